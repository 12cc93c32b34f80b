//! Dense matching: engines behind one trait.

mod block;
mod census;
mod method;
mod sgbm;

use std::str::FromStr;

pub use block::BlockMatcher;
pub use census::CensusMatcher;
use halcyon_model::Image;
pub use method::StudyMethod;
use opencv::core::{self as cvcore, BORDER_REPLICATE, Mat, MatTraitConst, MatTraitConstManual, Rect};
pub use sgbm::{SemiGlobalMatcher, SgbmMode};

use super::cv;
use super::disparity::Disparity;
use super::guided::GuidedMatcher;
use super::plane::DisparityPlane;
pub use super::sgm::Paths;
use super::study;

/// Which disparities to search: `min_px ..= max_px`, whole pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct DisparityRange {
    /// Least disparity, pixels.
    pub min_px: u32,
    /// Largest disparity, pixels.
    pub max_px: u32,
}

impl DisparityRange {
    /// OpenCV searches multiples of this many disparities.
    const STEP: u32 = 16;

    /// How many disparities to search: enough for the range, rounded up to a multiple of 16.
    #[must_use]
    pub fn count(&self) -> u32 {
        (self.max_px.saturating_sub(self.min_px) + 1).div_ceil(Self::STEP) * Self::STEP
    }
}

/// Why two pictures could not be matched.
#[derive(Debug, thiserror::Error)]
pub enum MatchError {
    /// The two pictures differ in size.
    #[error(
        "the left picture is {left_width_px}x{left_height_px} px, the right one {right_width_px}x{right_height_px}: they must be of one size"
    )]
    Sizes {
        /// Left width.
        left_width_px: u32,
        /// Left height.
        left_height_px: u32,
        /// Right width.
        right_width_px: u32,
        /// Right height.
        right_height_px: u32,
    },
    /// No such range of disparities in a picture of this width.
    #[error("disparities of {min_px} to {max_px} px cannot be searched in a picture {width_px} px wide")]
    Range {
        /// Least disparity asked for.
        min_px: u32,
        /// Largest disparity asked for.
        max_px: u32,
        /// Width of the pictures.
        width_px: u32,
    },
    /// No larger than the window that is compared.
    #[error("a picture of {width_px}x{height_px} px is too small to match")]
    TooSmall {
        /// Width.
        width_px: u32,
        /// Height.
        height_px: u32,
    },
    /// A setting of the reference matcher.
    #[error("{0}")]
    Settings(String),
    /// The reference matcher holds all costs at once.
    #[error(
        "the reference matcher would need {needed_mib} MiB for its costs and takes at most {most_mib}: shrink the pictures or search fewer disparities"
    )]
    Memory {
        /// What it would need.
        needed_mib: u64,
        /// What it takes.
        most_mib: u64,
    },
    /// OpenCV failed.
    #[error("OpenCV failed while matching")]
    OpenCv(#[from] opencv::Error),
}

/// A way to find, for each pixel of the left rectified picture, the same point in the right one.
pub trait Matcher: Send {
    /// As in configuration and reports.
    fn name(&self) -> &'static str;

    /// Matches two one-channel 8-bit pictures of one size and fills `disparity`. Keeps its buffers between calls.
    ///
    /// # Errors
    /// [`MatchError`] where the pictures differ in size or the range does not fit into them.
    fn compute(&mut self, left: &Mat, right: &Mat, range: DisparityRange, disparity: &mut Disparity) -> Result<(), MatchError>;

    /// Where the next pair's mean surface is expected, for engines that make use of that; `None` where nobody knows.
    fn guide(&mut self, plane: Option<DisparityPlane>) {
        let _ = plane;
    }

    /// Whether the last pair was searched about a plane only.
    fn was_guided(&self) -> bool {
        false
    }

    /// How many bytes its own buffers hold; OpenCV does not tell.
    fn memory_bytes(&self) -> usize {
        0
    }
}

/// Matches two pictures with any engine: the convenient form of [`Matcher::compute`].
///
/// # Errors
/// As [`Matcher::compute`].
pub fn match_images(
    matcher: &mut dyn Matcher,
    left: &Image,
    right: &Image,
    range: DisparityRange,
) -> Result<Disparity, MatchError> {
    let mut disparity = Disparity::default();
    let (left, right) = (cv::mat_from_image(left)?.clone_pointee(), cv::mat_from_image(right)?.clone_pointee());
    matcher.compute(&left, &right, range, &mut disparity)?;
    Ok(disparity)
}

