//! What is heard of another vehicle, predicted to now.

use std::f64::consts::PI;

use halcyon_model::{FlightMode, Stamp, VehicleState};
use nalgebra::Vector3;

use super::continuity::Continuity;
use super::intent;
use super::observer::{LEAN_S, Observer};

/// Time constant of the acceleration and yaw-rate filters, seconds: long enough to calm 10 Hz differences.
const FILTER_S: f64 = 0.3;
/// Differences are believed up to these; beyond them is a jump, not a motion.
const ACCELERATION_MPS2_MAX: f64 = 4.0;
const YAW_RATE_RADPS_MAX: f64 = 2.5;
/// Never predict further ahead than this, seconds.
const PREDICTION_S_MAX: f64 = 1.0;
/// A stamp this far ahead of the present is an error of its clock, and does not keep newer states out, seconds.
const AHEAD_S_MAX: f64 = 2.0;

/// Nothing that flies is further from the fleet's origin, metres, or faster, metres per second.
const PLACE_M_MAX: f64 = 1e5;
const SPEED_MPS_MAX: f64 = 100.0;

/// Another vehicle's newest state, with what several of them tell: acceleration and yaw rate.
#[derive(Debug, Clone)]
pub struct Track {
    /// The newest state by its own stamp.
    pub state: VehicleState,
    /// When it was received.
    pub received: Stamp,
    /// When the vehicle last said anything, the same again included.
    heard: Stamp,
    observer: Observer,
    continuity: Continuity,
    /// By filtered differences: what the plain law goes by.
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
    /// Acceleration, metres per second squared.
    pub acceleration_ned_mps2: Vector3<f64>,
    /// Jerk, metres per second cubed.
    pub jerk_ned_mps3: Vector3<f64>,
    /// Heading, radians clockwise from north.
    pub heading_rad: f64,
    /// Rate of the heading, radians per second.
    pub yaw_rate_radps: f64,
}

impl Track {
    /// From a first state.
    #[must_use]
    pub fn new(state: VehicleState, now: Stamp) -> Self {
        let observer = Observer::new(&state);
        let mut continuity = Continuity::default();
        continuity.observe(state.stamp, state.position_ned_m, state.velocity_ned_mps);
        let none = Vector3::zeros();
        Self { state, received: now, heard: now, observer, continuity, acceleration_ned_mps2: none, yaw_rate_radps: 0.0 }
    }

