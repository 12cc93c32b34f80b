//! Each test against a record made for it: what it must find, and what it must leave alone.

use super::super::series::RawSeries;
use super::*;
use std::f64::consts::TAU;

/// Two hundred seconds of a 4 s sine of 0.3 m about `level_m`, five times a second.
fn sine(level_m: f64) -> (Vec<f64>, Vec<f64>) {
    let stamp_s: Vec<f64> = (0..1000).map(|i| 0.2 * f64::from(i)).collect();
    let elevation_m = stamp_s.iter().map(|t| level_m + 0.3 * (TAU * t / 4.0 + 0.3).sin()).collect();
    (stamp_s, elevation_m)
}

fn ordered(stamp_s: &[f64], elevation_m: &[f64]) -> Ordered {
    RawSeries { stamp_s, elevation_m }.ordered().0
}

fn all(series: &mut Ordered) -> Vec<Finding> {
    let limits = ReadingLimits::default();
    vec![
        gap(series, &limits),
        range(series, &limits),
        spike(series, &limits),
        acceleration(series, &limits),
        segment_shift(series, &limits),
        flat_line(series, &limits),
        percent_good(series, &limits),
    ]
}

#[test]
fn a_good_record_passes_all() {
    let (stamp_s, elevation_m) = sine(0.1);
    let mut series = ordered(&stamp_s, &elevation_m);
    for finding in all(&mut series) {
        assert_eq!(finding.flag, Flag::Pass, "{finding:?}");
        assert!(finding.samples.is_empty(), "{finding:?}");
    }
}

#[test]
fn nothing_at_all_is_missing_and_no_panic() {
    for (stamp_s, elevation_m) in [(vec![], vec![]), (vec![1.0], vec![f64::NAN]), (vec![1.0, 2.0], vec![f64::NAN; 2])] {
        for finding in all(&mut ordered(&stamp_s, &elevation_m)) {
            assert_eq!(finding.flag, Flag::Missing, "{finding:?}");
        }
    }
    for n in 1..5 {
        let some: Vec<f64> = (0..n).map(f64::from).collect();
        all(&mut ordered(&some, &some));
        all(&mut ordered(&vec![3.0; some.len()], &some));
    }
}

#[test]
fn gaps_are_counted_whether_readings_are_left_out_or_empty() {
    let (stamp_s, mut elevation_m) = sine(0.0);
    elevation_m[100..102].fill(f64::NAN);
    let finding = gap(&ordered(&stamp_s, &elevation_m), &ReadingLimits::default());
    assert_eq!((finding.flag, finding.samples.as_slice()), (Flag::Pass, &[][..]), "two are no gap");
    elevation_m[200..204].fill(f64::NAN);
    let finding = gap(&ordered(&stamp_s, &elevation_m), &ReadingLimits::default());
    assert_eq!((finding.flag, finding.samples.as_slice()), (Flag::Suspect, &[199, 204][..]));
    let without = |x: &[f64]| [&x[..300], &x[310..]].concat();
    let finding = gap(&ordered(&without(&stamp_s), &without(&elevation_m)), &ReadingLimits::default());
    assert_eq!((finding.flag, finding.samples.as_slice()), (Flag::Fail, &[199, 204, 299, 300][..]));
    assert_eq!(finding.reason, "at most 10 readings missing in a row, in 2 gaps of 3 or more");
}

