//! The few special functions that wave statistics need.

/// ln Γ(x) for x > 0: Lanczos' approximation (g = 7, nine terms, Godfrey's coefficients), about 15 digits.
pub(crate) fn ln_gamma(x: f64) -> f64 {
    const COEFFICIENTS: [f64; 8] = [
        676.520_368_121_885_1,
        -1_259.139_216_722_402_8,
        771.323_428_777_653_1,
        -176.615_029_162_140_6,
        12.507_343_278_686_905,
        -0.138_571_095_265_720_12,
        9.984_369_578_019_572e-6,
        1.505_632_735_149_311_6e-7,
    ];
    let x = x - 1.0;
    let mut sum = 0.999_999_999_999_809_9;
    for (i, coefficient) in COEFFICIENTS.iter().enumerate() {
        sum += coefficient / (x + i as f64 + 1.0);
    }
    let t = x + 7.5;
    0.5 * std::f64::consts::TAU.ln() + (x + 0.5) * t.ln() - t + sum.ln()
}

/// The regularised lower incomplete gamma function P(a, x), for a > 0 and x ≥ 0: its series below a + 1, Lentz's continued fraction
/// above (Abramowitz & Stegun 6.5.29, 6.5.31).
pub(crate) fn gamma_p(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 0.0;
    }
    // Terms needed grow with √a.
    let terms_max = 200 + (10.0 * a.sqrt()) as u32;
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum) = (1.0 / a, 1.0 / a);
        for i in 1..terms_max {
            term *= x / (a + f64::from(i));
            sum += term;
            if term < 1e-16 * sum {
                break;
            }
        }
        return front * sum;
    }
    let mut b = x + 1.0 - a;
    let mut c = 1e300;
    let mut d = 1.0 / b;
    let mut fraction = d;
    for i in 1..terms_max {
        let i = f64::from(i);
        let numerator = -i * (i - a);
        b += 2.0;
        d = 1.0 / (numerator * d + b);
        c = b + numerator / c;
        fraction *= d * c;
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    1.0 - front * fraction
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn gamma_at_whole_and_half_numbers() {
        assert_relative_eq!(ln_gamma(5.0), 24f64.ln(), max_relative = 1e-14);
        assert_relative_eq!(ln_gamma(0.5), std::f64::consts::PI.sqrt().ln(), max_relative = 1e-14);
        assert_relative_eq!(ln_gamma(171.0), (1..171).map(|i| f64::from(i).ln()).sum::<f64>(), max_relative = 1e-14);
    }

    /// P(1, x) = 1 − exp(−x); P(½, x) = erf(√x); P(a, a) is near ½ for large a.
    #[test]
    fn incomplete_gamma_in_closed_form() {
        for x in [0.1, 1.0, 1.9, 2.1, 30.0] {
            assert_relative_eq!(gamma_p(1.0, x), 1.0 - (-x).exp(), max_relative = 1e-13);
        }
        assert_relative_eq!(gamma_p(0.5, 1.0), 0.842_700_792_949_714_9, max_relative = 1e-13);
        assert_relative_eq!(gamma_p(0.5, 4.0), 0.995_322_265_018_952_7, max_relative = 1e-13);
        assert_relative_eq!(gamma_p(1e4, 1e4), 0.5 + 1.0 / (3.0 * (std::f64::consts::TAU * 1e4).sqrt()), max_relative = 1e-6);
        assert_eq!(gamma_p(3.0, 0.0), 0.0);
    }
}
