//! The normal equations of one guess, in blocks.

use halcyon_model::CameraIntrinsics;
use nalgebra::{Matrix2x3, Matrix3, Matrix6, SMatrix, Vector2, Vector6};

use super::{Guess, LEFT, RIG, RIGHT, SHARED, Scene, Seen, SharedMatrix, SharedVector, WARP};
use crate::core::calibrate::board::BoardSpec;
use crate::core::calibrate::sighting::Pose;
use crate::core::camera::{self, INTRINSICS};

/// What a row of the left picture depends on: warp, left intrinsics, pose; and the residual.
const LEFT_ROW: usize = 2 + INTRINSICS + 6 + 1;
/// What a row of the right picture depends on: warp, right intrinsics, rig, pose; and the residual.
const RIGHT_ROW: usize = 2 + INTRINSICS + 6 + 6 + 1;

/// JᵀJ and Jᵀr (r = seen − predicted, J the slopes of the prediction), and Σ r².
#[derive(Debug, Clone)]
pub(super) struct Normal {
    pub(super) shared: SharedMatrix,
    pub(super) gradient: SharedVector,
    pub(super) views: Vec<ViewNormal>,
    /// Sum of squared residuals, square pixels.
    pub(super) cost_px2: f64,
}

/// One view's part.
#[derive(Debug, Clone)]
pub(super) struct ViewNormal {
    pub(super) pose: Matrix6<f64>,
    pub(super) cross: SMatrix<f64, SHARED, 6>,
    pub(super) gradient: Vector6<f64>,
}

impl Normal {
    /// `None` where a corner would lie behind a camera.
    pub(super) fn new(scene: &Scene, guess: &Guess) -> Option<Self> {
        let mut normal = Self {
            shared: SharedMatrix::zeros(),
            gradient: SharedVector::zeros(),
            views: Vec::with_capacity(scene.views.len()),
            cost_px2: 0.0,
        };
        for (view, pose) in scene.views.iter().zip(&guess.poses) {
            let left = left_rows(&scene.board, guess, pose, &view.left)?;
            let right = right_rows(&scene.board, guess, pose, &view.right)?;
            let mut part = ViewNormal { pose: Matrix6::zeros(), cross: SMatrix::zeros(), gradient: Vector6::zeros() };
            normal.add(&mut part, &left, &[(WARP, 2), (LEFT, INTRINSICS)]);
            normal.add(&mut part, &right, &[(WARP, 2), (RIGHT, INTRINSICS), (RIG, 6)]);
            normal.views.push(part);
        }
        normal.cost_px2.is_finite().then_some(normal)
    }

    /// Adds rows' products where they belong. `blocks` are the shared unknowns (start, count) that come before the six of the pose.
    fn add<const N: usize>(&mut self, part: &mut ViewNormal, rows: &[[f64; N]; N], blocks: &[(usize, usize)]) {
        let mut shared = blocks.iter().flat_map(|&(start, count)| start..start + count);
        let places: [usize; N] = std::array::from_fn(|_| shared.next().unwrap_or(0));
        let (pose, residual) = (N - 7, N - 1);
        for i in 0..pose {
            let place = places[i];
            for j in i..pose {
                self.shared[(place, places[j])] += rows[i][j];
                if j > i {
                    self.shared[(places[j], place)] += rows[i][j];
                }
            }
            for k in 0..6 {
                part.cross[(place, k)] += rows[i][pose + k];
            }
            self.gradient[place] += rows[i][residual];
        }
        for i in 0..6 {
            for j in i..6 {
                part.pose[(i, j)] += rows[pose + i][pose + j];
                if j > i {
                    part.pose[(j, i)] += rows[pose + i][pose + j];
                }
            }
            part.gradient[i] += rows[pose + i][residual];
        }
        self.cost_px2 += rows[residual][residual];
    }
}

/// Sum of squared residuals, square pixels; infinite where a corner would lie behind a camera.
pub(super) fn cost_px2(scene: &Scene, guess: &Guess) -> f64 {
    let mut sum = 0.0;
    for (view, pose) in scene.views.iter().zip(&guess.poses) {
        for seen in &view.left {
            let in_left = pose.apply(&scene.board.corner_m(seen.corner, &guess.warp_m));
            sum += (seen.pixel - camera::project(&guess.left, &in_left)).norm_squared();
        }
        for seen in &view.right {
            let in_left = pose.apply(&scene.board.corner_m(seen.corner, &guess.warp_m));
            let in_right = guess.right_from_left * in_left + guess.right_from_left_m;
            sum += (seen.pixel - camera::project(&guess.right, &in_right)).norm_squared();
        }
    }
    if sum.is_nan() { f64::INFINITY } else { sum }
}

