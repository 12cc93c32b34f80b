//! Height above what lies below, by the downward rangefinder, and whether the vehicle floats on it.
//!
//! The autopilot's height is a barometer's: right to decimetres after take-off, wrong by as much again after half an hour. The
//! rangefinder sees the water itself, waves and all; its mean over a few waves, less the autopilot's height, is the barometer's
//! error, which hardly changes while the vehicle comes down. So the two together give the height above *mean* water at every
//! moment, and go on for a while when the one below is out of range.

use std::collections::VecDeque;

use halcyon_model::{Stamp, VehicleState};
use nalgebra::Vector3;

/// The mean is taken over so long, seconds: a wave or two.
const WINDOW_S: f64 = 6.0;
/// Of at least so many readings.
const READINGS_MIN: usize = 10;
/// More than this many are not kept.
const READINGS_MAX: usize = 256;
/// A reading this old says nothing about now, seconds.
const READING_S: f64 = 0.5;
/// A beam leaning more than this from the vertical is not used, cosine (25°).
const UPRIGHT: f64 = 0.9;

/// On the surface, the rangefinder reads less than this, metres: it sits in the hull.
const AFLOAT_RANGE_M: f64 = 0.6;
/// And the autopilot's height is within this of it, metres.
const AFLOAT_HEIGHT_M: f64 = 1.0;
/// And has stayed within this, metres: what waves lift. In LAND it would have come down further in [`Afloat`]'s time.
const AFLOAT_HEAVE_M: f64 = 1.5;

#[derive(Debug, Clone, Copy)]
struct Reading {
    stamp: Stamp,
    range_height_m: f64,
    autopilot_height_m: f64,
}

/// The rangefinder against the autopilot's height.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    readings: VecDeque<Reading>,
}

impl Surface {
    /// Takes a state's reading, if it has a new one.
    pub fn observe(&mut self, state: &VehicleState) {
        let Some(range) = state.range else { return };
        let cosine = (state.ned_from_body * Vector3::z()).z;
        let range_height_m = range.distance_m * cosine;
        let new = self.readings.back().is_none_or(|last| range.stamp > last.stamp);
        // NaN is on neither side.
        if new && cosine >= UPRIGHT && range_height_m >= 0.0 && range_height_m.is_finite() {
            let autopilot_height_m = -state.position_ned_m.z;
            self.readings.push_back(Reading { stamp: range.stamp, range_height_m, autopilot_height_m });
            if self.readings.len() > READINGS_MAX {
                self.readings.pop_front();
            }
        }
    }

    /// What the autopilot's height lacks to the height above what lies below, averaged over waves, metres; `None` while the
    /// rangefinder has not said enough lately.
    #[must_use]
    pub fn correction_m(&self, now: Stamp) -> Option<f64> {
        let recent = |reading: &&Reading| (-1.0..=WINDOW_S).contains(&now.seconds_since(reading.stamp));
        let differences = self.readings.iter().filter(recent).map(|r| r.range_height_m - r.autopilot_height_m);
        let (count, sum) = differences.fold((0usize, 0.0), |(count, sum), difference| (count + 1, sum + difference));
        (count >= READINGS_MIN).then(|| sum / count as f64)
    }

    /// The newest height by the rangefinder alone, metres, if it is of just now.
    #[must_use]
    pub fn range_height_m(&self, now: Stamp) -> Option<f64> {
        let fresh = |reading: &&Reading| (-1.0..=READING_S).contains(&now.seconds_since(reading.stamp));
        self.readings.back().filter(fresh).map(|reading| reading.range_height_m)
    }

    /// Forgets everything: our clock was set.
    pub fn reset(&mut self) {
        self.readings.clear();
    }
}

/// How sure it is that the vehicle floats, in LAND mode, with its motors on: an autopilot that waits for stillness never finds the
/// end of a landing on waves.
#[derive(Debug, Clone, Copy, Default)]
pub struct Afloat {
    for_s: f64,
    witnessed_s: f64,
    heights_m: Option<(f64, f64)>,
}

impl Afloat {
    /// Takes the heights above the surface at one step in LAND mode: the autopilot's, and the rangefinder's where it has one.
    pub fn step(&mut self, autopilot_height_m: f64, range_height_m: Option<f64>, dt_s: f64) {
        let (low_m, high_m) = self.heights_m.unwrap_or((autopilot_height_m, autopilot_height_m));
        let heights_m = (low_m.min(autopilot_height_m), high_m.max(autopilot_height_m));
        let level = autopilot_height_m.abs() <= AFLOAT_HEIGHT_M && heights_m.1 - heights_m.0 <= AFLOAT_HEAVE_M;
        let away = range_height_m.is_some_and(|range_m| range_m > AFLOAT_RANGE_M);
        if !level || away {
            *self = Self::default();
            return;
        }
        self.heights_m = Some(heights_m);
        self.for_s += dt_s;
        // Out of its range, or silent, the rangefinder witnesses nothing.
        if range_height_m.is_some() {
            self.witnessed_s += dt_s;
        }
    }

