//! Pictures of simulated water against projections worked out here, apart from the renderer.

use std::sync::Arc;
use std::time::Duration;

use halcyon_model::{CameraIntrinsics, Image, Stamp};
use halcyon_sim::render::{RenderError, Renderer};
use halcyon_sim::rig::RigConfig;
use halcyon_sim::sea::SeaConfig;
use halcyon_sim::texture::Texture;
use halcyon_sim::water::Water;
use nalgebra::{UnitQuaternion, Vector3};

const NOW: Stamp = Stamp::from_nanos(1_780_000_000_123_456_789);
/// The texture drifts with the wind; documented, so that a place on the texture can be found on the water.
const DRIFT_MPS: [f64; 2] = [0.03, 0.02];

fn quiet() -> RigConfig {
    RigConfig { noise_sigma_grey: 0.0, ..RigConfig::default() }
}

/// Pinhole and Brown's distortion, forwards, straight from the formula (OpenCV's camera model page).
fn project(camera: &CameraIntrinsics, point_m: Vector3<f64>) -> [f64; 2] {
    let (x, y) = (point_m.x / point_m.z, point_m.y / point_m.z);
    let r2 = x * x + y * y;
    let [k1, k2, p1, p2, k3] = camera.distortion;
    let radial = 1.0 + k1 * r2 + k2 * r2 * r2 + k3 * r2 * r2 * r2;
    let xd = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x);
    let yd = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y;
    [camera.fx_px * xd + camera.cx_px, camera.fy_px * yd + camera.cy_px]
}

/// Centre of brightness of what stands out from the background within 8 px of `near`.
fn spot(image: &Image, background: &Image, near: [f64; 2]) -> [f64; 2] {
    let (mut sum, mut su, mut sv) = (0.0, 0.0, 0.0);
    for v in 0..image.height_px() {
        for u in 0..image.width_px() {
            let (x, y) = (f64::from(u), f64::from(v));
            if (x - near[0]).abs() < 8.0 && (y - near[1]).abs() < 8.0 {
                let at = (v * image.width_px() + u) as usize;
                let weight = (f64::from(image.pixels()[at]) - f64::from(background.pixels()[at])).max(0.0);
                (sum, su, sv) = (sum + weight, su + weight * x, sv + weight * y);
            }
        }
    }
    assert!(sum > 100.0, "no spot near {near:?}");
    [su / sum, sv / sum]
}

/// A bright dot floats at a known place of a rough sea; a tilted, turned rig far from the origin must show it where the water's
/// height there and the projection say, in both pictures, to a tenth of a pixel.
#[test]
fn a_floating_dot_is_seen_where_it_floats() {
    let water = Water::new(&SeaConfig::jonswap(0.25, 2.0, 200.0), 5).unwrap();
    let rig = quiet();
    let calibration = rig.calibration();
    let body_m = Vector3::new(812.3, -1430.9, -5.2);
    let mut seen_dots = 0;
    for (roll, pitch, heading) in [(0.0, 0.0, 0.0), (0.05, -0.08, 2.2), (-0.1, 0.12, -1.0_f64)] {
        let ned_from_body = UnitQuaternion::from_euler_angles(roll, pitch, heading);
        let left_m = body_m + ned_from_body * calibration.camera_in_body_m;
        for (ahead, aside) in [(0.0, 0.0), (1.1, 1.6), (-1.0, 1.2), (0.9, -1.3), (-1.2, -0.4)] {
            let (sin, cos) = heading.sin_cos();
            let (north_m, east_m) = (body_m.x + ahead * cos - aside * sin, body_m.y + ahead * sin + aside * cos);
            let point_ned_m = Vector3::new(north_m, east_m, -water.elevation_m(north_m, east_m, NOW));
            let in_left_m =
                (ned_from_body.to_rotation_matrix() * calibration.body_from_camera).transpose() * (point_ned_m - left_m);
            let in_right_m = calibration.right_from_left * in_left_m + calibration.right_from_left_m;
            let expected = [project(&calibration.left, in_left_m), project(&calibration.right, in_right_m)];
            if expected.iter().any(|[u, v]| !((10.0..310.0).contains(u) && (10.0..230.0).contains(v))) {
                continue;
            }
            seen_dots += 1;
            // The dot at texture coordinates of that place; the texture repeats every 1024 × 7 mm.
            let side_m = 1024.0 * 0.007;
            let wrapped = |at_m: f64, drift_mps: f64| (at_m - drift_mps * NOW.as_secs_f64()).rem_euclid(side_m);
            let dot = [wrapped(north_m, DRIFT_MPS[0]), wrapped(east_m, DRIFT_MPS[1])];
            let away = |a: f64, b: f64| ((a - b + 1.5 * side_m).rem_euclid(side_m)) - 0.5 * side_m;
            let texture = Texture::from_fn(1024, 0.007, |n, e| {
                let d2 = away(n, dot[0]).powi(2) + away(e, dot[1]).powi(2);
                0.01 + 0.08 * (-d2 / (2.0 * 0.022 * 0.022)).exp()
            });
            let mut with = Renderer::new(&rig, Arc::new(texture)).unwrap();
            let mut without = Renderer::new(&rig, Arc::new(Texture::from_fn(64, 0.007, |_, _| 0.01))).unwrap();
            let (left, right) = with.render_pair(&water, &ned_from_body, body_m, NOW, 1).unwrap();
            let (left_bare, right_bare) = without.render_pair(&water, &ned_from_body, body_m, NOW, 1).unwrap();

            for (image, bare, expected) in [(&left, &left_bare, expected[0]), (&right, &right_bare, expected[1])] {
                let seen = spot(image, bare, expected);
                let off = (seen[0] - expected[0]).hypot(seen[1] - expected[1]);
                assert!(off < 0.1, "roll {roll} dot {ahead} {aside}: seen {seen:?}, expected {expected:?}");
            }
        }
    }
    assert!(seen_dots >= 10, "{seen_dots}");
}

