//! Poses that are known, seen through points that are known, and everything that shows no pose.

use nalgebra::{Rotation3, UnitVector3, Vector2};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use halcyon_model::CameraIntrinsics;

fn rig(turn_deg: [f64; 3], t_m: [f64; 3]) -> RigCalibration {
    let camera =
        CameraIntrinsics { fx_px: 500.0, fy_px: 502.0, cx_px: 318.0, cy_px: 242.0, distortion: [-0.2, 0.05, 1e-3, -5e-4, 0.0] };
    let [x, y, z] = turn_deg.map(f64::to_radians);
    RigCalibration {
        width_px: 640,
        height_px: 480,
        left: camera,
        right: CameraIntrinsics { fx_px: 505.0, cx_px: 322.0, ..camera },
        right_from_left: Rotation3::new(Vector3::new(x, y, z)).into_inner(),
        right_from_left_m: Vector3::from(t_m),
        body_from_camera: RigCalibration::LOOKING_DOWN,
        camera_in_body_m: Vector3::zeros(),
    }
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    (0..12).map(|_| random.random_range(-0.5..0.5)).sum()
}

/// What a scene is: the depth of the point on a ray, metres.
type Depth<'a> = &'a dyn Fn(usize, Vector2<f64>, &mut ChaCha8Rng) -> f64;

/// Matches of `views` pairs by exact projection, with noise and a share of lies.
fn views(
    rig: &RigCalibration,
    views: usize,
    count: usize,
    depth: Depth<'_>,
    sigma_px: f64,
    lies: f64,
    seed: u64,
) -> Vec<Vec<PointPair>> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..views)
        .map(|view| {
            let mut pairs = Vec::new();
            while pairs.len() < count {
                let ray = Vector2::new(random.random_range(-0.55..0.55), random.random_range(-0.4..0.4));
                let point = ray.push(1.0) * depth(view, ray, &mut random);
                let left = crate::core::camera::project(&rig.left, &point);
                let right = crate::core::camera::project(&rig.right, &(rig.right_from_left * point + rig.right_from_left_m));
                let inside = |p: Vector2<f64>| (0.0..640.0).contains(&p.x) && (0.0..480.0).contains(&p.y);
                if !inside(left) || !inside(right) {
                    continue;
                }
                let mut noisy = |p: Vector2<f64>| p + Vector2::new(normal(&mut random), normal(&mut random)) * sigma_px;
                let mut pair = PointPair { left: noisy(left), right: noisy(right) };
                if random.random_bool(lies) {
                    pair.right = Vector2::new(random.random_range(0.0..640.0), random.random_range(0.0..480.0));
                }
                pairs.push(pair);
            }
            pairs
        })
        .collect()
}

/// A scene with depth: 3 to 6 m anywhere.
fn deep(_: usize, _: Vector2<f64>, random: &mut ChaCha8Rng) -> f64 {
    random.random_range(3.0..6.0)
}

/// A flat scene that is tilted differently in each view.
fn flat(view: usize, ray: Vector2<f64>, _: &mut ChaCha8Rng) -> f64 {
    let tilt = view as f64 * 0.9;
    5.0 / (1.0 + 0.12 * tilt.cos() * ray.x + 0.12 * tilt.sin() * ray.y)
}

/// The errors of an estimate in its own standard deviations: turn (3), direction (2).
fn errors(found: &SelfCalibration, truth: &RigCalibration) -> [f64; 5] {
    let turn = Rotation3::from_matrix_unchecked(found.rig.right_from_left * truth.right_from_left.transpose()).scaled_axis();
    let t = UnitVector3::new_normalize(truth.right_from_left_m);
    let direction = bundle::tangent(&t).tr_mul(&found.rig.right_from_left_m.normalize());
    [
        turn.x / found.turn_sigma_rad.x,
        turn.y / found.turn_sigma_rad.y,
        turn.z / found.turn_sigma_rad.z,
        direction.x / found.direction_sigma_rad.x,
        direction.y / found.direction_sigma_rad.y,
    ]
}

