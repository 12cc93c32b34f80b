//! OpenCV's semi-global matching (Hirschmüller 2008; pixel cost by Birchfield and Tomasi on gradients and intensities).

use opencv::calib3d::{self, StereoSGBM};
use opencv::core::{Mat, Ptr};
use opencv::prelude::*;

use super::{DisparityRange, MatchError, Matcher, Padded, check};
use crate::core::disparity::Disparity;

/// Along how many paths costs are summed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SgbmMode {
    /// Three: threaded, least memory.
    ThreePaths,
    /// Four, along rows and columns, in two passes.
    FourPaths,
    /// Five, in one pass over the picture.
    FivePaths,
    /// Eight, in two passes: best and slowest.
    EightPaths,
}

impl SgbmMode {
    fn flag(self) -> i32 {
        match self {
            Self::ThreePaths => calib3d::StereoSGBM_MODE_SGBM_3WAY,
            Self::FourPaths => calib3d::StereoSGBM_MODE_HH4,
            Self::FivePaths => calib3d::StereoSGBM_MODE_SGBM,
            Self::EightPaths => calib3d::StereoSGBM_MODE_HH,
        }
    }
}

/// Semi-global matching.
pub struct SemiGlobalMatcher {
    mode: SgbmMode,
    block_px: u32,
    engine: Option<Ptr<StereoSGBM>>,
    padded: Padded,
}

impl SemiGlobalMatcher {
    /// With `block_px × block_px` windows; made odd.
    #[must_use]
    pub fn new(mode: SgbmMode, block_px: u32) -> Self {
        Self { mode, block_px: block_px | 1, engine: None, padded: Padded::default() }
    }

    /// Without the margin that lets the left edge be matched: as OpenCV's own users call it, and as fast.
    #[must_use]
    pub fn without_margin(mut self) -> Self {
        self.padded.without_margin = true;
        self
    }

    fn create(&self) -> opencv::Result<Ptr<StereoSGBM>> {
        let area = (self.block_px * self.block_px) as i32;
        // Penalties for a change by one and by more, per pixel of the window (OpenCV's own recommendation); at most one pixel
        // between left-right and right-left; a best match must beat the second by 10 %; specks under 50 px are noise.
        StereoSGBM::create(0, 16, self.block_px as i32, 8 * area, 32 * area, 1, 31, 10, 50, 2, self.mode.flag())
    }
}

impl Matcher for SemiGlobalMatcher {
    fn name(&self) -> &'static str {
        super::Engine::Sgbm(self.mode).name()
    }

    fn compute(&mut self, left: &Mat, right: &Mat, range: DisparityRange, disparity: &mut Disparity) -> Result<(), MatchError> {
        check(left, right, range, self.block_px)?;
        let mut engine = match self.engine.take() {
            Some(engine) => engine,
            None => self.create()?,
        };
        engine.set_min_disparity(range.min_px as i32)?;
        engine.set_num_disparities(range.count() as i32)?;
        let outcome = self.padded.run(left, right, range, disparity, |left, right, fixed| engine.compute(left, right, fixed));
        self.engine = Some(engine);
        outcome
    }
}
