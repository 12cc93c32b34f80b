//! Standard frequency spectra of the sea: one-sided variance densities in m²/Hz.

/// A one-sided variance density spectrum of surface elevation.
pub trait Spectrum {
    /// Variance density at `f_hz`, m²/Hz; zero for `f_hz` ≤ 0 and for NaN.
    fn density_m2_per_hz(&self, f_hz: f64) -> f64;

    /// Frequency of the highest density, hertz.
    fn peak_hz(&self) -> f64;

    /// The moment mₙ = ∫ fⁿ S(f) df over `low_hz`…`high_hz`, in m² Hzⁿ.
    ///
    /// Composite Simpson on a logarithmic frequency axis, split at the peak, where the JONSWAP shape has a kink. Tails of
    /// f⁻⁵ make moments from the fourth up depend on `high_hz`: that is the spectrum's doing. Zero unless
    /// 0 < `low_hz` < `high_hz`, both finite.
    fn moment(&self, order: i32, low_hz: f64, high_hz: f64) -> f64 {
        if !(low_hz > 0.0 && high_hz > low_hz && high_hz.is_finite()) {
            return 0.0;
        }
        let integrand = |log_f: f64| {
            let f_hz = log_f.exp();
            f_hz.powi(order + 1) * self.density_m2_per_hz(f_hz)
        };
        let split_hz = self.peak_hz().clamp(low_hz, high_hz);
        simpson(low_hz.ln(), split_hz.ln(), integrand) + simpson(split_hz.ln(), high_hz.ln(), integrand)
    }
}

/// ∫ `f` over `low`…`high` by Simpson's rule in 2000 steps.
fn simpson(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    const STEPS: u32 = 2000;
    let step = (high - low) / f64::from(STEPS);
    if step <= 0.0 {
        return 0.0;
    }
    let inner: f64 = (1..STEPS).map(|i| f(low + f64::from(i) * step) * if i % 2 == 1 { 4.0 } else { 2.0 }).sum();
    (f(low) + inner + f(high)) * step / 3.0
}

/// Why a spectrum cannot be.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SpectrumError {
    /// Height.
    #[error("significant wave height must be finite and not negative, not {0} m")]
    Height(f64),
    /// Period.
    #[error("peak period must be finite and above 0 s, not {0} s")]
    Period(f64),
    /// Peak enhancement.
    #[error("JONSWAP peak enhancement must be from 1 to 20, not {0}")]
    Gamma(f64),
}

/// The JONSWAP spectrum (Hasselmann et al., 1973), scaled so that 4 √m0 is exactly the wave height asked for.
///
/// S(f) = A f⁻⁵ exp(−5/4 (f_p/f)⁴) γ^exp(−(f/f_p − 1)²/2σ²), σ = 0.07 below the peak and 0.09 above. A follows from a
/// numerical integral over all frequencies, not from Goda's fit (which is up to 1 % off).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jonswap {
    h_m0_m: f64,
    t_p_s: f64,
    gamma: f64,
    /// m0 f_p⁴ over the integral of the dimensionless shape.
    scale: f64,
}

impl Jonswap {
    /// Waves of H_m0 `h_m0_m` metres, peak period `t_p_s` seconds and peak enhancement `gamma` (3.3 on average, 1 is
    /// Pierson-Moskowitz).
    ///
    /// # Errors
    /// [`SpectrumError`] for a negative height, a period of 0 or less, a `gamma` out of 1 to 20, or what is not finite.
    pub fn new(h_m0_m: f64, t_p_s: f64, gamma: f64) -> Result<Self, SpectrumError> {
        if !(h_m0_m >= 0.0 && h_m0_m.is_finite()) {
            return Err(SpectrumError::Height(h_m0_m));
        }
        if !(t_p_s > 0.0 && t_p_s.is_finite()) {
            return Err(SpectrumError::Period(t_p_s));
        }
        if !(1.0..=20.0).contains(&gamma) {
            return Err(SpectrumError::Gamma(gamma));
        }
        // ∫ ν⁻⁵ exp(−5/4 ν⁻⁴) dν = 1/5 in closed form; only the enhancement's excess needs quadrature, and it is confined to
        // within ten widths of the peak.
        let excess = |nu: f64| base_shape(nu) * (enhancement(nu, gamma) - 1.0);
        let area = if gamma > 1.0 { 0.2 + simpson(0.3, 1.0, excess) + simpson(1.0, 2.0, excess) } else { 0.2 };
        Ok(Self { h_m0_m, t_p_s, gamma, scale: h_m0_m * h_m0_m / 16.0 * t_p_s / area })
    }

