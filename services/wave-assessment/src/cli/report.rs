//! What `halcyon waves` prints: numbers with their units in their names, and 95 % intervals as `x_low` and `x_high`.

use halcyon_ocean::crossing::{Crossing, Wave, WaveStatistics, waves};
use halcyon_ocean::filter::band_pass;
use halcyon_ocean::interval::{Interval, SpectralIntervals, WaveIntervals};
use halcyon_ocean::quality::{Assessment, Even, Finding};
use halcyon_ocean::record::RecordError;
use halcyon_ocean::{Record, SampledSpectrum, Taper, Welch};
use serde::Serialize;

use super::crests::{CrestReport, crests};
use super::shape::Shape;
use super::witness::WitnessReport;
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
    /// Bursts that hold no waves to speak of.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub unusable: Vec<Unusable>,
    /// The last part of the record or of its last burst, which is what a verdict is about; `None` where that is all of it, and in words what is
    /// wrong with it.
    #[serde(skip)]
    pub latest: Result<Option<Burst>, String>,
    /// What a second witness says of the whole record, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub witness: Option<WitnessReport>,
}

/// A burst without waves to speak of.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Unusable {
    /// Its number, from 1.
    pub burst: usize,
    /// Why.
    pub reason: String,
}

impl WavesReport {
    pub(super) fn new(
        readings: &Readings,
        (first, bursts, unusable): (Burst, Vec<Burst>, Vec<Unusable>),
        latest: Result<Option<Burst>, String>,
        witness: Option<WitnessReport>,
    ) -> Self {
        Self {
            time_column: readings.time_column.clone(),
            value_column: readings.value_column.clone(),
            unit: readings.unit.as_str(),
            first,
            bursts,
            unusable,
            latest,
            witness,
        }
    }
}

/// One record that is analysed by itself.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Burst {
    /// Its number, from 1, where the record was cut.
    #[serde(rename = "burst", skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
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
    /// Beside the longest stretch, which is analysed, the record spans so much more, seconds: before or after a gap too long to fill. Absent where
    /// there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_out_s: Option<f64>,
    /// Mean elevation, metres.
    pub mean_m: f64,
    /// Standard deviation about the trend, metres.
    pub deviation_m: f64,
    /// Standard deviation of what is slower than the waves' band, metres, where it was taken off: tide, seiche, a drifting sensor. Waves that ride
    /// on it would cross no mean level; absent where it is next to nothing.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slow_deviation_m: Option<f64>,
    /// Skewness of the elevation; null where it is flat.
    pub skewness: f64,
    /// Its kurtosis, 3 for a Gaussian sea.
    pub kurtosis: f64,
    /// Waves from one rise through the trend to the next; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zero_up: Option<ZeroCrossing>,
    /// Waves from one fall through the trend to the next; absent where there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub zero_down: Option<ZeroCrossing>,
    /// From the spectrum; absent where it holds no energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spectrum: Option<Spectrum>,
    /// What the spectrum says beyond its moments; absent where it holds no energy.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<Shape>,
    /// Crests and heights against theories; empty with too few waves.
    pub crest_statistics: Vec<CrestReport>,
    /// Every quality test.
    pub quality: Vec<FlagReport>,
    /// The density spectrum, line by line; each line's 95 % interval is it times `shape.line_factor_low` to `shape.line_factor_high`.
    #[serde(serialize_with = "super::lists::lines")]
    pub density: Option<SampledSpectrum>,
    /// The elevation without its trend, metres, for plots.
    #[serde(skip)]
    pub elevation_m: Vec<f64>,
    /// Every wave between rises through the trend.
    #[serde(serialize_with = "super::lists::waves")]
    pub waves: Vec<Wave>,
}

