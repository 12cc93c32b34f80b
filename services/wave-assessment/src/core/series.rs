//! Elevation series at the gauges.

use halcyon_model::{Stamp, TracePoint};

use super::gauge::{CENTRE, GAUGES};
use super::hidden::Hidden;
use super::smooth::{SMOOTHINGS, Taken};
use super::window::Window;

/// Shorter stretches at one gauge are left out, seconds: their mean takes too much of the waves away.
const STRETCH_S_MIN: f64 = 10.0;
/// Fewer samples than this are no stretch.
const SAMPLES_MIN: usize = 12;
/// The readings' stated variances are wrong by this share.
const NOISE_DOUBT: f64 = 0.1;
/// Outliers: this many standard deviations from the mean (thesis 7.3) …
const OUTLIER_SIGMAS: f64 = 3.0;
/// … that also stand out from both neighbours by this many.
const OUTLIER_JUMP_SIGMAS: f64 = 2.5;

/// An unbroken series at one gauge, without its mean.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stretch {
    /// The gauge's place in the layout.
    pub slot: usize,
    /// Seconds since the window's first frame, rising.
    pub times_s: Vec<f64>,
    /// Best estimate of the elevation, metres.
    pub elevation_m: Vec<f64>,
    /// The same before outliers were replaced and the mean was taken off, metres.
    pub raw_m: Vec<f64>,
    /// The same with all that may be hidden waves in it, metres.
    pub elevation_upper_m: Vec<f64>,
}

impl Stretch {
    fn duration_s(&self) -> f64 {
        self.times_s.last().copied().unwrap_or(0.0) - self.times_s.first().copied().unwrap_or(0.0)
    }
}

/// A gauge's readings without a gap, as they come together.
struct Run {
    gauge: u64,
    stretch: Stretch,
    /// Sum of the readings' variances, m².
    noise_m2: f64,
}

impl Run {
    /// None yet, of at most so many.
    fn new(slot: usize, gauge: u64, count_max: usize) -> Self {
        let [times_s, elevation_m, elevation_upper_m] = [(); 3].map(|()| Vec::with_capacity(count_max));
        Self { gauge, stretch: Stretch { slot, times_s, elevation_m, raw_m: Vec::new(), elevation_upper_m }, noise_m2: 0.0 }
    }

    fn end_s(&self) -> f64 {
        self.stretch.times_s.last().copied().unwrap_or(f64::NEG_INFINITY)
    }
}

/// Every gauge's series over the window.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Series {
    pub stretches: Vec<Stretch>,
    /// Samples in all stretches.
    pub samples: usize,
    /// How many of them were replaced.
    pub replaced: usize,
    /// Mean variance of the readings' own errors, m².
    pub noise_m2: f64,
    /// Variance of waves that smoothing may have taken out, at most, m².
    pub lost_m2: f64,
    /// The longest that one gauge was observed, seconds.
    pub observed_s: f64,
    start: Stamp,
}

impl Series {
    /// From the frames of a window. A longer gap than `gap_s` breaks a series.
    pub(crate) fn new(window: &Window, hidden: &Hidden, gap_s: f64) -> Self {
        let frames = window.frames();
        let start = frames.front().map_or_else(Stamp::default, |f| f.stamp);
        let mut series =
            Self { stretches: Vec::new(), samples: 0, replaced: 0, noise_m2: 0.0, lost_m2: 0.0, observed_s: 0.0, start };
        let smoothing = Smoothing::of(window);
        series.lost_m2 = smoothing.lost_m2;
        // One pass over the frames, which are large, for all gauges.
        let mut readings: [Vec<Run>; GAUGES] = Default::default();
        for (i, frame) in frames.iter().enumerate().filter(|(i, _)| !hidden.is_missing(*i)) {
            let time_s = frame.stamp.seconds_since(start);
            for (slot, reading) in frame.readings.iter().enumerate() {
                let Some(reading) = reading else { continue };
                let runs = &mut readings[slot];
                let goes_on = |run: &Run| run.gauge == reading.gauge && time_s - run.end_s() <= gap_s + GAP_S_HAIR;
                if !runs.last().is_some_and(goes_on) {
                    runs.push(Run::new(slot, reading.gauge, frames.len() - i));
                }
                if let Some(run) = runs.last_mut() {
                    let sample = &reading.samples[smoothing.level];
                    let (waves_m, all_m) = hidden.at(i, frame, reading.place);
                    run.stretch.times_s.push(time_s);
                    run.stretch.elevation_m.push(sample.elevation_m + waves_m);
                    run.stretch.elevation_upper_m.push(sample.elevation_m + all_m);
                    run.noise_m2 += sample.noise_m2;
                }
            }
        }
        for runs in readings {
            let observed_s = runs.into_iter().map(|run| series.add(run)).sum::<f64>();
            series.observed_s = series.observed_s.max(observed_s);
        }
        if series.samples > 0 {
            series.noise_m2 /= series.samples as f64;
        }
        series
    }

