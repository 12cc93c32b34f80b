//! The directional spectrum S(f, θ): variance density by frequency and by the direction that waves come from.

use std::f64::consts::{PI, TAU};

use super::moments::FourierMoments;
use super::water::Water;

/// S(f, θ), m²/Hz/rad, on evenly spaced frequencies and directions.
#[derive(Debug, Clone, PartialEq)]
pub struct DirectionalSpectrum {
    first_hz: f64,
    df_hz: f64,
    directions: usize,
    density_m2_per_hz_rad: Vec<f64>,
}

/// One plane wave of a sea, as a forecast needs it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveLine {
    /// Wavenumber to the north, of where it goes to, radians per metre.
    pub k_north_radpm: f64,
    /// To the east.
    pub k_east_radpm: f64,
    /// Angular frequency as seen, radians per second.
    pub omega_radps: f64,
    /// Its variance, m².
    pub variance_m2: f64,
}

impl DirectionalSpectrum {
    /// Of densities at `first_hz`, `first_hz` + `df_hz`, … and in each at 0, 2π/`directions`, …; `None` unless frequencies are positive, there
    /// are four directions or more, rows are whole, and densities are finite and at least 0.
    #[must_use]
    pub fn new(first_hz: f64, df_hz: f64, directions: usize, density_m2_per_hz_rad: Vec<f64>) -> Option<Self> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let whole =
            directions >= 4 && !density_m2_per_hz_rad.is_empty() && density_m2_per_hz_rad.len().is_multiple_of(directions);
        let densities = density_m2_per_hz_rad.iter().all(|d| *d >= 0.0 && d.is_finite());
        (positive(first_hz) && positive(df_hz) && whole && densities).then_some(Self {
            first_hz,
            df_hz,
            directions,
            density_m2_per_hz_rad,
        })
    }

    /// Frequencies, hertz.
    #[must_use]
    pub fn frequencies_hz(&self) -> Vec<f64> {
        (0..self.density_m2_per_hz_rad.len() / self.directions).map(|i| self.first_hz + i as f64 * self.df_hz).collect()
    }

    /// Distance between frequencies, hertz.
    #[must_use]
    pub fn df_hz(&self) -> f64 {
        self.df_hz
    }

    /// Directions that waves come from, radians clockwise from north.
    #[must_use]
    pub fn directions_from_rad(&self) -> Vec<f64> {
        (0..self.directions).map(|i| i as f64 * self.dtheta_rad()).collect()
    }

    /// Distance between directions, radians.
    #[must_use]
    pub fn dtheta_rad(&self) -> f64 {
        TAU / self.directions as f64
    }

    /// Densities, m²/Hz/rad: frequency by frequency, in each by direction.
    #[must_use]
    pub fn density_m2_per_hz_rad(&self) -> &[f64] {
        &self.density_m2_per_hz_rad
    }

    /// Variance, m².
    #[must_use]
    pub fn variance_m2(&self) -> f64 {
        self.density_m2_per_hz_rad.iter().sum::<f64>() * self.df_hz * self.dtheta_rad()
    }

    /// Energy and first Fourier moments at each frequency, in order.
    #[must_use]
    pub fn moments(&self) -> Vec<FourierMoments> {
        let table: Vec<[f64; 4]> =
            self.directions_from_rad().iter().map(|t| [t.cos(), t.sin(), (2.0 * t).cos(), (2.0 * t).sin()]).collect();
        let rows = self.density_m2_per_hz_rad.chunks_exact(self.directions);
        rows.zip(self.frequencies_hz())
            .map(|(row, f_hz)| {
                let energy: f64 = row.iter().sum();
                let mean = |i: usize| {
                    if energy > 0.0 { row.iter().zip(&table).map(|(d, t)| d * t[i]).sum::<f64>() / energy } else { 0.0 }
                };
                let density_m2_per_hz = energy * self.dtheta_rad();
                FourierMoments { f_hz, density_m2_per_hz, a1: mean(0), b1: mean(1), a2: mean(2), b2: mean(3) }
            })
            .collect()
    }

    /// Moments of all frequencies together; `None` without energy. Mean direction and spread are its
    /// [`FourierMoments::direction_from_rad`] and [`FourierMoments::spread_rad`].
    #[must_use]
    pub fn overall(&self) -> Option<FourierMoments> {
        FourierMoments::overall(&self.moments())
    }

    /// Frequency, hertz, and direction, from, radians, of the highest density; `None` without energy.
    #[must_use]
    pub fn peak(&self) -> Option<(f64, f64)> {
        let (index, density) = self.density_m2_per_hz_rad.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
        let (i, j) = (index / self.directions, index % self.directions);
        (*density > 0.0).then(|| (self.first_hz + i as f64 * self.df_hz, j as f64 * self.dtheta_rad()))
    }

    /// Wavelength at the frequency of the peak and 2π over the mean wavenumber, metres, by the dispersion relation: for films too short to
    /// see a whole wave. `None` without energy.
    #[must_use]
    pub fn wavelengths_m(&self, water: &Water) -> Option<(f64, f64)> {
        let moments = self.moments();
        let weights: f64 = moments.iter().map(|m| m.density_m2_per_hz.powi(4)).sum();
        let f_p_hz = moments.iter().map(|m| m.density_m2_per_hz.powi(4) * m.f_hz).sum::<f64>() / weights;
        let peak = water.wavenumber_radpm(TAU * f_p_hz, self.overall()?.direction_from_rad())?;
        let lines = self.lines(water);
        let variance_m2: f64 = lines.iter().map(|line| line.variance_m2).sum();
        let k =
            lines.iter().map(|line| line.variance_m2 * line.k_north_radpm.hypot(line.k_east_radpm)).sum::<f64>() / variance_m2;
        Some((TAU / peak, TAU / k))
    }

    /// The plane waves that it stands for in `water`: those with energy that can run there.
    #[must_use]
    pub fn lines(&self, water: &Water) -> Vec<WaveLine> {
        let mut lines = Vec::new();
        let still = water.current_mps == [0.0; 2];
        let cell = self.df_hz * self.dtheta_rad();
        let directions = self.directions_from_rad();
        for (row, f_hz) in self.density_m2_per_hz_rad.chunks_exact(self.directions).zip(self.frequencies_hz()) {
            let omega_radps = TAU * f_hz;
            let any = water.wavenumber_radpm(omega_radps, 0.0).filter(|_| still);
            for (density, from_rad) in row.iter().zip(&directions).filter(|(density, _)| **density > 0.0) {
                let Some(k) = any.or_else(|| water.wavenumber_radpm(omega_radps, *from_rad)) else { continue };
                let (sin, cos) = (from_rad + PI).sin_cos();
                lines.push(WaveLine {
                    k_north_radpm: k * cos,
                    k_east_radpm: k * sin,
                    omega_radps,
                    variance_m2: density * cell,
                });
            }
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Water, maximum_entropy};
    use super::*;
    use crate::dispersion::wavenumber_radpm;
    use crate::{CosTwoS, Depth, Jonswap, Spectrum};
    use approx::assert_relative_eq;

    /// JONSWAP times cos-2s on a grid has the moments m_n of cos-2s (Longuet-Higgins et al. 1963), and its lines carry its variance.
    #[test]
    fn cos_two_s_has_its_moments_and_lines() {
        let (s, from_rad) = (6.0, 5.0_f64);
        let (jonswap, spreading) = (Jonswap::new(0.2, 2.0, 3.3).unwrap(), CosTwoS::new(s).unwrap());
        let density: Vec<f64> = (0..100)
            .flat_map(|i| (0..72).map(move |j| (0.25 + 0.01 * f64::from(i), TAU * f64::from(j) / 72.0)))
            .map(|(f, theta)| jonswap.density_m2_per_hz(f) * spreading.density_per_rad(theta - from_rad))
            .collect();
        let all = DirectionalSpectrum::new(0.25, 0.01, 72, density).unwrap();
        let overall = all.overall().unwrap();
        let (m1, m2) = (s / (s + 1.0), s * (s - 1.0) / ((s + 1.0) * (s + 2.0)));
        assert_relative_eq!(overall.a1, m1 * from_rad.cos(), max_relative = 1e-6);
        assert_relative_eq!(overall.b1, m1 * from_rad.sin(), max_relative = 1e-6);
        assert_relative_eq!(overall.a2, m2 * (2.0 * from_rad).cos(), max_relative = 1e-6);
        assert_relative_eq!(overall.b2, m2 * (2.0 * from_rad).sin(), max_relative = 1e-6);
        assert_relative_eq!(overall.direction_from_rad(), from_rad, max_relative = 1e-6);
        assert_relative_eq!(overall.spread_rad(), spreading.spread_rad(), max_relative = 1e-6);
        let (f_hz, peak_rad) = all.peak().unwrap();
        assert!((f_hz - 0.5).abs() < 0.006 && (peak_rad - from_rad).abs() < 0.05);
        let lines = all.lines(&Water::DEEP);
        assert_relative_eq!(lines.iter().map(|l| l.variance_m2).sum::<f64>(), all.variance_m2(), max_relative = 1e-12);
        for line in &lines {
            let k = wavenumber_radpm(line.omega_radps, Depth::DEEP);
            assert_relative_eq!(line.k_north_radpm.hypot(line.k_east_radpm), k, max_relative = 1e-9);
        }
        // Waves go to where they do not come from.
        let north: f64 = lines.iter().map(|l| l.variance_m2 * l.k_north_radpm).sum();
        assert!(north * from_rad.cos() < 0.0);
    }

    /// Lygre and Krogstad: the function has the moments it was made of.
    #[test]
    fn entropy_keeps_the_moments() {
        for s in [1.0, 4.0, 10.0, 40.0] {
            for from_rad in [0.3, 2.0, 4.4_f64] {
                let (m1, m2) = (s / (s + 1.0), s * (s - 1.0) / ((s + 1.0) * (s + 2.0)));
                let given = FourierMoments {
                    f_hz: 0.5,
                    density_m2_per_hz: 1.0,
                    a1: m1 * from_rad.cos(),
                    b1: m1 * from_rad.sin(),
                    a2: m2 * (2.0 * from_rad).cos(),
                    b2: m2 * (2.0 * from_rad).sin(),
                };
                let found = DirectionalSpectrum::new(0.5, 0.1, 180, maximum_entropy(&given, 180)).unwrap().moments()[0];
                assert_relative_eq!(found.density_m2_per_hz, 1.0, max_relative = 1e-9);
                for (found, given) in [(found.a1, given.a1), (found.b1, given.b1), (found.a2, given.a2), (found.b2, given.b2)] {
                    assert!((found - given).abs() < 2e-3, "s {s}: {found} {given}");
                }
            }
        }
        let wild = FourierMoments { f_hz: 0.5, density_m2_per_hz: 1.0, a1: 3.0, b1: f64::NAN, a2: -7.0, b2: 1.0 };
        assert!(maximum_entropy(&wild, 0).iter().all(|d| d.is_finite() && *d >= 0.0));
        let wild = FourierMoments { a1: 3.0, b1: 4.0, ..wild };
        assert!(maximum_entropy(&wild, 90).iter().all(|d| d.is_finite() && *d >= 0.0));
    }

    #[test]
    fn what_is_no_spectrum_is_none() {
        for bad in [f64::NAN, -1.0, f64::INFINITY] {
            assert!(DirectionalSpectrum::new(0.5, 0.1, 4, vec![bad; 4]).is_none());
            assert!(DirectionalSpectrum::new(bad, 0.1, 4, vec![1.0; 4]).is_none());
            assert!(DirectionalSpectrum::new(0.5, bad, 4, vec![1.0; 4]).is_none());
        }
        assert!(DirectionalSpectrum::new(0.5, 0.1, 0, Vec::new()).is_none());
        assert!(DirectionalSpectrum::new(0.5, 0.1, 4, vec![1.0; 5]).is_none());
        let still = DirectionalSpectrum::new(0.5, 0.1, 4, vec![0.0; 8]).unwrap();
        assert!(still.overall().is_none() && still.peak().is_none() && still.wavelengths_m(&Water::DEEP).is_none());
        assert!(still.lines(&Water::DEEP).is_empty());
    }
}
