//! Seas of closed form for the tests: plane waves of linear dispersion, random phases.

use std::f64::consts::{PI, TAU};

use rand::{Rng, SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;

use super::film::{Film, Shape};
use crate::dispersion::{Depth, wavenumber_radpm};
use crate::spectrum::{Jonswap, Spectrum};
use crate::spreading::CosTwoS;

/// a cos(k·x − ωt + φ).
#[derive(Clone, Copy)]
pub(super) struct PlaneWave {
    pub(super) amplitude_m: f64,
    pub(super) k_north_radpm: f64,
    pub(super) k_east_radpm: f64,
    pub(super) omega_radps: f64,
    pub(super) phase_rad: f64,
}

impl PlaneWave {
    pub(super) fn from(amplitude_m: f64, f_hz: f64, from_rad: f64, phase_rad: f64, depth: Depth) -> Self {
        let k = wavenumber_radpm(TAU * f_hz, depth);
        let (sin, cos) = from_rad.sin_cos();
        Self { amplitude_m, k_north_radpm: -k * cos, k_east_radpm: -k * sin, omega_radps: TAU * f_hz, phase_rad }
    }
}

/// A JONSWAP sea under cos-2s spreading.
#[derive(Clone, Copy)]
pub(super) struct Sea {
    pub(super) jonswap: Jonswap,
    pub(super) s: f64,
    pub(super) from_rad: f64,
    pub(super) band_hz: (f64, f64),
    pub(super) depth: Depth,
}

impl Sea {
    pub(super) fn new(h_m0_m: f64, t_p_s: f64, s: f64, from_deg: f64) -> Self {
        let jonswap = Jonswap::new(h_m0_m, t_p_s, 3.3).unwrap();
        let band_hz = (0.55 / t_p_s, 3.0 / t_p_s);
        Self { jonswap, s, from_rad: from_deg.to_radians(), band_hz, depth: Depth::DEEP }
    }

    /// ∫ kⁿ S df over the band: a midpoint sum.
    pub(super) fn moment_k(&self, order: i32) -> f64 {
        let (low, high) = self.band_hz;
        let n = 20_000;
        let df = (high - low) / f64::from(n);
        (0..n)
            .map(|i| low + (f64::from(i) + 0.5) * df)
            .map(|f| wavenumber_radpm(TAU * f, self.depth).powi(order) * self.jonswap.density_m2_per_hz(f) * df)
            .sum()
    }

    /// `n` waves: evenly spaced frequencies, each anywhere in its interval; directions evenly by their share of the energy, in random order;
    /// every phase as likely. A set's own moments are close to the sea's, then, and only the film's shortness scatters what is found.
    pub(super) fn waves(&self, n: usize, seed: u64) -> Vec<PlaneWave> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let (low, high) = self.band_hz;
        let df = (high - low) / n as f64;
        // Neighbouring frequencies take directions of different parts of the circle: shuffled decks of 16.
        let deck = 16;
        let quantiles = self.quantiles(n.div_ceil(deck), deck, &mut random);
        (0..n)
            .map(|i| {
                let f = low + (i as f64 + random.random::<f64>()) * df;
                let amplitude = (2.0 * self.jonswap.density_m2_per_hz(f) * df).sqrt();
                PlaneWave::from(amplitude, f, self.from_rad + quantiles[i], random.random_range(0.0..TAU), self.depth)
            })
            .collect()
    }

    fn quantiles(&self, decks: usize, deck: usize, random: &mut ChaCha8Rng) -> Vec<f64> {
        let spreading = CosTwoS::new(self.s).unwrap();
        let n = 20_000;
        let step = TAU / f64::from(n);
        let mut sum = 0.0;
        let cumulative: Vec<(f64, f64)> = (0..n)
            .map(|i| -PI + (f64::from(i) + 0.5) * step)
            .map(|theta| {
                sum += spreading.density_per_rad(theta) * step;
                (sum, theta)
            })
            .collect();
        let mut all = Vec::new();
        for _ in 0..decks {
            let mut of_deck: Vec<f64> = (0..deck)
                .map(|i| (i as f64 + random.random::<f64>()) / deck as f64)
                .map(|share| cumulative[cumulative.partition_point(|c| c.0 < share).min(cumulative.len() - 1)].1)
                .collect();
            of_deck.shuffle(random);
            all.extend(of_deck);
        }
        all
    }

    pub(super) fn film(&self, shape: Shape, cell_m: f64, rate_hz: f64, seed: u64) -> Film {
        film(&self.waves(400, seed), shape, cell_m, rate_hz)
    }
}

/// Elevations of plane waves; the first cell's middle is the origin.
pub(super) fn elevations(waves: &[PlaneWave], shape: Shape, cell_m: f64, rate_hz: f64) -> Vec<f32> {
    let Shape { rows, cols, frames } = shape;
    let mut all = vec![0.0_f32; rows * cols * frames];
    for wave in waves {
        let table = |step: f64, n: usize| -> Vec<(f32, f32)> {
            (0..n).map(|i| (step * i as f64).sin_cos()).map(|(s, c)| (s as f32, c as f32)).collect()
        };
        let north = table(wave.k_north_radpm * cell_m, rows);
        let east = table(wave.k_east_radpm * cell_m, cols);
        for (t, frame) in all.chunks_exact_mut(rows * cols).enumerate() {
            let (s, c) = (wave.phase_rad - wave.omega_radps * t as f64 / rate_hz).sin_cos();
            let (s, c) = ((wave.amplitude_m * s) as f32, (wave.amplitude_m * c) as f32);
            for (row, (sn, cn)) in frame.chunks_exact_mut(cols).zip(&north) {
                let (cos, sin) = (c * cn - s * sn, s * cn + c * sn);
                row.iter_mut().zip(&east).for_each(|(z, (se, ce))| *z += cos * ce - sin * se);
            }
        }
    }
    all
}

pub(super) fn film(waves: &[PlaneWave], shape: Shape, cell_m: f64, rate_hz: f64) -> Film {
    Film::new(elevations(waves, shape, cell_m, rate_hz), shape, cell_m, rate_hz).unwrap()
}

/// `found` less `expected`, degrees from −180 to 180.
pub(super) fn off_deg(found_rad: f64, expected_rad: f64) -> f64 {
    ((found_rad - expected_rad + PI).rem_euclid(TAU) - PI).to_degrees()
}
