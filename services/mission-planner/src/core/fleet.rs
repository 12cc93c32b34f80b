//! What the planner knows of the vehicles, and whom it may send.

use std::collections::{BTreeMap, BTreeSet};

use halcyon_model::{Activity, LandedState, LocalFrame, LocalPoint, Role, Stamp, VehicleId, VehicleState};

use super::live::World;
use crate::config::Config;

/// Vehicles that are kept in mind; more are ignored, so that a flood of names cannot fill the memory.
const VEHICLES_MAX: usize = 256;

/// Vehicles whose reasons are told one by one: what a fleet of a hundred says is too long for people, and for the wire.
const REASONS_MAX: usize = 8;

/// Why a message was not taken in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Ignored {
    /// An older one than is known; late, not wrong.
    #[error("it is older than what is known")]
    Old,
    /// Its clock runs ahead.
    #[error("it is stamped in the future")]
    Future,
    /// There are too many senders already.
    #[error("there are too many senders")]
    TooMany,
    /// A number in it is not finite.
    #[error("a number in it is not finite")]
    NotFinite,
}

/// The newest state of a vehicle, and for how long it has been in some conditions.
#[derive(Debug, Clone)]
struct Known {
    state: VehicleState,
    /// Since when a fail-safe or the pilot has had it.
    trouble_since: Option<Stamp>,
    /// Since when it has been on the ground or the water.
    down_since: Option<Stamp>,
    /// Since when it has said that its flight is over.
    landed_since: Option<Stamp>,
}

/// All vehicles heard of.
#[derive(Debug)]
pub(super) struct Fleet {
    vehicles: BTreeMap<VehicleId, Known>,
    /// Since when the planner has been listening.
    listening_since: Stamp,
}

impl Fleet {
    /// Nobody heard yet.
    #[must_use]
    pub(super) fn new(now: Stamp) -> Self {
        Self { vehicles: BTreeMap::new(), listening_since: now }
    }

    /// Takes in a vehicle's state.
    ///
    /// # Errors
    /// [`Ignored`] if it says nothing new or nothing credible.
    pub(super) fn observe(&mut self, state: VehicleState, now: Stamp, config: &Config) -> Result<(), Ignored> {
        if state.stamp.seconds_since(now) > config.clock_skew_max_s {
            return Err(Ignored::Future);
        }
        if !state.position_ned_m.iter().all(|x| x.is_finite()) || !state.heading_rad.is_finite() {
            return Err(Ignored::NotFinite);
        }
        let known = self.vehicles.get(&state.vehicle);
        if known.is_some_and(|known| state.stamp <= known.state.stamp) {
            return Err(Ignored::Old);
        }
        if known.is_none() && self.vehicles.len() >= VEHICLES_MAX {
            return Err(Ignored::TooMany);
        }
        let since = |holds: bool, before: Option<Stamp>| holds.then(|| before.unwrap_or(state.stamp));
        let trouble = matches!(state.activity, Activity::FailSafe { .. } | Activity::PilotControl);
        let down = state.landed == LandedState::OnGround;
        let trouble_since = since(trouble, known.and_then(|known| known.trouble_since));
        let down_since = since(down, known.and_then(|known| known.down_since));
        let landed_since = since(state.activity == Activity::Landed, known.and_then(|known| known.landed_since));
        self.vehicles.insert(state.vehicle.clone(), Known { state, trouble_since, down_since, landed_since });
        Ok(())
    }

    /// The newest state of a vehicle, however old.
    #[must_use]
    pub(super) fn last(&self, vehicle: &VehicleId) -> Option<&VehicleState> {
        self.vehicles.get(vehicle).map(|known| &known.state)
    }

    /// The state of a vehicle, if it is fresh.
    #[must_use]
    pub(super) fn fresh(&self, vehicle: &VehicleId, now: Stamp, config: &Config) -> Option<&VehicleState> {
        self.last(vehicle).filter(|state| now.seconds_since(state.stamp) <= config.vehicle_age_max_s)
    }

    /// What has been wrong with a vehicle for longer than the mission can bear: silent, a fail-safe, its pilot.
    #[must_use]
    pub(super) fn fault(&self, vehicle: &VehicleId, now: Stamp, config: &Config) -> Option<String> {
        let Some(known) = self.vehicles.get(vehicle) else {
            let silent_s = now.seconds_since(self.listening_since);
            return (silent_s > config.vehicle_lost_s).then(|| format!("{vehicle} is lost: not heard for {silent_s:.0} s"));
        };
        let silent_s = now.seconds_since(known.state.stamp);
        if silent_s > config.vehicle_lost_s {
            return Some(format!("{vehicle} is lost: not heard for {silent_s:.0} s"));
        }
        let lasted_s = now.seconds_since(known.trouble_since?);
        (lasted_s > config.fault_grace_s).then(|| match &known.state.activity {
            Activity::FailSafe { reason } => format!("{vehicle} flies its fail-safe: {reason}"),
            _ => format!("{vehicle} is flown by its pilot"),
        })
    }

    /// Whether a vehicle has been on the ground or the water for longer than `for_s`.
    #[must_use]
    pub(super) fn is_down(&self, vehicle: &VehicleId, for_s: f64, now: Stamp) -> bool {
        self.vehicles.get(vehicle).and_then(|known| known.down_since).is_some_and(|since| now.seconds_since(since) >= for_s)
    }

    /// Whether a vehicle has said for longer than `for_s` that its flight is over.
    #[must_use]
    pub(super) fn has_landed(&self, vehicle: &VehicleId, for_s: f64, now: Stamp) -> bool {
        self.vehicles.get(vehicle).and_then(|known| known.landed_since).is_some_and(|since| now.seconds_since(since) >= for_s)
    }