/// How much the left picture and the right one shifted by `d` pixels differ over the middle, in steps from pixel to pixel (grey
/// levels): the sky that each camera sees mirrored differs too, but smoothly.
fn mismatch(left: &Image, right: &Image, d: u32) -> f64 {
    let (width, mut sum, mut count) = (left.width_px(), 0.0, 0.0);
    let step = |image: &Image, at: u32| f64::from(image.pixels()[at as usize + 1]) - f64::from(image.pixels()[at as usize]);
    for v in 20..left.height_px() - 20 {
        for u in 60..width - 20 {
            sum += (step(left, v * width + u) - step(right, v * width + u - d)).abs();
            count += 1.0;
        }
    }
    sum / count
}

#[test]
fn still_water_has_the_disparity_f_b_over_z() {
    // Ideal cameras, so that the raw pictures are rectified ones; a lens without vignetting and a height for a whole disparity.
    let rig = RigConfig { distortion: [0.0; 5], misalignment_deg: [0.0; 3], vignetting: 0.0, mount_m: [0.0; 3], ..quiet() };
    let water = Water::new(&SeaConfig::still(), 1).unwrap();
    let mut renderer = Renderer::new(&rig, Arc::new(Texture::water(4))).unwrap();
    let focal_px = 160.0 / 25.0_f64.to_radians().tan();
    for disparity in [20, 27, 34] {
        let height_m = focal_px * 0.40 / f64::from(disparity);
        let (left, right) =
            renderer.render_pair(&water, &UnitQuaternion::identity(), Vector3::new(3.0, 4.0, -height_m), NOW, 1).unwrap();
        let best = (5..50).min_by(|a, b| mismatch(&left, &right, *a).total_cmp(&mismatch(&left, &right, *b))).unwrap();
        assert_eq!(best, disparity);
        // Not just the best of bad ones: only the rounding to grey levels is left.
        assert!(mismatch(&left, &right, best) < 0.7, "{}", mismatch(&left, &right, best));
        assert!(mismatch(&left, &right, best + 3) > 4.0, "{}", mismatch(&left, &right, best + 3));
    }
}

