//! One pair of pictures in which both cameras saw the board.

use nalgebra::{Matrix3, Matrix6, Rotation3, UnitQuaternion, Vector2, Vector3, Vector6};
use opencv::core::{Mat, Point2f, Point3f, Vector};
use opencv::{Result, calib3d};

use halcyon_model::CameraIntrinsics;

use super::board::BoardSpec;
use super::fit::RigFit;
use crate::core::{camera, cv};

/// Why a view takes no part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ViewProblem {
    /// The board was not found in the left picture.
    NotFoundLeft,
    /// The board was not found in the right picture.
    NotFoundRight,
    /// The board was found in neither.
    NotFound,
    /// The two pictures disagree about where the cameras are: not of the same instant, or swapped or mirrored.
    Inconsistent,
    /// Its reprojection error is far above the other views'.
    LargeError,
}

impl ViewProblem {
    /// For reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::NotFoundLeft => "board not found in the left picture",
            Self::NotFoundRight => "board not found in the right picture",
            Self::NotFound => "board not found in either picture",
            Self::Inconsistent => "left and right disagree with the other views",
            Self::LargeError => "reprojection error far above the other views",
        }
    }
}

/// The board as both cameras saw it once.
#[derive(Debug, Clone)]
pub(super) struct Sighting {
    /// Which of the given pairs.
    pub(super) view: usize,
    /// Corners in the left picture, pixels, row-major.
    pub(super) left: Vec<Point2f>,
    /// The same corners in the right picture.
    pub(super) right: Vec<Point2f>,
    /// Corners that take part.
    pub(super) keep: Vec<bool>,
    pub(super) problem: Option<ViewProblem>,
}

impl Sighting {
    pub(super) fn new(view: usize, left: Vec<Point2f>, right: Vec<Point2f>) -> Self {
        let keep = vec![true; left.len()];
        Self { view, left, right, keep, problem: None }
    }

    pub(super) fn is_used(&self) -> bool {
        self.problem.is_none()
    }

    pub(super) fn kept_corners(&self) -> impl Iterator<Item = usize> {
        self.keep.iter().enumerate().filter_map(|(i, keep)| keep.then_some(i))
    }

    /// Reprojection residuals of every corner, kept or not, under the board pose that suits the kept ones best.
    pub(super) fn residuals(&self, fit: &RigFit, board: &BoardSpec) -> Result<Residuals> {
        let Some(start) = Pose::of_board(board, &self.left, &fit.left)? else {
            return Ok(Residuals::unknown(self.left.len()));
        };
        let mut pose = start;
        for _ in 0..10 {
            let (step, size) = self.pose_step(fit, board, &pose);
            pose = pose.moved(&step);
            if size < 1e-10 {
                break;
            }
        }
        Ok(self.residuals_at(fit, board, &pose))
    }

    fn residuals_at(&self, fit: &RigFit, board: &BoardSpec, pose: &Pose) -> Residuals {
        let both = (0..self.left.len()).map(|i| self.residual_of(i, fit, board, pose));
        let (left, right) = both.unzip();
        Residuals { left, right }
    }

    /// Seen minus predicted, left and right, pixels.
    fn residual_of(&self, corner: usize, fit: &RigFit, board: &BoardSpec, pose: &Pose) -> (Vector2<f64>, Vector2<f64>) {
        let in_left = pose.apply(&board.corner_m(corner));
        let in_right = fit.right_from_left * in_left + fit.right_from_left_m;
        (
            seen(self.left[corner]) - camera::project(&fit.left, &in_left),
            seen(self.right[corner]) - camera::project(&fit.right, &in_right),
        )
    }

