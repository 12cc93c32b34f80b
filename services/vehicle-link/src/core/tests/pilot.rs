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

/// The motors stop in the air, by a crash or by somebody's hand: whoever fishes it out is not to meet turning propellers, whatever the plan
/// says next.
#[test]
fn motors_that_stopped_in_the_air_stay_off_until_guided_is_set() {
    let cut: [fn(&mut World); 2] =
        [|world| world.copters[0].armed = false, |world| drop(world.command(0, VehicleAction::Terminate))];
    for stop in cut {
        let mut world = World::new(&[(0.0, 0.0)]);
        world.until(60.0, plan, |world| world.height(0) > 3.0);
        stop(&mut world);
        let other = |world: &mut World| drop(world.plan(&[(0, survey(80.0, 0.0))], 5.0));
        world.run(30.0, |world| {
            other(world);
            assert!(!asked(world, Command::Arm));
        });
        assert!(matches!(world.activity(0), Activity::PilotControl), "{:?}", world.activity(0));
        world.command(0, VehicleAction::SetMode(FlightMode::Guided));
        world.until(60.0, other, |world| world.height(0) > 3.0);
    }
}

/// A ground station flies it on the ground already, armed in GUIDED; then somebody stops the motors.
#[test]
fn a_station_that_took_it_on_the_ground_keeps_it_when_the_motors_stop() {
    let mut world = armed_on_the_ground();
    world.executors[0].observe_station("sends targets");
    world.step();
    world.copters[0].armed = false;
    world.run(60.0, |world| {
        plan(world);
        assert!(!asked(world, Command::Arm) && !world.copters[0].armed, "started again");
    });
    assert!(matches!(world.activity(0), Activity::PilotControl), "{:?}", world.activity(0));
}

/// A command by a person ends with GUIDED, and there is no plan: the last target would be flown on at its velocity.
#[test]
fn with_nothing_more_to_do_it_holds_and_does_not_fly_on() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.step();
    world.command(0, VehicleAction::TakeOff { height_m: 5.0 });
    world.until(30.0, |_| {}, |world| world.height(0) > 4.0);
    let point = halcyon_model::LocalPoint::new(100.0, 0.0);
    world.command(0, VehicleAction::GoTo { point, height_m: 5.0 });
    world.until(30.0, |_| {}, |world| world.copters[0].velocity.norm() > 2.5);
    world.command(0, VehicleAction::SetMode(FlightMode::Guided));
    let from = world.copters[0].position;
    world.run(20.0, |world| assert!((world.copters[0].position - from).norm() < 8.0, "{}", world.copters[0].position));
    assert!(world.copters[0].velocity.norm() < 0.1, "{}", world.copters[0].velocity);
    assert!(matches!(world.activity(0), Activity::Holding { .. }), "{:?}", world.activity(0));
}

/// On the way down in LAND the estimator recovers and fails again: it is not flown up and down.
#[test]
fn a_landing_for_a_bad_estimator_is_not_broken_off_by_a_moment_of_good_news() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -30.0));
    world.run(2.0, plan);
    world.copters[0].estimator_ok = false;
    world.until(30.0, plan, |world| world.copters[0].mode == FlightMode::Land);
    for moment in 0..40 {
        world.copters[0].estimator_ok = moment % 2 == 0;
        world.run(1.0, |world| {
            plan(world);
            assert_eq!(world.copters[0].mode, FlightMode::Land, "{moment}");
        });
    }
    // Good for longer than a moment, it flies on.
    world.copters[0].estimator_ok = true;
    let for_s = world.until(30.0, plan, |world| world.copters[0].mode == FlightMode::Guided);
    assert!((4.0..7.0).contains(&for_s), "{for_s}");
}

/// Its place has jumped when LAND is asked for, and the autopilot doesn't take LAND at once: no target leads to where it was to be held.
#[test]
fn before_land_is_in_force_a_place_that_jumped_is_not_flown_to() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.run(5.0, plan);
    world.copters[0].estimator_ok = false;
    world.copters[0].off = Vector3::new(12.0, 0.0, 0.0);
    let mut asked_for = 0;
    world.step();
    world.run(30.0, |world| {
        if asked(world, Command::SetMode(FlightMode::Land)) {
            asked_for += 1;
        }
        plan(world);
        world.copters[0].mode = FlightMode::Guided;
        if let Some(setpoint) = world.setpoint(0) {
            let believed = world.copters[0].position + world.copters[0].off;
            assert!((setpoint.position_ned_m - believed).xy().norm() < 1.0, "{} {believed}", setpoint.position_ned_m);
        }
    });
    assert!(asked_for > 0);
    // It jumps on while LAND is asked for.
    world.copters[0].off = Vector3::new(24.0, 0.0, 0.0);
    world.step();
    world.run(3.0, |world| {
        plan(world);
        world.copters[0].mode = FlightMode::Guided;
        let believed = world.copters[0].position + world.copters[0].off;
        let setpoint = world.setpoint(0).unwrap();
        assert!((setpoint.position_ned_m - believed).xy().norm() < 1.0, "{} {believed}", setpoint.position_ned_m);
    });
}

