//! White noise of a measurement, told from the sea's tail and taken off.
//!
//! Independent errors of σ in readings taken r times a second are a density of 2 σ²/r at every frequency. The sea's own density
//! falls as f⁻⁴ (Toba 1973) to f⁻⁵ (Phillips 1958) well above its peak f_p. Both are fitted there together, n + a f⁻ᵖ exp(−p/4
//! (f_p/f)⁴), by the likelihood of chi-square lines, so that a tail is not taken for noise.

use super::likelihood::{Expected, Found, climb};
use super::scatter::Scatter;
use crate::confidence::chi_square_quantile;
use crate::welch::SampledSpectrum;

/// Exponents p of the tail: Toba's, the one between, and Phillips's. The likeliest is taken.
const EXPONENTS: [f64; 3] = [4.0, 4.5, 5.0];
/// Lines needed: more than twice what is sought.
const LINES_MIN: usize = 8;
/// Lines so high that one in ten records has one by chance are interference, and left out.
const CHANCE: f64 = 0.1;
/// Times that lines are left out and the rest fitted again.
const ROUNDS_MAX: usize = 8;

/// A density that does not depend on frequency, with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NoiseFloor {
    /// m²/Hz, not negative.
    pub density_m2_per_hz: f64,
    /// Its standard error, m²/Hz.
    pub error_m2_per_hz: f64,
}

/// A moment with its standard error due to the noise alone, m² Hzⁿ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// Its value; below 0 where there is less than the noise.
    pub value: f64,
    /// How far the noise taken off may be wrong: the sea's own scatter comes on top.
    pub error: f64,
}

impl NoiseFloor {
    /// Of independent errors of standard deviation `sigma_m`, known to ± `error_m`, in a record taken `rate_hz` times a second;
    /// `None` unless these are finite, the rate positive and the others not negative.
    #[must_use]
    pub fn of_sigma(sigma_m: f64, error_m: f64, rate_hz: f64) -> Option<Self> {
        let density_m2_per_hz = 2.0 * sigma_m * sigma_m / rate_hz;
        let error_m2_per_hz = 4.0 * sigma_m * error_m / rate_hz;
        let good = sigma_m >= 0.0 && error_m >= 0.0 && rate_hz > 0.0;
        (good && density_m2_per_hz.is_finite() && error_m2_per_hz.is_finite())
            .then_some(Self { density_m2_per_hz, error_m2_per_hz })
    }

    /// What `spectrum` has from `low_hz` to `high_hz`, where there is no more than the sea's tail: `low_hz` at least twice the
    /// peak's frequency.
    ///
    /// Single high lines (motors, mains) are left out. The error is that of the fit and of the tail's unknown exponent; an
    /// estimate below twice its error is no noise that matters. `None` for fewer than eight lines, or where these do not tell.
    #[must_use]
    pub fn estimated(spectrum: &SampledSpectrum, scatter: &Scatter, (low_hz, high_hz): (f64, f64)) -> Option<Self> {
        let mut lines: Vec<(f64, f64)> = spectrum.band(low_hz, high_hz).collect();
        let from_hz = lines.first()?.0;
        let (highest_hz, _) = spectrum.band(0.0, from_hz).max_by(|a, b| a.1.total_cmp(&b.1))?;
        let peak_hz = highest_hz.min(0.5 * from_hz);
        let dof = scatter.line_dof();
        let factor_max = chi_square_quantile(1.0 - CHANCE / lines.len().max(1) as f64, dof) / dof;
        for _ in 0..ROUNDS_MAX {
            let tails = EXPONENTS.map(|exponent| Tail { exponent, from_hz, peak_hz });
            let fits: Vec<(Tail, Found<2>)> = tails.into_iter().filter_map(|tail| Some((tail, fit(&lines, tail)?))).collect();
            let (tail, best) = fits.iter().max_by(|a, b| a.1.likelihood.total_cmp(&b.1.likelihood))?;
            let expected = |f_hz: f64| best.theta[0] + best.theta[1] * tail.at(f_hz);
            let kept: Vec<(f64, f64)> = lines.iter().copied().filter(|(f, s)| *s <= factor_max * expected(*f)).collect();
            if kept.len() == lines.len() {
                let joint = scatter.joint_dof();
                // Exponents that the record does not rule out, four standard deviations as e⁻⁸: the noise hangs on the exponent a
                // lot.
                let open = fits.iter().filter(|(_, fit)| 0.5 * joint * (best.likelihood - fit.likelihood) < 8.0);
                let spread = open.map(|(_, fit)| (fit.theta[0] - best.theta[0]).abs()).fold(0.0, f64::max);
                let variance = 2.0 * best.covariance[0][0] / joint + spread * spread;
                return Some(Self { density_m2_per_hz: best.theta[0], error_m2_per_hz: variance.sqrt() });
            }
            lines = kept;
        }
        None
    }

