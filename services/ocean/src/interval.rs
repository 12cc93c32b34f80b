//! 95 % intervals of wave statistics: what a finite record leaves open.
//!
//! | numbers | method |
//! |---|---|
//! | heights and periods of single waves | bootstrap by groups: neighbouring waves resemble each other (large ones come in groups), so that runs of them are drawn, not single ones (Künsch 1989) |
//! | H_m0 | chi-square on the variance, with the degrees of freedom that its spectrum has (Donelan and Pierson 1983) |
//! | mean periods | the spectrum's moments and their covariances, to first order |
//! | peak period | the frequencies about the peak whose density may be as high as the peak's |
//!
//! A taper weighs the samples unevenly, and leaves fewer of them: a single segment under Hann's tells as much as (3/8)²/(35/128) = 0.51 of its length.
//! Of a Gaussian sea of length T the moments mₐ and m_b have the covariance (1/T) ∫ fᵃ⁺ᵇ S²(f) df (Bendat and Piersol 2010, 8.5).

use crate::confidence::variance_factors_95;
use crate::crossing::{Wave, WaveStatistics};
use crate::height::{H_S_OVER_ROOT_M0, H_TENTH_OVER_ROOT_M0};
use crate::record::Record;
use crate::shape::Scatter;
use crate::welch::{SampledSpectrum, SpectralStatistics, Taper, Welch};

/// Low and high end.
pub type Interval = (f64, f64);

/// Degrees of freedom come from the same record as the variance: when it is low by chance, they are high. So much of them is claimed.
pub(crate) const CLAIMED: f64 = 0.85;
/// Two-sided 95 % of the normal distribution.
pub(crate) const NORMAL_95: f64 = 1.959_964;
/// Redrawn records; the ends of an interval are then known to a tenth of its width.
const DRAWS: usize = 400;
/// Waves in a group, at most. Correlation of successive heights is about 0.2 to 0.4 in wind seas, and lasts for a few waves: groups must be
/// longer than that, and there must be many of them.
const GROUP_MAX: usize = 12;
/// Of fewer waves nothing can be redrawn.
const WAVES_MIN: usize = 8;

/// Intervals of [`WaveStatistics`]. The highest wave, crest and trough of a record are facts of it and have none.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "as WaveStatistics has them")]
pub struct WaveIntervals {
    pub h_mean_m: Interval,
    pub h_rms_m: Interval,
    pub h_s_m: Interval,
    pub h_tenth_m: Interval,
    pub t_z_s: Interval,
    pub t_third_s: Interval,
}

impl WaveIntervals {
    /// Of `waves` in the order they came; `None` for fewer than eight. The same waves give the same intervals.
    #[must_use]
    pub fn of(waves: &[Wave]) -> Option<Self> {
        let n = waves.len();
        if n < WAVES_MIN {
            return None;
        }
        let measured = WaveStatistics::of(waves)?;
        // Four groups at least.
        let group = GROUP_MAX.min(n / 4);
        // By height, the highest first: then a redrawn record is a list of how often each was drawn.
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|a, b| waves[*b].height_m().total_cmp(&waves[*a].height_m()));
        let mut rank = vec![0; n];
        order.iter().enumerate().for_each(|(place, wave)| rank[*wave] = place);
        // Groups run on from the last wave to the first: every wave is drawn as often.
        rank.extend_from_within(..group);
        let sorted: Vec<(f64, f64)> = order.iter().map(|wave| (waves[*wave].height_m(), waves[*wave].period_s)).collect();

