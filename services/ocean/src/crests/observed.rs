//! Observed crests or heights against a distribution: points to plot, and how well they fit.

use super::distribution::Exceedance;

/// One observed height with its place among all, and what theory says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExceedancePoint {
    /// The height, metres.
    pub value_m: f64,
    /// Its observed exceedance i/(n + 1), i counted from the highest (Weibull's plotting position).
    pub observed: f64,
    /// The theory's, given that it is above the threshold.
    pub theory: f64,
}

/// How observations compare with a distribution.
///
/// Both numbers take the distribution as given: where its variance comes from the same waves, they judge too kindly. They take waves as
/// independent: groups of waves make them judge too harshly.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Highest first.
    pub points: Vec<ExceedancePoint>,
    /// Kolmogorov & Smirnov's D, the largest difference between the two distributions.
    pub ks_distance: f64,
    /// The probability of a larger one by chance; small means that the theory does not hold.
    pub ks_probability: f64,
    /// Anderson & Darling's A², which looks at the ends harder: above 2.492 with 5 %, above 3.857 with 1 % (their 1954 table).
    pub anderson_darling: f64,
    /// Half width of a band about the observed exceedance that holds the true one everywhere with 95 %: √(ln 40/2n) (Dvoretzky, Kiefer & Wolfowitz; Massart).
    pub band_95: f64,
}

/// Compares those of `values_m` that are above `from_m` with `model`, given that they are above it. Asymptotic theories (Boccotti's) only hold
/// for high waves: give them a threshold; 0 compares all positive ones. `None` with fewer than five values.
#[must_use]
pub fn compare(values_m: &[f64], model: &(impl Exceedance + ?Sized), from_m: f64) -> Option<Comparison> {
    const VALUES_MIN: usize = 5;
    let from_m = from_m.max(0.0);
    let mut values: Vec<f64> = values_m.iter().copied().filter(|x| x.is_finite() && *x > from_m).collect();
    if values.len() < VALUES_MIN {
        return None;
    }
    values.sort_by(|a, b| b.total_cmp(a));
    let n = values.len() as f64;
    let above = model.exceedance(from_m);
    let theory: Vec<f64> = values.iter().map(|x| (model.exceedance(*x) / above).clamp(0.0, 1.0)).collect();
    if theory.iter().any(|p| p.is_nan()) || above <= 0.0 {
        return None;
    }
    let points = (1..).zip(values.iter().zip(&theory));
    let points: Vec<ExceedancePoint> = points
        .map(|(i, (&value_m, &theory))| ExceedancePoint { value_m, observed: f64::from(i) / (n + 1.0), theory })
        .collect();
    // The empirical distribution steps at each value: both its sides count.
    let steps = theory.iter().enumerate().map(|(i, p)| (p - i as f64 / n).abs().max((p - (i as f64 + 1.0) / n).abs()));
    let ks_distance = steps.fold(0.0, f64::max);
    // Exceedances, highest first, are as uniform as the distribution function is.
    let log = |p: f64| p.max(1e-300).ln();
    let weighed: f64 =
        (0..theory.len()).map(|i| (2.0 * i as f64 + 1.0) * (log(theory[i]) + log(1.0 - theory[theory.len() - 1 - i]))).sum();
    Some(Comparison {
        points,
        ks_distance,
        ks_probability: kolmogorov(ks_distance, n),
        anderson_darling: -n - weighed / n,
        band_95: (40f64.ln() / (2.0 * n)).sqrt(),
    })
}

