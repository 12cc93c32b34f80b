//! A leader and its followers, up to nine, through radio that loses and delays, gusts, receivers that jump, and each other.
//!
//! Every vehicle is flown by the executor that flies real ones; the vehicles themselves are points with an autopilot's cascade,
//! with gains and lags of their own that guidance doesn't know. Contact is judged by the truth, fifty times a second.

mod air;
mod craft;
mod scene;

pub use scene::{Formation, Lead, SwarmScenario, Trouble};

use halcyon_model::{Activity, Assignment, DispatchPlan, FlightMode, LocalPoint, Slot, Stamp, Task, VehicleId, VehicleState};
use nalgebra::Vector3;

use super::chance::Chance;
use crate::core::executor::{Executor, ExecutorConfig, Output};
use crate::core::guidance::Guidance;
use crate::core::law::offset_ned_m;
use crate::core::limits::{FailSafeLimits, Limits};
use crate::core::payload::Payload;
use air::{Air, Message};
use craft::{Craft, frame};
use scene::Pilot;

/// The truth moves on in steps of this, nanoseconds; guidance is stepped and states are said every fifth, each vehicle at its own.
const TICK_NS: i64 = 20_000_000;
const TICKS_A_PERIOD: usize = 5;
const TICK_S: f64 = 0.02;
/// Plans are renewed this often, seconds.
const PLAN_S: f64 = 1.0;
/// The followers settle in for so long before anything happens, seconds.
const SETTLE_S: f64 = 10.0;
/// Something happens this often, seconds.
const TROUBLE_S: f64 = 15.0;
/// All fly at this height, metres.
const HEIGHT_M: f64 = 8.0;

/// How near they came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwarmReport {
    /// Least true distance between any two, metres.
    pub least_m: f64,
    /// How often an autopilot was thought not to follow its targets, which all of these do.
    pub unheeded: u32,
    /// Root mean square of the followers' true horizontal distances from their slots while all was well, metres; `NaN` if it never
    /// was.
    pub slot_rms_m: f64,
    /// How many settled samples that is of, as a fraction of all.
    pub settled_fraction: f64,
}

struct Swarm {
    scenario: SwarmScenario,
    crafts: Vec<Craft>,
    executors: Vec<Executor>,
    slots: Vec<Slot>,
    pilot: Pilot,
    air: Air,
    chance: Chance,
    /// Whose radio is dead, and until when.
    silent: Option<(usize, Stamp)>,
    /// Whose receiver has jumped, and until when.
    jumped: Option<(usize, Stamp)>,
    generation: u64,
    /// Slots have changed, and are not judged for so long, seconds.
    settling_s: f64,
    leader_goal: Vector3<f64>,
    next_goal: Option<Stamp>,
    stranger_goal: Vector3<f64>,
    least_m: f64,
    unheeded: u32,
    slot_m2: f64,
    settled: u64,
    samples: u64,
}

/// Flies it. The same scenario gives the same report; `None` if it names vehicles that can't be.
#[must_use]
pub fn fly(scenario: &SwarmScenario) -> Option<SwarmReport> {
    let begin = Stamp::from_secs_f64(1_760_000_000.0);
    let mut swarm = Swarm::new(scenario)?;
    let ticks = ((SETTLE_S + scenario.duration_s) / TICK_S) as usize;
    let mut next_trouble_s = SETTLE_S;
    let mut next_plan_s = 0.0;
    for tick in 0..ticks {
        let now = Stamp::from_nanos(begin.as_nanos() + TICK_NS * tick as i64);
        let flown_s = TICK_S * tick as f64;
        if flown_s >= next_trouble_s {
            next_trouble_s += TROUBLE_S;
            swarm.trouble(now);
            next_plan_s = flown_s;
        }
        if flown_s >= SETTLE_S && swarm.next_goal.is_none_or(|at| now >= at) {
            swarm.send_leader_on(now);
            next_plan_s = flown_s;
        }
        if flown_s >= next_plan_s {
            next_plan_s = flown_s + PLAN_S;
            swarm.publish_plan(now);
        }
        swarm.recover(now);
        swarm.hear(now);
        for index in 0..swarm.crafts.len() {
            if tick % TICKS_A_PERIOD == index % TICKS_A_PERIOD {
                swarm.guide(index, now);
            }
        }
        swarm.move_on(flown_s);
        if flown_s > 1.0 {
            swarm.judge();
        }
    }
    Some(SwarmReport {
        least_m: swarm.least_m,
        unheeded: swarm.unheeded,
        slot_rms_m: (swarm.slot_m2 / swarm.settled as f64).sqrt(),
        settled_fraction: swarm.settled as f64 / swarm.samples.max(1) as f64,
    })
}