/// The autopilot refuses to stop the motors afloat, or doesn't answer: only a refusal, with both witnesses, lets them be stopped all the same.
#[test]
fn motors_are_cut_afloat_only_after_a_refusal() {
    let afloat = |refuses: bool| {
        let mut world = World::new(&[(0.0, 0.0)]);
        world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
        world.copters[0].rangefinder = Some(0.0);
        world.copters[0].finds_ground = false;
        let cleared = |world: &mut World| {
            let until = world.now.plus_secs_f64(5.0);
            world.plan(&[(0, super::world::land(40.0, 0.0, Some(until)))], 5.0);
        };
        world.until(90.0, cleared, |world| world.copters[0].mode == FlightMode::Land && world.height(0) < 0.05);
        let mut cut = false;
        world.run(90.0, |world| {
            cleared(world);
            cut |= asked(world, Command::Disarm { force: true });
            let gentle = Command::Disarm { force: false };
            if !refuses && asked(world, gentle) {
                let silence = Err(CommandError::TimedOut { tries: 4, percent: None });
                let now = world.now;
                world.executors[0].observe_outcome(&gentle, &silence, now);
            }
        });
        cut
    };
    assert!(afloat(true) && !afloat(false));
}

/// Wherever it stands, the autopilot may count a take-off from home or, by its rangefinder, from what is below: it is high enough by both, and
/// not taken higher than asked for.
#[test]
fn a_take_off_from_below_home_is_high_enough_by_either_count() {
    let safe_m = crate::core::limits::Limits::default().safe_height_m;
    for climbs_from_below in [false, true] {
        let mut world = World::new(&[(0.0, 0.0)]);
        world.executors[0] = Executor::new(crate::core::executor::ExecutorConfig { home_height_m: 4.0, ..config("v0") });
        // On the water; home is on a jetty, 4 m up, and far away.
        world.copters[0].home = Vector3::new(0.0, 300.0, -4.0);
        world.copters[0].climbs_from_below = climbs_from_below;
        let away = |world: &mut World| drop(world.plan(&[(0, survey(0.0, 40.0))], 5.0));
        let took_s = world.until(20.0, away, |world| world.copters[0].position.y > 5.0);
        assert!((safe_m - 0.7..safe_m + 2.7).contains(&world.height(0)), "{climbs_from_below}: {}", world.height(0));
        assert!(took_s < 12.0, "{took_s}");
    }
}

/// GUIDED that a person set, by his transmitter, before the take-off: a crash is one all the same.
#[test]
fn a_crash_is_one_whoever_set_guided() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.copters[0].mode = FlightMode::Guided;
    world.until(60.0, plan, |world| world.height(0) > 3.0);
    world.copters[0].armed = false;
    world.run(30.0, |world| {
        world.plan(&[(0, survey(80.0, 0.0))], 5.0);
        assert!(!asked(world, Command::Arm));
    });
    assert!(matches!(world.activity(0), Activity::PilotControl), "{:?}", world.activity(0));
}

/// That it stands on the ground is heard before that its motors are off; in GUIDED, or in LAND from high up.
#[test]
fn what_falls_stays_down_though_the_ground_is_heard_first() {
    for (mode, height_m) in [(FlightMode::Guided, 5.0), (FlightMode::Land, 20.0)] {
        let mut world = World::new(&[(0.0, 0.0)]);
        world.airborne(0, Vector3::new(40.0, 0.0, -height_m));
        world.run(3.0, plan);
        if mode == FlightMode::Land {
            world.command(0, VehicleAction::Land);
            world.until(5.0, plan, |world| world.copters[0].mode == mode);
            world.run(1.0, plan);
        }
        let stamp = |world: &World| world.now.plus_secs_f64(0.05);
        let grounded = halcyon_model::VehicleState {
            landed: halcyon_model::LandedState::OnGround,
            ..world.copters[0].state(stamp(&world))
        };
        let now = stamp(&world);
        world.executors[0].observe_self(grounded, now, now);
        world.copters[0].armed = false;
        world.run(30.0, |world| {
            world.plan(&[(0, survey(80.0, 0.0))], 5.0);
            assert!(!asked(world, Command::Arm), "{mode:?}");
        });
        assert!(matches!(world.activity(0), Activity::PilotControl), "{mode:?} {:?}", world.activity(0));
    }
}

