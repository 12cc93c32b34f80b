//! Two series on one even time base.

use super::{CompareError, Which};
use crate::quality::series::{Ordered, RawSeries};
use crate::record::Record;
use crate::spline::Spline;

/// Samples in common that anything can be said of.
pub(super) const SAMPLES_MIN: usize = 64;
/// More are no record of waves but a wrong stamp.
const SAMPLES_MAX: f64 = (1 << 20) as f64;

/// A series in order, at least [`SAMPLES_MIN`]/4 readings of it good.
pub(super) fn ordered(series: &RawSeries<'_>, which: Which) -> Result<Ordered, CompareError> {
    const READINGS_MIN: usize = SAMPLES_MIN / 4;
    let (mut ordered, _) = series.ordered();
    ordered.readings.retain(crate::quality::series::Reading::is_good);
    let readings = ordered.readings.len();
    if readings < READINGS_MIN || !(ordered.interval_s > 0.0 && ordered.interval_s.is_finite()) {
        return Err(CompareError::TooFew { which, readings, readings_min: READINGS_MIN });
    }
    Ok(ordered)
}

/// First and last stamp, seconds.
pub(super) fn span_s(series: &Ordered) -> (f64, f64) {
    let stamp_s = |reading: Option<&crate::quality::series::Reading>| reading.map_or(f64::NAN, |reading| reading.stamp_s);
    (stamp_s(series.readings.first()), stamp_s(series.readings.last()))
}

/// Elevations of both at the same instants, metres; NaN where a series has none near enough.
#[derive(Debug, Clone)]
pub(super) struct Pair {
    pub(super) rate_hz: f64,
    pub(super) a_m: Vec<f64>,
    pub(super) b_m: Vec<f64>,
}

impl Pair {
    /// At the rate of the slower series over the time that both have, with `b` taken `lag_s` later than `a`. Readings further
    /// apart than `gap_intervals` of their own series' usual interval are a gap: splines end before it and start anew after it,
    /// so that nothing is extrapolated or made up.
    pub(super) fn of(a: &Ordered, b: &Ordered, lag_s: f64, gap_intervals: f64) -> Result<Self, CompareError> {
        let interval_s = a.interval_s.max(b.interval_s);
        let ((a_from_s, a_to_s), (b_from_s, b_to_s)) = (span_s(a), span_s(b));
        let from_s = a_from_s.max(b_from_s - lag_s);
        let overlap_s = a_to_s.min(b_to_s - lag_s) - from_s;
        if overlap_s.is_nan() || overlap_s <= 0.0 {
            return Err(CompareError::NoOverlap { apart_s: -overlap_s });
        }
        // A hair more, so that a last reading just at a sample counts.
        let count = (overlap_s / interval_s + 1e-6).floor() + 1.0;
        if count > SAMPLES_MAX {
            return Err(CompareError::TooLong { samples: count as usize });
        }
        let count = count as usize;
        let even = |series: &Ordered, lag_s: f64| sampled(series, from_s, lag_s, interval_s, count, gap_intervals);
        Ok(Self { rate_hz: 1.0 / interval_s, a_m: even(a, 0.0), b_m: even(b, lag_s) })
    }

    /// Instants at which both have an elevation.
    pub(super) fn both(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        self.a_m.iter().copied().zip(self.b_m.iter().copied()).filter(|(a, b)| a.is_finite() && b.is_finite())
    }

    /// How many samples each has, gaps counted.
    pub(super) fn samples(&self) -> usize {
        self.a_m.len()
    }

    /// Each less its least-squares line through the instants that both have.
    pub(super) fn take_trends_off(&mut self) {
        let both: Vec<bool> = self.a_m.iter().zip(&self.b_m).map(|(a, b)| a.is_finite() && b.is_finite()).collect();
        for elevation_m in [&mut self.a_m, &mut self.b_m] {
            take_line_off(elevation_m, &both);
        }
    }

    /// Runs of samples that both have, of at least four.
    pub(super) fn stretches(&self) -> Vec<(&[f64], &[f64])> {
        let mut found = Vec::new();
        let mut start = 0;
        for i in 0..=self.a_m.len() {
            let good = i < self.a_m.len() && self.a_m[i].is_finite() && self.b_m[i].is_finite();
            if !good {
                if i - start >= Record::SAMPLES_MIN {
                    found.push((&self.a_m[start..i], &self.b_m[start..i]));
                }
                start = i + 1;
            }
        }
        found
    }
}

fn sampled(series: &Ordered, from_s: f64, lag_s: f64, interval_s: f64, count: usize, gap_intervals: f64) -> Vec<f64> {
    let mut even_m = vec![f64::NAN; count];
    let gap_s = gap_intervals * series.interval_s;
    for piece in series.readings.chunk_by(|before, after| after.stamp_s - before.stamp_s <= gap_s) {
        if piece.len() < Record::SAMPLES_MIN {
            continue;
        }
        // From the first sample on: seconds since an epoch leave few digits for fractions.
        let (knots, values): (Vec<f64>, Vec<f64>) = piece.iter().map(|r| (r.stamp_s - from_s - lag_s, r.elevation_m)).unzip();
        let (first, last) = (knots[0] / interval_s, knots[knots.len() - 1] / interval_s);
        let first = (first - 1e-6).ceil().max(0.0);
        let last = (last + 1e-6).floor().min((count - 1) as f64);
        if last < first {
            continue;
        }
        // Stamps so near each other that they fall together are no curve: then there is nothing here.
        if let Ok(curve) = Spline::new(knots, values) {
            let (start, samples) = (first as usize, (last - first) as usize + 1);
            even_m[start..start + samples].copy_from_slice(&curve.sampled(first * interval_s, interval_s, samples));
        }
    }
    even_m
}

fn take_line_off(elevation_m: &mut [f64], both: &[bool]) {
    let used = || elevation_m.iter().zip(both).enumerate().filter(|(_, (_, both))| **both).map(|(i, (x, _))| (i as f64, *x));
    let count = used().count() as f64;
    let (sum_i, sum_x) = used().fold((0.0, 0.0), |(i, x), (at, m)| (i + at, x + m));
    let (middle, level) = (sum_i / count, sum_x / count);
    let (spread, moved) = used().fold((0.0, 0.0), |(s, m), (i, x)| (s + (i - middle).powi(2), m + (i - middle) * (x - level)));
    let slope = if spread > 0.0 { moved / spread } else { 0.0 };
    elevation_m.iter_mut().enumerate().for_each(|(i, x)| *x -= level + slope * (i as f64 - middle));
}
