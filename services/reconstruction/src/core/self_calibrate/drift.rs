//! Whether a calibration still holds, watched in flight by the rows of rectified pairs.
//!
//! In a rectified pair a match shares a row. If the right camera has since turned by small angles ω about its own x, y and z, and
//! the baseline's direction has moved by τ_y and τ_z, its row in the right picture is off, to first order, by
//!
//! δ/f = −(1 + y²) ω_x + x y ω_y + x ω_z + (d/f) τ_y − (d/f) y τ_z
//!
//! with (x, y) the ray of the match in the right camera and d its disparity. Five numbers, linear: a least-squares fit over
//! the matches of the last few pairs says how far rows are off, and how sure that is. What the five are singly is often open,
//! over flat water above all; the row error that they make together is not.

use std::collections::VecDeque;

use nalgebra::{SMatrix, SVector};

use super::median;
use crate::core::features::{FeatureError, MatchRule, Method, detect_in, match_features};
use crate::core::rectify::{RectifiedRig, Rectifier};

type Vector5 = SVector<f64, 5>;
type Matrix5 = SMatrix<f64, 5, 5>;

/// Angles that are thinkable before anything is measured, radians, one standard deviation: keeps what matches leave open small.
const PRIOR_RAD: f64 = 0.05;
/// Residuals beyond this many robust standard deviations have no say (Tukey's biweight).
const TUKEY_SIGMAS: f64 = 4.685;
const ROUNDS: u32 = 8;
/// The scatter of rows is taken for at least this, pixels: ORB's places are whole pixels of their level, so that most rows may agree
/// exactly, and those that don't, which hold the drift, must not pass for outliers.
const SIGMA_PX_MIN: f64 = 0.4;

/// A match of a rectified pair.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowMatch {
    /// In the left picture, pixels.
    pub left_x_px: f64,
    /// In the left picture, pixels.
    pub left_y_px: f64,
    /// In the right picture, pixels.
    pub right_x_px: f64,
    /// In the right picture, pixels.
    pub right_y_px: f64,
}

/// What the watch goes by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DriftSettings {
    /// Row error by which a calibration has drifted, pixels RMS over the picture.
    pub row_px_max: f64,
    /// A yaw that changes disparities by more than this is drift, pixels.
    pub disparity_px_max: f64,
    /// Said only when the row error is above it by this many of its standard deviations.
    pub sigmas: f64,
    /// A pair with fewer matches says nothing.
    pub matches_min: usize,
    /// Pairs that are looked at together: the last so many.
    pub pairs: usize,
}

impl Default for DriftSettings {
    fn default() -> Self {
        Self { row_px_max: 0.5, disparity_px_max: 1.0, sigmas: 2.0, matches_min: 40, pairs: 6 }
    }
}

/// How far the calibration has drifted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drift {
    /// Row error that the change makes over the picture, pixels RMS, the matches' own scatter taken out.
    pub row_rms_px: f64,
    /// Its standard deviation.
    pub row_sigma_px: f64,
    /// Turn of the right camera about its x (pitch), y (yaw) and z (roll), radians: a best guess where the scene leaves it open.
    pub turn_rad: [f64; 3],
    /// Its standard deviations.
    pub turn_sigma_rad: [f64; 3],
    /// What the yaw does to disparities in the middle of the picture, pixels: rows hardly show it, distances do.
    pub disparity_px: f64,
    /// Its standard deviation.
    pub disparity_sigma_px: f64,
    /// Matches it is made of.
    pub matches: usize,
    /// Off by more than the stated row error, or by more than the stated disparity, surely.
    pub has_drifted: bool,
}

/// What one pair adds: weighted sums over its matches.
struct PairSums {
    normal: Matrix5,
    right: Vector5,
    /// Mean of a aᵀ, a being what a match's row depends on: turns the five numbers into a mean square row error.
    spread: Matrix5,
    matches: usize,
    focal_px: f64,
}

/// Keypoints of each picture: few, so that a look costs milliseconds.
const KEYPOINTS_MAX: usize = 500;
/// Half the side of ORB's patch, pixels: nearer to what the camera did not see, descriptors see what warping invented.
const PATCH_PX: u32 = 16;

