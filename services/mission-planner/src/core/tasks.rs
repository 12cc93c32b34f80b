//! What each vehicle of a mission is to do in its phase, and the permission to descend.

use halcyon_model::{Assignment, Clearance, LocalPoint, MissionPhase, Task, VehicleId, VerdictState};

use super::flow::occupied;
use super::live::{Live, World};

/// The assignments of a mission's crew, leader first.
pub(super) fn assignments(live: &Live, world: &World<'_>) -> Vec<Assignment> {
    let config = world.config;
    let survey = |point: LocalPoint| Task::Survey {
        point,
        height_m: live.mission.spec.survey_height_m,
        heading_rad: live.course.heading_rad,
    };
    let land = |clearance| Task::Land { point: live.spot(), approach_height_m: config.approach_height_m, clearance };
    let follow = |leader: &VehicleId| Task::Follow { leader: leader.clone(), slot: live.slot(config) };
    let Some(leader) = &live.mission.leader else { return Vec::new() };
    let (leader_task, follower_task) = match live.mission.phase {
        MissionPhase::Waiting | MissionPhase::Completed | MissionPhase::Aborted | MissionPhase::Failed => return Vec::new(),
        MissionPhase::Transit | MissionPhase::Assessing | MissionPhase::AwaitingApproval | MissionPhase::Approved => {
            (survey(live.spot()), None)
        }
        MissionPhase::Joining => (survey(live.spot()), Some(follow(leader))),
        MissionPhase::Clearing => (survey(live.stand_off(config)), Some(follow(leader))),
        MissionPhase::Landing => (survey(live.stand_off(config)), Some(land(clearance(live, world)))),
        // Halfway down is no place to hold: a follower over the spot climbs to the approach height and waits there.
        MissionPhase::Paused if live.course.paused_from == Some(MissionPhase::Landing) => (Task::Hold, Some(land(None))),
        MissionPhase::Paused => (Task::Hold, Some(Task::Hold)),
    };
    let follower = live.mission.follower.iter().zip(follower_task);
    std::iter::once((leader, leader_task))
        .chain(follower)
        .map(|(vehicle, task)| Assignment { vehicle: vehicle.clone(), task })
        .collect()
}

/// Permission to descend: only in the landing phase, on a safe verdict that is fresh and of this spot, while the leader is known
/// to be clear of the spot and nobody else is there. It ends by itself when no newer verdict renews it.
pub(super) fn clearance(live: &Live, world: &World<'_>) -> Option<Clearance> {
    if live.mission.phase != MissionPhase::Landing {
        return None;
    }
    let sea = live.safe_sea(world)?;
    let leader = world.fleet.fresh(live.mission.leader.as_ref()?, world.now, world.config)?;
    let clear_m = LocalPoint::from(leader.position_ned_m).distance_m(&live.spot());
    if clear_m < world.config.separation_m || occupied(live, world).is_some() {
        return None;
    }
    let valid_until = sea.verdict.valid_until.min(sea.stamp.plus_secs_f64(world.config.clearance_s));
    (valid_until > world.now).then_some(Clearance { verdict: VerdictState::Safe, sea_state_stamp: sea.stamp, valid_until })
}

/// Why there is no clearance, for people.
pub(super) fn why_not_cleared(live: &Live, world: &World<'_>) -> String {
    match live.sea(world) {
        None => "no fresh sea state of the spot".into(),
        Some(sea) if sea.verdict.state != VerdictState::Safe => {
            format!("the verdict is {}: {}", sea.verdict.state.as_str(), super::waters::failed_checks(sea))
        }
        Some(_) => match occupied(live, world) {
            Some(other) => format!("{other} is on or over the spot"),
            None => "the leader is not known to be clear of the spot".into(),
        },
    }
}
