//! How well the parameters are known, and what that means for measured depth.

use halcyon_model::RigCalibration;
use nalgebra::{Matrix3, Matrix4x3, Rotation3, SMatrix, SVector, Vector2, Vector3};

use super::bundle::{LEFT, RIG, RIGHT, SHARED, SharedMatrix, WARP};
use crate::core::camera::{self, INTRINSICS};

/// Half of a 95 % interval in standard deviations.
pub const SIGMAS_95: f64 = 1.959_964;

/// Standard deviations of what a calibration found; zero for what the model holds fixed.
///
/// From the covariance at the optimum, scaled by the scatter of the residuals. It speaks of noise in the corners only: a wrong
/// square size or a lens that the model can't describe is beyond it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sigmas {
    /// fx, fy, cx, cy (pixels), k1, k2, p1, p2, k3 of the left camera.
    pub left: [f64; INTRINSICS],
    /// The same of the right camera.
    pub right: [f64; INTRINSICS],
    /// The rotation vector of `right_from_left`, radians.
    pub rotation_rad: Vector3<f64>,
    /// `right_from_left_m`.
    pub translation_m: Vector3<f64>,
    /// Distance between the cameras, metres.
    pub baseline_m: f64,
    /// The board's warp, metres.
    pub warp_m: Vector2<f64>,
}

/// Rotation vector of a rotation matrix, radians.
#[must_use]
pub fn rotation_vector_rad(rotation: &Matrix3<f64>) -> Vector3<f64> {
    Rotation3::from_matrix_unchecked(*rotation).scaled_axis()
}

impl Sigmas {
    pub(super) fn new(rig: &RigCalibration, covariance: &SharedMatrix) -> Self {
        let sigma = |at: usize| covariance[(at, at)].max(0.0).sqrt();
        let block = |at: usize| covariance.fixed_view::<3, 3>(at, at).into_owned();
        let to_vector = vector_from_turn(&rotation_vector_rad(&rig.right_from_left));
        let rotation = to_vector * block(RIG) * to_vector.transpose();
        let along = rig.right_from_left_m.normalize();
        Self {
            left: std::array::from_fn(|k| sigma(LEFT + k)),
            right: std::array::from_fn(|k| sigma(RIGHT + k)),
            rotation_rad: rotation.diagonal().map(|variance| variance.max(0.0).sqrt()),
            translation_m: Vector3::from_fn(|k, _| sigma(RIG + 3 + k)),
            baseline_m: along.dot(&(block(RIG + 3) * along)).max(0.0).sqrt(),
            warp_m: Vector2::new(sigma(WARP), sigma(WARP + 1)),
        }
    }
}

/// How a rotation vector changes with a small turn applied from the left: the inverse left Jacobian of SO(3)
/// (Barfoot, "State Estimation for Robotics", 7.77).
fn vector_from_turn(vector_rad: &Vector3<f64>) -> Matrix3<f64> {
    let (cross, angle) = (vector_rad.cross_matrix(), vector_rad.norm());
    let square =
        if angle < 1e-4 { 1.0 / 12.0 } else { 1.0 / (angle * angle) - (1.0 + angle.cos()) / (2.0 * angle * angle.sin()) };
    Matrix3::identity() - cross / 2.0 + cross * cross * square
}

/// Standard deviation of triangulated depth that the calibration alone brings, over the left picture.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthUncertainty {
    /// Depth (z in left camera axes) that the map is for, metres.
    pub distance_m: f64,
    /// Fields along a row.
    pub cols: usize,
    /// Fields along a column.
    pub rows: usize,
    /// At the middle of each field, metres, row-major from the top left; NaN where the right camera does not see the point.
    pub sigma_m: Vec<f64>,
}

impl DepthUncertainty {
    const COLS: usize = 32;
    const ROWS: usize = 24;

    pub(super) fn new(rig: &RigCalibration, covariance: &SharedMatrix, distance_m: f64) -> Self {
        let field = |at: usize, fields: usize, px: u32| (at as f64 + 0.5) / fields as f64 * f64::from(px) - 0.5;
        let mut sigma_m = Vec::with_capacity(Self::COLS * Self::ROWS);
        for row in 0..Self::ROWS {
            for col in 0..Self::COLS {
                let pixel = Vector2::new(field(col, Self::COLS, rig.width_px), field(row, Self::ROWS, rig.height_px));
                sigma_m.push(depth_sigma_m(rig, covariance, pixel, distance_m).unwrap_or(f64::NAN));
            }
        }
        Self { distance_m, cols: Self::COLS, rows: Self::ROWS, sigma_m }
    }

    /// The median and the largest of what is known, metres; NaN where nothing is.
    #[must_use]
    pub fn median_and_max_m(&self) -> (f64, f64) {
        let mut known: Vec<f64> = self.sigma_m.iter().copied().filter(|sigma| sigma.is_finite()).collect();
        known.sort_by(f64::total_cmp);
        match known.last() {
            Some(max) => (known[known.len() / 2], *max),
            None => (f64::NAN, f64::NAN),
        }
    }
}

/// One point of the map. The triangulated point X minimises the reprojection error of its two fixed pixels; where that is zero,
/// the implicit function theorem gives dX/dp = −(AᵀA)⁻¹ Aᵀ B, with A the slopes of the four pixel coordinates by X and B those by
/// the parameters p.
pub(super) fn depth_sigma_m(
    rig: &RigCalibration,
    covariance: &SharedMatrix,
    pixel: Vector2<f64>,
    distance_m: f64,
) -> Option<f64> {
    let in_left = camera::unproject(&rig.left, pixel)? * distance_m;
    let about_right = rig.right_from_left * in_left;
    let (_, left) = camera::project_with_slopes(&rig.left, &in_left)?;
    let (seen, right) = camera::project_with_slopes(&rig.right, &(about_right + rig.right_from_left_m))?;
    let inside = |at: f64, px: u32| (-0.5..f64::from(px) - 0.5).contains(&at);
    if !inside(seen.x, rig.width_px) || !inside(seen.y, rig.height_px) {
        return None;
    }
    let mut by_point = Matrix4x3::zeros();
    by_point.fixed_rows_mut::<2>(0).copy_from(&left.by_point);
    by_point.fixed_rows_mut::<2>(2).copy_from(&(right.by_point * rig.right_from_left));
    let mut by_parameters = SMatrix::<f64, 4, SHARED>::zeros();
    by_parameters.fixed_view_mut::<2, INTRINSICS>(0, LEFT).copy_from(&left.by_intrinsics);
    by_parameters.fixed_view_mut::<2, INTRINSICS>(2, RIGHT).copy_from(&right.by_intrinsics);
    by_parameters.fixed_view_mut::<2, 3>(2, RIG).copy_from(&-(right.by_point * about_right.cross_matrix()));
    by_parameters.fixed_view_mut::<2, 3>(2, RIG + 3).copy_from(&right.by_point);
    let inverse = by_point.tr_mul(&by_point).try_inverse()?;
    let depth: SVector<f64, SHARED> = (-(inverse * by_point.transpose() * by_parameters)).row(2).transpose();
    Some(depth.dot(&(covariance * depth)).max(0.0).sqrt())
}
