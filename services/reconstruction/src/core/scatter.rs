//! How far cells scatter against what their pixels promised.
//!
//! The standard deviation of a cell's mean comes from the fit of each window and from how windows overlap. Both are models: real
//! windows are weighted by their texture, resampling colours the noise, and a camera does more to a picture than add white
//! noise. So the promise is held against the grid itself. The mixed second difference over 3 × 3 cells,
//!
//! ```text
//!   1 −2  1
//!  −2  4 −2      (Immerkær 1996)
//!   1 −2  1
//! ```
//!
//! is blind to planes, to anything curved along one axis, and nearly to waves of more than six cells in any direction; noise it
//! passes. Where windows span several cells it is taken over cells a window apart, since how neighbours share their errors is
//! the weakest part of the model. Its mean square over what was promised is the factor by which to widen. Ripples that cells
//! cannot resolve count as noise: to a cell, they are.

use halcyon_model::ElevationGrid;
use halcyon_model::grid_error::covariance;

/// The factor (of variance) before anything is seen …
const PRIOR: f64 = 1.7;
/// … is worth so many differences, and what was learnt at most so many: a few pairs' worth, since cameras and light change.
const PRIOR_WEIGHT: f64 = 60.0;
const MEMORY: f64 = 4000.0;
/// A single difference larger than this many promised deviations is a hole's edge or a gull, not noise.
const SIGMAS_MAX: f64 = 12.0;
/// Windows of more cells than this are not spanned: the grid would end.
const STEP_MAX: usize = 4;
/// Promises are never narrowed below half, nor widened beyond sixteen times.
const FACTOR_MIN: f64 = 0.25;
const FACTOR_MAX: f64 = 256.0;

/// Learns the factor from patch to patch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scatter {
    factor: f64,
    weight: f64,
}

impl Default for Scatter {
    fn default() -> Self {
        Self { factor: PRIOR, weight: PRIOR_WEIGHT }
    }
}

impl Scatter {
    /// Learns from `grid`, whose `sigma_m` are promises, and widens (or narrows) them. Points closer than `window_m` share
    /// their errors.
    pub(super) fn apply(&mut self, grid: &mut ElevationGrid, window_m: f64) {
        let (cols, rows) = (grid.cols as usize, grid.rows as usize);
        let step = ((window_m / grid.cell_m).round() as usize).clamp(1, STEP_MAX);
        let passes = noise_gain(step as f64 * grid.cell_m, grid.cell_m, window_m).powi(2);
        let (mut sum, mut count) = (0.0, 0_usize);
        for row in step..rows.saturating_sub(step) {
            for col in step..cols.saturating_sub(step) {
                if let Some((difference_m, variance_m2)) = difference(grid, (row, col), step) {
                    let squared = difference_m * difference_m / (variance_m2 * passes);
                    if squared <= SIGMAS_MAX * SIGMAS_MAX {
                        sum += squared;
                        count += 1;
                    }
                }
            }
        }
        if count > 0 && sum.is_finite() {
            // Neighbouring differences share cells, and cells within a step their windows.
            let seen = count as f64 / (4 * step * step) as f64;
            let weight = (self.weight + seen).min(MEMORY);
            self.factor += (sum / count as f64 - self.factor) * (seen / weight).min(1.0);
            self.factor = self.factor.clamp(FACTOR_MIN, FACTOR_MAX);
            self.weight = weight;
        }
        let widen = self.factor.sqrt() as f32;
        for sigma_m in &mut grid.sigma_m {
            *sigma_m *= widen;
        }
    }
}

/// The mixed second difference about a cell over cells `step` apart, and the mean of the promised variances that go into it;
/// `None` unless all nine cells were measured.
fn difference(grid: &ElevationGrid, (row, col): (usize, usize), step: usize) -> Option<(f64, f64)> {
    const WEIGHTS: [f64; 3] = [1.0, -2.0, 1.0];
    let cols = grid.cols as usize;
    let (mut difference_m, mut variance_m2) = (0.0, 0.0);
    for (i, down) in WEIGHTS.into_iter().enumerate() {
        for (j, across) in WEIGHTS.into_iter().enumerate() {
            let at = (row + i * step - step) * cols + col + j * step - step;
            let (elevation_m, sigma_m) = (f64::from(grid.elevation_m[at]), f64::from(grid.sigma_m[at]));
            difference_m += down * across * elevation_m;
            variance_m2 += (down * across).powi(2) * sigma_m * sigma_m;
        }
    }
    // The squares of the weights add up to 36. NaN is not positive.
    (difference_m.is_finite() && variance_m2 > 0.0).then_some((difference_m, variance_m2 / 36.0))
}

