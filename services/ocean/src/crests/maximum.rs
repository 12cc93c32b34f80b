//! The highest of many waves: its expectation and its interval.

use super::distribution::{Exceedance, falling_root};

/// A random highest height or crest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extreme {
    /// Expectation, metres.
    pub expected_m: f64,
    /// Undershot with 2.5 %, metres.
    pub low_m: f64,
    /// Exceeded with 2.5 %, metres.
    pub high_m: f64,
}

/// More waves than this are taken as this many.
const WAVES_MAX: f64 = 1e12;

/// The highest of `waves` independent waves of a distribution: exceeded with probability 1 − (1 − P)ⁿ. Less than one wave counts as one; NaN as
/// 10¹², since not to know how many is not calm.
///
/// Successive waves of a narrow band come in groups and are not quite independent: that makes the truth a little lower.
#[must_use]
pub fn highest(model: &(impl Exceedance + ?Sized), waves: f64) -> Extreme {
    let n = if waves.is_nan() { WAVES_MAX } else { waves.clamp(1.0, WAVES_MAX) };
    // Without cancellation for small P; P = 1 gives ln 0 and so 1.
    Extreme::of(&|x| -(n * (-model.exceedance(x)).ln_1p()).exp_m1())
}

/// How many waves a duration holds, by the mean zero-crossing period; NaN unless the period is positive.
#[must_use]
pub fn waves_in(duration_s: f64, t_m02_s: f64) -> f64 {
    if t_m02_s > 0.0 { duration_s / t_m02_s } else { f64::NAN }
}

impl Extreme {
    /// Of a positive variable exceeded with probability `survival(x)`, which falls from 1: E = ∫ survival dx by Simpson's rule. All NaN where it is.
    pub(super) fn of(survival: &dyn Fn(f64) -> f64) -> Self {
        const STEPS: u32 = 4000;
        // At most 10⁻⁹ of what is beyond is lost.
        let end_m = falling_root(survival, 1e-12);
        let step_m = end_m / f64::from(STEPS);
        let inner: f64 = (1..STEPS).map(|i| survival(f64::from(i) * step_m) * if i % 2 == 1 { 4.0 } else { 2.0 }).sum();
        Self {
            expected_m: (survival(0.0) + inner + survival(end_m)) * step_m / 3.0,
            low_m: falling_root(survival, 0.975),
            high_m: falling_root(survival, 0.025),
        }
        .or_nan(survival(end_m).is_nan())
    }

    fn or_nan(self, nan: bool) -> Self {
        if nan { Self { expected_m: f64::NAN, low_m: f64::NAN, high_m: f64::NAN } } else { self }
    }
}

#[cfg(test)]
mod tests {
    use super::super::distribution::{Rayleigh, Tayfun};
    use super::*;
    use crate::height::{H_S_OVER_ROOT_M0, expected_highest_over_h_s};
    use approx::assert_relative_eq;

    /// One Rayleigh crest has mean √(π/2) and quantiles √(−2 ln p); the highest of n has the closed forms of [`crate::height`].
    #[test]
    fn rayleigh_in_closed_form() {
        let one = highest(&Rayleigh::crests(1.0), 1.0);
        assert_relative_eq!(one.expected_m, (std::f64::consts::PI / 2.0).sqrt(), max_relative = 1e-9);
        assert_relative_eq!(one.low_m, (-2.0 * 0.975f64.ln()).sqrt(), max_relative = 1e-9);
        assert_relative_eq!(one.high_m, (-2.0 * 0.025f64.ln()).sqrt(), max_relative = 1e-9);
        for n in [2.0, 50.0, 1000.0, 1e6] {
            let expected = expected_highest_over_h_s(n) * H_S_OVER_ROOT_M0;
            let found = highest(&Rayleigh::heights(1.0), n);
            assert_relative_eq!(found.expected_m, expected, max_relative = 1e-6);
            // F = (1 − p)ⁿ = 0.975.
            let p = 1.0 - 0.975f64.powf(1.0 / n);
            assert_relative_eq!(found.high_m, (-8.0 * p.ln()).sqrt(), max_relative = 1e-6);
        }
    }

    /// A rising map of one variable moves its quantiles: Tayfun's of Rayleigh's.
    #[test]
    fn tayfuns_interval_is_rayleighs_mapped() {
        let (linear, bound) = (highest(&Rayleigh::crests(1.0), 300.0), highest(&Tayfun::crests(1.0, 0.07), 300.0));
        let map = |a: f64| a + 0.035 * a * a;
        assert_relative_eq!(bound.low_m, map(linear.low_m), max_relative = 1e-9);
        assert_relative_eq!(bound.high_m, map(linear.high_m), max_relative = 1e-9);
        assert!(bound.expected_m > linear.expected_m);
    }

    #[test]
    fn not_knowing_is_not_calm() {
        let model = Rayleigh::heights(1.0);
        assert_eq!(highest(&model, f64::NAN), highest(&model, 1e12));
        assert_eq!(highest(&model, -4.0), highest(&model, 1.0));
        assert!(highest(&Rayleigh::heights(f64::NAN), 10.0).expected_m.is_nan());
        assert_eq!(highest(&Rayleigh::heights(0.0), 10.0).expected_m.max(1e-9), 1e-9);
        assert_relative_eq!(waves_in(600.0, 2.0), 300.0);
        assert!(waves_in(600.0, 0.0).is_nan());
    }
}
