//! QARTOD's tests of spectra: check ratio (14), operational frequency range (17), energy at low frequencies (18), and ours at high ones.

use std::ops::RangeInclusive;

use super::{Finding, Flag, Test};
use crate::dispersion::{Depth, wavenumber_radpm};
use crate::welch::SampledSpectrum;

/// Thresholds of the tests of spectra.
#[derive(Debug, Clone, PartialEq)]
pub struct SpectralLimits {
    /// Frequencies that the instrument can measure, hertz; energy outside fails. 0.02 to 4 Hz.
    pub instrument_hz: RangeInclusive<f64>,
    /// Frequencies that waves have at this place, hertz; energy outside is suspect. 0.04 to 2 Hz.
    pub local_hz: RangeInclusive<f64>,
    /// The share of the variance that counts as energy outside. 0.05.
    pub outside_share: f64,
    /// Slower than this is drift, tide or motion of the vehicle rather than waves, hertz. 0.05.
    pub low_hz: f64,
    /// Share of the variance below it that is suspect. 0.1.
    pub low_suspect_share: f64,
    /// Share that fails. 0.4.
    pub low_fail_share: f64,
    /// Faster than this is noise or ripples rather than waves, hertz. 1.5: waves shorter than 0.7 m.
    pub high_hz: f64,
    /// Share of the variance above it that is suspect. 0.1.
    pub high_suspect_share: f64,
    /// Share that fails. 0.4.
    pub high_fail_share: f64,
    /// Check ratios within this of 1 pass. 0.1.
    pub check_ratio_tolerance: f64,
}

impl Default for SpectralLimits {
    fn default() -> Self {
        Self {
            instrument_hz: 0.02..=4.0,
            local_hz: 0.04..=2.0,
            outside_share: 0.05,
            low_hz: 0.05,
            low_suspect_share: 0.1,
            low_fail_share: 0.4,
            high_hz: 1.5,
            high_suspect_share: 0.1,
            high_fail_share: 0.4,
            check_ratio_tolerance: 0.1,
        }
    }
}

/// Share of the variance within `range_hz`; NaN where there is none at all. The mean is never part of it.
fn share_within(spectrum: &SampledSpectrum, range_hz: &RangeInclusive<f64>) -> f64 {
    spectrum.moment(0, *range_hz.start(), *range_hz.end()) / spectrum.moment(0, 0.0, f64::INFINITY)
}

/// Test 17: energy at frequencies that the instrument cannot measure, or the place does not have.
#[must_use]
pub fn operational_frequency(spectrum: &SampledSpectrum, limits: &SpectralLimits) -> Finding {
    let instrument = 1.0 - share_within(spectrum, &limits.instrument_hz);
    let local = 1.0 - share_within(spectrum, &limits.local_hz);
    let flag = match (instrument, local) {
        (a, b) if a.is_nan() || b.is_nan() => Flag::NotEvaluated,
        (a, _) if a >= limits.outside_share => Flag::Fail,
        (_, b) if b >= limits.outside_share => Flag::Suspect,
        _ => Flag::Pass,
    };
    let text = format!(
        "{:.1} % of the variance is outside {:?} Hz, the instrument's range, {:.1} % outside {:?} Hz, the place's",
        100.0 * instrument,
        limits.instrument_hz,
        100.0 * local,
        limits.local_hz
    );
    Finding::new(Test::OperationalFrequency, flag, reason(instrument + local, text))
}

/// Test 18: too large a share of the variance at low frequencies. (The manual compares it with swell and fetch at the place; what a
/// place can have is for the thresholds to say.)
#[must_use]
pub fn energy_low(spectrum: &SampledSpectrum, limits: &SpectralLimits) -> Finding {
    let share = share_within(spectrum, &(0.0..=limits.low_hz));
    let flag = Flag::rising(share, limits.low_suspect_share, limits.low_fail_share);
    Finding::new(
        Test::EnergyLow,
        flag,
        reason(share, format!("{:.1} % of the variance is under {} Hz", 100.0 * share, limits.low_hz)),
    )
}

/// Too large a share of the variance at high frequencies: noise, ripples, or bad matches.
#[must_use]
pub fn energy_high(spectrum: &SampledSpectrum, limits: &SpectralLimits) -> Finding {
    let share = share_within(spectrum, &(limits.high_hz..=f64::INFINITY));
    let flag = Flag::rising(share, limits.high_suspect_share, limits.high_fail_share);
    Finding::new(
        Test::EnergyHigh,
        flag,
        reason(share, format!("{:.1} % of the variance is above {} Hz", 100.0 * share, limits.high_hz)),
    )
}

/// `text`, where `share` is one.
fn reason(share: f64, text: String) -> String {
    if share.is_nan() { "there is no energy to speak of".into() } else { text }
}

/// Density of elevation and of slope at one frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlopeDensity {
    /// Frequency, hertz.
    pub f_hz: f64,
    /// Elevation, m²/Hz.
    pub elevation_m2_per_hz: f64,
    /// Slopes along two axes at right angles, added, 1/Hz.
    pub slope_per_hz: f64,
}

