//! Seas made from closed forms, on other frequencies and directions than any forecast's lines, and readings of them.

use std::f64::consts::{PI, TAU};

use halcyon_ocean::forecast::Reading;
use halcyon_ocean::{CosTwoS, GRAVITY_MPS2, Jonswap, Record, SampledSpectrum, Spectrum, Welch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// A kind of sea and how it is read. A gamma of 1 is Pierson-Moskowitz's.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Case {
    pub(crate) h_s_m: f64,
    pub(crate) t_p_s: f64,
    pub(crate) gamma: f64,
    pub(crate) s: f64,
    pub(crate) sigma_m: f64,
    pub(crate) spacing_m: f64,
}

impl Case {
    pub(crate) fn spectrum(&self, period_factor: f64) -> Jonswap {
        Jonswap::new(self.h_s_m, self.t_p_s * period_factor, self.gamma).unwrap()
    }
}

struct Wave {
    k_north: f64,
    k_east: f64,
    omega: f64,
    amplitude: f64,
    phase: f64,
}

/// One sea of a case.
pub(crate) struct Sea {
    waves: Vec<Wave>,
    pub(crate) towards_rad: f64,
    case: Case,
    random: ChaCha8Rng,
}

impl Sea {
    /// 300 waves: a frequency drawn from each of as many strips of equal width in ln f from half to four times the peak's, a direction
    /// from the spreading (by rejection), normal amplitudes.
    pub(crate) fn new(case: Case, seed: u64) -> Self {
        const WAVES: u32 = 300;
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let towards_rad = TAU * random.random::<f64>();
        let (spectrum, spread) = (case.spectrum(1.0), CosTwoS::new(case.s).unwrap());
        let low = 0.5 * spectrum.peak_hz();
        let ratio = 8f64.ln() / f64::from(WAVES);
        let wave = |i: u32| {
            let (from, to) = (low * (ratio * f64::from(i)).exp(), low * (ratio * f64::from(i + 1)).exp());
            let f_hz = from + (to - from) * random.random::<f64>();
            let offset = loop {
                let x = (random.random::<f64>() * 2.0 - 1.0) * PI;
                if random.random::<f64>() * spread.density_per_rad(0.0) < spread.density_per_rad(x) {
                    break x;
                }
            };
            let variance = spectrum.density_m2_per_hz(f_hz) * (to - from);
            let (re, im): (f64, f64) = (random.sample(StandardNormal), random.sample(StandardNormal));
            let omega = TAU * f_hz;
            let k = omega * omega / GRAVITY_MPS2;
            let (sin, cos) = (towards_rad + offset).sin_cos();
            let amplitude = (variance * (re * re + im * im)).sqrt();
            Wave { k_north: k * cos, k_east: k * sin, omega, amplitude, phase: im.atan2(re) }
        };
        Self { waves: (0..WAVES).map(wave).collect(), towards_rad, case, random }
    }

    /// Elevation, slope north, slope east, vertical speed.
    pub(crate) fn truth(&self, north_m: f64, east_m: f64, t_s: f64) -> [f64; 4] {
        let mut sum = [0.0; 4];
        for w in &self.waves {
            let (sin, cos) = (w.k_north * north_m + w.k_east * east_m - w.omega * t_s + w.phase).sin_cos();
            sum[0] += w.amplitude * cos;
            sum[1] -= w.amplitude * w.k_north * sin;
            sum[2] -= w.amplitude * w.k_east * sin;
            sum[3] += w.amplitude * w.omega * sin;
        }
        sum
    }

    /// Readings over a 4 m square at 5 Hz for `span_s` up to 0; gauges stand within 5 cm of their places, anew each time.
    pub(crate) fn readings(&mut self, span_s: f64) -> Vec<Reading> {
        let Case { spacing_m, sigma_m, .. } = self.case;
        let side = (4.0 / spacing_m) as u32 + 1;
        let mut all = Vec::new();
        for frame in 0..(span_s * 5.0) as u32 {
            let t_s = -0.2 * f64::from(frame);
            for i in 0..side * side {
                let mut shaken = |n: u32| f64::from(n) * spacing_m - 2.0 + 0.1 * (self.random.random::<f64>() - 0.5);
                let (north_m, east_m) = (shaken(i / side), shaken(i % side));
                let noise: f64 = self.random.sample(StandardNormal);
                let elevation_m = self.truth(north_m, east_m, t_s)[0] + sigma_m * noise;
                all.push(Reading { north_m, east_m, t_s, elevation_m, sigma_m, group: frame });
            }
        }
        all
    }

    /// Welch's spectrum of one gauge in the middle over the same `span_s`, segments of 12 s.
    pub(crate) fn welch(&mut self, span_s: f64) -> SampledSpectrum {
        let n = (span_s * 5.0) as u32;
        let mut one = |i: u32| {
            let noise: f64 = self.random.sample(StandardNormal);
            self.truth(0.0, 0.0, -0.2 * f64::from(n - i))[0] + self.case.sigma_m * noise
        };
        let record = Record::new((0..n).map(&mut one).collect::<Vec<_>>(), 5.0).unwrap();
        Welch::with_segments_of_s(12.0, &record).spectrum(&record).unwrap()
    }

    /// A number from 0 to 1.
    pub(crate) fn dice(&mut self) -> f64 {
        self.random.random()
    }
}
