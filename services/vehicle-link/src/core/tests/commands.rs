//! Direct commands.

use halcyon_model::{Activity, FlightMode, LocalPoint, Slot, Task, VehicleAction, VehicleCommand};
use nalgebra::Vector3;

use super::world::{World, follow, id, survey};
use crate::core::commands::Command;
use crate::core::executor::Decision;

fn go_to(north_m: f64, height_m: f64) -> VehicleAction {
    VehicleAction::GoTo { point: LocalPoint::new(north_m, 0.0), height_m }
}

#[track_caller]
fn refused(decision: &Decision, expected: &str) {
    assert!(matches!(decision, Decision::Refused(why) if why.contains(expected)), "{decision:?} should say {expected:?}");
}

fn flying() -> World {
    let mut world = World::new(&[(0.0, 0.0), (0.0, -8.0)]);
    world.airborne(0, Vector3::new(20.0, 0.0, -5.0));
    world.run(1.0, |_| {});
    world
}

#[test]
fn each_refusal_says_why() {
    let mut world = World::new(&[(0.0, 0.0), (0.0, -8.0)]);
    refused(&world.command(0, VehicleAction::Hold), "nothing heard");
    world.run(0.5, |_| {});
    let late = VehicleCommand {
        stamp: world.now,
        deadline: world.now.plus_secs_f64(-0.1),
        who: "test".into(),
        vehicle: id("v0"),
        action: VehicleAction::Arm,
    };
    let now = world.now;
    refused(&world.executors[0].command(&late, now), "deadline");
    let other = VehicleCommand { vehicle: id("v9"), deadline: now, ..late };
    refused(&world.executors[0].command(&other, now), "this is v0, not v9");
    refused(&world.command(0, go_to(10.0, 6.0)), "take off first");
    refused(&world.command(0, VehicleAction::Land), "take off first");
    refused(&world.command(0, VehicleAction::Return), "take off first");
    world.copters[0].ready = false;
    world.run(0.2, |_| {});
    refused(&world.command(0, VehicleAction::TakeOff { height_m: 6.0 }), "arming checks");
    refused(&world.command(0, VehicleAction::TakeOff { height_m: f64::NAN }), "arming checks");
    refused(&world.command(0, VehicleAction::TakeOff { height_m: 100.0 }), "outside");

    let mut world = flying();
    refused(&world.command(0, VehicleAction::Disarm), "in the air");
    refused(&world.command(0, VehicleAction::TakeOff { height_m: 6.0 }), "in the air");
    refused(&world.command(0, go_to(10.0, 3.0)), "below the safe height");
    refused(&world.command(0, go_to(10.0, f64::NAN)), "not finite");
    refused(&world.command(0, go_to(900.0, 6.0)), "outside the fence");
    let close = VehicleAction::Follow { leader: id("v1"), slot: Slot { forward_m: 0.0, right_m: 4.0, up_m: 0.0 } };
    refused(&world.command(0, close), "5.0 m is the least");
    let grounded = VehicleAction::Follow { leader: id("v1"), slot: Slot { forward_m: 0.0, right_m: 7.0, up_m: 0.0 } };
    refused(&world.command(0, grounded), "not flying");
    let unknown = VehicleAction::Follow { leader: id("v7"), slot: Slot { forward_m: 0.0, right_m: 7.0, up_m: 0.0 } };
    refused(&world.command(0, unknown), "not been heard");
    world.copters[0].mode = FlightMode::Loiter;
    world.run(0.2, |_| {});
    refused(&world.command(0, go_to(10.0, 6.0)), "the pilot has the vehicle");
    refused(&world.command(0, VehicleAction::Return), "the pilot has the vehicle");
    world.copters[0].silent = true;
    world.run(4.0, |_| {});
    refused(&world.command(0, VehicleAction::Hold), "silent");
}

