//! Mutual information as a matching cost (Hirschmüller 2008, section 2.1; Kim, Kolmogorov and Zabih 2003; thesis 4-15): which grey
//! level of the right picture belongs to which of the left one is learned from the pictures themselves.
//!
//! MI = H_left + H_right − H_joint is a sum over matched pixels of h_left(i) + h_right(k) − h_joint(i, k), where h is minus the
//! logarithm of the smoothed (Parzen) density, smoothed again. What a match lacks of the largest such term is its cost, in nats.
//! Learning takes a disparity map: first that of census, to which brightness hardly matters, then those that the cost itself
//! gives.

use super::cost::{Cost, Prepared};
use super::volume::{CostVolume, Pair};
use super::window::Windows;
use super::{DisparityRange, MatchError, Optimiser, Settings, select};
use crate::core::disparity::Disparity;

/// Grey levels.
const LEVELS: usize = 256;
/// How often the cost is learned: three times is enough even from a random start (Hirschmüller 2008).
const ROUNDS: usize = 3;
/// Learning takes the map of a window at least so wide: better a coarse map than a noisy one.
const WINDOW_PX_MIN: u32 = 7;
/// Standard deviation of the Parzen window, grey levels; it reaches three of them (7 × 7, as in the paper).
const PARZEN_SIGMA_GREY: f64 = 1.0;
/// Densities below this are taken as this: what was never seen is very unlikely, not impossible.
const DENSITY_MIN: f64 = 1e-7;

/// How often each pair of grey levels was matched; weights, so that a known density can be put in as well.
#[derive(Debug, Clone, PartialEq)]
pub struct JointHistogram {
    weights: Vec<f64>,
}

impl Default for JointHistogram {
    fn default() -> Self {
        Self { weights: vec![0.0; LEVELS * LEVELS] }
    }
}

impl JointHistogram {
    /// Counts what `disparity` matches.
    #[must_use]
    pub fn of(pair: &Pair<'_>, disparity: &Disparity) -> Self {
        let mut histogram = Self::default();
        for (pixel, value) in disparity.values_px.iter().enumerate().filter(|(_, value)| value.is_finite()) {
            let d = value.round().max(0.0) as usize;
            if d <= pixel % pair.width {
                histogram.add(pair.left[pixel], pair.right[pixel - d], 1.0);
            }
        }
        histogram
    }

    /// Adds to the weight of a pair.
    pub fn add(&mut self, left: u8, right: u8, weight: f64) {
        self.weights[usize::from(left) * LEVELS + usize::from(right)] += weight;
    }

    /// Mutual information (4-15) in nats, without any smoothing; 0 for an empty histogram.
    #[must_use]
    pub fn mutual_information(&self) -> f64 {
        let density = self.density();
        let (left, right) = marginals(&density);
        entropy(&left) + entropy(&right) - entropy(&density)
    }

    /// What it costs to match left grey level i with right grey level k, at index 256 i + k: nats, the least 0.
    #[must_use]
    pub fn costs(&self) -> Vec<f32> {
        let density = self.density();
        let (mut left, mut right) = marginals(&density);
        let mut joint = density;
        for one in [&mut left, &mut right] {
            information(one, |values| smooth(values, LEVELS, 1));
        }
        information(&mut joint, |values| {
            smooth(values, LEVELS, 1);
            smooth(values, LEVELS, LEVELS);
        });
        let cost = |(i, h): (usize, &f64)| h - left[i / LEVELS] - right[i % LEVELS];
        let least = joint.iter().enumerate().map(cost).fold(f64::INFINITY, f64::min);
        joint.iter().enumerate().map(|entry| (cost(entry) - least) as f32).collect()
    }

    fn density(&self) -> Vec<f64> {
        let total: f64 = self.weights.iter().sum();
        self.weights.iter().map(|weight| if total > 0.0 { weight / total } else { 0.0 }).collect()
    }
}

/// Densities of left and right grey levels alone.
fn marginals(joint: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let left = joint.chunks_exact(LEVELS).map(|row| row.iter().sum()).collect();
    let right = (0..LEVELS).map(|k| joint.iter().skip(k).step_by(LEVELS).sum()).collect();
    (left, right)
}

/// −Σ p ln p, nats.
fn entropy(density: &[f64]) -> f64 {
    -density.iter().filter(|p| **p > 0.0).map(|p| p * p.ln()).sum::<f64>()
}

/// Density to information: smoothed, minus its logarithm, smoothed again.
fn information(density: &mut [f64], smooth: impl Fn(&mut [f64])) {
    smooth(density);
    for p in density.iter_mut() {
        *p = -p.max(DENSITY_MIN).ln();
    }
    smooth(density);
}

/// Gaussian smoothing of each run of `length` values that lie `stride` apart; mirrored at the ends, so that none is lost.
fn smooth(values: &mut [f64], length: usize, stride: usize) {
    let reach = (3.0 * PARZEN_SIGMA_GREY) as isize;
    let weight = |offset: isize| (-0.5 * (offset as f64 / PARZEN_SIGMA_GREY).powi(2)).exp();
    let total: f64 = (-reach..=reach).map(weight).sum();
    let kernel: Vec<(isize, f64)> = (-reach..=reach).map(|offset| (offset, weight(offset) / total)).collect();
    let mirrored = |i: isize| (if i < 0 { -1 - i } else { i.min(2 * length as isize - 1 - i) }) as usize;
    let mut run = vec![0.0; length];
    // With a stride, runs are interleaved; without, they follow each other.
    let starts = (0..values.len()).filter(|i| (i / stride).is_multiple_of(length));
    for start in starts.collect::<Vec<_>>() {
        for (i, value) in run.iter_mut().enumerate() {
            *value = values[start + i * stride];
        }
        for i in 0..length {
            values[start + i * stride] =
                kernel.iter().map(|(offset, weight)| weight * run[mirrored(i as isize + offset)]).sum();
        }
    }
}