/// Declares numbers, some of which have 95 % intervals as siblings.
macro_rules! with_intervals {
    ($(#[$doc:meta])* $name:ident { $($plain:ident: $type:ty,)* } $($value:ident, $low:ident, $high:ident;)*) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Serialize)]
        #[allow(missing_docs, reason = "as halcyon_ocean has them")]
        pub struct $name {
            $(pub $plain: $type,)*
            $(
                pub $value: f64,
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $low: Option<f64>,
                #[serde(skip_serializing_if = "Option::is_none")]
                pub $high: Option<f64>,
            )*
        }
    };
}

with_intervals! {
    /// Statistics of single waves; bounds are absent where there are too few waves. Highest wave, crest and trough are facts of the record.
    ZeroCrossing { waves: usize, h_max_m: f64, crest_max_m: f64, trough_min_m: f64, }
    h_mean_m, h_mean_m_low, h_mean_m_high;
    h_rms_m, h_rms_m_low, h_rms_m_high;
    h_s_m, h_s_m_low, h_s_m_high;
    h_tenth_m, h_tenth_m_low, h_tenth_m_high;
    t_z_s, t_z_s_low, t_z_s_high;
    t_third_s, t_third_s_low, t_third_s_high;
}

impl ZeroCrossing {
    /// `h_m0_high_m` is the upper bound of H_m0 by the spectrum, where there is one.
    fn of(waves: &[Wave], h_m0_high_m: Option<f64>) -> Option<Self> {
        let found = WaveStatistics::of(waves)?;
        let bounds = WaveIntervals::of(waves).map(|bounds| h_m0_high_m.map_or(bounds, |high_m| bounds.not_below(high_m)));
        let low = |pick: fn(&WaveIntervals) -> Interval| bounds.as_ref().map(|bounds| pick(bounds).0);
        let high = |pick: fn(&WaveIntervals) -> Interval| bounds.as_ref().map(|bounds| pick(bounds).1);
        Some(Self {
            waves: found.waves,
            h_max_m: found.h_max_m,
            crest_max_m: found.crest_max_m,
            trough_min_m: found.trough_min_m,
            h_mean_m: found.h_mean_m,
            h_mean_m_low: low(|b| b.h_mean_m),
            h_mean_m_high: high(|b| b.h_mean_m),
            h_rms_m: found.h_rms_m,
            h_rms_m_low: low(|b| b.h_rms_m),
            h_rms_m_high: high(|b| b.h_rms_m),
            h_s_m: found.h_s_m,
            h_s_m_low: low(|b| b.h_s_m),
            h_s_m_high: high(|b| b.h_s_m),
            h_tenth_m: found.h_tenth_m,
            h_tenth_m_low: low(|b| b.h_tenth_m),
            h_tenth_m_high: high(|b| b.h_tenth_m),
            t_z_s: found.t_z_s,
            t_z_s_low: low(|b| b.t_z_s),
            t_z_s_high: high(|b| b.t_z_s),
            t_third_s: found.t_third_s,
            t_third_s_low: low(|b| b.t_third_s),
            t_third_s_high: high(|b| b.t_third_s),
        })
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

with_intervals! {
    /// Statistics of a spectrum; moments in m² Hzⁿ.
    Spectrum {
        band: Band, degrees_of_freedom: Option<f64>, f_p_hz: f64, width_epsilon: f64, width_nu: f64, peakedness_q_p: f64, m_minus1: f64, m0: f64, m1: f64, m2: f64, m3: f64, m4: f64,
    }
    h_m0_m, h_m0_m_low, h_m0_m_high;
    t_p_s, t_p_s_low, t_p_s_high;
    t_m01_s, t_m01_s_low, t_m01_s_high;
    t_m02_s, t_m02_s_low, t_m02_s_high;
    t_e_s, t_e_s_low, t_e_s_high;
}

impl Spectrum {
    fn of(taper: Taper, record: &Record, density: &SampledSpectrum, (low_hz, high_hz): (f64, f64)) -> Option<Self> {
        let found = density.statistics(low_hz, high_hz)?;
        let bounds = SpectralIntervals::under(taper, record, density, &found, (low_hz, high_hz));
        let moment = |order| density.moment(order, low_hz, high_hz);
        let low = |pick: fn(&SpectralIntervals) -> Interval| bounds.as_ref().map(|bounds| pick(bounds).0);
        let high = |pick: fn(&SpectralIntervals) -> Interval| bounds.as_ref().map(|bounds| pick(bounds).1);
        Some(Self {
            band: Band { low_hz, high_hz },
            degrees_of_freedom: bounds.as_ref().map(|bounds| bounds.degrees_of_freedom),
            f_p_hz: found.f_p_hz,
            width_epsilon: density.width_epsilon(low_hz, high_hz),
            width_nu: density.width_nu(low_hz, high_hz),
            peakedness_q_p: density.peakedness(low_hz, high_hz),
            m_minus1: moment(-1),
            m0: found.m0_m2,
            m1: moment(1),
            m2: moment(2),
            m3: moment(3),
            m4: moment(4),
            h_m0_m: found.h_m0_m,
            h_m0_m_low: low(|b| b.h_m0_m),
            h_m0_m_high: high(|b| b.h_m0_m),
            t_p_s: found.t_p_s,
            t_p_s_low: low(|b| b.t_p_s),
            t_p_s_high: high(|b| b.t_p_s),
            t_m01_s: found.t_m01_s,
            t_m01_s_low: low(|b| b.t_m01_s),
            t_m01_s_high: high(|b| b.t_m01_s),
            t_m02_s: found.t_m02_s,
            t_m02_s_low: low(|b| b.t_m02_s),
            t_m02_s_high: high(|b| b.t_m02_s),
            t_e_s: found.t_e_s,
            t_e_s_low: low(|b| b.t_e_s),
            t_e_s_high: high(|b| b.t_e_s),
        })
    }
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
    pub(super) fn new(
        even: &Even,
        assessment: &Assessment,
        (segment_s, taper): (f64, Taper),
        band_hz: (f64, f64),
    ) -> Result<Self, RecordError> {
        let mean_m = even.record.mean_m();
        let (record, slow_deviation_m) = without_tide(even.record.clone().without_trend(), band_hz.0)?;
        let up = waves(&record, Crossing::Up, 0.0);
        let welch = Welch { taper, ..Welch::with_segments_of_s(segment_s, &record) };
        let density = welch.spectrum(&record)?;
        let band_hz = (band_hz.0, band_hz.1.min(0.5 * record.rate_hz()));
        let spectrum = Spectrum::of(taper, &record, &density, band_hz);
        let h_m0_high_m = spectrum.as_ref().and_then(|spectrum| spectrum.h_m0_m_high);
        let crest_statistics = spectrum.as_ref().map_or_else(Vec::new, |spectrum| crests(&up, spectrum, &density));
        Ok(Self {
            number: None,
            samples: record.samples_m().len(),
            filled: even.filled.iter().filter(|filled| **filled).count(),
            rate_hz: record.rate_hz(),
            start_s: even.start_s,
            duration_s: record.duration_s(),
            left_out_s: None,
            mean_m,
            deviation_m: record.variance_m2().sqrt(),
            slow_deviation_m,
            skewness: record.skewness(),
            kurtosis: record.kurtosis(),
            zero_up: ZeroCrossing::of(&up, h_m0_high_m),
            zero_down: ZeroCrossing::of(&waves(&record, Crossing::Down, 0.0), h_m0_high_m),
            spectrum,
            shape: Shape::of(&welch, record.samples_m().len(), &density, band_hz),
            crest_statistics,
            quality: assessment.findings.iter().map(FlagReport::from).collect(),
            density: Some(density),
            waves: up,
            elevation_m: record.samples_m().to_vec(),
        })
    }
}

/// A record without what is slower than `low_hz`, and that part's standard deviation, metres; as it is where that is little beside the waves.
fn without_tide(record: Record, low_hz: f64) -> Result<(Record, Option<f64>), RecordError> {
    /// Of the waves' variance: heights then are wrong by a fortieth at most.
    const LITTLE: f64 = 0.05;
    let slow_m = band_pass(&record, 0.0, low_hz);
    let mean_square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>() / x.len() as f64;
    let rest_m: Vec<f64> = record.samples_m().iter().zip(&slow_m).map(|(all, slow)| all - slow).collect();
    if low_hz <= 0.0 || mean_square(&slow_m) <= LITTLE * mean_square(&rest_m) {
        return Ok((record, None));
    }
    Ok((Record::new(rest_m, record.rate_hz())?, Some(mean_square(&slow_m).sqrt())))
}
