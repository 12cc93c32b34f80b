//! Acceleration from the autopilot's velocity: what every ArduCopter and PX4 sends ten times a second, and what its own estimator
//! has cleaned of gravity, bias and vibration already. RAW_IMU and SCALED_IMU are none of that, and would alias at 10 Hz.

use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega as ardu;
use nalgebra::Vector3;

/// Time constant of the filter over the differences, seconds.
const FILTER_S: f64 = 0.15;
/// Further apart than this, two velocities tell nothing of the acceleration now; nor do older ones, seconds.
const GAP_S: f64 = 0.5;
/// More than this no multicopter accelerates by: a velocity that was reset, metres per second squared.
const ACCELERATION_MPS2_MAX: f64 = 30.0;

/// Differentiates LOCAL_POSITION_NED's velocity over the autopilot's own clock, which the link's delays don't touch.
#[derive(Debug, Clone, Copy, Default)]
pub struct Differentiator {
    last: Option<(u32, Vector3<f64>)>,
    acceleration: Option<(Vector3<f64>, Stamp)>,
}

impl Differentiator {
    /// Takes a velocity, received at `now`.
    pub fn observe(&mut self, data: &ardu::LOCAL_POSITION_NED_DATA, now: Stamp) {
        let velocity_mps = Vector3::new(data.vx, data.vy, data.vz).map(f64::from);
        if !velocity_mps.iter().all(|part| part.is_finite()) {
            return;
        }
        let Some((last_ms, last_mps)) = self.last.replace((data.time_boot_ms, velocity_mps)) else { return };
        if data.time_boot_ms == last_ms {
            return;
        }
        let dt_s = (f64::from(data.time_boot_ms) - f64::from(last_ms)) * 1e-3;
        let raw_mps2 = (velocity_mps - last_mps) / dt_s;
        if !(0.0..=GAP_S).contains(&dt_s) || raw_mps2.norm() > ACCELERATION_MPS2_MAX {
            self.acceleration = None;
            return;
        }
        let before_mps2 = self.ned_mps2(now).unwrap_or(raw_mps2);
        let gain = dt_s / (FILTER_S + dt_s);
        self.acceleration = Some((before_mps2 + (raw_mps2 - before_mps2) * gain, now));
    }

    /// Acceleration without gravity, north, east, down; `None` if it is not of just now.
    #[must_use]
    pub fn ned_mps2(&self, now: Stamp) -> Option<Vector3<f64>> {
        self.acceleration.filter(|(_, at)| (-GAP_S..=GAP_S).contains(&now.seconds_since(*at))).map(|(mps2, _)| mps2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
    }

    fn velocity(boot_s: f64, north_mps: f64) -> ardu::LOCAL_POSITION_NED_DATA {
        ardu::LOCAL_POSITION_NED_DATA { time_boot_ms: (boot_s * 1e3) as u32, vx: north_mps as f32, ..Default::default() }
    }

    /// v = 2 sin(0.8 t): the acceleration is its derivative, half an interval and the filter late.
    #[test]
    fn it_is_the_derivative_whatever_the_link_delays() {
        let mut differentiator = Differentiator::default();
        let mut worst = 0.0f64;
        for step in 0..300 {
            let time_s = 0.1 * f64::from(step);
            let delay_s = 0.2 * f64::from(step % 3) / 2.0;
            differentiator.observe(&velocity(50.0 + time_s, 2.0 * (0.8 * time_s).sin()), t(time_s + delay_s));
            if step > 20 {
                let late_s = 0.05 + FILTER_S;
                let expected = 1.6 * (0.8 * (time_s - late_s)).cos();
                worst = worst.max((differentiator.ned_mps2(t(time_s + delay_s)).unwrap().x - expected).abs());
            }
        }
        assert!(worst < 0.05, "{worst}");
    }

    #[test]
    fn a_gap_a_reset_a_restart_or_no_number_is_no_acceleration() {
        let after = |next: ardu::LOCAL_POSITION_NED_DATA| {
            let mut differentiator = Differentiator::default();
            for step in 0..10 {
                differentiator
                    .observe(&velocity(50.0 + 0.1 * f64::from(step), 0.1 * f64::from(step)), t(0.1 * f64::from(step)));
            }
            assert!(differentiator.ned_mps2(t(0.9)).is_some() && differentiator.ned_mps2(t(2.0)).is_none());
            differentiator.observe(&next, t(1.0));
            differentiator.ned_mps2(t(1.0))
        };
        assert!(after(velocity(51.0, 1.0)).is_some());
        assert_eq!(after(velocity(53.0, 1.0)), None);
        assert_eq!(after(velocity(51.0, 9.0)), None);
        assert_eq!(after(velocity(0.1, 1.0)), None);
        assert!((after(velocity(51.0, f64::NAN)).unwrap().x - 1.0).abs() < 1e-3, "the last good one, while it is fresh");
    }
}
