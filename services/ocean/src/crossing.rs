//! Zero-crossing analysis: single waves and the statistics of their heights and periods.

use crate::record::Record;

/// Where a wave begins and ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Crossing {
    /// Where the surface rises through zero: a wave is a crest and the trough after it.
    Up,
    /// Where it falls through zero: a wave is a trough and the crest after it.
    Down,
}

/// One wave between two successive crossings of the same kind.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wave {
    /// Its first crossing, seconds after the first sample.
    pub start_s: f64,
    /// Time to its second crossing, seconds.
    pub period_s: f64,
    /// Highest sample, metres above zero.
    pub crest_m: f64,
    /// Lowest sample, metres above zero: negative.
    pub trough_m: f64,
}

impl Wave {
    /// Crest to trough, metres.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        self.crest_m - self.trough_m
    }
}

/// The whole waves of `record` about zero; take its mean or trend away first.
///
/// Crossing instants are interpolated linearly; a sample of exactly zero belongs to no side, and a run of them crosses at its
/// first. A crossing counts once the surface has been beyond `deadband_m` on both sides, so that noise of that size about
/// zero makes no waves; 0 is the textbook's rule. What comes before the first crossing and after the last is left out.
/// Crests and troughs are the extreme samples, as in the literature: they miss the true ones by up to 1 − cos(π/n) of the amplitude
/// with n samples a wave.
#[must_use]
pub fn waves(record: &Record, crossing: Crossing, deadband_m: f64) -> Vec<Wave> {
    let [found] = waves_beyond(record, crossing, [deadband_m]);
    found
}

/// The same for several dead bands, in one pass over the record.
#[must_use]
pub fn waves_beyond<const N: usize>(record: &Record, crossing: Crossing, deadbands_m: [f64; N]) -> [Vec<Wave>; N] {
    // A down-crossing of η is an up-crossing of −η.
    let sign = match crossing {
        Crossing::Up => 1.0,
        Crossing::Down => -1.0,
    };
    let (before, rises) = rises(record.samples_m(), sign);
    deadbands_m.map(|deadband_m| joined(&before, &rises, deadband_m.max(0.0), sign, record.rate_hz()))
}

/// What the surface does between two rises through zero, or before the first.
struct Rise {
    /// Instant of the rise, samples.
    at: f64,
    /// Highest and lowest sample, metres.
    high_m: f64,
    low_m: f64,
}

impl Rise {
    fn new(at: f64) -> Self {
        Self { at, high_m: f64::NEG_INFINITY, low_m: f64::INFINITY }
    }
}

/// What comes before the first rise of `sign` × `samples` through zero, and every rise.
fn rises(samples: &[f64], sign: f64) -> (Rise, Vec<Rise>) {
    let mut rises = Vec::new();
    let (mut before, mut current) = (None, Rise::new(0.0));
    // The last sample that was not zero.
    let mut last: (usize, f64) = (0, 0.0);
    // Samples on one side of zero, run by run.
    let mut start = 0;
    while let Some(first) = samples.get(start).map(|x| sign * x) {
        let rest = &samples[start..];
        let length = |is: &dyn Fn(f64) -> bool| rest.iter().position(|x| !is(sign * x)).unwrap_or(rest.len());
        let extreme = |run: &[f64], more: fn(f64, f64) -> f64| run.iter().fold(first, |found, x| more(found, sign * x));
        let end = if first > 0.0 {
            let (j, y) = last;
            if y < 0.0 {
                let at = if j + 1 == start { j as f64 + y / (y - first) } else { (j + 1) as f64 };
                let ended = std::mem::replace(&mut current, Rise::new(at));
                if before.is_none() { before = Some(ended) } else { rises.push(ended) }
            }
            let count = length(&|x| x > 0.0);
            current.high_m = current.high_m.max(extreme(&rest[..count], f64::max));
            start + count
        } else if first < 0.0 {
            let count = length(&|x| x < 0.0);
            current.low_m = current.low_m.min(extreme(&rest[..count], f64::min));
            start + count
        } else {
            start += 1;
            continue;
        };
        last = (end - 1, sign * samples[end - 1]);
        start = end;
    }
    match before {
        Some(before) => {
            rises.push(current);
            (before, rises)
        }
        None => (current, rises),
    }
}

