//! Quality tests of the window's readings (QARTOD) and of its newest grids (rotor ripples), as flags.

use halcyon_model::QualityFlag;
use halcyon_ocean::quality::downwash::{self, DownwashLimits};
use halcyon_ocean::quality::readings::ReadingLimits;
use halcyon_ocean::quality::{Finding, Flag, Limits, RawSeries, Test, assess};

use super::gauge::CENTRE;
use super::series::Series;
use super::window::Window;

/// Findings that are no reason to distrust the rest: gaps break series, and what is left is judged by itself; bad readings are counted by the
/// check of outliers; how steep the sea is, is what the verdict is about.
const REPORTED_ONLY: [Test; 6] = [Test::Gap, Test::Spike, Test::PercentGood, Test::Stamps, Test::Steepness, Test::BulkRange];

/// Limits of the tests. What is rejected is filled in, and a crest that was real would be lost: an hour at 10 Hz of a Gaussian sea reaches 4.2
/// deviations on average, and 6 once in 14,000 such hours.
pub(crate) fn limits() -> Limits {
    Limits { readings: ReadingLimits { spike_sigmas: 6.0, ..ReadingLimits::default() }, ..Limits::default() }
}

/// What did not pass at the central gauge, or at the one that saw the most where that one saw less than half of it. Where nothing stands out
/// of the noise (`above_noise`), tests of waves have nothing to test.
pub(crate) fn flags(series: &Series, above_noise: bool) -> Vec<QualityFlag> {
    let samples = |slot: usize| series.stretches.iter().filter(|s| s.slot == slot).map(|s| s.times_s.len()).sum::<usize>();
    let Some(best) = series.stretches.iter().map(|s| s.slot).max_by_key(|slot| samples(*slot)) else { return Vec::new() };
    let slot = if 2 * samples(CENTRE) >= samples(best) { CENTRE } else { best };
    let of_slot = || series.stretches.iter().filter(|s| s.slot == slot);
    let stamp_s: Vec<f64> = of_slot().flat_map(|s| &s.times_s).copied().collect();
    let elevation_m: Vec<f64> = of_slot().flat_map(|s| &s.raw_m).copied().collect();
    let found = assess(RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m }, &limits());
    found.complaints().filter(|finding| above_noise || !of_waves(finding.test)).map(flag).collect()
}

fn flag(finding: &Finding) -> QualityFlag {
    QualityFlag {
        test: finding.test.name().into(),
        failed: matches!(finding.flag, Flag::Fail) && !REPORTED_ONLY.contains(&finding.test),
        text: finding.reason.clone(),
    }
}

/// Whether the newest grids show rings about their middle, where the vehicle is: its rotors' ripples, and no waves. `None` where they do not,
/// where cells are too coarse for ripples, or too little was seen.
pub(crate) fn downwash(window: &Window) -> Option<QualityFlag> {
    let newest = window.grids().back()?;
    let (columns, rows) = (newest.cols as usize, newest.rows as usize);
    let alike =
        |grid: &&halcyon_model::ElevationGrid| (grid.rows, grid.cols, grid.cell_m) == (newest.rows, newest.cols, newest.cell_m);
    let cells: Vec<Vec<f64>> =
        window.grids().iter().filter(alike).map(|grid| grid.elevation_m.iter().map(|z| f64::from(*z)).collect()).collect();
    let frames: Vec<downwash::ElevationGrid<'_>> =
        cells.iter().map(|elevation_m| downwash::ElevationGrid { elevation_m, columns, cell_m: newest.cell_m }).collect();
    let middle_m = [columns, rows].map(|cells| 0.5 * (cells as f64 - 1.0) * newest.cell_m);
    // Pairs come far slower than ripples run: no direction is asked for.
    let found = downwash::detect(&frames, f64::NAN, middle_m, &DownwashLimits::default()).ok()?;
    matches!(found.finding.flag, Flag::Suspect | Flag::Fail).then(|| flag(&found.finding))
}

/// Whether a test is of waves, and not of readings.
fn of_waves(test: Test) -> bool {
    matches!(
        test,
        Test::SamplingRate
            | Test::OperationalFrequency
            | Test::EnergyLow
            | Test::EnergyHigh
            | Test::BulkRange
            | Test::Steepness
            | Test::SegmentShift
    )
}
