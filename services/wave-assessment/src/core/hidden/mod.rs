//! What a single patch cannot know of the waves: how they lift it as a whole, and how they tilt it.
//!
//! A grid is relative to its patch's own mean level, which rises and falls with waves longer than the footprint. Two witnesses know
//! of that. The level itself, by the height of the camera: an autopilot's, which wanders by centimetres, or that of a rig that
//! stands still. And how the patch is bent (see [`bend`]), by the waves' own dispersion: sharp for waves of a few footprints, useless
//! for long ones. A grid's tilt is as uncertain as the autopilot's attitude. Over a window all of this is told apart by frequency (see
//! [`splitter`]); it never makes water look calmer than it could be.

mod bend;
mod response;
mod run;
mod splitter;

use std::f64::consts::TAU;

pub(crate) use bend::Bend;
use halcyon_model::LocalPoint;
use halcyon_ocean::Depth;
use halcyon_ocean::dispersion::{angular_frequency_radps, wavenumber_radpm};
use response::bend_of_residual_per_m4;
use run::Run;
use splitter::{Shape, Splitter};

use super::series::{median, runs};
use super::window::{Frame, Window};
use crate::config::Config;

/// Least share of frames with a level, or a bend, for it to be used; the others are then left out.
const KNOWN_MIN: f64 = 0.9;
/// A frame whose mean square stands out from both neighbours by so many medians is a spike: a patch that sees one point of a wave reaches 25 at 3.4
/// deviations.
const SPIKE_SQUARE: f64 = 25.0;
/// The cells' own errors are wrong by this share.
const OWN_DOUBT: f64 = 0.1;

/// What may be waves in the level and the tilt of patches.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Hidden {
    /// Measured.
    Measured {
        /// For each frame of the window; `None` where its level is missing.
        frames: Vec<Option<HiddenFrame>>,
        /// 4 √variance of all of the level that may be waves, metres.
        h_m0_m: f64,
    },
    /// Nothing is known of the level.
    Unknown,
}

/// The hidden part of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HiddenFrame {
    /// What is believed to be waves.
    waves: Motion,
    /// All that could be.
    all: Motion,
}

/// How far a patch as a whole is lifted, metres, and tilted, rise over run east and north; `None` where the grid's tilt must do.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Motion {
    level_m: f64,
    slope: Option<[f64; 2]>,
}

impl Motion {
    /// What it adds to the grid's elevation at `place`, metres.
    fn at(&self, frame: &Frame, place: LocalPoint) -> f64 {
        // The grid's own tilt gives way to the one that was found over the whole window.
        let tilt_m = match (&frame.bend, self.slope) {
            (Some(bend), Some([east, north])) => {
                (east - bend.grid_slope[0]) * (place.east_m - bend.middle.east_m)
                    + (north - bend.grid_slope[1]) * (place.north_m - bend.middle.north_m)
            }
            _ => 0.0,
        };
        self.level_m + tilt_m
    }
}

impl Hidden {
    /// Whether frame `index` has no level, though others have.
    pub(crate) fn is_missing(&self, index: usize) -> bool {
        matches!(self, Self::Measured { frames, .. } if frames[index].is_none())
    }

    /// What to add to the elevation that `frame`, the `index`th, has at `place`, metres: of waves, and of all that could be.
    pub(crate) fn at(&self, index: usize, frame: &Frame, place: LocalPoint) -> (f64, f64) {
        match self {
            Self::Measured { frames, .. } => {
                frames[index].map_or((0.0, 0.0), |hidden| (hidden.waves.at(frame, place), hidden.all.at(frame, place)))
            }
            Self::Unknown => (0.0, 0.0),
        }
    }
}

/// Variance of the elevation over all cells of all frames, m², less the cells' own errors: of the same waves as the gauges', from every cell, and
/// whatever holes there are. `None` without levels or bends.
pub(crate) fn whole_m2(window: &Window, hidden: &Hidden) -> Option<f64> {
    let Hidden::Measured { frames: found, .. } = hidden else { return None };
    let of = |(frame, hidden): (&Frame, &Option<HiddenFrame>)| {
        let (bend, hidden) = (frame.bend.as_ref()?, hidden.as_ref()?);
        let tilt = hidden.waves.slope.map_or([0.0; 2], |[east, north]| [east - bend.grid_slope[0], north - bend.grid_slope[1]]);
        Some(bend.square_with_m2(hidden.waves.level_m, tilt) - bend.own_m2)
    };
    let squares_m2: Vec<f64> = window.frames().iter().zip(found).filter_map(of).collect();
    if squares_m2.is_empty() {
        return None;
    }
    let spike_m2 = SPIKE_SQUARE * median(squares_m2.clone()).max(0.0);
    let is_spike = |i: usize| {
        let neighbours = [i.checked_sub(1), Some(i + 1)].into_iter().flatten().filter_map(|j| squares_m2.get(j));
        squares_m2[i] > spike_m2 && neighbours.into_iter().all(|beside| squares_m2[i] - beside > spike_m2)
    };
    let (sum_m2, count) =
        (0..squares_m2.len()).filter(|i| !is_spike(*i)).fold((0.0, 0.0), |(sum, count), i| (sum + squares_m2[i], count + 1.0));
    (count > 0.0).then(|| sum_m2 / count)
}

