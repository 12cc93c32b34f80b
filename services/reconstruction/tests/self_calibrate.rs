//! Self-calibration against truth: rendered water, and the sample checkerboards against their board calibration.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use halcyon_model::{RigCalibration, StereoPair};
use halcyon_reconstruction::core::calibrate::{BoardSpec, calibrate};
use halcyon_reconstruction::core::epipolar::{
    PointPair, RansacSettings, find_fundamental, pixels_without_distortion, rectify_from_matches,
};
use halcyon_reconstruction::core::features::{MatchRule, Method, match_pictures};
use halcyon_reconstruction::core::rectify::Rectifier;
use halcyon_reconstruction::core::self_calibrate::{
    DriftSettings, DriftWatch, Scale, SelfCalibration, Settings, row_matches, self_calibrate,
};
use nalgebra::{Rotation3, Vector3};
use support::sample_pairs;
use support::scene::{default_rig, pose, render};

/// `rig` with the right camera turned about its own axes, degrees, and its baseline's direction moved.
fn bent(rig: &RigCalibration, turn_deg: [f64; 3], direction_deg: [f64; 2]) -> RigCalibration {
    let turn = Rotation3::new(Vector3::from(turn_deg.map(f64::to_radians)));
    let [down, forward] = direction_deg.map(f64::to_radians);
    let t = rig.right_from_left_m;
    let moved = (t.normalize() + Vector3::new(0.0, down, forward)).normalize() * t.norm();
    RigCalibration { right_from_left: turn.matrix() * rig.right_from_left, right_from_left_m: moved, ..*rig }
}

/// The default rig with a lens that bends lines, pixels 1.5 times as fine.
fn rig() -> RigCalibration {
    let mut rig = default_rig();
    (rig.width_px, rig.height_px) = (480, 360);
    for camera in [&mut rig.left, &mut rig.right] {
        (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px) = (514.0, 515.0, 240.3, 178.9);
        camera.distortion = [-0.12, 0.05, 4e-4, -3e-4, 0.0];
    }
    rig
}

/// Waves of 12 cm and 0.9 m, and 7 cm and 0.5 m.
fn waves(north: f64, east: f64) -> f64 {
    0.06 * (7.0 * north + 1.0).sin() + 0.035 * (12.5 * east + 2.0 * north).sin()
}

/// Pairs from here and there, as a drone takes them.
fn flight(rig: &RigCalibration, pairs: u64) -> Vec<StereoPair> {
    (0..pairs)
        .map(|i| {
            let k = i as f64;
            let attitude_deg = [9.0 * (1.7 * k).sin(), 9.0 * (2.3 * k + 1.0).cos(), 40.0 * k];
            let height_m = 3.0 + 1.2 * (k * 0.9).sin();
            render(rig, &pose(3.0 * k, -2.0 * k, height_m, attitude_deg), &waves, 1.5, i)
        })
        .collect()
}

fn matches(pairs: &[StereoPair], method: Method) -> Vec<Vec<PointPair>> {
    let one = |pair: &StereoPair| match_pictures(&pair.left, &pair.right, method, 2000, &MatchRule::default()).unwrap();
    pairs.iter().map(one).collect()
}

fn off_deg(found: &SelfCalibration, truth: &RigCalibration) -> Vector3<f64> {
    let turn = Rotation3::from_matrix_unchecked(found.rig.right_from_left * truth.right_from_left.transpose());
    turn.scaled_axis().map(f64::to_degrees)
}

#[test]
fn a_bent_rig_is_measured_over_water() {
    let given = rig();
    let truth = bent(&given, [0.4, -0.7, 0.5], [0.6, -0.4]);
    let pairs = flight(&truth, 4);
    for (method, margin_deg) in [(Method::Sift, 0.02), (Method::Surf, 0.02), (Method::Orb, 0.1), (Method::Akaze, 0.02)] {
        let found = self_calibrate(&given, &matches(&pairs, method), &Settings::default()).unwrap();
        let (off, sigma) = (off_deg(&found, &truth), found.turn_sigma_rad.map(f64::to_degrees));
        println!(
            "{}: {} of {} matches, {:.3} px; off {:.4?}° sigma {:.4?}°; rows {:.3} -> {:.3} px",
            method.name(),
            found.inliers,
            found.matches,
            found.sigma_px,
            off.as_slice(),
            sigma.as_slice(),
            found.before.rms_px,
            found.after.rms_px
        );
        let direction = found.rig.right_from_left_m.angle(&truth.right_from_left_m).to_degrees();
        let direction_sigma = found.direction_sigma_rad.norm().to_degrees();
        println!("  direction off {direction:.4}° sigma {direction_sigma:.4}°");
        // ORB's corners are whole pixels of their level, several of them of one corner: their errors repeat, and sigma is too small.
        let sigmas = if method == Method::Orb { 6.0 } else { 3.0 };
        for i in 0..3 {
            assert!(off[i].abs() < sigmas * sigma[i], "{method:?} {i}: {off} {sigma}");
            assert!(off[i].abs() < margin_deg, "{method:?} {i}: {off}");
        }
        assert!(direction < sigmas * direction_sigma);
        assert!(found.has_drifted && found.after.rms_px < 1.0 && found.before.rms_px > 2.0);
    }
}

