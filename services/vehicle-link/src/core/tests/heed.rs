//! What is taken for an autopilot that does not follow, and what is not.

use halcyon_model::VehicleState;
use nalgebra::{UnitQuaternion, Vector3};

use super::world::{World, t0};
use crate::core::heed::{Change, Heed};

const DT_S: f64 = 0.1;

/// A vehicle under watch.
struct Flown {
    heed: Heed,
    state: VehicleState,
    now_s: f64,
    /// Age of its state, seconds.
    age_s: f64,
    changes: Vec<(f64, Change)>,
}

impl Flown {
    fn new() -> Self {
        let mut world = World::new(&[(0.0, 0.0)]);
        world.airborne(0, Vector3::new(0.0, 0.0, -10.0));
        let state = world.copters[0].state(t0());
        Self { heed: Heed::default(), state, now_s: 0.0, age_s: 0.1, changes: Vec::new() }
    }

    /// For so many seconds: told `told(t)`, it flies `flown(t, velocity)`.
    fn run(&mut self, seconds: f64, told: impl Fn(f64) -> Vector3<f64>, flown: impl Fn(f64, Vector3<f64>) -> Vector3<f64>) {
        for _ in 0..(seconds / DT_S).round() as usize {
            self.now_s += DT_S;
            self.state.velocity_ned_mps = flown(self.now_s, self.state.velocity_ned_mps);
            self.state.position_ned_m += self.state.velocity_ned_mps * DT_S;
            let change = self.heed.step(Some(told(self.now_s)), &self.state, self.age_s, DT_S);
            self.changes.extend(change.map(|change| (self.now_s, change)));
        }
    }

    /// It leans so that it is pushed north by this, metres per second squared.
    fn lean(&mut self, push_mps2: f64) {
        let up = Vector3::new(push_mps2, 0.0, -9.806_65).normalize();
        let level = Vector3::new(0.0, 0.0, -1.0);
        self.state.ned_from_body = UnitQuaternion::rotation_between(&level, &up).unwrap();
    }
}

fn north(mps: f64) -> Vector3<f64> {
    Vector3::new(mps, 0.0, 0.0)
}

/// What guidance sends from rest: 1.5 m/s² up to 5 m/s.
fn start(t_s: f64) -> Vector3<f64> {
    north((1.5 * t_s).min(5.0))
}

fn still(_: f64, _: Vector3<f64>) -> Vector3<f64> {
    Vector3::zeros()
}

/// The way told is 0.75 t², so 2.5 m are told after 1.83 s; 3 s later it counts.
#[test]
fn a_vehicle_that_does_not_move_is_found_out_in_five_seconds() {
    let mut flown = Flown::new();
    flown.run(10.0, start, still);
    let [(at_s, Change::Ignored)] = flown.changes[..] else { panic!("{:?}", flown.changes) };
    assert!((at_s - (1.83 + 3.0)).abs() < 0.25, "{at_s}");
    assert!(flown.heed.is_ignored() && flown.heed.holds());
    // Nor one that the wind carries about, or that is told to climb.
    let mut flown = Flown::new();
    flown.run(10.0, start, |t_s, _| Vector3::new(0.4 * (1.3 * t_s).sin(), 0.6 * t_s.cos(), 0.0));
    assert_eq!(flown.changes.len(), 1);
    let mut flown = Flown::new();
    flown.run(10.0, |_| Vector3::new(0.0, 0.0, -1.5), still);
    assert_eq!(flown.changes.len(), 1);
}

#[test]
fn whoever_follows_however_slowly_is_believed() {
    let quiet = |told: fn(f64) -> Vector3<f64>, lag_s: f64| {
        let mut flown = Flown::new();
        flown.run(60.0, told, |t_s, v| v + (told(t_s) - v) * (DT_S / lag_s));
        assert!(flown.changes.is_empty(), "{lag_s} s: {:?}", flown.changes);
    };
    for lag_s in [0.2, 0.7, 1.5, 3.0] {
        quiet(start, lag_s);
        // A circle, a way to and fro, a way that turns about at 8 m/s, a climb.
        quiet(|t_s| Vector3::new((0.8 * t_s).cos(), (0.8 * t_s).sin(), 0.0) * 5.0, lag_s);
        quiet(|t_s| north(5.0 * (0.5 * t_s).sin()), lag_s);
        quiet(|t_s| north(if (t_s / 6.0) as i32 % 2 == 0 { 8.0 } else { -8.0 }), lag_s);
        quiet(|_| Vector3::new(0.0, 0.0, -1.5), lag_s);
    }
}