        let mut random = Random(0x9e37_79b9_7f4a_7c15);
        let mut draws: [Vec<f64>; 6] = Default::default();
        let mut times = vec![0_u32; n];
        let counts = [part(n, 10.0), part(n, 3.0), n];
        for _ in 0..DRAWS {
            times.fill(0);
            let mut drawn = 0;
            while drawn < n {
                let start = random.below(n);
                for place in &rank[start..start + group.min(n - drawn)] {
                    times[*place] += 1;
                }
                drawn += group;
            }
            let [tenth, third, all] = shares(&sorted, &times, counts);
            let values = [all.height_m, all.square_m2.sqrt(), third.height_m, tenth.height_m, all.period_s, third.period_s];
            draws.iter_mut().zip(values).for_each(|(draws, value)| draws.push(value));
        }
        // Groups that are drawn differ less than groups that could have been: (n − 1)/n of the variance, with n groups; and how much they
        // differ is itself known from n of them only.
        let freedom = n as f64 / group as f64 - 1.0;
        let widen = (1.0 + 1.0 / freedom).sqrt() * student_95(freedom) / NORMAL_95;
        let ends = |draws: &mut Vec<f64>, value: f64| {
            draws.sort_by(f64::total_cmp);
            let at = |p: f64| draws[((p * draws.len() as f64) as usize).min(draws.len() - 1)];
            // About the value itself: mean heights of redrawn records are biased low where few waves make them.
            let middle = at(0.5);
            (value + widen * (at(0.025) - middle), value + widen * (at(0.975) - middle))
        };
        let [h_mean, h_rms, h_s, h_tenth, t_z, t_third] = &mut draws;
        let positive = |(low, high): Interval| (low.max(0.0), high);
        Some(Self {
            h_mean_m: positive(ends(h_mean, measured.h_mean_m)),
            h_rms_m: positive(ends(h_rms, measured.h_rms_m)),
            h_s_m: positive(ends(h_s, measured.h_s_m)),
            h_tenth_m: positive(ends(h_tenth, measured.h_tenth_m)),
            t_z_s: positive(ends(t_z, measured.t_z_s)),
            t_third_s: positive(ends(t_third, measured.t_third_s)),
        })
    }
}

impl WaveIntervals {
    /// The same with an upper end of H_1/10 that is no lower than H_m0's (`h_m0_high_m`) has it for Rayleigh heights, 5.091/4.004 of it
    /// (Longuet-Higgins 1952): of few waves the highest tenth is one or two, and a redrawn record has no higher one than was seen.
    #[must_use]
    pub fn not_below(mut self, h_m0_high_m: f64) -> Self {
        self.h_tenth_m.1 = self.h_tenth_m.1.max(H_TENTH_OVER_ROOT_M0 / H_S_OVER_ROOT_M0 * h_m0_high_m);
        self
    }
}

/// Two-sided 95 % of Student's distribution: Cornish and Fisher's expansion, good to a percent from four degrees of freedom on.
pub(crate) fn student_95(freedom: f64) -> f64 {
    NORMAL_95 + 2.372_27 / freedom + 2.822_5 / freedom.powi(2) + 2.555_8 / freedom.powi(3)
}

/// How many waves the highest 1/`share` of n are, as [`WaveStatistics`] has it.
fn part(n: usize, share: f64) -> usize {
    ((n as f64 / share).round() as usize).clamp(1, n)
}

/// Means over some waves, or sums.
#[derive(Clone, Copy)]
struct Means {
    height_m: f64,
    square_m2: f64,
    period_s: f64,
}

impl Means {
    fn add(&mut self, (height_m, period_s): (f64, f64), weight: f64) {
        self.height_m += weight * height_m;
        self.square_m2 += weight * height_m * height_m;
        self.period_s += weight * period_s;
    }

    fn over(self, count: f64) -> Self {
        Self { height_m: self.height_m / count, square_m2: self.square_m2 / count, period_s: self.period_s / count }
    }
}

