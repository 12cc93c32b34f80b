//! The planner is killed and comes back from its store.

mod common;

use common::{World, mission_id, spec};
use halcyon_model::{MissionAction, MissionPhase, VerdictState};

use MissionPhase::{
    Approved, Assessing, AwaitingApproval, Clearing, Completed, Failed, Joining, Landing, Paused, Transit, Waiting,
};

#[test]
fn killed_for_a_moment_in_any_phase_the_mission_still_completes() {
    for phase in [Waiting, Transit, Assessing, Joining, Clearing, Landing] {
        let mut world = World::new(1, 2);
        world.create("m", spec(60.0, 0.0));
        world.run_to("m", if phase == Waiting { Transit } else { phase }, 120.0);
        world.run(1.0);
        let before = world.plan.as_ref().unwrap().generation;
        world.restart(2.0);
        assert!(world.mission("m").history.last().unwrap().why.contains("restarted"));
        assert_eq!(world.run_to_end("m", 240.0), Completed, "{phase:?}: {:#?}", world.mission("m").history);
        assert!(world.plan.as_ref().unwrap().generation > before);
        assert!(world.least_separation_m >= 5.0);
        world.run(60.0);
        assert!(!world.vehicle("leader-1").airborne(), "{phase:?}");
    }
}

#[test]
fn killed_long_enough_for_plans_to_lapse_it_goes_on_when_it_is_back() {
    for phase in [Transit, Assessing, Joining, Clearing, Landing] {
        let mut world = World::new(1, 2);
        world.create("m", spec(60.0, 0.0));
        world.run_to("m", phase, 120.0);
        world.run(1.0);
        world.restart(20.0);
        assert_eq!(world.run_to_end("m", 240.0), Completed, "{phase:?}: {:#?}", world.mission("m").history);
    }
}

#[test]
fn an_approval_is_not_kept_without_a_verdict() {
    let mut world = World::new(1, 1);
    let mut mission = common::manual(60.0, 0.0);
    mission.dispatch_on_approval = false;
    world.create("m", mission);
    world.run_to("m", AwaitingApproval, 120.0);
    world.command(MissionAction::Approve(mission_id("m")));
    assert_eq!(world.phase("m"), Approved);
    world.verdict = None;
    world.restart(2.0);
    world.run(1.0);
    assert_eq!(world.phase("m"), Assessing);
    world.verdict = Some(VerdictState::Safe);
    world.run_to("m", AwaitingApproval, 60.0);
}

#[test]
fn a_pause_outlives_a_restart() {
    let mut world = World::new(1, 1);
    world.create("m", spec(60.0, 0.0));
    world.run_to("m", Joining, 120.0);
    world.command(MissionAction::Pause(mission_id("m")));
    world.restart(2.0);
    world.run(10.0);
    assert_eq!(world.phase("m"), Paused);
    world.command(MissionAction::Resume(mission_id("m")));
    assert_eq!(world.phase("m"), Joining);
    assert_eq!(world.run_to_end("m", 120.0), Completed);
}

#[test]
fn a_leader_that_went_home_meanwhile_ends_the_mission_safely() {
    for phase in [Transit, Assessing, Clearing, Landing] {
        let mut world = World::new(1, 1);
        world.create("m", spec(60.0, 0.0));
        world.run_to("m", phase, 120.0);
        world.run(if phase == Transit { 8.0 } else { 1.0 });
        let home = world.vehicle("leader-1").home;
        world.restart(30.0);
        world.vehicle("leader-1").position_m = nalgebra::Vector3::new(home.north_m, home.east_m, 0.0);
        world.vehicle("leader-1").armed = false;
        world.vehicle("leader-1").activity = halcyon_model::Activity::Landed;
        assert_eq!(world.run_to_end("m", 40.0), Failed, "{phase:?}: {:#?}", world.mission("m").history);
        assert!(world.last_why("m").contains("leader-1 is on the ground"), "{}", world.last_why("m"));
        world.run(60.0);
        assert!(world.vehicles.iter().all(|vehicle| !vehicle.airborne()), "{phase:?}");
    }
}

#[test]
fn a_follower_that_landed_while_the_planner_was_away_has_completed_the_mission() {
    let mut world = World::new(1, 1);
    world.create("m", spec(60.0, 0.0));
    world.run_to("m", Landing, 120.0);
    while world.vehicle("follower-1").position_m.z > 0.5 {
        world.run(0.2);
    }
    world.restart(3.0);
    assert!(!world.vehicle("follower-1").airborne());
    assert_eq!(world.run_to_end("m", 2.0), Completed);
}

#[test]
fn vehicles_on_their_way_home_are_not_forgotten() {
    let mut world = World::new(1, 1);
    world.create("m", spec(60.0, 0.0));
    world.run_to("m", Clearing, 120.0);
    world.command(MissionAction::Abort(mission_id("m")));
    world.restart(2.0);
    world.run(1.0);
    assert_eq!(world.plan.as_ref().unwrap().assignments.len(), 2);
    world.run(60.0);
    assert!(world.vehicles.iter().all(|vehicle| vehicle.place().distance_m(&vehicle.home) < 1.0));
    assert_eq!(world.plan.as_ref().unwrap().assignments, []);
    world.restart(1.0);
    world.run(1.0);
    assert_eq!(world.plan.as_ref().unwrap().assignments, [], "who was released stays released");
}

#[test]
fn generations_increase_over_many_restarts() {
    let mut world = World::new(1, 1);
    let mut last = 0;
    for _ in 0..20 {
        world.run(3.0);
        let generation = world.plan.as_ref().unwrap().generation;
        assert!(generation > last);
        last = generation;
        world.restart(0.2);
        world.run(0.4);
        assert!(world.plan.as_ref().unwrap().generation > last);
    }
}

#[test]
fn a_planner_that_lost_its_store_still_gets_past_what_vehicles_have_seen() {
    let mut world = World::new(1, 1);
    for vehicle in &mut world.vehicles {
        vehicle.generation = 5_000_000;
    }
    world.run(1.0);
    assert!(world.plan.as_ref().unwrap().generation > 5_000_000);
    world.create("m", spec(60.0, 0.0));
    assert_eq!(world.run_to_end("m", 240.0), Completed);
}

#[test]
fn an_old_id_is_known_after_a_restart() {
    let mut world = World::new(1, 1);
    world.create("m", spec(60.0, 0.0));
    world.command(MissionAction::Abort(mission_id("m")));
    world.restart(1.0);
    let again = world.command_as("anna", MissionAction::Create(mission_id("m"), spec(60.0, 0.0)));
    assert!(again.accepted);
    assert_eq!(world.missions.len(), 1);
    let other = world.command_as("anna", MissionAction::Create(mission_id("m"), spec(61.0, 0.0)));
    assert!(!other.accepted && other.reason.contains("other content"), "{}", other.reason);
}