/// Waves from the rises that count with a dead band: those after which the surface comes above it, having been under it since the one before.
fn joined(before: &Rise, rises: &[Rise], deadband_m: f64, sign: f64, rate_hz: f64) -> Vec<Wave> {
    let mut waves = Vec::with_capacity(rises.len());
    let mut below = before.low_m < -deadband_m;
    let mut current: Option<Rise> = None;
    for rise in rises {
        if below && rise.high_m > deadband_m {
            below = false;
            if let Some(wave) = current.replace(Rise::new(rise.at)) {
                // Of −η crests are troughs.
                let (trough_m, crest_m) = if sign > 0.0 { (wave.low_m, wave.high_m) } else { (-wave.high_m, -wave.low_m) };
                waves.push(Wave { start_s: wave.at / rate_hz, period_s: (rise.at - wave.at) / rate_hz, crest_m, trough_m });
            }
        }
        below |= rise.low_m < -deadband_m;
        if let Some(wave) = &mut current {
            (wave.high_m, wave.low_m) = (wave.high_m.max(rise.high_m), wave.low_m.min(rise.low_m));
        }
    }
    waves
}

/// Statistics of a set of waves.
///
/// H_s and T_1/3 are means over the highest third of the waves, H_1/10 over the highest tenth, where n waves have round(n/3) and
/// round(n/10) of them (halves up), and at least one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaveStatistics {
    /// How many.
    pub waves: usize,
    /// Mean height H_m, metres.
    pub h_mean_m: f64,
    /// Root mean square height, metres.
    pub h_rms_m: f64,
    /// Significant height H_s = H_1/3, metres.
    pub h_s_m: f64,
    /// H_1/10, metres.
    pub h_tenth_m: f64,
    /// Highest, metres.
    pub h_max_m: f64,
    /// Mean period T_z, seconds.
    pub t_z_s: f64,
    /// Mean period of the highest third T_1/3, seconds.
    pub t_third_s: f64,
    /// Highest crest, metres.
    pub crest_max_m: f64,
    /// Lowest trough, metres: negative.
    pub trough_min_m: f64,
}

