//! Two series of the same water, compared in time, in frequency and by regression.

use super::align::{Pair, SAMPLES_MIN, ordered, span_s};
use super::cross::AtPeak;
use super::lag;
use super::ratio::Ratio;
use super::regression::Regression;
use super::spectra::Spectra;
use super::{CompareError, Which};
use crate::crossing::WaveStatistics;
use crate::interval::{Interval, WaveIntervals};
use crate::quality::series::RawSeries;

/// How two series are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// The lag is looked for within ± this, seconds.
    pub max_lag_s: f64,
    /// Readings further apart than this many of their series' usual interval are a gap, which is left out.
    pub gap_intervals: f64,
    /// Where waves are, hertz. The upper end is lowered to a quarter of the common rate: splines keep 98.6 % of a wave of four
    /// samples.
    pub band_hz: Interval,
    /// Standard deviation of a single reading's noise of the series under test, metres; white.
    pub noise_a_m: f64,
    /// The same of the witness. A resolution of r is a noise of r/√12.
    pub noise_b_m: f64,
    /// What the scale of one sensor to the other is known to, as a share, with 95 %.
    pub scale_95: f64,
}

impl Default for Options {
    /// ± 2 s, gaps of more than three intervals, 0.05 to 2 Hz, no noise, scales to 2 %.
    fn default() -> Self {
        Self { max_lag_s: 2.0, gap_intervals: 3.0, band_hz: (0.05, 2.0), noise_a_m: 0.0, noise_b_m: 0.0, scale_95: 0.02 }
    }
}

impl Options {
    fn checked(&self) -> Result<(), CompareError> {
        let length = |x: f64| x.is_finite() && x >= 0.0;
        let (low_hz, high_hz) = self.band_hz;
        for (good, name) in [
            (length(self.max_lag_s), "max_lag_s"),
            (self.gap_intervals.is_finite() && self.gap_intervals >= 1.0, "gap_intervals"),
            (length(low_hz) && high_hz > low_hz, "band_hz"),
            (length(self.noise_a_m), "noise_a_m"),
            (length(self.noise_b_m), "noise_b_m"),
            (length(self.scale_95), "scale_95"),
        ] {
            if !good {
                return Err(CompareError::Option(name));
            }
        }
        Ok(())
    }
}

/// What one of two series says about the waves, over the time that both have, with 95 % intervals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Waves {
    /// H_m0 of the band, metres, noise included.
    pub h_m0_m: f64,
    /// Its interval.
    pub h_m0_95_m: Interval,
    /// Peak frequency, hertz: top of the parabola through the highest lines.
    pub f_p_hz: f64,
    /// Peak period's interval, seconds.
    pub t_p_95_s: Interval,
    /// H_s (1/3) and T_z by up-crossings; `None` without a whole wave.
    pub crossing: Option<WaveStatistics>,
    /// Their intervals; `None` for fewer than eight waves.
    pub crossing_95: Option<WaveIntervals>,
    /// Noise within the band, m².
    pub noise_m0_m2: f64,
}

/// Two series compared. Lags, regression, and everything after them are of the aligned series less their trends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// Of the common time base, hertz: the slower one's.
    pub rate_hz: f64,
    /// Time that both have, gaps left out, seconds.
    pub common_s: f64,
    /// That, as a share of the shorter series' span.
    pub common_share: f64,
    /// How much later b comes, seconds; `None` where the two do not correlate beyond chance (four deviations of what unrelated
    /// seas give) or the highest correlation is at an end of the search: then they are compared as their stamps are.
    pub lag_s: Option<f64>,
    /// The lowest correlation of the search where it is clearly stronger than the highest, beyond chance: one of the two has its
    /// sign wrong, as a range taken for an elevation. No lag is taken then.
    pub upside_down: Option<f64>,
    /// Pearson's correlation after the lag.
    pub correlation: f64,
    /// a on b.
    pub regression: Regression,
    /// Mean of a − b before trends are off, metres.
    pub bias_m: f64,
    /// Root mean square of a − b after, metres.
    pub rmse_m: f64,
    /// The band that waves were looked for in, hertz.
    pub band_hz: Interval,
    /// Coherence and gain about the peak; `None` where there are too few estimates of them.
    pub at_peak: Option<AtPeak>,
    /// The series under test.
    pub a: Waves,
    /// The witness.
    pub b: Waves,
    /// H_m0 of a over b without noise; `None` where one has no waves above its noise.
    pub height_ratio: Option<Ratio>,
    /// Mean zero-crossing period √(m0/m2) of a over b without noise. Not by counting: its covariance between the two is known.
    pub period_ratio: Option<Ratio>,
}

