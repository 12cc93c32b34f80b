//! The gauges' series as even records, and the waves in them.

use halcyon_ocean::crossing::{Crossing, Wave, waves_beyond};
use halcyon_ocean::{Record, Spline};

use super::gauge::GAUGES;
use super::series::{Series, Stretch};

/// Series are drawn this many times as dense as the patches before crests are looked for.
const DENSER: usize = 4;

/// Every stretch drawn densely, and its gauge.
pub(super) fn dense(series: &Series, interval_s: f64) -> Vec<(usize, Record)> {
    let step_s = interval_s / DENSER as f64;
    let drawn = |stretch: &Stretch| {
        let (start_s, end_s) = (*stretch.times_s.first()?, *stretch.times_s.last()?);
        // Stamps rise and readings are finite, so neither can fail; a stretch that did would only be one stretch less.
        let curve = Spline::new(stretch.times_s.clone(), stretch.elevation_m.clone()).ok()?;
        let dense_m = curve.sampled(start_s, step_s, ((end_s - start_s) / step_s).floor() as usize + 1);
        Some((stretch.slot, Record::new(dense_m, 1.0 / step_s).ok()?))
    };
    series.stretches.iter().filter_map(drawn).collect()
}

/// Every stretch at even instants an interval apart, without its trend: of the dense ones, one in so many.
pub(super) fn even(dense: &[(usize, Record)]) -> Vec<Record> {
    let thinned = |(_, record): &(usize, Record)| {
        let even_m: Vec<f64> = record.samples_m().iter().step_by(DENSER).copied().collect();
        Some(Record::new(even_m, record.rate_hz() / DENSER as f64).ok()?.without_trend())
    };
    dense.iter().filter_map(thinned).collect()
}

/// Waves of every record by each dead band, and how many each gauge had.
pub(super) fn waves_at_gauges<const N: usize>(
    records: &[(usize, Record)],
    deadbands_m: [f64; N],
) -> [(Vec<Wave>, [usize; GAUGES]); N] {
    let mut all: [(Vec<Wave>, [usize; GAUGES]); N] = std::array::from_fn(|_| (Vec::new(), [0; GAUGES]));
    for (slot, record) in records {
        for ((waves, at_each), found) in all.iter_mut().zip(waves_beyond(record, Crossing::Up, deadbands_m)) {
            at_each[*slot] += found.len();
            waves.extend(found);
        }
    }
    all
}
