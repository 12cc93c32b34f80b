//! A verdict on a record of one gauge, by the limits that patches are judged by.

use halcyon_model::{Estimate, VerdictState};
use serde::Serialize;

use super::{Band, Burst, WavesReport};
use crate::config::Config;
use crate::core::{Evidence, Judgement, Statistics, judge};

/// A verdict, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct VerdictReport {
    /// `safe`, `unsafe` or `inconclusive`.
    pub state: &'static str,
    /// That the water is under every limit, by the measurement; `null` where it cannot be trusted.
    pub probability: Option<f64>,
    /// Every check in words, those that failed first.
    pub reasons: Vec<ReasonReport>,
    /// Stamp from which on the record was judged, seconds: of a long record the last part is, as it is in flight.
    pub judged_from_s: f64,
    /// For so long, seconds.
    pub judged_s: f64,
    /// Seconds of the record's stamps after which it means nothing.
    pub valid_until: f64,
}

/// One check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReasonReport {
    /// Its name.
    pub check: String,
    /// Whether it passed.
    pub passed: bool,
    /// In words.
    pub text: String,
}

/// Checks that make sense of patches only.
const OF_PATCHES: [&str; 3] = ["coverage", "repeated", "long_waves"];

/// Judges a file by its newest waves: the last part of the record, or of the last burst. Who lands, lands on what comes next, and an hour's mean may
/// be that of a calm before it. A burst or part that is unusable is judged by nothing.
#[must_use]
pub fn newest(report: &WavesReport, config: &Config) -> VerdictReport {
    let last = report.bursts.last().unwrap_or(&report.first);
    let unusable = match (&report.latest, report.unusable.last()) {
        (_, Some(one)) if last.number.is_none_or(|number| one.burst > number) => {
            Some(format!("burst {}, the last one, is unusable: {}", one.burst, one.reason))
        }
        (Err(reason), _) => Some(format!("the last part of the record is unusable: {reason}")),
        _ => None,
    };
    let latest = report.latest.as_ref().ok().and_then(Option::as_ref);
    let mut judged = verdict(latest.unwrap_or(last), config);
    if let Some(text) = unusable {
        judged.state = VerdictState::Inconclusive.as_str();
        judged.probability = None;
        judged.reasons.insert(0, ReasonReport { check: "usable".into(), passed: false, text });
    }
    judged
}

/// Judges a record as a whole. Slope is that of waves in deep water by the spectrum (Cox and Munk 1954 have it so) over the baseline that patches
/// are measured with: noise raises it, which is on the safe side. A record with a failed quality test is judged by nothing, and one with a wave over
/// the limit of the highest is not safe.
#[must_use]
pub fn verdict(burst: &Burst, config: &Config) -> VerdictReport {
    let evidence = Evidence {
        observed_s: burst.duration_s,
        coverage: 1.0,
        repeated: 0.0,
        outliers: burst.filled as f64 / burst.samples.max(1) as f64,
        interval_s: Some(1.0 / burst.rate_hz),
        footprint_m: 0.0,
        hidden_m: Some(0.0),
        // They come with the burst, and their words go first below.
        quality: Vec::new(),
        statistics: statistics(burst, config.slope_baseline_m),
        witness: None,
    };
    let Judgement { mut state, reasons, mut probability } = judge(&evidence, config, VerdictState::Inconclusive);
    let checks = reasons.into_iter().filter(|reason| !OF_PATCHES.contains(&reason.check.as_str()));
    let checks = checks.map(|reason| ReasonReport { check: reason.check, passed: reason.passed, text: reason.text });
    let failed = burst.quality.iter().filter(|flag| flag.flag >= 4);
    let failed = failed.map(|flag| ReasonReport { check: flag.test.into(), passed: false, text: flag.reason.clone() });
    let mut reasons: Vec<ReasonReport> = failed.collect();
    if !reasons.is_empty() {
        state = VerdictState::Inconclusive;
        probability = None;
    }
    let highest_m = burst.zero_up.iter().chain(&burst.zero_down).map(|waves| waves.h_max_m).fold(0.0, f64::max);
    let limit_m = config.h_highest_m_max;
    if highest_m > limit_m {
        let text = format!("a wave of {highest_m:.3} m was seen, over the limit of {limit_m:.3} m for the highest");
        reasons.push(ReasonReport { check: "highest_seen".into(), passed: false, text });
        if state == VerdictState::Safe {
            state = VerdictState::Unsafe;
        }
        probability = probability.map(|probability| probability.min(0.5));
    }
    reasons.extend(checks);
    let valid_until = burst.start_s + burst.duration_s + config.validity_s;
    let (judged_from_s, judged_s) = (burst.start_s, burst.duration_s);
    VerdictReport { state: state.as_str(), probability, reasons, judged_from_s, judged_s, valid_until }
}

/// `None` without waves.
fn statistics(burst: &Burst, baseline_m: f64) -> Option<Statistics> {
    let (up, spectrum) = (burst.zero_up.as_ref()?, burst.spectrum.as_ref()?);
    // Without bounds nothing is known: NaN passes no check.
    let estimate = |value: f64, low: Option<f64>, high: Option<f64>| Estimate {
        value,
        low: low.unwrap_or(f64::NAN),
        high: high.unwrap_or(f64::NAN),
    };
    let Band { low_hz, high_hz } = spectrum.band;
    let slope = burst.density.as_ref()?.slope_variance(baseline_m, low_hz, high_hz).sqrt();
    let h_m0_m = estimate(spectrum.h_m0_m, spectrum.h_m0_m_low, spectrum.h_m0_m_high);
    // A slope is a root of a variance, and steep waves are short: it is known at least as well as a height.
    let share = |bound: f64| bound / h_m0_m.value * slope;
    Some(Statistics {
        waves: up.waves,
        waves_at_one: up.waves,
        above_noise: true,
        h_mean_m: estimate(up.h_mean_m, up.h_mean_m_low, up.h_mean_m_high),
        h_s_m: estimate(up.h_s_m, up.h_s_m_low, up.h_s_m_high),
        h_max_m: Estimate { value: up.h_max_m, low: up.h_max_m, high: up.h_max_m },
        h_m0_m,
        h_rms_m: estimate(up.h_rms_m, up.h_rms_m_low, up.h_rms_m_high),
        h_tenth_m: estimate(up.h_tenth_m, up.h_tenth_m_low, up.h_tenth_m_high),
        freedom: 1.0,
        spectral: None,
        t_z_s: Some(estimate(up.t_z_s, up.t_z_s_low, up.t_z_s_high)),
        slope_rms_rad: Some(Estimate { value: slope, low: share(h_m0_m.low), high: share(h_m0_m.high) }),
    })
}
