//! Semi-global matching (Hirschmüller 2008) with census costs, in bytes, 64 rows side by side, on all cores.

mod agree;
mod census;
mod choose;
mod lanes;
mod simd;
mod speckle;
mod strip;
mod sweep;

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

/// Along how many paths costs are summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Paths {
    /// Four.
    Four,
    /// Eight.
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
    /// Instructions to use.
    pub simd: Simd,
    /// Rows by which a strip overlaps the next.
    pub overlap_rows: usize,
}

/// Why pictures cannot be matched.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SgmError {
    /// Bad sizes.
    #[error("sizes")]
    Size,
}

/// The matcher.
#[derive(Debug)]
pub struct SemiGlobal {
    settings: Settings,
    workspaces: Mutex<Vec<Workspace>>,
    sums: Vec<u8>,
    specks: Specks,
}

impl SemiGlobal {
    /// With these settings.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self { settings, workspaces: Mutex::default(), sums: Vec::new(), specks: Specks::default() }
    }

    /// Matches.
    ///
    /// # Errors
    /// [`SgmError`].
    pub fn compute(
        &mut self,
        left: View<'_>,
        right: View<'_>,
        min_px: i32,
        count: u32,
        out_px: &mut [f32],
    ) -> Result<(), SgmError> {
        let (width, height) = (left.width, left.height);
        let settings = self.settings;
        self.sums.resize(width * height, 0);
        let keep = LANES - 2 * settings.overlap_rows;
        let workspaces = &self.workspaces;
        let strips = out_px.par_chunks_mut(keep * width).zip(self.sums.par_chunks_mut(keep * width));
        strips.enumerate().for_each(|(number, (disparity_px, sums))| {
            let row = number * keep;
            let first_row = row.saturating_sub(settings.overlap_rows).min(height.saturating_sub(LANES));
            let job = Job { left, right, min_px, count: count as usize, settings, first_row, lead: row - first_row };
            let mut workspace = workspaces.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default();
            settings.simd.run(&job, &mut workspace, Output { disparity_px, sums });
            workspaces.lock().unwrap_or_else(PoisonError::into_inner).push(workspace);
        });
        self.specks.remove(out_px, width, settings.speckle_area_max, settings.speckle_step_max_px);
        Ok(())
    }

    /// Bytes held.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let workspaces = self.workspaces.lock().unwrap_or_else(PoisonError::into_inner);
        workspaces.iter().map(Workspace::memory_bytes).sum::<usize>() + self.sums.capacity() + self.specks.memory_bytes()
    }
}
