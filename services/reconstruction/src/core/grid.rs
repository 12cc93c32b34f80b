//! From scattered points to a regular elevation grid: a robust, weighted mean for each cell, with its standard deviation.

use halcyon_model::ElevationGrid;
use rayon::prelude::*;

/// More cells than any patch needs; a view of the horizon would ask for millions.
const CELLS_MAX: usize = 1 << 18;
/// Within a cell, points further from the median than this many robust standard deviations are left out.
const OUTLIER_SIGMAS: f32 = 3.5;
/// A cell seen less than this share of its area is not filled: its mean would belong to another place.
const FILLED_MIN: f64 = 0.3;

/// Points that are worth another thread.
const POINTS_A_TASK: usize = 1 << 15;
/// South, north, west and east of no point.
const NOWHERE: [f64; 4] = [f64::INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::NEG_INFINITY];

/// A point of the water surface in the local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// North, metres.
    pub north_m: f64,
    /// East, metres.
    pub east_m: f64,
    /// Up, metres.
    pub up_m: f32,
    /// One standard deviation of `up_m`, metres.
    pub sigma_m: f32,
}

/// How densely the points sample the water.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampling {
    /// Distance between neighbouring points on the water, metres.
    pub spacing_m: f64,
    /// Points closer than this on the water, metres, share most of their error: the matching window's side.
    pub window_m: f64,
}

/// Why there is no grid.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum GridError {
    /// More cells than fit.
    #[error("the points span {north_m:.0} x {east_m:.0} m, too much for cells of {cell_m} m")]
    TooLarge {
        /// From south to north.
        north_m: f64,
        /// From west to east.
        east_m: f64,
        /// Cell side.
        cell_m: f64,
    },
    /// Not one cell was seen well enough.
    #[error("no cell of the grid has enough points")]
    Empty,
}

/// Makes grids; keeps its buffers between calls.
#[derive(Debug, Default)]
pub struct Gridder {
    first_of_cell: Vec<u32>,
    cell_of_point: Vec<u32>,
    by_cell: Vec<(f32, f32)>,
}

impl Gridder {
    /// Grids `points` into cells of `cell_m`. Cells are aligned to whole multiples of `cell_m` from the frame's origin, so that
    /// the same water falls into the same cell from patch to patch. Elevations are as given: see [`remove_mean`].
    ///
    /// # Errors
    /// [`GridError`] where the points span too much or no cell is filled.
    pub fn grid(&mut self, points: &[SurfacePoint], cell_m: f64, sampling: Sampling) -> Result<ElevationGrid, GridError> {
        // Comparisons, which NaN fails: half the work of `min` and `max`.
        let (lower, upper) = (|a: f64, b: f64| if b < a { b } else { a }, |a: f64, b: f64| if b > a { b } else { a });
        let wider = |a: [f64; 4], b: [f64; 4]| [lower(a[0], b[0]), upper(a[1], b[1]), lower(a[2], b[2]), upper(a[3], b[3])];
        let extent = |points: &[SurfacePoint]| {
            let around = |point: &SurfacePoint| [point.north_m, point.north_m, point.east_m, point.east_m];
            points.iter().fold(NOWHERE, |all, point| wider(all, around(point)))
        };
        let [south, north, west, east] = points.par_chunks(POINTS_A_TASK).map(extent).reduce(|| NOWHERE, wider);
        if points.is_empty() {
            return Err(GridError::Empty);
        }
        let per_m = cell_m.recip();
        let (first_row, first_col) = ((south * per_m).floor(), (west * per_m).floor());
        let (rows, cols) = ((north * per_m).floor() - first_row + 1.0, (east * per_m).floor() - first_col + 1.0);
        // NaN is in no range, so that it is refused, too.
        if !(1.0..=CELLS_MAX as f64).contains(&(rows * cols)) {
            return Err(GridError::TooLarge { north_m: north - south, east_m: east - west, cell_m });
        }
        let (rows, cols) = (rows as usize, cols as usize);
        let cell_of = |point: &SurfacePoint| {
            // Nothing is negative here, so that cutting off is rounding down.
            let row = (point.north_m * per_m - first_row) as usize;
            let col = (point.east_m * per_m - first_col) as usize;
            row.min(rows - 1) * cols + col.min(cols - 1)
        };
        self.sort_by_cell(points, rows * cols, cell_of);

        let mut elevation_m = vec![f32::NAN; rows * cols];
        let mut sigma_m = vec![f32::NAN; rows * cols];
        let nominal = (cell_m / sampling.spacing_m).powi(2);
        let needed = ((nominal * FILLED_MIN) as usize).max(3);
        let (first_of_cell, by_cell) = (&self.first_of_cell, &self.by_cell);
        let row_of_cells = |scratch: &mut Vec<i32>, (row, (elevation_m, sigma_m)): (usize, (&mut [f32], &mut [f32]))| {
            let mut filled = 0_usize;
            for (col, (elevation_m, sigma_m)) in elevation_m.iter_mut().zip(sigma_m).enumerate() {
                let cell = row * cols + col;
                let within = first_of_cell[cell] as usize..first_of_cell[cell + 1] as usize;
                if within.len() < needed {
                    continue;
                }
                let side_m = (within.len() as f64).sqrt() * sampling.spacing_m;
                let independent = correlation(side_m, sampling.window_m) as f32;
                let (mean, sigma) = robust_mean(&by_cell[within], scratch);
                (*elevation_m, *sigma_m) = (mean, sigma * independent);
                filled += 1;
            }
            filled
        };
        let rows_of_cells = elevation_m.par_chunks_mut(cols).zip(sigma_m.par_chunks_mut(cols)).enumerate();
        let filled: usize = rows_of_cells.map_init(Vec::new, row_of_cells).sum();
        if filled == 0 {
            return Err(GridError::Empty);
        }
        Ok(ElevationGrid {
            south_west_north_m: (first_row + 0.5) * cell_m,
            south_west_east_m: (first_col + 0.5) * cell_m,
            cell_m,
            rows: rows as u32,
            cols: cols as u32,
            elevation_m,
            sigma_m,
        })
    }

