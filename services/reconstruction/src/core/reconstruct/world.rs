//! From the rectified left camera to north, east, down: every point turned by the full attitude about the camera's mount.

use halcyon_model::{Plane, PoseAtExposure, RigCalibration};
use nalgebra::{Matrix3, Vector3};

use crate::core::rectify::RectifiedRig;

/// A rigid transform: P = rotation · X + origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldFromRectified {
    /// Rectified left camera axes in north, east, down.
    pub rotation: Matrix3<f64>,
    /// The left camera's centre: north, east, down, metres.
    pub origin_ned_m: Vector3<f64>,
}

impl WorldFromRectified {
    /// By the carrier's pose: body about its origin, camera about its mount, rectified about the camera's centre. (The thesis's
    /// (7-1), elevation = S_z − D cos(pitch) cos(roll), is this for the point on the optical axis, without the mount.)
    #[must_use]
    pub fn from_pose(pose: &PoseAtExposure, calibration: &RigCalibration, rig: &RectifiedRig) -> Self {
        let ned_from_body = pose.ned_from_body.to_rotation_matrix().into_inner();
        Self {
            rotation: ned_from_body * calibration.body_from_camera * rig.camera_from_rectified,
            origin_ned_m: pose.position_ned_m + ned_from_body * calibration.camera_in_body_m,
        }
    }

    /// Without a pose the mean water plane is level by definition: down is its normal, "north" the top of the picture, and the
    /// origin the point on the water next to the left camera.
    #[must_use]
    pub fn from_plane(plane: &Plane) -> Self {
        let down = plane.normal;
        let level = |axis: Vector3<f64>| axis - down * down.dot(&axis);
        // A camera that looks along the water's own vertical axis still has a sideways one.
        let north = level(-Vector3::y()).try_normalize(1e-6).unwrap_or_else(|| level(Vector3::z()).normalize());
        let east = down.cross(&north);
        Self {
            rotation: Matrix3::from_rows(&[north.transpose(), east.transpose(), down.transpose()]),
            origin_ned_m: Vector3::new(0.0, 0.0, -plane.distance_m),
        }
    }

    /// A point of the rectified left camera frame in the world, metres.
    #[must_use]
    pub fn apply(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point_m + self.origin_ned_m
    }

    /// Where the vertical at (north, east) meets the plane: a point in the rectified left camera frame. `None` for a plane that
    /// is vertical.
    #[must_use]
    pub fn on_plane(&self, plane: &Plane, north_m: f64, east_m: f64) -> Option<Vector3<f64>> {
        let normal = self.rotation * plane.normal;
        if normal.z.abs() < 1e-6 {
            return None;
        }
        let (north, east) = (north_m - self.origin_ned_m.x, east_m - self.origin_ned_m.y);
        let down_m = (plane.distance_m - normal.x * north - normal.y * east) / normal.z;
        Some(self.rotation.transpose() * Vector3::new(north, east, down_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::UnitQuaternion;

    const RIG: RectifiedRig = RectifiedRig {
        width_px: 320,
        height_px: 240,
        focal_px: 343.0,
        cx_px: 159.5,
        cy_px: 119.5,
        baseline_m: 0.4,
        camera_from_rectified: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    };

    fn calibration(camera_in_body_m: Vector3<f64>) -> RigCalibration {
        let camera =
            halcyon_model::CameraIntrinsics { fx_px: 343.0, fy_px: 343.0, cx_px: 159.5, cy_px: 119.5, distortion: [0.0; 5] };
        RigCalibration {
            width_px: 320,
            height_px: 240,
            left: camera,
            right: camera,
            right_from_left: Matrix3::identity(),
            right_from_left_m: Vector3::new(-0.4, 0.0, 0.0),
            body_from_camera: RigCalibration::LOOKING_DOWN,
            camera_in_body_m,
        }
    }

    /// By hand: heading east, level, 5 m up at (10 N, 20 E). The top of the picture is forward, so east.
    #[test]
    fn heading_east_the_top_of_the_picture_is_east() {
        let pose = PoseAtExposure {
            position_ned_m: Vector3::new(10.0, 20.0, -5.0),
            ned_from_body: UnitQuaternion::from_euler_angles(0.0, 0.0, std::f64::consts::FRAC_PI_2),
            height_sigma_m: 0.0,
            attitude_sigma_rad: 0.0,
        };
        let world = WorldFromRectified::from_pose(&pose, &calibration(Vector3::new(0.2, 0.0, 0.1)), &RIG);
        // Camera 0.2 m forward (east), 0.1 m down; the point 1 m to the right of the picture (south), 2 m up in it (east).
        let point = world.apply(&Vector3::new(1.0, -2.0, 4.9));
        assert!((point - Vector3::new(9.0, 22.2, 0.0)).norm() < 1e-9, "{point}");
    }

    /// The thesis's (7-1) is the vertical distance to the point on the optical axis.
    #[test]
    fn on_the_axis_the_thesis_equation_holds() {
        let (roll, pitch, distance_m) = (0.1_f64, -0.07_f64, 5.0);
        let pose = PoseAtExposure {
            position_ned_m: Vector3::zeros(),
            ned_from_body: UnitQuaternion::from_euler_angles(roll, pitch, 0.6),
            height_sigma_m: 0.0,
            attitude_sigma_rad: 0.0,
        };
        let world = WorldFromRectified::from_pose(&pose, &calibration(Vector3::zeros()), &RIG);
        let down_m = world.apply(&Vector3::new(0.0, 0.0, distance_m)).z;
        assert!((down_m - distance_m * pitch.cos() * roll.cos()).abs() < 1e-12);
    }

    #[test]
    fn without_a_pose_the_plane_is_level_and_the_picture_points_north() {
        let plane = Plane { normal: Vector3::new(0.1, -0.2, 1.0).normalize(), distance_m: 3.0, rms_m: 0.0 };
        let world = WorldFromRectified::from_plane(&plane);
        assert!((world.rotation * world.rotation.transpose() - Matrix3::identity()).norm() < 1e-12);
        assert!(world.rotation.determinant() > 0.0);
        assert!(world.apply(&(plane.normal * 3.0)).norm() < 1e-12, "the foot of the camera is the origin");
        assert!((world.rotation * -Vector3::y()).x > 0.9);
        let seen = world.on_plane(&plane, 0.5, -0.3).unwrap();
        assert!((plane.normal.dot(&seen) - 3.0).abs() < 1e-12);
        assert!((world.apply(&seen) - Vector3::new(0.5, -0.3, 0.0)).norm() < 1e-12);
    }
}
