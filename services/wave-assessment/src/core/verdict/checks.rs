//! Checks, gathered one by one.

use halcyon_model::{Estimate, VerdictReason, VerdictState};
use halcyon_ocean::confidence::{chi_square_quantile, normal_cumulative};

/// An estimate and so much of the way to the end of its two-sided 95 % interval are the upper 95 % bound: that is one-sided, 1.645 deviations
/// up and not 1.960.
const ONE_SIDED: f64 = 0.839_252;

/// How a check ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Outcome {
    /// The measurement itself cannot be trusted: nothing follows from it, not even that the water is rough.
    Untrusted,
    /// Known not to be as it should.
    Over,
    /// Not known to be.
    Failed,
    /// As it should be.
    Passed,
}

/// What the checks so far say.
#[derive(Debug)]
pub(super) struct Checks {
    made: Vec<(Outcome, VerdictReason)>,
    previous: VerdictState,
    hysteresis: f64,
    /// Share of the window that was observed so far: bounds of earlier looks are that much wider.
    filled: f64,
    /// The one-sided upper 95 % bound of a height over the end of its two-sided interval.
    one_sided: f64,
    /// The smallest probability of any quantity to be under its limit.
    probability: Option<f64>,
}

impl Checks {
    /// `filled` is the share of the window that was observed so far. One who looks again and again while a window fills is wrong more often than
    /// each look is. Bounds as much wider as the root of the share is less than one would make up for it (O'Brien and Fleming 1979) if it were known how
    /// wide they are; a short window knows that badly too, and so they are as much wider as the share itself is less than one. `freedom` is that of
    /// the variance, if it is known.
    pub(super) fn new(previous: VerdictState, hysteresis: f64, filled: f64, freedom: Option<f64>) -> Self {
        // Written so that what is no share counts as little.
        let filled = if filled >= 1.0 { 1.0 } else { filled.max(0.01) };
        let ratio = |freedom| (chi_square_quantile(0.025, freedom) / chi_square_quantile(0.05, freedom)).sqrt();
        let one_sided = freedom.map(ratio).filter(|ratio| ratio.is_finite()).unwrap_or(1.0);
        Self { made: Vec::new(), previous, hysteresis, filled, one_sided, probability: None }
    }

    pub(super) fn add(&mut self, name: &str, outcome: Outcome, text: String) {
        self.made.push((outcome, VerdictReason { check: name.into(), passed: outcome == Outcome::Passed, text }));
    }

    /// Whether the measurement can be trusted.
    pub(super) fn trusted(&mut self, name: &str, ok: bool, text: String) {
        self.add(name, if ok { Outcome::Passed } else { Outcome::Untrusted }, text);
    }

    /// Whether something is known.
    pub(super) fn known(&mut self, name: &str, ok: bool, text: String) {
        self.add(name, if ok { Outcome::Passed } else { Outcome::Failed }, text);
    }

    /// A quantity against its limit. The upper 95 % bound must be under it, well under it to become safe; the lower bound over it is known to be
    /// too much, and what was too much stays so until the best estimate is under the limit.
    pub(super) fn limit(&mut self, name: &str, what: &str, unit: &str, measured: Estimate, limit: f64) {
        let Estimate { value, low, high } = measured;
        // What the interval holds beside chance, as what may be hidden waves or a fixed speed, is not made smaller.
        let bound = (value + ONE_SIDED * (high - value)).max(self.one_sided * high);
        let sure = value + (bound - value) / self.filled;
        let margin = if self.previous == VerdictState::Safe { 1.0 } else { 1.0 - self.hysteresis };
        let (outcome, verb) = if !measured.is_valid() {
            (Outcome::Failed, "not surely under")
        } else if low > limit || (self.previous == VerdictState::Unsafe && value >= limit) {
            (Outcome::Over, "over")
        } else if sure < limit * margin {
            (Outcome::Passed, "under")
        } else {
            (Outcome::Failed, "not surely under")
        };
        let early = if self.filled < 1.0 { ", so early" } else { "" };
        let target =
            if margin < 1.0 { format!(" (by {:.0} % to become safe)", self.hysteresis * 100.0) } else { String::new() };
        let text = if measured.is_valid() {
            format!(
                "{what} {value:.3} {unit} ({low:.3} to {high:.3}; at most {sure:.3}{early}), {verb} the limit of {limit:.3} {unit}{target}"
            )
        } else {
            format!("{what} is not known well enough to be held against the limit of {limit:.3} {unit}")
        };
        self.add(name, outcome, text);
        let under = probability_under(measured, limit);
        self.probability = Some(self.probability.map_or(under, |least| least.min(under)));
    }

    /// A quantity that could not be measured.
    pub(super) fn unknown(&mut self, name: &str, text: &str) {
        self.add(name, Outcome::Failed, text.into());
        self.probability = Some(0.0);
    }

