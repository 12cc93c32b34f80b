//! The planner: everything known in, the plan, the missions and what to store out.

use std::collections::{BTreeMap, BTreeSet};

use halcyon_model::{
    DispatchPlan, FormationSpec, LandedState, Mission, MissionId, MissionPhase, MissionSpec, SeaState, Severity, Stamp,
    VehicleId, VehicleState,
};

use super::fleet::{Fleet, Ignored};
use super::flow;
use super::formation::{self, Formation, Formations};
use super::homing::Homings;
use super::live::{Live, World};
use super::record::{Effects, Notice, Record, Saved};
use super::release;
use super::tasks;
use super::waters::Waters;
use crate::config::Config;

/// Generations that one line of the store covers: about ten minutes of plans.
const GENERATIONS_RESERVED: u64 = 1000;
/// A vehicle that claims a greater generation is not believed; the planner could never get past it.
const GENERATION_MAX: u64 = 1 << 60;
/// Transitions that a mission may go through at one moment: as many as there are phases.
const STEPS_MAX: usize = 13;
/// Missions that are announced again after a restart, besides those under way.
const ANNOUNCED_MAX: usize = 200;
/// Who the planner is in a mission's history.
pub const PLANNER: &str = "planner";

/// All missions, and the plan that serves them.
///
/// Deterministic: the same calls with the same stamps give the same effects.
#[derive(Debug)]
pub struct Planner {
    pub(super) config: Config,
    pub(super) fleet: Fleet,
    waters: Waters,
    /// Missions under way, in the order in which they were created.
    pub(super) live: Vec<Live>,
    /// What became of the others.
    pub(super) finished: BTreeMap<MissionId, (MissionSpec, MissionPhase)>,
    homings: Homings,
    pub(super) formations: Formations,
    generation: u64,
    generation_reserved: u64,
    issued: Option<DispatchPlan>,
}

impl Planner {
    /// Goes on from what the store holds, which may be nothing. Missions under way resume in their phase; if their vehicles do
    /// not agree with it, the flow takes them back or ends them.
    pub fn restore(config: Config, saved: Saved, now: Stamp) -> (Self, Effects) {
        let mut planner = Self {
            fleet: Fleet::new(now),
            waters: Waters::default(),
            live: Vec::new(),
            finished: BTreeMap::new(),
            homings: Homings::default(),
            formations: Formations::restored(saved.formations),
            generation: saved.generation,
            generation_reserved: saved.generation,
            issued: None,
            config,
        };
        let mut effects = Effects::default();
        let quiet = saved.missions.len().saturating_sub(ANNOUNCED_MAX);
        for (index, saved) in saved.missions.into_iter().enumerate() {
            let mission = saved.mission;
            if mission.phase.is_final() {
                if index >= quiet {
                    announce(&mission, &mut effects);
                }
                for vehicle in saved.crew {
                    let rests = mission.touchdown.is_some() && mission.follower.as_ref() == Some(&vehicle);
                    planner.homings.add(vehicle, Some(mission.id.clone()), rests, now);
                }
                planner.finished.insert(mission.id, (mission.spec, mission.phase));
            } else {
                let mut live = Live::restored(mission, saved.course, now);
                for vehicle in saved.crew.into_iter().filter(|vehicle| !live.crew().any(|mine| mine == vehicle)) {
                    planner.homings.add(vehicle, Some(live.mission.id.clone()), false, now);
                }
                let phase = live.mission.phase;
                enter(&mut live, (phase, "the planner was restarted".into()), PLANNER, now, &mut effects);
                live.recovered = true;
                planner.live.push(live);
            }
        }
        (planner, effects)
    }

    /// Takes in a vehicle's state.
    ///
    /// # Errors
    /// [`Ignored`] if it says nothing new or nothing credible.
    pub fn observe_vehicle(&mut self, state: VehicleState, now: Stamp) -> Result<(), Ignored> {
        let seen = state.plan_generation;
        self.fleet.observe(state, now, &self.config)?;
        // A store that was lost or is a new one would make vehicles refuse every plan.
        if seen > self.generation && seen < GENERATION_MAX {
            self.generation = seen;
        }
        Ok(())
    }

