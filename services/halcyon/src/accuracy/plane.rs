//! Flat water: how flat and where it is measured (thesis 5.2.1.1, figures 5-8 … 5-10 and 5-18 … 5-20).

use halcyon_model::PoseAtExposure;
use halcyon_sim::sea::SeaConfig;
use nalgebra::{UnitQuaternion, Vector3};

use super::scene::{Scene, SceneError, chain, measure, thesis_rig};
use super::tank::{Assessed, assess};

/// A flat surface measured again and again.
#[derive(Debug, Clone, PartialEq)]
pub struct PlaneRecord {
    /// The true distance, metres.
    pub distance_m: f64,
    /// Mean distance of each pair's points, metres, with its time in seconds (figure 5-10).
    pub measured: Vec<(f64, f64)>,
    /// Root mean square error of single cells, metres.
    pub rmse_m: f64,
}

/// A plane at 0.5 m from the thesis's cameras, `baseline_m` apart, 640 × 480, over `pairs` pairs from slightly different places,
/// two a second: every cell's height against the truth, distance included.
///
/// # Errors
/// [`SceneError`] where a pair becomes no patch.
pub fn plane(baseline_m: f64, pairs: usize) -> Result<PlaneRecord, SceneError> {
    const DISTANCE_M: f64 = 0.5;
    let mut scene = Scene::new(&thesis_rig(baseline_m, 1.0), &SeaConfig::still(), 0.003, 11)?;
    let (mut sum_m2, mut cells) = (0.0, 0_usize);
    let mut measured = Vec::with_capacity(pairs);
    for i in 0..pairs {
        let t_s = i as f64 * 0.5;
        // A little to the side each time, and leaning a little: another part of the surface, other sub-pixel shifts.
        let at_m = Vector3::new(0.013 * i as f64, 0.007 * i as f64, -DISTANCE_M);
        let attitude = UnitQuaternion::from_euler_angles(0.02 * (i as f64).sin(), 0.02 * (1.7 * i as f64).cos(), 0.3);
        let pose =
            PoseAtExposure { position_ned_m: at_m, ned_from_body: attitude, height_sigma_m: 0.0, attitude_sigma_rad: 0.0 };
        let pair = scene.pair(t_s, at_m, &attitude, Some(pose))?;
        let patch = measure(&mut chain(0.01, false), &pair)?;
        let level_m = patch.level_m.unwrap_or(f64::NAN);
        measured.push((t_s, DISTANCE_M - level_m));
        for elevation_m in patch.grid.elevation_m.iter().filter(|elevation| elevation.is_finite()) {
            sum_m2 += (f64::from(*elevation_m) + level_m).powi(2);
            cells += 1;
        }
    }
    Ok(PlaneRecord { distance_m: DISTANCE_M, measured, rmse_m: (sum_m2 / cells.max(1) as f64).sqrt() })
}

/// Still water, where every wave is false, `height_m` below the thesis's cameras, from `pairs` pairs at its rate. `seed` makes
/// repetitions.
///
/// # Errors
/// [`SceneError`] where nothing comes out.
pub fn still_water(height_m: f64, pairs: usize, seed: u64) -> Result<Assessed, SceneError> {
    let mut scene = Scene::new(&thesis_rig(0.092, 0.5), &SeaConfig::still(), 0.006, seed)?;
    assess(&mut scene, height_m, pairs)
}
