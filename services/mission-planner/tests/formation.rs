//! Standing formations: ordered, changed, used by missions, kept over a restart, disbanded.

mod common;

use common::{World, id, spec};
use halcyon_model::{FormationSpec, LocalPoint, MissionAction, MissionPhase, Shape, Slot, Task};

fn order(shape: Shape, followers: &[&str]) -> FormationSpec {
    let followers = followers.iter().map(|follower| id(follower)).collect();
    FormationSpec { leader: id("leader-1"), shape, spacing_m: 8.0, followers }
}

fn slot(world: &World, vehicle: &str) -> Option<Slot> {
    match world.task(vehicle) {
        Some(Task::Follow { leader, slot }) if *leader == id("leader-1") => Some(*slot),
        _ => None,
    }
}

/// A leader that hovers over a place by its pilot's will, not by a plan.
fn hovering(followers: usize) -> World {
    let mut world = World::new(1, followers);
    let leader = world.vehicle("leader-1");
    leader.position_m = nalgebra::Vector3::new(40.0, 0.0, 5.0);
    leader.activity = halcyon_model::Activity::Holding { settled: true };
    world.run(0.4);
    world
}

#[test]
fn an_order_that_cannot_be_flown_is_refused_with_the_reason() {
    let mut world = hovering(2);
    let mut refused = |spec: FormationSpec, words: &str| {
        let reply = world.command_as("anna", MissionAction::Form(spec));
        assert!(!reply.accepted && reply.reason.contains(words), "{}", reply.reason);
    };
    for spacing_m in [4.9, 101.0, f64::NAN, f64::INFINITY] {
        refused(FormationSpec { spacing_m, ..order(Shape::Line, &[]) }, "the spacing must be 5 to 100 m");
    }
    refused(FormationSpec { leader: id("nobody"), ..order(Shape::Line, &[]) }, "nobody is not known");
    refused(FormationSpec { leader: id("follower-1"), ..order(Shape::Line, &[]) }, "follower-1 is a follower");
    refused(order(Shape::Line, &["follower-1", "follower-1"]), "named twice");
    refused(order(Shape::Line, &["follower-9"]), "follower-9: not heard yet");
    refused(order(Shape::Line, &["leader-1"]), "leader-1: not a follower");
    world.vehicle("follower-1").battery = Some(0.2);
    world.run(0.2);
    let reply = world.command_as("anna", MissionAction::Form(order(Shape::Line, &["follower-1"])));
    assert!(reply.reason.contains("follower-1: its battery is below"), "{}", reply.reason);
    let reply = world.command_as("anna", MissionAction::Disband(id("leader-1")));
    assert!(reply.reason.contains("has no formation"), "{}", reply.reason);
}

#[test]
fn followers_take_off_join_and_keep_their_slots_and_a_new_shape_is_the_shorter_way() {
    let mut world = hovering(4);
    world.command(MissionAction::Form(order(Shape::Line, &[])));
    world.run(60.0);
    let mut rights: Vec<_> = (1..=4).map(|n| slot(&world, &format!("follower-{n}")).unwrap().right_m).collect();
    rights.sort_by(f64::total_cmp);
    assert_eq!(rights, [-16.0, -8.0, 8.0, 16.0]);
    // The leader flies with its nose to the north and all stand to the west: nobody passes anybody.
    for n in 1..4 {
        let (inner, outer) = (format!("follower-{n}"), format!("follower-{}", n + 1));
        assert!(slot(&world, &inner).unwrap().right_m > slot(&world, &outer).unwrap().right_m);
    }
    assert!(world.vehicles.iter().all(common::FakeVehicle::airborne));
    // The same again changes nothing.
    let generation = world.plan.as_ref().unwrap().assignments.clone();
    world.command(MissionAction::Form(order(Shape::Line, &[])));
    assert_eq!(world.plan.as_ref().unwrap().assignments, generation);
    world.command(MissionAction::Form(order(Shape::Vee, &[])));
    world.run(20.0);
    for n in 1..=4 {
        let kept = slot(&world, &format!("follower-{n}")).unwrap();
        assert!(kept.forward_m < 0.0, "a vee is behind");
    }
    world.command(MissionAction::Disband(id("leader-1")));
    world.run(90.0);
    for n in 1..=4 {
        assert!(!world.vehicle(&format!("follower-{n}")).airborne());
        assert!(slot(&world, &format!("follower-{n}")).is_none());
    }
}

