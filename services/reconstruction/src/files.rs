//! Pictures and disparity maps on disk, for the command line; the service itself touches no file.
//!
//! Decoders are lenient where we are not: a truncated JPEG decodes to a grey lower half with a remark on stderr. So the
//! container is checked first, byte by byte, and only whole files reach a decoder.

use std::path::{Path, PathBuf};

use halcyon_model::Image;
use halcyon_model::stereo::ImageError;
use opencv::core::{MatTraitConst, MatTraitConstManual};
use opencv::{imgcodecs, imgproc};

mod container;
mod glob;
mod rig;

pub use container::PictureKind;
use container::check;
pub use glob::{GlobError, glob};
pub use rig::{RigFileError, read_rig};

/// Larger files are no pictures of a stereo rig.
const FILE_BYTES_MAX: u64 = 512 << 20;
/// A decoder allocates what the header says: refuse a header that says too much.
const PIXELS_MAX: u64 = 128 << 20;

/// Why a picture could not be read or a result not written.
#[derive(Debug, thiserror::Error)]
pub enum FileError {
    /// The operating system refused.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// The operating system refused.
    #[error("cannot write {}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// Larger than any picture.
    #[error("{} has {bytes} bytes, at most {FILE_BYTES_MAX} are read", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
        /// Its size.
        bytes: u64,
    },
    /// Neither JPEG nor PNG nor PNM, whatever its name says.
    #[error("{} is not a JPEG, PNG, PGM or PPM picture", path.display())]
    NotAPicture {
        /// The file.
        path: PathBuf,
    },
    /// Starts as a picture, but is not whole.
    #[error("{} is a damaged {kind}: {why}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What it starts as.
        kind: &'static str,
        /// What is wrong with it.
        why: String,
    },
    /// More than eight bits a channel.
    #[error("{} has {bits} bits a channel: convert it to 8", path.display())]
    Depth {
        /// The file.
        path: PathBuf,
        /// Bits a channel.
        bits: u32,
    },
    /// Sides out of range.
    #[error("{} is too large", path.display())]
    Size {
        /// The file.
        path: PathBuf,
        /// The sides.
        #[source]
        source: ImageError,
    },
    /// The name of an output says no format that we write.
    #[error("{}: the name must end in {expected}", path.display())]
    Extension {
        /// The file.
        path: PathBuf,
        /// What it may end in.
        expected: &'static str,
    },
}

/// Reads a picture as 8-bit grey; colour is converted with the usual weights (ITU-R BT.601). EXIF orientation is not applied:
/// a calibration belongs to the sensor's own rows and columns.
///
/// # Errors
/// [`FileError`] for a file that is missing, too large, not a picture, damaged, or of more than 8 bits.
pub fn read_picture(path: &Path) -> Result<Image, FileError> {
    decode_picture(path, &read_bytes(path)?)
}

/// All bytes of a file of sane size.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    let read = |source| FileError::Read { path: path.into(), source };
    let metadata = std::fs::metadata(path).map_err(read)?;
    if metadata.is_dir() {
        return Err(read(std::io::Error::from(std::io::ErrorKind::IsADirectory)));
    }
    if metadata.len() > FILE_BYTES_MAX {
        return Err(FileError::TooLarge { path: path.into(), bytes: metadata.len() });
    }
    std::fs::read(path).map_err(read)
}

/// Writes a result as a whole: into a file beside it first, so that a full disk leaves no half result under the name.
pub(crate) fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    let write = |source| FileError::Write { path: path.into(), source };
    let name = path.file_name().ok_or_else(|| write(std::io::Error::from(std::io::ErrorKind::InvalidInput)))?;
    if path.is_dir() {
        return Err(write(std::io::Error::from(std::io::ErrorKind::IsADirectory)));
    }
    // A device or a pipe is written as it is; there is nothing to rename over it.
    if path.exists() && !path.is_file() {
        return std::fs::write(path, bytes).map_err(write);
    }
    let mut partial = name.to_owned();
    partial.push(format!(".{}.partial", std::process::id()));
    let partial = path.with_file_name(partial);
    let done = std::fs::write(&partial, bytes).and_then(|()| std::fs::rename(&partial, path));
    if done.is_err() {
        // Best effort: what matters is the first error.
        let _ = std::fs::remove_file(&partial);
    }
    done.map_err(write)
}

fn decode_picture(path: &Path, bytes: &[u8]) -> Result<Image, FileError> {
    let damaged = |kind: PictureKind, why: String| FileError::Damaged { path: path.into(), kind: kind.name(), why };
    let kind = PictureKind::of(bytes).ok_or_else(|| FileError::NotAPicture { path: path.into() })?;
    let header = check(kind, bytes).map_err(|why| damaged(kind, why))?;
    if header.bits > 8 {
        return Err(FileError::Depth { path: path.into(), bits: header.bits });
    }
    if u64::from(header.width_px) * u64::from(header.height_px) > PIXELS_MAX {
        return Err(damaged(kind, format!("its header claims {} x {} px", header.width_px, header.height_px)));
    }
    let grey = decode_grey(bytes).map_err(|error| damaged(kind, error.message))?;
    let Some((width_px, height_px, pixels)) = grey else { return Err(damaged(kind, "it does not decode".into())) };
    Image::new(width_px, height_px, pixels.into()).map_err(|source| FileError::Size { path: path.into(), source })
}

/// Width, height and grey pixels; `None` where the decoder gives up.
fn decode_grey(bytes: &[u8]) -> opencv::Result<Option<(u32, u32, Vec<u8>)>> {
    let encoded = opencv::core::Mat::from_slice(bytes)?;
    let decoded = imgcodecs::imdecode(&encoded, imgcodecs::IMREAD_UNCHANGED)?;
    if decoded.empty() || decoded.depth() != opencv::core::CV_8U {
        return Ok(None);
    }
    let code = match decoded.channels() {
        1 => None,
        3 => Some(imgproc::COLOR_BGR2GRAY),
        4 => Some(imgproc::COLOR_BGRA2GRAY),
        _ => return Ok(None),
    };
    let mut grey = opencv::core::Mat::default();
    match code {
        Some(code) => imgproc::cvt_color_def(&decoded, &mut grey, code)?,
        None => grey = decoded,
    }
    Ok(Some((grey.cols() as u32, grey.rows() as u32, grey.data_bytes()?.to_vec())))
}