    /// The verdict, its reasons, what decided before the rest, and the probability that everything is under its limit: quantities all
    /// follow the height of the waves, and so the least probable one tells.
    pub(super) fn verdict(mut self) -> (VerdictState, Vec<VerdictReason>, Option<f64>) {
        let state = match self.made.iter().map(|(outcome, _)| *outcome).min() {
            None | Some(Outcome::Untrusted | Outcome::Failed) => VerdictState::Inconclusive,
            Some(Outcome::Over) => VerdictState::Unsafe,
            Some(Outcome::Passed) => VerdictState::Safe,
        };
        let trusted = !self.made.iter().any(|(outcome, _)| *outcome == Outcome::Untrusted);
        self.made.sort_by_key(|(outcome, _)| *outcome);
        let reasons = self.made.into_iter().map(|(_, reason)| reason).collect();
        (state, reasons, self.probability.filter(|_| trusted))
    }
}

/// Probability that a positive quantity is under `limit`: its logarithm is taken as normal, each half with the width that its side of the 95 %
/// interval has. 0 for what is not known.
fn probability_under(measured: Estimate, limit: f64) -> f64 {
    const NORMAL_95: f64 = 1.959_964;
    let Estimate { value, low, high } = measured;
    if !measured.is_valid() {
        return 0.0;
    }
    // Nothing measured but a bound: half of a normal distribution.
    if value <= 0.0 {
        return if high > 0.0 { normal_cumulative(NORMAL_95 * limit / high) } else { 1.0 };
    }
    let width = if limit >= value { (high / value).ln() } else { (value / low).ln() } / NORMAL_95;
    let distance = (limit / value).ln();
    match width {
        w if w > 0.0 => normal_cumulative(distance / w),
        _ => f64::from(u8::from(distance > 0.0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn probabilities_are_those_of_the_interval() {
        let measured = Estimate { value: 0.10, low: 0.08, high: 0.125 };
        let close = |limit: f64, expected: f64| {
            let found = probability_under(measured, limit);
            assert!((found - expected).abs() < 1e-4, "{limit}: {found}");
        };
        close(0.125, 0.975);
        close(0.08, 0.025);
        close(0.10, 0.5);
        close(1e3, 1.0);
        let unknown = Estimate { value: f64::NAN, ..measured };
        assert_eq!(probability_under(unknown, 1.0), 0.0);
        let exact = Estimate { value: 0.1, low: 0.1, high: 0.1 };
        assert_eq!((probability_under(exact, 0.11), probability_under(exact, 0.09)), (1.0, 0.0));
        let still = Estimate { value: 0.0, low: 0.0, high: 0.01 };
        assert!((probability_under(still, 0.01) - 0.975).abs() < 1e-4);
        // A lower bound of nothing leaves everything open below the value.
        assert!(probability_under(Estimate { value: 0.1, low: 0.0, high: 0.2 }, 0.05) > 0.4);
    }

    #[test]
    fn no_check_is_no_safety() {
        assert_eq!(Checks::new(VerdictState::Safe, 0.1, 1.0, None).verdict().0, VerdictState::Inconclusive);
    }

    /// Of 100 degrees of freedom a variance is under 1/0.7793 of its estimate with 95 % confidence, and under 1/0.7422 at the end of the two-sided
    /// interval (Pearson & Hartley); what is added to it stays.
    #[test]
    fn the_upper_bound_is_one_sided() {
        let judged = |high: f64, limit: f64| {
            let mut checks = Checks::new(VerdictState::Safe, 0.0, 1.0, Some(100.0));
            checks.limit("x", "x", "m", Estimate { value: 0.10, low: 0.09, high }, limit);
            checks.verdict().0
        };
        let (safe, inconclusive) = (VerdictState::Safe, VerdictState::Inconclusive);
        let (high, bound) = (0.10 / 0.742_219_f64.sqrt(), 0.10 / 0.779_295_f64.sqrt());
        assert_eq!((judged(high, 1.003 * bound), judged(high, 0.999 * bound)), (safe, inconclusive));
        let hidden = |limit: f64| judged(high + 0.2, limit);
        assert_eq!((hidden(0.2 + 1.003 * bound), hidden(0.18 + bound)), (safe, inconclusive));
    }

    /// At half of the window a bound is twice as far from its value.
    #[test]
    fn early_looks_have_to_be_surer() {
        let measured = Estimate { value: 0.10, low: 0.09, high: 0.12 };
        let judged = |filled: f64| {
            let mut checks = Checks::new(VerdictState::Safe, 0.0, filled, None);
            checks.limit("x", "x", "m", measured, 0.13);
            checks.verdict().0
        };
        assert_eq!((judged(1.0), judged(5.0)), (VerdictState::Safe, VerdictState::Safe));
        assert_eq!((judged(0.7), judged(0.5)), (VerdictState::Safe, VerdictState::Inconclusive));
        assert_eq!((judged(0.0), judged(f64::NAN)), (VerdictState::Inconclusive, VerdictState::Inconclusive));
    }
}
