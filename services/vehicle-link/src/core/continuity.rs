//! A place that jumps where the vehicle can't have: a receiver's leap, or its return.
//!
//! Nobody knows whether the place was wrong before or is wrong now. Whoever flies on as before is as far from the others as before,
//! in both cases; whoever follows the leap may fly into somebody. So a leap is taken out of the place as it comes, and then let in
//! again slowly, for a place that stays is believed in the end. The way back of a leap that ends cancels it.

use halcyon_model::Stamp;
use nalgebra::Vector3;

/// Further than this from where its own velocity brings it, a place has jumped: metres, and what a turn at so many metres per
/// second squared may add.
const JUMP_M: f64 = 1.0;
const TURN_MPS2: f64 = 5.0;
/// After longer than this without news nothing is known of what lies between, seconds.
const GAP_S_MAX: f64 = 1.0;
/// What has been taken out comes back at this speed, metres per second.
const RETURN_MPS: f64 = 0.25;
/// No more than this is taken out, metres: a larger leap is a new place, and the fail-safes' affair.
const SHIFT_M_MAX: f64 = 20.0;

/// What a vehicle's place is short of its leaps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Continuity {
    last: Option<(Stamp, Vector3<f64>, Vector3<f64>)>,
    shift_ned_m: Vector3<f64>,
}

impl Continuity {
    /// Takes a place and a velocity as they are told; a stamp that isn't newer changes nothing.
    pub fn observe(&mut self, stamp: Stamp, position_ned_m: Vector3<f64>, velocity_ned_mps: Vector3<f64>) {
        let now = (stamp, position_ned_m, velocity_ned_mps);
        let Some((last_stamp, last_m, last_mps)) = self.last.replace(now) else { return };
        let dt_s = stamp.seconds_since(last_stamp);
        if !(0.0..=GAP_S_MAX).contains(&dt_s) {
            self.shift_ned_m = Vector3::zeros();
            return;
        }
        let left_m = self.shift_ned_m.norm() - RETURN_MPS * dt_s;
        self.shift_ned_m = if left_m > 0.0 { self.shift_ned_m.normalize() * left_m } else { Vector3::zeros() };
        let leap_m = position_ned_m - last_m - (last_mps + velocity_ned_mps) * (0.5 * dt_s);
        // Heights come from a barometer.
        let leap_m = Vector3::new(leap_m.x, leap_m.y, 0.0);
        if leap_m.norm() > JUMP_M + 0.25 * TURN_MPS2 * dt_s * dt_s {
            let shift_m = self.shift_ned_m + leap_m;
            self.shift_ned_m = if shift_m.norm() <= SHIFT_M_MAX { shift_m } else { Vector3::zeros() };
        }
    }

    /// What to take from the place that is told, metres.
    #[must_use]
    pub fn shift_ned_m(&self) -> Vector3<f64> {
        self.shift_ned_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0 + s)
    }

    #[test]
    fn a_leap_is_taken_out_and_its_return_cancels_it() {
        let (mut continuity, velocity) = (Continuity::default(), Vector3::new(3.0, 0.0, 0.0));
        for step in 0..100 {
            let time_s = 0.1 * f64::from(step);
            let error_m = if (30..60).contains(&step) { Vector3::new(0.0, -4.0, 0.0) } else { Vector3::zeros() };
            let place = velocity * time_s + error_m;
            continuity.observe(at(time_s), place, velocity);
            // As if it had never leapt, but for what comes back: 0.25 m/s for 3 s.
            let miss_m = (place - continuity.shift_ned_m() - velocity * time_s).norm();
            let returned_m = RETURN_MPS * (time_s - 2.9).clamp(0.0, 3.0);
            assert!(miss_m <= returned_m + 1e-9, "{step}: {miss_m}");
            assert!(miss_m > 0.0 || !(31..60).contains(&step));
        }
        assert!(continuity.shift_ned_m().norm() < 1e-9, "what had come back has come back again");
    }

    #[test]
    fn a_place_that_stays_is_believed_in_the_end_and_a_turn_is_no_leap() {
        let mut continuity = Continuity::default();
        for step in 0..300 {
            let place = Vector3::new(if step < 10 { 0.0 } else { 4.0 }, 0.0, -5.0);
            continuity.observe(at(0.1 * f64::from(step)), place, Vector3::zeros());
        }
        assert_eq!(continuity.shift_ned_m(), Vector3::zeros());
        // Braking from 5 m/s with 5 m/s², heard once a second.
        let mut continuity = Continuity::default();
        continuity.observe(at(0.0), Vector3::zeros(), Vector3::new(5.0, 0.0, 0.0));
        continuity.observe(at(1.0), Vector3::new(2.5, 0.0, 0.0), Vector3::zeros());
        assert_eq!(continuity.shift_ned_m(), Vector3::zeros());
        // Nothing heard for long: a new place.
        continuity.observe(at(9.0), Vector3::new(80.0, 0.0, 0.0), Vector3::zeros());
        assert_eq!(continuity.shift_ned_m(), Vector3::zeros());
    }
}
