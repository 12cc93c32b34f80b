//! What `halcyon rig` promises against what the chain measures on still water that is known exactly.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests fail by panicking and print what they measured")]

mod support;

use halcyon_reconstruction::core::reconstruct::{Reconstructor, Settings};
use halcyon_reconstruction::core::rig_budget::RigGeometry;
use support::scene::{default_rig, pose, render};

/// Root mean square.
fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0.0), |(sum, count), value| (sum + value * value, count + 1.0));
    f64::sqrt(sum / count)
}

/// Elevation noise per point and per cell within 25 % of what the chain measures. The disparity's own noise is taken from the
/// same pair, against the true disparity f b / h: it is a matter of texture and camera, not of geometry.
#[test]
fn elevation_noise_is_as_predicted() {
    let calibration = default_rig();
    for (altitude_m, cell_m, noise) in [(2.5, 0.1, 4.0), (5.0, 0.15, 4.0), (5.0, 0.4, 4.0), (8.0, 0.25, 2.0)] {
        let pair = render(&calibration, &pose(0.0, 0.0, altitude_m, [0.0; 3]), &|_, _| 0.0, noise, 3);
        let mut chain = Reconstructor::new(Settings { cell_m, ..Settings::default() });
        let patch = chain.reconstruct(&pair).unwrap();
        let rig = *chain.rectified_rig().unwrap();
        let truth_px = rig.focal_px * rig.baseline_m / altitude_m;
        let disparity_sigma_px = rms(chain.matches().iter().map(|m| f64::from(m.disparity_px) - truth_px));
        let geometry = RigGeometry {
            width_px: rig.width_px,
            height_px: rig.height_px,
            focal_px: rig.focal_px,
            baseline_m: rig.baseline_m,
            window_px: f64::from(Settings::default().refine_window_px),
            disparity_sigma_px,
            cell_m: Some(cell_m),
            disparity_max_px: None,
        };
        let budget = geometry.at(altitude_m);
        let points_m = rms(chain.matches().iter().map(|m| rig.depth_m(f64::from(m.disparity_px)) - altitude_m));
        let cells_m = rms(patch.grid.elevation_m.iter().filter(|e| e.is_finite()).map(|e| f64::from(*e)));
        let still_h_m0_m = 4.0 * cells_m;
        println!(
            "{altitude_m} m, cells of {cell_m} m: disparity {disparity_sigma_px:.4} px; point {:.2} mm, predicted {:.2}; \
             cell {:.2} mm, predicted {:.2}; coverage {:.3}",
            points_m * 1e3,
            budget.point_sigma_m * 1e3,
            cells_m * 1e3,
            budget.cell_sigma_m * 1e3,
            patch.coverage
        );
        assert!((points_m / budget.point_sigma_m - 1.0).abs() < 0.25);
        assert!((cells_m / budget.cell_sigma_m - 1.0).abs() < 0.25);
        assert!((still_h_m0_m / budget.still_height_m - 1.0).abs() < 0.25);
        assert!((truth_px - budget.disparity_px).abs() < 1e-9);
        // The patch spans what is said to be shared, to a cell and a window on either side.
        let spans = [patch.grid.cols, patch.grid.rows].map(|cells| f64::from(cells) * cell_m);
        for (span_m, shared_m) in spans.into_iter().zip(budget.shared_m) {
            let margin_m = 2.0 * cell_m + 12.0 * budget.pixel_m;
            assert!((span_m - shared_m).abs() < margin_m, "{span_m} {shared_m}");
        }
    }
}
