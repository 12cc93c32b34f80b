//! Sub-pixel refinement by least squares, with a standard deviation for every pixel.
//!
//! A matcher interpolates its costs and is drawn towards whole pixels ("pixel locking"). Here each pixel's disparity is fitted to
//! the pictures themselves: over a window, left(u) ≈ a · right(u − d − δ) + b, solved for the correction δ, gain a and offset b
//! together (Lucas and Kanade 1981; Tian and Huhns 1986 for stereo), a few times over. The residual says how well it fits, and so how
//! far δ can be trusted.
//!
//! A window's δ corrects the window's mean disparity, so the result is that mean plus δ: the pixel's own start drops out.
//!
//! Pictures are warped, multiplied, summed and solved row by row while they are in the cache; bands of rows are independent tasks.

mod round;
mod smooth;
mod solve;

use multiversion::multiversion;
use opencv::Result;
use opencv::core::Mat;
use opencv::prelude::*;
use rayon::prelude::*;
use round::{Round, RoundScratch};
use smooth::{Smooth, SmoothScratch};

use super::disparity::Disparity;
use super::window::BAND_ROWS;

/// Refines disparity maps of one size; keeps its buffers between calls.
pub struct Refiner {
    window_px: u32,
    iterations: u32,
    start: Vec<f32>,
    next: Vec<f32>,
    scratch: Vec<Scratch>,
}

/// What one band works with.
#[derive(Default)]
struct Scratch {
    smooth: SmoothScratch,
    round: RoundScratch,
}

impl Refiner {
    /// With `window_px × window_px` windows (made odd) and this many rounds of correction.
    #[must_use]
    pub fn new(window_px: u32, iterations: u32) -> Self {
        Self { window_px: window_px | 1, iterations, start: Vec::new(), next: Vec::new(), scratch: Vec::new() }
    }

    /// Side of the window, pixels: errors of pixels closer than this are correlated.
    #[must_use]
    pub fn window_px(&self) -> u32 {
        self.window_px
    }

    /// How many bytes its buffers hold.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let bands: usize = self.scratch.iter().map(|s| s.smooth.memory_bytes() + s.round.memory_bytes()).sum();
        bands + size_of::<f32>() * (self.start.capacity() + self.next.capacity())
    }

    /// Refines `disparity` against the rectified pictures (`f32`) that it came from, and fills `sigma_px` with one standard
    /// deviation for each pixel (row-major; NaN with the disparity). Pixels whose fit fails become NaN; small holes in smooth
    /// surroundings are filled. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// OpenCV's, where the sizes differ.
    pub fn refine(&mut self, left: &Mat, right: &Mat, disparity: &mut Disparity, sigma_px: &mut Vec<f32>) -> Result<()> {
        let (width, height) = (disparity.width_px as usize, disparity.height_px as usize);
        let (left, right) = (left.data_typed::<f32>()?, right.data_typed::<f32>()?);
        if left.len() != width * height || right.len() != left.len() {
            let what = "pictures and disparity differ in size";
            return Err(opencv::Error::new(opencv::core::StsUnmatchedSizes, what));
        }
        sigma_px.clear();
        sigma_px.resize(left.len(), f32::NAN);
        if left.is_empty() {
            return Ok(());
        }
        self.scratch.resize_with(height.div_ceil(BAND_ROWS), Scratch::default);
        self.start.clone_from(&disparity.values_px);
        self.next.resize(left.len(), f32::NAN);
        let window = self.window_px as usize;

        // Each disparity is replaced by the mean around it, twice: the second time without those that stand out. A window's
        // correction is one number, so what it corrects should be smooth.
        for among in [None, Some(())] {
            let mean = among.map(|()| &disparity.values_px[..]);
            let smooth = Smooth { start: &self.start, mean, width, height, window };
            let bands = self.next.par_chunks_mut(BAND_ROWS * width).zip(&mut self.scratch).enumerate();
            bands.for_each(|(band, (to, scratch))| smooth_band(&smooth, band, &mut scratch.smooth, to));
            std::mem::swap(&mut disparity.values_px, &mut self.next);
        }
        for iteration in 0..self.iterations {
            let round = Round {
                left,
                right,
                disparity_px: &disparity.values_px,
                width,
                height,
                window,
                // Between rounds a doubtful pixel may recover; after the last it may not.
                is_last: iteration + 1 == self.iterations,
            };
            let to = self.next.par_chunks_mut(BAND_ROWS * width).zip(sigma_px.par_chunks_mut(BAND_ROWS * width));
            to.zip(&mut self.scratch).enumerate().for_each(|(band, ((to, sigma_px), scratch))| {
                round_band(&round, band, &mut scratch.round, to, sigma_px);
            });
            std::mem::swap(&mut disparity.values_px, &mut self.next);
        }
        Ok(())
    }
}

// The loops of a band are compiled for each of these; what they compute is the same to the last bit, because products are never fused
// with sums.

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl+avx512dq", "x86_64+avx2"))]
fn smooth_band(smooth: &Smooth, band: usize, scratch: &mut SmoothScratch, to: &mut [f32]) {
    smooth.band(band, scratch, to);
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl+avx512dq", "x86_64+avx2"))]
fn round_band(round: &Round, band: usize, scratch: &mut RoundScratch, to: &mut [f32], sigma_px: &mut [f32]) {
    round.band(band, scratch, to, sigma_px);
}

#[cfg(test)]
mod tests;
