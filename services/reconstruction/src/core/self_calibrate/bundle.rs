//! Bundle adjustment of one rig over any number of pairs: Levenberg and Marquardt, with the points eliminated (Schur complement;
//! Triggs et al. 2000) and Huber's loss.
//!
//! Every point is seen exactly twice, and pairs share nothing but the rig. So six numbers are common, R (3), the direction of
//! t (2) and a factor on the focal lengths (1), and each point adds three of its own: its ray in the left camera and its inverse
//! depth in baselines, which stays finite where depth does not.

use halcyon_model::{CameraIntrinsics, RigCalibration};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3x2, Rotation3, SMatrix, SVector, UnitVector3, Vector2, Vector3, Vector4};

use super::median;
use crate::core::epipolar::PointPair;

/// Residuals beyond this many standard deviations count linearly (95 % efficient where noise is normal).
const HUBER_SIGMAS: f64 = 1.345;
/// The median of |x| of a normal variable is this many standard deviations.
const MEDIAN_PER_SIGMA: f64 = 0.6745;
/// Rounds in which the noise, and so the loss, is estimated anew.
const SCALE_ROUNDS: u32 = 4;
const STEPS_MAX: u32 = 30;
/// A step that changes the cost by less than this share of it is the last.
const GAIN_MIN: f64 = 1e-9;
/// Noise that is assumed at least, pixels: exact matches must not divide by zero.
const SIGMA_PX_MIN: f64 = 1e-6;

/// X_right = R X_left + t with |t| = 1, and the factor on the calibration's focal lengths.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pose {
    pub(super) rotation: Matrix3<f64>,
    pub(super) direction: Vector3<f64>,
    pub(super) focal_scale: f64,
}

impl Pose {
    pub(super) fn new(rotation: Matrix3<f64>, direction: Vector3<f64>) -> Self {
        Self { rotation, direction, focal_scale: 1.0 }
    }

    /// Inverse depth of a match along its left ray, in units of one over the baseline; negative behind the cameras.
    pub(super) fn inverse_depth(&self, ray: &PointPair) -> f64 {
        let (from_left, right) = (self.rotation * ray.left.push(1.0), ray.right.push(1.0));
        // R q + ρ t is parallel to the right ray.
        let (a, b) = (from_left.cross(&right), self.direction.cross(&right));
        -a.dot(&b) / b.norm_squared()
    }

    pub(super) fn rotation_to_rad(&self, other: &Self) -> f64 {
        Rotation3::from_matrix_unchecked(self.rotation * other.rotation.transpose()).angle()
    }

    pub(super) fn direction_to_rad(&self, other: &Self) -> f64 {
        self.direction.angle(&other.direction)
    }

    /// `given` with this pose.
    pub(super) fn rig(&self, given: &RigCalibration, baseline_m: f64) -> RigCalibration {
        let camera = |camera: &CameraIntrinsics| CameraIntrinsics {
            fx_px: camera.fx_px * self.focal_scale,
            fy_px: camera.fy_px * self.focal_scale,
            ..*camera
        };
        RigCalibration {
            left: camera(&given.left),
            right: camera(&given.right),
            right_from_left: self.rotation,
            right_from_left_m: self.direction * baseline_m,
            ..*given
        }
    }

    /// Moved by (turn, direction, focal).
    fn moved(&self, step: &SVector<f64, 6>) -> Self {
        let turn = Rotation3::new(step.fixed_rows::<3>(0).into_owned());
        let tangent = tangent(&UnitVector3::new_unchecked(self.direction));
        // Back to a rotation: rounding must not add up over many steps.
        let rotation = Rotation3::from_matrix(&(turn.matrix() * self.rotation)).into_inner();
        let direction = (self.direction + tangent * step.fixed_rows::<2>(3)).normalize();
        Self { rotation, direction, focal_scale: self.focal_scale + step[5] }
    }
}

/// Two unit vectors across a direction, the first nearest to y, the second to z: for a baseline along x, just y and z.
pub(super) fn tangent(direction: &UnitVector3<f64>) -> Matrix3x2<f64> {
    let t = direction.as_ref();
    // A baseline along y has no direction nearest to y; x serves.
    let seed = if t.y.abs() > 0.9 { Vector3::x() } else { Vector3::y() };
    let first = (seed - t * t.dot(&seed)).normalize();
    let second = t.cross(&first);
    let second = if second.z < 0.0 { -second } else { second };
    Matrix3x2::from_columns(&[first, second])
}

/// The result.
#[derive(Debug, Clone)]
pub(super) struct Bundle {
    pub(super) pose: Pose,
    /// Which matches took part.
    pub(super) used: Vec<usize>,
    /// Ray and inverse depth of each of them.
    pub(super) points: Vec<Vector3<f64>>,
    /// Standard deviation of one coordinate of one match, pixels.
    pub(super) sigma_px: f64,
    /// Of (turn, direction, focal), radians and share; the focal part is 0 where it was held.
    pub(super) covariance: SMatrix<f64, 6, 6>,
}

