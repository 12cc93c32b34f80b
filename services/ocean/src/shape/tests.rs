//! What the tests of this folder share, and those of all of it.

use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use realfft::{ComplexToReal, RealFftPlanner};
use std::sync::Arc;

use super::{Estimate, NoiseFloor, PeakPeriods, Scatter, systems};
use crate::{PiersonMoskowitz, SampledSpectrum, Spectrum, Welch};

/// A density at 0, `df_hz`, … in so many lines.
pub(super) fn sampled(df_hz: f64, lines: u32, density: impl Fn(f64) -> f64) -> SampledSpectrum {
    SampledSpectrum::new(df_hz, (0..lines).map(|i| density(f64::from(i) * df_hz)).collect::<Vec<_>>()).unwrap()
}

/// Gaussian seas: independent normal parts on every line. They repeat after `samples`, so that a record ought to be half as long
/// at most.
pub(super) struct Sea {
    deviations_m: Vec<f64>,
    fft: Arc<dyn ComplexToReal<f64>>,
    random: ChaCha8Rng,
}

impl Sea {
    pub(super) fn new(spectrum: &impl Spectrum, rate_hz: f64, samples: usize, seed: u64) -> Self {
        let df_hz = rate_hz / samples as f64;
        let fft = RealFftPlanner::<f64>::new().plan_fft_inverse(samples);
        let mut deviations_m: Vec<f64> =
            (0..samples / 2 + 1).map(|i| 0.5 * (spectrum.density_m2_per_hz(i as f64 * df_hz) * df_hz).sqrt()).collect();
        *deviations_m.last_mut().unwrap() = 0.0;
        Self { deviations_m, fft, random: ChaCha8Rng::seed_from_u64(seed) }
    }

    /// The next sea, metres.
    pub(super) fn draw(&mut self) -> Vec<f64> {
        let mut lines = self.fft.make_input_vec();
        for (line, deviation_m) in lines.iter_mut().zip(&self.deviations_m) {
            let (re, im): (f64, f64) = (self.random.sample(StandardNormal), self.random.sample(StandardNormal));
            (line.re, line.im) = (deviation_m * re, deviation_m * im);
        }
        lines[0].im = 0.0;
        lines.last_mut().unwrap().im = 0.0;
        let mut samples_m = self.fft.make_output_vec();
        self.fft.process(&mut lines, &mut samples_m).unwrap();
        samples_m
    }
}

/// Moments of a sampled density against closed forms, m0 (5/4)^(n/4) Γ(1 − n/4) f_pⁿ: within 0.1 %.
#[test]
fn moments_of_a_sampled_density_are_the_theorys() {
    let (h_m0_m, t_p_s) = (1.2_f64, 5.0_f64);
    let grown = PiersonMoskowitz::new(h_m0_m, t_p_s).unwrap();
    // The tail beyond 80 f_p holds 2 × 5/4/√(5π/4)/80² of m2: a ten-thousandth.
    let spectrum = sampled(0.02 / t_p_s, 4001, |f_hz| grown.density_m2_per_hz(f_hz));
    for (order, gamma) in [(-1, 0.906_402_477_055_477), (0, 1.0), (1, 1.225_416_702_465_178), (2, 1.772_453_850_905_516)] {
        let expected = h_m0_m * h_m0_m / 16.0 * 1.25_f64.powf(0.25 * f64::from(order)) * gamma * t_p_s.powi(-order);
        approx::assert_relative_eq!(spectrum.moment(order, 0.0, f64::INFINITY), expected, max_relative = 1e-3);
    }
}

proptest! {
    // A fit is a few milliseconds, and most of these are the hardest.
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever a spectrum holds: an answer, none or an error, but never a panic, and no system gains or loses energy.
    #[test]
    fn any_spectrum_is_answered(
        density in prop::collection::vec(prop_oneof![3 => 0.0..1.0, 1 => Just(0.0), 1 => 0.0..1e-12, 1 => 0.0..1e12], 2..120),
        df_hz in 1e-3..1.0,
        dof in 0.5..100.0,
        low in -0.1..1.2,
        high in -0.1..1.2,
    ) {
        let top_hz = df_hz * density.len() as f64;
        let band_hz = (low * top_hz, high * top_hz);
        let spectrum = SampledSpectrum::new(df_hz, density).unwrap();
        let segment_samples = 2 * (spectrum.density_m2_per_hz().len() + 1);
        let of_welch = Scatter::of(&Welch::new(segment_samples), 10 * segment_samples);
        for scatter in [Scatter::independent(dof), of_welch].into_iter().flatten() {
            let _ = PeakPeriods::of(&spectrum, band_hz);
            let _ = scatter.density_intervals_95(&spectrum);
            if let Some(floor) = NoiseFloor::estimated(&spectrum, &scatter, band_hz) {
                prop_assert!(floor.density_m2_per_hz >= 0.0 && !floor.error_m2_per_hz.is_nan());
                let _ = floor.removed(&spectrum);
            }
            let estimate = Estimate { spectrum: &spectrum, scatter: &scatter, band_hz, noise_m2_per_hz: 0.0 };
            let _ = (estimate.jonswap(), estimate.pierson_moskowitz());
            let sum: f64 = systems(&spectrum, &scatter, band_hz).iter().map(|system| system.statistics.m0_m2).sum();
            let all = spectrum.moment(0, band_hz.0, band_hz.1);
            prop_assert!((sum - all).abs() <= 1e-6 * all, "{} of {}", sum, all);
        }
    }
}