    /// A counting sort: points of one cell become neighbours in `by_cell`.
    fn sort_by_cell(&mut self, points: &[SurfacePoint], cells: usize, cell_of: impl Fn(&SurfacePoint) -> usize + Sync) {
        self.first_of_cell.clear();
        self.first_of_cell.resize(cells + 1, 0);
        let cells_of_points = points.par_iter().with_min_len(POINTS_A_TASK).map(|point| cell_of(point) as u32);
        cells_of_points.collect_into_vec(&mut self.cell_of_point);
        for cell in &self.cell_of_point {
            self.first_of_cell[*cell as usize] += 1;
        }
        // Counts become the end of each cell; filling from the back turns ends into starts.
        let mut end = 0;
        for count in &mut self.first_of_cell {
            end += *count;
            *count = end;
        }
        self.by_cell.clear();
        self.by_cell.resize(points.len(), (0.0, 0.0));
        for (point, cell) in points.iter().zip(&self.cell_of_point).rev() {
            let at = &mut self.first_of_cell[*cell as usize];
            *at -= 1;
            self.by_cell[*at as usize] = (point.up_m, point.sigma_m);
        }
    }
}

/// Mean of (value, sigma) pairs, weighted by 1/sigma², without what stands out from the median; and the typical sigma of one
/// value that went in (the root of the weighted mean square).
fn robust_mean(values: &[(f32, f32)], scratch: &mut Vec<i32>) -> (f32, f32) {
    scratch.clear();
    scratch.extend(values.iter().map(|(value, _)| key(*value)));
    let median = median(scratch);
    scratch.clear();
    scratch.extend(values.iter().map(|(value, _)| key((*value - median).abs())));
    let deviation = self::median(scratch) / 0.6745;
    let (mut weights, mut sum, mut variances) = (0.0_f64, 0.0_f64, 0.0_f64);
    for (value, sigma) in values {
        // A point is never left out for less than its own uncertainty.
        if (value - median).abs() <= OUTLIER_SIGMAS * deviation.max(*sigma) {
            let variance = f64::from(*sigma) * f64::from(*sigma);
            let weight = 1.0 / variance.max(1e-12);
            weights += weight;
            sum += weight * f64::from(value - median);
            variances += weight * variance;
        }
    }
    ((f64::from(median) + sum / weights) as f32, (variances / weights).sqrt() as f32)
}

/// Integers that sort as the numbers do (those of negative ones run backwards), but faster. It is its own inverse.
fn key(value: f32) -> i32 {
    turn(value.to_bits() as i32)
}

fn turn(bits: i32) -> i32 {
    bits ^ ((bits >> 31) & i32::MAX)
}

/// The number in the middle.
fn median(keys: &mut [i32]) -> f32 {
    let middle = keys.len() / 2;
    f32::from_bits(turn(*keys.select_nth_unstable(middle).1) as u32)
}

