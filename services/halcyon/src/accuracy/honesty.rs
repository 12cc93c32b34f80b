//! Is the stated standard deviation of a cell what cells are really off by?

use halcyon_model::PoseAtExposure;
use halcyon_sim::rig::RigConfig;
use halcyon_sim::sea::SeaConfig;
use nalgebra::{UnitQuaternion, Vector3};

use super::scene::{Scene, SceneError, chain, measure};

/// Shares of cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Honesty {
    /// Within one stated standard deviation of the truth: 68.3 % for an honest one.
    pub within_one: f64,
    /// Within two: 95.4 %.
    pub within_two: f64,
    /// Cells judged.
    pub cells: usize,
}

/// Judges every cell of `pairs` pairs: calm and rough water, low and high, quiet and noisy cameras, level and tilted.
///
/// # Errors
/// [`SceneError`] where a pair becomes no patch.
pub fn honesty(pairs: usize) -> Result<Honesty, SceneError> {
    let (mut one, mut two, mut cells) = (0_usize, 0_usize, 0_usize);
    for i in 0..pairs {
        let (within_one, within_two, count) = judge(i)?;
        one += within_one;
        two += within_two;
        cells += count;
    }
    let share = |count: usize| count as f64 / cells.max(1) as f64;
    Ok(Honesty { within_one: share(one), within_two: share(two), cells })
}

fn judge(i: usize) -> Result<(usize, usize, usize), SceneError> {
    let seas = [
        SeaConfig::still(),
        SeaConfig::jonswap(0.05, 1.5, 240.0),
        SeaConfig::jonswap(0.15, 2.5, 60.0),
        SeaConfig::regular(0.04, 1.2, 10.0),
    ];
    let heights_m = [3.0, 5.0, 8.0];
    let noises = [1.0, 2.0, 4.0];
    let (sea, height_m, noise) = (&seas[i % 4], heights_m[(i / 4) % 3], noises[(i / 12) % 3]);
    let rig = RigConfig { noise_sigma_grey: noise, ..RigConfig::default() };
    let mut scene = Scene::new(&rig, sea, 0.028, 41 + i as u64)?;
    let at_m = Vector3::new(1.7 * i as f64, -0.9 * i as f64, -height_m);
    let attitude = UnitQuaternion::from_euler_angles(0.05 * (i as f64).sin(), 0.05 * (2.0 * i as f64).cos(), i as f64);
    let pose = PoseAtExposure { position_ned_m: at_m, ned_from_body: attitude, height_sigma_m: 0.0, attitude_sigma_rad: 0.0 };
    let pair = scene.pair(0.1 * i as f64, at_m, &attitude, Some(pose))?;
    let patch = measure(&mut chain(0.15, false), &pair)?;
    let grid = &patch.grid;
    let errors: Vec<(f64, f64)> = grid
        .elevation_m
        .iter()
        .zip(&grid.sigma_m)
        .enumerate()
        .filter(|(_, (elevation_m, _))| elevation_m.is_finite())
        .map(|(at, (elevation_m, sigma_m))| {
            let (row, col) = (at / grid.cols as usize, at % grid.cols as usize);
            let north_m = grid.south_west_north_m + row as f64 * grid.cell_m;
            let east_m = grid.south_west_east_m + col as f64 * grid.cell_m;
            (f64::from(*elevation_m) - scene.water.elevation_m(north_m, east_m, pair.stamp), f64::from(*sigma_m))
        })
        .collect();
    // Elevation is above the patch's own mean.
    let mean_m = errors.iter().map(|(error_m, _)| error_m).sum::<f64>() / errors.len().max(1) as f64;
    let within = |sigmas: f64| errors.iter().filter(|(error_m, sigma_m)| (error_m - mean_m).abs() <= sigmas * sigma_m).count();
    Ok((within(1.0), within(2.0), errors.len()))
}