/// The engines, by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Engine {
    /// Halcyon's own: a few disparities about the mean plane of the water; a general search where there is no plane.
    Guided,
    /// OpenCV's block matching: fastest, sparse where texture is weak.
    Bm,
    /// OpenCV's semi-global matching (Hirschmüller 2008, thesis 4-16).
    Sgbm(SgbmMode),
    /// Our own semi-global matching with census costs: several times as fast as OpenCV's.
    Sgm(Paths),
    /// The plain reference matcher, for study: slow, and holds all costs in memory.
    Study(StudyMethod),
}

impl Engine {
    /// Every engine for work. Those for study are [`StudyMethod::ALL`].
    pub const ALL: [Self; 8] = [
        Self::Guided,
        Self::Bm,
        Self::Sgbm(SgbmMode::FivePaths),
        Self::Sgbm(SgbmMode::ThreePaths),
        Self::Sgbm(SgbmMode::FourPaths),
        Self::Sgbm(SgbmMode::EightPaths),
        Self::Sgm(Paths::Four),
        Self::Sgm(Paths::Eight),
    ];

    /// As in configuration and on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Guided => "guided",
            Self::Bm => "bm",
            Self::Sgbm(SgbmMode::FivePaths) => "sgbm",
            Self::Sgbm(SgbmMode::ThreePaths) => "sgbm-3way",
            Self::Sgbm(SgbmMode::FourPaths) => "sgbm-hh4",
            Self::Sgbm(SgbmMode::EightPaths) => "sgbm-hh",
            Self::Sgm(Paths::Four) => "sgm",
            Self::Sgm(Paths::Eight) => "sgm8",
            Self::Study(method) => method.name(),
        }
    }

    /// A matcher of this kind with `block_px × block_px` windows (odd).
    #[must_use]
    pub fn matcher(self, block_px: u32) -> Box<dyn Matcher> {
        match self {
            Self::Guided => Box::new(GuidedMatcher::new(block_px, GENERAL.matcher(GENERAL.block_px_default()))),
            Self::Bm => Box::new(BlockMatcher::new(block_px)),
            Self::Sgbm(mode) => Box::new(SemiGlobalMatcher::new(mode, block_px)),
            Self::Sgm(paths) => Box::new(CensusMatcher::new(paths, block_px)),
            Self::Study(method) => Box::new(study::ReferenceMatcher::new(study::Settings::new(method, block_px))),
        }
    }

    /// The same as OpenCV's own users call it, without a margin on the left: for comparisons of speed. `None` for ours.
    #[must_use]
    pub fn peer(self) -> Option<Box<dyn Matcher>> {
        let block_px = self.block_px_default();
        match self {
            Self::Bm => Some(Box::new(BlockMatcher::new(block_px).without_margin())),
            Self::Sgbm(mode) => Some(Box::new(SemiGlobalMatcher::new(mode, block_px).without_margin())),
            Self::Guided | Self::Sgm(_) | Self::Study(_) => None,
        }
    }

    /// A window that suits the engine, pixels: block matching has nothing but its window, semi-global matching little need
    /// of one.
    #[must_use]
    pub fn block_px_default(self) -> u32 {
        match self {
            Self::Guided => 9,
            Self::Bm => 15,
            Self::Sgbm(_) | Self::Sgm(_) => 5,
            Self::Study(method) => method.window_px_default(),
        }
    }

    /// How many disparities the engine searches for a range: OpenCV's in multiples of 16.
    #[must_use]
    pub fn disparities(self, range: DisparityRange) -> u32 {
        match self {
            Self::Bm | Self::Sgbm(_) => range.count(),
            Self::Guided | Self::Sgm(_) | Self::Study(_) => range.max_px.saturating_sub(range.min_px) + 1,
        }
    }
}

/// What `guided` searches with where no plane explains a pair.
const GENERAL: Engine = Engine::Sgm(Paths::Four);

/// No engine of that name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "no matching engine is called {0:?}: there are guided, bm, sgbm, sgbm-3way, sgbm-hh4, sgbm-hh, sgm, sgm8 and, for study, wta- or sgm- with sad, ssd, ncc, rank, census or mi"
)]
pub struct UnknownEngine(String);

