//! Semi-global matching (Hirschmüller 2008) with census costs, in bytes, 64 rows side by side, on all cores.

//!
//! A picture is cut into strips of 64 rows that overlap by a few; each is transposed, described by its census, and swept from left to
//! right and back (`sweep`, `strip`). Every strip is one task. What a strip's own rows cannot tell, paths do not carry further:
//! they begin at its edges.

mod agree;
mod census;
mod choose;
mod lanes;
#[cfg(test)]
mod oracle;
mod simd;
mod speckle;
mod strip;
mod sweep;
#[cfg(test)]
mod tests;

use std::sync::{Mutex, PoisonError};

pub use census::Census;
use lanes::LANES;
use rayon::prelude::*;
pub use simd::Simd;
use speckle::Specks;
use strip::{Job, Output, Workspace};

/// A picture of 8 bits a pixel, not owned.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    /// Rows from the top, `stride` apart.
    pub pixels: &'a [u8],
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Pixels from the start of a row to the start of the next.
    pub stride: usize,
}

/// Along how many paths costs are summed. Rows are worked on side by side, so no path runs along a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Paths {
    /// Four: along rows and along the falling diagonal, both ways.
    Four,
    /// Eight: along rows, both diagonals and a steep line (two rows down for a column), both ways.
    Eight,
}

/// What can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// How many paths.
    pub paths: Paths,
    /// Which pixels are compared.
    pub census: Census,
    /// Penalty for a step of disparity by one, in bits of the census.
    pub p1: u8,
    /// Penalty for a larger step.
    pub p2: u8,
    /// By how much the best must beat the best that is no neighbour of it, percent.
    pub uniqueness_percent: u8,
    /// How much left and right may disagree, pixels; `None` does not ask.
    pub left_right_max_px: Option<u8>,
    /// Patches of at most so many pixels are specks; 0 keeps all.
    pub speckle_area_max: u32,
    /// Within a patch, neighbours differ by at most this, pixels.
    pub speckle_step_max_px: f32,
    /// Instructions to use; the result is the same with all.
    pub simd: Simd,
}

impl Settings {
    /// What suits water and the sample pictures.
    #[must_use]
    pub fn new(paths: Paths) -> Self {
        Self {
            paths,
            census: Census::Five,
            p1: 10,
            p2: 40,
            uniqueness_percent: 5,
            left_right_max_px: Some(1),
            speckle_area_max: 50,
            speckle_step_max_px: 2.0,
            simd: Simd::best(),
        }
    }
}

/// Rows above and below a strip on which paths get going; more of them change nothing that can be measured on the sample pictures.
const OVERLAP_ROWS: usize = 4;
/// Rows of a strip that are kept.
const KEPT_ROWS: usize = LANES - 2 * OVERLAP_ROWS;
/// Widest and highest picture, pixels.
const SIDE_MAX: usize = 1 << 14;
/// Most disparities.
const COUNT_MAX: u32 = 1 << 11;
/// Least and largest disparity, pixels, to either side.
const DISPARITY_MAX: i32 = 1 << 14;

/// Why two pictures could not be matched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SgmError {
    /// No picture, one too large, or fewer bytes than its rows need.
    #[error("{bytes} bytes are no picture of {width}x{height} px with {stride} bytes a row (at most {SIDE_MAX} px a side)")]
    View {
        /// Width.
        width: usize,
        /// Height.
        height: usize,
        /// Bytes from row to row.
        stride: usize,
        /// Bytes given.
        bytes: usize,
    },
    /// Pictures or result differ in size.
    #[error("the left picture has {left} px, the right one {right}, the result {out}: all must be of one size")]
    Sizes {
        /// Pixels of the left picture.
        left: usize,
        /// Pixels of the right picture.
        right: usize,
        /// Pixels of the result.
        out: usize,
    },
    /// Too many disparities, none, or too far.
    #[error("{count} disparities from {min_px} px cannot be searched: 1 to {COUNT_MAX} within {DISPARITY_MAX} px can")]
    Range {
        /// Least disparity.
        min_px: i32,
        /// How many.
        count: u32,
    },
}