#[test]
fn what_cannot_be_told_is_no_alarm() {
    // It holds its place, in gusts; it is told to and fro by vehicles in its way.
    let mut flown = Flown::new();
    flown.run(60.0, |_| Vector3::zeros(), |t_s, _| north(1.5 * (2.0 * t_s).sin()));
    flown.run(60.0, |t_s| north(2.0 * (4.0 * t_s).sin()), still);
    // A slow way, and a descent that may have ended on the water.
    flown.run(60.0, |_| north(0.5), still);
    flown.run(60.0, |_| Vector3::new(0.0, 0.0, 1.5), still);
    assert!(flown.changes.is_empty(), "{:?}", flown.changes);
    // Old news of itself; a bad estimator.
    flown.age_s = 2.0;
    flown.run(20.0, |_| north(5.0), still);
    flown.age_s = 0.1;
    flown.state.estimator_ok = false;
    flown.run(20.0, |_| north(5.0), still);
    assert!(flown.changes.is_empty(), "{:?}", flown.changes);
    // Its velocity is not told, its place is; and the other way round.
    for (velocity, place) in [(0.0, 5.0), (5.0, 0.0)] {
        let mut flown = Flown::new();
        for _ in 0..200 {
            flown.state.velocity_ned_mps = north(velocity);
            flown.state.position_ned_m += north(place) * DT_S;
            assert_eq!(flown.heed.step(Some(north(5.0)), &flown.state, 0.1, DT_S), None);
        }
    }
}

/// Against a storm it makes no way, and leans for all it is worth: 20° are 3.6 m/s².
#[test]
fn whoever_leans_into_its_way_tries() {
    let found = |push_mps2| {
        let mut flown = Flown::new();
        flown.lean(push_mps2);
        flown.run(20.0, start, still);
        flown.changes.len()
    };
    assert_eq!((found(3.6), found(-3.6), found(1.0)), (0, 1, 1));
}

#[test]
fn it_is_held_for_tried_again_ever_less_often_and_released_once_it_follows() {
    let mut flown = Flown::new();
    let told = |_| north(5.0);
    flown.run(300.0, told, still);
    assert_eq!(flown.changes.len(), 1, "told once: {:?}", flown.changes);
    // How long each try lasts, and each wait: 15, 30, 60, 60 s.
    let mut flown = Flown::new();
    let (mut waits_s, mut wait_s, mut tried_s) = (Vec::new(), 0.0, 0.0);
    for _ in 0..2500 {
        // A held vehicle is told to stay.
        let told = if flown.heed.holds() { north(0.0) } else { north(5.0) };
        flown.run(DT_S, |_| told, still);
        if flown.heed.holds() {
            wait_s += DT_S;
        } else if wait_s > 0.0 {
            waits_s.push(wait_s);
            wait_s = 0.0;
        } else if flown.heed.is_ignored() {
            tried_s += DT_S;
        }
    }
    for (wait_s, expected_s) in waits_s.iter().zip([15.0, 30.0, 60.0, 60.0]) {
        assert!((wait_s - expected_s).abs() < 0.3, "{waits_s:?}");
    }
    assert!(waits_s.len() >= 4 && tried_s / (waits_s.len() as f64) < 5.0, "{waits_s:?}, {tried_s} s");
    assert_eq!(flown.changes.len(), 1);
    // The next try is followed.
    flown.run(100.0, told, |t_s, v| v + (told(t_s) - v) * (DT_S / 0.7));
    assert_eq!(flown.changes.len(), 2, "{:?}", flown.changes);
    assert!(matches!(flown.changes[1], (_, Change::Heeded)) && !flown.heed.is_ignored());
}
