//! QARTOD's tests of single readings: gap, spike, range, segment shift, acceleration (9 to 13), flat line (16), percent good.
//!
//! Those that reject readings set them to NaN in the [`Ordered`] series, so that the tests after them do not see them; all
//! name the readings concerned. Each test is one pass, or a bounded number of passes, over the readings.

use std::ops::RangeInclusive;

use super::series::{Ordered, Reading};
use super::{Finding, Flag, Test};
use crate::dispersion::GRAVITY_MPS2;

/// Thresholds of the tests of readings.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadingLimits {
    /// This many readings missing in a row are suspect. 3: a wave is sampled five times or more, and loses its crest.
    pub gap_suspect_samples: usize,
    /// This many fail, and the record is cut there. 8.
    pub gap_fail_samples: usize,
    /// What the instrument can give about the median, metres; what is outside fails and is rejected. −20 to 20 m. About the median, for levels
    /// are counted from data: a lake's is 174 m.
    pub instrument_m: RangeInclusive<f64>,
    /// What the place can give about the median, metres; outside is suspect, and kept. −5 to 5 m.
    pub local_m: RangeInclusive<f64>,
    /// A spike is this many standard deviations from the mean. 4, as the manual and CDIP have it.
    pub spike_sigmas: f64,
    /// How often spikes are looked for, each time without those found before. 3.
    pub spike_passes: usize,
    /// More readings than this in a row are no spike: they stay, suspect. 3.
    pub spike_run_samples_max: usize,
    /// This share of rejected readings fails the spike and acceleration tests. 0.1.
    pub rejected_fail_share: f64,
    /// Length of a segment whose mean is compared with the next, seconds. 30: several waves.
    pub shift_segment_s: f64,
    /// A step between two means, in standard deviations about the segments' means, that is suspect. 0.5.
    pub shift_suspect_sigmas: f64,
    /// One that fails. 1.
    pub shift_fail_sigmas: f64,
    /// Accelerations beyond this many g are rejected. 0.5: the highest wave of Stokes's kind has half of gravity at its crest.
    pub acceleration_g: f64,
    /// Time over which they are measured where readings come faster, seconds; noise would drown them else. 0.1.
    pub acceleration_step_s: f64,
    /// Readings no further apart than this are the same, metres. 10⁻⁹: bit for bit but for rounding.
    pub flat_tolerance_m: f64,
    /// So many same readings in a row are suspect. 5.
    pub flat_suspect_samples: usize,
    /// So many fail. 15.
    pub flat_fail_samples: usize,
    /// A smaller share of good readings is suspect. 0.95.
    pub good_suspect_share: f64,
    /// A smaller one fails. 0.9, as CDIP has it.
    pub good_fail_share: f64,
}

impl Default for ReadingLimits {
    fn default() -> Self {
        Self {
            gap_suspect_samples: 3,
            gap_fail_samples: 8,
            instrument_m: -20.0..=20.0,
            local_m: -5.0..=5.0,
            spike_sigmas: 4.0,
            spike_passes: 3,
            spike_run_samples_max: 3,
            rejected_fail_share: 0.1,
            shift_segment_s: 30.0,
            shift_suspect_sigmas: 0.5,
            shift_fail_sigmas: 1.0,
            acceleration_g: 0.5,
            acceleration_step_s: 0.1,
            flat_tolerance_m: 1e-9,
            flat_suspect_samples: 5,
            flat_fail_samples: 15,
            good_suspect_share: 0.95,
            good_fail_share: 0.9,
        }
    }
}

fn nothing(test: Test) -> Finding {
    Finding::new(test, Flag::Missing, "no reading has an elevation")
}

fn good(series: &Ordered) -> impl Iterator<Item = &Reading> + Clone {
    series.readings.iter().filter(|reading| reading.is_good())
}

/// Mean, standard deviation and number of the good readings.
fn moments(series: &Ordered) -> (f64, f64, usize) {
    let count = good(series).count();
    let mean_m = good(series).map(|r| r.elevation_m).sum::<f64>() / count as f64;
    let variance_m2 = good(series).map(|r| (r.elevation_m - mean_m).powi(2)).sum::<f64>() / count as f64;
    (mean_m, variance_m2.sqrt(), count)
}

