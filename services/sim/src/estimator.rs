//! What the autopilot believes: the truth plus the errors that its filter would make.
//!
//! A strapdown filter with fixed gains is linear in its errors, so the errors are simulated themselves, by the filter's own error
//! equations: biased accelerations integrate into them, GNSS and barometer pull them towards their own errors. The estimate is
//! the truth plus these. Nothing that flies sees more than that.

use std::collections::VecDeque;

use nalgebra::{UnitQuaternion, Vector2, Vector3};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::copter::Motion;
use crate::gnss::{Gnss, GnssConfig, GnssFix};
use crate::noise::{GaussMarkov, generator, normal, normal3};

/// GNSS gains: position to position (1/s), position to velocity (1/s²), velocity to velocity (1/s).
const GNSS_GAINS: (f64, f64, f64) = (0.4, 0.08, 0.6);
/// Barometer gains: height to height (1/s), height to climb rate (1/s²).
const BARO_GAINS: (f64, f64) = (1.2, 0.4);
/// Barometer samples a second.
const BARO_RATE_HZ: f64 = 50.0;
/// White noise of one barometer sample, metres.
const BARO_WHITE_M: f64 = 0.05;
/// Without a fix for this long the horizontal position is no longer trusted, seconds.
const FIX_TIMEOUT_S: f64 = 3.0;
/// Gyroscope noise on each reported rate, radians per second.
const GYRO_WHITE_RADPS: f64 = 0.003;
/// Most fixes in flight between measurement and delivery: latency × rate, with room.
const FIXES_IN_FLIGHT_MAX: usize = 64;

/// The autopilot's sensors other than GNSS, and its filter (`[sim.estimator]`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct EstimatorConfig {
    /// Roll and pitch error, standard deviation, degrees, 0 to 10.
    pub attitude_sigma_deg: f64,
    /// Heading error, standard deviation, degrees, 0 to 30.
    pub heading_sigma_deg: f64,
    /// Correlation time of the attitude errors, seconds, 1 to 10 000.
    pub attitude_correlation_s: f64,
    /// Acceleration error that the filter has not learnt, standard deviation, metres per second squared, 0 to 1.
    pub accelerometer_sigma_mps2: f64,
    /// Wander of the barometric height, standard deviation, metres, 0 to 10.
    pub baro_sigma_m: f64,
    /// Correlation time of that wander, seconds, 1 to 10 000.
    pub baro_correlation_s: f64,
    /// From the first fix to a position that is good enough to arm, seconds, 0 to 600. A real vehicle needs about 40.
    pub convergence_s: f64,
}

impl Default for EstimatorConfig {
    fn default() -> Self {
        Self {
            attitude_sigma_deg: 0.2,
            heading_sigma_deg: 0.7,
            attitude_correlation_s: 60.0,
            accelerometer_sigma_mps2: 0.01,
            baro_sigma_m: 0.05,
            baro_correlation_s: 120.0,
            convergence_s: 8.0,
        }
    }
}

impl EstimatorConfig {
    /// Without any error, converged after half a second.
    #[must_use]
    pub fn perfect() -> Self {
        Self {
            attitude_sigma_deg: 0.0,
            heading_sigma_deg: 0.0,
            accelerometer_sigma_mps2: 0.0,
            baro_sigma_m: 0.0,
            convergence_s: 0.5,
            ..Self::default()
        }
    }

    /// Checks every number.
    ///
    /// # Errors
    /// One line that names the key and its range.
    pub fn validate(&self) -> Result<(), String> {
        use crate::config::range;
        range("estimator.attitude_sigma_deg", self.attitude_sigma_deg, 0.0, 10.0)?;
        range("estimator.heading_sigma_deg", self.heading_sigma_deg, 0.0, 30.0)?;
        range("estimator.attitude_correlation_s", self.attitude_correlation_s, 1.0, 10_000.0)?;
        range("estimator.accelerometer_sigma_mps2", self.accelerometer_sigma_mps2, 0.0, 1.0)?;
        range("estimator.baro_sigma_m", self.baro_sigma_m, 0.0, 10.0)?;
        range("estimator.baro_correlation_s", self.baro_correlation_s, 1.0, 10_000.0)?;
        range("estimator.convergence_s", self.convergence_s, 0.0, 600.0)
    }
}

