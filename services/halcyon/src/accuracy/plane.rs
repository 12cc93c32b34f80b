//! Flat water: how flat and where it is measured (thesis 5.2.1.1, figures 5-8 … 5-10 and 5-18 … 5-20).

use halcyon_sim::sea::SeaConfig;
use nalgebra::{UnitQuaternion, Vector3};

use super::scene::{Scene, SceneError, chain, measure, thesis_rig};
use super::tank::assess;

/// Root mean square error of a plane at 0.5 m from the thesis's cameras, `baseline_m` apart, 640 × 480: every cell's height
/// against the truth, distance included, over `pairs` pairs from slightly different places.
///
/// # Errors
/// [`SceneError`] where a pair becomes no patch.
pub fn plane_rmse_m(baseline_m: f64, pairs: usize) -> Result<f64, SceneError> {
    const DISTANCE_M: f64 = 0.5;
    let mut scene = Scene::new(&thesis_rig(baseline_m, 1.0), &SeaConfig::still(), 0.003, 11)?;
    let (mut sum_m2, mut cells) = (0.0, 0_usize);
    for i in 0..pairs {
        let t_s = i as f64 * 0.5;
        // A little to the side each time, and leaning a little: another part of the surface, other sub-pixel shifts.
        let at_m = Vector3::new(0.013 * i as f64, 0.007 * i as f64, -DISTANCE_M);
        let attitude = UnitQuaternion::from_euler_angles(0.02 * (i as f64).sin(), 0.02 * (1.7 * i as f64).cos(), 0.3);
        let pose = halcyon_model::PoseAtExposure {
            position_ned_m: at_m,
            ned_from_body: attitude,
            height_sigma_m: 0.0,
            attitude_sigma_rad: 0.0,
        };
        let pair = scene.pair(t_s, at_m, &attitude, Some(pose))?;
        let patch = measure(&mut chain(0.01, false), &pair)?;
        let level_m = patch.level_m.unwrap_or(f64::NAN);
        for elevation_m in patch.grid.elevation_m.iter().filter(|elevation| elevation.is_finite()) {
            sum_m2 += (f64::from(*elevation_m) + level_m).powi(2);
            cells += 1;
        }
    }
    Ok((sum_m2 / cells.max(1) as f64).sqrt())
}

/// Mean wave height H_m that is measured over still water at 0.99 m, where there is none, from `pairs` pairs at the thesis's rate.
///
/// # Errors
/// [`SceneError`] where nothing comes out.
pub fn still_wave_height_m(pairs: usize) -> Result<f64, SceneError> {
    let mut scene = Scene::new(&thesis_rig(0.092, 0.5), &SeaConfig::still(), 0.006, 12)?;
    Ok(assess(&mut scene, pairs)?.h_mean_m)
}
