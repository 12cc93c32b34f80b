//! The rows of the fail-safe table that concern plans, links, batteries, people and clearances; the others are in `mishaps`.

use halcyon_model::{Activity, Assignment, DispatchPlan, FlightMode, LocalPoint, Task, VehicleAction};
use nalgebra::Vector3;

use super::world::{World, follow, id, land, survey};
use crate::core::commands::Command;
use crate::core::executor::{Decision, Output, PlanAnswer};

fn reason(world: &World, index: usize) -> &str {
    match world.activity(index) {
        Activity::FailSafe { reason } => reason,
        _ => "",
    }
}

fn down(world: &World, index: usize) -> bool {
    !world.copters[index].armed
}

/// In the air over (40, 0), holding there under a plan.
fn holding() -> World {
    let mut world = World::new(&[(0.0, 0.0), (0.0, -8.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.run(5.0, keep);
    assert!(matches!(world.activity(0), Activity::Holding { settled: true }), "{:?}", world.activity(0));
    world
}

fn keep(world: &mut World) {
    world.plan(&[(0, survey(40.0, 0.0))], 5.0);
}

/// `v1` in its slot beside `v0`.
fn following() -> World {
    let mut world = World::new(&[(0.0, 0.0), (0.0, -8.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.airborne(1, Vector3::new(40.0, 9.0, -5.0));
    world.run(15.0, keep_following);
    assert!(matches!(world.activity(1), Activity::Following { settled: true, .. }), "{:?}", world.activity(1));
    world
}

fn keep_following(world: &mut World) {
    world.plan(&[(0, survey(40.0, 0.0)), (1, follow("v0", 7.0))], 5.0);
}

#[test]
fn a_lapsed_plan_holds_then_returns_and_a_newer_one_is_taken_up_again() {
    let mut world = holding();
    // 5 s of validity, then held for 10 s, then home.
    world.run(14.5, |world| assert!((world.copters[0].position.x - 40.0).abs() < 0.5));
    assert_eq!(reason(&world, 0), "no valid plan");
    world.until(10.0, |_| {}, |world| world.copters[0].position.x < 30.0);
    world.until(60.0, keep, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
    world.until(120.0, |_| {}, |world| down(world, 0));
    assert!(world.copters[0].position.norm() < 0.5, "{}", world.copters[0].position);
}

#[test]
fn a_silent_leader_is_predicted_then_waited_for_then_given_up() {
    let mut world = following();
    world.copters[0].silent = true;
    world.run(1.5, keep_following);
    let place = world.copters[1].position;
    world.run(3.0, |world| {
        keep_following(world);
        assert!(matches!(world.activity(1), Activity::Following { settled: false, .. }));
    });
    assert!((world.copters[1].position - place).norm() < 0.5, "it kept flying blind");
    world.run(1.5, keep_following);
    assert!(reason(&world, 1).contains("has not been heard"), "{:?}", world.activity(1));
    // Heard again in time, it goes on.
    world.copters[0].silent = false;
    world.until(10.0, keep_following, |world| matches!(world.activity(1), Activity::Following { settled: true, .. }));
    world.copters[0].silent = true;
    // At 5 s it is given up and flown home, not waited for again.
    world.until(9.0, keep_following, |world| (world.copters[1].position - place).norm() > 4.0);
    world.until(120.0, keep_following, |world| down(world, 1));
    assert!((world.copters[1].position - Vector3::new(0.0, -8.0, 0.0)).norm() < 0.5);
}

#[test]
fn a_leader_that_leaves_the_allowed_modes_ends_the_following() {
    let mut world = following();
    world.copters[0].mode = FlightMode::Loiter;
    world.run(3.0, keep_following);
    assert!(matches!(world.activity(1), Activity::Following { .. }), "LOITER is allowed");
    world.copters[0].mode = FlightMode::Rtl;
    world.run(1.0, keep_following);
    assert!(reason(&world, 1).contains("is in RTL"), "{:?}", world.activity(1));
    world.until(120.0, keep_following, |world| down(world, 1));
}

#[test]
fn a_bad_estimator_stops_then_lands() {
    let mut world = holding();
    world.copters[0].estimator_ok = false;
    world.run(2.0, keep);
    assert!(reason(&world, 0).contains("position not good enough"), "{:?}", world.activity(0));
    assert_eq!(world.copters[0].mode, FlightMode::Guided);
    world.run(5.0, keep);
    assert_eq!(world.copters[0].mode, FlightMode::Land);
    world.until(60.0, keep, |world| down(world, 0));
}

#[test]
fn a_glitch_that_passes_changes_nothing() {
    let mut world = holding();
    world.copters[0].estimator_ok = false;
    world.run(0.5, keep);
    world.copters[0].estimator_ok = true;
    world.run(5.0, |world| {
        keep(world);
        assert!(matches!(world.activity(0), Activity::Holding { settled: true }));
    });
}

#[test]
fn battery_low_returns_and_stays_returning_battery_empty_lands_here() {
    let mut world = holding();
    world.copters[0].battery = Some(0.24);
    world.run(4.0, keep);
    world.copters[0].battery = Some(0.27);
    assert!(reason(&world, 0).contains("battery 24 %"), "{:?}", world.activity(0));
    world.until(120.0, keep, |world| down(world, 0));
    assert!(world.copters[0].position.norm() < 0.5, "latched: a battery that recovers at rest is still low");

    let mut world = holding();
    world.copters[0].battery = Some(0.1);
    world.until(60.0, keep, |world| down(world, 0));
    assert!((world.copters[0].position.x - 40.0).abs() < 1.0, "{}", world.copters[0].position);
}

#[test]
fn battery_unknown_for_long_returns() {
    let mut world = holding();
    world.copters[0].battery = None;
    world.run(14.0, keep);
    assert_eq!(reason(&world, 0), "");
    world.run(2.0, keep);
    assert!(reason(&world, 0).contains("battery unknown"));
}

#[test]
fn outside_the_fence_it_returns_and_a_task_outside_is_refused() {
    let mut world = holding();
    let answers = world.plan(&[(0, survey(600.0, 0.0))], 5.0);
    assert!(matches!(&answers[0], PlanAnswer::RefusedInvalid(reason) if reason.contains("outside the fence")), "{answers:?}");
    // Carried away by the wind, before anyone was looking.
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(510.0, 0.0, -5.0));
    world.run(1.0, keep);
    assert!(reason(&world, 0).contains("outside the fence"), "{:?}", world.activity(0));
    world.until(250.0, keep, |world| down(world, 0));
    assert!(world.copters[0].position.norm() < 0.5);
}

/// ArduCopter's own fence ends where ours goes on.
#[test]
fn targets_that_the_autopilot_ignores_are_held_for_and_tried_again() {
    let far = |world: &mut World| drop(world.plan(&[(0, survey(100.0, 0.0))], 5.0));
    let mut world = holding();
    world.copters[0].fence_m = 60.0;
    world.until(30.0, far, |world| world.copters[0].position.x > 57.0);
    let now = world.now;
    world.executors[0].observe_text("Fence: 60m", now);
    let took_s = world.until(15.0, far, |world| !reason(world, 0).is_empty());
    assert!(took_s > 3.0, "{took_s}: it lags, it might have been thought");
    assert_eq!(reason(&world, 0), "the autopilot does not follow its targets; its own fence? (it said: Fence: 60m)");
    let alarms = |world: &World| world.notes.iter().filter(|(_, note)| note.what == "fail-safe").count();
    // Through several tries it stays where it is, in GUIDED, and says so once.
    let place = world.copters[0].position;
    world.run(90.0, |world| {
        far(world);
        assert!((world.copters[0].position - place).norm() < 2.0, "{}", world.copters[0].position);
        assert_eq!(world.copters[0].mode, FlightMode::Guided);
        assert!(reason(world, 0).contains("does not follow"), "{:?}", world.activity(0));
    });
    assert_eq!(alarms(&world), 1, "{:?}", world.notes);
    // The same again is refused, something else is not.
    let go = |north_m| VehicleAction::GoTo { point: LocalPoint::new(north_m, 0.0), height_m: 5.0 };
    let Decision::Refused(why) = world.command(0, go(100.0)) else { panic!("it was not refused") };
    assert!(why.contains("does not follow its targets"), "{why}");
    assert!(matches!(world.command(0, go(30.0)), Decision::Accepted(_)));
    world.until(30.0, |_| {}, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
    assert!((world.copters[0].position.x - 30.0).abs() < 1.0);
    // The autopilot's fence is taken away while it is held for: the next try goes on.
    let mut world = holding();
    world.copters[0].fence_m = 60.0;
    world.until(60.0, far, |world| !reason(world, 0).is_empty());
    world.copters[0].fence_m = f64::INFINITY;
    world.until(60.0, far, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
    assert!((world.copters[0].position.x - 100.0).abs() < 1.0);
    // On the way home there is nothing to hold for, but it is said.
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(100.0, 0.0, -6.0));
    world.run(2.0, far);
    world.copters[0].fence_m = -1.0;
    world.run(20.0, |world| drop(world.plan(&[(0, Task::Return)], 5.0)));
    assert_eq!(*world.activity(0), Activity::Returning);
    assert_eq!(world.notes.iter().filter(|(_, note)| note.what == "not on its way home").count(), 1, "{:?}", world.notes);
}

#[test]
fn the_pilot_is_never_fought_and_hands_back_with_guided() {
    let mut world = holding();
    world.copters[0].mode = FlightMode::Loiter;
    world.step();
    assert!(world.outputs[0].contains(&Output::Withdraw));
    world.run(30.0, |world| {
        keep(world);
        let silent = |output: &Output| matches!(output, Output::Note(_) | Output::Withdraw);
        assert!(world.outputs[0].iter().all(silent), "{:?}", world.outputs[0]);
        assert_eq!(world.copters[0].mode, FlightMode::Loiter);
    });
    assert_eq!(*world.activity(0), Activity::PilotControl);
    // Not even with an empty battery, nor by a task.
    world.copters[0].battery = Some(0.05);
    world.run(5.0, |world| {
        world.plan(&[(0, Task::Return)], 5.0);
    });
    assert_eq!(world.copters[0].mode, FlightMode::Loiter);
    world.copters[0].battery = Some(0.9);
    world.copters[0].mode = FlightMode::Guided;
    world.until(30.0, keep, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
}

#[test]
fn the_autopilots_own_fail_safe_is_not_fought_either_and_is_named() {
    let mut world = holding();
    let now = world.now;
    world.executors[0].observe_text("EKF Failsafe: changed to LAND Mode", now);
    world.copters[0].mode = FlightMode::Land;
    world.run(2.0, keep);
    assert!(reason(&world, 0).contains("EKF Failsafe"), "{:?}", world.activity(0));
    world.until(60.0, keep, |world| down(world, 0));
    world.run(20.0, |world| {
        keep(world);
        assert!(down(world, 0), "it took off again");
    });
}

#[test]
fn a_silent_autopilot_is_sent_nothing_and_taken_up_again() {
    let mut world = holding();
    world.copters[0].silent = true;
    world.run(3.2, keep);
    world.run(20.0, |world| {
        keep(world);
        let silent = |output: &Output| matches!(output, Output::Note(_));
        assert!(world.outputs[0].iter().all(silent), "{:?}", world.outputs[0]);
    });
    assert_eq!(reason(&world, 0), "autopilot link lost");
    world.copters[0].silent = false;
    world.until(30.0, keep, |world| matches!(world.activity(0), Activity::Holding { settled: true }));
}

/// Descends over (40, 0) with clearance until it is at `height_m`.
fn descending_to(height_m: f64) -> World {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.until(90.0, cleared, |world| world.height(0) <= height_m);
    world
}

fn cleared(world: &mut World) {
    let until = world.now.plus_secs_f64(1.0);
    world.plan(&[(0, land(40.0, 0.0, Some(until)))], 5.0);
}

fn uncleared(world: &mut World) {
    world.plan(&[(0, land(40.0, 0.0, None))], 5.0);
}

#[test]
fn a_withdrawn_clearance_stops_the_descent_climbs_waits_and_returns() {
    let mut world = descending_to(2.5);
    let lowest = std::cell::Cell::new(f64::INFINITY);
    world.until(
        30.0,
        |world| {
            uncleared(world);
            lowest.set(lowest.get().min(world.height(0)));
        },
        |world| world.height(0) > 4.6,
    );
    assert!(lowest.get() > 2.0, "{}", lowest.get());
    assert!(world.notes.iter().any(|(_, note)| note.what == "descent broken off"));
    world.run(20.0, uncleared);
    assert_eq!(*world.activity(0), Activity::Approaching);
    assert!((world.height(0) - 5.0).abs() < 0.3);
    // A new clearance is taken up.
    world.until(30.0, cleared, |world| world.height(0) < 3.0);
    world.until(300.0, uncleared, |world| down(world, 0));
    assert!(world.copters[0].position.norm() < 0.5, "it waited two minutes, then flew home");
}

#[test]
fn a_clearance_that_merely_lapses_and_a_plan_that_lapses_do_the_same() {
    let mut world = descending_to(2.5);
    let until = world.now.plus_secs_f64(0.5);
    world.run(3.0, |world| drop(world.plan(&[(0, land(40.0, 0.0, Some(until)))], 5.0)));
    assert!(world.height(0) > 4.5, "{}", world.height(0));

    let mut world = descending_to(2.5);
    world.plan(&[(0, land(40.0, 0.0, Some(world.now.plus_secs_f64(600.0))))], 0.5);
    world.run(5.0, |_| {});
    assert_eq!(reason(&world, 0), "no valid plan");
    world.run(3.0, |_| {});
    assert!(world.height(0) > 4.5, "{}", world.height(0));
    world.until(120.0, |_| {}, |world| down(world, 0));
    assert!(world.copters[0].position.norm() < 0.5);
}

/// A companion computer without a clock of its own may start minutes behind the ground's.
#[test]
fn a_clock_that_is_behind_does_not_lengthen_a_plan_or_a_clearance() {
    let ahead = |world: &World, generation, plan_s, clearance_s| {
        let theirs = world.now.plus_secs_f64(40.0);
        let task = land(40.0, 0.0, Some(theirs.plus_secs_f64(clearance_s)));
        DispatchPlan {
            stamp: theirs,
            generation,
            mission: None,
            valid_until: theirs.plus_secs_f64(plan_s),
            assignments: vec![Assignment { vehicle: id("v0"), task }],
        }
    };
    for (plan_s, clearance_s) in [(5.0, 1.0), (1.0, 5.0)] {
        let mut world = descending_to(2.5);
        let (now, plan) = (world.now, ahead(&world, world.generation + 1, plan_s, clearance_s));
        assert_eq!(world.executors[0].observe_plan(&plan, now), PlanAnswer::Accepted);
        world.run(4.5, |_| {});
        assert!(world.height(0) > 2.5, "plan {plan_s} s, clearance {clearance_s} s: {}", world.height(0));
    }
}

#[test]
fn in_land_mode_it_is_broken_off_above_the_commit_height_and_finished_below() {
    let mut world = descending_to(0.9);
    world.until(5.0, cleared, |world| world.copters[0].mode == FlightMode::Land);
    assert!(world.height(0) > 0.55, "{}", world.height(0));
    world.until(15.0, uncleared, |world| world.height(0) > 4.0);

    let mut world = descending_to(0.45);
    world.until(10.0, uncleared, |world| down(world, 0));
    assert!(world.executors[0].touchdown().is_some());
}

#[test]
fn a_fail_safes_landing_elsewhere_is_not_finished_on_the_landing_places_clearance() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(20.0, 0.0, -5.0));
    world.run(1.0, cleared);
    world.copters[0].estimator_ok = false;
    world.until(20.0, cleared, |world| world.copters[0].mode == FlightMode::Land && world.height(0) < 4.0);
    assert!(world.copters[0].position.x < 36.0, "it was still on the way: {}", world.copters[0].position);
    world.copters[0].estimator_ok = true;
    world.until(120.0, cleared, |world| down(world, 0));
    assert!((world.copters[0].position - Vector3::new(40.0, 0.0, 0.0)).norm() < 1.0, "{}", world.copters[0].position);
}

#[test]
fn a_verdict_that_is_not_safe_is_no_clearance() {
    for verdict in [halcyon_model::VerdictState::Unsafe, halcyon_model::VerdictState::Inconclusive] {
        let mut world = descending_to(3.0);
        world.run(10.0, |world| {
            let mut task = land(40.0, 0.0, Some(world.now.plus_secs_f64(5.0)));
            if let Task::Land { clearance: Some(clearance), .. } = &mut task {
                clearance.verdict = verdict;
            }
            world.plan(&[(0, task)], 5.0);
        });
        assert!(world.height(0) > 4.5, "{verdict:?} {}", world.height(0));
    }
}

#[test]
fn after_a_restart_in_flight_nothing_is_sent_until_a_plan_comes_or_the_grace_ends() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.run(9.5, |world| {
        let silent = |output: &Output| matches!(output, Output::Note(_));
        assert!(world.outputs[0].iter().all(silent), "{:?}", world.outputs[0]);
    });
    world.run(5.0, |_| {});
    assert_eq!(reason(&world, 0), "no valid plan");
    assert!((world.copters[0].position.x - 40.0).abs() < 0.2, "held");
    world.until(120.0, |_| {}, |world| down(world, 0));
    assert!(world.copters[0].position.norm() < 0.5, "then home");
}

#[test]
fn after_a_restart_a_landing_under_way_is_finished_and_one_that_is_over_is_not_repeated() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -1.0));
    world.copters[0].mode = FlightMode::Land;
    world.run(0.3, cleared);
    assert_eq!(*world.activity(0), Activity::Descending);
    world.until(20.0, cleared, |world| down(world, 0));
    assert_eq!(*world.activity(0), Activity::Landed);
    // The service restarts on the water.
    world.executors[0] = crate::core::executor::Executor::new(super::world::config("v0"));
    world.run(10.0, |world| {
        cleared(world);
        let asks = |output: &Output| matches!(output, Output::Request(Command::Arm | Command::TakeOff { .. }));
        assert!(!world.outputs[0].iter().any(asks));
    });
    assert_eq!(*world.activity(0), Activity::Landed);
    assert!(world.executors[0].touchdown().is_some());
    // An RTL that nobody here asked for is left alone.
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(40.0, 0.0, -5.0));
    world.copters[0].mode = FlightMode::Rtl;
    world.run(3.0, keep);
    assert_eq!(*world.activity(0), Activity::PilotControl);
    assert_eq!(world.copters[0].mode, FlightMode::Rtl);
}