/// He flies by himself; a plan has a task for it meanwhile. He lands, and stops the motors: they stay off.
#[test]
fn a_task_that_came_while_the_pilot_flew_waits_for_guided() {
    for after_a_restart in [false, true] {
        let mut world = World::new(&[(0.0, 0.0)]);
        world.step();
        world.copters[0].mode = FlightMode::Loiter;
        world.copters[0].armed = true;
        world.copters[0].position.z = -5.0;
        if after_a_restart {
            world.executors[0] = Executor::new(config("v0"));
        }
        world.run(2.0, |_| {});
        // After a restart it may have been for this very task that he took it.
        let meanwhile = |world: &mut World| {
            if !after_a_restart {
                plan(world);
            }
        };
        world.run(2.0, meanwhile);
        world.copters[0].position.z = 0.0;
        world.run(1.0, meanwhile);
        world.copters[0].armed = false;
        world.run(1.0, meanwhile);
        world.run(30.0, |world| {
            plan(world);
            assert!(!asked(world, Command::Arm), "{after_a_restart}");
        });
        world.command(0, VehicleAction::SetMode(FlightMode::Guided));
        world.until(60.0, plan, |world| world.height(0) > 3.0);
    }
}

/// A LAND for a bad estimator was taken over by the pilot; long after it was good again he hands it back: it flies on, and does not land.
#[test]
fn a_landing_that_the_pilot_ended_does_not_go_on_when_he_hands_back() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -30.0));
    world.run(2.0, plan);
    world.copters[0].estimator_ok = false;
    world.until(30.0, plan, |world| world.copters[0].mode == FlightMode::Land);
    world.copters[0].mode = FlightMode::Loiter;
    world.run(1.0, plan);
    world.copters[0].estimator_ok = true;
    world.run(60.0, plan);
    world.copters[0].mode = FlightMode::Guided;
    world.run(10.0, |world| {
        plan(world);
        assert_eq!(world.copters[0].mode, FlightMode::Guided);
    });
}

/// A station flew it in GUIDED, and asks for GUIDED on the relay: no heartbeat would show that.
#[test]
fn a_station_hands_back_by_asking_for_guided_again() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.run(2.0, plan);
    world.executors[0].observe_station("sends targets");
    world.run(2.0, plan);
    assert!(matches!(world.activity(0), Activity::PilotControl));
    let now = world.now;
    world.executors[0].observe_station_guided(now);
    world.run(2.0, plan);
    assert!(matches!(world.activity(0), Activity::Holding { .. } | Activity::Transit), "{:?}", world.activity(0));
}

/// Low, with another vehicle right above: the floor under all flight does not lift it into that.
#[test]
fn the_floor_lifts_nobody_into_whoever_is_above() {
    let mut world = World::new(&[(0.0, 0.0), (0.0, 60.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -1.5));
    world.airborne(1, Vector3::new(40.3, 0.0, -6.0));
    world.copters[0].finds_ground = false;
    // A pilot holds it there.
    world.copters[1].mode = FlightMode::Loiter;
    let own = |world: &mut World| drop(world.plan(&[(0, survey(30.0, 0.0))], 5.0));
    world.run(20.0, |world| {
        own(world);
        let away_m = world.copters[0].position - world.copters[1].position;
        if away_m.xy().norm() < 2.0 {
            assert!(away_m.z > 4.2, "{away_m}");
        }
    });
    assert!(world.height(0) > 4.0, "{}", world.height(0));
}

/// On the water below home the height of the take-off is by where it stands, which trembles: asked for once, and its refusal told once.
#[test]
fn a_take_off_is_asked_for_once() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.executors[0] = Executor::new(crate::core::executor::ExecutorConfig { home_height_m: 4.0, ..config("v0") });
    world.copters[0].home = Vector3::new(0.0, 300.0, -4.0);
    let mut asks = 0;
    let mut steps = 0;
    world.until(60.0, plan, |world| world.copters[0].armed);
    world.run(4.5, |world| {
        plan(world);
        let is_one = |output: &Output| matches!(output, Output::Request(Command::TakeOff { .. }));
        asks += world.outputs[0].iter().filter(|output| is_one(output)).count();
        steps += 1;
        // It doesn't begin, and says nothing.
        world.copters[0].hold_down();
        world.copters[0].off.z = 0.001 * f64::from(steps % 7);
    });
    assert_eq!(asks, 1);
}

