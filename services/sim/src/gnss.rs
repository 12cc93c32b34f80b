//! A GNSS receiver: slowly wandering position error, a rate, a latency, and the loss of its fix.

use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::noise::{GaussMarkov, generator, normal3};

/// A GNSS receiver (`[sim.gnss]`). The error of two vehicles on one lake is mostly common and cancels between them; what is
/// stated here is the part that does not.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GnssConfig {
    /// Standard deviation of the wandering position error on each horizontal axis, metres, 0 to 50.
    pub horizontal_sigma_m: f64,
    /// The same for height, metres, 0 to 100.
    pub vertical_sigma_m: f64,
    /// Correlation time of that error, seconds, 1 to 10 000.
    pub correlation_s: f64,
    /// White noise on each position, standard deviation, metres, 0 to 10.
    pub white_sigma_m: f64,
    /// White noise on each velocity, standard deviation, metres per second, 0 to 10.
    pub velocity_sigma_mps: f64,
    /// Fixes a second, 1 to 50.
    pub rate_hz: f64,
    /// From measurement to delivery, seconds, 0 to 1.
    pub latency_s: f64,
    /// Satellites in use while there is a fix, 4 to 40.
    pub satellites: u8,
}

impl Default for GnssConfig {
    /// A good single-frequency receiver under an open sky.
    fn default() -> Self {
        Self {
            horizontal_sigma_m: 0.4,
            vertical_sigma_m: 0.8,
            correlation_s: 120.0,
            white_sigma_m: 0.02,
            velocity_sigma_mps: 0.05,
            rate_hz: 5.0,
            latency_s: 0.12,
            satellites: 14,
        }
    }
}

impl GnssConfig {
    /// Without any error or latency.
    #[must_use]
    pub fn perfect() -> Self {
        Self {
            horizontal_sigma_m: 0.0,
            vertical_sigma_m: 0.0,
            white_sigma_m: 0.0,
            velocity_sigma_mps: 0.0,
            latency_s: 0.0,
            ..Self::default()
        }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// One line that names the key and its range.
    pub fn validate(&self) -> Result<(), String> {
        use crate::config::range;
        range("gnss.horizontal_sigma_m", self.horizontal_sigma_m, 0.0, 50.0)?;
        range("gnss.vertical_sigma_m", self.vertical_sigma_m, 0.0, 100.0)?;
        range("gnss.correlation_s", self.correlation_s, 1.0, 10_000.0)?;
        range("gnss.white_sigma_m", self.white_sigma_m, 0.0, 10.0)?;
        range("gnss.velocity_sigma_mps", self.velocity_sigma_mps, 0.0, 10.0)?;
        range("gnss.rate_hz", self.rate_hz, 1.0, 50.0)?;
        range("gnss.latency_s", self.latency_s, 0.0, 1.0)?;
        range("gnss.satellites", f64::from(self.satellites), 4.0, 40.0)
    }
}

/// One fix, as errors relative to the truth at the time of measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GnssFix {
    /// Position error, north, east, down, metres.
    pub position_error_ned_m: Vector3<f64>,
    /// Velocity error, metres per second.
    pub velocity_error_ned_mps: Vector3<f64>,
}

/// The receiver of one vehicle.
#[derive(Debug, Clone)]
pub struct Gnss {
    config: GnssConfig,
    random: ChaCha8Rng,
    wander: GaussMarkov,
    /// Time since the last fix, seconds.
    since_fix_s: f64,
    lost: bool,
}

impl Gnss {
    /// The receiver of `vehicle` under `seed`.
    #[must_use]
    pub fn new(config: GnssConfig, seed: u64, vehicle: &str) -> Self {
        let mut random = generator(seed, vehicle, "gnss");
        let wander = GaussMarkov::new(config.correlation_s, &mut random);
        Self { config, random, wander, since_fix_s: 0.0, lost: false }
    }

    /// Its configuration.
    #[must_use]
    pub fn config(&self) -> &GnssConfig {
        &self.config
    }

    /// Takes the sky away, or gives it back.
    pub fn set_lost(&mut self, lost: bool) {
        self.lost = lost;
    }

    /// Whether there is a fix.
    #[must_use]
    pub fn has_fix(&self) -> bool {
        !self.lost
    }

    /// Advances by `dt_s`; a fix when one is measured in this step. Without a sky the error wanders on, but nothing is measured.
    pub fn step(&mut self, dt_s: f64) -> Option<GnssFix> {
        self.since_fix_s += dt_s;
        let period_s = 1.0 / self.config.rate_hz;
        // Half a nanosecond of slack, so that rounding never costs a step.
        if self.since_fix_s + 5e-10 < period_s {
            return None;
        }
        self.since_fix_s -= period_s;
        let sigma_m =
            Vector3::new(self.config.horizontal_sigma_m, self.config.horizontal_sigma_m, self.config.vertical_sigma_m);
        let position_error_ned_m = self.wander.step(period_s, &mut self.random).component_mul(&sigma_m)
            + normal3(&mut self.random) * self.config.white_sigma_m;
        let velocity_error_ned_mps = normal3(&mut self.random) * self.config.velocity_sigma_mps;
        (!self.lost).then_some(GnssFix { position_error_ned_m, velocity_error_ned_mps })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The configured standard deviation and correlation come back out of a long record.
    #[test]
    fn error_has_the_configured_sigma_and_correlation() {
        let config = GnssConfig { correlation_s: 10.0, white_sigma_m: 0.0, ..GnssConfig::default() };
        let mut gnss = Gnss::new(config.clone(), 5, "test");
        let east: Vec<f64> = (0..1_000_000).filter_map(|_| gnss.step(0.1)).map(|fix| fix.position_error_ned_m.y).collect();
        // 5 Hz, stepped at 10 Hz: every other step.
        assert_eq!(east.len(), 500_000);
        let at = |lag: usize| east.iter().zip(&east[lag..]).map(|(a, b)| a * b).sum::<f64>() / (east.len() - lag) as f64;
        // 100 000 s over 10 s of correlation: about 1.4 % standard error of the variance.
        let sigma_m = at(0).sqrt();
        assert!((sigma_m / config.horizontal_sigma_m - 1.0).abs() < 0.04, "{sigma_m}");
        let one_time_constant = at(50) / at(0);
        assert!((one_time_constant - (-1.0_f64).exp()).abs() < 0.04, "{one_time_constant}");
    }

    #[test]
    fn a_lost_sky_gives_no_fix_and_a_regained_one_does() {
        let mut gnss = Gnss::new(GnssConfig::default(), 5, "test");
        gnss.set_lost(true);
        assert!((0..100).all(|_| gnss.step(0.1).is_none()) && !gnss.has_fix());
        gnss.set_lost(false);
        assert!((0..3).any(|_| gnss.step(0.1).is_some()));
    }
}
