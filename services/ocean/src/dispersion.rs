//! The linear dispersion relation of gravity waves: ω² = g k tanh(k h) (Airy, 1845).
//!
//! Surface tension is left out, so wavelengths under about 5 cm (periods under 0.2 s) are not described.

use std::f64::consts::TAU;

/// Standard gravity, metres per second squared (CGPM 1901).
pub const GRAVITY_MPS2: f64 = 9.806_65;

/// Why a depth is refused.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("water depth must be above 0 m, not {depth_m} m")]
pub struct DepthError {
    depth_m: f64,
}

/// Depth of the water below its mean level: positive metres, or deep.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Depth {
    depth_m: f64,
}

impl Depth {
    /// Deeper than any wave can feel.
    pub const DEEP: Self = Self { depth_m: f64::INFINITY };

    /// A depth in metres; infinity is [`Self::DEEP`].
    ///
    /// # Errors
    /// [`DepthError`] unless `depth_m` is above 0 (NaN is refused).
    pub fn from_m(depth_m: f64) -> Result<Self, DepthError> {
        if depth_m > 0.0 { Ok(Self { depth_m }) } else { Err(DepthError { depth_m }) }
    }

    /// Metres; infinity where deep.
    #[must_use]
    pub fn as_m(self) -> f64 {
        self.depth_m
    }
}

/// Wavenumber, radians per metre, of waves of `angular_frequency_radps` (its sign is ignored) over `depth`.
///
/// Zero for zero; NaN for what is not finite. Newton's method from Eckart's (1952) approximation, to rounding error.
#[must_use]
pub fn wavenumber_radpm(angular_frequency_radps: f64, depth: Depth) -> f64 {
    if !angular_frequency_radps.is_finite() {
        return f64::NAN;
    }
    let deep_radpm = angular_frequency_radps * angular_frequency_radps / GRAVITY_MPS2;
    let y = deep_radpm * depth.depth_m;
    // Past k h = 20 tanh(k h) is 1 to the last bit; `y` is NaN for a still, deep sea.
    if deep_radpm == 0.0 || y > 20.0 {
        return deep_radpm;
    }
    // Solve x tanh x = y for x = k h.
    let mut x = y / y.tanh().sqrt();
    for _ in 0..20 {
        let tanh = x.tanh();
        let step = (x * tanh - y) / (tanh + x * (1.0 - tanh * tanh));
        x -= step;
        if step.abs() <= 1e-15 * x {
            break;
        }
    }
    x / depth.depth_m
}

/// Angular frequency, radians per second, of waves of `wavenumber_radpm` (its sign is ignored) over `depth`.
#[must_use]
pub fn angular_frequency_radps(wavenumber_radpm: f64, depth: Depth) -> f64 {
    let k_radpm = wavenumber_radpm.abs();
    if k_radpm == 0.0 {
        return 0.0;
    }
    (GRAVITY_MPS2 * k_radpm * (k_radpm * depth.depth_m).tanh()).sqrt()
}

/// Wavelength, metres, of waves of `period_s` over `depth`; infinite for an infinite period.
#[must_use]
pub fn wavelength_m(period_s: f64, depth: Depth) -> f64 {
    TAU / wavenumber_radpm(TAU / period_s, depth)
}

/// Period, seconds, of waves of `wavelength_m` over `depth`.
#[must_use]
pub fn period_s(wavelength_m: f64, depth: Depth) -> f64 {
    TAU / angular_frequency_radps(TAU / wavelength_m, depth)
}

/// Speed of the crests, metres per second, of waves of `wavenumber_radpm` over `depth`.
#[must_use]
pub fn phase_speed_mps(wavenumber_radpm: f64, depth: Depth) -> f64 {
    angular_frequency_radps(wavenumber_radpm, depth) / wavenumber_radpm.abs()
}

/// Speed of the energy, metres per second, of waves of `wavenumber_radpm` over `depth`: n = ½ (1 + 2kh / sinh 2kh) times the
/// crests' speed.
#[must_use]
pub fn group_speed_mps(wavenumber_radpm: f64, depth: Depth) -> f64 {
    let twice_kh = 2.0 * wavenumber_radpm.abs() * depth.depth_m;
    let ratio = if twice_kh > 700.0 { 0.0 } else { twice_kh / twice_kh.sinh() };
    0.5 * (1.0 + ratio) * phase_speed_mps(wavenumber_radpm, depth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    #[test]
    fn deep_water_is_the_closed_form() {
        let omega = TAU / 1.3;
        assert_relative_eq!(wavenumber_radpm(omega, Depth::DEEP), omega * omega / GRAVITY_MPS2);
        // L0 = g T² / 2π: 1.56 T² in every textbook.
        assert_relative_eq!(wavelength_m(10.0, Depth::DEEP), 156.08, max_relative = 1e-4);
        let k = wavenumber_radpm(omega, Depth::DEEP);
        assert_relative_eq!(group_speed_mps(k, Depth::DEEP), 0.5 * phase_speed_mps(k, Depth::DEEP));
    }

    /// Shore Protection Manual (1984), table C-1: d/L0, d/L, n.
    #[test]
    fn finite_depth_is_the_published_table() {
        for (d_over_l0, d_over_l, n) in [
            (0.0100, 0.04032, 0.9792),
            (0.0500, 0.09416, 0.8999),
            (0.1000, 0.1410, 0.8103),
            (0.2000, 0.2251, 0.6675),
            (0.5000, 0.5018, 0.5117),
        ] {
            let depth = Depth::from_m(3.0).unwrap();
            let l0_m = 3.0 / d_over_l0;
            let period_s = (TAU * l0_m / GRAVITY_MPS2).sqrt();
            let k = wavenumber_radpm(TAU / period_s, depth);
            assert_relative_eq!(3.0 * k / TAU, d_over_l, max_relative = 4e-4);
            assert_relative_eq!(group_speed_mps(k, depth) / phase_speed_mps(k, depth), n, max_relative = 1e-3);
        }
    }

    #[test]
    fn shallow_water_runs_at_the_root_of_g_h() {
        let depth = Depth::from_m(0.01).unwrap();
        let k = wavenumber_radpm(0.01, depth);
        assert_relative_eq!(phase_speed_mps(k, depth), (GRAVITY_MPS2 * 0.01).sqrt(), max_relative = 1e-6);
    }

    #[test]
    fn bad_numbers_do_not_become_waves() {
        assert!(Depth::from_m(0.0).is_err() && Depth::from_m(f64::NAN).is_err() && Depth::from_m(-1.0).is_err());
        assert!(wavenumber_radpm(f64::NAN, Depth::DEEP).is_nan());
        assert!(wavenumber_radpm(f64::INFINITY, Depth::DEEP).is_nan());
        assert_eq!(wavenumber_radpm(0.0, Depth::DEEP), 0.0);
        assert_eq!(wavenumber_radpm(0.0, Depth::from_m(2.0).unwrap()), 0.0);
    }

    proptest! {
        #[test]
        fn there_and_back(omega in 1e-3f64..60.0, depth_m in 1e-2f64..1e4) {
            let depth = Depth::from_m(depth_m).unwrap();
            let back = angular_frequency_radps(wavenumber_radpm(omega, depth), depth);
            prop_assert!((back - omega).abs() <= 1e-12 * omega, "{back} {omega}");
        }
    }
}
