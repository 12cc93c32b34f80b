//! A mission under way, and the questions that its flow asks about the world.

use std::collections::BTreeSet;

use halcyon_model::{
    Activity, LandedState, LocalPoint, Mission, MissionId, MissionPhase, MissionSpec, SeaState, Slot, Stamp, Transition,
    VehicleId, VehicleState, VerdictState,
};

use super::fleet::Fleet;
use super::formation::Formations;
use super::geometry;
use super::record::Course;
use super::release::Request;
use super::waters::Waters;
use crate::config::Config;

/// A mission that waits says so again no sooner than this.
const NOTE_PERIOD_S: f64 = 10.0;

/// What is known at the moment of a step.
#[derive(Clone, Copy)]
pub(super) struct World<'a> {
    pub(super) config: &'a Config,
    pub(super) fleet: &'a Fleet,
    pub(super) formations: &'a Formations,
    pub(super) waters: &'a Waters,
    pub(super) now: Stamp,
}

/// A mission that is not final.
#[derive(Debug, Clone)]
pub(super) struct Live {
    pub(super) mission: Mission,
    pub(super) course: Course,
    /// When the present phase began; after a restart, when the planner came back.
    pub(super) entered: Stamp,
    /// Generation of the first plan that carried the present phase's tasks; what a vehicle says counts only once it has that.
    pub(super) task_generation: Option<u64>,
    /// Since when the verdict has been unsafe.
    pub(super) unsafe_since: Option<Stamp>,
    /// Followers that have already failed to join.
    pub(super) tried: BTreeSet<VehicleId>,
    /// Vehicles that this mission let go of in this step.
    pub(super) dropped: Vec<VehicleId>,
    /// It came out of the store, and nothing has happened since.
    pub(super) recovered: bool,
    /// Whether the last plan cleared the follower to descend.
    pub(super) was_cleared: bool,
    /// The request to let the payload go that was made in the present phase.
    pub(super) release: Option<Request>,
    /// Requests made so far, since the planner runs.
    pub(super) release_attempts: u32,
    /// What the mission last said it was waiting for, and when.
    pub(super) note: Option<(String, Stamp)>,
    /// What it waits for now.
    pub(super) waits_for: Option<String>,
}

impl Live {
    pub(super) fn new(id: MissionId, spec: MissionSpec, now: Stamp) -> Self {
        let mission = Mission {
            stamp: now,
            id,
            spec,
            phase: MissionPhase::Waiting,
            leader: None,
            follower: None,
            verdict: None,
            h_s_m: None,
            touchdown: None,
            release_problem: None,
            history: Vec::new(),
        };
        Self::with(mission, Course::default(), now)
    }

    pub(super) fn restored(mission: Mission, course: Course, now: Stamp) -> Self {
        Self { recovered: true, ..Self::with(mission, course, now) }
    }

    fn with(mission: Mission, course: Course, now: Stamp) -> Self {
        Self {
            mission,
            course,
            entered: now,
            task_generation: None,
            unsafe_since: None,
            tried: BTreeSet::new(),
            dropped: Vec::new(),
            recovered: false,
            was_cleared: false,
            release: None,
            release_attempts: 0,
            note: None,
            waits_for: None,
        }
    }

    /// Enters `phase`; the same phase again is a change of crew, or a restart of the planner.
    pub(super) fn enter(&mut self, phase: MissionPhase, who: &str, why: String, now: Stamp) -> Transition {
        self.course.reached_landing |= phase == MissionPhase::Landing;
        let transition = Transition { stamp: now, phase, who: who.to_owned(), why };
        self.mission.stamp = now;
        self.mission.phase = phase;
        self.mission.history.push(transition.clone());
        self.entered = now;
        self.task_generation = None;
        self.unsafe_since = None;
        self.release = None;
        self.note = None;
        transition
    }

    /// Whoever flies for it now.
    pub(super) fn crew(&self) -> impl Iterator<Item = &VehicleId> {
        self.mission.leader.iter().chain(&self.mission.follower)
    }

    pub(super) fn spot(&self) -> LocalPoint {
        self.mission.spec.point
    }

    /// The leader's heading over the spot, radians. It is always known once there is a leader.
    pub(super) fn heading_rad(&self) -> f64 {
        self.course.heading_rad.unwrap_or(0.0)
    }