impl WaveStatistics {
    /// Of `waves`, from one record or pooled from several; `None` without a wave.
    #[must_use]
    pub fn of(waves: &[Wave]) -> Option<Self> {
        if waves.is_empty() {
            return None;
        }
        let mut by_height: Vec<(f64, f64)> = waves.iter().map(|w| (w.height_m(), w.period_s)).collect();
        by_height.sort_by(|a, b| b.0.total_cmp(&a.0));
        let n = by_height.len();
        let highest = |share: f64| &by_height[..((n as f64 / share).round() as usize).clamp(1, n)];
        let height = |w: &[(f64, f64)]| w.iter().map(|w| w.0).sum::<f64>() / w.len() as f64;
        let period = |w: &[(f64, f64)]| w.iter().map(|w| w.1).sum::<f64>() / w.len() as f64;
        Some(Self {
            waves: n,
            h_mean_m: height(&by_height),
            h_rms_m: (by_height.iter().map(|w| w.0 * w.0).sum::<f64>() / n as f64).sqrt(),
            h_s_m: height(highest(3.0)),
            h_tenth_m: height(highest(10.0)),
            h_max_m: by_height[0].0,
            t_z_s: period(&by_height),
            t_third_s: period(highest(3.0)),
            crest_max_m: waves.iter().map(|w| w.crest_m).fold(f64::NEG_INFINITY, f64::max),
            trough_min_m: waves.iter().map(|w| w.trough_m).fold(f64::INFINITY, f64::min),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use std::f64::consts::{PI, TAU};

    fn record(n: usize, rate_hz: f64, f: impl Fn(f64) -> f64) -> Record {
        Record::new((0..n).map(|i| f(i as f64 / rate_hz)).collect::<Vec<_>>(), rate_hz).unwrap()
    }

    #[test]
    fn every_wave_of_a_sine_is_the_same() {
        let sine = record(6000, 100.0, |t| 0.3 * (TAU * t / 2.37 + 0.4).sin());
        for crossing in [Crossing::Up, Crossing::Down] {
            let waves = waves(&sine, crossing, 0.0);
            assert_eq!(waves.len(), 24); // 25.3 periods hold 25 crossings of each kind
            for wave in &waves {
                assert_relative_eq!(wave.height_m(), 0.6, max_relative = 2e-4);
                assert_relative_eq!(wave.period_s, 2.37, max_relative = 1e-4);
            }
            let all = WaveStatistics::of(&waves).unwrap();
            assert_relative_eq!(all.h_s_m, 0.6, max_relative = 2e-4);
            assert_relative_eq!(all.h_max_m, all.h_mean_m, max_relative = 2e-4);
            assert_relative_eq!(all.t_z_s, 2.37, max_relative = 1e-5);
        }
    }

    #[test]
    fn crossings_are_interpolated() {
        let saw = Record::new(vec![-1.0, 3.0, -1.0, -1.0, 1.0, -1.0], 2.0).unwrap();
        let waves = waves(&saw, Crossing::Up, 0.0);
        // Crossings a quarter of the way from sample 0 and half of the way from sample 3.
        assert_eq!(waves, vec![Wave { start_s: 0.125, period_s: 1.625, crest_m: 3.0, trough_m: -1.0 }]);
    }

    /// The rule as it is stated, sample by sample.
    fn plainly(record: &Record, crossing: Crossing, deadband: f64) -> Vec<Wave> {
        let samples = record.samples_m();
        let up: Vec<f64> = samples.iter().map(|x| if crossing == Crossing::Up { *x } else { -x }).collect();
        let (mut instants, mut rise, mut below, mut last) = (Vec::new(), None, false, None::<usize>);
        for i in (0..up.len()).filter(|i| up[*i] != 0.0) {
            if let Some(j) = last.filter(|j| up[*j] < 0.0 && up[i] > 0.0) {
                rise = Some(if j + 1 == i { j as f64 + up[j] / (up[j] - up[i]) } else { (j + 1) as f64 });
            }
            if up[i] < -deadband {
                below = true;
            } else if up[i] > deadband && below {
                below = false;
                instants.extend(rise);
            }
            last = Some(i);
        }
        let of = |pair: &[f64]| {
            let inside = &samples[pair[0].ceil() as usize..=pair[1].floor() as usize];
            Wave {
                start_s: pair[0] / record.rate_hz(),
                period_s: (pair[1] - pair[0]) / record.rate_hz(),
                crest_m: inside.iter().copied().fold(f64::NEG_INFINITY, f64::max),
                trough_m: inside.iter().copied().fold(f64::INFINITY, f64::min),
            }
        };
        instants.windows(2).map(of).collect()
    }

    proptest::proptest! {
        /// Whatever the surface does, one pass for several dead bands finds what the rule says of each. Few levels, so that zeros, and samples just on
        /// a dead band, are common.
        #[test]
        fn one_pass_finds_what_the_rule_says(levels in proptest::collection::vec(-4_i32..=4, 4..120), bands in (0_i32..4, 0_i32..4)) {
            let record = Record::new(levels.iter().map(|level| 0.25 * f64::from(*level)).collect::<Vec<_>>(), 4.0).unwrap();
            let deadbands = [0.25 * f64::from(bands.0), 0.25 * f64::from(bands.1) - 0.1];
            for crossing in [Crossing::Up, Crossing::Down] {
                let found = waves_beyond(&record, crossing, deadbands);
                for (found, deadband) in found.iter().zip(deadbands) {
                    proptest::prop_assert_eq!(found, &plainly(&record, crossing, deadband.max(0.0)));
                }
            }
        }
    }

    #[test]
    fn zeros_are_on_no_side() {
        // Touches zero from below once (no crossing), crosses through a run of zeros twice.
        let flat = Record::new(vec![-1.0, 0.0, -1.0, 0.0, 0.0, 2.0, -1.0, 0.0, 1.0, -1.0], 1.0).unwrap();
        let waves = waves(&flat, Crossing::Up, 0.0);
        assert_eq!(waves, vec![Wave { start_s: 3.0, period_s: 4.0, crest_m: 2.0, trough_m: -1.0 }]);
    }

    #[test]
    fn still_water_and_one_crossing_hold_no_wave() {
        assert!(waves(&record(50, 2.0, |_| 0.0), Crossing::Up, 0.0).is_empty());
        assert!(waves(&record(50, 2.0, |_| 0.7), Crossing::Up, 0.0).is_empty());
        assert!(waves(&record(50, 2.0, |t| t - 10.0), Crossing::Up, 0.0).is_empty());
        assert_eq!(WaveStatistics::of(&[]), None);
    }

    #[test]
    fn ripples_within_the_deadband_make_no_waves() {
        // A slow wave with a small ripple that crosses zero many times beside each of its crossings.
        let sea = record(4000, 20.0, |t| (TAU * t / 10.0).sin() - 0.08 * (TAU * t / 0.4).sin());
        // It starts at a rise, which nothing came before: 19 rises follow, 18 waves between them.
        assert!(waves(&sea, Crossing::Up, 0.0).len() > 18);
        let whole = waves(&sea, Crossing::Up, 0.1);
        assert_eq!(whole.len(), 18);
        assert!(whole.iter().all(|w| (w.period_s - 10.0).abs() < 0.5));
    }

    /// Known heights 1 to 9 in a shuffled order: the highest third is 9, 8, 7; the highest tenth is 9.
    #[test]
    fn the_highest_third_is_the_highest_third() {
        let heights = [4.0, 9.0, 1.0, 7.0, 3.0, 8.0, 2.0, 6.0, 5.0];
        let waves: Vec<Wave> =
            heights.iter().map(|h| Wave { start_s: 0.0, period_s: 10.0 + h, crest_m: 0.6 * h, trough_m: -0.4 * h }).collect();
        let all = WaveStatistics::of(&waves).unwrap();
        assert_relative_eq!(all.h_mean_m, 5.0);
        assert_relative_eq!(all.h_rms_m, (285.0f64 / 9.0).sqrt());
        assert_relative_eq!(all.h_s_m, 8.0);
        assert_relative_eq!(all.h_tenth_m, 9.0);
        assert_relative_eq!(all.t_third_s, 18.0);
        assert_relative_eq!(all.crest_max_m, 5.4);
        assert_relative_eq!(all.trough_min_m, -3.6);
    }

    /// Longuet-Higgins (1952): a narrow-band Gaussian sea has Rayleigh heights, H_s = 4.004 √m0, H_m = √2π √m0,
    /// H_1/10 = 5.091 √m0. A random sum of many lines within ±5 % of 0.1 Hz; heights scatter by about 0.5/√n, and waves come in
    /// groups of some ten, so 20,000 waves are worth about 2,000: four standard errors are 4 %.
    #[test]
    fn narrow_band_heights_are_rayleigh() {
        use rand::{Rng, SeedableRng};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(11);
        let lines: Vec<(f64, f64)> =
            (0..200).map(|_| (random.random_range(0.095..0.105), random.random_range(0.0..TAU))).collect();
        let sea = record(400_000, 2.0, |t| lines.iter().map(|(f, phase)| (TAU * f * t + phase).cos()).sum::<f64>() * 0.1);
        let sigma = 0.1 * 100f64.sqrt(); // 200 lines of variance 0.1²/2 each
        let all = WaveStatistics::of(&waves(&sea, Crossing::Up, 0.0)).unwrap();
        assert_relative_eq!(all.h_s_m, 4.004 * sigma, max_relative = 0.04);
        assert_relative_eq!(all.h_mean_m, (2.0 * PI).sqrt() * sigma, max_relative = 0.04);
        assert_relative_eq!(all.h_tenth_m, 5.091 * sigma, max_relative = 0.04);
        assert_relative_eq!(all.t_z_s, 10.0, max_relative = 0.01);
    }
}
