//! The payload: let go after the landing, confirmed, or a person's choice; never taken for released.

mod common;

use common::{World, mission_id, spec};
use halcyon_model::{MissionAction, MissionPhase, Severity, Task};

use MissionPhase::{Aborted, Completed, Failed, Landing, Paused, Releasing};

/// One leader and a follower that carries a payload, landed: the mission is releasing.
#[track_caller]
fn landed(release: Option<Result<(), String>>) -> World {
    let mut world = World::new(1, 1);
    world.vehicle("follower-1").has_payload = true;
    world.release = release;
    world.create("m", spec(60.0, 0.0));
    world.run_to("m", Releasing, 240.0);
    world
}

fn refused() -> Option<Result<(), String>> {
    Some(Err("the autopilot refused: failed".into()))
}

/// Refused, and told so.
#[track_caller]
fn held() -> World {
    let mut world = landed(refused());
    world.run(3.0);
    assert_eq!(world.phase("m"), Releasing);
    assert_eq!(world.mission("m").release_problem.as_deref(), Some("the autopilot refused: failed"));
    world
}

fn release() -> MissionAction {
    MissionAction::Release(mission_id("m"))
}

fn skip() -> MissionAction {
    MissionAction::SkipRelease(mission_id("m"))
}

#[test]
fn confirmed_it_completes_the_mission_and_not_before() {
    let mut world = landed(Some(Ok(())));
    assert!(world.last_why("m").contains("m from the spot"), "{}", world.last_why("m"));
    assert_eq!(world.run_to_end("m", 5.0), Completed);
    assert_eq!(world.phases("m")[world.phases("m").len() - 3..], [Landing, Releasing, Completed]);
    assert!(world.last_why("m").contains("its payload is released"), "{}", world.last_why("m"));
    assert_eq!((world.orders.len(), world.mission("m").release_problem.clone()), (1, None));
    world.run(60.0);
    assert_eq!(world.orders.len(), 1);
}

#[test]
fn without_a_payload_the_landing_completes_it() {
    let mut world = World::new(1, 1);
    world.create("m", spec(60.0, 0.0));
    assert_eq!(world.run_to_end("m", 240.0), Completed);
    assert!(!world.phases("m").contains(&Releasing) && world.orders.is_empty());
}

#[test]
fn refused_it_waits_for_a_person_while_the_leader_goes_home_and_may_be_tried_again() {
    let mut world = held();
    let told = |notice: &&halcyon_mission_planner::core::Notice| {
        notice.severity == Severity::Warning && notice.why.contains("not released") && notice.why.contains("skip")
    };
    assert_eq!(world.notices.iter().filter(told).count(), 1);
    world.run(60.0);
    assert!(!world.vehicle("leader-1").airborne() && world.phase("m") == Releasing);
    assert!(matches!(world.task("follower-1"), Some(Task::Land { clearance: None, .. })), "{:?}", world.task("follower-1"));
    assert_eq!(world.orders.len(), 1, "not asked again by itself");
    world.command(release());
    world.run(3.0);
    assert_eq!((world.orders.len(), world.phase("m")), (2, Releasing));
    assert!(world.mission("m").release_problem.is_some(), "refused again");
    world.release = Some(Ok(()));
    world.command(release());
    assert_eq!(world.mission("m").release_problem, None);
    assert_eq!(world.run_to_end("m", 5.0), Completed);
    assert!(world.orders.windows(2).all(|pair| pair[0].attempt < pair[1].attempt));
}

#[test]
fn skipped_it_completes_with_the_payload_held_and_says_so() {
    let mut world = held();
    world.command(skip());
    assert_eq!(world.phase("m"), Completed);
    assert!(world.last_why("m").contains("not released (the autopilot refused: failed)"), "{}", world.last_why("m"));
    assert_eq!(world.mission("m").history.last().unwrap().who, "anna");
    assert!(world.mission("m").release_problem.is_some());
}

