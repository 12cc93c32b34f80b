//! The search about the plane: absolute differences of horizontal slopes over a window, winner takes all.
//!
//! Windows lie in the plane, rounded to whole pixels: within a window every pixel is compared at the plane's disparity there plus the
//! same residual, so that a tilted camera costs nothing.

use multiversion::multiversion;
use rayon::prelude::*;

use super::Pair;
use crate::core::disparity::Disparity;
use crate::core::matcher::DisparityRange;
use crate::core::plane::DisparityPlane;
use crate::core::window::{BAND_ROWS, mirror_ends, mirrored, sums};

/// Slopes are cut off here, grey levels: a glint must not outvote its window.
const SLOPE_MAX: i16 = 31;
/// What a pixel costs that the right camera did not see.
const UNSEEN: u8 = 2 * SLOPE_MAX as u8 + 1;
/// The best residual must beat all that are not its neighbours by this share, percent.
const UNIQUENESS_PERCENT: u32 = 10;
/// The right picture's pixel must choose the same disparity, to so many pixels.
const LEFT_RIGHT_MAX_PX: u16 = 1;
/// Wider windows would overflow their 16-bit sums: 31² · 63 < 2¹⁶.
const WINDOW_MAX_PX: u32 = 31;

/// Searches pairs of one size; keeps its buffers between calls.
pub(super) struct Residual {
    window_px: u32,
    slopes: [Vec<u8>; 2],
    scratch: Vec<Scratch>,
}

/// What was found.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Found {
    /// Pixels that both cameras see, if the plane is right.
    pub(super) seen: u64,
    /// Of those, pixels with a match.
    found: u64,
    /// Further pixels whose winner is at an end of the range.
    ends: u64,
}

impl Found {
    /// Share of the pixels with a match or with a winner at an end.
    pub(super) fn share(&self) -> f64 {
        (self.found + self.ends) as f64 / self.seen.max(1) as f64
    }

    /// Share of the winners that are at an end.
    pub(super) fn at_ends(&self) -> f64 {
        self.ends as f64 / (self.found + self.ends).max(1) as f64
    }

    fn plus(self, other: Self) -> Self {
        Self { seen: self.seen + other.seen, found: self.found + other.found, ends: self.ends + other.ends }
    }
}

/// What a band of rows works with.
#[derive(Default)]
struct Scratch {
    /// Runs of pixels of one row with the same whole disparity of the plane: first pixel, end, disparity.
    runs: Vec<(usize, usize, i32)>,
    costs: Vec<u8>,
    /// For each residual, sums of costs down the columns of the window, and over the window.
    columns: Vec<Vec<u16>>,
    windows: Vec<Vec<u16>>,
    best: Vec<u16>,
    winner: Vec<u16>,
    /// Costs of the winner's neighbours.
    below: Vec<u16>,
    above: Vec<u16>,
    second: Vec<u16>,
    /// All ones where the right picture agrees.
    mutual: Vec<u16>,
    /// For each pixel of the right picture, the least cost of any pixel that is matched with it, and at which disparity.
    right_best: Vec<u16>,
    right_px: Vec<i16>,
}

impl Scratch {
    fn resize(&mut self, width: usize, half: usize, residuals: usize) {
        self.costs.resize(width, 0);
        self.columns.resize_with(residuals, Vec::new);
        self.windows.resize_with(residuals, Vec::new);
        for columns in &mut self.columns {
            columns.clear();
            columns.resize(width + 2 * half, 0);
        }
        self.windows.iter_mut().for_each(|windows| windows.resize(width, 0));
        let all = [&mut self.best, &mut self.winner, &mut self.below, &mut self.above, &mut self.second, &mut self.mutual];
        all.into_iter().chain([&mut self.right_best]).for_each(|buffer| buffer.resize(width, 0));
        self.right_px.resize(width, 0);
    }

    fn memory_bytes(&self) -> usize {
        let sums: usize = self.columns.iter().chain(&self.windows).map(Vec::capacity).sum();
        size_of::<u16>() * (sums + 8 * self.best.capacity()) + self.costs.capacity()
    }
}

/// One search.
struct Job<'a> {
    slopes: [&'a [u8]; 2],
    width: usize,
    height: usize,
    window: usize,
    plane: DisparityPlane,
    reach: i32,
    range: DisparityRange,
}

