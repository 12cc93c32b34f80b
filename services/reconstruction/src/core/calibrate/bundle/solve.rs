//! Levenberg-Marquardt, and the covariance where it ends.

use nalgebra::{Matrix6, Vector6};

use super::normal::{Normal, cost_px2};
use super::{Free, Guess, SHARED, Scene, SharedMatrix, SharedVector};

/// Steps are seldom above 20; a start that needs more than this is going nowhere.
const STEPS_MAX: u32 = 100;
/// Ends when a step gains less than this share of the cost.
const GAIN_MIN: f64 = 1e-11;
/// Damping beyond which no step is left.
const DAMPING_MAX: f64 = 1e12;

/// Where a search ended.
#[derive(Debug, Clone)]
pub(in crate::core::calibrate) struct Solved {
    pub(in crate::core::calibrate) guess: Guess,
    /// Sum of squared residuals over both coordinates of all corners, square pixels.
    pub(in crate::core::calibrate) cost_px2: f64,
}

impl Solved {
    /// Root mean square **distance** from seen to predicted corner, pixels: as OpenCV's `stereoCalibrate` reports it.
    pub(in crate::core::calibrate) fn rms_px(&self, scene: &Scene) -> f64 {
        (self.cost_px2 / scene.corners() as f64).sqrt()
    }
}

/// How a search ended: `None` where the start is behind a camera, or the unknowns are not determined.
pub(in crate::core::calibrate) type Outcome = Option<Solved>;

/// Moves the free unknowns and all poses to the nearest minimum of the squared residuals.
pub(in crate::core::calibrate) fn minimise(scene: &Scene, start: &Guess, free: &Free) -> Outcome {
    let mut normal = Normal::new(scene, start)?;
    let mut guess = start.clone();
    // Nielsen's damping: shrinks smoothly with good steps, grows ever faster with bad ones.
    let (mut damping, mut growth) = (1e-3, 2.0);
    let mut steps = 0;
    while steps < STEPS_MAX && damping < DAMPING_MAX {
        steps += 1;
        let Some(step) = Step::new(&normal, free, damping) else {
            damping *= growth;
            growth *= 2.0;
            continue;
        };
        let then = guess.moved(&step.shared, &step.poses);
        let cost = cost_px2(scene, &then);
        let gained = normal.cost_px2 - cost;
        if gained >= 0.0 && cost.is_finite() {
            let done = gained <= GAIN_MIN * normal.cost_px2;
            let quality = gained / step.promised_px2.max(f64::MIN_POSITIVE);
            damping = (damping * (1.0 - (2.0 * quality - 1.0).powi(3)).clamp(1.0 / 10.0, 2.0)).max(1e-15);
            growth = 2.0;
            guess = then;
            if done {
                return Some(Solved { guess, cost_px2: cost });
            }
            normal = Normal::new(scene, &guess)?;
        } else {
            // Rounding keeps the last step from gaining: that is the minimum, not a failure.
            if step.promised_px2 <= GAIN_MIN * normal.cost_px2 {
                break;
            }
            damping *= growth;
            growth *= 2.0;
        }
    }
    let cost_px2 = normal.cost_px2;
    Some(Solved { guess, cost_px2 })
}

/// One damped step.
struct Step {
    shared: SharedVector,
    poses: Vec<Vector6<f64>>,
    /// What the linear model says the cost will fall by.
    promised_px2: f64,
}

impl Step {
    fn new(normal: &Normal, free: &Free, damping: f64) -> Option<Self> {
        let mut reduced = normal.shared;
        let mut gradient = normal.gradient;
        for i in 0..SHARED {
            reduced[(i, i)] += damping * normal.shared[(i, i)];
        }
        let mut inverses: Vec<Matrix6<f64>> = Vec::with_capacity(normal.views.len());
        for view in &normal.views {
            let damped = view.pose + Matrix6::from_diagonal(&(view.pose.diagonal() * damping));
            let inverse = damped.cholesky()?.inverse();
            let weighed = view.cross * inverse;
            reduced -= weighed * view.cross.transpose();
            gradient -= weighed * view.gradient;
            inverses.push(inverse);
        }
        hold(&mut reduced, free);
        for i in (0..SHARED).filter(|&i| !free.0[i]) {
            gradient[i] = 0.0;
        }
        let shared = reduced.cholesky()?.solve(&gradient);
        let poses: Vec<Vector6<f64>> = normal
            .views
            .iter()
            .zip(&inverses)
            .map(|(view, inverse)| inverse * (view.gradient - view.cross.tr_mul(&shared)))
            .collect();
        // ½ hᵀ(λ D h + g), twice.
        let mut promised_px2 =
            (0..SHARED).map(|i| shared[i] * (damping * normal.shared[(i, i)] * shared[i] + normal.gradient[i])).sum::<f64>();
        for (view, step) in normal.views.iter().zip(&poses) {
            promised_px2 += (0..6).map(|i| step[i] * (damping * view.pose[(i, i)] * step[i] + view.gradient[i])).sum::<f64>();
        }
        Some(Self { shared, poses, promised_px2 })
    }
}

/// Takes the unknowns that may not move out of a matrix.
fn hold(matrix: &mut SharedMatrix, free: &Free) {
    for i in (0..SHARED).filter(|&i| !free.0[i]) {
        matrix.row_mut(i).fill(0.0);
        matrix.column_mut(i).fill(0.0);
        matrix[(i, i)] = 1.0;
    }
}

/// Covariance of the shared unknowns at a solution: the inverse of the reduced normal matrix, scaled by the residuals' own
/// variance, σ̂² = Σr² / (numbers − unknowns). Rows of what was not free are zero. `None` where they are not determined.
pub(in crate::core::calibrate) fn covariance(scene: &Scene, solved: &Solved, free: &Free) -> Option<SharedMatrix> {
    let normal = Normal::new(scene, &solved.guess)?;
    let mut reduced = normal.shared;
    for view in &normal.views {
        reduced -= view.cross * view.pose.cholesky()?.inverse() * view.cross.transpose();
    }
    hold(&mut reduced, free);
    // Unknowns differ by six orders of magnitude: unit diagonal first, so that the Cholesky test for "determined" means something.
    let scale = reduced.diagonal().map(|value| 1.0 / value.sqrt());
    let scaled = SharedMatrix::from_fn(|i, j| reduced[(i, j)] * scale[i] * scale[j]);
    let inverse = scaled.cholesky()?.inverse();
    let numbers = 2 * scene.corners();
    let unknowns = free.count() + 6 * scene.views.len();
    let variance_px2 = normal.cost_px2 / numbers.checked_sub(unknowns).filter(|left| *left > 0)? as f64;
    let mut covariance = SharedMatrix::from_fn(|i, j| inverse[(i, j)] * scale[i] * scale[j] * variance_px2);
    for i in (0..SHARED).filter(|&i| !free.0[i]) {
        covariance.row_mut(i).fill(0.0);
        covariance.column_mut(i).fill(0.0);
    }
    covariance.iter().all(|value| value.is_finite()).then_some(covariance)
}
