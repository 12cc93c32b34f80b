//! The motion of another vehicle, observed through its states: acceleration, jerk and yaw rate, smooth and bounded.
//!
//! A multicopter accelerates where it leans, and it leans before its velocity changes. So the lean that the state carries gives
//! the acceleration without a difference, `g tan(lean)`, but for the drag and the level error, which an observer of the velocity
//! learns; and the change of lean gives the jerk, which tells a follower of a corner a few tenths of a second before differences of
//! velocity would.
//!
//! Per axis, with u the lean's acceleration and b what it misses: v' = u + b, b' = 0, corrected by the measured velocity with the
//! gains of a critically damped α-β filter. The yaw rate comes from the same filter over the heading.

use halcyon_model::VehicleState;
use nalgebra::Vector3;

use super::track::wrap_rad;

/// Standard gravity, metres per second squared.
const GRAVITY_MPS2: f64 = 9.806_65;
/// Memory of the velocity observer, seconds: drag changes within about a second of a corner.
const VELOCITY_S: f64 = 0.35;
/// Memory of the heading observer, seconds.
const HEADING_S: f64 = 0.15;
/// Low pass of the jerk, seconds: one state's interval.
const JERK_S: f64 = 0.06;
/// A lean goes on changing for about so long, seconds: the time constant of an attitude loop (ATC_ANG_RLL_P 4.5).
pub const LEAN_S: f64 = 0.22;
/// Bounds: what a vehicle that carries others beside it does; more is noise or a jump.
const ACCELERATION_MPS2_MAX: f64 = 5.0;
const JERK_MPS3_MAX: f64 = 8.0;
const YAW_RATE_RADPS_MAX: f64 = 2.5;

/// The observer of one vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer {
    velocity_ned_mps: Vector3<f64>,
    /// Acceleration by the lean, north and east; 0 down.
    lean_ned_mps2: Vector3<f64>,
    /// What the lean misses.
    missed_ned_mps2: Vector3<f64>,
    jerk_ned_mps3: Vector3<f64>,
    heading_rad: f64,
    yaw_rate_radps: f64,
}

impl Observer {
    /// From a first state, taken as unaccelerated: whatever it leans, it leans against the wind.
    #[must_use]
    pub fn new(state: &VehicleState) -> Self {
        let lean_ned_mps2 = lean_mps2(state);
        Self {
            velocity_ned_mps: state.velocity_ned_mps,
            lean_ned_mps2,
            missed_ned_mps2: -lean_ned_mps2,
            jerk_ned_mps3: Vector3::zeros(),
            heading_rad: state.heading_rad,
            yaw_rate_radps: 0.0,
        }
    }

    /// Takes the state `dt_s` after the last one; `dt_s` is above 0.
    pub fn observe(&mut self, state: &VehicleState, dt_s: f64) {
        let lean_ned_mps2 = lean_mps2(state);
        let change_mps3 = (lean_ned_mps2 - self.lean_ned_mps2) / dt_s;
        let keep = (-dt_s / JERK_S).exp();
        self.jerk_ned_mps3 = (self.jerk_ned_mps3 * keep + change_mps3 * (1.0 - keep)).cap_magnitude(JERK_MPS3_MAX);

        let (alpha, beta) = gains(dt_s, VELOCITY_S);
        let mean_mps2 = 0.5 * (self.lean_ned_mps2 + lean_ned_mps2) + self.missed_ned_mps2;
        let predicted_mps = self.velocity_ned_mps + mean_mps2 * dt_s;
        let surprise_mps = state.velocity_ned_mps - predicted_mps;
        self.velocity_ned_mps = predicted_mps + alpha * surprise_mps;
        self.missed_ned_mps2 = (self.missed_ned_mps2 + surprise_mps * (beta / dt_s)).cap_magnitude(2.0 * ACCELERATION_MPS2_MAX);
        self.lean_ned_mps2 = lean_ned_mps2;

        let (alpha, beta) = gains(dt_s, HEADING_S);
        let predicted_rad = self.heading_rad + self.yaw_rate_radps * dt_s;
        let surprise_rad = wrap_rad(state.heading_rad - predicted_rad);
        self.heading_rad = wrap_rad(predicted_rad + alpha * surprise_rad);
        let yaw_rate_radps = self.yaw_rate_radps + surprise_rad * (beta / dt_s);
        self.yaw_rate_radps = yaw_rate_radps.clamp(-YAW_RATE_RADPS_MAX, YAW_RATE_RADPS_MAX);
    }

