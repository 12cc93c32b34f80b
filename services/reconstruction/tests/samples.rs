//! OpenCV's own sample checkerboards: real pictures, with a published result.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use halcyon_reconstruction::core::calibrate::{BoardSpec, CalibrateError, ViewProblem, calibrate};
use support::sample_pairs;

/// The size of the squares is not published; it scales lengths only.
fn board() -> BoardSpec {
    BoardSpec::new(9, 6, 0.025).unwrap()
}

#[test]
fn the_sample_checkerboards_calibrate_to_the_good_minimum() {
    let calibration = calibrate(&sample_pairs(), board()).unwrap();
    println!(
        "stereo {:.3} px of all corners, {:.3} px with {} of {} left out ({}); rows {:.3} px rms, {:.2} px max; {} of {} starts agree",
        calibration.stereo_rms_all_px,
        calibration.stereo_rms_px,
        calibration.corners_rejected,
        calibration.corners_total,
        calibration.model.name(),
        calibration.row_error.rms_px,
        calibration.row_error.max_px,
        calibration.starts_agreeing,
        calibration.starts
    );
    // 0.44 px is what careful use of OpenCV reaches with its classic corners; 1.75 px is the bad minimum.
    assert!(calibration.stereo_rms_all_px <= 0.44 && calibration.stereo_rms_px <= calibration.stereo_rms_all_px);
    assert!(calibration.views.iter().all(|view| view.problem.is_none()));
    assert_eq!(calibration.corners_total, 13 * 54);
    assert!(calibration.corners_rejected as f64 <= 0.03 * calibration.corners_total as f64);
    assert_eq!(calibration.starts_agreeing, calibration.starts);
    // The residuals are ours, the root mean square OpenCV's: two hands, one number.
    let ours_px = ((calibration.left_rms_px.powi(2) + calibration.right_rms_px.powi(2)) / 2.0).sqrt();
    assert!((ours_px - calibration.stereo_rms_px).abs() < 1e-3 * ours_px, "{ours_px} {}", calibration.stereo_rms_px);
    // OpenCV publishes the left camera of these pictures (opencv-doc, left_intrinsics.yml): f 535.9 px, centre (342.3, 235.6).
    let left = calibration.rig.left;
    assert!((left.fx_px / 535.9 - 1.0).abs() < 0.01 && (left.fy_px / 535.9 - 1.0).abs() < 0.01, "{left:?}");
    assert!((left.cx_px - 342.3).abs() < 5.0 && (left.cy_px - 235.6).abs() < 5.0, "{left:?}");
    assert!(calibration.row_error.rms_px < 0.2 && calibration.row_error.max_px < 1.5, "{:?}", calibration.row_error);
    let centre_m = -(calibration.rig.right_from_left.transpose() * calibration.rig.right_from_left_m);
    assert!(centre_m.x > 0.0 && centre_m.x > 20.0 * centre_m.y.abs(), "the right camera is to the right: {centre_m}");
}

#[test]
fn a_pair_that_is_none_is_left_out_and_named() {
    let mut pairs: Vec<_> = sample_pairs().into_iter().take(7).collect();
    let stranger = pairs[6].1.clone();
    pairs[2].1 = stranger;
    let blank = halcyon_model::Image::new(640, 480, vec![128; 640 * 480].into()).unwrap();
    pairs[4].0 = blank;
    let calibration = calibrate(&pairs, board()).unwrap();
    assert!(
        matches!(calibration.views[2].problem, Some(ViewProblem::Inconsistent | ViewProblem::LargeError)),
        "{:?}",
        calibration.views[2]
    );
    assert_eq!(calibration.views[4].problem, Some(ViewProblem::NotFoundLeft));
    assert_eq!(calibration.views.iter().filter(|view| view.problem.is_none()).count(), 5);
    assert!(calibration.stereo_rms_px < 0.44, "{}", calibration.stereo_rms_px);
}

#[test]
fn too_few_views_are_counted() {
    let mut pairs: Vec<_> = sample_pairs().into_iter().take(3).collect();
    let blank = halcyon_model::Image::new(640, 480, vec![128; 640 * 480].into()).unwrap();
    pairs[1].1 = blank;
    assert!(matches!(calibrate(&pairs, board()), Err(CalibrateError::TooFewViews { views: 3, usable: 2 })));
    assert!(matches!(calibrate(&[], board()), Err(CalibrateError::TooFewViews { views: 0, usable: 0 })));
}
