//! How much a finite window can tell: degrees of freedom of the pooled variance.

use std::f64::consts::FRAC_PI_2;

use super::gauge::{GAUGES, SIDE};
use super::series::Series;

/// Correlations further apart than this many mean periods are taken as nothing.
const LAG_PERIODS: f64 = 3.0;
/// The degrees of freedom ν come from the same window as the variance, and are the less known the fewer they are: ν²/(ν + 10) are claimed.
const UNCLAIMED: f64 = 10.0;
/// ∫ S² df / m0² over T_z for JONSWAP with γ = 3.3, as its spectrum gives it up to five times the peak's frequency. That over the duration is what a wind
/// sea leaves open of the squared variance at one gauge. Seas that are more narrow leave more; a window that claims less is not believed, since the
/// waves that make it low make the variance low with it.
const JONSWAP: f64 = 1.9;
/// Lags reach at least this far, seconds.
const LAG_S_MIN: f64 = 2.0;

/// Equivalent degrees of freedom of the variance pooled over all gauges: 2 / CV².
///
/// For a Gaussian surface the variance of that estimate is (2/T) ∫ ρ²(τ) dτ of its square, with ρ² the mean of all pairs of gauges' squared
/// correlations (Bendat & Piersol, 8.2.2): neighbours that see the same waves, now or a moment later, count as one. Half of it is the
/// number of independent waves that the window is worth. `None` without data.
///
/// Correlations come from signs alone: of a Gaussian surface ρ = sin(π/2 r), with r the correlation of the signs (the arcsine law; Van Vleck &
/// Middleton 1966). A group of high waves that came by chance makes the variance too large; it would make the correlations of elevations too
/// large with it, and low variances too sure of themselves. It does not change the signs. And signs are counted 64 at a time.
///
/// The sea under the gauges is the same everywhere, and so pairs that lie as far apart in the same direction share one correlation. Estimates are noisy,
/// and their squares too large for it, by lags/T of the like integral of (π/2 r)² over the same gauges; that is taken off.
pub(crate) fn degrees_of_freedom(series: &Series, interval_s: f64, period_s: Option<f64>) -> Option<f64> {
    let (table, length) = table(series, interval_s);
    let used: Vec<Gauge> = table.into_iter().enumerate().filter_map(|(slot, row)| Some(Gauge::of(slot, &row?))).collect();
    let gauges = used.len() as f64;
    let duration_s = length as f64 * interval_s;
    let lag_s = (LAG_PERIODS * period_s.unwrap_or(0.0)).max(LAG_S_MIN).min(duration_s / 3.0);
    let lag_max = (lag_s / interval_s).round() as usize;
    if !used.iter().any(|gauge| gauge.varies) || lag_max == 0 || lag_max >= length {
        return None;
    }
    let mut pairs: [Vec<[&Gauge; 2]>; SEPARATIONS] = Default::default();
    for (a, b) in used.iter().flat_map(|a| used.iter().map(move |b| (a, b))) {
        pairs[separation(a, b)].push([a, b]);
    }
    let squares = squares(&used, lag_max, length);
    // Mean of what spoils the squares, over all pairs of some gauges.
    let noise = |some: &[[&Gauge; 2]]| {
        let each = some.iter().map(|[a, _]| some.iter().map(|[b, _]| squares[separation(a, b)].signs).sum::<f64>());
        each.sum::<f64>() / (some.len() * some.len()) as f64
    };
    let lags = 2.0 * lag_max as f64 * interval_s / duration_s;
    let unspoilt =
        |(some, found): (&Vec<[&Gauge; 2]>, &Squares)| some.len() as f64 * (found.waves - lags / (1.0 + lags) * noise(some));
    let scale = 2.0 * interval_s / duration_s;
    let apart = pairs.iter().zip(&squares).filter(|(some, _)| !some.is_empty());
    let all = apart.map(unspoilt).sum::<f64>() * scale / (gauges * gauges);
    let own = squares[NOWHERE].waves / (1.0 + lags) * scale;
    // A window whose waves forget each other sooner than those of a wind sea does so by chance.
    let wider = (JONSWAP * period_s.unwrap_or(0.0) / duration_s / own).max(1.0);
    // No better than gauges that know nothing of each other, no worse than one.
    let cv_squared = wider * all.clamp(own / gauges, own);
    let freedom = 2.0 / cv_squared;
    Some(freedom * freedom / (freedom + UNCLAIMED))
}

/// How many different ways one gauge can lie from another: places of the layout along its rows, and along its columns.
const SEPARATIONS: usize = ACROSS * ACROSS;
const ACROSS: usize = 2 * SIDE - 1;
/// A gauge from itself.
const NOWHERE: usize = SEPARATIONS / 2;

/// The number of the way in which b lies from a.
fn separation(a: &Gauge, b: &Gauge) -> usize {
    let along = |from: usize, to: usize| to + SIDE - 1 - from;
    along(a.place.0, b.place.0) * ACROSS + along(a.place.1, b.place.1)
}

