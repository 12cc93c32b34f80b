//! A rig's calibration as text: the file `rig.yaml` of a survey folder.
//!
//! The format is OpenCV's `FileStorage` YAML, so that OpenCV's own programs and ours read each other's files. It holds
//! `image_size` (width, height), `M1` and `M2` (3 × 3 camera matrices), `D1` and `D2` (k1, k2, p1, p2\[, k3\]), `R` (3 × 3) and `T` (metres) of
//! X2 = R X1 + T, and optionally `body_from_camera` (3 × 3, default [`RigCalibration::LOOKING_DOWN`]) and `camera_in_body_m` (metres,
//! default zero). Names that other programs give the same things (`cameraMatrix1`, `K1`, `distCoeffs1`, `imageSize` …) are understood;
//! other keys are left alone: calibration programs add theirs. This reads the subset of YAML that `FileStorage` writes, and nothing
//! of the disk: text in, text out.

use std::fmt::Write as _;

use nalgebra::{Matrix3, Vector3};

use crate::stereo::RigCalibration;
use crate::yaml::{Document, also_looked_for};

/// Texts longer than this are not a rig's calibration; bounds what a hostile file can cost.
pub const TEXT_BYTES_MAX: usize = 1 << 20;

/// Why a text is not a rig's calibration. Lines count from 1.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RigYamlError {
    /// Longer than [`TEXT_BYTES_MAX`].
    #[error("{bytes} bytes are too many for a rig's calibration: at most {TEXT_BYTES_MAX}")]
    TooLong {
        /// Its length.
        bytes: usize,
    },
    /// A line that is not YAML as OpenCV writes it.
    #[error("line {line}: expected {expected}")]
    Syntax {
        /// Where.
        line: usize,
        /// What should be there.
        expected: &'static str,
    },
    /// A key given twice.
    #[error("line {line}: {key} is given a second time")]
    Duplicate {
        /// Where.
        line: usize,
        /// Which.
        key: String,
    },
    /// A key that must be there.
    #[error("{key} is missing{}", also_looked_for(key))]
    Missing {
        /// Which.
        key: &'static str,
    },
    /// A matrix or list of another shape.
    #[error("line {line}: {key} is {rows} x {cols}, expected {expected}")]
    Shape {
        /// Where the key is.
        line: usize,
        /// Which.
        key: &'static str,
        /// Its rows.
        rows: usize,
        /// Its columns.
        cols: usize,
        /// The shape that is read here.
        expected: &'static str,
    },
    /// Something that is not a finite number.
    #[error("line {line}: {key} has {text:?}, expected a finite number")]
    Number {
        /// Where the key is.
        line: usize,
        /// Which.
        key: &'static str,
        /// The text in question.
        text: String,
    },
    /// Numbers that no rig can have.
    #[error("line {line}: {key} {why}")]
    Value {
        /// Where the key is.
        line: usize,
        /// Which.
        key: &'static str,
        /// What is wrong.
        why: &'static str,
    },
    /// Two files that are not of one rig.
    #[error("the left and the right camera do not make a rig: {why}")]
    Pair {
        /// What is wrong.
        why: &'static str,
    },
}

/// Reads a calibration.
///
/// # Errors
/// [`RigYamlError`], naming the line and the key.
pub fn parse(text: &str) -> Result<RigCalibration, RigYamlError> {
    if text.len() > TEXT_BYTES_MAX {
        return Err(RigYamlError::TooLong { bytes: text.len() });
    }
    let document = Document::read(text)?;
    let (width_px, height_px) = document.image_size()?;
    let translation = document.required("T")?;
    let right_from_left_m = translation.vector3()?;
    if right_from_left_m.norm() <= 0.0 {
        return Err(translation.value("is zero: the two cameras can't be in one place"));
    }
    Ok(RigCalibration {
        width_px,
        height_px,
        left: document.camera("M1", "D1")?,
        right: document.camera("M2", "D2")?,
        right_from_left: document.required("R")?.rotation()?,
        right_from_left_m,
        body_from_camera: match document.optional("body_from_camera")? {
            Some(list) => list.rotation()?,
            None => RigCalibration::LOOKING_DOWN,
        },
        camera_in_body_m: match document.optional("camera_in_body_m")? {
            Some(list) => list.vector3()?,
            None => Vector3::zeros(),
        },
    })
}

