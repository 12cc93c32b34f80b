//! Waves longer than the footprint: a grid is relative to its patch's own mean level, which rises and falls with them.
//!
//! The level is known only through the height of the camera, by an autopilot whose height wanders by centimetres. So the level
//! is split by frequency: what is slower than waves is wander and goes; what is faster than waves that fill the footprint is
//! noise and goes; the band between may be either. Its energy beyond what the stated standard deviation explains is added to
//! the gauges; the whole of it is added for the upper bounds, since it could be waves. It never makes water look calmer.

use std::f64::consts::TAU;

use halcyon_ocean::dispersion::angular_frequency_radps;
use halcyon_ocean::filter::band_pass;
use halcyon_ocean::{Depth, Record, Spline};

use super::series::{despike, runs};
use super::window::{Frame, Window};
use crate::config::Config;

/// Least share of frames with a level for it to be used; the others are then left out.
const LEVELS_MIN: f64 = 0.9;
/// Fewer level samples in a row than this cannot be filtered.
const SAMPLES_MIN: usize = 16;

/// The part of the level that may be waves, frame by frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Hidden {
    /// Measured.
    Measured {
        /// Metres for each frame of the window; `None` where the level is missing.
        level_m: Vec<Option<f64>>,
        /// Share of it (as an amplitude, 0 to 1) that its standard deviation does not explain.
        gain: f64,
        /// 4 √variance of all of it, metres.
        h_m0_m: f64,
    },
    /// Nothing is known of the level.
    Unknown,
}

/// Splits the levels of `window`.
pub(crate) fn hidden(window: &Window, config: &Config, interval_s: f64) -> Hidden {
    let frames = window.frames();
    let count = frames.len();
    let share = |n: usize| n as f64 / count as f64;
    let with_level = frames.iter().filter(|f| f.level_m.is_some()).count();
    // A rig that stands still knows its level by its distance to the water, without an autopilot between.
    let with_levels = count > 0 && share(with_level) >= LEVELS_MIN;
    if !with_levels && !config.fixed_rig {
        return Hidden::Unknown;
    }
    let by_pose = with_levels && !config.fixed_rig;
    let level = |f: &Frame| if with_levels { f.level_m } else { Some(-f.distance_m) };
    let footprint_m = frames.iter().map(|f| f.footprint_m).sum::<f64>() / count as f64;
    // Waves half as long as the footprint average out over it; deep water has the fastest, so none is missed in shallow.
    let high_hz = angular_frequency_radps(TAU / (0.5 * footprint_m), Depth::DEEP) / TAU;
    let low_hz = if by_pose { config.wave_hz_min } else { 0.0 };

    let mut level_m = vec![None; count];
    let stamps_s: Vec<(usize, f64)> = frames
        .iter()
        .enumerate()
        .filter(|(_, f)| level(f).is_some())
        .map(|(i, f)| (i, f.stamp.seconds_since(frames[0].stamp)))
        .collect();
    for run in runs(&stamps_s, config.gap_s_max.max(2.0 * interval_s)) {
        let times_s: Vec<f64> = run.iter().map(|(_, t)| *t).collect();
        let mut values_m: Vec<f64> = run.iter().filter_map(|(i, _)| level(&frames[*i])).collect();
        despike(&mut values_m, &mut []);
        let samples = ((times_s[times_s.len() - 1] - times_s[0]) / interval_s).floor() as usize + 1;
        if samples < SAMPLES_MIN {
            continue;
        }
        let Some(slow_m) = split(times_s.clone(), values_m, samples, interval_s, low_hz, high_hz) else { continue };
        for ((i, _), t) in run.iter().zip(&times_s) {
            level_m[*i] = slow_m.sampled(*t, 1.0, 1).first().copied();
        }
    }

    let found: Vec<f64> = level_m.iter().flatten().copied().collect();
    if found.is_empty() {
        return Hidden::Unknown;
    }
    let variance_m2 = found.iter().map(|x| x * x).sum::<f64>() / found.len() as f64;
    let explained_m2 = if by_pose {
        // A deviation that nobody states explains everything.
        frames.iter().map(|f| f.level_sigma_m.map_or(f64::INFINITY, |s| s * s)).sum::<f64>() / count as f64
    } else {
        0.0
    };
    let gain = if variance_m2 > explained_m2 { (1.0 - explained_m2 / variance_m2).sqrt() } else { 0.0 };
    Hidden::Measured { level_m, gain, h_m0_m: 4.0 * variance_m2.sqrt() }
}

/// The band of one unbroken run, as a curve over the same time; `None` if the run is no record.
fn split(times_s: Vec<f64>, values_m: Vec<f64>, samples: usize, interval_s: f64, low_hz: f64, high_hz: f64) -> Option<Spline> {
    let start_s = *times_s.first()?;
    let even_m = Spline::new(times_s, values_m).ok()?.sampled(start_s, interval_s, samples);
    let band_m = band_pass(&Record::new(even_m, 1.0 / interval_s).ok()?, low_hz, high_hz);
    Spline::new((0..samples).map(|i| start_s + i as f64 * interval_s).collect(), band_m).ok()
}
