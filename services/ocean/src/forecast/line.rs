//! Plane waves with a prior variance, and what the waves that none of them stands for add.

use super::ForecastError;

/// A plane wave as the prior knows it: elevation a cos(k·x − ωt) + b sin(k·x − ωt), with a and b independent, normal, of mean 0 and
/// variance `variance_m2` each, which then is the elevation's own variance. It travels towards k.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Wavenumber northwards, radians per metre.
    pub k_north_radpm: f64,
    /// Wavenumber eastwards, radians per metre.
    pub k_east_radpm: f64,
    /// Angular frequency, radians per second.
    pub omega_radps: f64,
    /// Variance of elevation, m².
    pub variance_m2: f64,
}

/// Variances of elevation, slopes and vertical speed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Variances {
    /// Of elevation, m².
    pub elevation_m2: f64,
    /// Of the slope northwards.
    pub slope_north: f64,
    /// Of the slope eastwards.
    pub slope_east: f64,
    /// Covariance of both slopes.
    pub slope_covariance: f64,
    /// Of vertical speed, m²/s².
    pub vertical_speed_m2ps2: f64,
}

impl Variances {
    fn add(&mut self, line: &Line) {
        self.elevation_m2 += line.variance_m2;
        self.slope_north += line.variance_m2 * line.k_north_radpm.powi(2);
        self.slope_east += line.variance_m2 * line.k_east_radpm.powi(2);
        self.slope_covariance += line.variance_m2 * line.k_north_radpm * line.k_east_radpm;
        self.vertical_speed_m2ps2 += line.variance_m2 * line.omega_radps.powi(2);
    }

    /// In the order elevation, slope north, slope east, vertical speed.
    pub(super) fn as_array(&self) -> [f64; 4] {
        [self.elevation_m2, self.slope_north, self.slope_east, self.vertical_speed_m2ps2]
    }
}

/// The sea before any reading: checked lines, and the variances of the waves left out of them.
///
/// Waves left out are taken to be short, so that they are noise to each reading and cannot be foretold: they add to the noise of each
/// reading and to the variance of each forecast.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    pub(super) lines: Vec<Line>,
    pub(super) rest: Variances,
    pub(super) sea: Variances,
    /// From the oldest reading to the last forecast that the lines are good for, seconds.
    pub(super) span_s: f64,
    /// Across readings and spots that the lines are good for, metres.
    pub(super) extent_m: f64,
}

impl Prior {
    /// Checks and takes `lines`; with none left out. Lines of variance 0 are dropped. Each is taken to be a wave, which will go on for ever: lines
    /// that stand for bands of a spectrum come from a [`Grid`](super::Grid), which knows how far they are good.
    ///
    /// # Errors
    /// [`ForecastError::Line`] where a number is not finite or a variance is negative; [`ForecastError::NoLines`] where nothing is left.
    pub fn new(lines: impl IntoIterator<Item = Line>) -> Result<Self, ForecastError> {
        let mut kept = Vec::new();
        let mut sea = Variances::default();
        for (index, line) in lines.into_iter().enumerate() {
            let Line { k_north_radpm, k_east_radpm, omega_radps, variance_m2 } = line;
            // Far above any sea, and their squares' products do not overflow.
            let sane = [k_north_radpm, k_east_radpm, omega_radps, variance_m2].iter().all(|x| x.abs() < 1e30);
            if !sane || variance_m2 < 0.0 {
                return Err(ForecastError::Line { index });
            }
            if variance_m2 > 0.0 {
                sea.add(&line);
                kept.push(line);
            }
        }
        if kept.is_empty() {
            return Err(ForecastError::NoLines);
        }
        Ok(Self { lines: kept, rest: Variances::default(), sea, span_s: f64::INFINITY, extent_m: f64::INFINITY })
    }

    /// Keeps the `lines_max` lines of the highest variance (at least one) and counts the others among the waves left out.
    #[must_use]
    pub fn with_at_most(mut self, lines_max: usize) -> Self {
        let lines_max = lines_max.max(1);
        if self.lines.len() > lines_max {
            self.lines.sort_by(|a, b| b.variance_m2.total_cmp(&a.variance_m2));
            self.lines.drain(lines_max..).for_each(|line| self.rest.add(&line));
        }
        self
    }

    /// The same waves left out, and the same bounds, with other lines.
    pub(super) fn with_lines(&self, lines: impl IntoIterator<Item = Line>) -> Result<Self, ForecastError> {
        let mut other = Self { rest: self.rest, span_s: self.span_s, extent_m: self.extent_m, ..Self::new(lines)? };
        let rest = self.rest;
        other.sea.elevation_m2 += rest.elevation_m2;
        other.sea.slope_north += rest.slope_north;
        other.sea.slope_east += rest.slope_east;
        other.sea.slope_covariance += rest.slope_covariance;
        other.sea.vertical_speed_m2ps2 += rest.vertical_speed_m2ps2;
        Ok(other)
    }

    /// The lines.
    #[must_use]
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// What the waves left out add.
    #[must_use]
    pub fn rest(&self) -> Variances {
        self.rest
    }

    /// Variances of the whole sea, waves left out included: the square of a forecast's error where nothing is known.
    #[must_use]
    pub fn sea(&self) -> Variances {
        self.sea
    }
}
