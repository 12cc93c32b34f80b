//! Joint bundle adjustment of the stereo rig: all corners of both cameras, all parameters at once.
//!
//! Levenberg-Marquardt on the sum of squared reprojection errors (Triggs et al., "Bundle adjustment: a modern synthesis", 2000).
//! Every view's board pose touches only its own corners, so the poses are eliminated by the Schur complement and what is left
//! to solve has at most [`SHARED`] unknowns, however many views there are. Derivatives are in closed form. The same normal
//! matrix, at the optimum, gives the covariance of the parameters.
//!
//! Unknowns, in this order: board warp (2), left and right intrinsics (9 each, see [`crate::core::camera::INTRINSICS`]), and the rig's
//! rotation and translation (6); then six for each view's pose. Rotations move by a rotation vector applied from the left.
//! The gauge is fixed by the left camera (origin) and by the size of the board's squares (scale).

mod normal;
mod solve;

use halcyon_model::CameraIntrinsics;
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, Vector2, Vector3, Vector6};

pub(super) use solve::{Solved, covariance, minimise};

use super::board::BoardSpec;
use super::model::DistortionModel;
use super::sighting::{Pose, Side, Sighting};
use crate::core::camera;

/// Unknowns that all views share.
pub(super) const SHARED: usize = RIG + 6;
/// Where the two parameters of the board's warp start.
pub(super) const WARP: usize = 0;
/// Where the left camera's start.
pub(super) const LEFT: usize = WARP + 2;
/// Where the right camera's start.
pub(super) const RIGHT: usize = LEFT + camera::INTRINSICS;
/// Where the rig's rotation vector and then its translation start.
pub(super) const RIG: usize = RIGHT + camera::INTRINSICS;

/// One number for each shared unknown.
pub(super) type SharedVector = SVector<f64, SHARED>;
/// A matrix over the shared unknowns.
pub(super) type SharedMatrix = SMatrix<f64, SHARED, SHARED>;

/// Which of the shared unknowns may move.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Free(pub(super) [bool; SHARED]);

impl Free {
    /// None: only the poses of the boards are sought.
    pub(super) const POSES: Self = Self([false; SHARED]);

    /// All that `model` frees, and the board's warp where asked.
    pub(super) fn rig(model: DistortionModel, warp: bool) -> Self {
        let mut free = [true; SHARED];
        free[WARP..LEFT].fill(warp);
        for at in [LEFT, RIGHT] {
            free[at + 4..at + camera::INTRINSICS].copy_from_slice(&model.frees());
        }
        Self(free)
    }

    /// How many.
    pub(super) fn count(&self) -> usize {
        self.0.iter().filter(|free| **free).count()
    }
}

/// A solution, or a guess at one: the rig, the board's warp and where the board was in each view.
#[derive(Debug, Clone)]
pub(super) struct Guess {
    pub(super) left: CameraIntrinsics,
    pub(super) right: CameraIntrinsics,
    pub(super) right_from_left: Matrix3<f64>,
    pub(super) right_from_left_m: Vector3<f64>,
    /// How far the middle of the board's columns and rows bulges, metres; see [`BoardSpec::corner_m`].
    pub(super) warp_m: Vector2<f64>,
    /// The board in the left camera's axes, view by view.
    pub(super) poses: Vec<Pose>,
}

impl Guess {
    /// The same after a step; `shared` moves only where it isn't zero.
    fn moved(&self, shared: &SharedVector, poses: &[Vector6<f64>]) -> Self {
        let camera = |camera: &CameraIntrinsics, at: usize| {
            let mut parameters = camera::to_parameters(camera);
            parameters.iter_mut().zip(&shared.as_slice()[at..]).for_each(|(parameter, step)| *parameter += step);
            camera::from_parameters(&parameters)
        };
        let turn = Rotation3::new(shared.fixed_rows::<3>(RIG).into_owned());
        Self {
            left: camera(&self.left, LEFT),
            right: camera(&self.right, RIGHT),
            right_from_left: turn.matrix() * self.right_from_left,
            right_from_left_m: self.right_from_left_m + shared.fixed_rows::<3>(RIG + 3),
            warp_m: self.warp_m + shared.fixed_rows::<2>(WARP),
            poses: self.poses.iter().zip(poses).map(|(pose, step)| pose.moved(step)).collect(),
        }
    }

