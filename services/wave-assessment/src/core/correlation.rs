//! How a sum of cells is in error, whose errors hang together.

use halcyon_model::{SurfacePatch, grid_error};

/// Cells along each side of a sum, at most.
pub(super) const SPAN: usize = 19;

/// Correlation of the errors of two cells along one axis, by their places. It is the same for all patches of as large cells, and takes longer to
/// find than a patch to read.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Correlation {
    cell_m: f64,
    error_length_m: f64,
    matrix: [[f64; SPAN]; SPAN],
}

impl Correlation {
    /// Of cells of this side, whose points share errors within this length.
    pub(super) fn new(cell_m: f64, error_length_m: f64) -> Self {
        let covariance = |lag: usize| grid_error::covariance(lag as f64 * cell_m, cell_m, error_length_m);
        let own = covariance(0);
        let along: [f64; SPAN] = std::array::from_fn(|lag| covariance(lag) / own);
        let matrix = std::array::from_fn(|a| std::array::from_fn(|b| along[usize::abs_diff(a, b)]));
        Self { cell_m, error_length_m, matrix }
    }

    /// Whether it is that of `patch`.
    pub(super) fn is_of(&self, patch: &SurfacePatch) -> bool {
        self.cell_m == patch.grid.cell_m && self.error_length_m == patch.error_length_m
    }

    /// Variance of a sum of cells by their pulls on it, m². The correlation of two cells is one along rows times one along
    /// columns, so that it is taken along one after the other: a tenth of the work of all pairs.
    pub(super) fn variance(&self, pull_m: &[[f64; SPAN]; SPAN]) -> f64 {
        let spread = |values: &[f64; SPAN]| -> [f64; SPAN] {
            let mut sum = [0.0; SPAN];
            for (value, row) in values.iter().zip(&self.matrix).filter(|(value, _)| **value != 0.0) {
                sum.iter_mut().zip(row).for_each(|(sum, share)| *sum += value * share);
            }
            sum
        };
        let across = pull_m.each_ref().map(spread);
        let mut noise_m2 = 0.0;
        for (pulls, row) in pull_m.iter().zip(&self.matrix).filter(|(pulls, _)| pulls.iter().any(|pull| *pull != 0.0)) {
            let mut sum = [0.0; SPAN];
            for (values, share) in across.iter().zip(row).filter(|(_, share)| **share != 0.0) {
                sum.iter_mut().zip(values).for_each(|(sum, value)| *sum += share * value);
            }
            noise_m2 += sum.iter().zip(pulls).map(|(sum, pull)| sum * pull).sum::<f64>();
        }
        noise_m2
    }
}
