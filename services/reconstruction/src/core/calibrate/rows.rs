//! What a calibration says about rows: the rectification that it implies, and how well corners keep to their row in it.

use halcyon_model::camera_info::CameraInfo;
use halcyon_model::{CameraIntrinsics, RigCalibration};
use nalgebra::{Matrix3, Matrix3x4, Vector2};
use opencv::Result;
use opencv::core::{Mat, MatTraitConstManual};

use super::CalibrateError;
use super::sighting::{Side, Sighting};
use crate::core::{camera, cv};

/// Vertical disparity that rectification leaves, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowError {
    /// Root mean square.
    pub rms_px: f64,
    /// Largest.
    pub max_px: f64,
}

/// The calibration as ROS keeps it: each camera with its rectification (Bouguet's, by OpenCV, without pixels that neither saw).
///
/// # Errors
/// [`CalibrateError::OpenCv`] where OpenCV refuses the rig.
pub fn camera_infos(rig: &RigCalibration) -> std::result::Result<[CameraInfo; 2], CalibrateError> {
    let found = cv::rectification(rig, cv::View::OnlySeen)?;
    let info = |intrinsics: CameraIntrinsics, rotation: &Mat, projection: &Mat| -> Result<CameraInfo> {
        Ok(CameraInfo {
            width_px: rig.width_px,
            height_px: rig.height_px,
            intrinsics,
            rectified_from_camera: cv::matrix3_from_mat(rotation)?,
            projection: Matrix3x4::from_row_slice(projection.data_typed::<f64>()?),
        })
    };
    Ok([
        info(rig.left, &found.left_rotation, &found.left_projection)?,
        info(rig.right, &found.right_rotation, &found.right_projection)?,
    ])
}

/// Distance across rows between the same corner left and right after rectification. NaN where no corner was seen on both sides.
pub(super) fn row_error(rig: &RigCalibration, sightings: &[Sighting]) -> std::result::Result<RowError, CalibrateError> {
    let infos = camera_infos(rig)?;
    // A rig whose cameras sit one above the other is rectified along columns.
    let across = usize::from(infos[1].projection[(0, 3)] != 0.0);
    let (mut sum, mut count, mut max_px) = (0.0, 0_usize, 0.0_f64);
    for sighting in sightings.iter().filter(|sighting| sighting.is_used()) {
        for corner in sighting.kept_in_both() {
            let [left, right] = Side::BOTH.map(|side| rectified(&infos[side as usize], sighting.pixel(side, corner)));
            let Some((left, right)) = left.zip(right) else { continue };
            let error_px = left[across] - right[across];
            sum += error_px * error_px;
            count += 1;
            max_px = max_px.max(error_px.abs());
        }
    }
    Ok(RowError { rms_px: (sum / count as f64).sqrt(), max_px })
}

/// Where a pixel comes to lie.
fn rectified(info: &CameraInfo, pixel: Vector2<f64>) -> Option<Vector2<f64>> {
    let ray = info.rectified_from_camera * camera::unproject(&info.intrinsics, pixel)?;
    let matrix: Matrix3<f64> = info.projection.fixed_columns::<3>(0).into_owned();
    let seen = matrix * ray;
    (seen.z > 0.0).then(|| Vector2::new(seen.x / seen.z, seen.y / seen.z))
}