#[test]
fn a_moved_rig_is_found_by_both_solvers_with_lies_and_noise() {
    let given = rig([0.0; 3], [-0.4, 0.0, 0.0]);
    let truth = rig([0.8, -1.5, 0.5], [-0.4, 0.012, -0.02]);
    let matches = views(&truth, 4, 250, &deep, 0.3, 0.3, 1);
    for solver in [Solver::FivePoint, Solver::EightPoint] {
        let settings = Settings { solver, scale: Scale::Baseline(0.4), ..Settings::default() };
        let found = self_calibrate(&given, &matches, &settings).unwrap();
        println!("{solver:?}: {found:?}");
        assert!(errors(&found, &truth).iter().all(|error| error.abs() < 4.0), "{:?}", errors(&found, &truth));
        assert!(found.turn_sigma_rad.amax() < 0.04_f64.to_radians(), "{}", found.turn_sigma_rad);
        // 70 % are true, but for those few that lie on their lines by chance.
        assert!((650..=760).contains(&found.inliers), "{}", found.inliers);
        assert!((found.sigma_px / 0.3 - 1.0).abs() < 0.15, "{}", found.sigma_px);
        assert!(found.has_drifted && !found.is_flat && found.alternative.is_none());
        // Rows differ by the noise of two pictures.
        assert!((found.after.rms_px / (0.3 * 2.0_f64.sqrt()) - 1.0).abs() < 0.15, "{:?}", found.after);
        assert!(found.before.rms_px > 5.0 && (found.drift_px / found.before.rms_px - 1.0).abs() < 0.05);
        assert!((found.baseline_m - 0.4).abs() < 1e-12);
    }
}

/// The standard deviations are those of repeated trials: sums of squares of 40 × 5 unit normals are 200 ± 20.
#[test]
fn standard_deviations_are_honest() {
    let truth = rig([0.1, -0.2, 0.1], [-0.4, 0.002, 0.003]);
    let (mut sum, mut count) = (0.0, 0.0);
    for seed in 0..40 {
        let found = self_calibrate(&truth, &views(&truth, 2, 150, &deep, 0.4, 0.0, seed), &Settings::default()).unwrap();
        for error in errors(&found, &truth) {
            sum += error * error;
            count += 1.0;
        }
        assert!(!found.has_drifted, "{found:?}");
    }
    let ratio = sum / count;
    println!("{ratio:.3}");
    assert!((0.7..1.35).contains(&ratio), "{ratio}");
}

#[test]
fn flat_water_is_solved_and_said_to_be_flat() {
    let given = rig([0.0; 3], [-0.4, 0.0, 0.0]);
    let truth = rig([0.3, -0.4, 0.2], [-0.4, 0.005, 0.004]);
    let found = self_calibrate(&given, &views(&truth, 5, 300, &flat, 0.3, 0.2, 2), &Settings::default()).unwrap();
    println!("{found:?}");
    assert!(found.is_flat);
    assert!(errors(&found, &truth).iter().all(|error| error.abs() < 4.0), "{:?}", errors(&found, &truth));
    // Eight points can't; the calibration in force is still a start, so either the same pose or a refusal.
    let eight = Settings { solver: Solver::EightPoint, ..Settings::default() };
    if let Ok(found) = self_calibrate(&given, &views(&truth, 5, 300, &flat, 0.3, 0.2, 2), &eight) {
        assert!(errors(&found, &truth).iter().all(|error| error.abs() < 4.0));
    }
}

/// A wall seen from two places far apart, all of it on one side: the classic case of two poses (one view, one plane).
#[test]
fn two_poses_that_explain_one_wall_are_reported() {
    let mut truth = rig([0.0, -12.0, 0.0], [-2.0, 0.3, 0.9]);
    truth.left.distortion = [0.0; 5];
    truth.right.distortion = [0.0; 5];
    let wall = |_: usize, ray: Vector2<f64>, _: &mut ChaCha8Rng| 6.0 / (1.0 + 0.9 * ray.x);
    let matches = views(&truth, 1, 400, &wall, 0.3, 0.0, 3);
    let found = self_calibrate(&truth, &matches, &Settings::default()).unwrap();
    println!("{found:?}");
    assert!(found.is_flat);
    let alternative = found.alternative.unwrap();
    assert!(alternative.rotation_rad > 0.01 || alternative.direction_rad > 0.05, "{alternative:?}");
    assert!(
        errors(&found, &truth).iter().all(|error| error.abs() < 4.0),
        "the nearer one is taken: {:?}",
        errors(&found, &truth)
    );
    // A second view of another wall tells them apart.
    let other =
        |view: usize, ray: Vector2<f64>, _: &mut ChaCha8Rng| 6.0 / (1.0 + if view == 0 { 0.9 * ray.x } else { -0.5 * ray.y });
    let found = self_calibrate(&truth, &views(&truth, 2, 400, &other, 0.3, 0.0, 4), &Settings::default()).unwrap();
    assert!(found.is_flat && found.alternative.is_none(), "{found:?}");
}

