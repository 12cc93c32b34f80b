//! What `halcyon waves` prints: numbers with their units in their names, and 95 % intervals as `x_low` and `x_high`.

use halcyon_ocean::crossing::{Crossing, Wave, WaveStatistics, waves};
use halcyon_ocean::quality::{Assessment, Even, Finding};
use halcyon_ocean::record::RecordError;
use halcyon_ocean::{SampledSpectrum, Welch};
use serde::Serialize;

use crate::table::Readings;

/// A file's waves.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WavesReport {
    /// The column of stamps; absent where a rate was stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_column: Option<String>,
    /// The column of elevations.
    pub value_column: String,
    /// The unit it was read in.
    pub unit: &'static str,
    /// The whole record, or the first burst of several.
    #[serde(flatten)]
    pub first: Burst,
    /// Every burst, where the record was cut.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub bursts: Vec<Burst>,
}

impl WavesReport {
    pub(super) fn new(readings: &Readings, mut bursts: Vec<Burst>) -> Self {
        let first = if bursts.len() == 1 { bursts.remove(0) } else { bursts[0].clone() };
        Self {
            time_column: readings.time_column.clone(),
            value_column: readings.value_column.clone(),
            unit: readings.unit.as_str(),
            first,
            bursts,
        }
    }
}

/// One record that is analysed by itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Burst {
    /// Samples of the even record.
    pub samples: usize,
    /// Of these, how many were filled in.
    pub filled: usize,
    /// Their rate, hertz.
    pub rate_hz: f64,
    /// Stamp of the first, seconds.
    pub start_s: f64,
    /// Length, seconds.
    pub duration_s: f64,
    /// Mean elevation, metres.
    pub mean_m: f64,
    /// Standard deviation about the trend, metres.
    pub deviation_m: f64,
    /// Waves from one rise through the trend to the next; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zero_up: Option<ZeroCrossing>,
    /// Waves from one fall through the trend to the next; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zero_down: Option<ZeroCrossing>,
    /// From the spectrum; absent where it holds no energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<Spectrum>,
    /// Every quality test.
    pub quality: Vec<FlagReport>,
    /// The density spectrum, for plots.
    #[serde(skip)]
    pub density: Option<SampledSpectrum>,
    /// The elevation without its trend, metres, for plots.
    #[serde(skip)]
    pub elevation_m: Vec<f64>,
    /// The waves, for lists.
    #[serde(skip)]
    pub waves: Vec<Wave>,
}

/// Statistics of single waves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs, reason = "as halcyon_ocean::WaveStatistics has them")]
pub struct ZeroCrossing {
    pub waves: usize,
    pub h_mean_m: f64,
    pub h_rms_m: f64,
    pub h_s_m: f64,
    pub h_tenth_m: f64,
    pub h_max_m: f64,
    pub t_z_s: f64,
    pub t_third_s: f64,
    pub crest_max_m: f64,
    pub trough_min_m: f64,
}

impl From<WaveStatistics> for ZeroCrossing {
    fn from(of: WaveStatistics) -> Self {
        let WaveStatistics { waves, h_mean_m, h_rms_m, h_s_m, h_tenth_m, h_max_m, .. } = of;
        let WaveStatistics { t_z_s, t_third_s, crest_max_m, trough_min_m, .. } = of;
        Self { waves, h_mean_m, h_rms_m, h_s_m, h_tenth_m, h_max_m, t_z_s, t_third_s, crest_max_m, trough_min_m }
    }
}

/// The frequencies that count as waves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Band {
    /// From, hertz.
    pub low_hz: f64,
    /// To, hertz.
    pub high_hz: f64,
}

/// Statistics of a spectrum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[allow(missing_docs, reason = "as halcyon_ocean::SpectralStatistics has them")]
pub struct Spectrum {
    pub band: Band,
    pub h_m0_m: f64,
    pub t_p_s: f64,
    pub f_p_hz: f64,
    pub t_m01_s: f64,
    pub t_m02_s: f64,
    pub t_e_s: f64,
    pub m_minus1: f64,
    pub m0: f64,
    pub m1: f64,
    pub m2: f64,
    pub m3: f64,
    pub m4: f64,
}

/// A quality test's flag.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlagReport {
    /// Which test.
    pub test: &'static str,
    /// Its number in the QARTOD manual, where it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub qartod: Option<u8>,
    /// QARTOD's flag: 1 pass, 2 not evaluated, 3 suspect, 4 fail, 9 missing.
    pub flag: u8,
    /// In words.
    pub reason: String,
    /// How many readings it concerns.
    pub readings: usize,
}

impl From<&Finding> for FlagReport {
    fn from(finding: &Finding) -> Self {
        Self {
            test: finding.test.name(),
            qartod: finding.test.number(),
            flag: finding.flag.number(),
            reason: finding.reason.clone(),
            readings: finding.samples.len(),
        }
    }
}

impl Burst {
    pub(super) fn new(even: &Even, assessment: &Assessment, segment_s: f64, band_hz: (f64, f64)) -> Result<Self, RecordError> {
        let mean_m = even.record.mean_m();
        let record = even.record.clone().without_trend();
        let of = |crossing| WaveStatistics::of(&waves(&record, crossing, 0.0)).map(ZeroCrossing::from);
        let density = Welch::with_segments_of_s(segment_s, &record).spectrum(&record)?;
        let (low_hz, high_hz) = (band_hz.0, band_hz.1.min(0.5 * record.rate_hz()));
        let spectrum = density.statistics(low_hz, high_hz).map(|found| {
            let moment = |order| density.moment(order, low_hz, high_hz);
            Spectrum {
                band: Band { low_hz, high_hz },
                h_m0_m: found.h_m0_m,
                t_p_s: found.t_p_s,
                f_p_hz: found.f_p_hz,
                t_m01_s: found.t_m01_s,
                t_m02_s: found.t_m02_s,
                t_e_s: found.t_e_s,
                m_minus1: moment(-1),
                m0: found.m0_m2,
                m1: moment(1),
                m2: moment(2),
                m3: moment(3),
                m4: moment(4),
            }
        });
        Ok(Self {
            samples: record.samples_m().len(),
            filled: even.filled.iter().filter(|filled| **filled).count(),
            rate_hz: record.rate_hz(),
            start_s: even.start_s,
            duration_s: record.duration_s(),
            mean_m,
            deviation_m: record.variance_m2().sqrt(),
            zero_up: of(Crossing::Up),
            zero_down: of(Crossing::Down),
            spectrum,
            quality: assessment.findings.iter().map(FlagReport::from).collect(),
            density: Some(density),
            waves: waves(&record, Crossing::Up, 0.0),
            elevation_m: record.samples_m().to_vec(),
        })
    }
}
