//! The flow of a mission: given what is known now, which phase comes next, and why.
//!
//! Every phase ends: by what it waits for, by a fault of its crew, or by its time limit. What goes wrong ends in `Failed`, and
//! whoever is in the air returns.

use std::collections::BTreeSet;

use halcyon_model::{MissionPhase, Role, VehicleId, VerdictState};

use super::geometry;
use super::live::{Live, World};
use super::release::{landed, releasing};
use super::waters::failed_checks;

/// The phase to enter next, and why.
pub(super) type Step = (MissionPhase, String);

/// What a mission does next; `None` if it stays. May set the crew and the course of `live`; `taken` are vehicles of others.
pub(super) fn advance(live: &mut Live, world: &World<'_>, taken: &BTreeSet<VehicleId>) -> Option<Step> {
    match live.mission.phase {
        MissionPhase::Waiting => waiting(live, world, taken),
        MissionPhase::Transit => transit(live, world),
        MissionPhase::Assessing => assessing(live, world),
        MissionPhase::AwaitingApproval => awaiting_approval(live, world),
        MissionPhase::Approved => approved(live, world, taken),
        MissionPhase::Joining => joining(live, world, taken),
        MissionPhase::Clearing => clearing(live, world),
        MissionPhase::Landing => landing(live, world),
        MissionPhase::Releasing => releasing(live, world),
        MissionPhase::Paused => overdue(live, world, world.config.paused_max_s, "nobody resumed it"),
        MissionPhase::Completed | MissionPhase::Aborted | MissionPhase::Failed => None,
    }
}

fn failed(why: impl Into<String>) -> Option<Step> {
    Some((MissionPhase::Failed, why.into()))
}

/// Fails a phase that has lasted too long.
pub(super) fn overdue(live: &Live, world: &World<'_>, limit_s: f64, what: &str) -> Option<Step> {
    (world.now.seconds_since(live.entered) > limit_s).then(|| (MissionPhase::Failed, format!("{what} within {limit_s:.0} s")))
}

/// Fails a mission whose leader is lost or no longer ours.
fn leader_fault(live: &Live, world: &World<'_>) -> Option<Step> {
    failed(world.fleet.fault(live.mission.leader.as_ref()?, world.now, world.config)?)
}

/// The same for a leader that must be in the air by now. One that went home while the planner was away is not sent again: it had
/// its reasons, and vehicles do not take off again by themselves for a task that they have flown.
fn airborne_leader_fault(live: &Live, world: &World<'_>) -> Option<Step> {
    if let Some(step) = leader_fault(live, world) {
        return Some(step);
    }
    let leader = live.mission.leader.as_ref()?;
    let down = world.fleet.is_down(leader, world.config.fault_grace_s, world.now);
    if down { failed(format!("{leader} is on the ground")) } else { None }
}

/// A vehicle that was to take off, and says that it has landed: it came back by itself, or will not fly the same task again.
fn landed_again(vehicle: &VehicleId, live: &Live, world: &World<'_>) -> Option<String> {
    let patience_s = world.config.fault_grace_s;
    let waited = world.now.seconds_since(live.entered) >= patience_s;
    let landed = waited && world.fleet.has_landed(vehicle, patience_s, world.now);
    landed.then(|| format!("{vehicle} is on the ground, and does not take off"))
}

fn follower_fault(live: &Live, world: &World<'_>) -> Option<String> {
    world.fleet.fault(live.mission.follower.as_ref()?, world.now, world.config)
}

fn waiting(live: &mut Live, world: &World<'_>, taken: &BTreeSet<VehicleId>) -> Option<Step> {
    let spot = live.spot();
    let named = live.mission.spec.leader.clone();
    match world.fleet.pick(Role::Leader, named.as_ref(), spot, taken, world) {
        Ok((leader, place)) => {
            // The heading of the way there, kept for the whole mission: the nose points away from home and from the follower.
            let heading_rad = geometry::bearing_rad(place, spot)
                .or_else(|| world.fleet.last(&leader).map(|state| state.heading_rad))
                .unwrap_or(0.0);
            let why = format!("{leader} is ready, {:.0} m from the spot", place.distance_m(&spot));
            live.course.heading_rad = Some(heading_rad);
            live.mission.leader = Some(leader);
            Some((MissionPhase::Transit, why))
        }
        Err(reasons) => {
            let late = overdue(live, world, world.config.waiting_max_s, &format!("no leader was ready ({reasons})"));
            live.wait_for(format!("waits for a leader: {reasons}"), late.is_none());
            late
        }
    }
}

