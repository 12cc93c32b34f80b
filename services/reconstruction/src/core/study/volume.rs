//! All costs of a pair of pictures.

use super::cost::Prepared;
use super::window::{BoxMean, Plane, Windows};
use super::{DisparityRange, MatchError, Settings};

/// A rectified pair of 8-bit grey pictures, row-major.
#[derive(Debug, Clone, Copy)]
pub struct Pair<'a> {
    /// `height × width` pixels.
    pub left: &'a [u8],
    /// `height × width` pixels.
    pub right: &'a [u8],
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
}

/// `height × width × count` costs: for each pixel of the left picture those of disparities `min_px`, `min_px + 1`, … Infinite
/// where the right pixel would lie outside its picture.
#[derive(Debug, Clone, PartialEq)]
pub struct CostVolume {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Least disparity, pixels.
    pub min_px: usize,
    /// How many disparities.
    pub count: usize,
    /// The costs.
    pub values: Vec<f32>,
}

impl CostVolume {
    /// No more than this many costs: 2 GiB. Semi-global sums take as much again.
    pub const VALUES_MAX: usize = 512 << 20;

    /// The costs of `pair`, averaged over windows.
    ///
    /// # Errors
    /// [`MatchError::Memory`] where they are too many.
    pub fn new(pair: &Pair<'_>, settings: &Settings, range: DisparityRange) -> Result<Self, MatchError> {
        Self::build(pair, settings, range, Prepared::new(pair, settings, range)?)
    }

    /// The same with a cost function at hand.
    pub(super) fn build(
        pair: &Pair<'_>,
        settings: &Settings,
        range: DisparityRange,
        mut prepared: Prepared<'_>,
    ) -> Result<Self, MatchError> {
        let count = (range.max_px - range.min_px + 1) as usize;
        let mut volume = Self::infinite(pair.width, pair.height, range.min_px as usize, count)?;
        let (mut boxes, mut plane) = (BoxMean::default(), Plane::default());
        for k in 0..count {
            let d = volume.min_px + k;
            if d >= pair.width {
                break;
            }
            plane.resize(pair.width - d, pair.height);
            prepared.plane(d, settings.window_px, &mut boxes, &mut plane);
            if settings.windows == Windows::Nine {
                boxes.best_of_nine(&mut plane, settings.window_px);
            }
            for (costs, plane) in volume.values.chunks_exact_mut(pair.width * count).zip(plane.values.chunks_exact(plane.width))
            {
                for (costs, cost) in costs.chunks_exact_mut(count).skip(d).zip(plane) {
                    costs[k] = *cost;
                }
            }
        }
        Ok(volume)
    }

    /// Only infinite costs.
    pub(super) fn infinite(width: usize, height: usize, min_px: usize, count: usize) -> Result<Self, MatchError> {
        let needed = width.saturating_mul(height).saturating_mul(count);
        if needed > Self::VALUES_MAX {
            return Err(MatchError::Memory { needed_mib: (needed >> 18) as u64, most_mib: (Self::VALUES_MAX >> 18) as u64 });
        }
        Ok(Self { width, height, min_px, count, values: vec![f32::INFINITY; needed] })
    }

    /// The costs of the pixel with this index, one for each disparity.
    #[must_use]
    pub fn at(&self, pixel: usize) -> &[f32] {
        &self.values[pixel * self.count..][..self.count]
    }
}
