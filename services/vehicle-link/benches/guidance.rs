//! What a setpoint costs: one guidance step of a follower with nine neighbours about it, and the news of all of them.
#![allow(missing_docs, clippy::unwrap_used)]

use criterion::{Criterion, criterion_group, criterion_main};
use halcyon_model::{
    Activity, Ages, Assignment, DispatchPlan, Fix, FleetOrigin, FlightMode, Geodetic, Intent, LandedState, Role, Slot, Stamp,
    Task, VehicleId, VehicleState,
};
use halcyon_vehicle_link::core::executor::{Executor, ExecutorConfig, Output};
use halcyon_vehicle_link::core::guidance::Guidance;
use halcyon_vehicle_link::core::limits::{FailSafeLimits, Limits};
use halcyon_vehicle_link::core::payload::Payload;
use nalgebra::{UnitQuaternion, Vector3};

fn origin() -> FleetOrigin {
    FleetOrigin(Geodetic::from_deg(53.1, -2.9, 0.0))
}

fn id(index: usize) -> VehicleId {
    VehicleId::new(if index == 0 { "leader-1".to_owned() } else { format!("follower-{index}") }.as_str()).unwrap()
}

/// The leader and its line abreast, all at 3 m/s.
fn state(index: usize, now: Stamp, flown_s: f64) -> VehicleState {
    let side = if index.is_multiple_of(2) { -1.0 } else { 1.0 };
    let position_ned_m = Vector3::new(3.0 * flown_s, side * 7.0 * index.div_ceil(2) as f64, -8.0);
    let velocity_ned_mps = Vector3::new(3.0, 0.0, 0.0);
    VehicleState {
        stamp: now,
        vehicle: id(index),
        role: if index == 0 { Role::Leader } else { Role::Follower },
        position: origin().frame().geodetic_from_ned(position_ned_m),
        position_ned_m,
        velocity_ned_mps,
        ned_from_body: UnitQuaternion::identity(),
        heading_rad: 0.0,
        home: Some(origin().0),
        mode: FlightMode::Guided,
        armed: true,
        landed: LandedState::InAir,
        battery_fraction: Some(0.9),
        battery_v: None,
        fix: Some(Fix { kind: 3, satellites: 12, horizontal_sigma_m: None }),
        estimator_ok: true,
        ready_to_arm: true,
        boot_s: 100.0,
        activity: Activity::Following { settled: true, slot_error_m: 0.1 },
        plan_generation: 1,
        touchdown: None,
        acceleration_ned_mps2: None,
        intent: (index == 0).then_some(Intent {
            stamp: now,
            position_ned_m,
            velocity_ned_mps,
            acceleration_ned_mps2: Vector3::zeros(),
        }),
        range: None,
        ages: Ages::default(),
        link: None,
        firmware: None,
        has_payload: false,
    }
}

fn follower() -> Executor {
    Executor::new(ExecutorConfig {
        vehicle: id(1),
        limits: Limits::default(),
        fail_safe: FailSafeLimits { fence_radius_m: 1e6, ..FailSafeLimits::default() },
        guidance: Guidance::default(),
        home_height_m: 0.0,
        payload: Payload::default(),
        frame: origin().frame(),
    })
}

fn plan(now: Stamp, generation: u64) -> DispatchPlan {
    let task = |index: usize| {
        let side = if index.is_multiple_of(2) { -1.0 } else { 1.0 };
        let slot = Slot { forward_m: 0.0, right_m: side * 7.0 * index.div_ceil(2) as f64, up_m: 0.0 };
        Assignment { vehicle: id(index), task: Task::Follow { leader: id(0), slot } }
    };
    let valid_until = now.plus_secs_f64(30.0);
    DispatchPlan { stamp: now, generation, mission: None, valid_until, assignments: (1..10).map(task).collect() }
}

/// Hears everybody, or only its own autopilot, and takes a step. A tenth of a second goes by each time.
fn tick(executor: &mut Executor, step: u64) -> bool {
    let flown_s = 0.1 * step as f64;
    let now = Stamp::from_secs_f64(1_760_000_000.0).plus_secs_f64(flown_s);
    if step.is_multiple_of(50) {
        executor.observe_plan(&plan(now, 1 + step / 50), now);
    }
    executor.observe_self(state(1, now, flown_s), now, now);
    for index in (0..10).filter(|index| *index != 1) {
        executor.observe_neighbour(state(index, now, flown_s), now);
    }
    executor.step(now).iter().any(|output| matches!(output, Output::Setpoint(_)))
}

fn guidance(criterion: &mut Criterion) {
    let mut executor = follower();
    let mut step = 0;
    // In formation before anything is measured.
    for _ in 0..100 {
        assert!(tick(&mut executor, step) || step < 2, "no setpoint");
        step += 1;
    }
    criterion.bench_function("nine neighbours' states, own state, setpoint", |bencher| {
        bencher.iter(|| {
            step += 1;
            assert!(tick(&mut executor, step), "no setpoint");
        });
    });
}

criterion_group!(benches, guidance);
criterion_main!(benches);
