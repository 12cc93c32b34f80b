//! Engines side by side on one pair, for the lab: figures 4-23 and 5-6 (disparity maps), 4-24 (numbers of points), 5-17 (time by
//! resolution).

use halcyon_model::Image;
use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, Size};
use opencv::imgproc;

use super::speed::{Spent, median, spent};
use crate::core::cv;
use crate::core::disparity::Disparity;
use crate::core::disparity::score::{Score, SizeError, score};
use crate::core::matcher::{DisparityRange, Engine, MatchError, match_images};
use crate::core::reconstruct::{REFINE_ROUNDS, Settings};
use crate::core::refine::{Every, Refined, Refiner};

/// What one engine made of a pair.
#[derive(Debug, Clone, PartialEq)]
pub struct Matched {
    /// The engine.
    pub engine: Engine,
    /// Its disparity map.
    pub disparity: Disparity,
    /// Pixels with a match, each a point in space.
    pub points: usize,
    /// Processor time, all threads, milliseconds; `None` where the system does not tell.
    pub cpu_ms: Option<f64>,
    /// Time, milliseconds.
    pub wall_ms: f64,
}

impl Matched {
    /// Against the truth.
    ///
    /// # Errors
    /// [`SizeError`] where the truth has another size.
    pub fn score(&self, truth: &Disparity) -> Result<Score, SizeError> {
        score(&self.disparity, truth)
    }
}

/// Matches one rectified pair with each engine and what suits it.
///
/// # Errors
/// [`MatchError`] where the pictures differ in size or the range does not fit into them.
pub fn compare(left: &Image, right: &Image, range: DisparityRange, engines: &[Engine]) -> Result<Vec<Matched>, MatchError> {
    let one = |engine: &Engine| {
        let mut matcher = engine.matcher(engine.block_px_default());
        let (disparity, Spent { cpu_ms, wall_ms }) = spent(|| match_images(matcher.as_mut(), left, right, range));
        let disparity = disparity?;
        Ok(Matched { engine: *engine, points: disparity.matched(), disparity, cpu_ms, wall_ms })
    };
    engines.iter().map(one).collect()
}

/// What one engine takes for one size of picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeAtSize {
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// Disparities searched.
    pub disparities: u32,
    /// The engine.
    pub engine: Engine,
    /// Median processor time of a pair, all threads, milliseconds; `None` where the system does not tell.
    pub cpu_ms: Option<f64>,
    /// Median time of a pair, milliseconds.
    pub wall_ms: f64,
    /// Pixels with a match.
    pub points: usize,
}

/// The thesis's sizes of pictures (fig. 5-17), width and height in pixels.
pub const THESIS_SIZES_PX: [(u32, u32); 3] = [(320, 240), (640, 480), (1920, 1080)];

/// Times matching of one scene at several sizes: the pair is resampled to each, and the search grows with the width, so that
/// it covers the same depths. Each engine runs `repeats` times after one run to warm up.
///
/// # Errors
/// [`MatchError`] as for [`compare`], and where resampling fails.
pub fn times_by_size(
    left: &Image,
    right: &Image,
    range: DisparityRange,
    sizes_px: &[(u32, u32)],
    engines: &[Engine],
    repeats: usize,
) -> Result<Vec<TimeAtSize>, MatchError> {
    let mut rows = Vec::new();
    for (width_px, height_px) in sizes_px.iter().copied() {
        let at_size = |image: &Image| resized(image, width_px, height_px);
        let (left_there, right_there) = (at_size(left)?, at_size(right)?);
        let factor = f64::from(width_px) / f64::from(left.width_px());
        let scaled = |px: u32| (f64::from(px) * factor).ceil() as u32;
        let there = DisparityRange { min_px: scaled(range.min_px), max_px: scaled(range.max_px).clamp(1, width_px - 1) };
        for engine in engines {
            let mut runs = Vec::new();
            for _ in 0..=repeats.max(1) {
                runs.extend(compare(&left_there, &right_there, there, &[*engine])?);
            }
            // The first warms caches and allocator.
            let warm = &runs[1..];
            rows.push(TimeAtSize {
                width_px,
                height_px,
                disparities: engine.disparities(there),
                engine: *engine,
                cpu_ms: warm.iter().map(|run| run.cpu_ms).collect::<Option<Vec<_>>>().map(median),
                wall_ms: median(warm.iter().map(|run| run.wall_ms)),
                points: warm[0].points,
            });
        }
    }
    Ok(rows)
}

/// Resampled, by areas where it shrinks.
fn resized(image: &Image, width_px: u32, height_px: u32) -> Result<Image, MatchError> {
    let size = |found: u32| MatchError::TooSmall { width_px: found.min(width_px), height_px };
    if width_px == 0 || height_px == 0 {
        return Err(size(width_px));
    }
    let from = Mat::from_slice(image.pixels())?;
    let from = from.reshape(1, image.height_px() as i32)?;
    let how = if width_px < image.width_px() { imgproc::INTER_AREA } else { imgproc::INTER_CUBIC };
    let mut to = Mat::default();
    imgproc::resize(&from, &mut to, Size::new(width_px as i32, height_px as i32), 0.0, 0.0, how)?;
    Image::new(width_px, height_px, to.data_bytes()?.to_vec().into()).map_err(|_| size(width_px))
}

/// The disparity after the refinement of the default chain.
///
/// # Errors
/// [`MatchError`] where pictures and disparity differ in size.
pub fn refined(left: &Image, right: &Image, disparity: &Disparity) -> Result<Disparity, MatchError> {
    let exact = |image: &Image| -> opencv::Result<Mat> {
        let mut exact = Mat::default();
        cv::mat_from_image(image)?.convert_to(&mut exact, opencv::core::CV_32F, 1.0, 0.0)?;
        Ok(exact)
    };
    let mut refiner = Refiner::new(Settings::default().refine_window_px, REFINE_ROUNDS, Every::Pixel);
    let mut refined = Refined::default();
    refiner.refine(&exact(left)?, &exact(right)?, disparity, &mut refined)?;
    Ok(refined.disparity)
}
