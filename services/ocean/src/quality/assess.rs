//! All tests of one record, in the manual's order, and the even record that is left.

use super::bulk::{BulkLimits, BulkParameters, bulk_range, steepness};
use super::readings::{ReadingLimits, acceleration, flat_line, gap, percent_good, range, segment_shift, spike};
use super::sampling::{SamplingLimits, sampling_rate};
use super::series::{Even, RawSeries};
use super::spectral::{SpectralLimits, energy_high, energy_low, operational_frequency};
use super::{Finding, Flag};
use crate::welch::{SampledSpectrum, Welch};

/// Every threshold, and how the spectrum is made.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Of readings.
    pub readings: ReadingLimits,
    /// Of the sampling rate.
    pub sampling: SamplingLimits,
    /// Of the spectrum.
    pub spectral: SpectralLimits,
    /// Of the parameters.
    pub bulk: BulkLimits,
    /// Length of the spectrum's segments, seconds. 60: a resolution of 0.025 Hz.
    pub segment_s: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            readings: ReadingLimits::default(),
            sampling: SamplingLimits::default(),
            spectral: SpectralLimits::default(),
            bulk: BulkLimits::default(),
            segment_s: 60.0,
        }
    }
}

/// What is left of a record, and what was found.
#[derive(Debug, Clone, PartialEq)]
pub struct Assessment {
    /// The longest stretch without a failing gap, even, with rejected and missing readings filled in; `None` where too little is left.
    pub even: Option<Even>,
    /// Its spectrum, trend taken off.
    pub spectrum: Option<SampledSpectrum>,
    /// Its parameters; directions unknown.
    pub bulk: Option<BulkParameters>,
    /// Every test's finding, those that passed too.
    pub findings: Vec<Finding>,
}

impl Assessment {
    /// The worst flag of all findings.
    #[must_use]
    pub fn flag(&self) -> Flag {
        Flag::worst(self.findings.iter().map(|finding| finding.flag))
    }

    /// Findings that are not simply passed or untested.
    pub fn complaints(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| !matches!(finding.flag, Flag::Pass | Flag::NotEvaluated))
    }
}

/// Orders, tests, cleans and evens `raw`. Takes any input; what is wrong with it is in the findings.
///
/// Parameters are those of the whole spectrum within the place's frequencies. Tests of history (15, 20) and of slopes (14) need more than
/// one record: call [`super::bulk::mean_and_deviation`], [`super::bulk::rate_of_change`] and [`super::spectral::check_ratio`].
#[must_use]
pub fn assess(raw: RawSeries<'_>, limits: &Limits) -> Assessment {
    let (mut series, stamps) = raw.ordered();
    let readings = &limits.readings;
    let mut findings = vec![stamps, gap(&series, readings)];
    findings.push(range(&mut series, readings));
    findings.push(spike(&mut series, readings));
    findings.push(acceleration(&mut series, readings));
    findings.push(segment_shift(&series, readings));
    findings.push(flat_line(&series, readings));
    findings.push(percent_good(&series, readings));
    // `gap_fail_samples` missing make one more interval than that; half an interval allows for uneven stamps.
    let stretch = series.longest_stretch((readings.gap_fail_samples as f64 + 0.5) * series.interval_s);
    let even = series.even(stretch);
    let spectrum = even.as_ref().and_then(|even| {
        let record = even.record.clone().without_trend();
        Welch::with_segments_of_s(limits.segment_s, &record).spectrum(&record).ok()
    });
    let mut bulk = None;
    if let Some(spectrum) = &spectrum {
        findings.push(sampling_rate(spectrum, &limits.sampling));
        findings.push(operational_frequency(spectrum, &limits.spectral));
        findings.push(energy_low(spectrum, &limits.spectral));
        findings.push(energy_high(spectrum, &limits.spectral));
        let band = &limits.spectral.local_hz;
        bulk = spectrum.statistics(*band.start(), *band.end()).map(|found| BulkParameters {
            h_m0_m: found.h_m0_m,
            t_p_s: found.t_p_s,
            t_m02_s: found.t_m02_s,
            direction_from_rad: f64::NAN,
            spread_rad: f64::NAN,
        });
    }
    if let Some(bulk) = &bulk {
        findings.push(bulk_range(bulk, &limits.bulk));
        findings.push(steepness(bulk, &limits.bulk));
    }
    Assessment { even, spectrum, bulk, findings }
}

