//! Our own semi-global matching ([`sgm`]) as an engine.

use opencv::core::{Mat, MatTraitConst, MatTraitConstManual};

use super::{DisparityRange, Engine, MatchError, Matcher, check};
use crate::core::disparity::Disparity;
use crate::core::sgm::{self, Census, Paths, SemiGlobal, Settings, View};

/// Semi-global matching with census costs.
pub struct CensusMatcher {
    paths: Paths,
    engine: SemiGlobal,
}

impl CensusMatcher {
    /// Along so many paths. `block_px` chooses the census: 5 × 5 up to 5, 7 × 7 up to 7, 9 × 7 above.
    #[must_use]
    pub fn new(paths: Paths, block_px: u32) -> Self {
        let census = match block_px {
            0..=5 => Census::Five,
            6..=7 => Census::Seven,
            _ => Census::NineSymmetric,
        };
        Self { paths, engine: SemiGlobal::new(Settings { census, ..Settings::new(paths) }) }
    }
}

impl Matcher for CensusMatcher {
    fn name(&self) -> &'static str {
        Engine::Sgm(self.paths).name()
    }

    fn compute(&mut self, left: &Mat, right: &Mat, range: DisparityRange, disparity: &mut Disparity) -> Result<(), MatchError> {
        check(left, right, range, 1)?;
        disparity.reset(left.cols() as u32, left.rows() as u32);
        let (left, right) = (view(left)?, view(right)?);
        let count = Engine::Sgm(self.paths).disparities(range);
        Ok(self.engine.compute(left, right, range.min_px as i32, count, &mut disparity.values_px)?)
    }
}

fn view(mat: &Mat) -> opencv::Result<View<'_>> {
    let width = mat.cols() as usize;
    Ok(View { pixels: mat.data_bytes()?, width, height: mat.rows() as usize, stride: width })
}

impl From<sgm::SgmError> for MatchError {
    fn from(error: sgm::SgmError) -> Self {
        Self::Settings(error.to_string())
    }
}
