//! Whether a record is sampled often enough for its waves.
//!
//! Waves shorter than two samples are not lost: they come back as longer ones (aliasing). 2 Hz, the rate of the thesis, does so
//! with all that is shorter than a second. A record cannot show this directly, but its spectrum gives it away: the tail of a resolved
//! sea has fallen by half the sampling rate f_N, as f⁻⁴ or faster (Phillips, 1958; Toba, 1973), while folded energy keeps it up.

use super::{Finding, Flag, Test};
use crate::welch::SampledSpectrum;

/// Thresholds of [`sampling_rate`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SamplingLimits {
    /// Share of the variance beyond half the rate that is suspect. 0.05: 2.5 % of the height.
    pub aliased_suspect_share: f64,
    /// Share that fails. 0.15.
    pub aliased_fail_share: f64,
    /// Slope d ln S/d ln f under half the rate above which there is no tail, so that a suspect share fails. −1.
    pub slope_flat: f64,
    /// Exponent of the tail assumed beyond half the rate. 4: Toba's, the slowest.
    pub tail_exponent: f64,
    /// Height 4 √(aliased variance) that does not matter, metres, whatever its share. 0.01: the noise of a calm sea is flat too.
    pub aliased_height_min_m: f64,
}

impl Default for SamplingLimits {
    fn default() -> Self {
        Self {
            aliased_suspect_share: 0.05,
            aliased_fail_share: 0.15,
            slope_flat: -1.0,
            tail_exponent: 4.0,
            aliased_height_min_m: 0.01,
        }
    }
}

/// What a spectrum shows near half its sampling rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nyquist {
    /// The highest frequency of the spectrum, hertz: half the sampling rate.
    pub nyquist_hz: f64,
    /// d ln S/d ln f from 0.6 of it to all of it, by least squares. A folded f⁻⁴ tail has about −2.7 there.
    pub slope: f64,
    /// Estimated variance beyond it, m².
    pub aliased_m2: f64,
    /// That over all variance.
    pub aliased_share: f64,
}

impl Nyquist {
    /// Of a spectrum of at least ten frequencies with some energy; `None` else.
    ///
    /// At f_N the tail and its mirror image are alike, so that half the density S there is the sea's own, and a tail of
    /// exponent n from there on holds ½ S f_N/(n − 1).
    #[must_use]
    pub fn of(spectrum: &SampledSpectrum, tail_exponent: f64) -> Option<Self> {
        let density = spectrum.density_m2_per_hz();
        let last = density.len().checked_sub(1)?;
        let nyquist_hz = last as f64 * spectrum.df_hz();
        let m0_m2 = spectrum.moment(0, 0.0, f64::INFINITY);
        if last < 10 || !(m0_m2 > 0.0 && m0_m2.is_finite()) {
            return None;
        }
        let tail: Vec<(f64, f64)> = (last * 3 / 5..=last)
            .filter(|i| density[*i] > 0.0)
            .map(|i| ((i as f64 / last as f64).ln(), density[i].ln()))
            .collect();
        let n = tail.len() as f64;
        let (mean_x, mean_y) = (tail.iter().map(|t| t.0).sum::<f64>() / n, tail.iter().map(|t| t.1).sum::<f64>() / n);
        let covariance: f64 = tail.iter().map(|t| (t.0 - mean_x) * (t.1 - mean_y)).sum();
        let spread: f64 = tail.iter().map(|t| (t.0 - mean_x).powi(2)).sum();
        // Where nothing is left of the density the tail has certainly fallen.
        let slope = if spread > 0.0 { covariance / spread } else { f64::NEG_INFINITY };
        let top = &density[last - last / 10..=last];
        let top_m2_per_hz = top.iter().sum::<f64>() / top.len() as f64;
        let aliased_m2 = 0.5 * top_m2_per_hz * nyquist_hz / (tail_exponent - 1.0).max(1.0);
        Some(Self { nyquist_hz, slope, aliased_m2, aliased_share: aliased_m2 / m0_m2 })
    }
}

