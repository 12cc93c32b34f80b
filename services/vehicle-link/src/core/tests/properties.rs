//! What must hold in every flight, tried on many.

use std::f64::consts::TAU;

use halcyon_model::{Activity, LocalPoint, Stamp, Task};
use nalgebra::Vector3;
use proptest::prelude::*;

use super::world::{World, follow, land, survey};
use crate::core::executor::PlanAnswer;

const SAFE_HEIGHT_M: f64 = 5.0;

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    /// Clearances come, lapse and go as they like, plans too: no setpoint of a landing is below the safe height unless a valid
    /// safe clearance is in force at that moment.
    #[test]
    fn no_setpoint_below_the_safe_height_without_a_clearance(
        script in prop::collection::vec((0u8..4, 0.2f64..6.0, 0.0f64..5.0), 4..24),
        start_height in 1.0f64..9.0,
    ) {
        let mut world = World::new(&[(0.0, 0.0)]);
        world.airborne(0, Vector3::new(28.0, 0.0, -start_height));
        let mut cleared_until: Option<Stamp>;
        for (kind, for_s, valid_s) in script {
            match kind {
                0 => { cleared_until = None; world.plan(&[(0, land(30.0, 0.0, None))], 20.0); }
                1 | 2 => {
                    cleared_until = Some(world.now.plus_secs_f64(valid_s * 4.0));
                    world.plan(&[(0, land(30.0, 0.0, cleared_until))], 20.0);
                }
                // A plan that lapses while its clearance would still hold: then the plan's end counts.
                _ => {
                    cleared_until = Some(world.now.plus_secs_f64(valid_s));
                    world.plan(&[(0, land(30.0, 0.0, Some(world.now.plus_secs_f64(60.0))))], valid_s);
                }
            }
            for _ in 0..(for_s * 10.0) as usize {
                world.step();
                let cleared = cleared_until.is_some_and(|until| world.now <= until);
                if let Some(setpoint) = world.setpoint(0) {
                    prop_assert!(cleared || setpoint.height_m() >= SAFE_HEIGHT_M - 1e-9, "{setpoint:?}");
                }
            }
        }
    }

    /// Two vehicles cross, at any angle and offset, at the same height.
    #[test]
    fn vehicles_that_cross_keep_their_distance(
        angle in 0.0f64..TAU, offset in -6.0f64..6.0, height in 5.0f64..7.0,
    ) {
        let mut world = World::new(&[(0.0, 0.0), (0.0, -8.0)]);
        let direction = Vector3::new(angle.cos(), angle.sin(), 0.0);
        let side = Vector3::new(-angle.sin(), angle.cos(), 0.0);
        world.airborne(0, Vector3::new(-30.0, 0.0, -5.0));
        world.airborne(1, -30.0 * direction + offset * side + Vector3::new(0.0, 0.0, -height));
        if (world.copters[0].position - world.copters[1].position).norm() < 8.0 {
            return Ok(());
        }
        let goal = 30.0 * direction + offset * side;
        if (goal - Vector3::new(30.0, 0.0, 0.0)).norm() < 8.0 {
            return Ok(());
        }
        let there = Task::Survey { point: LocalPoint::new(goal.x, goal.y), height_m: height, heading_rad: None };
        world.until(
            120.0,
            |world| drop(world.plan(&[(0, survey(30.0, 0.0)), (1, there.clone())], 5.0)),
            |world| (0..2).all(|index| matches!(world.activity(index), Activity::Holding { settled: true })),
        );
        prop_assert!(world.least_m >= 5.0, "{}", world.least_m);
    }

    /// A leader that goes through wild squares and turns, followers on both sides, one of them changing sides.
    #[test]
    fn followers_keep_their_distance_whatever_the_leader_does(
        corners in prop::collection::vec((-40.0f64..40.0, -40.0f64..40.0, 0.0f64..TAU), 3..6),
        swap_at in 0usize..3,
    ) {
        let mut world = World::new(&[(0.0, 0.0), (0.0, -12.0), (0.0, 12.0)]);
        world.airborne(0, Vector3::new(0.0, 0.0, -5.0));
        world.airborne(1, Vector3::new(0.0, -8.0, -5.0));
        world.airborne(2, Vector3::new(0.0, 8.0, -5.0));
        for (index, (north, east, heading)) in corners.into_iter().enumerate() {
            let sides = if index > swap_at { (7.0, -7.0) } else { (-7.0, 7.0) };
            world.run(20.0, |world| {
                let task = Task::Survey { point: LocalPoint::new(north, east), height_m: 5.0, heading_rad: Some(heading) };
                world.plan(&[(0, task), (1, follow("v0", sides.0)), (2, follow("v0", sides.1))], 5.0);
            });
        }
        prop_assert!(world.least_m >= 5.0, "{}", world.least_m);
    }

    /// The generation in force never goes back, whatever order plans come in.
    #[test]
    fn generations_only_grow(order in prop::collection::vec(1u64..40, 1..60)) {
        let mut world = World::new(&[(0.0, 0.0)]);
        let mut newest = 0;
        for generation in order {
            world.generation = generation - 1;
            let answer = world.plan(&[(0, survey(10.0, 0.0))], 5.0).remove(0);
            let expected = match generation.cmp(&newest) {
                std::cmp::Ordering::Less => PlanAnswer::RefusedOlder { seen: newest },
                std::cmp::Ordering::Equal => PlanAnswer::Known,
                std::cmp::Ordering::Greater => PlanAnswer::Accepted,
            };
            prop_assert_eq!(answer, expected);
            newest = newest.max(generation);
            prop_assert_eq!(world.executors[0].plan_generation(), newest);
        }
    }

    /// The same inputs give the same outputs.
    #[test]
    fn deterministic(north in -40.0f64..40.0, east in -40.0f64..40.0) {
        let fly = || {
            let mut world = World::new(&[(0.0, 0.0), (0.0, -8.0)]);
            let mut all = Vec::new();
            world.run(30.0, |world| {
                world.plan(&[(0, survey(north, east)), (1, follow("v0", 7.0))], 5.0);
                all.push(world.outputs.clone());
            });
            all
        };
        prop_assert_eq!(fly(), fly());
    }
}
