//! The frames of the last while over the same water.

use std::collections::VecDeque;
use std::hash::{Hash, Hasher};

use halcyon_model::{ElevationGrid, LocalPoint, Stamp, SurfacePatch};

use super::film::Raster;
use super::gauge::{GAUGES, Gauges, Reading};
use super::hidden::Bend;
use super::ripples::without_disc;
use super::smooth::Smoothed;
use crate::config::Config;

/// Never more frames than this, whatever the rate: the oldest go first.
const FRAMES_MAX: usize = 4096;

/// Mean square slope of one patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Slope {
    /// Sum of the two directions' mean squares.
    pub mean_square: f64,
    /// What the cells' errors alone would make of it.
    pub noise: f64,
}

/// What is kept of one patch.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Frame {
    pub stamp: Stamp,
    pub centre: LocalPoint,
    pub coverage: f64,
    /// The patch's shorter side, or that of a square as large as what was seen of it if that is less, metres.
    pub footprint_m: f64,
    pub readings: [Option<Reading>; GAUGES],
    /// What smoothing takes out of them.
    pub smoothing: Smoothed,
    pub slope: Option<Slope>,
    /// One standard deviation of roll and pitch, radians.
    pub attitude_sigma_rad: f64,
    /// How the patch is bent.
    pub bend: Option<Bend>,
    /// Level by the autopilot, metres, and its standard deviation where stated.
    pub level_m: Option<f64>,
    pub level_sigma_m: Option<f64>,
    /// Distance from the camera to the mean plane, metres.
    pub distance_m: f64,
    /// The grid, coarsely, for directions.
    pub raster: Raster,
    /// Whether the grid is, bit for bit, the one before: a source that repeats itself measures nothing.
    pub frozen: bool,
}

/// So many of the grids that came last are kept whole: enough to see what rotors do to the water.
const GRIDS: usize = 4;

/// Frames, oldest first.
#[derive(Debug, Clone, Default)]
pub(crate) struct Window {
    frames: VecDeque<Frame>,
    grids: VecDeque<ElevationGrid>,
    gauges: Gauges,
    fingerprint: Option<u64>,
}

impl Window {
    /// Adds a checked patch at its place in time, and drops what is older than the window or too far from the newest. Nothing is read within
    /// `rippled_m` of the patch's middle.
    pub(crate) fn add(&mut self, patch: &SurfacePatch, rippled_m: Option<f64>, config: &Config) {
        let Config { window_s, spot_radius_m, slope_baseline_m, .. } = *config;
        let grid = &patch.grid;
        let rest = rippled_m.map(|radius_m| without_disc(patch, radius_m));
        let read = rest.as_ref().unwrap_or(patch);
        let (height_m, width_m) = (f64::from(grid.rows - 1) * grid.cell_m, f64::from(grid.cols - 1) * grid.cell_m);
        let centre = LocalPoint::new(grid.south_west_north_m + 0.5 * height_m, grid.south_west_east_m + 0.5 * width_m);
        let (seen, fingerprint) = survey(grid);
        let readings = self.gauges.read(read);
        let frame = Frame {
            stamp: patch.stamp,
            centre,
            // Cells of the grid's rectangle outside a turned footprint do not count: reconstruction knows which those are. But a
            // patch cannot cover anything without a cell that was seen.
            coverage: if seen > 0.0 { patch.coverage } else { 0.0 },
            footprint_m: height_m.min(width_m).min((seen * height_m * width_m).sqrt()).max(grid.cell_m),
            smoothing: Smoothed::of(readings.iter().flatten().map(|reading| &reading.samples)),
            readings,
            bend: bend(patch, rest.as_ref()),
            attitude_sigma_rad: patch.attitude_sigma_rad,
            slope: slope(&read.grid, slope_baseline_m),
            level_m: patch.level_m,
            level_sigma_m: patch.level_sigma_m,
            distance_m: patch.plane.distance_m,
            raster: Raster::of(grid),
            frozen: fingerprint.is_some() && fingerprint == self.fingerprint,
        };
        self.fingerprint = fingerprint;
        if self.grids.len() >= GRIDS {
            self.grids.pop_front();
        }
        self.grids.push_back(grid.clone());
        let place = self.frames.partition_point(|old| old.stamp < frame.stamp);
        self.frames.insert(place, frame);
        if let Some((newest, centre)) = self.newest().map(|frame| (frame.stamp, frame.centre)) {
            // Frames are in order, and large: those that stay are not moved for those that go.
            while self.frames.front().is_some_and(|old| newest.seconds_since(old.stamp) > window_s) {
                self.frames.pop_front();
            }
            let is_near = |old: &Frame| old.centre.distance_m(&centre) <= spot_radius_m;
            if !self.frames.iter().all(is_near) {
                self.frames.retain(is_near);
            }
        }
        if self.frames.len() > FRAMES_MAX {
            self.frames.pop_front();
        }
    }

