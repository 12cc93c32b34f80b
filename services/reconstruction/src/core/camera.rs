//! One camera as a formula: pinhole projection with radial and tangential distortion, and its inverse.
//!
//! Written out here, beside OpenCV's, because the residuals of a calibration are worth checking with a second hand.

use halcyon_model::CameraIntrinsics;
use nalgebra::{Matrix2x3, SMatrix, Vector2, Vector3};

/// Intrinsic parameters of a camera, in the order fx, fy, cx, cy, k1, k2, p1, p2, k3.
pub const INTRINSICS: usize = 9;

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

/// How a projected pixel moves with what it was projected from.
#[derive(Debug, Clone, Copy)]
pub struct Slopes {
    /// Pixels per metre of the point, in camera axes.
    pub by_point: Matrix2x3<f64>,
    /// Pixels per unit of each of [`INTRINSICS`].
    pub by_intrinsics: SMatrix<f64, 2, INTRINSICS>,
}

/// [`project`], with its derivatives in closed form; `None` at or behind the camera.
#[must_use]
#[inline]
pub fn project_with_slopes(camera: &CameraIntrinsics, point_m: &Vector3<f64>) -> Option<(Vector2<f64>, Slopes)> {
    if point_m.z.is_nan() || point_m.z <= 0.0 {
        return None;
    }
    let [k1, k2, p1, p2, k3] = camera.distortion;
    let (fx, fy, per_z) = (camera.fx_px, camera.fy_px, 1.0 / point_m.z);
    let (x, y) = (point_m.x * per_z, point_m.y * per_z);
    let (r2, xy) = (x * x + y * y, x * y);
    let radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    // d radial / d r².
    let bend = k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3);
    let distorted = Vector2::new(
        x * radial + 2.0 * p1 * xy + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * xy,
    );
    let xx = radial + 2.0 * x * x * bend + 2.0 * p1 * y + 6.0 * p2 * x;
    let cross = 2.0 * xy * bend + 2.0 * p1 * x + 2.0 * p2 * y;
    let yy = radial + 2.0 * y * y * bend + 6.0 * p1 * y + 2.0 * p2 * x;
    let by_point = Matrix2x3::new(
        fx * xx * per_z,
        fx * cross * per_z,
        -fx * (xx * x + cross * y) * per_z,
        fy * cross * per_z,
        fy * yy * per_z,
        -fy * (cross * x + yy * y) * per_z,
    );
    let (r4, r6) = (r2 * r2, r2 * r2 * r2);
    #[rustfmt::skip]
    let by_intrinsics = SMatrix::<f64, 2, INTRINSICS>::from_row_slice(&[
        distorted.x, 0.0, 1.0, 0.0, fx * x * r2, fx * x * r4, fx * 2.0 * xy, fx * (r2 + 2.0 * x * x), fx * x * r6,
        0.0, distorted.y, 0.0, 1.0, fy * y * r2, fy * y * r4, fy * (r2 + 2.0 * y * y), fy * 2.0 * xy, fy * y * r6,
    ]);
    let pixel = Vector2::new(fx * distorted.x + camera.cx_px, fy * distorted.y + camera.cy_px);
    Some((pixel, Slopes { by_point, by_intrinsics }))
}

/// Direction in camera axes (z = 1) from which `pixel` is seen: [`project`] turned round by Newton's method; `None` where the
/// distortion has no inverse there.
#[must_use]
pub fn unproject(camera: &CameraIntrinsics, pixel: Vector2<f64>) -> Option<Vector3<f64>> {
    let mut ray = Vector3::new((pixel.x - camera.cx_px) / camera.fx_px, (pixel.y - camera.cy_px) / camera.fy_px, 1.0);
    for _ in 0..50 {
        let (seen, slopes) = project_with_slopes(camera, &ray)?;
        let off = pixel - seen;
        let slope = slopes.by_point.fixed_columns::<2>(0).into_owned();
        let step = slope.try_inverse()? * off;
        ray.x += step.x;
        ray.y += step.y;
        if step.norm() < 1e-12 {
            // Beyond the fold of a lens there are solutions, too, but they are mirrored.
            return (slope.trace() > 0.0 && slope.determinant() > 0.0).then_some(ray);
        }
    }
    None
}

/// The parameters in the order of [`INTRINSICS`].
#[must_use]
pub fn to_parameters(camera: &CameraIntrinsics) -> [f64; INTRINSICS] {
    let [k1, k2, p1, p2, k3] = camera.distortion;
    [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, k1, k2, p1, p2, k3]
}

/// A camera from its parameters in the order of [`INTRINSICS`].
#[must_use]
pub fn from_parameters(parameters: &[f64; INTRINSICS]) -> CameraIntrinsics {
    let [fx_px, fy_px, cx_px, cy_px, k1, k2, p1, p2, k3] = *parameters;
    CameraIntrinsics { fx_px, fy_px, cx_px, cy_px, distortion: [k1, k2, p1, p2, k3] }
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

    /// Slopes in closed form against central differences of [`project`], all terms of the model alive.
    #[test]
    fn slopes_are_those_of_the_projection() {
        let camera = CameraIntrinsics { distortion: [-0.2, 0.1, 1e-2, -2e-2, 0.05], ..CAMERA };
        let point_m = Vector3::new(0.4, -0.3, 1.1);
        let (pixel, slopes) = project_with_slopes(&camera, &point_m).unwrap();
        assert!((pixel - project(&camera, &point_m)).norm() < 1e-12);
        const H: f64 = 1e-6;
        for k in 0..3 {
            let at = |h: f64| project(&camera, &(point_m + Vector3::ith(k, h)));
            let by = (at(H) - at(-H)) / (2.0 * H);
            assert!((by - slopes.by_point.column(k)).norm() < 1e-5, "point {k}: {by} {}", slopes.by_point.column(k));
        }
        for k in 0..INTRINSICS {
            let at = |h: f64| {
                let mut parameters = to_parameters(&camera);
                parameters[k] += h;
                project(&from_parameters(&parameters), &point_m)
            };
            let by = (at(H) - at(-H)) / (2.0 * H);
            assert!((by - slopes.by_intrinsics.column(k)).norm() < 1e-5, "intrinsic {k}");
        }
        assert!(project_with_slopes(&camera, &Vector3::new(0.0, 0.0, f64::NAN)).is_none());
    }

    #[test]
    fn a_pixel_looks_where_it_is_seen_from() {
        for (x, y) in [(0.0, 0.0), (0.5, 0.4), (-0.6, 0.45)] {
            let ray = unproject(&CAMERA, project(&CAMERA, &Vector3::new(2.0 * x, 2.0 * y, 2.0))).unwrap();
            assert!((ray - Vector3::new(x, y, 1.0)).norm() < 1e-10, "{ray}");
        }
        let folded = CameraIntrinsics { distortion: [-0.9, 0.0, 0.0, 0.0, 0.0], ..CAMERA };
        assert!(unproject(&folded, Vector2::new(2000.0, 240.0)).is_none());
    }

    #[test]
    fn a_lens_that_folds_over_is_noticed() {
        assert!(distortion_is_monotone(&CAMERA, 640, 480));
        let folded = CameraIntrinsics { distortion: [-0.9, 0.0, 0.0, 0.0, 0.0], ..CAMERA };
        assert!(!distortion_is_monotone(&folded, 640, 480));
    }
}
