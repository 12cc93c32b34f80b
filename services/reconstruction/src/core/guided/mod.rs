//! Matching that is guided by a plane (DESIGN §5.4): over water the disparity of the mean surface is an affine function of the pixel,
//! so that only a few pixels about it have to be searched, instead of hundreds.
//!
//! 1. The plane comes from whoever knows it (the last pair, or height and attitude: [`Matcher::guide`]), or from [`scouts`]: a few
//!    windows, searched over the whole range, and a robust plane through what they found. So a first pair needs nothing.
//! 2. [`residual`] searches a few pixels to either side of it, everywhere. Where winners crowd at the ends of that, or too little is
//!    found, the water leaves the range: the plane is set right by what was found, and the range doubled; never silently clipped.
//! 3. Where no plane explains the pair, a general matcher searches everything.

mod residual;
mod scouts;

use opencv::core::{Mat, MatTraitConst, MatTraitConstManual};
use residual::Residual;

use super::disparity::Disparity;
use super::matcher::{DisparityRange, MatchError, Matcher, check};
use super::plane::{DisparityPlane, Match};

/// How far from the plane to search, pixels, one after the other.
const REACHES_PX: [u32; 4] = [6, 12, 24, 48];
/// Where more of the winners than this are at an end of the range, some water is beyond it.
const AT_ENDS_MAX: f64 = 0.005;
/// A plane that fits finds a match for at least this share of the pixels that both cameras see.
const FOUND_MIN: f64 = 0.5;

/// The engine `guided`.
pub struct GuidedMatcher {
    general: Box<dyn Matcher>,
    guide: Option<DisparityPlane>,
    residual: Residual,
    was_guided: bool,
}

impl GuidedMatcher {
    /// With `block_px × block_px` windows (made odd), and what to search with where no plane explains a pair.
    #[must_use]
    pub fn new(block_px: u32, general: Box<dyn Matcher>) -> Self {
        Self { general, guide: None, residual: Residual::new(block_px), was_guided: false }
    }

    /// Searches about `plane`, wider and wider; false where it is no guide. `disparity` is then worth nothing.
    fn search(&mut self, pair: &Pair<'_>, mut plane: DisparityPlane, range: DisparityRange, disparity: &mut Disparity) -> bool {
        for reach_px in REACHES_PX {
            // Three quarters of the whole range are no saving any more.
            if 2 * reach_px + 1 > (range.max_px - range.min_px + 1) * 3 / 4 && reach_px != REACHES_PX[0] {
                return false;
            }
            let found = self.residual.search(pair, &plane, reach_px, range, disparity);
            if found.seen == 0 || found.share() < FOUND_MIN {
                // Few matches: a wrong plane finds them by chance only. A wider search may still find more, but not of this plane.
                return false;
            }
            if found.at_ends() <= AT_ENDS_MAX {
                return true;
            }
            plane = plane_through(disparity).unwrap_or(plane);
        }
        false
    }
}

/// The two rectified pictures, 8-bit, row-major.
pub(super) struct Pair<'a> {
    left: &'a [u8],
    right: &'a [u8],
    width: usize,
    height: usize,
}

impl Matcher for GuidedMatcher {
    fn name(&self) -> &'static str {
        super::matcher::Engine::Guided.name()
    }

    fn compute(&mut self, left: &Mat, right: &Mat, range: DisparityRange, disparity: &mut Disparity) -> Result<(), MatchError> {
        check(left, right, range, self.residual.window_px())?;
        self.was_guided = false;
        let guide = self.guide.take();
        let pair = Pair {
            left: left.data_typed::<u8>()?,
            right: right.data_typed::<u8>()?,
            width: left.cols() as usize,
            height: left.rows() as usize,
        };
        self.residual.prepare(&pair);
        if let Some(plane) = guide
            && self.search(&pair, plane, range, disparity)
        {
            self.was_guided = true;
            return Ok(());
        }
        if let Some(plane) = scouts::plane(&pair, range)
            && self.search(&pair, plane, range, disparity)
        {
            self.was_guided = true;
            return Ok(());
        }
        self.general.compute(left, right, range, disparity)
    }

    fn guide(&mut self, plane: Option<DisparityPlane>) {
        self.guide = plane;
    }

    fn was_guided(&self) -> bool {
        self.was_guided
    }

    fn memory_bytes(&self) -> usize {
        self.residual.memory_bytes()
    }
}

/// The plane through what was found, wherever that is.
fn plane_through(disparity: &Disparity) -> Option<DisparityPlane> {
    /// Enough for a plane.
    const SAMPLES: usize = 4096;
    let width = disparity.width_px as usize;
    let step = (disparity.values_px.len() / SAMPLES).max(1) | 1;
    let matches: Vec<Match> = (0..disparity.values_px.len())
        .step_by(step)
        .map(|i| (i, disparity.values_px[i]))
        .filter(|(_, value_px)| value_px.is_finite())
        .map(|(i, disparity_px)| Match { x_px: (i % width) as f32, y_px: (i / width) as f32, disparity_px, sigma_px: 0.5 })
        .collect();
    let (plane, sigma_px) = DisparityPlane::robust(&matches, &matches, 1)?;
    plane.refit(&matches, (3.0 * sigma_px).max(1.0))
}

#[cfg(test)]
mod tests;
