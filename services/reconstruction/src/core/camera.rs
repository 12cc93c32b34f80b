//! One camera as a formula: pinhole projection with radial and tangential distortion, and its inverse.
//!
//! Written out here, beside OpenCV's, because the residuals of a calibration are worth checking with a second hand.

use halcyon_model::CameraIntrinsics;
use nalgebra::{Vector2, Vector3};

/// Pixel where a point in camera axes (metres, x right, y down, z forward) is seen (thesis 3-8 … 3-11); NaN at or behind the
/// camera.
#[must_use]
pub fn project(camera: &CameraIntrinsics, point_m: &Vector3<f64>) -> Vector2<f64> {
    if point_m.z <= 0.0 {
        return Vector2::new(f64::NAN, f64::NAN);
    }
    let distorted = distort(&camera.distortion, Vector2::new(point_m.x / point_m.z, point_m.y / point_m.z));
    Vector2::new(camera.fx_px * distorted.x + camera.cx_px, camera.fy_px * distorted.y + camera.cy_px)
}

/// Moves a normalised image point (x/z, y/z) to where the lens puts it.
fn distort(distortion: &[f64; 5], point: Vector2<f64>) -> Vector2<f64> {
    let [k1, k2, p1, p2, k3] = *distortion;
    let (x, y) = (point.x, point.y);
    let r2 = x * x + y * y;
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    Vector2::new(
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    )
}

/// Whether the radial distortion still grows with the angle all the way out to the farthest corner of a
/// `width_px × height_px` picture. Where it turns back, two directions share a pixel and the model means nothing.
#[must_use]
pub fn distortion_is_monotone(camera: &CameraIntrinsics, width_px: u32, height_px: u32) -> bool {
    let corner = |x: f64, y: f64| ((x - camera.cx_px) / camera.fx_px).hypot((y - camera.cy_px) / camera.fy_px);
    let (right, bottom) = (f64::from(width_px) - 1.0, f64::from(height_px) - 1.0);
    let radius_max = corner(0.0, 0.0).max(corner(right, 0.0)).max(corner(0.0, bottom)).max(corner(right, bottom));
    let [k1, k2, _, _, k3] = camera.distortion;
    (1..=64).all(|step| {
        let r2 = (radius_max * f64::from(step) / 64.0).powi(2);
        1.0 + r2 * (3.0 * k1 + r2 * (5.0 * k2 + r2 * 7.0 * k3)) > 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: CameraIntrinsics =
        CameraIntrinsics { fx_px: 500.0, fy_px: 510.0, cx_px: 320.0, cy_px: 240.0, distortion: [-0.2, 0.1, 1e-3, -2e-3, 0.0] };

    /// By hand: x = 0.2, y = 0.1, r² = 0.05, radial = 1 − 0.01 + 0.00025 = 0.99025,
    /// x' = 0.19805 + 2·1e-3·0.02 − 2e-3·(0.05 + 0.08) = 0.19783, y' = 0.099025 + 1e-3·0.07 − 2·2e-3·0.02 = 0.099015.
    #[test]
    fn projection_agrees_with_a_calculation_by_hand() {
        let pixel = project(&CAMERA, &Vector3::new(0.4, 0.2, 2.0));
        assert!((pixel - Vector2::new(320.0 + 500.0 * 0.197_83, 240.0 + 510.0 * 0.099_015)).norm() < 1e-9, "{pixel}");
        assert!(project(&CAMERA, &Vector3::new(0.0, 0.0, -1.0)).x.is_nan());
    }

    #[test]
    fn a_lens_that_folds_over_is_noticed() {
        assert!(distortion_is_monotone(&CAMERA, 640, 480));
        let folded = CameraIntrinsics { distortion: [-0.9, 0.0, 0.0, 0.0, 0.0], ..CAMERA };
        assert!(!distortion_is_monotone(&folded, 640, 480));
    }
}
