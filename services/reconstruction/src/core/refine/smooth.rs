//! The mean disparity around each pixel.

use super::Every;
use crate::core::window::{BAND_ROWS, mirror_ends, mirrored, sums, sums_of_every_second};

/// A start that differs from the mean around it by more than this, pixels, is left out of that mean.
const START_SPREAD_MAX_PX: f32 = 1.0;

/// One pass.
#[derive(Clone, Copy)]
pub(super) struct Smooth<'a> {
    pub(super) start: &'a [f32],
    /// Means of an earlier pass; with them, what stands out does not count.
    pub(super) mean: Option<&'a [f32]>,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) window: usize,
    /// Where means are wanted.
    pub(super) every: Every,
}

/// Sums over the columns of the window, and over the window.
#[derive(Default)]
pub(super) struct SmoothScratch {
    counts: Vec<f32>,
    totals: Vec<f32>,
    count: Vec<f32>,
    total: Vec<f32>,
    halves: [Vec<f32>; 2],
}

impl SmoothScratch {
    pub(super) fn memory_bytes(&self) -> usize {
        let all = [&self.counts, &self.totals, &self.count, &self.total, &self.halves[0], &self.halves[1]];
        size_of::<f32>() * all.iter().map(|buffer| buffer.capacity()).sum::<usize>()
    }
}

impl Smooth<'_> {
    #[inline(always)]
    pub(super) fn band(&self, band: usize, scratch: &mut SmoothScratch, to: &mut [f32]) {
        let (width, half) = (self.width, self.window / 2);
        let SmoothScratch { counts, totals, count, total, halves } = scratch;
        let step = self.every.step_px();
        let cols = width.div_ceil(step);
        for buffer in [&mut *counts, &mut *totals] {
            buffer.clear();
            buffer.resize(width + 2 * half, 0.0);
        }
        count.resize(cols, 0.0);
        total.resize(cols, 0.0);
        let first = (band * BAND_ROWS) as isize;
        // Sums are taken about a disparity of this band: fewer digits are lost.
        let base_px = self.start[band * BAND_ROWS * width..].iter().copied().find(|px| px.is_finite()).unwrap_or(0.0);
        for row in first - half as isize..first + half as isize {
            self.add(row, 1.0, base_px, &mut counts[half..], &mut totals[half..]);
        }
        let least = 0.5 * (self.window * self.window) as f32;
        for (row, to) in to.chunks_exact_mut(cols).enumerate() {
            let row = first + (row * step) as isize;
            self.add(row + half as isize, 1.0, base_px, &mut counts[half..], &mut totals[half..]);
            for (columns, windows) in [(&mut *counts, &mut *count), (&mut *totals, &mut *total)] {
                mirror_ends(columns, half);
                match self.every {
                    Every::Pixel => sums(columns, self.window, windows),
                    Every::SecondPixel => sums_of_every_second(columns, self.window, halves, windows),
                }
            }
            for (to, (count, total)) in to.iter_mut().zip(count.iter().zip(&*total)) {
                // At least half of the window must have been matched.
                *to = if *count >= least { base_px + total / count } else { f32::NAN };
            }
            for skipped in row..row + step as isize {
                self.add(skipped - half as isize, -1.0, base_px, &mut counts[half..], &mut totals[half..]);
                if skipped > row {
                    self.add(skipped + half as isize, 1.0, base_px, &mut counts[half..], &mut totals[half..]);
                }
            }
        }
    }

    /// Adds a row to the columns' sums, or takes it away.
    #[inline(always)]
    fn add(&self, row: isize, sign: f32, base_px: f32, counts: &mut [f32], totals: &mut [f32]) {
        let at = mirrored(row, self.height) * self.width;
        let start = &self.start[at..][..self.width];
        let columns = counts.iter_mut().zip(totals);
        match self.mean {
            None => {
                for (start, (count, total)) in start.iter().zip(columns) {
                    let counts = !start.is_nan();
                    *count += if counts { sign } else { 0.0 };
                    *total += if counts { sign * (start - base_px) } else { 0.0 };
                }
            }
            Some(mean) => {
                for ((start, mean), (count, total)) in start.iter().zip(&mean[at..][..self.width]).zip(columns) {
                    // False for NaN.
                    let counts = (start - mean).abs() <= START_SPREAD_MAX_PX;
                    *count += if counts { sign } else { 0.0 };
                    *total += if counts { sign * (start - base_px) } else { 0.0 };
                }
            }
        }
    }
}