#[cfg(test)]
mod tests {
    use super::super::Test;
    use super::super::sampling::tests::sea;
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn stamped(samples_m: &[f64], rate_hz: f64) -> (Vec<f64>, Vec<f64>) {
        ((0..samples_m.len()).map(|i| i as f64 / rate_hz).collect(), samples_m.to_vec())
    }

    fn flag_of(assessment: &Assessment, test: Test) -> Flag {
        assessment.findings.iter().find(|f| f.test == test).unwrap().flag
    }

    #[test]
    fn a_good_sea_passes_every_test_and_is_left_as_it_is() {
        let record = sea(0.3, 2.5, 10.0, 6000);
        let (stamp_s, elevation_m) = stamped(record.samples_m(), 10.0);
        let found = assess(RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m }, &Limits::default());
        assert_eq!(found.flag(), Flag::Pass, "{:?}", found.complaints().collect::<Vec<_>>());
        assert_eq!(found.findings.len(), 14);
        let even = found.even.as_ref().unwrap();
        assert_eq!(even.record.samples_m().len(), 6000);
        for (a, b) in even.record.samples_m().iter().zip(record.samples_m()) {
            assert!((a - b).abs() < 1e-6);
        }
        assert_relative_eq!(found.bulk.unwrap().h_m0_m, 0.3, max_relative = 0.1);
    }

    /// What an ultrasonic probe and a careless logger do to it: the height comes back, and each trouble has its flag.
    #[test]
    fn a_battered_sea_is_mended_and_every_trouble_is_named() {
        let record = sea(0.3, 2.5, 10.0, 6000);
        let (mut stamp_s, mut elevation_m) = stamped(record.samples_m(), 10.0);
        for i in (37..6000).step_by(400) {
            elevation_m[i] = 3.0;
        }
        for i in (11..6000).step_by(100) {
            elevation_m[i] = f64::NAN;
        }
        elevation_m[2000..2004].fill(f64::NAN);
        stamp_s.swap(500, 501);
        elevation_m.swap(500, 501);
        let found = assess(RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m }, &Limits::default());
        assert_eq!(flag_of(&found, Test::Stamps), Flag::Suspect);
        assert_eq!(flag_of(&found, Test::Gap), Flag::Suspect);
        assert_eq!(flag_of(&found, Test::Spike), Flag::Suspect);
        assert_eq!(flag_of(&found, Test::PercentGood), Flag::Pass);
        let spikes: Vec<usize> = (37..6000).step_by(400).collect();
        assert_eq!(found.findings.iter().find(|f| f.test == Test::Spike).unwrap().samples, spikes);
        let even = found.even.unwrap();
        let worst = even.record.samples_m().iter().zip(record.samples_m()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst < 0.03, "{worst}");
        assert_eq!(even.filled.iter().filter(|f| **f).count(), 15 + 60 + 4);
    }

    #[test]
    fn two_readings_a_second_are_too_few_for_short_waves() {
        let record = sea(0.3, 1.3, 2.0, 2000);
        let (stamp_s, elevation_m) = stamped(record.samples_m(), 2.0);
        let found = assess(RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m }, &Limits::default());
        assert_eq!(flag_of(&found, Test::SamplingRate), Flag::Fail);
    }

    #[test]
    fn a_long_gap_cuts_the_record() {
        let record = sea(0.3, 2.5, 10.0, 6000);
        let (mut stamp_s, elevation_m) = stamped(record.samples_m(), 10.0);
        stamp_s[2000..].iter_mut().for_each(|t| *t += 60.0);
        let found = assess(RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m }, &Limits::default());
        assert_eq!(flag_of(&found, Test::Gap), Flag::Fail);
        let even = found.even.unwrap();
        assert_eq!((even.start_s, even.record.samples_m().len()), (260.0, 4000));
    }

    proptest! {
        /// Whatever comes in, an answer comes out, and a record that is there is sound.
        #[test]
        fn any_input_is_survived(
            readings in prop::collection::vec((prop::num::f64::ANY, prop::num::f64::ANY), 0..60),
            plain in prop::collection::vec((-5.0f64..5.0, -1.0f64..1.0), 0..60),
        ) {
            for pairs in [readings, plain] {
                let (stamp_s, elevation_m): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
                let found = assess(RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m }, &Limits::default());
                prop_assert!(!found.findings.is_empty());
                if let Some(even) = found.even {
                    prop_assert!(even.record.samples_m().iter().all(|x| x.is_finite()));
                    prop_assert_eq!(even.filled.len(), even.record.samples_m().len());
                }
            }
        }
    }
}
