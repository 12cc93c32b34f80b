//! How much a finite window can tell: degrees of freedom of the pooled variance.

use super::gauge::GAUGES;
use super::series::Series;

/// Correlations further apart than this many mean periods are taken as nothing.
const LAG_PERIODS: f64 = 5.0;
/// The degrees of freedom come from the same short window as the variance; so much of them is claimed. The upper bound of H_m0 is then under the truth in
/// 2.7 of 100 made seas with noise and gaps; with all of it claimed it was in 3 to 4.
const CLAIMED: f64 = 0.9;
/// Lags reach at least this far, seconds.
const LAG_S_MIN: f64 = 2.0;

/// Equivalent degrees of freedom of the variance pooled over all gauges: 2 / CV².
///
/// For a Gaussian surface the variance of that estimate is (2/T) ∫ R²(τ) dτ with R² the mean of all pairs of gauges' squared
/// covariances (Bendat & Piersol, 8.2.2): neighbours that see the same waves, now or a moment later, count as one. Sample
/// covariances are noisy, and their squares biased by about (1/T) ∫ R² each; that is taken off. Half of it is the number of
/// independent waves that the window is worth. `None` without data.
pub(crate) fn degrees_of_freedom(series: &Series, interval_s: f64, period_s: Option<f64>) -> Option<f64> {
    let (table, length) = table(series, interval_s);
    let used: Vec<Gauge> = table.into_iter().flatten().map(|elevation_m| Gauge::of(&elevation_m)).collect();
    let gauges = used.len() as f64;
    let duration_s = length as f64 * interval_s;
    let lag_s = (LAG_PERIODS * period_s.unwrap_or(0.0)).max(LAG_S_MIN).min(duration_s / 3.0);
    let lag_max = (lag_s / interval_s).round() as usize;
    if used.is_empty() || lag_max == 0 || lag_max >= length {
        return None;
    }
    let variance = used.iter().map(|x| covariance(x, x, 0)).sum::<f64>() / gauges;
    if variance <= 0.0 {
        return None;
    }
    let (mut all, mut own) = (0.0, 0.0);
    for (i, a) in used.iter().enumerate() {
        for (j, b) in used.iter().enumerate() {
            let squares: f64 = (0..=lag_max).map(|lag| covariance(a, b, lag).powi(2) * if lag == 0 { 1.0 } else { 2.0 }).sum();
            all += squares;
            own += if i == j { squares } else { 0.0 };
        }
    }
    let scale = 2.0 * interval_s / (duration_s * variance * variance);
    let (all, own) = (all * scale / (gauges * gauges), own * scale / gauges);
    let bias = 2.0 * lag_max as f64 * interval_s / duration_s;
    let own = own / (1.0 + bias);
    // No better than gauges that know nothing of each other, no worse than one.
    let cv_squared = (all - bias * own).clamp(own / gauges, own);
    Some(CLAIMED * 2.0 / cv_squared)
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

/// One gauge's elevations, nothing where they are not known, and where they are.
struct Gauge {
    elevation_m: Vec<f64>,
    known: Vec<f64>,
}

impl Gauge {
    fn of(elevation_m: &[f64]) -> Self {
        let known = elevation_m.iter().map(|x| f64::from(u8::from(!x.is_nan()))).collect();
        Self { elevation_m: elevation_m.iter().map(|x| if x.is_nan() { 0.0 } else { *x }).collect(), known }
    }
}

/// Mean of a(t) b(t + lag) where both are known, weighted down as lags get longer, so that far ones do not run wild. What is missing here and there
/// makes a mean no smaller: it would pass for waves that soon forget each other.
fn covariance(a: &Gauge, b: &Gauge, lag: usize) -> f64 {
    let pairs = lagged(&a.known, &b.known, lag);
    let length = a.known.len() as f64;
    if pairs > 0.0 { lagged(&a.elevation_m, &b.elevation_m, lag) / pairs * (1.0 - lag as f64 / length) } else { 0.0 }
}

/// Sum of a(t) b(t + lag).
fn lagged(a: &[f64], b: &[f64], lag: usize) -> f64 {
    const LANES: usize = 8;
    let later = b.get(lag..).unwrap_or_default();
    let (ours, theirs) = (a[..later.len().min(a.len())].chunks_exact(LANES), later.chunks_exact(LANES));
    let rest: f64 = ours.remainder().iter().zip(theirs.remainder()).map(|(x, y)| x * y).sum();
    // Sums side by side, which the processor takes at once.
    let mut sums = [0.0; LANES];
    for (x, y) in ours.zip(theirs) {
        for ((sum, x), y) in sums.iter_mut().zip(x).zip(y) {
            *sum += x * y;
        }
    }
    rest + sums.iter().sum::<f64>()
}
