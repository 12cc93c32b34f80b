//! Whole flights, nothing going wrong.

use halcyon_model::{Activity, FlightMode, LocalPoint, Task, VehicleAction};
use nalgebra::Vector3;

use super::world::{World, follow, land, survey};
use crate::core::commands::Command;
use crate::core::executor::{Output, word};

fn settled(world: &World, index: usize) -> bool {
    matches!(world.activity(index), Activity::Holding { settled: true } | Activity::Following { settled: true, .. })
}

#[test]
fn a_survey_takes_off_to_the_safe_height_goes_there_and_settles() {
    let mut world = World::new(&[(0.0, 0.0)]);
    let mut story: Vec<&str> = Vec::new();
    let mut sideways_low = false;
    let took_s = world.until(
        90.0,
        |world| {
            world.plan(&[(0, survey(60.0, 20.0))], 5.0);
            let word = word(world.activity(0));
            if story.last() != Some(&word) {
                story.push(word);
            }
            sideways_low |= world.height(0) < 4.0 && world.copters[0].velocity.xy().norm() > 0.2;
        },
        |world| settled(world, 0),
    );
    assert_eq!(story, ["idle", "preparing", "taking off", "in transit", "holding"]);
    assert!(!sideways_low, "it went sideways below the safe height");
    let copter = &world.copters[0];
    assert!((copter.position - Vector3::new(60.0, 20.0, -5.0)).norm() < 0.7, "{}", copter.position);
    assert!((copter.heading - 1.0).abs() < 1e-9);
    assert!(took_s < 40.0, "{took_s}");
    // Again and again the same plan changes nothing: it holds.
    world.run(20.0, |world| {
        world.plan(&[(0, survey(60.0, 20.0))], 5.0);
        assert!(settled(world, 0));
    });
    assert!((world.copters[0].position - Vector3::new(60.0, 20.0, -5.0)).norm() < 0.05);
}

#[test]
fn a_follower_climbs_to_the_safe_height_joins_its_slot_and_keeps_it_while_the_leader_turns() {
    let mut world = World::new(&[(0.0, 0.0), (0.0, -8.0)]);
    let leader = survey(60.0, 20.0);
    world.until(90.0, |world| drop(world.plan(&[(0, leader.clone())], 5.0)), |world| settled(world, 0));
    let mut low_in_transit = false;
    let plan = |world: &mut World| drop(world.plan(&[(0, leader.clone()), (1, follow("v0", 7.0))], 5.0));
    world.until(
        90.0,
        |world| {
            plan(world);
            let flying = matches!(world.activity(1), Activity::Following { .. });
            low_in_transit |= flying && world.height(1) < 4.4;
        },
        |world| settled(world, 1),
    );
    assert!(!low_in_transit, "it followed below the safe height");
    // The leader turns at 20°/s, the slot swings at 2.4 m/s.
    let mut error_squared = 0.0;
    let mut heading = 1.0f64;
    world.run(36.0, |world| {
        heading += 2.0f64.to_radians();
        let task = Task::Survey {
            point: LocalPoint::new(60.0, 20.0),
            height_m: 5.0,
            heading_rad: Some(heading.rem_euclid(std::f64::consts::TAU)),
        };
        world.plan(&[(0, task), (1, follow("v0", 7.0))], 5.0);
        let (leader, follower) = (&world.copters[0], &world.copters[1]);
        let slot = leader.position + 7.0 * Vector3::new(-leader.heading.sin(), leader.heading.cos(), 0.0);
        error_squared += (slot - follower.position).norm_squared() / 360.0;
    });
    assert!(world.least_m > 5.5, "{}", world.least_m);
    assert!(error_squared.sqrt() < 2.0, "slot error {} m RMS", error_squared.sqrt());
}

#[test]
fn a_cleared_landing_touches_down_on_the_spot_and_stays_down() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.airborne(0, Vector3::new(30.0, 0.0, -5.0));
    let plan = |world: &mut World| drop(world.plan(&[(0, land(40.0, 10.0, Some(world.now.plus_secs_f64(3.0))))], 5.0));
    let mut story: Vec<&str> = Vec::new();
    let mut fastest = 0.0f64;
    world.until(
        120.0,
        |world| {
            plan(world);
            let word = word(world.activity(0));
            if story.last() != Some(&word) {
                story.push(word);
            }
            fastest = fastest.max(world.copters[0].velocity.z);
        },
        |world| *world.activity(0) == Activity::Landed && !world.copters[0].armed,
    );
    story.push(word(world.activity(0)));
    assert_eq!(story, ["idle", "in transit", "approaching", "descending", "landed"]);
    // A little more while the point mass catches up with its reference.
    assert!(fastest <= 0.6, "{fastest} m/s down");
    let touchdown = world.executors[0].touchdown().unwrap();
    assert!(touchdown.distance_m(&LocalPoint::new(40.0, 10.0)) < 0.3, "{touchdown:?}");
    world.run(30.0, |world| {
        plan(world);
        assert_eq!(*world.activity(0), Activity::Landed);
        assert!(!world.copters[0].armed);
    });
}