#[test]
fn a_whole_flight_by_hand_without_any_plan() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.run(0.5, |_| {});
    assert!(matches!(world.command(0, VehicleAction::TakeOff { height_m: 7.0 }), Decision::Accepted(_)));
    world.until(60.0, |_| {}, |world| (world.height(0) - 7.0).abs() < 0.2);
    assert!(matches!(world.command(0, go_to(30.0, 6.0)), Decision::Accepted(_)));
    world.until(60.0, |_| {}, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
    assert!((world.copters[0].position - Vector3::new(30.0, 0.0, -6.0)).norm() < 0.5);
    world.command(0, VehicleAction::SetHeading { heading_rad: 2.0 });
    world.run(3.0, |_| {});
    assert!((world.copters[0].heading - 2.0).abs() < 1e-9);
    // No plan ever came, and none is needed: a person answers for it.
    world.run(60.0, |_| {});
    assert!((world.copters[0].position - Vector3::new(30.0, 0.0, -6.0)).norm() < 0.5, "{:?}", world.activity(0));
    world.command(0, VehicleAction::Return);
    world.until(90.0, |_| {}, |world| !world.copters[0].armed);
    assert!(world.copters[0].position.norm() < 0.5);
}

#[test]
fn a_command_stands_until_the_task_changes_not_until_it_is_renewed() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(20.0, 0.0, -5.0));
    let plan = |world: &mut World| drop(world.plan(&[(0, survey(40.0, 0.0))], 5.0));
    world.run(2.0, plan);
    world.command(0, VehicleAction::Hold);
    let x = world.copters[0].position.x;
    world.run(20.0, plan);
    assert!((world.copters[0].position.x - x).abs() < 5.0 && matches!(world.activity(0), Activity::Holding { .. }));
    world.until(90.0, |world| drop(world.plan(&[(0, Task::Return)], 5.0)), |world| !world.copters[0].armed);
}

#[test]
fn set_mode_guided_gives_the_vehicle_back_to_the_plan_and_another_mode_is_hands_off() {
    let mut world = flying();
    let plan = |world: &mut World| drop(world.plan(&[(0, survey(40.0, 0.0))], 5.0));
    world.run(1.0, plan);
    world.command(0, VehicleAction::Hold);
    world.run(2.0, plan);
    assert_eq!(
        world.command(0, VehicleAction::SetMode(FlightMode::Guided)),
        Decision::Ask(Command::SetMode(FlightMode::Guided))
    );
    world.until(30.0, plan, |world| (world.copters[0].position.x - 40.0).abs() < 0.5);
    world.command(0, VehicleAction::SetMode(FlightMode::Loiter));
    world.run(3.0, plan);
    assert_eq!(*world.activity(0), Activity::PilotControl);
    world.command(0, VehicleAction::SetMode(FlightMode::Guided));
    world.run(3.0, plan);
    assert!(matches!(world.activity(0), Activity::Holding { .. }), "{:?}", world.activity(0));
}

#[test]
fn fail_safes_stand_above_a_direct_command() {
    let mut world = flying();
    world.command(0, go_to(60.0, 6.0));
    world.copters[0].battery = Some(0.2);
    world.until(120.0, |_| {}, |world| !world.copters[0].armed);
    assert!(world.copters[0].position.norm() < 0.5);
}

#[test]
fn terminate_stops_the_motors_and_nothing_starts_them_again() {
    let mut world = flying();
    let plan = |world: &mut World| drop(world.plan(&[(0, survey(40.0, 0.0)), (1, follow("v0", 7.0))], 5.0));
    world.run(1.0, plan);
    assert_eq!(world.command(0, VehicleAction::Terminate), Decision::Ask(Command::Disarm { force: true }));
    world.run(30.0, |world| {
        plan(world);
        assert!(!world.copters[0].armed);
    });
}

#[test]
fn land_here_lands_here_and_stays() {
    let mut world = flying();
    let plan = |world: &mut World| drop(world.plan(&[(0, survey(20.0, 0.0))], 5.0));
    world.run(3.0, plan);
    world.command(0, VehicleAction::Land);
    world.until(60.0, plan, |world| !world.copters[0].armed);
    assert!((world.copters[0].position - Vector3::new(20.0, 0.0, 0.0)).norm() < 1.0);
    world.run(20.0, |world| {
        plan(world);
        assert!(!world.copters[0].armed);
    });
}
