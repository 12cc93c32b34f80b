//! Row error: how far matches are from sharing a row once the pair is rectified.

use halcyon_model::RigCalibration;
use nalgebra::Matrix3;
use opencv::core::MatTraitConstManual;

use crate::core::cv;
use crate::core::epipolar::PointPair;

/// Row errors of many matches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowErrors {
    /// Root mean square, pixels.
    pub rms_px: f64,
    /// 95 % are smaller, pixels.
    pub p95_px: f64,
}

impl RowErrors {
    /// Of signed errors, pixels; NaN of none.
    #[must_use]
    pub fn new(errors_px: &[f64]) -> Self {
        let mut sizes: Vec<f64> = errors_px.iter().map(|error| error.abs()).collect();
        let rms_px = (errors_px.iter().map(|error| error * error).sum::<f64>() / errors_px.len() as f64).sqrt();
        let at = (0.95 * sizes.len() as f64) as usize;
        let p95_px = if sizes.is_empty() { f64::NAN } else { *sizes.select_nth_unstable_by(at, f64::total_cmp).1 };
        Self { rms_px, p95_px }
    }
}

/// The two turns that rectify a rig, and the focal length of the rectified pictures.
pub(super) struct RowGeometry {
    left: Matrix3<f64>,
    right: Matrix3<f64>,
    focal_px: f64,
    along_rows: bool,
}

impl RowGeometry {
    pub(super) fn new(rig: &RigCalibration) -> opencv::Result<Self> {
        let found = cv::rectification(rig, cv::View::Natural)?;
        let t = &rig.right_from_left_m;
        Ok(Self {
            left: cv::matrix3_from_mat(&found.left_rotation)?,
            right: cv::matrix3_from_mat(&found.right_rotation)?,
            focal_px: found.left_projection.data_typed::<f64>()?[0],
            along_rows: t.x.abs() >= t.y.abs(),
        })
    }

    /// Left row less right row of matches given in normalised coordinates, pixels.
    pub(super) fn errors_px(&self, rays: &[PointPair]) -> Vec<f64> {
        rays.iter()
            .map(|ray| {
                let (left, right) = (self.left * ray.left.push(1.0), self.right * ray.right.push(1.0));
                // A rig whose cameras sit one above the other is rectified along columns.
                let off =
                    if self.along_rows { left.y / left.z - right.y / right.z } else { left.x / left.z - right.x / right.z };
                off * self.focal_px
            })
            .collect()
    }
}