    /// Takes in a sea state.
    ///
    /// # Errors
    /// [`Ignored`] if it says nothing new or nothing credible.
    pub fn observe_sea(&mut self, sea: SeaState, now: Stamp) -> Result<(), Ignored> {
        self.waters.observe(sea, now, &self.config)
    }

    /// Takes in a vehicle's answer to request number `attempt` to let its payload go: done, or why not.
    pub fn observe_release(&mut self, mission: &MissionId, attempt: u32, answer: Result<(), String>, now: Stamp) -> Effects {
        if let Some(live) = self.live.iter_mut().find(|live| live.mission.id == *mission) {
            release::answered(live, attempt, answer);
        }
        self.step(now)
    }

    pub(super) fn world(&self, now: Stamp) -> World<'_> {
        World { config: &self.config, fleet: &self.fleet, formations: &self.formations, waters: &self.waters, now }
    }

    /// Missions under way.
    pub fn missions(&self) -> impl Iterator<Item = &Mission> {
        self.live.iter().map(|live| &live.mission)
    }

    /// Looks at the world, and moves every mission on as far as it goes.
    pub fn step(&mut self, now: Stamp) -> Effects {
        let mut effects = Effects::default();
        self.advance(now, &mut effects);
        effects
    }

    pub(super) fn advance(&mut self, now: Stamp, effects: &mut Effects) {
        for index in 0..self.live.len() {
            self.advance_mission(index, now, effects);
        }
        self.retire(now, effects);
        let world = World { config: &self.config, fleet: &self.fleet, formations: &self.formations, waters: &self.waters, now };
        self.homings.step(&world, effects);
        self.plan(now, effects);
    }

    fn advance_mission(&mut self, index: usize, now: Stamp, effects: &mut Effects) {
        let taken = self.taken_by_others(index);
        let world = World { config: &self.config, fleet: &self.fleet, formations: &self.formations, waters: &self.waters, now };
        let live = &mut self.live[index];
        for _ in 0..STEPS_MAX {
            let Some(step) = flow::advance(live, &world, &taken) else { break };
            enter(live, step, PLANNER, now, effects);
        }
        if live.mission.phase.is_final() {
            return;
        }
        effects.releases.extend(release::due(live, &world));
        if let Some(verdict) = live.sea(&world).map(|sea| sea.verdict.state)
            && live.mission.verdict != Some(verdict)
        {
            live.mission.verdict = Some(verdict);
            live.mission.stamp = now;
            announce(&live.mission, effects);
        }
        if let Some(why) = live.fresh_note(now) {
            effects.notices.push(notice(Severity::Info, "mission waits", why, &live.mission));
        }
    }

    /// Vehicles that mission `index` may not take.
    fn taken_by_others(&self, index: usize) -> BTreeSet<VehicleId> {
        let others = self
            .live
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != index)
            .flat_map(|(_, live)| live.crew().chain(&live.dropped));
        let leader = self.live.get(index).and_then(|live| live.mission.leader.as_ref());
        others.chain(self.homings.vehicles()).chain(self.formations.members_of_others(leader)).cloned().collect()
    }

    /// Sends home whoever a mission let go of, and puts finished missions aside.
    pub(super) fn retire(&mut self, now: Stamp, effects: &mut Effects) {
        let mut home = Vec::new();
        for live in &mut self.live {
            home.extend(live.dropped.drain(..).map(|vehicle| (vehicle, live.mission.id.clone(), false)));
            if !live.mission.phase.is_final() {
                continue;
            }
            let mission = &live.mission;
            if let Some(leader) = &mission.leader {
                home.push((leader.clone(), mission.id.clone(), false));
            }
            if let Some(follower) = &mission.follower {
                let on_water = live.course.reached_landing && is_down(&self.fleet, follower);
                home.push((follower.clone(), mission.id.clone(), mission.touchdown.is_some() || on_water));
            }
            self.finished.insert(mission.id.clone(), (mission.spec.clone(), mission.phase));
        }
        self.live.retain(|live| !live.mission.phase.is_final());
        for (vehicle, mission, stays) in home {
            if let Some(changed) = self.formations.leave(&vehicle) {
                effects.records.push(Record::Formed { formation: changed, who: PLANNER.into(), stamp: now });
            }
            // Its formation has nobody to follow any more.
            self.disband(&vehicle, PLANNER, now, effects);
            self.homings.add(vehicle, Some(mission), stays, now);
        }
    }

    /// Makes or changes the formation of a leader.
    ///
    /// # Errors
    /// Why it cannot be.
    pub(super) fn form(
        &mut self,
        spec: &FormationSpec,
        who: &str,
        now: Stamp,
        effects: &mut Effects,
    ) -> Result<String, String> {
        let leader = &spec.leader;
        let own = self.live.iter().filter(|live| live.mission.leader.as_ref() != Some(leader));
        let mut taken: BTreeSet<VehicleId> = own.flat_map(|live| live.crew().chain(&live.dropped)).cloned().collect();
        let followers = self.live.iter().filter_map(|live| live.mission.follower.as_ref());
        taken.extend(followers.chain(self.formations.members_of_others(Some(leader))).cloned());
        // Whoever was only called back from a formation may be called again.
        taken.extend(self.homings.after_missions().cloned());
        if taken.contains(leader) && self.homings.vehicles().any(|vehicle| vehicle == leader) {
            return Err(format!("{leader} is on its way home"));
        }
        let formation = formation::form(spec, &taken, &self.homings.after_formations(), &self.world(now))?;
        let count = formation.members.len();
        let words = format!("{count} in {} about {leader}", spec.shape.as_str());
        let same = |before: &Formation| before.spec == *spec && before.members.keys().eq(formation.members.keys());
        if self.formations.of(leader).is_some_and(same) {
            return Ok(words);
        }
        effects.records.push(Record::Formed { formation: formation.clone(), who: who.into(), stamp: now });
        effects.notices.push(order("formation ordered", format!("{who}: {words}"), leader));
        for member in formation.members.keys() {
            self.homings.recall(member);
        }
        for vehicle in self.formations.put(formation) {
            self.homings.add(vehicle, None, false, now);
        }
        Ok(words)
    }

    /// Ends the formation of a leader, if it has one: its followers return. Returns how many.
    pub(super) fn disband(&mut self, leader: &VehicleId, who: &str, now: Stamp, effects: &mut Effects) -> Option<usize> {
        let ended = self.formations.of(leader)?.clone();
        let members = self.formations.end(leader)?;
        let formation = Formation { members: BTreeMap::new(), ..ended };
        effects.records.push(Record::Formed { formation, who: who.into(), stamp: now });
        effects.notices.push(order("formation disbanded", format!("{who}: {} return", members.len()), leader));
        let busy: BTreeSet<VehicleId> = self.live.iter().flat_map(Live::crew).chain(self.homings.vehicles()).cloned().collect();
        for vehicle in members.iter().filter(|member| !busy.contains(*member)) {
            self.homings.add(vehicle.clone(), None, false, now);
        }
        Some(members.len())
    }

    /// Issues a plan if the one in force no longer suits, or must be extended.
    fn plan(&mut self, now: Stamp, effects: &mut Effects) {
        let world = World { config: &self.config, fleet: &self.fleet, formations: &self.formations, waters: &self.waters, now };
        let mut assignments = Vec::new();
        for live in &mut self.live {
            let tasks = tasks::assignments(live, &world);
            report_clearance(live, &world, effects);
            assignments.extend(tasks);
        }
        assignments.extend(self.homings.assignments(&world));
        let busy = assignments.iter().map(|assignment| assignment.vehicle.clone()).collect();
        let with_follower = self.live.iter().filter(|live| live.mission.follower.is_some());
        let reserved = with_follower.filter_map(|live| Some((live.mission.leader.clone()?, live.slot(&self.config)))).collect();
        assignments.extend(self.formations.assignments(&busy, &reserved, &self.config));
        if let Some(issued) = &self.issued
            && issued.assignments == assignments
            && issued.generation == self.generation
            && now.seconds_since(issued.stamp) < self.config.plan_period_s
        {
            return;
        }
        self.generation += 1;
        if self.generation > self.generation_reserved {
            self.generation_reserved = self.generation.saturating_add(GENERATIONS_RESERVED);
            effects.records.push(Record::Reserved { generation: self.generation_reserved });
        }
        for live in &mut self.live {
            live.task_generation.get_or_insert(self.generation);
        }
        self.homings.issued(self.generation);
        let mission = match self.live.as_slice() {
            [only] => Some(only.mission.id.clone()),
            _ => None,
        };
        let valid_until = now.plus_secs_f64(self.config.plan_validity_s);
        let plan = DispatchPlan { stamp: now, generation: self.generation, mission, valid_until, assignments };
        self.issued = Some(plan.clone());
        effects.plan = Some(plan);
    }
}