    /// Standard deviation of the readings' errors at a rate, metres.
    #[must_use]
    pub fn sigma_m(&self, rate_hz: f64) -> f64 {
        (0.5 * self.density_m2_per_hz * rate_hz).sqrt()
    }

    /// `spectrum` less the noise. Lines that are lower than it become 0, so that sums over many noisy ones are too high: take
    /// those from [`Self::moment`].
    #[must_use]
    pub fn removed(&self, spectrum: &SampledSpectrum) -> SampledSpectrum {
        spectrum.map(|_, density| (density - self.density_m2_per_hz).max(0.0))
    }

    /// The moment mₙ of `spectrum` less that of the noise.
    #[must_use]
    pub fn moment(&self, spectrum: &SampledSpectrum, order: i32, (low_hz, high_hz): (f64, f64)) -> Moment {
        let of_one: f64 = spectrum.band(low_hz, high_hz).map(|(f_hz, _)| f_hz.powi(order) * spectrum.df_hz()).sum();
        let value = spectrum.moment(order, low_hz, high_hz) - self.density_m2_per_hz * of_one;
        Moment { value, error: self.error_m2_per_hz * of_one }
    }
}

/// What a sea has well above its peak, as a share of what it has at about `from_hz`.
#[derive(Clone, Copy)]
struct Tail {
    exponent: f64,
    from_hz: f64,
    peak_hz: f64,
}

impl Tail {
    fn at(&self, f_hz: f64) -> f64 {
        (f_hz / self.from_hz).powf(-self.exponent) * (-0.25 * self.exponent * (self.peak_hz / f_hz).powi(4)).exp()
    }
}

/// The likeliest density of the noise, and of the tail at its beginning; neither negative.
fn fit(lines: &[(f64, f64)], tail: Tail) -> Option<Found<2>> {
    if lines.len() < LINES_MIN {
        return None;
    }
    let measured: Vec<f64> = lines.iter().map(|line| line.1).collect();
    let tail: Vec<f64> = lines.iter().map(|(f_hz, _)| tail.at(*f_hz)).collect();
    let highest = measured.iter().copied().fold(0.0, f64::max);
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    // The end of the band holds the noise, its beginning that and the tail.
    let (start, end) = (mean(&measured[..LINES_MIN / 2]), mean(&measured[measured.len() - LINES_MIN / 2..]));
    if !(highest > 0.0 && end > 0.0) {
        return None;
    }
    let expected = |theta: &[f64; 2]| {
        let density = tail.iter().map(|tail| theta[0] + theta[1] * tail).collect();
        Some(Expected { density, by: [vec![1.0; tail.len()], tail.clone()] })
    };
    let bounds = (0.0, 10.0 * highest);
    climb(&measured, [0.5 * end, (start - end).max(0.5 * end)], &[bounds, bounds], expected)
}

#[cfg(test)]
mod tests;