    /// One Gauss-Newton step of the board's pose against both pictures, and its length.
    fn pose_step(&self, fit: &RigFit, board: &BoardSpec, pose: &Pose) -> (Vector6<f64>, f64) {
        const H: f64 = 1e-6;
        let moved: [Pose; 6] = std::array::from_fn(|k| pose.moved(&(Vector6::ith(k, H))));
        let (mut normal, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
        for corner in self.kept_corners() {
            let (left, right) = self.residual_of(corner, fit, board, pose);
            let now = [left.x, left.y, right.x, right.y];
            let mut slopes = [Vector6::zeros(); 4];
            for (k, pose) in moved.iter().enumerate() {
                let (left, right) = self.residual_of(corner, fit, board, pose);
                for (row, (then, now)) in [left.x, left.y, right.x, right.y].into_iter().zip(now).enumerate() {
                    slopes[row][k] = (then - now) / H;
                }
            }
            for (slope, residual) in slopes.iter().zip(now) {
                normal += slope * slope.transpose();
                gradient += slope * residual;
            }
        }
        let step = normal.cholesky().map_or_else(Vector6::zeros, |factor| -factor.solve(&gradient));
        (step, step.norm())
    }
}

fn seen(point: Point2f) -> Vector2<f64> {
    Vector2::new(f64::from(point.x), f64::from(point.y))
}

/// Residuals of one view, pixels, in the order of the board's corners.
#[derive(Debug, Clone)]
pub(super) struct Residuals {
    pub(super) left: Vec<Vector2<f64>>,
    pub(super) right: Vec<Vector2<f64>>,
}

impl Residuals {
    fn unknown(corners: usize) -> Self {
        let nan = vec![Vector2::new(f64::NAN, f64::NAN); corners];
        Self { left: nan.clone(), right: nan }
    }
}

/// Where the board is in a camera's axes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pose {
    pub(super) camera_from_board: Matrix3<f64>,
    pub(super) camera_from_board_m: Vector3<f64>,
}

impl Pose {
    /// The board's pose from its corners in one picture; `None` where there is no solution.
    pub(super) fn of_board(board: &BoardSpec, corners: &[Point2f], camera: &CameraIntrinsics) -> Result<Option<Self>> {
        let object: Vector<Point3f> = (0..corners.len()).map(|i| board.corner_point3f(i)).collect();
        let image: Vector<Point2f> = corners.iter().copied().collect();
        let (matrix, distortion) = (cv::mat_from_matrix3(&camera.matrix())?, cv::mat_from_distortion(camera)?);
        let (mut rotation, mut translation) = (Mat::default(), Mat::default());
        let solved = calib3d::solve_pnp(
            &object,
            &image,
            &matrix,
            &distortion,
            &mut rotation,
            &mut translation,
            false,
            calib3d::SOLVEPNP_ITERATIVE,
        );
        if !solved.unwrap_or(false) {
            return Ok(None);
        }
        let camera_from_board = Rotation3::new(cv::vector3_from_mat(&rotation)?).into_inner();
        Ok(Some(Self { camera_from_board, camera_from_board_m: cv::vector3_from_mat(&translation)? }))
    }

    fn apply(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.camera_from_board * point_m + self.camera_from_board_m
    }

    /// Turned and shifted a little in the camera's axes: rotation vector first, then metres.
    fn moved(&self, step: &Vector6<f64>) -> Self {
        let turn = Rotation3::new(step.fixed_rows::<3>(0).into_owned());
        Self {
            camera_from_board: turn.matrix() * self.camera_from_board,
            camera_from_board_m: self.camera_from_board_m + step.fixed_rows::<3>(3),
        }
    }

    /// The other camera's axes from this one's, both having seen the same board.
    pub(super) fn to(self, other: &Self) -> Self {
        let rotation = other.camera_from_board * self.camera_from_board.transpose();
        Self {
            camera_from_board: rotation,
            camera_from_board_m: other.camera_from_board_m - rotation * self.camera_from_board_m,
        }
    }

    /// Angle between two rotations, radians.
    pub(super) fn angle_rad(&self, other: &Self) -> f64 {
        let rotation = |pose: &Self| UnitQuaternion::from_matrix(&pose.camera_from_board);
        rotation(self).angle_to(&rotation(other))
    }
}
