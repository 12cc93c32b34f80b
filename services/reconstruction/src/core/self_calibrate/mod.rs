//! The pose of a rig's cameras to each other from what they see, without a board (thesis 8.2.1).
//!
//! All pairs are of one rig, so all their matches say the same R and t. A robust start (five or eight points within RANSAC, and
//! the calibration in force) is followed by bundle adjustment over R, the direction of t and every point. Two views fix no
//! scale: a known baseline or a known altitude does.
//!
//! [`DriftWatch`] is the small brother for a rig in flight: it only watches the rows of rectified pairs.

mod bundle;
mod drift;
mod flat;
mod rows;
mod scale;

use std::borrow::Cow;

use bundle::{Bundle, Pose};
pub use drift::{Drift, DriftSettings, DriftWatch, RowMatch, row_matches};
use halcyon_model::RigCalibration;
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector, UnitVector3, Vector2, Vector3};
pub use rows::RowErrors;
use rows::RowGeometry;

use super::epipolar::{
    EpipolarError, PointPair, RansacSettings, Rays, essential_from_fundamental, essential_from_pose, find_fundamental,
    five_point, pixels_without_distortion, pose_from_essential, sampson_px2,
};

/// Matches that RANSAC looks at, drawn evenly from all.
const RANSAC_MATCHES_MAX: usize = 3000;
/// A focal length known worse than this, as a share of itself, is not known.
const FOCAL_SIGMA_MAX: f64 = 0.02;
/// What lenses are off by all the same, pixels RMS: unlike the matches' scatter it does not average out. Where an error of this size,
/// of the worst shape, would pass for another focal length, the pictures do not show it.
const LENS_ERROR_PX: f64 = 0.05;
/// Matches further off than this many standard deviations are not used for the final fit.
const OUTLIER_SIGMAS: f64 = 4.0;
/// The 99.9 % point of χ² with five degrees of freedom: beyond it a pose has changed, not scattered.
const CHI2_5_MAX: f64 = 20.515;
/// A match this many times nearer than the middle one pulls at the baseline's direction that many times as hard, and is, over water,
/// a wrong match that happens to lie on its epipolar line: not used.
const NEARNESS_MAX: f64 = 4.0;
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

struct Fit<'a> {
    given: &'a RigCalibration,
    pixels: &'a [PointPair],
    rays: &'a [PointPair],
    focal_px: f64,
    settings: &'a Settings,
}