/// Over the highest so many of a redrawn record, for rising `counts` of which the last is all: in one pass, adding up in the order of
/// the heights.
fn shares(sorted: &[(f64, f64)], times: &[u32], counts: [usize; 3]) -> [Means; 3] {
    let mut sum = Means { height_m: 0.0, square_m2: 0.0, period_s: 0.0 };
    let (mut before, mut found, mut place) = (0, [sum; 3], 0);
    for (wave, times) in sorted.iter().zip(times) {
        let after = before + *times as usize;
        // A wave drawn several times may be the last of one share and go on in the next.
        while place < counts.len() && after >= counts[place] {
            let mut means = sum;
            means.add(*wave, (counts[place] - before) as f64);
            found[place] = means.over(counts[place] as f64);
            place += 1;
        }
        sum.add(*wave, f64::from(*times));
        before = after;
    }
    found
}

/// A generator (Marsaglia's xorshift) that needs no crate and gives the same everywhere: nothing hangs on its quality.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((u128::from(self.0) * n as u128) >> 64) as usize
    }
}

/// Intervals of [`SpectralStatistics`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs, reason = "as SpectralStatistics has them")]
pub struct SpectralIntervals {
    /// Equivalent degrees of freedom of the variance: 2 m0² / var(m0).
    pub degrees_of_freedom: f64,
    pub h_m0_m: Interval,
    pub t_p_s: Interval,
    pub t_m01_s: Interval,
    pub t_m02_s: Interval,
    pub t_e_s: Interval,
}

impl SpectralIntervals {
    /// Of `found` in the band `low_hz`…`high_hz` of `spectrum`, which is one of `record` under Hann's window; `None` without energy.
    #[must_use]
    pub fn of(record: &Record, spectrum: &SampledSpectrum, found: &SpectralStatistics, band_hz: Interval) -> Option<Self> {
        Self::under(Taper::Hann, record, spectrum, found, band_hz)
    }

    /// The same under another window.
    #[must_use]
    pub fn under(
        taper: Taper,
        record: &Record,
        spectrum: &SampledSpectrum,
        found: &SpectralStatistics,
        (low_hz, high_hz): Interval,
    ) -> Option<Self> {
        // What smears a peak lowers the square under it: a third of the record tells it better than the segments of a steady spectrum.
        let fine = Welch::new((record.samples_m().len() / 3).max(Record::SAMPLES_MIN)).spectrum(record).ok()?;
        let duration_s = record.duration_s();
        let df_hz = fine.df_hz();
        // A line of so many segments is the true density times a chi-square variable, whose square is too high by this.
        let per_line = 1.0 + 1.0 / independent(duration_s * df_hz);
        let lines = || {
            let all = fine.density_m2_per_hz().iter().enumerate().skip(1).map(|(i, density)| (i as f64 * df_hz, *density));
            all.filter(|(f, _)| (low_hz..=high_hz).contains(f))
        };
        // What the segments of the spectrum itself see of the record.
        let segment_samples = (record.rate_hz() / spectrum.df_hz()).round() as usize;
        let seen = Scatter::of(&Welch { segment_samples, taper }, record.samples_m().len());
        let seen_s = seen.map_or(duration_s, |seen| 0.5 * seen.joint_dof() * segment_samples as f64 / record.rate_hz());
        let covariance = |order: i32| {
            let sum: f64 = lines().map(|(f, density)| f.powi(order) * density * density * df_hz).sum();
            sum / (seen_s * per_line * CLAIMED)
        };
        let m = [-1, 0, 1, 2].map(|order| fine.moment(order, low_hz, high_hz));
        if !(m[1] > 0.0 && duration_s > 0.0) {
            return None;
        }
        let relative = |a: i32, b: i32| covariance(a + b) / (m[(a + 1) as usize] * m[(b + 1) as usize]);
        let degrees_of_freedom = (2.0 / relative(0, 0)).max(1.0);
        // They are known from the record, too, from about half as many independent squares: Student's tails instead of the normal's.
        let widen = student_95(0.5 * degrees_of_freedom) / NORMAL_95;
        let (low, high) = variance_factors_95((degrees_of_freedom / (widen * widen)).max(1.0));
        // Deviation of the logarithm of m_a/m_b; periods are positive, and their intervals multiply.
        let ratio = |a: i32, b: i32| (relative(a, a) + relative(b, b) - 2.0 * relative(a, b)).max(0.0).sqrt();
        let around = |value: f64, deviation: f64| {
            let factor = (NORMAL_95 * widen * deviation).exp();
            (value / factor, value * factor)
        };
        Some(Self {
            degrees_of_freedom,
            h_m0_m: (found.h_m0_m * low.sqrt(), found.h_m0_m * high.sqrt()),
            t_p_s: peak(spectrum, found.f_p_hz, (low_hz, high_hz), independent(duration_s * spectrum.df_hz())),
            t_m01_s: around(found.t_m01_s, ratio(0, 1)),
            t_m02_s: around(found.t_m02_s, 0.5 * ratio(0, 2)),
            t_e_s: around(found.t_e_s, ratio(-1, 0)),
        })
    }
}

