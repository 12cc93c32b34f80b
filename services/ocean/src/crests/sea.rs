//! What crest statistics need to know of a sea: widths, steepness, shallowness, and the autocovariance's first minimum.

use std::f64::consts::TAU;

use crate::dispersion::{Depth, GRAVITY_MPS2, wavenumber_radpm};

/// Moments mₙ = ∫ fⁿ S df of a one-sided spectrum, m² Hzⁿ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeaMoments {
    /// Variance, m².
    pub m0: f64,
    /// m² Hz.
    pub m1: f64,
    /// m² Hz².
    pub m2: f64,
}

impl SeaMoments {
    /// H_s as 4 √m0, metres.
    #[must_use]
    pub fn h_s_m(&self) -> f64 {
        4.0 * self.m0.sqrt()
    }

    /// Mean period m0/m1, seconds.
    #[must_use]
    pub fn t_m01_s(&self) -> f64 {
        self.m0 / self.m1
    }

    /// Mean zero-crossing period √(m0/m2), seconds.
    #[must_use]
    pub fn t_m02_s(&self) -> f64 {
        (self.m0 / self.m2).sqrt()
    }

    /// Spectral width ν = √(m0 m2/m1² − 1) (Longuet-Higgins 1975).
    #[must_use]
    pub fn width(&self) -> f64 {
        (self.m0 * self.m2 / (self.m1 * self.m1) - 1.0).max(0.0).sqrt()
    }

    /// Tayfun's steepness of deep water, μ = μ_m (1 − ν + ν²) with μ_m = √m0 ω_m²/g and ω_m = 2π m1/m0 (Fedele & Tayfun 2009): a third of the
    /// skewness that bound waves give to the surface.
    #[must_use]
    pub fn tayfun_steepness(&self) -> f64 {
        let omega_radps = TAU * self.m1 / self.m0;
        let nu = self.width();
        self.m0.sqrt() * omega_radps * omega_radps / GRAVITY_MPS2 * (1.0 - nu + nu * nu)
    }

    /// Forristall's steepness S₁ = 2π H_s/(g T₁²) with T₁ = m0/m1.
    #[must_use]
    pub fn forristall_steepness(&self) -> f64 {
        TAU * self.h_s_m() / (GRAVITY_MPS2 * self.t_m01_s().powi(2))
    }

    /// Ursell's number H_s/(k₁² d³), with k₁ of period T₁ over depth d; 0 where deep.
    #[must_use]
    pub fn ursell(&self, depth: Depth) -> f64 {
        let k_radpm = wavenumber_radpm(TAU / self.t_m01_s(), depth);
        // d³ first would be ∞ × 0 for a sea without waves.
        if depth.as_m().is_infinite() { 0.0 } else { self.h_s_m() / (k_radpm * k_radpm * depth.as_m().powi(3)) }
    }
}

/// Boccotti's narrow-band parameter and what belongs to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NarrowBand {
    /// ψ* = −ψ(T*)/ψ(0), the depth of the autocovariance's first minimum: 1 for one frequency, 0.73 for the mean JONSWAP sea.
    pub psi_star: f64,
    /// ψ̈* = |ψ̈(T*)/ψ̈(0)|, its curvature there.
    pub psi_curvature_star: f64,
    /// T*, seconds after 0: about half a mean period.
    pub t_star_s: f64,
}

