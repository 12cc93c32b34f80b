use halcyon_model::{
    CameraIntrinsics, ElevationGrid, Image, Plane, PoseAtExposure, Preview, RigCalibration, StereoPair, SurfacePatch,
};
use nalgebra::Matrix3;

use super::geo::{rotation_from, rotation_to, vector_from, vector_to};
use crate::field::{FieldError, finite, fraction, header, id, non_negative, numbers, optional, optionally, positive, required};
use crate::{SCHEMA_VERSION, Wire, v1};

fn image_to(image: &Image) -> v1::Image {
    v1::Image { width_px: image.width_px(), height_px: image.height_px(), pixels: image.pixels().clone() }
}

fn image_from(proto: v1::Image) -> Result<Image, FieldError> {
    Image::new(proto.width_px, proto.height_px, proto.pixels).map_err(|error| FieldError::new("pixels", error.to_string()))
}

fn camera_to(camera: &CameraIntrinsics) -> v1::CameraIntrinsics {
    let CameraIntrinsics { fx_px, fy_px, cx_px, cy_px, distortion } = *camera;
    v1::CameraIntrinsics { fx_px, fy_px, cx_px, cy_px, distortion: distortion.to_vec() }
}

fn camera_from(proto: &v1::CameraIntrinsics) -> Result<CameraIntrinsics, FieldError> {
    Ok(CameraIntrinsics {
        fx_px: positive("fx_px", proto.fx_px)?,
        fy_px: positive("fy_px", proto.fy_px)?,
        cx_px: finite("cx_px", proto.cx_px)?,
        cy_px: finite("cy_px", proto.cy_px)?,
        distortion: numbers("distortion", &proto.distortion)?,
    })
}

fn matrix_to(matrix: &Matrix3<f64>) -> Vec<f64> {
    matrix.transpose().as_slice().to_vec()
}

/// A rotation: nine numbers, row-major, orthonormal within 1e-3, determinant +1.
fn rotation_matrix_from(path: &str, values: &[f64]) -> Result<Matrix3<f64>, FieldError> {
    let matrix = Matrix3::from_row_slice(&numbers::<9>(path, values)?);
    let off = (matrix * matrix.transpose() - Matrix3::identity()).abs().max();
    if off < 1e-3 && matrix.determinant() > 0.0 { Ok(matrix) } else { Err(FieldError::new(path, "is not a rotation")) }
}

fn calibration_to(rig: &RigCalibration) -> v1::RigCalibration {
    v1::RigCalibration {
        width_px: rig.width_px,
        height_px: rig.height_px,
        left: Some(camera_to(&rig.left)),
        right: Some(camera_to(&rig.right)),
        right_from_left: matrix_to(&rig.right_from_left),
        right_from_left_m: Some(vector_to(&rig.right_from_left_m)),
        body_from_camera: matrix_to(&rig.body_from_camera),
        camera_in_body_m: Some(vector_to(&rig.camera_in_body_m)),
    }
}

fn calibration_from(proto: v1::RigCalibration) -> Result<RigCalibration, FieldError> {
    let rig = RigCalibration {
        width_px: proto.width_px,
        height_px: proto.height_px,
        left: required("left", proto.left, |camera| camera_from(&camera))?,
        right: required("right", proto.right, |camera| camera_from(&camera))?,
        right_from_left: rotation_matrix_from("right_from_left", &proto.right_from_left)?,
        right_from_left_m: required("right_from_left_m", proto.right_from_left_m, vector_from)?,
        body_from_camera: rotation_matrix_from("body_from_camera", &proto.body_from_camera)?,
        camera_in_body_m: required("camera_in_body_m", proto.camera_in_body_m, vector_from)?,
    };
    positive("right_from_left_m", rig.baseline_m())?;
    Ok(rig)
}

fn pose_to(pose: &PoseAtExposure) -> v1::PoseAtExposure {
    v1::PoseAtExposure {
        position_ned_m: Some(vector_to(&pose.position_ned_m)),
        ned_from_body: Some(rotation_to(&pose.ned_from_body)),
        height_sigma_m: pose.height_sigma_m,
        attitude_sigma_rad: pose.attitude_sigma_rad,
    }
}

fn pose_from(proto: v1::PoseAtExposure) -> Result<PoseAtExposure, FieldError> {
    Ok(PoseAtExposure {
        position_ned_m: required("position_ned_m", proto.position_ned_m, vector_from)?,
        ned_from_body: required("ned_from_body", proto.ned_from_body, rotation_from)?,
        height_sigma_m: non_negative("height_sigma_m", proto.height_sigma_m)?,
        attitude_sigma_rad: non_negative("attitude_sigma_rad", proto.attitude_sigma_rad)?,
    })
}

impl Wire for StereoPair {
    const NAME: &'static str = "StereoPair";
    type Proto = v1::StereoPair;

    fn to_proto(&self) -> Self::Proto {
        v1::StereoPair {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            rig_id: self.rig.to_string(),
            sequence: self.sequence,
            left: Some(image_to(&self.left)),
            right: Some(image_to(&self.right)),
            exposure_s: self.exposure_s,
            calibration: Some(calibration_to(&self.calibration)),
            pose: self.pose.as_ref().map(pose_to),
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        let pair = Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            rig: id("rig_id", &proto.rig_id)?,
            sequence: proto.sequence,
            left: required("left", proto.left, image_from)?,
            right: required("right", proto.right, image_from)?,
            exposure_s: non_negative("exposure_s", proto.exposure_s)?,
            calibration: required("calibration", proto.calibration, calibration_from)?,
            pose: optional("pose", proto.pose, pose_from)?,
        };
        let size = (pair.calibration.width_px, pair.calibration.height_px);
        for (path, image) in [("left", &pair.left), ("right", &pair.right)] {
            if (image.width_px(), image.height_px()) != size {
                return Err(FieldError::new(
                    path,
                    format!("is {image:?}, but the rig is calibrated for {} x {} px", size.0, size.1),
                ));
            }
        }
        Ok(pair)
    }
}