/// Takes the elevations away at these places; the readings' own indices.
fn reject(series: &mut Ordered, places: &[usize]) -> Vec<usize> {
    let mut indices = Vec::with_capacity(places.len());
    for place in places {
        if let Some(reading) = series.readings.get_mut(*place) {
            reading.elevation_m = f64::NAN;
            indices.push(reading.index);
        }
    }
    indices
}

/// Test 9: readings missing in a row, whether left out or without an elevation. Names the readings before and after each gap.
#[must_use]
pub fn gap(series: &Ordered, limits: &ReadingLimits) -> Finding {
    let mut present = good(series);
    let Some(mut before) = present.next() else { return nothing(Test::Gap) };
    let suspect = limits.gap_suspect_samples as f64;
    let (mut longest, mut around) = (0.0_f64, Vec::new());
    for after in present {
        let steps = (after.stamp_s - before.stamp_s) / series.interval_s;
        // Rounding is slow; nearly all steps are one interval.
        if steps >= 1.5 || suspect < 1.0 {
            let missing = steps.round() - 1.0;
            longest = longest.max(missing);
            if missing >= suspect {
                around.extend([before.index, after.index]);
            }
        }
        before = after;
    }
    let reason =
        format!("at most {longest:.0} readings missing in a row, in {} gaps of {suspect:.0} or more", around.len() / 2);
    Finding::new(Test::Gap, Flag::rising(longest, suspect, limits.gap_fail_samples as f64), reason).about(around)
}

/// Test 11: what the instrument cannot give is rejected and fails; what the place does not give is suspect.
pub fn range(series: &mut Ordered, limits: &ReadingLimits) -> Finding {
    let mut values_m: Vec<f64> = good(series).map(|r| r.elevation_m).collect();
    if values_m.is_empty() {
        return nothing(Test::Range);
    }
    let middle = values_m.len() / 2;
    let median_m = *values_m.select_nth_unstable_by(middle, f64::total_cmp).1;
    fn outside(series: &Ordered, inside: impl Fn(f64) -> bool) -> Vec<usize> {
        let of = |(place, reading): (usize, &Reading)| (reading.is_good() && !inside(reading.elevation_m)).then_some(place);
        series.readings.iter().enumerate().filter_map(of).collect()
    }
    let impossible = outside(series, |x| limits.instrument_m.contains(&(x - median_m)));
    let rejected = reject(series, &impossible);
    if !rejected.is_empty() {
        let reason = format!(
            "{} readings outside {:?} m about the median of {median_m:.3} m, what the instrument can give",
            rejected.len(),
            limits.instrument_m
        );
        return Finding::new(Test::Range, Flag::Fail, reason).about(rejected);
    }
    let unlikely = outside(series, |x| limits.local_m.contains(&(x - median_m)));
    let indices: Vec<usize> = unlikely.iter().map(|i| series.readings[*i].index).collect();
    let flag = if indices.is_empty() { Flag::Pass } else { Flag::Suspect };
    let reason = format!("{} readings outside {:?} m about the median of {median_m:.3} m", indices.len(), limits.local_m);
    Finding::new(Test::Range, flag, reason).about(indices)
}

