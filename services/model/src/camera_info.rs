//! A camera's calibration as ROS keeps it: the `camera_info` YAML of `camera_calibration_parsers`, one file a camera.
//!
//! ROS stores no pose between two cameras: a rig is in the two files' rectifications R and projections P. A point X of a camera
//! is R X in rectified axes, which both cameras share but for the baseline b; the right file's P has −fx b in its fourth column
//! (REP 104: `Tx = -fx' * B`). So X₂ = R₂ᵀ (R₁ X₁ + (−b, 0, 0)), and nothing is lost on the way there and back, but for the mount
//! (`body_from_camera`, `camera_in_body_m`), for which ROS has no place here.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Matrix3x4, Vector3};

use crate::rig_yaml::{RigYamlError, TEXT_BYTES_MAX};
use crate::stereo::{CameraIntrinsics, RigCalibration};
use crate::yaml::Document;

/// What one `camera_info` file says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraInfo {
    /// Picture width, pixels.
    pub width_px: u32,
    /// Picture height, pixels.
    pub height_px: u32,
    /// The camera; `distortion_model` is `plumb_bob`.
    pub intrinsics: CameraIntrinsics,
    /// Rectified axes from the camera's own.
    pub rectified_from_camera: Matrix3<f64>,
    /// Rectified pixels from rectified axes; pixels, and pixels times metres in the fourth column.
    pub projection: Matrix3x4<f64>,
}

/// Reads one file.
///
/// # Errors
/// [`RigYamlError`], naming the line and the key; a distortion model other than `plumb_bob` (or `rational_polynomial` that uses
/// no more than five coefficients) is refused.
pub fn parse(text: &str) -> Result<CameraInfo, RigYamlError> {
    if text.len() > TEXT_BYTES_MAX {
        return Err(RigYamlError::TooLong { bytes: text.len() });
    }
    let document = Document::read(text)?;
    let side = |key| {
        let list = document.required(key)?;
        list.side_px().ok_or_else(|| list.value("must be a whole number of 1 to 16384 pixels"))
    };
    let (width_px, height_px) = (side("image_width")?, side("image_height")?);
    if !matches!(document.word("distortion_model")?, "plumb_bob" | "rational_polynomial") {
        return Err(document.defect("distortion_model", "must be plumb_bob (k1 k2 p1 p2 k3), which is what this models"));
    }
    let intrinsics = document.camera("camera_matrix", "distortion_coefficients")?;
    let rectified_from_camera = document.required("rectification_matrix")?.rotation()?;
    let list = document.required("projection_matrix")?;
    let projection = list.matrix3x4()?;
    let p = &projection;
    let plain = p[(0, 1)] == 0.0 && p[(1, 0)] == 0.0 && [p[(2, 0)], p[(2, 1)], p[(2, 2)], p[(2, 3)]] == [0.0, 0.0, 1.0, 0.0];
    if !plain || p[(0, 0)] <= 0.0 || p[(1, 1)] <= 0.0 {
        return Err(list.value("must be [fx 0 cx Tx; 0 fy cy Ty; 0 0 1 0] with positive focal lengths"));
    }
    Ok(CameraInfo { width_px, height_px, intrinsics, rectified_from_camera, projection })
}

/// Writes one file; [`parse`] gives back the very same numbers.
#[must_use]
pub fn write(name: &str, info: &CameraInfo) -> String {
    // A name is free text: what could end it or start something else goes.
    let name: String = name.chars().filter(|c| c.is_alphanumeric() || matches!(c, '_' | '-' | '/')).collect();
    let mut text = format!("image_width: {}\nimage_height: {}\ncamera_name: {name}\n", info.width_px, info.height_px);
    let rows = |m: &[f64], cols: usize| -> Vec<f64> {
        // nalgebra stores columns first, the file rows first.
        let rows = m.len() / cols;
        (0..m.len()).map(|i| m[i / cols + i % cols * rows]).collect()
    };
    let mut matrix = |key: &str, cols: usize, values: &[f64]| {
        let data = values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", ");
        let _ = write!(text, "{key}:\n  rows: {}\n  cols: {cols}\n  data: [{data}]\n", values.len() / cols);
        if key == "camera_matrix" {
            text.push_str("distortion_model: plumb_bob\n");
        }
    };
    matrix("camera_matrix", 3, &rows(info.intrinsics.matrix().as_slice(), 3));
    matrix("distortion_coefficients", 5, &info.intrinsics.distortion);
    matrix("rectification_matrix", 3, &rows(info.rectified_from_camera.as_slice(), 3));
    matrix("projection_matrix", 4, &rows(info.projection.as_slice(), 4));
    text
}