    /// Adds one run of readings; returns its length in seconds, 0 where it is too short.
    fn add(&mut self, Run { mut stretch, noise_m2, .. }: Run) -> f64 {
        let duration_s = stretch.duration_s();
        if duration_s < STRETCH_S_MIN || stretch.times_s.len() < SAMPLES_MIN {
            return 0.0;
        }
        stretch.raw_m.clone_from(&stretch.elevation_m);
        self.replaced += despike(&mut stretch.elevation_m, &mut stretch.elevation_upper_m);
        center(&mut stretch.elevation_m);
        center(&mut stretch.elevation_upper_m);
        self.samples += stretch.times_s.len();
        self.noise_m2 += noise_m2;
        self.stretches.push(stretch);
        duration_s
    }

    /// The gauge to show: the central one, or the one that saw the most where that one saw less than half of it. `None` without any.
    pub(crate) fn shown(&self) -> Option<usize> {
        let samples = |slot: usize| self.stretches.iter().filter(|s| s.slot == slot).map(|s| s.times_s.len()).sum::<usize>();
        let best = self.stretches.iter().map(|s| s.slot).max_by_key(|slot| samples(*slot))?;
        Some(if 2 * samples(CENTRE) >= samples(best) { CENTRE } else { best })
    }

    /// The series at the gauge that is shown, oldest first.
    pub(crate) fn trace(&self) -> Vec<TracePoint> {
        let shown = self.shown();
        let mut trace: Vec<TracePoint> = self
            .stretches
            .iter()
            .filter(|s| Some(s.slot) == shown)
            .flat_map(|s| s.times_s.iter().zip(&s.elevation_m))
            .map(|(time_s, elevation_m)| TracePoint { stamp: self.start.plus_secs_f64(*time_s), elevation_m: *elevation_m })
            .collect();
        trace.sort_by_key(|point| point.stamp);
        trace
    }
}

/// How far readings may be smoothed before waves are lost.
struct Smoothing {
    /// Which of a reading's samples to take.
    level: usize,
    /// What waves that it took out may contribute to the variance even so, m².
    lost_m2: f64,
}

impl Smoothing {
    /// The largest disc that takes out no more than noise explains. A window of chop is read cell by cell.
    fn of(window: &Window) -> Self {
        let count = window.frames().iter().map(|frame| frame.smoothing.readings).sum::<f64>().max(1.0);
        let mut best = Self { level: 0, lost_m2: 0.0 };
        for level in 1..SMOOTHINGS {
            let mean = |of: fn(&Taken) -> f64| {
                window.frames().iter().map(|frame| of(&frame.smoothing.taken[level - 1])).sum::<f64>() / count
            };
            // A least-squares value and the residual beside it are uncorrelated.
            let (taken_m2, explained_m2) = (mean(|taken| taken.square_m2), mean(|taken| taken.explained_m2));
            let doubt_m2 = explained_m2 * (NOISE_DOUBT + 2.0 * (2.0 / count).sqrt());
            if taken_m2 > explained_m2 + doubt_m2 {
                break;
            }
            best = Self { level, lost_m2: (taken_m2 - explained_m2 + doubt_m2).max(0.0) };
        }
        best
    }
}

fn center(values: &mut [f64]) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter_mut().for_each(|x| *x -= mean);
}

/// So much longer a gap may be, seconds: stamps are rounded to nanoseconds.
const GAP_S_HAIR: f64 = 1e-6;