impl Swarm {
    fn new(scenario: &SwarmScenario) -> Option<Self> {
        let mut chance = Chance::new(scenario.seed);
        let slots = scenario.slots();
        let level = Vector3::new(0.0, 0.0, -HEIGHT_M);
        let mut places = vec![("leader-1".to_owned(), level)];
        let follower = |(index, slot): (usize, &Slot)| (format!("follower-{}", index + 1), level + offset_ned_m(slot, 0.0));
        places.extend(slots.iter().enumerate().map(follower));
        if scenario.trouble == Trouble::Passing {
            places.push(("stranger-1".to_owned(), Vector3::new(90.0, 0.0, -HEIGHT_M)));
        }
        let mut limits = Limits::default();
        if !scenario.separation {
            (limits.separation_m_min, limits.separation_margin_m, limits.separation_parked_m) = (0.1, 0.0, 0.1);
        }
        let mut crafts = Vec::new();
        let mut executors = Vec::new();
        for (name, position_m) in places {
            let id = VehicleId::new(&name).ok()?;
            let airframe = scenario.airframe(&mut chance);
            crafts.push(Craft::new(id.clone(), position_m, airframe, chance.fork()));
            executors.push(Executor::new(ExecutorConfig {
                vehicle: id,
                limits: limits.clone(),
                fail_safe: FailSafeLimits::default(),
                guidance: Guidance::default(),
                home_height_m: 0.0,
                payload: Payload::default(),
                frame: frame(),
            }));
        }
        if let Some(leader) = crafts.first_mut().filter(|_| scenario.lead == Lead::Pilot) {
            leader.mode = FlightMode::Loiter;
        }
        Some(Self {
            pilot: Pilot::new(scenario, chance.fork()),
            air: Air::new(scenario.delay_s, scenario.loss, chance.fork()),
            scenario: scenario.clone(),
            crafts,
            executors,
            slots,
            chance,
            silent: None,
            jumped: None,
            generation: 0,
            settling_s: 0.0,
            leader_goal: level,
            next_goal: None,
            stranger_goal: Vector3::new(90.0, 0.0, -HEIGHT_M),
            least_m: f64::INFINITY,
            unheeded: 0,
            slot_m2: 0.0,
            settled: 0,
            samples: 0,
        })
    }

    fn follower(&mut self) -> usize {
        1 + self.chance.below(self.scenario.followers)
    }

    fn trouble(&mut self, now: Stamp) {
        match self.scenario.trouble {
            Trouble::None => {}
            Trouble::SlotChanges => {
                let (a, b) = (self.follower() - 1, self.follower() - 1);
                self.slots.swap(a, b);
                self.settling_s = SETTLE_S;
            }
            Trouble::Passing => {
                // Through the leader's place, to the other side of it.
                let Some(leader_m) = self.crafts.first().map(|craft| craft.position_m) else { return };
                let Some(stranger_m) = self.crafts.last().map(|craft| craft.position_m) else { return };
                let aside_m = Vector3::new(self.chance.between(-30.0, 30.0), self.chance.between(-30.0, 30.0), 0.0);
                let through_m = leader_m + aside_m - stranger_m;
                let way_m = Vector3::new(through_m.x, through_m.y, 0.0);
                self.stranger_goal = leader_m + aside_m + way_m / way_m.norm().max(1.0) * 70.0;
            }
            Trouble::GnssJump { jump_m, for_s } => {
                let (index, course_rad) = (self.follower(), self.chance.between(0.0, std::f64::consts::TAU));
                if let Some(craft) = self.crafts.get_mut(index) {
                    craft.jump_m = Vector3::new(course_rad.cos(), course_rad.sin(), 0.0) * jump_m;
                    self.jumped = Some((index, now.plus_secs_f64(for_s)));
                }
            }
            Trouble::Silence { for_s } => {
                // The leader's silence is worth the same as any other's.
                let index = self.chance.below(self.scenario.followers + 1);
                self.silent = Some((index, now.plus_secs_f64(for_s)));
            }
        }
    }

    /// To somewhere else, often before it has arrived.
    fn send_leader_on(&mut self, now: Stamp) {
        self.next_goal = Some(now.plus_secs_f64(self.chance.between(4.0, 15.0)));
        let (north_m, east_m) = (self.chance.between(-40.0, 40.0), self.chance.between(-40.0, 40.0));
        self.leader_goal = Vector3::new(north_m, east_m, -HEIGHT_M);
    }