/// Writes a calibration; [`parse`] gives back the very same numbers, and so does OpenCV's `FileStorage`.
#[must_use]
pub fn write(rig: &RigCalibration) -> String {
    let mut text = format!("%YAML:1.0\n---\nimage_size: [ {}, {} ]\n", rig.width_px, rig.height_px);
    // nalgebra stores columns first, the file rows first.
    let square = |m: &Matrix3<f64>| m.transpose().as_slice().to_vec();
    for (key, rows, values) in [
        ("M1", 3, square(&rig.left.matrix())),
        ("D1", 1, rig.left.distortion.to_vec()),
        ("M2", 3, square(&rig.right.matrix())),
        ("D2", 1, rig.right.distortion.to_vec()),
        ("R", 3, square(&rig.right_from_left)),
        ("T", 3, rig.right_from_left_m.as_slice().to_vec()),
        ("body_from_camera", 3, square(&rig.body_from_camera)),
        ("camera_in_body_m", 3, rig.camera_in_body_m.as_slice().to_vec()),
    ] {
        let cols = values.len() / rows;
        // `{:?}` is the shortest text that reads back as the same number. Writing to a String cannot fail.
        let data = values.iter().map(|v| format!("{v:?}")).collect::<Vec<_>>().join(", ");
        let _ = write!(text, "{key}: !!opencv-matrix\n   rows: {rows}\n   cols: {cols}\n   dt: d\n   data: [ {data} ]\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stereo::CameraIntrinsics;
    use proptest::prelude::*;

    /// Written by hand after the layout in OpenCV's FileStorage documentation: wrapped data, `1.`, a comment, a foreign key.
    const TEXT: &str = "%YAML:1.0\n---\ncalibrated_by: \"a: program # 3\"\nimage_size: [ 640, 480 ]  # px\nM1: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 5.0e+02, 0., 3.2e+02, 0., 501.,\n       240., 0., 0., 1. ]\nD1: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data: [ -0.1, 0.02, 1.0e-03, -2.0e-03, 0.003 ]\nM2: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: f\n   data: [ 510., 0., 330., 0., 511., 250., 0., 0., 1. ]\nD2: !!opencv-matrix\n   rows: 4\n   cols: 1\n   dt: d\n   data: [ 0.1, 0.2, 0.3, 0.4 ]\nR: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 1., 0., 0., 0., 0., -1., 0., 1., 0. ]\nT: !!opencv-matrix\n   rows: 3\n   cols: 1\n   dt: d\n   data: [ -0.092, 0.001, 0.002 ]\nviews:\n   - { rms: 0.4 }\n   - [ 1, 2 ]\n";

    #[test]
    fn reads_what_file_storage_writes() {
        let rig = parse(TEXT).unwrap();
        assert_eq!((rig.width_px, rig.height_px), (640, 480));
        assert_eq!((rig.left.fx_px, rig.left.fy_px, rig.left.cx_px, rig.left.cy_px), (500.0, 501.0, 320.0, 240.0));
        assert_eq!(rig.left.distortion, [-0.1, 0.02, 1e-3, -2e-3, 0.003]);
        assert_eq!(rig.right.distortion, [0.1, 0.2, 0.3, 0.4, 0.0]);
        assert_eq!(rig.right_from_left * Vector3::y(), Vector3::z());
        assert_eq!(rig.right_from_left_m, Vector3::new(-0.092, 0.001, 0.002));
        assert_eq!(rig.body_from_camera, RigCalibration::LOOKING_DOWN);
        let sizes = [
            "image_size:\n   - 640\n   - 480\n",
            "image_size: !!opencv-matrix\n   rows: 1\n   cols: 2\n   dt: i\n   data: [ 640, 480 ]\n",
        ];
        for size in sizes {
            assert_eq!(parse(&TEXT.replace("image_size: [ 640, 480 ]  # px\n", size)), Ok(rig), "{size}");
        }
        assert_eq!(parse(&TEXT.replace('\n', "\r\n")), Ok(rig));
    }

    #[test]
    fn other_programs_names_are_understood() {
        let rig = parse(TEXT).unwrap();
        let renamed = |pairs: &[(&str, &str)]| {
            pairs.iter().fold(TEXT.to_owned(), |text, (from, to)| {
                assert!(text.contains(from), "{from}");
                text.replace(from, to)
            })
        };
        let opencv = [("M1:", "cameraMatrix1:"), ("D1:", "distCoeffs1:"), ("M2:", "cameraMatrix2:"), ("D2:", "distCoeffs2:")];
        assert_eq!(parse(&renamed(&opencv)), Ok(rig));
        assert_eq!(parse(&renamed(&[("M1:", "K1:"), ("M2:", "K2:"), ("image_size:", "imageSize:")])), Ok(rig));
        let sides = [("image_size: [ 640, 480 ]", "image_width: 640\nimage_height: 480")];
        assert_eq!(parse(&renamed(&sides)), Ok(rig));
        // Ours come first, and a matrix that is missing is named with all that was looked for.
        let both = format!("{TEXT}K1: [ 1, 2 ]\n");
        assert_eq!(parse(&both), Ok(rig));
        let error = parse(&renamed(&[("M2:", "Kright:")])).unwrap_err().to_string();
        assert!(error.starts_with("M2 is missing, and so are cameraMatrix2, ") && error.contains("K2"), "{error}");
        let one_side = renamed(&[("image_size: [ 640, 480 ]", "image_width: 640")]);
        assert!(parse(&one_side).unwrap_err().to_string().starts_with("image_size is missing"));
    }

    #[test]
    fn every_defect_is_named() {
        #[track_caller]
        fn check(from: &str, to: &str, expected: &str) {
            assert!(TEXT.contains(from), "{from}");
            assert_eq!(parse(&TEXT.replacen(from, to, 1)).unwrap_err().to_string(), expected);
        }
        check(
            "image_size: [ 640, 480 ]  # px\n",
            "",
            "image_size is missing, and so are imageSize, ImageSize, img_size, image_width with image_height",
        );
        check("[ 640, 480 ]", "[ 640, 480.5 ]", "line 4: image_size must be two whole numbers of 1 to 16384 pixels");
        check("[ 640, 480 ]", "[ 640 ]", "line 4: image_size is 1 x 1, expected 2 numbers: width, height");
        check("5.0e+02, 0., 3.2e+02", ".Nan, 0., 3.2e+02", "line 5: M1 has \".Nan\", expected a finite number");
        check("5.0e+02, 0., 3.2e+02", "-5.0e+02, 0., 3.2e+02", "line 5: M1 must have positive focal lengths");
        check("5.0e+02, 0., 3.2e+02", "5.0e+02, 0.", "line 5: expected rows and cols that fit the data of a matrix");
        check(
            "[ 1., 0., 0., 0., 0., -1.,",
            "[ 1., 0., 0., 0., 0., 1.,",
            "line 26: R must be a rotation: orthonormal, determinant 1",
        );
        check("-0.092, 0.001, 0.002", "0., 0., 0.", "line 31: T is zero: the two cameras can't be in one place");
        check("M2:", "M1:", "line 16: M1 is given a second time");
        check("D2: !!opencv-matrix", "D2 !!opencv-matrix", "line 21: expected \"key: value\"");
        check("0.002 ]", "0.002", "line 31: expected a list of numbers in [ ]");
    }

    proptest! {
        #[test]
        fn no_text_panics(text in "(?s)(image_size|M1|D1|R|T|:|!!opencv-matrix|rows: 3|cols|data: \\[| |\n|-|,|\\]|[0-9.e#\"é]){0,60}") {
            let _ = parse(&text);
        }

        #[test]
        fn there_and_back(values in proptest::collection::vec(-1e3f64..1e3, 14), angle in -3.0f64..3.0, width in 1u32..5000) {
            let rotation = nalgebra::Rotation3::from_euler_angles(angle, 0.3 * angle, -angle).into_inner();
            let camera = |at: usize| CameraIntrinsics {
                fx_px: values[at].abs() + 1e-3, fy_px: 3.0, cx_px: values[at + 1], cy_px: values[at + 2],
                distortion: [values[at + 3], 1e-7, -1e-300, values[at + 4], 1e20],
            };
            let rig = RigCalibration {
                width_px: width, height_px: 16, left: camera(0), right: camera(5),
                right_from_left: rotation, right_from_left_m: Vector3::new(values[10], 1e-9, -3.0),
                body_from_camera: rotation.transpose(), camera_in_body_m: Vector3::new(values[11], values[12], values[13]),
            };
            prop_assert_eq!(parse(&write(&rig)), Ok(rig));
        }
    }
}
