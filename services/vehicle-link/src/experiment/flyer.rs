//! The two vehicles, each a simulated copter with its vehicle-link.

use halcyon_model::{
    Activity, Assignment, DispatchPlan, FleetOrigin, Geodetic, SimTruth, Slot, Stamp, Task, VehicleId, VehicleState,
};
use halcyon_sim::autopilot::{Inbound, LinkId, Outbound};
use halcyon_sim::vehicle::Vehicle;
use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::MavMessage;

use super::pilot::Pilot;
use super::scene::Scenario;
use crate::autopilot::Autopilot;
use crate::config::Config;
use crate::core::commands::{Command, Effect};
use crate::core::executor::{Executor, ExecutorConfig, Output};
use crate::core::limits::Limits;

const LINK: LinkId = LinkId(1);
/// The plan is renewed this often, seconds.
const PLAN_S: f64 = 1.0;

/// A simulated copter and the picture that its vehicle-link has of it.
pub(super) struct Craft {
    pub(super) vehicle: Vehicle,
    pub(super) link: Autopilot,
    pub(super) heard_state: bool,
}

impl Craft {
    fn new(scenario: &Scenario, index: usize, now: Stamp) -> Result<(Self, Config), String> {
        let sim = scenario.sim()?;
        let origin = FleetOrigin(Geodetic::from_deg(53.1, -2.9, 40.0));
        let mut vehicle = Vehicle::new(&sim, index, origin, now).ok_or("no such vehicle")?;
        vehicle.attach(LINK);
        let config = Config { vehicle: vehicle.id().to_string(), ..Config::default() };
        let link = Autopilot::new(&config, origin, now).map_err(|error| error.to_string())?;
        Ok((Self { vehicle, link, heard_state: false }, config))
    }

    /// Simulates up to `now` and hears what it says.
    fn advance(&mut self, now: Stamp) {
        self.vehicle.advance(now, &|_, _| 0.0);
        let header = MavHeader { system_id: self.vehicle.autopilot().system_id().into(), component_id: 1, sequence: 0 };
        let said: Vec<MavMessage> = self
            .vehicle
            .take_outbox()
            .filter_map(|(_, outbound)| match outbound {
                Outbound::Message(message) => Some(message),
                Outbound::Acknowledgement(_) => None,
            })
            .collect();
        for message in said {
            self.heard_state |= self.link.observe(header, &message, now).state;
        }
    }

    pub(super) fn say(&mut self, message: MavMessage) {
        self.vehicle.handle(LINK, &Inbound::Message(self.link.header(), message));
    }

    /// Sends what the command protocol has due; returns what ended.
    fn exchange(&mut self, now: Stamp) -> Vec<Effect> {
        let mut ended = Vec::new();
        for effect in self.link.poll(now) {
            match effect {
                Effect::Send(message) => self.say(message),
                done => ended.push(done),
            }
        }
        ended
    }

    pub(super) fn system_id(&self) -> u8 {
        self.vehicle.autopilot().system_id()
    }
}

/// What there is to know about a vehicle at a moment: the truth, and what it reports.
pub(super) struct Sighting {
    pub(super) truth: SimTruth,
    pub(super) reported: Option<VehicleState>,
}

impl Sighting {
    pub(super) fn of(craft: &Craft, now: Stamp) -> Self {
        let mut reported = craft.link.state(now).map(|(state, _)| state);
        if let Some(state) = &mut reported {
            // Both vehicles' reports at the same moment.
            state.position_ned_m += state.velocity_ned_mps * now.seconds_since(state.stamp);
        }
        Self { truth: craft.vehicle.truth(), reported }
    }
}

/// The leader, under a pilot's hands.
pub(super) struct Leader {
    craft: Craft,
    pilot: Pilot,
    shares_intent: bool,
}

impl Leader {
    pub(super) fn new(scenario: &Scenario, now: Stamp) -> Result<Self, String> {
        let (craft, _) = Craft::new(scenario, 0, now)?;
        Ok(Self { craft, pilot: Pilot::new(scenario.flight), shares_intent: scenario.shares_intent })
    }

    pub(super) fn craft(&self) -> &Craft {
        &self.craft
    }

    pub(super) fn advance(&mut self, now: Stamp) {
        self.craft.advance(now);
    }

    pub(super) fn state(&self, now: Stamp) -> Option<VehicleState> {
        let (mut state, _) = self.craft.link.state(now)?;
        state.intent = self.pilot.intent().filter(|_| self.shares_intent);
        Some(state)
    }

    pub(super) fn airborne(&self) -> bool {
        self.pilot.is_up()
    }

    /// `flown_s`: since the figures began to be taken, or before that if negative or none.
    pub(super) fn pilot(&mut self, now: Stamp, flown_s: Option<f64>) {
        self.craft.exchange(now);
        self.pilot.step(&mut self.craft, flown_s.unwrap_or(-1.0), now);
    }
}