/// How much smaller the standard deviation of a cell's mean is than that of one point, when each point is itself a mean over a
/// window: along one axis the mean over `side` of a triangular correlation of half-width `window`; the same along the other.
fn correlation(side: f64, window: f64) -> f64 {
    // Variance ratio along one axis; two axes multiply it, the root undoes the square.
    if side >= window { window / side * (1.0 - window / (3.0 * side)) } else { 1.0 - side / (3.0 * window) }
}

/// Makes the mean of the filled cells zero and returns what it was, metres.
pub fn remove_mean(grid: &mut ElevationGrid) -> f64 {
    let (sum, count) = grid
        .elevation_m
        .iter()
        .filter(|elevation| elevation.is_finite())
        .fold((0.0, 0_usize), |(sum, count), elevation| (sum + f64::from(*elevation), count + 1));
    let mean = sum / count.max(1) as f64;
    for elevation in &mut grid.elevation_m {
        *elevation = (f64::from(*elevation) - mean) as f32;
    }
    mean
}

#[cfg(test)]
mod tests {
    use super::*;

    const SAMPLING: Sampling = Sampling { spacing_m: 0.05, window_m: 0.05 };

    fn plane(up_m: impl Fn(f64, f64) -> f64) -> Vec<SurfacePoint> {
        let mut points = Vec::new();
        for i in 0..40 {
            for j in 0..20 {
                let (north_m, east_m) = (-1.0 + 0.05 * (f64::from(i) + 0.5), 3.0 + 0.05 * (f64::from(j) + 0.5));
                points.push(SurfacePoint { north_m, east_m, up_m: up_m(north_m, east_m) as f32, sigma_m: 0.01 });
            }
        }
        points
    }

    #[test]
    fn rows_go_north_and_columns_east() {
        let grid = Gridder::default().grid(&plane(|north, east| 0.1 * north + 0.01 * east), 0.2, SAMPLING).unwrap();
        assert_eq!((grid.rows, grid.cols), (10, 5));
        for row in 0..10 {
            for col in 0..5 {
                let north_m = grid.south_west_north_m + f64::from(row) * 0.2;
                let east_m = grid.south_west_east_m + f64::from(col) * 0.2;
                let up_m = grid.elevation_m[(row * 5 + col) as usize];
                assert!((f64::from(up_m) - (0.1 * north_m + 0.01 * east_m)).abs() < 1e-6);
            }
        }
        assert!((grid.south_west_north_m + 0.9).abs() < 1e-9 && (grid.south_west_east_m - 3.1).abs() < 1e-9);
    }

    #[test]
    fn keys_sort_as_numbers_do() {
        let numbers = [f32::NEG_INFINITY, -3.5, -1e-30, -0.0, 0.0, 1e-30, 2.0, 1e9, f32::INFINITY, f32::NAN];
        assert!(numbers.windows(2).all(|pair| key(pair[0]) < key(pair[1])));
        for start in 0..numbers.len() {
            let mut keys: Vec<i32> = numbers[start..].iter().rev().map(|number| key(*number)).collect();
            assert_eq!(median(&mut keys).to_bits(), numbers[start + (numbers.len() - start) / 2].to_bits());
        }
    }

    #[test]
    fn spikes_do_not_reach_the_mean() {
        let mut points = plane(|_, _| 1.0);
        for point in points.iter_mut().step_by(7) {
            point.up_m = 5.0;
        }
        let grid = Gridder::default().grid(&points, 0.2, SAMPLING).unwrap();
        assert!(grid.elevation_m.iter().all(|up| (up - 1.0).abs() < 1e-6));
    }

    /// Against a direct numerical double integral of the triangular correlation.
    #[test]
    fn correlated_points_average_less() {
        for (side, window) in [(0.2, 0.05), (0.1, 0.1), (0.03, 0.1)] {
            let steps = 400;
            let at = |i: i32| side * (f64::from(i) + 0.5) / f64::from(steps);
            let mut sum = 0.0;
            for i in 0..steps {
                for j in 0..steps {
                    sum += (1.0 - (at(i) - at(j)).abs() / window).max(0.0);
                }
            }
            let along_one_axis = sum / f64::from(steps * steps);
            assert!((correlation(side, window) - along_one_axis).abs() < 1e-3, "{side} {window}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        let far = [
            SurfacePoint { north_m: 1e9, east_m: 0.0, up_m: 0.0, sigma_m: 0.1 },
            SurfacePoint { north_m: 0.0, east_m: 0.0, up_m: 0.0, sigma_m: 0.1 },
        ];
        assert!(matches!(Gridder::default().grid(&far, 0.1, SAMPLING), Err(GridError::TooLarge { .. })));
        assert_eq!(Gridder::default().grid(&[], 0.1, SAMPLING), Err(GridError::Empty));
    }
}
