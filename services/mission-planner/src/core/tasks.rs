//! What each vehicle of a mission is to do in its phase, and the permission to descend.

use halcyon_model::{
    Assignment, CalmForecast, CalmWindow, Clearance, LocalPoint, MissionPhase, SeaState, Stamp, Task, VehicleId, VerdictState,
};

use super::flow::occupied;
use super::live::{Live, World};

/// A forecast of calm is passed on if it is of a place this near to the spot, metres: further, other waves come.
const CALM_WITHIN_M: f64 = 3.0;
/// And if its error is at most this share of the sea's own standard deviation: at 1 nothing is known.
const CALM_ERROR_SHARE_MAX: f64 = 0.6;
/// So many windows at most: the soonest.
const WINDOWS_MAX: usize = 8;

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
        // On the water it stays, its task still the landing, so that a release of its own goes on, too; the leader has nothing more to do.
        MissionPhase::Releasing => (Task::Return, Some(land(None))),
        // Halfway down is no place to hold: a follower over the spot climbs to the approach height and waits there.
        MissionPhase::Paused if matches!(live.course.paused_from, Some(MissionPhase::Landing | MissionPhase::Releasing)) => {
            (Task::Hold, Some(land(None)))
        }
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
    let windows = calm_windows(live, sea, world.now);
    (valid_until > world.now).then_some(Clearance {
        verdict: VerdictState::Safe,
        sea_state_stamp: sea.stamp,
        valid_until,
        windows,
    })
}

/// Quiet moments ahead at the spot, if the forecast is of the spot and knows more than that the sea has waves.
fn calm_windows(live: &Live, sea: &SeaState, now: Stamp) -> Vec<CalmWindow> {
    let useful =
        |calm: &&CalmForecast| calm.place.distance_m(&live.spot()) <= CALM_WITHIN_M && calm.error_share <= CALM_ERROR_SHARE_MAX;
    let Some(calm) = sea.calm.as_ref().filter(useful) else { return Vec::new() };
    calm.windows.iter().filter(|window| window.to > now).take(WINDOWS_MAX).copied().collect()
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
