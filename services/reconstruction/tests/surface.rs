//! The chain against water that is known exactly: pinhole rays on a formula, nothing shared with what is tested.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use halcyon_model::{CameraIntrinsics, RigCalibration, Stamp, SurfacePatch};
use halcyon_reconstruction::core::matcher::DisparityRange;
use halcyon_reconstruction::core::reconstruct::{ReconstructError, Reconstructor, Settings};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use support::scene::{Surface, default_rig, normal, pose, render};

/// A regular wave running towards (0.8, 0.6).
fn wave(amplitude_m: f64, length_m: f64) -> impl Fn(f64, f64) -> f64 {
    move |north, east| amplitude_m * (std::f64::consts::TAU * (0.8 * north + 0.6 * east) / length_m).sin()
}

/// A patch's errors against the truth, which has its own mean over the measured cells.
struct Errors {
    /// Root mean square error of the elevations, metres.
    rms_m: f64,
    /// Root mean square of error over stated standard deviation: 1 is honest.
    ratio: f64,
    /// Error of the level, metres.
    level_m: f64,
}

fn errors(patch: &SurfacePatch, surface: Surface<'_>) -> Errors {
    let grid = &patch.grid;
    let mut cells = Vec::new();
    for (i, (elevation, sigma)) in grid.elevation_m.iter().zip(&grid.sigma_m).enumerate().filter(|(_, (e, _))| e.is_finite()) {
        let north_m = grid.south_west_north_m + (i / grid.cols as usize) as f64 * grid.cell_m;
        let east_m = grid.south_west_east_m + (i % grid.cols as usize) as f64 * grid.cell_m;
        cells.push((f64::from(*elevation), surface(north_m, east_m), f64::from(*sigma)));
    }
    let count = cells.len() as f64;
    let true_level_m = cells.iter().map(|cell| cell.1).sum::<f64>() / count;
    let mean = |value: &dyn Fn(&(f64, f64, f64)) -> f64| (cells.iter().map(value).sum::<f64>() / count).sqrt();
    let error = |cell: &(f64, f64, f64)| cell.0 - (cell.1 - true_level_m);
    Errors {
        rms_m: mean(&|cell| error(cell).powi(2)),
        ratio: mean(&|cell| (error(cell) / cell.2).powi(2)),
        level_m: patch.level_m.map_or(f64::NAN, |level_m| level_m - true_level_m),
    }
}

/// Five metres up, 1 px is 0.18 m: 4 mm in a cell is 0.02 px.
#[track_caller]
fn check(rig: &RigCalibration, attitude_deg: [f64; 3], surface: Surface<'_>, noise: f64, rms_m_max: f64) {
    let pair = render(rig, &pose(12.3, -4.5, 5.07, attitude_deg), surface, noise, 3);
    let patch = Reconstructor::new(Settings::default()).reconstruct(&pair).unwrap();
    let errors = errors(&patch, surface);
    println!(
        "rms {:.2} mm, error/sigma {:.2}, level {:+.2} mm, coverage {:.3}, {} points",
        errors.rms_m * 1e3,
        errors.ratio,
        errors.level_m * 1e3,
        patch.coverage,
        patch.points
    );
    assert!(errors.rms_m <= rms_m_max, "rms {} m", errors.rms_m);
    assert!((0.5..2.0).contains(&errors.ratio), "error/sigma {}", errors.ratio);
    assert!(errors.level_m.abs() <= 2e-3, "level {} m", errors.level_m);
    assert!(patch.coverage >= 0.97, "coverage {}", patch.coverage);
}

#[test]
fn still_water() {
    check(&default_rig(), [0.0; 3], &|_, _| 0.0, 2.0, 0.004);
}

#[test]
fn still_water_above_the_datum() {
    check(&default_rig(), [0.0; 3], &|_, _| 0.3, 2.0, 0.004);
}

#[test]
fn a_wave_without_camera_noise_loses_no_crest() {
    check(&default_rig(), [0.0; 3], &wave(0.0177, 2.6), 0.0, 0.0025);
}

#[test]
fn a_wave_seen_level() {
    check(&default_rig(), [0.0; 3], &wave(0.0177, 2.6), 2.0, 0.004);
}

#[test]
fn a_wave_seen_tilted_and_turned() {
    check(&default_rig(), [4.0, -5.0, 130.0], &wave(0.0177, 2.6), 2.0, 0.005);
}

#[test]
fn a_short_wave_through_a_noisy_camera() {
    check(&default_rig(), [-2.0, 3.0, 300.0], &wave(0.01, 0.9), 4.0, 0.008);
}

