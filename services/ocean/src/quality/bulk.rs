//! QARTOD's tests of wave parameters: history (15), bounds (19), rate of change (20), and steepness.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use super::{Finding, Flag, Test};
use crate::dispersion::GRAVITY_MPS2;

/// The parameters of a sea state. NaN where unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BulkParameters {
    /// H_m0, metres.
    pub h_m0_m: f64,
    /// Peak period, seconds.
    pub t_p_s: f64,
    /// Mean zero-crossing period √(m0/m2), seconds.
    pub t_m02_s: f64,
    /// Mean direction that the waves come from, radians clockwise from north.
    pub direction_from_rad: f64,
    /// Directional spread, radians.
    pub spread_rad: f64,
}

/// Thresholds of the tests of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct BulkLimits {
    /// H_m0, metres. 0 to 10.
    pub h_m0_m: RangeInclusive<f64>,
    /// Peak period, seconds. 0.3 to 25.
    pub t_p_s: RangeInclusive<f64>,
    /// Mean period, seconds. 0.3 to 20.
    pub t_m02_s: RangeInclusive<f64>,
    /// Spread, radians. 0 to √2, what an even spread over all directions has (Kuik et al., 1988).
    pub spread_rad: RangeInclusive<f64>,
    /// Steepness 2π H_m0/(g T_m02²) that is suspect. 0.1: seas of the open ocean stay under about 0.08.
    pub steepness_suspect: f64,
    /// Steepness that fails. 0.142: the limit of a single wave (Michell, 1893).
    pub steepness_fail: f64,
    /// Change of H_m0 from one window to the next that chance makes, over the larger of the two. 0.3.
    pub height_step_ratio: f64,
    /// Change of H_m0 that the weather makes, metres per hour. 1.
    pub height_growth_m_per_h: f64,
    /// Change of T_m02 that chance makes, over the larger of the two. 0.3.
    pub period_step_ratio: f64,
    /// Change of T_m02 that the weather makes, seconds per hour. 2.
    pub period_growth_s_per_h: f64,
    /// Deviations from the mean of its history that a parameter may have. 3.
    pub history_sigmas: f64,
    /// Values a history needs. 10.
    pub history_min: usize,
}

impl Default for BulkLimits {
    fn default() -> Self {
        Self {
            h_m0_m: 0.0..=10.0,
            t_p_s: 0.3..=25.0,
            t_m02_s: 0.3..=20.0,
            spread_rad: 0.0..=std::f64::consts::SQRT_2,
            steepness_suspect: 0.1,
            steepness_fail: 0.142,
            height_step_ratio: 0.3,
            height_growth_m_per_h: 1.0,
            period_step_ratio: 0.3,
            period_growth_s_per_h: 2.0,
            history_sigmas: 3.0,
            history_min: 10,
        }
    }
}

/// Test 19: bounds. A height out of bounds fails, and with it all the others, as in the manual; anything else out of bounds is suspect.
#[must_use]
pub fn bulk_range(bulk: &BulkParameters, limits: &BulkLimits) -> Finding {
    if bulk.h_m0_m.is_nan() {
        return Finding::new(Test::BulkRange, Flag::Missing, "there is no wave height");
    }
    let named = [
        ("H_m0", bulk.h_m0_m, &limits.h_m0_m, "m"),
        ("T_p", bulk.t_p_s, &limits.t_p_s, "s"),
        ("T_m02", bulk.t_m02_s, &limits.t_m02_s, "s"),
        ("direction", bulk.direction_from_rad, &(0.0..=TAU), "rad"),
        ("spread", bulk.spread_rad, &limits.spread_rad, "rad"),
    ];
    let outside: Vec<String> = named
        .iter()
        .filter(|(_, value, range, _)| !value.is_nan() && !range.contains(value))
        .map(|(name, value, range, unit)| format!("{name} of {value:.3} {unit} is outside {range:?} {unit}"))
        .collect();
    let flag = match outside.is_empty() {
        true => Flag::Pass,
        false if !limits.h_m0_m.contains(&bulk.h_m0_m) => Flag::Fail,
        false => Flag::Suspect,
    };
    let reason = if outside.is_empty() { "all known parameters are within bounds".into() } else { outside.join(", ") };
    Finding::new(Test::BulkRange, flag, reason)
}

/// Waves steeper than water can be: noise, or a wrong scale.
#[must_use]
pub fn steepness(bulk: &BulkParameters, limits: &BulkLimits) -> Finding {
    let steepness = TAU * bulk.h_m0_m / (GRAVITY_MPS2 * bulk.t_m02_s * bulk.t_m02_s);
    let flag = Flag::rising(steepness, limits.steepness_suspect, limits.steepness_fail);
    Finding::new(Test::Steepness, flag, format!("the mean steepness 2π H_m0/(g T_m02²) is {steepness:.3}"))
}

