//! `halcyon match`

use std::path::Path;
use std::time::Instant;

use serde::Serialize;

use crate::core::disparity::{colour, pfm};
use crate::core::matcher::{DisparityRange, Engine, MatchError, UnknownEngine, match_images};
use crate::files::{FileError, read_picture, write_bytes};

/// Why there is no disparity map.
#[derive(Debug, thiserror::Error)]
pub enum MatchCliError {
    /// `--engine`
    #[error(transparent)]
    Engine(#[from] UnknownEngine),
    /// `--max-disparity`
    #[error("the largest disparity must be at least 1 and below the pictures' width, {width_px} px, not {max_disparity_px}")]
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
    /// Disparities searched, after rounding up to what the engine takes.
    pub disparities: u32,
    /// Share of the pixels with a match, 0 to 1.
    pub density: f64,
    /// Processor time of matching, all threads, milliseconds; absent where the system does not tell.
    pub cpu_ms: Option<f64>,
    /// Time of matching, milliseconds.
    pub wall_ms: f64,
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
    out: &Path,
) -> Result<MatchReport, MatchCliError> {
    let engine: Engine = engine.parse()?;
    let extension = out.extension().map(std::ffi::OsStr::to_ascii_lowercase);
    let as_png = match extension.as_deref().and_then(std::ffi::OsStr::to_str) {
        Some("pfm") => false,
        Some("png") => true,
        _ => return Err(FileError::Extension { path: out.into(), expected: ".pfm or .png" }.into()),
    };
    let (left, right) = (read_picture(left)?, read_picture(right)?);
    let width_px = left.width_px();
    // Negated so that NaN is refused, too.
    if !(max_disparity_px >= 1.0 && max_disparity_px < f64::from(width_px)) {
        return Err(MatchCliError::MaxDisparity { max_disparity_px, width_px });
    }
    // Rounded up where the sum is no multiple of 16; still below the width, which the check above leaves room for.
    let range = DisparityRange { min_px: 0, max_px: (max_disparity_px.ceil() as u32).min(width_px - 1) };
    let mut matcher = engine.matcher(engine.block_px_default());
    let (wall, cpu_s) = (Instant::now(), cpu_s());
    let disparity = match_images(matcher.as_mut(), &left, &right, range)?;
    let wall_ms = wall.elapsed().as_secs_f64() * 1e3;
    let cpu_ms = cpu_s.zip(self::cpu_s()).map(|(before_s, after_s)| (after_s - before_s) * 1e3);
    let bytes = if as_png { colour::encode_png(&disparity).map_err(MatchError::from)? } else { pfm::encode(&disparity) };
    write_bytes(out, &bytes)?;
    Ok(MatchReport {
        engine: engine.name(),
        width_px,
        height_px: disparity.height_px,
        disparities: range.count(),
        density: disparity.density(),
        cpu_ms,
        wall_ms,
    })
}

/// Processor time of this process so far, all threads, seconds, from Linux's `/proc` (in hundredths: `USER_HZ` is 100 on every
/// architecture that Linux and we run on).
pub(super) fn cpu_s() -> Option<f64> {
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program, in brackets, may contain anything; numbers follow the last bracket.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let ticks = fields.get(11)?.parse::<f64>().ok()? + fields.get(12)?.parse::<f64>().ok()?;
    Some(ticks / 100.0)
}