impl Fit<'_> {
    /// R and t from RANSAC over matches of all pairs together.
    fn robust_start(&self) -> Result<Pose, SelfCalibrateError> {
        let every = self.rays.len().div_ceil(RANSAC_MATCHES_MAX).max(1);
        let thin = |pairs: &[PointPair]| pairs.iter().step_by(every).copied().collect::<Vec<_>>();
        let rays = thin(self.rays);
        let needed = self.settings.matches_min;
        let no_consensus = |inliers| SelfCalibrateError::NoConsensus { inliers, matches: self.pixels.len(), needed };
        let refused = |error| match error {
            EpipolarError::TooFew { points, .. } => SelfCalibrateError::TooFew { matches: points, needed },
            EpipolarError::NoConsensus { inliers, .. } => no_consensus(inliers),
            EpipolarError::Degenerate => SelfCalibrateError::Open,
            EpipolarError::OpenCv(error) => error.into(),
        };
        let essential = match self.settings.solver {
            Solver::FivePoint => five_point(&rays, self.settings.threshold_px / self.focal_px).map_err(refused)?.0,
            Solver::EightPoint => {
                let ideal = pixels_without_distortion(&thin(self.pixels), &self.given.left, &self.given.right)?;
                let ransac = RansacSettings {
                    threshold_px: self.settings.threshold_px,
                    seed: self.settings.seed,
                    ..RansacSettings::default()
                };
                let found = find_fundamental(&ideal, &ransac).map_err(refused)?;
                essential_from_fundamental(&found.fundamental, &self.given.left.matrix(), &self.given.right.matrix())
            }
        };
        let limit = self.limit(1.0);
        let agreeing: Vec<PointPair> = rays.into_iter().filter(|ray| sampson_px2(&essential, ray) <= limit).collect();
        let pose = pose_from_essential(&essential, &agreeing).ok_or_else(|| no_consensus(agreeing.len()))?;
        Ok(Pose::new(pose.right_from_left, pose.direction))
    }

    /// RANSAC's threshold times a factor, squared, in rays.
    fn limit(&self, factor: f64) -> f64 {
        (factor * self.settings.threshold_px / self.focal_px).powi(2)
    }

    /// Bundle adjustment from a start, over matches within ever narrower bounds; ends with those that fit.
    fn refine(&self, start: &Pose, factors: &[f64]) -> Option<Bundle> {
        let mut pose = *start;
        let mut bundle: Option<Bundle> = None;
        for limit in factors.iter().map(|factor| self.limit(*factor)).chain([f64::NAN, f64::NAN]) {
            // The last two rounds go by the noise that the matches have.
            let limit = match &bundle {
                Some(bundle) if limit.is_nan() => (OUTLIER_SIGMAS * bundle.sigma_px.max(0.01) / self.focal_px).powi(2),
                _ => limit,
            };
            let essential = essential_from_pose(&pose.rotation, &pose.direction);
            let rays = self.rays_for(&pose).ok()?;
            let depths = (0..rays.len()).map(|i| (i, pose.inverse_depth(&rays[i])));
            let near: Vec<(usize, f64)> =
                depths.filter(|&(i, inverse)| inverse > 0.0 && sampson_px2(&essential, &rays[i]) <= limit).collect();
            let middle = median(&mut near.iter().map(|(_, inverse)| *inverse).collect::<Vec<_>>());
            let used: Vec<usize> =
                near.into_iter().filter(|(_, inverse)| *inverse <= NEARNESS_MAX * middle).map(|(i, _)| i).collect();
            if used.len() < self.settings.matches_min.max(12) {
                return None;
            }
            let done = bundle::adjust(self.given, self.pixels, &rays, used, &pose, self.settings.refine_focal)?;
            pose = done.pose;
            bundle = Some(done);
        }
        bundle
    }

    /// The rays by a pose's focal lengths.
    fn rays_for(&self, pose: &Pose) -> opencv::Result<Cow<'_, [PointPair]>> {
        if pose.focal_scale == 1.0 {
            return Ok(Cow::Borrowed(self.rays));
        }
        let rig = pose.rig(self.given, 1.0);
        Ok(Cow::Owned(Rays::new(&rig.left, &rig.right)?.of(self.pixels)?))
    }

    /// How well a pose explains all matches: the truncated sum of squared distances, pixels².
    fn cost(&self, pose: &Pose) -> f64 {
        let limit = self.limit(1.0);
        let essential = essential_from_pose(&pose.rotation, &pose.direction);
        let Ok(rays) = self.rays_for(pose) else { return f64::INFINITY };
        let sum: f64 = rays
            .iter()
            .map(|ray| if pose.inverse_depth(ray) > 0.0 { sampson_px2(&essential, ray).min(limit) } else { limit })
            .sum();
        sum * self.focal_px * self.focal_px
    }

    /// Looks for the second pose of a flat scene (Faugeras and Lustman 1988). Where both fit, the nearer to the calibration in
    /// force is taken.
    fn with_twin(
        &self,
        best: Bundle,
        given_pose: &Pose,
        view_of: &[usize],
    ) -> Result<(Bundle, bool, Option<Alternative>), SelfCalibrateError> {
        // Noise of √2 σ along each axis: 99 of 100 true matches lie within three times that.
        let threshold = 3.0 * std::f64::consts::SQRT_2 * best.sigma_px.max(0.05) / self.focal_px;
        let homographies = flat::homographies(self.rays, &best.used, view_of, threshold)?;
        let Some(homographies) = homographies else { return Ok((best, false, None)) };
        let differs = |a: &Pose, b: &Pose| a.rotation_to_rad(b) > 0.01 || a.direction_to_rad(b) > 0.05;
        let mut twin: Option<Bundle> = None;
        for start in flat::poses(&homographies)? {
            if !differs(&start, &best.pose) {
                continue;
            }
            let Some(other) = self.refine(&start, &[2.0]) else { continue };
            // Told apart where the sum of squares says so: ten is 3 σ and then some.
            let worse = (self.cost(&other.pose) - self.cost(&best.pose)) / best.sigma_px.max(0.02).powi(2);
            let better_than_known = twin.as_ref().is_none_or(|known| self.cost(&other.pose) < self.cost(&known.pose));
            if differs(&other.pose, &best.pose) && worse < 10.0 && better_than_known {
                twin = Some(other);
            }
        }
        let Some(twin) = twin else { return Ok((best, true, None)) };
        let off = |pose: &Pose| pose.rotation_to_rad(given_pose) + pose.direction_to_rad(given_pose);
        let (best, twin) = if off(&twin.pose) < off(&best.pose) { (twin, best) } else { (best, twin) };
        let alternative = Alternative {
            rotation_rad: best.pose.rotation_to_rad(&twin.pose),
            direction_rad: best.pose.direction_to_rad(&twin.pose),
        };
        Ok((best, true, Some(alternative)))
    }

    fn report(
        &self,
        best: &Bundle,
        view_of: &[usize],
        is_flat: bool,
        alternative: Option<Alternative>,
    ) -> Result<SelfCalibration, SelfCalibrateError> {
        let given = self.given;
        let given_t = UnitVector3::new_normalize(given.right_from_left_m);
        let given_centre = -(given.right_from_left.transpose() * given.right_from_left_m);
        if (-(best.pose.rotation.transpose() * best.pose.direction)).dot(&given_centre) < 0.0 {
            return Err(SelfCalibrateError::Swapped);
        }
        let sigma = |i: usize| best.covariance[(i, i)].max(0.0).sqrt();
        let focal_scale = self.settings.refine_focal.then(|| (best.pose.focal_scale, sigma(5)));
        if let Some((_, sigma)) = focal_scale {
            let by_lens = LENS_ERROR_PX / best.sigma_px.max(0.01) * (best.used.len() as f64).sqrt() * sigma;
            let sigma = sigma.hypot(by_lens);
            if sigma > FOCAL_SIGMA_MAX {
                return Err(SelfCalibrateError::FocalOpen { sigma_percent: 100.0 * sigma });
            }
        }
        let (baseline_m, baseline_sigma_m) = match self.settings.scale {
            Scale::Given => (given.baseline_m(), 0.0),
            Scale::Baseline(baseline_m) => (baseline_m, 0.0),
            Scale::Altitude(altitude_m) => {
                let (inverse, sigma) = scale::inverse_depth_on_axis(best, view_of).ok_or(SelfCalibrateError::Open)?;
                (altitude_m * inverse, altitude_m * sigma)
            }
        };
        let rig = best.pose.rig(given, baseline_m);
        let turn = best.pose.rotation * given.right_from_left.transpose();
        let turn_rad = Rotation3::from_matrix_unchecked(turn).scaled_axis();
        let direction_rad = bundle::tangent(&given_t).tr_mul(&best.pose.direction);
        let used = |pairs: &[PointPair]| best.used.iter().map(|&i| pairs[i]).collect::<Vec<_>>();
        let (used_rays, used_pixels) = (used(self.rays), used(self.pixels));
        let new_rays =
            if self.settings.refine_focal { Rays::new(&rig.left, &rig.right)?.of(&used_pixels)? } else { used_rays.clone() };
        let (before, after) = (RowGeometry::new(given)?.errors_px(&used_rays), RowGeometry::new(&rig)?.errors_px(&new_rays));
        let drift_px = (before.iter().zip(&after).map(|(b, a)| (b - a) * (b - a)).sum::<f64>() / before.len() as f64).sqrt();
        let pose_covariance: SMatrix<f64, 5, 5> = best.covariance.fixed_view::<5, 5>(0, 0).into_owned();
        let change = SVector::<f64, 5>::from([turn_rad.x, turn_rad.y, turn_rad.z, direction_rad.x, direction_rad.y]);
        let distance = pose_covariance.cholesky().map_or(f64::NAN, |cholesky| change.dot(&cholesky.solve(&change)));
        Ok(SelfCalibration {
            rig,
            matches: self.pixels.len(),
            inliers: best.used.len(),
            sigma_px: best.sigma_px,
            turn_rad,
            turn_sigma_rad: Vector3::new(sigma(0), sigma(1), sigma(2)),
            direction_rad,
            direction_sigma_rad: Vector2::new(sigma(3), sigma(4)),
            baseline_m,
            baseline_sigma_m,
            focal_scale,
            before: RowErrors::new(&before),
            after: RowErrors::new(&after),
            drift_px,
            has_drifted: distance > CHI2_5_MAX && drift_px > self.settings.drift_px_max,
            is_flat,
            alternative,
        })
    }
}

#[cfg(test)]
mod tests;
