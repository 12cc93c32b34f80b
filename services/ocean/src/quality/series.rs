//! Readings as they come, put in order, and the even record that is made of them.

use super::{Finding, Flag, Test};
use crate::record::Record;
use crate::spline::Spline;

/// Elevation readings as an instrument or a file gives them: in any order, some twice, some missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RawSeries<'a> {
    /// Instants, seconds after any epoch. What is not finite is dropped and reported.
    pub stamp_s: &'a [f64],
    /// Elevation at each, metres positive up; NaN where missing.
    pub elevation_m: &'a [f64],
}

/// One reading, with its place in the series it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Its instant, seconds.
    pub stamp_s: f64,
    /// Its elevation, metres; NaN where missing or rejected.
    pub elevation_m: f64,
    /// Its index in the series given.
    pub index: usize,
}

impl Reading {
    /// Whether there is an elevation.
    #[must_use]
    pub fn is_good(&self) -> bool {
        self.elevation_m.is_finite()
    }
}

/// Readings in the order of their stamps, each stamp once.
#[derive(Debug, Clone, PartialEq)]
pub struct Ordered {
    /// Oldest first; stamps rise strictly.
    pub readings: Vec<Reading>,
    /// The usual time between two, seconds: the mean of those from 0.4 to 1.6 medians. NaN with fewer than two readings.
    pub interval_s: f64,
}

/// Elevations beyond this are no water but an overflow, and count as missing.
const ELEVATION_MAX_M: f64 = 1e6;

impl RawSeries<'_> {
    /// Puts the readings in order. Of readings with the same stamp the first with an elevation stays. What was wrong is in the
    /// finding: anything but a plain series is suspect, and different elevations at one instant fail.
    #[must_use]
    pub fn ordered(&self) -> (Ordered, Finding) {
        let pairs = self.stamp_s.iter().zip(self.elevation_m).enumerate();
        let mut readings: Vec<Reading> = pairs
            .filter(|(_, (stamp_s, _))| stamp_s.is_finite() && stamp_s.abs() < 1e15)
            .map(|(index, (&stamp_s, &elevation_m))| {
                let elevation_m = if elevation_m.abs() <= ELEVATION_MAX_M { elevation_m } else { f64::NAN };
                Reading { stamp_s, elevation_m, index }
            })
            .collect();
        let surplus = self.stamp_s.len().abs_diff(self.elevation_m.len());
        let unstamped = self.stamp_s.len().min(self.elevation_m.len()) - readings.len();
        let late: Vec<usize> = readings.windows(2).filter(|w| w[1].stamp_s < w[0].stamp_s).map(|w| w[1].index).collect();
        readings.sort_by(|a, b| a.stamp_s.total_cmp(&b.stamp_s));
        let (mut doubled, mut contradicting) = (Vec::new(), 0_usize);
        readings.dedup_by(|next, kept| {
            let same = next.stamp_s <= kept.stamp_s;
            if same {
                doubled.push(next.index);
                contradicting += usize::from(next.is_good() && kept.is_good() && next.elevation_m != kept.elevation_m);
                if next.is_good() && !kept.is_good() {
                    std::mem::swap(next, kept);
                }
            }
            same
        });
        let interval_s = usual_interval_s(&readings);

        let mut wrong = Vec::new();
        let mut say = |count: usize, what: &str| {
            if count > 0 {
                wrong.push(format!("{count} {what}"));
            }
        };
        say(surplus, "stamps or elevations without the other");
        say(unstamped, "readings without a usable stamp");
        say(late.len(), "readings out of order");
        say(doubled.len(), "readings with a stamp that was there before");
        say(contradicting, "of these with a different elevation");
        let flag = match (readings.is_empty(), contradicting > 0, wrong.is_empty()) {
            (true, _, _) => Flag::Missing,
            (_, true, _) => Flag::Fail,
            (_, _, true) => Flag::Pass,
            _ => Flag::Suspect,
        };
        let reason = if wrong.is_empty() { format!("{} readings in order", readings.len()) } else { wrong.join(", ") };
        late.iter().for_each(|index| doubled.push(*index));
        (Ordered { readings, interval_s }, Finding::new(Test::Stamps, flag, reason).about(doubled))
    }
}