#[test]
fn without_an_answer_it_is_not_released_and_one_that_comes_too_late_changes_nothing() {
    let mut world = landed(None);
    world.run(9.0);
    assert_eq!((world.orders.len(), world.mission("m").release_problem.clone()), (1, None));
    let reply = world.command_as("anna", skip());
    assert!(!reply.accepted && reply.reason.contains("waits for the payload's answer"), "{}", reply.reason);
    world.command(release());
    assert_eq!(world.orders.len(), 1, "it is being asked already");
    world.run(3.0);
    assert_eq!(world.mission("m").release_problem.as_deref(), Some("no answer within 10 s"));
    let late = world.orders[0].clone();
    world.command(release());
    world.run(0.4);
    assert_eq!(world.orders.len(), 2);
    let _ = world.planner.observe_release(&late.mission, late.attempt, Ok(()), world.now);
    assert_eq!(world.planner.missions().next().unwrap().phase, Releasing, "the first request's answer is not the second's");
}

#[test]
fn nobody_decides_and_it_fails_with_the_follower_left_where_it_is() {
    let mut world = held();
    let max_s = world.config.release_wait_max_s;
    world.run(max_s - 10.0);
    assert_eq!(world.phase("m"), Releasing);
    assert_eq!(world.run_to_end("m", 20.0), Failed);
    assert!(world.last_why("m").contains("nobody decided"), "{}", world.last_why("m"));
    let spot = world.vehicle("follower-1").place();
    world.run(30.0);
    assert!(world.vehicle("follower-1").place().distance_m(&spot) < 0.01 && !world.vehicle("follower-1").airborne());
    assert_ne!(world.task("follower-1"), Some(&Task::Return));
}

#[test]
fn a_restart_asks_anew_and_forgets_no_refusal() {
    let mut world = landed(None);
    world.run(1.0);
    assert_eq!(world.orders.len(), 1);
    world.release = Some(Ok(()));
    world.restart(2.0);
    assert_eq!(world.phase("m"), Releasing);
    assert_eq!(world.run_to_end("m", 5.0), Completed);
    assert_eq!(world.orders.len(), 2);

    let mut world = held();
    world.restart(2.0);
    world.run(30.0);
    assert_eq!((world.orders.len(), world.phase("m")), (1, Releasing));
    assert_eq!(world.mission("m").release_problem.as_deref(), Some("the autopilot refused: failed"));
    world.release = Some(Ok(()));
    world.command(release());
    assert_eq!(world.run_to_end("m", 5.0), Completed);
}

#[test]
fn paused_it_asks_again_when_it_goes_on_and_an_abort_leaves_the_follower_on_the_water() {
    let mut world = landed(None);
    world.run(1.0);
    world.command(MissionAction::Pause(mission_id("m")));
    assert_eq!(world.phase("m"), Paused);
    world.run(20.0);
    assert!(matches!(world.task("follower-1"), Some(Task::Land { clearance: None, .. })));
    world.release = Some(Ok(()));
    world.command(MissionAction::Resume(mission_id("m")));
    assert_eq!(world.run_to_end("m", 5.0), Completed);

    let mut world = held();
    world.command(MissionAction::Abort(mission_id("m")));
    world.run(30.0);
    assert_eq!(world.phase("m"), Aborted);
    assert_ne!(world.task("follower-1"), Some(&Task::Return));
}

#[test]
fn before_the_landing_and_after_the_end_there_is_nothing_to_release() {
    let mut world = World::new(1, 1);
    world.vehicle("follower-1").has_payload = true;
    world.create("m", spec(60.0, 0.0));
    for action in [release(), skip()] {
        let reply = world.command_as("anna", action);
        assert!(!reply.accepted && reply.reason.contains("not releasing"), "{}", reply.reason);
    }
    assert_eq!(world.run_to_end("m", 240.0), Completed);
    for action in [release(), skip()] {
        let reply = world.command_as("anna", action);
        assert!(!reply.accepted && reply.reason.contains("already completed"), "{}", reply.reason);
    }
}