fn transit(live: &mut Live, world: &World<'_>) -> Option<Step> {
    if let Some(settled) = live.leader_settled_at(live.spot(), world) {
        let why = format!("{} holds over the spot", settled.vehicle);
        live.on_station(settled.stamp, world.config);
        return Some((MissionPhase::Assessing, why));
    }
    leader_fault(live, world)
        .or_else(|| failed(landed_again(live.mission.leader.as_ref()?, live, world)?))
        .or_else(|| overdue(live, world, world.config.transit_max_s, "the leader did not get there"))
}

/// What ends every phase in which the leader holds over the spot.
fn over_spot(live: &mut Live, world: &World<'_>) -> Option<Step> {
    live.keep_station(world);
    if let Some(step) = airborne_leader_fault(live, world) {
        return Some(step);
    }
    let held_s = world.now.seconds_since(live.course.first_on_station?);
    (held_s > world.config.station_max_s)
        .then(|| (MissionPhase::Failed, format!("no dispatch within {:.0} s over the spot", world.config.station_max_s)))
}

fn assessing(live: &mut Live, world: &World<'_>) -> Option<Step> {
    if let Some(step) = over_spot(live, world) {
        return Some(step);
    }
    let Some(sea) = live.sea(world) else {
        live.unsafe_since = None;
        return overdue(live, world, world.config.assessing_max_s, "nothing was measured at the spot");
    };
    match sea.verdict.state {
        VerdictState::Safe => {
            live.mission.h_s_m = sea.h_s_m;
            Some(match live.mission.spec.approval {
                halcyon_model::Approval::Automatic => {
                    (MissionPhase::Approved, "the verdict is safe, and approval is automatic".into())
                }
                halcyon_model::Approval::Manual => (MissionPhase::AwaitingApproval, "the verdict is safe".into()),
            })
        }
        VerdictState::Unsafe => {
            let since = *live.unsafe_since.get_or_insert(world.now);
            if world.now.seconds_since(since) >= world.config.unsafe_s {
                live.mission.h_s_m = sea.h_s_m;
                return failed(format!("the water is unsafe: {}", failed_checks(sea)));
            }
            overdue(live, world, world.config.assessing_max_s, "no safe verdict")
        }
        VerdictState::Inconclusive => {
            live.unsafe_since = None;
            let what = format!("no conclusion ({})", failed_checks(sea));
            overdue(live, world, world.config.assessing_max_s, &what)
        }
    }
}

/// Back to assessing when the verdict that allowed the next step no longer stands. An approval given on it is void.
fn verdict_withdrawn(live: &mut Live, world: &World<'_>) -> Option<Step> {
    let why = match live.sea(world) {
        None => "the safe verdict has expired".into(),
        Some(sea) => match sea.verdict.state {
            VerdictState::Safe => return None,
            state => format!("the verdict became {}: {}", state.as_str(), failed_checks(sea)),
        },
    };
    live.course.dispatch = false;
    Some((MissionPhase::Assessing, why))
}

fn awaiting_approval(live: &mut Live, world: &World<'_>) -> Option<Step> {
    over_spot(live, world)
        .or_else(|| verdict_withdrawn(live, world))
        .or_else(|| overdue(live, world, world.config.awaiting_approval_max_s, "nobody approved"))
}

fn approved(live: &mut Live, world: &World<'_>, taken: &BTreeSet<VehicleId>) -> Option<Step> {
    if let Some(step) = over_spot(live, world).or_else(|| verdict_withdrawn(live, world)) {
        return Some(step);
    }
    if !(live.mission.spec.dispatch_on_approval || live.course.dispatch) {
        return overdue(live, world, world.config.approved_max_s, "no dispatch was commanded");
    }
    let found = match occupied(live, world) {
        Some(occupant) => Err(format!("{occupant} is on or over the spot")),
        None => take_follower(live, world, taken),
    };
    match found {
        Ok(why) => {
            live.mission.h_s_m = live.safe_sea(world).and_then(|sea| sea.h_s_m);
            Some((MissionPhase::Joining, why))
        }
        Err(reasons) => {
            let late = overdue(live, world, world.config.approved_max_s, &format!("no follower could be sent ({reasons})"));
            live.wait_for(format!("waits to dispatch: {reasons}"), late.is_none());
            late
        }
    }
}