/// How many independent segments those of 1/`share` of a record are worth: Hann windows that overlap by half, 0.95 each (Welch 1967).
fn independent(share: f64) -> f64 {
    0.95 * (2.0 * share - 1.0).max(1.0)
}

/// Periods about the peak whose density may be as high: the upper bound of theirs reaches the lower bound of the peak's.
fn peak(spectrum: &SampledSpectrum, f_p_hz: f64, (low_hz, high_hz): Interval, segments: f64) -> Interval {
    let (low, high) = variance_factors_95(2.0 * segments);
    let df_hz = spectrum.df_hz();
    let lines = || {
        let all = spectrum.density_m2_per_hz().iter().enumerate().skip(1).map(|(i, density)| (i as f64 * df_hz, *density));
        all.filter(|(f, _)| (low_hz..=high_hz).contains(f))
    };
    let highest = lines().fold(0.0_f64, |highest, (_, density)| highest.max(density));
    let near = lines().filter(|(_, density)| density * high >= highest * low);
    let (from_hz, to_hz) = near.fold((f_p_hz, f_p_hz), |(from, to), (f, _)| (from.min(f), to.max(f)));
    // A line stands for half a distance to either side.
    let half_hz = 0.5 * df_hz;
    (1.0 / (to_hz + half_hz), 1.0 / (from_hz - half_hz).max(half_hz))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn wave(height_m: f64, period_s: f64) -> Wave {
        Wave { start_s: 0.0, period_s, crest_m: 0.5 * height_m, trough_m: -0.5 * height_m }
    }

    /// Tables of Student's distribution.
    #[test]
    fn students_quantiles_are_the_published_ones() {
        for (freedom, expected) in [(4.0, 2.776), (6.0, 2.447), (10.0, 2.228), (30.0, 2.042), (100.0, 1.984)] {
            assert!((student_95(freedom) / expected - 1.0).abs() < 0.01, "{freedom}");
        }
    }

    #[test]
    fn waves_that_are_all_alike_leave_nothing_open() {
        let found = WaveIntervals::of(&[wave(0.4, 2.0); 50]).unwrap();
        for (interval, value) in [(found.h_mean_m, 0.4), (found.h_s_m, 0.4), (found.t_z_s, 2.0), (found.t_third_s, 2.0)] {
            assert!((interval.0 - value).abs() < 1e-12 && (interval.1 - value).abs() < 1e-12);
        }
        assert_eq!(WaveIntervals::of(&[wave(0.4, 2.0); 7]), None);
    }

    /// Of independent waves the mean's interval is ± 1.96 σ/√n.
    #[test]
    fn independent_waves_have_the_textbooks_interval() {
        let n = 4000_u32;
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let waves: Vec<Wave> = (0..n).map(|_| wave(random.random_range(1.0..2.0), 2.0)).collect();
        let found = WaveIntervals::of(&waves).unwrap();
        let expected = 2.0 * NORMAL_95 * (1.0 / 12.0_f64).sqrt() / f64::from(n).sqrt();
        let width = found.h_mean_m.1 - found.h_mean_m.0;
        assert!((width / expected - 1.0).abs() < 0.2, "{width} {expected}");
    }
}