    /// H_m0 = 4 √m0, metres.
    #[must_use]
    pub fn h_m0_m(&self) -> f64 {
        self.h_m0_m
    }

    /// Peak period, seconds.
    #[must_use]
    pub fn t_p_s(&self) -> f64 {
        self.t_p_s
    }

    /// Peak enhancement.
    #[must_use]
    pub fn gamma(&self) -> f64 {
        self.gamma
    }

    /// ∂ ln S/∂ ln T_p at `f_hz` > 0, H_m0 and γ kept.
    pub(crate) fn log_slope_by_period(&self, f_hz: f64) -> f64 {
        let nu = f_hz * self.t_p_s;
        // Where no density is left, any finite slope will do.
        if nu < NU_MIN {
            return 0.0;
        }
        let peak = self.gamma.ln() * enhancement_exponent(nu) * (nu - 1.0) * nu / width(nu).powi(2);
        -4.0 + 5.0 * nu.powi(-4) - peak
    }

    /// What ln γ is multiplied by in ln S at `f_hz`.
    pub(crate) fn enhancement_exponent(&self, f_hz: f64) -> f64 {
        enhancement_exponent(f_hz * self.t_p_s)
    }

    /// Mean of [`Self::enhancement_exponent`] over the variance: ∂ ln m0/∂ ln γ at a constant height of the shape.
    pub(crate) fn enhancement_mean(&self) -> f64 {
        let moment = |nu: f64| base_shape(nu) * enhancement(nu, self.gamma) * enhancement_exponent(nu);
        (simpson(0.3, 1.0, moment) + simpson(1.0, 2.0, moment)) * self.scale / (self.h_m0_m * self.h_m0_m / 16.0 * self.t_p_s)
    }
}

impl Spectrum for Jonswap {
    fn density_m2_per_hz(&self, f_hz: f64) -> f64 {
        let nu = f_hz * self.t_p_s;
        if nu > 0.0 { self.scale * base_shape(nu) * enhancement(nu, self.gamma) } else { 0.0 }
    }

    fn peak_hz(&self) -> f64 {
        1.0 / self.t_p_s
    }
}

/// No density is left under this share of the peak's frequency.
const NU_MIN: f64 = 0.05;

/// ν⁻⁵ exp(−5/4 ν⁻⁴) with ν = f/f_p: the Pierson-Moskowitz shape.
fn base_shape(nu: f64) -> f64 {
    // Nothing is left below a fifth of the peak, and ν⁻⁵ would overflow further down: 0 × ∞ is not 0.
    if nu < NU_MIN { 0.0 } else { nu.powi(-5) * (-1.25 * nu.powi(-4)).exp() }
}

fn enhancement(nu: f64, gamma: f64) -> f64 {
    gamma.powf(enhancement_exponent(nu))
}

fn enhancement_exponent(nu: f64) -> f64 {
    (-0.5 * ((nu - 1.0) / width(nu)).powi(2)).exp()
}

/// σ of JONSWAP.
fn width(nu: f64) -> f64 {
    if nu <= 1.0 { 0.07 } else { 0.09 }
}

