//! The first Fourier moments of the directions at each frequency, as a pitch-and-roll buoy has them (Longuet-Higgins, Cartwright and Smith
//! 1963), here from every point of a film.

use std::f64::consts::TAU;

use super::water::Water;
use super::welch3::Spectrum3;

/// Directions that wavenumbers over a current are tabulated for.
const SECTORS: usize = 72;

/// Moments of the directions that waves of one frequency come from: a = ∫ cos nθ D dθ, b = ∫ sin nθ D dθ, θ clockwise from north.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "as in the literature")]
pub struct FourierMoments {
    /// Frequency, hertz.
    pub f_hz: f64,
    /// One-sided variance density, m²/Hz.
    pub density_m2_per_hz: f64,
    pub a1: f64,
    pub b1: f64,
    pub a2: f64,
    pub b2: f64,
}

impl FourierMoments {
    /// Mean direction, from, radians from 0 to 2π; NaN for no energy.
    #[must_use]
    pub fn direction_from_rad(&self) -> f64 {
        direction(self.a1, self.b1)
    }

    /// Circular spread σ = √(2 (1 − m1)) with m1 = √(a1² + b1²) (Kuik, van Vledder and Holthuijsen 1988), radians.
    #[must_use]
    pub fn spread_rad(&self) -> f64 {
        spread(self.a1, self.b1)
    }

    /// Moments of many frequencies together: each by its energy. `f_hz` is the mean frequency, the density their sum.
    #[must_use]
    pub fn overall(all: &[Self]) -> Option<Self> {
        let sum = |f: &dyn Fn(&Self) -> f64| all.iter().map(|m| m.density_m2_per_hz * f(m)).sum::<f64>();
        let energy = sum(&|_| 1.0);
        (energy > 0.0).then(|| Self {
            f_hz: sum(&|m| m.f_hz) / energy,
            density_m2_per_hz: energy,
            a1: sum(&|m| m.a1) / energy,
            b1: sum(&|m| m.b1) / energy,
            a2: sum(&|m| m.a2) / energy,
            b2: sum(&|m| m.b2) / energy,
        })
    }

    /// The moments of each frequency with those of `bins` to either side, each by its energy; densities as they are. Of few segments single
    /// frequencies' moments scatter so much that no direction function has them: smooth before [`super::maximum_entropy`].
    #[must_use]
    pub fn smoothed(all: &[Self], bins: usize) -> Vec<Self> {
        let near = |i: usize| &all[i.saturating_sub(bins)..i.saturating_add(bins).saturating_add(1).min(all.len())];
        let one = |(i, own): (usize, &Self)| {
            let mean = Self::overall(near(i)).unwrap_or(*own);
            Self { f_hz: own.f_hz, density_m2_per_hz: own.density_m2_per_hz, ..mean }
        };
        all.iter().enumerate().map(one).collect()
    }
}

/// Mean direction of first moments, radians from 0 to 2π.
pub(super) fn direction(a1: f64, b1: f64) -> f64 {
    b1.atan2(a1).rem_euclid(TAU)
}

/// Spread of first moments, radians.
pub(super) fn spread(a1: f64, b1: f64) -> f64 {
    // Sampling can take m1 past 1.
    (2.0 * (1.0 - a1.hypot(b1)).max(0.0)).sqrt()
}

impl Spectrum3 {
    /// The first Fourier moments at each frequency above 0, in `water`.
    ///
    /// With S the spectrum, a1 = ⟨k_north⟩/k(f), a2 = ⟨k_north² − k_east²⟩/k(f)², and so on: the co- and quadrature spectra of elevation and
    /// slopes at every point of the film, averaged with the taper's square. However coarse the wavenumbers are, these means are true ones (the
    /// taper widens wavenumbers evenly; the second moments of a film that is not square have its share taken off), so that a film may be
    /// shorter than its waves. What the taper in time does to 1/k(f) is taken off to first order; frequencies below the third are left at 0,
    /// where that cannot be, and where no wave can run.
    ///
    /// If the mean and the tilt of each frame have been taken off, films shorter than about two waves give moments that are too small: see
    /// [`super::Array`].
    #[must_use]
    pub fn moments(&self, water: &Water) -> Vec<FourierMoments> {
        let (n, df_hz, highest) = (self.segment_frames, self.df_hz(), self.frequencies());
        let inverse = inverse_wavenumbers(water, df_hz, highest);
        let [smear_north, smear_east] = self.smear_rad2pm2();
        let mut sums = vec![[0.0_f64; 5]; highest + 1];
        for ([north, east], variances) in self.wavenumbers() {
            let turn = (east.atan2(north) / TAU * SECTORS as f64).round().rem_euclid(SECTORS as f64) as usize % SECTORS;
            let (square, cross) = (north * north - east * east - smear_north + smear_east, 2.0 * north * east);
            for (m, sums) in sums.iter_mut().enumerate().skip(1) {
                for (place, sign, turn) in [(m, 1.0, turn), (n - m, -1.0, (turn + SECTORS / 2) % SECTORS)] {
                    let p = f64::from(variances[place]);
                    let [one, two] = inverse[m * SECTORS + turn];
                    sums[0] += p;
                    sums[1] += sign * p * north * one;
                    sums[2] += sign * p * east * one;
                    sums[3] += p * square * two;
                    sums[4] += p * cross * two;
                }
            }
        }
        let all = sums.iter().enumerate().skip(1);
        all.map(|(m, [energy, moments @ ..])| {
            let [a1, b1, a2, b2] = if *energy > 0.0 { moments.map(|x| x / energy) } else { [0.0; 4] };
            FourierMoments { f_hz: m as f64 * df_hz, density_m2_per_hz: energy / df_hz, a1, b1, a2, b2 }
        })
        .collect()
    }
}

/// 1/k and 1/k² by frequency and direction, so that their means over a line and its two neighbours (a sixth each, from Hann's taper) are the
/// true ones: less a sixth of the second difference. 0 where there is no such wave.
fn inverse_wavenumbers(water: &Water, df_hz: f64, highest: usize) -> Vec<[f64; 2]> {
    let rows = highest + 2;
    let still = water.current_mps == [0.0; 2];
    let mut raw = vec![None; rows * SECTORS];
    for m in 1..rows {
        for turn in 0..SECTORS {
            raw[m * SECTORS + turn] = if still && turn > 0 {
                raw[m * SECTORS]
            } else {
                water
                    .wavenumber_radpm(TAU * m as f64 * df_hz, TAU * turn as f64 / SECTORS as f64)
                    .map(|k| [1.0 / k, 1.0 / (k * k)])
            };
        }
    }
    let mut all = vec![[0.0; 2]; (highest + 1) * SECTORS];
    for m in 3..=highest {
        for turn in 0..SECTORS {
            let at = |m: usize| raw[m * SECTORS + turn];
            if let (Some(below), Some(here), Some(above)) = (at(m - 1), at(m), at(m + 1)) {
                all[m * SECTORS + turn] = [0, 1].map(|i| here[i] - (below[i] - 2.0 * here[i] + above[i]) / 6.0);
            }
        }
    }
    all
}
