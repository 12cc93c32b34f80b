//! A second witness: another sensor's record of the same waves.

use std::path::PathBuf;

use halcyon_ocean::interval::Interval;
use halcyon_ocean::quality::RawSeries;
use halcyon_ocean::witness::{Comparison, Difference, Ignorance, Options, Verdict, agreement, compare};
use serde::Serialize;

use super::verdict::{ReasonReport, VerdictReport};
use super::{WavesError, readings};
use crate::table::Choice;

/// Where the witness's record is.
#[derive(Debug, Clone, PartialEq)]
pub struct Witness {
    /// The file.
    pub input: PathBuf,
    /// Its columns.
    pub choice: Choice,
    /// Its clock may be off by so much either way, seconds.
    pub max_lag_s: f64,
    /// Standard deviation of a reading's noise, metres; a resolution of r is r/√12.
    pub noise_m: f64,
}

/// What a witness says of a record, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WitnessReport {
    /// `agree`, `disagree` or `unknown`.
    pub verdict: &'static str,
    /// Why not.
    pub why: Vec<String>,
    /// The comparison; absent where the two cannot be compared.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub comparison: Option<ComparisonReport>,
}

/// Both over the time that both have; a is the record, b the witness.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ComparisonReport {
    /// Time that both have, seconds.
    pub common_s: f64,
    /// How much later the witness's waves come, seconds; absent where that cannot be told.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub lag_s: Option<f64>,
    /// Pearson's.
    pub correlation: f64,
    /// Of the record on the witness: as if the witness had no error.
    pub slope: f64,
    /// The same where both have errors (reduced major axis).
    pub slope_reduced: f64,
    /// Coefficient of determination.
    pub r_squared: f64,
    /// Mean of the record less the witness, metres.
    pub bias_m: f64,
    /// Root mean square difference, metres.
    pub rmse_m: f64,
    /// Magnitude-squared coherence about the peak.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coherence: Option<f64>,
    /// H_m0 of each, metres.
    pub h_m0_a_m: f64,
    /// The witness's.
    pub h_m0_b_m: f64,
    /// The record's over the witness's, without noise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_ratio: Option<f64>,
    /// Its 95 % interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_ratio_low: Option<f64>,
    /// Its 95 % interval.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub height_ratio_high: Option<f64>,
}

impl WitnessReport {
    /// Of a record of stamps, seconds, and elevations, metres.
    ///
    /// # Errors
    /// [`WavesError`] where the witness's file cannot be read.
    pub fn of(record: RawSeries<'_>, witness: &Witness, band_hz: Interval) -> Result<Self, WavesError> {
        if !(0.0..=3600.0).contains(&witness.max_lag_s) {
            let must = "from 0 to 3600 s".into();
            return Err(WavesError::Option { option: "--witness-lag", must, value: witness.max_lag_s });
        }
        if !(0.0..=1.0).contains(&witness.noise_m) {
            let must = "from 0 to 1 m".into();
            return Err(WavesError::Option { option: "--witness-noise", must, value: witness.noise_m });
        }
        let other = readings(&witness.input, &witness.choice)?;
        let same = |a: &[f64], b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        if same(record.elevation_m, &other.elevation_m) {
            let why = vec!["it holds the very readings that it should confirm".into()];
            return Ok(Self { verdict: "unknown", why, comparison: None });
        }
        let other = RawSeries { stamp_s: &other.stamp_s, elevation_m: &other.elevation_m };
        let options = Options { max_lag_s: witness.max_lag_s, noise_b_m: witness.noise_m, band_hz, ..Options::default() };
        let compared = match compare(&record, &other, &options) {
            Ok(compared) => compared,
            Err(error) => return Ok(Self { verdict: "unknown", why: vec![error.to_string()], comparison: None }),
        };
        let (verdict, why) = match agreement(&compared) {
            Verdict::Agree => match unrelated(&compared) {
                Some(why) => ("unknown", vec![why]),
                None => ("agree", Vec::new()),
            },
            Verdict::Disagree { why } => ("disagree", why.iter().map(Difference::to_string).collect()),
            Verdict::Unknown { why } => ("unknown", why.iter().map(ignorance).collect()),
        };
        let ratio = compared.height_ratio.map(|ratio| (ratio.value, ratio.interval_95()));
        Ok(Self {
            verdict,
            why,
            comparison: Some(ComparisonReport {
                common_s: compared.common_s,
                lag_s: compared.lag_s,
                correlation: compared.correlation,
                slope: compared.regression.slope,
                slope_reduced: compared.regression.slope_reduced,
                r_squared: compared.regression.r_squared,
                bias_m: compared.bias_m,
                rmse_m: compared.rmse_m,
                coherence: compared.at_peak.map(|peak| peak.coherence),
                h_m0_a_m: compared.a.h_m0_m,
                h_m0_b_m: compared.b.h_m0_m,
                height_ratio: ratio.map(|(value, _)| value),
                height_ratio_low: ratio.map(|(_, (low, _))| low),
                height_ratio_high: ratio.map(|(_, (_, high))| high),
            }),
        })
    }

    /// Puts what the witness says into a verdict: water that two sensors see differently, or that the second one cannot confirm, is
    /// not known.
    pub fn weigh(&self, verdict: &mut VerdictReport) {
        let passed = self.verdict == "agree";
        let text = match self.verdict {
            "agree" => "the second witness agrees within the intervals".to_owned(),
            "disagree" => format!("the second witness disagrees: {}", self.why.join("; ")),
            _ => format!("the second witness says nothing: {}", self.why.join("; ")),
        };
        let reason = ReasonReport { check: "witness".into(), passed, text };
        if passed {
            verdict.reasons.push(reason);
            return;
        }
        verdict.reasons.insert(0, reason);
        verdict.probability = None;
        verdict.state = "inconclusive";
    }
}

/// Whether two records that should be of the same waves have nothing in common but heights and periods, in words: any sea of that height would do.
fn unrelated(compared: &Comparison) -> Option<String> {
    /// Coherence that unrelated records exceed no more often than this is no chance. The best of all lags was taken, which makes more of chance than
    /// one look does.
    const CHANCE: f64 = 0.001;
    let peak = compared.at_peak?;
    let by_chance = 1.0 - CHANCE.powf(1.0 / (peak.averages - 1.0).max(f64::MIN_POSITIVE));
    (peak.coherence <= by_chance).then(|| {
        format!(
            "heights and periods agree, the waves do not (coherence of {:.2} about the peak, and {by_chance:.2} come by chance): another place or time, \
             or a clock that is off by more than the lag allowed",
            peak.coherence
        )
    })
}

fn ignorance(ignorance: &Ignorance) -> String {
    match ignorance {
        Ignorance::Incomparable(error) => error.to_string(),
        Ignorance::TooShort { periods, periods_min } => {
            format!("{periods:.0} peak periods in common, {periods_min:.0} needed")
        }
        Ignorance::LittleOverlap { share, share_min } => {
            format!("{:.0} % of the shorter record in common, {:.0} % needed", 100.0 * share, 100.0 * share_min)
        }
        Ignorance::NoWaves { which, .. } => format!("{which} shows no waves above its noise"),
        Ignorance::Undersampled { f_p_hz, high_hz } => {
            format!("the peak at {f_p_hz:.2} Hz is too near to the {high_hz:.2} Hz that the slower one can show")
        }
    }
}
