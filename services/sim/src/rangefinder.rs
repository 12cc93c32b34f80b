//! A laser that looks along the body's down axis at what really lies there: the water as it stands at the beam's foot, or the jetty.

use halcyon_model::Role;
use nalgebra::Vector3;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::copter::Motion;
use crate::noise::{generator, normal};

/// Tilted further than this it sees nothing of use: cosine of about 70°.
const COS_TILT_MIN: f64 = 0.34;
/// Steps towards the place where beam and surface meet, and how near is near enough, metres.
const STEPS_MAX: usize = 12;
const NEAR_M: f64 = 1e-3;
/// Beyond its range it says its greatest distance and this, metres, as such lasers do.
const BEYOND_M: f64 = 1.0;

/// The vehicles' rangefinder (`[sim.rangefinder]`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RangefinderConfig {
    /// Whether leaders carry one.
    pub leaders: bool,
    /// Whether followers carry one: they land.
    pub followers: bool,
    /// White noise of one measurement, standard deviation, metres, 0 to 1.
    pub sigma_m: f64,
    /// Measurements a second, 1 to 100.
    pub rate_hz: f64,
    /// Least distance, metres, 0 to 10.
    pub least_m: f64,
    /// Greatest distance, metres, 1 to 300. Small lasers see little of water further away.
    pub most_m: f64,
}

impl Default for RangefinderConfig {
    fn default() -> Self {
        Self { leaders: false, followers: true, sigma_m: 0.02, rate_hz: 20.0, least_m: 0.1, most_m: 12.0 }
    }
}

impl RangefinderConfig {
    /// Checks every number.
    ///
    /// # Errors
    /// One line that names the key and its range.
    pub fn validate(&self) -> Result<(), String> {
        use crate::config::range;
        range("rangefinder.sigma_m", self.sigma_m, 0.0, 1.0)?;
        range("rangefinder.rate_hz", self.rate_hz, 1.0, 100.0)?;
        range("rangefinder.least_m", self.least_m, 0.0, 10.0)?;
        range("rangefinder.most_m", self.most_m, 1.0, 300.0)
    }

    /// Whether a vehicle of this role carries one.
    #[must_use]
    pub fn is_fitted(&self, role: Role) -> bool {
        match role {
            Role::Leader => self.leaders,
            Role::Follower => self.followers,
        }
    }
}

/// One vehicle's rangefinder.
#[derive(Debug, Clone)]
pub struct Rangefinder {
    config: RangefinderConfig,
    random: ChaCha8Rng,
    since_s: f64,
    measured_m: Option<f64>,
}

impl Rangefinder {
    /// The rangefinder of `vehicle` under `seed`.
    #[must_use]
    pub fn new(config: RangefinderConfig, seed: u64, vehicle: &str) -> Self {
        let random = generator(seed, vehicle, "rangefinder");
        Self { config, random, since_s: f64::INFINITY, measured_m: None }
    }

    /// Its settings.
    #[must_use]
    pub fn config(&self) -> &RangefinderConfig {
        &self.config
    }

    /// What it last measured, metres along the beam; `None` before the first measurement.
    #[must_use]
    pub fn measured_m(&self) -> Option<f64> {
        self.measured_m
    }

    /// Advances by `dt_s` to where the truth is `truth`; `surface_m` is the height of what lies at a place, positive up.
    pub fn step(&mut self, dt_s: f64, truth: &Motion, surface_m: impl Fn(Vector3<f64>) -> f64) {
        self.since_s += dt_s;
        // Half a step early is nearer than half a step late.
        if self.since_s + 0.5 * dt_s < 1.0 / self.config.rate_hz {
            return;
        }
        self.since_s = 0.0;
        let noise_m = normal(&mut self.random) * self.config.sigma_m;
        let beyond_m = self.config.most_m + BEYOND_M;
        let seen_m = distance_m(truth, beyond_m, surface_m).map(|distance_m| (distance_m + noise_m).max(0.0));
        self.measured_m = Some(seen_m.filter(|seen_m| *seen_m <= self.config.most_m).unwrap_or(beyond_m));
    }
}

