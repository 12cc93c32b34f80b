//! From matches to a pose: robust start, bundle adjustment over those that agree, the second pose of a flat scene, the report.

use std::borrow::Cow;

use halcyon_model::RigCalibration;
use nalgebra::{Rotation3, SMatrix, SVector, UnitVector3, Vector2, Vector3};

use super::bundle::{self, Bundle, Pose};
use super::rows::{RowErrors, RowGeometry};
use super::{Alternative, Scale, SelfCalibrateError, SelfCalibration, Settings, Solver, flat, median, scale};
use crate::core::epipolar::{
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

/// One rig's matches, and what is asked of them.
pub(super) struct Fit<'a> {
    pub(super) given: &'a RigCalibration,
    pub(super) pixels: &'a [PointPair],
    pub(super) rays: &'a [PointPair],
    pub(super) focal_px: f64,
    pub(super) settings: &'a Settings,
}

impl Fit<'_> {
    /// R and t from RANSAC over matches of all pairs together.
    pub(super) fn robust_start(&self) -> Result<Pose, SelfCalibrateError> {
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
    pub(super) fn refine(&self, start: &Pose, factors: &[f64]) -> Option<Bundle> {
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
    pub(super) fn cost(&self, pose: &Pose) -> f64 {
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
    pub(super) fn with_twin(
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

    pub(super) fn report(
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
        // Rows hardly show a yaw; disparities, and with them every distance, do: by f ω.
        let vergence_px = given.left.fx_px * (turn_rad.y.abs() - 2.0 * sigma(1)).max(0.0);
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
            has_drifted: distance > CHI2_5_MAX && drift_px.max(vergence_px) > self.settings.drift_px_max,
            is_flat,
            alternative,
        })
    }
}
