//! A rig's calibration on disk.

use std::path::{Path, PathBuf};

use halcyon_model::RigCalibration;
use halcyon_model::rig_yaml::{self, RigYamlError};

use super::{FileError, read_bytes};

/// Why a calibration could not be read.
#[derive(Debug, thiserror::Error)]
pub enum RigFileError {
    /// The file.
    #[error(transparent)]
    File(#[from] FileError),
    /// Not text, or far too much of it.
    #[error("{} is no calibration: it is not a text of at most {} kB", path.display(), rig_yaml::TEXT_BYTES_MAX / 1024)]
    NotText {
        /// The file.
        path: PathBuf,
    },
    /// Its contents.
    #[error("{}", path.display())]
    Contents {
        /// The file.
        path: PathBuf,
        /// What is wrong, with the line.
        #[source]
        source: RigYamlError,
    },
}

/// Reads an OpenCV YAML calibration (see [`rig_yaml`]).
///
/// # Errors
/// [`RigFileError`], naming the file and the line.
pub fn read_rig(path: &Path) -> Result<RigCalibration, RigFileError> {
    let bytes = read_bytes(path)?;
    let not_text = || RigFileError::NotText { path: path.into() };
    if bytes.len() > rig_yaml::TEXT_BYTES_MAX {
        return Err(not_text());
    }
    let text = String::from_utf8(bytes).map_err(|_| not_text())?;
    rig_yaml::parse(&text).map_err(|source| RigFileError::Contents { path: path.into(), source })
}
