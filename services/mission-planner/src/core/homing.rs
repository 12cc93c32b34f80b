//! Vehicles whose mission is over, until they are down and may be used again.

use std::collections::{BTreeMap, BTreeSet};

use halcyon_model::{Assignment, LandedState, MissionId, Severity, Stamp, Task, VehicleId};

use super::live::World;
use super::record::{Effects, Notice, Record};

/// One vehicle on its way home.
#[derive(Debug)]
struct Homing {
    /// Its mission; `None` after a formation.
    mission: Option<MissionId>,
    since: Stamp,
    /// It rests on the water, and stays there whatever its landing detector makes of the waves.
    stays: bool,
    task_generation: Option<u64>,
    reported: bool,
}

/// All of them.
#[derive(Debug, Default)]
pub(super) struct Homings(BTreeMap<VehicleId, Homing>);

impl Homings {
    pub(super) fn add(&mut self, vehicle: VehicleId, mission: Option<MissionId>, stays: bool, now: Stamp) {
        self.0.insert(vehicle, Homing { mission, since: now, stays, task_generation: None, reported: false });
    }

    pub(super) fn vehicles(&self) -> impl Iterator<Item = &VehicleId> {
        self.0.keys()
    }

    /// Those who flew for a mission.
    pub(super) fn after_missions(&self) -> impl Iterator<Item = &VehicleId> {
        self.0.iter().filter(|(_, homing)| homing.mission.is_some()).map(|(vehicle, _)| vehicle)
    }

    /// Those who were called back from a formation.
    pub(super) fn after_formations(&self) -> BTreeSet<VehicleId> {
        self.0.iter().filter(|(_, homing)| homing.mission.is_none()).map(|(vehicle, _)| vehicle.clone()).collect()
    }

    /// It has something else to do.
    pub(super) fn recall(&mut self, vehicle: &VehicleId) {
        self.0.remove(vehicle);
    }

    /// Lets go of whoever is down and disarmed, or has been taken over by its pilot, and knows that its task is over.
    pub(super) fn step(&mut self, world: &World<'_>, effects: &mut Effects) {
        self.0.retain(|vehicle, homing| {
            let over = homing.task_generation.is_some_and(|generation| {
                world.fleet.fresh(vehicle, world.now, world.config).is_some_and(|state| {
                    let down = state.landed == LandedState::OnGround && !state.armed;
                    let pilot = state.activity == halcyon_model::Activity::PilotControl;
                    state.plan_generation >= generation && (down || pilot)
                })
            });
            if over {
                let release = |mission| Record::Released { mission, vehicle: vehicle.clone(), stamp: world.now };
                effects.records.extend(homing.mission.clone().map(release));
            } else if !homing.reported && world.now.seconds_since(homing.since) > world.config.return_max_s {
                homing.reported = true;
                effects.notices.push(Notice {
                    severity: Severity::Critical,
                    what: format!("{vehicle} has not come home"),
                    why: format!("it was called back {:.0} s ago", world.config.return_max_s),
                    vehicle: Some(vehicle.clone()),
                    mission: homing.mission.clone(),
                });
            }
            !over
        });
    }

    /// Whoever is down stays down; everyone else returns.
    pub(super) fn assignments(&self, world: &World<'_>) -> impl Iterator<Item = Assignment> {
        self.0.iter().map(|(vehicle, homing)| {
            let down = world.fleet.is_down(vehicle, 0.0, world.now);
            let task = if homing.stays || down { Task::Hold } else { Task::Return };
            Assignment { vehicle: vehicle.clone(), task }
        })
    }

    /// Plan `generation` carries the tasks of all of them.
    pub(super) fn issued(&mut self, generation: u64) {
        for homing in self.0.values_mut() {
            homing.task_generation.get_or_insert(generation);
        }
    }
}