/// What the second difference along one axis over places `step_m` apart does to noise variance, when points closer than `window_m`
/// share errors: 6 for independent cells, less where windows overlap.
fn noise_gain(step_m: f64, cell_m: f64, window_m: f64) -> f64 {
    let [own, next, second] = [0.0, 1.0, 2.0].map(|lag| covariance(lag * step_m, cell_m, window_m));
    ((6.0 * own - 8.0 * next + 2.0 * second) / own).max(1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn normal(random: &mut ChaCha8Rng) -> f64 {
        (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0
    }

    /// Cells of side 0.1 whose noise is the mean of a finer white field over windows of `window` cells.
    fn grid(true_sigma_m: f64, window: usize, seed: u64, wave: impl Fn(f64, f64) -> f64) -> ElevationGrid {
        let (rows, cols, fine) = (30_usize, 40_usize, 4_usize);
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (height, width) = ((rows + 2 * window) * fine, (cols + 2 * window) * fine);
        let white: Vec<f64> = (0..height * width).map(|_| normal(&mut random)).collect();
        let reach = window * fine;
        let mut elevation: Vec<f64> = Vec::new();
        for row in 0..rows {
            for col in 0..cols {
                // A point's error is the mean over its window, a cell's the mean of its points'.
                let mut sum = 0.0;
                for i in 0..fine {
                    for j in 0..fine {
                        let (top, left) = (row * fine + i, col * fine + j);
                        for down in 0..reach.max(1) {
                            sum += white[(top + down) * width + left..][..reach.max(1)].iter().sum::<f64>();
                        }
                    }
                }
                elevation.push(sum);
            }
        }
        let rms = (elevation.iter().map(|x| x * x).sum::<f64>() / elevation.len() as f64).sqrt();
        let elevation_m = elevation
            .iter()
            .enumerate()
            .map(|(i, x)| (x / rms * true_sigma_m + wave((i / cols) as f64 * 0.1, (i % cols) as f64 * 0.1)) as f32)
            .collect();
        ElevationGrid {
            south_west_north_m: 0.0,
            south_west_east_m: 0.0,
            cell_m: 0.1,
            rows: rows as u32,
            cols: cols as u32,
            elevation_m,
            sigma_m: vec![0.002; rows * cols],
        }
    }

    #[track_caller]
    fn check(true_sigma_m: f64, window: usize, wave: impl Fn(f64, f64) -> f64 + Copy) {
        let mut scatter = Scatter::default();
        let mut sigma_m = 0.0;
        for seed in 0..12 {
            let mut grid = grid(true_sigma_m, window, seed, wave);
            scatter.apply(&mut grid, window as f64 * 0.1);
            sigma_m = f64::from(grid.sigma_m[0]);
        }
        assert!((sigma_m / true_sigma_m - 1.0).abs() < 0.1, "{sigma_m} for {true_sigma_m}, window {window}");
    }

    #[test]
    fn broken_promises_are_found_out_whether_windows_overlap_or_not() {
        for window in [1, 2, 3] {
            check(0.002, window, |_, _| 0.0);
            check(0.005, window, |_, _| 0.0);
        }
    }

    #[test]
    fn waves_are_not_noise() {
        // Ten cells long, five times as high as the noise, along and across.
        check(0.004, 1, |n, e| 0.02 * (std::f64::consts::TAU * (0.6 * n + 0.8 * e) / 1.0).sin());
        check(0.004, 1, |n, e| 0.1 * n - 0.05 * e + 0.02 * n * n);
    }

    #[test]
    fn holes_and_nonsense_teach_nothing() {
        let mut scatter = Scatter::default();
        let mut holes = grid(0.002, 1, 1, |_, _| 0.0);
        holes.elevation_m.iter_mut().step_by(2).for_each(|z| *z = f32::NAN);
        scatter.apply(&mut holes, 0.1);
        assert!((scatter.factor - PRIOR).abs() < 1e-12);
        let mut tiny = ElevationGrid { rows: 1, cols: 1, elevation_m: vec![0.0], sigma_m: vec![0.0], ..holes };
        scatter.apply(&mut tiny, f64::NAN);
        assert!((scatter.factor - PRIOR).abs() < 1e-12);
    }
}