/// The follower, flown by the code under test.
pub(super) struct Follower {
    craft: Craft,
    executor: Executor,
    id: VehicleId,
    slot: Slot,
    generation: u64,
    planned: Option<Stamp>,
    setpoints: u64,
}

impl Follower {
    pub(super) fn new(scenario: &Scenario, now: Stamp) -> Result<Self, String> {
        let (mut craft, config) = Craft::new(scenario, 1, now)?;
        let id = craft.vehicle.id().clone();
        let mut limits = Limits::default();
        if !scenario.separation {
            (limits.separation_m_min, limits.separation_margin_m, limits.separation_parked_m) = (0.1, 0.0, 0.1);
        }
        let executor = Executor::new(ExecutorConfig {
            vehicle: id.clone(),
            limits,
            fail_safe: config.fail_safe,
            guidance: crate::core::guidance::Guidance { law: scenario.law, slot_lock: scenario.slot_lock, ..config.guidance },
            payload: config.payload,
            home_height_m: config.home_height_m,
            frame: FleetOrigin(Geodetic::from_deg(53.1, -2.9, 40.0)).frame(),
        });
        for (name, value) in [
            ("PSC_POSXY_P", 1.0),
            ("PSC_VELXY_P", 2.0),
            ("PSC_POSZ_P", 1.0),
            ("PSC_VELZ_P", 5.0),
            ("ATC_ANG_RLL_P", 4.5),
            ("ATC_ANG_PIT_P", 4.5),
        ] {
            craft.vehicle.handle(
                LINK,
                &Inbound::Message(
                    MavHeader { system_id: 255, component_id: 190, sequence: 0 },
                    MavMessage::PARAM_SET(ardu::PARAM_SET_DATA {
                        param_value: (value * scenario.gain_scale) as f32,
                        target_system: craft.system_id(),
                        target_component: 1,
                        param_id: name.into(),
                        param_type: ardu::MavParamType::MAV_PARAM_TYPE_REAL32,
                    }),
                ),
            );
        }
        let slot = Slot { forward_m: 0.0, right_m: scenario.slot_m, up_m: 0.0 };
        Ok(Self { craft, executor, id, slot, generation: 0, planned: None, setpoints: 0 })
    }

    pub(super) fn craft(&self) -> &Craft {
        &self.craft
    }

    pub(super) fn setpoints(&self) -> u64 {
        self.setpoints
    }

    pub(super) fn advance(&mut self, now: Stamp) {
        self.craft.advance(now);
        if std::mem::take(&mut self.craft.heard_state)
            && let Some((state, mode_heard)) = self.craft.link.state(now)
        {
            self.executor.observe_self(state, mode_heard, now);
        }
    }

    pub(super) fn hear(&mut self, state: VehicleState, now: Stamp) {
        self.executor.observe_neighbour(state, now);
    }

    /// One guidance step; with a plan to follow once there is somebody to follow.
    pub(super) fn step(&mut self, leader_is_up: bool, now: Stamp) {
        if leader_is_up && self.planned.is_none_or(|at| now.seconds_since(at) >= PLAN_S) {
            self.planned = Some(now);
            self.generation += 1;
            if let Ok(leader) = VehicleId::new("leader-1") {
                let task = Task::Follow { leader, slot: self.slot };
                let plan = DispatchPlan {
                    stamp: now,
                    generation: self.generation,
                    mission: None,
                    valid_until: now.plus_secs_f64(5.0),
                    assignments: vec![Assignment { vehicle: self.id.clone(), task }],
                };
                self.executor.observe_plan(&plan, now);
            }
        }
        for output in self.executor.step(now) {
            match output {
                Output::Setpoint(setpoint) => {
                    if let Some(message) = self.craft.link.setpoint(&setpoint, now) {
                        self.craft.say(message);
                        self.setpoints += 1;
                    }
                }
                Output::Request(command) => {
                    if let Err(error) = self.craft.link.submit(0, command) {
                        self.executor.observe_outcome(&command, &Err(error), now);
                    }
                }
                Output::Withdraw => drop(self.craft.link.withdraw(now)),
                Output::AskStreams => self.craft.link.started_again(),
                Output::Note(_) => {}
            }
        }
        for effect in self.craft.exchange(now) {
            if let Effect::Done(_, command, outcome) = effect
                && !matches!(command, Command::SetInterval(_))
            {
                self.executor.observe_outcome(&command, &outcome, now);
            }
        }
    }

    pub(super) fn settled(&self) -> bool {
        // A law that lags or swings may never settle by the executor's measure; being in the slot's neighbourhood is enough.
        matches!(self.executor.activity(), Activity::Following { slot_error_m, .. } if *slot_error_m < 1.0)
    }

    pub(super) fn describe(&self) -> String {
        format!("the follower is {:?}: {}", self.executor.activity(), self.executor.detail())
    }
}
