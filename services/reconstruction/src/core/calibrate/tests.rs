//! Calibration against a rig that is known exactly: corners are projected, not detected.

use halcyon_model::CameraIntrinsics;
use nalgebra::Matrix3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::core::camera;

const SIZE: (u32, u32) = (640, 480);
const FLAT: Vector2<f64> = Vector2::new(0.0, 0.0);

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

/// Errors of corners: seeded, of a stated standard deviation in each coordinate.
struct Noise {
    random: ChaCha8Rng,
    sigma_px: f64,
}

impl Noise {
    fn new(seed: u64, sigma_px: f64) -> Self {
        Self { random: ChaCha8Rng::seed_from_u64(seed), sigma_px }
    }

    fn within(&mut self, half: f64) -> f64 {
        self.random.random_range(-half..=half)
    }

    /// Box and Muller's way to a normal error.
    fn normal(&mut self) -> f64 {
        let (a, b): (f64, f64) = (1.0 - self.random.random::<f64>(), self.random.random());
        self.sigma_px * (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
    }
}

/// Boards in many directions, as both cameras see them.
fn views_of(rig: &Rig, board: &BoardSpec, warp_m: Vector2<f64>, views: usize, noise: &mut Noise) -> Vec<CornerPair> {
    let centre = board.corner_m(board.corners() - 1, &FLAT) / 2.0;
    let mut view = || {
        let turn = Rotation3::from_euler_angles(noise.within(0.5), noise.within(0.5), noise.within(0.3));
        let middle_m = Vector3::new(noise.within(0.05) + 0.04, noise.within(0.04), 0.55 + noise.within(0.15));
        let mut see = |camera: &CameraIntrinsics, rotation: &Matrix3<f64>, translation_m: &Vector3<f64>| {
            let corner = |i: usize| {
                let in_left = turn * (board.corner_m(i, &warp_m) - centre) + middle_m;
                camera::project(camera, &(rotation * in_left + translation_m)) + Vector2::new(noise.normal(), noise.normal())
            };
            (0..board.corners()).map(corner).collect::<Vec<_>>()
        };
        let left = see(&rig.left, &Matrix3::identity(), &Vector3::zeros());
        let right = see(&rig.right, &rig.rotation, &rig.translation_m);
        CornerPair { left, right }
    };
    (0..views).map(|_| view()).collect()
}

fn sightings(rig: &Rig, board: &BoardSpec, views: usize, sigma_px: f64) -> Vec<Sighting> {
    let points = |pixels: &[Vector2<f64>]| pixels.iter().map(|p| Point2f::new(p.x as f32, p.y as f32)).collect();
    let pairs = views_of(rig, board, FLAT, views, &mut Noise::new(4, sigma_px));
    pairs.iter().enumerate().map(|(view, pair)| Sighting::new(view, points(&pair.left), points(&pair.right))).collect()
}

fn board() -> BoardSpec {
    BoardSpec::new(9, 6, 0.03).unwrap()
}

#[test]
fn a_known_rig_is_found_again() {
    let (truth, board) = (rig(), board());
    let found =
        calibrate_corners(&views_of(&truth, &board, FLAT, 14, &mut Noise::new(4, 0.1)), board, SIZE, &Options::default());
    let found = found.unwrap();
    assert_eq!(found.model, DistortionModel::Radial2, "no tangential distortion was put in, none may be found");
    assert_eq!(found.board_warp_m, None, "nor a warp");
    for (found, truth) in [(found.rig.left, truth.left), (found.rig.right, truth.right)] {
        assert!((found.fx_px - truth.fx_px).abs() < 1.0 && (found.fy_px - truth.fy_px).abs() < 1.0, "{found:?}");
        assert!((found.cx_px - truth.cx_px).abs() < 1.5 && (found.cy_px - truth.cy_px).abs() < 1.5, "{found:?}");
        assert!((found.distortion[0] - truth.distortion[0]).abs() < 0.02, "{found:?}");
    }
    assert!((found.rig.right_from_left_m - truth.translation_m).norm() < 3e-4, "{}", found.rig.right_from_left_m);
    // Noise of 0.1 px in x and y has a root mean square length of 0.1 √2, but for the share that the unknowns take up.
    assert!((found.stereo_rms_px - 0.1 * 2.0_f64.sqrt()).abs() < 0.005, "{}", found.stereo_rms_px);
    assert_eq!((found.starts_agreeing, found.corners_rejected), (found.starts, 0));
}

#[test]
fn exact_corners_give_the_rig_to_the_last_digits_of_their_type() {
    let (truth, board) = (rig(), board());
    let found =
        calibrate_corners(&views_of(&truth, &board, FLAT, 8, &mut Noise::new(4, 0.0)), board, SIZE, &Options::default());
    let found = found.unwrap();
    // Corners are f32: 3e-5 px apart at 500.
    assert!((found.rig.left.fx_px - truth.left.fx_px).abs() < 1e-3, "{:?}", found.rig.left);
    assert!((found.rig.right_from_left_m - truth.translation_m).norm() < 1e-7, "{}", found.rig.right_from_left_m);
}

#[test]
fn a_warped_board_is_seen_to_be_warped() {
    let (truth, board) = (rig(), board());
    let warp_m = Vector2::new(8e-4, -5e-4);
    let views = views_of(&truth, &board, warp_m, 14, &mut Noise::new(5, 0.1));
    let found = calibrate_corners(&views, board, SIZE, &Options::default()).unwrap();
    let (estimate, sigma) = (found.board_warp_m.unwrap(), found.sigmas.warp_m);
    for k in 0..2 {
        assert!((estimate[k] - warp_m[k]).abs() < 4.0 * sigma[k] && sigma[k] < 1e-4, "{estimate} {sigma}");
    }
    let flat = calibrate_corners(&views, board, SIZE, &Options { flat_board: true, ..Options::default() }).unwrap();
    assert!(flat.board_warp_m.is_none() && flat.stereo_rms_px > 1.2 * found.stereo_rms_px, "{}", flat.stereo_rms_px);
}

/// Another hand: OpenCV's own joint calibration of the same corners, flat board and all, ends at the same rig and the same error.
#[test]
fn opencv_agrees() {
    use crate::core::cv;
    use opencv::calib3d;
    use opencv::core::{Mat, Size, TermCriteria, Vector};

    let (truth, board) = (rig(), board());
    let seen = sightings(&truth, &board, 10, 0.2);
    let from = start::guess(&seen, &board, &(truth.left, truth.right)).unwrap().unwrap();
    let ours = RigFit::new(&Scene::new(&seen, &board), &from, DistortionModel::Radial2, false, SIZE).unwrap();
    let points =
        |side: Side| -> Vector<Vector<Point2f>> { seen.iter().map(|seen| Vector::from_slice(seen.corners(side))).collect() };
    let flat: Vec<_> = (0..board.corners()).map(|i| board.corner_point3f(i)).collect();
    let object: Vector<Vector<opencv::core::Point3f>> = seen.iter().map(|_| Vector::from_slice(&flat)).collect();
    let mats =
        |camera: &CameraIntrinsics| (cv::mat_from_matrix3(&camera.matrix()).unwrap(), cv::mat_from_distortion(camera).unwrap());
    let ((mut m1, mut d1), (mut m2, mut d2)) = (mats(&truth.left), mats(&truth.right));
    let (mut r, mut t) = (Mat::default(), Mat::default());
    let (mut e, mut f) = (Mat::default(), Mat::default());
    let theirs_px = calib3d::stereo_calibrate(
        &object,
        &points(Side::Left),
        &points(Side::Right),
        &mut m1,
        &mut d1,
        &mut m2,
        &mut d2,
        Size::new(640, 480),
        &mut r,
        &mut t,
        &mut e,
        &mut f,
        calib3d::CALIB_USE_INTRINSIC_GUESS | calib3d::CALIB_FIX_K3 | calib3d::CALIB_ZERO_TANGENT_DIST,
        TermCriteria::new(3, 200, 1e-9).unwrap(),
    )
    .unwrap();
    assert!((ours.rms_px / theirs_px - 1.0).abs() < 1e-5, "{} {theirs_px}", ours.rms_px);
    let (left, right) = (cv::intrinsics_from_mats(&m1, &d1).unwrap(), cv::intrinsics_from_mats(&m2, &d2).unwrap());
    for (ours, theirs) in [(&ours.solved.guess.left, left), (&ours.solved.guess.right, right)] {
        assert!((ours.matrix() - theirs.matrix()).abs().max() < 0.02, "{ours:?} {theirs:?}");
        assert!(ours.distortion.iter().zip(theirs.distortion).all(|(a, b)| (a - b).abs() < 1e-3), "{ours:?} {theirs:?}");
    }
    let t = cv::vector3_from_mat(&t).unwrap();
    assert!((ours.solved.guess.right_from_left_m - t).norm() < 2e-6, "{} {t}", ours.solved.guess.right_from_left_m);
}

/// The gradient in blocks against central differences of the cost, for every shared unknown and a pose.
#[test]
fn the_normal_equations_have_the_slopes_of_the_cost() {
    let (truth, board) = (rig(), board());
    let seen = sightings(&truth, &board, 3, 0.5);
    let scene = Scene::new(&seen, &board);
    let mut guess = start::guess(&seen, &board, &(truth.left, truth.right)).unwrap().unwrap();
    guess.warp_m = Vector2::new(1e-3, 2e-3);
    guess.left.distortion = [-0.2, 0.1, 1e-3, 2e-3, 0.01];
    bundle::check_slopes(&scene, &guess);
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
    let mut views = views_of(&truth, &board, FLAT, 10, &mut Noise::new(4, 0.05));
    views[3].left[17].x += 4.0;
    views[7].right[40].y -= 3.0;
    for corner in &mut views[5].right {
        corner.x += 6.0;
    }
    let found = calibrate_corners(&views, board, SIZE, &Options::default()).unwrap();
    for (view, quality) in found.views.iter().enumerate() {
        assert_eq!(quality.problem, (view == 5).then_some(ViewProblem::LargeError), "view {view}");
        let expected = match view {
            3 => [1, 0],
            7 => [0, 1],
            _ => [0, 0],
        };
        assert_eq!(quality.corners_rejected, expected, "view {view}");
    }
    assert_eq!((found.corners_total, found.corners_rejected), (10 * 2 * 54, 2 + 2 * 54));
    assert!(found.stereo_rms_px < 0.08 && found.stereo_rms_all_px > 0.3, "{}", found.stereo_rms_px);
    // What was left out is reported where it was seen: 4 px beside its place.
    assert!((found.views[3].left_residuals_px[17].x - 4.0).abs() < 0.3, "{}", found.views[3].left_residuals_px[17]);
}

/// A board held square to the camera at one distance fixes no focal length: an error, not a number.
#[test]
fn views_that_fix_nothing_are_refused() {
    let flat: Vec<_> = (0..54).map(|i| Vector2::new(f64::from(100 + 40 * (i % 9)), f64::from(80 + 40 * (i / 9)))).collect();
    let views = vec![CornerPair { left: flat.clone(), right: flat }; 5];
    let refused = calibrate_corners(&views, board(), SIZE, &Options::default());
    assert!(matches!(refused, Err(CalibrateError::Degenerate { views: 5 })), "{refused:?}");
}

#[test]
fn corners_that_are_none_are_refused() {
    let views = views_of(&rig(), &board(), FLAT, 5, &mut Noise::new(4, 0.1));
    let mut bad = views.clone();
    bad[2].left.pop();
    let refused = calibrate_corners(&bad, board(), SIZE, &Options::default());
    assert!(matches!(refused, Err(CalibrateError::Corners { view: 2, left: 53, .. })), "{refused:?}");
    let mut bad = views.clone();
    bad[4].right[3].y = f64::NAN;
    assert!(matches!(
        calibrate_corners(&bad, board(), SIZE, &Options::default()),
        Err(CalibrateError::Corners { view: 4, .. })
    ));
    let swapped: Vec<_> = views.iter().map(|pair| CornerPair { left: pair.right.clone(), right: pair.left.clone() }).collect();
    let refused = calibrate_corners(&swapped, board(), SIZE, &Options::default());
    assert!(matches!(refused, Err(CalibrateError::Swapped { .. })), "{refused:?}");
    for depth_at_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = calibrate_corners(&views, board(), SIZE, &Options { depth_at_m, ..Options::default() });
        assert!(matches!(refused, Err(CalibrateError::Distance { .. })), "{depth_at_m}");
    }
}

