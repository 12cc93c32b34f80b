//! A verdict on a record of one gauge, by the limits that patches are judged by.

use halcyon_model::{Estimate, VerdictState};
use halcyon_ocean::dispersion::GRAVITY_MPS2;
use serde::Serialize;

use super::Burst;
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

/// Judges a record. Slope is that of waves in deep water by the spectrum, (2π)⁴ m4 / g² (Cox and Munk 1954 have it so): noise raises it, which
/// is on the safe side. A record with a failed quality test is judged by nothing.
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
        statistics: statistics(burst),
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
    reasons.extend(checks);
    let valid_until = burst.start_s + burst.duration_s + config.validity_s;
    VerdictReport { state: state.as_str(), probability, reasons, valid_until }
}

/// `None` without waves.
fn statistics(burst: &Burst) -> Option<Statistics> {
    let (up, spectrum) = (burst.zero_up.as_ref()?, burst.spectrum.as_ref()?);
    // Without bounds nothing is known: NaN passes no check.
    let estimate = |value: f64, low: Option<f64>, high: Option<f64>| Estimate {
        value,
        low: low.unwrap_or(f64::NAN),
        high: high.unwrap_or(f64::NAN),
    };
    let slope = (std::f64::consts::TAU.powi(4) * spectrum.m4).sqrt() / GRAVITY_MPS2;
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