/// Matches pictures; keeps its buffers between calls, so that nothing is allocated once they fit.
///
/// Memory ([`Self::memory_bytes`]): each thread holds a strip's census (192 bytes a column of 64 rows, left and right), a checkpoint
/// (128 bytes a disparity for four paths) before each block of columns, and a block of sums (256 KB, more only above 256
/// disparities); all threads share a byte a pixel and the runs of the speck filter. Measured on the aloe pair with four paths: 1.4 MB for
/// 640 × 480 with 64 disparities and 1.1 MB for each further thread, 8.7 MB for 1920 × 1080 with 128 and 3 MB for each further one.
#[derive(Debug)]
pub struct SemiGlobal {
    settings: Settings,
    workspaces: Mutex<Vec<Workspace>>,
    sums: Vec<u8>,
    specks: Specks,
}

impl SemiGlobal {
    /// With these settings. Penalties above what a byte leaves beside the census's bits are held there.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        let p2 = settings.p2.min(u8::MAX - settings.census.bits());
        let settings = Settings { p2, p1: settings.p1.min(p2), ..settings };
        Self { settings, workspaces: Mutex::default(), sums: Vec::new(), specks: Specks::default() }
    }

    /// Fills `out_px` (row-major, without a stride) with left x minus right x of each left pixel, from `min_px` on for `count` whole
    /// pixels and fractions between them; NaN where there is no match, or only one beyond the right picture's edges.
    /// The result depends on the pictures and the settings alone, not on threads or instructions.
    ///
    /// # Errors
    /// [`SgmError`] for sizes that do not fit together.
    pub fn compute(
        &mut self,
        left: View<'_>,
        right: View<'_>,
        min_px: i32,
        count: u32,
        out_px: &mut [f32],
    ) -> Result<(), SgmError> {
        check(left, right, out_px.len())?;
        let distance_max = DISPARITY_MAX - COUNT_MAX as i32;
        if !(1..=COUNT_MAX).contains(&count) || !(-distance_max..=distance_max).contains(&min_px) {
            return Err(SgmError::Range { min_px, count });
        }
        let (width, height) = (left.width, left.height);
        let settings = self.settings;
        self.sums.resize(width * height, 0);
        let workspaces = &self.workspaces;
        let strips = out_px.par_chunks_mut(KEPT_ROWS * width).zip(self.sums.par_chunks_mut(KEPT_ROWS * width));
        strips.enumerate().for_each(|(number, (disparity_px, sums))| {
            let row = number * KEPT_ROWS;
            let first_row = row.saturating_sub(OVERLAP_ROWS).min(height.saturating_sub(LANES));
            let job = Job { left, right, min_px, count: count as usize, settings, first_row, lead: row - first_row };
            let mut workspace = workspaces.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default();
            settings.simd.run(&job, &mut workspace, Output { disparity_px, sums });
            workspaces.lock().unwrap_or_else(PoisonError::into_inner).push(workspace);
        });
        self.specks.remove(out_px, width, settings.speckle_area_max, settings.speckle_step_max_px);
        Ok(())
    }

    /// Bytes that the buffers take.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let workspaces = self.workspaces.lock().unwrap_or_else(PoisonError::into_inner);
        workspaces.iter().map(Workspace::memory_bytes).sum::<usize>() + self.sums.capacity() + self.specks.memory_bytes()
    }
}

fn check(left: View<'_>, right: View<'_>, out: usize) -> Result<(), SgmError> {
    for View { pixels, width, height, stride } in [left, right] {
        let sides = 1..=SIDE_MAX;
        let needed = (height.max(1) - 1).saturating_mul(stride).saturating_add(width);
        if !sides.contains(&width) || !sides.contains(&height) || stride < width || pixels.len() < needed {
            return Err(SgmError::View { width, height, stride, bytes: pixels.len() });
        }
    }
    let (left_px, right_px) = (left.width * left.height, right.width * right.height);
    if (left.width, left.height) != (right.width, right.height) || out != left_px {
        return Err(SgmError::Sizes { left: left_px, right: right_px, out });
    }
    Ok(())
}
