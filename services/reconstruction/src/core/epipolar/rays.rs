//! From pixels to directions: the lens undone.

use halcyon_model::CameraIntrinsics;
use nalgebra::Vector2;
use opencv::Result;
use opencv::calib3d;
use opencv::core::{Mat, Point2d, TermCriteria, TermCriteria_COUNT, TermCriteria_EPS, Vector};

use super::PointPair;
use crate::core::cv;

/// The two lenses of a rig, ready to be undone.
pub struct Rays {
    left: Camera,
    right: Camera,
}

struct Camera {
    matrix: Mat,
    distortion: Mat,
}

impl Camera {
    fn new(camera: &CameraIntrinsics) -> Result<Self> {
        Ok(Self { matrix: cv::mat_from_matrix3(&camera.matrix())?, distortion: cv::mat_from_distortion(camera)? })
    }

    fn rays(&self, points: impl Iterator<Item = Vector2<f64>>) -> Result<Vec<Vector2<f64>>> {
        let pixels: Vector<Point2d> = points.map(|point| Point2d::new(point.x, point.y)).collect();
        if pixels.is_empty() {
            return Ok(Vec::new());
        }
        let mut rays = Vector::<Point2d>::new();
        // The default five iterations leave hundredths of a pixel in the corners.
        let until = TermCriteria::new(TermCriteria_COUNT + TermCriteria_EPS, 40, 1e-9)?;
        let none = Mat::default();
        calib3d::undistort_points_iter(&pixels, &mut rays, &self.matrix, &self.distortion, &none, &none, until)?;
        Ok(rays.iter().map(|ray| Vector2::new(ray.x, ray.y)).collect())
    }
}

impl Rays {
    /// Of a rig's two cameras.
    ///
    /// # Errors
    /// OpenCV's, which only memory can cause.
    pub fn new(left: &CameraIntrinsics, right: &CameraIntrinsics) -> Result<Self> {
        Ok(Self { left: Camera::new(left)?, right: Camera::new(right)? })
    }

    /// Normalised coordinates (x/z, y/z) of matched pixels.
    ///
    /// # Errors
    /// OpenCV's, which only memory can cause.
    pub fn of(&self, pairs: &[PointPair]) -> Result<Vec<PointPair>> {
        let left = self.left.rays(pairs.iter().map(|pair| pair.left))?;
        let right = self.right.rays(pairs.iter().map(|pair| pair.right))?;
        Ok(left.into_iter().zip(right).map(|(left, right)| PointPair { left, right }).collect())
    }
}

/// Where ideal lenses of the same focal lengths would have put matched pixels.
///
/// # Errors
/// OpenCV's, which only memory can cause.
pub fn pixels_without_distortion(
    pairs: &[PointPair],
    left: &CameraIntrinsics,
    right: &CameraIntrinsics,
) -> Result<Vec<PointPair>> {
    let pixel = |camera: &CameraIntrinsics, ray: Vector2<f64>| {
        Vector2::new(camera.fx_px * ray.x + camera.cx_px, camera.fy_px * ray.y + camera.cy_px)
    };
    let rays = Rays::new(left, right)?.of(pairs)?;
    Ok(rays.iter().map(|ray| PointPair { left: pixel(left, ray.left), right: pixel(right, ray.right) }).collect())
}