/// The battery is changed on the water: the autopilot starts there, and counts its height from there.
#[test]
fn an_autopilot_that_starts_again_away_from_home_does_not_take_off_there() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.copters[0].position = Vector3::new(60.0, 0.0, 0.0);
    world.run(1.0, |_| {});
    world.copters[0].boot_s = 1.0;
    world.copters[0].home = world.copters[0].position;
    world.run(1.0, |_| {});
    world.run(20.0, |world| {
        plan(world);
        assert!(!world.copters[0].armed);
    });
    assert!(world.executors[0].detail().contains("bring it home"), "{}", world.executors[0].detail());
    world.copters[0].position = Vector3::zeros();
    world.until(60.0, plan, |world| world.height(0) > 3.0);
}

/// Terminated low over the water, in LAND, where motors that stop are no fall.
#[test]
fn what_was_terminated_in_a_landing_stays_down() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.run(2.0, plan);
    world.command(0, VehicleAction::Land);
    world.until(30.0, plan, |world| world.copters[0].mode == FlightMode::Land && world.height(0) < 1.0);
    world.command(0, VehicleAction::Terminate);
    world.run(30.0, |world| {
        world.plan(&[(0, survey(80.0, 0.0))], 5.0);
        assert!(!asked(world, Command::Arm));
    });
    assert!(matches!(world.activity(0), Activity::PilotControl), "{:?}", world.activity(0));
}

/// Its height has drifted by 4 m in the flight: it is down all the same, and where it was to be.
#[test]
fn a_landing_counts_though_the_height_has_drifted() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.copters[0].off = Vector3::new(0.0, 0.0, -4.0);
    world.copters[0].finds_ground = false;
    let cleared = |world: &mut World| {
        let until = world.now.plus_secs_f64(1.0);
        world.plan(&[(0, super::world::land(40.0, 0.0, Some(until)))], 5.0);
    };
    world.until(90.0, cleared, |world| world.copters[0].mode == FlightMode::Land);
    world.copters[0].finds_ground = true;
    world.until(10.0, cleared, |world| !world.copters[0].armed);
    let touchdown = world.executors[0].touchdown().unwrap();
    assert!(touchdown.distance_m(&halcyon_model::LocalPoint::new(40.0, 0.0)) < 1.0, "{touchdown:?}");
}

/// The autopilot would not fix home for this take-off; for the next it is asked again.
#[test]
fn home_that_was_declined_is_asked_for_again_before_the_next_flight() {
    let mut world = World::new(&[(0.0, 0.0)]);
    let result = crate::core::commands::Refusal::Listed("denied");
    let declined = Err(CommandError::Refused { result, words: None });
    let now = world.now;
    world.executors[0].observe_outcome(&Command::SetHome, &declined, now);
    world.until(60.0, plan, |world| {
        assert!(!asked(world, Command::SetHome));
        world.height(0) > 3.0
    });
    world.command(0, VehicleAction::Land);
    world.until(60.0, plan, |world| !world.copters[0].armed);
    world.run(2.0, plan);
    world.until(30.0, |world| drop(world.plan(&[(0, survey(80.0, 0.0))], 5.0)), |world| asked(world, Command::SetHome));
}

/// Its battery is changed after the mission, and it comes up in STABILIZE: that is no pilot, and the next mission may have it.
#[test]
fn an_autopilot_that_starts_again_after_its_flight_is_nobodys() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.until(60.0, plan, |world| world.height(0) > 3.0);
    let back = |world: &mut World| drop(world.plan(&[(0, halcyon_model::Task::Return)], 5.0));
    world.until(120.0, back, |world| !world.copters[0].armed);
    world.run(2.0, back);
    world.copters[0].boot_s = 1.0;
    world.copters[0].mode = FlightMode::Stabilize;
    world.run(2.0, back);
    assert!(!matches!(world.activity(0), Activity::PilotControl), "{:?}", world.activity(0));
    world.until(60.0, |world| drop(world.plan(&[(0, survey(80.0, 0.0))], 5.0)), |world| world.height(0) > 3.0);
}

/// In GUIDED the autopilot says for a moment that it is on the ground; it flies on, and lands soon after: that is no fall.
#[test]
fn a_moment_on_the_ground_in_the_air_is_no_fall_of_a_later_landing() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.run(3.0, plan);
    let now = world.now.plus_secs_f64(0.05);
    let grounded = halcyon_model::VehicleState { landed: halcyon_model::LandedState::OnGround, ..world.copters[0].state(now) };
    world.executors[0].observe_self(grounded, now, now);
    world.run(1.0, plan);
    world.command(0, VehicleAction::Land);
    world.until(18.0, plan, |world| !world.copters[0].armed);
    world.run(2.0, plan);
    assert!(matches!(world.activity(0), Activity::Landed), "{:?}", world.activity(0));
}
