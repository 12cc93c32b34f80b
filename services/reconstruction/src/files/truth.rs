//! Known disparities on disk: PFM, or grey levels that stand for pixels.

use std::path::Path;

use super::grey::Samples;
use super::{FileError, decode_picture, read_bytes};
use crate::core::disparity::{Disparity, pfm};

/// Reads a known disparity map. In a PFM, infinity and NaN stand for "not known" and `scale_px` is not used; in a picture 0
/// does, and any other grey level (of 8 or 16 bits, as stored) times `scale_px` is the disparity: 1 for the aloe pair, 1/256 for KITTI.
///
/// # Errors
/// [`FileError`] for a file that is missing, too large, damaged, or neither PFM nor picture.
pub fn read_truth(path: &Path, scale_px: f32) -> Result<Disparity, FileError> {
    let bytes = read_bytes(path)?;
    if bytes.starts_with(b"Pf") || bytes.starts_with(b"PF") {
        return pfm::decode(&bytes).map_err(|source| FileError::Pfm { path: path.into(), source });
    }
    let grey = decode_picture(path, &bytes)?;
    let pixel = |level: f32| if level > 0.0 { level * scale_px } else { f32::NAN };
    let values_px = match grey.samples {
        Samples::Eight(levels) => levels.into_iter().map(|level| pixel(level.into())).collect(),
        Samples::Sixteen(levels) => levels.into_iter().map(|level| pixel(level.into())).collect(),
    };
    Ok(Disparity { width_px: grey.width_px, height_px: grey.height_px, values_px })
}
