//! Safe, unsafe or inconclusive, with every reason.

mod checks;

use checks::{Checks, Outcome};
use halcyon_model::{Estimate, QualityFlag, VerdictReason, VerdictState};

use super::statistics::{Largest, Statistics};
use crate::config::{Airframe, Config};

/// Crests need at least this many samples a wave.
const SAMPLES_PER_WAVE_MIN: f64 = 3.0;
/// Largest share of frames that may be copies of the one before.
const REPEATED_MAX: f64 = 0.5;
/// A hull rides waves this many times as long; shorter ones wash over it.
const RIDDEN_HULLS: f64 = 4.0;

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
    /// Quality tests that did not pass.
    pub quality: Vec<QualityFlag>,
    pub statistics: Option<Statistics>,
    /// Whether a second witness agrees, and what it says; `None` where it says nothing.
    pub witness: Option<(bool, String)>,
}

/// What [`judge`] says.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Judgement {
    pub state: VerdictState,
    /// What decided before the rest.
    pub reasons: Vec<VerdictReason>,
    /// That the water is under every limit; `None` where the measurement cannot be trusted.
    pub probability: Option<f64>,
}

/// Draws a verdict. `previous` is the last one, for hysteresis: bounds must be well under the limits to become safe, and reach
/// them to stop being so; unsafe water stays so until the best estimates are under the limits.
pub(crate) fn judge(evidence: &Evidence, config: &Config, previous: VerdictState) -> Judgement {
    let freedom = evidence.statistics.as_ref().map(|statistics| statistics.freedom);
    let mut checks = Checks::new(previous, config.hysteresis, evidence.observed_s / config.window_s, freedom);
    measurement(&mut checks, evidence, config);
    match (&evidence.statistics, config.airframe.resolved()) {
        (Some(statistics), Ok(airframe)) => {
            waves(&mut checks, statistics, evidence.interval_s, config, previous);
            let largest = statistics.largest(config.landing_s);
            heights(&mut checks, statistics, &largest, config);
            vehicle(&mut checks, statistics, &largest, config, &airframe);
        }
        (_, Err(problem)) => checks.unknown("airframe", &problem),
        (None, Ok(_)) => {
            for name in ["significant_height", "highest_tenth", "highest_wave", "slope", "tilt", "hull", "touchdown_speed"] {
                checks.unknown(name, "not yet measured");
            }
        }
    }
    let (state, reasons, probability) = checks.verdict();
    Judgement { state, reasons, probability }
}

/// Whether there is enough of a measurement, and it can be trusted.
fn measurement(checks: &mut Checks, evidence: &Evidence, config: &Config) {
    let percent = |share: f64| share * 100.0;
    checks.trusted(
        "window",
        evidence.observed_s >= config.window_s_min,
        format!("water observed for {:.0} s of {:.0} s needed", evidence.observed_s.floor(), config.window_s_min),
    );
    checks.trusted(
        "coverage",
        evidence.coverage >= config.coverage_min,
        format!("{:.0} % of the patches measured, {:.0} % needed", percent(evidence.coverage), percent(config.coverage_min)),
    );
    checks.trusted(
        "repeated",
        evidence.repeated <= REPEATED_MAX,
        format!("{:.0} % of the patches are copies of the one before", percent(evidence.repeated)),
    );
    checks.trusted(
        "outliers",
        evidence.outliers <= config.outliers_max,
        format!(
            "{:.1} % of the samples were outliers, at most {:.1} % allowed",
            percent(evidence.outliers),
            percent(config.outliers_max)
        ),
    );
    for flag in evidence.quality.iter().filter(|flag| flag.failed) {
        checks.add(&flag.test, Outcome::Untrusted, flag.text.clone());
    }
    if let Some((agrees, text)) = &evidence.witness {
        checks.trusted("witness", *agrees, text.clone());
    }
    let footprint_m = evidence.footprint_m;
    match evidence.hidden_m {
        Some(height_m) => checks.add(
            "long_waves",
            Outcome::Passed,
            format!(
                "waves longer than the {footprint_m:.1} m footprint: at most {height_m:.3} m by the level's movement, added to the bounds"
            ),
        ),
        None => checks.add(
            "long_waves",
            Outcome::Failed,
            format!(
                "waves longer than the {footprint_m:.1} m footprint are hidden: no height of the rig, and not configured as fixed"
            ),
        ),
    }
}

