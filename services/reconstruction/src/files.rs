//! Pictures and disparity maps on disk, for the command line; the service itself touches no file.
//!
//! Decoders are lenient where we are not: a truncated JPEG decodes to a grey lower half with a remark on stderr. So every file is
//! walked first, byte by byte, and only whole ones reach a decoder. JPEG, PNG and PNM are read: colour becomes luma (ITU-R
//! BT.601), more than 8 bits are scaled by the rule of [`Grey`], and whatever else a file may be is an error that says so.

use std::io::Read as _;
use std::path::{Path, PathBuf};

use halcyon_model::Image;
use halcyon_model::stereo::ImageError;

use crate::core::disparity::pfm::PfmError;

mod container;
mod decode;
mod glob;
mod grey;
pub mod netcdf;
mod outputs;
pub mod ply;
mod pnm;
mod rig;
mod truth;

pub use container::PictureKind;
use container::Trouble;
pub use glob::{GlobError, glob};
pub use grey::{Grey, Samples};
pub use outputs::{Output, OutputError, check_outputs, has_ending};
pub use rig::{RigFileError, check_rig, read_rig, rig_files, write_rig, write_ros};
pub use truth::read_truth;

/// Larger files are no pictures of a stereo rig.
const FILE_BYTES_MAX: u64 = 512 << 20;

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
    #[error("{} has more than {FILE_BYTES_MAX} bytes, too many for a picture", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// A device, a pipe or a socket; reading it may never end.
    #[error("{} is a device or a pipe, not a file", path.display())]
    Device {
        /// The file.
        path: PathBuf,
    },
    /// No bytes.
    #[error("{} is empty", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// No picture, whatever its name says.
    #[error("{} is not a picture (JPEG, PNG, PBM, PGM and PPM are read)", path.display())]
    NotAPicture {
        /// The file.
        path: PathBuf,
    },
    /// Of a known format, or a sort of it, that is not read.
    #[error("{} is a {format}, which is not read: convert it to a plain PNG", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The format.
        format: String,
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
    /// Starts as a PFM.
    #[error("{} is a damaged PFM", path.display())]
    Pfm {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        #[source]
        source: PfmError,
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
    /// An output that must not be written, found out before the work.
    #[error(transparent)]
    Output(OutputError),
}

/// Reads a picture as 8-bit grey. EXIF orientation is not applied: a calibration belongs to the sensor's own rows and columns.
///
/// # Errors
/// [`FileError`] for a file that is missing, too large, damaged, not a picture, or of a sort that is not read.
pub fn read_picture(path: &Path) -> Result<Image, FileError> {
    let grey = read_grey(path)?;
    let white = grey.white();
    into_image(path, grey, white)
}

/// Reads both pictures of a pair as 8-bit grey; of 16-bit pictures, both on the same scale.
///
/// # Errors
/// As [`read_picture`].
pub fn read_pair(left: &Path, right: &Path) -> Result<(Image, Image), FileError> {
    let (left_grey, right_grey) = (read_grey(left)?, read_grey(right)?);
    let is_deep = |grey: &Grey| matches!(grey.samples, Samples::Sixteen(_));
    let (mut left_white, mut right_white) = (left_grey.white(), right_grey.white());
    if is_deep(&left_grey) && is_deep(&right_grey) {
        (left_white, right_white) = (left_white.max(right_white), left_white.max(right_white));
    }
    Ok((into_image(left, left_grey, left_white)?, into_image(right, right_grey, right_white)?))
}

/// Reads a picture's grey levels as they are, of 8 or of 16 bits.
///
/// # Errors
/// As [`read_picture`].
pub fn read_grey(path: &Path) -> Result<Grey, FileError> {
    decode_picture(path, &read_bytes(path)?)
}

fn into_image(path: &Path, grey: Grey, white: u16) -> Result<Image, FileError> {
    grey.into_image(white).map_err(|source| FileError::Size { path: path.into(), source })
}

/// All bytes of a file of sane size.
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    let read = |source| FileError::Read { path: path.into(), source };
    let kind = std::fs::metadata(path).map_err(read)?.file_type();
    if kind.is_dir() {
        return Err(read(std::io::Error::from(std::io::ErrorKind::IsADirectory)));
    }
    // Asked before it is opened: opening a pipe that nobody writes to never ends.
    if !kind.is_file() {
        return Err(FileError::Device { path: path.into() });
    }
    let mut bytes = Vec::new();
    std::fs::File::open(path).map_err(read)?.take(FILE_BYTES_MAX + 1).read_to_end(&mut bytes).map_err(read)?;
    match bytes.len() as u64 {
        0 => Err(FileError::Empty { path: path.into() }),
        length if length > FILE_BYTES_MAX => Err(FileError::TooLarge { path: path.into() }),
        _ => Ok(bytes),
    }
}

/// Writes a result as a whole: under a temporary name beside it first, so that neither a full disk nor a crash leaves half a result
/// under its name. A device or a pipe is written as it is.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), FileError> {
    if path.exists() && !path.is_file() && !path.is_dir() {
        return std::fs::write(path, bytes).map_err(|source| FileError::Write { path: path.into(), source });
    }
    write_whole(path, |partial| std::fs::write(partial, bytes))
}

/// Lets `write` make a file under a temporary name beside `path`, then renames it: neither a full disk nor a crash leaves half a
/// result under the name.
pub(crate) fn write_whole(path: &Path, write: impl FnOnce(&Path) -> std::io::Result<()>) -> Result<(), FileError> {
    let failed = |source| FileError::Write { path: path.into(), source };
    let name = path.file_name().ok_or_else(|| failed(std::io::Error::from(std::io::ErrorKind::InvalidInput)))?;
    if path.is_dir() {
        return Err(failed(std::io::Error::from(std::io::ErrorKind::IsADirectory)));
    }
    // There is nothing to rename over a device or a pipe.
    if path.exists() && !path.is_file() {
        return Err(failed(std::io::Error::from(std::io::ErrorKind::InvalidInput)));
    }
    let mut partial = name.to_owned();
    partial.push(format!(".{}.partial", std::process::id()));
    let partial = path.with_file_name(partial);
    let done = write(&partial).and_then(|()| std::fs::rename(&partial, path));
    if done.is_err() {
        // Best effort: what matters is the first error.
        let _ = std::fs::remove_file(&partial);
    }
    done.map_err(failed)
}

fn decode_picture(path: &Path, bytes: &[u8]) -> Result<Grey, FileError> {
    let Some(kind) = PictureKind::of(bytes) else {
        return Err(match container::foreign(bytes) {
            Some(format) => FileError::Unsupported { path: path.into(), format: format.into() },
            None => FileError::NotAPicture { path: path.into() },
        });
    };
    let damaged = |why| FileError::Damaged { path: path.into(), kind: kind.name(), why };
    decode::decode(kind, bytes).map_err(|trouble| match trouble {
        Trouble::Truncated => damaged("it is truncated".into()),
        Trouble::Damaged(why) => damaged(why),
        Trouble::Unsupported(sort) => FileError::Unsupported { path: path.into(), format: format!("{} {sort}", kind.name()) },
    })
}
