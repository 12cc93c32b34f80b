//! What `halcyon reconstruct` can be told.

use std::path::{Path, PathBuf};

use halcyon_model::{PoseAtExposure, RigCalibration, Stamp};
use nalgebra::{UnitQuaternion, Vector3};

use super::ReconstructCliError;
use crate::core::matcher::{DisparityRange, Engine};
use crate::core::reconstruct::Settings;
use crate::files::{FileError, Output, check_outputs};

/// A cell of about so many pixels holds one independent measurement: the side of the matching window.
const CELL_PX: f64 = 10.0;
/// The full-range search covers this share of the picture's width where nobody says otherwise.
const RANGE_SHARE: f64 = 0.4;

/// What a mesh is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MeshOf {
    /// Every point of the cloud, with its grey level.
    #[default]
    Cloud,
    /// The elevation grid: smoother, and without the points' noise.
    Grid,
}

/// Flags.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReconstructOptions {
    /// `--engine`, by name.
    pub engine: String,
    /// `--cell`, metres; `None` takes what suits the distance.
    pub cell_m: Option<f64>,
    /// `--stride`, pixels between points; `None` takes every pixel of one pair, every second of a survey.
    pub stride_px: Option<u32>,
    /// `--max-disparity`, pixels; `None` takes 40 % of the width.
    pub max_disparity_px: Option<u32>,
    /// `--cloud`, PLY.
    pub cloud: Option<PathBuf>,
    /// `--mesh`, PLY.
    pub mesh: Option<PathBuf>,
    /// `--mesh-of`
    pub mesh_of: MeshOf,
    /// `--disparity`, PFM or PNG by its name.
    pub disparity: Option<PathBuf>,
    /// `--grid`, NetCDF with CF names.
    pub grid: Option<PathBuf>,
    /// `--wass`, NetCDF in the layout of WASS.
    pub wass: Option<PathBuf>,
    /// The present, for the attribute `history` of NetCDF files …
    pub now: Stamp,
    /// … and the command.
    pub command: String,
}

impl ReconstructOptions {
    /// What the chain takes.
    pub(super) fn settings(&self, rig: &RigCalibration, stride_px_default: u32) -> Result<Settings, ReconstructCliError> {
        let engine: Engine = self.engine.parse()?;
        let width_px = rig.width_px;
        let max_px = self.max_disparity_px.unwrap_or((f64::from(width_px) * RANGE_SHARE) as u32).max(1);
        let value = |name, expected, value| Err(ReconstructCliError::Value { name, expected, value });
        if self.max_disparity_px == Some(0) || max_px >= width_px.max(2) || max_px > 2000 {
            return value("--max-disparity", "at least 1 px, at most 2000 px and below the pictures' width", f64::from(max_px));
        }
        let stride_px = self.stride_px.unwrap_or(stride_px_default);
        if !(1..=64).contains(&stride_px) {
            return value("--stride", "1 to 64 px", f64::from(stride_px));
        }
        if let Some(cell_m) = self.cell_m
            && !(1e-4..=100.0).contains(&cell_m)
        {
            return value("--cell", "0.0001 to 100 m", cell_m);
        }
        let defaults = Settings::default();
        Ok(Settings {
            engine,
            block_px: engine.block_px_default(),
            range: DisparityRange { min_px: 0, max_px },
            point_stride_px: stride_px,
            cell_m: self.cell_m.unwrap_or(defaults.cell_m),
            ..defaults
        })
    }

    /// Refuses outputs that cannot be written, or that are inputs or each other, before any work is done.
    pub(super) fn check_outputs<'a>(
        &self,
        inputs: impl IntoIterator<Item = (&'static str, &'a Path)>,
    ) -> Result<(), FileError> {
        let bytes = |option, path: &Option<PathBuf>, endings| path.as_ref().map(|path| Output::file(option, path, endings));
        let library =
            |option, path: &Option<PathBuf>| path.as_ref().map(|path| Output::plain_file(option, path, &["nc", "nc4"]));
        let outputs = [
            bytes("--cloud", &self.cloud, &["ply"]),
            bytes("--mesh", &self.mesh, &["ply"]),
            bytes("--disparity", &self.disparity, &["pfm", "png"]),
            library("--grid", &self.grid),
            library("--wass", &self.wass),
        ];
        Ok(check_outputs(inputs, &outputs.into_iter().flatten().collect::<Vec<_>>())?)
    }

    /// Whether an output is made of the elevation grid; without any output the grid's figures are the result.
    pub(super) fn needs_grid(&self) -> bool {
        let needs = self.grid.is_some() || self.wass.is_some() || (self.mesh.is_some() && self.mesh_of == MeshOf::Grid);
        needs || (self.cloud.is_none() && self.mesh.is_none() && self.disparity.is_none())
    }

    /// A NetCDF file that was asked for, if any.
    pub(super) fn series_file(&self) -> Option<&Path> {
        self.grid.as_deref().or(self.wass.as_deref())
    }
}

/// A cell for water whose pixels are `pixel_m` wide: about ten of them, rounded to 1, 2 or 5 times a power of ten.
#[must_use]
pub(super) fn suitable_cell_m(pixel_m: f64) -> f64 {
    let wanted_m = (pixel_m * CELL_PX).clamp(1e-4, 100.0);
    let decade = 10_f64.powf(wanted_m.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * decade);
    let distance = |step: f64| (step / wanted_m).ln().abs();
    steps.into_iter().min_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap_or(decade)
}

/// A pose over the local origin from what a person knows: attitude in degrees, height of the body above the mean water, metres;
/// and the standard deviations of height and attitude.
///
/// # Errors
/// [`ReconstructCliError::Value`], naming the flag.
pub fn given_pose(
    attitude_deg: [f64; 3],
    height_m: f64,
    height_sigma_m: f64,
    attitude_sigma_deg: f64,
) -> Result<PoseAtExposure, ReconstructCliError> {
    let [roll_deg, pitch_deg, heading_deg] = attitude_deg;
    for (name, value, low, high, expected) in [
        ("--roll-deg", roll_deg, -180.0, 180.0, "-180 to 180°"),
        ("--pitch-deg", pitch_deg, -90.0, 90.0, "-90 to 90°"),
        ("--heading-deg", heading_deg, -360.0, 360.0, "-360 to 360°"),
        ("--height-m", height_m, 0.01, 1e4, "0.01 to 10000 m"),
        ("--height-sigma-m", height_sigma_m, 0.0, 100.0, "0 to 100 m"),
        ("--attitude-sigma-deg", attitude_sigma_deg, 0.0, 90.0, "0 to 90°"),
    ] {
        // NaN is in no range.
        if !(low..=high).contains(&value) {
            return Err(ReconstructCliError::Value { name, expected, value });
        }
    }
    let [roll, pitch, heading] = attitude_deg.map(f64::to_radians);
    Ok(PoseAtExposure {
        position_ned_m: Vector3::new(0.0, 0.0, -height_m),
        ned_from_body: UnitQuaternion::from_euler_angles(roll, pitch, heading),
        height_sigma_m,
        attitude_sigma_rad: attitude_sigma_deg.to_radians(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_round_and_about_ten_pixels() {
        for (pixel_m, cell_m) in [(0.0146, 0.2), (0.001, 0.01), (0.002, 0.02), (0.0045, 0.05), (0.0095, 0.1), (1e9, 100.0)] {
            assert!((suitable_cell_m(pixel_m) / cell_m - 1.0).abs() < 1e-9, "{pixel_m} {}", suitable_cell_m(pixel_m));
        }
    }
}