/// Whether there are enough waves, sampled often enough.
fn waves(checks: &mut Checks, statistics: &Statistics, interval_s: Option<f64>, config: &Config, previous: VerdictState) {
    let waves = statistics.waves_at_one;
    // A tenth more to become safe, so that a wave more or less in the window does not make the verdict flicker.
    let waves_min = f64::from(config.waves_min) * if previous == VerdictState::Safe { 1.0 } else { 1.0 + config.hysteresis };
    if statistics.above_noise {
        checks.known("waves", waves as f64 >= waves_min, format!("{waves} waves at one gauge, {waves_min:.0} needed"));
    } else {
        let high_m = statistics.h_m0_m.high;
        checks.add(
            "waves",
            Outcome::Passed,
            format!("no waves above the measurement's noise; judged by its bound, H_m0 under {high_m:.3} m"),
        );
    }
    if let (Some(t_z), Some(interval_s)) = (statistics.t_z_s, interval_s) {
        let samples = t_z.value / interval_s;
        checks.known(
            "sampling",
            samples >= SAMPLES_PER_WAVE_MIN,
            format!("{samples:.1} patches a wave, {SAMPLES_PER_WAVE_MIN:.0} needed"),
        );
    }
}

/// Limits of the mission.
fn heights(checks: &mut Checks, statistics: &Statistics, largest: &Largest, config: &Config) {
    checks.limit("significant_height", "H_s", "m", statistics.significant_m(), config.h_s_m_max);
    checks.limit("highest_tenth", "mean of the highest tenth", "m", statistics.h_tenth_m, config.h_tenth_m_max);
    let highest_m = statistics.highest_m(largest);
    checks.limit("highest_wave", "expected highest wave of the landing", "m", highest_m, config.h_highest_m_max);
    match statistics.slope_rms_rad {
        Some(slope) => checks.limit("slope", "RMS slope", "rad", slope, config.slope_rms_rad_max),
        None => checks.unknown("slope", "slope could not be measured"),
    }
}

/// Limits of the airframe, each less its margin.
fn vehicle(checks: &mut Checks, statistics: &Statistics, largest: &Largest, config: &Config, airframe: &Airframe) {
    let kept = 1.0 - config.airframe.margin;
    match statistics.tilt_rad(largest) {
        Some(tilt) => {
            checks.limit("tilt", "expected steepest water of the landing", "rad", tilt, airframe.tip_angle_rad * kept);
        }
        None => checks.unknown("tilt", "slope could not be measured"),
    }
    let length = statistics.wavelength_m();
    let (hull_m, ridden_m) = (airframe.hull_length_m, RIDDEN_HULLS * airframe.hull_length_m);
    let crest = halved(statistics.h_tenth_m);
    let deck_m = airframe.float_depth_m * kept;
    if length.low >= ridden_m {
        checks.add(
            "hull",
            Outcome::Passed,
            format!("waves of {:.1} m carry the hull of {hull_m:.1} m (over {ridden_m:.1} m)", length.value),
        );
    } else {
        let what = format!("waves of {:.1} m wash over a hull of {hull_m:.1} m: crests of the highest tenth", length.value);
        checks.limit("hull", &what, "m", crest, deck_m);
    }
    let descent_mps = config.airframe.descent_mps;
    let rise = statistics.rise_mps(largest);
    let meeting = Estimate { value: rise.value + descent_mps, low: rise.low + descent_mps, high: rise.high + descent_mps };
    checks.limit(
        "touchdown_speed",
        "expected fastest meeting of water and floats",
        "m/s",
        meeting,
        airframe.touchdown_speed_mps * kept,
    );
}

fn halved(height: Estimate) -> Estimate {
    Estimate { value: 0.5 * height.value, low: 0.5 * height.low, high: 0.5 * height.high }
}