/// The rig of a left and a right camera. The mount is the default: looking down, in the body's origin.
///
/// # Errors
/// [`RigYamlError::Pair`] where the two do not belong together: sizes or projections differ, or there is no baseline.
pub fn rig(left: &CameraInfo, right: &CameraInfo) -> Result<RigCalibration, RigYamlError> {
    let pair = |why| Err(RigYamlError::Pair { why });
    if (left.width_px, left.height_px) != (right.width_px, right.height_px) {
        return pair("image sizes differ");
    }
    let (p, q) = (&left.projection, &right.projection);
    if p[(0, 3)] != 0.0 || p[(1, 3)] != 0.0 {
        return pair("the left projection_matrix must have no offset (its fourth column is the right camera's business)");
    }
    // One row of the pair may have its own principal point (disparity then has an offset); focal lengths must be one.
    if (p[(0, 0)] - q[(0, 0)]).abs() > 1e-6 * p[(0, 0)] || (p[(1, 1)] - q[(1, 1)]).abs() > 1e-6 * p[(1, 1)] {
        return pair("the two projection_matrix have different focal lengths");
    }
    let shift_m = Vector3::new(q[(0, 3)] / q[(0, 0)], q[(1, 3)] / q[(1, 1)], 0.0);
    if shift_m.norm() <= 0.0 {
        return pair("the right projection_matrix has no baseline (-fx times metres, row 1, column 4): not a stereo pair");
    }
    let right_from_rectified = right.rectified_from_camera.transpose();
    Ok(RigCalibration {
        width_px: left.width_px,
        height_px: left.height_px,
        left: left.intrinsics,
        right: right.intrinsics,
        right_from_left: right_from_rectified * left.rectified_from_camera,
        right_from_left_m: right_from_rectified * shift_m,
        body_from_camera: RigCalibration::LOOKING_DOWN,
        camera_in_body_m: Vector3::zeros(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    /// As ROS's `camera_calibration` writes it (the right camera of a rig), but for rounder numbers.
    const RIGHT: &str = "image_width: 640\nimage_height: 480\ncamera_name: narrow_stereo/right\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [500.25, 0.     , 320.5,\n           0.     , 501.5, 240.25,\n           0.     ,   0.     ,   1.     ]\ndistortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.363528, 0.095, 0.000256, 0.000331, 0.000000]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [ 0.8, 0. , 0.6,\n         0. , 1. , 0. ,\n         -0.6, 0. , 0.8]\nprojection_matrix:\n  rows: 3\n  cols: 4\n  data: [400., 0., 300., -36.8,\n         0., 400., 220., 0.,\n         0., 0., 1., 0.]\n";

    fn left() -> String {
        RIGHT.replace("-36.8", "0.").replace(
            "[ 0.8, 0. , 0.6,\n         0. , 1. , 0. ,\n         -0.6, 0. , 0.8]",
            "[1., 0., 0., 0., 1., 0., 0., 0., 1.]",
        )
    }

    /// By hand: R₂ᵀ turns by atan(0.6/0.8) about y; the baseline is 36.8 / 400 = 0.092 m; T = R₂ᵀ (−0.092, 0, 0).
    #[test]
    fn two_files_are_a_rig() {
        let rig = rig(&parse(&left()).unwrap(), &parse(RIGHT).unwrap()).unwrap();
        assert_eq!((rig.width_px, rig.height_px, rig.right.fx_px, rig.right.cy_px), (640, 480, 500.25, 240.25));
        assert_eq!(rig.left.distortion, [-0.363_528, 0.095, 0.000_256, 0.000_331, 0.0]);
        assert_eq!(rig.right_from_left, Matrix3::new(0.8, 0.0, -0.6, 0.0, 1.0, 0.0, 0.6, 0.0, 0.8));
        assert!((rig.right_from_left_m - Vector3::new(-0.0736, 0.0, -0.0552)).norm() < 1e-12, "{}", rig.right_from_left_m);
    }

    #[test]
    fn lists_in_blocks_are_read_as_well() {
        let block = "projection_matrix:\n  rows: 3\n  cols: 4\n  data:\n    - 400.\n    - 0\n    - 300.\n    - -36.8\n    - 0\n    - 400.\n    - 220.\n    - 0\n    - 0\n    - 0\n    - 1\n    - 0\n";
        let text = RIGHT[..RIGHT.find("projection_matrix").unwrap()].to_owned() + block;
        assert_eq!(parse(&text), parse(RIGHT));
    }

    #[test]
    fn every_defect_is_named() {
        #[track_caller]
        fn check(from: &str, to: &str, expected: &str) {
            assert!(RIGHT.contains(from), "{from}");
            assert_eq!(parse(&RIGHT.replacen(from, to, 1)).unwrap_err().to_string(), expected);
        }
        check("image_height: 480\n", "", "image_height is missing");
        check("480", "480.5", "line 2: image_height must be a whole number of 1 to 16384 pixels");
        check("480", "tall", "line 2: image_height has \"tall\", expected a finite number");
        check(
            "plumb_bob",
            "equidistant",
            "line 10: distortion_model must be plumb_bob (k1 k2 p1 p2 k3), which is what this models",
        );
        check(
            "[ 0.8, 0. , 0.6,",
            "[ 0.9, 0. , 0.6,",
            "line 15: rectification_matrix must be a rotation: orthonormal, determinant 1",
        );
        check("cols: 4", "cols: 3", "line 21: expected rows and cols that fit the data of a matrix");
        check(
            "0., 1., 0.]",
            "0., 2., 0.]",
            "line 21: projection_matrix must be [fx 0 cx Tx; 0 fy cy Ty; 0 0 1 0] with positive focal lengths",
        );
        check("0.000000]", "0.000000, 0.1]", "line 11: expected rows and cols that fit the data of a matrix");
        check(
            "cols: 5\n  data: [-0.363528,",
            "cols: 8\n  data: [0, 0, 0.1, -0.363528,",
            "line 11: distortion_coefficients uses more than k1 k2 p1 p2 k3, which this does not model",
        );

        let pair = |left: &str, right: &str| rig(&parse(left).unwrap(), &parse(right).unwrap()).unwrap_err().to_string();
        assert!(pair(&left(), &left()).contains("no baseline"));
        assert!(pair(RIGHT, RIGHT).contains("must have no offset"));
        assert!(pair(&left(), &RIGHT.replace("image_width: 640", "image_width: 320")).contains("sizes differ"));
        assert!(pair(&left(), &RIGHT.replace("[400., 0.", "[401., 0.")).contains("focal lengths"));
    }

    proptest! {
        #[test]
        fn no_text_panics(text in "(?s)(image_width|image_height|camera_matrix|data|distortion_model|plumb_bob|:|rows: 3|cols|data: \\[| |\n|-|,|\\]|[0-9.e#\"é]){0,60}") {
            let _ = parse(&text);
        }

        #[test]
        fn there_and_back(values in proptest::collection::vec(-1e3f64..1e3, 8), turn in -3.0f64..3.0) {
            let intrinsics = CameraIntrinsics {
                fx_px: values[0].abs() + 1e-3, fy_px: 1.0, cx_px: values[1], cy_px: values[2],
                distortion: [values[3], 1e-7, -1e-300, values[4], 1e20],
            };
            let rectified_from_camera = Rotation3::from_euler_angles(turn, 0.3 * turn, -turn).into_inner();
            let f = values[5].abs() + 1.0;
            let projection = Matrix3x4::new(f, 0.0, values[6], values[7], 0.0, f, 3.0, 0.0, 0.0, 0.0, 1.0, 0.0);
            let info = CameraInfo { width_px: 640, height_px: 480, intrinsics, rectified_from_camera, projection };
            prop_assert_eq!(parse(&write("a: b\nc", &info)), Ok(info));
        }
    }
}