/// Resampling and clocks leave this share of a period open, with 95 %.
const PERIOD_SCALE_95: f64 = 0.01;
/// By how much a negative correlation must be the stronger one.
const UPSIDE_DOWN: f64 = 0.1;

/// `a`, the series under test, with `b`, the witness.
///
/// # Errors
/// [`CompareError`] where options make no sense, or the series have too little in common to say anything.
pub fn compare(a: &RawSeries<'_>, b: &RawSeries<'_>, options: &Options) -> Result<Comparison, CompareError> {
    options.checked()?;
    let (a, b) = (ordered(a, Which::A)?, ordered(b, Which::B)?);
    let aligned = |lag_s: f64| -> Result<(Pair, f64), CompareError> {
        let mut pair = Pair::of(&a, &b, lag_s, options.gap_intervals)?;
        let samples = pair.both().count();
        let longest = pair.stretches().iter().map(|stretch| stretch.0.len()).max().unwrap_or(0);
        if longest < SAMPLES_MIN {
            return Err(CompareError::TooShort { samples: longest, samples_min: SAMPLES_MIN });
        }
        let bias_m = pair.both().map(|(a, b)| a - b).sum::<f64>() / samples as f64;
        let levels_m = pair.both().fold((0.0_f64, 0.0_f64), |(a, b), pair| (a.max(pair.0.abs()), b.max(pair.1.abs())));
        pair.take_trends_off();
        // What rounding leaves of a constant is no wave.
        let power = |of: fn((f64, f64)) -> f64| (pair.both().map(|both| of(both).powi(2)).sum::<f64>() / samples as f64).sqrt();
        for (which, moved_m, level_m) in [(Which::A, power(|p| p.0), levels_m.0), (Which::B, power(|p| p.1), levels_m.1)] {
            if moved_m.is_nan() || moved_m <= 1e-12 * level_m.max(1e-3) {
                return Err(CompareError::Flat { which });
            }
        }
        Ok((pair, bias_m))
    };
    let noise_density = [(options.noise_a_m, a.interval_s), (options.noise_b_m, b.interval_s)].map(|(m, s)| 2.0 * m * m * s);

    let (mut pair, mut bias_m) = aligned(0.0)?;
    let band_hz = (options.band_hz.0, options.band_hz.1.min(0.25 * pair.rate_hz));
    let mut lag_s = None;
    let mut upside_down = None;
    if let Some(best) = lag::best(&pair, options.max_lag_s)? {
        // Unrelated records correlate with a deviation of one over the root of their degrees of freedom.
        let chance = 4.0 / Spectra::of(&pair, band_hz, noise_density)?.both().freedom().sqrt();
        // A sea's own highest and lowest correlations differ by a quarter; a regular wave's do not, and it has no upside.
        if -best.lowest > chance && -best.lowest > best.correlation + UPSIDE_DOWN {
            upside_down = Some(best.lowest);
        } else if best.inside && best.lag_s.abs() <= options.max_lag_s && best.correlation > chance {
            // Once more from there: the parabola's own error, and that of resampling, then vanish with what is left.
            (pair, bias_m) = aligned(best.lag_s)?;
            let left_s = lag::best(&pair, 2.0 / pair.rate_hz)?.filter(|left| left.inside).map_or(0.0, |left| left.lag_s);
            (pair, bias_m) = if left_s == 0.0 { (pair, bias_m) } else { aligned(best.lag_s + left_s)? };
            lag_s = Some(best.lag_s + left_s);
        }
    }

    let common = pair.both().count();
    let regression =
        Regression::of(pair.both(), options.noise_a_m, options.noise_b_m).ok_or(CompareError::Flat { which: Which::B })?;
    let rmse_m = (pair.both().map(|(a, b)| (a - b).powi(2)).sum::<f64>() / common as f64).sqrt();
    let spectra = Spectra::of(&pair, band_hz, noise_density)?;
    let [seen_a, seen_b] = [Which::A, Which::B].map(|which| spectra.waves(&pair, which, options));
    let shortest_s = [span_s(&a), span_s(&b)].map(|(from, to)| to - from).into_iter().fold(f64::INFINITY, f64::min);
    let common_s = common as f64 / pair.rate_hz;
    let both = spectra.both();
    Ok(Comparison {
        rate_hz: pair.rate_hz,
        common_s,
        common_share: (common_s / shortest_s).min(1.0),
        lag_s,
        upside_down,
        correlation: regression.correlation(),
        regression,
        bias_m,
        rmse_m,
        band_hz,
        at_peak: spectra.coarse.at_peak(band_hz, noise_density[1]),
        a: seen_a?,
        b: seen_b?,
        height_ratio: both.heights(options.scale_95),
        period_ratio: both.periods(PERIOD_SCALE_95),
    })
}
