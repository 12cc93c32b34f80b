//! Standing formations: followers that keep a shape about a leader for as long as nobody says otherwise.
//!
//! A mission of that leader takes its follower from the formation, and the follower leaves it for good: after a mission a vehicle
//! comes home, and nothing takes off again for an order that it has left. Slots are given out so that the ways there do not cross
//! ([`super::assignment`]), anew at every order.

use std::collections::{BTreeMap, BTreeSet};

use halcyon_model::{Assignment, FormationSpec, LocalPoint, Role, Slot, Task, VehicleId};

use super::assignment::assign;
use super::fleet::role_name;
use super::geometry::offset;
use super::live::World;
use super::shape::shape;
use crate::config::Config;

/// Followers of one leader.
const MEMBERS_MAX: usize = 16;
/// Slots beyond the shape for those who must make room: a slot that is reserved is too near to two of them at most.
const EXTRA: usize = 3;
/// Farther apart than this it is no formation, metres.
const SPACING_M_MAX: f64 = 100.0;

/// One formation.
#[derive(Debug, Clone, PartialEq)]
pub struct Formation {
    /// As it was ordered.
    pub spec: FormationSpec,
    /// Who keeps which slot now.
    pub members: BTreeMap<VehicleId, Slot>,
}

/// All of them, by leader.
#[derive(Debug, Default)]
pub(super) struct Formations(BTreeMap<VehicleId, Formation>);

impl Formations {
    pub(super) fn restored(formations: Vec<Formation>) -> Self {
        Self(formations.into_iter().map(|formation| (formation.spec.leader.clone(), formation)).collect())
    }

    pub(super) fn of(&self, leader: &VehicleId) -> Option<&Formation> {
        self.0.get(leader)
    }

    /// The leader of the formation that `vehicle` is in.
    pub(super) fn leader_of(&self, vehicle: &VehicleId) -> Option<&VehicleId> {
        self.0.iter().find(|(_, formation)| formation.members.contains_key(vehicle)).map(|(leader, _)| leader)
    }

    /// Members of formations about anyone but `leader`.
    pub(super) fn members_of_others(&self, leader: Option<&VehicleId>) -> impl Iterator<Item = &VehicleId> {
        self.0.iter().filter(move |(other, _)| Some(*other) != leader).flat_map(|(_, formation)| formation.members.keys())
    }

    /// Puts a formation in the place of the one that its leader had; returns whom that leaves without a slot.
    pub(super) fn put(&mut self, formation: Formation) -> Vec<VehicleId> {
        let kept: BTreeSet<_> = formation.members.keys().cloned().collect();
        let before = self.0.insert(formation.spec.leader.clone(), formation);
        before.map_or_else(Vec::new, |before| before.members.into_keys().filter(|member| !kept.contains(member)).collect())
    }

    /// Ends the formation of a leader; returns who was in it.
    pub(super) fn end(&mut self, leader: &VehicleId) -> Option<Vec<VehicleId>> {
        self.0.remove(leader).map(|formation| formation.members.into_keys().collect())
    }

    /// A vehicle that has something else to do leaves its formation for good. Returns the formation that changed, to be stored.
    pub(super) fn leave(&mut self, vehicle: &VehicleId) -> Option<Formation> {
        let leader = self.leader_of(vehicle)?.clone();
        let formation = self.0.get_mut(&leader)?;
        formation.members.remove(vehicle);
        let changed = formation.clone();
        if changed.members.is_empty() {
            self.0.remove(&leader);
        }
        Some(changed)
    }

    /// What the members that nobody else needs are to do. `reserved`: where a leader's mission has its own follower; a member whose
    /// slot is too near to that takes the next one of the shape that is free.
    pub(super) fn assignments(
        &self,
        busy: &BTreeSet<VehicleId>,
        reserved: &BTreeMap<VehicleId, Slot>,
        config: &Config,
    ) -> Vec<Assignment> {
        let of = |(leader, formation): (&VehicleId, &Formation)| -> Vec<Assignment> {
            let count = formation.members.len();
            let reserved = reserved.get(leader);
            let is_clear = |slot: &Slot| reserved.is_none_or(|other| apart_m(slot, other) >= config.separation_m);
            let mut more = slots_of(&formation.spec, count + EXTRA, config).into_iter().skip(count).filter(is_clear);
            let free = formation.members.iter().filter(|(member, _)| !busy.contains(member));
            let mut kept = |slot: &Slot| if is_clear(slot) { Some(*slot) } else { more.next() };
            let task = |slot: Option<Slot>| slot.map_or(Task::Hold, |slot| Task::Follow { leader: leader.clone(), slot });
            free.map(|(member, slot)| Assignment { vehicle: member.clone(), task: task(kept(slot)) }).collect()
        };
        self.0.iter().flat_map(of).collect()
    }
}

