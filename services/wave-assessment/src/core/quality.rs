//! Quality tests of the window's readings (QARTOD), as flags.

use halcyon_model::QualityFlag;
use halcyon_ocean::quality::readings::ReadingLimits;
use halcyon_ocean::quality::{Finding, Flag, Limits, RawSeries, Test, assess};

use super::series::Series;

/// Findings that are no reason to distrust the rest: gaps break series, and what is left is judged by itself; bad readings are counted by the
/// check of outliers; how steep the sea is, is what the verdict is about.
const REPORTED_ONLY: [Test; 6] = [Test::Gap, Test::Spike, Test::PercentGood, Test::Stamps, Test::Steepness, Test::BulkRange];

/// Limits of the tests. What is rejected is filled in, and a crest that was real would be lost: an hour at 10 Hz of a Gaussian sea reaches 4.2
/// deviations on average, and 6 once in 14,000 such hours.
pub(crate) fn limits() -> Limits {
    Limits { readings: ReadingLimits { spike_sigmas: 6.0, ..ReadingLimits::default() }, ..Limits::default() }
}

/// What did not pass at the gauge that is shown. Where nothing stands out of the noise (`above_noise`), tests of waves have nothing to test.
pub(crate) fn flags(series: &Series, above_noise: bool) -> Vec<QualityFlag> {
    let Some(slot) = series.shown() else { return Vec::new() };
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