/// Whether waves shorter than two samples hold a share of the variance that matters.
#[must_use]
pub fn sampling_rate(spectrum: &SampledSpectrum, limits: &SamplingLimits) -> Finding {
    let Some(found) = Nyquist::of(spectrum, limits.tail_exponent) else {
        return Finding::new(Test::SamplingRate, Flag::NotEvaluated, "no energy, or too few frequencies to judge a tail by");
    };
    let height_m = 4.0 * found.aliased_m2.sqrt();
    let mut flag = Flag::rising(found.aliased_share, limits.aliased_suspect_share, limits.aliased_fail_share);
    if flag == Flag::Suspect && found.slope > limits.slope_flat {
        flag = Flag::Fail;
    }
    if height_m < limits.aliased_height_min_m {
        flag = Flag::Pass;
    }
    let reason = format!(
        "waves shorter than {:.2} s hold about {:.1} % of the variance (H_m0 {height_m:.3} m); the spectrum falls as f^{:.1} there",
        1.0 / found.nyquist_hz,
        100.0 * found.aliased_share,
        found.slope
    );
    Finding::new(Test::SamplingRate, flag, reason)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::{Jonswap, Record, Spectrum, Welch};
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;
    use std::f64::consts::TAU;

    /// A long random sea of a JONSWAP spectrum up to 20 f_p, sampled.
    pub(crate) fn sea(h_m0_m: f64, t_p_s: f64, rate_hz: f64, samples: usize) -> Record {
        let spectrum = Jonswap::new(h_m0_m, t_p_s, 3.3).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(11);
        let step_hz = 0.02 / t_p_s;
        let waves: Vec<(f64, f64, f64)> = (20..1000)
            .map(|i| {
                let f_hz = (f64::from(i) + random.random::<f64>() - 0.5) * step_hz;
                let amplitude_m = (2.0 * spectrum.density_m2_per_hz(f_hz) * step_hz).sqrt();
                (amplitude_m, TAU * f_hz / rate_hz, TAU * random.random::<f64>())
            })
            .collect();
        let at = |i: usize| waves.iter().map(|(a, w, p)| a * (w * i as f64 + p).cos()).sum::<f64>();
        Record::new((0..samples).map(at).collect::<Vec<_>>(), rate_hz).unwrap()
    }

    /// The share of a JONSWAP sea that is beyond half the rate, by its own integral, against what its samples show.
    #[test]
    fn the_aliased_share_is_the_spectrums_own() {
        for (t_p_s, rate_hz, expected) in
            [(1.3, 2.0, Flag::Fail), (3.0, 2.0, Flag::Pass), (1.3, 10.0, Flag::Pass), (1.0, 4.0, Flag::Suspect)]
        {
            let record = sea(0.3, t_p_s, rate_hz, 4096);
            let spectrum = Welch::new(256).spectrum(&record).unwrap();
            let truth = Jonswap::new(0.3, t_p_s, 3.3).unwrap().moment(0, 0.5 * rate_hz, 100.0) / (0.3f64.powi(2) / 16.0);
            let found = Nyquist::of(&spectrum, 4.0).unwrap();
            // A tail of f⁻⁵ holds a quarter less than the f⁻⁴ assumed; near the peak it is not a tail at all.
            let ratio = found.aliased_share / truth;
            assert!((0.8..2.0).contains(&ratio), "{t_p_s} s at {rate_hz} Hz: {} for {truth}", found.aliased_share);
            let finding = sampling_rate(&spectrum, &SamplingLimits::default());
            assert_eq!(finding.flag, expected, "{t_p_s} s at {rate_hz} Hz, truth {truth}: {}", finding.reason);
        }
    }

    #[test]
    fn calm_noise_matters_to_nobody_and_stillness_cannot_be_judged() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut noise = |sigma_m: f64| {
            let samples: Vec<f64> = (0..4096).map(|_| sigma_m * random.sample::<f64, _>(rand_distr::StandardNormal)).collect();
            Welch::new(256).spectrum(&Record::new(samples, 5.0).unwrap()).unwrap()
        };
        assert_eq!(sampling_rate(&noise(0.001), &SamplingLimits::default()).flag, Flag::Pass);
        // White noise of a tenth of a metre: nothing falls, and it is as high as waves.
        assert_eq!(sampling_rate(&noise(0.1), &SamplingLimits::default()).flag, Flag::Fail);
        assert_eq!(sampling_rate(&noise(0.0), &SamplingLimits::default()).flag, Flag::NotEvaluated);
    }
}
