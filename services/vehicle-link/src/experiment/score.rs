//! What is measured.

use halcyon_model::Stamp;
use nalgebra::{Vector2, Vector3};

use super::flyer::Sighting;
use super::scene::Scenario;
use crate::core::law::SlotLock;

/// Root mean squares over a flight, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// Of the horizontal distance between the vehicles against the slot's.
    pub range_rms_m: f64,
    /// Of the horizontal vector from the slot to the follower.
    pub slot_rms_m: f64,
    /// Of the height difference.
    pub altitude_rms_m: f64,
}

/// How a flight went. Report all of it: range alone hides GNSS error, and a follower that lags along the track.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// By what the vehicles report of themselves, as the thesis measured (6-9).
    pub reported: Errors,
    /// By the truth.
    pub true_errors: Errors,
    /// Greatest true horizontal distance from the slot, metres.
    pub slot_peak_m: f64,
    /// Least true distance between the vehicles, metres.
    pub least_separation_m: f64,
    /// Samples, 50 a second.
    pub samples: u64,
    /// Setpoints sent since the follower was switched on.
    pub setpoints: u64,
}

#[derive(Default)]
struct Sums {
    range_m2: f64,
    slot_m2: f64,
    altitude_m2: f64,
    samples: u64,
}

impl Sums {
    /// `apart_ned_m`: the follower seen from the leader; `slot_ned_m`: where it should be.
    fn add(&mut self, apart_ned_m: Vector3<f64>, slot_ned_m: Vector2<f64>) -> f64 {
        let miss_m = (apart_ned_m.xy() - slot_ned_m).norm();
        self.range_m2 += (apart_ned_m.xy().norm() - slot_ned_m.norm()).powi(2);
        self.slot_m2 += miss_m * miss_m;
        self.altitude_m2 += apart_ned_m.z.powi(2);
        self.samples += 1;
        miss_m
    }

    fn errors(&self) -> Errors {
        let rms_m = |sum_m2: f64| (sum_m2 / self.samples.max(1) as f64).sqrt();
        Errors { range_rms_m: rms_m(self.range_m2), slot_rms_m: rms_m(self.slot_m2), altitude_rms_m: rms_m(self.altitude_m2) }
    }
}

pub(super) struct Score {
    slot_m: f64,
    lock: SlotLock,
    reported: Sums,
    truth: Sums,
    slot_peak_m: f64,
    least_m: f64,
}

impl Score {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self {
            slot_m: scenario.slot_m,
            lock: scenario.slot_lock,
            reported: Sums::default(),
            truth: Sums::default(),
            slot_peak_m: 0.0,
            least_m: f64::INFINITY,
        }
    }

    fn slot(&self, heading_rad: f64) -> Vector2<f64> {
        let heading_rad = if self.lock == SlotLock::North { 0.0 } else { heading_rad };
        // To the right: a quarter turn clockwise from the heading.
        Vector2::new(-heading_rad.sin(), heading_rad.cos()) * self.slot_m
    }

    pub(super) fn observe(&mut self, leader: &Sighting, follower: &Sighting, _now: Stamp) {
        let apart_m = follower.truth.position_ned_m - leader.truth.position_ned_m;
        let slot_m = self.slot(leader.truth.ned_from_body.euler_angles().2);
        let miss_m = self.truth.add(apart_m, slot_m);
        self.slot_peak_m = self.slot_peak_m.max(miss_m);
        self.least_m = self.least_m.min(apart_m.norm());
        if let (Some(leader), Some(follower)) = (&leader.reported, &follower.reported) {
            let slot_m = self.slot(leader.heading_rad);
            self.reported.add(follower.position_ned_m - leader.position_ned_m, slot_m);
        }
    }

    pub(super) fn report(&self, setpoints: u64) -> Report {
        Report {
            reported: self.reported.errors(),
            true_errors: self.truth.errors(),
            slot_peak_m: self.slot_peak_m,
            least_separation_m: self.least_m,
            samples: self.truth.samples,
            setpoints,
        }
    }
}
