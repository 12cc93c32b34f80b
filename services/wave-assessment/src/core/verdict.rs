//! Safe, unsafe or inconclusive, with every reason.

use halcyon_model::{Estimate, VerdictReason, VerdictState};

use super::statistics::Statistics;
use crate::config::Config;

/// Crests need at least this many samples a wave.
const SAMPLES_PER_WAVE_MIN: f64 = 3.0;
/// Largest share of frames that may be copies of the one before.
const REPEATED_MAX: f64 = 0.5;

/// What a verdict is drawn from.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Evidence {
    pub observed_s: f64,
    pub coverage: f64,
    /// Share of frames that repeat the one before.
    pub repeated: f64,
    /// Share of samples that were replaced.
    pub outliers: f64,
    pub interval_s: Option<f64>,
    pub footprint_m: f64,
    /// Height of what may be waves longer than the footprint, metres; `None` where they cannot be seen at all.
    pub hidden_m: Option<f64>,
    pub statistics: Option<Statistics>,
}

/// How a check ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    /// As it should be.
    Passed,
    /// Not known to be.
    Failed,
    /// Known not to be.
    Over,
    /// The measurement itself cannot be trusted: nothing follows from it, not even that the water is rough.
    Untrusted,
}

/// Draws a verdict. `previous` is the last one, for hysteresis: bounds must be well under the limits to become safe, and reach
/// them to stop being so; unsafe water stays so until the best estimates are under the limits.
pub(crate) fn judge(evidence: &Evidence, config: &Config, previous: VerdictState) -> (VerdictState, Vec<VerdictReason>) {
    let mut checks: Vec<(Outcome, VerdictReason)> = Vec::new();
    let mut check = |name: &str, outcome: Outcome, text: String| {
        checks.push((outcome, VerdictReason { check: name.into(), passed: outcome == Outcome::Passed, text }));
    };
    let trusted = |ok: bool| if ok { Outcome::Passed } else { Outcome::Untrusted };
    let known = |ok: bool| if ok { Outcome::Passed } else { Outcome::Failed };

    check(
        "window",
        trusted(evidence.observed_s >= config.window_s_min),
        format!("water observed for {:.0} s of {:.0} s needed", evidence.observed_s.floor(), config.window_s_min),
    );
    check(
        "coverage",
        trusted(evidence.coverage >= config.coverage_min),
        format!("{:.0} % of the patches measured, {:.0} % needed", evidence.coverage * 100.0, config.coverage_min * 100.0),
    );
    check(
        "repeated",
        trusted(evidence.repeated <= REPEATED_MAX),
        format!("{:.0} % of the patches are copies of the one before", evidence.repeated * 100.0),
    );
    check(
        "outliers",
        trusted(evidence.outliers <= config.outliers_max),
        format!(
            "{:.1} % of the samples were outliers, at most {:.1} % allowed",
            evidence.outliers * 100.0,
            config.outliers_max * 100.0
        ),
    );
    let footprint_m = evidence.footprint_m;
    match evidence.hidden_m {
        Some(height_m) => check(
            "long_waves",
            Outcome::Passed,
            format!(
                "waves longer than the {footprint_m:.1} m footprint: at most {height_m:.3} m by the level's movement, added to the bounds"
            ),
        ),
        None => check(
            "long_waves",
            Outcome::Failed,
            format!(
                "waves longer than the {footprint_m:.1} m footprint are hidden: no height of the rig, and not configured as fixed"
            ),
        ),
    }

    if let Some(statistics) = &evidence.statistics {
        let waves = statistics.waves_at_one;
        // A tenth more to become safe, so that a wave more or less in the window does not make the verdict flicker.
        let waves_min =
            f64::from(config.waves_min) * if previous == VerdictState::Safe { 1.0 } else { 1.0 + config.hysteresis };
        if statistics.above_noise {
            check("waves", known(waves as f64 >= waves_min), format!("{waves} waves at one gauge, {waves_min:.0} needed"));
        } else {
            check(
                "waves",
                Outcome::Passed,
                format!(
                    "no waves above the measurement's noise; judged by its bound, H_m0 under {:.3} m",
                    statistics.h_m0_m.high
                ),
            );
        }
        if let (Some(t_z), Some(interval_s)) = (statistics.t_z_s, evidence.interval_s) {
            let samples = t_z.value / interval_s;
            check(
                "sampling",
                known(samples >= SAMPLES_PER_WAVE_MIN),
                format!("{samples:.1} patches a wave, {SAMPLES_PER_WAVE_MIN:.0} needed"),
            );
        }
        let mut limit = |name: &str, what: &str, unit: &str, measured: Estimate, limit: f64| {
            let Estimate { value, low, high } = measured;
            let margin = if previous == VerdictState::Safe { 1.0 } else { 1.0 - config.hysteresis };
            let outcome = if !measured.is_valid() {
                Outcome::Failed
            } else if low > limit || (previous == VerdictState::Unsafe && value >= limit) {
                Outcome::Over
            } else {
                known(high < limit * margin)
            };
            let verb = match outcome {
                Outcome::Passed => "under",
                Outcome::Over => "over",
                Outcome::Failed | Outcome::Untrusted => "not surely under",
            };
            let target =
                if margin < 1.0 { format!(" (by {:.0} % to become safe)", config.hysteresis * 100.0) } else { String::new() };
            check(
                name,
                outcome,
                format!("{what} {value:.3} {unit} ({low:.3} to {high:.3}), {verb} the limit of {limit:.3} {unit}{target}"),
            );
        };
        limit("significant_height", "H_s", "m", statistics.significant_m(), config.h_s_m_max);
        limit(
            "highest_wave",
            "expected highest wave of the landing",
            "m",
            statistics.highest_m(config.landing_s),
            config.h_highest_m_max,
        );
        match statistics.slope_rms_rad {
            Some(slope) => limit("slope", "RMS slope", "rad", slope, config.slope_rms_rad_max),
            None => check("slope", Outcome::Failed, "slope could not be measured".into()),
        }
    } else {
        for name in ["significant_height", "highest_wave", "slope"] {
            check(name, Outcome::Failed, "not yet measured".into());
        }
    }

    let any = |outcome: Outcome| checks.iter().any(|(o, _)| *o == outcome);
    let state = if any(Outcome::Untrusted) {
        VerdictState::Inconclusive
    } else if any(Outcome::Over) {
        VerdictState::Unsafe
    } else if any(Outcome::Failed) {
        VerdictState::Inconclusive
    } else {
        VerdictState::Safe
    };
    // Failed ones first, what decided before the rest; the sort is stable.
    checks.sort_by_key(|(outcome, _)| match outcome {
        Outcome::Untrusted => 0,
        Outcome::Over => 1,
        Outcome::Failed => 2,
        Outcome::Passed => 3,
    });
    (state, checks.into_iter().map(|(_, reason)| reason).collect())
}
