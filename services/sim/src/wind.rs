//! Wind: a mean that shears with height, and gusts by the Dryden model.
//!
//! Gusts follow MIL-F-8785C's Dryden spectra for low altitude: a first-order filter along the mean wind, second-order across it
//! and vertically, with length scales and intensities that depend on height. A multicopter that hovers is swept by frozen
//! turbulence at its own air speed, which is what carries the spectrum from space into time.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::noise::{generator, normal, normal3};

/// Feet in a metre: the model's formulas are in feet.
const FT_PER_M: f64 = 1.0 / 0.3048;
/// The height that the wind speed is stated for, metres.
const REFERENCE_HEIGHT_M: f64 = 10.0;
/// Below this height the shear and the length scales are frozen, metres.
const HEIGHT_MIN_M: f64 = 1.0;
/// Exponent of the wind profile over open water.
const SHEAR_EXPONENT: f64 = 0.11;

/// The wind (`[sim.wind]`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WindConfig {
    /// Mean speed at 10 m, metres per second, 0 to 30.
    pub speed_mps: f64,
    /// Where the wind comes from, degrees clockwise from true north.
    pub direction_from_deg: f64,
    /// Gusts relative to what the Dryden model gives for this speed; 0 is steady wind, at most 5.
    pub gust_scale: f64,
}

impl Default for WindConfig {
    /// A light breeze from where the default sea comes.
    fn default() -> Self {
        Self { speed_mps: 3.0, direction_from_deg: 240.0, gust_scale: 1.0 }
    }
}

impl WindConfig {
    /// No wind at all.
    #[must_use]
    pub fn calm() -> Self {
        Self { speed_mps: 0.0, gust_scale: 0.0, ..Self::default() }
    }

    /// Steady wind of `speed_mps` from `direction_from_deg`.
    #[must_use]
    pub fn steady(speed_mps: f64, direction_from_deg: f64) -> Self {
        Self { speed_mps, direction_from_deg, gust_scale: 0.0 }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// One line that names the key and its range.
    pub fn validate(&self) -> Result<(), String> {
        crate::config::range("wind.speed_mps", self.speed_mps, 0.0, 30.0)?;
        crate::config::range("wind.direction_from_deg", self.direction_from_deg, -360.0, 360.0)?;
        crate::config::range("wind.gust_scale", self.gust_scale, 0.0, 5.0)
    }

    /// Mean wind at `height_m` above the water, metres per second, north, east and down. Where the air goes **to**.
    #[must_use]
    pub fn mean_ned_mps(&self, height_m: f64) -> Vector3<f64> {
        let speed_mps = self.speed_mps * (height_m.max(HEIGHT_MIN_M) / REFERENCE_HEIGHT_M).powf(SHEAR_EXPONENT);
        let (sin, cos) = self.direction_from_deg.to_radians().sin_cos();
        Vector3::new(-speed_mps * cos, -speed_mps * sin, 0.0)
    }
}

/// Standard deviations (along, across, vertical; metres per second) and length scales (metres) at a height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turbulence {
    /// Along, across, down, metres per second.
    pub sigma_mps: Vector3<f64>,
    /// Along, across, down, metres.
    pub length_m: Vector3<f64>,
}

impl Turbulence {
    /// MIL-F-8785C, section 3.7.3.4, below 1000 ft: σ_w = 0.1 W_20, σ_u / σ_w = σ_v / σ_w = (0.177 + 0.000823 h)^−0.4,
    /// L_w = h, L_u = L_v = h (0.177 + 0.000823 h)^−1.2, h in feet.
    #[must_use]
    pub fn at(height_m: f64, speed_at_20_ft_mps: f64) -> Self {
        let height_ft = height_m.clamp(HEIGHT_MIN_M, 300.0) * FT_PER_M;
        let ratio = 0.177 + 0.000_823 * height_ft;
        let vertical_mps = 0.1 * speed_at_20_ft_mps;
        let across_mps = vertical_mps / ratio.powf(0.4);
        let across_m = height_ft / ratio.powf(1.2) / FT_PER_M;
        Self {
            sigma_mps: Vector3::new(across_mps, across_mps, vertical_mps),
            length_m: Vector3::new(across_m, across_m, height_ft / FT_PER_M),
        }
    }
}

/// The wind that one vehicle meets. Seeded: the same seed and the same calls give the same wind.
#[derive(Debug, Clone)]
pub struct Wind {
    config: WindConfig,
    random: ChaCha8Rng,
    /// First stage of the filter on each axis, unit variance.
    first: Vector3<f64>,
    /// Second stage across and down.
    second: Vector3<f64>,
}

