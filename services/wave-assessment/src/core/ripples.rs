//! Rings that the rotors press into the water below: looked for in the newest grids, reported, and left out of what is read.
//!
//! *What is left out* is water: a disc about the point below, as far as rings make up most of the short waves. A sea is alike everywhere, so that
//! the cells outside tell as much of it as all would, short waves included; they are fewer, and no more than half may go. Where a sea is taken for
//! rings by mistake nothing but some cells is lost.
//!
//! *What is not left out* is a band. Rings are 5 to 40 cm long, and so are real waves that a hull meets: a filter would take both. In time they
//! cannot be told apart either, since they run at 2 to 6 Hz and pairs come more slowly than twice that. Nor are the rings' variances taken off beyond
//! the disc: they are known to some ten percent of all short waves', and what is taken off too much is a real sea made calmer. So rings
//! beyond the disc stay in every estimate, which they can only raise, and fail the test where they are much of it. On cells too coarse
//! to show rings (over 11 cm) they are neither found nor left out: what of them is left in a cell's mean counts as waves.

use std::collections::VecDeque;

use halcyon_model::{ElevationGrid, QualityFlag, Stamp, SurfacePatch};
use halcyon_ocean::quality::downwash::{self, Downwash, DownwashLimits};
use halcyon_ocean::quality::{Flag, Test};

/// They are looked for once in so many seconds of patch time.
const PERIOD_S: f64 = 5.0;
/// At most so large a share of the cells is left out: of what is left, patches must still tell the sea.
const LEFT_OUT_MAX: f64 = 0.5;

/// Rings about the point below the vehicle, as far as they are known.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Ripples {
    looked: Option<Stamp>,
    /// Radii within which rings were most of the short waves, metres, with the patch time of each. A vehicle that hovers makes rings all the time,
    /// and a gauge at the edge of a disc that comes and goes would have no unbroken series: the widest counts for as long as it is in the window.
    discs: VecDeque<(Stamp, f64)>,
    found: Option<QualityFlag>,
}

impl Ripples {
    /// Looks for them in `grids`, the newest last, if it is time. What was found longer than `window_s` ago is forgotten.
    pub(crate) fn look(&mut self, grids: &VecDeque<ElevationGrid>, newest: Stamp, window_s: f64) {
        let is_fresh = |at: Stamp| (0.0..PERIOD_S).contains(&newest.seconds_since(at));
        if self.looked.is_some_and(is_fresh) {
            return;
        }
        self.looked = Some(newest);
        self.discs.retain(|(at, _)| (0.0..=window_s).contains(&newest.seconds_since(*at)));
        let Some(all) = detected(grids, None).filter(is_found) else {
            let before =
                |radius_m| format!("no rings are seen now; left out within {radius_m:.2} m of the point below since some were");
            self.found = self.radius_m().map(|radius_m| flag(false, before(radius_m)));
            return;
        };
        if let Some(radius_m) = grids.back().and_then(|grid| radius_m(&all, grid)) {
            self.discs.push_back((newest, radius_m));
        }
        let text = &all.finding.reason;
        let rest = self.radius_m().map(|radius_m| (radius_m, detected(grids, Some(radius_m))));
        let (failed, text) = match rest {
            None => (all.finding.flag == Flag::Fail, format!("{text}; nothing is left out")),
            // What cannot be judged without the disc is judged with it.
            Some((_, None)) => (all.finding.flag == Flag::Fail, text.clone()),
            Some((radius_m, Some(rest))) => {
                let (judged, beyond) = match rest.finding.flag {
                    Flag::NotEvaluated => (&all, "what is beyond cannot be judged".into()),
                    _ => (&rest, format!("beyond rings hold {:.0} % of all", 100.0 * rest.ring_share_of_all)),
                };
                let failed = judged.finding.flag == Flag::Fail;
                (failed, format!("{text}; left out within {radius_m:.2} m of it, {beyond}"))
            }
        };
        self.found = Some(flag(failed, text));
    }

    /// What was found when they were last looked for, and what is left out.
    pub(crate) fn flag(&self) -> Option<QualityFlag> {
        self.found.clone()
    }

