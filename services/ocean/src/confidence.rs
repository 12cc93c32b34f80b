//! Confidence limits of variances: what a finite record leaves open.

use crate::special::{gamma_p, ln_gamma};

/// The value that a chi-square variable of `dof` degrees of freedom stays under with probability `p`.
///
/// `dof` need not be whole. NaN unless 0 < `p` < 1 and `dof` is positive and finite. Newton's steps on the incomplete gamma function from
/// Wilson and Hilferty's (1931) approximation, or halves of the bracket where one would leave it.
#[must_use]
pub fn chi_square_quantile(p: f64, dof: f64) -> f64 {
    if !(p > 0.0 && p < 1.0 && dof > 0.0 && dof.is_finite()) {
        return f64::NAN;
    }
    let half = 0.5 * dof;
    let (mut low, mut high) = (0.0, f64::INFINITY);
    let mut x = start(p, dof);
    // The logarithm of the density, without its variable part.
    let front = -half * std::f64::consts::LN_2 - ln_gamma(half);
    for _ in 0..1200 {
        let off = gamma_p(half, 0.5 * x) - p;
        if off < 0.0 {
            low = x;
        } else {
            high = x;
        }
        let density = (front + (half - 1.0) * x.ln() - 0.5 * x).exp();
        let newton = x - off / density;
        // Where nothing lies above yet, further up; else in the middle.
        let between = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * x };
        let next = if newton > low && newton < high { newton } else { between };
        if (next - x).abs() <= 1e-12 * x {
            return next;
        }
        x = next;
    }
    x
}

/// Where to begin: the cube root of χ²/ν is nearly normal, with mean 1 − 2/(9ν) and variance 2/(9ν). Far down, for few degrees of freedom, the
/// density is that of a power of x alone.
fn start(p: f64, dof: f64) -> f64 {
    let spread = 2.0 / (9.0 * dof);
    let cube = dof * (1.0 - spread + normal_quantile(p) * spread.sqrt()).powi(3);
    let half = 0.5 * dof;
    let power = 2.0 * ((p.ln() + ln_gamma(half + 1.0)) / half).exp();
    if cube <= 0.3 * dof && power > 0.0 { power } else { cube.max(f64::MIN_POSITIVE) }
}

/// Of the standard normal distribution, to 4.5e-4 (Hastings 1955; Abramowitz & Stegun 26.2.23).
fn normal_quantile(p: f64) -> f64 {
    let t = (-2.0 * p.min(1.0 - p).ln()).sqrt();
    let tail = t - (2.515_517 + t * (0.802_853 + t * 0.010_328)) / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308)));
    if p < 0.5 { -tail } else { tail }
}

/// Factors (low, high) on an estimated variance of `dof` degrees of freedom, between which the true one lies with 95 % confidence.
#[must_use]
pub fn variance_factors_95(dof: f64) -> (f64, f64) {
    (dof / chi_square_quantile(0.975, dof), dof / chi_square_quantile(0.025, dof))
}

/// Probability that a standard normal variable is under `z`; NaN for NaN.
#[must_use]
pub fn normal_cumulative(z: f64) -> f64 {
    // Further out it is 0 or 1 to the last digit. z² is chi-square with one degree of freedom.
    let z = z.clamp(-40.0, 40.0);
    let within = gamma_p(0.5, 0.5 * z * z);
    if z < 0.0 { 0.5 * (1.0 - within) } else { 0.5 * (1.0 + within) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Pearson & Hartley's tables, and the closed form −2 ln(1 − p) for two degrees of freedom.
    #[test]
    fn quantiles_are_the_published_ones() {
        for (p, dof, expected) in [
            (0.025, 1.0, 0.000_982_069),
            (0.975, 1.0, 5.023_886),
            (0.025, 10.0, 3.246_973),
            (0.975, 10.0, 20.483_177),
            (0.025, 30.0, 16.790_772),
            (0.975, 30.0, 46.979_242),
            (0.975, 100.0, 129.561_197),
        ] {
            assert_relative_eq!(chi_square_quantile(p, dof), expected, max_relative = 1e-5);
        }
        for p in [0.01, 0.3, 0.999] {
            assert_relative_eq!(chi_square_quantile(p, 2.0), -2.0 * (1.0f64 - p).ln(), max_relative = 1e-9);
        }
        let normal_limit = variance_factors_95(1e5);
        assert_relative_eq!(normal_limit.1, 1.0 + 1.96 * (2e-5f64).sqrt(), max_relative = 1e-3);
    }

    /// Tables of the normal distribution.
    #[test]
    fn the_normal_distribution_is_the_published_one() {
        for (z, expected) in
            [(0.0, 0.5), (1.0, 0.841_344_746), (-1.0, 0.158_655_254), (1.959_963_985, 0.975), (-3.0, 0.001_349_898)]
        {
            assert_relative_eq!(normal_cumulative(z), expected, max_relative = 1e-6);
        }
        assert_eq!((normal_cumulative(f64::INFINITY), normal_cumulative(f64::NEG_INFINITY)), (1.0, 0.0));
    }

    /// Whatever is asked, the answer is one: the distribution gives back the probability.
    #[test]
    fn quantiles_are_where_the_distribution_says() {
        for dof in [0.01, 0.1, 0.5, 1.0, 1.7, 3.0, 12.0, 77.0, 140.0, 1e3, 1e5, 1e7] {
            for p in [1e-9, 1e-4, 0.025, 0.05, 0.3, 0.5, 0.9, 0.975, 0.999_9, 1.0 - 1e-9] {
                let x = chi_square_quantile(p, dof);
                // So few degrees of freedom have quantiles that no number is as small as.
                if x > 1e-300 {
                    // Ten million degrees of freedom leave six digits of the distribution itself.
                    assert_relative_eq!(gamma_p(0.5 * dof, 0.5 * x), p, max_relative = 1e-6);
                }
            }
        }
    }

    #[test]
    fn nonsense_is_nan() {
        for (p, dof) in [(0.0, 1.0), (1.0, 1.0), (0.5, 0.0), (f64::NAN, 1.0), (0.5, f64::NAN), (0.5, f64::INFINITY)] {
            assert!(chi_square_quantile(p, dof).is_nan());
        }
    }
}