impl FromStr for Engine {
    type Err = UnknownEngine;

    fn from_str(text: &str) -> Result<Self, UnknownEngine> {
        // Bounded: the text may be anything.
        let study = StudyMethod::ALL.into_iter().map(Self::Study);
        Self::ALL
            .into_iter()
            .chain(study)
            .find(|engine| engine.name() == text)
            .ok_or_else(|| UnknownEngine(text.chars().take(40).collect()))
    }
}

/// What every OpenCV matcher needs around it: both pictures get a margin on the left as wide as the search, so that the left
/// edge is matched as well, and 16ths of pixels become pixels.
#[derive(Debug, Default)]
struct Padded {
    left: Mat,
    right: Mat,
    fixed: Mat,
    /// For comparisons of speed.
    without_margin: bool,
}

impl Padded {
    /// Runs `compute(left, right, disparity in 16ths)` on padded pictures and unpacks what comes out.
    fn run(
        &mut self,
        left: &Mat,
        right: &Mat,
        range: DisparityRange,
        disparity: &mut Disparity,
        compute: impl FnOnce(&Mat, &Mat, &mut Mat) -> opencv::Result<()>,
    ) -> Result<(), MatchError> {
        let margin = if self.without_margin { 0 } else { (range.min_px + range.count()) as i32 };
        if margin == 0 {
            compute(left, right, &mut self.fixed)?;
        } else {
            for (from, to) in [(left, &mut self.left), (right, &mut self.right)] {
                cvcore::copy_make_border(from, to, 0, 0, margin, 0, BORDER_REPLICATE, cvcore::Scalar::default())?;
            }
            compute(&self.left, &self.right, &mut self.fixed)?;
        }
        let (width, height) = (left.cols(), left.rows());
        let inner = Mat::roi(&self.fixed, Rect::new(margin, 0, width, height))?;
        disparity.reset(width as u32, height as u32);
        let none = (range.min_px as i16).saturating_mul(16) - 1;
        for (row, values) in disparity.values_px.chunks_exact_mut(width as usize).enumerate() {
            for (x, (value, fixed)) in values.iter_mut().zip(inner.at_row::<i16>(row as i32)?).enumerate() {
                let disparity_px = f32::from(*fixed) / 16.0;
                // What lies in the margin of the right picture was never seen.
                if *fixed > none && disparity_px <= x as f32 {
                    *value = disparity_px;
                }
            }
        }
        Ok(())
    }
}

/// Refuses what OpenCV would abort on.
pub(super) fn check(left: &Mat, right: &Mat, range: DisparityRange, block_px: u32) -> Result<(), MatchError> {
    let ((left_width_px, left_height_px), (right_width_px, right_height_px)) = (cv::size_px(left), cv::size_px(right));
    if (left_width_px, left_height_px) != (right_width_px, right_height_px) {
        return Err(MatchError::Sizes { left_width_px, left_height_px, right_width_px, right_height_px });
    }
    if left_width_px <= block_px || left_height_px <= block_px {
        return Err(MatchError::TooSmall { width_px: left_width_px, height_px: left_height_px });
    }
    // 16-bit fixed point holds disparities below 2048.
    if range.min_px > range.max_px || range.max_px >= left_width_px || range.min_px + range.count() >= 2047 {
        return Err(MatchError::Range { min_px: range.min_px, max_px: range.max_px, width_px: left_width_px });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_go_there_and_back() {
        for engine in Engine::ALL.into_iter().chain(StudyMethod::ALL.map(Engine::Study)) {
            assert_eq!(engine.name().parse(), Ok(engine));
            assert_eq!(engine.matcher(engine.block_px_default()).name(), engine.name());
        }
        assert!("elas".parse::<Engine>().is_err());
        // In configurations since the first version.
        for name in ["bm", "sgbm", "sgbm-3way", "sgbm-hh"] {
            assert!(name.parse::<Engine>().is_ok());
        }
    }

    #[test]
    fn the_number_of_disparities_is_rounded_up() {
        assert_eq!(DisparityRange { min_px: 0, max_px: 15 }.count(), 16);
        assert_eq!(DisparityRange { min_px: 0, max_px: 16 }.count(), 32);
        assert_eq!(DisparityRange { min_px: 20, max_px: 30 }.count(), 16);
    }
}