    /// The same with everything at zero that `free` holds: what a simpler model starts from.
    pub(super) fn without(&self, free: &Free) -> Self {
        let mut plain = self.clone();
        for (at, camera) in [(LEFT, &mut plain.left), (RIGHT, &mut plain.right)] {
            for (coefficient, free) in camera.distortion.iter_mut().zip(&free.0[at + 4..]) {
                *coefficient = if *free { *coefficient } else { 0.0 };
            }
        }
        plain.warp_m = if free.0[WARP] { plain.warp_m } else { Vector2::zeros() };
        plain
    }

    /// Seen minus predicted is what a corner has; this is the prediction of `corner` in the left and right picture, pixels;
    /// NaN behind a camera.
    pub(super) fn predict(&self, board: &BoardSpec, pose: &Pose, corner: usize) -> (Vector2<f64>, Vector2<f64>) {
        let in_left = pose.apply(&board.corner_m(corner, &self.warp_m));
        let in_right = self.right_from_left * in_left + self.right_from_left_m;
        (camera::project(&self.left, &in_left), camera::project(&self.right, &in_right))
    }
}

/// A corner and where it was seen, pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    pub(super) corner: usize,
    pub(super) pixel: Vector2<f64>,
}

/// What one view contributes.
#[derive(Debug, Clone, Default)]
pub(super) struct View {
    pub(super) left: Vec<Seen>,
    pub(super) right: Vec<Seen>,
}

impl View {
    pub(super) fn new(sighting: &Sighting) -> Self {
        let side =
            |side: Side| sighting.kept(side).map(|corner| Seen { corner, pixel: sighting.pixel(side, corner) }).collect();
        Self { left: side(Side::Left), right: side(Side::Right) }
    }
}

/// All that was seen, ready to be fitted.
#[derive(Debug, Clone)]
pub(super) struct Scene {
    pub(super) board: BoardSpec,
    pub(super) views: Vec<View>,
}

impl Scene {
    /// Of the sightings that are used, in order.
    pub(super) fn new(sightings: &[Sighting], board: &BoardSpec) -> Self {
        let views = sightings.iter().filter(|sighting| sighting.is_used()).map(View::new).collect();
        Self { board: *board, views }
    }

    /// Corners seen, left and right counted each.
    pub(super) fn corners(&self) -> usize {
        self.views.iter().map(|view| view.left.len() + view.right.len()).sum()
    }
}

#[cfg(test)]
pub(super) fn check_slopes(scene: &Scene, guess: &Guess) {
    use nalgebra::Vector6;

    let normal = normal::Normal::new(scene, guess).unwrap();
    assert!((normal.cost_px2 - normal::cost_px2(scene, guess)).abs() < 1e-9 * normal.cost_px2);
    let still = vec![Vector6::zeros(); guess.poses.len()];
    let close = |by: f64, gradient: f64, what: &str| {
        // The cost falls by twice Jᵀr.
        assert!((by + 2.0 * gradient).abs() < 1e-4 * (1.0 + gradient.abs()), "{what}: {by} {}", -2.0 * gradient);
    };
    for k in 0..SHARED {
        // Steps that move pixels by about a thousandth: of pixels, or of coefficients, radians and metres.
        let h = if (LEFT..RIG).contains(&k) && (k - LEFT) % camera::INTRINSICS < 4 { 1e-3 } else { 1e-5 };
        let cost = |h: f64| normal::cost_px2(scene, &guess.moved(&SharedVector::ith(k, h), &still));
        close((cost(h) - cost(-h)) / (2.0 * h), normal.gradient[k], &format!("shared {k}"));
    }
    for k in 0..6 {
        let cost = |h: f64| {
            let mut poses = still.clone();
            poses[1] = Vector6::ith(k, h);
            normal::cost_px2(scene, &guess.moved(&SharedVector::zeros(), &poses))
        };
        close((cost(1e-5) - cost(-1e-5)) / 2e-5, normal.views[1].gradient[k], &format!("pose {k}"));
    }
}