/// The autopilot's belief.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Position in the fleet's local frame, metres.
    pub position_ned_m: Vector3<f64>,
    /// Velocity, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
    /// Attitude.
    pub ned_from_body: UnitQuaternion<f64>,
    /// Body rates (forward, right, down), radians per second.
    pub rate_body_radps: Vector3<f64>,
    /// Whether attitude and height can be trusted: from half a second after power-up.
    pub attitude_ok: bool,
    /// Whether the horizontal position can be trusted.
    pub position_ok: bool,
}

/// What the receiver last delivered.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GnssReading {
    /// Position in the fleet's local frame, metres.
    pub position_ned_m: Vector3<f64>,
    /// Velocity, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
}

/// A fix between measurement and delivery.
#[derive(Debug, Clone)]
struct InFlight {
    due_s: f64,
    fix: GnssFix,
    reading: GnssReading,
    /// The filter's errors when it was measured: corrections are made against the past, as a filter with a delayed horizon does.
    position_then_m: Vector2<f64>,
    velocity_then_mps: Vector2<f64>,
}

/// The sensors and the filter of one vehicle.
#[derive(Debug, Clone)]
pub struct Estimator {
    config: EstimatorConfig,
    random: ChaCha8Rng,
    gnss: Gnss,
    in_flight: VecDeque<InFlight>,
    attitude: GaussMarkov,
    acceleration: GaussMarkov,
    baro: GaussMarkov,
    position_error_m: Vector3<f64>,
    velocity_error_mps: Vector3<f64>,
    /// Time since power-up, seconds.
    time_s: f64,
    since_baro_s: f64,
    fix_at_s: Option<f64>,
    first_fix_s: Option<f64>,
    dead_reckoning: bool,
    reading: Option<GnssReading>,
}

impl Estimator {
    /// The sensors of `vehicle` under `seed`.
    #[must_use]
    pub fn new(config: EstimatorConfig, gnss: GnssConfig, seed: u64, vehicle: &str) -> Self {
        let mut random = generator(seed, vehicle, "estimator");
        Self {
            attitude: GaussMarkov::new(config.attitude_correlation_s, &mut random),
            acceleration: GaussMarkov::new(60.0, &mut random),
            baro: GaussMarkov::new(config.baro_correlation_s, &mut random),
            config,
            random,
            gnss: Gnss::new(gnss, seed, vehicle),
            in_flight: VecDeque::new(),
            position_error_m: Vector3::zeros(),
            velocity_error_mps: Vector3::zeros(),
            time_s: 0.0,
            since_baro_s: 0.0,
            fix_at_s: None,
            first_fix_s: None,
            dead_reckoning: true,
            reading: None,
        }
    }

    /// The receiver.
    #[must_use]
    pub fn gnss(&self) -> &Gnss {
        &self.gnss
    }

    /// The receiver, to take its sky away.
    pub fn gnss_mut(&mut self) -> &mut Gnss {
        &mut self.gnss
    }

    /// What the receiver last delivered; `None` before the first fix and while there is none.
    #[must_use]
    pub fn gnss_reading(&self) -> Option<GnssReading> {
        self.reading.filter(|_| self.gnss.has_fix())
    }

    /// Advances by `dt_s` to where the truth is `truth`, and returns the new belief.
    pub fn step(&mut self, dt_s: f64, truth: &Motion) -> Estimate {
        self.time_s += dt_s;
        self.inertial(dt_s);
        self.barometric(dt_s);
        if let Some(fix) = self.gnss.step(dt_s) {
            self.measured(fix, truth);
        }
        while self.in_flight.front().is_some_and(|first| first.due_s <= self.time_s) {
            if let Some(arrived) = self.in_flight.pop_front() {
                self.delivered(&arrived);
            }
        }
        self.estimate(truth)
    }