/// The two-parameter Pierson-Moskowitz (Bretschneider, ISSC) spectrum of a fully grown sea:
/// S(f) = (5/16) H_m0² f_p⁴ f⁻⁵ exp(−5/4 (f_p/f)⁴).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PiersonMoskowitz(Jonswap);

impl PiersonMoskowitz {
    /// Waves of H_m0 `h_m0_m` metres and peak period `t_p_s` seconds.
    ///
    /// # Errors
    /// [`SpectrumError`] for a negative height, a period of 0 or less, or what is not finite.
    pub fn new(h_m0_m: f64, t_p_s: f64) -> Result<Self, SpectrumError> {
        Jonswap::new(h_m0_m, t_p_s, 1.0).map(Self)
    }

    /// H_m0 = 4 √m0, metres.
    #[must_use]
    pub fn h_m0_m(&self) -> f64 {
        self.0.h_m0_m
    }

    /// Peak period, seconds.
    #[must_use]
    pub fn t_p_s(&self) -> f64 {
        self.0.t_p_s
    }
}

impl Spectrum for PiersonMoskowitz {
    fn density_m2_per_hz(&self, f_hz: f64) -> f64 {
        self.0.density_m2_per_hz(f_hz)
    }

    fn peak_hz(&self) -> f64 {
        self.0.peak_hz()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Plain midpoint sums, written here so as not to judge the quadrature by itself.
    fn midpoint_moment(spectrum: &impl Spectrum, order: i32, high_hz: f64) -> f64 {
        let n = 400_000;
        let df = high_hz / f64::from(n);
        (0..n).map(|i| (f64::from(i) + 0.5) * df).map(|f| f.powi(order) * spectrum.density_m2_per_hz(f) * df).sum()
    }

    #[test]
    fn jonswap_has_the_height_asked_for() {
        for gamma in [1.0, 2.0, 3.3, 7.0, 20.0] {
            for (h, t) in [(0.05, 1.3), (3.5, 11.0)] {
                let sea = Jonswap::new(h, t, gamma).unwrap();
                // The f⁻⁵ tail beyond 40 f_p holds a ten-millionth of the variance.
                assert_relative_eq!(4.0 * midpoint_moment(&sea, 0, 40.0 / t).sqrt(), h, max_relative = 1e-6);
                assert_relative_eq!(4.0 * sea.moment(0, 0.05 / t, 400.0 / t).sqrt(), h, max_relative = 1e-7);
            }
        }
    }

    #[test]
    fn the_peak_is_where_it_should_be() {
        let sea = Jonswap::new(1.0, 8.0, 3.3).unwrap();
        let (peak_hz, _) = (1..2000)
            .map(|i| f64::from(i) * 2e-4)
            .map(|f| (f, sea.density_m2_per_hz(f)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap();
        assert!((peak_hz - 0.125).abs() < 2e-4, "{peak_hz}");
    }

    /// Goda (2000): T_m01 and T_m02 over T_p are 0.834 and 0.779 at γ = 3.3; closed forms for γ = 1:
    /// m1/m0 = Γ(3/4)(5/4)^¼ f_p and m2/m0 = √π (5/4)^½ f_p².
    #[test]
    fn mean_periods_are_the_published_ones() {
        let grown = PiersonMoskowitz::new(2.0, 10.0).unwrap();
        let m = |n| grown.moment(n, 0.005, 1000.0);
        assert_relative_eq!(m(1) / m(0), 1.225_416_702_465_178 * 1.25_f64.powf(0.25) * 0.1, max_relative = 1e-6);
        assert_relative_eq!(m(2) / m(0), (std::f64::consts::PI * 1.25).sqrt() * 0.01, max_relative = 1e-4);
        assert_relative_eq!(m(-1) / m(0), 0.906_402_477_055_477 * 1.25_f64.powf(-0.25) * 10.0, max_relative = 1e-6);

        let young = Jonswap::new(2.0, 10.0, 3.3).unwrap();
        let m = |n| young.moment(n, 0.005, 1000.0);
        assert_relative_eq!(m(0) / m(1) / 10.0, 0.834, max_relative = 2e-3);
        assert_relative_eq!((m(0) / m(2)).sqrt() / 10.0, 0.779, max_relative = 3e-3);
    }

    /// All moments of Pierson-Moskowitz in closed form: mₙ = m0 (5/4)^(n/4) Γ(1 − n/4) f_pⁿ, for n < 4. Gammas of Abramowitz & Stegun,
    /// tables 6.1: Γ(3/2), Γ(5/4), Γ(3/4), Γ(1/2), Γ(1/4).
    #[test]
    fn moments_of_pierson_moskowitz_are_gamma_functions() {
        let (h_m0_m, t_p_s) = (0.6_f64, 3.7_f64);
        let grown = PiersonMoskowitz::new(h_m0_m, t_p_s).unwrap();
        let gammas = [
            (-2, 0.886_226_925_452_758),
            (-1, 0.906_402_477_055_477),
            (0, 1.0),
            (1, 1.225_416_702_465_178),
            (2, 1.772_453_850_905_516),
            (3, 3.625_609_908_221_908),
        ];
        for (order, gamma) in gammas {
            let expected = h_m0_m * h_m0_m / 16.0 * 1.25_f64.powf(0.25 * f64::from(order)) * gamma * t_p_s.powi(-order);
            // The tail that the upper end cuts off m3 is 5/4 × 4 f_p/f of it.
            assert_relative_eq!(grown.moment(order, 0.05 / t_p_s, 1e6 / t_p_s), expected, max_relative = 1e-5);
        }
    }

    /// Derivatives by hand against differences of the density itself.
    #[test]
    fn slopes_by_period_and_enhancement_are_differences() {
        let step = 1e-6_f64;
        for gamma in [1.5, 3.3, 9.0] {
            let at = |t_p_s: f64, gamma: f64, f_hz: f64| Jonswap::new(0.8, t_p_s, gamma).unwrap().density_m2_per_hz(f_hz).ln();
            let sea = Jonswap::new(0.8, 5.0, gamma).unwrap();
            for f_hz in [0.12, 0.17, 0.19, 0.21, 0.25, 0.6] {
                let by_period = (at(5.0 * step.exp(), gamma, f_hz) - at(5.0 * (-step).exp(), gamma, f_hz)) / (2.0 * step);
                assert_relative_eq!(sea.log_slope_by_period(f_hz), by_period, max_relative = 1e-5, epsilon = 1e-6);
                let by_gamma = (at(5.0, gamma * step.exp(), f_hz) - at(5.0, gamma * (-step).exp(), f_hz)) / (2.0 * step);
                let slope = sea.enhancement_exponent(f_hz) - sea.enhancement_mean();
                assert_relative_eq!(slope, by_gamma, max_relative = 1e-5, epsilon = 1e-6);
            }
        }
    }

    #[test]
    fn nothing_comes_of_nothing() {
        let still = Jonswap::new(0.0, 1.3, 3.3).unwrap();
        assert_eq!(still.density_m2_per_hz(0.7), 0.0);
        let sea = Jonswap::new(1.0, 1.3, 3.3).unwrap();
        for f in [0.0, -1.0, f64::NAN, 1e-300, f64::INFINITY] {
            assert_eq!(sea.density_m2_per_hz(f), 0.0, "{f}");
        }
        assert_eq!(sea.moment(0, 0.0, 1.0), 0.0);
        assert!(matches!(Jonswap::new(f64::NAN, 1.0, 3.3), Err(SpectrumError::Height(_))));
        assert!(matches!(Jonswap::new(1.0, 0.0, 3.3), Err(SpectrumError::Period(_))));
        assert!(matches!(Jonswap::new(1.0, 1.0, 0.5), Err(SpectrumError::Gamma(_))));
    }
}
