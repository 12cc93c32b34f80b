//! OpenCV's own way from a pair to points, as its users write it. A yardstick of speed: nothing measures with it.

use halcyon_model::{Image, RigCalibration};
use opencv::calib3d;
use opencv::core::{CV_16SC2, Mat, Scalar};
use opencv::imgproc;
use opencv::prelude::*;

use super::cv;
use super::disparity::Disparity;
use super::matcher::{DisparityRange, Matcher, SemiGlobalMatcher, SgbmMode};
use super::reconstruct::ReconstructError;
use super::rectify::{self, Rectifier};

/// Rectify (bilinear, fixed-point maps), SGBM, `reprojectImageTo3D`, with buffers kept between pairs.
pub struct OpenCvChain {
    maps: [(Mat, Mat); 2],
    rectified: [Mat; 2],
    matcher: SemiGlobalMatcher,
    range: DisparityRange,
    disparity: Disparity,
    /// From (x, y, disparity, 1) to a point (OpenCV's Q).
    point_from_disparity: Mat,
    points: Mat,
}

impl OpenCvChain {
    /// For one rig.
    ///
    /// # Errors
    /// [`ReconstructError::Rectify`] for a calibration that cannot be rectified.
    pub fn new(rig: &RigCalibration, range: DisparityRange, block_px: u32) -> Result<Self, ReconstructError> {
        let rectified = *Rectifier::new(rig)?.rig();
        let [left, right] = rectify::maps_of(rig)?;
        let fixed = |(x, y): (Mat, Mat)| -> opencv::Result<(Mat, Mat)> {
            let (mut whole, mut fraction) = (Mat::default(), Mat::default());
            imgproc::convert_maps(&x, &y, &mut whole, &mut fraction, CV_16SC2, false)?;
            Ok((whole, fraction))
        };
        let (f, cx, cy, b) = (rectified.focal_px, rectified.cx_px, rectified.cy_px, rectified.baseline_m);
        let q = [1.0, 0.0, 0.0, -cx, 0.0, 1.0, 0.0, -cy, 0.0, 0.0, 0.0, f, 0.0, 0.0, 1.0 / b, 0.0];
        Ok(Self {
            maps: [fixed(left)?, fixed(right)?],
            rectified: [Mat::default(), Mat::default()],
            matcher: SemiGlobalMatcher::new(SgbmMode::FivePaths, block_px).without_margin(),
            range,
            disparity: Disparity::default(),
            point_from_disparity: Mat::new_rows_cols_with_data(4, 4, &q).and_then(|q| q.try_clone())?,
            points: Mat::default(),
        })
    }

    /// How many points the pair gives.
    ///
    /// # Errors
    /// As OpenCV and [`Matcher::compute`] have them.
    pub fn points(&mut self, left: &Image, right: &Image) -> Result<usize, ReconstructError> {
        for ((image, maps), to) in [left, right].into_iter().zip(&self.maps).zip(&mut self.rectified) {
            let border = opencv::core::BORDER_CONSTANT;
            imgproc::remap(
                &cv::mat_from_image(image)?,
                to,
                &maps.0,
                &maps.1,
                imgproc::INTER_LINEAR,
                border,
                Scalar::default(),
            )?;
        }
        let [left, right] = &self.rectified;
        self.matcher.compute(left, right, self.range, &mut self.disparity)?;
        let (rows, values) = (self.disparity.height_px as i32, &self.disparity.values_px);
        let disparity = Mat::from_slice(values)?;
        let disparity = disparity.reshape(1, rows)?;
        calib3d::reproject_image_to_3d(&disparity, &mut self.points, &self.point_from_disparity, false, -1)?;
        Ok(self.disparity.matched())
    }
}
