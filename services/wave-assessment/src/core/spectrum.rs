//! The window's spectrum: Welch's, of every gauge, averaged.

use halcyon_model::{Estimate, WaveSpectrum};
use halcyon_ocean::confidence::variance_factors_95;
use halcyon_ocean::interval::SpectralIntervals;
use halcyon_ocean::{Record, SampledSpectrum, Welch};

/// Length of a segment, seconds, where the stretches allow: lines 0.04 Hz apart.
const SEGMENT_S: f64 = 25.0;
/// At least so many segments in the longest stretch: fewer tell noise from waves too badly.
const SEGMENTS_MIN: f64 = 2.0;
/// Overlapping Hann segments are worth so much of as many that do not overlap (Welch 1967).
const WORTH: f64 = 0.95;

/// Periods and spectrum of a window.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Spectral {
    pub t_p_s: Estimate,
    pub t_m01_s: Estimate,
    pub t_m02_s: Estimate,
    pub t_e_s: Estimate,
    pub spectrum: WaveSpectrum,
}

impl Spectral {
    /// Of all gauges' even records, with `noise_m2` of white noise taken off; `None` where no record is long enough, or nothing is left above
    /// the noise.
    pub(crate) fn of(records: &[Record], noise_m2: f64, interval_s: f64, wave_hz_min: f64) -> Option<Self> {
        let longest = records.iter().max_by_key(|record| record.samples_m().len())?;
        let segment = ((longest.duration_s() / SEGMENTS_MIN).min(SEGMENT_S) / interval_s).round() as usize;
        let welch = Welch::new(segment).planned(segment);
        // Gauges see the same waves: the freedom claimed is that of the longest record alone.
        let single = welch.spectrum(longest).ok()?;
        let mut density = vec![0.0; single.density_m2_per_hz().len()];
        let df_hz = single.df_hz();
        let mut worth = 0.0;
        for record in records {
            let Ok(spectrum) = (if std::ptr::eq(record, longest) { Ok(single.clone()) } else { welch.spectrum(record) }) else {
                continue;
            };
            let segments = (2.0 * record.samples_m().len() as f64 / segment as f64 - 1.0).max(1.0);
            density.iter_mut().zip(spectrum.density_m2_per_hz()).for_each(|(sum, x)| *sum += segments * x);
            worth += segments;
        }
        if worth <= 0.0 {
            return None;
        }
        // White noise of variance σ² has 2 σ²/rate everywhere.
        let floor = 2.0 * noise_m2 * interval_s;
        density.iter_mut().for_each(|x| *x = (*x / worth - floor).max(0.0));
        let pooled = SampledSpectrum::new(df_hz, density.clone()).ok()?;
        let band = (wave_hz_min.max(0.5 * df_hz), 0.5 / interval_s);
        let found = pooled.statistics(band.0, band.1)?;
        let alone = single.statistics(band.0, band.1)?;
        let intervals = SpectralIntervals::of(longest, &single, &alone, band)?;
        let around = |value: f64, alone: f64, (low, high): (f64, f64)| Estimate {
            value,
            low: (value * low / alone).min(value),
            high: (value * high / alone).max(value),
        };
        let freedom = 2.0 * WORTH * (2.0 * longest.samples_m().len() as f64 / segment as f64 - 1.0).max(1.0);
        let (low, high) = variance_factors_95(freedom);
        Some(Self {
            t_p_s: around(found.t_p_s, alone.t_p_s, intervals.t_p_s),
            t_m01_s: around(found.t_m01_s, alone.t_m01_s, intervals.t_m01_s),
            t_m02_s: around(found.t_m02_s, alone.t_m02_s, intervals.t_m02_s),
            t_e_s: around(found.t_e_s, alone.t_e_s, intervals.t_e_s),
            spectrum: WaveSpectrum { df_hz, density_m2_per_hz: density, degrees_of_freedom: freedom, factors_95: [low, high] },
        })
    }
}
