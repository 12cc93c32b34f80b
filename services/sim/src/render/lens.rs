//! Which way each pixel looks: undistorted once, when the renderer is made.

use halcyon_model::CameraIntrinsics;
use nalgebra::{Matrix3, Vector3};

/// A pixel's line of sight, and how bright the lens leaves it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    /// Unit vector in the left camera's axes.
    pub(super) direction: [f32; 3],
    /// Share of the light that reaches the sensor here.
    pub(super) gain: f32,
}

/// The rays of every pixel, row-major, turned by `left_from_camera`. The corners lose `vignetting` of their light.
pub(super) fn rays(
    camera: &CameraIntrinsics,
    (width_px, height_px): (u32, u32),
    left_from_camera: &Matrix3<f64>,
    vignetting: f64,
) -> Vec<Ray> {
    let corner_px = 0.5 * f64::from(width_px).hypot(f64::from(height_px));
    let pixels = (0..height_px).flat_map(|v| (0..width_px).map(move |u| (f64::from(u), f64::from(v))));
    pixels
        .map(|(u_px, v_px)| {
            let radius = (u_px - camera.cx_px).hypot(v_px - camera.cy_px) / corner_px;
            let ray = (left_from_camera * undistorted(camera, u_px, v_px)).normalize();
            let gain = (1.0 - vignetting * radius * radius).max(0.0) as f32;
            Ray { direction: [ray.x as f32, ray.y as f32, ray.z as f32], gain }
        })
        .collect()
}

/// The line of sight (x, y, 1) of a pixel in its camera's own axes.
///
/// Newton's method on Brown's distortion (OpenCV's five coefficients), whose inverse has no closed form.
fn undistorted(camera: &CameraIntrinsics, u_px: f64, v_px: f64) -> Vector3<f64> {
    let [k1, k2, p1, p2, k3] = camera.distortion;
    let (x_distorted, y_distorted) = ((u_px - camera.cx_px) / camera.fx_px, (v_px - camera.cy_px) / camera.fy_px);
    let (mut x, mut y) = (x_distorted, y_distorted);
    for _ in 0..20 {
        let q = x * x + y * y;
        let radial = 1.0 + q * (k1 + q * (k2 + q * k3));
        let radial_slope = k1 + q * (2.0 * k2 + 3.0 * q * k3);
        let off_x = x * radial + 2.0 * p1 * x * y + p2 * (q + 2.0 * x * x) - x_distorted;
        let off_y = y * radial + p1 * (q + 2.0 * y * y) + 2.0 * p2 * x * y - y_distorted;
        // The Jacobian of the distortion; it is symmetric.
        let xx = radial + 2.0 * x * x * radial_slope + 2.0 * p1 * y + 6.0 * p2 * x;
        let xy = 2.0 * x * y * radial_slope + 2.0 * p1 * x + 2.0 * p2 * y;
        let yy = radial + 2.0 * y * y * radial_slope + 6.0 * p1 * y + 2.0 * p2 * x;
        let determinant = xx * yy - xy * xy;
        x -= (yy * off_x - xy * off_y) / determinant;
        y -= (xx * off_y - xy * off_x) / determinant;
        if off_x.abs() + off_y.abs() < 1e-13 {
            break;
        }
    }
    Vector3::new(x, y, 1.0)
}
