//! How unlike two pixels are: thesis 4-10 … 4-13 and 4-15, 0 for a perfect match (mutual information: for the commonest).

use super::information;
use super::path::Penalties;
use super::transform::{census, rank};
use super::volume::Pair;
use super::window::{BoxMean, Plane};
use super::{DisparityRange, MatchError, Settings};

/// A cost function. Sums over a window are divided by its pixels, so that windows cut off by the picture's edge compare fairly
/// and penalties do not depend on the window.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cost {
    /// Sum of absolute differences (4-11), grey levels.
    Sad,
    /// Sum of squared differences (4-12), squared grey levels.
    Ssd,
    /// 1 − normalised cross-correlation: 0 to 2. The thesis's (4-10) lacks the root in the denominator; without it the result
    /// has a unit and depends on contrast, so the root is here. A window without contrast correlates with nothing: 1.
    Ncc,
    /// Absolute difference of ranks (Zabih and Woodfill 1994; 4-13, fig. 4-7), ranks.
    Rank,
    /// Hamming distance of census bits (Zabih and Woodfill 1994; fig. 4-8), bits.
    Census,
    /// Pixelwise mutual information (Hirschmüller 2008; 4-15), nats: high where this pair of grey levels is rarely matched.
    MutualInformation,
}

impl Cost {
    /// Every cost function.
    pub const ALL: [Self; 6] = [Self::Sad, Self::Ssd, Self::Ncc, Self::Rank, Self::Census, Self::MutualInformation];

    /// As on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sad => "sad",
            Self::Ssd => "ssd",
            Self::Ncc => "ncc",
            Self::Rank => "rank",
            Self::Census => "census",
            Self::MutualInformation => "mi",
        }
    }

    /// Penalties in the unit of the cost that suit pictures of 8 bits; found on the aloe pair, where
    /// half or twice as much changes little.
    #[must_use]
    pub fn penalties_default(self) -> Penalties {
        let (p1, p2) = match self {
            Self::Sad => (4.0, 48.0),
            Self::Ssd => (100.0, 1600.0),
            Self::Ncc => (0.1, 0.8),
            Self::Rank => (3.0, 20.0),
            Self::Census => (6.0, 30.0),
            Self::MutualInformation => (0.4, 3.0),
        };
        Penalties { p1, p2, adaptive: false }
    }
}

/// A cost function with what it needs of two pictures.
pub(super) enum Prepared<'a> {
    Absolute(Pair<'a>),
    Squared(Pair<'a>),
    Correlation(Pair<'a>, Box<Correlation>),
    Rank { left: Vec<f32>, right: Vec<f32> },
    Census { left: Vec<u128>, right: Vec<u128> },
    Information(Pair<'a>, Vec<f32>),
}

impl<'a> Prepared<'a> {
    pub(super) fn new(pair: &Pair<'a>, settings: &Settings, range: DisparityRange) -> Result<Self, MatchError> {
        let (width, side_px) = (pair.width, settings.transform_px);
        Ok(match settings.cost {
            Cost::Sad => Self::Absolute(*pair),
            Cost::Ssd => Self::Squared(*pair),
            Cost::Ncc => Self::Correlation(*pair, Box::default()),
            Cost::Rank => Self::Rank { left: rank(pair.left, width, side_px), right: rank(pair.right, width, side_px) },
            Cost::Census => Self::Census { left: census(pair.left, width, side_px), right: census(pair.right, width, side_px) },
            Cost::MutualInformation => Self::Information(*pair, information::learn(pair, settings, range)?),
        })
    }

    /// Fills `plane` with the mean costs over windows at disparity `d`: its column j compares left x = j + d with right x = j.
    pub(super) fn plane(&mut self, d: usize, window_px: u32, boxes: &mut BoxMean, plane: &mut Plane) {
        match self {
            Self::Absolute(pair) => {
                plane.fill(pair.width, d, |l, r| f32::from(pair.left[l].abs_diff(pair.right[r])));
            }
            Self::Squared(pair) => {
                plane.fill(pair.width, d, |l, r| f32::from(pair.left[l].abs_diff(pair.right[r])).powi(2));
            }
            // Made of window means already.
            Self::Correlation(pair, correlation) => return correlation.plane(pair, d, window_px, boxes, plane),
            Self::Rank { left, right } => plane.fill(plane.width + d, d, |l, r| (left[l] - right[r]).abs()),
            Self::Census { left, right } => {
                plane.fill(plane.width + d, d, |l, r| (left[l] ^ right[r]).count_ones() as f32);
            }
            Self::Information(pair, table) => {
                plane.fill(pair.width, d, |l, r| table[usize::from(pair.left[l]) * 256 + usize::from(pair.right[r])]);
            }
        }
        boxes.smooth(plane, window_px);
    }
}

/// Window means of which correlation is made.
#[derive(Default)]
pub(super) struct Correlation {
    l: Plane,
    r: Plane,
    ll: Plane,
    rr: Plane,
    lr: Plane,
}

impl Correlation {
    fn plane(&mut self, pair: &Pair<'_>, d: usize, window_px: u32, boxes: &mut BoxMean, plane: &mut Plane) {
        let (left, right) = (|i: usize| f32::from(pair.left[i]), |i: usize| f32::from(pair.right[i]));
        let mut mean = |to: &mut Plane, of: &dyn Fn(usize, usize) -> f32| {
            to.resize(plane.width, plane.height);
            to.fill(pair.width, d, of);
            boxes.smooth(to, window_px);
        };
        mean(&mut self.l, &|l, _| left(l));
        mean(&mut self.r, &|_, r| right(r));
        mean(&mut self.ll, &|l, _| left(l) * left(l));
        mean(&mut self.rr, &|_, r| right(r) * right(r));
        mean(&mut self.lr, &|l, r| left(l) * right(r));
        for (i, cost) in plane.values.iter_mut().enumerate() {
            let (l, r) = (f64::from(self.l.values[i]), f64::from(self.r.values[i]));
            let left_variance = f64::from(self.ll.values[i]) - l * l;
            let right_variance = f64::from(self.rr.values[i]) - r * r;
            let covariance = f64::from(self.lr.values[i]) - l * r;
            // Less than a tenth of a grey level of contrast is none.
            let contrast = left_variance.min(right_variance) > 0.01;
            *cost = if contrast { (1.0 - covariance / (left_variance * right_variance).sqrt()) as f32 } else { 1.0 };
        }
    }
}