/// Some other vehicle that is where the follower is to land.
pub(super) fn occupied(live: &Live, world: &World<'_>) -> Option<VehicleId> {
    let crew = [live.mission.leader.as_ref(), live.mission.follower.as_ref()];
    world.fleet.occupant(live.spot(), world.config.separation_m, &crew).cloned()
}

/// Takes the nearest follower that can be sent, on the side of the leader from which it comes.
fn take_follower(live: &mut Live, world: &World<'_>, taken: &BTreeSet<VehicleId>) -> Result<String, String> {
    let spot = live.spot();
    let taken: BTreeSet<VehicleId> = taken.union(&live.tried).cloned().collect();
    let named = live.mission.spec.follower.clone();
    let (follower, place) = world.fleet.pick(Role::Follower, named.as_ref(), spot, &taken, world)?;
    live.course.abreast_m = world.config.slot_abreast_m * geometry::side(spot, live.heading_rad(), place);
    let why = format!("{follower} is sent, {:.0} m from the spot", place.distance_m(&spot));
    live.mission.follower = Some(follower);
    Ok(why)
}

fn joining(live: &mut Live, world: &World<'_>, taken: &BTreeSet<VehicleId>) -> Option<Step> {
    if let Some(step) = airborne_leader_fault(live, world) {
        return Some(step);
    }
    if live.follower_settled(world) {
        return Some((MissionPhase::Clearing, "the follower is settled in its slot".into()));
    }
    let late = world.now.seconds_since(live.entered) > world.config.joining_max_s;
    let fault = follower_fault(live, world)
        .or_else(|| landed_again(live.mission.follower.as_ref()?, live, world))
        .or_else(|| late.then(|| format!("the follower did not join within {:.0} s", world.config.joining_max_s)))?;
    let lost = live.mission.follower.take()?;
    live.tried.insert(lost.clone());
    match take_follower(live, world, taken) {
        Ok(why) => {
            live.dropped.push(lost);
            Some((MissionPhase::Joining, format!("{fault}; {why}")))
        }
        Err(reasons) => {
            live.mission.follower = Some(lost);
            failed(format!("{fault}; no other follower could be sent ({reasons})"))
        }
    }
}

fn clearing(live: &mut Live, world: &World<'_>) -> Option<Step> {
    if let Some(step) = airborne_leader_fault(live, world) {
        return Some(step);
    }
    if let Some(fault) = airborne_follower_fault(live, world) {
        return failed(fault);
    }
    if live.leader_settled_at(live.stand_off(world.config), world).is_none() || !live.follower_settled(world) {
        return overdue(live, world, world.config.clearing_max_s, "the leader did not clear the spot");
    }
    // The leader may have to measure anew from where it is now. The follower waits beside it rather than over the spot.
    if live.safe_sea(world).is_some() {
        return Some((MissionPhase::Landing, "the leader has cleared the spot, and the water is safe".into()));
    }
    let late = overdue(live, world, world.config.clearing_max_s, "the water was not found safe again");
    live.wait_for("waits for a safe verdict from beside the spot".into(), late.is_none());
    late
}

fn airborne_follower_fault(live: &Live, world: &World<'_>) -> Option<String> {
    let follower = live.mission.follower.as_ref()?;
    let down = || world.fleet.is_down(follower, world.config.fault_grace_s, world.now);
    follower_fault(live, world).or_else(|| down().then(|| format!("{follower} is down, and says of no touchdown")))
}

fn landing(live: &mut Live, world: &World<'_>) -> Option<Step> {
    let down = live.follower_landed(world).and_then(|state| Some((state.touchdown?, state.has_payload)));
    if let Some((touchdown, has_payload)) = down {
        let miss_m = touchdown.distance_m(&live.spot());
        live.mission.touchdown = Some(touchdown);
        return Some(if miss_m > world.config.touchdown_error_max_m {
            (MissionPhase::Failed, format!("the follower came down {miss_m:.0} m from the spot"))
        } else {
            (if has_payload { MissionPhase::Releasing } else { MissionPhase::Completed }, landed(live))
        });
    }
    airborne_leader_fault(live, world)
        .or_else(|| failed(airborne_follower_fault(live, world)?))
        .or_else(|| overdue(live, world, world.config.landing_max_s, "the follower did not land"))
}
