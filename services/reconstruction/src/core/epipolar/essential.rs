//! The essential matrix, and the motion in it (thesis 4.4.2).

use nalgebra::{Matrix3, Vector3};
use opencv::calib3d;
use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, Point2d, Vector};

use super::{EpipolarError, PointPair, projection_matrices, triangulate};
use crate::core::cv;

/// OpenCV's limit, of which its adaptive count usually needs a small part.
const SAMPLES_MAX: i32 = 2000;
const CONFIDENCE: f64 = 0.9999;

/// How the right camera stands to the left one: X_right = R X_left + t, |t| = 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativePose {
    /// R.
    pub right_from_left: Matrix3<f64>,
    /// t / |t|.
    pub direction: Vector3<f64>,
    /// Points that lie in front of both cameras.
    pub in_front: usize,
}

/// E = K_rᵀ F K_l (thesis 4-7).
#[must_use]
pub fn essential_from_fundamental(
    fundamental: &Matrix3<f64>,
    left_matrix: &Matrix3<f64>,
    right_matrix: &Matrix3<f64>,
) -> Matrix3<f64> {
    right_matrix.transpose() * fundamental * left_matrix
}

/// E = \[t\]× R. The thesis's (4-8) writes the same as R S, with t in the left camera's axes.
#[must_use]
pub fn essential_from_pose(right_from_left: &Matrix3<f64>, t: &Vector3<f64>) -> Matrix3<f64> {
    t.cross_matrix() * right_from_left
}

/// E by the five-point algorithm (Nistér 2004) within RANSAC, both OpenCV's, from normalised coordinates; and which matches keep
/// to it, within `threshold` (pixels over focal length). Unlike eight points, five do not mind a flat scene.
///
/// # Errors
/// [`EpipolarError`] with fewer than five matches, or none that agree.
pub fn five_point(rays: &[PointPair], threshold: f64) -> Result<(Matrix3<f64>, Vec<bool>), EpipolarError> {
    if rays.len() < 5 {
        return Err(EpipolarError::TooFew { points: rays.len(), needed: 5 });
    }
    let points = |side: fn(&PointPair) -> nalgebra::Vector2<f64>| -> Vector<Point2d> {
        rays.iter().map(|pair| Point2d::new(side(pair).x, side(pair).y)).collect()
    };
    let (left, right) = (points(|pair| pair.left), points(|pair| pair.right));
    let identity = cv::mat_from_matrix3(&Matrix3::identity())?;
    let mut mask = Mat::default();
    let e =
        calib3d::find_essential_mat(&left, &right, &identity, calib3d::RANSAC, CONFIDENCE, threshold, SAMPLES_MAX, &mut mask)?;
    // From just five points OpenCV returns all solutions one below the other; none where it found none.
    if e.rows() != 3 || e.cols() != 3 {
        return Err(EpipolarError::Degenerate);
    }
    Ok((cv::matrix3_from_mat(&e)?, mask.data_bytes()?.iter().map(|flag| *flag != 0).collect()))
}

/// Of the four motions in an essential matrix the one that puts most of the points, normalised coordinates, in front of both
/// cameras. E need not be perfect: the nearest one with two equal singular values counts.
#[must_use]
pub fn pose_from_essential(essential: &Matrix3<f64>, rays: &[PointPair]) -> Option<RelativePose> {
    let svd = essential.try_svd(true, true, f64::EPSILON, 100)?;
    let (mut u, mut v_t) = (svd.u?, svd.v_t?);
    // The signs of the third vectors are free: choose rotations.
    if u.determinant() < 0.0 {
        u.column_mut(2).neg_mut();
    }
    if v_t.determinant() < 0.0 {
        v_t.row_mut(2).neg_mut();
    }
    let quarter = Matrix3::new(0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0);
    let t: Vector3<f64> = u.column(2).into_owned();
    let mut best: Option<RelativePose> = None;
    for (turn, direction) in [(quarter, t), (quarter, -t), (quarter.transpose(), t), (quarter.transpose(), -t)] {
        let right_from_left = u * turn * v_t;
        let in_front = count_in_front(&right_from_left, &direction, rays);
        if best.is_none_or(|best| in_front > best.in_front) {
            best = Some(RelativePose { right_from_left, direction, in_front });
        }
    }
    best.filter(|pose| pose.right_from_left.iter().chain(pose.direction.iter()).all(|number| number.is_finite()))
}

/// How many points lie in front of both cameras.
pub(crate) fn count_in_front(right_from_left: &Matrix3<f64>, direction: &Vector3<f64>, rays: &[PointPair]) -> usize {
    let identity = Matrix3::identity();
    let (left, right) = projection_matrices(&identity, &identity, right_from_left, direction);
    rays.iter()
        .filter_map(|pair| triangulate(&left, &right, pair))
        .filter(|point| point.z > 0.0 && (right_from_left * point + direction).z > 0.0)
        .count()
}
