//! The elevation and wave-height series of one rig, joined from the overlapping windows of its sea states.

use std::collections::VecDeque;

use halcyon_model::{Estimate, SeaState, Stamp, TracePoint};

/// At most this many samples of either kind, whatever the rates.
const SAMPLES_MAX: usize = 20_000;

/// What one rig measured over the last minutes.
#[derive(Debug, Clone, Default)]
pub struct RigSeries {
    elevation: VecDeque<TracePoint>,
    h_s: VecDeque<(Stamp, Estimate)>,
}

impl RigSeries {
    /// Joins a sea state on. Its trace replaces what is held from its first sample on, since assessment may have corrected it.
    pub fn join(&mut self, sea: &SeaState, length_s: f64) {
        if let Some(first) = sea.trace.first() {
            while self.elevation.back().is_some_and(|held| held.stamp >= first.stamp) {
                self.elevation.pop_back();
            }
            self.elevation.extend(&sea.trace);
        }
        while self.h_s.back().is_some_and(|held| held.0 >= sea.stamp) {
            self.h_s.pop_back();
        }
        self.h_s.extend(sea.h_s_m.map(|h_s_m| (sea.stamp, h_s_m)));

        let too_old = |stamp: Stamp| sea.stamp.seconds_since(stamp) > length_s;
        while self.elevation.len() > SAMPLES_MAX || self.elevation.front().is_some_and(|held| too_old(held.stamp)) {
            self.elevation.pop_front();
        }
        while self.h_s.len() > SAMPLES_MAX || self.h_s.front().is_some_and(|held| too_old(held.0)) {
            self.h_s.pop_front();
        }
    }

    /// Elevation samples not older than `since`, oldest first.
    pub fn elevation_since(&self, since: Stamp) -> impl Iterator<Item = &TracePoint> {
        self.elevation.iter().filter(move |point| point.stamp >= since)
    }

    /// Significant heights not older than `since`, oldest first.
    pub fn h_s_since(&self, since: Stamp) -> impl Iterator<Item = &(Stamp, Estimate)> {
        self.h_s.iter().filter(move |sample| sample.0 >= since)
    }
}