/// Splits levels and tilts of `window`.
pub(crate) fn hidden(window: &Window, config: &Config, interval_s: f64) -> Hidden {
    let frames = window.frames();
    let count = frames.len();
    let known = |of: &dyn Fn(&Frame) -> bool| frames.iter().filter(|f| of(f)).count() as f64 >= KNOWN_MIN * count as f64;
    // A rig that stands still knows its level by its distance to the water, without an autopilot between.
    let with_levels = count > 0 && known(&|f| f.level_m.is_some());
    if !with_levels && !config.fixed_rig {
        return Hidden::Unknown;
    }
    let level = |f: &Frame| if with_levels { f.level_m } else { Some(-f.distance_m) };
    let with_bends = known(&|f| f.bend.is_some());
    let splitter = splitter(window, config, interval_s, with_levels);

    let mut hidden = vec![None; count];
    let stamps_s: Vec<(usize, f64)> = frames
        .iter()
        .enumerate()
        .filter(|(_, f)| level(f).is_some() && (f.bend.is_some() || !with_bends))
        .map(|(i, f)| (i, f.stamp.seconds_since(frames[0].stamp)))
        .collect();
    for run in runs(&stamps_s, config.gap_s_max.max(2.0 * interval_s)) {
        let Some(run) = Run::new(run, interval_s) else { continue };
        let Some(levels) = run.even(run.frames.iter().filter_map(|i| level(&frames[*i])).collect()) else { continue };
        let bends: Vec<&Bend> = run.frames.iter().filter_map(|i| frames[*i].bend.as_ref()).collect();
        let shape = if with_bends {
            let series = |of: &dyn Fn(&Bend) -> f64| run.even(bends.iter().map(|bend| of(bend)).collect());
            let (bend, east, north) = (series(&|b| b.half_laplacian_per_m), series(&|b| b.slope[0]), series(&|b| b.slope[1]));
            bend.zip(east.zip(north)).map(|(bend, (east, north))| Shape { bend, slopes: [east, north] })
        } else {
            None
        };
        let (waves, all) = splitter.split_level(&levels, shape.as_ref());
        let (Some(waves), Some(all)) = (run.back(waves), run.back(all)) else { continue };
        // A grid whose attitude nobody doubts is tilted as the water is.
        let slopes = shape.as_ref().filter(|_| splitter.slope_noise > 0.0).and_then(|shape| {
            let [waves, all] = splitter.split_slopes(shape);
            let both = |[east, north]: [Vec<f64>; 2]| Some([run.back(east)?, run.back(north)?]);
            Some((both(waves)?, both(all)?))
        });
        for (at, i) in run.frames.iter().enumerate() {
            let slope = |of: &[Vec<f64>; 2]| [of[0][at], of[1][at]];
            hidden[*i] = Some(HiddenFrame {
                waves: Motion { level_m: waves[at], slope: slopes.as_ref().map(|(waves, _)| slope(waves)) },
                all: Motion { level_m: all[at], slope: slopes.as_ref().map(|(_, all)| slope(all)) },
            });
        }
    }

    let levels: Vec<f64> = hidden.iter().flatten().map(|hidden: &HiddenFrame| hidden.all.level_m).collect();
    if levels.is_empty() {
        return Hidden::Unknown;
    }
    let variance_m2 = levels.iter().map(|x| x * x).sum::<f64>() / levels.len() as f64;
    Hidden::Measured { frames: hidden, h_m0_m: 4.0 * variance_m2.sqrt() }
}

/// What a window says of bands and noises.
fn splitter(window: &Window, config: &Config, interval_s: f64, with_levels: bool) -> Splitter {
    let frames = window.frames();
    let mean = |of: &dyn Fn(&Frame) -> f64| frames.iter().map(of).sum::<f64>() / frames.len().max(1) as f64;
    let bends: Vec<&Bend> = frames.iter().filter_map(|f| f.bend.as_ref()).collect();
    let bend_mean = |of: &dyn Fn(&Bend) -> f64| bends.iter().map(|bend| of(bend)).sum::<f64>() / bends.len().max(1) as f64;
    let level_noise_m2 = match (with_levels, config.fixed_rig) {
        // A deviation that nobody states explains everything.
        (true, false) => mean(&|f| f.level_sigma_m.map_or(f64::INFINITY, |s| s * s)),
        (true, true) => mean(&|f| f.level_sigma_m.map_or(0.0, |s| s * s)),
        (false, _) => 0.0,
    };
    let sides_m = [bend_mean(&|b| b.sides_m[0]), bend_mean(&|b| b.sides_m[1])];
    // Waves too fast for the rate of the pairs appear at any frequency, and what they bend is then no measure of a long wave. A
    // parabola leaves a residual of them, which tells how much there is.
    let nyquist_radpm = wavenumber_radpm(std::f64::consts::PI / interval_s, Depth::DEEP);
    let ripple_m2 = (bend_mean(&|b| b.residual_m2) - bend_mean(&|b| b.own_m2) * (1.0 + OWN_DOUBT)).max(0.0);
    let ripple_noise_per_m2 = if ripple_m2 > 0.0 { ripple_m2 * bend_of_residual_per_m4(nyquist_radpm, sides_m) } else { 0.0 };
    Splitter {
        // Waves half as long as the footprint average out over it; deep water has the fastest, so none is missed in shallow.
        high_hz: angular_frequency_radps(TAU / (0.5 * mean(&|f| f.footprint_m)), Depth::DEEP) / TAU,
        low_hz: if config.fixed_rig { 0.0 } else { config.wave_hz_min },
        level_noise_m2,
        bend_noise_per_m2: bend_mean(&|b| b.sigma_per_m.powi(2)) + ripple_noise_per_m2,
        slope_noise: 2.0 * mean(&|f| f.attitude_sigma_rad.powi(2)),
        sides_m,
    }
}
