//! Closed-form scenes, and OpenCV's own functions as a second hand.

use nalgebra::{Matrix3, Rotation3, Vector2, Vector3};
use opencv::calib3d;
use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, Point2d, Vector};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::core::cv;

const MATRIX: Matrix3<f64> = Matrix3::new(500.0, 0.0, 320.0, 0.0, 510.0, 240.0, 0.0, 0.0, 1.0);

struct Scene {
    right_from_left: Matrix3<f64>,
    t_m: Vector3<f64>,
    points_m: Vec<Vector3<f64>>,
    pixels: Vec<PointPair>,
}

/// A rig that is turned and tilted, before a cloud of points 2 to 6 m away; `noise_px` evenly spread in every coordinate.
fn scene(count: usize, noise_px: f64, seed: u64) -> Scene {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let right_from_left = Rotation3::from_euler_angles(0.03, -0.08, 0.02).into_inner();
    let t_m = Vector3::new(-0.4, 0.03, 0.05);
    let pixel = |point: Vector3<f64>| (MATRIX * point).xy() / point.z;
    let (mut points_m, mut pixels) = (Vec::new(), Vec::new());
    while points_m.len() < count {
        let z = random.random_range(2.0..6.0);
        let point = Vector3::new(random.random_range(-0.5..0.5) * z, random.random_range(-0.4..0.4) * z, z);
        let mut noise = || Vector2::new(random.random_range(-1.0..1.0), random.random_range(-1.0..1.0)) * noise_px;
        pixels.push(PointPair { left: pixel(point) + noise(), right: pixel(right_from_left * point + t_m) + noise() });
        points_m.push(point);
    }
    Scene { right_from_left, t_m, points_m, pixels }
}

fn true_fundamental(scene: &Scene) -> Matrix3<f64> {
    let inverse = MATRIX.try_inverse().unwrap();
    let f = inverse.transpose() * essential_from_pose(&scene.right_from_left, &scene.t_m) * inverse;
    f / f.norm()
}

/// Two matrices that differ by a factor, as the Frobenius norm of what is left of them.
fn distance(a: &Matrix3<f64>, b: &Matrix3<f64>) -> f64 {
    let (a, b) = (a / a.norm(), b / b.norm());
    (a - b).norm().min((a + b).norm())
}

fn cv_points(pairs: &[PointPair], side: fn(&PointPair) -> Vector2<f64>) -> Vector<Point2d> {
    pairs.iter().map(|pair| Point2d::new(side(pair).x, side(pair).y)).collect()
}

#[test]
fn eight_points_give_the_true_fundamental_matrix() {
    for count in [8, 9, 40] {
        let scene = scene(count, 0.0, 1);
        let f = eight_point(&scene.pixels).unwrap();
        assert!(distance(&f, &true_fundamental(&scene)) < 1e-6, "{count}: {f}");
        assert!(f.determinant().abs() < 1e-15 && (f.norm() - 1.0).abs() < 1e-12);
        assert!(scene.pixels.iter().all(|pair| sampson_px2(&f, pair) < 1e-10));
    }
}

#[test]
fn the_library_finds_the_same_fundamental_matrix_in_noise() {
    let scene = scene(200, 0.5, 2);
    let ours = eight_point(&scene.pixels).unwrap();
    let (left, right) = (cv_points(&scene.pixels, |p| p.left), cv_points(&scene.pixels, |p| p.right));
    let theirs = calib3d::find_fundamental_mat_1(&left, &right, calib3d::FM_8POINT, 1.0, 0.99, &mut Mat::default()).unwrap();
    let theirs = cv::matrix3_from_mat(&theirs).unwrap();
    // They normalise alike; what differs is rounding.
    assert!(distance(&ours, &theirs) < 1e-6, "{ours} {theirs}");
}

/// Along the epipolar normal a point displaced by δ in the right picture is δ/√2 off in both pictures together.
#[test]
fn sampson_distance_of_a_known_displacement() {
    // A perfect rectified rig: F maps to the same row.
    let f = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 1.0, 0.0);
    let pair = PointPair { left: Vector2::new(100.0, 50.0), right: Vector2::new(70.0, 50.6) };
    assert!((sampson_px2(&f, &pair) - 0.6 * 0.6 / 2.0).abs() < 1e-12);
}