fn left_rows(board: &BoardSpec, guess: &Guess, pose: &Pose, seen: &[Seen]) -> Option<[[f64; LEFT_ROW]; LEFT_ROW]> {
    let mut rows = [[0.0; LEFT_ROW]; LEFT_ROW];
    let lift = pose.camera_from_board.column(2).into_owned();
    for seen in seen {
        let turned = pose.camera_from_board * board.corner_m(seen.corner, &guess.warp_m);
        let (off, by_point, by_camera) = one(&guess.left, &(turned + pose.camera_from_board_m), seen)?;
        let by_turn = turned_slopes(&by_point, &turned);
        let (by_lift, bulge) = (by_point * lift, board.bulge(seen.corner));
        for axis in 0..2 {
            let mut row = [0.0; LEFT_ROW];
            row[0] = by_lift[axis] * bulge.x;
            row[1] = by_lift[axis] * bulge.y;
            for k in 0..INTRINSICS {
                row[2 + k] = by_camera[(axis, k)];
            }
            for k in 0..3 {
                row[2 + INTRINSICS + k] = by_turn[(axis, k)];
                row[5 + INTRINSICS + k] = by_point[(axis, k)];
            }
            row[LEFT_ROW - 1] = off[axis];
            accumulate(&mut rows, &row);
        }
    }
    Some(rows)
}

fn right_rows(board: &BoardSpec, guess: &Guess, pose: &Pose, seen: &[Seen]) -> Option<[[f64; RIGHT_ROW]; RIGHT_ROW]> {
    let mut rows = [[0.0; RIGHT_ROW]; RIGHT_ROW];
    let rotation = &guess.right_from_left;
    let lift = rotation * pose.camera_from_board.column(2);
    for seen in seen {
        let turned = pose.camera_from_board * board.corner_m(seen.corner, &guess.warp_m);
        let about_right = rotation * (turned + pose.camera_from_board_m);
        let (off, by_point, by_camera) = one(&guess.right, &(about_right + guess.right_from_left_m), seen)?;
        let by_left: Matrix2x3<f64> = by_point * rotation;
        let (by_rig_turn, by_turn) = (turned_slopes(&by_point, &about_right), turned_slopes(&by_left, &turned));
        let (by_lift, bulge) = (by_point * lift, board.bulge(seen.corner));
        for axis in 0..2 {
            let mut row = [0.0; RIGHT_ROW];
            row[0] = by_lift[axis] * bulge.x;
            row[1] = by_lift[axis] * bulge.y;
            for k in 0..INTRINSICS {
                row[2 + k] = by_camera[(axis, k)];
            }
            for k in 0..3 {
                row[2 + INTRINSICS + k] = by_rig_turn[(axis, k)];
                row[5 + INTRINSICS + k] = by_point[(axis, k)];
                row[8 + INTRINSICS + k] = by_turn[(axis, k)];
                row[11 + INTRINSICS + k] = by_left[(axis, k)];
            }
            row[RIGHT_ROW - 1] = off[axis];
            accumulate(&mut rows, &row);
        }
    }
    Some(rows)
}

/// Residual and slopes of one corner in one picture.
fn one(
    camera: &CameraIntrinsics,
    point_m: &nalgebra::Vector3<f64>,
    seen: &Seen,
) -> Option<(Vector2<f64>, Matrix2x3<f64>, SMatrix<f64, 2, INTRINSICS>)> {
    let (pixel, slopes) = camera::project_with_slopes(camera, point_m)?;
    Some((seen.pixel - pixel, slopes.by_point, slopes.by_intrinsics))
}

/// A small turn w moves a point p by w × p: slopes by w from slopes by p.
fn turned_slopes(by_point: &Matrix2x3<f64>, turned: &nalgebra::Vector3<f64>) -> Matrix2x3<f64> {
    let cross: Matrix3<f64> = turned.cross_matrix();
    -(by_point * cross)
}

/// Adds a row's products to the upper triangle.
#[inline]
fn accumulate<const N: usize>(rows: &mut [[f64; N]; N], row: &[f64; N]) {
    for (i, sums) in rows.iter_mut().enumerate() {
        let factor = row[i];
        for (sum, value) in sums[i..].iter_mut().zip(&row[i..]) {
            *sum += factor * value;
        }
    }
}
