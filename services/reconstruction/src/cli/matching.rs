//! `halcyon match`

use std::path::Path;

use halcyon_model::Image;
use serde::Serialize;

use super::options::{MatchOptions, OptionError};
use super::speed::{Spent, spent};
use super::texture::without_texture;
use crate::core::disparity::Disparity;
use crate::core::disparity::score::{Score, SizeError, score};
use crate::core::disparity::{colour, pfm};
use crate::core::matcher::{DisparityRange, Engine, MatchError, UnknownEngine, match_images};
use crate::files::{FileError, Output, check_outputs, has_ending, read_pair, read_truth, write_bytes};
use crate::limits::{OutOfRange, within};

/// Why there is no disparity map.
#[derive(Debug, thiserror::Error)]
pub enum MatchCliError {
    /// `--engine`
    #[error(transparent)]
    Engine(#[from] UnknownEngine),
    /// Another option.
    #[error(transparent)]
    Option(#[from] OptionError),
    /// `--max-disparity`, of any picture.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// `--max-disparity`, of these pictures.
    #[error("--max-disparity must be below the pictures' width, {width_px} px, not {max_disparity_px} px")]
    MaxDisparity {
        /// What was asked for.
        max_disparity_px: f64,
        /// Width of the pictures.
        width_px: u32,
    },
    /// A file.
    #[error(transparent)]
    File(#[from] FileError),
    /// The pictures themselves.
    #[error(transparent)]
    Match(#[from] MatchError),
    /// `--truth`
    #[error(transparent)]
    Truth(#[from] SizeError),
}

/// The result, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MatchReport {
    /// The engine.
    pub engine: &'static str,
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// Disparities searched, after rounding up to what the engine takes; matches beyond what was asked for are dropped.
    pub disparities: u32,
    /// Side of the window, pixels.
    pub window_px: u32,
    /// Pixels with a match: each becomes a point in space (fig. 4-24).
    pub points: usize,
    /// Share of the pixels with a match, 0 to 1.
    pub density: f64,
    /// Processor time of matching, all threads, milliseconds; absent where the system does not tell.
    pub cpu_ms: Option<f64>,
    /// Time of matching, milliseconds.
    pub wall_ms: f64,
    /// The comparison with the truth, where one was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub truth: Option<TruthReport>,
    /// What makes the result doubtful; mostly empty.
    pub warnings: Vec<String>,
}

/// A disparity map against its truth, as `--json` prints it; shares are 0 to 1, and null where nothing was matched.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TruthReport {
    /// Pixels whose true disparity is known.
    pub known: usize,
    /// Share of these that were matched.
    pub density: f64,
    /// Share of the matched ones that are off by more than 1 px.
    pub bad1: f64,
    /// Share of the matched ones that are off by more than 2 px.
    pub bad2: f64,
    /// Mean absolute error of the matched ones, pixels.
    pub mean_error_px: f64,
}

impl From<Score> for TruthReport {
    fn from(score: Score) -> Self {
        let Score { known, density, bad1, bad2, mean_error_px } = score;
        Self { known, density, bad1, bad2, mean_error_px }
    }
}

/// Matches a rectified pair and writes the disparity of the left picture: PFM (NaN where there is no match) or colour PNG,
/// by the name of `out`.
///
/// # Errors
/// [`MatchCliError`]: one line that says which file or what number is at fault.
pub fn match_pair(
    left: &Path,
    right: &Path,
    max_disparity_px: f64,
    engine: &str,
    options: &MatchOptions,
    out: &Path,
) -> Result<MatchReport, MatchCliError> {
    let engine: Engine = engine.parse()?;
    let mut matcher = options.matcher(engine)?;
    within("--max-disparity", max_disparity_px, 1.0, f64::from(Image::SIDE_PX_MAX), " px")?;
    let inputs = [("--left", Some(left)), ("--right", Some(right)), ("--truth", options.truth.as_deref())];
    let inputs = inputs.into_iter().filter_map(|(option, path)| Some((option, path?)));
    check_outputs(inputs, &[Output::file("--out", out, &["pfm", "png"])]).map_err(FileError::from)?;
    let as_png = has_ending(out, &["png"]);
    let paths = [left, right];
    let (left, right) = read_pair(left, right)?;
    let width_px = left.width_px();
    if max_disparity_px >= f64::from(width_px) {
        return Err(MatchCliError::MaxDisparity { max_disparity_px, width_px });
    }
    let truth = options.truth.as_deref().map(|path| read_truth(path, options.truth_scale_px)).transpose()?;
    if let Some(truth) = &truth {
        // Before the work, not after it.
        let mut blank = Disparity::default();
        blank.reset(width_px, left.height_px());
        score(&blank, truth)?;
    }
    // Rounded up where the sum is no multiple of 16; still below the width, which the check above leaves room for.
    let range = DisparityRange { min_px: 0, max_px: (max_disparity_px.ceil() as u32).min(width_px - 1) };
    let (disparity, Spent { cpu_ms, wall_ms }) = spent(|| match_images(matcher.as_mut(), &left, &right, range));
    let mut disparity = disparity?;
    keep_up_to(&mut disparity, max_disparity_px);
    let mut warnings = Vec::new();
    if let Some(blank) = without_texture([(paths[0], &left), (paths[1], &right)]) {
        disparity.reset(width_px, left.height_px());
        warnings.push(format!("no texture in {}: there is nothing to match", blank.display()));
    }
    let truth = truth.map(|truth| score(&disparity, &truth)).transpose()?.map(TruthReport::from);
    let bytes = if as_png { colour::encode_png(&disparity).map_err(MatchError::from)? } else { pfm::encode(&disparity) };
    write_bytes(out, &bytes)?;
    Ok(MatchReport {
        engine: engine.name(),
        width_px,
        height_px: disparity.height_px,
        disparities: engine.disparities(range),
        window_px: options.window_px(engine),
        points: disparity.matched(),
        density: disparity.density(),
        cpu_ms,
        wall_ms,
        truth,
        warnings,
    })
}

/// Drops what an engine found beyond the range that was asked for: OpenCV's search multiples of 16.
fn keep_up_to(disparity: &mut Disparity, max_px: f64) {
    for value in disparity.values_px.iter_mut().filter(|value| f64::from(**value) > max_px) {
        *value = f32::NAN;
    }
}
