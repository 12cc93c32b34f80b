//! JONSWAP and Pierson-Moskowitz spectra fitted to an estimate by maximum likelihood, with 95 % intervals.
//!
//! A least-squares fit would hang on the few highest lines, which scatter most: a line's scatter is proportional to its density.
//! The likelihood of chi-square lines weighs each by that. What is compared with the estimate is the density as the taper spreads
//! it, so that segments may be short.
//!
//! Intervals are of the logarithms of height, period and γ (all positive), normal, from the information matrix J and the
//! covariance V of the likelihood's slopes: J⁻¹ V J⁻¹ (White 1982). V is J where lines are independent; under a taper as wide as
//! the peak they are not.

mod found;

pub use found::{FitError, Goodness, JonswapFit, PiersonMoskowitzFit};

use super::likelihood::{Expected, Found, climb};
use super::peak::PeakPeriods;
use super::scatter::Scatter;
use crate::interval::Interval;
use crate::spectrum::{Jonswap, PiersonMoskowitz, Spectrum};
use crate::welch::SampledSpectrum;

/// Two-sided 95 % of the normal distribution.
const NORMAL_95: f64 = 1.959_964;
/// Lines needed: more than twice the parameters.
const LINES_MIN: usize = 8;
/// Frequencies under this share of the peak's have next to no density (0.3 % of it), and what a taper leaks there says nothing.
const FRONT: f64 = 0.6;
/// Periods at most this factor from where the search began.
const PERIOD_FACTOR: f64 = 3.0;

/// An estimate of one wave system, and what is known about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate<'a> {
    /// The spectrum.
    pub spectrum: &'a SampledSpectrum,
    /// How it scatters.
    pub scatter: &'a Scatter,
    /// Frequencies that hold the system and no other, hertz. Above half of the sampling rate's half, folded energy lifts the
    /// tail.
    pub band_hz: (f64, f64),
    /// White noise that the spectrum has on top, m²/Hz; 0 for none.
    pub noise_m2_per_hz: f64,
}

/// Lines that are fitted, and where to begin.
struct Lines<'a> {
    range: std::ops::Range<usize>,
    measured: &'a [f64],
    h_m0_m: f64,
    t_p_s: f64,
}

impl<'a> Estimate<'a> {
    /// The likeliest JONSWAP spectrum (H_m0, T_p, γ) from 0.6 of the peak's frequency on.
    ///
    /// # Errors
    /// [`FitError`] where the band holds too few lines or no energy, or these leave a parameter open.
    pub fn jonswap(&self) -> Result<JonswapFit, FitError> {
        let lines = self.lines()?;
        let gamma_bounds = (0.0, 20.0_f64.ln());
        // Broad and narrow peaks are two hills: climb both.
        let climbs = [1.5_f64, 5.0].into_iter().filter_map(|gamma| self.climb(&lines, gamma, gamma_bounds));
        let found = climbs.max_by(|a, b| a.likelihood.total_cmp(&b.likelihood)).ok_or(FitError::Undetermined)?;
        let [h_m0_m, t_p_s, gamma] = found.theta.map(f64::exp);
        let gamma = gamma.clamp(1.0, 20.0);
        let sea = Jonswap::new(h_m0_m, t_p_s, gamma)?;
        let covariance = self.covariance(&lines, &found, &sea)?;
        let around = |value: f64, i: usize| self.around(value, covariance[i][i]);
        let (gamma_low, gamma_high) = around(gamma, 2);
        Ok(JonswapFit {
            sea,
            h_m0_m: around(h_m0_m, 0),
            t_p_s: around(t_p_s, 1),
            gamma: (gamma_low.max(1.0), gamma_high.min(20.0)),
            goodness: self.goodness(&lines, &sea, 3),
        })
    }

