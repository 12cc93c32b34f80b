//! What a patch must be before anything is read from it.

use halcyon_model::{ElevationGrid, RigId, Stamp, SurfacePatch};

/// Least time between two patches, seconds.
pub(crate) const APART_S_MIN: f64 = 0.005;

/// Why a patch was not used. The window is as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PatchError {
    /// Of another rig.
    #[error("surface patch {sequence} is of rig {rig}, not of {expected}")]
    OtherRig {
        /// Its number.
        sequence: u64,
        /// Its rig.
        rig: RigId,
        /// The rig assessed here.
        expected: RigId,
    },
    /// Older than the window is long.
    #[error("surface patch {sequence} is {behind_s:.3} s older than the newest, more than the window holds")]
    OutOfOrder {
        /// Its number.
        sequence: u64,
        /// By how much.
        behind_s: f64,
    },
    /// Closer to another than any camera takes pairs: the window would fill with seconds.
    #[error("surface patch {sequence} is only {apart_s:.6} s from another, less than {APART_S_MIN} s")]
    Crowded {
        /// Its number.
        sequence: u64,
        /// Time between the two.
        apart_s: f64,
    },
    /// Of the same instant as another.
    #[error("surface patch {sequence} came twice")]
    Duplicate {
        /// Its number.
        sequence: u64,
    },
    /// Stamped later than now.
    #[error("surface patch {sequence} is stamped {ahead_s:.3} s in the future")]
    Future {
        /// Its number.
        sequence: u64,
        /// By how much.
        ahead_s: f64,
    },
    /// Too long under way.
    #[error("surface patch {sequence} is {age_s:.1} s old, more than {age_s_max:.1} s")]
    Late {
        /// Its number.
        sequence: u64,
        /// Its age on arrival.
        age_s: f64,
        /// The limit.
        age_s_max: f64,
    },
    /// The grid is empty, ragged or too large.
    #[error("surface patch {sequence} has {rows} × {cols} cells but {elevations} elevations and {sigmas} deviations")]
    Shape {
        /// Its number.
        sequence: u64,
        /// Rows stated.
        rows: u32,
        /// Columns stated.
        cols: u32,
        /// Elevations there.
        elevations: usize,
        /// Standard deviations there.
        sigmas: usize,
    },
    /// A number that cannot be.
    #[error("surface patch {sequence} has {field} = {value}")]
    Value {
        /// Its number.
        sequence: u64,
        /// Which.
        field: &'static str,
        /// Its value.
        value: f64,
    },
}

/// More cells than this are refused.
const CELLS_MAX: usize = 4_000_000;
/// Water higher above its mean level than this is refused, metres.
const ELEVATION_M_MAX: f32 = 100.0;
/// Positions further from the origin than this are refused, metres.
const POSITION_M_MAX: f64 = 1e6;

/// Checks everything about `patch` that does not depend on what came before.
///
/// # Errors
/// [`PatchError`] for the first fault.
pub(crate) fn check(patch: &SurfacePatch, rig: &RigId, now: Stamp, skew_s_max: f64, age_s_max: f64) -> Result<(), PatchError> {
    let sequence = patch.sequence;
    if patch.rig != *rig {
        return Err(PatchError::OtherRig { sequence, rig: patch.rig.clone(), expected: rig.clone() });
    }
    let age_s = now.seconds_since(patch.stamp);
    if age_s < -skew_s_max {
        return Err(PatchError::Future { sequence, ahead_s: -age_s });
    }
    if age_s > age_s_max {
        return Err(PatchError::Late { sequence, age_s, age_s_max });
    }
    let grid = &patch.grid;
    let cells = (grid.rows as usize).saturating_mul(grid.cols as usize);
    if !(4..=CELLS_MAX).contains(&cells)
        || grid.rows < 2
        || grid.cols < 2
        || grid.elevation_m.len() != cells
        || grid.sigma_m.len() != cells
    {
        return Err(PatchError::Shape {
            sequence,
            rows: grid.rows,
            cols: grid.cols,
            elevations: grid.elevation_m.len(),
            sigmas: grid.sigma_m.len(),
        });
    }
    let value = |field, value| Err(PatchError::Value { sequence, field, value });
    if !(1e-4..=1e3).contains(&grid.cell_m) {
        return value("grid.cell_m", grid.cell_m);
    }
    for (field, position_m) in
        [("grid.south_west_north_m", grid.south_west_north_m), ("grid.south_west_east_m", grid.south_west_east_m)]
    {
        if !(-POSITION_M_MAX..=POSITION_M_MAX).contains(&position_m) {
            return value(field, position_m);
        }
    }
    // NaN says that nothing was seen; anything else that is not a height is a fault.
    if let Some(bad) = grid.elevation_m.iter().find(|z| z.abs() > ELEVATION_M_MAX) {
        return value("grid.elevation_m", f64::from(*bad));
    }
    if let Some(bad) = grid.sigma_m.iter().find(|s| **s < 0.0) {
        return value("grid.sigma_m", f64::from(*bad));
    }
    if !(0.0..=1.0).contains(&patch.coverage) {
        return value("coverage", patch.coverage);
    }
    if !(patch.plane.distance_m > 0.0 && patch.plane.distance_m < POSITION_M_MAX) {
        return value("plane.distance_m", patch.plane.distance_m);
    }
    if let Some(level_m) = patch.level_m.filter(|level_m| !(-POSITION_M_MAX..=POSITION_M_MAX).contains(level_m)) {
        return value("level_m", level_m);
    }
    if let Some(sigma_m) = patch.level_sigma_m.filter(|sigma_m| !(0.0..=POSITION_M_MAX).contains(sigma_m)) {
        return value("level_sigma_m", sigma_m);
    }
    Ok(())
}

/// Elevation and its standard deviation at a cell, metres; `None` where nothing was seen or its error is not known.
pub(crate) fn cell(grid: &ElevationGrid, row: usize, col: usize) -> Option<(f64, f64)> {
    let index = row * grid.cols as usize + col;
    let (elevation_m, sigma_m) = (*grid.elevation_m.get(index)?, *grid.sigma_m.get(index)?);
    (elevation_m.is_finite() && sigma_m.is_finite()).then_some((f64::from(elevation_m), f64::from(sigma_m)))
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use halcyon_model::Plane;

    /// A patch with this grid, whose cells share errors within `error_length_m` and whose slope is wrong by `slope_sigma`.
    pub(crate) fn patch(grid: &ElevationGrid, error_length_m: f64, slope_sigma: f64) -> SurfacePatch {
        SurfacePatch {
            stamp: Stamp::from_nanos(0),
            rig: RigId::new("r").unwrap(),
            sequence: 0,
            grid: grid.clone(),
            coverage: 1.0,
            plane: Plane { normal: nalgebra::Vector3::z(), distance_m: 5.0, rms_m: 0.01 },
            points: 1000,
            level_m: None,
            level_sigma_m: None,
            level_thesis_m: None,
            error_length_m,
            slope_removed: [0.0; 2],
            slope_sigma,
            attitude_sigma_rad: 0.003,
            processing_s: 0.0,
        }
    }
}
