//! Sub-pixel refinement by least squares, with a standard deviation for every pixel.
//!
//! A matcher interpolates its costs and is drawn towards whole pixels ("pixel locking"). Here each pixel's disparity is fitted to
//! the pictures themselves: over a window, left(u) ≈ a · right(u − d − δ) + b, solved for the correction δ, gain a and offset b
//! together (Lucas and Kanade 1981; Tian and Huhns 1986 for stereo), a few times over. The residual says how well it fits, and so how
//! far δ can be trusted.
//!
//! A window's δ corrects the window's mean disparity, so the result is that mean plus δ: the pixel's own start drops out.
//!
//! Pictures are warped, multiplied, summed and solved row by row while they are in the cache; bands of rows are independent tasks. Windows
//! of neighbours are nearly the same window, so that it can be enough to solve every second one, in x and in y.

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
    every: Every,
    mean: Vec<f32>,
    start: Vec<f32>,
    scratch: Vec<Scratch>,
}

/// Which pixels are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Every {
    /// All of them.
    #[default]
    Pixel,
    /// Those at even x and y: a quarter of the work, which loses next to nothing where windows are much wider.
    SecondPixel,
}

impl Every {
    /// From one to the next, pixels.
    #[must_use]
    pub fn step_px(self) -> usize {
        match self {
            Self::Pixel => 1,
            Self::SecondPixel => 2,
        }
    }
}

/// Refined disparities of every so many pixels.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Refined {
    /// Which pixels these are.
    pub every: Every,
    /// Their disparities: of ⌈width / step⌉ × ⌈height / step⌉.
    pub disparity: Disparity,
    /// One standard deviation of each, pixels; NaN with the disparity.
    pub sigma_px: Vec<f32>,
}

impl Refined {
    /// Of all `width_px × height_px` pixels: those between two (four) others are their mean, those beside a hole are holes.
    #[must_use]
    pub fn full(&self, width_px: u32, height_px: u32) -> Disparity {
        let step = self.every.step_px();
        let (width, cols) = (width_px as usize, self.disparity.width_px as usize);
        let (last_row, last_col) = ((self.disparity.height_px as usize).saturating_sub(1), cols.saturating_sub(1));
        let at = |row: usize, col: usize| self.disparity.values_px[row.min(last_row) * cols + col.min(last_col)];
        let pixel = |i: usize| {
            let (x, y) = (i % width, i / width);
            let ((row, down), (col, across)) = ((y / step, y % step), (x / step, x % step));
            0.25 * (at(row, col) + at(row + down, col) + at(row, col + across) + at(row + down, col + across))
        };
        let is_empty = self.disparity.values_px.is_empty();
        let values_px = if is_empty { Vec::new() } else { (0..width * height_px as usize).map(pixel).collect() };
        Disparity { width_px, height_px, values_px }
    }
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
    pub fn new(window_px: u32, iterations: u32, every: Every) -> Self {
        let window_px = window_px | 1;
        Self { window_px, iterations, every, mean: Vec::new(), start: Vec::new(), scratch: Vec::new() }
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
        bands + size_of::<f32>() * (self.start.capacity() + self.mean.capacity())
    }

    /// Refines `disparity` against the rectified pictures (`f32`) that it came from. Pixels whose fit fails become NaN; small holes in
    /// smooth surroundings are filled. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// OpenCV's, where the sizes differ.
    pub fn refine(&mut self, left: &Mat, right: &Mat, disparity: &Disparity, to: &mut Refined) -> Result<()> {
        let (width, height) = (disparity.width_px as usize, disparity.height_px as usize);
        let (left, right) = (left.data_typed::<f32>()?, right.data_typed::<f32>()?);
        if left.len() != width * height || right.len() != left.len() || disparity.values_px.len() != left.len() {
            let what = "pictures and disparity differ in size";
            return Err(opencv::Error::new(opencv::core::StsUnmatchedSizes, what));
        }
        let step = self.every.step_px();
        let (cols, rows) = (width.div_ceil(step), height.div_ceil(step));
        to.every = self.every;
        (to.disparity.width_px, to.disparity.height_px) = (cols as u32, rows as u32);
        for buffer in [&mut to.disparity.values_px, &mut to.sigma_px, &mut self.start] {
            buffer.resize(cols * rows, f32::NAN);
        }
        if left.is_empty() {
            return Ok(());
        }
        self.mean.resize(left.len(), f32::NAN);
        self.scratch.resize_with(height.div_ceil(BAND_ROWS), Scratch::default);
        let window = self.window_px as usize;

        // Each disparity is replaced by the mean around it, twice: the second time without those that stand out. A window's
        // correction is one number, so what it corrects should be smooth.
        let smooth = Smooth { start: &disparity.values_px, mean: None, width, height, window, every: Every::Pixel };
        let bands = self.mean.par_chunks_mut(BAND_ROWS * width).zip(&mut self.scratch).enumerate();
        bands.for_each(|(band, (to, scratch))| smooth_band(&smooth, band, &mut scratch.smooth, to));
        let smooth = Smooth { mean: Some(&self.mean), every: self.every, ..smooth };
        let band_len = BAND_ROWS / step * cols;
        let bands = self.start.par_chunks_mut(band_len).zip(&mut self.scratch).enumerate();
        bands.for_each(|(band, (to, scratch))| smooth_band(&smooth, band, &mut scratch.smooth, to));

        if self.iterations == 0 {
            to.disparity.values_px.copy_from_slice(&self.start);
            to.sigma_px.fill(f32::NAN);
        }
        for iteration in 0..self.iterations {
            if iteration > 0 {
                std::mem::swap(&mut self.start, &mut to.disparity.values_px);
            }
            let round = Round {
                left,
                right,
                disparity_px: &self.start,
                every: self.every,
                width,
                height,
                window,
                // Between rounds a doubtful pixel may recover; after the last it may not.
                is_last: iteration + 1 == self.iterations,
            };
            let bands = to.disparity.values_px.par_chunks_mut(band_len).zip(to.sigma_px.par_chunks_mut(band_len));
            bands.zip(&mut self.scratch).enumerate().for_each(|(band, ((to, sigma_px), scratch))| {
                round_band(&round, band, &mut scratch.round, to, sigma_px);
            });
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