#[test]
fn return_flies_home_lands_and_stays() {
    let mut world = World::new(&[(3.0, -8.0)]);
    world.until(90.0, |world| drop(world.plan(&[(0, survey(60.0, 20.0))], 5.0)), |world| settled(world, 0));
    world.until(
        120.0,
        |world| drop(world.plan(&[(0, Task::Return)], 5.0)),
        |world| *world.activity(0) == Activity::Landed && !world.copters[0].armed,
    );
    assert!((world.copters[0].position - Vector3::new(3.0, -8.0, 0.0)).norm() < 0.3, "{}", world.copters[0].position);
    assert_eq!(world.executors[0].touchdown(), None, "a touchdown belongs to a landing task");
}

#[test]
fn nothing_takes_off_without_a_plan_or_for_a_landing_or_unready() {
    let quiet = |prepare: &dyn Fn(&mut World), task: Option<Task>| {
        let mut world = World::new(&[(0.0, 0.0)]);
        prepare(&mut world);
        world.run(20.0, |world| {
            if let Some(task) = &task {
                world.plan(&[(0, task.clone())], 5.0);
            }
            let forbidden = |output: &Output| matches!(output, Output::Request(Command::Arm | Command::TakeOff { .. }));
            assert!(!world.outputs[0].iter().any(forbidden), "{:?}", world.outputs[0]);
        });
        world.executors[0].detail().to_owned()
    };
    let go = || Some(survey(20.0, 0.0));
    quiet(&|_| {}, None);
    quiet(&|_| {}, Some(Task::Hold));
    quiet(&|_| {}, Some(Task::Return));
    quiet(&|_| {}, Some(land(20.0, 0.0, None)));
    assert!(quiet(&|world| world.copters[0].ready = false, go()).contains("arming checks"));
    assert!(quiet(&|world| world.copters[0].estimator_ok = false, go()).contains("estimator"));
    assert!(quiet(&|world| world.copters[0].battery = None, go()).contains("battery unknown"));
    assert!(quiet(&|world| world.copters[0].battery = Some(0.3), go()).contains("battery 30 %"));
    assert!(quiet(&|_| {}, Some(follow("v1", 7.0))).contains("not been heard"));
}

#[test]
fn a_plan_that_lapses_before_take_off_stops_it() {
    let mut world = World::new(&[(0.0, 0.0)]);
    world.copters[0].ready = false;
    world.plan(&[(0, survey(20.0, 0.0))], 5.0);
    world.run(6.0, |_| {});
    world.copters[0].ready = true;
    world.run(20.0, |world| assert!(!world.copters[0].armed));
    assert!(world.executors[0].detail().contains("valid plan"));
}

#[test]
fn a_vehicle_that_came_down_stays_down_until_its_task_changes() {
    let mut world = World::new(&[(0.0, 0.0)]);
    let plan = |world: &mut World| drop(world.plan(&[(0, survey(20.0, 0.0))], 5.0));
    world.until(90.0, plan, |world| settled(world, 0));
    world.command(0, VehicleAction::Land);
    world.until(60.0, plan, |world| !world.copters[0].armed);
    world.run(30.0, |world| {
        plan(world);
        assert!(!world.copters[0].armed, "it took off again by itself");
    });
    world.until(30.0, |world| drop(world.plan(&[(0, survey(25.0, 0.0))], 5.0)), |world| world.copters[0].armed);
}

#[test]
fn a_vehicle_that_the_pilot_brought_down_stays_down_until_guided_is_set() {
    let mut world = World::new(&[(0.0, 0.0)]);
    let plan = |world: &mut World| drop(world.plan(&[(0, survey(20.0, 0.0))], 5.0));
    world.until(90.0, plan, |world| settled(world, 0));
    world.copters[0].mode = FlightMode::Land;
    world.until(60.0, plan, |world| !world.copters[0].armed);
    let other = |world: &mut World| drop(world.plan(&[(0, survey(25.0, 0.0))], 5.0));
    world.run(30.0, |world| {
        other(world);
        assert!(!world.copters[0].armed, "it took off with the pilot beside it");
    });
    world.command(0, VehicleAction::SetMode(FlightMode::Guided));
    world.until(30.0, other, |world| world.copters[0].armed);
}
