//! The water that waves run in: its depth and its current.

use crate::dispersion::{Depth, angular_frequency_radps, group_speed_mps, wavenumber_radpm};

/// Depth and an even current, which shifts frequencies as seen from where the film stands (Doppler): ω = √(g k tanh kh) + k·U.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Water {
    /// Depth below the mean level.
    pub depth: Depth,
    /// Where the current goes: to the north and to the east, metres per second. What is not finite counts as none.
    pub current_mps: [f64; 2],
}

impl Water {
    /// Deep, and without a current.
    pub const DEEP: Self = Self::still(Depth::DEEP);

    /// Without a current.
    #[must_use]
    pub const fn still(depth: Depth) -> Self {
        Self { depth, current_mps: [0.0; 2] }
    }

    /// The current along a direction that waves come from, metres per second; positive where it goes with them.
    pub(super) fn along_mps(&self, from_rad: f64) -> f64 {
        let [north, east] = self.current_mps.map(|u| if u.is_finite() { u } else { 0.0 });
        -(north * from_rad.cos() + east * from_rad.sin())
    }

    /// Wavenumber, radians per metre, of waves that come from `from_rad` and are seen with `omega_radps`; `None` for 0 and below, and where
    /// waves of that frequency cannot run against the current.
    #[must_use]
    pub fn wavenumber_radpm(&self, omega_radps: f64, from_rad: f64) -> Option<f64> {
        let along_mps = self.along_mps(from_rad);
        let mut k = wavenumber_radpm(omega_radps, self.depth);
        if !(omega_radps > 0.0 && k > 0.0 && k.is_finite()) {
            return None;
        }
        if along_mps == 0.0 {
            return Some(k);
        }
        // ω(k) is concave: Newton's steps are on the low side of the root from the first on, and climb.
        for _ in 0..60 {
            let slope = group_speed_mps(k, self.depth) + along_mps;
            if slope <= 0.0 {
                return None;
            }
            let step = (angular_frequency_radps(k, self.depth) + k * along_mps - omega_radps) / slope;
            k = (k - step).max(0.1 * k);
            if step.abs() <= 1e-12 * k {
                return k.is_finite().then_some(k);
            }
        }
        None
    }

    /// Angular frequency, radians per second, of waves of `k_radpm` that come from `from_rad`; negative where the current carries them back.
    #[must_use]
    pub fn omega_radps(&self, k_radpm: f64, from_rad: f64) -> f64 {
        angular_frequency_radps(k_radpm, self.depth) + k_radpm.abs() * self.along_mps(from_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use std::f64::consts::{PI, TAU};

    /// Deep water: √(g k) + U k = ω is a quadratic in √k.
    #[test]
    fn currents_shift_waves_as_the_quadratic_has_it() {
        let g = crate::GRAVITY_MPS2;
        for (u, from_rad, along) in [(0.4, PI, 0.4), (0.4, 0.0, -0.4), (0.4, 0.5 * PI, 0.0), (3.0, PI, 3.0)] {
            let water = Water { depth: Depth::DEEP, current_mps: [u, 0.0] };
            for omega in [0.5, TAU / 2.0, 5.0] {
                let root =
                    if along == 0.0 { omega / g.sqrt() } else { ((g + 4.0 * along * omega).sqrt() - g.sqrt()) / (2.0 * along) };
                let found = water.wavenumber_radpm(omega, from_rad).unwrap();
                assert_relative_eq!(found, root * root, max_relative = 1e-9);
                assert_relative_eq!(water.omega_radps(found, from_rad), omega, max_relative = 1e-9);
            }
        }
        // Against 0.4 m/s nothing is seen with more than g/4U.
        let against = Water { depth: Depth::DEEP, current_mps: [0.4, 0.0] };
        assert!(against.wavenumber_radpm(g / 1.6 + 0.01, 0.0).is_none());
        assert!(against.wavenumber_radpm(g / 1.6 - 0.01, 0.0).is_some());
        assert!(against.wavenumber_radpm(0.0, 0.0).is_none() && against.wavenumber_radpm(f64::NAN, 0.0).is_none());
    }
}
