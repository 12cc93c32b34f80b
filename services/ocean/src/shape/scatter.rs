//! How an estimated spectrum scatters about the true one, and what its taper makes of it.
//!
//! A line of a Welch estimate is the true density times χ²_ν/ν. Overlapping segments share samples, and neighbouring lines share
//! a taper's main lobe, so that there are two numbers of degrees of freedom: of a line by itself, and of what a line adds to a
//! sum over many.

use crate::confidence::variance_factors_95;
use crate::interval::Interval;
use crate::welch::{SampledSpectrum, Taper, Welch};

/// Half lines to either side over which a taper spreads a line.
const REACH: usize = 8;

/// Degrees of freedom and spread of an estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct Scatter {
    line_dof: f64,
    joint_dof: f64,
    /// Shares of the true density in an estimated line, at distances of 0, ½, 1, … lines to either side; `None`: it is not
    /// spread.
    spread: Option<[f64; REACH + 1]>,
    /// The line at half the sampling rate, which has half the degrees of freedom.
    nyquist: Option<usize>,
}

impl Scatter {
    /// Of the spectrum that `welch` makes of a record of so many samples; `None` where it makes none.
    ///
    /// Degrees of freedom of a line are Welch's (1967), ν = 2K/(1 + 2 Σ (1 − j/K) ρⱼ) for K segments, where ρⱼ is the squared
    /// correlation of the taper with itself j segments later (Percival & Walden 1993, 6.17): 36 K²/(19 K − 1) for Hann's.
    #[must_use]
    pub fn of(welch: &Welch, samples: usize) -> Option<Self> {
        let n = welch.segment_samples;
        if n < crate::Record::SAMPLES_MIN || samples < n {
            return None;
        }
        let step = n.div_ceil(2);
        let segments = (samples - n) / step + 1;
        let square: Vec<f64> = (0..n).map(|i| welch.taper.at(i as f64 / n as f64).powi(2)).collect();
        let power: f64 = square.iter().sum();
        let shared: f64 = square.iter().zip(&square[step..]).map(|(a, b)| (a * b).sqrt()).sum();
        // Steps of half a segment: only the next one overlaps, as tapers are nowhere negative.
        let k = segments as f64;
        let line_dof = 2.0 * k / (1.0 + 2.0 * (1.0 - 1.0 / k) * (shared / power).powi(2));
        // How much each sample counts in the sum of all segments; unequal weights are worth fewer samples.
        let mut weight = vec![0.0; samples];
        for start in (0..segments).map(|segment| segment * step) {
            weight[start..].iter_mut().zip(&square).for_each(|(weight, square)| *weight += square);
        }
        let (sum, of_squares) = weight.iter().fold((0.0, 0.0), |(a, b), w| (a + w, b + w * w));
        Some(Self {
            line_dof,
            joint_dof: 2.0 * sum * sum / of_squares / n as f64,
            spread: Some(spread(welch.taper)),
            nyquist: n.is_multiple_of(2).then_some(n / 2),
        })
    }

    /// Of an estimate whose lines are independent and not spread, as of a file that gives degrees of freedom; `None` unless these
    /// are positive and finite.
    #[must_use]
    pub fn independent(dof: f64) -> Option<Self> {
        let good = dof > 0.0 && dof.is_finite();
        good.then_some(Self { line_dof: dof, joint_dof: dof, spread: None, nyquist: None })
    }

    /// Degrees of freedom of one line.
    #[must_use]
    pub fn line_dof(&self) -> f64 {
        self.line_dof
    }

    /// Degrees of freedom that each line adds to a smooth sum of many: fewer than [`Self::line_dof`] where lines resemble their
    /// neighbours.
    ///
    /// The variance of Σ g Ŝ df is (1/T) ∫ g² S² df (Bendat & Piersol 2010, 8.5) over the record's time, less what the tapers'
    /// uneven weights on its samples lose.
    #[must_use]
    pub fn joint_dof(&self) -> f64 {
        self.joint_dof
    }

    /// Between what the true density at each line lies with 95 % confidence, each line by itself, m²/Hz.
    ///
    /// The mean and, for segments of an even length, half the sampling rate have half the degrees of freedom. What a taper's main
    /// lobe averages over (1.5 lines for Hann's) is not told apart by any interval.
    #[must_use]
    pub fn density_intervals_95(&self, spectrum: &SampledSpectrum) -> Vec<Interval> {
        let (whole, half) = (variance_factors_95(self.line_dof), variance_factors_95(0.5 * self.line_dof));
        let of = |(line, density): (usize, &f64)| {
            let (low, high) = if line == 0 || Some(line) == self.nyquist { half } else { whole };
            (density * low, density * high)
        };
        spectrum.density_m2_per_hz().iter().enumerate().map(of).collect()
    }

