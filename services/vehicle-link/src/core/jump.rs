//! Tells a position that jumped from one that moved: the way between two states must be what their velocities make of it.
//!
//! A jump is a receiver's, or the estimator starting afresh; the vehicle itself is where it was. What is left over between two
//! states is summed up and forgotten within [`LEAK_S`], so that a jump spread over several states is one too, while the slow
//! wander of a receiver is none.

use halcyon_model::{Stamp, VehicleState};
use nalgebra::Vector3;

/// The receiver's stated accuracy excuses so much at most, metres.
const SIGMA_M_MAX: f64 = 3.0;
/// Between two states the velocity may have done what it liked within this, metres per second squared.
const ACCELERATION_MPS2: f64 = 4.0;
/// What is left over is forgotten with this time constant, seconds.
const LEAK_S: f64 = 2.0;
/// Over a longer silence nothing can be said, seconds.
const GAP_S_MAX: f64 = 2.0;

#[derive(Debug, Clone, Copy)]
struct Seen {
    stamp: Stamp,
    boot_s: f64,
    position_ned_m: Vector3<f64>,
    velocity_ned_mps: Vector3<f64>,
}

/// Watches one vehicle's position.
#[derive(Debug, Clone, Default)]
pub struct JumpWatch {
    last: Option<Seen>,
    left_over_m: Vector3<f64>,
}

impl JumpWatch {
    /// Takes the next state. Returns by how much the position jumped, if by more than `jump_m` beyond what the vehicle's motion and
    /// its receiver's stated accuracy allow.
    pub fn observe(&mut self, state: &VehicleState, jump_m: f64) -> Option<Vector3<f64>> {
        let seen = Seen {
            stamp: state.stamp,
            boot_s: state.boot_s,
            position_ned_m: state.position_ned_m,
            velocity_ned_mps: state.velocity_ned_mps,
        };
        let Some(last) = self.last else {
            self.last = Some(seen);
            return None;
        };
        let dt_s = seen.stamp.seconds_since(last.stamp);
        if dt_s == 0.0 {
            return None;
        }
        self.last = Some(seen);
        if !(0.0..=GAP_S_MAX).contains(&dt_s) {
            self.left_over_m = Vector3::zeros();
            return None;
        }
        let moved_m = seen.position_ned_m - last.position_ned_m;
        let mean_mps = 0.5 * (seen.velocity_ned_mps + last.velocity_ned_mps);
        let left_over = |dt_s: f64| moved_m - mean_mps * dt_s;
        // The stamp or the autopilot's own clock, whichever explains more: a stamp that was corrected is no jump.
        let boot_dt_s = seen.boot_s - last.boot_s;
        let by_stamp_m = left_over(dt_s);
        let by_boot_m = if (0.0..=GAP_S_MAX).contains(&boot_dt_s) { left_over(boot_dt_s) } else { by_stamp_m };
        let step_m = if by_boot_m.norm() < by_stamp_m.norm() { by_boot_m } else { by_stamp_m };
        self.left_over_m = self.left_over_m * (-dt_s / LEAK_S).exp() + step_m;
        let sigma_m = state.fix.and_then(|fix| fix.horizontal_sigma_m).filter(|sigma_m| sigma_m.is_finite()).unwrap_or(0.0);
        let allowed_m = jump_m + sigma_m.clamp(0.0, SIGMA_M_MAX) + 0.5 * ACCELERATION_MPS2 * dt_s * dt_s;
        (self.left_over_m.norm() > allowed_m).then(|| std::mem::take(&mut self.left_over_m))
    }