#[test]
fn a_high_wave() {
    check(&default_rig(), [0.0, 0.0, 45.0], &wave(0.15, 3.0), 2.0, 0.006);
}

/// Lenses that bend and cameras that squint, as real ones do.
#[test]
fn a_real_rig_with_distortion_toe_in_and_offset_mount() {
    let mut rig = default_rig();
    rig.left =
        CameraIntrinsics { fx_px: 345.0, fy_px: 344.0, cx_px: 163.0, cy_px: 117.0, distortion: [-0.2, 0.05, 8e-4, -6e-4, 0.0] };
    rig.right = CameraIntrinsics {
        fx_px: 339.0,
        fy_px: 340.0,
        cx_px: 156.0,
        cy_px: 121.5,
        distortion: [-0.19, 0.045, -5e-4, 4e-4, 0.0],
    };
    rig.right_from_left = Rotation3::from_euler_angles(0.01, -0.02, 0.015).into_inner();
    rig.right_from_left_m = rig.right_from_left * Vector3::new(-0.4, 0.01, -0.008);
    rig.camera_in_body_m = Vector3::new(0.1, -0.2, 0.05);
    check(&rig, [2.0, 1.0, 75.0], &wave(0.0177, 2.6), 2.0, 0.005);
}

#[test]
fn the_plane_is_where_the_water_is() {
    let pair = render(&default_rig(), &pose(0.0, 0.0, 5.0, [0.0; 3]), &|_, _| 0.0, 2.0, 1);
    let patch = Reconstructor::new(Settings::default()).reconstruct(&pair).unwrap();
    assert!((patch.plane.distance_m - 5.0).abs() < 1e-3, "{:?}", patch.plane);
    assert!(patch.plane.normal.angle(&Vector3::z()) < 5e-4, "{:?}", patch.plane);
    assert_eq!((patch.sequence, patch.stamp, &patch.rig), (pair.sequence, pair.stamp, &pair.rig));
    assert!((patch.level_sigma_m.unwrap() - 0.02).abs() < 1e-3, "the height's own standard deviation, and no lever");
}

#[test]
fn without_a_pose_the_plane_is_level() {
    let surface = wave(0.0177, 2.6);
    let mut pair = render(&default_rig(), &pose(0.0, 0.0, 5.0, [6.0, -3.0, 0.0]), &|_, _| 0.0, 2.0, 1);
    pair.pose = None;
    let patch = Reconstructor::new(Settings::default()).reconstruct(&pair).unwrap();
    assert_eq!((patch.level_m, patch.level_sigma_m), (None, None));
    let worst = patch.grid.elevation_m.iter().filter(|e| e.is_finite()).fold(0.0_f32, |worst, e| worst.max(e.abs()));
    assert!(worst < 0.02, "still water seen obliquely is level in the plane's own frame: {worst}");
    // Straight down and heading north, own frame and world agree, so waves can be compared cell by cell.
    let mut level = render(&default_rig(), &pose(0.0, 0.0, 5.0, [0.0; 3]), &surface, 2.0, 1);
    level.pose = None;
    let patch = Reconstructor::new(Settings::default()).reconstruct(&level).unwrap();
    assert!(errors(&patch, &surface).rms_m < 0.006);
}

/// The autopilot is metres off: the narrow search fails, the full one does not, and the next pair is searched narrowly again.
#[test]
fn a_wrong_height_costs_a_search_not_the_patch() {
    let mut reconstructor = Reconstructor::new(Settings::default());
    for off_m in [2.0, -1.5, 0.0] {
        let mut pair = render(&default_rig(), &pose(0.0, 0.0, 5.0, [0.0; 3]), &|_, _| 0.0, 2.0, 1);
        if let Some(pose) = &mut pair.pose {
            pose.position_ned_m.z -= off_m;
        }
        let patch = reconstructor.reconstruct(&pair).unwrap();
        assert!((patch.plane.distance_m - 5.0).abs() < 2e-3);
        assert!((patch.level_m.unwrap() - off_m).abs() < 5e-3, "the level carries the autopilot's error");
    }
}

