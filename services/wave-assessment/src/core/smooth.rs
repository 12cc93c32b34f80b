//! The elevation at a place from all cells around it: a least-squares parabola over a small disc.
//!
//! A single cell is as noisy as its few pixels. A parabola over a disc follows waves (one as long as three radii loses 7 %), and has a
//! fraction of the noise: the less, the larger the disc. Which disc loses no waves that are there is for the series to judge, which has
//! all of them.

use halcyon_model::{ElevationGrid, LocalPoint, SurfacePatch};
use nalgebra::Vector6;

use super::correlation::{Correlation, SPAN};
use super::gauge::Sample;
use super::moments::{Moments, powers};
use super::patch::cell;

/// Radii of the discs over the shorter side of the patch. The first keeps chop, the second all that is longer than the patch.
const RADIUS_SHARES: [f64; 2] = [0.12, 0.30];
/// Readings of one place: the cell, and each disc.
pub(crate) const SMOOTHINGS: usize = 1 + RADIUS_SHARES.len();
/// More cells than this are not looked at, along the radius: finer cells bring no more.
const RADIUS_CELLS_MAX: f64 = (SPAN / 2) as f64;
/// A disc of fewer cells smooths nothing.
const CELLS_MIN: usize = 13;
/// What smoothing takes out of one frame's readings: kept with the frame, so that a window only adds them up.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Smoothed {
    /// How many readings.
    pub readings: f64,
    /// By each disc.
    pub taken: [Taken; RADIUS_SHARES.len()],
}

/// Sums over readings of what one disc takes out.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Taken {
    /// Of the squares, m².
    pub square_m2: f64,
    /// What the matcher's noise explains of them, m².
    pub explained_m2: f64,
}

impl Smoothed {
    /// Of a frame's readings.
    pub(super) fn of<'a>(readings: impl Iterator<Item = &'a [Sample; SMOOTHINGS]>) -> Self {
        let mut all = Self::default();
        for samples in readings {
            all.readings += 1.0;
            for (taken, sample) in all.taken.iter_mut().zip(&samples[1..]) {
                taken.square_m2 += (samples[0].elevation_m - sample.elevation_m).powi(2);
                taken.explained_m2 += samples[0].noise_m2 - sample.noise_m2;
            }
        }
        all
    }
}

/// Smooths one grid.
pub(super) struct Smoother<'a> {
    grid: &'a ElevationGrid,
    radii_cells: [f64; RADIUS_SHARES.len()],
    /// Correlation of the errors of two cells along one axis, by their places.
    correlation: &'a Correlation,
    errors: CellErrors,
}

impl<'a> Smoother<'a> {
    /// For the grid of `patch`, whose errors have this `correlation`.
    pub(super) fn new(patch: &'a SurfacePatch, correlation: &'a Correlation) -> Self {
        let grid = &patch.grid;
        let shorter_cells = f64::from(grid.rows.min(grid.cols) - 1);
        let radii_cells = RADIUS_SHARES.map(|share| (share * shorter_cells).min(RADIUS_CELLS_MAX));
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
        let (rows, cols) = (reach(row0, self.grid.rows), reach(col0, self.grid.cols));
        let (first_row, first_col) = (*rows.start(), *cols.start());
        let mut cells: Vec<DiscCell> = Vec::with_capacity(SPAN * SPAN);
        let mut moments = Moments::default();
        for row in rows {
            let y = row as f64 - row0;
            let mut row_sums = [0.0; 5];
            for col in cols.clone() {
                let x = col as f64 - col0;
                if x * x + y * y > radius_cells * radius_cells {
                    continue;
                }
                let Some((elevation_m, sigma_m)) = cell(self.grid, row, col) else { continue };
                row_sums.iter_mut().zip(powers(x)).for_each(|(sum, power)| *sum += power);
                let own_m = (sigma_m * sigma_m - self.errors.tilt_m2(row as f64, col as f64)).max(0.0).sqrt();
                cells.push(DiscCell { place: [row - first_row, col - first_col], x, y, elevation_m, own_m });
            }
            moments.add(&row_sums, y);
        }
        if cells.len() < CELLS_MIN {
            return None;
        }
        // The value at the place itself is the constant term.
        let picked = moments.normal().cholesky()?.solve(&Vector6::x());
        let mut elevation_m = 0.0;
        let mut pull_m = [[0.0; SPAN]; SPAN];
        for cell in &cells {
            let DiscCell { x, y, .. } = *cell;
            let pull = picked[0] + picked[1] * x + picked[2] * y + picked[3] * x * x + picked[4] * x * y + picked[5] * y * y;
            elevation_m += cell.elevation_m * pull;
            if let Some(place) = pull_m.get_mut(cell.place[0]).and_then(|row| row.get_mut(cell.place[1])) {
                *place = cell.own_m * pull;
            }
        }
        let noise_m2 = self.correlation.variance(&pull_m);
        noise_m2.is_finite().then_some((elevation_m, noise_m2))
    }
}

struct DiscCell {
    /// Row and column from the disc's first.
    place: [usize; 2],
    /// East and north of the disc's middle, cells.
    x: f64,
    y: f64,
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
        let (mut rows, mut columns, mut count) = (0_u64, 0_u64, 0_u64);
        for (row, cells) in grid.elevation_m.chunks(cols).enumerate() {
            for (col, _) in cells.iter().enumerate().filter(|(_, elevation)| elevation.is_finite()) {
                (rows, columns, count) = (rows + row as u64, columns + col as u64, count + 1);
            }
        }
        let mean = |sum: u64| sum as f64 / count.max(1) as f64;
        Self { row0: mean(rows), col0: mean(columns), tilt_m2_per_cell2: (patch.slope_sigma * grid.cell_m).powi(2) }
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

    fn all(patch: &SurfacePatch, place: LocalPoint, elevation_m: f64) -> [Sample; SMOOTHINGS] {
        let correlation = Correlation::new(patch.grid.cell_m, patch.error_length_m);
        assert!(correlation.is_of(patch));
        Smoother::new(patch, &correlation).samples(place, elevation_m, 0.004)
    }

    /// The reading of the smaller disc.
    fn small(grid: &ElevationGrid, error_length_m: f64, place: LocalPoint) -> Sample {
        all(&patch(grid, error_length_m, 0.0), place, 0.0)[1]
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
        let samples = all(&patch(&grid(|_, _| 0.0), 1e-3, 0.003), place, 0.0);
        assert!((samples[0].noise_m2 - (0.004_f64.powi(2) - 0.003_233_f64.powi(2))).abs() < 1e-8);
        assert!((samples[2].sigma_m.powi(2) - samples[2].noise_m2 - 0.003_233_f64.powi(2)).abs() < 1e-8);
        assert!(samples[2].noise_m2 < samples[1].noise_m2 && samples[1].noise_m2 < samples[0].noise_m2);
    }

    #[test]
    fn little_seen_is_not_smoothed() {
        let mut holes = grid(|_, _| 0.0);
        holes.elevation_m.iter_mut().enumerate().filter(|(i, _)| i % 3 != 0).for_each(|(_, z)| *z = f32::NAN);
        let samples = all(&patch(&holes, 0.1, 0.0), LocalPoint::new(2.1, 3.0), 0.01);
        assert_eq!(samples[1], samples[0]);
    }
}