/// Gaps would spoil the mean of all steps, and uneven stamps the median.
fn usual_interval_s(readings: &[Reading]) -> f64 {
    let mut steps: Vec<f64> = readings.windows(2).map(|w| w[1].stamp_s - w[0].stamp_s).collect();
    if steps.is_empty() {
        return f64::NAN;
    }
    let middle = steps.len() / 2;
    let median_s = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    let usual = steps.iter().filter(|s| (0.4 * median_s..=1.6 * median_s).contains(*s));
    usual.clone().sum::<f64>() / usual.count() as f64
}

/// An even record and which of its samples were filled in.
#[derive(Debug, Clone, PartialEq)]
pub struct Even {
    /// The record, metres.
    pub record: Record,
    /// Stamp of its first sample, seconds.
    pub start_s: f64,
    /// Whether each sample lies further than three quarters of an interval from any good reading.
    pub filled: Vec<bool>,
}

impl Ordered {
    /// More samples than this are no record but a wrong stamp.
    pub const SAMPLES_MAX: usize = 1 << 22;

    /// The longest stretch whose good readings are nowhere more than `gap_max_s` apart, as a range of readings that begins and
    /// ends with a good one. Empty where there is none.
    #[must_use]
    pub fn longest_stretch(&self, gap_max_s: f64) -> std::ops::Range<usize> {
        let mut best = 0..0;
        let mut current: Option<(usize, usize)> = None;
        let span_s = |a: usize, b: usize| self.readings[b].stamp_s - self.readings[a].stamp_s;
        for i in (0..self.readings.len()).filter(|i| self.readings[*i].is_good()) {
            current = match current {
                Some((start, last)) if span_s(last, i) <= gap_max_s => Some((start, i)),
                _ => Some((i, i)),
            };
            if let Some((start, end)) = current
                && (best.is_empty() || span_s(start, end) > span_s(best.start, best.end - 1))
            {
                best = start..end + 1;
            }
        }
        best
    }

