//! Linear triangulation (thesis 4-17 … 4-23).

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector3};

use super::PointPair;

/// M_l = K_l \[I | 0\] and M_r = K_r \[R | t\] (thesis 4-28 … 4-31).
#[must_use]
pub fn projection_matrices(
    left_matrix: &Matrix3<f64>,
    right_matrix: &Matrix3<f64>,
    right_from_left: &Matrix3<f64>,
    right_from_left_m: &Vector3<f64>,
) -> (Matrix3x4<f64>, Matrix3x4<f64>) {
    let identity = Matrix3x4::identity();
    let mut pose = Matrix3x4::zeros();
    pose.fixed_view_mut::<3, 3>(0, 0).copy_from(right_from_left);
    pose.set_column(3, right_from_left_m);
    (left_matrix * identity, right_matrix * pose)
}

/// The point that two projections see at a pair of pixels, in the frame and unit of the matrices: least squares over the four
/// equations of (4-22). `None` at infinity.
#[must_use]
pub fn triangulate(left: &Matrix3x4<f64>, right: &Matrix3x4<f64>, pair: &PointPair) -> Option<Vector3<f64>> {
    let rows = [
        left.row(2) * pair.left.x - left.row(0),
        left.row(2) * pair.left.y - left.row(1),
        right.row(2) * pair.right.x - right.row(0),
        right.row(2) * pair.right.y - right.row(1),
    ];
    // Each row to unit length: they are pixels times matrices of any scale.
    let a = Matrix4::from_rows(&rows.map(|row| row / row.norm()));
    let svd = a.try_svd(false, true, f64::EPSILON, 100)?;
    let point = svd.v_t?.row(3).transpose();
    let at = point.xyz() / point.w;
    // At infinity w is rounding error.
    (point.w.abs() > 1e-12 * point.norm() && at.iter().all(|number| number.is_finite())).then_some(at)
}
