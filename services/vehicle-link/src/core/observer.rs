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