    /// For how long the autopilot's height has been that of the surface, and nothing has spoken against it, seconds.
    #[must_use]
    pub fn for_s(&self) -> f64 {
        self.for_s
    }

    /// For how much of that the rangefinder has said so too, seconds.
    #[must_use]
    pub fn witnessed_s(&self) -> f64 {
        self.witnessed_s
    }
}

#[cfg(test)]
mod tests {
    use halcyon_model::Range;
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::core::track::tests::{state, t};

    /// 4 m over waves of 0.4 m amplitude, 4 s, the barometer 0.7 m high, coming down at 0.3 m/s.
    fn over_waves(surface: &mut Surface, time_s: f64, roll_rad: f64) -> f64 {
        let true_m = 4.0 - 0.3 * time_s;
        let wave_m = 0.4 * (std::f64::consts::TAU * time_s / 4.0).sin();
        let mut state = state(t(time_s), 0.0);
        state.position_ned_m.z = -(true_m + 0.7);
        state.ned_from_body = UnitQuaternion::from_euler_angles(roll_rad, 0.0, 0.3);
        state.range = Some(Range { stamp: t(time_s), distance_m: (true_m - wave_m) / roll_rad.cos() });
        surface.observe(&state);
        true_m
    }

    #[test]
    fn the_barometers_error_is_found_through_waves_and_lean() {
        let mut surface = Surface::default();
        assert_eq!(surface.correction_m(t(0.0)), None);
        for step in 0..80 {
            over_waves(&mut surface, 0.1 * f64::from(step), 0.3);
        }
        // 6 s are one wave and a half of 4 s: the half leaves 2/(3π) of the amplitude at most.
        let correction_m = surface.correction_m(t(7.9)).unwrap();
        assert!((correction_m + 0.7).abs() < 0.4 * 2.0 / (3.0 * std::f64::consts::PI) + 0.01, "{correction_m}");
        // Silent, it goes on while the readings last.
        assert!(surface.correction_m(t(11.0)).is_some() && surface.range_height_m(t(11.0)).is_none());
        assert_eq!(surface.correction_m(t(15.0)), None);
    }

    #[test]
    fn a_beam_aside_and_what_is_no_number_are_not_used() {
        let mut surface = Surface::default();
        for step in 0..80 {
            over_waves(&mut surface, 0.1 * f64::from(step), 0.6);
        }
        for (step, bad) in [f64::NAN, f64::INFINITY, -1.0].into_iter().enumerate() {
            let mut state = state(t(9.0 + step as f64), 0.0);
            state.range = Some(Range { stamp: state.stamp, distance_m: bad });
            surface.observe(&state);
        }
        assert_eq!((surface.correction_m(t(8.0)), surface.range_height_m(t(11.0))), (None, None));
    }

    #[test]
    fn only_level_and_near_the_surface_is_afloat() {
        let after = |seconds: f64, height_m: &dyn Fn(f64) -> f64, range_m: &dyn Fn(f64) -> Option<f64>| {
            let mut afloat = Afloat::default();
            for step in 0..(seconds * 10.0) as u32 {
                let time_s = 0.1 * f64::from(step);
                afloat.step(height_m(time_s), range_m(time_s), 0.1);
            }
            (afloat.for_s(), afloat.witnessed_s())
        };
        let heave = |time_s: f64| 0.3 * (1.5 * time_s).sin();
        let (for_s, witnessed_s) = after(10.0, &heave, &|_| Some(0.2));
        assert!((for_s - 10.0).abs() < 1e-6 && (witnessed_s - 10.0).abs() < 1e-6);
        assert_eq!(after(10.0, &heave, &|_| None).1, 0.0, "nothing is witnessed by silence");
        // Coming down, however slowly the autopilot does it, it is never afloat for long.
        assert!(after(60.0, &|time_s| 5.0 - 0.2 * time_s, &|_| Some(0.2)).0 < 10.0);
        // At the surface by the barometer, in the air by the rangefinder; and the other way round.
        assert!(after(60.0, &|_| 0.0, &|_| Some(2.0)).0 == 0.0);
        assert!(after(60.0, &|_| 2.0, &|_| Some(0.1)).0 == 0.0);
        assert!(after(60.0, &|_| f64::NAN, &|_| Some(0.1)).0 == 0.0);
    }
}