/// Learns the costs for a pair.
pub(super) fn learn(pair: &Pair<'_>, settings: &Settings, range: DisparityRange) -> Result<Vec<f32>, MatchError> {
    let local = Settings {
        cost: Cost::Census,
        window_px: settings.window_px.max(WINDOW_PX_MIN),
        windows: Windows::One,
        optimiser: Optimiser::WinnerTakesAll,
        left_right_px: Some(1),
        sub_pixel: false,
        ..*settings
    };
    let mut disparity = Disparity::default();
    let mut prepared = Prepared::new(pair, &local, range)?;
    let mut costs = Vec::new();
    for _ in 0..ROUNDS {
        select::fill(&CostVolume::build(pair, &local, range, prepared)?, &local, &mut disparity);
        costs = JointHistogram::of(pair, &disparity).costs();
        prepared = Prepared::Information(*pair, costs.clone());
    }
    Ok(costs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_tells_all_about_itself() {
        // 256 equally frequent levels: H = ln 256, and MI of a picture with any one-to-one image of itself is H.
        for image in [|i: u8| i, |i: u8| 255 - i, |i: u8| i.wrapping_mul(77)] {
            let mut histogram = JointHistogram::default();
            (0..=255).for_each(|i| histogram.add(i, image(i), 3.0));
            assert!((histogram.mutual_information() - 256_f64.ln()).abs() < 1e-12);
        }
    }

    #[test]
    fn independent_pictures_tell_nothing() {
        let mut histogram = JointHistogram::default();
        for (i, k) in (0..=255).flat_map(|i| (0..=255).map(move |k| (i, k))) {
            histogram.add(i, k, f64::from(i % 7 + 1) * f64::from(k % 5 + 1));
        }
        assert!(histogram.mutual_information().abs() < 1e-9);
        assert_eq!(JointHistogram::default().mutual_information(), 0.0);
    }

    /// Grey levels of correlation ρ with a normal distribution: MI = −½ ln(1 − ρ²).
    #[test]
    fn normal_grey_levels_have_a_closed_form() {
        for rho in [0.0, 0.3, 0.9, -0.9] {
            let mut histogram = JointHistogram::default();
            for (i, k) in (0..=255).flat_map(|i| (0..=255).map(move |k| (i, k))) {
                let (x, y) = ((f64::from(i) - 127.5) / 20.0, (f64::from(k) - 127.5) / 20.0);
                let exponent: f64 = (x * x - 2.0 * rho * x * y + y * y) / (2.0 * (1.0 - rho * rho));
                histogram.add(i, k, (-exponent).exp());
            }
            let expected = -0.5 * f64::ln(1.0 - rho * rho);
            assert!((histogram.mutual_information() - expected).abs() < 1e-4, "{rho}: {}", histogram.mutual_information());
        }
    }

    /// For a smooth density the pixelwise terms are ln p(i, k) / (p(i) p(k)), whose mean is the mutual information.
    #[test]
    fn pixelwise_costs_average_to_the_mutual_information() {
        let rho = 0.8;
        let density = |i: u8, k: u8| {
            let (x, y) = ((f64::from(i) - 127.5) / 25.0, (f64::from(k) - 127.5) / 25.0);
            (-(x * x - 2.0 * rho * x * y + y * y) / (2.0 * (1.0 - rho * rho))).exp()
        };
        let mut histogram = JointHistogram::default();
        let mut total = 0.0;
        for (i, k) in (0..=255).flat_map(|i| (0..=255).map(move |k| (i, k))) {
            histogram.add(i, k, density(i, k));
            total += density(i, k);
        }
        let costs = histogram.costs();
        let cost = |i: u8, k: u8| f64::from(costs[usize::from(i) * 256 + usize::from(k)]);
        for (i, k) in [(127, 127), (150, 150), (155, 100), (90, 120), (180, 160)] {
            let (x, y) = ((f64::from(i) - 127.5) / 25.0, (f64::from(k) - 127.5) / 25.0);
            let expected = (x * x - 2.0 * rho * x * y + y * y) / (2.0 * (1.0 - rho * rho)) - (x * x + y * y) / 2.0;
            let got = cost(i, k) - cost(127, 127);
            assert!((got - expected).abs() < 0.06, "{i} {k}: {got} instead of {expected}");
        }
        // Where both levels are the mean, the term is −½ ln(1 − ρ²), and so it is on average.
        let pairs = (0..=255_u8).flat_map(|i| (0..=255).map(move |k| (i, k)));
        let mean: f64 = pairs.map(|(i, k)| density(i, k) / total * cost(i, k)).sum();
        assert!((mean - cost(127, 127)).abs() < 0.03, "{mean} {}", cost(127, 127));
    }

    #[test]
    fn smoothing_loses_nothing() {
        let mut values = vec![0.0; LEVELS * LEVELS];
        values[0] = 1.0;
        values[LEVELS * 100 + 255] = 2.0;
        smooth(&mut values, LEVELS, 1);
        smooth(&mut values, LEVELS, LEVELS);
        assert!((values.iter().sum::<f64>() - 3.0).abs() < 1e-12);
        // A column was smoothed by columns, a row by rows.
        assert!(values[LEVELS * 101 + 255] > values[LEVELS * 103 + 255] && values[LEVELS * 103 + 255] > 0.0);
    }
}
