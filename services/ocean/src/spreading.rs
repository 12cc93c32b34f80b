//! How wave energy spreads over directions.

use std::f64::consts::{PI, TAU};

use crate::special::ln_gamma;

/// Why a spreading function cannot be.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("spreading exponent s must be from 0 to 1000, not {s}")]
pub struct SpreadingError {
    s: f64,
}

/// Longuet-Higgins's cos-2s spreading: D(θ) = N(s) cos²ˢ((θ − θ₀)/2), with ∫ D dθ = 1 over the circle.
///
/// `s` of 0 is the same in all directions; wind sea has about 10, swell 25 to 75 (Goda & Suzuki, 1975).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CosTwoS {
    s: f64,
    norm: f64,
}

impl CosTwoS {
    /// Spreading with exponent `s`.
    ///
    /// # Errors
    /// [`SpreadingError`] unless `s` is from 0 to 1000.
    pub fn new(s: f64) -> Result<Self, SpreadingError> {
        if !(0.0..=1000.0).contains(&s) {
            return Err(SpreadingError { s });
        }
        // ∫ cos²ˢ(θ/2) dθ = 2 √π Γ(s + ½) / Γ(s + 1).
        let norm = (ln_gamma(s + 1.0) - ln_gamma(s + 0.5)).exp() / (2.0 * PI.sqrt());
        Ok(Self { s, norm })
    }

    /// The exponent.
    #[must_use]
    pub fn s(&self) -> f64 {
        self.s
    }

    /// Share of the energy per radian at `offset_rad` from the mean direction.
    #[must_use]
    pub fn density_per_rad(&self, offset_rad: f64) -> f64 {
        let offset_rad = (offset_rad + PI).rem_euclid(TAU) - PI;
        self.norm * (0.5 * offset_rad).cos().max(0.0).powf(2.0 * self.s)
    }

    /// Circular standard deviation √(2 (1 − m1)), radians, with m1 = s/(s + 1) (Kuik et al., 1988).
    #[must_use]
    pub fn spread_rad(&self) -> f64 {
        (2.0 / (self.s + 1.0)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn integrate(f: impl Fn(f64) -> f64) -> f64 {
        let n = 100_000;
        let step = TAU / f64::from(n);
        (0..n).map(|i| f(-PI + (f64::from(i) + 0.5) * step) * step).sum()
    }

    #[test]
    fn it_holds_all_the_energy_and_has_its_spread() {
        for s in [0.0, 0.5, 1.0, 2.7, 10.0, 75.0, 1000.0] {
            let d = CosTwoS::new(s).unwrap();
            assert_relative_eq!(integrate(|t| d.density_per_rad(t)), 1.0, max_relative = 1e-8);
            let m1 = integrate(|t| t.cos() * d.density_per_rad(t));
            assert_relative_eq!((2.0 * (1.0 - m1)).sqrt(), d.spread_rad(), max_relative = 1e-6);
        }
    }

    #[test]
    fn a_full_turn_changes_nothing() {
        let d = CosTwoS::new(10.0).unwrap();
        assert_relative_eq!(d.density_per_rad(0.3), d.density_per_rad(0.3 + 3.0 * TAU), max_relative = 1e-9);
        assert!(CosTwoS::new(-1.0).is_err() && CosTwoS::new(f64::NAN).is_err());
    }
}
