//! The elevation at a place from all cells around it: a least-squares parabola over a small disc.
//!
//! A single cell is as noisy as its few pixels. A parabola over a disc follows waves (one as long as three radii loses 7 %), and has a
//! fraction of the noise: the less, the larger the disc. Which disc loses no waves that are there is for the series to judge, which has
//! all of them.

use halcyon_model::{ElevationGrid, LocalPoint, SurfacePatch, grid_error};
use nalgebra::{Matrix6, Vector6};

use super::gauge::Sample;
use super::patch::cell;

/// Radii of the discs over the shorter side of the patch. The first keeps chop, the second all that is longer than the patch.
const RADIUS_SHARES: [f64; 2] = [0.12, 0.30];
/// Readings of one place: the cell, and each disc.
pub(crate) const SMOOTHINGS: usize = 1 + RADIUS_SHARES.len();
/// A disc of fewer cells smooths nothing.
const CELLS_MIN: usize = 13;
/// More cells than this are not looked at, along the radius: finer cells bring no more.
const RADIUS_CELLS_MAX: f64 = 9.0;
/// Cells across the largest disc.
const SPAN: usize = 2 * RADIUS_CELLS_MAX as usize + 1;

/// Smooths one grid.
pub(super) struct Smoother<'a> {
    grid: &'a ElevationGrid,
    radii_cells: [f64; RADIUS_SHARES.len()],
    /// Correlation of two cells' errors by their distance along one axis, cells.
    correlation: Vec<f64>,
    errors: CellErrors,
}

impl<'a> Smoother<'a> {
    /// For the grid of `patch`.
    pub(super) fn new(patch: &'a SurfacePatch) -> Self {
        let grid = &patch.grid;
        let shorter_cells = f64::from(grid.rows.min(grid.cols) - 1);
        let radii_cells = RADIUS_SHARES.map(|share| (share * shorter_cells).min(RADIUS_CELLS_MAX));
        let covariance = |lag: usize| grid_error::covariance(lag as f64 * grid.cell_m, grid.cell_m, patch.error_length_m);
        let own = covariance(0);
        let correlation = (0..=2 * RADIUS_CELLS_MAX as usize).map(|lag| covariance(lag) / own).collect();
        Self { grid, radii_cells, correlation, errors: CellErrors::of(patch) }
    }

    /// All readings of a place whose cells say `elevation_m ± sigma_m`.
    pub(super) fn samples(&self, place: LocalPoint, elevation_m: f64, sigma_m: f64) -> [Sample; SMOOTHINGS] {
        let row0 = (place.north_m - self.grid.south_west_north_m) / self.grid.cell_m;
        let col0 = (place.east_m - self.grid.south_west_east_m) / self.grid.cell_m;
        let tilt_m2 = self.errors.tilt_m2(row0, col0).min(sigma_m * sigma_m);
        let single = Sample { elevation_m, sigma_m, noise_m2: sigma_m * sigma_m - tilt_m2 };
        let mut samples = [single; SMOOTHINGS];
        for (i, radius_cells) in self.radii_cells.into_iter().enumerate() {
            // A hole beside the place can leave the parabola hanging: then less smoothing is better.
            if let Some((elevation_m, noise_m2)) = self.disc(row0, col0, radius_cells)
                && noise_m2 <= samples[i].noise_m2
            {
                // What attitude adds is a tilt, which smoothing keeps.
                samples[i + 1] = Sample { elevation_m, sigma_m: (noise_m2 + tilt_m2).sqrt(), noise_m2 };
            } else {
                samples[i + 1] = samples[i];
            }
        }
        samples
    }

