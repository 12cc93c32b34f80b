//! The regression: amplitudes of the lines given the readings.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::ForecastError;
use super::line::Prior;
use super::outlook::Spot;
use super::reading::{Reading, chosen};

/// What is known of the level from which readings of one group are measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Level {
    /// It is the mean water level.
    #[default]
    Known,
    /// Any level, one for each group: so too where each frame's mean has been taken out.
    Free,
    /// Any level and any tilt, for each group: so too where each frame's mean plane has been taken out.
    FreeWithTilt,
}

/// What is used of the readings, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The level of each group of readings.
    pub level: Level,
    /// Readings older than this are not used, seconds.
    pub span_s: f64,
    /// Readings used at most: the work grows with their square times the lines, and with their cube.
    pub readings_max: usize,
    /// Readings of one frame used at most, where there are too many.
    pub per_frame_max: usize,
    /// Where there are too many, frames lie twice as far apart at this age as at 0 s, thrice at twice this age, and so on.
    pub dense_s: f64,
}

impl Default for Options {
    fn default() -> Self {
        Self { level: Level::Known, span_s: 16.0, readings_max: 320, per_frame_max: 16, dense_s: 1.0 }
    }
}

/// The sea given the readings.
#[derive(Debug, Clone)]
pub struct Forecast {
    pub(super) prior: Prior,
    /// Origin of phases: a reading's place, and now.
    pub(super) origin: (f64, f64, f64),
    pub(super) oldest_s: f64,
    /// South-west and north-east of all readings.
    corners: [(f64, f64); 2],
    /// Readings by twice the lines: cos and sin of each line at each reading, times the root of its variance.
    pub(super) features: DMatrix<f64>,
    pub(super) factor: Cholesky<f64, Dyn>,
    /// Mean of the amplitudes given the readings, over the roots of their variances.
    pub(super) amplitudes: DVector<f64>,
    pub(super) inflation: f64,
    used: usize,
    dropped: usize,
    log_evidence: f64,
}

impl Forecast {
    /// Fits the lines of `prior` to `readings` taken up to `now_s`; those that are not finite, have no error above 0, lie ahead or are older
    /// than [`Options::span_s`] are dropped.
    ///
    /// # Errors
    /// [`ForecastError::Now`], [`ForecastError::NoReadings`] and [`ForecastError::Singular`].
    pub fn fit(readings: &[Reading], prior: &Prior, now_s: f64, options: &Options) -> Result<Self, ForecastError> {
        if !now_s.is_finite() {
            return Err(ForecastError::Now);
        }
        let used = chosen(readings, now_s, options);
        let Some(first) = used.first() else { return Err(ForecastError::NoReadings { given: readings.len() }) };
        let origin = (first.north_m, first.east_m, now_s);
        let dropped = readings.iter().filter(|r| !r.is_usable(now_s, options.span_s)).count();
        let oldest_s = used.iter().map(|r| r.t_s).fold(now_s, f64::min);
        let corners = corners(&used);
        let features = features(&used, prior, origin);
        let mut covariance = symmetric_square(&features);
        let mut elevations_m = DVector::from_iterator(used.len(), used.iter().map(|r| r.elevation_m));
        // Far under any reading's error, and enough for the factor of readings that repeat each other.
        let floor_m2 = 1e-12 * prior.sea().elevation_m2;
        for (i, reading) in used.iter().enumerate() {
            covariance[(i, i)] += reading.sigma_m.powi(2) + prior.rest().elevation_m2 + floor_m2;
        }
        let freed = free_levels(&used, options.level, prior, &mut covariance, &mut elevations_m);
        let factor = Cholesky::new(covariance).ok_or(ForecastError::Singular)?;
        let weights = factor.solve(&elevations_m);
        let amplitudes = features.tr_mul(&weights);
        // Over its degrees of freedom this is 1 on average where the prior and the readings' errors are right. Where they are too small
        // it is larger, and so is the error of the forecast; where it is smaller the prior is believed.
        let misfit = elevations_m.dot(&weights);
        let degrees = used.len().saturating_sub(freed);
        let inflation = if degrees > 0 { (misfit / degrees as f64).max(1.0) } else { 1.0 };
        if !inflation.is_finite() {
            return Err(ForecastError::Singular);
        }
        let log_scale = if degrees > 0 { (misfit / degrees as f64).max(f64::MIN_POSITIVE).ln() } else { 0.0 };
        let log_determinant: f64 = 2.0 * factor.l_dirty().diagonal().iter().map(|x| x.ln()).sum::<f64>();
        let log_evidence = -0.5 * (log_determinant + degrees as f64 * log_scale);
        let prior = prior.clone();
        let used = used.len();
        Ok(Self { prior, origin, oldest_s, corners, features, factor, amplitudes, inflation, used, dropped, log_evidence })
    }

