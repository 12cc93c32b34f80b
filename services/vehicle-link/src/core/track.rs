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
/// A stamp this far ahead of the present is an error of its clock, and does not keep newer states out, seconds.
const AHEAD_S_MAX: f64 = 2.0;

/// Another vehicle's newest state, with what two of them tell: acceleration and yaw rate.
#[derive(Debug, Clone)]
pub struct Track {
    /// The newest state by its own stamp.
    pub state: VehicleState,
    /// When it was received.
    pub received: Stamp,
    /// When the vehicle last said anything, the same again included.
    heard: Stamp,
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
        Self { state, received: now, heard: now, acceleration_ned_mps2: Vector3::zeros(), yaw_rate_radps: 0.0 }
    }

    /// Takes a newer state. An older one by its stamp changes nothing; the same again, from a vehicle that no longer hears its
    /// autopilot, tells that it is still there.
    pub fn observe(&mut self, state: VehicleState, now: Stamp) {
        let dt_s = state.stamp.seconds_since(self.state.stamp);
        let misdated = self.state.stamp.seconds_since(now) > AHEAD_S_MAX;
        if dt_s < 0.0 && !misdated {
            return;
        }
        self.heard = now;
        if dt_s == 0.0 {
            return;
        }
        if (0.0..PREDICTION_S_MAX).contains(&dt_s) {
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

    /// How long ago it last said anything, even if nothing new, seconds.
    #[must_use]
    pub fn unheard_s(&self, now: Stamp) -> f64 {
        now.seconds_since(self.heard)
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

#[cfg(test)]
mod tests {
    use halcyon_model::{Activity, Geodetic, LandedState, Role, VehicleId};
    use nalgebra::UnitQuaternion;

    use super::*;

    fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
    }

    fn state(stamp: Stamp, north_m: f64) -> VehicleState {
        VehicleState {
            stamp,
            vehicle: VehicleId::new("other").unwrap(),
            role: Role::Leader,
            position: Geodetic::from_deg(53.1, -2.9, 0.0),
            position_ned_m: Vector3::new(north_m, 0.0, -5.0),
            velocity_ned_mps: Vector3::zeros(),
            ned_from_body: UnitQuaternion::identity(),
            heading_rad: 0.0,
            home: None,
            mode: FlightMode::Guided,
            armed: true,
            landed: LandedState::InAir,
            battery_fraction: None,
            battery_v: None,
            fix: None,
            estimator_ok: true,
            ready_to_arm: true,
            boot_s: 100.0,
            activity: Activity::Holding { settled: true },
            plan_generation: 0,
            touchdown: None,
        }
    }

    /// Its link says the last state again once a second; the autopilot hovers on.
    #[test]
    fn one_that_lost_its_autopilot_is_silent_to_follow_but_stays_an_obstacle() {
        let mut track = Track::new(state(t(0.0), 3.0), t(0.0));
        for second in 1..=120 {
            track.observe(state(t(0.0), 3.0), t(f64::from(second)));
        }
        let limits = crate::core::limits::Limits::default();
        assert!(track.silent_s(t(120.0)) > 119.0);
        assert!(crate::core::separation::obstacle(&track, false, &limits, t(120.0)).is_some(), "it still hovers there");
        assert!(crate::core::separation::obstacle(&track, false, &limits, t(151.0)).is_none(), "it is gone");
    }

    #[test]
    fn a_clock_that_was_ahead_and_is_set_right_does_not_make_a_vehicle_unheard() {
        let mut track = Track::new(state(t(600.0), 3.0), t(0.0));
        track.observe(state(t(1.0), 4.0), t(1.0));
        track.observe(state(t(1.1), 4.1), t(1.1));
        assert!(track.state.position_ned_m.x == 4.1 && track.silent_s(t(1.1)) < 1e-6);
        assert!(track.predict(t(1.1), 0.0).position_ned_m.x.is_finite());
        // An ordinary late one is still no news.
        track.observe(state(t(1.0), 9.0), t(1.2));
        assert_eq!(track.state.position_ned_m.x, 4.1);
    }
}