    fn inertial(&mut self, dt_s: f64) {
        self.attitude.step(dt_s, &mut self.random);
        let error_mps2 = self.acceleration.step(dt_s, &mut self.random) * self.config.accelerometer_sigma_mps2;
        self.velocity_error_mps += error_mps2 * dt_s;
        self.position_error_m += self.velocity_error_mps * dt_s;
    }

    fn barometric(&mut self, dt_s: f64) {
        self.since_baro_s += dt_s;
        let period_s = 1.0 / BARO_RATE_HZ;
        if self.since_baro_s + 5e-10 < period_s {
            return;
        }
        self.since_baro_s -= period_s;
        let sigma_m = self.config.baro_sigma_m;
        let white_m = if sigma_m > 0.0 { normal(&mut self.random) * BARO_WHITE_M } else { 0.0 };
        let measured_m = self.baro.step(period_s, &mut self.random).z * sigma_m + white_m;
        let innovation_m = measured_m - self.position_error_m.z;
        self.position_error_m.z += BARO_GAINS.0 * period_s * innovation_m;
        self.velocity_error_mps.z += BARO_GAINS.1 * period_s * innovation_m;
    }

    fn measured(&mut self, fix: GnssFix, truth: &Motion) {
        if self.in_flight.len() >= FIXES_IN_FLIGHT_MAX {
            return;
        }
        self.in_flight.push_back(InFlight {
            due_s: self.time_s + self.gnss.config().latency_s,
            fix,
            reading: GnssReading {
                position_ned_m: truth.position_ned_m + fix.position_error_ned_m,
                velocity_ned_mps: truth.velocity_ned_mps + fix.velocity_error_ned_mps,
            },
            position_then_m: self.position_error_m.xy(),
            velocity_then_mps: self.velocity_error_mps.xy(),
        });
    }

    fn delivered(&mut self, arrived: &InFlight) {
        self.fix_at_s = Some(self.time_s);
        self.first_fix_s.get_or_insert(self.time_s);
        self.reading = Some(arrived.reading);
        let (position_m, velocity_mps) = (arrived.fix.position_error_ned_m.xy(), arrived.fix.velocity_error_ned_mps.xy());
        if self.dead_reckoning {
            // A first fix, or one after a long outage: start over from it.
            self.dead_reckoning = false;
            self.position_error_m = position_m.push(self.position_error_m.z);
            self.velocity_error_mps = velocity_mps.push(self.velocity_error_mps.z);
            return;
        }
        let period_s = 1.0 / self.gnss.config().rate_hz;
        let position_innovation_m = position_m - arrived.position_then_m;
        let velocity_innovation_mps = velocity_mps - arrived.velocity_then_mps;
        let (position, position_to_velocity, velocity) = GNSS_GAINS;
        let position_change_m = position_innovation_m * (position * period_s).min(1.0);
        let velocity_change_mps = position_innovation_m * (position_to_velocity * period_s)
            + velocity_innovation_mps * (velocity * period_s).min(1.0);
        self.position_error_m += position_change_m.push(0.0);
        self.velocity_error_mps += velocity_change_mps.push(0.0);
    }