/// Test 10: readings far from the mean, alone or a few in a row, are rejected. Names them, and those that stay: of longer runs, and of what
/// is continuous, as a wave is, or no further out than the water about it moves ([`is_wave`]).
pub fn spike(series: &mut Ordered, limits: &ReadingLimits) -> Finding {
    let (_, _, count) = moments(series);
    if count == 0 {
        return nothing(Test::Spike);
    }
    // Of n readings none can be further than √(n − 1) deviations from their mean.
    if (count as f64) < limits.spike_sigmas.powi(2) + 2.0 {
        let reason = format!("{count} readings are too few for one to stand out by {} deviations", limits.spike_sigmas);
        return Finding::new(Test::Spike, Flag::NotEvaluated, reason);
    }
    let mut rejected = Vec::new();
    let mut runs_too_long = Vec::new();
    for _ in 0..limits.spike_passes.max(1) {
        let (mean_m, sigma_m, _) = moments(series);
        // Rounding alone makes the deviation of a constant differ from zero.
        let far = |r: &Reading| {
            sigma_m > 1e-12 * (1.0 + mean_m.abs()) && (r.elevation_m - mean_m).abs() >= limits.spike_sigmas * sigma_m
        };
        let outside: Vec<usize> =
            (0..series.readings.len()).filter(|i| series.readings[*i].is_good() && far(&series.readings[*i])).collect();
        runs_too_long.clear();
        let mut short = Vec::new();
        for run in outside.chunk_by(|a, b| a + 1 == *b) {
            let stays = run.len() > limits.spike_run_samples_max || is_wave(series, run, mean_m, limits);
            if stays { &mut runs_too_long } else { &mut short }.extend_from_slice(run);
        }
        if short.is_empty() {
            break;
        }
        rejected.extend(reject(series, &short));
    }
    let share = rejected.len() as f64 / count as f64;
    let flag = match rejected.len() + runs_too_long.len() {
        0 => Flag::Pass,
        _ if share >= limits.rejected_fail_share => Flag::Fail,
        _ => Flag::Suspect,
    };
    let reason = format!(
        "{} spikes beyond {} deviations rejected, {} such readings in longer runs or waves kept",
        rejected.len(),
        limits.spike_sigmas,
        runs_too_long.len()
    );
    rejected.extend(runs_too_long.iter().map(|place| series.readings[*place].index));
    Finding::new(Test::Spike, flag, reason).about(rejected)
}

/// Whether a few readings far from the mean of the record are water: the readings to both sides lie on their side of the mean and a third
/// as far out (a sine of six samples a period has half), or the readings of a quarter of a minute before or after move so much that these do
/// not stand out, as where a sea grows. Of those a few spikes do not change the scale, which is that of a normal distribution by the median.
fn is_wave(series: &Ordered, run: &[usize], mean_m: f64, limits: &ReadingLimits) -> bool {
    const NEIGHBOUR_SHARE: f64 = 1.0 / 3.0;
    const AROUND_S: f64 = 15.0;
    const READINGS_MIN: usize = 16;
    const SIGMA_OVER_MEDIAN: f64 = 1.4826;
    let (Some(&first), Some(&last)) = (run.first(), run.last()) else { return false };
    let off_m = |place: usize| series.readings.get(place).filter(|r| r.is_good()).map(|r| r.elevation_m - mean_m);
    let furthest = run.iter().filter_map(|place| off_m(*place)).fold(0.0_f64, |a, b| if b.abs() > a.abs() { b } else { a });
    let beside = [first.checked_sub(1), last.checked_add(1)];
    // Beyond a gap is no neighbour.
    let near = |place: usize, of: usize| {
        (series.readings[place].stamp_s - series.readings[of].stamp_s).abs() < 1.5 * series.interval_s
    };
    let follows = |place: Option<usize>, of: usize| {
        place.is_some_and(|place| off_m(place).is_some_and(|x| x / furthest >= NEIGHBOUR_SHARE) && near(place, of))
    };
    if follows(beside[0], first) && follows(beside[1], last) {
        return true;
    }
    let (from_s, to_s) = (series.readings[first].stamp_s - AROUND_S, series.readings[last].stamp_s + AROUND_S);
    let before = series.readings[..first].iter().rev().take_while(|r| r.stamp_s >= from_s);
    let after = series.readings[last + 1..].iter().take_while(|r| r.stamp_s <= to_s);
    let off = |r: &Reading| r.is_good().then_some((r.elevation_m - mean_m).abs());
    // Either side: where a sea begins to grow there is calm before, and where a record ends there is nothing after.
    [before.filter_map(off).collect(), after.filter_map(off).collect()].into_iter().any(|mut side_m: Vec<f64>| {
        let middle = side_m.len() / 2;
        side_m.len() >= READINGS_MIN
            && furthest.abs()
                < limits.spike_sigmas * SIGMA_OVER_MEDIAN * *side_m.select_nth_unstable_by(middle, f64::total_cmp).1
    })
}

