//! OpenCV's block matching: sums of absolute differences over a window, winner takes all.

use opencv::calib3d::StereoBM;
use opencv::core::{Mat, Ptr};
use opencv::prelude::*;

use super::{DisparityRange, Engine, MatchError, Matcher, Padded, check};
use crate::core::disparity::Disparity;

/// Block matching.
pub struct BlockMatcher {
    block_px: u32,
    engine: Option<Ptr<StereoBM>>,
    padded: Padded,
}

impl BlockMatcher {
    /// With `block_px × block_px` windows; made odd and at least 5, the least that OpenCV takes.
    #[must_use]
    pub fn new(block_px: u32) -> Self {
        Self { block_px: block_px.max(5) | 1, engine: None, padded: Padded::default() }
    }

    /// Without the margin that lets the left edge be matched: as OpenCV's own users call it, and as fast.
    #[must_use]
    pub fn without_margin(mut self) -> Self {
        self.padded.without_margin = true;
        self
    }

    fn create(&self) -> opencv::Result<Ptr<StereoBM>> {
        let mut engine = StereoBM::create(16, self.block_px as i32)?;
        // As for semi-global matching: left-right agreement within a pixel, a clear winner, no specks.
        engine.set_disp12_max_diff(1)?;
        engine.set_uniqueness_ratio(10)?;
        engine.set_speckle_window_size(50)?;
        engine.set_speckle_range(2)?;
        Ok(engine)
    }
}

impl Matcher for BlockMatcher {
    fn name(&self) -> &'static str {
        Engine::Bm.name()
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
