//! How far two records' heights and periods may differ by chance, when they saw the same, partly the same, or different waves.
//!
//! To first order the logarithm of a moment mₙ = ∫ fⁿ S df changes by ∫ (fⁿ/mₙ) δS df, and of Gaussian seas over a time T
//! cov(δS_a, δS_b) = |S_ab|²/T at a frequency and none between two (Bendat and Piersol 2010, 8.5 and chapter 9). With a weight w(f),
//! 1/m0 for heights and 1/m0 − f²/m2 for periods, of each record,
//!
//! > var(∫ w_a δS_a df − ∫ w_b δS_b df) = (1/T) ∫ (w_a² S_a² + w_b² S_b² − 2 w_a w_b |S_ab|²) df.
//!
//! For two records of one spectrum whose coherence γ² is the same everywhere that is 2(1 − γ²) ∫ S² df/(T m0²) = 4(1 − γ²)/ν for
//! the ratio of the variances, with ν = 2 T m0²/∫ S² df the degrees of freedom of either, and (1 − γ²)/ν for the ratio of H_m0,
//! which has half the logarithm: unrelated records differ as two chi-square variables do, those of the same waves not at all.
//!
//! A sensor's noise is part of its spectrum, so that its scatter is in there: it lowers γ². Its mean is taken off the moments,
//! and it is known to 30 % only, which is added.

use super::cross::CrossSpectrum;
use crate::interval::{CLAIMED, Interval, NORMAL_95};

/// Standard deviation of a noise variance that is given, as a share of it: its standard deviation is good to 15 %.
const NOISE_KNOWN: f64 = 0.3;
/// Two-sided √95 % of the normal distribution: two such intervals hold together with 95 %.
const NORMAL_BOTH_95: f64 = 2.2365;

/// A ratio a/b whose true value is 1 where both saw the same sea.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ratio {
    /// As measured, without the noise that was given.
    pub value: f64,
    /// Standard deviation of its logarithm: by chance, the noise and the scale.
    pub deviation: f64,
}

impl Ratio {
    /// Its 95 % interval.
    #[must_use]
    pub fn interval_95(&self) -> Interval {
        self.interval(NORMAL_95)
    }

    /// The interval of one of two ratios that hold together with 95 %: what a verdict goes by.
    #[must_use]
    pub fn interval_both_95(&self) -> Interval {
        self.interval(NORMAL_BOTH_95)
    }

    /// Whether 1 is in [`Self::interval_both_95`]; never for a NaN.
    #[must_use]
    pub fn is_one(&self) -> bool {
        let (low, high) = self.interval_both_95();
        low <= 1.0 && high >= 1.0
    }

    fn interval(&self, deviations: f64) -> Interval {
        let factor = (deviations * self.deviation).exp();
        (self.value / factor, self.value * factor)
    }
}

/// One record's moments of a band, with and without noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moments {
    /// m0 with noise, m².
    pub(super) m0_m2: f64,
    /// m0 of the noise alone, m².
    pub(super) noise_m0_m2: f64,
    m2_m2hz2: f64,
    noise_m2_m2hz2: f64,
}

impl Moments {
    /// Of lines of density within a band; `noise_m2_per_hz` is the sensor's.
    pub(super) fn of(density: &[f64], df_hz: f64, lines: impl Iterator<Item = usize>, noise_m2_per_hz: f64) -> Self {
        let mut sum = Self { m0_m2: 0.0, noise_m0_m2: 0.0, m2_m2hz2: 0.0, noise_m2_m2hz2: 0.0 };
        for line in lines {
            let square_hz2 = (line as f64 * df_hz).powi(2);
            sum.m0_m2 += density[line] * df_hz;
            sum.m2_m2hz2 += square_hz2 * density[line] * df_hz;
            sum.noise_m0_m2 += noise_m2_per_hz * df_hz;
            sum.noise_m2_m2hz2 += square_hz2 * noise_m2_per_hz * df_hz;
        }
        sum
    }

    /// m0 without the noise, m²; may be negative.
    pub(super) fn waves_m0_m2(&self) -> f64 {
        self.m0_m2 - self.noise_m0_m2
    }

    fn waves_m2_m2hz2(&self) -> f64 {
        self.m2_m2hz2 - self.noise_m2_m2hz2
    }