#[test]
fn ransac_tells_lies_from_truth() {
    let mut scene = scene(300, 0.3, 3);
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let lies: Vec<bool> = (0..300).map(|i| i % 5 >= 3).collect();
    for (pair, _) in scene.pixels.iter_mut().zip(&lies).filter(|(_, lie)| **lie) {
        pair.right = Vector2::new(random.random_range(0.0..640.0), random.random_range(0.0..480.0));
    }
    let settings = RansacSettings::default();
    let found = find_fundamental(&scene.pixels, &settings).unwrap();
    let missed = found.is_inlier.iter().zip(&lies).filter(|(inlier, lie)| !**inlier && !**lie).count();
    let believed = found.is_inlier.iter().zip(&lies).filter(|(inlier, lie)| **inlier && **lie).count();
    // A random point is within 1 px of a line through a picture 480 high by chance once in 200 times or so.
    assert!(missed <= 2 && believed <= 5, "{missed} {believed}");
    assert_eq!(found, find_fundamental(&scene.pixels, &settings).unwrap());
    assert!(found.samples < settings.samples_max, "the count adapts: {}", found.samples);

    let chaos: Vec<PointPair> = (0..100)
        .map(|_| {
            let mut point = || Vector2::new(random.random_range(0.0..640.0), random.random_range(0.0..480.0));
            PointPair { left: point(), right: point() }
        })
        .collect();
    let few = RansacSettings { samples_max: 300, inliers_min: 20, ..settings };
    assert!(matches!(find_fundamental(&chaos, &few), Err(EpipolarError::NoConsensus { .. })));
}

#[test]
fn points_that_leave_it_open_are_refused() {
    let mut scene = scene(60, 0.0, 5);
    assert!(matches!(eight_point(&scene.pixels[..7]), Err(EpipolarError::TooFew { points: 7, needed: 8 })));
    assert!(matches!(find_fundamental(&scene.pixels[..10], &RansacSettings::default()), Err(EpipolarError::TooFew { .. })));
    for (pair, point) in scene.pixels.iter_mut().zip(&scene.points_m) {
        let on_plane = point * (4.0 / point.z);
        let pixel = |point: Vector3<f64>| (MATRIX * point).xy() / point.z;
        *pair = PointPair { left: pixel(on_plane), right: pixel(scene.right_from_left * on_plane + scene.t_m) };
    }
    assert!(matches!(eight_point(&scene.pixels), Err(EpipolarError::Degenerate)));
    let same = vec![scene.pixels[0]; 20];
    assert!(matches!(eight_point(&same), Err(EpipolarError::Degenerate)));
    let nan = vec![PointPair { left: Vector2::new(f64::NAN, 0.0), right: Vector2::zeros() }; 20];
    assert!(eight_point(&nan).is_err() && find_fundamental(&nan, &RansacSettings::default()).is_err());
}

fn rays(scene: &Scene) -> Vec<PointPair> {
    let ray = |p: Vector2<f64>| Vector2::new((p.x - 320.0) / 500.0, (p.y - 240.0) / 510.0);
    scene.pixels.iter().map(|pair| PointPair { left: ray(pair.left), right: ray(pair.right) }).collect()
}

#[test]
fn both_ways_to_the_pose_end_at_the_truth() {
    let scene = scene(80, 0.0, 6);
    let rays = rays(&scene);
    let by_eight = essential_from_fundamental(&eight_point(&scene.pixels).unwrap(), &MATRIX, &MATRIX);
    let (by_five, agree) = five_point(&rays, 1e-3).unwrap();
    assert!(agree.iter().all(|agrees| *agrees));
    for e in [by_eight, by_five] {
        assert!(distance(&e, &essential_from_pose(&scene.right_from_left, &scene.t_m)) < 1e-5, "{e}");
        let pose = pose_from_essential(&e, &rays).unwrap();
        assert_eq!(pose.in_front, 80);
        assert!((pose.right_from_left - scene.right_from_left).norm() < 1e-4, "{}", pose.right_from_left);
        assert!((pose.direction - scene.t_m.normalize()).norm() < 1e-3, "{}", pose.direction);
    }
    assert!(matches!(five_point(&rays[..4], 1e-3), Err(EpipolarError::TooFew { .. })));
    assert!(pose_from_essential(&Matrix3::repeat(f64::NAN), &rays).is_none());
}

#[test]
fn triangulation_finds_points_and_agrees_with_the_library() {
    let exact = scene(50, 0.0, 7);
    let (left, right) = projection_matrices(&MATRIX, &MATRIX, &exact.right_from_left, &exact.t_m);
    for (pair, point) in exact.pixels.iter().zip(&exact.points_m) {
        assert!((triangulate(&left, &right, pair).unwrap() - point).norm() < 1e-9);
    }
    // By hand: f = 500, b = 0.4, d = 50 → z = 4.
    let (l, r) = projection_matrices(&MATRIX, &MATRIX, &Matrix3::identity(), &Vector3::new(-0.4, 0.0, 0.0));
    let pair = PointPair { left: Vector2::new(320.0, 240.0), right: Vector2::new(270.0, 240.0) };
    assert!((triangulate(&l, &r, &pair).unwrap() - Vector3::new(0.0, 0.0, 4.0)).norm() < 1e-9);
    let at_infinity = PointPair { right: pair.left, ..pair };
    assert_eq!(triangulate(&l, &r, &at_infinity), None);

    let noisy = scene(50, 0.5, 8);
    let mat = |m: &nalgebra::Matrix3x4<f64>| {
        Mat::new_rows_cols_with_data(3, 4, m.transpose().as_slice()).unwrap().try_clone().unwrap()
    };
    let mut found = Mat::default();
    let (a, b) = (cv_points(&noisy.pixels, |p| p.left), cv_points(&noisy.pixels, |p| p.right));
    calib3d::triangulate_points(&mat(&left), &mat(&right), &a, &b, &mut found).unwrap();
    let found = found.data_typed::<f64>().unwrap();
    for (i, pair) in noisy.pixels.iter().enumerate() {
        let theirs = Vector3::new(found[i], found[50 + i], found[100 + i]) / found[150 + i];
        let ours = triangulate(&left, &right, pair).unwrap();
        // They weigh the four equations a little differently: apart by a small part of what the noise does.
        assert!((ours - theirs).norm() < 0.01 * ours.norm(), "{ours} {theirs}");
    }
}