fn apart_m(a: &Slot, b: &Slot) -> f64 {
    (a.forward_m - b.forward_m).hypot(a.right_m - b.right_m).hypot(a.up_m - b.up_m)
}

/// The first `count` slots of what is asked for, at the height that followers keep.
fn slots_of(spec: &FormationSpec, count: usize, config: &Config) -> Vec<Slot> {
    let slots = shape(spec.shape, count, spec.spacing_m).into_iter();
    slots.map(|slot| Slot { up_m: slot.up_m + config.slot_up_m, ..slot }).collect()
}

/// Checks an order and gives out the slots. `taken`: vehicles that other missions and formations have; `called_back`: those that are on
/// their way home from a formation.
///
/// # Errors
/// Why it cannot be.
pub(super) fn form(
    spec: &FormationSpec,
    taken: &BTreeSet<VehicleId>,
    called_back: &BTreeSet<VehicleId>,
    world: &World<'_>,
) -> Result<Formation, String> {
    let (least_m, spacing_m) = (world.config.separation_m, spec.spacing_m);
    if !(least_m..=SPACING_M_MAX).contains(&spacing_m) {
        return Err(format!("the spacing must be {least_m} to {SPACING_M_MAX} m, not {spacing_m} m"));
    }
    let leader = &spec.leader;
    let Some(state) = world.fleet.last(leader) else { return Err(format!("vehicle {leader} is not known")) };
    if state.role != Role::Leader {
        return Err(format!("{leader} is a {}, not a leader", role_name(state.role)));
    }
    let Some(state) = world.fleet.fresh(leader, world.now, world.config) else {
        return Err(format!("{leader} has not been heard lately"));
    };
    let followers = followers(spec, taken, called_back, world)?;
    let slots = slots_of(spec, followers.len(), world.config);
    let here = LocalPoint::from(state.position_ned_m);
    let targets: Vec<_> = slots.iter().map(|slot| offset(here, state.heading_rad, slot.forward_m, slot.right_m)).collect();
    let places: Vec<_> = followers.iter().map(|(_, place)| *place).collect();
    let given = assign(&places, &targets);
    let member = |((vehicle, _), slot): ((VehicleId, LocalPoint), Option<usize>)| slots.get(slot?).map(|slot| (vehicle, *slot));
    Ok(Formation { spec: spec.clone(), members: followers.into_iter().zip(given).filter_map(member).collect() })
}

/// Those who are to be in it, and where they are.
fn followers(
    spec: &FormationSpec,
    taken: &BTreeSet<VehicleId>,
    called_back: &BTreeSet<VehicleId>,
    world: &World<'_>,
) -> Result<Vec<(VehicleId, LocalPoint)>, String> {
    let named: BTreeSet<_> = spec.followers.iter().cloned().collect();
    if named.len() != spec.followers.len() {
        return Err("a follower is named twice".into());
    }
    let candidates: BTreeSet<VehicleId> =
        if named.is_empty() { world.fleet.of_role(Role::Follower).cloned().collect() } else { named.clone() };
    let mut found = Vec::new();
    let mut reasons = Vec::new();
    for vehicle in candidates {
        let obstacle = if taken.contains(&vehicle) {
            Some("in a mission, on its way home from one, or in another formation".to_owned())
        } else {
            let ours = called_back.contains(&vehicle) || world.formations.leader_of(&vehicle).is_some();
            world.fleet.obstacle(&vehicle, Role::Follower, !named.is_empty(), ours, world)
        };
        match (obstacle, world.fleet.last(&vehicle)) {
            (None, Some(state)) => found.push((vehicle, LocalPoint::from(state.position_ned_m))),
            (obstacle, _) => reasons.push(format!("{vehicle}: {}", obstacle.unwrap_or_else(|| "not heard yet".into()))),
        }
    }
    reasons.truncate(MEMBERS_MAX);
    if found.is_empty() || (!named.is_empty() && !reasons.is_empty()) {
        let reasons = if reasons.is_empty() { "no follower has been heard".into() } else { reasons.join("; ") };
        return Err(reasons);
    }
    if found.len() > MEMBERS_MAX {
        return Err(format!("a leader takes at most {MEMBERS_MAX} followers, not {}", found.len()));
    }
    Ok(found)
}