    /// Share of noise in m0 and in m2, of the waves'.
    fn noise_shares(&self) -> (f64, f64) {
        (self.noise_m0_m2 / self.waves_m0_m2(), self.noise_m2_m2hz2 / self.waves_m2_m2hz2())
    }
}

/// What both records hold within a band.
#[derive(Debug, Clone, Copy)]
pub(super) struct Both<'a> {
    /// Finely resolved: what smears a peak lowers the squares under it.
    pub(super) cross: &'a CrossSpectrum,
    pub(super) band_hz: Interval,
    pub(super) a: Moments,
    pub(super) b: Moments,
}

impl Both<'_> {
    /// Variance of ∫ w_a δS_a df − ∫ w_b δS_b df.
    ///
    /// Lines of n independent estimates have squares too high by 1/n, and cross spectra that are none have |S_ab|² = S_a S_b/n:
    /// of X = |S_ab|² and Y = S_a S_b as estimated, (X − Y/n)/(1 − 1/n²) is without either bias. It may be negative at a line,
    /// but not on the whole.
    fn variance(&self, a: impl Fn(f64) -> f64, b: impl Fn(f64) -> f64) -> f64 {
        let n = self.cross.averages.max(1.5);
        let sum: f64 = self
            .cross
            .lines(self.band_hz)
            .map(|line| {
                let f_hz = line as f64 * self.cross.df_hz;
                let (aa, bb) = (self.cross.aa_m2_per_hz[line], self.cross.bb_m2_per_hz[line]);
                let (w_a, w_b) = (a(f_hz), b(f_hz));
                let shared = (self.cross.ab_m2_per_hz[line].norm_sqr() - aa * bb / n) / (1.0 - 1.0 / (n * n));
                ((w_a * aa).powi(2) + (w_b * bb).powi(2)) / (1.0 + 1.0 / n) - 2.0 * w_a * w_b * shared
            })
            .sum();
        (sum * self.cross.df_hz / (self.cross.covered_s * CLAIMED)).max(0.0)
    }

    /// Degrees of freedom that the variances of the two have, of both together: 2 T m0_a m0_b/∫ S_a S_b df.
    pub(super) fn freedom(&self) -> f64 {
        let lines = self.cross.lines(self.band_hz);
        let squares: f64 = lines.map(|line| self.cross.aa_m2_per_hz[line] * self.cross.bb_m2_per_hz[line]).sum();
        2.0 * self.cross.covered_s * self.a.m0_m2 * self.b.m0_m2 / (squares * self.cross.df_hz)
    }

    /// Of H_m0; `scale_95` is what the sensors' scales are known to. `None` where either has no waves above its noise.
    pub(super) fn heights(&self, scale_95: f64) -> Option<Ratio> {
        let (m0_a, m0_b) = (self.a.waves_m0_m2(), self.b.waves_m0_m2());
        if !(m0_a > 0.0 && m0_b > 0.0) {
            return None;
        }
        let chance = self.variance(|_| 1.0 / m0_a, |_| 1.0 / m0_b);
        let noise = [self.a, self.b].map(|one| (NOISE_KNOWN * one.noise_shares().0).powi(2));
        let variance = 0.25 * (chance + noise[0] + noise[1]) + (scale_95 / NORMAL_95).powi(2);
        Some(Ratio { value: (m0_a / m0_b).sqrt(), deviation: variance.sqrt() })
    }

    /// Of the mean zero-crossing periods √(m0/m2); `scale_95` is what is left open by resampling and clocks.
    pub(super) fn periods(&self, scale_95: f64) -> Option<Ratio> {
        let (m0_a, m0_b) = (self.a.waves_m0_m2(), self.b.waves_m0_m2());
        let (m2_a, m2_b) = (self.a.waves_m2_m2hz2(), self.b.waves_m2_m2hz2());
        if !(m0_a > 0.0 && m0_b > 0.0 && m2_a > 0.0 && m2_b > 0.0) {
            return None;
        }
        let chance = self.variance(|f| 1.0 / m0_a - f * f / m2_a, |f| 1.0 / m0_b - f * f / m2_b);
        let noise = [self.a, self.b].map(|one| {
            let (height, square) = one.noise_shares();
            (NOISE_KNOWN * (height - square)).powi(2)
        });
        let variance = 0.25 * (chance + noise[0] + noise[1]) + (scale_95 / NORMAL_95).powi(2);
        Some(Ratio { value: ((m0_a / m2_a) / (m0_b / m2_b)).sqrt(), deviation: variance.sqrt() })
    }
}