    fn recover(&mut self, now: Stamp) {
        self.silent = self.silent.filter(|(_, until)| now < *until);
        if let Some((index, _)) = self.jumped.filter(|(_, until)| now >= *until) {
            self.jumped = None;
            if let Some(craft) = self.crafts.get_mut(index) {
                craft.jump_m = Vector3::zeros();
            }
        }
    }

    fn is_silent(&self, index: usize) -> bool {
        self.silent.is_some_and(|(silent, _)| silent == index)
    }

    fn publish_plan(&mut self, now: Stamp) {
        let Some(leader) = self.crafts.first().map(|craft| craft.id.clone()) else { return };
        self.generation += 1;
        let mut assignments = Vec::new();
        for (craft, slot) in self.crafts.iter().skip(1).zip(&self.slots) {
            let task = Task::Follow { leader: leader.clone(), slot: *slot };
            assignments.push(Assignment { vehicle: craft.id.clone(), task });
        }
        if let Some(stranger) = self.crafts.get(1 + self.slots.len()) {
            let point = LocalPoint::from(self.stranger_goal);
            let task = Task::Survey { point, height_m: HEIGHT_M, heading_rad: None };
            assignments.push(Assignment { vehicle: stranger.id.clone(), task });
        }
        if self.scenario.lead != Lead::Pilot {
            let point = LocalPoint::from(self.leader_goal);
            let task = Task::Survey { point, height_m: HEIGHT_M, heading_rad: Some(0.0) };
            assignments.push(Assignment { vehicle: leader, task });
        }
        let plan = DispatchPlan {
            stamp: now,
            generation: self.generation,
            mission: None,
            valid_until: now.plus_secs_f64(10.0),
            assignments,
        };
        for index in 0..self.crafts.len() {
            self.air.send(index, Message::Plan(plan.clone()), now);
        }
    }

    fn hear(&mut self, now: Stamp) {
        let arrived: Vec<_> = self.air.receive(now).collect();
        for (index, message) in arrived {
            if self.is_silent(index) {
                continue;
            }
            let Some(executor) = self.executors.get_mut(index) else { continue };
            match message {
                Message::State(state) => executor.observe_neighbour(*state, now),
                Message::Plan(plan) => drop(executor.observe_plan(&plan, now)),
            }
        }
    }

    /// One vehicle's own computer: hears its autopilot, guides, and says where it is.
    fn guide(&mut self, index: usize, now: Stamp) {
        let silent = self.is_silent(index);
        let (Some(craft), Some(executor)) = (self.crafts.get_mut(index), self.executors.get_mut(index)) else { return };
        let mut state: VehicleState = craft.state(now);
        executor.complete(&mut state);
        executor.observe_self(state.clone(), now, now);
        for output in executor.step(now) {
            match output {
                Output::Setpoint(setpoint) => craft.setpoint = Some(setpoint),
                Output::Note(note) if note.why.contains("does not follow its targets") => self.unheeded += 1,
                _ => {}
            }
        }
        executor.complete(&mut state);
        if self.scenario.lead == Lead::GuidedSilently {
            state.intent = None;
        }
        if !silent {
            for other in (0..self.crafts.len()).filter(|other| *other != index) {
                self.air.send(other, Message::State(Box::new(state.clone())), now);
            }
        }
    }

    fn move_on(&mut self, flown_s: f64) {
        for (index, craft) in self.crafts.iter_mut().enumerate() {
            if index > 0 || self.scenario.lead != Lead::Pilot {
                craft.step(TICK_S);
                continue;
            }
            let (velocity_mps, turn_radps) =
                if flown_s < SETTLE_S { (Vector3::zeros(), 0.0) } else { self.pilot.sticks(craft.position_m, TICK_S) };
            craft.steer(velocity_mps, turn_radps, TICK_S);
        }
    }

    fn judge(&mut self) {
        for (index, one) in self.crafts.iter().enumerate() {
            for other in self.crafts.iter().skip(index + 1) {
                self.least_m = self.least_m.min((one.position_m - other.position_m).norm());
            }
        }
        if self.settling_s > 0.0 {
            self.settling_s -= TICK_S;
            return;
        }
        let Some(leader) = self.crafts.first() else { return };
        for ((craft, executor), slot) in self.crafts.iter().zip(&self.executors).skip(1).zip(&self.slots) {
            self.samples += 1;
            if matches!(executor.activity(), Activity::Following { settled: true, .. }) {
                let miss_m = leader.position_m + offset_ned_m(slot, leader.heading_rad) - craft.position_m;
                self.slot_m2 += miss_m.xy().norm_squared();
                self.settled += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests;
