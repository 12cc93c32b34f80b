//! The pose of a rig's cameras to each other from what they see, without a board (thesis 8.2.1).
//!
//! All pairs are of one rig, so all their matches say the same R and t. A robust start (five or eight points within RANSAC, and
//! the calibration in force) is followed by bundle adjustment over R, the direction of t and every point. Two views fix no
//! scale: a known baseline or a known altitude does.
//!
//! [`DriftWatch`] is the small brother for a rig in flight: it only watches the rows of rectified pairs.

mod bundle;
mod drift;
mod fit;
mod flat;
mod rows;
mod scale;

use bundle::{Bundle, Pose};
pub use drift::{Drift, DriftSettings, DriftWatch, RowMatch, row_matches};
use fit::Fit;
use halcyon_model::RigCalibration;
use nalgebra::{Matrix3, Vector2, Vector3};
pub use rows::RowErrors;

use super::epipolar::{PointPair, Rays};

/// Parallax below this, pixels, is none, however small the noise.
const PARALLAX_PX_MIN: f64 = 0.1;

/// How the robust start is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// Five points, OpenCV's: copes with flat water.
    FivePoint,
    /// Eight points, ours: needs depth in the scene.
    EightPoint,
}

/// What fixes the length of the baseline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Scale {
    /// Keep that of the calibration in force.
    Given,
    /// Its length, metres.
    Baseline(f64),
    /// Distance from the left camera along its optical axis to the water or ground, metres, in the middle of all pairs.
    Altitude(f64),
}

/// How to self-calibrate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The robust start.
    pub solver: Solver,
    /// RANSAC's threshold, pixels.
    pub threshold_px: f64,
    /// Also estimate one factor on all four focal lengths. A rig with parallel cameras hardly shows it: refused where it stays open.
    pub refine_focal: bool,
    /// The scale.
    pub scale: Scale,
    /// Fewer matches that agree are too few.
    pub matches_min: usize,
    /// Row error by which a calibration has drifted, pixels RMS.
    pub drift_px_max: f64,
    /// For the random choices.
    pub seed: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            solver: Solver::FivePoint,
            threshold_px: 1.0,
            refine_focal: false,
            scale: Scale::Given,
            matches_min: 50,
            drift_px_max: 0.5,
            seed: 1,
        }
    }
}

/// Why there is no pose.
#[derive(Debug, thiserror::Error)]
pub enum SelfCalibrateError {
    /// Too few matches.
    #[error("{matches} matches between left and right are too few: at least {needed} are needed (more pairs, or more texture)")]
    TooFew {
        /// What there is.
        matches: usize,
        /// What is needed.
        needed: usize,
    },
    /// Matches that contradict each other.
    #[error("only {inliers} of {matches} matches agree on one pose of the cameras: at least {needed} must")]
    NoConsensus {
        /// The most that agree.
        inliers: usize,
        /// Matches.
        matches: usize,
        /// What is needed.
        needed: usize,
    },
    /// Two pictures from one place.
    #[error(
        "left and right show the scene from one place (parallax {parallax_px:.2} px): there is no baseline to measure by, or the scene is too far away"
    )]
    NoBaseline {
        /// What a turn of the camera leaves unexplained, pixels.
        parallax_px: f64,
    },
    /// Left is right.
    #[error("the right pictures were taken from the left of the left ones: they are swapped")]
    Swapped,
    /// A scene that leaves the pose open.
    #[error("the scene leaves the cameras' pose open: a flat one needs the five-point solver")]
    Open,
    /// A scene that leaves the focal length open.
    #[error("the pictures leave the focal length open (to {sigma_percent:.1} %): keep the one of the calibration")]
    FocalOpen {
        /// Its standard deviation, per cent.
        sigma_percent: f64,
    },
    /// A number that is none.
    #[error("the {0} is out of range")]
    Invalid(&'static str),
    /// OpenCV failed.
    #[error("OpenCV failed while self-calibrating")]
    OpenCv(#[from] opencv::Error),
}

/// Another pose that explains a flat scene as well.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alternative {
    /// Angle between its R and the chosen one, radians.
    pub rotation_rad: f64,
    /// Angle between its direction and the chosen one, radians.
    pub direction_rad: f64,
}