    fn estimate(&mut self, truth: &Motion) -> Estimate {
        let fix_is_fresh = self.fix_at_s.is_some_and(|at_s| self.time_s - at_s < FIX_TIMEOUT_S);
        if !fix_is_fresh {
            self.dead_reckoning = true;
        }
        let converged = self.first_fix_s.is_some_and(|at_s| self.time_s - at_s >= self.config.convergence_s);
        let tilt_rad = self.config.attitude_sigma_deg.to_radians();
        let heading_rad = self.config.heading_sigma_deg.to_radians();
        let rotation_rad = self.attitude.value().component_mul(&Vector3::new(tilt_rad, tilt_rad, heading_rad));
        let gyro = if tilt_rad > 0.0 { normal3(&mut self.random) * GYRO_WHITE_RADPS } else { Vector3::zeros() };
        Estimate {
            position_ned_m: truth.position_ned_m + self.position_error_m,
            velocity_ned_mps: truth.velocity_ned_mps + self.velocity_error_mps,
            ned_from_body: UnitQuaternion::from_scaled_axis(rotation_rad) * truth.ned_from_body,
            rate_body_radps: truth.rate_body_radps + gyro,
            attitude_ok: self.time_s >= 0.5,
            position_ok: fix_is_fresh && converged,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(config: EstimatorConfig, gnss: GnssConfig, seconds: usize, mut each: impl FnMut(f64, &Estimate)) -> Estimator {
        let mut estimator = Estimator::new(config, gnss, 9, "test");
        let truth = Motion::at_rest(Vector3::zeros(), 0.3);
        for step in 0..seconds * 100 {
            let estimate = estimator.step(0.01, &truth);
            each(step as f64 * 0.01, &estimate);
        }
        estimator
    }

    #[test]
    fn position_error_is_the_gnss_wander_and_height_error_the_barometers() {
        let gnss = GnssConfig { correlation_s: 20.0, ..GnssConfig::default() };
        let config = EstimatorConfig { baro_correlation_s: 20.0, ..EstimatorConfig::default() };
        let (mut north, mut down, mut tilt, mut count) = (0.0, 0.0, 0.0, 0.0);
        run(config, gnss, 20_000, |_, estimate| {
            let true_attitude = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.3);
            north += estimate.position_ned_m.x.powi(2);
            down += estimate.position_ned_m.z.powi(2);
            tilt += (estimate.ned_from_body * true_attitude.inverse()).scaled_axis().x.powi(2);
            count += 1.0;
        });
        let (north_m, down_m, tilt_deg): (f64, f64, f64) =
            ((north / count).sqrt(), (down / count).sqrt(), (tilt / count).sqrt().to_degrees());
        // The filter follows a wander that is slower than itself almost fully, and adds a little.
        assert!((0.34..0.46).contains(&north_m), "{north_m}");
        assert!((0.04..0.07).contains(&down_m), "{down_m}");
        assert!((tilt_deg - 0.2).abs() < 0.03, "{tilt_deg}");
    }

    #[test]
    fn position_is_trusted_after_convergence_and_no_longer_without_a_fix() {
        let mut ready_at_s = None;
        let mut estimator = run(EstimatorConfig::default(), GnssConfig::default(), 20, |at_s, estimate| {
            if estimate.position_ok && ready_at_s.is_none() {
                ready_at_s = Some(at_s);
            }
        });
        assert!(ready_at_s.is_some_and(|at_s| (8.0..9.0).contains(&at_s)), "{ready_at_s:?}");
        estimator.gnss_mut().set_lost(true);
        let truth = Motion::at_rest(Vector3::zeros(), 0.0);
        let lost_s = (0..1000).take_while(|_| estimator.step(0.01, &truth).position_ok).count() as f64 * 0.01;
        assert!((2.5..3.5).contains(&lost_s), "{lost_s}");
        assert!(estimator.gnss_reading().is_none());
        estimator.gnss_mut().set_lost(false);
        assert!((0..100).any(|_| estimator.step(0.01, &truth).position_ok));
    }

    #[test]
    fn a_perfect_estimator_tells_the_truth() {
        run(EstimatorConfig::perfect(), GnssConfig::perfect(), 10, |at_s, estimate| {
            assert!(estimate.position_ned_m.norm() < 1e-12 && estimate.velocity_ned_mps.norm() < 1e-12);
            assert!(estimate.position_ok || at_s < 1.0);
        });
    }
}