#[test]
fn projection_matrices_are_the_theses() {
    let (left, right) = projection_matrices(&MATRIX, &MATRIX, &Matrix3::identity(), &Vector3::new(-0.1, 0.0, 0.0));
    assert_eq!(left.fixed_view::<3, 3>(0, 0).into_owned(), MATRIX);
    assert_eq!(left.column(3).norm(), 0.0);
    assert_eq!(right[(0, 3)], -50.0);
}

#[test]
fn rays_undo_the_lens() {
    let camera = halcyon_model::CameraIntrinsics {
        fx_px: 500.0,
        fy_px: 510.0,
        cx_px: 320.0,
        cy_px: 240.0,
        distortion: [-0.28, 0.1, 1e-3, -2e-3, -0.01],
    };
    let rays = [Vector2::new(0.0, 0.0), Vector2::new(0.55, -0.4), Vector2::new(-0.6, 0.45)];
    let pixels: Vec<PointPair> = rays
        .iter()
        .map(|ray| {
            let pixel = crate::core::camera::project(&camera, &ray.push(1.0));
            PointPair { left: pixel, right: pixel }
        })
        .collect();
    for (found, ray) in Rays::new(&camera, &camera).unwrap().of(&pixels).unwrap().iter().zip(&rays) {
        assert!((found.left - ray).norm() < 1e-7 && (found.right - ray).norm() < 1e-7, "{found:?} {ray}");
    }
    let ideal = pixels_without_distortion(&pixels, &camera, &camera).unwrap();
    assert!((ideal[1].right - Vector2::new(320.0 + 500.0 * 0.55, 240.0 - 510.0 * 0.4)).norm() < 1e-4);
}

#[test]
fn hartley_puts_matches_on_rows_and_leaves_the_picture_upright() {
    let scene = scene(100, 0.0, 9);
    let f = true_fundamental(&scene);
    let h = rectify_from_matches(&f, &scene.pixels, (640, 480)).unwrap();
    for pair in &scene.pixels {
        let moved = h.apply(pair);
        assert!((moved.left.y - moved.right.y).abs() < 1e-6, "{moved:?}");
    }
    // Little moves: the right picture's centre stays, its corners stay within a few pixels of the turn, nothing is mirrored.
    let corner = |x: f64, y: f64| PointPair { left: Vector2::new(x, y), right: Vector2::new(x, y) };
    let centre = h.apply(&corner(319.5, 239.5));
    assert!((centre.right - Vector2::new(319.5, 239.5)).norm() < 1e-6);
    for (x, y) in [(0.0, 0.0), (639.0, 0.0), (0.0, 479.0), (639.0, 479.0)] {
        let moved = h.apply(&corner(x, y));
        assert!((moved.right - Vector2::new(x, y)).norm() < 100.0, "{moved:?}");
        assert!((moved.left - Vector2::new(x, y)).norm() < 200.0, "{moved:?}");
    }
    // Least squares: the mean disparity is 0.
    let mean = scene.pixels.iter().map(|p| h.apply(p)).map(|p| p.left.x - p.right.x).sum::<f64>() / 100.0;
    assert!(mean.abs() < 5.0, "{mean}");
}

#[test]
fn cameras_in_a_row_cannot_be_rectified() {
    let mut scene = scene(100, 0.0, 10);
    scene.t_m = Vector3::new(0.01, 0.0, 0.5);
    let f = true_fundamental(&scene);
    assert_eq!(rectify_from_matches(&f, &scene.pixels, (640, 480)), Err(HartleyError::EpipoleInside));
    assert_eq!(rectify_from_matches(&f, &scene.pixels[..5], (640, 480)), Err(HartleyError::TooFew(5)));
    assert!(rectify_from_matches(&Matrix3::repeat(f64::NAN), &scene.pixels, (640, 480)).is_err());
}
