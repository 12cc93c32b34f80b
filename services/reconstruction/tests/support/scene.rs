//! Water that is known exactly, seen by cameras that are known exactly: rays, a surface and a texture, nothing shared with
//! what is tested.

use halcyon_model::{CameraIntrinsics, Image, PoseAtExposure, RigCalibration, RigId, Stamp, StereoPair};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Height of the water above the datum at (north, east), metres.
pub(crate) type Surface<'a> = &'a dyn Fn(f64, f64) -> f64;

/// 320 × 240 px, 50° wide, 0.4 m apart, looking straight down: the default simulated rig.
pub(crate) fn default_rig() -> RigCalibration {
    let camera = CameraIntrinsics { fx_px: 343.1, fy_px: 343.1, cx_px: 159.5, cy_px: 119.5, distortion: [0.0; 5] };
    RigCalibration {
        width_px: 320,
        height_px: 240,
        left: camera,
        right: camera,
        right_from_left: Matrix3::identity(),
        right_from_left_m: Vector3::new(-0.4, 0.0, 0.0),
        body_from_camera: RigCalibration::LOOKING_DOWN,
        camera_in_body_m: Vector3::zeros(),
    }
}

/// A pose from position and roll, pitch, heading in degrees.
pub(crate) fn pose(north_m: f64, east_m: f64, height_m: f64, attitude_deg: [f64; 3]) -> PoseAtExposure {
    let [roll, pitch, heading] = attitude_deg.map(f64::to_radians);
    PoseAtExposure {
        position_ned_m: Vector3::new(north_m, east_m, -height_m),
        ned_from_body: UnitQuaternion::from_euler_angles(roll, pitch, heading),
        height_sigma_m: 0.02,
        attitude_sigma_rad: 0.0,
    }
}

/// Renders a pair. `noise` is the standard deviation of a pixel in grey levels; the same seed gives the same pair.
pub(crate) fn render(rig: &RigCalibration, pose: &PoseAtExposure, surface: Surface<'_>, noise: f64, seed: u64) -> StereoPair {
    let ned_from_left = pose.ned_from_body.to_rotation_matrix().into_inner() * rig.body_from_camera;
    let left_ned_m = pose.position_ned_m + pose.ned_from_body * rig.camera_in_body_m;
    let ned_from_right = ned_from_left * rig.right_from_left.transpose();
    let right_ned_m = left_ned_m - ned_from_right * rig.right_from_left_m;
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let size = (rig.width_px, rig.height_px);
    StereoPair {
        stamp: Stamp::from_secs_f64(1000.0 + seed as f64),
        rig: RigId::new("leader-1").unwrap(),
        sequence: seed,
        left: picture(&rig.left, size, &ned_from_left, &left_ned_m, surface, noise, &mut random),
        right: picture(&rig.right, size, &ned_from_right, &right_ned_m, surface, noise, &mut random),
        exposure_s: 0.001,
        calibration: *rig,
        pose: Some(*pose),
    }
}

fn picture(
    camera: &CameraIntrinsics,
    (width, height): (u32, u32),
    ned_from_camera: &Matrix3<f64>,
    centre_ned_m: &Vector3<f64>,
    surface: Surface<'_>,
    noise: f64,
    random: &mut ChaCha8Rng,
) -> Image {
    let mut pixels = Vec::with_capacity((width * height) as usize);
    for y in 0..height {
        for x in 0..width {
            // A pixel is an area: the mean of 2 × 2 rays.
            let mut sum = 0.0;
            for (dx, dy) in [(-0.25, -0.25), (0.25, -0.25), (-0.25, 0.25), (0.25, 0.25)] {
                let ray = ned_from_camera * undistorted_ray(camera, f64::from(x) + dx, f64::from(y) + dy);
                let (north, east) = hit(centre_ned_m, &ray, surface);
                sum += texture(north, east);
            }
            let grey = 128.0 + 45.0 * sum / 4.0 + noise * normal(random);
            pixels.push(grey.round().clamp(0.0, 255.0) as u8);
        }
    }
    Image::new(width, height, pixels.into()).unwrap()
}

/// Inverts the lens by fixed-point iteration.
fn undistorted_ray(camera: &CameraIntrinsics, x_px: f64, y_px: f64) -> Vector3<f64> {
    let (xd, yd) = ((x_px - camera.cx_px) / camera.fx_px, (y_px - camera.cy_px) / camera.fy_px);
    let [k1, k2, p1, p2, k3] = camera.distortion;
    let (mut x, mut y) = (xd, yd);
    for _ in 0..20 {
        let r2 = x * x + y * y;
        let radial = 1.0 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
        let (tx, ty) = (2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x), p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
        (x, y) = ((xd - tx) / radial, (yd - ty) / radial);
    }
    Vector3::new(x, y, 1.0)
}

/// Where a ray meets the water: (north, east). Fixed-point iteration on the height, which gentle slopes let converge.
pub(crate) fn hit(centre_ned_m: &Vector3<f64>, ray: &Vector3<f64>, surface: Surface<'_>) -> (f64, f64) {
    let mut height = 0.0;
    let (mut north, mut east) = (0.0, 0.0);
    for _ in 0..8 {
        let along = (-height - centre_ned_m.z) / ray.z;
        (north, east) = (centre_ned_m.x + ray.x * along, centre_ned_m.y + ray.y * along);
        height = surface(north, east);
    }
    (north, east)
}

/// Smooth noise of unit variance or so, fixed to the place: lattices of 35, 80 and 300 mm, a pixel at 5 m being 15 mm.
fn texture(north_m: f64, east_m: f64) -> f64 {
    0.75 * lattice(north_m, east_m, 0.035, 1) + 0.9 * lattice(north_m, east_m, 0.08, 2) + 0.7 * lattice(north_m, east_m, 0.3, 3)
}

/// Random numbers on a lattice, joined by a quintic step.
fn lattice(north_m: f64, east_m: f64, cell_m: f64, salt: u64) -> f64 {
    let (u, v) = (north_m / cell_m, east_m / cell_m);
    let (i, j) = (u.floor(), v.floor());
    let smooth = |t: f64| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let (s, t) = (smooth(u - i), smooth(v - j));
    let at = |di: i64, dj: i64| hash(i as i64 + di, j as i64 + dj, salt);
    let row = |di: i64| at(di, 0) * (1.0 - t) + at(di, 1) * t;
    row(0) * (1.0 - s) + row(1) * s
}

/// Uniform in −1 to 1 (SplitMix64).
fn hash(i: i64, j: i64, salt: u64) -> f64 {
    let mut z = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ (j as u64).wrapping_mul(0xc2b2_ae3d_27d4_eb4f)
        ^ salt.wrapping_mul(0x1656_67b1_9e37_79f9);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// Standard normal (Box and Muller).
pub(crate) fn normal(random: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (random.random(), random.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}