#[test]
fn spikes_are_rejected_and_the_waves_are_not() {
    let (stamp_s, mut elevation_m) = sine(0.0);
    // One that hides another: the second is beyond four deviations only once the first is gone.
    elevation_m[500] = 30.0;
    elevation_m[700] = -2.0;
    let mut series = ordered(&stamp_s, &elevation_m);
    let finding = spike(&mut series, &ReadingLimits::default());
    assert_eq!((finding.flag, finding.samples.as_slice()), (Flag::Suspect, &[500, 700][..]));
    assert!(!series.readings[500].is_good() && !series.readings[700].is_good());
    assert_eq!(spike(&mut series, &ReadingLimits::default()).flag, Flag::Pass);

    // Six in a row are no spike.
    elevation_m = sine(0.0).1;
    elevation_m[300..306].fill(4.0);
    let mut series = ordered(&stamp_s, &elevation_m);
    let finding = spike(&mut series, &ReadingLimits::default());
    assert_eq!((finding.flag, finding.samples.len()), (Flag::Suspect, 6));
    assert!(series.readings[303].is_good());

    assert_eq!(spike(&mut ordered(&[0.0, 1.0, 2.0], &[0.0, 0.0, 9.0]), &ReadingLimits::default()).flag, Flag::NotEvaluated);
}

/// A sea that grows twentyfold in the last tenth of its record: its crests are beyond six deviations of the whole, and are no spikes; a
/// spike among them is one, and so is one in the calm.
#[test]
fn waves_that_grow_are_no_spikes() {
    let stamp_s: Vec<f64> = (0..6000).map(|i| 0.5 * f64::from(i)).collect();
    let grown = |t: f64| if t > 2960.0 { 1.0 } else { 0.02 };
    let sea = |t: f64| grown(t) * ((TAU * t / 2.7).sin() + 0.4 * (TAU * t / 3.9).sin());
    let mut elevation_m: Vec<f64> = stamp_s.iter().map(|t| sea(*t)).collect();
    let limits = ReadingLimits { spike_sigmas: 6.0, ..ReadingLimits::default() };
    let mut series = ordered(&stamp_s, &elevation_m);
    let finding = spike(&mut series, &limits);
    assert_eq!(series.readings.iter().filter(|r| !r.is_good()).count(), 0, "{finding:?}");
    assert_eq!(finding.flag, Flag::Suspect, "said all the same: {finding:?}");
    elevation_m[1000] = -1.5;
    // Between two crests: among the readings of one it would be of its run, which stays.
    elevation_m[5960] = 9.0;
    let mut series = ordered(&stamp_s, &elevation_m);
    spike(&mut series, &limits);
    let gone: Vec<usize> = series.readings.iter().filter(|r| !r.is_good()).map(|r| r.index).collect();
    assert_eq!(gone, [1000, 5960]);
}

#[test]
fn the_instrument_and_the_place_have_their_ranges() {
    let (stamp_s, mut elevation_m) = sine(7.0);
    elevation_m[10] = 13.0;
    let mut series = ordered(&stamp_s, &elevation_m);
    let finding = range(&mut series, &ReadingLimits::default());
    assert_eq!((finding.flag, finding.samples.as_slice()), (Flag::Suspect, &[10][..]), "six metres above the median");
    assert!(series.readings[10].is_good());
    elevation_m[11] = -400.0;
    let mut series = ordered(&stamp_s, &elevation_m);
    let finding = range(&mut series, &ReadingLimits::default());
    assert_eq!((finding.flag, finding.samples.as_slice()), (Flag::Fail, &[11][..]));
    assert!(!series.readings[11].is_good());
}

/// Lake Superior's level is 183.4 m, Lake Michigan's 176 m (International Great Lakes Datum 1985): water, not an instrument's fault.
#[test]
fn a_level_above_a_datum_is_a_level() {
    let (stamp_s, mut elevation_m) = sine(183.4);
    assert_eq!(range(&mut ordered(&stamp_s, &elevation_m), &ReadingLimits::default()).flag, Flag::Pass);
    elevation_m[11] = 0.0;
    let finding = range(&mut ordered(&stamp_s, &elevation_m), &ReadingLimits::default());
    assert_eq!((finding.flag, finding.samples.as_slice()), (Flag::Fail, &[11][..]));
}