    /// Value and the matcher's variance, m², of the parabola over one disc; `None` where too little was seen of it.
    fn disc(&self, row0: f64, col0: f64, radius_cells: f64) -> Option<(f64, f64)> {
        let reach = |at: f64, end: u32| {
            let last = f64::from(end - 1);
            ((at - radius_cells).ceil().clamp(0.0, last) as usize)..=((at + radius_cells).floor().clamp(0.0, last) as usize)
        };
        let mut cells: Vec<DiscCell> = Vec::new();
        let mut normal = Matrix6::<f64>::zeros();
        for row in reach(row0, self.grid.rows) {
            for col in reach(col0, self.grid.cols) {
                let (y, x) = (row as f64 - row0, col as f64 - col0);
                if x.hypot(y) > radius_cells {
                    continue;
                }
                let Some((elevation_m, sigma_m)) = cell(self.grid, row, col) else { continue };
                let basis = Vector6::new(1.0, x, y, x * x, x * y, y * y);
                normal += basis * basis.transpose();
                let own_m = (sigma_m * sigma_m - self.errors.tilt_m2(row as f64, col as f64)).max(0.0).sqrt();
                cells.push(DiscCell { row, col, basis, elevation_m, own_m });
            }
        }
        if cells.len() < CELLS_MIN {
            return None;
        }
        // The value at the place itself is the constant term.
        let picked = normal.cholesky()?.solve(&Vector6::x());
        let elevation_m = cells.iter().map(|cell| cell.elevation_m * picked.dot(&cell.basis)).sum();
        let noise_m2 = self.noise_m2(cells.iter().map(|cell| (cell.row, cell.col, cell.own_m * picked.dot(&cell.basis))));
        noise_m2.is_finite().then_some((elevation_m, noise_m2))
    }
}

impl Smoother<'_> {
    /// Variance of a sum of cells, each by its row, column and pull on the sum, m². The correlation of two cells is one along rows times one along
    /// columns, so that it is taken along one after the other: a tenth of the work of all pairs.
    fn noise_m2(&self, pulls: impl Iterator<Item = (usize, usize, f64)> + Clone) -> f64 {
        let least = |of: fn(&(usize, usize, f64)) -> usize| pulls.clone().map(|cell| of(&cell)).min().unwrap_or(0);
        let (first_row, first_col) = (least(|cell| cell.0), least(|cell| cell.1));
        let mut pull_m = [[0.0; SPAN]; SPAN];
        for (row, col, pull) in pulls {
            if let Some(cell) = pull_m.get_mut(row - first_row).and_then(|cells| cells.get_mut(col - first_col)) {
                *cell = pull;
            }
        }
        let along: [f64; SPAN] = std::array::from_fn(|lag| self.correlation.get(lag).copied().unwrap_or(0.0));
        let matrix: [[f64; SPAN]; SPAN] = std::array::from_fn(|a| std::array::from_fn(|b| along[a.abs_diff(b)]));
        let spread = |values: &[f64; SPAN]| -> [f64; SPAN] {
            let mut sum = [0.0; SPAN];
            for (value, row) in values.iter().zip(&matrix).filter(|(value, _)| **value != 0.0) {
                sum.iter_mut().zip(row).for_each(|(sum, share)| *sum += value * share);
            }
            sum
        };
        let across = pull_m.each_ref().map(spread);
        let mut noise_m2 = 0.0;
        for (pulls, row) in pull_m.iter().zip(&matrix) {
            let mut sum = [0.0; SPAN];
            for (values, share) in across.iter().zip(row).filter(|(_, share)| **share != 0.0) {
                sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += share * value);
            }
            noise_m2 += sum.iter().zip(pulls).map(|(sum, pull)| sum * pull).sum::<f64>();
        }
        noise_m2
    }
}

struct DiscCell {
    row: usize,
    col: usize,
    basis: Vector6<f64>,
    elevation_m: f64,
    /// One standard deviation of the matcher's part of the error, metres.
    own_m: f64,
}

/// Splits the cells' variances into the matcher's part and that of a doubtful attitude, which grows with the distance from the middle.
pub(super) struct CellErrors {
    row0: f64,
    col0: f64,
    /// Variance a cell away from the middle, m².
    tilt_m2_per_cell2: f64,
}

impl CellErrors {
    /// Of a patch.
    pub(super) fn of(patch: &SurfacePatch) -> Self {
        let grid = &patch.grid;
        let cols = grid.cols as usize;
        let seen = || grid.elevation_m.iter().enumerate().filter(|(_, elevation)| elevation.is_finite()).map(|(i, _)| i);
        let count = seen().count().max(1) as f64;
        Self {
            row0: seen().map(|i| (i / cols) as f64).sum::<f64>() / count,
            col0: seen().map(|i| (i % cols) as f64).sum::<f64>() / count,
            tilt_m2_per_cell2: (patch.slope_sigma * grid.cell_m).powi(2),
        }
    }