/// Kolmogorov's limiting probability of a larger distance, 2 Σ (−1)^(j−1) exp(−2 j² λ²), with Stephens's (1970) correction for n values.
fn kolmogorov(distance: f64, n: f64) -> f64 {
    let lambda = (n.sqrt() + 0.12 + 0.11 / n.sqrt()) * distance;
    // The series alternates about 1 there.
    if lambda < 0.2 {
        return 1.0;
    }
    let term = |j: i32| if j % 2 == 1 { 2.0 } else { -2.0 } * (-2.0 * f64::from(j * j) * lambda * lambda).exp();
    (1..=100).map(term).sum::<f64>().clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::distribution::{Rayleigh, Tayfun, Weibull};
    use super::*;
    use approx::assert_relative_eq;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn drawn(model: &(impl Exceedance + ?Sized), n: usize, seed: u64) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        (0..n).map(|_| model.exceeded_m(random.random_range(1e-12..1.0))).collect()
    }

    /// Smirnov's table: λ = 1.358 and 1.628 at 5 % and 1 %.
    #[test]
    fn kolmogorovs_table() {
        for (lambda, probability) in [(1.358, 0.05), (1.628, 0.01), (0.828, 0.5)] {
            assert_relative_eq!(kolmogorov(lambda / 1e6, 1e12), probability, max_relative = 0.01);
        }
        assert_eq!(kolmogorov(0.0, 10.0), 1.0);
    }

    /// By hand: five values where an exponential has exceedances of 0.9, 0.7, 0.5, 0.3, 0.1: D is 0.1 and
    /// A² = −5 − (1/5) Σ (2i − 1)(ln u_i + ln(1 − u_(6−i))).
    #[test]
    fn five_values_by_hand() {
        let u: [f64; 5] = [0.1, 0.3, 0.5, 0.7, 0.9];
        let values: Vec<f64> = u.iter().map(|u| -u.ln()).collect();
        let found = compare(&values, &Weibull { scale_m: 1.0, shape: 1.0 }, 0.0).unwrap();
        assert_relative_eq!(found.ks_distance, 0.1, max_relative = 1e-9);
        // 1 − u reversed is u here: Σ (2i − 1) 2 ln u_i.
        let sum = 2.0 * (0.1f64.ln() + 3.0 * 0.3f64.ln() + 5.0 * 0.5f64.ln() + 7.0 * 0.7f64.ln() + 9.0 * 0.9f64.ln());
        assert_relative_eq!(found.anderson_darling, -5.0 - sum / 5.0, max_relative = 1e-9);
        assert_relative_eq!(found.points[0].observed, 1.0 / 6.0);
        assert_relative_eq!(found.points[0].theory, 0.1, max_relative = 1e-9);
        assert!(found.points.windows(2).all(|w| w[0].value_m > w[1].value_m));
    }

    /// Of its own draws a theory is rejected as often as it says, and a wrong one nearly always.
    #[test]
    fn the_right_theory_is_kept_and_the_wrong_one_is_not() {
        let (right, wrong) = (Rayleigh::crests(1.0), Tayfun::crests(1.0, 0.15));
        let rejected = |model: &dyn Fn(&[f64]) -> Comparison, limit: f64| {
            (0..200).filter(|seed| model(&drawn(&right, 400, *seed)).anderson_darling > limit).count()
        };
        let own = |x: &[f64]| compare(x, &right, 0.0).unwrap();
        let other = |x: &[f64]| compare(x, &wrong, 0.0).unwrap();
        let five_percent = rejected(&own, 2.492);
        assert!((2..=20).contains(&five_percent), "{five_percent} of 200");
        assert!(rejected(&other, 2.492) > 180);
        let small = (0..200).filter(|seed| own(&drawn(&right, 400, *seed)).ks_probability < 0.05).count();
        assert!((2..=20).contains(&small), "{small} of 200");
    }

    /// Above a threshold the theory is what is left of it.
    #[test]
    fn a_threshold_conditions_the_theory() {
        let model = Rayleigh::heights(1.0);
        let found = compare(&drawn(&model, 5000, 1), &model, 4.0).unwrap();
        assert!(found.points.len() < 1000 && found.points.len() > 400, "{}", found.points.len());
        assert!(found.ks_probability > 0.01, "{}", found.ks_probability);
        assert!(found.ks_distance < found.band_95 * 1.2);
    }

    #[test]
    fn too_little_is_no_comparison() {
        let model = Rayleigh::heights(1.0);
        assert!(compare(&[1.0; 4], &model, 0.0).is_none());
        assert!(compare(&[f64::NAN; 40], &model, 0.0).is_none());
        assert!(compare(&[1.0; 9], &Rayleigh::heights(f64::NAN), 0.0).is_none());
        assert!(compare(&[1.0; 9], &model, f64::INFINITY).is_none());
        assert!(compare(&[1e9; 9], &model, 1e8).is_none(), "theory has nothing there");
    }
}