    /// The likeliest Pierson-Moskowitz spectrum (H_m0, T_p) from 0.6 of the peak's frequency on.
    ///
    /// # Errors
    /// [`FitError`] where the band holds too few lines or no energy, or these leave a parameter open.
    pub fn pierson_moskowitz(&self) -> Result<PiersonMoskowitzFit, FitError> {
        let lines = self.lines()?;
        let bounds = lines.bounds();
        let start = [lines.h_m0_m.ln(), lines.t_p_s.ln()];
        let expected = |theta: &[f64; 2]| self.expected(&lines, theta);
        let found = climb(lines.measured, start, &[bounds[0], bounds[1]], expected).ok_or(FitError::Undetermined)?;
        let [h_m0_m, t_p_s] = found.theta.map(f64::exp);
        let sea = PiersonMoskowitz::new(h_m0_m, t_p_s)?;
        let covariance = self.covariance(&lines, &found, &sea)?;
        Ok(PiersonMoskowitzFit {
            sea,
            h_m0_m: self.around(h_m0_m, covariance[0][0]),
            t_p_s: self.around(t_p_s, covariance[1][1]),
            goodness: self.goodness(&lines, &sea, 2),
        })
    }

    /// The lines of the band that a fit can use.
    fn lines(&self) -> Result<Lines<'a>, FitError> {
        if !(self.noise_m2_per_hz >= 0.0 && self.noise_m2_per_hz.is_finite()) {
            return Err(FitError::Noise(self.noise_m2_per_hz));
        }
        let (spectrum, (low_hz, high_hz)) = (self.spectrum, self.band_hz);
        let peak = PeakPeriods::of(spectrum, self.band_hz).ok_or(FitError::Still)?;
        let df_hz = spectrum.df_hz();
        let from_hz = low_hz.max(FRONT / peak.young_s);
        // A segment's mean is taken away, and with it part of the first line.
        let from = ((from_hz / df_hz).ceil() as usize).max(2);
        let to = ((high_hz / df_hz).floor().min(spectrum.density_m2_per_hz().len() as f64) as usize + 1).max(from);
        let measured = spectrum.density_m2_per_hz().get(from..to.min(spectrum.density_m2_per_hz().len())).unwrap_or_default();
        if measured.len() < LINES_MIN {
            return Err(FitError::Lines { lines: measured.len(), lines_min: LINES_MIN });
        }
        let variance_m2: f64 = measured.iter().map(|s| (s - self.noise_m2_per_hz) * df_hz).sum();
        let all_m2: f64 = measured.iter().map(|s| s * df_hz).sum();
        let h_m0_m = 4.0 * variance_m2.max(0.1 * all_m2).sqrt();
        if !(h_m0_m > 0.0 && h_m0_m.is_finite()) {
            return Err(FitError::Still);
        }
        Ok(Lines { range: from..from + measured.len(), measured, h_m0_m, t_p_s: peak.young_s })
    }

    fn climb(&self, lines: &Lines<'_>, gamma: f64, gamma_bounds: (f64, f64)) -> Option<Found<3>> {
        let [height, period] = lines.bounds();
        let start = [lines.h_m0_m.ln(), lines.t_p_s.ln(), gamma.ln()];
        climb(lines.measured, start, &[height, period, gamma_bounds], |theta| self.expected(lines, theta))
    }

    /// What is expected of each line, and its derivatives by the first N of the logarithms of H_m0, T_p and γ.
    fn expected<const N: usize>(&self, lines: &Lines<'_>, theta: &[f64; N]) -> Option<Expected<N>> {
        // Without γ it is 1.
        let [h_m0_m, t_p_s, gamma] = [0, 1, 2].map(|i| theta.get(i).copied().unwrap_or(0.0).exp());
        let sea = Jonswap::new(h_m0_m, t_p_s, gamma.clamp(1.0, 20.0)).ok()?;
        let df_hz = self.spectrum.df_hz();
        let spread = |of: &dyn Fn(f64) -> f64| self.scatter.expected(lines.range.clone(), |line| of(line * df_hz));
        let bare = spread(&|f_hz| sea.density_m2_per_hz(f_hz));
        let by = std::array::from_fn(|i| match i {
            0 => bare.iter().map(|density| 2.0 * density).collect(),
            1 => spread(&|f_hz| sea.density_m2_per_hz(f_hz) * sea.log_slope_by_period(f_hz)),
            _ => {
                let mean = sea.enhancement_mean();
                spread(&|f_hz| sea.density_m2_per_hz(f_hz) * (sea.enhancement_exponent(f_hz) - mean))
            }
        });
        Some(Expected { density: bare.iter().map(|density| density + self.noise_m2_per_hz).collect(), by })
    }

    /// Covariance of the parameters' logarithms for ν = 2.
    fn covariance<const N: usize>(
        &self,
        lines: &Lines<'_>,
        found: &Found<N>,
        sea: &impl Spectrum,
    ) -> Result<[[f64; N]; N], FitError> {
        let Expected { density, by } = self.expected(lines, &found.theta).ok_or(FitError::Undetermined)?;
        let df_hz = self.spectrum.df_hz();
        // A slope is Σ (Ŝ/E − 1) ∂ ln E/∂θ: a sum of lines with the weights ∂E/∂θ/E².
        let slopes = by.map(|by| {
            let weights: Vec<f64> = by.iter().zip(&density).map(|(by, density)| by / (density * density)).collect();
            let truth = self.scatter.true_weights(lines.range.clone(), &weights);
            let scaled = truth.into_iter().map(|(line, w)| w * (sea.density_m2_per_hz(line * df_hz) + self.noise_m2_per_hz));
            scaled.collect::<Vec<f64>>()
        });
        let square = |i: usize, j: usize| slopes[i].iter().zip(&slopes[j]).map(|(a, b)| a * b).sum::<f64>();
        let slopes: [[f64; N]; N] = std::array::from_fn(|i| std::array::from_fn(|j| square(i, j)));
        Ok(product(&product(&found.covariance, &slopes), &found.covariance))
    }

    /// `variance` is that of the logarithm for ν = 2.
    fn around(&self, value: f64, variance: f64) -> Interval {
        let factor = (NORMAL_95 * (2.0 * variance / self.scatter.joint_dof()).sqrt()).exp();
        (value / factor, value * factor)
    }

    fn goodness(&self, lines: &Lines<'_>, sea: &impl Spectrum, parameters: usize) -> Goodness {
        let df_hz = self.spectrum.df_hz();
        let expected = self.scatter.expected(lines.range.clone(), |line| sea.density_m2_per_hz(line * df_hz));
        let half_dof = 0.5 * self.scatter.line_dof();
        let squares: f64 =
            lines.measured.iter().zip(&expected).map(|(s, e)| (s / (e + self.noise_m2_per_hz) - 1.0).powi(2)).sum();
        let left = (lines.measured.len() - parameters) as f64;
        let misfit = half_dof * squares / left;
        // Fourth moments of χ²: the variance of one square about its mean 1 is 2 + 6/(ν/2).
        let variance = (2.0 + 6.0 / half_dof) / left * self.scatter.line_dof() / self.scatter.joint_dof();
        Goodness { misfit, misfit_sigmas: (misfit - 1.0) / variance.sqrt(), lines: lines.measured.len() }
    }
}

impl Lines<'_> {
    /// Of the logarithms of height and period.
    fn bounds(&self) -> [(f64, f64); 2] {
        let (height, period) = (self.h_m0_m.ln(), self.t_p_s.ln());
        [(height - 7.0, height + 7.0), (period - PERIOD_FACTOR.ln(), period + PERIOD_FACTOR.ln())]
    }
}

fn product<const N: usize>(a: &[[f64; N]; N], b: &[[f64; N]; N]) -> [[f64; N]; N] {
    std::array::from_fn(|i| std::array::from_fn(|j| (0..N).map(|k| a[i][k] * b[k][j]).sum()))
}

#[cfg(test)]
mod tests;
