//! The window's grids as a film: one piece of water, fixed in the local frame, at an even rate.

use halcyon_model::ElevationGrid;
use halcyon_ocean::space::{Film, Shape};

use super::patch::cell;
use super::window::Window;

/// Cells of a film are at least this large, metres: directions come from waves far longer, and memory is kept per frame.
const CELL_M: f64 = 0.2;
/// Frames and cells at most along one side of a raster; larger patches are kept more coarsely.
const SIDE_MAX: f64 = 48.0;
/// The film is as large as what so large a share of the frames has seen.
const SHARED: f64 = 0.9;

/// A patch on cells that are multiples of the cell from the local origin, so that rasters of a window lie on each other.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Raster {
    cell_m: f64,
    /// South-west cell's number, north and east.
    corner: [i64; 2],
    rows: usize,
    cols: usize,
    /// Mean of the patch's cells in each, metres; NaN where none was seen. Row 0 south.
    elevation_m: Vec<f32>,
}

impl Raster {
    /// Of a checked grid.
    pub(crate) fn of(grid: &ElevationGrid) -> Self {
        let side_m = f64::from(grid.rows.max(grid.cols)) * grid.cell_m;
        // Powers of two, so that a patch a little larger does not change the cell.
        let cell_m = CELL_M.max(grid.cell_m) * (side_m / (SIDE_MAX * CELL_M.max(grid.cell_m))).max(1.0).log2().ceil().exp2();
        let number = |place_m: f64| (place_m / cell_m).round() as i64;
        let corner = [number(grid.south_west_north_m), number(grid.south_west_east_m)];
        let last = |start_m: f64, count: u32| number(start_m + f64::from(count - 1) * grid.cell_m);
        let rows = (last(grid.south_west_north_m, grid.rows) - corner[0] + 1).max(1) as usize;
        let cols = (last(grid.south_west_east_m, grid.cols) - corner[1] + 1).max(1) as usize;
        let mut sums = vec![(0.0_f64, 0_u32); rows * cols];
        for row in 0..grid.rows as usize {
            let r = (number(grid.south_west_north_m + row as f64 * grid.cell_m) - corner[0]) as usize;
            for col in 0..grid.cols as usize {
                let Some((elevation_m, _)) = cell(grid, row, col) else { continue };
                let c = (number(grid.south_west_east_m + col as f64 * grid.cell_m) - corner[1]) as usize;
                if let Some(sum) = sums.get_mut(r * cols + c) {
                    *sum = (sum.0 + elevation_m, sum.1 + 1);
                }
            }
        }
        let mean = |(sum, count): (f64, u32)| if count == 0 { f32::NAN } else { (sum / f64::from(count)) as f32 };
        Self { cell_m, corner, rows, cols, elevation_m: sums.into_iter().map(mean).collect() }
    }

    /// Elevation of a cell by its number; `None` where nothing was seen.
    fn at(&self, north: i64, east: i64) -> Option<f32> {
        let (row, col) = (usize::try_from(north - self.corner[0]).ok()?, usize::try_from(east - self.corner[1]).ok()?);
        let inside = row < self.rows && col < self.cols;
        inside.then(|| self.elevation_m[row * self.cols + col]).filter(|z| z.is_finite())
    }
}

/// The film of a window, each frame less its mean; `None` where frames have too little water in common.
pub(crate) fn film(window: &Window, interval_s: f64) -> Option<Film> {
    let frames = window.frames();
    let newest = frames.back()?;
    let cell_m = newest.raster.cell_m;
    let rasters: Vec<(f64, &Raster)> = frames
        .iter()
        .filter(|frame| frame.raster.cell_m == cell_m)
        .map(|frame| (frame.stamp.seconds_since(newest.stamp), &frame.raster))
        .collect();
    // Edges that all but a tenth of the frames reach.
    let edge = |of: &dyn Fn(&Raster) -> i64, low: bool| -> Option<i64> {
        let mut edges: Vec<i64> = rasters.iter().map(|(_, raster)| of(raster)).collect();
        edges.sort_unstable();
        let skipped = ((1.0 - SHARED) * edges.len() as f64) as usize;
        edges.get(if low { edges.len().checked_sub(1 + skipped)? } else { skipped }).copied()
    };
    let (south, west) = (edge(&|r| r.corner[0], true)?, edge(&|r| r.corner[1], true)?);
    let north = edge(&|r| r.corner[0] + r.rows as i64 - 1, false)?;
    let east = edge(&|r| r.corner[1] + r.cols as i64 - 1, false)?;
    let (rows, cols) = (usize::try_from(north - south + 1).ok()?, usize::try_from(east - west + 1).ok()?);
    let duration_s = -rasters.first()?.0;
    // A window holds as many frames as were counted, whatever its stamps say.
    let count = ((duration_s / interval_s).round() as usize + 1).min(2 * frames.len());
    let mut elevation_m = vec![f32::NAN; count * rows * cols];
    for (age_s, raster) in &rasters {
        // Ages are negative: the newest frame is the last.
        let frame = count as f64 - 1.0 + (age_s / interval_s).round();
        if !(0.0..count as f64).contains(&frame) {
            continue;
        }
        let start = frame as usize * rows * cols;
        let cells = elevation_m[start..start + rows * cols].iter_mut();
        for (i, cell) in cells.enumerate() {
            *cell = raster.at(south + (i / cols) as i64, west + (i % cols) as i64).unwrap_or(f32::NAN);
        }
    }
    for frame in elevation_m.chunks_mut((rows * cols).max(1)) {
        let (sum, seen) = frame.iter().filter(|z| z.is_finite()).fold((0.0_f64, 0_u32), |(s, n), z| (s + f64::from(*z), n + 1));
        let mean = (sum / f64::from(seen.max(1))) as f32;
        frame.iter_mut().for_each(|z| *z -= mean);
    }
    Film::new(elevation_m, Shape { rows, cols, frames: count }, cell_m, 1.0 / interval_s).ok()
}
