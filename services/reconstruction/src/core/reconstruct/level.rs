//! Where the mean level of a patch is: by the carrier's pose, or by the rig's own distance where it stands still.

use halcyon_model::grid_error::inflation;
use halcyon_model::{ElevationGrid, Plane, PoseAtExposure, RigCalibration};
use nalgebra::Vector3;

/// As many planes as this are averaged with equal weights; from then on the oldest fade.
const PLANES_MAX: f64 = 4000.0;
/// A plane that leans this far from the mean, radians, is no wave: somebody has moved the rig.
const MOVED_RAD: f64 = 0.2;

/// What a rig that stands still learns about which way is down: the mean of the water planes it has seen. Waves longer than the
/// footprint tilt single planes by more than their own height over the footprint's edge, but not the mean.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct FixedMount {
    learnt: Option<Learnt>,
}

#[derive(Debug, Clone, Copy)]
struct Learnt {
    calibration: RigCalibration,
    normal: Vector3<f64>,
    planes: f64,
    /// Of the first plane, metres: any fixed datum will do.
    distance_m: f64,
}

impl FixedMount {
    /// Takes in a pair's plane and returns the still water's.
    pub(super) fn observe(&mut self, plane: &Plane, calibration: &RigCalibration) -> Plane {
        let fresh = Learnt { calibration: *calibration, normal: plane.normal, planes: 0.0, distance_m: plane.distance_m };
        let mut learnt = match self.learnt {
            Some(learnt) if learnt.calibration == *calibration && learnt.normal.angle(&plane.normal) <= MOVED_RAD => learnt,
            _ => fresh,
        };
        learnt.planes = (learnt.planes + 1.0).min(PLANES_MAX);
        learnt.normal = (learnt.normal + (plane.normal - learnt.normal) / learnt.planes).normalize();
        self.learnt = Some(learnt);
        Plane { normal: learnt.normal, distance_m: learnt.distance_m, rms_m: plane.rms_m }
    }
}

/// The thesis's correction (7-1): elevation = S_z − D cos(pitch) cos(roll), S_z the carrier's height by the autopilot and D the
/// mean distance of the points from the camera, metres. It moves a patch as a whole and knows no mount.
pub(super) fn level_by_thesis_m(pose: &PoseAtExposure, mean_depth_m: f64) -> f64 {
    let (roll_rad, pitch_rad, _) = pose.ned_from_body.euler_angles();
    -pose.position_ned_m.z - mean_depth_m * pitch_rad.cos() * roll_rad.cos()
}

/// Standard deviation of the mean of all filled cells, metres: errors are common within a matching window of `window_m` a side,
/// and independent beyond.
pub(super) fn mean_sigma_m(grid: &ElevationGrid, window_m: f64) -> f64 {
    let (sum, cells) = grid
        .sigma_m
        .iter()
        .filter(|sigma| sigma.is_finite())
        .fold((0.0, 0_usize), |(sum, cells), sigma| (sum + f64::from(*sigma).powi(2), cells + 1));
    let cells = cells.max(1) as f64;
    let mean_m2 = sum / cells;
    // At most as uncertain as a cell: a patch within one window.
    (mean_m2 * (inflation(grid.cell_m, window_m) / cells).min(1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, UnitQuaternion};

    fn calibration() -> RigCalibration {
        let camera =
            halcyon_model::CameraIntrinsics { fx_px: 500.0, fy_px: 500.0, cx_px: 320.0, cy_px: 240.0, distortion: [0.0; 5] };
        RigCalibration {
            width_px: 640,
            height_px: 480,
            left: camera,
            right: camera,
            right_from_left: Matrix3::identity(),
            right_from_left_m: Vector3::new(-0.1, 0.0, 0.0),
            body_from_camera: RigCalibration::LOOKING_DOWN,
            camera_in_body_m: Vector3::zeros(),
        }
    }

    fn plane(x: f64, distance_m: f64) -> Plane {
        Plane { normal: Vector3::new(x, 0.0, 1.0).normalize(), distance_m, rms_m: 0.0 }
    }

    #[test]
    fn waves_average_out_and_a_moved_rig_starts_over() {
        let mut mount = FixedMount::default();
        let mut still = plane(0.0, 1.0);
        for i in 0..200 {
            still = mount.observe(
                &plane(0.1 + 0.05 * (f64::from(i) * 0.4).sin(), 1.0 + 0.02 * (f64::from(i) * 0.4).cos()),
                &calibration(),
            );
        }
        assert!((still.normal.x / still.normal.z - 0.1).abs() < 1e-3, "{still:?}");
        assert!((still.distance_m - 1.02).abs() < 1e-12, "the datum is the first plane's and stays");
        let moved = mount.observe(&plane(-0.3, 2.0), &calibration());
        assert!((moved.distance_m - 2.0).abs() < 1e-12 && (moved.normal.x / moved.normal.z + 0.3).abs() < 1e-12);
    }

    /// By hand: 5 m up, 5.1 m along the axis, rolled by 0.1 and pitched by 0.2 rad.
    #[test]
    fn the_thesis_equation() {
        let pose = PoseAtExposure {
            position_ned_m: Vector3::new(1.0, 2.0, -5.0),
            ned_from_body: UnitQuaternion::from_euler_angles(0.1, 0.2, 2.0),
            height_sigma_m: 0.0,
            attitude_sigma_rad: 0.0,
        };
        assert!((level_by_thesis_m(&pose, 5.1) - (5.0 - 5.1 * 0.980_066_578 * 0.995_004_165)).abs() < 1e-8);
    }

    #[test]
    fn a_mean_is_better_than_its_cells_by_the_root_of_the_windows() {
        let grid = |cell_m: f64| ElevationGrid {
            south_west_north_m: 0.0,
            south_west_east_m: 0.0,
            cell_m,
            rows: 10,
            cols: 10,
            elevation_m: vec![0.0; 100],
            sigma_m: vec![0.01; 100],
        };
        assert!((mean_sigma_m(&grid(0.1), 1e-4) - 0.001).abs() < 1e-5, "every cell is many windows");
        // Windows as wide as a cell: 1 / (2/3) along each axis.
        assert!((mean_sigma_m(&grid(0.1), 0.1) - 0.0015).abs() < 1e-5);
        assert!((mean_sigma_m(&grid(0.1), 5.0) - 0.01).abs() < 1e-9, "one window for all");
    }
}