#[test]
fn a_true_calibration_holds_and_altitude_scales_it() {
    let truth = rig();
    // Straight down: the water is as far along the axis as the drone is high.
    let pairs: Vec<StereoPair> =
        (0..2_u64).map(|i| render(&truth, &pose(4.0 * i as f64, 0.0, 4.0, [0.0, 0.0, 30.0]), &waves, 1.5, i)).collect();
    let settings = Settings { scale: Scale::Altitude(4.0), ..Settings::default() };
    let found = self_calibrate(&truth, &matches(&pairs, Method::Sift), &settings).unwrap();
    println!("{found:?}");
    assert!(!found.has_drifted && found.drift_px < 0.1);
    // Water under the axis stands off the mean by a few millimetres: 4 cm waves over 2 m of footprint, in the mean of four.
    assert!((found.baseline_m / 0.4 - 1.0).abs() < 0.01, "{}", found.baseline_m);
}

#[test]
fn drift_is_seen_in_rectified_pairs() {
    let given = default_rig();
    let alarm = |truth: &RigCalibration| {
        let (mut watch, mut rectifier) = (DriftWatch::new(DriftSettings::default()), Rectifier::new(&given).unwrap());
        let mut last = None;
        for pair in flight(truth, 2) {
            rectifier.rectify(&pair.left, &pair.right).unwrap();
            let matches = row_matches(&rectifier).unwrap();
            last = watch.observe(&matches, rectifier.rig());
        }
        last.unwrap()
    };
    let still = alarm(&given);
    println!("{still:?}");
    assert!(!still.has_drifted && still.row_rms_px < 0.2, "{still:?}");
    // 0.15° of pitch is f · 0.0026 = 0.9 px of row.
    let drift = alarm(&bent(&given, [0.15, 0.0, 0.0], [0.0, 0.0]));
    println!("{drift:?}");
    assert!(drift.has_drifted && (drift.row_rms_px - 0.9).abs() < 0.15, "{drift:?}");
    // Too little to matter.
    assert!(!alarm(&bent(&given, [0.04, 0.0, 0.0], [0.0, 0.0])).has_drifted);
}

/// A board calibration of the sample pictures, and their pose again from features of the same pictures, board unknown.
#[test]
fn the_samples_without_their_board_agree_with_their_board() {
    // Every other pair: enough of both, in half the time.
    let pairs: Vec<_> = sample_pairs().into_iter().step_by(2).collect();
    let board = calibrate(&pairs, BoardSpec::new(9, 6, 0.025).unwrap()).unwrap().rig;
    let matches: Vec<Vec<PointPair>> = pairs
        .iter()
        .map(|(left, right)| match_pictures(left, right, Method::Sift, 2000, &MatchRule::default()).unwrap())
        .collect();
    let given = bent(&board, [0.8, -0.5, 0.6], [0.5, 0.5]);
    let found = self_calibrate(&given, &matches, &Settings::default()).unwrap();
    let off = off_deg(&found, &board);
    let direction = found.rig.right_from_left_m.angle(&board.right_from_left_m).to_degrees();
    println!(
        "{} of {} matches, {:.3} px, rows {:.3} -> {:.3} px, off {:.3?}° ± {:.3?}°, direction {direction:.3}°",
        found.inliers,
        found.matches,
        found.sigma_px,
        found.before.rms_px,
        found.after.rms_px,
        off.as_slice(),
        found.turn_sigma_rad.map(f64::to_degrees).as_slice()
    );
    assert!(found.has_drifted && found.after.rms_px < 0.6);
    // The lenses come from the board; what they leave is in both.
    assert!(off.amax() < 0.3 && direction < 1.5, "{off} {direction}");
    // Hartley's rectification of the undistorted matches, all pictures together.
    let ideal = pixels_without_distortion(&matches.concat(), &board.left, &board.right).unwrap();
    let consensus = find_fundamental(&ideal, &RansacSettings::default()).unwrap();
    let inliers: Vec<PointPair> = ideal.iter().zip(&consensus.is_inlier).filter(|(_, i)| **i).map(|(p, _)| *p).collect();
    let homographies = rectify_from_matches(&consensus.fundamental, &inliers, (640, 480)).unwrap();
    let rows: Vec<f64> = inliers.iter().map(|p| homographies.apply(p)).map(|p| p.left.y - p.right.y).collect();
    let rms = (rows.iter().map(|r| r * r).sum::<f64>() / rows.len() as f64).sqrt();
    println!("Hartley: {} matches, rows {rms:.3} px RMS", rows.len());
    assert!(rms < 0.7, "{rms}");
}
