//! One round of correction: warp, multiply, sum, solve.

use super::Every;
use super::solve::{SUMS, Solved, solve};
use crate::core::resample::{self, shift, shifted};
use crate::core::window::{BAND_ROWS, mirror_ends, mirrored, sums, sums_of_every_second};

/// What a round works on.
pub(super) struct Round<'a> {
    pub(super) left: &'a [f32],
    pub(super) right: &'a [f32],
    /// From before the round, of every so many pixels.
    pub(super) disparity_px: &'a [f32],
    pub(super) every: Every,
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) window: usize,
    pub(super) is_last: bool,
}

/// One row: left, warped right, slope of their mean, and the start without holes, about the band's levels.
#[derive(Default)]
struct Row {
    left: Vec<f32>,
    warped: Vec<f32>,
    slope: Vec<f32>,
    start_px: Vec<f32>,
}

impl Row {
    fn resize(&mut self, width: usize) {
        for buffer in [&mut self.left, &mut self.warped, &mut self.slope, &mut self.start_px] {
            buffer.clear();
            buffer.resize(width, 0.0);
        }
    }
}

/// The rows of a window and one more, sums down their columns, sums over windows.
#[derive(Default)]
pub(super) struct RoundScratch {
    rows: Vec<Row>,
    /// A row of the right picture, and where it is sampled.
    right: resample::Row,
    shift_px: Vec<f32>,
    /// A row of disparities, without holes.
    coarse_px: Vec<f32>,
    columns: [Vec<f32>; SUMS],
    windows: [Vec<f32>; SUMS],
    halves: [Vec<f32>; 2],
}

impl RoundScratch {
    pub(super) fn memory_bytes(&self) -> usize {
        let rows: usize = self.rows.iter().map(|row| 4 * row.left.capacity()).sum();
        let sums: usize = self.columns.iter().chain(&self.windows).chain(&self.halves).map(Vec::capacity).sum();
        size_of::<f32>() * (rows + sums + self.shift_px.capacity() + self.coarse_px.capacity()) + self.right.memory_bytes()
    }
}

/// What is subtracted from everything in a band: products of centred pictures keep more digits.
#[derive(Clone, Copy)]
struct Level {
    left: f32,
    right: f32,
    start_px: f32,
}