/// Enters a phase, and says so.
pub(super) fn enter(live: &mut Live, step: flow::Step, who: &str, now: Stamp, effects: &mut Effects) {
    let (phase, why) = step;
    live.recovered = false;
    let transition = live.enter(phase, who, why.clone(), now);
    effects.records.push(Record::Entered {
        mission: Box::new(Mission { history: Vec::new(), ..live.mission.clone() }),
        course: live.course.clone(),
        transition,
    });
    announce(&live.mission, effects);
    let severity = match phase {
        MissionPhase::Failed | MissionPhase::Aborted => Severity::Warning,
        MissionPhase::Releasing if live.mission.release_problem.is_some() => Severity::Warning,
        _ => Severity::Info,
    };
    effects.notices.push(notice(severity, &format!("mission {}", phase.as_str()), format!("{who}: {why}"), &live.mission));
}

/// The newest version of a mission takes the place of an older one.
fn announce(mission: &Mission, effects: &mut Effects) {
    effects.missions.retain(|known| known.id != mission.id);
    effects.missions.push(mission.clone());
}

fn notice(severity: Severity, what: &str, why: String, mission: &Mission) -> Notice {
    Notice { severity, what: what.to_owned(), why, vehicle: None, mission: Some(mission.id.clone()) }
}

fn order(what: &str, why: String, leader: &VehicleId) -> Notice {
    Notice { severity: Severity::Info, what: what.into(), why, vehicle: Some(leader.clone()), mission: None }
}

/// Tells people when the permission to descend comes and goes.
fn report_clearance(live: &mut Live, world: &World<'_>, effects: &mut Effects) {
    let cleared = tasks::clearance(live, world).is_some();
    if cleared == live.was_cleared {
        return;
    }
    live.was_cleared = cleared;
    let landing = live.mission.phase == MissionPhase::Landing;
    let (severity, what, why) = if cleared {
        (Severity::Info, "cleared to descend", "the verdict is safe and fresh".to_owned())
    } else if landing {
        (Severity::Warning, "clearance withdrawn", tasks::why_not_cleared(live, world))
    } else {
        return;
    };
    let vehicle = live.mission.follower.clone();
    effects.notices.push(Notice { vehicle, ..notice(severity, what, why, &live.mission) });
}

/// Whether a vehicle was last heard on the ground or the water.
fn is_down(fleet: &Fleet, vehicle: &VehicleId) -> bool {
    fleet.last(vehicle).is_some_and(|state| state.landed == LandedState::OnGround)
}
