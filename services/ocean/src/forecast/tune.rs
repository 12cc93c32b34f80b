//! A spectrum set right by the readings: which period and direction make them likely.

use std::f64::consts::TAU;

use super::ForecastError;
use super::fit::{Forecast, Options};
use super::grid::Grid;
use super::line::{Line, Prior};
use super::reading::Reading;
use crate::dispersion::wavenumber_radpm;

/// What is tried of a spectrum that may be wrong: each period with each turn.
///
/// A fit's own errors hold only as far as its prior does, and a wrong direction shows up in them last. The evidence of the readings (Rasmussen &
/// Williams 2006, section 5.4) is what tells priors apart; it costs a small fit each.
#[derive(Debug, Clone, PartialEq)]
pub struct Search {
    /// Factors of all periods.
    pub period_factors: Vec<f64>,
    /// Turns of all directions, radians clockwise.
    pub turns_rad: Vec<f64>,
    /// Readings at most for each small fit.
    pub readings_max: usize,
    /// Lines at most for each small fit.
    pub lines_max: usize,
}

impl Search {
    /// For a spectrum off by up to a quarter in its period and 45° in its direction: 35 small fits.
    #[must_use]
    pub fn near() -> Self {
        let turns_rad = (-3..=3).map(|i| f64::from(i) * TAU / 24.0).collect();
        Self { period_factors: vec![0.8, 0.9, 1.0, 1.12, 1.25], turns_rad, readings_max: 160, lines_max: 250 }
    }

    /// For a spectrum of frequency alone, good to 15 % in its period, of which the direction is unknown: 48 small fits.
    #[must_use]
    pub fn all_round() -> Self {
        let turns_rad = (0..16).map(|i| f64::from(i) * TAU / 16.0).collect();
        Self { period_factors: vec![0.87, 1.0, 1.15], turns_rad, ..Self::near() }
    }
}

/// A prior set right.
#[derive(Debug, Clone, PartialEq)]
pub struct Tuned {
    /// Lines of the mean of all spectra tried, each by its probability given the readings.
    pub prior: Prior,
    /// Mean factor of periods.
    pub period_factor: f64,
    /// Mean turn, radians clockwise.
    pub turn_rad: f64,
    /// The probability of the most probable of the spectra tried.
    pub share: f64,
}

impl Grid {
    /// Sets `density` (as in [`Self::directional`]) right by `readings`: tries each of `search` on some of them, and takes the mean of
    /// all by their probability, so that what the readings cannot tell stays open.
    ///
    /// # Errors
    /// As [`Self::directional`] and [`Forecast::fit`]; [`ForecastError::NoLines`] for an empty search.
    pub fn tuned(
        &self,
        density: impl Fn(f64, f64) -> f64,
        readings: &[Reading],
        now_s: f64,
        options: &Options,
        search: &Search,
    ) -> Result<Tuned, ForecastError> {
        let small = Options { readings_max: search.readings_max, per_frame_max: options.per_frame_max.min(9), ..*options };
        let readings = super::reading::chosen(readings, now_s, &small);
        let base = Self { lines_max: search.lines_max, ..*self }.directional(&density)?;
        let mut tried = Vec::new();
        for &factor in search.period_factors.iter().filter(|f| f.is_finite() && **f > 0.0) {
            for &turn_rad in &search.turns_rad {
                let prior = base.with_lines(base.lines().iter().map(|line| self.moved(line, factor, turn_rad)))?;
                tried.push((factor, turn_rad, Forecast::fit(&readings, &prior, now_s, &small)?.log_evidence()));
            }
        }
        let best = tried.iter().map(|t| t.2).fold(f64::NEG_INFINITY, f64::max);
        tried.iter_mut().for_each(|t| t.2 = (t.2 - best).exp());
        let sum: f64 = tried.iter().map(|t| t.2).sum();
        if sum.is_nan() || sum < 1.0 {
            return Err(ForecastError::NoLines);
        }
        tried.iter_mut().for_each(|t| t.2 /= sum);
        let mean = |f: fn(&(f64, f64, f64)) -> f64| tried.iter().map(|t| t.2 * f(t)).sum::<f64>();
        let (period_factor, turn_rad) = (mean(|t| t.0), mean(|t| t.1.sin()).atan2(mean(|t| t.1.cos())));
        let share = tried.iter().map(|t| t.2).fold(0.0, f64::max);
        // What is improbable costs time and changes nothing.
        tried.retain(|t| t.2 > 1e-3 * share);
        let slowest = tried.iter().map(|t| t.0).fold(1.0, f64::max);
        let fastest = tried.iter().map(|t| t.0).fold(1.0, f64::min);
        let wide = Self { low_hz: self.low_hz / slowest, high_hz: self.high_hz / fastest, ..*self };
        let mixed =
            |f_hz: f64, rad: f64| tried.iter().map(|t| t.2 * t.0 * density(f_hz * t.0, rad - t.1)).filter(|d| *d > 0.0).sum();
        Ok(Tuned { prior: wide.directional(mixed)?, period_factor, turn_rad, share })
    }

    fn moved(&self, line: &Line, factor: f64, turn_rad: f64) -> Line {
        let omega_radps = line.omega_radps / factor;
        let towards_rad = line.k_east_radpm.atan2(line.k_north_radpm) + turn_rad;
        let k_radpm = wavenumber_radpm(omega_radps, self.depth);
        let (east, north) = towards_rad.sin_cos();
        Line { k_north_radpm: k_radpm * north, k_east_radpm: k_radpm * east, omega_radps, ..*line }
    }
}
