//! The follower's own lag, made up for: what to ask of the autopilot so that the vehicle, not the target, is where it should be.
//!
//! An autopilot tracks a target by a cascade: position error to velocity (K_p), velocity error to acceleration (K_v), acceleration
//! by leaning, which takes the attitude loop τ. A consistent target p, p', p'' is reached but for that lag: the vehicle's position y
//! follows τ y''' + y'' + K_v y' + K_v K_p y = p'' + K_v p' + K_v K_p p. For y to be the wanted s, the target must be s + c with
//!
//!   c'' + K_v c' + K_v K_p c = τ s'''
//!
//! a small correction that lives only while the acceleration changes. Its three derivatives go along with the target's, so that
//! the target stays consistent and the autopilot's own shaping has nothing to smooth.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::track::Motion;

/// What is believed of the follower's autopilot (`[vehicle_link.guidance.loops]`). Being wrong by a third costs centimetres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Loops {
    /// Position error to velocity, 1/s: ArduCopter's PSC_POSXY_P.
    pub position_gain_hz: f64,
    /// Velocity error to acceleration, 1/s: ArduCopter's PSC_VELXY_P.
    pub velocity_gain_hz: f64,
    /// From a demanded acceleration to the real one, seconds: 1 / ATC_ANG_RLL_P, and the rate loop's and the motors' own lag.
    pub lean_lag_s: f64,
}

impl Default for Loops {
    fn default() -> Self {
        Self { position_gain_hz: 1.0, velocity_gain_hz: 2.0, lean_lag_s: 0.26 }
    }
}

impl Loops {
    /// Checks every number.
    ///
    /// # Errors
    /// One line that names the key and its range.
    pub fn validate(&self) -> Result<(), String> {
        let keys = [
            ("position_gain_hz", self.position_gain_hz, 0.1, 5.0),
            ("velocity_gain_hz", self.velocity_gain_hz, 0.1, 10.0),
            ("lean_lag_s", self.lean_lag_s, 0.0, 1.0),
        ];
        match keys.iter().find(|(_, value, least, most)| !(least..=most).contains(&value)) {
            Some((key, value, least, most)) => Err(format!("guidance.loops.{key} must be in {least} to {most}, not {value}")),
            None => Ok(()),
        }
    }
}

/// The correction's largest size, metres: a corner needs a tenth of this.
const CORRECTION_M_MAX: f64 = 1.0;
/// The correction is integrated in steps no longer than this, seconds.
const STEP_S_MAX: f64 = 0.02;

/// The correction in motion.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Inverse {
    position_ned_m: Vector3<f64>,
    velocity_ned_mps: Vector3<f64>,
}

impl Inverse {
    /// What to ask for at this moment, so that `wanted` comes about; `dt_s` after the last time.
    pub fn step(&mut self, wanted: &Motion, loops: &Loops, dt_s: f64) -> Motion {
        let push_mps2 = wanted.jerk_ned_mps3 * loops.lean_lag_s;
        let (velocity_hz, position_hz2) = (loops.velocity_gain_hz, loops.velocity_gain_hz * loops.position_gain_hz);
        let pull = |this: &Self| push_mps2 - this.velocity_ned_mps * velocity_hz - this.position_ned_m * position_hz2;
        let steps = (dt_s / STEP_S_MAX).ceil().clamp(1.0, 100.0);
        for _ in 0..steps as usize {
            self.velocity_ned_mps += pull(self) * (dt_s / steps);
            self.position_ned_m += self.velocity_ned_mps * (dt_s / steps);
        }
        self.position_ned_m = self.position_ned_m.cap_magnitude(CORRECTION_M_MAX);
        Motion {
            position_ned_m: wanted.position_ned_m + self.position_ned_m,
            velocity_ned_mps: wanted.velocity_ned_mps + self.velocity_ned_mps,
            acceleration_ned_mps2: wanted.acceleration_ned_mps2 + pull(self),
            ..*wanted
        }
    }
}
