//! The rows of the fail-safe table that concern positions, clocks, energy and the surface; and the table itself.

use halcyon_model::{Activity, CalmWindow, FlightMode, LocalPoint, Severity, Task, VehicleAction, VehicleState};
use nalgebra::Vector3;

use super::world::{DT_S, World, follow, id, land, survey};
use crate::core::commands::Command;
use crate::core::executor::{Decision, Output};

fn reason(world: &World, index: usize) -> &str {
    match world.activity(index) {
        Activity::FailSafe { reason } => reason,
        _ => "",
    }
}

fn noted(world: &World, severity: Severity, what: &str) -> usize {
    world.notes.iter().filter(|(_, note)| note.severity == severity && note.what.contains(what)).count()
}

fn keep(world: &mut World) {
    world.plan(&[(0, survey(40.0, 0.0))], 5.0);
}

fn keep_following(world: &mut World) {
    world.plan(&[(0, survey(40.0, 0.0)), (1, follow("v0", 7.0))], 5.0);
}

fn cleared(world: &mut World) {
    let until = world.now.plus_secs_f64(1.0);
    world.plan(&[(0, land(40.0, 0.0, Some(until)))], 5.0);
}

/// Holding over (40, 0) under a plan.
fn holding() -> World {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.run(5.0, keep);
    world
}