/// The result.
#[derive(Debug, Clone, PartialEq)]
pub struct SelfCalibration {
    /// The calibration in force with its pose, and focal lengths where asked for, replaced.
    pub rig: RigCalibration,
    /// Matches given.
    pub matches: usize,
    /// Matches used in the end.
    pub inliers: usize,
    /// Standard deviation of a match's place in one picture, along one axis, pixels.
    pub sigma_px: f64,
    /// Turn of the right camera against the calibration in force, about its own x (pitch), y (yaw) and z (roll), radians.
    pub turn_rad: Vector3<f64>,
    /// Its standard deviations, from the scatter of the matches: the lenses are taken as exact.
    pub turn_sigma_rad: Vector3<f64>,
    /// Turn of the baseline's direction against the calibration in force, in the right camera's axes: towards y, towards z, radians.
    pub direction_rad: Vector2<f64>,
    /// Its standard deviations.
    pub direction_sigma_rad: Vector2<f64>,
    /// Length of the baseline, metres.
    pub baseline_m: f64,
    /// Its standard deviation; 0 where it was given.
    pub baseline_sigma_m: f64,
    /// Factor on the focal lengths, and its standard deviation, where asked for.
    pub focal_scale: Option<(f64, f64)>,
    /// Row error of the matches used, with the calibration in force.
    pub before: RowErrors,
    /// The same with the new one.
    pub after: RowErrors,
    /// The part of the row error that the change of pose explains, pixels RMS: free of the matches' own noise.
    pub drift_px: f64,
    /// The calibration in force is off beyond its uncertainty, and by more than the stated row error.
    pub has_drifted: bool,
    /// Whether the matches of each pair lie in one plane.
    pub is_flat: bool,
    /// For a flat scene: another pose that fits as well. The one nearer to the calibration in force was taken.
    pub alternative: Option<Alternative>,
}

/// Finds the pose from `views`, the matched pixels (as taken, not undistorted) of each pair.
///
/// # Errors
/// [`SelfCalibrateError`] for input from which no pose can be known.
pub fn self_calibrate(
    given: &RigCalibration,
    views: &[Vec<PointPair>],
    settings: &Settings,
) -> Result<SelfCalibration, SelfCalibrateError> {
    check(given, settings)?;
    let pixels: Vec<PointPair> = views.iter().flatten().copied().filter(is_finite).collect();
    let too_few = |matches| SelfCalibrateError::TooFew { matches, needed: settings.matches_min };
    if pixels.len() < settings.matches_min {
        return Err(too_few(pixels.len()));
    }
    let rays = Rays::new(&given.left, &given.right)?.of(&pixels)?;
    let focal_px = mean_focal_px(given);
    // Twice the same picture shows no parallax, whatever the two lenses make of it.
    let shift_px = median(&mut pixels.iter().map(|pair| (pair.left - pair.right).norm()).collect::<Vec<_>>());
    let parallax = parallax_px(&rays, focal_px).min(shift_px);
    if parallax.is_nan() || parallax <= PARALLAX_PX_MIN {
        return Err(SelfCalibrateError::NoBaseline { parallax_px: parallax });
    }
    let view_of: Vec<usize> =
        views.iter().enumerate().flat_map(|(view, pairs)| pairs.iter().filter(|p| is_finite(p)).map(move |_| view)).collect();
    let solver = Fit { given, pixels: &pixels, rays: &rays, focal_px, settings };

    let given_pose = Pose::new(given.right_from_left, given.right_from_left_m.normalize());
    let robust = solver.robust_start();
    // A consensus missed by chance or by flatness may still be one near the calibration in force.
    let mut fits: Vec<Bundle> = Vec::new();
    if let Ok(pose) = &robust {
        fits.extend(solver.refine(pose, &[2.0]));
    }
    fits.extend(solver.refine(&given_pose, &[16.0, 4.0, 2.0]));
    let Some(best) = fits.into_iter().min_by(|a, b| solver.cost(&a.pose).total_cmp(&solver.cost(&b.pose))) else {
        return Err(match robust {
            Err(error) => error,
            Ok(_) if parallax < settings.threshold_px => SelfCalibrateError::NoBaseline { parallax_px: parallax },
            Ok(_) => SelfCalibrateError::Open,
        });
    };
    if best.used.len() < settings.matches_min {
        return Err(SelfCalibrateError::NoConsensus {
            inliers: best.used.len(),
            matches: pixels.len(),
            needed: settings.matches_min,
        });
    }
    // Noise of √2 σ in either axis of the difference has a median length of 1.67 σ.
    if parallax < 3.0 * best.sigma_px {
        return Err(SelfCalibrateError::NoBaseline { parallax_px: parallax });
    }
    let (best, is_flat, alternative) = solver.with_twin(best, &given_pose, &view_of)?;
    solver.report(&best, &view_of, is_flat, alternative)
}