#[test]
fn altitude_gives_the_scale() {
    let truth = rig([0.2, 0.1, -0.1], [-0.4, 0.003, 0.002]);
    let given = RigCalibration { right_from_left_m: truth.right_from_left_m * 1.3, ..truth };
    let settings = Settings { scale: Scale::Altitude(5.0), ..Settings::default() };
    let found = self_calibrate(&given, &views(&truth, 5, 300, &flat, 0.2, 0.1, 5), &settings).unwrap();
    assert!((found.baseline_m - truth.baseline_m()).abs() < 4.0 * found.baseline_sigma_m + 1e-4, "{found:?}");
    assert!(found.baseline_sigma_m < 2e-3, "{}", found.baseline_sigma_m);
}

/// Cameras that look at each other's field from the sides show their focal length; parallel ones do not, and that is said.
#[test]
fn focal_length_where_it_shows() {
    let mut truth = rig([25.0, -35.0, 10.0], [-2.5, 1.5, 1.0]);
    let given = truth;
    for camera in [&mut truth.left, &mut truth.right] {
        camera.fx_px *= 1.03;
        camera.fy_px *= 1.03;
    }
    let settings = Settings { refine_focal: true, ..Settings::default() };
    let found = self_calibrate(&given, &views(&truth, 4, 400, &deep, 0.2, 0.0, 6), &settings).unwrap();
    let (scale, sigma) = found.focal_scale.unwrap();
    println!("{scale} ± {sigma}");
    assert!((scale - 1.03).abs() < 4.0 * sigma && sigma < 0.01, "{scale} {sigma}");
    assert!((found.rig.left.fx_px - truth.left.fx_px).abs() < 4.0 * sigma * truth.left.fx_px);
    let parallel = rig([0.0; 3], [-0.4, 0.0, 0.0]);
    let open = self_calibrate(&parallel, &views(&parallel, 2, 200, &deep, 0.3, 0.0, 7), &settings);
    assert!(matches!(open, Err(SelfCalibrateError::FocalOpen { .. })), "{open:?}");
}

#[test]
fn what_shows_no_pose_is_refused() {
    let truth = rig([0.1, -0.2, 0.1], [-0.4, 0.002, 0.003]);
    let settings = Settings::default();
    let run = |matches: &[Vec<PointPair>]| self_calibrate(&truth, matches, &settings);
    let good = views(&truth, 2, 150, &deep, 0.3, 0.0, 8);

    assert!(matches!(run(&[]), Err(SelfCalibrateError::TooFew { matches: 0, needed: 50 })));
    assert!(matches!(run(&[good[0][..20].to_vec()]), Err(SelfCalibrateError::TooFew { matches: 20, .. })));

    let swapped: Vec<Vec<PointPair>> =
        good.iter().map(|v| v.iter().map(|p| PointPair { left: p.right, right: p.left }).collect()).collect();
    let refused = run(&swapped);
    assert!(matches!(refused, Err(SelfCalibrateError::Swapped)), "{refused:?}");

    let same: Vec<Vec<PointPair>> =
        good.iter().map(|v| v.iter().map(|p| PointPair { left: p.left, right: p.left }).collect()).collect();
    assert!(matches!(run(&same), Err(SelfCalibrateError::NoBaseline { .. })));
    // One camera that turned on the spot, with noise.
    let mut turned = rig([1.0, -4.0, 2.0], [-1e-9, 0.0, 0.0]);
    turned.right = truth.right;
    let refused = run(&views(&turned, 2, 150, &deep, 0.3, 0.1, 9));
    assert!(matches!(refused, Err(SelfCalibrateError::NoBaseline { .. })), "{refused:?}");

    let lies = run(&views(&truth, 2, 150, &deep, 0.3, 1.0, 10));
    assert!(matches!(lies, Err(SelfCalibrateError::NoConsensus { .. } | SelfCalibrateError::Open)), "{lies:?}");
    let nan = vec![vec![PointPair { left: Vector2::new(f64::NAN, 1.0), right: Vector2::new(1.0, 1.0) }; 100]];
    assert!(matches!(run(&nan), Err(SelfCalibrateError::TooFew { matches: 0, .. })));

    for scale in [Scale::Baseline(0.0), Scale::Baseline(f64::NAN), Scale::Altitude(-3.0), Scale::Altitude(f64::INFINITY)] {
        let refused = self_calibrate(&truth, &good, &Settings { scale, ..settings });
        assert!(matches!(refused, Err(SelfCalibrateError::Invalid(_))), "{scale:?}");
    }
    let mut broken = truth;
    broken.left.fx_px = f64::NAN;
    assert!(matches!(self_calibrate(&broken, &good, &settings), Err(SelfCalibrateError::Invalid(_))));
}