    /// Whether the lines are good from all readings to `spot` and `t_s`.
    pub(super) fn reaches(&self, spot: Spot, t_s: f64) -> bool {
        let away = |at: f64, low: f64, high: f64| (at - low).max(high - at);
        let [low, high] = self.corners;
        let away_m = away(spot.north_m, low.0, high.0).hypot(away(spot.east_m, low.1, high.1));
        // Written so that NaN reaches nowhere.
        away_m.is_finite() && away_m <= self.prior.extent_m && t_s.is_finite() && t_s - self.oldest_s <= self.prior.span_s
    }

    /// Readings the forecast rests on.
    #[must_use]
    pub fn used(&self) -> usize {
        self.used
    }

    /// Readings that were not usable.
    #[must_use]
    pub fn dropped(&self) -> usize {
        self.dropped
    }

    /// By how much variances were raised because the readings contradict the prior; 1 where they do not.
    #[must_use]
    pub fn inflation(&self) -> f64 {
        self.inflation
    }

    /// Logarithm of the probability of the readings under this prior, with the best scale of all variances together, up to a constant
    /// that is the same for all priors (Rasmussen & Williams 2006, eq. 2.30). Only for comparing priors on the same readings and options.
    #[must_use]
    pub fn log_evidence(&self) -> f64 {
        self.log_evidence
    }
}

/// The corners of the box that holds all readings, north and east, lowest first.
fn corners(readings: &[Reading]) -> [(f64, f64); 2] {
    readings.iter().fold([(f64::INFINITY, f64::INFINITY), (f64::NEG_INFINITY, f64::NEG_INFINITY)], |[low, high], r| {
        [(low.0.min(r.north_m), low.1.min(r.east_m)), (high.0.max(r.north_m), high.1.max(r.east_m))]
    })
}

/// Cosine and sine of each line at each reading, times the root of its variance.
fn features(readings: &[Reading], prior: &Prior, origin: (f64, f64, f64)) -> DMatrix<f64> {
    let lines = prior.lines();
    let mut features = DMatrix::zeros(readings.len(), 2 * lines.len());
    for (j, line) in lines.iter().enumerate() {
        let root_m = line.variance_m2.sqrt();
        for (i, r) in readings.iter().enumerate() {
            let (north_m, east_m, t_s) = (r.north_m - origin.0, r.east_m - origin.1, r.t_s - origin.2);
            let phase_rad = line.k_north_radpm * north_m + line.k_east_radpm * east_m - line.omega_radps * t_s;
            let (sin, cos) = phase_rad.sin_cos();
            features[(i, 2 * j)] = root_m * cos;
            features[(i, 2 * j + 1)] = root_m * sin;
        }
    }
    features
}

/// The lower triangle of F Fᵀ, by blocks, which is twice as fast as all of it; above it is nothing of use.
fn symmetric_square(f: &DMatrix<f64>) -> DMatrix<f64> {
    const BLOCK: usize = 64;
    let n = f.nrows();
    let transposed = f.transpose();
    let mut square = DMatrix::zeros(n, n);
    for from in (0..n).step_by(BLOCK) {
        let width = BLOCK.min(n - from);
        let (rows, columns) = (f.rows(from, n - from), transposed.columns(from, width));
        square.view_mut((from, from), (n - from, width)).gemm(1.0, &rows, &columns, 0.0);
    }
    square
}

/// Lets each group have any level (and tilt): takes out its mean, and adds to the lower triangle of `covariance` a prior for what is left that is
/// a hundred times as wide as the sea, which is to marginalise it out. Returns how many numbers have been freed.
fn free_levels(
    readings: &[Reading],
    level: Level,
    prior: &Prior,
    covariance: &mut DMatrix<f64>,
    elevations_m: &mut DVector<f64>,
) -> usize {
    if level == Level::Known {
        return 0;
    }
    let sea = prior.sea();
    let level_m2 = 1e4 * sea.elevation_m2;
    let tilt = if level == Level::FreeWithTilt { 1e4 * (sea.slope_north + sea.slope_east) } else { 0.0 };
    let mut order: Vec<usize> = (0..readings.len()).collect();
    order.sort_by_key(|&i| readings[i].group);
    let mut freed = 0;
    for group in order.chunk_by(|&a, &b| readings[a].group == readings[b].group) {
        let mean = |f: fn(&Reading) -> f64| group.iter().map(|&i| f(&readings[i])).sum::<f64>() / group.len() as f64;
        let (mean_m, north_m, east_m) = (mean(|r| r.elevation_m), mean(|r| r.north_m), mean(|r| r.east_m));
        let place = |i: usize| (readings[i].north_m - north_m, readings[i].east_m - east_m);
        for &i in group {
            elevations_m[i] -= mean_m;
            for &j in group.iter().filter(|&&j| j <= i) {
                let ((a, b), (c, d)) = (place(i), place(j));
                covariance[(i, j)] += level_m2 + tilt * (a * c + b * d);
            }
        }
        freed += if level == Level::FreeWithTilt { group.len().min(3) } else { 1 };
    }
    freed
}