/// The matches of the pair that a rectifier holds, by ORB: cheap, and coarse places average out.
///
/// # Errors
/// [`FeatureError`] for pictures too small.
pub fn row_matches(rectifier: &Rectifier) -> Result<Vec<RowMatch>, FeatureError> {
    let (left, right) = rectifier.grey();
    let (left, right) = (detect_in(left, Method::Orb, KEYPOINTS_MAX)?, detect_in(right, Method::Orb, KEYPOINTS_MAX)?);
    let width_px = rectifier.rig().width_px;
    let seen = |m: &RowMatch| {
        let (x_px, y_px) = (m.left_x_px.round().max(0.0) as u32, m.left_y_px.round().max(0.0) as u32);
        let disparity_px = (m.left_x_px - m.right_x_px) as f32;
        x_px < width_px && rectifier.seen(y_px, PATCH_PX).is_some_and(|row| row.has(x_px, disparity_px))
    };
    Ok(match_features(&left, &right, &MatchRule::default())
        .iter()
        .map(|m| {
            let (l, r) = (&left.keypoints[m.left], &right.keypoints[m.right]);
            RowMatch {
                left_x_px: l.x_px.into(),
                left_y_px: l.y_px.into(),
                right_x_px: r.x_px.into(),
                right_y_px: r.y_px.into(),
            }
        })
        .filter(seen)
        .collect())
}

/// Watches one rig.
pub struct DriftWatch {
    settings: DriftSettings,
    pairs: VecDeque<PairSums>,
}

impl Default for DriftWatch {
    fn default() -> Self {
        Self::new(DriftSettings::default())
    }
}

impl DriftWatch {
    /// With nothing seen yet.
    #[must_use]
    pub fn new(settings: DriftSettings) -> Self {
        Self { settings, pairs: VecDeque::new() }
    }

    /// Forgets: for another rig, or a new calibration.
    pub fn reset(&mut self) {
        self.pairs.clear();
    }

    /// Takes the matches of one pair, outliers among them or not. `None` while too few have been seen to say anything.
    pub fn observe(&mut self, matches: &[RowMatch], rig: &RectifiedRig) -> Option<Drift> {
        if let Some(sums) = self.sum(matches, rig) {
            self.pairs.push_back(sums);
            while self.pairs.len() > self.settings.pairs.max(1) {
                self.pairs.pop_front();
            }
        }
        self.drift()
    }

    fn sum(&self, matches: &[RowMatch], rig: &RectifiedRig) -> Option<PairSums> {
        let (lines, errors_px): (Vec<Vector5>, Vec<f64>) = matches
            .iter()
            .filter(|m| m.left_x_px > m.right_x_px)
            .map(|m| (line(m, rig), m.right_y_px - m.left_y_px))
            .filter(|(line, error_px)| error_px.is_finite() && line.iter().all(|number| number.is_finite()))
            .unzip();
        if lines.len() < self.settings.matches_min.max(10) {
            return None;
        }
        // Robust start: all rows off by the same. Then the five, outliers losing their say round by round.
        let shift_px = median(&mut errors_px.clone());
        let mut deviations: Vec<f64> = errors_px.iter().map(|error| (error - shift_px).abs()).collect();
        let mut sigma_px = (median(&mut deviations) / 0.6745).max(SIGMA_PX_MIN);
        let mut weights: Vec<f64> = errors_px.iter().map(|error| tukey(error - shift_px, sigma_px)).collect();
        let (mut normal, mut right) = (Matrix5::zeros(), Vector5::zeros());
        for _ in 0..ROUNDS {
            (normal, right) = (Matrix5::zeros(), Vector5::zeros());
            for ((line, error_px), weight) in lines.iter().zip(&errors_px).zip(&weights) {
                normal.syger(*weight, line, line, 1.0);
                right += line * (weight * error_px);
            }
            normal.fill_upper_triangle_with_lower_triangle();
            let change = solve(&(normal / (sigma_px * sigma_px)), &(right / (sigma_px * sigma_px)))?.0;
            let residuals: Vec<f64> = lines.iter().zip(&errors_px).map(|(line, error)| error - line.dot(&change)).collect();
            sigma_px = (median(&mut residuals.iter().map(|r| r.abs()).collect::<Vec<_>>()) / 0.6745).max(SIGMA_PX_MIN);
            for (weight, residual) in weights.iter_mut().zip(&residuals) {
                *weight = tukey(*residual, sigma_px);
            }
        }
        let kept = weights.iter().filter(|weight| **weight > 0.0).count();
        if kept < self.settings.matches_min.max(lines.len() / 3) {
            return None;
        }
        let mut spread = Matrix5::zeros();
        for (line, _) in lines.iter().zip(&weights).filter(|(_, weight)| **weight > 0.0) {
            spread.syger(1.0 / kept as f64, line, line, 1.0);
        }
        spread.fill_upper_triangle_with_lower_triangle();
        let per_variance = 1.0 / (sigma_px * sigma_px);
        Some(PairSums {
            normal: normal * per_variance,
            right: right * per_variance,
            spread,
            matches: kept,
            focal_px: rig.focal_px,
        })
    }