impl Residual {
    pub(super) fn new(window_px: u32) -> Self {
        let window_px = (window_px | 1).min(WINDOW_MAX_PX);
        Self { window_px, slopes: Default::default(), scratch: Vec::new() }
    }

    pub(super) fn window_px(&self) -> u32 {
        self.window_px
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let slopes: usize = self.slopes.iter().map(Vec::capacity).sum();
        slopes + self.scratch.iter().map(Scratch::memory_bytes).sum::<usize>()
    }

    /// Takes the slopes of a pair.
    pub(super) fn prepare(&mut self, pair: &Pair<'_>) {
        let [left, right] = &mut self.slopes;
        let (width, height) = (pair.width, pair.height);
        for slopes in [&mut *left, &mut *right] {
            slopes.resize(width * height, 0);
        }
        let bands = left.par_chunks_mut(BAND_ROWS * width).zip(right.par_chunks_mut(BAND_ROWS * width)).enumerate();
        bands.for_each(|(band, (left, right))| {
            slopes_of(pair.left, width, height, band * BAND_ROWS, left);
            slopes_of(pair.right, width, height, band * BAND_ROWS, right);
        });
    }

    /// Matches the pair that was prepared within `reach_px` of `plane`; NaN where the winner is doubtful, at an end, or out of `range`.
    pub(super) fn search(
        &mut self,
        pair: &Pair<'_>,
        plane: &DisparityPlane,
        reach_px: u32,
        range: DisparityRange,
        disparity: &mut Disparity,
    ) -> Found {
        let (width, height) = (pair.width, pair.height);
        disparity.reset(width as u32, height as u32);
        self.scratch.resize_with(height.div_ceil(BAND_ROWS), Scratch::default);
        let job = Job {
            slopes: [&self.slopes[0], &self.slopes[1]],
            width,
            height,
            window: self.window_px as usize,
            plane: *plane,
            reach: reach_px as i32,
            range,
        };
        let bands = disparity.values_px.par_chunks_mut(BAND_ROWS * width).zip(&mut self.scratch).enumerate();
        bands.map(|(band, (to, scratch))| search_band(&job, band, scratch, to)).reduce(Found::default, Found::plus)
    }
}