    /// An even record at the usual interval over the readings of `stretch`, by a natural cubic spline through the good ones, which
    /// leaves samples alone that are even already. `None` for fewer than [`Record::SAMPLES_MIN`] good readings or more than
    /// [`Self::SAMPLES_MAX`] samples.
    #[must_use]
    pub fn even(&self, stretch: std::ops::Range<usize>) -> Option<Even> {
        let good = self.readings.get(stretch)?.iter().filter(|reading| reading.is_good());
        let (first, last) = (good.clone().next()?, good.clone().next_back()?);
        let count = ((last.stamp_s - first.stamp_s) / self.interval_s).round() + 1.0;
        if !(count >= Record::SAMPLES_MIN as f64 && count <= Self::SAMPLES_MAX as f64) {
            return None;
        }
        let count = count as usize;
        // Seconds since the epoch leave few digits for the fractions: count from the first reading.
        let (knots, elevations_m): (Vec<f64>, Vec<f64>) =
            good.map(|reading| (reading.stamp_s - first.stamp_s, reading.elevation_m)).unzip();
        if knots.len() < Record::SAMPLES_MIN {
            return None;
        }
        let mut next = 0;
        let filled = (0..count)
            .map(|i| {
                let t_s = i as f64 * self.interval_s;
                while next + 1 < knots.len() && (knots[next + 1] - t_s).abs() <= (knots[next] - t_s).abs() {
                    next += 1;
                }
                (knots[next] - t_s).abs() > 0.75 * self.interval_s
            })
            .collect();
        let curve = Spline::new(knots, elevations_m).ok()?;
        let record = Record::new(curve.sampled(0.0, self.interval_s, count), 1.0 / self.interval_s).ok()?;
        Some(Even { record, start_s: first.stamp_s, filled })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    fn ordered(stamp_s: &[f64], elevation_m: &[f64]) -> (Ordered, Finding) {
        RawSeries { stamp_s, elevation_m }.ordered()
    }

    #[test]
    fn order_doubles_and_nonsense_are_put_right_and_said() {
        let (series, finding) =
            ordered(&[0.0, 2.0, 1.0, 3.0, 3.0, f64::NAN, 4.0, 5.0], &[0.0, 2.0, 1.0, f64::NAN, 3.0, 9.0, 1e300, 5.0]);
        assert_eq!(series.readings.iter().map(|r| r.stamp_s).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        assert_eq!(series.readings[3].elevation_m, 3.0, "the one with an elevation");
        assert!(!series.readings[4].is_good(), "an overflow is no elevation");
        assert_eq!(series.interval_s, 1.0);
        assert_eq!(finding.flag, Flag::Suspect);
        assert_eq!(
            finding.reason,
            "1 readings without a usable stamp, 1 readings out of order, 1 readings with a stamp that was there before"
        );
        assert_eq!(ordered(&[0.0, 1.0, 1.0], &[0.0, 1.0, 1.5]).1.flag, Flag::Fail, "two heights at once");
        assert_eq!(ordered(&[0.0, 1.0], &[0.0, 1.0]).1.flag, Flag::Pass);
        assert_eq!(ordered(&[0.0, 1.0], &[0.0]).1.flag, Flag::Suspect);
        assert_eq!(ordered(&[], &[]).1.flag, Flag::Missing);
        assert_eq!(ordered(&[f64::INFINITY], &[1.0]).1.flag, Flag::Missing);
    }

    /// A sine with jittered stamps and a fifth of its readings missing comes back as the sine.
    #[test]
    fn an_uneven_sine_becomes_an_even_one() {
        let sine = |t: f64| 0.4 * (TAU * t / 4.0).sin();
        let stamp_s: Vec<f64> = (0..400).map(|i| 1.7e9 + 0.2 * f64::from(i) + 0.05 * f64::from(i * 7 % 5 - 2) / 2.0).collect();
        let elevation_m: Vec<f64> =
            stamp_s.iter().enumerate().map(|(i, t)| if i % 5 == 3 { f64::NAN } else { sine(t - 1.7e9) }).collect();
        let (series, _) = ordered(&stamp_s, &elevation_m);
        let even = series.even(series.longest_stretch(1.0)).unwrap();
        let start = even.start_s - 1.7e9;
        for (i, y) in even.record.samples_m().iter().enumerate().skip(5).take(380) {
            let t = start + i as f64 / even.record.rate_hz();
            assert!((y - sine(t)).abs() < 2e-3, "{t}: {y} for {}", sine(t));
        }
    }

    #[test]
    fn filled_samples_are_those_without_a_reading() {
        let stamp_s: Vec<f64> = (0..10).map(f64::from).collect();
        let mut elevation_m = vec![0.5; 10];
        elevation_m[4] = f64::NAN;
        elevation_m[5] = f64::NAN;
        let (series, _) = ordered(&stamp_s, &elevation_m);
        let even = series.even(0..10).unwrap();
        assert_eq!(even.filled.iter().enumerate().filter(|(_, f)| **f).map(|(i, _)| i).collect::<Vec<_>>(), [4, 5]);
        assert_eq!(series.longest_stretch(2.0), 0..4, "as long as the other, and first");
        assert_eq!(series.longest_stretch(3.0), 0..10);
        assert_eq!(series.longest_stretch(f64::NAN), 0..1, "nothing is near enough");
    }

    #[test]
    fn a_stray_stamp_allocates_nothing() {
        let (series, _) = ordered(&[0.0, 1e-3, 2e-3, 3e-3, 1e14], &[0.0; 5]);
        assert!(series.even(0..5).is_none());
        assert!(series.even(3..99).is_none());
        assert!(ordered(&[1.0], &[1.0]).0.even(0..1).is_none());
    }
}
