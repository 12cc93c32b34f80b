//! A rig's calibration on disk: OpenCV's YAML in one file, or ROS's camera_info in two.

use std::path::{Path, PathBuf};

use halcyon_model::RigCalibration;
use halcyon_model::camera_info::{self, CameraInfo};
use halcyon_model::rig_yaml::{self, RigYamlError};

use super::{FileError, read_bytes, write_bytes};

/// Names of ROS's two files in their folder.
const ROS_FILES: [&str; 2] = ["left.yaml", "right.yaml"];

/// Why there is no rig.
#[derive(Debug, thiserror::Error)]
pub enum RigFileError {
    /// The file.
    #[error(transparent)]
    File(#[from] FileError),
    /// What is in it.
    #[error("{} is no calibration", path.display())]
    Content {
        /// The file, or the folder of the two.
        path: PathBuf,
        /// What is wrong.
        #[source]
        source: RigYamlError,
    },
}

/// Reads a rig: `path` is an OpenCV YAML file, or a folder with ROS's `left.yaml` and `right.yaml`.
///
/// # Errors
/// [`RigFileError`], naming the file, the line and the key.
pub fn read_rig(path: &Path) -> Result<RigCalibration, RigFileError> {
    if path.is_dir() {
        let read = |name: &str| -> Result<CameraInfo, RigFileError> {
            let file = path.join(name);
            camera_info::parse(&text(&file)?).map_err(|source| RigFileError::Content { path: file, source })
        };
        let (left, right) = (read(ROS_FILES[0])?, read(ROS_FILES[1])?);
        return camera_info::rig(&left, &right).map_err(|source| RigFileError::Content { path: path.into(), source });
    }
    rig_yaml::parse(&text(path)?).map_err(|source| RigFileError::Content { path: path.into(), source })
}

/// Writes a rig as OpenCV's YAML.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_rig(path: &Path, rig: &RigCalibration) -> Result<(), FileError> {
    write_bytes(path, rig_yaml::write(rig).as_bytes())
}

/// Writes both cameras as ROS's camera_info into a folder, which is made where it isn't there.
///
/// # Errors
/// [`FileError::Write`].
pub fn write_ros(folder: &Path, infos: &[CameraInfo; 2]) -> Result<(), FileError> {
    std::fs::create_dir_all(folder).map_err(|source| FileError::Write { path: folder.into(), source })?;
    for ((file, name), info) in ROS_FILES.into_iter().zip(["left", "right"]).zip(infos) {
        write_bytes(&folder.join(file), camera_info::write(name, info).as_bytes())?;
    }
    Ok(())
}

/// Bytes that are no UTF-8 are no calibration either: they come out as a syntax error with its line.
fn text(path: &Path) -> Result<String, FileError> {
    Ok(String::from_utf8_lossy(&read_bytes(path)?).into_owned())
}
