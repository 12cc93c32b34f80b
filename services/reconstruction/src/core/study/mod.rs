//! A plain reference matcher: every local and semi-global method of the thesis's section 4.6.2, in code that reads like the
//! formulas. For study, for the lab's figures, and as an oracle in tests; the engines of [`matcher`](super::matcher) are for work.
//!
//! A match is found in four steps (Scharstein and Szeliski 2002), one module each:
//!
//! 1. [`cost`] (with [`transform`] and [`information`]): how unlike are left (x, y) and right (x − d, y)?
//! 2. [`window`]: the mean cost over a window around the pixel, or over the best of nine windows.
//! 3. [`path`]: semi-global only: costs along straight paths to the pixel, with penalties for steps of disparity (4-16).
//! 4. [`select`]: the least cost wins, if it is unique and if left and right agree; a parabola for the fraction of a pixel.
//!
//! All costs of a picture are held at once, `height × width × disparities` of 4 bytes: 79 MB for 640 × 480 × 64, and as much
//! again for semi-global sums.

pub mod cost;
pub mod information;
pub mod path;
pub mod select;
pub mod transform;
pub mod volume;
pub mod window;

use opencv::core::{Mat, MatTraitConst, MatTraitConstManual};

use super::disparity::Disparity;
use super::matcher::{DisparityRange, MatchError, Matcher, StudyMethod, check};
use cost::Cost;
use path::{Paths, Penalties};
use volume::{CostVolume, Pair};
use window::Windows;

/// How a disparity is chosen from the costs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Optimiser {
    /// Each pixel takes its least cost.
    WinnerTakesAll,
    /// Costs are first summed along paths that meet in the pixel (Hirschmüller 2008; thesis 4-16).
    SemiGlobal {
        /// How many paths.
        paths: Paths,
        /// What a step of disparity costs.
        penalties: Penalties,
    },
}

/// Everything that can be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// How pixels are compared.
    pub cost: Cost,
    /// Side of the window over which costs are averaged, pixels, odd. 1 compares single pixels, which [`Cost::Ncc`] cannot.
    pub window_px: u32,
    /// Side of the neighbourhood that [`Cost::Rank`] and [`Cost::Census`] look at, pixels, odd, 3 to
    /// [`transform::SIDE_PX_MAX`]; others ignore it.
    pub transform_px: u32,
    /// One window or nine.
    pub windows: Windows,
    /// Winner takes all, or semi-global.
    pub optimiser: Optimiser,
    /// How far left and right may disagree, whole pixels; `None` leaves the check out (fig. 4-10).
    pub left_right_px: Option<u32>,
    /// The best cost must beat every other that is no neighbour by this many percent. With 0 only ties are refused.
    pub uniqueness_percent: f32,
    /// Interpolate to fractions of a pixel by a parabola through three costs.
    pub sub_pixel: bool,
}

impl Settings {
    /// What suits a method, with a window of `window_px × window_px`.
    #[must_use]
    pub fn new(method: StudyMethod, window_px: u32) -> Self {
        let optimiser = if method.semi_global {
            Optimiser::SemiGlobal { paths: Paths::Eight, penalties: method.cost.penalties_default() }
        } else {
            Optimiser::WinnerTakesAll
        };
        Self {
            cost: method.cost,
            window_px,
            transform_px: 7,
            windows: Windows::One,
            optimiser,
            left_right_px: Some(1),
            uniqueness_percent: 0.0,
            sub_pixel: true,
        }
    }

    /// The method, without its numbers.
    #[must_use]
    pub fn method(&self) -> StudyMethod {
        StudyMethod { semi_global: matches!(self.optimiser, Optimiser::SemiGlobal { .. }), cost: self.cost }
    }

    /// # Errors
    /// One line that names the setting, what it may be and what it is.
    pub fn check(&self) -> Result<(), String> {
        let odd = |name: &str, value: u32, least: u32, most: u32| {
            if value % 2 == 1 && (least..=most).contains(&value) {
                Ok(())
            } else {
                Err(format!("{name} must be odd, {least} to {most}, not {value}"))
            }
        };
        odd("the window", self.window_px, if self.cost == Cost::Ncc { 3 } else { 1 }, window::SIDE_PX_MAX)?;
        if matches!(self.cost, Cost::Rank | Cost::Census) {
            odd("the neighbourhood", self.transform_px, 3, transform::SIDE_PX_MAX)?;
        }
        if let Optimiser::SemiGlobal { penalties: Penalties { p1, p2, .. }, .. } = self.optimiser
            && !(p1.is_finite() && p2.is_finite() && 0.0 <= p1 && p1 <= p2)
        {
            return Err(format!("the penalties must be 0 <= P1 <= P2, not {p1} and {p2}"));
        }
        // Negated so that NaN is refused, too.
        if !(0.0..=100.0).contains(&self.uniqueness_percent) {
            return Err(format!("the uniqueness must be 0 to 100 percent, not {}", self.uniqueness_percent));
        }
        Ok(())
    }
}

/// The reference matcher.
#[derive(Debug)]
pub struct ReferenceMatcher {
    settings: Settings,
}

impl ReferenceMatcher {
    /// With these settings, which [`Matcher::compute`] checks.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        Self { settings }
    }

    /// The costs from which disparities are chosen: averaged over windows and, where so set, summed along paths.
    ///
    /// # Errors
    /// [`MatchError::Settings`] for settings that make no sense, [`MatchError::Memory`] where the costs would not fit.
    pub fn costs(&self, pair: &Pair<'_>, range: DisparityRange) -> Result<CostVolume, MatchError> {
        self.settings.check().map_err(MatchError::Settings)?;
        let costs = CostVolume::new(pair, &self.settings, range)?;
        match self.settings.optimiser {
            Optimiser::WinnerTakesAll => Ok(costs),
            Optimiser::SemiGlobal { paths, penalties } => path::sum(&costs, pair.left, paths, penalties),
        }
    }
}

impl Matcher for ReferenceMatcher {
    fn name(&self) -> &'static str {
        self.settings.method().name()
    }

    fn compute(&mut self, left: &Mat, right: &Mat, range: DisparityRange, disparity: &mut Disparity) -> Result<(), MatchError> {
        check(left, right, range, self.settings.window_px)?;
        let (width, height) = (left.cols() as usize, left.rows() as usize);
        let (left, right) = (rows(left)?, rows(right)?);
        let costs = self.costs(&Pair { left: &left, right: &right, width, height }, range)?;
        select::fill(&costs, &self.settings, disparity);
        Ok(())
    }
}

/// The pixels of a one-channel 8-bit matrix, whether or not its rows lie close together.
fn rows(mat: &Mat) -> opencv::Result<Vec<u8>> {
    let mut pixels = Vec::with_capacity((mat.rows() * mat.cols()) as usize);
    for row in 0..mat.rows() {
        pixels.extend_from_slice(mat.at_row::<u8>(row)?);
    }
    Ok(pixels)
}