/// Test 20: a change from `before` to `now`, `elapsed_s` later, larger than chance and weather make. Height and mean period; peak period and
/// direction may jump between two systems of waves, and the manual excepts them.
#[must_use]
pub fn rate_of_change(before: &BulkParameters, now: &BulkParameters, elapsed_s: f64, limits: &BulkLimits) -> Finding {
    let hours = elapsed_s / 3600.0;
    let over = |a: f64, b: f64, ratio: f64, per_h: f64| (a - b).abs() / (ratio * a.max(b) + per_h * hours);
    let height = over(before.h_m0_m, now.h_m0_m, limits.height_step_ratio, limits.height_growth_m_per_h);
    let period = over(before.t_m02_s, now.t_m02_s, limits.period_step_ratio, limits.period_growth_s_per_h);
    let still = before.h_m0_m == now.h_m0_m;
    let flag = match () {
        () if !(elapsed_s >= 0.0 && elapsed_s.is_finite()) => Flag::NotEvaluated,
        () if height > 1.0 || period > 1.0 => Flag::Fail,
        () if (height.is_nan() && !still) || period.is_nan() => Flag::NotEvaluated,
        () => Flag::Pass,
    };
    let reason = format!(
        "in {elapsed_s:.0} s H_m0 went from {:.3} to {:.3} m and T_m02 from {:.2} to {:.2} s",
        before.h_m0_m, now.h_m0_m, before.t_m02_s, now.t_m02_s
    );
    Finding::new(Test::RateOfChange, flag, reason)
}

/// Test 15: a value further from the mean of its `history` than so many of its standard deviations. Not for directions, which have no
/// plain mean.
#[must_use]
pub fn mean_and_deviation(history: &[f64], value: f64, limits: &BulkLimits) -> Finding {
    let known: Vec<f64> = history.iter().copied().filter(|x| x.is_finite()).collect();
    let n = known.len() as f64;
    if known.len() < limits.history_min.max(2) {
        let reason = format!("{} values of history, needs {}", known.len(), limits.history_min.max(2));
        return Finding::new(Test::MeanAndDeviation, Flag::NotEvaluated, reason);
    }
    let mean = known.iter().sum::<f64>() / n;
    let sigma = (known.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    let flag = match (value - mean).abs() {
        off if off.is_nan() => Flag::Missing,
        off if off > limits.history_sigmas * sigma => Flag::Suspect,
        _ => Flag::Pass,
    };
    Finding::new(Test::MeanAndDeviation, flag, format!("{value:.3} against {mean:.3} with deviation {sigma:.3} before"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEA: BulkParameters =
        BulkParameters { h_m0_m: 0.5, t_p_s: 3.0, t_m02_s: 2.5, direction_from_rad: 1.0, spread_rad: f64::NAN };

    #[test]
    fn bounds() {
        let limits = BulkLimits::default();
        assert_eq!(bulk_range(&SEA, &limits).flag, Flag::Pass);
        let finding = bulk_range(&BulkParameters { t_p_s: 60.0, ..SEA }, &limits);
        assert_eq!((finding.flag, finding.reason.as_str()), (Flag::Suspect, "T_p of 60.000 s is outside 0.3..=25.0 s"));
        assert_eq!(bulk_range(&BulkParameters { h_m0_m: 12.0, ..SEA }, &limits).flag, Flag::Fail);
        assert_eq!(bulk_range(&BulkParameters { h_m0_m: f64::INFINITY, ..SEA }, &limits).flag, Flag::Fail);
        assert_eq!(bulk_range(&BulkParameters { h_m0_m: f64::NAN, ..SEA }, &limits).flag, Flag::Missing);
    }

    /// 2π 0.5/(9.81 × 6.25) = 0.051.
    #[test]
    fn steep_water_breaks() {
        let limits = BulkLimits::default();
        assert_eq!(steepness(&SEA, &limits).reason, "the mean steepness 2π H_m0/(g T_m02²) is 0.051");
        assert_eq!(steepness(&SEA, &limits).flag, Flag::Pass);
        assert_eq!(steepness(&BulkParameters { h_m0_m: 1.1, ..SEA }, &limits).flag, Flag::Suspect);
        assert_eq!(steepness(&BulkParameters { h_m0_m: 2.0, ..SEA }, &limits).flag, Flag::Fail);
        assert_eq!(steepness(&BulkParameters { t_m02_s: f64::NAN, ..SEA }, &limits).flag, Flag::NotEvaluated);
    }

    #[test]
    fn the_sea_changes_slowly() {
        let limits = BulkLimits::default();
        let after =
            |h_m0_m: f64, elapsed_s: f64| rate_of_change(&SEA, &BulkParameters { h_m0_m, ..SEA }, elapsed_s, &limits).flag;
        assert_eq!(after(0.65, 60.0), Flag::Pass);
        assert_eq!(after(1.5, 60.0), Flag::Fail);
        assert_eq!(after(1.5, 3600.0), Flag::Pass, "an hour's growth");
        assert_eq!(after(1.5, f64::NAN), Flag::NotEvaluated);
        assert_eq!(after(f64::NAN, 60.0), Flag::NotEvaluated);
        let longer = BulkParameters { t_m02_s: 9.0, ..SEA };
        assert_eq!(rate_of_change(&SEA, &longer, 60.0, &limits).flag, Flag::Fail);
        let calm = BulkParameters { h_m0_m: 0.0, ..SEA };
        assert_eq!(rate_of_change(&calm, &calm, 0.0, &limits).flag, Flag::Pass);
    }

    /// 1 to 9 and 5: mean 5, deviation √(60/9) = 2.58.
    #[test]
    fn history_tells_what_is_unusual() {
        let limits = BulkLimits::default();
        let history = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 5.0, f64::NAN];
        assert_eq!(mean_and_deviation(&history, 12.7, &limits).flag, Flag::Pass);
        assert_eq!(mean_and_deviation(&history, 12.8, &limits).flag, Flag::Suspect);
        assert_eq!(mean_and_deviation(&history, f64::NAN, &limits).flag, Flag::Missing);
        assert_eq!(mean_and_deviation(&history[..5], 3.0, &limits).flag, Flag::NotEvaluated);
    }
}