/// Each gauge's elevation at 0, 1, 2 … intervals since the window began; NaN where there is none. And how many intervals.
fn table(series: &Series, interval_s: f64) -> ([Option<Vec<f64>>; GAUGES], usize) {
    let end_s = series.stretches.iter().filter_map(|s| s.times_s.last()).fold(0.0_f64, |a, b| a.max(*b));
    let length = (end_s / interval_s).round() as usize + 1;
    let mut table: [Option<Vec<f64>>; GAUGES] = Default::default();
    for stretch in &series.stretches {
        let row = table[stretch.slot].get_or_insert_with(|| vec![f64::NAN; length]);
        for (time_s, elevation_m) in stretch.times_s.iter().zip(&stretch.elevation_m) {
            if let Some(cell) = row.get_mut((time_s / interval_s).round() as usize) {
                *cell = *elevation_m;
            }
        }
    }
    (table, length)
}

/// Where one gauge's elevations are known, and where they are above the mean level; its place in the layout.
struct Gauge {
    place: (usize, usize),
    varies: bool,
    known: Vec<u64>,
    above: Vec<u64>,
}

impl Gauge {
    fn of(slot: usize, elevation_m: &[f64]) -> Self {
        Self {
            place: (slot / SIDE, slot % SIDE),
            varies: elevation_m.iter().any(|x| x.abs() > 0.0),
            known: bits(elevation_m, |x| !x.is_nan()),
            above: bits(elevation_m, |x| x > 0.0),
        }
    }
}

/// Which values are so, 64 to a word.
fn bits(values: &[f64], is: impl Fn(f64) -> bool) -> Vec<u64> {
    let word = |of: &[f64]| of.iter().rev().fold(0, |word, x| (word << 1) | u64::from(is(*x)));
    values.chunks(BITS).map(word).collect()
}

const BITS: usize = u64::BITS as usize;

/// All words of what comes `lag` later, into `found`.
fn later(words: &[u64], lag: usize, found: &mut Vec<u64>) {
    let (skipped, by) = (lag / BITS, lag % BITS);
    let rest = words.get(skipped..).unwrap_or_default();
    found.clear();
    found.extend_from_slice(rest);
    if by > 0 {
        found.iter_mut().for_each(|word| *word >>= by);
        let next = rest.get(1..).unwrap_or_default();
        found.iter_mut().zip(next).for_each(|(word, next)| *word |= next << (BITS - by));
    }
}

/// How often two gauges' signs are both known, and then differ.
#[derive(Clone, Copy, Default)]
struct Count {
    known: u64,
    unlike: u64,
}

/// Those of all pairs of gauges, the second `lag` later, by the way in which the two lie. Compiled for processors that count bits, too: nothing else
/// takes as long here.
#[multiversion::multiversion(targets("x86_64+avx2+popcnt", "x86_64+popcnt"))]
fn counts(gauges: &[Gauge], lag: usize) -> [Count; SEPARATIONS] {
    let mut counts = [Count::default(); SEPARATIONS];
    let (mut known, mut above) = (Vec::new(), Vec::new());
    for b in gauges {
        later(&b.known, lag, &mut known);
        later(&b.above, lag, &mut above);
        for a in gauges {
            let mut count = Count::default();
            for ((k, s), (l, t)) in a.known.iter().zip(&a.above).zip(known.iter().zip(&above)) {
                let both = k & l;
                count.known += u64::from(both.count_ones());
                count.unlike += u64::from((both & (s ^ t)).count_ones());
            }
            let sum = &mut counts[separation(a, b)];
            (sum.known, sum.unlike) = (sum.known + count.known, sum.unlike + count.unlike);
        }
    }
    counts
}

/// Sums over all lags, before and after: of the squared correlation of the waves, and of that of their signs, times (π/2)².
#[derive(Clone, Copy, Default)]
struct Squares {
    waves: f64,
    signs: f64,
}

/// Those of all pairs of gauges that lie in each way from each other.
fn squares(gauges: &[Gauge], lag_max: usize, length: usize) -> [Squares; SEPARATIONS] {
    let mut squares = [Squares::default(); SEPARATIONS];
    for lag in 0..=lag_max {
        // Far lags are weighted down, so that they do not run wild.
        let weight = (1.0 - lag as f64 / length as f64).powi(2) * if lag == 0 { 1.0 } else { 2.0 };
        for (sum, Count { known, unlike }) in squares.iter_mut().zip(counts(gauges, lag)) {
            // Correlation of the signs of a(t) and b(t + lag) over all pairs where both are known.
            let correlation = if known > 0 { 1.0 - 2.0 * unlike as f64 / known as f64 } else { 0.0 };
            let angle = FRAC_PI_2 * correlation;
            sum.waves += weight * angle.sin().powi(2);
            sum.signs += weight * angle.powi(2);
        }
    }
    squares
}
