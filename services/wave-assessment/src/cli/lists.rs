//! The spectrum line by line, and every wave, as `--json` prints them.

use halcyon_ocean::SampledSpectrum;
use halcyon_ocean::crossing::Wave;
use serde::{Serialize, Serializer};

/// Columns of equal length.
#[derive(Debug, Serialize)]
struct Lines {
    /// Hertz.
    frequency_hz: Vec<f64>,
    /// One-sided variance density.
    density_m2_per_hz: Vec<f64>,
}

/// One wave, from one rise through the trend to the next.
#[derive(Debug, Serialize)]
struct Listed {
    /// Its first crossing, seconds after the first sample.
    start_s: f64,
    period_s: f64,
    height_m: f64,
    crest_m: f64,
    /// Negative.
    trough_m: f64,
}

#[allow(clippy::ref_option, reason = "as serde hands it over")]
pub(super) fn lines<S: Serializer>(spectrum: &Option<SampledSpectrum>, to: S) -> Result<S::Ok, S::Error> {
    let lines = spectrum.as_ref().map(|spectrum| {
        let density_m2_per_hz = spectrum.density_m2_per_hz().to_vec();
        let frequency_hz = (0..density_m2_per_hz.len()).map(|line| line as f64 * spectrum.df_hz()).collect();
        Lines { frequency_hz, density_m2_per_hz }
    });
    lines.serialize(to)
}

pub(super) fn waves<S: Serializer>(waves: &[Wave], to: S) -> Result<S::Ok, S::Error> {
    to.collect_seq(waves.iter().map(|wave| Listed {
        start_s: wave.start_s,
        period_s: wave.period_s,
        height_m: wave.height_m(),
        crest_m: wave.crest_m,
        trough_m: wave.trough_m,
    }))
}