    /// Acceleration at the last state, metres per second squared.
    #[must_use]
    pub fn acceleration_ned_mps2(&self) -> Vector3<f64> {
        (self.lean_ned_mps2 + self.missed_ned_mps2).cap_magnitude(ACCELERATION_MPS2_MAX)
    }

    /// Jerk at the last state, metres per second cubed. It dies away with [`LEAN_S`].
    #[must_use]
    pub fn jerk_ned_mps3(&self) -> Vector3<f64> {
        self.jerk_ned_mps3
    }

    /// Yaw rate at the last state, radians per second.
    #[must_use]
    pub fn yaw_rate_radps(&self) -> f64 {
        self.yaw_rate_radps
    }
}

/// Gains of the critically damped α-β filter with a memory of `memory_s`, at this interval.
fn gains(dt_s: f64, memory_s: f64) -> (f64, f64) {
    let keep = (-dt_s / memory_s).exp();
    (1.0 - keep * keep, (1.0 - keep) * (1.0 - keep))
}

/// Horizontal acceleration of a vehicle that carries its weight along its own axis with this attitude, metres per second squared.
fn lean_mps2(state: &VehicleState) -> Vector3<f64> {
    let up = state.ned_from_body * Vector3::new(0.0, 0.0, -1.0);
    // Beyond 60° nothing here is flying as usual.
    Vector3::new(up.x, up.y, 0.0) * (GRAVITY_MPS2 / (-up.z).max(0.5))
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::core::track::tests::{state, t};

    /// A level circle of `r_m` at `speed_mps`, leaning as it must, with a constant push of the wind that the lean makes up for.
    fn circling(time_s: f64, r_m: f64, speed_mps: f64, wind_mps2: f64) -> VehicleState {
        let rate = speed_mps / r_m;
        let (sin, cos) = (rate * time_s).sin_cos();
        let acceleration = Vector3::new(-cos, -sin, 0.0) * (speed_mps * rate);
        let lean = acceleration - Vector3::new(wind_mps2, 0.0, 0.0);
        let up = (lean + Vector3::new(0.0, 0.0, -GRAVITY_MPS2)).normalize();
        let ned_from_body = UnitQuaternion::rotation_between(&Vector3::new(0.0, 0.0, -1.0), &up).unwrap();
        VehicleState {
            position_ned_m: Vector3::new(r_m * cos, r_m * sin, -5.0),
            velocity_ned_mps: Vector3::new(-sin, cos, 0.0) * speed_mps,
            ned_from_body,
            heading_rad: (rate * time_s).rem_euclid(std::f64::consts::TAU),
            ..state(t(time_s), 0.0)
        }
    }

    /// v²/r inwards, v³/r² backwards, v/r round, whatever the wind.
    #[test]
    fn on_a_circle_the_acceleration_is_v_squared_over_r() {
        let (r_m, speed_mps) = (8.0, 3.0);
        for wind_mps2 in [0.0, 0.6] {
            let mut observer = Observer::new(&circling(0.0, r_m, speed_mps, wind_mps2));
            for step in 1..=100u32 {
                let time_s = 0.1 * f64::from(step);
                observer.observe(&circling(time_s, r_m, speed_mps, wind_mps2), 0.1);
                if step < 40 {
                    continue;
                }
                let (sin, cos) = (speed_mps / r_m * time_s).sin_cos();
                let acceleration = Vector3::new(-cos, -sin, 0.0) * (speed_mps * speed_mps / r_m);
                let jerk = Vector3::new(sin, -cos, 0.0) * (speed_mps.powi(3) / (r_m * r_m));
                assert!(
                    (observer.acceleration_ned_mps2() - acceleration).norm() < 0.02,
                    "{}",
                    observer.acceleration_ned_mps2()
                );
                assert!((observer.jerk_ned_mps3() - jerk).norm() < 0.05, "{}", observer.jerk_ned_mps3());
                assert!((observer.yaw_rate_radps() - speed_mps / r_m).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn a_jump_stays_within_bounds() {
        let mut observer = Observer::new(&state(t(0.0), 0.0));
        let jumped = VehicleState {
            velocity_ned_mps: Vector3::new(90.0, -90.0, 0.0),
            ned_from_body: UnitQuaternion::from_euler_angles(1.5, 1.5, 0.0),
            heading_rad: 3.0,
            ..state(t(0.01), 0.0)
        };
        observer.observe(&jumped, 0.01);
        assert!(observer.acceleration_ned_mps2().norm() <= ACCELERATION_MPS2_MAX + 1e-9);
        assert!(observer.jerk_ned_mps3().norm() <= JERK_MPS3_MAX + 1e-9);
        assert!(observer.yaw_rate_radps().abs() <= YAW_RATE_RADPS_MAX);
    }
}