/// One match linearised: residuals left and right (pixels), and their derivatives by the common six and the point's three.
struct Linear {
    residual: Vector4<f64>,
    common: SMatrix<f64, 4, 6>,
    point: SMatrix<f64, 4, 3>,
}

struct Problem<'a> {
    given: &'a RigCalibration,
    pixels: Vec<PointPair>,
    with_focal: bool,
}

/// Adjusts a pose and the points of the matches `used`. `None` where the matches leave it open.
pub(super) fn adjust(
    given: &RigCalibration,
    pixels: &[PointPair],
    rays: &[PointPair],
    used: Vec<usize>,
    start: &Pose,
    with_focal: bool,
) -> Option<Bundle> {
    let problem = Problem { given, pixels: used.iter().map(|&i| pixels[i]).collect(), with_focal };
    let mut pose = *start;
    let mut points: Vec<Vector3<f64>> = used.iter().map(|&i| rays[i].left.push(pose.inverse_depth(&rays[i]))).collect();
    let mut sigma_px = problem.sigma_px(&pose, &points);
    for round in 0..SCALE_ROUNDS {
        problem.descend(&mut pose, &mut points, HUBER_SIGMAS * sigma_px)?;
        let new_px = problem.sigma_px(&pose, &points);
        let is_settled = (new_px - sigma_px).abs() < 0.01 * sigma_px;
        sigma_px = new_px;
        if is_settled && round > 0 {
            break;
        }
    }
    let covariance = problem.covariance(&pose, &points, HUBER_SIGMAS * sigma_px)?;
    Some(Bundle { pose, used, points, sigma_px, covariance })
}