fn plane_from(proto: v1::Plane) -> Result<Plane, FieldError> {
    let plane = Plane {
        normal: required("normal", proto.normal, vector_from)?,
        distance_m: positive("distance_m", proto.distance_m)?,
        rms_m: non_negative("rms_m", proto.rms_m)?,
    };
    if (plane.normal.norm() - 1.0).abs() > 1e-3 {
        return Err(FieldError::new("normal", "is not of unit length"));
    }
    Ok(plane)
}

fn grid_from(proto: v1::ElevationGrid) -> Result<ElevationGrid, FieldError> {
    /// Far more than any patch needs; keeps a hostile size from overflowing or exhausting memory.
    const CELLS_MAX: u64 = 4_000_000;
    let cells = u64::from(proto.rows) * u64::from(proto.cols);
    if cells == 0 || cells > CELLS_MAX {
        return Err(FieldError::new("rows", format!("x cols must be 1 to {CELLS_MAX} cells, not {cells}")));
    }
    for (path, values) in [("elevation_m", &proto.elevation_m), ("sigma_m", &proto.sigma_m)] {
        if values.len() as u64 != cells {
            return Err(FieldError::new(path, format!("must hold rows x cols = {cells} numbers, not {}", values.len())));
        }
        if values.iter().any(|value| value.is_infinite()) {
            return Err(FieldError::new(path, "holds an infinite number"));
        }
    }
    if proto.sigma_m.iter().any(|&sigma_m| sigma_m < 0.0) {
        return Err(FieldError::new("sigma_m", "holds a negative number"));
    }
    Ok(ElevationGrid {
        south_west_north_m: finite("south_west_north_m", proto.south_west_north_m)?,
        south_west_east_m: finite("south_west_east_m", proto.south_west_east_m)?,
        cell_m: positive("cell_m", proto.cell_m)?,
        rows: proto.rows,
        cols: proto.cols,
        elevation_m: proto.elevation_m,
        sigma_m: proto.sigma_m,
    })
}

impl Wire for SurfacePatch {
    const NAME: &'static str = "SurfacePatch";
    type Proto = v1::SurfacePatch;

    fn to_proto(&self) -> Self::Proto {
        let grid = &self.grid;
        v1::SurfacePatch {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            rig_id: self.rig.to_string(),
            sequence: self.sequence,
            grid: Some(v1::ElevationGrid {
                south_west_north_m: grid.south_west_north_m,
                south_west_east_m: grid.south_west_east_m,
                cell_m: grid.cell_m,
                rows: grid.rows,
                cols: grid.cols,
                elevation_m: grid.elevation_m.clone(),
                sigma_m: grid.sigma_m.clone(),
            }),
            coverage: self.coverage,
            plane: Some(v1::Plane {
                normal: Some(vector_to(&self.plane.normal)),
                distance_m: self.plane.distance_m,
                rms_m: self.plane.rms_m,
            }),
            points: self.points,
            level_m: self.level_m,
            level_sigma_m: self.level_sigma_m,
            level_thesis_m: self.level_thesis_m,
            error_length_m: self.error_length_m,
            slope_removed_north: self.slope_removed[0],
            slope_removed_east: self.slope_removed[1],
            slope_sigma: self.slope_sigma,
            attitude_sigma_rad: self.attitude_sigma_rad,
            processing_s: self.processing_s,
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            rig: id("rig_id", &proto.rig_id)?,
            sequence: proto.sequence,
            grid: required("grid", proto.grid, grid_from)?,
            coverage: fraction("coverage", proto.coverage)?,
            plane: required("plane", proto.plane, plane_from)?,
            points: proto.points,
            level_m: optionally("level_m", proto.level_m, finite)?,
            level_sigma_m: optionally("level_sigma_m", proto.level_sigma_m, non_negative)?,
            level_thesis_m: optionally("level_thesis_m", proto.level_thesis_m, finite)?,
            error_length_m: non_negative("error_length_m", proto.error_length_m)?,
            slope_removed: [
                finite("slope_removed_north", proto.slope_removed_north)?,
                finite("slope_removed_east", proto.slope_removed_east)?,
            ],
            slope_sigma: non_negative("slope_sigma", proto.slope_sigma)?,
            attitude_sigma_rad: non_negative("attitude_sigma_rad", proto.attitude_sigma_rad)?,
            processing_s: non_negative("processing_s", proto.processing_s)?,
        })
    }
}

impl Wire for Preview {
    const NAME: &'static str = "Preview";
    type Proto = v1::Preview;

    fn to_proto(&self) -> Self::Proto {
        v1::Preview {
            schema_version: SCHEMA_VERSION,
            stamp_ns: self.stamp.as_nanos(),
            rig_id: self.rig.to_string(),
            left_jpeg: self.left_jpeg.clone(),
            disparity_png: self.disparity_png.clone(),
        }
    }

    fn from_proto(proto: Self::Proto) -> Result<Self, FieldError> {
        Ok(Self {
            stamp: header(proto.schema_version, proto.stamp_ns)?,
            rig: id("rig_id", &proto.rig_id)?,
            left_jpeg: proto.left_jpeg,
            disparity_png: proto.disparity_png,
        })
    }
}