    /// Stamps of the frames next to `stamp`, before and after; one at `stamp` itself counts as after.
    pub(crate) fn neighbours(&self, stamp: Stamp) -> [Option<Stamp>; 2] {
        let place = self.frames.partition_point(|old| old.stamp < stamp);
        let at = |index: Option<usize>| index.and_then(|index| self.frames.get(index)).map(|frame| frame.stamp);
        [at(place.checked_sub(1)), at(Some(place))]
    }

    pub(crate) fn frames(&self) -> &VecDeque<Frame> {
        &self.frames
    }

    /// The grids that came last, whole.
    pub(crate) fn grids(&self) -> &VecDeque<ElevationGrid> {
        &self.grids
    }

    pub(crate) fn newest(&self) -> Option<&Frame> {
        self.frames.back()
    }

    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }

    /// The usual interval between frames, seconds: the median; `None` with fewer than two.
    pub(crate) fn interval_s(&self) -> Option<f64> {
        let mut steps: Vec<f64> =
            self.frames.iter().zip(self.frames.iter().skip(1)).map(|(a, b)| b.stamp.seconds_since(a.stamp)).collect();
        let middle = steps.len() / 2;
        (!steps.is_empty()).then(|| *steps.select_nth_unstable_by(middle, f64::total_cmp).1)
    }
}

/// How a patch is bent of which only the cells of `rest`, if given, are waves: all cells tell the curvature, which goes with the level of all (and
/// ripples bend nothing), and those of the rest how they are tilted and how high they go.
fn bend(patch: &SurfacePatch, rest: Option<&SurfacePatch>) -> Option<Bend> {
    let whole = Bend::of(patch)?;
    let Some(rest) = rest else { return Some(whole) };
    let Bend { half_laplacian_per_m, sigma_per_m, sides_m, .. } = whole;
    Some(Bend { half_laplacian_per_m, sigma_per_m, sides_m, ..Bend::of(rest)? })
}

/// Share of cells with a measurement, and a hash of them; no hash where there is none.
fn survey(grid: &ElevationGrid) -> (f64, Option<u64>) {
    let mut hasher = std::hash::DefaultHasher::new();
    let mut seen = 0_usize;
    for (elevation_m, sigma_m) in grid.elevation_m.iter().zip(&grid.sigma_m) {
        let measured = elevation_m.is_finite() && sigma_m.is_finite();
        seen += usize::from(measured);
        if measured { elevation_m.to_bits() } else { u32::MAX }.hash(&mut hasher);
    }
    (seen as f64 / grid.elevation_m.len() as f64, (seen > 0).then(|| hasher.finish()))
}

/// Mean square slope between points `baseline_m` apart, over all pairs seen: between those of the whole numbers of cells to either side of it.
/// `None` without a pair in both directions.
fn slope(grid: &ElevationGrid, baseline_m: f64) -> Option<Slope> {
    let step_max = grid.rows.min(grid.cols) as usize - 1;
    let steps = (baseline_m / grid.cell_m).clamp(1.0, step_max as f64);
    let (lower, upper) = (slope_over(grid, steps.floor() as usize)?, slope_over(grid, steps.ceil() as usize)?);
    let share = steps.fract();
    let between = |of: fn(&Slope) -> f64| of(&lower) + share * (of(&upper) - of(&lower));
    Some(Slope { mean_square: between(|s| s.mean_square), noise: between(|s| s.noise) })
}

/// So many cells from each of two on; `None` where there are not so many.
fn beside(cells: &[f32], [from, to]: [usize; 2], width: usize) -> Option<(&[f32], &[f32])> {
    Some((cells.get(from..from + width)?, cells.get(to..to + width)?))
}

