//! Rectified pairs with known disparity.

use std::path::Path;

use halcyon_model::{Image, Stamp};
use halcyon_reconstruction::core::disparity::Disparity;
use halcyon_reconstruction::core::disparity::score::non_occluded;
use halcyon_reconstruction::core::matcher::DisparityRange;
use halcyon_reconstruction::files::{read_pair, read_truth};
use halcyon_sim::rig::RigConfig;
use halcyon_sim::sea::SeaConfig;
use halcyon_sim::water::Water;
use nalgebra::{UnitQuaternion, Vector3};

use super::BenchError;
use crate::accuracy::{Scene, thesis_rig};

/// A rectified pair, what to search, and the truth where both cameras see it.
pub(super) struct Rectified {
    pub(super) name: String,
    pub(super) left: Image,
    pub(super) right: Image,
    pub(super) range: DisparityRange,
    pub(super) truth: Disparity,
}

/// The truth is computed on every so many pixels.
const TRUTH_STRIDE: usize = 4;

/// Water at the sizes and ranges that the speed of engines is quoted for, and the aloe pair where the samples are.
pub(super) fn all(samples: &Path, quick: bool) -> Result<Vec<Rectified>, BenchError> {
    let mut scenes = vec![water(640, 480, 64, 0.99)?];
    if !quick {
        scenes.push(water(1920, 1080, 128, 1.35)?);
    }
    let aloe = ["aloeL.jpg", "aloeR.jpg", "aloeGT.png"].map(|name| samples.join(name));
    if aloe.iter().all(|path| path.exists()) {
        let (left, right) = read_pair(&aloe[0], &aloe[1])?;
        let truth = non_occluded(&read_truth(&aloe[2], 1.0)?);
        scenes.push(Rectified { name: "aloe".into(), left, right, range: DisparityRange { min_px: 0, max_px: 223 }, truth });
    }
    Ok(scenes)
}

/// Waves seen from `height_m` by the thesis's cameras, without the flaws of lenses and mounts: such pictures are rectified as they
/// are taken.
fn water(width_px: u32, height_px: u32, disparities: u32, height_m: f64) -> Result<Rectified, BenchError> {
    let scale = f64::from(width_px) / 640.0;
    let rig = RigConfig { width_px, height_px, misalignment_deg: [0.0; 3], distortion: [0.0; 5], ..thesis_rig(0.092, scale) };
    // Grains of two pixels.
    let grain_m = 2.0 * height_m / rig.calibration().left.fx_px;
    let mut scene = Scene::new(&rig, &SeaConfig::jonswap(0.06, 1.0, 250.0), grain_m, 11)?;
    let position_m = Vector3::new(0.0, 0.0, -height_m);
    let pair = scene.pair(2.0, position_m, &UnitQuaternion::identity(), None)?;
    let calibration = pair.calibration;
    let left_m = position_m + calibration.camera_in_body_m;
    let camera = &calibration.left;
    let mut truth = Disparity { width_px, height_px, values_px: vec![f32::NAN; width_px as usize * height_px as usize] };
    for y in (0..height_px as usize).step_by(TRUTH_STRIDE) {
        for x in (0..width_px as usize).step_by(TRUTH_STRIDE) {
            let ray = Vector3::new((x as f64 - camera.cx_px) / camera.fx_px, (y as f64 - camera.cy_px) / camera.fy_px, 1.0);
            let depth_m = depth_m(&scene.water, left_m, calibration.body_from_camera * ray, pair.stamp);
            truth.values_px[y * width_px as usize + x] = (camera.fx_px * calibration.baseline_m() / depth_m) as f32;
        }
    }
    let range = DisparityRange { min_px: 0, max_px: disparities - 1 };
    Ok(Rectified { name: "water".into(), left: pair.left, right: pair.right, range, truth: non_occluded(&truth) })
}

/// How far along `ray` (NED, unit depth) from `from_m` the water is, metres: fixed-point iteration, which slopes below 1 let converge.
fn depth_m(water: &Water, from_m: Vector3<f64>, ray: Vector3<f64>, stamp: Stamp) -> f64 {
    let mut depth_m = -from_m.z / ray.z;
    for _ in 0..30 {
        let at_m = from_m + ray * depth_m;
        let next_m = (-water.elevation_m(at_m.x, at_m.y, stamp) - from_m.z) / ray.z;
        let step_m = (next_m - depth_m).abs();
        depth_m = next_m;
        if step_m < 1e-7 {
            break;
        }
    }
    depth_m
}