    fn drift(&self) -> Option<Drift> {
        if self.pairs.is_empty() {
            return None;
        }
        let normal: Matrix5 = self.pairs.iter().map(|pair| pair.normal).sum();
        let right: Vector5 = self.pairs.iter().map(|pair| pair.right).sum();
        let spread: Matrix5 = self.pairs.iter().map(|pair| pair.spread).sum::<Matrix5>() / self.pairs.len() as f64;
        let (change, covariance) = solve(&normal, &right)?;
        // E[aᵀθ̂]² is too large by what θ̂ scatters: tr(M Σ).
        let scatter = (spread * covariance).trace();
        let mean_square = (change.dot(&(spread * change)) - scatter).max(0.0);
        let row_rms_px = mean_square.sqrt();
        // By first-order propagation; where there is no drift to speak of, what scatter alone would make.
        let slope = spread * change;
        let row_sigma_px = (slope.dot(&(covariance * slope)) / mean_square.max(scatter)).sqrt().max((scatter / 5.0).sqrt());
        let sigma = |i: usize| covariance[(i, i)].max(0.0).sqrt();
        let focal_px = self.pairs.back().map_or(0.0, |pair| pair.focal_px);
        let (disparity_px, disparity_sigma_px) = (focal_px * change[1].abs(), focal_px * sigma(1));
        let DriftSettings { sigmas, row_px_max, disparity_px_max, .. } = self.settings;
        let is_beyond = |value_px: f64, sigma_px: f64, limit_px: f64| value_px - sigmas * sigma_px > limit_px;
        Some(Drift {
            disparity_px,
            disparity_sigma_px,
            row_rms_px,
            row_sigma_px,
            turn_rad: [change[0], change[1], change[2]],
            turn_sigma_rad: [sigma(0), sigma(1), sigma(2)],
            matches: self.pairs.iter().map(|pair| pair.matches).sum(),
            has_drifted: is_beyond(row_rms_px, row_sigma_px, row_px_max)
                || is_beyond(disparity_px, disparity_sigma_px, disparity_px_max),
        })
    }
}

/// How a match's row error, pixels, depends on (ω_x, ω_y, ω_z, τ_y, τ_z).
fn line(m: &RowMatch, rig: &RectifiedRig) -> Vector5 {
    let x = (m.right_x_px - rig.cx_px) / rig.focal_px;
    let y = (m.right_y_px - rig.cy_px) / rig.focal_px;
    let nearness = (m.left_x_px - m.right_x_px) / rig.focal_px;
    Vector5::from([-(1.0 + y * y), x * y, x, nearness, -nearness * y]) * rig.focal_px
}

/// The least-squares answer and its covariance, with a loose prior about no change.
fn solve(normal: &Matrix5, right: &Vector5) -> Option<(Vector5, Matrix5)> {
    let with_prior = normal + Matrix5::identity() / (PRIOR_RAD * PRIOR_RAD);
    let cholesky = with_prior.cholesky()?;
    let change = cholesky.solve(right);
    change.iter().all(|number| number.is_finite()).then(|| (change, cholesky.inverse()))
}

