//! The rig's text format against OpenCV's own reader and writer.

use halcyon_model::{CameraIntrinsics, RigCalibration, rig_yaml};
use halcyon_sim::rig::RigConfig;
use nalgebra::{DMatrix, Matrix3, Rotation3, Vector3};
use opencv::core::{
    FileNode_FLOW, FileNode_SEQ, FileStorage, FileStorage_FORMAT_YAML, FileStorage_MEMORY, FileStorage_READ, FileStorage_WRITE,
    Mat,
};
use opencv::prelude::*;

fn rig() -> RigCalibration {
    let tilted = RigConfig { tilt_deg: 12.0, ..RigConfig::default() }.calibration();
    let right = CameraIntrinsics { fx_px: 343.123_456_789_012_3, distortion: [-0.1, 1e-17, 3e-4, 0.0, 2.5], ..tilted.right };
    RigCalibration { right, ..tilted }
}

#[test]
fn opencv_reads_what_we_write() {
    let rig = rig();
    let text = rig_yaml::write(&rig);
    let file = FileStorage::new(text.as_str(), FileStorage_READ | FileStorage_MEMORY, "").unwrap();
    let matrix = |key: &str| {
        let mat = file.get(key).unwrap().mat().unwrap();
        DMatrix::from_row_slice(mat.rows() as usize, mat.cols() as usize, mat.data_typed::<f64>().unwrap())
    };
    let size = file.get("image_size").unwrap();
    assert_eq!((size.at(0).unwrap().to_i32().unwrap(), size.at(1).unwrap().to_i32().unwrap()), (320, 240));
    for (key, camera, distortion_key) in [("M1", rig.left, "D1"), ("M2", rig.right, "D2")] {
        let m = matrix(key);
        assert_eq!((m[(0, 0)], m[(1, 1)], m[(0, 2)], m[(1, 2)]), (camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px));
        assert_eq!((m[(0, 1)], m[(1, 0)], m[(2, 0)], m[(2, 1)], m[(2, 2)]), (0.0, 0.0, 0.0, 0.0, 1.0));
        assert_eq!(matrix(distortion_key).as_slice(), camera.distortion);
    }
    assert_eq!(matrix("R"), rig.right_from_left);
    assert_eq!(matrix("T").as_slice(), rig.right_from_left_m.as_slice());
    assert_eq!(matrix("body_from_camera"), rig.body_from_camera);
    assert_eq!(matrix("camera_in_body_m").as_slice(), rig.camera_in_body_m.as_slice());
}

#[test]
fn we_read_what_opencv_writes() {
    let rig = rig();
    let flags = FileStorage_WRITE | FileStorage_MEMORY | FileStorage_FORMAT_YAML;
    let mut file = FileStorage::new(".yml", flags, "").unwrap();
    let mat = |m: &Matrix3<f64>| Mat::from_slice(m.transpose().as_slice()).unwrap().reshape(1, 3).unwrap().clone_pointee();
    let column = |values: &[f64]| Mat::from_slice(values).unwrap().reshape(1, values.len() as i32).unwrap().clone_pointee();
    // As `fs << "image_size" << Size` does.
    file.start_write_struct("image_size", FileNode_SEQ | FileNode_FLOW, "").unwrap();
    file.write_i32("", 320).unwrap();
    file.write_i32("", 240).unwrap();
    file.end_write_struct().unwrap();
    file.write_str("made_by", "a calibration: with # odd text").unwrap();
    file.write_mat("M1", &mat(&rig.left.matrix())).unwrap();
    file.write_mat("D1", &column(&rig.left.distortion)).unwrap();
    file.write_mat("M2", &mat(&rig.right.matrix())).unwrap();
    // A row this time, as stereoCalibrate gives it.
    file.write_mat("D2", &Mat::from_slice(&rig.right.distortion).unwrap()).unwrap();
    file.write_mat("R", &mat(&rig.right_from_left)).unwrap();
    file.write_mat("T", &column(rig.right_from_left_m.as_slice())).unwrap();
    file.write_f64("rms", 0.4).unwrap();
    let text = file.release_and_get_string().unwrap();
    let read = rig_yaml::parse(&text).unwrap();
    // OpenCV writes 17 digits, so nothing is lost; the keys that it wasn't told take their defaults.
    let expected = RigCalibration { body_from_camera: RigCalibration::LOOKING_DOWN, camera_in_body_m: Vector3::zeros(), ..rig };
    assert_eq!(read, expected, "{text}");
    let rotation = Rotation3::from_matrix_unchecked(read.right_from_left);
    assert!((rotation.angle() - rig_angle(&rig)).abs() < 1e-12);
}

fn rig_angle(rig: &RigCalibration) -> f64 {
    Rotation3::from_matrix_unchecked(rig.right_from_left).angle()
}
