//! Rayleigh statistics of wave heights: what a variance says about heights, and how high the highest wave will be.
//!
//! A narrow-band Gaussian sea has Rayleigh-distributed heights (Longuet-Higgins, 1952). Real, broader seas have somewhat lower
//! ones (H_1/3 is about 3.8 √m0 rather than 4.004 √m0), so these are on the careful side.

use std::sync::LazyLock;

/// H_1/3 over √m0: 2 √2 (√ln 3 + 3 ∫ exp(−x²) dx from √ln 3) = 4.004….
pub const H_S_OVER_ROOT_M0: f64 = 4.004_302_95;
/// H_m over √m0: √(2π).
pub const H_MEAN_OVER_ROOT_M0: f64 = 2.506_628_274_631_000_2;
/// H_rms over √m0: √8.
pub const H_RMS_OVER_ROOT_M0: f64 = 2.828_427_124_746_190_3;

/// H_1/10 over √m0: √8 (√ln 10 + 10 × ∫ exp(−x²) dx from √ln 10) = 5.09….
pub const H_TENTH_OVER_ROOT_M0: f64 = 5.090_937_09;

/// Steps of the integral over the highest wave: n exp(−x²) is under 1e-8 at the end even for the most waves; midpoint rule on a smooth integrand.
const STEPS: u32 = 500;
const STEP: f64 = 7.0 / STEPS as f64;
/// ln(1 − exp(−x²)) at the middle of each step: the same for any number of waves.
static LOWER: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let logarithm = |x: f64| (-(-x * x).exp()).ln_1p();
    (0..STEPS).map(|i| logarithm((f64::from(i) + 0.5) * STEP)).collect()
});

/// Expected highest of `waves` successive waves, over H_s.
///
/// The exact mean of the highest of n Rayleigh heights, E[H_max]/H_rms = ∫ 1 − (1 − exp(−x²))ⁿ dx, for any real n; less than one
/// wave counts as one, NaN and more than 10¹² as 10¹².
#[must_use]
pub fn expected_highest_over_h_s(waves: f64) -> f64 {
    const WAVES_MAX: f64 = 1e12;
    // NaN must not come out as calm: `min` and `max` would drop it silently.
    let n = if waves.is_nan() { WAVES_MAX } else { waves.clamp(1.0, WAVES_MAX) };
    // (1 − e)ⁿ without cancellation for small e.
    let over_rms: f64 = LOWER.iter().map(|logarithm| -(n * logarithm).exp_m1() * STEP).sum();
    over_rms * H_RMS_OVER_ROOT_M0 / H_S_OVER_ROOT_M0
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn the_constants_are_their_integrals() {
        // Upper third and tenth by quadrature of the Rayleigh density 2x exp(−x²), for H/H_rms.
        let upper = |share: f64| -> f64 {
            let from = share.ln().sqrt();
            let n = 100_000;
            let step = (8.0 - from) / f64::from(n);
            (0..n).map(|i| from + (f64::from(i) + 0.5) * step).map(|x| share * x * 2.0 * x * (-x * x).exp() * step).sum()
        };
        assert_relative_eq!(upper(3.0) * 8f64.sqrt(), H_S_OVER_ROOT_M0, max_relative = 1e-8);
        assert_relative_eq!(upper(10.0) * 8f64.sqrt(), H_TENTH_OVER_ROOT_M0, max_relative = 1e-6);
        assert_relative_eq!(H_MEAN_OVER_ROOT_M0, (2.0 * std::f64::consts::PI).sqrt());
    }

    /// E[max]/H_rms = Σ (−1)ᵏ⁺¹ C(n, k) √(π/k)/2, expanded by hand for small n.
    #[test]
    fn the_highest_of_a_few_has_a_closed_form() {
        for n in 1..=20_u32 {
            let mut choose = 1.0;
            let mut sum = 0.0;
            for k in 1..=n {
                choose *= f64::from(n - k + 1) / f64::from(k);
                let sign = if k % 2 == 1 { 1.0 } else { -1.0 };
                sum += sign * choose * (std::f64::consts::PI / f64::from(k)).sqrt() / 2.0;
            }
            let expected = sum * H_RMS_OVER_ROOT_M0 / H_S_OVER_ROOT_M0;
            assert_relative_eq!(expected_highest_over_h_s(f64::from(n)), expected, max_relative = 1e-6);
        }
    }

    /// Longuet-Higgins's asymptote √ln n + γ/(2 √ln n), over √2 × 1.4157; good to half a percent at n = 1000.
    #[test]
    fn the_highest_of_many_is_longuet_higgins() {
        let root = 1000f64.ln().sqrt();
        let expected = (root + 0.577_216 / (2.0 * root)) / 1.415_7;
        assert_relative_eq!(expected_highest_over_h_s(1000.0), expected, max_relative = 5e-3);
    }

    #[test]
    fn not_knowing_how_many_is_not_calm() {
        assert!(expected_highest_over_h_s(f64::NAN) > expected_highest_over_h_s(1e11));
        assert_eq!(expected_highest_over_h_s(-3.0), expected_highest_over_h_s(1.0));
        assert!(expected_highest_over_h_s(f64::INFINITY).is_finite());
    }
}
