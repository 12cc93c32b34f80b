//! Distributions of crest and wave heights, as the probability that one exceeds a value.

use super::sea::{NarrowBand, SeaMoments};
use crate::dispersion::Depth;
use crate::special::gamma_p;

/// A distribution of a height.
pub trait Exceedance {
    /// The probability, 0 to 1, that one crest or wave is higher than `value_m`; NaN for NaN.
    fn exceedance(&self, value_m: f64) -> f64;

    /// The height, metres, that one exceeds with `probability`; by bisection. 0 where the least height is exceeded less often than
    /// that, NaN unless 0 < `probability` < 1.
    fn exceeded_m(&self, probability: f64) -> f64 {
        if !(probability > 0.0 && probability < 1.0) {
            return f64::NAN;
        }
        falling_root(&|x| self.exceedance(x), probability)
    }
}

/// Where the falling function `f` of x ≥ 0 passes `level`, to rounding error; its bracket at 10³⁰⁰ where it never does.
pub(super) fn falling_root(f: &dyn Fn(f64) -> f64, level: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1e-3);
    while f(high) > level && high < 1e300 {
        low = high;
        high *= 2.0;
    }
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if f(middle) > level {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// P(x) = exp(−(x/scale)^shape).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weibull {
    /// Height exceeded by one in e, metres.
    pub scale_m: f64,
    /// Exponent; 2 is Rayleigh's.
    pub shape: f64,
}

impl Exceedance for Weibull {
    fn exceedance(&self, value_m: f64) -> f64 {
        if value_m.is_nan() {
            return f64::NAN;
        }
        if value_m <= 0.0 { 1.0 } else { (-(value_m / self.scale_m).powf(self.shape)).exp() }
    }
}

/// Rayleigh's distribution, P(x) = exp(−x²/scale²): a narrow-band linear sea (Longuet-Higgins 1952).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rayleigh {
    scale_m: f64,
}

impl Rayleigh {
    /// Crests (or troughs) over a variance `m0`, m²: scale² = 2 m0.
    #[must_use]
    pub fn crests(m0: f64) -> Self {
        Self { scale_m: (2.0 * m0).sqrt() }
    }

    /// Heights crest to trough: scale² = 8 m0 = H_rms².
    #[must_use]
    pub fn heights(m0: f64) -> Self {
        Self { scale_m: (8.0 * m0).sqrt() }
    }

    /// Heights with the first correction for the width ν of the band: H_rms² = 8 m0 (1 − (π²/8 − ½) ν²) (Longuet-Higgins 1980). Meant for
    /// ν under about 0.5; it is not let under half of 8 m0.
    #[must_use]
    pub fn heights_of_width(m0: f64, width: f64) -> Self {
        let factor = 1.0 - (std::f64::consts::PI.powi(2) / 8.0 - 0.5) * width * width;
        Self { scale_m: (8.0 * m0 * factor.max(0.5)).sqrt() }
    }

    /// Root mean square of the heights, metres.
    #[must_use]
    pub fn rms_m(&self) -> f64 {
        self.scale_m
    }
}

impl Exceedance for Rayleigh {
    fn exceedance(&self, value_m: f64) -> f64 {
        Weibull { scale_m: self.scale_m, shape: 2.0 }.exceedance(value_m)
    }
}

/// Forristall's (1978) Weibull fit to hurricane waves: P(H) = exp(−(H/√m0)^2.126/8.42).
#[must_use]
pub fn forristall_1978(m0: f64) -> Weibull {
    Weibull { scale_m: m0.sqrt() * 8.42_f64.powf(1.0 / 2.126), shape: 2.126 }
}

/// How a sea spreads over directions, as far as [`forristall_2000`] cares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spread {
    /// All one way (Forristall's 2-D).
    LongCrested,
    /// Spread over directions (his 3-D).
    ShortCrested,
}

/// Forristall's (2000) Weibull fit to second-order simulations, *J. Phys. Oceanogr.* 30: crests, P(η) = exp(−(η/(α H_s))^β), with α and β of the
/// steepness S₁ and Ursell's number. At S₁ = Ur = 0 it is Rayleigh's; fitted for S₁ to 0.1 and Ur to 0.1 or so.
#[must_use]
pub fn forristall_2000(sea: &SeaMoments, depth: Depth, spread: Spread) -> Weibull {
    let (s1, ursell) = (sea.forristall_steepness(), sea.ursell(depth));
    let (alpha, shape) = match spread {
        Spread::LongCrested => (0.3536 + 0.2892 * s1 + 0.1060 * ursell, 2.0 - 2.1597 * s1 + 0.0968 * ursell * ursell),
        Spread::ShortCrested => {
            (0.3536 + 0.2568 * s1 + 0.0800 * ursell, 2.0 - 1.7912 * s1 - 0.5302 * ursell + 0.2824 * ursell * ursell)
        }
    };
    Weibull { scale_m: alpha * sea.h_s_m(), shape }
}

