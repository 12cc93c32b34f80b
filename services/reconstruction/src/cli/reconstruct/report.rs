//! Results, as `--json` prints them.

use halcyon_model::{Plane, SurfacePatch};
use serde::Serialize;

use crate::cli::speed::Spent;
use crate::core::calibrate::SIGMAS_95;
use crate::core::cloud::CloudFrame;
use crate::core::disparity::Disparity;

/// One pair.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReconstructReport {
    /// The engine.
    pub engine: &'static str,
    /// `gravity` or `plane`: what elevations and clouds are aligned to.
    pub frame: &'static str,
    /// Width of the pictures, pixels.
    pub width_px: u32,
    /// Height of the pictures, pixels.
    pub height_px: u32,
    /// Share of the pixels with a disparity, 0 to 1.
    pub density: f64,
    /// Triangulated points on the water.
    pub points: u32,
    /// The mean water plane.
    pub plane: PlaneReport,
    /// The elevation grid.
    pub patch: PatchReport,
    /// Processor time of the chain, all threads, milliseconds; absent where the system does not tell.
    pub cpu_ms: Option<f64>,
    /// Time of the chain, milliseconds.
    pub wall_ms: f64,
    /// What makes the result doubtful; mostly empty.
    pub warnings: Vec<String>,
}

/// A plane, in the rectified left camera frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlaneReport {
    /// Unit normal, away from the camera.
    pub normal: [f64; 3],
    /// Distance from the left camera, metres.
    pub distance_m: f64,
    /// Root mean square distance of the points, metres.
    pub rms_m: f64,
}

impl From<&Plane> for PlaneReport {
    fn from(plane: &Plane) -> Self {
        Self { normal: plane.normal.into(), distance_m: plane.distance_m, rms_m: plane.rms_m }
    }
}

/// A grid.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PatchReport {
    /// Share of the cells in view that were measured.
    pub coverage: f64,
    /// Cell side, metres.
    pub cell_m: f64,
    /// Typical (root mean square) standard deviation of a cell's elevation, metres.
    pub sigma_m: f64,
    /// Rows of the grid.
    pub rows: u32,
    /// Columns of the grid.
    pub cols: u32,
    /// Root mean square elevation about the patch's mean, metres.
    pub elevation_rms_m: f64,
    /// Mean level above the datum by the height that was given, metres; absent without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level_m: Option<f64>,
    /// Its 95 % interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level_m_low: Option<f64>,
    /// Its 95 % interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level_m_high: Option<f64>,
}

impl From<&SurfacePatch> for PatchReport {
    fn from(patch: &SurfacePatch) -> Self {
        let grid = &patch.grid;
        let rms = |values: &[f32]| {
            let finite = values.iter().filter(|value| value.is_finite());
            let (sum, count) = finite.fold((0.0, 0_u32), |(sum, n), value| (sum + f64::from(*value).powi(2), n + 1));
            (sum / f64::from(count.max(1))).sqrt()
        };
        let mut report = Self {
            coverage: patch.coverage,
            cell_m: grid.cell_m,
            sigma_m: rms(&grid.sigma_m),
            rows: grid.rows,
            cols: grid.cols,
            elevation_rms_m: rms(&grid.elevation_m),
            level_m: None,
            level_m_low: None,
            level_m_high: None,
        };
        report.set_level(patch.level_m.zip(patch.level_sigma_m));
        report
    }
}

impl PatchReport {
    /// Level and its standard deviation.
    pub(super) fn set_level(&mut self, level: Option<(f64, f64)>) {
        self.level_m = level.map(|(level_m, _)| level_m);
        self.level_m_low = level.map(|(level_m, sigma_m)| level_m - SIGMAS_95 * sigma_m);
        self.level_m_high = level.map(|(level_m, sigma_m)| level_m + SIGMAS_95 * sigma_m);
    }
}

impl ReconstructReport {
    pub(super) fn new(
        engine: &'static str,
        frame: CloudFrame,
        patch: &SurfacePatch,
        disparity: &Disparity,
        timing: Spent,
        warnings: Vec<String>,
    ) -> Self {
        Self {
            engine,
            frame: frame.name(),
            width_px: disparity.width_px,
            height_px: disparity.height_px,
            density: disparity.density(),
            points: patch.points,
            plane: (&patch.plane).into(),
            patch: patch.into(),
            cpu_ms: timing.cpu_ms,
            wall_ms: timing.wall_ms,
            warnings,
        }
    }
}
