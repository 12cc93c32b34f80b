//! The fundamental matrix by the normalised eight-point algorithm (Hartley 1997; thesis 4-1 … 4-5).

use nalgebra::{Matrix3, SMatrix, SVector, Vector2, Vector3};

use super::{EpipolarError, PointPair};

/// Fewer points leave F open.
pub(super) const POINTS_MIN: usize = 8;
/// The least squares' second-smallest eigenvalue, as a share of the largest, below which a second F fits as well as the first.
const GAP_MIN: f64 = 1e-11;

/// F with p_rᵀ F p_l = 0 in the least-squares sense, of rank 2, Frobenius norm 1 and, its sign being free, f₃₃ ≥ 0. Eight or more points, in pixels or
/// normalised coordinates.
///
/// # Errors
/// [`EpipolarError::TooFew`]; [`EpipolarError::Degenerate`] where the points leave F open (exactly planar, or fewer than eight
/// different ones).
pub fn eight_point<'a>(pairs: impl IntoIterator<Item = &'a PointPair, IntoIter: Clone>) -> Result<Matrix3<f64>, EpipolarError> {
    let pairs = pairs.into_iter();
    let count = pairs.clone().count();
    if count < POINTS_MIN {
        return Err(EpipolarError::TooFew { points: count, needed: POINTS_MIN });
    }
    let left_from = normaliser(pairs.clone().map(|pair| pair.left), count).ok_or(EpipolarError::Degenerate)?;
    let right_from = normaliser(pairs.clone().map(|pair| pair.right), count).ok_or(EpipolarError::Degenerate)?;
    // MᵀM of (4-3), from rows (4-4) with F row by row.
    let mut squares = SMatrix::<f64, 9, 9>::zeros();
    for pair in pairs {
        let l = left_from * pair.left.push(1.0);
        let r = right_from * pair.right.push(1.0);
        let row = SVector::<f64, 9>::from([r.x * l.x, r.x * l.y, r.x, r.y * l.x, r.y * l.y, r.y, l.x, l.y, 1.0]);
        squares.syger(1.0, &row, &row, 1.0);
    }
    squares.fill_upper_triangle_with_lower_triangle();
    let eigen = squares.symmetric_eigen();
    let mut order: [usize; 9] = std::array::from_fn(|i| i);
    order.sort_by(|a, b| eigen.eigenvalues[*a].total_cmp(&eigen.eigenvalues[*b]));
    let gap = eigen.eigenvalues[order[1]] / eigen.eigenvalues[order[8]];
    if gap.is_nan() || gap <= GAP_MIN {
        return Err(EpipolarError::Degenerate);
    }
    let f = Matrix3::from_row_slice(eigen.eigenvectors.column(order[0]).as_slice());
    // Rank 2 while the coordinates are still normalised: there the least change is the right one.
    let f = right_from.transpose() * with_rank_two(&f).ok_or(EpipolarError::Degenerate)? * left_from;
    let norm = if f.m33 < 0.0 { -f.norm() } else { f.norm() };
    if norm.is_finite() && norm != 0.0 { Ok(f / norm) } else { Err(EpipolarError::Degenerate) }
}

/// Squared distance of a match from F, to first order (Sampson; Hartley and Zisserman 11.9); in the square of the points' unit.
#[must_use]
pub fn sampson_px2(f: &Matrix3<f64>, pair: &PointPair) -> f64 {
    let (l, r) = (pair.left.push(1.0), pair.right.push(1.0));
    let (line_right, line_left) = (f * l, f.tr_mul(&r));
    let algebraic = r.dot(&line_right);
    algebraic * algebraic / (line_right.xy().norm_squared() + line_left.xy().norm_squared())
}

/// Moves the mean of the points to the origin and their mean distance from it to √2.
fn normaliser(points: impl Iterator<Item = Vector2<f64>> + Clone, count: usize) -> Option<Matrix3<f64>> {
    let mean = points.clone().sum::<Vector2<f64>>() / count as f64;
    let spread = points.map(|point| (point - mean).norm()).sum::<f64>() / count as f64;
    let scale = std::f64::consts::SQRT_2 / spread;
    scale.is_finite().then(|| Matrix3::new(scale, 0.0, -scale * mean.x, 0.0, scale, -scale * mean.y, 0.0, 0.0, 1.0))
}

/// The nearest matrix of rank 2.
fn with_rank_two(f: &Matrix3<f64>) -> Option<Matrix3<f64>> {
    let mut svd = f.try_svd(true, true, f64::EPSILON, 100)?;
    svd.singular_values = Vector3::new(svd.singular_values[0], svd.singular_values[1], 0.0);
    svd.recompose().ok()
}