impl Wind {
    /// The wind of `vehicle` under `seed`.
    #[must_use]
    pub fn new(config: WindConfig, seed: u64, vehicle: &str) -> Self {
        let mut random = generator(seed, vehicle, "wind");
        let first = normal3(&mut random);
        // Stationary pair: the second stage has variance 1/2 and covariance 1/2 with the first.
        let second = first * 0.5 + normal3(&mut random) * 0.5;
        Self { config, random, first, second }
    }

    /// Advances by `dt_s` and returns the wind at `height_m` for a vehicle with `air_speed_mps`, metres per second NED.
    pub fn step(&mut self, dt_s: f64, height_m: f64, air_speed_mps: f64) -> Vector3<f64> {
        let mean_mps = self.config.mean_ned_mps(height_m);
        if self.config.gust_scale == 0.0 || self.config.speed_mps == 0.0 {
            return mean_mps;
        }
        let at_20_ft_mps = self.config.mean_ned_mps(20.0 / FT_PER_M).norm();
        let turbulence = Turbulence::at(height_m, at_20_ft_mps);
        let sweep_mps = air_speed_mps.max(1.0);
        for axis in 0..3 {
            let ratio = dt_s * sweep_mps / turbulence.length_m[axis];
            let keep = (-ratio).exp();
            // The second stage sees the first as it was: x2' = (x1 − x2) / T, exact for x1 held over the short step.
            self.second[axis] = self.second[axis] * keep + self.first[axis] * (1.0 - keep);
            self.first[axis] = self.first[axis] * keep + normal(&mut self.random) * (1.0 - keep * keep).sqrt();
        }
        // Across and down: σ (1 + √3 T s) / (1 + T s)² in partial fractions, scaled to unit variance (the sum of the two has 2).
        let root_3 = 3.0_f64.sqrt();
        let second_order = (self.first * root_3 + self.second * (1.0 - root_3)) / 2.0_f64.sqrt();
        let unit = Vector3::new(self.first.x, second_order.y, second_order.z);
        let gust = unit.component_mul(&turbulence.sigma_mps) * self.config.gust_scale;
        // Along and across the mean wind, turned into north and east.
        let along = mean_mps.xy() / mean_mps.xy().norm();
        mean_mps + Vector3::new(along.x * gust.x - along.y * gust.y, along.y * gust.x + along.x * gust.y, gust.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wind_from_the_west_blows_to_the_east() {
        let wind = WindConfig::steady(10.0, 270.0).mean_ned_mps(10.0);
        assert!((wind - Vector3::new(0.0, 10.0, 0.0)).norm() < 1e-9, "{wind}");
    }

    /// Values worked by hand from the standard's formulas at 20 ft: ratio 0.19346.
    #[test]
    fn turbulence_at_20_ft_is_the_standards() {
        let turbulence = Turbulence::at(20.0 / FT_PER_M, 10.0);
        assert!((turbulence.sigma_mps.z - 1.0).abs() < 1e-9);
        assert!((turbulence.sigma_mps.x - 1.929).abs() < 2e-3, "{}", turbulence.sigma_mps.x);
        assert!((turbulence.length_m.x * FT_PER_M - 143.6).abs() < 0.5, "{}", turbulence.length_m.x * FT_PER_M);
    }

    #[test]
    fn gusts_have_the_models_standard_deviation_about_the_mean() {
        let config = WindConfig { speed_mps: 8.0, direction_from_deg: 0.0, gust_scale: 1.0 };
        let turbulence = Turbulence::at(5.0, config.mean_ned_mps(20.0 / FT_PER_M).norm());
        let mean_mps = config.mean_ned_mps(5.0);
        let mut wind = Wind::new(config, 11, "test");
        let steps = 1_000_000;
        let (mut sum, mut square) = (Vector3::zeros(), Vector3::zeros());
        for _ in 0..steps {
            let gust = wind.step(0.05, 5.0, 8.0) - mean_mps;
            sum += gust;
            square += gust.component_mul(&gust);
        }
        let count = f64::from(steps);
        for axis in 0..3 {
            let sigma_mps = (square[axis] / count).sqrt();
            assert!((sum[axis] / count).abs() < 0.05 * sigma_mps);
            assert!((sigma_mps / turbulence.sigma_mps[axis] - 1.0).abs() < 0.05, "axis {axis}: {sigma_mps} {turbulence:?}");
        }
    }
}