    /// Whether a state can be that of a vehicle at all: what isn't is not taken, so that it never reaches a setpoint.
    #[must_use]
    pub fn believable(state: &VehicleState) -> bool {
        // NaN is never within.
        state.position_ned_m.norm() <= PLACE_M_MAX
            && state.velocity_ned_mps.norm() <= SPEED_MPS_MAX
            && state.heading_rad.is_finite()
            && (state.ned_from_body.norm() - 1.0).abs() < 1e-3
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
        self.continuity.observe(state.stamp, state.position_ned_m, state.velocity_ned_mps);
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
            self.observer.observe(&state, dt_s);
        } else {
            self.observer = Observer::new(&state);
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

    /// What is taken out of the place that it says, metres.
    #[must_use]
    pub fn leap_ned_m(&self) -> Vector3<f64> {
        self.continuity.shift_ned_m()
    }

    /// Where it was at its stamp, metres; without leaps of its receiver.
    #[must_use]
    pub fn place_ned_m(&self) -> Vector3<f64> {
        self.state.position_ned_m - self.continuity.shift_ned_m()
    }

    /// Predicted `ahead_s` after `now`, at most one second from the stamp. Where it has said where it means to be, it goes there as
    /// its autopilot would; else its acceleration goes on and its jerk dies away as a lean settles. Its turn goes on.
    #[must_use]
    pub fn predict(&self, now: Stamp, ahead_s: f64) -> Motion {
        let age_s = self.age_s(now, ahead_s);
        let (acceleration, jerk) = (self.observer.acceleration_ned_mps2(), self.observer.jerk_ned_mps3());
        let carried_on = |dt_s: f64| self.carried_on(dt_s, acceleration, jerk, self.observer.yaw_rate_radps());
        match intent::plausible(&self.state) {
            Some(intent) => intent::carried_on(&self.state, &carried_on(0.0), intent, age_s),
            None => carried_on(age_s),
        }
    }

    /// The same with the acceleration and the yaw rate that filtered differences give, for the plain law.
    #[must_use]
    pub fn predict_by_differences(&self, now: Stamp, ahead_s: f64) -> Motion {
        self.carried_on(self.age_s(now, ahead_s), self.acceleration_ned_mps2, Vector3::zeros(), self.yaw_rate_radps)
    }

    /// As it was at its stamp, for laws that don't predict.
    #[must_use]
    pub fn as_heard(&self) -> Motion {
        self.carried_on(0.0, self.acceleration_ned_mps2, Vector3::zeros(), self.yaw_rate_radps)
    }

    fn age_s(&self, now: Stamp, ahead_s: f64) -> f64 {
        (now.seconds_since(self.state.stamp) + ahead_s).clamp(0.0, PREDICTION_S_MAX)
    }

    fn carried_on(&self, dt_s: f64, acceleration: Vector3<f64>, jerk: Vector3<f64>, yaw_rate_radps: f64) -> Motion {
        let left = (-dt_s / LEAN_S).exp();
        // Integrals of e^(−t/T): once, twice, three times.
        let once_s = LEAN_S * (1.0 - left);
        let twice_s2 = LEAN_S * (dt_s - once_s);
        let thrice_s3 = LEAN_S * (0.5 * dt_s * dt_s - twice_s2);
        let state = &self.state;
        Motion {
            position_ned_m: self.place_ned_m()
                + state.velocity_ned_mps * dt_s
                + acceleration * (0.5 * dt_s * dt_s)
                + jerk * thrice_s3,
            velocity_ned_mps: state.velocity_ned_mps + acceleration * dt_s + jerk * twice_s2,
            acceleration_ned_mps2: acceleration + jerk * once_s,
            jerk_ned_mps3: jerk * left,
            heading_rad: (state.heading_rad + yaw_rate_radps * dt_s).rem_euclid(2.0 * PI),
            yaw_rate_radps,
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
pub(super) mod tests {
    use halcyon_model::{Activity, Geodetic, LandedState, Role, VehicleId};
    use nalgebra::UnitQuaternion;

    use super::*;

    pub(in crate::core) fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
    }

    pub(in crate::core) fn state(stamp: Stamp, north_m: f64) -> VehicleState {
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
            acceleration_ned_mps2: None,
            intent: None,
            range: None,
            ages: halcyon_model::Ages::default(),
            link: None,
            firmware: None,
            has_payload: false,
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

    /// The prediction is the solution of its own differential equation: each derivative is that of the one before it, and the jerk
    /// dies away with the lean's time constant.
    #[test]
    fn a_prediction_is_consistent() {
        let mut track = Track::new(state(t(0.0), 0.0), t(0.0));
        for step in 1..=5u32 {
            let time_s = 0.1 * f64::from(step);
            let leaning = VehicleState {
                velocity_ned_mps: Vector3::new(2.0 * time_s * time_s, 0.3 * time_s, 0.0),
                ned_from_body: UnitQuaternion::from_euler_angles(0.1 * time_s, -0.4 * time_s, 0.0),
                ..state(t(time_s), 0.5 * time_s)
            };
            track.observe(leaning, t(time_s));
        }
        let h = 1e-4;
        for ahead_s in [0.1, 0.3, 0.6] {
            let at = |shift_s: f64| track.predict(t(0.5), ahead_s + shift_s);
            let (before, here, after) = (at(-h), at(0.0), at(h));
            let slope = |a: Vector3<f64>, b: Vector3<f64>| (b - a) / (2.0 * h);
            assert!((slope(before.position_ned_m, after.position_ned_m) - here.velocity_ned_mps).norm() < 1e-5);
            assert!((slope(before.velocity_ned_mps, after.velocity_ned_mps) - here.acceleration_ned_mps2).norm() < 1e-5);
            assert!((slope(before.acceleration_ned_mps2, after.acceleration_ned_mps2) - here.jerk_ned_mps3).norm() < 1e-5);
            assert!((slope(before.jerk_ned_mps3, after.jerk_ned_mps3) + here.jerk_ned_mps3 / LEAN_S).norm() < 1e-3);
        }
    }
}