#[test]
fn whoever_is_left_out_of_the_next_order_goes_home() {
    let mut world = hovering(3);
    world.command(MissionAction::Form(order(Shape::Line, &["follower-1", "follower-2"])));
    world.run(40.0);
    world.command(MissionAction::Form(order(Shape::Line, &["follower-2", "follower-3"])));
    assert_eq!(world.task("follower-1"), Some(&Task::Return));
    // Called back on the ground, it may be called again at once.
    world.run(90.0);
    world.command(MissionAction::Form(order(Shape::Line, &["follower-1"])));
    assert!(slot(&world, "follower-1").is_some());
    world.command(MissionAction::Form(order(Shape::Line, &["follower-2", "follower-3"])));
    assert!(slot(&world, "follower-2").is_some() && slot(&world, "follower-3").is_some());
}

#[test]
fn a_mission_of_the_leader_takes_its_follower_from_the_formation_for_good() {
    let mut world = World::new(1, 3);
    let followers = ["follower-1", "follower-2", "follower-3"];
    world.create("m", spec(60.0, 0.0));
    world.run_to("m", MissionPhase::Transit, 60.0);
    // As far apart as the mission's own slot: one of the three stands just where that is, and must make room.
    world.command(MissionAction::Form(FormationSpec { spacing_m: 7.0, ..order(Shape::Line, &followers) }));
    assert_eq!(world.run_to_end("m", 300.0), MissionPhase::Completed, "{:#?}", world.mission("m").history);
    let sent = world.mission("m").follower.clone().unwrap();
    assert!(world.mission("m").touchdown.unwrap().distance_m(&LocalPoint::new(60.0, 0.0)) < 1.0);
    assert!(slot(&world, sent.as_str()).is_none());
    // The leader goes home after its mission, and so do they all.
    world.run(120.0);
    for follower in followers.iter().filter(|follower| **follower != sent.as_str()) {
        assert!(!world.vehicle(follower).airborne(), "{follower}: {:?}", world.task(follower));
    }
}

#[test]
fn missions_of_other_leaders_leave_it_alone() {
    let mut world = World::new(2, 2);
    let leader = world.vehicle("leader-1");
    leader.position_m = nalgebra::Vector3::new(-60.0, 0.0, 5.0);
    leader.activity = halcyon_model::Activity::Holding { settled: true };
    world.run(0.4);
    world.command(MissionAction::Form(order(Shape::Line, &["follower-1"])));
    let mut mission = spec(60.0, 0.0);
    mission.leader = Some(id("leader-2"));
    world.create("m", mission);
    assert_eq!(world.run_to_end("m", 300.0), MissionPhase::Completed);
    assert_eq!(world.mission("m").follower, Some(id("follower-2")));
    assert!(slot(&world, "follower-1").is_some());
}

#[test]
fn a_formation_outlives_a_restart_of_the_planner_and_so_does_its_end() {
    let mut world = hovering(2);
    world.command(MissionAction::Form(order(Shape::Column, &["follower-1", "follower-2"])));
    world.run(30.0);
    let before = (slot(&world, "follower-1"), slot(&world, "follower-2"));
    assert!(before.0.is_some() && before.1.is_some());
    world.restart(2.0);
    world.run(1.0);
    assert_eq!((slot(&world, "follower-1"), slot(&world, "follower-2")), before);
    world.command(MissionAction::Disband(id("leader-1")));
    world.run(60.0);
    world.restart(2.0);
    world.run(1.0);
    assert_eq!((slot(&world, "follower-1"), slot(&world, "follower-2")), (None, None));
}