/// Test 12: steps between the means of successive segments, against the deviation about these means. Names the first reading after
/// each step. A segment holds at least eight good readings.
#[must_use]
pub fn segment_shift(series: &Ordered, limits: &ReadingLimits) -> Finding {
    const READINGS_MIN: usize = 8;
    let Some(start_s) = good(series).next().map(|r| r.stamp_s) else { return nothing(Test::SegmentShift) };
    let segment = |r: &Reading| ((r.stamp_s - start_s) / limits.shift_segment_s).floor();
    let present: Vec<(f64, &Reading)> = good(series).map(|r| (segment(r), r)).collect();
    let end_s = present.last().map_or(start_s, |(_, r)| r.stamp_s) + series.interval_s;
    // Only whole segments: part of a wave has a mean of its own.
    let whole = ((end_s - start_s) / limits.shift_segment_s + 1e-6).floor();
    let means: Vec<(f64, f64, usize)> = present
        .chunk_by(|a, b| a.0 == b.0)
        .filter(|readings| readings.len() >= READINGS_MIN && readings[0].0 < whole)
        .map(|readings| {
            let mean_m = readings.iter().map(|(_, r)| r.elevation_m).sum::<f64>() / readings.len() as f64;
            let square_m2 = readings.iter().map(|(_, r)| (r.elevation_m - mean_m).powi(2)).sum::<f64>() / readings.len() as f64;
            (mean_m, square_m2, readings[0].1.index)
        })
        .collect();
    if means.len() < 2 {
        let reason = format!("fewer than two segments of {} s", limits.shift_segment_s);
        return Finding::new(Test::SegmentShift, Flag::NotEvaluated, reason);
    }
    let sigma_m = (means.iter().map(|m| m.1).sum::<f64>() / means.len() as f64).sqrt();
    let in_sigmas = |w: &[(f64, f64, usize)]| {
        let step_m = (w[1].0 - w[0].0).abs();
        if step_m > 1e-12 * (1.0 + w[0].0.abs()) { step_m / sigma_m } else { 0.0 }
    };
    let largest = means.windows(2).map(in_sigmas).fold(0.0, f64::max);
    let after: Vec<usize> = means.windows(2).filter(|w| in_sigmas(w) >= limits.shift_suspect_sigmas).map(|w| w[1].2).collect();
    let reason = format!("the mean level steps by at most {largest:.2} standard deviations ({sigma_m:.4} m)");
    Finding::new(Test::SegmentShift, Flag::rising(largest, limits.shift_suspect_sigmas, limits.shift_fail_sigmas), reason)
        .about(after)
}

/// Test 13: readings where the surface would accelerate by more than a share of gravity are rejected: in each run of such readings
/// the worst, then again, up to five times; where they are everywhere it fails and rejects none. From three readings at least [`ReadingLimits::acceleration_step_s`] apart.
pub fn acceleration(series: &mut Ordered, limits: &ReadingLimits) -> Finding {
    const PASSES: usize = 5;
    let before = good(series).count();
    if before == 0 {
        return nothing(Test::Acceleration);
    }
    let lag = (limits.acceleration_step_s / series.interval_s).round().max(1.0);
    if before < 3 || lag.is_nan() || lag >= before as f64 {
        return Finding::new(Test::Acceleration, Flag::NotEvaluated, "too few readings for an acceleration");
    }
    let (lag, limit_mps2) = (lag as usize, limits.acceleration_g * GRAVITY_MPS2);
    let mut rejected = Vec::new();
    let mut largest_mps2 = 0.0_f64;
    for pass in 0..PASSES {
        let sharp = |i: usize| acceleration_mps2(&series.readings, series.interval_s, i, lag).map_or(0.0, f64::abs);
        let mut beyond = Vec::new();
        let mut largest = 0.0_f64;
        for place in 0..series.readings.len() {
            let value = sharp(place);
            largest = largest.max(value);
            if value > limit_mps2 {
                beyond.push(place);
            }
        }
        if pass == 0 {
            largest_mps2 = largest;
        }
        if beyond.is_empty() {
            break;
        }
        // A spike makes three sharp readings. So many of them are no spikes: there is nothing to mend.
        if pass == 0 && beyond.len() as f64 >= 3.0 * limits.rejected_fail_share * before as f64 {
            let reason =
                format!("accelerations up to {largest_mps2:.2} m/s² and {} of them beyond {limit_mps2:.2} m/s²", beyond.len());
            let indices = beyond.iter().map(|place| series.readings[*place].index).collect();
            return Finding::new(Test::Acceleration, Flag::Fail, reason).about(indices);
        }
        // A spike bends its neighbours too: they are within two lags of it.
        let worst: Vec<usize> = beyond
            .chunk_by(|a, b| b - a <= lag)
            .filter_map(|run| run.iter().copied().max_by(|a, b| sharp(*a).total_cmp(&sharp(*b))))
            .collect();
        rejected.extend(reject(series, &worst));
    }
    let flag = if rejected.is_empty() { Flag::Pass } else { Flag::Suspect };
    let reason =
        format!("accelerations up to {largest_mps2:.2} m/s², {} readings beyond {limit_mps2:.2} m/s² rejected", rejected.len());
    Finding::new(Test::Acceleration, flag, reason).about(rejected)
}

