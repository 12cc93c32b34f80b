//! One round of correction: warp, multiply, sum, solve.

use super::solve::{SUMS, Solved, solve};
use crate::core::resample::{self, shift, shifted};
use crate::core::window::{BAND_ROWS, mirror_ends, mirrored, sums};

/// What a round works on.
pub(super) struct Round<'a> {
    pub(super) left: &'a [f32],
    pub(super) right: &'a [f32],
    /// From before the round.
    pub(super) disparity_px: &'a [f32],
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
    columns: [Vec<f32>; SUMS],
    windows: [Vec<f32>; SUMS],
    powers: [Vec<f32>; 2],
}

impl RoundScratch {
    pub(super) fn memory_bytes(&self) -> usize {
        let rows: usize = self.rows.iter().map(|row| 4 * row.left.capacity()).sum();
        let sums: usize = self.columns.iter().chain(&self.windows).chain(&self.powers).map(Vec::capacity).sum();
        size_of::<f32>() * (rows + sums + self.shift_px.capacity()) + self.right.memory_bytes()
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
        let first = band * BAND_ROWS;
        let level = self.level(first..first + to.len() / width);
        scratch.rows.resize_with(self.window + 1, Row::default);
        scratch.rows.iter_mut().for_each(|row| row.resize(width));
        scratch.right.resize(width);
        scratch.shift_px.resize(width, 0.0);
        for columns in &mut scratch.columns {
            columns.clear();
            columns.resize(width + 2 * half, 0.0);
        }
        scratch.windows.iter_mut().for_each(|windows| windows.resize(width, 0.0));
        let samples = (self.window * self.window) as f32;
        let rows = to.chunks_exact_mut(width).zip(sigma_px.chunks_exact_mut(width));
        for next in 0..self.window - 1 {
            self.slide(first as isize - half as isize, next, level, scratch);
        }
        for (row, (to, sigma_px)) in rows.enumerate() {
            self.slide(first as isize - half as isize, row + self.window - 1, level, scratch);
            for (columns, windows) in scratch.columns.iter_mut().zip(&mut scratch.windows) {
                mirror_ends(columns, half);
                sums(columns, self.window, &mut scratch.powers, windows);
            }
            let before = &self.disparity_px[(first + row) * width..][..width];
            let windows = scratch.windows.each_ref().map(Vec::as_slice);
            solve(windows, samples, level.start_px, before, self.is_last, &mut Solved { disparity_px: to, sigma_px });
        }
    }

    /// Mean grey levels, and any disparity, of the band.
    #[inline(always)]
    fn level(&self, rows: std::ops::Range<usize>) -> Level {
        let here = rows.start * self.width..rows.end * self.width;
        // A few thousand pixels tell.
        let left = self.left[here.clone()].iter().step_by(17);
        let count = left.len().max(1) as f32;
        let mean = left.sum::<f32>() / count;
        let start_px = self.disparity_px[here].iter().copied().find(|px| px.is_finite()).unwrap_or(0.0);
        Level { left: mean, right: mean, start_px }
    }

    /// Computes row `number` of the band (which begins at `top`), and adds it to the columns' sums in place of the one that leaves the
    /// window.
    #[inline(always)]
    fn slide(&self, top: isize, number: usize, level: Level, scratch: &mut RoundScratch) {
        let at = mirrored(top + number as isize, self.height);
        let slots = self.window + 1;
        let RoundScratch { rows, right, shift_px, .. } = scratch;
        self.fill(at, level, &mut rows[number % slots], right, shift_px);
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

    /// Warps the right picture onto the left one by the disparity so far. Holes take the nearest disparity on their left (the first,
    /// at the edge): windows beside them must not compare the wrong water.
    #[inline(always)]
    fn fill(&self, at: usize, level: Level, row: &mut Row, right: &mut resample::Row, shift_px: &mut [f32]) {
        let width = self.width;
        let values = &self.disparity_px[at * width..][..width];
        let mut last = values.iter().copied().find(|px| px.is_finite()).unwrap_or_else(|| self.near(at, level.start_px));
        for (whole, value) in row.start_px.iter_mut().zip(values) {
            last = if value.is_nan() { last } else { *value };
            *whole = last;
        }
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
    fn near(&self, at: usize, otherwise: f32) -> f32 {
        let reach = 1..self.window.min(self.height);
        let rows = reach.flat_map(|step| [at.checked_sub(step), Some(at + step).filter(|row| *row < self.height)]).flatten();
        let mut found =
            rows.filter_map(|row| self.disparity_px[row * self.width..][..self.width].iter().find(|px| px.is_finite()));
        found.next().copied().unwrap_or(otherwise)
    }
}