    /// Our clock went back: what was seen is dated back with it.
    pub fn clock_went_back(&mut self, by_s: f64) {
        if let Some(last) = &mut self.last {
            last.stamp = last.stamp.plus_secs_f64(-by_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::track::tests::{state, t};

    fn flown(steps: u32, dt_s: f64, mut state_at: impl FnMut(f64) -> VehicleState) -> Option<(u32, Vector3<f64>)> {
        let mut watch = JumpWatch::default();
        (0..steps).find_map(|step| {
            let state = state_at(f64::from(step) * dt_s);
            watch.observe(&state, 3.0).map(|by_m| (step, by_m))
        })
    }

    fn moving(time_s: f64, position: Vector3<f64>, velocity: Vector3<f64>) -> VehicleState {
        VehicleState { position_ned_m: position, velocity_ned_mps: velocity, boot_s: 100.0 + time_s, ..state(t(time_s), 0.0) }
    }

    /// A circle at 8 m/s, 3.2 m/s²: hard flying, at every rate at which states may come.
    #[test]
    fn motion_is_no_jump_and_a_jump_within_it_is_found_at_once() {
        let (radius_m, turn_radps) = (20.0, 0.4);
        for dt_s in [0.02, 0.1, 0.5, 1.0] {
            let steps = (15.0 / dt_s) as u32;
            let on_circle = |time_s: f64, shift_m: f64| {
                let angle: f64 = turn_radps * time_s;
                let place = Vector3::new(radius_m * angle.cos() + shift_m, radius_m * angle.sin(), -5.0);
                moving(time_s, place, Vector3::new(-angle.sin(), angle.cos(), 0.0) * (radius_m * turn_radps))
            };
            assert_eq!(flown(steps, dt_s, |time_s| on_circle(time_s, 0.0)), None, "{dt_s}");
            let jumped = flown(steps, dt_s, |time_s| on_circle(time_s, if time_s >= 9.99 { 8.0 } else { 0.0 })).unwrap();
            assert_eq!(jumped.0, (10.0 / dt_s).round() as u32);
            assert!((jumped.1 - Vector3::new(8.0, 0.0, 0.0)).norm() < 1.5, "{}", jumped.1);
        }
    }

    #[test]
    fn a_jump_in_instalments_is_one_and_wander_is_none() {
        // 8 m within a second, 0.8 m at a time.
        let slid =
            |time_s: f64| moving(time_s, Vector3::new(8.0 * (time_s - 5.0).clamp(0.0, 1.0), 0.0, -5.0), Vector3::zeros());
        assert!(flown(100, 0.1, slid).is_some());
        // 0.5 m/s of drift that the velocity knows nothing of settles at v T = 1 m left over.
        assert_eq!(flown(1000, 0.1, |time_s| moving(time_s, Vector3::new(0.5 * time_s, 0.0, -5.0), Vector3::zeros())), None);
    }

    #[test]
    fn stated_accuracy_and_corrected_stamps_excuse_and_silence_says_nothing() {
        let jump_4_m = |sigma_m: Option<f64>| {
            flown(100, 0.1, |time_s| {
                let mut state = moving(time_s, Vector3::new(if time_s > 5.0 { 4.0 } else { 0.0 }, 0.0, -5.0), Vector3::zeros());
                state.fix = Some(halcyon_model::Fix { kind: 3, satellites: 9, horizontal_sigma_m: sigma_m });
                state
            })
        };
        assert!(jump_4_m(Some(0.5)).is_some() && jump_4_m(None).is_some() && jump_4_m(Some(f64::NAN)).is_some());
        assert!(jump_4_m(Some(2.5)).is_none());
        // The stamps are corrected by 0.6 s at 8 m/s.
        let corrected = |time_s: f64| {
            let mut state = moving(time_s, Vector3::new(8.0 * time_s, 0.0, -5.0), Vector3::new(8.0, 0.0, 0.0));
            state.stamp = t(if time_s > 5.0 { time_s } else { time_s - 0.6 });
            state
        };
        assert_eq!(flown(100, 0.1, corrected), None);
        assert_eq!(flown(10, 3.0, |time_s| moving(time_s, Vector3::new(5.0 * time_s, 0.0, -5.0), Vector3::zeros())), None);
    }
}
