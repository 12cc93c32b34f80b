//! A second witness in flight: the rangefinder that looks down beside the cameras.
//!
//! Its readings become elevations by the same motion correction, and are held against the series at the middle of the patches as `halcyon waves`
//! holds a probe against it (thesis, chapter 5). Where heights or periods differ by more than chance and both sensors leave open, one of the two
//! is wrong, and nothing follows from either. A rangefinder that is not there, stuck, or sees nothing above its noise says nothing.

use std::collections::VecDeque;

use halcyon_model::{Stamp, VehicleState};
use halcyon_ocean::quality::RawSeries;
use halcyon_ocean::witness::{self, Options, Verdict, agreement, compare, elevation_of_range};

use super::series::Series;
use super::window::Window;
use crate::config::Config;

/// Never more readings than this: the oldest go first.
const READINGS_MAX: usize = 4096;
/// A reading this far from the pose it came with belongs to another attitude, seconds.
const APART_S_MAX: f64 = 0.2;
/// What the scale of one to the other is known to, as a share, with 95 %: the cameras' baseline, and where the beam meets the water.
const SCALE_95: f64 = 0.05;
/// Their clocks differ by this much at most, seconds.
const LAG_S_MAX: f64 = 0.5;

/// One reading, corrected for motion.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Reading {
    stamp: Stamp,
    elevation_m: f64,
}

/// Readings of the last while, oldest first.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Witness {
    readings: VecDeque<Reading>,
}

/// What a witness says of the middle of the patches.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Testimony {
    /// Patch time of it.
    pub at: Stamp,
    /// Whether the two agree.
    pub agrees: bool,
    /// In words.
    pub text: String,
}

impl Witness {
    /// Takes in the reading of `state` at its place in time, if there is a new one. What is older than `window_s`, ahead of `now` by more than
    /// `skew_s`, or cannot be is left out.
    pub(super) fn add(&mut self, state: &VehicleState, now: Stamp, window_s: f64, skew_s: f64) {
        let Some(range) = state.range else { return };
        let apart_s = range.stamp.seconds_since(state.stamp);
        if apart_s.abs() > APART_S_MAX || range.stamp.seconds_since(now) > skew_s {
            return;
        }
        if self.readings.back().is_some_and(|newest| newest.stamp.seconds_since(now) > skew_s) {
            // The clock was set back.
            self.readings.clear();
        }
        let (roll_rad, pitch_rad, _) = state.ned_from_body.euler_angles();
        let height_m = -(state.position_ned_m.z + apart_s * state.velocity_ned_mps.z);
        let elevation_m = elevation_of_range(range.distance_m, height_m, roll_rad, pitch_rad);
        if !elevation_m.is_finite() {
            return;
        }
        let place = self.readings.partition_point(|old| old.stamp < range.stamp);
        // States come faster than readings, and repeat the last.
        if self.readings.get(place).is_some_and(|there| there.stamp == range.stamp) {
            return;
        }
        self.readings.insert(place, Reading { stamp: range.stamp, elevation_m });
        let newest = self.readings.back().map_or(range.stamp, |reading| reading.stamp);
        self.readings.retain(|old| newest.seconds_since(old.stamp) <= window_s);
        if self.readings.len() > READINGS_MAX {
            self.readings.pop_front();
        }
    }

    /// What it says of the series at the middle of the patches; `None` where it says nothing.
    pub(super) fn testify(&self, window: &Window, series: &Series, config: &Config) -> Option<Testimony> {
        let (first, last) = (window.frames().front()?.stamp, window.newest()?.stamp);
        // What it saw before the rig came here is of other water.
        let readings = self.readings.iter().filter(|reading| (first..=last).contains(&reading.stamp));
        let (stamp_s, elevation_m): (Vec<f64>, Vec<f64>) =
            readings.map(|reading| (reading.stamp.seconds_since(first), reading.elevation_m)).unzip();
        let (trace_s, trace_m): (Vec<f64>, Vec<f64>) =
            series.trace().iter().map(|point| (point.stamp.seconds_since(first), point.elevation_m)).unzip();
        let level_sigma_m: Vec<f64> = window.frames().iter().filter_map(|frame| frame.level_sigma_m).collect();
        let level_m2 = level_sigma_m.iter().map(|sigma_m| sigma_m * sigma_m).sum::<f64>() / level_sigma_m.len().max(1) as f64;
        let options = Options {
            max_lag_s: LAG_S_MAX,
            // Slower, the autopilot's height wanders, for both in the same way.
            band_hz: (config.wave_hz_min.max(0.02), f64::MAX),
            noise_a_m: series.noise_m2.sqrt(),
            noise_b_m: config.range_sigma_m.hypot(level_m2.sqrt()),
            scale_95: SCALE_95,
            ..Options::default()
        };
        let (ours, theirs) = (
            RawSeries { stamp_s: &trace_s, elevation_m: &trace_m },
            RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m },
        );
        let compared = compare(&ours, &theirs, &options).ok()?;
        let heights = format!("H_m0 {:.3} m by the cameras, {:.3} m by it", compared.a.h_m0_m, compared.b.h_m0_m);
        match agreement(&compared) {
            Verdict::Unknown { .. } => None,
            Verdict::Agree => Some(Testimony { at: last, agrees: true, text: format!("the rangefinder agrees: {heights}") }),
            Verdict::Disagree { why } => {
                let why: Vec<String> = why.iter().map(witness::Difference::to_string).collect();
                let text = format!("the rangefinder sees other water ({heights}): {}", why.join("; "));
                Some(Testimony { at: last, agrees: false, text })
            }
        }
    }
}
