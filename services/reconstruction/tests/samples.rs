//! OpenCV's own sample checkerboards: real pictures, with a published result.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use halcyon_reconstruction::core::calibrate::{BoardSpec, CalibrateError, Options, ViewProblem, calibrate, calibrate_with};
use support::sample_pairs;

/// The size of the squares is not published; it scales lengths only.
fn board() -> BoardSpec {
    BoardSpec::new(9, 6, 0.025).unwrap()
}

/// The numbers.
#[test]
fn the_sample_checkerboards_calibrate_to_a_fifth_of_a_pixel() {
    let calibration = calibrate(&sample_pairs(), board()).unwrap();
    println!(
        "stereo {:.4} px of all corners and a flat board, {:.4} px with {} of {} left out and warp {:?} m ({}); rows {:.3} px rms, {:.2} px max; {} of {} starts agree",
        calibration.stereo_rms_all_px,
        calibration.stereo_rms_px,
        calibration.corners_rejected,
        calibration.corners_total,
        calibration.board_warp_m,
        calibration.model.name(),
        calibration.row_error.rms_px,
        calibration.row_error.max_px,
        calibration.starts_agreeing,
        calibration.starts
    );
    // Careful use of OpenCV ends at 0.44 px, its own sample's flags at 1.75 px; mrcal 2.2 at 0.186 px with 2.6 % left out.
    assert!(calibration.stereo_rms_all_px <= 0.445 && calibration.stereo_rms_px <= 0.2);
    assert!(calibration.views.iter().all(|view| view.problem.is_none()));
    assert_eq!(calibration.corners_total, 13 * 2 * 54);
    assert!(calibration.corners_rejected as f64 <= 0.03 * calibration.corners_total as f64);
    assert_eq!(calibration.starts_agreeing, calibration.starts);
    assert!(calibration.board_warp_m.unwrap().norm() < 5e-4, "a printed board on a plate: {:?}", calibration.board_warp_m);
    // OpenCV publishes the left camera of these pictures (opencv-doc, left_intrinsics.yml): f 535.9 px, centre (342.3, 235.6).
    let left = calibration.rig.left;
    assert!((left.fx_px / 535.9 - 1.0).abs() < 0.01 && (left.fy_px / 535.9 - 1.0).abs() < 0.01, "{left:?}");
    assert!((left.cx_px - 342.3).abs() < 5.0 && (left.cy_px - 235.6).abs() < 5.0, "{left:?}");
    assert!(calibration.row_error.rms_px < 0.2 && calibration.row_error.max_px <= 1.0, "{:?}", calibration.row_error);
    let centre_m = -(calibration.rig.right_from_left.transpose() * calibration.rig.right_from_left_m);
    assert!(centre_m.x > 0.0 && centre_m.x > 20.0 * centre_m.y.abs(), "the right camera is to the right: {centre_m}");
    // With many views the calibration holds for pictures that it has not seen; with three it does not yet.
    let errors = &calibration.error_by_views;
    assert_eq!((errors[0].views, errors[errors.len() - 1].views), (3, 13));
    assert!(errors[0].held_out_error_px > errors[0].mean_error_px && errors[8].held_out_error_px < errors[0].held_out_error_px);
}

/// The same answer from anywhere: a hundred starts, focal lengths off by up to 70 %, principal points by a tenth of the picture.
#[test]
fn a_hundred_starts_agree() {
    let options = Options { starts: 100, ..Options::default() };
    let calibration = calibrate_with(&sample_pairs(), board(), &options, &mut |_, _| {}).unwrap();
    println!("{} of {} starts agree", calibration.starts_agreeing, calibration.starts);
    assert_eq!(calibration.starts, 100);
    assert_eq!(calibration.starts_agreeing, 100);
}

#[test]
fn a_pair_that_is_none_is_left_out_and_named() {
    let mut pairs: Vec<_> = sample_pairs().into_iter().take(7).collect();
    // The last right picture stands where the third should.
    pairs[2].1 = sample_pairs()[8].1.clone();
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
    assert!(calibration.stereo_rms_px < 0.25, "{}", calibration.stereo_rms_px);
}

#[test]
fn too_few_views_are_counted() {
    let mut pairs: Vec<_> = sample_pairs().into_iter().take(3).collect();
    let blank = halcyon_model::Image::new(640, 480, vec![128; 640 * 480].into()).unwrap();
    pairs[1].1 = blank;
    assert!(matches!(calibrate(&pairs, board()), Err(CalibrateError::TooFewViews { views: 3, usable: 2 })));
    assert!(matches!(calibrate(&[], board()), Err(CalibrateError::TooFewViews { views: 0, usable: 0 })));
}

#[test]
fn slips_are_named() {
    let pairs: Vec<_> = sample_pairs().into_iter().take(4).collect();
    let mut twice = pairs.clone();
    twice[3].0 = twice[1].0.clone();
    let refused = calibrate(&twice, board());
    assert!(
        matches!(refused, Err(CalibrateError::SamePicture { first: 1, first_side: "left", second: 3, second_side: "left" })),
        "{refused:?}"
    );
    let swapped: Vec<_> = pairs.iter().map(|(left, right)| (right.clone(), left.clone())).collect();
    let refused = calibrate(&swapped, board());
    assert!(matches!(refused, Err(CalibrateError::Swapped { .. })), "{refused:?}");
}
