//! What a film's spectrum says about the waves: how long, where from, how spread, how steep.

use std::f64::consts::TAU;

use super::moments::{FourierMoments, direction, spread};
use super::water::Water;
use super::welch3::Spectrum3;

/// Statistics of a film.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmStatistics {
    /// Variance, m².
    pub variance_m2: f64,
    /// H_m0 = 4 √m0, metres.
    pub h_m0_m: f64,
    /// Frequency of the peak, hertz: the mean weighted by S⁴ (Young 1995), which no line's scatter moves far.
    pub f_p_hz: f64,
    /// Wavelength at the peak, metres: 2π over the mean of the wavenumbers that were seen there, each frequency weighted by S⁴.
    pub wavelength_peak_m: f64,
    /// 2π over the mean wavenumber, metres.
    pub wavelength_mean_m: f64,
    /// Mean direction, from, radians clockwise from north, 0 to 2π.
    pub direction_from_rad: f64,
    /// Mean direction about the peak (weighted by S⁴), from.
    pub direction_peak_from_rad: f64,
    /// Circular spread σ of all waves (Kuik et al. 1988), radians.
    pub spread_rad: f64,
    /// Mean square slope in all.
    pub mss: f64,
    /// Mean square slope along the mean direction.
    pub mss_along: f64,
    /// Mean square slope across it.
    pub mss_across: f64,
}

impl Spectrum3 {
    /// Statistics in `water`, best of a spectrum that only the shell was left of ([`Self::on_shell`]): noise is short, and lengthens no wave.
    /// `None` without energy.
    ///
    /// Wavelengths and slopes are from the wavenumbers seen, not from periods, less what the taper adds to them (exactly for slopes, to first
    /// order for wavelengths: the film should be at least a wave long); directions and spread are from [`Self::moments`]. Slopes are those of
    /// waves at least two cells long, and hang on the shortest.
    #[must_use]
    pub fn statistics(&self, water: &Water) -> Option<FilmStatistics> {
        let moments = self.moments(water);
        let overall = FourierMoments::overall(&moments)?;
        let (n, highest) = (self.segment_frames, self.frequencies());
        let smear = self.smear_rad2pm2();
        let (mut by_frequency, mut slopes) = (vec![0.0_f64; highest], [0.0_f64; 3]);
        for ([north, east], variances) in self.wavenumbers() {
            let k = north.hypot(east);
            let mut energy = 0.0;
            for (m, sum) in (1..).zip(&mut by_frequency) {
                let p = f64::from(variances[m]) + f64::from(variances[n - m]);
                *sum += k * p;
                energy += p;
            }
            slopes[0] += energy * (north * north - smear[0]);
            slopes[1] += energy * (east * east - smear[1]);
            slopes[2] += energy * north * east;
        }
        let variance_m2 = overall.density_m2_per_hz * self.df_hz();
        let k_mean = less_smear(by_frequency.iter().sum::<f64>() / variance_m2, smear);

        let peak_weight = |m: &FourierMoments| m.density_m2_per_hz.max(0.0).powi(4);
        let weights: f64 = moments.iter().map(peak_weight).sum();
        let at_peak = |f: &dyn Fn(usize, &FourierMoments) -> f64| {
            moments.iter().enumerate().map(|(i, m)| peak_weight(m) * f(i, m)).sum::<f64>() / weights
        };
        let k_peak = at_peak(&|i, m| {
            let energy = m.density_m2_per_hz * self.df_hz();
            if energy > 0.0 { by_frequency[i] / energy } else { 0.0 }
        });
        let (sin, cos) = overall.direction_from_rad().sin_cos();
        let [north, east, both] = slopes;
        Some(FilmStatistics {
            variance_m2,
            h_m0_m: 4.0 * variance_m2.sqrt(),
            f_p_hz: at_peak(&|_, m| m.f_hz),
            wavelength_peak_m: TAU / less_smear(k_peak, smear),
            wavelength_mean_m: TAU / k_mean,
            direction_from_rad: overall.direction_from_rad(),
            direction_peak_from_rad: direction(at_peak(&|_, m| m.a1), at_peak(&|_, m| m.b1)),
            spread_rad: spread(overall.a1, overall.b1),
            mss: north + east,
            mss_along: cos * cos * north + sin * sin * east + 2.0 * sin * cos * both,
            mss_across: sin * sin * north + cos * cos * east - 2.0 * sin * cos * both,
        })
    }
}

/// The wavenumber whose length, widened by the taper, is on average `k`: what widens it across lengthens it by σ²/2k.
pub(super) fn less_smear(k: f64, smear_rad2pm2: [f64; 2]) -> f64 {
    let across = 0.5 * (smear_rad2pm2[0] + smear_rad2pm2[1]);
    0.5 * (k + (k * k - 2.0 * across).max(0.0).sqrt())
}