/// Attitude noise of 0.2° on still water: taken literally it makes waves of 5 mm r.m.s.; learnt, most of it goes, and the
/// standard deviations stay honest.
#[test]
fn attitude_noise_is_not_mistaken_for_waves() {
    let mut reconstructor = Reconstructor::new(Settings::default());
    let sigma_rad = 0.2_f64.to_radians();
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let truth = pose(0.0, 0.0, 5.0, [0.0, 0.0, 20.0]);
    let still = render(&default_rig(), &truth, &|_, _| 0.0, 2.0, 5);
    let (mut last_rms_m, mut literal_rms_m, mut pairs) = (0.0, 0.0, 0.0);
    for i in 0..150 {
        let mut pair = still.clone();
        pair.stamp = Stamp::from_secs_f64(f64::from(i) * 0.2);
        let mut noisy = truth;
        noisy.ned_from_body = truth.ned_from_body
            * UnitQuaternion::from_euler_angles(sigma_rad * normal(&mut random), sigma_rad * normal(&mut random), 0.0);
        noisy.attitude_sigma_rad = sigma_rad;
        pair.pose = Some(noisy);
        let patch = reconstructor.reconstruct(&pair).unwrap();
        // Half a minute at 5 Hz; the second half counts.
        if i >= 75 {
            noisy.attitude_sigma_rad = 0.0;
            pair.pose = Some(noisy);
            let literal = Reconstructor::new(Settings::default()).reconstruct(&pair).unwrap();
            last_rms_m += errors(&patch, &|_, _| 0.0).rms_m.powi(2);
            literal_rms_m += errors(&literal, &|_, _| 0.0).rms_m.powi(2);
            pairs += 1.0;
            let ratio = errors(&patch, &|_, _| 0.0).ratio;
            assert!((0.3..2.0).contains(&ratio), "error/sigma {ratio}");
        }
    }
    let (rms_m, literal_rms_m) = ((last_rms_m / pairs).sqrt(), (literal_rms_m / pairs).sqrt());
    println!("rms {:.2} mm, taken literally {:.2} mm", rms_m * 1e3, literal_rms_m * 1e3);
    assert!(literal_rms_m > 0.005 && rms_m < 0.0045, "{rms_m} {literal_rms_m}");
}

#[test]
fn the_same_pairs_give_the_same_patches() {
    let pair = render(&default_rig(), &pose(0.0, 0.0, 5.0, [1.0, 2.0, 3.0]), &wave(0.02, 2.0), 2.0, 9);
    let once = || {
        Reconstructor::new(Settings::default())
            .reconstruct(&pair)
            .map(|patch| (patch.plane, patch.points, patch.grid.rows))
            .unwrap()
    };
    assert_eq!(once(), once());
}

#[test]
fn what_cannot_be_measured_is_an_error() {
    let mut reconstructor = Reconstructor::new(Settings::default());
    let good = render(&default_rig(), &pose(0.0, 0.0, 5.0, [0.0; 3]), &|_, _| 0.0, 2.0, 1);

    let blank = halcyon_model::Image::new(320, 240, vec![90; 320 * 240].into()).unwrap();
    let mut pair = good.clone();
    (pair.left, pair.right) = (blank.clone(), blank);
    assert!(matches!(reconstructor.reconstruct(&pair), Err(ReconstructError::Plane(_))), "nothing to match");

    let mut pair = good.clone();
    pair.left = halcyon_model::Image::new(4, 4, vec![0; 16].into()).unwrap();
    assert!(matches!(reconstructor.reconstruct(&pair), Err(ReconstructError::Rectify(_))), "another size");

    let mut pair = good.clone();
    pair.calibration.right_from_left_m = Vector3::new(0.4, 0.0, 0.0);
    assert!(matches!(reconstructor.reconstruct(&pair), Err(ReconstructError::Rectify(_))), "cameras swapped");

    let mut pair = good.clone();
    pair.calibration.left.fx_px = f64::NAN;
    assert!(matches!(reconstructor.reconstruct(&pair), Err(ReconstructError::Rectify(_))), "no number");

    let pair = render(&default_rig(), &pose(0.0, 0.0, 0.2, [0.0; 3]), &|_, _| 0.0, 2.0, 1);
    assert!(
        matches!(reconstructor.reconstruct(&pair), Err(ReconstructError::TooClose { .. })),
        "a hand's breadth above the water"
    );

    assert!(reconstructor.reconstruct(&good).is_ok(), "and none of it does any harm");
    assert!(reconstructor.preview().unwrap().is_some());
}

#[test]
fn every_engine_measures() {
    for engine in halcyon_reconstruction::core::matcher::Engine::ALL {
        let pair = render(&default_rig(), &pose(0.0, 0.0, 5.0, [0.0; 3]), &wave(0.0177, 2.6), 2.0, 1);
        let settings = Settings {
            engine,
            block_px: engine.block_px_default(),
            range: DisparityRange { min_px: 0, max_px: 63 },
            ..Settings::default()
        };
        let patch = Reconstructor::new(settings).reconstruct(&pair).unwrap();
        let rms_m = errors(&patch, &wave(0.0177, 2.6)).rms_m;
        assert!(rms_m < 0.006, "{} {rms_m}", engine.name());
    }
}
