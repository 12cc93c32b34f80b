//! How the errors of neighbouring grid cells hang together.
//!
//! A point's error is common to all points whose matching windows overlap with its own, so over the water errors have a triangular
//! correlation of half-width [`SurfacePatch::error_length_m`](crate::SurfacePatch). A cell is a mean of its points.

/// Covariance of the means over two cells of side `cell_m` whose centres are `lag_m` apart along one axis, of an error of unit
/// variance with triangular correlation of half-width `length_m`. Over two axes the covariances multiply.
#[must_use]
pub fn covariance(lag_m: f64, cell_m: f64, length_m: f64) -> f64 {
    const STEPS: i32 = 200;
    // Distances between the points of two cells have a triangular density, as wide as the cells: the mean of one triangle over the
    // other. It is integrated over the narrower of the two, or steps would miss it.
    let triangle = |x: f64| (1.0 - x.abs()).max(0.0);
    let length_m = length_m.max(1e-9);
    let (narrow_m, wide_m) = (cell_m.min(length_m), cell_m.max(length_m));
    let sum: f64 = (0..STEPS)
        .map(|i| {
            let x = 2.0 * (f64::from(i) + 0.5) / f64::from(STEPS) - 1.0;
            triangle(x) * triangle((lag_m + x * narrow_m) / wide_m)
        })
        .sum();
    // Over the density the weight is one; over the correlation it is that triangle's area in cells.
    sum * 2.0 / f64::from(STEPS) * (narrow_m / cell_m)
}

/// By how much the variance of a mean over many cells exceeds that of as many independent ones: the sum of all correlations.
#[must_use]
pub fn inflation(cell_m: f64, length_m: f64) -> f64 {
    // The triangle's area, in cells, over the variance of one cell; two axes.
    (length_m / cell_m / covariance(0.0, cell_m, length_m)).powi(2).max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: the mean of 1 − |x − y| over the unit square is 1 − 1/3; for points that share nothing beyond a tenth of the
    /// cell it is 0.1 (1 − 0.1/3).
    #[test]
    fn the_variance_of_a_cell() {
        assert!((covariance(0.0, 1.0, 1.0) - 2.0 / 3.0).abs() < 1e-4);
        assert!((covariance(0.0, 1.0, 0.1) - 0.1 * (1.0 - 0.1 / 3.0)).abs() < 1e-5);
        assert!(covariance(2.1, 1.0, 1.0).abs() < 1e-12, "windows that never meet share nothing");
    }

    #[test]
    fn independent_cells_are_not_inflated_and_overlapping_ones_are() {
        assert!((inflation(1.0, 1e-3) - 1.0).abs() < 0.01);
        // All lags of a triangle add up to its area.
        let sum: f64 = (-5..=5).map(|lag| covariance(f64::from(lag), 1.0, 2.0)).sum();
        assert!((inflation(1.0, 2.0) - (sum / covariance(0.0, 1.0, 2.0)).powi(2)).abs() < 0.02);
    }
}