    /// What is expected of the estimate at `lines` where the true density at half lines is `truth(2 × line)`.
    pub(super) fn expected(&self, lines: std::ops::Range<usize>, truth: impl Fn(f64) -> f64) -> Vec<f64> {
        let Some(spread) = &self.spread else { return lines.map(|line| truth(line as f64)).collect() };
        let first = 2 * lines.start as i64 - REACH as i64;
        let halves: Vec<f64> = (0..2 * lines.len() + 2 * REACH).map(|i| truth(0.5 * (first + i as i64).abs() as f64)).collect();
        (0..lines.len())
            .map(|line| {
                let middle = 2 * line + REACH;
                let beside = |distance: usize| halves[middle - distance] + halves[middle + distance];
                spread[0] * halves[middle] + (1..=REACH).map(|distance| spread[distance] * beside(distance)).sum::<f64>()
            })
            .collect()
    }

    /// What a sum of estimated `lines` with these weights is a sum of: frequencies in lines and the weights of the true density
    /// there, scaled so that the sum's variance is 2/`joint_dof` Σ (weight × density)².
    pub(super) fn true_weights(&self, lines: std::ops::Range<usize>, weights: &[f64]) -> Vec<(f64, f64)> {
        let Some(spread) = &self.spread else { return lines.map(|line| line as f64).zip(weights.iter().copied()).collect() };
        let first = 2.0 * lines.start as f64 - REACH as f64;
        let mut halves = vec![0.0; 2 * weights.len() + 2 * REACH];
        for (line, weight) in weights.iter().enumerate() {
            let middle = 2 * line + REACH;
            halves[middle] += spread[0] * weight;
            for (distance, share) in spread.iter().enumerate().skip(1) {
                halves[middle - distance] += share * weight;
                halves[middle + distance] += share * weight;
            }
        }
        // Twice as many halves as lines, of half the weight each: their squares are half of what those of lines are.
        let scaled = |(i, weight): (usize, f64)| (0.5 * (first + i as f64), std::f64::consts::SQRT_2 * weight);
        halves.into_iter().enumerate().map(scaled).collect()
    }
}

