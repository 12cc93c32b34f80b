//! Keeping a slot beside a leader whose states can't be trusted, or that stands at the least separation.

use halcyon_model::{Activity, LocalPoint, Task, VehicleState};
use nalgebra::Vector3;

use super::world::{World, follow};
use crate::core::executor::Output;

fn in_formation(right_m: f64) -> (World, impl Fn(&mut World)) {
    let mut world = World::new(&[(0.0, 0.0), (0.0, 12.0)]);
    world.airborne(0, Vector3::new(0.0, 0.0, -6.0));
    world.airborne(1, Vector3::new(0.0, 9.0, -6.0));
    let plan = move |world: &mut World| {
        let task = Task::Survey { point: LocalPoint::new(0.0, 0.0), height_m: 6.0, heading_rad: Some(0.0) };
        world.plan(&[(0, task), (1, follow("v0", right_m))], 5.0);
    };
    let settled = |world: &World| matches!(world.activity(1), Activity::Following { settled: true, .. });
    world.until(60.0, &plan, settled);
    (world, plan)
}

/// The distance kept within a formation is less than the formation's own, or neither vehicle would leave the other in peace.
#[test]
fn a_slot_at_the_least_separation_is_kept_there_and_the_leader_stands_still() {
    let (mut world, plan) = in_formation(5.0);
    world.run(30.0, &plan);
    let (leader, follower) = (&world.copters[0], &world.copters[1]);
    assert!(leader.position.xy().norm() < 0.05, "the leader was pushed away: {}", leader.position);
    assert!((follower.position - Vector3::new(0.0, 5.0, -6.0)).norm() < 0.1, "{}", follower.position);
}

#[test]
fn nonsense_from_the_leader_never_reaches_a_setpoint() {
    let (mut world, _) = in_formation(7.0);
    let good = world.copters[0].state(world.now);
    let nonsense = |change: &dyn Fn(&mut VehicleState)| {
        let mut state = good.clone();
        state.stamp = world.now.plus_secs_f64(0.05);
        change(&mut state);
        state
    };
    let bad = [
        nonsense(&|state| state.position_ned_m.x = f64::NAN),
        nonsense(&|state| state.position_ned_m.y = 1e12),
        nonsense(&|state| state.velocity_ned_mps.z = f64::INFINITY),
        nonsense(&|state| state.velocity_ned_mps.x = 1e6),
        nonsense(&|state| state.heading_rad = f64::NAN),
    ];
    for state in bad {
        let now = world.now.plus_secs_f64(0.1);
        world.executors[1].observe_neighbour(state, now);
        for output in world.executors[1].step(now) {
            if let Output::Setpoint(setpoint) = output {
                assert!((setpoint.position_ned_m - Vector3::new(0.0, 7.0, -6.0)).norm() < 0.5, "{setpoint:?}");
                assert!(setpoint.velocity_ned_mps.norm() < 0.5, "{setpoint:?}");
                assert!(setpoint.acceleration_ned_mps2.is_none_or(|acceleration| acceleration.norm() < 1.0));
            }
        }
    }
}
