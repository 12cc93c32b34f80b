//! Where a body was between the moments at which we were told.

use std::collections::VecDeque;

use halcyon_model::Stamp;
use nalgebra::{UnitQuaternion, Vector3};

/// Samples kept: two seconds at 50 Hz, and more at what autopilots send.
const SAMPLES_MAX: usize = 100;
/// Two samples further apart than this don't say how fast the body turns.
const RATE_GAP_S_MAX: f64 = 0.5;

/// A body's position, velocity and attitude at an instant, in the local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseSample {
    /// When.
    pub stamp: Stamp,
    /// Position, metres north, east, down.
    pub position_ned_m: Vector3<f64>,
    /// Velocity, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
    /// Rotates body axes into north, east, down.
    pub ned_from_body: UnitQuaternion<f64>,
}

/// The last few samples of one body, oldest first.
#[derive(Debug, Clone, Default)]
pub struct PoseHistory {
    samples: VecDeque<PoseSample>,
}

impl PoseHistory {
    /// Takes a sample. One that isn't newer than the last is dropped, unless it is much older: then the sender's clock was
    /// set back (a simulation restarted), and the history starts again.
    pub fn push(&mut self, sample: PoseSample) {
        if let Some(last) = self.samples.back() {
            let ahead_s = sample.stamp.seconds_since(last.stamp);
            if ahead_s < -5.0 {
                self.samples.clear();
            } else if ahead_s <= 0.0 {
                return;
            }
        }
        if self.samples.len() == SAMPLES_MAX {
            self.samples.pop_front();
        }
        self.samples.push_back(sample);
    }

    /// The newest sample.
    #[must_use]
    pub fn newest(&self) -> Option<&PoseSample> {
        self.samples.back()
    }

    /// The pose at `stamp`: between two samples by a cubic that keeps their velocities, attitude along the shortest turn; after
    /// the newest, for at most `ahead_s_max` seconds, at its velocity and the last turn rate. `None` when nothing is known that
    /// near: before the oldest sample, or too long after the newest.
    #[must_use]
    pub fn at(&self, stamp: Stamp, ahead_s_max: f64) -> Option<PoseSample> {
        let newest = self.newest()?;
        let ahead_s = stamp.seconds_since(newest.stamp);
        if ahead_s >= 0.0 {
            return (ahead_s <= ahead_s_max).then(|| self.ahead(newest, stamp, ahead_s));
        }
        let after = self.samples.partition_point(|sample| sample.stamp <= stamp);
        let (from, to) = (self.samples.get(after.checked_sub(1)?)?, self.samples.get(after)?);
        Some(between(from, to, stamp))
    }

    fn ahead(&self, newest: &PoseSample, stamp: Stamp, ahead_s: f64) -> PoseSample {
        let turn = self.samples.iter().rev().nth(1).and_then(|previous| {
            let gap_s = newest.stamp.seconds_since(previous.stamp);
            (gap_s < RATE_GAP_S_MAX).then(|| (previous.ned_from_body.inverse() * newest.ned_from_body).scaled_axis() / gap_s)
        });
        // Nobody turns evenly for long: a quarter of a second ahead at most.
        let turned = UnitQuaternion::from_scaled_axis(turn.unwrap_or_default() * ahead_s.min(0.25));
        PoseSample {
            stamp,
            position_ned_m: newest.position_ned_m + newest.velocity_ned_mps * ahead_s,
            velocity_ned_mps: newest.velocity_ned_mps,
            ned_from_body: newest.ned_from_body * turned,
        }
    }
}

fn between(from: &PoseSample, to: &PoseSample, stamp: Stamp) -> PoseSample {
    let span_s = to.stamp.seconds_since(from.stamp);
    let t = stamp.seconds_since(from.stamp) / span_s;
    let (a, b) = (from.velocity_ned_mps * span_s, to.velocity_ned_mps * span_s);
    let step = to.position_ned_m - from.position_ned_m;
    // Hermite's cubic from `from` on.
    let position_ned_m =
        from.position_ned_m + step * (t * t * (3.0 - 2.0 * t)) + a * (t * (1.0 - t) * (1.0 - t)) - b * (t * t * (1.0 - t));
    let turn = (from.ned_from_body.inverse() * to.ned_from_body).scaled_axis();
    PoseSample {
        stamp,
        position_ned_m,
        velocity_ned_mps: from.velocity_ned_mps.lerp(&to.velocity_ned_mps, t),
        ned_from_body: from.ned_from_body * UnitQuaternion::from_scaled_axis(turn * t),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A known motion: a cubic in position, an even turn about a slanted axis.
    fn truth(t_s: f64) -> PoseSample {
        let turn = Vector3::new(0.3, -0.2, 0.6);
        PoseSample {
            stamp: Stamp::from_nanos(1_780_000_000_000_000_000).plus_secs_f64(t_s),
            position_ned_m: Vector3::new(3.0 * t_s, 1.0 - t_s * t_s, -5.0 + 0.1 * t_s.powi(3)),
            velocity_ned_mps: Vector3::new(3.0, -2.0 * t_s, 0.3 * t_s * t_s),
            ned_from_body: UnitQuaternion::from_euler_angles(0.1, 0.2, 3.0) * UnitQuaternion::from_scaled_axis(turn * t_s),
        }
    }

    fn history(times_s: &[f64]) -> PoseHistory {
        let mut history = PoseHistory::default();
        times_s.iter().for_each(|t_s| history.push(truth(*t_s)));
        history
    }

    #[test]
    fn between_samples_it_is_the_motion_itself() {
        let history = history(&[0.0, 0.1, 0.3, 0.4]);
        for t_s in [0.0, 0.05, 0.1, 0.17, 0.29, 0.4] {
            let (got, expected) = (history.at(truth(t_s).stamp, 0.0).unwrap(), truth(t_s));
            assert!((got.position_ned_m - expected.position_ned_m).norm() < 1e-7, "{t_s}");
            assert!(got.ned_from_body.angle_to(&expected.ned_from_body) < 1e-7, "{t_s}");
        }
    }

    #[test]
    fn ahead_it_goes_on_for_a_while_and_then_says_nothing() {
        let history = history(&[0.0, 0.1, 0.2]);
        let got = history.at(truth(0.3).stamp, 0.2).unwrap();
        // Acceleration is what it can't know: half of 2 m/s² over 0.1 s.
        assert!((got.position_ned_m - truth(0.3).position_ned_m).norm() < 0.011);
        assert!(got.ned_from_body.angle_to(&truth(0.3).ned_from_body) < 1e-6);
        assert_eq!(history.at(truth(0.5).stamp, 0.2), None);
        assert_eq!(history.at(truth(-0.1).stamp, 0.2), None);
        assert_eq!(PoseHistory::default().at(truth(0.0).stamp, 9.0), None);
    }

    #[test]
    fn late_samples_are_dropped_and_a_set_back_clock_starts_anew() {
        let mut history = history(&[10.0, 10.1]);
        history.push(truth(10.05));
        assert_eq!(history.newest().unwrap().stamp, truth(10.1).stamp);
        history.push(truth(1.0));
        assert_eq!(history.newest().unwrap().stamp, truth(1.0).stamp);
        assert_eq!(history.at(truth(10.05).stamp, 0.1), None);
        (0..500).for_each(|i| history.push(truth(2.0 + 0.01 * f64::from(i))));
        assert_eq!(history.samples.len(), SAMPLES_MAX);
    }
}