/// The second divided difference at reading `i`; `None` at the ends and beside gaps.
fn acceleration_mps2(readings: &[Reading], interval_s: f64, i: usize, lag: usize) -> Option<f64> {
    let (a, b, c) = (readings.get(i.checked_sub(lag)?)?, readings.get(i)?, readings.get(i + lag)?);
    let (back_s, ahead_s) = (b.stamp_s - a.stamp_s, c.stamp_s - b.stamp_s);
    let usual_s = lag as f64 * interval_s;
    let near = |step_s: f64| step_s > 0.5 * usual_s && step_s < 1.5 * usual_s;
    if !(a.is_good() && b.is_good() && c.is_good() && near(back_s) && near(ahead_s)) {
        return None;
    }
    let bend = (c.elevation_m - b.elevation_m) / ahead_s - (b.elevation_m - a.elevation_m) / back_s;
    Some(2.0 * bend / (back_s + ahead_s))
}

/// Test 16, for readings: the same one again and again.
#[must_use]
pub fn flat_line(series: &Ordered, limits: &ReadingLimits) -> Finding {
    let present: Vec<&Reading> = good(series).collect();
    if present.is_empty() {
        return nothing(Test::FlatLine);
    }
    let (mut longest, mut same) = (0, Vec::new());
    for run in present.chunk_by(|a, b| (a.elevation_m - b.elevation_m).abs() <= limits.flat_tolerance_m) {
        longest = longest.max(run.len());
        if run.len() >= limits.flat_suspect_samples {
            same.extend(run.iter().map(|r| r.index));
        }
    }
    let flag = Flag::rising(longest as f64, limits.flat_suspect_samples as f64, limits.flat_fail_samples as f64);
    Finding::new(Test::FlatLine, flag, format!("at most {longest} same readings in a row")).about(same)
}

/// The share of instants, from the first stamp to the last, that have a good reading; run it last.
#[must_use]
pub fn percent_good(series: &Ordered, limits: &ReadingLimits) -> Finding {
    let (Some(first), Some(last)) = (series.readings.first(), series.readings.last()) else {
        return nothing(Test::PercentGood);
    };
    let present = good(series).count();
    if present == 0 {
        return nothing(Test::PercentGood);
    }
    let due = ((last.stamp_s - first.stamp_s) / series.interval_s).round() + 1.0;
    let share = present as f64 / due.max(present as f64);
    let flag = match share {
        x if x.is_nan() => Flag::NotEvaluated,
        x if x < limits.good_fail_share => Flag::Fail,
        x if x < limits.good_suspect_share => Flag::Suspect,
        _ => Flag::Pass,
    };
    Finding::new(Test::PercentGood, flag, format!("{present} good readings of {due:.0} due: {:.1} %", 100.0 * share))
}

#[cfg(test)]
mod tests;
