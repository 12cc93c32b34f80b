//! Where the joint search starts from: Zhang's method (thesis 3.4), each camera alone, by OpenCV; and many places beside it.
//!
//! The joint problem has bad local minima: started from a guess, `stereoCalibrate` with the flags of OpenCV's own sample stops
//! at four times the error of the best solution. So the search starts from cameras that differ widely in focal length,
//! principal point and distortion, each with the boards' poses and the rig that suit it, and the best end is taken.

use halcyon_model::CameraIntrinsics;
use nalgebra::{Vector2, Vector3};
use opencv::core::{Mat, Point2f, Point3f, Size, TermCriteria, TermCriteria_Type, Vector};
use opencv::{Result, calib3d};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::board::BoardSpec;
use super::bundle::Guess;
use super::model::is_plausible;
use super::sighting::{Pose, Side, Sighting};
use crate::core::cv;

/// Both cameras.
pub(super) type Cameras = (CameraIntrinsics, CameraIntrinsics);

/// Each camera alone, with k1 and k2: what the views surely fix. `None` where they don't.
pub(super) fn alone(sightings: &[Sighting], board: &BoardSpec, size: (u32, u32)) -> Result<Option<Cameras>> {
    let left = one_alone(sightings, board, Side::Left, size)?;
    let right = one_alone(sightings, board, Side::Right, size)?;
    Ok(left.zip(right))
}

fn one_alone(sightings: &[Sighting], board: &BoardSpec, side: Side, size: (u32, u32)) -> Result<Option<CameraIntrinsics>> {
    let (mut object, mut image) = (Vector::<Vector<Point3f>>::new(), Vector::<Vector<Point2f>>::new());
    for sighting in sightings.iter().filter(|sighting| sighting.is_used()) {
        object.push(sighting.kept(side).map(|i| board.corner_point3f(i)).collect());
        image.push(sighting.kept(side).map(|i| sighting.corners(side)[i]).collect());
    }
    let (mut matrix, mut distortion) = (Mat::default(), Mat::default());
    let (mut rotations, mut translations) = (Vector::<Mat>::new(), Vector::<Mat>::new());
    let outcome = calib3d::calibrate_camera(
        &object,
        &image,
        Size::new(size.0 as i32, size.1 as i32),
        &mut matrix,
        &mut distortion,
        &mut rotations,
        &mut translations,
        calib3d::CALIB_FIX_K3 | calib3d::CALIB_ZERO_TANGENT_DIST,
        TermCriteria::new(TermCriteria_Type::COUNT as i32 + TermCriteria_Type::EPS as i32, 30, 1e-6)?,
    );
    // Views that do not fix a camera make OpenCV throw or return nonsense: both mean "no start from here".
    if outcome.is_err() {
        return Ok(None);
    }
    let camera = cv::intrinsics_from_mats(&matrix, &distortion)?;
    Ok(is_plausible(&camera, size).then_some(camera))
}

/// The boards' poses and the rig that suit these cameras: each board by itself, then the pose of the right camera on which most
/// views agree. `None` where no view has a pose.
pub(super) fn guess(sightings: &[Sighting], board: &BoardSpec, (left, right): &Cameras) -> Result<Option<Guess>> {
    let (mut poses, mut relative) = (Vec::new(), Vec::new());
    for sighting in sightings.iter().filter(|sighting| sighting.is_used()) {
        let Some(in_left) = Pose::of_board(board, &sighting.left, left)? else { return Ok(None) };
        let in_right = Pose::of_board(board, &sighting.right, right)?;
        relative.extend(in_right.map(|in_right| in_left.to(&in_right)));
        poses.push(in_left);
    }
    // The medoid: the candidate nearest to all others, in angle. A single wrong pose does not move it. Cameras that are far off
    // put boards at wrong distances; then the next best may be needed to have them all in front of the right camera.
    let unease = |candidate: &Pose| relative.iter().map(|other| candidate.angle_rad(other)).sum::<f64>();
    let mut candidates: Vec<(f64, &Pose)> = relative.iter().map(|candidate| (unease(candidate), candidate)).collect();
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    let flat = Vector2::zeros();
    let is_in_front = |rig: &Pose| {
        let seen = |pose: &Pose| (0..board.corners()).all(|i| rig.apply(&pose.apply(&board.corner_m(i, &flat))).z > 0.0);
        poses.iter().all(seen)
    };
    // In the worst case cameras side by side: what is in front of the one is in front of the other.
    let level = candidates.first().map(|(_, rig)| Pose {
        camera_from_board_m: rig.camera_from_board_m.component_mul(&Vector3::new(1.0, 1.0, 0.0)),
        ..**rig
    });
    let rig = candidates.iter().map(|(_, rig)| **rig).chain(level).find(is_in_front);
    Ok(rig.map(|rig| Guess {
        left: *left,
        right: *right,
        right_from_left: rig.camera_from_board,
        right_from_left_m: rig.camera_from_board_m,
        warp_m: Vector2::zeros(),
        poses,
    }))
}

/// `count` pairs of cameras to start from: as found alone; the same without distortion; a nominal camera, centred and square,
/// with the mean focal length of both; and from there on random ones (seeded: the same every time), focal lengths of 0.6 to
/// 1.7 times the nominal one, principal points within a tenth of the picture about its middle, k1 within ±0.3 as far as the lens bears it.
pub(super) fn cameras((left, right): Cameras, (width_px, height_px): (u32, u32), count: usize, seed: u64) -> Vec<Cameras> {
    let plain = |camera: CameraIntrinsics| CameraIntrinsics { distortion: [0.0; 5], ..camera };
    let focal_px = (left.fx_px + left.fy_px + right.fx_px + right.fy_px) / 4.0;
    let nominal = CameraIntrinsics {
        fx_px: focal_px,
        fy_px: focal_px,
        cx_px: (f64::from(width_px) - 1.0) / 2.0,
        cy_px: (f64::from(height_px) - 1.0) / 2.0,
        distortion: [0.0; 5],
    };
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut anyhow = || {
        let factor = random.random_range(0.6_f64.ln()..1.7_f64.ln()).exp();
        let squeeze = random.random_range(0.9_f64..1.1);
        let mut off = |px: u32| random.random_range(-0.1..0.1) * f64::from(px);
        let (cx_px, cy_px) = (nominal.cx_px + off(width_px), nominal.cy_px + off(height_px));
        let k1 = random.random_range(-0.3..0.3);
        let (fx_px, fy_px) = (focal_px * factor, focal_px * factor * squeeze);
        let mut camera = CameraIntrinsics { fx_px, fy_px, cx_px, cy_px, distortion: [k1, 0.0, 0.0, 0.0, 0.0] };
        // A wide lens folds over with a distortion that a long one bears.
        while !is_plausible(&camera, (width_px, height_px)) && camera.distortion[0].abs() > 1e-3 {
            camera.distortion[0] /= 2.0;
        }
        camera
    };
    let known = [(left, right), (plain(left), plain(right)), (nominal, nominal)];
    known.into_iter().chain(std::iter::repeat_with(|| (anyhow(), anyhow()))).take(count).collect()
}
