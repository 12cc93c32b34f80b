//! Judges a simulated fleet from outside: what the simulator knows to be true, against what the fleet measured and did.
//!
//! [`Witness`] is pure; [`watch`] feeds it from the bus.

mod formation;

use std::collections::BTreeMap;
use std::time::Duration;

use halcyon_chassis::{Bus, Clock, topics};
use halcyon_model::{
    Activity, DispatchPlan, Event, Mission, MissionId, MissionPhase, Severity, SimTruth, Stamp, Task, VehicleId, VehicleState,
};
use serde::Serialize;

use formation::Formation;

/// Events kept for the report.
const EVENTS_MAX: usize = 1000;

/// What `halcyon up --once --json` prints.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The mission's last phase, or `timeout` or `interrupted`.
    pub outcome: String,
    /// Why, in the words of the mission's last transition.
    pub reason: String,
    /// Seed of the simulation.
    pub seed: u64,
    /// True and measured water.
    pub sea: SeaReport,
    /// The newest verdict: `safe`, `unsafe`, `inconclusive`, or null.
    pub verdict: Option<&'static str>,
    /// True horizontal distance between where the follower came down and the spot, metres; null if it did not land.
    pub touchdown_error_m: Option<f64>,
    /// How well the formation was kept, by the simulator's truth.
    pub formation: FormationReport,
    /// Length of the mission, seconds of fleet time.
    pub mission_s: f64,
    /// Every transition of the mission.
    pub history: Vec<Step>,
    /// What happened.
    pub events: Vec<Step>,
}

/// The water.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SeaReport {
    /// Significant wave height of the simulated water, exactly, metres.
    pub true_h_s_m: f64,
    /// Measured significant wave height on which the dispatch was decided, metres.
    pub h_s_m: Option<f64>,
    /// Its lower 95 % bound.
    pub h_s_m_low: Option<f64>,
    /// Its upper 95 % bound.
    pub h_s_m_high: Option<f64>,
}

/// The formation, from the first time that the follower had settled in its slot until it left for the spot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FormationReport {
    /// Root mean square error of the horizontal distance to the leader, metres.
    pub range_rms_m: Option<f64>,
    /// Root mean square horizontal distance from the slot, metres.
    pub slot_rms_m: Option<f64>,
    /// Root mean square height error relative to the slot, metres.
    pub altitude_rms_m: Option<f64>,
    /// Least distance between any two vehicles in the air, over the whole run, metres; null if there were never two.
    pub least_separation_m: Option<f64>,
    /// Seconds that the first three rest on.
    pub seconds: f64,
}

/// One thing that happened.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Step {
    /// Since the witness began, seconds of fleet time.
    pub t_s: f64,
    /// Phase or severity.
    pub kind: &'static str,
    /// Who.
    pub who: String,
    /// What, and why.
    pub text: String,
}

/// The witness of one mission.
#[derive(Debug)]
pub struct Witness {
    began: Stamp,
    mission_id: MissionId,
    mission: Option<Mission>,
    truth: BTreeMap<VehicleId, SimTruth>,
    formation: Formation,
    events: Vec<Step>,
}

impl Witness {
    /// A witness of the mission with this id.
    #[must_use]
    pub fn new(mission_id: MissionId, began: Stamp) -> Self {
        Self { began, mission_id, mission: None, truth: BTreeMap::new(), formation: Formation::default(), events: Vec::new() }
    }

    /// A vehicle's true state.
    pub fn observe_truth(&mut self, truth: SimTruth) {
        self.formation.observe_truth(&truth, &self.truth);
        self.truth.insert(truth.vehicle.clone(), truth);
    }

    /// What a vehicle says of itself.
    pub fn observe_state(&mut self, state: &VehicleState) {
        let settled = match state.activity {
            Activity::Following { settled, .. } => Some(settled),
            _ => None,
        };
        self.formation.observe_activity(&state.vehicle, settled);
    }

    /// The plan: says who is to follow whom, and where.
    pub fn observe_plan(&mut self, plan: &DispatchPlan) {
        for assignment in &plan.assignments {
            let follows = match &assignment.task {
                Task::Follow { leader, slot } => Some((leader.clone(), *slot)),
                _ => None,
            };
            self.formation.observe_task(&assignment.vehicle, follows);
        }
    }

    /// The mission. Returns whether it has ended.
    pub fn observe_mission(&mut self, mission: Mission) -> bool {
        if mission.id != self.mission_id {
            return false;
        }
        let ended = mission.phase.is_final();
        self.mission = Some(mission);
        ended
    }

