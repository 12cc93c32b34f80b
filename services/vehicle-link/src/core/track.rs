//! What is heard of another vehicle, predicted to now.

use std::f64::consts::PI;

use halcyon_model::{FlightMode, Stamp, VehicleState};
use nalgebra::Vector3;

/// Time constant of the acceleration and yaw-rate filters, seconds: long enough to calm 10 Hz differences.
const FILTER_S: f64 = 0.3;
/// Differences are believed up to these; beyond them is a jump, not a motion.
const ACCELERATION_MPS2_MAX: f64 = 4.0;
const YAW_RATE_RADPS_MAX: f64 = 2.5;
/// Never predict further ahead than this, seconds.
const PREDICTION_S_MAX: f64 = 1.0;

/// Another vehicle's newest state, with what two of them tell: acceleration and yaw rate.
#[derive(Debug, Clone)]
pub struct Track {
    /// The newest state by its own stamp.
    pub state: VehicleState,
    /// When it was received.
    pub received: Stamp,
    acceleration_ned_mps2: Vector3<f64>,
    yaw_rate_radps: f64,
}

/// Where a vehicle is predicted to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Fleet-local position, metres.
    pub position_ned_m: Vector3<f64>,
    /// Velocity, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
    /// Heading, radians clockwise from north.
    pub heading_rad: f64,
    /// Rate of the heading, radians per second.
    pub yaw_rate_radps: f64,
}

impl Track {
    /// From a first state.
    #[must_use]
    pub fn new(state: VehicleState, now: Stamp) -> Self {
        Self { state, received: now, acceleration_ned_mps2: Vector3::zeros(), yaw_rate_radps: 0.0 }
    }

    /// Takes a newer state; one that isn't newer by its stamp changes nothing.
    pub fn observe(&mut self, state: VehicleState, now: Stamp) {
        let dt_s = state.stamp.seconds_since(self.state.stamp);
        if dt_s <= 0.0 {
            return;
        }
        if dt_s < PREDICTION_S_MAX {
            let gain = dt_s / (FILTER_S + dt_s);
            let acceleration = (state.velocity_ned_mps - self.state.velocity_ned_mps) / dt_s;
            let yaw_rate = wrap_rad(state.heading_rad - self.state.heading_rad) / dt_s;
            if acceleration.norm() <= ACCELERATION_MPS2_MAX {
                self.acceleration_ned_mps2 += gain * (acceleration - self.acceleration_ned_mps2);
            }
            if yaw_rate.abs() <= YAW_RATE_RADPS_MAX {
                self.yaw_rate_radps += gain * (yaw_rate - self.yaw_rate_radps);
            }
        } else {
            self.acceleration_ned_mps2 = Vector3::zeros();
            self.yaw_rate_radps = 0.0;
        }
        self.state = state;
        self.received = now;
    }

    /// How long it has been silent, seconds: by its own stamp and by receipt, whichever is longer, since a cache may deliver old
    /// news late and a wrong clock may date it ahead.
    #[must_use]
    pub fn silent_s(&self, now: Stamp) -> f64 {
        now.seconds_since(self.state.stamp).max(now.seconds_since(self.received)).max(0.0)
    }

    /// Predicted `ahead_s` after `now` with constant acceleration and yaw rate, at most one second from the stamp.
    #[must_use]
    pub fn predict(&self, now: Stamp, ahead_s: f64) -> Motion {
        let dt_s = (now.seconds_since(self.state.stamp) + ahead_s).clamp(0.0, PREDICTION_S_MAX);
        let velocity_ned_mps = self.state.velocity_ned_mps + self.acceleration_ned_mps2 * dt_s;
        Motion {
            position_ned_m: self.state.position_ned_m
                + self.state.velocity_ned_mps * dt_s
                + 0.5 * dt_s * dt_s * self.acceleration_ned_mps2,
            velocity_ned_mps,
            heading_rad: (self.state.heading_rad + self.yaw_rate_radps * dt_s).rem_euclid(2.0 * PI),
            yaw_rate_radps: self.yaw_rate_radps,
        }
    }

    /// Whether it stands with its motors off.
    #[must_use]
    pub fn parked(&self) -> bool {
        !self.state.armed
    }

    /// Its flight mode.
    #[must_use]
    pub fn mode(&self) -> FlightMode {
        self.state.mode
    }
}

/// Into (−π, π].
#[must_use]
pub fn wrap_rad(angle_rad: f64) -> f64 {
    let wrapped = angle_rad.rem_euclid(2.0 * PI);
    if wrapped > PI { wrapped - 2.0 * PI } else { wrapped }
}
