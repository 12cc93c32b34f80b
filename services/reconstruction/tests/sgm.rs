//! Our own semi-global matching beside OpenCV's, where the truth is known: the aloe pair and simulated water.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests fail by panicking and print what they measured")]

mod support;

use halcyon_model::Image;
use halcyon_reconstruction::core::disparity::Disparity;
use halcyon_reconstruction::core::disparity::score::{Score, score};
use halcyon_reconstruction::core::matcher::{DisparityRange, Engine, match_images};
use nalgebra::Vector3;
use support::scene::{default_rig, hit, pose, render};

fn judge(name: &str, left: &Image, right: &Image, max_px: u32, truth: &Disparity) -> Score {
    let engine: Engine = name.parse().unwrap();
    let mut matcher = engine.matcher(engine.block_px_default());
    let disparity = match_images(matcher.as_mut(), left, right, DisparityRange { min_px: 0, max_px }).unwrap();
    let score = score(&disparity, truth).unwrap();
    println!("{name}: density {:.4}, bad1 {:.4}, mean error {:.3} px", score.density, score.bad1, score.mean_error_px);
    score
}

/// No worse than OpenCV's three paths on water: bad pixels and density.
#[test]
fn on_water_no_worse_than_three_paths() {
    for (tilt_deg, amplitude_m, seed) in [(0.0, 0.02, 1), (4.0, 0.1, 2)] {
        let (rig, pose) = (default_rig(), pose(0.0, 0.0, 5.0, [tilt_deg, -tilt_deg, 30.0]));
        let surface = move |north: f64, east: f64| amplitude_m * (2.4 * north + 0.7 * east).sin();
        let pair = render(&rig, &pose, &surface, 2.0, seed);
        let ned_from_left = pose.ned_from_body.to_rotation_matrix().into_inner() * rig.body_from_camera;
        let values_px = (0..rig.width_px * rig.height_px).map(|i| {
            let (x, y) = (f64::from(i % rig.width_px), f64::from(i / rig.width_px));
            let ray = Vector3::new((x - rig.left.cx_px) / rig.left.fx_px, (y - rig.left.cy_px) / rig.left.fy_px, 1.0);
            let (north, east) = hit(&pose.position_ned_m, &(ned_from_left * ray), &surface);
            let point_m = Vector3::new(north, east, -surface(north, east)) - pose.position_ned_m;
            let disparity_px = rig.left.fx_px * 0.4 / (ned_from_left.transpose() * point_m).z;
            if disparity_px <= x { disparity_px as f32 } else { f32::NAN }
        });
        let truth = Disparity { width_px: rig.width_px, height_px: rig.height_px, values_px: values_px.collect() };
        let [three, four, eight] = ["sgbm-3way", "sgm", "sgm8"].map(|name| judge(name, &pair.left, &pair.right, 63, &truth));
        for ours in [four, eight] {
            assert!(ours.density >= 0.98 * three.density && ours.bad1 <= three.bad1.max(0.001), "{ours:?} {three:?}");
        }
    }
}