    /// Everyone of a role.
    pub(super) fn of_role(&self, role: Role) -> impl Iterator<Item = &VehicleId> {
        self.vehicles.iter().filter(move |(_, known)| known.state.role == role).map(|(vehicle, _)| vehicle)
    }

    /// A vehicle, other than `besides`, whose last known place is within `radius_m` of `point`. However old that knowledge is:
    /// a vehicle that fell silent is still somewhere.
    #[must_use]
    pub(super) fn occupant(&self, point: LocalPoint, radius_m: f64, besides: &[Option<&VehicleId>]) -> Option<&VehicleId> {
        self.vehicles
            .iter()
            .filter(|(vehicle, _)| !besides.contains(&Some(vehicle)))
            .find(|(_, known)| LocalPoint::from(known.state.position_ned_m).distance_m(&point) < radius_m)
            .map(|(vehicle, _)| vehicle)
    }

    /// Why `vehicle` cannot be sent now; `None` if it can. `named` says that this very vehicle is asked for,
    /// `ours` that what it does in the air it does for a formation.
    #[must_use]
    pub(super) fn obstacle(
        &self,
        vehicle: &VehicleId,
        role: Role,
        named: bool,
        ours: bool,
        world: &World<'_>,
    ) -> Option<String> {
        let (now, config) = (world.now, world.config);
        let Some(state) = self.last(vehicle) else { return Some("not heard yet".into()) };
        if state.role != role {
            return Some(format!("not a {}", role_name(role)));
        }
        if self.fresh(vehicle, now, config).is_none() {
            return Some("not heard lately".into());
        }
        if !state.estimator_ok {
            return Some("its position is not good enough to fly by".into());
        }
        match state.battery_fraction {
            None => return Some("its battery is not known".into()),
            // Written so that NaN is refused.
            Some(battery) if battery >= config.battery_min => {}
            Some(_) => return Some(format!("its battery is below {:.0} %", config.battery_min * 100.0)),
        }
        match (&state.activity, state.landed) {
            (Activity::FailSafe { reason }, _) => Some(format!("in a fail-safe: {reason}")),
            (Activity::PilotControl, _) => Some("its pilot has it: set GUIDED to hand it back".into()),
            (_, LandedState::OnGround) if !state.ready_to_arm => Some("not ready to arm".into()),
            (_, LandedState::OnGround) => away_from_home(state, named, config),
            (Activity::Idle | Activity::Holding { .. }, LandedState::InAir) => None,
            (_, LandedState::InAir) if ours => None,
            (_, LandedState::Unknown) => Some("it is not known whether it is on the ground".into()),
            _ => Some("busy in the air".into()),
        }
    }

    /// The nearest vehicle of `role` to `point` that can be sent; or why nobody can. Equal distances go by name, so that the
    /// choice is always the same.
    ///
    /// # Errors
    /// One line with a reason for every vehicle of that role, as far as they are few.
    pub(super) fn pick(
        &self,
        role: Role,
        named: Option<&VehicleId>,
        point: LocalPoint,
        taken: &BTreeSet<VehicleId>,
        world: &World<'_>,
    ) -> Result<(VehicleId, LocalPoint), String> {
        let mut best: Option<(f64, &VehicleId, LocalPoint)> = None;
        let mut reasons = Vec::new();
        let candidates = self.vehicles.iter().filter(|(vehicle, known)| match named {
            Some(named) => *vehicle == named,
            None => known.state.role == role,
        });
        for (vehicle, known) in candidates {
            let obstacle = if taken.contains(vehicle) {
                Some("busy in another mission".into())
            } else {
                self.obstacle(vehicle, role, named.is_some(), world.formations.leader_of(vehicle).is_some(), world)
            };
            if let Some(obstacle) = obstacle {
                reasons.push(format!("{vehicle}: {obstacle}"));
                continue;
            }
            let place = LocalPoint::from(known.state.position_ned_m);
            let distance_m = place.distance_m(&point);
            if best.is_none_or(|(least_m, ..)| distance_m < least_m) {
                best = Some((distance_m, vehicle, place));
            }
        }
        match best {
            Some((_, vehicle, place)) => Ok((vehicle.clone(), place)),
            None if reasons.is_empty() => Err(match named {
                Some(named) => format!("{named} has not been heard"),
                None => format!("no {} has been heard", role_name(role)),
            }),
            None => {
                let more = reasons.len().saturating_sub(REASONS_MAX);
                reasons.truncate(REASONS_MAX);
                reasons.extend((more > 0).then(|| format!("{more} more")));
                Err(reasons.join("; "))
            }
        }
    }
}

/// A role in a word.
#[must_use]
pub(super) fn role_name(role: Role) -> &'static str {
    match role {
        Role::Leader => "leader",
        Role::Follower => "follower",
    }
}

/// A vehicle that sits away from its home is a follower on the water: it stays there unless a person asks for it by name.
fn away_from_home(state: &VehicleState, named: bool, config: &Config) -> Option<String> {
    if named {
        return None;
    }
    // Its link may just have been restarted, and heard everything else sooner.
    let Some(home) = state.home else { return Some("its home is not known, so that it may be on the water".into()) };
    let away_m = LocalFrame::new(home).ned_from_geodetic(state.position).xy().norm();
    (away_m > config.home_radius_m)
        .then(|| format!("on the ground {away_m:.0} m from its home: name it in the mission, or have it take off and return"))
}