/// Test 14: the check ratio R = k(f) √(S_η/(S_x + S_y)), which is 1 for waves that follow the dispersion relation over `depth`.
///
/// `densities` at any frequencies, those that matter; R is averaged with the elevation's energy as weight. Currents, noise in the slopes and
/// wrong scales all move it off 1.
#[must_use]
pub fn check_ratio(densities: &[SlopeDensity], depth: Depth, limits: &SpectralLimits) -> Finding {
    let (mut sum, mut weight) = (0.0, 0.0);
    for d in densities.iter().filter(|d| d.elevation_m2_per_hz > 0.0 && d.slope_per_hz > 0.0 && d.f_hz > 0.0) {
        let k_radpm = wavenumber_radpm(std::f64::consts::TAU * d.f_hz, depth);
        let ratio = k_radpm * (d.elevation_m2_per_hz / d.slope_per_hz).sqrt();
        if ratio.is_finite() && d.elevation_m2_per_hz.is_finite() {
            sum += ratio * d.elevation_m2_per_hz;
            weight += d.elevation_m2_per_hz;
        }
    }
    let ratio = sum / weight;
    let flag = match ratio {
        x if x.is_nan() => Flag::NotEvaluated,
        x if (x - 1.0).abs() <= limits.check_ratio_tolerance => Flag::Pass,
        _ => Flag::Suspect,
    };
    Finding::new(Test::CheckRatio, flag, format!("the check ratio is {ratio:.3}, of waves it is 1"))
}

#[cfg(test)]
mod tests {
    use super::super::sampling::tests::sea;
    use super::*;
    use crate::{GRAVITY_MPS2, Record, Welch};
    use std::f64::consts::TAU;

    /// Sines of stated amplitudes (m) and frequencies (Hz) at 10 Hz, whole periods in a segment.
    fn sines(waves: &[(f64, f64)]) -> SampledSpectrum {
        let at = |i: usize| waves.iter().map(|(a, f)| a * (TAU * f * i as f64 / 10.0).sin()).sum::<f64>();
        let record = Record::new((0..8000).map(at).collect::<Vec<_>>(), 10.0).unwrap();
        Welch::new(2000).spectrum(&record).unwrap()
    }

    fn flags(spectrum: &SampledSpectrum) -> [Flag; 3] {
        let limits = SpectralLimits::default();
        [operational_frequency(spectrum, &limits), energy_low(spectrum, &limits), energy_high(spectrum, &limits)]
            .map(|f| f.flag)
    }

    /// Variances a²/2: shares are ratios of squares.
    #[test]
    fn energy_out_of_place_is_found_by_its_share() {
        use Flag::{Fail, Pass, Suspect};
        assert_eq!(flags(&sines(&[(1.0, 0.25)])), [Pass, Pass, Pass]);
        // 0.5²/1.25 = 20 % at 0.03 Hz, under the place's 0.04.
        assert_eq!(flags(&sines(&[(1.0, 0.25), (0.5, 0.03)])), [Suspect, Suspect, Pass]);
        assert_eq!(flags(&sines(&[(1.0, 0.25), (1.0, 0.03)])), [Suspect, Fail, Pass]);
        // Half at 4.5 Hz, beyond the instrument's 4.
        assert_eq!(flags(&sines(&[(1.0, 0.25), (1.0, 4.5)])), [Fail, Pass, Fail]);
        let finding = energy_high(&sines(&[(1.0, 0.25), (0.5, 1.8)]), &SpectralLimits::default());
        assert_eq!((finding.flag, finding.reason.as_str()), (Suspect, "20.0 % of the variance is above 1.5 Hz"));
        assert_eq!(flags(&sines(&[])), [Flag::NotEvaluated; 3]);
    }

    #[test]
    fn an_ordinary_sea_passes() {
        let spectrum = Welch::new(1024).spectrum(&sea(0.3, 2.5, 10.0, 8192)).unwrap();
        assert_eq!(flags(&spectrum), [Flag::Pass; 3]);
    }

    /// Deep water: slopes of k² = (ω²/g)² times the elevation.
    #[test]
    fn waves_have_a_check_ratio_of_one() {
        let density = |f_hz: f64, scale: f64| SlopeDensity {
            f_hz,
            elevation_m2_per_hz: 0.1 / f_hz,
            slope_per_hz: 0.1 / f_hz * ((TAU * f_hz).powi(2) / GRAVITY_MPS2).powi(2) * scale,
        };
        let limits = SpectralLimits::default();
        let of = |scale: f64| check_ratio(&[0.2, 0.5, 1.0].map(|f| density(f, scale)), Depth::DEEP, &limits);
        assert_eq!((of(1.0).flag, of(1.0).reason.as_str()), (Flag::Pass, "the check ratio is 1.000, of waves it is 1"));
        assert_eq!(of(1.5).flag, Flag::Suspect);
        assert_eq!(check_ratio(&[], Depth::DEEP, &limits).flag, Flag::NotEvaluated);
        assert_eq!(check_ratio(&[density(f64::NAN, 1.0)], Depth::DEEP, &limits).flag, Flag::NotEvaluated);
    }
}
