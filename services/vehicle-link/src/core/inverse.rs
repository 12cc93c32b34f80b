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
    /// Position error to velocity, 1/s: ArduCopter's PSC_POSXY_P, PSC_NE_POS_P since 4.7.
    pub position_gain_hz: f64,
    /// Velocity error to acceleration, 1/s: ArduCopter's PSC_VELXY_P, PSC_NE_VEL_P since 4.7.
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

#[cfg(test)]
mod tests {
    use super::*;

    fn wanted(t_s: f64) -> Motion {
        // A circle of 8 m at 3 m/s, as its own derivatives.
        let (r, w) = (8.0, 3.0 / 8.0);
        let (sin, cos) = (w * t_s).sin_cos();
        Motion {
            position_ned_m: Vector3::new(r * cos, r * sin, -5.0),
            velocity_ned_mps: Vector3::new(-sin, cos, 0.0) * (r * w),
            acceleration_ned_mps2: Vector3::new(-cos, -sin, 0.0) * (r * w * w),
            jerk_ned_mps3: Vector3::new(sin, -cos, 0.0) * (r * w * w * w),
            heading_rad: 0.0,
            yaw_rate_radps: 0.0,
        }
    }

    /// The autopilot's cascade itself, integrated: how far the vehicle is from where it should be, metres RMS.
    fn flown_miss_m(loops: &Loops, believed: Option<&Loops>) -> f64 {
        let dt_s = 0.001;
        let start = wanted(0.0);
        let (mut p, mut v, mut a) = (start.position_ned_m, start.velocity_ned_mps, start.acceleration_ned_mps2);
        let mut inverse = Inverse::default();
        let (mut sum_m2, mut count) = (0.0, 0.0);
        for step in 0..40_000 {
            let at = wanted(f64::from(step) * dt_s);
            let asked = believed.map_or(at, |believed| inverse.step(&at, believed, dt_s));
            let velocity = asked.velocity_ned_mps + (asked.position_ned_m - p) * loops.position_gain_hz;
            let demand = asked.acceleration_ned_mps2 + (velocity - v) * loops.velocity_gain_hz;
            a += (demand - a) * (dt_s / loops.lean_lag_s);
            v += a * dt_s;
            p += v * dt_s;
            if step > 15_000 {
                sum_m2 += (p - wanted(f64::from(step + 1) * dt_s).position_ned_m).norm_squared();
                count += 1.0;
            }
        }
        f64::sqrt(sum_m2 / count)
    }

    #[test]
    fn the_lag_is_made_up_for_and_a_third_of_error_in_the_gains_costs_centimetres() {
        let loops = Loops::default();
        let plain_m = flown_miss_m(&loops, None);
        // |τ (iω)³ / (τ (iω)³ + (iω)² + K_v iω + K_v K_p)| r, by hand at ω = 0.375: 0.0137 / |1.859 + 0.736 i| · 8.
        assert!((plain_m - 0.0549).abs() < 0.001, "{plain_m}");
        assert!(flown_miss_m(&loops, Some(&loops)) < 0.004);
        for scale in [0.7, 1.3] {
            let other = Loops {
                position_gain_hz: scale * loops.position_gain_hz,
                velocity_gain_hz: scale * loops.velocity_gain_hz,
                lean_lag_s: loops.lean_lag_s / scale,
            };
            let (without_m, with_m) = (flown_miss_m(&other, None), flown_miss_m(&other, Some(&loops)));
            // Loops that are quicker than believed are over-corrected: 3 cm, where there were 2.5 cm to correct.
            assert!(with_m < without_m.max(0.035), "{scale}: {with_m} against {without_m}");
        }
    }

    #[test]
    fn a_steady_motion_is_asked_for_as_it_is_and_a_huge_jerk_stays_bounded() {
        let steady = Motion { jerk_ned_mps3: Vector3::zeros(), ..wanted(1.0) };
        assert_eq!(Inverse::default().step(&steady, &Loops::default(), 0.1), steady);
        let mut inverse = Inverse::default();
        for _ in 0..1000 {
            let wild = Motion { jerk_ned_mps3: Vector3::new(8.0, -8.0, 8.0), ..steady };
            let asked = inverse.step(&wild, &Loops::default(), 0.5);
            assert!((asked.position_ned_m - wild.position_ned_m).norm() <= CORRECTION_M_MAX + 1e-9);
        }
    }
}
