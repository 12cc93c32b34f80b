//! What the tests of this folder share.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use realfft::{ComplexToReal, RealFftPlanner};
use std::sync::Arc;

use crate::{SampledSpectrum, Spectrum};

/// A density at 0, `df_hz`, … in so many lines.
pub(super) fn sampled(df_hz: f64, lines: u32, density: impl Fn(f64) -> f64) -> SampledSpectrum {
    SampledSpectrum::new(df_hz, (0..lines).map(|i| density(f64::from(i) * df_hz)).collect::<Vec<_>>()).unwrap()
}

/// Gaussian seas: independent normal parts on every line. They repeat after `samples`, so that a record ought to be half as long at most.
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