impl NarrowBand {
    /// Of spectral lines: frequency, hertz, and variance, m², of each; what is not positive is left out.
    ///
    /// ψ(τ) = Σ m² cos 2πfτ is followed from 0 in steps of a 128th of the mean period to its first minimum, which is then refined by bisection
    /// on its slope; `None` where two mean periods show none.
    #[must_use]
    pub fn of(lines: impl IntoIterator<Item = (f64, f64)>) -> Option<Self> {
        const STEPS_PER_PERIOD: u32 = 128;
        let lines: Vec<(f64, f64)> = lines
            .into_iter()
            .filter(|(f_hz, m2)| *f_hz > 0.0 && *m2 > 0.0 && f_hz.is_finite() && m2.is_finite())
            .map(|(f_hz, m2)| (TAU * f_hz, m2))
            .collect();
        let variance: f64 = lines.iter().map(|l| l.1).sum();
        let spread: f64 = lines.iter().map(|l| l.0 * l.0 * l.1).sum();
        let period_s = TAU * (variance / spread).sqrt();
        if !(period_s > 0.0 && period_s.is_finite()) {
            return None;
        }
        let psi = |tau: f64| lines.iter().map(|(w, m2)| m2 * (w * tau).cos()).sum::<f64>();
        let slope = |tau: f64| -lines.iter().map(|(w, m2)| m2 * w * (w * tau).sin()).sum::<f64>();
        let curvature = |tau: f64| -lines.iter().map(|(w, m2)| m2 * w * w * (w * tau).cos()).sum::<f64>();
        let step_s = period_s / f64::from(STEPS_PER_PERIOD);
        // The slope starts at 0 and falls; where it first turns positive is the minimum.
        let after = (1..=2 * STEPS_PER_PERIOD).find(|i| slope(f64::from(*i) * step_s) > 0.0)?;
        let (mut low_s, mut high_s) = (f64::from(after - 1) * step_s, f64::from(after) * step_s);
        for _ in 0..60 {
            let middle_s = 0.5 * (low_s + high_s);
            if slope(middle_s) > 0.0 {
                high_s = middle_s;
            } else {
                low_s = middle_s;
            }
        }
        let t_star_s = 0.5 * (low_s + high_s);
        let (psi_star, psi_curvature_star) = (-psi(t_star_s) / variance, curvature(t_star_s).abs() / spread);
        (psi_star > 0.0 && psi_curvature_star > 0.0).then_some(Self { psi_star, psi_curvature_star, t_star_s })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::{Jonswap, Spectrum};
    use approx::assert_relative_eq;

    /// Lines of a JONSWAP sea from 0.3 to 10 f_p.
    pub(crate) fn lines(h_m0_m: f64, t_p_s: f64, gamma: f64) -> Vec<(f64, f64)> {
        let sea = Jonswap::new(h_m0_m, t_p_s, gamma).unwrap();
        let step_hz = 0.002 / t_p_s;
        (150..5000).map(|i| f64::from(i) * step_hz).map(|f| (f, sea.density_m2_per_hz(f) * step_hz)).collect()
    }

    pub(crate) fn moments(lines: &[(f64, f64)]) -> SeaMoments {
        let m = |n: i32| lines.iter().map(|(f, m2)| f.powi(n) * m2).sum();
        SeaMoments { m0: m(0), m1: m(1), m2: m(2) }
    }

    #[test]
    fn one_frequency_has_no_width() {
        let swell = SeaMoments { m0: 0.25, m1: 0.025, m2: 0.0025 };
        assert_relative_eq!(swell.width(), 0.0);
        assert_relative_eq!(swell.t_m01_s(), 10.0);
        // k √m0 with k = ω²/g; S₁ = 2π 2/(9.80665 × 100).
        assert_relative_eq!(swell.tayfun_steepness(), 0.5 * (TAU / 10.0).powi(2) / 9.806_65, max_relative = 1e-12);
        assert_relative_eq!(swell.forristall_steepness(), 0.012_814, max_relative = 1e-4);
        assert_eq!(swell.ursell(Depth::DEEP), 0.0);
        // Shallow: k = ω/√(g d), so that Ur = H g/(ω² d²).
        let depth = Depth::from_m(0.5).unwrap();
        let shallow = 2.0 * 9.806_65 / ((TAU / 10.0).powi(2) * 0.25);
        assert_relative_eq!(swell.ursell(depth), shallow, max_relative = 0.03);
    }

    /// ψ = cos ωτ: ψ* = ψ̈* = 1 at half a period.
    #[test]
    fn one_line_is_as_narrow_as_can_be() {
        let found = NarrowBand::of([(0.2, 3.0), (f64::NAN, 1.0), (0.0, 1.0)]).unwrap();
        assert_relative_eq!(found.psi_star, 1.0, max_relative = 1e-9);
        assert_relative_eq!(found.psi_curvature_star, 1.0, max_relative = 1e-9);
        assert_relative_eq!(found.t_star_s, 2.5, max_relative = 1e-9);
        assert_eq!(NarrowBand::of([]), None);
    }

    /// Boccotti (2000): ψ* is 0.73 for the mean JONSWAP spectrum; 0.65 and 0.73 are also ρ of DNV-RP-C205 (3.5.11) for γ = 1 and 3.3.
    #[test]
    fn psi_star_is_the_published_one() {
        for (gamma, expected) in [(1.0, 0.65), (3.3, 0.73)] {
            let found = NarrowBand::of(lines(1.0, 8.0, gamma)).unwrap();
            assert!((found.psi_star - expected).abs() < 0.012, "γ {gamma}: {found:?}");
        }
    }
}
