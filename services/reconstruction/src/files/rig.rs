//! A rig's calibration on disk: OpenCV's YAML in one file, or ROS's camera_info in two.

use std::path::{Path, PathBuf};

use halcyon_model::RigCalibration;
use halcyon_model::camera_info::{self, CameraInfo};
use halcyon_model::rig_yaml::{self, RigYamlError};

use super::{FileError, read_bytes, write_bytes};
use crate::limits::{OutOfRange, within};

/// Names of ROS's two files in their folder.
pub(super) const ROS_FILES: [&str; 2] = ["left.yaml", "right.yaml"];

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
    /// Numbers that no rig has.
    #[error("{} is no calibration of a rig", path.display())]
    Impossible {
        /// The file, or the folder of the two.
        path: PathBuf,
        /// Which number.
        #[source]
        source: OutOfRange,
    },
}

/// A focal length of 0.05 to 100 widths of the picture: from wider than any fisheye to the longest lens.
const FOCAL_WIDTHS: [f64; 2] = [0.05, 100.0];
/// Between a stereo microscope and two ships, metres.
const BASELINE_M: [f64; 2] = [1e-3, 100.0];
/// A camera is not further from its carrier's middle, metres.
const MOUNT_M_MAX: f64 = 100.0;

/// Refuses what is a calibration by its form, but of no rig: a decimal point lost, millimetres for metres, or nonsense.
///
/// # Errors
/// [`OutOfRange`], naming the number and its unit.
pub fn check_rig(rig: &RigCalibration) -> Result<(), OutOfRange> {
    let within = |what, value: f64, [low, high]: [f64; 2], unit| within(what, value, low, high, unit);
    let (width_px, height_px) = (f64::from(rig.width_px), f64::from(rig.height_px));
    let focal_px = FOCAL_WIDTHS.map(|widths| (widths * width_px.max(height_px)).round());
    // The sensor may sit beside the axis, as in a lens that shifts, but not by more than its own side.
    let beside = |side_px: f64| [-side_px, 2.0 * side_px];
    for (names, camera) in [
        (["the left camera's fx", "the left camera's fy", "the left camera's cx", "the left camera's cy"], &rig.left),
        (["the right camera's fx", "the right camera's fy", "the right camera's cx", "the right camera's cy"], &rig.right),
    ] {
        within(names[0], camera.fx_px, focal_px, " px")?;
        within(names[1], camera.fy_px, focal_px, " px")?;
        within(names[2], camera.cx_px, beside(width_px), " px")?;
        within(names[3], camera.cy_px, beside(height_px), " px")?;
    }
    within("the baseline |T|", rig.baseline_m(), BASELINE_M, " m")?;
    within("the camera's place |camera_in_body_m|", rig.camera_in_body_m.norm(), [0.0, MOUNT_M_MAX], " m")
}

/// Reads a rig: `path` is an OpenCV YAML file, or a folder with ROS's `left.yaml` and `right.yaml`.
///
/// # Errors
/// [`RigFileError`], naming the file, the line and the key.
pub fn read_rig(path: &Path) -> Result<RigCalibration, RigFileError> {
    let rig = parse(path)?;
    check_rig(&rig).map_err(|source| RigFileError::Impossible { path: path.into(), source })?;
    Ok(rig)
}

fn parse(path: &Path) -> Result<RigCalibration, RigFileError> {
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

/// The files that [`read_rig`] reads.
#[must_use]
pub fn rig_files(path: &Path) -> Vec<PathBuf> {
    if path.is_dir() { ROS_FILES.map(|name| path.join(name)).to_vec() } else { vec![path.into()] }
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

#[cfg(test)]
mod tests {
    use halcyon_model::CameraIntrinsics;
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    #[test]
    fn a_rig_that_cannot_be_is_named_with_its_unit() {
        let camera = CameraIntrinsics { fx_px: 509.0, fy_px: 509.0, cx_px: 319.5, cy_px: 239.5, distortion: [0.0; 5] };
        let rig = RigCalibration {
            width_px: 640,
            height_px: 480,
            left: camera,
            right: camera,
            right_from_left: Matrix3::identity(),
            right_from_left_m: Vector3::new(-0.092, 0.0, 0.0),
            body_from_camera: RigCalibration::LOOKING_DOWN,
            camera_in_body_m: Vector3::zeros(),
        };
        assert_eq!(check_rig(&rig), Ok(()));
        let check = |change: &dyn Fn(&mut RigCalibration), expected: &str| {
            let mut rig = rig;
            change(&mut rig);
            let text = check_rig(&rig).unwrap_err().to_string();
            assert!(text.contains(expected), "{text}");
        };
        check(&|r| r.left.fx_px = 1e308, "left camera's fx must be 32 to 64000 px");
        check(&|r| r.right.fy_px = 1e-3, "right camera's fy");
        check(&|r| r.right.cx_px = f64::NAN, "right camera's cx must be -640 to 1280 px");
        check(&|r| r.left.cy_px = 1e6, "left camera's cy");
        check(&|r| r.right_from_left_m.x = -920.0, "the baseline |T| must be 0.001 to 100 m, not 920 m");
        check(&|r| r.right_from_left_m.x = -1e-9, "baseline");
        check(&|r| r.camera_in_body_m.z = f64::INFINITY, "camera_in_body_m");
    }
}