fn mean_and_sigma(values: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    (mean, (values.map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt())
}

#[test]
fn each_sensor_has_its_own_noise_of_the_stated_size() {
    let rig = RigConfig { noise_sigma_grey: 3.0, ..RigConfig::default() };
    let water = Water::new(&SeaConfig::default(), 1).unwrap();
    let texture = Arc::new(Texture::water(4));
    let mut noisy = Renderer::new(&rig, Arc::clone(&texture)).unwrap();
    let mut clean = Renderer::new(&quiet(), texture).unwrap();
    let shoot = |renderer: &mut Renderer, stamp, seed| {
        renderer.render_pair(&water, &UnitQuaternion::identity(), Vector3::new(0.0, 0.0, -5.0), stamp, seed).unwrap()
    };
    let (left, right) = shoot(&mut noisy, NOW, 9);
    assert_eq!((left.clone(), right.clone()), shoot(&mut noisy, NOW, 9), "a pure function of its arguments");
    assert_ne!(left, shoot(&mut noisy, NOW, 10).0);
    let (left_clean, right_clean) = shoot(&mut clean, NOW, 9);
    let noise = |a: &Image, b: &Image| -> Vec<f64> {
        a.pixels().iter().zip(b.pixels()).map(|(a, b)| f64::from(*a) - f64::from(*b)).collect()
    };
    let (n_left, n_right) = (noise(&left, &left_clean), noise(&right, &right_clean));
    for n in [&n_left, &n_right] {
        let (mean, sigma) = mean_and_sigma(n.iter().copied());
        // Rounding to grey levels twice adds 1/6 to the variance.
        assert!(mean.abs() < 0.05 && (sigma - (9.0_f64 + 1.0 / 6.0).sqrt()).abs() < 0.05, "{mean} {sigma}");
    }
    let covariance = n_left.iter().zip(&n_right).map(|(a, b)| a * b).sum::<f64>() / n_left.len() as f64;
    assert!(covariance.abs() < 0.15, "{covariance}");
}

/// Bright enough to see, dark enough not to clip, and with contrast to match by, at every height that is flown.
#[test]
fn pictures_are_well_exposed_at_every_height() {
    let water = Water::new(&SeaConfig::default(), 1).unwrap();
    let mut renderer = Renderer::new(&RigConfig::default(), Arc::new(Texture::water(4))).unwrap();
    for height_m in [1.6, 3.0, 5.0, 8.0, 12.0, 20.0, 40.0] {
        let position_m = Vector3::new(10.0, -7.0, -height_m);
        let (left, _) = renderer.render_pair(&water, &UnitQuaternion::identity(), position_m, NOW, 1).unwrap();
        let (mean, sigma) = mean_and_sigma(left.pixels().iter().map(|p| f64::from(*p)));
        let clipped = left.pixels().iter().filter(|p| **p == 0 || **p == 255).count();
        println!("{height_m} m: mean {mean:.1} sigma {sigma:.1} clipped {clipped}");
        assert!((60.0..170.0).contains(&mean) && sigma > 8.0 && clipped < 80, "{height_m} m: {mean} {sigma} {clipped}");
    }
}

#[test]
fn time_moves_the_water() {
    let water = Water::new(&SeaConfig::default(), 1).unwrap();
    let mut renderer = Renderer::new(&quiet(), Arc::new(Texture::water(4))).unwrap();
    let mut shoot =
        |stamp| renderer.render_pair(&water, &UnitQuaternion::identity(), Vector3::new(0.0, 0.0, -5.0), stamp, 1).unwrap().0;
    let (now, later) = (shoot(NOW), shoot(NOW + Duration::from_millis(650)));
    let difference: f64 = now.pixels().iter().zip(later.pixels()).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>()
        / now.pixels().len() as f64;
    assert!(difference > 1.0, "{difference}");
}

#[test]
fn a_rig_that_sees_no_water_is_no_panic() {
    let water = Water::new(&SeaConfig::default(), 1).unwrap();
    let mut renderer = Renderer::new(&RigConfig::default(), Arc::new(Texture::water(4))).unwrap();
    let mut shoot = |roll: f64, down_m: f64| {
        renderer.render_pair(&water, &UnitQuaternion::from_euler_angles(roll, 0.0, 0.3), Vector3::new(0.0, 0.0, down_m), NOW, 1)
    };
    // On its side and on its back it sees the horizon and the sky.
    assert!(shoot(1.4, -5.0).is_ok() && shoot(3.1, -5.0).is_ok());
    for down_m in [0.0, 3.0, f64::NAN] {
        assert!(matches!(shoot(0.0, down_m), Err(RenderError::TooLow { .. })), "{down_m}");
    }
    assert!(matches!(shoot(f64::NAN, -5.0), Err(RenderError::Attitude)));
    let folded = RigConfig { distortion: [-0.9, 0.0, 0.0, 0.0, 0.0], ..RigConfig::default() };
    assert!(Renderer::new(&folded, Arc::new(Texture::water(1))).unwrap_err().to_string().starts_with("rig distortion"));
}
