//! Letting the payload go, once the follower has landed: it is asked for, answered or not, and then it is a person's choice.
//!
//! The vehicle has the last word: it releases nothing in the air. Asking again is harmless, since what is open is opened again; so
//! after a restart, and after a pause, it is asked for anew. What is never done is to go on as if it had been let go.

use halcyon_model::{MissionPhase, Stamp};

use super::flow::{Step, overdue};
use super::live::{Live, World};
use super::record::ReleaseOrder;

/// Motors that still turn after the landing are waited for so long, seconds; then the vehicle decides.
const MOTORS_S_MAX: f64 = 10.0;

/// One request to let it go.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Request {
    attempt: u32,
    at: Stamp,
    answer: Option<Result<(), String>>,
}

/// What became of the release: completed, or a person must choose, or nobody did.
pub(super) fn releasing(live: &mut Live, world: &World<'_>) -> Option<Step> {
    if let Some(problem) = &live.mission.release_problem {
        let what = format!("the payload was not released ({problem}), and nobody decided");
        return overdue(live, world, world.config.release_wait_max_s, &what);
    }
    let request = live.release.as_ref()?;
    let waited_s = world.now.seconds_since(request.at);
    let problem = match &request.answer {
        Some(Ok(())) => return Some((MissionPhase::Completed, format!("{}, and its payload is released", landed(live)))),
        Some(Err(why)) => why.clone(),
        None if waited_s > world.config.release_answer_s => format!("no answer within {:.0} s", world.config.release_answer_s),
        None => return None,
    };
    let why = format!("the payload was not released: {problem}; release it again, or skip it");
    live.mission.release_problem = Some(problem);
    Some((MissionPhase::Releasing, why))
}

/// The request that is to be made now: once in a stay in this phase, when the motors are off.
pub(super) fn due(live: &mut Live, world: &World<'_>) -> Option<ReleaseOrder> {
    let is_due =
        live.mission.phase == MissionPhase::Releasing && live.mission.release_problem.is_none() && live.release.is_none();
    let vehicle = live.mission.follower.clone().filter(|_| is_due)?;
    let is_off = world.fleet.fresh(&vehicle, world.now, world.config).is_some_and(|state| !state.armed);
    if !is_off && world.now.seconds_since(live.entered) < MOTORS_S_MAX {
        return None;
    }
    live.release_attempts += 1;
    let attempt = live.release_attempts;
    live.release = Some(Request { attempt, at: world.now, answer: None });
    let deadline = world.now.plus_secs_f64(world.config.release_answer_s);
    Some(ReleaseOrder { mission: live.mission.id.clone(), vehicle, attempt, stamp: world.now, deadline })
}

/// The vehicle's answer to request number `attempt`; to an older one, none that counts.
pub(super) fn answered(live: &mut Live, attempt: u32, answer: Result<(), String>) {
    if let Some(request) = live.release.as_mut().filter(|request| request.attempt == attempt && request.answer.is_none()) {
        request.answer = Some(answer);
    }
}

/// How the landing went, in words.
pub(super) fn landed(live: &Live) -> String {
    match live.mission.touchdown {
        Some(touchdown) => format!("the follower landed {:.2} m from the spot", touchdown.distance_m(&live.spot())),
        None => "the follower landed".into(),
    }
}