/// `v1` in its slot 7 m to the right of `v0`, which looks 57° east of north.
fn following() -> World {
    let mut world = World::new(&[(0.0, 0.0), (0.0, -8.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.airborne(1, Vector3::new(34.0, 5.0, -5.0));
    world.run(15.0, keep_following);
    assert!(matches!(world.activity(1), Activity::Following { settled: true, .. }), "{:?}", world.activity(1));
    world
}

/// Descends over (40, 0), cleared, until the true height is `height_m`; `prepare` before it starts.
fn descending_to(height_m: f64, prepare: impl Fn(&mut World)) -> World {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    prepare(&mut world);
    world.until(90.0, cleared, |world| world.height(0) <= height_m);
    world
}

#[test]
fn a_position_that_jumps_is_not_flown_after_and_is_believed_once_settled() {
    let mut world = holding();
    let place = world.copters[0].position;
    world.copters[0].off = Vector3::new(12.0, -9.0, 0.0);
    world.run(4.5, |world| {
        keep(world);
        // What is sent is what the autopilot believes in: it goes after nothing.
        if let Some(setpoint) = world.setpoint(0).filter(|_| !reason(world, 0).is_empty()) {
            let believed = world.copters[0].position + world.copters[0].off;
            assert!((setpoint.position_ned_m - believed).norm() < 0.5, "{setpoint:?} {believed}");
        }
    });
    assert!(reason(&world, 0).contains("own position jumped by 15 m"), "{:?}", world.activity(0));
    assert!((world.copters[0].position - place).norm() < 0.5, "{}", world.copters[0].position);
    assert_eq!(noted(&world, Severity::Critical, "own position jumped"), 1);
    // Settled, it goes to its place by the new position.
    world.until(30.0, keep, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
    let believed = world.copters[0].position + world.copters[0].off;
    assert!((believed - Vector3::new(40.0, 0.0, -5.0)).norm() < 1.0, "{believed}");

    // It jumps on and on: then LAND. Not beyond the fence, though it says so.
    let mut world = holding();
    let mut step = 0;
    world.until(
        60.0,
        |world| {
            keep(world);
            step += 1;
            world.copters[0].off.x = if step % 40 < 20 { 0.0 } else { 600.0 };
            assert!(!reason(world, 0).contains("fence"));
        },
        |world| world.copters[0].mode == FlightMode::Land,
    );
}

/// In a descent it stops and climbs; it is the estimator's word that ends the hold, not time alone.
#[test]
fn a_jump_in_a_descent_breaks_it_off_and_a_bad_estimator_keeps_the_hold() {
    let mut world = descending_to(2.5, |_| {});
    world.copters[0].off.x = 6.0;
    let lowest = std::cell::Cell::new(f64::INFINITY);
    let watch = |world: &mut World| {
        cleared(world);
        lowest.set(lowest.get().min(world.height(0)));
    };
    world.run(4.0, watch);
    assert!(lowest.get() > 2.0 && world.height(0) > 4.0, "{} {}", lowest.get(), world.height(0));
    let mut world = holding();
    world.copters[0].off.x = 6.0;
    world.run(4.8, keep);
    world.copters[0].estimator_ok = false;
    world.run(0.8, keep);
    assert!(reason(&world, 0).contains("jumped"), "{:?}", world.activity(0));
}

#[test]
fn a_jump_towards_a_neighbour_moves_nobody_into_it() {
    for off in [Vector3::new(0.0, 6.0, 0.0), Vector3::new(0.0, -6.0, 0.0), Vector3::new(6.0, 0.0, 0.0)] {
        let mut world = following();
        world.copters[1].off = off;
        world.run(30.0, keep_following);
        // What remains is the jump itself: the slot is kept by a wrong position in the end.
        world.copters[1].off = Vector3::zeros();
        let least_m = std::mem::replace(&mut world.least_m, f64::INFINITY);
        world.run(30.0, keep_following);
        if off.y < 0.0 || off.x > 0.0 {
            assert!(least_m > 2.0, "{off} {least_m}");
        }
        assert!(matches!(world.activity(1), Activity::Following { settled: true, .. }), "{:?}", world.activity(1));
    }
}

#[test]
fn a_leader_that_jumps_is_not_followed_and_both_places_are_kept_clear() {
    let mut world = following();
    let place = world.copters[1].position;
    world.copters[0].off = Vector3::new(-8.0, 6.0, 0.0);
    world.run(4.0, keep_following);
    assert!(reason(&world, 1).contains("position jumped"), "{:?}", world.activity(1));
    // The leader really is where it was: the follower has not come nearer to that. It says that it is beside the follower, which has
    // made room there too, and has not gone after it.
    assert!(world.least_m > 5.5, "{}", world.least_m);
    let (here, leader) = (world.copters[1].position, &world.copters[0]);
    assert!((here - leader.position - leader.off).norm() > 5.0, "{here}");
    assert!((here - place).norm() < 7.0, "{here}");
    world.until(30.0, keep_following, |world| matches!(world.activity(1), Activity::Following { settled: true, .. }));
}

#[test]
fn a_fence_is_not_broken_by_a_position_that_jumped_over_it() {
    let mut world = holding();
    world.copters[0].off.x = 600.0;
    world.run(2.0, keep);
    world.copters[0].off.x = 0.0;
    world.run(15.0, |world| {
        keep(world);
        assert!(!reason(world, 0).contains("fence"), "{}", reason(world, 0));
    });
    assert!(matches!(world.activity(0), Activity::Holding { settled: true }), "{:?}", world.activity(0));
}

/// One is held by its pilot and says that it is 30 m away; the other's way leads through where it really is.
#[test]
fn a_neighbour_that_jumped_is_kept_clear_of_where_it_was() {
    let mut world = World::new(&[(0.0, 0.0), (0.0, -8.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.airborne(1, Vector3::new(40.0, -30.0, -5.0));
    let plan = |world: &mut World| drop(world.plan(&[(0, survey(40.0, 0.0)), (1, survey(40.0, 30.0))], 5.0));
    world.until(30.0, plan, |world| (world.copters[0].position - world.copters[1].position).norm() < 12.0);
    world.copters[0].mode = FlightMode::Loiter;
    world.copters[0].off = Vector3::new(30.0, 0.0, 0.0);
    world.run(4.9, plan);
    assert!(world.least_m >= 5.0, "{}", world.least_m);
}

/// The same, but what it says after the jump is true: its receiver has come back. The way leads through that place for long.
#[test]
fn a_neighbour_that_jumped_is_kept_clear_of_where_it_says_that_it_is() {
    let mut world = World::new(&[(0.0, 0.0), (0.0, -8.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.airborne(1, Vector3::new(40.0, -30.0, -5.0));
    world.copters[0].off = Vector3::new(12.0, 0.0, 0.0);
    world.copters[0].mode = FlightMode::Loiter;
    let plan = |world: &mut World| drop(world.plan(&[(0, survey(40.0, 0.0)), (1, survey(40.0, 30.0))], 5.0));
    world.until(30.0, plan, |world| (world.copters[0].position - world.copters[1].position).norm() < 12.0);
    world.copters[0].off = Vector3::zeros();
    world.run(40.0, plan);
    assert!(world.least_m >= 5.0, "{}", world.least_m);
}

#[test]
fn an_autopilot_that_starts_again_in_flight_is_left_alone_until_guided_is_set() {
    let mut world = holding();
    world.copters[0].boot_s = 0.0;
    world.step();
    assert!(world.outputs[0].contains(&Output::Withdraw) && world.outputs[0].contains(&Output::AskStreams));
    assert_eq!(noted(&world, Severity::Critical, "started again in flight"), 1);
    // It came up in GUIDED, which nobody has asked for now.
    world.run(20.0, |world| {
        keep(world);
        let quiet = |output: &Output| matches!(output, Output::Note(_) | Output::Withdraw | Output::AskStreams);
        assert!(world.outputs[0].iter().all(quiet), "{:?}", world.outputs[0]);
    });
    assert_eq!(*world.activity(0), Activity::PilotControl);
    assert_eq!(
        world.command(0, VehicleAction::SetMode(FlightMode::Guided)),
        Decision::Ask(Command::SetMode(FlightMode::Guided))
    );
    world.until(10.0, keep, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
    // On the ground it is no matter, unless it was to fly: who changed the battery may hold it.
    let mut world = World::new(&[(0.0, 0.0)]);
    world.run(2.0, |_| {});
    world.copters[0].boot_s = 0.0;
    world.run(1.0, |_| {});
    world.copters[0].ready = false;
    world.run(2.0, keep);
    world.copters[0].boot_s = 0.0;
    world.run(1.0, keep);
    world.copters[0].ready = true;
    world.run(10.0, |world| {
        keep(world);
        assert!(!world.copters[0].armed);
    });
    world.command(0, VehicleAction::SetMode(FlightMode::Guided));
    world.until(60.0, keep, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
}

#[test]
fn a_ground_station_that_flies_it_in_guided_is_a_pilot() {
    let mut world = holding();
    world.executors[0].observe_station("sends it to a point");
    world.step();
    assert!(world.outputs[0].contains(&Output::Withdraw));
    assert_eq!(noted(&world, Severity::Warning, "the pilot has the vehicle"), 1);
    world.run(20.0, |world| {
        keep(world);
        assert!(
            world.outputs[0].iter().all(|output| matches!(output, Output::Note(_) | Output::Withdraw)),
            "no setpoint of ours"
        );
        // Its next words are no news.
        world.executors[0].observe_station("sends targets");
    });
    assert_eq!(*world.activity(0), Activity::PilotControl);
    assert_eq!(noted(&world, Severity::Warning, "the pilot has the vehicle"), 1);
    world.command(0, VehicleAction::SetMode(FlightMode::Guided));
    world.until(10.0, keep, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
}

/// ArduCopter takes home wherever it is armed, unless home was set.
#[test]
fn home_is_fixed_before_the_first_arming_and_not_where_it_landed() {
    let mut world = World::new(&[(0.0, 0.0)]);
    let mut asked = Vec::new();
    world.run(20.0, |world| {
        keep(world);
        asked.extend(world.outputs[0].iter().filter_map(|output| match output {
            Output::Request(command @ (Command::SetHome | Command::Arm)) => Some(*command),
            _ => None,
        }));
    });
    assert_eq!(asked, [Command::SetHome, Command::Arm]);
    // A service that starts anew beside a vehicle on the water leaves home where it is.
    let mut world = World::new(&[(60.0, 0.0)]);
    world.copters[0].home = Vector3::zeros();
    let mut asked = false;
    world.run(20.0, |world| {
        keep(world);
        asked |= world.outputs[0].contains(&Output::Request(Command::SetHome));
    });
    assert!(!asked);
}

/// What a step back of `back_s`, half a second after it was given, leaves of a permission to descend.
fn permitted_s(back_s: f64, stands_still: bool, plan_s: f64, clearance_s: f64) -> f64 {
    let mut world = descending_to(4.0, |_| {});
    let task = land(40.0, 0.0, Some(world.now.plus_secs_f64(clearance_s)));
    world.plan(&[(0, task)], plan_s);
    world.run(0.5, |_| {});
    if stands_still {
        // The computer slept; the vehicle did not.
        for _ in 0..(back_s / DT_S).round() as usize {
            world.now = world.now.plus_secs_f64(-DT_S);
            world.step_vehicles();
        }
    } else {
        world.now = world.now.plus_secs_f64(-back_s);
    }
    0.5 + world.until(30.0, |_| {}, |world| world.setpoint(0).is_some_and(|setpoint| setpoint.height_m() > 4.9))
}

#[test]
fn a_clock_that_goes_back_lengthens_nothing() {
    for (plan_s, clearance_s) in [(2.0, 5.0), (5.0, 2.0)] {
        let right_s = permitted_s(0.0, false, plan_s, clearance_s);
        assert!((right_s - 2.0).abs() < 0.35, "{right_s}");
        for back_s in [3.0, 50.0, 4000.0] {
            let after_s = permitted_s(back_s, false, plan_s, clearance_s);
            assert!((after_s - right_s).abs() < 0.35, "{back_s} s back: {after_s}");
        }
        // Asleep for three seconds, it wakes up with nothing left.
        let after_s = permitted_s(3.0, true, plan_s, clearance_s);
        assert!(after_s < 1.0, "{after_s}");
    }
    // Nor is the leader's silence shortened, or its own autopilot's.
    let mut world = following();
    world.now = world.now.plus_secs_f64(-100.0);
    world.copters[0].silent = true;
    world.run(5.5, keep_following);
    assert!(reason(&world, 1).contains("has not been heard"), "{:?}", world.activity(1));
    let mut world = holding();
    world.now = world.now.plus_secs_f64(-100.0);
    world.copters[0].silent = true;
    world.run(3.5, keep);
    assert_eq!(reason(&world, 0), "autopilot link lost");
    // And while all is well, nothing happens.
    let mut world = following();
    world.now = world.now.plus_secs_f64(-100.0);
    world.run(20.0, |world| {
        keep_following(world);
        assert_eq!((reason(world, 0), reason(world, 1)), ("", ""));
    });
    assert!(matches!(world.activity(1), Activity::Following { settled: true, .. }), "{:?}", world.activity(1));
}

#[test]
fn a_clock_that_goes_forward_lapses_permissions_and_rushes_nothing() {
    let mut world = descending_to(3.0, |_| {});
    world.plan(&[(0, land(40.0, 0.0, Some(world.now.plus_secs_f64(20.0))))], 20.0);
    world.now = world.now.plus_secs_f64(100.0);
    world.run(3.0, |_| {});
    assert_eq!(reason(&world, 0), "no valid plan");
    assert!(world.height(0) > 3.5, "{}", world.height(0));
    // Half a second of a bad estimator is not made a hundred of it, nor the hold of a lapsed plan.
    let mut world = holding();
    world.copters[0].estimator_ok = false;
    world.run(0.5, keep);
    world.now = world.now.plus_secs_f64(100.0);
    world.run(0.2, keep);
    assert_eq!(world.copters[0].mode, FlightMode::Guided, "it landed for half a second");
    world.copters[0].estimator_ok = true;
    world.run(2.0, keep);
    assert_eq!((reason(&world, 0), world.copters[0].mode), ("", FlightMode::Guided));
    world.now = world.now.plus_secs_f64(100.0);
    world.run(8.0, |_| {});
    assert_eq!(reason(&world, 0), "no valid plan");
    assert!((world.copters[0].position.x - 40.0).abs() < 0.5, "it didn't hold");
    world.run(10.0, |_| {});
    assert!(world.copters[0].position.x < 35.0, "it didn't return");
}

#[test]
fn a_clock_that_goes_forward_does_not_end_a_wait_for_a_clearance() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    let uncleared = |world: &mut World| drop(world.plan(&[(0, land(40.0, 0.0, None))], 5.0));
    world.run(20.0, uncleared);
    world.now = world.now.plus_secs_f64(500.0);
    world.run(30.0, |world| {
        uncleared(world);
        assert_eq!(reason(world, 0), "");
    });
    assert_eq!(*world.activity(0), Activity::Approaching);
    world.until(90.0, uncleared, |world| reason(world, 0).contains("no clearance to land"));
}

/// 400 m out, 90 % of 1200 s left, in still air: 80 s of flight, 12 s of descent, half as much again for wind, over 10 % to land
/// with. At four times the usual consumption that is 10 + 100 × 92 × 1.5 / 300 = 56 %.
#[test]
fn a_battery_that_just_suffices_for_the_way_home_sends_it_there() {
    let left_at = |rate_hz: f64| {
        let mut world = World::new(&[(0.0, 0.0)]);
        world.airborne(0, Vector3::new(400.0, 0.0, -6.0));
        let mut left = 0.9;
        let far = |world: &mut World| {
            drop(
                world.plan(&[(0, Task::Survey { point: LocalPoint::new(400.0, 0.0), height_m: 6.0, heading_rad: None })], 5.0),
            );
        };
        world.until(
            1000.0,
            |world| {
                far(world);
                left -= rate_hz * DT_S;
                world.copters[0].battery = Some((left * 100.0f64).round() / 100.0);
            },
            |world| reason(world, 0).contains("returning"),
        );
        (left, reason(&world, 0).to_owned())
    };
    let (left, why) = left_at(1.0 / 300.0);
    assert!((left - 0.56).abs() < 0.04, "{left}");
    assert!(why.contains("needed for the way home"), "{why}");
    // At the usual rate the fixed fraction comes first: 10 + 100 × 92 × 1.5 / 1200 = 21.5 %.
    let (left, why) = left_at(1.0 / 1200.0);
    assert!((left - 0.25).abs() < 0.012 && !why.contains("needed"), "{left} {why}");
}

#[test]
fn a_sag_or_a_bad_reading_is_no_low_battery_and_an_empty_one_is() {
    let mut world = holding();
    let mut step = 0;
    world.run(30.0, |world| {
        keep(world);
        step += 1;
        // 2.5 s of sag in every 5, and every now and then no number at all.
        world.copters[0].battery = Some(if step % 7 == 0 {
            f64::NAN
        } else if step % 50 < 25 {
            0.05
        } else {
            0.8
        });
        assert_eq!(reason(world, 0), "");
    });
    world.copters[0].battery = Some(0.0);
    world.until(5.0, keep, |world| world.copters[0].mode == FlightMode::Land);
    let mut world = holding();
    world.copters[0].battery = Some(f64::NAN);
    world.run(14.0, keep);
    assert_eq!(reason(&world, 0), "");
    world.run(2.5, keep);
    assert!(reason(&world, 0).contains("battery unknown"), "a number that is none is unknown");
}

#[test]
fn a_home_that_moves_in_flight_is_not_flown_to() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.until(60.0, keep, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
    world.copters[0].home = Vector3::new(200.0, 50.0, 0.0);
    world.run(1.0, keep);
    assert_eq!(noted(&world, Severity::Warning, "home moved in flight"), 1);
    world.until(120.0, |world| drop(world.plan(&[(0, Task::Return)], 5.0)), |world| !world.copters[0].armed);
    assert!(world.copters[0].position.norm() < 0.5, "{}", world.copters[0].position);
}

#[test]
fn another_vehicle_with_the_same_name_is_told_and_not_taken_off_beside() {
    let mut world = World::new(&[(0.0, 0.0), (30.0, 0.0)]);
    let echo = |world: &mut World| {
        // Our own voice comes back too, late.
        let own = VehicleState { vehicle: id("v0"), ..world.copters[0].state(world.now) };
        let now = world.now;
        world.executors[0].observe_neighbour(own, now);
    };
    world.run(5.0, echo);
    assert_eq!(noted(&world, Severity::Critical, "calls itself"), 0);
    world.run(5.0, |world| {
        keep(world);
        let twin = VehicleState { vehicle: id("v0"), ..world.copters[1].state(world.now.plus_secs_f64(-0.03)) };
        let now = world.now;
        world.executors[0].observe_neighbour(twin, now);
        assert!(!world.copters[0].armed);
    });
    assert_eq!(noted(&world, Severity::Critical, "calls itself v0"), 1);
    assert!(world.executors[0].detail().contains("calls itself"), "{}", world.executors[0].detail());
    world.until(30.0, keep, |world| world.copters[0].armed);
}

/// The true height at which LAND began, with the autopilot's height off by `drift_m` and the rangefinder by `range_m`.
fn land_began_at(drift_m: f64, range_m: Option<f64>) -> (f64, usize) {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0 + drift_m));
    world.copters[0].off.z = -drift_m;
    world.copters[0].waves = (0.25, 4.0);
    world.copters[0].rangefinder = range_m;
    world.until(90.0, cleared, |world| world.copters[0].mode == FlightMode::Land);
    let height_m = world.height(0);
    let warned = noted(&world, Severity::Warning, "disagree");
    world.until(60.0, cleared, |world| !world.copters[0].armed);
    (height_m, warned)
}

#[test]
fn a_rangefinder_tells_the_height_over_waves_that_the_barometer_has_lost() {
    for drift_m in [-0.9, 0.0, 0.7] {
        let (with_m, warned) = land_began_at(drift_m, Some(0.0));
        assert!((with_m - 1.0).abs() < 0.2 && warned == 0, "{drift_m}: {with_m}");
        let (without_m, _) = land_began_at(drift_m, None);
        assert!((without_m - (1.0 - drift_m)).abs() < 0.2, "{drift_m}: {without_m}");
    }
}

#[test]
fn a_rangefinder_that_disagrees_makes_it_careful() {
    // It reads 2 m too little: LAND begins early, which is slow but safe.
    let (height_m, warned) = land_began_at(0.0, Some(-2.0));
    assert!((height_m - 3.0).abs() < 0.3 && warned == 1, "{height_m} {warned}");
    // It reads 2 m too much: the autopilot's height counts, LAND begins where it would have.
    let (height_m, warned) = land_began_at(0.0, Some(2.0));
    assert!((height_m - 1.0).abs() < 0.2 && warned == 1, "{height_m} {warned}");
    // And it is committed only when both say so: at 0.3 m by one of them it is still broken off.
    let mut world = descending_to(0.3, |world| world.copters[0].rangefinder = Some(2.0));
    world.run(3.0, |world| drop(world.plan(&[(0, land(40.0, 0.0, None))], 5.0)));
    assert!(world.height(0) > 1.0, "{}", world.height(0));
    // One that goes silent on the way down is done without.
    let mut world = descending_to(2.0, |world| world.copters[0].rangefinder = Some(0.0));
    world.copters[0].rangefinder = None;
    world.until(60.0, cleared, |world| !world.copters[0].armed);
    assert!(world.executors[0].touchdown().is_some());
}

/// Lands with windows offered by `windows`, as seconds from the start; when it touched down by the same clock.
fn touches_down_at(windows: impl Fn(f64) -> Vec<(f64, f64)>) -> f64 {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    let start = world.now;
    let plan = |world: &mut World| {
        let now_s = world.now.seconds_since(start);
        let mut task = land(40.0, 0.0, Some(world.now.plus_secs_f64(1.0)));
        if let Task::Land { clearance: Some(clearance), .. } = &mut task {
            let window = |(from_s, to_s)| CalmWindow { from: start.plus_secs_f64(from_s), to: start.plus_secs_f64(to_s) };
            clearance.windows = windows(now_s).into_iter().map(window).collect();
        }
        world.plan(&[(0, task)], 5.0);
    };
    world.until(120.0, plan, |world| world.height(0) < 0.02);
    world.now.seconds_since(start)
}

#[test]
fn a_landing_ends_in_a_calm_window_if_one_is_offered_and_waits_for_none_for_ever() {
    let at_once_s = touches_down_at(|_| Vec::new());
    // Windows of 4 s every 12 s, seen 10 s ahead.
    let ahead = |now_s: f64| {
        let windows = (0..20).map(|index| 12.0 * f64::from(index)).map(|from_s| (from_s, from_s + 4.0));
        windows.filter(|(from_s, to_s)| *from_s < now_s + 10.0 && *to_s > now_s).collect()
    };
    let calm_s = touches_down_at(ahead);
    assert!(calm_s.rem_euclid(12.0) < 4.2, "{calm_s}");
    // The one that never comes is waited for by 20 s.
    let never_s = touches_down_at(|now_s| vec![(now_s + 9.0, now_s + 10.0)]);
    assert!((19.0..23.0).contains(&(never_s - at_once_s)), "{never_s} {at_once_s}");
}

/// Afloat in LAND on waves of 0.3 m, by an autopilot that doesn't notice. Returns the world after two minutes.
fn afloat(prepare: impl Fn(&mut World)) -> World {
    let mut world = descending_to(0.6, |world| {
        world.copters[0].waves = (0.3, 4.0);
        world.copters[0].finds_ground = false;
        world.copters[0].rangefinder = Some(0.0);
    });
    prepare(&mut world);
    world.run(120.0, cleared);
    world
}

fn forced(world: &World) -> bool {
    noted(world, Severity::Critical, "stopping the motors afloat") > 0
}

#[test]
fn afloat_on_waves_the_motors_stop_though_the_autopilot_finds_no_end() {
    let world = afloat(|_| {});
    assert!(!world.copters[0].armed && forced(&world));
    assert!(world.executors[0].touchdown().is_some());
    // One witness is not enough, and one that speaks against it still less.
    let world = afloat(|world| world.copters[0].rangefinder = None);
    assert!(world.copters[0].armed && !forced(&world));
    let world = afloat(|world| world.copters[0].rangefinder = Some(0.8));
    assert!(world.copters[0].armed && !forced(&world));
    let world = afloat(|world| world.copters[0].off.z = -2.0);
    assert!(world.copters[0].armed && !forced(&world));
}

/// Each row of the table in the documentation of `failsafe` names a test that exists.
#[test]
fn every_fail_safe_of_the_table_has_its_test() {
    let table = include_str!("../failsafe.rs");
    let tests = [include_str!("failsafes.rs"), include_str!("mishaps.rs"), include_str!("pilot.rs")].concat();
    let rows: Vec<&str> = table.lines().filter(|line| line.starts_with("//! |")).skip(2).collect();
    assert!(rows.len() > 20);
    for row in rows {
        let name = row.rsplit('|').nth(1).unwrap().trim().trim_matches('`');
        assert!(tests.contains(&format!("#[test]\nfn {name}(")), "{row}");
    }
}