/// The number: 200 simulated calibrations; 95 % intervals hold the truth 95 ± 3 times in a hundred. And what the depth map
/// says is what triangulation with those calibrations scatters by.
#[test]
fn intervals_cover_the_truth_as_often_as_they_say() {
    const TRIALS: usize = 200;
    const DISTANCE_M: f64 = 1.0;
    let (truth, board) = (rig(), board());
    let pixel = Vector2::new(400.0, 300.0);
    let point_m = camera::unproject(&truth.left, pixel).unwrap() * DISTANCE_M;
    let right_pixel = camera::project(&truth.right, &(truth.rotation * point_m + truth.translation_m));
    let free = Free::rig(DistortionModel::Radial2, false);
    let (mut inside, mut total) = (0, 0);
    let (mut depths_m, mut variance_m2) = (Vec::new(), 0.0);
    let mut noise = Noise::new(11, 0.2);
    for _ in 0..TRIALS {
        let mut seen = Vec::new();
        for (view, pair) in views_of(&truth, &board, FLAT, 8, &mut noise).iter().enumerate() {
            let points = |pixels: &[Vector2<f64>]| pixels.iter().map(|p| Point2f::new(p.x as f32, p.y as f32)).collect();
            seen.push(Sighting::new(view, points(&pair.left), points(&pair.right)));
        }
        let scene = Scene::new(&seen, &board);
        let from = start::guess(&seen, &board, &(truth.left, truth.right)).unwrap().unwrap();
        let fit = RigFit::new(&scene, &from, DistortionModel::Radial2, false, SIZE).unwrap();
        let covariance = covariance(&scene, &fit.solved, &free).unwrap();
        let found = rig_from_guess(&fit.solved.guess, SIZE);
        let sigmas = Sigmas::new(&found, &covariance);
        let mut check = |found: f64, sigma: f64, truth: f64| {
            total += 1;
            inside += usize::from((found - truth).abs() <= SIGMAS_95 * sigma);
        };
        let cameras = [(found.left, sigmas.left, truth.left), (found.right, sigmas.right, truth.right)];
        for (found, sigmas, truth) in cameras {
            let (found, truth) = (camera::to_parameters(&found), camera::to_parameters(&truth));
            (0..6).for_each(|k| check(found[k], sigmas[k], truth[k]));
        }
        let (vector, true_vector) = (rotation_vector_rad(&found.right_from_left), rotation_vector_rad(&truth.rotation));
        for k in 0..3 {
            check(vector[k], sigmas.rotation_rad[k], true_vector[k]);
            check(found.right_from_left_m[k], sigmas.translation_m[k], truth.translation_m[k]);
        }
        check(found.baseline_m(), sigmas.baseline_m, truth.translation_m.norm());
        depths_m.push(triangulated_depth_m(&found, pixel, right_pixel));
        variance_m2 += uncertainty::depth_sigma_m(&found, &covariance, pixel, DISTANCE_M).unwrap().powi(2);
    }
    let share = inside as f64 / total as f64;
    println!("95 % intervals hold the truth in {:.2} % of {total}", 100.0 * share);
    assert!((share - 0.95).abs() <= 0.03, "{share}");
    let scatter_m = (depths_m.iter().map(|z| (z - DISTANCE_M).powi(2)).sum::<f64>() / TRIALS as f64).sqrt();
    let stated_m = (variance_m2 / TRIALS as f64).sqrt();
    println!("depth at {DISTANCE_M} m scatters by {:.3} mm, stated {:.3} mm", 1e3 * scatter_m, 1e3 * stated_m);
    // A standard deviation from 200 samples is itself uncertain by 5 %.
    assert!((scatter_m / stated_m - 1.0).abs() < 0.15, "{scatter_m} {stated_m}");
}

/// Another hand: where two rays come nearest to each other.
fn triangulated_depth_m(rig: &RigCalibration, left: Vector2<f64>, right: Vector2<f64>) -> f64 {
    let to_left = rig.right_from_left.transpose();
    let (a, b) = (camera::unproject(&rig.left, left).unwrap(), to_left * camera::unproject(&rig.right, right).unwrap());
    let centre = -(to_left * rig.right_from_left_m);
    let along = nalgebra::Matrix3x2::from_columns(&[a, -b]);
    let at = (along.transpose() * along).try_inverse().unwrap() * along.transpose() * centre;
    ((a * at.x + centre + b * at.y) / 2.0).z
}