fn tukey(residual: f64, sigma: f64) -> f64 {
    (1.0 - (residual / (TUKEY_SIGMAS * sigma)).powi(2)).max(0.0).powi(2)
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Rotation3, Vector3};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    const RIG: RectifiedRig = RectifiedRig {
        width_px: 320,
        height_px: 240,
        focal_px: 343.0,
        cx_px: 159.5,
        cy_px: 119.5,
        baseline_m: 0.4,
        camera_from_rectified: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    };

    /// Exact projections of points at 4 to 6 m into a right camera that has turned and moved, with noise and lies.
    fn pair(turn: Vector3<f64>, shift_m: Vector3<f64>, sigma_px: f64, lies: f64, seed: u64) -> Vec<RowMatch> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let turn = Rotation3::new(turn);
        let mut matches = Vec::new();
        while matches.len() < 200 {
            let point =
                RIG.ray(random.random_range(5.0..315.0), random.random_range(5.0..235.0)) * random.random_range(4.0..6.0);
            let seen = turn * (point - Vector3::new(RIG.baseline_m, 0.0, 0.0)) + shift_m;
            let mut noise = || sigma_px * (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
            let place = |p: &Vector3<f64>| (RIG.focal_px * p.x / p.z + RIG.cx_px, RIG.focal_px * p.y / p.z + RIG.cy_px);
            let ((lx, ly), (rx, ry)) = (place(&point), place(&seen));
            let mut m = RowMatch {
                left_x_px: lx + noise(),
                left_y_px: ly + noise(),
                right_x_px: rx + noise(),
                right_y_px: ry + noise(),
            };
            if random.random_bool(lies) {
                m.right_y_px = random.random_range(0.0..240.0);
            }
            matches.push(m);
        }
        matches
    }

    /// Root mean square row error that a change makes, by exact projection.
    fn truth_px(turn: Vector3<f64>, shift_m: Vector3<f64>) -> f64 {
        let exact = pair(turn, shift_m, 0.0, 0.0, 99);
        (exact.iter().map(|m| (m.right_y_px - m.left_y_px).powi(2)).sum::<f64>() / exact.len() as f64).sqrt()
    }

    #[test]
    fn drift_is_measured_within_its_uncertainty() {
        let deg = std::f64::consts::PI / 180.0;
        let changes = [
            (Vector3::zeros(), Vector3::zeros()),
            (Vector3::new(0.2, 0.0, 0.0) * deg, Vector3::zeros()),
            (Vector3::new(0.0, 1.5, 0.0) * deg, Vector3::zeros()),
            (Vector3::new(0.0, -0.5, 0.0) * deg, Vector3::zeros()),
            (Vector3::new(0.0, 0.0, 0.6) * deg, Vector3::zeros()),
            (Vector3::zeros(), Vector3::new(0.0, 0.02, 0.0)),
            (Vector3::zeros(), Vector3::new(0.0, 0.0, -0.05)),
            (Vector3::new(-0.4, 0.5, -0.8) * deg, Vector3::new(0.0, 0.01, 0.02)),
        ];
        for (turn, shift_m) in changes {
            let truth_px = truth_px(turn, shift_m);
            let mut watch = DriftWatch::new(DriftSettings::default());
            let mut last = None;
            for seed in 0..6 {
                last = watch.observe(&pair(turn, shift_m, 0.4, 0.2, seed), &RIG);
            }
            let drift = last.unwrap();
            println!("{truth_px:.3} px: {drift:?}");
            let margin_px = 3.0 * drift.row_sigma_px + 0.05 * truth_px;
            assert!((drift.row_rms_px - truth_px).abs() < margin_px, "{truth_px} {drift:?}");
            assert!(drift.row_sigma_px < 0.05, "{drift:?}");
            // Yaw moves rows by f x y ω only, but disparities by f ω: 1.5° make 5 m of water 7.7 m.
            let disparity_px = RIG.focal_px * turn.y.abs();
            assert_eq!(drift.has_drifted, truth_px > 0.5 || disparity_px > 1.5, "{truth_px} {disparity_px} {drift:?}");
            for i in 0..3 {
                let off = drift.turn_rad[i] - turn[i];
                assert!(off.abs() < 4.0 * drift.turn_sigma_rad[i] + 0.05 * turn.norm(), "{i} {turn} {drift:?}");
            }
        }
    }

    #[test]
    fn noise_alone_raises_no_alarm() {
        let alarms = (0..100).filter(|seed| {
            let mut watch = DriftWatch::new(DriftSettings { row_px_max: 0.05, ..DriftSettings::default() });
            watch.observe(&pair(Vector3::zeros(), Vector3::zeros(), 0.8, 0.2, *seed), &RIG).unwrap().has_drifted
        });
        // Against a limit much below the default.
        assert!(alarms.count() <= 5);
    }

    #[test]
    fn a_calibration_put_right_is_forgotten_soon_and_little_says_nothing() {
        let mut watch = DriftWatch::new(DriftSettings::default());
        let (bent, none) = (Vector3::new(0.01, 0.0, 0.0), Vector3::zeros());
        assert_eq!(watch.observe(&[], &RIG), None);
        assert!(watch.observe(&pair(bent, none, 0.4, 0.1, 1), &RIG).unwrap().has_drifted);
        // A pair without matches changes nothing.
        assert!(watch.observe(&pair(bent, none, 0.4, 0.1, 1)[..20], &RIG).unwrap().has_drifted);
        for seed in 0..6 {
            watch.observe(&pair(none, none, 0.4, 0.1, seed), &RIG);
        }
        assert!(!watch.observe(&pair(none, none, 0.4, 0.1, 7), &RIG).unwrap().has_drifted);
        watch.reset();
        assert_eq!(watch.observe(&[], &RIG), None);
        let nan = vec![RowMatch { left_x_px: 5.0, left_y_px: f64::NAN, right_x_px: 1.0, right_y_px: 1.0 }; 100];
        assert_eq!(watch.observe(&nan, &RIG), None);
    }
}
