//! What is refused at the edge, and with which words.

mod common;

use common::{World, id, mission_id, spec};
use halcyon_mission_planner::Config;
use halcyon_model::{LocalPoint, MissionAction, MissionCommand, MissionSpec, Stamp};

#[track_caller]
fn refused(change: impl FnOnce(&mut MissionSpec), words: &str) {
    let mut world = World::new(1, 1);
    let mut bad = spec(60.0, 0.0);
    change(&mut bad);
    let reply = world.command_as("anna", MissionAction::Create(mission_id("m"), bad));
    assert!(!reply.accepted && reply.reason.contains(words), "{}", reply.reason);
    assert!(world.missions.is_empty() && reply.mission.is_none());
}

#[test]
fn a_mission_that_cannot_be_flown_is_refused() {
    refused(|s| s.point = LocalPoint::new(f64::NAN, 0.0), "finite");
    refused(|s| s.point = LocalPoint::new(0.0, f64::INFINITY), "finite");
    refused(|s| s.point = LocalPoint::new(400.0, 300.0), "500 m from the fleet's origin, at most 450 m");
    refused(|s| s.survey_height_m = 2.9, "survey height must be 3 to 30 m, not 2.9 m");
    refused(|s| s.survey_height_m = 31.0, "survey height");
    refused(|s| s.survey_height_m = f64::NAN, "survey height");
    refused(|s| s.leader = Some(id("leader-9")), "leader-9 is not known");
    refused(|s| s.leader = Some(id("follower-1")), "follower-1 is a follower, not a leader");
    refused(|s| s.follower = Some(id("leader-1")), "leader-1 is a leader, not a follower");
    refused(|s| s.name = "x".repeat(129), "name");
}

#[test]
fn the_same_creation_again_is_answered_as_before() {
    let mut world = World::new(1, 1);
    let create = MissionAction::Create(mission_id("m"), spec(60.0, 0.0));
    let first = world.command_as("anna", create.clone());
    let history = world.mission("m").history.clone();
    let again = world.command_as("anna", create);
    assert_eq!(first, again);
    assert_eq!((world.missions.len(), &world.mission("m").history), (1, &history));
    let other = world.command_as("anna", MissionAction::Create(mission_id("m"), spec(60.0, 1.0)));
    assert!(!other.accepted && other.reason.contains("other content"));
}

#[test]
fn late_early_and_nameless_commands_are_refused() {
    let mut world = World::new(1, 1);
    let at = |seconds: f64, world: &World| world.now.plus_secs_f64(seconds);
    let cases: [(f64, f64, &str, &str); 5] = [
        (-10.0, -1.0, "anna", "deadline passed 1.0 s ago"),
        (3.0, 10.0, "anna", "3.0 s in the future"),
        (0.0, -0.5, "anna", "before its stamp"),
        (0.0, 5.0, " ", "who gives it"),
        (0.0, 5.0, &"x".repeat(200), "who gives it"),
    ];
    for (stamp_s, deadline_s, who, words) in cases {
        let (stamp, deadline): (Stamp, Stamp) = (at(stamp_s, &world), at(deadline_s, &world));
        let action = MissionAction::Create(mission_id("m"), spec(60.0, 0.0));
        let reply = world.send(&MissionCommand { stamp, deadline, who: who.into(), action });
        assert!(!reply.accepted && reply.reason.contains(words), "{}", reply.reason);
    }
    assert!(world.missions.is_empty());
    let (stamp, deadline) = (at(1.5, &world), at(5.0, &world));
    let action = MissionAction::Create(mission_id("m"), spec(60.0, 0.0));
    assert!(world.send(&MissionCommand { stamp, deadline, who: "anna".into(), action }).accepted, "a little skew is borne");
}

#[test]
fn actions_that_do_not_fit_are_refused_with_the_reason() {
    let mut world = World::new(1, 1);
    let m = || mission_id("m");
    for action in [
        MissionAction::Approve(m()),
        MissionAction::Dispatch(m()),
        MissionAction::Pause(m()),
        MissionAction::Resume(m()),
        MissionAction::Abort(m()),
    ] {
        let reply = world.command_as("anna", action);
        assert!(!reply.accepted && reply.reason.contains("there is no mission m"), "{}", reply.reason);
    }
    world.create("m", spec(60.0, 0.0));
    let resume = world.command_as("anna", MissionAction::Resume(m()));
    assert!(!resume.accepted && resume.reason.contains("not paused"));
    let approve = world.command_as("anna", MissionAction::Approve(m()));
    assert!(!approve.accepted && approve.reason.contains("transit"), "{}", approve.reason);
    world.run_to_end("m", 240.0);
    for action in [MissionAction::Abort(m()), MissionAction::Pause(m())] {
        let reply = world.command_as("anna", action);
        assert!(!reply.accepted && reply.reason.contains("already completed"), "{}", reply.reason);
    }
}

#[test]
fn spots_keep_their_distance_and_missions_their_number() {
    let mut world = World::with(Config { missions_max: 2, ..Config::default() }, 1, 1);
    world.create("a", spec(60.0, 0.0));
    let near = world.command_as("anna", MissionAction::Create(mission_id("b"), spec(60.0, 29.0)));
    assert!(!near.accepted && near.reason.contains("mission a is 29.0 m away, at least 30 m"), "{}", near.reason);
    world.create("b", spec(60.0, 30.0));
    let third = world.command_as("anna", MissionAction::Create(mission_id("c"), spec(200.0, 0.0)));
    assert!(!third.accepted && third.reason.contains("2 missions are under way"), "{}", third.reason);
}

#[test]
fn nobody_can_make_a_history_grow_without_end() {
    let mut world = World::new(1, 1);
    world.create("m", spec(60.0, 0.0));
    let refused = (0..2000).find_map(|_| {
        let pause = world.command_as("anna", MissionAction::Pause(mission_id("m")));
        world.command_as("anna", MissionAction::Resume(mission_id("m")));
        (!pause.accepted).then_some(pause.reason)
    });
    assert!(refused.is_some_and(|reason| reason.contains("only go on or be aborted")));
    world.command(MissionAction::Abort(mission_id("m")));
}
