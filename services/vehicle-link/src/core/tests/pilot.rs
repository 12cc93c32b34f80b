//! The pilot wins: by the motors' switch on the ground, too; and what the autopilot has shown to be done is not asked for again.

use halcyon_model::{Activity, FlightMode, Severity, VehicleAction};
use nalgebra::Vector3;

use super::world::{World, config, id, survey};
use crate::core::commands::{Command, CommandError};
use crate::core::executor::{Executor, Output};

fn plan(world: &mut World) {
    world.plan(&[(0, survey(40.0, 0.0))], 5.0);
}

fn asked(world: &World, command: Command) -> bool {
    world.outputs[0].contains(&Output::Request(command))
}

/// Armed for a take-off that the autopilot doesn't begin.
fn armed_on_the_ground() -> World {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.until(30.0, plan, |world| world.copters[0].armed);
    world.step();
    world
}

#[test]
fn motors_that_somebody_stopped_on_the_ground_stay_off_until_guided_is_set() {
    let mut world = armed_on_the_ground();
    world.copters[0].armed = false;
    world.step();
    world.run(60.0, |world| {
        plan(world);
        assert!(!asked(world, Command::Arm) && !world.copters[0].armed, "started again");
    });
    assert!(matches!(world.activity(0), Activity::PilotControl), "{:?}", world.activity(0));
    let told = |(_, note): &(usize, crate::core::executor::Note)| {
        note.severity == Severity::Warning && note.what.contains("not by us")
    };
    assert_eq!(world.notes.iter().filter(|note| told(note)).count(), 1);
    // The plan with another task is no person's word either.
    world.run(5.0, |world| drop(world.plan(&[(0, survey(80.0, 0.0))], 5.0)));
    assert!(!world.copters[0].armed);
    world.command(0, VehicleAction::SetMode(FlightMode::Guided));
    world.until(60.0, |world| drop(world.plan(&[(0, survey(80.0, 0.0))], 5.0)), |world| world.height(0) > 3.0);
}

/// What it stops itself, as when a plan ends before the take-off, it starts again for the next.
#[test]
fn motors_that_halcyon_stopped_it_starts_again() {
    let mut world = armed_on_the_ground();
    world.command(0, VehicleAction::Disarm);
    world.run(2.0, plan);
    assert!(!world.copters[0].armed);
    world.command(0, VehicleAction::SetMode(FlightMode::Guided));
    world.until(60.0, plan, |world| world.height(0) > 3.0);
}

#[test]
fn home_is_fixed_when_the_autopilot_says_so_and_again_after_it_started_anew() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.until(30.0, plan, |world| asked(world, Command::SetHome));
    let mut executor = Executor::new(config("v0"));
    let timed_out = Err(CommandError::TimedOut { tries: 4, percent: None });
    executor.observe_outcome(&Command::SetHome, &timed_out, world.now);
    world.executors[0] = executor;
    world.copters[0].mode = FlightMode::Guided;
    world.step();
    world.until(30.0, plan, |world| asked(world, Command::SetHome));
    // Done, it is not asked for again, unless the autopilot forgot.
    world.until(30.0, plan, |world| world.copters[0].armed);
    world.command(0, VehicleAction::Disarm);
    world.run(1.0, plan);
    world.copters[0].boot_s = 1.0;
    world.step();
    world.command(0, VehicleAction::SetMode(FlightMode::Guided));
    assert!(!asked(&world, Command::SetHome));
    world.until(30.0, plan, |world| asked(world, Command::SetHome));
}

#[test]
fn a_place_that_jumped_while_the_estimator_is_bad_is_not_flown_to() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.run(5.0, plan);
    let place = world.copters[0].position;
    world.copters[0].estimator_ok = false;
    world.run(2.0, plan);
    world.copters[0].off = Vector3::new(9.0, 0.0, 0.0);
    world.run(2.0, plan);
    assert_eq!(world.copters[0].mode, FlightMode::Guided);
    assert!((world.copters[0].position - place).norm() < 0.5, "{}", world.copters[0].position);
}

/// The height that the autopilot believes in is 2.5 m too much, and nothing else tells.
#[test]
fn a_descent_ends_on_the_water_though_the_height_says_that_there_is_further_to_go() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.copters[0].off = Vector3::new(0.0, 0.0, -2.5);
    // It finds the ground in LAND only.
    world.copters[0].finds_ground = false;
    let cleared = |world: &mut World| {
        let until = world.now.plus_secs_f64(1.0);
        world.plan(&[(0, super::world::land(40.0, 0.0, Some(until)))], 5.0);
    };
    world.until(60.0, cleared, |world| world.copters[0].mode == FlightMode::Land);
    assert!(world.height(0) < 0.1, "{}", world.height(0));
    world.copters[0].finds_ground = true;
    world.until(10.0, cleared, |world| !world.copters[0].armed);
}

/// At 3 m/s, told once that nobody will guide any more: it stops, and stays there.
#[test]
fn the_last_target_stops_the_vehicle() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(0.0, 0.0, -5.0));
    world.until(
        30.0,
        |world| drop(world.plan(&[(0, survey(100.0, 0.0))], 5.0)),
        |world| world.copters[0].velocity.norm() > 2.5,
    );
    let last = world.executors[0].farewell(world.now).unwrap();
    let position = world.copters[0].position;
    assert!(last.velocity_ned_mps.norm() == 0.0 && last.acceleration_ned_mps2.is_none());
    assert!((0.5..8.0).contains(&(last.position_ned_m.x - position.x)), "{} {position}", last.position_ned_m);
    // A vehicle that the pilot has gets none.
    world.copters[0].mode = FlightMode::Loiter;
    world.step();
    assert_eq!(world.executors[0].farewell(world.now), None);
}

/// Sixty-four that fell silent make room for one that is there.
#[test]
fn the_dead_make_room_for_the_living() {
    let mut executor = Executor::new(config("v0"));
    let world = World::new(&[(0.0, 0.0)]);
    let state = |name: &str, now| halcyon_model::VehicleState { vehicle: id(name), ..world.copters[0].state(now) };
    for number in 0..64 {
        executor.observe_neighbour(state(&format!("old{number}"), world.now), world.now);
    }
    let soon = world.now.plus_secs_f64(10.0);
    executor.observe_neighbour(state("new", soon), soon);
    assert!(!executor.knows(&id("new")), "the others may yet speak");
    let late = world.now.plus_secs_f64(100.0);
    executor.observe_neighbour(state("new", late), late);
    assert!(executor.knows(&id("new")));
}