/// Horizontal slope (Sobel's) of the rows from `first` on, cut off and shifted to be positive.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl+avx512dq", "x86_64+avx2"))]
fn slopes_of(picture: &[u8], width: usize, height: usize, first: usize, to: &mut [u8]) {
    for (row, to) in to.chunks_exact_mut(width).enumerate() {
        let at = |row: isize| &picture[mirrored(row, height) * width..][..width];
        let row = (first + row) as isize;
        let (above, here, below) = (at(row - 1), at(row), at(row + 1));
        to.fill(SLOPE_MAX as u8);
        if width < 3 {
            continue;
        }
        let (a, h, b) = (&above[..width - 2], &here[..width - 2], &below[..width - 2]);
        let (c, i, d) = (&above[2..], &here[2..], &below[2..]);
        for (x, to) in to[1..width - 1].iter_mut().enumerate() {
            let before = i16::from(a[x]) + 2 * i16::from(h[x]) + i16::from(b[x]);
            let after = i16::from(c[x]) + 2 * i16::from(i[x]) + i16::from(d[x]);
            *to = ((after - before).clamp(-SLOPE_MAX, SLOPE_MAX) + SLOPE_MAX) as u8;
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl+avx512dq", "x86_64+avx2"))]
fn search_band(job: &Job, band: usize, scratch: &mut Scratch, to: &mut [f32]) -> Found {
    job.band(band, scratch, to)
}

impl Job<'_> {
    #[inline(always)]
    fn band(&self, band: usize, scratch: &mut Scratch, to: &mut [f32]) -> Found {
        let half = self.window / 2;
        let residuals = 2 * self.reach as usize + 1;
        scratch.resize(self.width, half, residuals);
        let first = (band * BAND_ROWS) as isize;
        let mut found = Found::default();
        for row in first - half as isize..first + half as isize {
            self.slide(row, true, scratch);
        }
        for (row, to) in to.chunks_exact_mut(self.width).enumerate() {
            let row = first + row as isize;
            self.slide(row + half as isize, true, scratch);
            let Scratch { columns, windows, .. } = scratch;
            for (columns, windows) in columns.iter_mut().zip(windows) {
                mirror_ends(columns, half);
                sums(columns, self.window, windows);
            }
            self.find_runs(row as usize, scratch);
            self.look_back(scratch);
            self.rank(scratch);
            self.agree(scratch);
            found = found.plus(self.choose(scratch, to));
            self.slide(row - half as isize, false, scratch);
        }
        found
    }

    /// The plane's whole disparities along a row.
    #[inline(always)]
    fn find_runs(&self, row: usize, scratch: &mut Scratch) {
        scratch.runs.clear();
        // Beyond the picture it is all the same, and 16 bits hold it.
        const LIMIT_PX: f32 = 16_384.0;
        let whole = |x: usize| self.plane.at(x as f32, row as f32).round().clamp(-LIMIT_PX, LIMIT_PX) as i32;
        let mut from = 0;
        while from < self.width {
            let here = whole(from);
            // It only rises or only falls along a row, rounding included: a run's end can be found by halving.
            let (mut inside, mut end) = (from, self.width);
            while end - inside > 1 {
                let middle = inside + (end - inside) / 2;
                if whole(middle) == here {
                    inside = middle;
                } else {
                    end = middle;
                }
            }
            scratch.runs.push((from, end, here));
            from = end;
        }
    }

    /// Adds the costs of a row to the columns' sums, or takes them away.
    #[inline(always)]
    fn slide(&self, row: isize, adds: bool, scratch: &mut Scratch) {
        let row = mirrored(row, self.height);
        self.find_runs(row, scratch);
        let half = self.window / 2;
        let [left, right] = self.slopes.map(|slopes| &slopes[row * self.width..][..self.width]);
        for (residual, columns) in (-self.reach..=self.reach).zip(&mut scratch.columns) {
            for (from, end, whole) in &scratch.runs {
                let shift = whole + residual;
                let (least, most) = self.partnered(*from, *end, shift);
                scratch.costs[*from..least].fill(UNSEEN);
                scratch.costs[most..*end].fill(UNSEEN);
                if least < most {
                    let partner = &right[(least as i32 - shift) as usize..][..most - least];
                    let pixels = left[least..most].iter().zip(partner);
                    for (cost, (l, r)) in scratch.costs[least..most].iter_mut().zip(pixels) {
                        *cost = l.abs_diff(*r);
                    }
                }
            }
            let columns = columns[half..][..self.width].iter_mut().zip(&scratch.costs);
            if adds {
                columns.for_each(|(sum, cost)| *sum += u16::from(*cost));
            } else {
                columns.for_each(|(sum, cost)| *sum -= u16::from(*cost));
            }
        }
    }

    /// Which pixels of a run have their partner in the picture.
    #[inline(always)]
    fn partnered(&self, from: usize, end: usize, shift: i32) -> (usize, usize) {
        let least = shift.clamp(from as i32, end as i32) as usize;
        (least, (self.width as i32 + shift).clamp(least as i32, end as i32) as usize)
    }

    /// For each pixel of the right picture, the disparity that suits it best.
    #[inline(always)]
    fn look_back(&self, scratch: &mut Scratch) {
        let Scratch { windows, runs, right_best, right_px, .. } = scratch;
        right_best.fill(u16::MAX);
        right_px.fill(i16::MIN);
        for (residual, costs) in (-self.reach..=self.reach).zip(windows.iter()) {
            for (from, end, whole) in runs.iter() {
                let shift = whole + residual;
                let (least, most) = self.partnered(*from, *end, shift);
                if least >= most {
                    continue;
                }
                let to = (least as i32 - shift) as usize;
                let right = right_best[to..][..most - least].iter_mut().zip(&mut right_px[to..][..most - least]);
                for (cost, (best, px)) in costs[least..most].iter().zip(right) {
                    let is_less = *cost < *best;
                    *best = if is_less { *cost } else { *best };
                    *px = if is_less { shift as i16 } else { *px };
                }
            }
        }
    }

    /// The residual with the least cost for each pixel, and what it must beat.
    #[inline(always)]
    fn rank(&self, scratch: &mut Scratch) {
        let width = self.width;
        let Scratch { windows, best, winner, below, above, second, .. } = scratch;
        let (best, winner, second) = (&mut best[..width], &mut winner[..width], &mut second[..width]);
        let (below, above) = (&mut below[..width], &mut above[..width]);
        best.fill(u16::MAX);
        winner.fill(0);
        below.fill(u16::MAX);
        above.fill(u16::MAX);
        for (residual, costs) in windows.iter().enumerate() {
            let costs = &costs[..width];
            let before = &windows[residual.saturating_sub(1)][..width];
            let residual = residual as u16;
            for x in 0..width {
                let (cost, follows) = (costs[x], winner[x].wrapping_add(1) == residual);
                let is_less = cost < best[x];
                above[x] = if follows { cost } else { above[x] };
                above[x] = if is_less { u16::MAX } else { above[x] };
                below[x] = if is_less { before[x] } else { below[x] };
                best[x] = if is_less { cost } else { best[x] };
                winner[x] = if is_less { residual } else { winner[x] };
            }
        }
        second.fill(u16::MAX);
        for (residual, costs) in windows.iter().enumerate() {
            let costs = &costs[..width];
            let next = residual as u16 + 1;
            for x in 0..width {
                let is_winner_or_neighbour = next.wrapping_sub(winner[x]) <= 2;
                let rival = if is_winner_or_neighbour { u16::MAX } else { costs[x] };
                second[x] = if rival < second[x] { rival } else { second[x] };
            }
        }
    }

    /// Whether the right picture's pixels choose what the left one's do.
    #[inline(always)]
    fn agree(&self, scratch: &mut Scratch) {
        let Scratch { runs, winner, mutual, right_px, .. } = scratch;
        mutual.fill(0);
        for residual in -self.reach..=self.reach {
            let chosen = (residual + self.reach) as u16;
            for (from, end, whole) in runs.iter() {
                let shift = whole + residual;
                let (least, most) = self.partnered(*from, *end, shift);
                if least >= most {
                    continue;
                }
                let partners = &right_px[(least as i32 - shift) as usize..][..most - least];
                let left = winner[least..most].iter().zip(&mut mutual[least..most]);
                let shift = shift as i16;
                for (partner, (winner, mutual)) in partners.iter().zip(left) {
                    let agrees = (*winner == chosen) & (partner.wrapping_sub(shift).unsigned_abs() <= LEFT_RIGHT_MAX_PX);
                    *mutual |= if agrees { u16::MAX } else { 0 };
                }
            }
        }
    }

    /// The winners that stand out, with a fraction.
    #[inline(always)]
    fn choose(&self, scratch: &mut Scratch, to: &mut [f32]) -> Found {
        let Scratch { best, winner, below, above, second, mutual, runs, .. } = scratch;
        let last = 2 * self.reach as u16;
        let (least_px, most_px) = (self.range.min_px as f32, self.range.max_px as f32);
        let mut found = Found::default();
        for (from, end, whole) in runs.iter() {
            let here = *from..*end;
            let (best, winner, second) = (&best[here.clone()], &winner[here.clone()], &second[here.clone()]);
            let (below, above, mutual) = (&below[here.clone()], &above[here.clone()], &mutual[here.clone()]);
            let to = &mut to[here];
            // Pixels are seen from the one that the right picture begins with up to the one that it ends with.
            let (first_seen, end_seen) = self.partnered(*from, *end, *whole);
            let (first_seen, end_seen) = ((first_seen - from) as u32, (end_seen - from) as u32);
            let base_px = (whole - self.reach) as f32;
            let (mut matches, mut ends) = (0_u32, 0_u32);
            for x in 0..to.len() {
                let is_seen = (x as u32 >= first_seen) & ((x as u32) < end_seen);
                let is_clear = (100 - UNIQUENESS_PERCENT) * u32::from(second[x]) > 100 * u32::from(best[x]);
                let is_clear = is_clear & (mutual[x] != 0);
                let is_end = (winner[x] == 0) | (winner[x] == last);
                // Costs of absolute differences meet at an angle: equal slopes on both sides (Shimizu and Okutomi 2001).
                let (best, below, above) = (f32::from(best[x]), f32::from(below[x]), f32::from(above[x]));
                let higher = if below > above { below } else { above };
                let twice = 2.0 * (higher - best);
                let fraction = (below - above) / if twice > 1.0 { twice } else { 1.0 };
                let value_px = base_px + f32::from(winner[x]) + fraction;
                let is_match = is_seen & is_clear & !is_end & (value_px <= (from + x) as f32);
                let is_match = is_match & (value_px >= least_px) & (value_px <= most_px);
                to[x] = if is_match { value_px } else { f32::NAN };
                matches += u32::from(is_match);
                ends += u32::from(is_seen & is_clear & is_end);
            }
            found = found.plus(Found { seen: u64::from(end_seen - first_seen), found: matches.into(), ends: ends.into() });
        }
        found
    }
}

#[cfg(test)]
mod tests;
