//! The few bridges between our types and OpenCV's.

use halcyon_model::{CameraIntrinsics, Image, RigCalibration};
use nalgebra::{Matrix3, Vector3};
use opencv::Result;
use opencv::boxed_ref::BoxedRef;
use opencv::calib3d;
use opencv::core::{Mat, MatTraitConst, MatTraitConstManual, Rect, Size};

/// A picture as OpenCV sees it; borrows the pixels.
pub(crate) fn mat_from_image(image: &Image) -> Result<BoxedRef<'_, Mat>> {
    Mat::new_rows_cols_with_data(image.height_px() as i32, image.width_px() as i32, &image.pixels()[..])
}

/// A 3 × 3 matrix, `f64`.
pub(crate) fn mat_from_matrix3(matrix: &Matrix3<f64>) -> Result<Mat> {
    // nalgebra is column-major: its transpose, read in order, is row-major.
    Mat::new_rows_cols_with_data(3, 3, matrix.transpose().as_slice())?.try_clone()
}

/// A 3 × 1 column, `f64`.
pub(crate) fn mat_from_vector3(vector: &Vector3<f64>) -> Result<Mat> {
    Mat::new_rows_cols_with_data(3, 1, vector.as_slice())?.try_clone()
}

/// A 3 × 3 `f64` matrix back.
pub(crate) fn matrix3_from_mat(mat: &Mat) -> Result<Matrix3<f64>> {
    Ok(Matrix3::from_row_slice(mat.data_typed::<f64>()?))
}

/// The first three numbers of an `f64` matrix.
pub(crate) fn vector3_from_mat(mat: &Mat) -> Result<Vector3<f64>> {
    Ok(Vector3::from_column_slice(&mat.data_typed::<f64>()?[..3]))
}

/// Distortion as OpenCV takes it.
pub(crate) fn mat_from_distortion(camera: &CameraIntrinsics) -> Result<Mat> {
    Mat::new_rows_cols_with_data(1, 5, &camera.distortion)?.try_clone()
}

/// One camera from OpenCV's matrix and up to five distortion coefficients (more are refused by the flags we pass).
pub(crate) fn intrinsics_from_mats(matrix: &Mat, distortion: &Mat) -> Result<CameraIntrinsics> {
    let k = matrix3_from_mat(matrix)?;
    let mut coefficients = [0.0; 5];
    for (to, from) in coefficients.iter_mut().zip(distortion.data_typed::<f64>()?) {
        *to = *from;
    }
    Ok(CameraIntrinsics { fx_px: k.m11, fy_px: k.m22, cx_px: k.m13, cy_px: k.m23, distortion: coefficients })
}

/// Width and height of a matrix, pixels.
pub(crate) fn size_px(mat: &Mat) -> (u32, u32) {
    (mat.cols() as u32, mat.rows() as u32)
}

/// How a rig's pictures are turned and projected to be rectified.
pub(crate) struct Rectification {
    /// Rotation of the left camera into the rectified frame, 3 × 3.
    pub(crate) left_rotation: Mat,
    /// Rotation of the right camera.
    pub(crate) right_rotation: Mat,
    /// Projection of the rectified left camera, 3 × 4, pixels.
    pub(crate) left_projection: Mat,
    /// Projection of the right one.
    pub(crate) right_projection: Mat,
}

/// Which pixels rectified pictures show.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum View {
    /// As large as the focal lengths make them, edges that a camera did not see included.
    Natural,
    /// Zoomed until every pixel was seen by its camera.
    OnlySeen,
}

/// Bouguet's rectification, by OpenCV.
pub(crate) fn rectification(rig: &RigCalibration, view: View) -> Result<Rectification> {
    let [mut left_rotation, mut right_rotation, mut left_projection, mut right_projection, mut q] =
        [(); 5].map(|()| Mat::default());
    let size = Size::new(rig.width_px as i32, rig.height_px as i32);
    calib3d::stereo_rectify(
        &mat_from_matrix3(&rig.left.matrix())?,
        &mat_from_distortion(&rig.left)?,
        &mat_from_matrix3(&rig.right.matrix())?,
        &mat_from_distortion(&rig.right)?,
        size,
        &mat_from_matrix3(&rig.right_from_left)?,
        &mat_from_vector3(&rig.right_from_left_m)?,
        &mut left_rotation,
        &mut right_rotation,
        &mut left_projection,
        &mut right_projection,
        &mut q,
        calib3d::CALIB_ZERO_DISPARITY,
        match view {
            View::Natural => -1.0,
            View::OnlySeen => 0.0,
        },
        size,
        None::<&mut Rect>,
        None::<&mut Rect>,
    )?;
    Ok(Rectification { left_rotation, right_rotation, left_projection, right_projection })
}