impl Problem<'_> {
    fn residual(&self, i: usize, pose: &Pose, point: &Vector3<f64>) -> Vector4<f64> {
        let (left, _) = project(&self.given.left, pose.focal_scale, &point.xy());
        let seen = pose.rotation * point.xy().push(1.0) + pose.direction * point.z;
        let (right, _) = project(&self.given.right, pose.focal_scale, &(seen.xy() / seen.z));
        let (left, right) = (left - self.pixels[i].left, right - self.pixels[i].right);
        Vector4::new(left.x, left.y, right.x, right.y)
    }

    fn linearise(&self, i: usize, pose: &Pose, tangent: &Matrix3x2<f64>, point: &Vector3<f64>) -> Linear {
        let ray = point.xy();
        let (left, left_by_ray) = project(&self.given.left, pose.focal_scale, &ray);
        let turned = pose.rotation * ray.push(1.0);
        let seen = turned + pose.direction * point.z;
        let at = seen.xy() / seen.z;
        let (right, right_by_ray) = project(&self.given.right, pose.focal_scale, &at);
        let ray_by_seen = Matrix2x3::new(1.0, 0.0, -at.x, 0.0, 1.0, -at.y) / seen.z;
        let right_by_seen = right_by_ray * ray_by_seen;

        let mut common = SMatrix::<f64, 4, 6>::zeros();
        // exp(ω) R q ≈ R q − [R q]× ω
        common.fixed_view_mut::<2, 3>(2, 0).copy_from(&(right_by_seen * -turned.cross_matrix()));
        common.fixed_view_mut::<2, 2>(2, 3).copy_from(&(right_by_seen * tangent * point.z));
        if self.with_focal {
            let centre = |camera: &CameraIntrinsics| Vector2::new(camera.cx_px, camera.cy_px);
            common.fixed_view_mut::<2, 1>(0, 5).copy_from(&((left - centre(&self.given.left)) / pose.focal_scale));
            common.fixed_view_mut::<2, 1>(2, 5).copy_from(&((right - centre(&self.given.right)) / pose.focal_scale));
        }
        let mut by_point = SMatrix::<f64, 4, 3>::zeros();
        by_point.fixed_view_mut::<2, 2>(0, 0).copy_from(&left_by_ray);
        by_point.fixed_view_mut::<2, 2>(2, 0).copy_from(&(right_by_seen * pose.rotation.fixed_columns::<2>(0)));
        by_point.fixed_view_mut::<2, 1>(2, 2).copy_from(&(right_by_seen * pose.direction));
        let (left, right) = (left - self.pixels[i].left, right - self.pixels[i].right);
        Linear { residual: Vector4::new(left.x, left.y, right.x, right.y), common, point: by_point }
    }

    /// A match's four residuals have one degree of freedom left, along the epipolar normal: their length is one normal variable.
    fn sigma_px(&self, pose: &Pose, points: &[Vector3<f64>]) -> f64 {
        let mut lengths: Vec<f64> = points.iter().enumerate().map(|(i, point)| self.residual(i, pose, point).norm()).collect();
        (median(&mut lengths) / MEDIAN_PER_SIGMA).max(SIGMA_PX_MIN)
    }

    fn cost(&self, pose: &Pose, points: &[Vector3<f64>], limit_px: f64) -> f64 {
        let loss = |length: f64| if length <= limit_px { length * length } else { limit_px * (2.0 * length - limit_px) };
        points.iter().enumerate().map(|(i, point)| loss(self.residual(i, pose, point).norm())).sum()
    }

    /// Levenberg and Marquardt until nothing is gained. `None` where the numbers go wrong.
    fn descend(&self, pose: &mut Pose, points: &mut Vec<Vector3<f64>>, limit_px: f64) -> Option<()> {
        let mut damping = 1e-4;
        let mut cost = self.cost(pose, points, limit_px);
        let mut moved = points.clone();
        let mut lines = Vec::with_capacity(points.len());
        for _ in 0..STEPS_MAX {
            if !cost.is_finite() {
                return None;
            }
            let tangent = tangent(&UnitVector3::new_unchecked(pose.direction));
            lines.clear();
            lines.extend(points.iter().enumerate().map(|(i, point)| {
                let line = self.linearise(i, pose, &tangent, point);
                let weight = (limit_px / line.residual.norm()).min(1.0);
                (line, weight)
            }));
            let mut gained = false;
            // Damped ever more until a step helps; ends at a damping that lets nothing move.
            while damping < 1e10 {
                if let Some(step) = self.step(&lines, damping, &mut moved, points) {
                    let there = pose.moved(&step);
                    let new_cost = self.cost(&there, &moved, limit_px);
                    if new_cost < cost {
                        gained = cost - new_cost > GAIN_MIN * cost;
                        *pose = there;
                        std::mem::swap(points, &mut moved);
                        cost = new_cost;
                        damping = (damping * 0.1).max(1e-12);
                        break;
                    }
                }
                damping *= 10.0;
            }
            if !gained {
                break;
            }
        }
        Some(())
    }

    /// Solves for the common step and puts the points that go with it into `moved`.
    fn step(
        &self,
        lines: &[(Linear, f64)],
        damping: f64,
        moved: &mut [Vector3<f64>],
        points: &[Vector3<f64>],
    ) -> Option<SVector<f64, 6>> {
        let (mut normal, mut diagonal, mut right) =
            (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros(), SVector::<f64, 6>::zeros());
        for (line, weight) in lines {
            let (by_point, coupling) = eliminate(line, *weight, damping)?;
            let common = line.common.tr_mul(&line.common) * *weight;
            diagonal += common.diagonal();
            normal += common - coupling * by_point * coupling.transpose();
            let gradient = line.common.tr_mul(&line.residual) * *weight;
            right -= gradient - coupling * by_point * line.point.tr_mul(&line.residual) * *weight;
        }
        for i in 0..6 {
            normal[(i, i)] += damping * diagonal[i];
        }
        if !self.with_focal {
            normal[(5, 5)] = 1.0;
        }
        let step = normal.cholesky()?.solve(&right);
        for ((to, from), (line, weight)) in moved.iter_mut().zip(points).zip(lines) {
            let (by_point, coupling) = eliminate(line, *weight, damping)?;
            *to = from - by_point * (line.point.tr_mul(&line.residual) * *weight + coupling.tr_mul(&step));
        }
        step.iter().all(|number| number.is_finite()).then_some(step)
    }

    /// Of the common parameters, by Huber's formula for M-estimates (Huber 1981, 7.6): σ² of what the loss lets through, over the
    /// square of the share of residuals it leaves as they are, times the inverse of the reduced normal equations.
    fn covariance(&self, pose: &Pose, points: &[Vector3<f64>], limit_px: f64) -> Option<SMatrix<f64, 6, 6>> {
        let tangent = tangent(&UnitVector3::new_unchecked(pose.direction));
        let mut normal = SMatrix::<f64, 6, 6>::zeros();
        let (mut squares, mut within) = (0.0, 0.0);
        for (i, point) in points.iter().enumerate() {
            let line = self.linearise(i, pose, &tangent, point);
            let (by_point, coupling) = eliminate(&line, 1.0, 0.0)?;
            normal += line.common.tr_mul(&line.common) - coupling * by_point * coupling.transpose();
            let length = line.residual.norm();
            squares += length.min(limit_px).powi(2);
            within += f64::from(u8::from(length <= limit_px));
        }
        let count = points.len() as f64;
        let parameters = if self.with_focal { 6.0 } else { 5.0 };
        let variance = squares / (count - parameters) / (within / count).powi(2);
        if !self.with_focal {
            normal[(5, 5)] = 1.0;
        }
        let mut covariance = normal.cholesky()?.inverse() * variance;
        if !self.with_focal {
            covariance[(5, 5)] = 0.0;
        }
        covariance.iter().all(|number| number.is_finite()).then_some(covariance)
    }
}