    /// How far about the point below water is left out, metres.
    pub(crate) fn radius_m(&self) -> Option<f64> {
        self.discs.iter().map(|(_, radius_m)| *radius_m).reduce(f64::max)
    }
}

fn flag(failed: bool, text: String) -> QualityFlag {
    QualityFlag { test: Test::Downwash.name().into(), failed, text }
}

fn is_found(found: &Downwash) -> bool {
    matches!(found.finding.flag, Flag::Suspect | Flag::Fail)
}

/// What the newest grids of one shape show about their middle, where the vehicle is; without what lies within `left_out_m` of it. `None` where
/// cells are too coarse for rings, or too little was seen.
fn detected(grids: &VecDeque<ElevationGrid>, left_out_m: Option<f64>) -> Option<Downwash> {
    let newest = grids.back()?;
    let (columns, rows) = (newest.cols as usize, newest.rows as usize);
    let alike = |grid: &&ElevationGrid| (grid.rows, grid.cols, grid.cell_m) == (newest.rows, newest.cols, newest.cell_m);
    let elevation_m = |grid: &ElevationGrid| -> Vec<f64> {
        let cells = grid.elevation_m.iter().enumerate();
        let left_out_m = left_out_m.map_or(0.0, |radius_m| bounded_m(grid, radius_m));
        let is_out = |i: usize| from_middle_m(grid, i) < left_out_m;
        cells.map(|(i, z)| if is_out(i) { f64::NAN } else { f64::from(*z) }).collect()
    };
    let cells: Vec<Vec<f64>> = grids.iter().filter(alike).map(elevation_m).collect();
    let frames: Vec<downwash::ElevationGrid<'_>> =
        cells.iter().map(|elevation_m| downwash::ElevationGrid { elevation_m, columns, cell_m: newest.cell_m }).collect();
    let middle_m = [columns, rows].map(|cells| 0.5 * (cells as f64 - 1.0) * newest.cell_m);
    // Pairs come far slower than ripples run: no direction is asked for.
    downwash::detect(&frames, f64::NAN, middle_m, &DownwashLimits::default()).ok()
}

/// How far rings are most of the short waves without a break, or as far as water may be left out; `None` where they are most of them nowhere.
fn radius_m(found: &Downwash, grid: &ElevationGrid) -> Option<f64> {
    let limits = DownwashLimits::default();
    let rippled_m = found.bins.iter().take_while(|bin| bin.share >= limits.mask_share).last()?.to_m;
    Some(bounded_m(grid, rippled_m))
}

/// `radius_m`, or what holds as many of the cells seen as may be left out: a vehicle that has come down sees less water than it did.
fn bounded_m(grid: &ElevationGrid, radius_m: f64) -> f64 {
    let seen = grid.elevation_m.iter().enumerate().filter(|(_, z)| z.is_finite());
    let mut away_m: Vec<f64> = seen.map(|(i, _)| from_middle_m(grid, i)).collect();
    let most = (LEFT_OUT_MAX * away_m.len() as f64) as usize;
    if most >= away_m.len() {
        return 0.0;
    }
    let (_, most_m, _) = away_m.select_nth_unstable_by(most, f64::total_cmp);
    radius_m.min(*most_m)
}

/// How far a cell is from the grid's middle, metres.
fn from_middle_m(grid: &ElevationGrid, index: usize) -> f64 {
    let cols = grid.cols as usize;
    let away = |at: usize, count: u32| (at as f64 - 0.5 * (f64::from(count) - 1.0)) * grid.cell_m;
    away(index / cols, grid.rows).hypot(away(index % cols, grid.cols))
}

/// `patch` as if nothing had been seen within `radius_m` of its middle, half of its cells at most. Its coverage, which is a matter of the measurement, stays.
pub(crate) fn without_disc(patch: &SurfacePatch, radius_m: f64) -> SurfacePatch {
    let mut rest = patch.clone();
    let radius_m = bounded_m(&patch.grid, radius_m);
    for (i, elevation_m) in rest.grid.elevation_m.iter_mut().enumerate() {
        if from_middle_m(&patch.grid, i) < radius_m {
            *elevation_m = f32::NAN;
        }
    }
    rest
}

#[cfg(test)]
mod tests;