impl Round<'_> {
    #[inline(always)]
    pub(super) fn band(&self, band: usize, scratch: &mut RoundScratch, to: &mut [f32], sigma_px: &mut [f32]) {
        let (width, half) = (self.width, self.window / 2);
        let (step, cols) = (self.every.step_px(), self.cols());
        let first = band * BAND_ROWS;
        let level = self.level(first);
        scratch.rows.resize_with(self.window + 1, Row::default);
        scratch.rows.iter_mut().for_each(|row| row.resize(width));
        scratch.right.resize(width);
        scratch.shift_px.resize(width, 0.0);
        scratch.coarse_px.resize(cols, 0.0);
        for columns in &mut scratch.columns {
            columns.clear();
            columns.resize(width + 2 * half, 0.0);
        }
        scratch.windows.iter_mut().for_each(|windows| windows.resize(cols, 0.0));
        let samples = (self.window * self.window) as f32;
        let rows = to.chunks_exact_mut(cols).zip(sigma_px.chunks_exact_mut(cols));
        let top = first as isize - half as isize;
        let mut next = 0;
        for (row, (to, sigma_px)) in rows.enumerate() {
            while next < row * step + self.window {
                self.slide(top, next, level, scratch);
                next += 1;
            }
            let RoundScratch { columns, windows, halves, .. } = &mut *scratch;
            for (columns, windows) in columns.iter_mut().zip(windows) {
                mirror_ends(columns, half);
                match self.every {
                    Every::Pixel => sums(columns, self.window, windows),
                    Every::SecondPixel => sums_of_every_second(columns, self.window, halves, windows),
                }
            }
            let before = &self.disparity_px[(first / step + row) * cols..][..cols];
            let windows = scratch.windows.each_ref().map(Vec::as_slice);
            solve(windows, samples, level.start_px, before, self.is_last, &mut Solved { disparity_px: to, sigma_px });
        }
    }

    #[inline(always)]
    fn cols(&self) -> usize {
        self.width.div_ceil(self.every.step_px())
    }

    /// Mean grey levels, and any disparity, of the band.
    #[inline(always)]
    fn level(&self, first: usize) -> Level {
        let end = (first + BAND_ROWS).min(self.height);
        // A few thousand pixels tell.
        let left = self.left[first * self.width..end * self.width].iter().step_by(17);
        let count = left.len().max(1) as f32;
        let mean = left.sum::<f32>() / count;
        let step = self.every.step_px();
        let start = &self.disparity_px[first / step * self.cols()..end.div_ceil(step) * self.cols()];
        let start_px = start.iter().copied().find(|px| px.is_finite()).unwrap_or(0.0);
        Level { left: mean, right: mean, start_px }
    }

    /// Computes row `number` of the band (which begins at `top`), and adds it to the columns' sums in place of the one that leaves the
    /// window.
    #[inline(always)]
    fn slide(&self, top: isize, number: usize, level: Level, scratch: &mut RoundScratch) {
        let at = mirrored(top + number as isize, self.height);
        let slots = self.window + 1;
        let RoundScratch { rows, right, shift_px, coarse_px, .. } = scratch;
        self.fill(at, level, &mut rows[number % slots], (right, shift_px, coarse_px));
        // Zeros, until the window is full.
        let (new, old) = (&scratch.rows[number % slots], &scratch.rows[(number + 1) % slots]);
        let half = self.window / 2;
        let [l, r, g, ll, rr, gg, lr, lg, rg, w] = scratch.columns.each_mut().map(|columns| &mut columns[half..][..self.width]);
        let width = self.width;
        let (nl, nr, ng, nw) = (&new.left[..width], &new.warped[..width], &new.slope[..width], &new.start_px[..width]);
        let (ol, or, og, ow) = (&old.left[..width], &old.warped[..width], &old.slope[..width], &old.start_px[..width]);
        for x in 0..width {
            l[x] += nl[x] - ol[x];
            r[x] += nr[x] - or[x];
            g[x] += ng[x] - og[x];
            w[x] += nw[x] - ow[x];
            ll[x] += nl[x] * nl[x] - ol[x] * ol[x];
            rr[x] += nr[x] * nr[x] - or[x] * or[x];
            gg[x] += ng[x] * ng[x] - og[x] * og[x];
            lr[x] += nl[x] * nr[x] - ol[x] * or[x];
            lg[x] += nl[x] * ng[x] - ol[x] * og[x];
            rg[x] += nr[x] * ng[x] - or[x] * og[x];
        }
    }

    /// The disparities of a row so far. Holes take the nearest one on their left (the first, at the edge): windows beside them must not
    /// compare the wrong water.
    #[inline(always)]
    fn start_of(&self, at: usize, level: Level, coarse_px: &mut [f32], start_px: &mut [f32]) {
        let (step, cols) = (self.every.step_px(), coarse_px.len());
        let row = |row: usize| &self.disparity_px[row * cols..][..cols];
        let (above, below) = (row(at / step), row(at.div_ceil(step).min(self.disparity_px.len() / cols - 1)));
        let mut holes = false;
        for ((to, above), below) in coarse_px.iter_mut().zip(above).zip(below) {
            // NaN in one of them takes the other.
            let (above, below) = (if above.is_nan() { *below } else { *above }, if below.is_nan() { *above } else { *below });
            *to = 0.5 * (above + below);
            holes |= to.is_nan();
        }
        if holes {
            let mut last =
                coarse_px.iter().copied().find(|px| px.is_finite()).unwrap_or_else(|| self.near(at / step, level.start_px));
            for to in &mut *coarse_px {
                *to = if to.is_nan() { last } else { *to };
                last = *to;
            }
        }
        match self.every {
            Every::Pixel => start_px.copy_from_slice(coarse_px),
            Every::SecondPixel => {
                let (pairs, last) = start_px.as_chunks_mut::<2>();
                for (to, (here, next)) in pairs.iter_mut().zip(coarse_px.iter().zip(&coarse_px[1..])) {
                    *to = [*here, 0.5 * (here + next)];
                }
                let end = coarse_px[cols - 1];
                match last {
                    [last] => *last = end,
                    _ => pairs[cols - 1] = [end, end],
                }
            }
        }
    }

    /// Warps the right picture onto the left one by the disparity so far.
    #[inline(always)]
    fn fill(&self, at: usize, level: Level, row: &mut Row, scratch: (&mut resample::Row, &mut [f32], &mut [f32])) {
        let width = self.width;
        let (right, shift_px, coarse_px) = scratch;
        self.start_of(at, level, coarse_px, &mut row.start_px);
        for (to, from) in right.values_mut().iter_mut().zip(&self.right[at * width..][..width]) {
            *to = from - level.right;
        }
        right.repeat_ends();
        for (x, (to, start_px)) in shift_px.iter_mut().zip(&row.start_px).enumerate() {
            *to = shift(x, x as f32 - start_px, width);
        }
        shifted(right, shift_px, &mut row.warped);
        for (left, value) in row.left.iter_mut().zip(&self.left[at * width..][..width]) {
            *left = value - level.left;
        }
        row.start_px.iter_mut().for_each(|px| *px -= level.start_px);
        // Slope of the mean of both pictures: central differences, within the row.
        let (left, warped, slope) = (&row.left[..width], &row.warped[..width], &mut row.slope[..width]);
        let ends = [(0, 0, 1.min(width - 1)), (width - 1, width.saturating_sub(2), width - 1)];
        for (x, before, after) in ends {
            slope[x] = 0.25 * ((left[after] + warped[after]) - (left[before] + warped[before]));
        }
        if let Some(inner) = width.checked_sub(2).filter(|inner| *inner > 0) {
            let (left_before, warped_before) = (&left[..inner], &warped[..inner]);
            let (left_after, warped_after) = (&left[2..][..inner], &warped[2..][..inner]);
            let slope = &mut slope[1..][..inner];
            for x in 0..inner {
                slope[x] = 0.25 * ((left_after[x] + warped_after[x]) - (left_before[x] + warped_before[x]));
            }
        }
    }

    /// Some disparity of the rows next to an empty one.
    #[inline(never)]
    fn near(&self, row: usize, otherwise: f32) -> f32 {
        let (cols, reach) = (self.cols(), 1..self.window.min(self.height));
        let rows = self.disparity_px.chunks_exact(cols);
        let near = reach.flat_map(|step| [row.checked_sub(step), Some(row + step)]).flatten();
        let mut found = near.filter_map(|row| rows.clone().nth(row)?.iter().find(|px| px.is_finite()));
        found.next().copied().unwrap_or(otherwise)
    }
}
