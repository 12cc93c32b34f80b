//! An independent judge of the simulated pictures: OpenCV's own rectification and matcher must find the water where it is.

use std::sync::Arc;

use halcyon_model::{CameraIntrinsics, Image, Stamp};
use halcyon_sim::render::Renderer;
use halcyon_sim::rig::RigConfig;
use halcyon_sim::sea::SeaConfig;
use halcyon_sim::texture::Texture;
use halcyon_sim::water::Water;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use opencv::core::{CV_32FC1, Mat, Size};
use opencv::prelude::*;
use opencv::{calib3d, imgproc};

#[allow(clippy::unwrap_used, reason = "a helper of tests")]
fn mat(m: &Matrix3<f64>) -> Mat {
    Mat::from_slice(m.transpose().as_slice()).unwrap().reshape(1, 3).unwrap().clone_pointee()
}

#[allow(clippy::unwrap_used, reason = "a helper of tests")]
fn rectified(image: &Image, camera: &CameraIntrinsics, rotation: &Mat, projection: &Mat) -> Mat {
    let size = Size::new(image.width_px() as i32, image.height_px() as i32);
    let (mut map_x, mut map_y, mut out) = (Mat::default(), Mat::default(), Mat::default());
    let distortion = Mat::from_slice(&camera.distortion).unwrap();
    let matrix = mat(&camera.matrix());
    calib3d::init_undistort_rectify_map(&matrix, &distortion, rotation, projection, size, CV_32FC1, &mut map_x, &mut map_y)
        .unwrap();
    let raw = Mat::from_slice(image.pixels()).unwrap().reshape(1, size.height).unwrap().clone_pointee();
    imgproc::remap_def(&raw, &mut out, &map_x, &map_y, imgproc::INTER_CUBIC).unwrap();
    out
}

#[test]
fn opencv_finds_the_water_where_it_is() {
    let rig = RigConfig { width_px: 640, height_px: 480, ..RigConfig::default() };
    let calibration = rig.calibration();
    let water = Water::new(&SeaConfig::jonswap(0.30, 2.2, 240.0), 11).unwrap();
    let mut renderer = Renderer::new(&rig, Arc::new(Texture::water(11))).unwrap();
    let stamp = Stamp::from_nanos(1_780_000_000_123_456_789);
    let ned_from_body = UnitQuaternion::from_euler_angles(0.04, -0.03, 1.1);
    let position_m = Vector3::new(40.0, -25.0, -4.0);
    let (left, right) = renderer.render_pair(&water, &ned_from_body, position_m, stamp, 1).unwrap();

    let size = Size::new(640, 480);
    let (m1, m2) = (mat(&calibration.left.matrix()), mat(&calibration.right.matrix()));
    let d = Mat::from_slice(&rig.distortion).unwrap();
    let translation = Mat::from_slice(calibration.right_from_left_m.as_slice()).unwrap().reshape(1, 3).unwrap().clone_pointee();
    let (mut r1, mut r2, mut p1, mut p2, mut q) =
        (Mat::default(), Mat::default(), Mat::default(), Mat::default(), Mat::default());
    let rotation = mat(&calibration.right_from_left);
    calib3d::stereo_rectify_def(&m1, &d, &m2, &d, size, &rotation, &translation, &mut r1, &mut r2, &mut p1, &mut p2, &mut q)
        .unwrap();
    let (a, b) = (rectified(&left, &calibration.left, &r1, &p1), rectified(&right, &calibration.right, &r2, &p2));
    let mut matcher =
        calib3d::StereoSGBM::create(32, 96, 5, 200, 800, 1, 31, 10, 100, 2, calib3d::StereoSGBM_MODE_SGBM).unwrap();
    let mut disparity = Mat::default();
    matcher.compute(&a, &b, &mut disparity).unwrap();

    let projection = |at: (i32, i32), m: &Mat| *m.at_2d::<f64>(at.0, at.1).unwrap();
    let (f, cx, cy) = (projection((0, 0), &p1), projection((0, 2), &p1), projection((1, 2), &p1));
    let f_b = -projection((0, 3), &p2);
    let left_from_rectified = Matrix3::from_fn(|i, j| projection((j as i32, i as i32), &r1));
    let ned_from_left = ned_from_body.to_rotation_matrix() * calibration.body_from_camera;
    let left_m = position_m + ned_from_body * calibration.camera_in_body_m;
    let (mut errors_m, mut heights_m) = (Vec::new(), Vec::new());
    for v in 0..480 {
        for u in 150..640 {
            let d_px = f64::from(*disparity.at_2d::<i16>(v, u).unwrap()) / 16.0;
            if d_px <= 32.0 {
                continue;
            }
            let z_m = f_b / d_px;
            let in_rectified_m = Vector3::new((f64::from(u) - cx) * z_m / f, (f64::from(v) - cy) * z_m / f, z_m);
            let point_m = left_m + ned_from_left * (left_from_rectified * in_rectified_m);
            let truth_m = water.elevation_m(point_m.x, point_m.y, stamp);
            errors_m.push(-point_m.z - truth_m);
            heights_m.push(truth_m);
        }
    }
    let seen = errors_m.len() as f64 / f64::from(480 * 490);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let sigma = |values: &[f64]| {
        let mean = mean(values);
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
    };
    let mut sizes_m: Vec<f64> = errors_m.iter().map(|error| error.abs()).collect();
    sizes_m.sort_by(f64::total_cmp);
    let median_m = sizes_m[sizes_m.len() / 2];
    println!(
        "matched {:.0} %, mean error {:.1} mm, median size {:.1} mm, sigma {:.1} mm over waves of sigma {:.1} mm",
        100.0 * seen,
        1e3 * mean(&errors_m),
        1e3 * median_m,
        1e3 * sigma(&errors_m),
        1e3 * sigma(&heights_m)
    );
    // One pixel of disparity is 58 mm here; SGBM is good to a tenth or two.
    assert!(seen > 0.9, "{seen}");
    assert!(mean(&errors_m).abs() < 0.003, "{}", mean(&errors_m));
    assert!(median_m < 0.010, "{median_m}");
    assert!(sigma(&errors_m) < 0.020 && sigma(&heights_m) > 0.025, "{} {}", sigma(&errors_m), sigma(&heights_m));
}
