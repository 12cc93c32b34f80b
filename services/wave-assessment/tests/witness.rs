//! The rig's rangefinder beside the cameras: one that sees the same waves, others, or nothing.
#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod support;

use halcyon_model::{
    Activity, Ages, FlightMode, Geodetic, LandedState, Range, Role, SeaState, Stamp, VehicleId, VehicleState, VerdictState,
};
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::core::Assessor;
use nalgebra::{UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use support::{Camera, Sea, start};

const HEIGHT_M: f64 = 5.0;
/// Error of a reading, metres.
const SIGMA_M: f64 = 0.005;

/// The rig's vehicle at `stamp`, tilted and swaying up and down, whose beam meets water `elevation_m` above the mean at its reading's instant.
fn state(vehicle: &str, stamp: Stamp, elevation_m: Option<f64>) -> VehicleState {
    let t_s = stamp.seconds_since(start());
    let (roll, pitch) = (0.1 * (0.9 * t_s).sin(), 0.08 * (1.3 * t_s).cos());
    let height_m = |t_s: f64| HEIGHT_M + 0.3 * (0.7 * t_s).sin();
    let climb_mps = 0.21 * (0.7 * t_s).cos();
    // Read a twentieth of a second before the state was put together.
    let age_s = 0.05;
    VehicleState {
        stamp,
        vehicle: VehicleId::new(vehicle).unwrap(),
        role: Role::Leader,
        position: Geodetic::from_deg(53.0, -2.9, 5.0),
        position_ned_m: Vector3::new(0.0, 0.0, -height_m(t_s)),
        velocity_ned_mps: Vector3::new(0.0, 0.0, -climb_mps),
        ned_from_body: UnitQuaternion::from_euler_angles(roll, pitch, 0.7),
        heading_rad: 0.7,
        home: None,
        mode: FlightMode::Loiter,
        armed: true,
        landed: LandedState::InAir,
        battery_fraction: None,
        battery_v: None,
        fix: None,
        estimator_ok: true,
        ready_to_arm: true,
        boot_s: 0.0,
        activity: Activity::Idle,
        plan_generation: 0,
        touchdown: None,
        acceleration_ned_mps2: None,
        intent: None,
        range: elevation_m.map(|elevation_m| Range {
            stamp: stamp.plus_secs_f64(-age_s),
            distance_m: (height_m(t_s - age_s) - elevation_m) / (roll.cos() * pitch.cos()),
        }),
        ages: Ages::default(),
        link: None,
        firmware: None,
        has_payload: false,
    }
}

/// The last sea state of a minute over `sea`, with a vehicle whose rangefinder reads `reading` of a time, ten times a second.
fn watched(vehicle: &str, sea: &Sea, reading: impl Fn(f64) -> Option<f64>) -> SeaState {
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let mut assessor = Assessor::new(Config { range_sigma_m: SIGMA_M, ..Config::default() }).unwrap();
    for patch in Camera::default().film(sea, 301) {
        let now = patch.stamp.plus_secs_f64(0.1);
        for at in [patch.stamp, now] {
            let read_s = at.seconds_since(start()) - 0.05;
            let error_m = SIGMA_M * random.sample::<f64, _>(rand_distr::StandardNormal);
            assessor.hear(&state(vehicle, at, reading(read_s).map(|z| z + error_m)), now);
        }
        assessor.observe(&patch, now).unwrap();
    }
    assessor.conclude(start().plus_secs_f64(60.1)).unwrap()
}

fn said(found: &SeaState) -> Option<bool> {
    found.verdict.reasons.iter().find(|reason| reason.check == "witness").map(|reason| reason.passed)
}

/// Where the middle of the patch is.
fn at_middle(sea: &Sea, t_s: f64) -> f64 {
    sea.elevation_m(40.0 + 6.5 * 0.25, -7.0 + 8.5 * 0.25, t_s)
}

#[test]
fn a_rangefinder_that_sees_the_same_waves_agrees() {
    let sea = Sea::jonswap(0.06, 1.5, 2);
    let found = watched("leader-1", &sea, |t_s| Some(at_middle(&sea, t_s)));
    assert_eq!((said(&found), found.verdict.state), (Some(true), VerdictState::Safe), "{:#?}", found.verdict.reasons);
}

/// Higher ones, and none at all.
#[test]
fn one_that_sees_other_waves_makes_nothing_known() {
    let sea = Sea::jonswap(0.06, 1.5, 2);
    for factor in [2.0, 0.0] {
        let found = watched("leader-1", &sea, |t_s| Some(factor * at_middle(&sea, t_s)));
        assert_eq!((said(&found), found.verdict.state), (Some(false), VerdictState::Inconclusive), "{factor}");
        assert_eq!(found.verdict.probability, None);
    }
}

/// None, another vehicle's, and ones that read what cannot be.
#[test]
fn what_says_nothing_changes_nothing() {
    let sea = Sea::jonswap(0.06, 1.5, 2);
    let absent = watched("leader-1", &sea, |_| None);
    assert_eq!((said(&absent), absent.verdict.state), (None, VerdictState::Safe));
    let silent = [
        watched("follower-1", &sea, |t_s| Some(2.0 * at_middle(&sea, t_s))),
        watched("leader-1", &sea, |_| Some(f64::NAN)),
        watched("leader-1", &sea, |_| Some(100.0)),
    ];
    for found in silent {
        assert_eq!((said(&found), found.verdict.state), (None, VerdictState::Safe), "{:#?}", found.verdict.reasons);
    }
}

/// States that come late take their place, and the same reading twice counts once: what is said is the same to the last digit.
#[test]
fn order_does_not_matter() {
    let sea = Sea::jonswap(0.06, 1.5, 4);
    let film = Camera::default().film(&sea, 301);
    let states: Vec<VehicleState> = (0..600)
        .map(|i| f64::from(i) * 0.1)
        .map(|t_s| state("leader-1", start().plus_secs_f64(t_s), Some(at_middle(&sea, t_s - 0.05))))
        .collect();
    let now = start().plus_secs_f64(60.0);
    let heard = |order: &[usize]| {
        let mut assessor =
            Assessor::new(Config { patch_age_s_max: 100.0, range_sigma_m: SIGMA_M, ..Config::default() }).unwrap();
        order.iter().for_each(|i| assessor.hear(&states[*i], now));
        film.iter().for_each(|patch| drop(assessor.observe(patch, now).unwrap()));
        assessor.conclude(now).unwrap().verdict
    };
    let forwards: Vec<usize> = (0..600).collect();
    let stirred: Vec<usize> = (0..1200).map(|i| (i * 7) % 600).collect();
    let expected = heard(&forwards);
    assert!(expected.reasons.iter().any(|reason| reason.check == "witness" && reason.passed));
    assert_eq!(heard(&stirred), expected);
}