    /// The attitude's part at a place, m².
    pub(super) fn tilt_m2(&self, row: f64, col: f64) -> f64 {
        self.tilt_m2_per_cell2 * ((row - self.row0).powi(2) + (col - self.col0).powi(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::patch::tests::patch;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use rand_distr::StandardNormal;

    fn grid(f: impl FnMut(f64, f64) -> f64) -> ElevationGrid {
        let mut f = f;
        let (rows, cols, cell_m) = (30_u32, 40_u32, 0.15);
        let elevation_m: Vec<f32> =
            (0..rows * cols).map(|i| f(f64::from(i / cols) * cell_m, f64::from(i % cols) * cell_m) as f32).collect();
        let sigma_m = vec![0.004; elevation_m.len()];
        ElevationGrid { south_west_north_m: 0.0, south_west_east_m: 0.0, cell_m, rows, cols, elevation_m, sigma_m }
    }

    /// The reading of the smaller disc.
    fn small(grid: &ElevationGrid, error_length_m: f64, place: LocalPoint) -> Sample {
        Smoother::new(&patch(grid, error_length_m, 0.0)).samples(place, 0.0, 0.004)[1]
    }

    #[test]
    fn parabolas_and_waves_come_through() {
        let place = LocalPoint::new(2.13, 3.04);
        let bowl = grid(|n, e| 0.1 + 0.02 * n - 0.01 * e + 0.03 * n * n - 0.02 * n * e);
        let sample = small(&bowl, 0.1, place);
        let truth = 0.1 + 0.02 * 2.13 - 0.01 * 3.04 + 0.03 * 2.13 * 2.13 - 0.02 * 2.13 * 3.04;
        assert!((sample.elevation_m - truth).abs() < 1e-6);
        // A crest at the place, two metres long: four radii.
        let wave = grid(|n, e| (std::f64::consts::TAU * (0.6 * (n - 2.13) + 0.8 * (e - 3.04)) / 2.0).cos());
        let crest = small(&wave, 0.1, place).elevation_m;
        assert!(crest > 0.96 && crest < 1.01, "{crest}");
    }

    /// The stated deviation against the scatter of 400 noisy grids, cells independent.
    #[test]
    fn noise_is_what_is_stated() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        let place = LocalPoint::new(2.1, 3.0);
        let mut squares = 0.0;
        let mut stated = 0.0;
        for _ in 0..400 {
            let noisy = grid(|_, _| 0.004 * random.sample::<f64, _>(StandardNormal));
            let sample = small(&noisy, 1e-3, place);
            squares += sample.elevation_m.powi(2);
            stated = sample.sigma_m;
        }
        let seen = (squares / 400.0_f64).sqrt();
        assert!((seen / stated - 1.0).abs() < 0.12 && stated < 0.002, "{seen} {stated}");
        let shared = small(&grid(|_, _| 0.0), 0.15, place).sigma_m;
        assert!(shared > 1.2 * stated, "overlapping windows average less: {shared} {stated}");
    }

    /// A tilt of unknown size is the same for every cell of a disc.
    #[test]
    fn the_attitudes_part_is_not_smoothed_away() {
        let place = LocalPoint::new(2.1, 4.0);
        // The middle is at 2.175, 2.925: 1.078 m away; 3 mrad there are 3.23 mm of the cell's 4.
        let samples = Smoother::new(&patch(&grid(|_, _| 0.0), 1e-3, 0.003)).samples(place, 0.0, 0.004);
        assert!((samples[0].noise_m2 - (0.004_f64.powi(2) - 0.003_233_f64.powi(2))).abs() < 1e-8);
        assert!((samples[2].sigma_m.powi(2) - samples[2].noise_m2 - 0.003_233_f64.powi(2)).abs() < 1e-8);
        assert!(samples[2].noise_m2 < samples[1].noise_m2 && samples[1].noise_m2 < samples[0].noise_m2);
    }

    #[test]
    fn little_seen_is_not_smoothed() {
        let mut holes = grid(|_, _| 0.0);
        holes.elevation_m.iter_mut().enumerate().filter(|(i, _)| i % 3 != 0).for_each(|(_, z)| *z = f32::NAN);
        let samples = Smoother::new(&patch(&holes, 0.1, 0.0)).samples(LocalPoint::new(2.1, 3.0), 0.01, 0.004);
        assert_eq!(samples[1], samples[0]);
    }
}
