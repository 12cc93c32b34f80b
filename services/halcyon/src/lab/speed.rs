//! Figure 5-17: time against resolution.

use std::time::Instant;

use halcyon_reconstruction::cli::THESIS_SIZES_PX;
use halcyon_reconstruction::core::matcher::DisparityRange;
use halcyon_reconstruction::core::reconstruct::{Reconstructor, Settings};
use halcyon_sim::rig::RigConfig;
use halcyon_sim::sea::SeaConfig;
use nalgebra::{UnitQuaternion, Vector3};

use super::context::{Lab, LabError};
use super::exhibit::Exhibit;
use crate::accuracy::{Scene, SceneError, thesis_rig};
use crate::report::Bars;

/// Its times for a pair, seconds.
const THESIS_S: [f64; 3] = [0.281, 0.512, 2.140];

pub(super) fn run(lab: &Lab) -> Result<Exhibit, LabError> {
    let mut exhibit = Exhibit::default();
    exhibit.text(
        "From a raw pair to a gridded patch with the default engine: rectify, match, refine, triangulate, fit, grid; median of several pairs \
         of simulated water at 0.99 m, on this machine, from pictures in memory. The thesis's times begin with grabbing \
         the pair.",
    );
    let mut ours_s = Vec::new();
    for ((width_px, height_px), thesis_s) in THESIS_SIZES_PX.into_iter().zip(THESIS_S) {
        let scale = f64::from(width_px) / 640.0;
        let rig = RigConfig { width_px, height_px, ..thesis_rig(0.092, scale) };
        let mut scene = Scene::new(&rig, &SeaConfig::regular(0.04, 0.8, 270.0), 0.0035 / scale, 5)?;
        // Down to half a metre from the water, at any resolution.
        let range = DisparityRange { min_px: 0, max_px: (96.0 * scale) as u32 - 1 };
        let mut chain = Reconstructor::new(Settings { cell_m: 0.04, fixed_rig: true, range, ..Settings::default() });
        let mut times_s = Vec::new();
        for i in 0..=lab.choose(10, 3) {
            let pair = scene.pair(0.3 * f64::from(i), Vector3::new(0.0, 0.0, -0.99), &UnitQuaternion::identity(), None)?;
            let start = Instant::now();
            chain.reconstruct(&pair).map_err(|source| SceneError::Reconstruct { sequence: pair.sequence, source })?;
            // The first warms caches, maps and buffers.
            times_s.extend((i > 0).then(|| start.elapsed().as_secs_f64()));
        }
        times_s.sort_by(f64::total_cmp);
        let median_s = times_s[times_s.len() / 2];
        exhibit.find(format!("pair to patch, {width_px} x {height_px}"), "ms", 1e3 * median_s, Some(1e3 * thesis_s));
        ours_s.push(median_s);
    }
    let sizes = THESIS_SIZES_PX.iter().map(|(width_px, height_px)| format!("{width_px} x {height_px}")).collect();
    let bars = Bars::new("time of a pair, s", sizes).with("ours", ours_s).with("thesis", THESIS_S.to_vec());
    exhibit.chart(bars.svg(), "Figure 5-17: processing time against resolution")?;
    Ok(exhibit)
}