/// A step of s in a sine of amplitude a (deviation a/√2) halfway is s √2/a deviations.
#[test]
fn a_step_of_the_mean_level_is_found_where_it_is() {
    for (step_m, expected) in [(0.05, Flag::Pass), (0.15, Flag::Suspect), (0.4, Flag::Fail)] {
        let (stamp_s, mut elevation_m) = sine(0.0);
        // At 120 s, where a segment of 30 s begins.
        elevation_m[600..].iter_mut().for_each(|x| *x += step_m);
        let finding = segment_shift(&ordered(&stamp_s, &elevation_m), &ReadingLimits::default());
        assert_eq!(finding.flag, expected, "{step_m} {finding:?}");
        assert_eq!(finding.samples, if expected == Flag::Pass { vec![] } else { vec![600] });
    }
    let (stamp_s, elevation_m) = sine(0.0);
    let short = segment_shift(&ordered(&stamp_s[..200], &elevation_m[..200]), &ReadingLimits::default());
    assert_eq!(short.flag, Flag::NotEvaluated);
}

/// a ω² of the sine is 0.74 m/s²; a reading 0.3 m off has 2 × 0.3/0.04 = 15 m/s².
#[test]
fn water_does_not_jump() {
    let (stamp_s, mut elevation_m) = sine(0.0);
    elevation_m[400] += 0.3;
    let mut series = ordered(&stamp_s, &elevation_m);
    let finding = acceleration(&mut series, &ReadingLimits::default());
    assert_eq!((finding.flag, finding.samples.as_slice()), (Flag::Suspect, &[400][..]), "{}", finding.reason);
    // A sine that short and high, all along: 0.3 m in 0.8 s has 18 m/s².
    let steep: Vec<f64> = stamp_s.iter().map(|t| 0.3 * (TAU * t / 0.8 + 0.5).sin()).collect();
    assert_eq!(acceleration(&mut ordered(&stamp_s, &steep), &ReadingLimits::default()).flag, Flag::Fail);
}

/// Measured over a tenth of a second, a centimetre of noise at 60 Hz is no acceleration of the water: 4 × 0.005/0.1² = 2 m/s² at most.
#[test]
fn fast_noise_is_no_acceleration() {
    let stamp_s: Vec<f64> = (0..6000).map(|i| f64::from(i) / 60.0).collect();
    let elevation_m: Vec<f64> = (0..6000).map(|i| if i * 7919 % 13 < 6 { 0.005 } else { -0.005 }).collect();
    let finding = acceleration(&mut ordered(&stamp_s, &elevation_m), &ReadingLimits::default());
    assert_eq!(finding.flag, Flag::Pass, "{}", finding.reason);
}

#[test]
fn a_stuck_instrument_is_flat() {
    let (stamp_s, mut elevation_m) = sine(0.0);
    let value = elevation_m[50];
    elevation_m[50..56].fill(value);
    let finding = flat_line(&ordered(&stamp_s, &elevation_m), &ReadingLimits::default());
    assert_eq!((finding.flag, finding.samples.as_slice()), (Flag::Suspect, &[50, 51, 52, 53, 54, 55][..]));
    elevation_m[50..70].fill(value);
    assert_eq!(flat_line(&ordered(&stamp_s, &elevation_m), &ReadingLimits::default()).flag, Flag::Fail);
}

#[test]
fn the_share_of_good_readings_counts_those_left_out() {
    let (stamp_s, mut elevation_m) = sine(0.0);
    let thinned = |x: &[f64]| x.iter().enumerate().filter(|(i, _)| i % 14 != 5).map(|(_, x)| *x).collect::<Vec<_>>();
    let finding = percent_good(&ordered(&thinned(&stamp_s), &thinned(&elevation_m)), &ReadingLimits::default());
    assert_eq!((finding.flag, finding.reason.as_str()), (Flag::Suspect, "928 good readings of 999 due: 92.9 %"));
    elevation_m[..150].fill(f64::NAN);
    assert_eq!(percent_good(&ordered(&stamp_s, &elevation_m), &ReadingLimits::default()).flag, Flag::Fail);
}