fn is_finite(pair: &PointPair) -> bool {
    pair.left.iter().chain(&pair.right).all(|number| number.is_finite())
}

fn mean_focal_px(rig: &RigCalibration) -> f64 {
    (rig.left.fx_px + rig.left.fy_px + rig.right.fx_px + rig.right.fy_px) / 4.0
}

fn check(given: &RigCalibration, settings: &Settings) -> Result<(), SelfCalibrateError> {
    let length = |name, value: f64| {
        if value > 0.0 && value.is_finite() { Ok(()) } else { Err(SelfCalibrateError::Invalid(name)) }
    };
    match settings.scale {
        Scale::Given => {}
        Scale::Baseline(baseline_m) => length("baseline", baseline_m)?,
        Scale::Altitude(altitude_m) => length("altitude", altitude_m)?,
    }
    length("threshold of RANSAC", settings.threshold_px)?;
    length("calibration's baseline", given.baseline_m())?;
    for camera in [&given.left, &given.right] {
        length("calibration's focal length", camera.fx_px.min(camera.fy_px))?;
        let sound = camera.matrix().iter().chain(&camera.distortion).all(|number| number.is_finite());
        if !sound || !super::camera::distortion_is_monotone(camera, given.width_px, given.height_px) {
            return Err(SelfCalibrateError::Invalid("calibration's camera"));
        }
    }
    Ok(())
}

/// What the best turn of the camera alone leaves unexplained: the median over the matches, pixels.
fn parallax_px(rays: &[PointPair], focal_px: f64) -> f64 {
    let unit = |ray: &Vector2<f64>| ray.push(1.0).normalize();
    let mut weights = vec![1.0; rays.len()];
    let mut lengths = vec![0.0; rays.len()];
    let mut parallax = f64::INFINITY;
    for _ in 0..5 {
        // Kabsch: the turn that brings left directions onto right ones.
        let covariance: Matrix3<f64> =
            rays.iter().zip(&weights).map(|(ray, w)| unit(&ray.right) * unit(&ray.left).transpose() * *w).sum();
        let Some(svd) = covariance.try_svd(true, true, f64::EPSILON, 100) else { return f64::NAN };
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return f64::NAN };
        let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
        let turn = u * flip * v_t;
        for (length, ray) in lengths.iter_mut().zip(rays) {
            let seen = turn * ray.left.push(1.0);
            *length = (seen.xy() / seen.z - ray.right).norm() * focal_px;
        }
        parallax = median(&mut lengths.clone());
        // Outliers must not turn it: least absolute deviations.
        for (weight, length) in weights.iter_mut().zip(&lengths) {
            *weight = 1.0 / length.max(0.1 * parallax).max(1e-9);
        }
    }
    parallax
}

/// Reorders; NaN of nothing.
fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { f64::NAN } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

#[cfg(test)]
mod tests;