/// The inverse of a point's own (damped) normal matrix, and what couples it to the common six.
fn eliminate(line: &Linear, weight: f64, damping: f64) -> Option<(Matrix3<f64>, SMatrix<f64, 6, 3>)> {
    let mut own = line.point.tr_mul(&line.point) * weight;
    for i in 0..3 {
        own[(i, i)] *= 1.0 + damping;
    }
    Some((own.try_inverse()?, line.common.tr_mul(&line.point) * weight))
}

/// Pixel of a ray, and its derivative by the ray.
fn project(camera: &CameraIntrinsics, focal_scale: f64, ray: &Vector2<f64>) -> (Vector2<f64>, Matrix2<f64>) {
    let [k1, k2, p1, p2, k3] = camera.distortion;
    let (x, y) = (ray.x, ray.y);
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    let slope = k1 + r2 * (2.0 * k2 + 3.0 * r2 * k3);
    let distorted = Vector2::new(
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    );
    let mixed = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
    let by_ray = Matrix2::new(
        radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x,
        mixed,
        mixed,
        radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x,
    );
    let focal = Vector2::new(camera.fx_px, camera.fy_px) * focal_scale;
    let pixel = focal.component_mul(&distorted) + Vector2::new(camera.cx_px, camera.cy_px);
    (pixel, Matrix2::from_diagonal(&focal) * by_ray)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: CameraIntrinsics = CameraIntrinsics {
        fx_px: 500.0,
        fy_px: 510.0,
        cx_px: 320.0,
        cy_px: 240.0,
        distortion: [-0.25, 0.08, 2e-3, -1e-3, 0.01],
    };

    fn rig() -> RigCalibration {
        RigCalibration {
            width_px: 640,
            height_px: 480,
            left: CAMERA,
            right: CameraIntrinsics { fx_px: 490.0, ..CAMERA },
            right_from_left: Matrix3::identity(),
            right_from_left_m: Vector3::new(-0.3, 0.0, 0.0),
            body_from_camera: RigCalibration::LOOKING_DOWN,
            camera_in_body_m: Vector3::zeros(),
        }
    }

    /// Every derivative against a central difference.
    #[test]
    fn derivatives_are_differences() {
        let rig = rig();
        let pixels = vec![PointPair { left: Vector2::new(300.0, 200.0), right: Vector2::new(250.0, 210.0) }];
        let problem = Problem { given: &rig, pixels, with_focal: true };
        let rotation = Rotation3::from_euler_angles(0.1, -0.05, 0.02).into_inner();
        let pose = Pose { rotation, direction: Vector3::new(-0.97, 0.1, 0.2).normalize(), focal_scale: 1.02 };
        let point = Vector3::new(0.2, -0.3, 0.15);
        let line = problem.linearise(0, &pose, &tangent(&UnitVector3::new_unchecked(pose.direction)), &point);
        assert_eq!(line.residual, problem.residual(0, &pose, &point));
        let h = 1e-6;
        for i in 0..6 {
            let step = SVector::<f64, 6>::ith(i, h);
            let slope = (problem.residual(0, &pose.moved(&step), &point) - problem.residual(0, &pose.moved(&-step), &point))
                / (2.0 * h);
            assert!((slope - line.common.column(i)).norm() < 1e-4, "{i}: {slope} {}", line.common.column(i));
        }
        for i in 0..3 {
            let step = Vector3::ith(i, h);
            let slope = (problem.residual(0, &pose, &(point + step)) - problem.residual(0, &pose, &(point - step))) / (2.0 * h);
            assert!((slope - line.point.column(i)).norm() < 1e-4, "{i}: {slope} {}", line.point.column(i));
        }
    }

    #[test]
    fn projection_is_the_calibrations() {
        let ray = Vector2::new(0.3, -0.2);
        let expected = crate::core::camera::project(&CAMERA, &ray.push(1.0));
        assert!((project(&CAMERA, 1.0, &ray).0 - expected).norm() < 1e-12);
    }

    #[test]
    fn tangents_are_across_and_named_by_axes() {
        let t = tangent(&UnitVector3::new_normalize(Vector3::new(-1.0, 0.0, 0.0)));
        assert_eq!(t, Matrix3x2::new(0.0, 0.0, 1.0, 0.0, 0.0, 1.0));
        for direction in [Vector3::new(-1.0, 0.2, 0.1), Vector3::y(), Vector3::z(), -Vector3::y()] {
            let direction = UnitVector3::new_normalize(direction);
            let t = tangent(&direction);
            assert!((t.tr_mul(&t) - Matrix2::identity()).norm() < 1e-12 && t.tr_mul(direction.as_ref()).norm() < 1e-12);
        }
    }
}