    /// Where the leader clears the spot to.
    pub(super) fn stand_off(&self, config: &Config) -> LocalPoint {
        geometry::offset(self.spot(), self.heading_rad(), config.stand_off_m, 0.0)
    }

    pub(super) fn slot(&self, config: &Config) -> Slot {
        Slot { forward_m: config.slot_forward_m, right_m: self.course.abreast_m, up_m: config.slot_up_m }
    }

    /// What is known now about the water at the spot, measured since the leader settled over it.
    pub(super) fn sea<'a>(&self, world: &World<'a>) -> Option<&'a SeaState> {
        world.waters.at(self.spot(), self.course.station_since?, world.now, world.config)
    }

    /// The same, if it is safe.
    pub(super) fn safe_sea<'a>(&self, world: &World<'a>) -> Option<&'a SeaState> {
        self.sea(world).filter(|sea| sea.verdict.state == VerdictState::Safe)
    }

    /// A fresh state of a vehicle that already flies by the present phase's tasks.
    fn obedient<'a>(&self, vehicle: Option<&VehicleId>, world: &World<'a>) -> Option<&'a VehicleState> {
        let generation = self.task_generation?;
        world.fleet.fresh(vehicle?, world.now, world.config).filter(|state| state.plan_generation >= generation)
    }

    /// The leader's state, once it is settled at `place` by the present plan.
    pub(super) fn leader_settled_at<'a>(&self, place: LocalPoint, world: &World<'a>) -> Option<&'a VehicleState> {
        self.obedient(self.mission.leader.as_ref(), world).filter(|state| {
            state.activity == Activity::Holding { settled: true }
                && LocalPoint::from(state.position_ned_m).distance_m(&place) <= world.config.station_radius_m
        })
    }

    /// Whether the follower is settled in its slot by the present plan.
    pub(super) fn follower_settled(&self, world: &World<'_>) -> bool {
        self.obedient(self.mission.follower.as_ref(), world)
            .is_some_and(|state| matches!(state.activity, Activity::Following { settled: true, .. }))
    }

    /// The follower's state, once it says that its landing is over. It may have landed while the planner was away.
    pub(super) fn follower_landed<'a>(&self, world: &World<'a>) -> Option<&'a VehicleState> {
        let follower = self.mission.follower.as_ref();
        let state =
            if self.recovered { world.fleet.fresh(follower?, world.now, world.config) } else { self.obedient(follower, world) };
        state.filter(|state| state.activity == Activity::Landed && state.landed == LandedState::OnGround)
    }

    /// Keeps the time since when the leader has been over the spot. A leader that left it must be there anew.
    pub(super) fn keep_station(&mut self, world: &World<'_>) {
        let Some(leader) = &self.mission.leader else { return };
        let Some(state) = world.fleet.fresh(leader, world.now, world.config) else { return };
        let there = LocalPoint::from(state.position_ned_m).distance_m(&self.spot()) <= world.config.station_radius_m
            && matches!(state.activity, Activity::Holding { .. });
        if !there {
            self.course.station_since = None;
        } else if self.course.station_since.is_none()
            && let Some(settled) = self.leader_settled_at(self.spot(), world)
        {
            self.on_station(settled.stamp, world.config);
        }
    }

    /// The leader said at `stamp` that it has settled over the spot.
    pub(super) fn on_station(&mut self, stamp: Stamp, config: &Config) {
        self.course.station_since = Some(stamp.plus_secs_f64(-config.settling_s));
        self.course.first_on_station.get_or_insert(stamp);
    }

    /// Notes what the mission waits for; [`Self::fresh_note`] then says it, unless `wanted` is false.
    pub(super) fn wait_for(&mut self, what: String, wanted: bool) {
        if wanted {
            self.waits_for = Some(what);
        }
    }

    /// What it waits for, if that changed and was not said just before.
    pub(super) fn fresh_note(&mut self, now: Stamp) -> Option<String> {
        let what = self.waits_for.take()?;
        let again = match &self.note {
            None => true,
            Some((said, at)) => *said != what && now.seconds_since(*at) >= NOTE_PERIOD_S,
        };
        again.then(|| {
            self.note = Some((what.clone(), now));
            what
        })
    }
}