/// Distance along the body's down axis to the surface, metres; `None` beyond `most_m` or with too much tilt.
fn distance_m(truth: &Motion, most_m: f64, surface_m: impl Fn(Vector3<f64>) -> f64) -> Option<f64> {
    let beam = truth.ned_from_body * Vector3::z();
    // No wave is so high that a look at the surface is worth its cost from far above.
    if beam.z < COS_TILT_MIN || -truth.position_ned_m.z > 2.0 * most_m {
        return None;
    }
    // Water is flatter than the beam is steep, so that each step comes nearer.
    let mut distance_m = (-truth.position_ned_m.z / beam.z).max(0.0);
    for _ in 0..STEPS_MAX {
        let foot_m = truth.position_ned_m + beam * distance_m;
        let above_m = -foot_m.z - surface_m(foot_m);
        distance_m += above_m / beam.z;
        if above_m.abs() < NEAR_M {
            break;
        }
    }
    (distance_m <= most_m).then_some(distance_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    fn tilted(height_m: f64, roll_rad: f64) -> Motion {
        let level = Motion::at_rest(Vector3::new(3.0, -2.0, -height_m), 0.7);
        Motion { ned_from_body: UnitQuaternion::from_euler_angles(roll_rad, 0.0, 0.7), ..level }
    }

    #[test]
    fn over_a_mirror_it_is_height_over_the_tilts_cosine() {
        for (height_m, roll_rad) in [(5.0_f64, 0.0_f64), (5.0, 0.3), (0.4, -0.5), (0.0, 0.1)] {
            let found = distance_m(&tilted(height_m, roll_rad), 20.0, |_| 0.0);
            assert!(found.is_some_and(|found_m| (found_m - height_m / roll_rad.cos()).abs() < 1e-6), "{found:?}");
        }
        assert_eq!(distance_m(&tilted(15.0, 0.0), 10.0, |_| 0.0), None);
        assert_eq!(distance_m(&tilted(2.0, 1.4), 10.0, |_| 0.0), None);
    }

    #[test]
    fn over_a_slope_the_foot_lies_on_it() {
        // A plane that rises 0.2 m a metre to the east: the beam's foot in closed form.
        let motion = tilted(6.0, 0.25);
        let beam = motion.ned_from_body * Vector3::z();
        let start_m = motion.position_ned_m;
        let expected_m = (-start_m.z - 0.2 * start_m.y) / (beam.z + 0.2 * beam.y);
        let found_m = distance_m(&motion, 20.0, |place| 0.2 * place.y);
        assert!(found_m.is_some_and(|found_m| (found_m - expected_m).abs() < 1e-3), "{found_m:?} {expected_m}");
    }

    #[test]
    fn its_noise_is_as_said_and_its_range_ends() {
        let mut sensor = Rangefinder::new(RangefinderConfig { sigma_m: 0.05, ..RangefinderConfig::default() }, 3, "test");
        let (motion, mut sum, count) = (tilted(6.0, 0.0), 0.0, 4000);
        for _ in 0..count {
            sensor.step(0.05, &motion, |_| 0.0);
            sum += (sensor.measured_m().unwrap_or(f64::NAN) - 6.0).powi(2);
        }
        let sigma_m = (sum / f64::from(count)).sqrt();
        // Four standard errors of a standard deviation: σ / √(2 n).
        assert!((sigma_m - 0.05).abs() < 4.0 * 0.05 / (2.0 * f64::from(count)).sqrt(), "{sigma_m}");
        sensor.step(0.05, &tilted(14.0, 0.0), |_| 0.0);
        assert_eq!(sensor.measured_m(), Some(13.0));
    }
}
