//! Calibration against a rig that is known exactly: corners are projected, not detected.

use halcyon_model::CameraIntrinsics;
use nalgebra::{Matrix3, Rotation3, Vector3};
use opencv::core::Point2f;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::core::camera;

const SIZE: (u32, u32) = (640, 480);

struct Rig {
    left: CameraIntrinsics,
    right: CameraIntrinsics,
    rotation: Matrix3<f64>,
    translation_m: Vector3<f64>,
}

fn rig() -> Rig {
    Rig {
        left: CameraIntrinsics {
            fx_px: 530.0,
            fy_px: 532.0,
            cx_px: 325.0,
            cy_px: 236.0,
            distortion: [-0.27, 0.08, 0.0, 0.0, 0.0],
        },
        right: CameraIntrinsics {
            fx_px: 541.0,
            fy_px: 540.0,
            cx_px: 312.0,
            cy_px: 244.0,
            distortion: [-0.25, 0.06, 0.0, 0.0, 0.0],
        },
        rotation: Rotation3::from_euler_angles(0.01, 0.03, -0.005).into_inner(),
        translation_m: Vector3::new(-0.092, 0.001, 0.002),
    }
}

/// Boards in many directions, seen by both cameras with `noise_px` of uniform error.
fn sightings(rig: &Rig, board: &BoardSpec, views: usize, noise_px: f64) -> Vec<Sighting> {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    (0..views)
        .map(|view| {
            let mut within = |half: f64| random.random_range(-half..=half);
            let turn = Rotation3::from_euler_angles(within(0.5), within(0.5), within(0.3));
            let centre = board.corner_m(board.corners() - 1) / 2.0;
            let middle_m = Vector3::new(within(0.05) + 0.04, within(0.04), 0.55 + within(0.15));
            let mut see = |camera: &CameraIntrinsics, rotation: &Matrix3<f64>, translation_m: &Vector3<f64>| {
                (0..board.corners())
                    .map(|i| {
                        let in_left = turn * (board.corner_m(i) - centre) + middle_m;
                        let pixel = camera::project(camera, &(rotation * in_left + translation_m));
                        Point2f::new((pixel.x + within(noise_px)) as f32, (pixel.y + within(noise_px)) as f32)
                    })
                    .collect::<Vec<_>>()
            };
            let left = see(&rig.left, &Matrix3::identity(), &Vector3::zeros());
            let right = see(&rig.right, &rig.rotation, &rig.translation_m);
            Sighting::new(view, left, right)
        })
        .collect()
}

fn board() -> BoardSpec {
    BoardSpec::new(9, 6, 0.03).unwrap()
}

#[test]
fn a_known_rig_is_found_again() {
    let (truth, board) = (rig(), board());
    let (fit, _) = solve(&sightings(&truth, &board, 14, 0.1), &board, SIZE).unwrap();
    assert_eq!(fit.model, DistortionModel::Radial2, "no tangential distortion was put in, none may be found");
    for (found, truth) in [(fit.left, truth.left), (fit.right, truth.right)] {
        assert!((found.fx_px - truth.fx_px).abs() < 1.0 && (found.fy_px - truth.fy_px).abs() < 1.0, "{found:?}");
        assert!((found.cx_px - truth.cx_px).abs() < 1.5 && (found.cy_px - truth.cy_px).abs() < 1.5, "{found:?}");
        assert!((found.distortion[0] - truth.distortion[0]).abs() < 0.01, "{found:?}");
    }
    assert!((fit.right_from_left_m - truth.translation_m).norm() < 3e-4, "{}", fit.right_from_left_m);
    // Uniform noise of ±0.1 px in x and y has a root mean square length of 0.1 √(2/3).
    assert!((fit.rms_px - 0.1 * (2.0_f64 / 3.0).sqrt()).abs() < 0.005, "{}", fit.rms_px);
}

#[test]
fn corners_numbered_from_the_other_end_are_renumbered() {
    for (cols, rows) in [(9, 6), (7, 7)] {
        let (truth, board) = (rig(), BoardSpec::new(cols, rows, 0.03).unwrap());
        let mut seen = sightings(&truth, &board, 8, 0.1);
        let straight: Vec<_> = seen.iter().map(|sighting| sighting.right.clone()).collect();
        let turns = board.turns();
        for (i, sighting) in seen.iter_mut().enumerate().filter(|(i, _)| i % 3 == 1) {
            sighting.right = turns[1 + i % (turns.len() - 1)].iter().map(|&corner| sighting.right[corner]).collect();
        }
        agreement::settle(&mut seen, &board, &truth.left, &truth.right).unwrap();
        for (sighting, straight) in seen.iter().zip(&straight) {
            assert_eq!(sighting.problem, None);
            assert_eq!(&sighting.right, straight, "{cols}x{rows}");
        }
    }
}

#[test]
fn outliers_go_and_good_corners_stay() {
    let (truth, board) = (rig(), board());
    let mut seen = sightings(&truth, &board, 10, 0.1);
    seen[3].left[17].x += 4.0;
    seen[7].right[40].y -= 3.0;
    for corner in &mut seen[5].right {
        corner.x += 6.0;
    }
    let first = solve(&seen, &board, SIZE).unwrap().0;
    let (fit, _) = reject_outliers(&mut seen, &board, SIZE, first).unwrap();
    assert_eq!(seen[5].problem, Some(ViewProblem::LargeError));
    assert_eq!(seen.iter().filter(|sighting| !sighting.is_used()).count(), 1);
    let gone: Vec<_> = seen
        .iter()
        .filter(|sighting| sighting.is_used())
        .flat_map(|sighting| sighting.keep.iter().enumerate().filter(|(_, keep)| !**keep).map(|(i, _)| (sighting.view, i)))
        .collect();
    assert_eq!(gone, [(3, 17), (7, 40)]);
    assert!(fit.rms_px < 0.1, "{}", fit.rms_px);
}

/// A board held square to the camera at one distance fixes no focal length: an error, not a number.
#[test]
fn views_that_fix_nothing_are_refused() {
    let (truth, board) = (rig(), board());
    let one = sightings(&truth, &board, 1, 0.0).remove(0);
    let flat: Vec<Point2f> =
        (0..board.corners()).map(|i| Point2f::new((100 + 40 * (i % 9)) as f32, (80 + 40 * (i / 9)) as f32)).collect();
    let seen: Vec<_> = (0..5).map(|view| Sighting { view, left: flat.clone(), right: flat.clone(), ..one.clone() }).collect();
    assert!(matches!(solve(&seen, &board, SIZE), Err(CalibrateError::Degenerate { views: 5 })));
}
