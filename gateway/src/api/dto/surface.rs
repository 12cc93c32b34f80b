//! What a rig shows: the surface grid, preview pictures, elevation series.

use halcyon_model as model;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Edge, Point, rfc3339};

/// The newest measured patch of water: a regular grid, rows to the north, columns to the east, row-major.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Surface {
    /// The rig.
    pub rig: String,
    /// Mid-exposure.
    pub stamp: String,
    /// Seconds since then when this was sent.
    pub age_s: f64,
    /// The rig has been silent for longer than allowed.
    pub stale: bool,
    /// Counts pairs of this rig.
    pub sequence: u64,
    /// Centre of the first cell.
    pub south_west: Point,
    /// Cell side, metres.
    pub cell_m: f64,
    /// Rows, northwards.
    pub rows: u32,
    /// Columns, eastwards.
    pub cols: u32,
    /// Elevation above the patch's own mean level, metres, `rows × cols`; `null` where nothing was seen.
    pub elevation_m: Vec<Option<f32>>,
    /// One standard deviation of each elevation, metres; `null` where nothing was seen.
    pub sigma_m: Vec<Option<f32>>,
    /// Share of the cells with a measurement, 0 to 1.
    pub coverage: f64,
    /// Distance of the mean water plane from the camera, metres.
    pub plane_distance_m: f64,
    /// Root mean square distance of the points from that plane, metres.
    pub plane_rms_m: f64,
    /// Triangulated points.
    pub points: u32,
    /// Mean water level above the fleet's datum by the autopilot's height, metres.
    #[schema(required = true)]
    pub level_m: Option<f64>,
    /// One standard deviation of it, metres.
    #[schema(required = true)]
    pub level_sigma_m: Option<f64>,
    /// Time that reconstruction spent, seconds.
    pub processing_s: f64,
}

impl Surface {
    /// From the model; `stale` is the store's judgement.
    #[must_use]
    pub fn new(patch: &model::SurfacePatch, stale: bool, edge: &Edge) -> Self {
        let cells = |values: &[f32]| values.iter().map(|value| value.is_finite().then_some(*value)).collect();
        let grid = &patch.grid;
        Self {
            rig: patch.rig.to_string(),
            stamp: rfc3339(patch.stamp),
            age_s: edge.age_s(patch.stamp),
            stale,
            sequence: patch.sequence,
            south_west: edge.point(model::LocalPoint::new(grid.south_west_north_m, grid.south_west_east_m)),
            cell_m: grid.cell_m,
            rows: grid.rows,
            cols: grid.cols,
            elevation_m: cells(&grid.elevation_m),
            sigma_m: cells(&grid.sigma_m),
            coverage: patch.coverage,
            plane_distance_m: patch.plane.distance_m,
            plane_rms_m: patch.plane.rms_m,
            points: patch.points,
            level_m: patch.level_m,
            level_sigma_m: patch.level_sigma_m,
            processing_s: patch.processing_s,
        }
    }
}

/// Where to get the newest pictures of a rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Preview {
    /// The rig.
    pub rig: String,
    /// Mid-exposure.
    pub stamp: String,
    /// Seconds since then when this was sent.
    pub age_s: f64,
    /// Path of the rectified left picture, JPEG.
    pub left: String,
    /// Path of the disparity in colour, PNG.
    pub disparity: String,
}

/// One sample of a rig's elevation series.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SeriesSample {
    /// Seconds relative to the series' `stamp`; negative lies before it.
    pub t_s: f64,
    /// Elevation at the patch centre, metres, positive up.
    pub elevation_m: f64,
}

/// The significant height at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct WaveHeightSample {
    /// Seconds relative to the series' `stamp`; negative lies before it.
    pub t_s: f64,
    /// Significant wave height, metres.
    pub value: f64,
    /// Lower 95 % bound, metres.
    pub low: f64,
    /// Upper 95 % bound, metres.
    pub high: f64,
}

/// What a rig measured over the last minutes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Series {
    /// The rig.
    pub rig: String,
    /// The newest sea state, to which `t_s` is relative.
    pub stamp: String,
    /// Seconds since then when this was sent.
    pub age_s: f64,
    /// Elevation at the patch centre, oldest first.
    pub elevation: Vec<SeriesSample>,
    /// Significant wave height, oldest first.
    pub h_s: Vec<WaveHeightSample>,
}