/// Shares of a line's estimate by distance in half lines: the squared transform of the taper a + b cos, which is a sinc and its
/// neighbours.
fn spread(taper: Taper) -> [f64; REACH + 1] {
    let (level, cosine) = match taper {
        Taper::Hann => (0.5, 0.5),
        Taper::Hamming => (0.54, 0.46),
        Taper::Rectangle => (1.0, 0.0),
    };
    let sinc = |x: f64| if x == 0.0 { 1.0 } else { (std::f64::consts::PI * x).sin() / (std::f64::consts::PI * x) };
    let mut shares = [0.0; REACH + 1];
    for (i, share) in shares.iter_mut().enumerate() {
        let x = 0.5 * i as f64;
        *share = (level * sinc(x) + 0.5 * cosine * (sinc(x - 1.0) + sinc(x + 1.0))).powi(2);
    }
    let sum = shares[0] + 2.0 * shares[1..].iter().sum::<f64>();
    shares.map(|share| share / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Record;
    use approx::assert_relative_eq;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const TAPERS: [Taper; 3] = [Taper::Hann, Taper::Hamming, Taper::Rectangle];

    fn scatter(segment_samples: usize, taper: Taper, samples: usize) -> Scatter {
        Scatter::of(&Welch { segment_samples, taper }, samples).unwrap()
    }

    /// Percival & Walden (1993), 6.17: 36 K²/(19 K − 1) for Hann's taper; Harris (1978), table I: half-overlapped segments are
    /// correlated by 16.7 % (Hann), 23.5 % (Hamming) and 50 % (none).
    #[test]
    fn degrees_of_freedom_are_the_published_ones() {
        for segments in [1.0, 2.0, 7.0, 100.0_f64] {
            let of = |taper| scatter(512, taper, 256 * (segments as usize + 1)).line_dof();
            assert_relative_eq!(of(Taper::Hann), 36.0 * segments * segments / (19.0 * segments - 1.0), max_relative = 1e-9);
            for (taper, correlation) in [(Taper::Hann, 0.167_f64), (Taper::Hamming, 0.235), (Taper::Rectangle, 0.5)] {
                let expected = 2.0 * segments / (1.0 + 2.0 * (1.0 - 1.0 / segments) * correlation.powi(2));
                assert_relative_eq!(of(taper), expected, max_relative = 3e-3);
            }
        }
    }

    /// Closed forms of sums over many lines: Σw⁴ n/(Σw²)² is 35/18 for one Hann segment; of many, overlapped by half, weights are
    /// 3/4 + 1/4 cos, whose mean square is 1 + 1/18 of their squared mean. Without a taper a single segment loses nothing.
    #[test]
    fn joint_degrees_of_freedom_are_closed_forms() {
        assert_relative_eq!(scatter(512, Taper::Rectangle, 600).joint_dof(), 2.0, max_relative = 1e-9);
        assert_relative_eq!(scatter(512, Taper::Hann, 600).joint_dof(), 2.0 * 18.0 / 35.0, max_relative = 1e-9);
        assert_relative_eq!(scatter(512, Taper::Hann, 512_000).joint_dof(), 2000.0 * 18.0 / 19.0, max_relative = 2e-3);
    }

    /// Hann's main lobe on whole lines is 1/6, 2/3, 1/6, half of all weights on half lines; what else there is adds up to the
    /// other half.
    #[test]
    fn hanns_taper_spreads_a_line_over_its_neighbours() {
        let shares = spread(Taper::Hann);
        assert_relative_eq!(shares[0], 1.0 / 3.0, max_relative = 1e-4);
        assert_relative_eq!(shares[2], 1.0 / 12.0, max_relative = 1e-4);
        assert!(shares[4] < 1e-12 && shares[6] < 1e-12);
        let even = scatter(64, Taper::Hamming, 640).expected(3..20, |_| 2.0);
        // And back: of even weights everything is even, and squares add up to as much, but for the ends.
        let squares: f64 = scatter(64, Taper::Hamming, 640).true_weights(3..203, &[2.0; 200]).iter().map(|(_, w)| w * w).sum();
        assert_relative_eq!(squares, 200.0 * 4.0, max_relative = 0.01);
        assert!(even.len() == 17 && even.iter().all(|density| (density - 2.0).abs() < 1e-12));
    }

    /// White noise: Var Ŝ/S² is 2/ν, and the intervals hold the truth in 95 % of all lines. Sums over lines 20 to 100 have 81
    /// joint ν.
    #[test]
    fn white_noise_scatters_as_stated() {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        for taper in TAPERS {
            let (welch, samples) = (Welch { segment_samples: 256, taper }, 256 * 6 + 40);
            let scatter = Scatter::of(&welch, samples).unwrap();
            let (mut squares, mut held, mut lines, mut sums) = (0.0, 0.0, 0.0, Vec::new());
            for _ in 0..2000 {
                let noise: Vec<f64> = (0..samples).map(|_| random.sample(rand_distr::StandardNormal)).collect();
                let spectrum = welch.spectrum(&Record::new(noise, 2.0).unwrap()).unwrap();
                let intervals = scatter.density_intervals_95(&spectrum);
                for (density, (low, high)) in spectrum.density_m2_per_hz().iter().zip(intervals).take(126).skip(3).step_by(3) {
                    squares += (density - 1.0).powi(2);
                    held += f64::from(u8::from((low..=high).contains(&1.0)));
                    lines += 1.0;
                }
                sums.push(spectrum.density_m2_per_hz()[20..=100].iter().sum::<f64>() / 81.0);
            }
            assert_relative_eq!(squares / lines, 2.0 / scatter.line_dof(), max_relative = 0.03);
            assert!((held / lines - 0.95).abs() < 0.01, "{taper:?}: {}", held / lines);
            let variance = sums.iter().map(|sum| (sum - 1.0).powi(2)).sum::<f64>() / sums.len() as f64;
            // Four standard errors of a variance of 2000 are 13 %.
            assert_relative_eq!(variance, 2.0 / (81.0 * scatter.joint_dof()), max_relative = 0.13);
        }
    }

    #[test]
    fn the_mean_and_half_the_rate_are_known_less() {
        let spectrum = SampledSpectrum::new(0.1, vec![1.0; 129]).unwrap();
        let intervals = scatter(256, Taper::Hann, 2560).density_intervals_95(&spectrum);
        assert!(intervals[0].1 > intervals[1].1 && intervals[128] == intervals[0] && intervals[127] == intervals[1]);
        let odd = scatter(257, Taper::Hann, 2560).density_intervals_95(&spectrum);
        assert_eq!(odd[128], odd[1]);
    }

    #[test]
    fn what_makes_no_spectrum_has_no_scatter() {
        assert_eq!(Scatter::of(&Welch::new(100), 99), None);
        assert_eq!(Scatter::of(&Welch::new(3), 99), None);
        for dof in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(Scatter::independent(dof), None);
        }
    }
}