/// Splits (anything, seconds) points, in order of time, where two are more than `gap_s` apart.
pub(crate) fn runs(points: &[(usize, f64)], gap_s: f64) -> impl Iterator<Item = &[(usize, f64)]> {
    points.chunk_by(move |a, b| b.1 - a.1 <= gap_s + GAP_S_HAIR)
}

/// Replaces outliers in `values` by the mean of their neighbours, and the same samples in `also` (as long, or empty); returns how many.
///
/// The thesis (7.3) takes everything beyond three standard deviations from the mean. Of a Gaussian sea that is one honest sample in
/// 370, and always the top of the highest waves, the very ones that matter here. So a sample must also stand out from both its
/// neighbours, as a failed match does and a wave does not. Deviations are estimated from the median absolute one, which outliers
/// do not inflate.
pub(crate) fn despike(values: &mut [f64], also: &mut [f64]) -> usize {
    let n = values.len();
    if n < 3 {
        return 0;
    }
    let center = median(values.to_vec());
    let sigma = 1.4826 * median(values.iter().map(|x| (x - center).abs()).collect());
    if sigma <= 0.0 {
        return 0;
    }
    let is_far = |x: f64| (x - center).abs() > OUTLIER_SIGMAS * sigma;
    if !values.iter().any(|x| is_far(*x)) {
        return 0;
    }
    let original = values.to_vec();
    let mut replaced = 0;
    for i in 0..n {
        let neighbours = [i.checked_sub(1), Some(i + 1).filter(|j| *j < n)];
        let stands_out = neighbours.iter().flatten().all(|j| (original[i] - original[*j]).abs() > OUTLIER_JUMP_SIGMAS * sigma);
        if is_far(original[i]) && stands_out {
            for series in [&mut *values, &mut *also] {
                if series.len() == n {
                    let (sum, count) = neighbours.iter().flatten().fold((0.0, 0.0), |(s, c), j| (s + series[*j], c + 1.0));
                    series[i] = sum / count;
                }
            }
            replaced += 1;
        }
    }
    replaced
}

pub(crate) fn median(values: Vec<f64>) -> f64 {
    // In the total order of numbers, as whole ones, which are sorted out several times as fast.
    let ordered = |bits: i64| bits ^ (((bits >> 63) as u64) >> 1) as i64;
    let mut whole: Vec<i64> = values.into_iter().map(|x| ordered(x.to_bits() as i64)).collect();
    let middle = whole.len() / 2;
    f64::from_bits(ordered(*whole.select_nth_unstable(middle).1) as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spikes_go_and_high_waves_stay() {
        let wave = |i: usize| (i as f64 * 1.2).sin() * if (60..66).contains(&i) { 2.6 } else { 0.8 };
        let clean: Vec<f64> = (0..300).map(wave).collect();
        let mut values = clean.clone();
        assert_eq!(despike(&mut values, &mut []), 0, "a group of waves three times as high as the others is no outlier");
        for i in [40, 100, 101 + 40, 299] {
            values[i] += 9.0;
        }
        let mut also = values.clone();
        assert_eq!(despike(&mut values, &mut also), 4);
        assert!(values.iter().all(|x| x.abs() < 3.0) && also.iter().all(|x| x.abs() < 3.0));
    }

    #[test]
    fn still_water_has_no_outliers() {
        assert_eq!(despike(&mut [0.0; 20], &mut []), 0);
        assert_eq!(despike(&mut [1.0, 2.0], &mut []), 0);
        assert_eq!(despike(&mut [], &mut []), 0);
    }

    #[test]
    fn the_median_is_in_the_middle() {
        for values in
            [vec![3.0], vec![2.0, -1.0], vec![-5.0, 0.5, -0.0, 0.0, 7e-300, -7e300, 1.0], vec![f64::NAN, 1.0, -f64::NAN]]
        {
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            assert_eq!(median(values).to_bits(), sorted[sorted.len() / 2].to_bits());
        }
    }

    #[test]
    fn gaps_break_runs() {
        let points = [(0, 0.0), (1, 0.2), (2, 0.4), (3, 1.2), (4, 1.4)];
        let lengths: Vec<usize> = runs(&points, 0.5).map(<[_]>::len).collect();
        assert_eq!(lengths, [3, 2]);
    }
}