/// The same between cells `step` apart.
fn slope_over(grid: &ElevationGrid, step: usize) -> Option<Slope> {
    let (rows, cols) = (grid.rows as usize, grid.cols as usize);
    let run_m = step as f64 * grid.cell_m;
    let (mut mean_square, mut noise) = (0.0, 0.0);
    for (row_step, col_step) in [(step, 0), (0, step)] {
        let (mut squares, mut variances, mut pairs) = (0.0, 0.0, 0_u32);
        let width = cols - col_step;
        for row in 0..rows - row_step {
            let (from, to) = (row * cols, (row + row_step) * cols + col_step);
            // A row, and what lies a step from it.
            let (Some((a_m, b_m)), Some((a_sigma_m, b_sigma_m))) =
                (beside(&grid.elevation_m, [from, to], width), beside(&grid.sigma_m, [from, to], width))
            else {
                continue;
            };
            let (elevations_m, sigmas_m) = (a_m.iter().zip(b_m), a_sigma_m.iter().zip(b_sigma_m));
            for ((a_m, b_m), (a_sigma_m, b_sigma_m)) in elevations_m.zip(sigmas_m) {
                let (rise_m, variance_m2) =
                    (f64::from(*b_m) - f64::from(*a_m), f64::from(*a_sigma_m).powi(2) + f64::from(*b_sigma_m).powi(2));
                // Not so where either was not seen.
                if rise_m.is_finite() && variance_m2.is_finite() {
                    squares += rise_m.powi(2);
                    variances += variance_m2;
                    pairs += 1;
                }
            }
        }
        if pairs == 0 {
            return None;
        }
        mean_square += squares / (f64::from(pairs) * run_m * run_m);
        noise += variances / (f64::from(pairs) * run_m * run_m);
    }
    Some(Slope { mean_square, noise })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(f: impl Fn(f64, f64) -> f32) -> ElevationGrid {
        let elevation_m: Vec<f32> = (0..40 * 50).map(|i| f(f64::from(i / 50) * 0.1, f64::from(i % 50) * 0.1)).collect();
        let sigma_m = vec![0.003; elevation_m.len()];
        ElevationGrid { south_west_north_m: 0.0, south_west_east_m: 0.0, cell_m: 0.1, rows: 40, cols: 50, elevation_m, sigma_m }
    }

    #[test]
    fn the_slope_of_a_plane_is_its_slope() {
        let slope = slope(&grid(|n, e| (0.03 * n + 0.04 * e) as f32), 0.4).unwrap();
        assert!((slope.mean_square.sqrt() - 0.05).abs() < 1e-5);
        // Two cells of 3 mm each over 0.4 m, in two directions.
        assert!((slope.noise - 2.0 * 2.0 * (0.003f64 / 0.4).powi(2)).abs() < 1e-8);
        assert_eq!(super::slope(&grid(|_, _| f32::NAN), 0.4), None);
    }

    /// Pair by pair, with holes in elevations and in deviations.
    #[test]
    fn only_pairs_that_were_seen_count() {
        let mut holes = grid(|n, e| (0.02 * (7.0 * n - 3.0 * e).sin()) as f32);
        holes.elevation_m.iter_mut().step_by(7).for_each(|z| *z = f32::NAN);
        holes.sigma_m.iter_mut().step_by(11).for_each(|sigma_m| *sigma_m = f32::INFINITY);
        holes.sigma_m.iter_mut().skip(3).step_by(5).for_each(|sigma_m| *sigma_m *= 2.0);
        for step in [1, 4, 39] {
            let (mut mean_square, mut noise) = (0.0, 0.0);
            for (down, across) in [(step, 0), (0, step)] {
                let places = (0..40 - down).flat_map(|row| (0..50 - across).map(move |col| (row, col)));
                let seen = |row, col| crate::core::patch::cell(&holes, row, col);
                let pairs: Vec<((f64, f64), (f64, f64))> =
                    places.filter_map(|(row, col)| seen(row, col).zip(seen(row + down, col + across))).collect();
                let over = pairs.len() as f64 * (step as f64 * 0.1).powi(2);
                mean_square += pairs.iter().map(|(a, b)| (b.0 - a.0).powi(2)).sum::<f64>() / over;
                noise += pairs.iter().map(|(a, b)| a.1.powi(2) + b.1.powi(2)).sum::<f64>() / over;
            }
            let found = slope_over(&holes, step).unwrap();
            assert!((found.mean_square / mean_square - 1.0).abs() < 1e-12 && (found.noise / noise - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn coverage_is_what_was_seen() {
        let (seen, hash) = survey(&grid(|n, _| if n < 1.95 { 0.0 } else { f32::NAN }));
        assert!((seen - 0.5).abs() < 1e-9 && hash.is_some());
        assert_eq!(survey(&grid(|_, _| f32::NAN)), (0.0, None));
    }
}