    /// An event; the oldest are kept, and the last is replaced by the newest when there are too many.
    pub fn observe_event(&mut self, event: &Event) {
        let kind = match event.severity {
            Severity::Info => "info",
            Severity::Warning => "warning",
            Severity::Critical => "critical",
        };
        self.events.truncate(EVENTS_MAX - 1);
        self.events.push(Step {
            t_s: event.stamp.seconds_since(self.began),
            kind,
            who: event.source.to_string(),
            text: join(&event.what, &event.why),
        });
    }

    /// The phase, as far as it is known.
    #[must_use]
    pub fn phase(&self) -> Option<MissionPhase> {
        self.mission.as_ref().map(|mission| mission.phase)
    }

    /// The report. `ended_by` names what ended the run, if it was not the mission.
    #[must_use]
    pub fn report(&self, seed: u64, true_h_s_m: f64, ended_by: Option<&str>) -> Report {
        let mission = self.mission.as_ref();
        let last = mission.and_then(|mission| mission.history.last());
        let phase = mission.map_or("not_created", |mission| mission.phase.as_str());
        let h_s_m = mission.and_then(|mission| mission.h_s_m);
        let first = mission.and_then(|mission| mission.history.first());
        Report {
            outcome: ended_by.unwrap_or(phase).to_owned(),
            reason: last.map(|last| last.why.clone()).unwrap_or_default(),
            seed,
            sea: SeaReport {
                true_h_s_m,
                h_s_m: h_s_m.map(|h_s_m| h_s_m.value),
                h_s_m_low: h_s_m.map(|h_s_m| h_s_m.low),
                h_s_m_high: h_s_m.map(|h_s_m| h_s_m.high),
            },
            verdict: mission.and_then(|mission| mission.verdict).map(halcyon_model::VerdictState::as_str),
            touchdown_error_m: self.touchdown_error_m(),
            formation: self.formation.report(),
            mission_s: first.zip(last).map_or(0.0, |(first, last)| last.stamp.seconds_since(first.stamp)),
            history: mission.map(|mission| mission.history.iter().map(|step| self.step(step)).collect()).unwrap_or_default(),
            events: self.events.clone(),
        }
    }

    fn step(&self, transition: &halcyon_model::Transition) -> Step {
        Step {
            t_s: transition.stamp.seconds_since(self.began),
            kind: transition.phase.as_str(),
            who: transition.who.clone(),
            text: transition.why.clone(),
        }
    }

    /// From the truth, not from what the follower believes.
    fn touchdown_error_m(&self) -> Option<f64> {
        let mission = self.mission.as_ref().filter(|mission| mission.phase == MissionPhase::Completed)?;
        let follower = self.truth.get(mission.follower.as_ref()?).filter(|truth| truth.landed)?;
        Some(halcyon_model::LocalPoint::from(follower.position_ned_m).distance_m(&mission.spec.point))
    }
}

fn join(what: &str, why: &str) -> String {
    if why.is_empty() { what.to_owned() } else { format!("{what}: {why}") }
}

/// Feeds a witness from the bus until its mission has ended, or `limit` of fleet time has passed. `tell` hears of each phase.
///
/// Returns the witness, and `timeout` if that is what ended it.
///
/// # Errors
/// If the bus fails.
pub async fn watch(
    bus: &Bus,
    clock: &Clock,
    mut witness: Witness,
    limit: Duration,
    mut tell: impl FnMut(MissionPhase),
) -> anyhow::Result<(Witness, Option<&'static str>)> {
    let mut truths = bus.subscribe(&topics::sim_truths()).await?;
    let mut states = bus.subscribe(&topics::vehicle_states()).await?;
    let mut plans = bus.subscribe(&topics::plan()).await?;
    let mut missions = bus.subscribe(&topics::missions()).await?;
    let mut events = bus.subscribe(&topics::event()).await?;
    let mut end = clock.now() + limit;
    let mut ended_by = Some("timeout");
    loop {
        tokio::select! {
            truth = truths.recv() => witness.observe_truth(truth?),
            state = states.recv() => witness.observe_state(&state?),
            plan = plans.recv() => witness.observe_plan(&plan?),
            event = events.recv() => witness.observe_event(&event?),
            mission = missions.recv() => {
                if witness.observe_mission(mission?) && ended_by.is_some() {
                    // The last truths and events are still on their way.
                    end = clock.now() + Duration::from_millis(500);
                    ended_by = None;
                }
                if let Some(phase) = witness.phase() {
                    tell(phase);
                }
            }
            () = clock.sleep_until(end) => return Ok((witness, ended_by)),
        }
    }
}