/// Tayfun's (1980) distribution of a narrow band with second-order bound waves: a linear amplitude a (over √m0) makes a crest
/// a + ½ μ a² and a trough a − ½ μ a².
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tayfun {
    sigma_m: f64,
    /// μ for crests, −μ for troughs.
    signed_steepness: f64,
}

impl Tayfun {
    /// Crests over a variance `m0`, m², with `steepness` μ, a third of the surface's skewness ([`SeaMoments::tayfun_steepness`]);
    /// a steepness that is not positive is none.
    #[must_use]
    pub fn crests(m0: f64, steepness: f64) -> Self {
        Self { sigma_m: m0.sqrt(), signed_steepness: steepness.max(0.0) }
    }

    /// Depths of troughs, metres, positive. None is deeper than √m0/(2μ), where the second-order trough turns back.
    #[must_use]
    pub fn troughs(m0: f64, steepness: f64) -> Self {
        Self { sigma_m: m0.sqrt(), signed_steepness: -steepness.max(0.0) }
    }
}

impl Exceedance for Tayfun {
    fn exceedance(&self, value_m: f64) -> f64 {
        if value_m.is_nan() || self.sigma_m.is_nan() {
            return f64::NAN;
        }
        let x = value_m / self.sigma_m;
        if x <= 0.0 || value_m <= 0.0 {
            return 1.0;
        }
        // a = (√(1 + 2 μ x) − 1)/μ, written so that μ may be 0.
        let inside = 1.0 + 2.0 * self.signed_steepness * x;
        if inside < 0.0 {
            return 0.0;
        }
        let amplitude = 2.0 * x / (1.0 + inside.sqrt());
        (-0.5 * amplitude * amplitude).exp()
    }
}

/// Boccotti's (1989, 2000) distribution of heights in a linear sea of any band:
/// P(H) = K exp(−H²/(4 (1 + ψ*) m0)), K = (1 + ψ̈*)/√(2 ψ̈* (1 + ψ*)).
///
/// Exact as H/√m0 grows; for heights of less than about 4 √m0 it is an extrapolation, cut off at 1. One frequency makes it Rayleigh's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Boccotti {
    m0: f64,
    band: NarrowBand,
}

impl Boccotti {
    /// Over a variance `m0`, m².
    #[must_use]
    pub fn heights(m0: f64, band: NarrowBand) -> Self {
        Self { m0, band }
    }

    /// K: 1 for one frequency.
    #[must_use]
    pub fn factor(&self) -> f64 {
        let (psi, bend) = (self.band.psi_star, self.band.psi_curvature_star);
        (1.0 + bend) / (2.0 * bend * (1.0 + psi)).sqrt()
    }
}

impl Exceedance for Boccotti {
    fn exceedance(&self, value_m: f64) -> f64 {
        if value_m <= 0.0 {
            return 1.0;
        }
        let exponent = -value_m * value_m / (4.0 * (1.0 + self.band.psi_star) * self.m0);
        // `min` would turn NaN into 1.
        (self.factor() * exponent.exp()).clamp(0.0, 1.0)
    }
}

/// All maxima, those below the mean level too, of a linear sea with bandwidth ε = √(1 − m2²/(m0 m4)) (Rice 1944; Cartwright & Longuet-Higgins
/// 1956): Rayleigh's crests at ε = 0, a normal distribution at ε = 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rice {
    sigma_m: f64,
    bandwidth: f64,
}

impl Rice {
    /// Over a variance `m0`, m², with ε, taken within 0 to 1.
    #[must_use]
    pub fn maxima(m0: f64, bandwidth: f64) -> Self {
        Self { sigma_m: m0.sqrt(), bandwidth: bandwidth.clamp(0.0, 1.0) }
    }
}

impl Exceedance for Rice {
    /// Also for negative values.
    fn exceedance(&self, value_m: f64) -> f64 {
        let x = value_m / self.sigma_m;
        let narrow = (1.0 - self.bandwidth * self.bandwidth).sqrt();
        if self.bandwidth < 1e-9 {
            return if x.is_nan() { f64::NAN } else { (-0.5 * x.max(0.0).powi(2)).exp() };
        }
        let bound = |x: f64| normal_exceedance(x / self.bandwidth);
        bound(x) + narrow * (-0.5 * x * x).exp() * (1.0 - bound(x * narrow))
    }
}

/// The probability that a standard normal variable exceeds `z`.
pub(crate) fn normal_exceedance(z: f64) -> f64 {
    // 1 − P loses the far tail to cancellation; past z = 5 its asymptotic fraction (Abramowitz & Stegun 26.2.14) does not.
    if z > 5.0 {
        let mut fraction = z;
        for n in (1..=40).rev() {
            fraction = z + f64::from(n) / fraction;
        }
        return (-0.5 * z * z).exp() / (std::f64::consts::TAU.sqrt() * fraction);
    }
    let half = 0.5 * gamma_p(0.5, 0.5 * z * z);
    if z >= 0.0 { 0.5 - half } else { 0.5 + half }
}

#[cfg(test)]
mod tests;
