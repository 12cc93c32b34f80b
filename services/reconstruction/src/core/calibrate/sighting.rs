//! One pair of pictures in which both cameras saw the board.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3, Vector6};
use opencv::core::{Mat, Point2f, Point3f, Vector};
use opencv::{Result, calib3d};

use halcyon_model::CameraIntrinsics;

use super::board::BoardSpec;
use super::bundle::Guess;
use crate::core::cv;

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

/// Which camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
}

impl Side {
    pub(super) const BOTH: [Self; 2] = [Self::Left, Self::Right];
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
    /// Left corners that take part.
    pub(super) keep_left: Vec<bool>,
    /// Right corners that take part.
    pub(super) keep_right: Vec<bool>,
    pub(super) problem: Option<ViewProblem>,
}

impl Sighting {
    pub(super) fn new(view: usize, left: Vec<Point2f>, right: Vec<Point2f>) -> Self {
        let keep = vec![true; left.len()];
        Self { view, left, right, keep_left: keep.clone(), keep_right: keep, problem: None }
    }

    pub(super) fn is_used(&self) -> bool {
        self.problem.is_none()
    }

    pub(super) fn corners(&self, side: Side) -> &[Point2f] {
        match side {
            Side::Left => &self.left,
            Side::Right => &self.right,
        }
    }

    pub(super) fn keep(&self, side: Side) -> &[bool] {
        match side {
            Side::Left => &self.keep_left,
            Side::Right => &self.keep_right,
        }
    }

    /// Corners that take part in one picture.
    pub(super) fn kept(&self, side: Side) -> impl Iterator<Item = usize> {
        self.keep(side).iter().enumerate().filter_map(|(i, keep)| keep.then_some(i))
    }

    /// Corners that take part in both pictures.
    pub(super) fn kept_in_both(&self) -> impl Iterator<Item = usize> {
        self.kept(Side::Left).filter(|&i| self.keep_right[i])
    }

    /// How many corners take part, left and right counted each.
    pub(super) fn kept_count(&self) -> usize {
        Side::BOTH.into_iter().map(|side| self.kept(side).count()).sum()
    }

    /// Leaves a corner out of one picture.
    pub(super) fn drop_corner(&mut self, side: Side, corner: usize) {
        match side {
            Side::Left => self.keep_left[corner] = false,
            Side::Right => self.keep_right[corner] = false,
        }
    }

    pub(super) fn pixel(&self, side: Side, corner: usize) -> Vector2<f64> {
        let point = self.corners(side)[corner];
        Vector2::new(f64::from(point.x), f64::from(point.y))
    }

    /// Seen minus predicted of every corner, kept or not, with the board at `pose`.
    pub(super) fn residuals(&self, board: &BoardSpec, guess: &Guess, pose: &Pose) -> Residuals {
        let both = (0..self.left.len()).map(|i| {
            let (left, right) = guess.predict(board, pose, i);
            (self.pixel(Side::Left, i) - left, self.pixel(Side::Right, i) - right)
        });
        let (left, right) = both.unzip();
        Residuals { left, right }
    }
}

/// Residuals of one view, pixels, in the order of the board's corners.
#[derive(Debug, Clone)]
pub(super) struct Residuals {
    pub(super) left: Vec<Vector2<f64>>,
    pub(super) right: Vec<Vector2<f64>>,
}

impl Residuals {
    pub(super) fn unknown(corners: usize) -> Self {
        let nan = vec![Vector2::new(f64::NAN, f64::NAN); corners];
        Self { left: nan.clone(), right: nan }
    }

    pub(super) fn of(&self, side: Side) -> &[Vector2<f64>] {
        match side {
            Side::Left => &self.left,
            Side::Right => &self.right,
        }
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

    #[inline]
    pub(super) fn apply(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.camera_from_board * point_m + self.camera_from_board_m
    }

    /// Turned and shifted a little in the camera's axes: rotation vector first, then metres.
    pub(super) fn moved(&self, step: &Vector6<f64>) -> Self {
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
