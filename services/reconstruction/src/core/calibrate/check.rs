//! How good a calibration is, and which views and corners do not belong.

use nalgebra::Vector2;
use opencv::Result;
use opencv::calib3d;
use opencv::core::{Mat, Point2f, Rect, Size, Vector};

use super::VIEWS_MIN;
use super::fit::RigFit;
use super::sighting::{Residuals, Sighting, ViewProblem};
use crate::core::cv;

/// A view goes when its error is this many times the median view's …
const VIEW_ERROR_RATIO_MAX: f64 = 3.0;
/// … and above this, pixels: with near-perfect pictures ratios mean nothing.
const VIEW_ERROR_PX_MIN: f64 = 0.25;
/// A corner goes when its residual is this many standard deviations long, where one in four million would by chance.
const CORNER_SIGMAS_MAX: f64 = 5.5;

/// Vertical disparity that rectification leaves, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowError {
    /// Root mean square.
    pub rms_px: f64,
    /// Largest.
    pub max_px: f64,
}

/// Which camera's residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    Left,
    Right,
    Both,
}

/// Root mean square residual of the kept corners, pixels.
pub(super) fn rms_px<'a>(views: impl Iterator<Item = (&'a Sighting, &'a Residuals)>, side: Side) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for (sighting, residuals) in views {
        for i in sighting.kept_corners() {
            if side != Side::Right {
                sum += residuals.left[i].norm_squared();
                count += 1;
            }
            if side != Side::Left {
                sum += residuals.right[i].norm_squared();
                count += 1;
            }
        }
    }
    (sum / count as f64).sqrt()
}

/// Median residual of a view's kept corners, pixels. Robust: a single bad corner does not make a bad view.
fn median_px(sighting: &Sighting, residuals: &Residuals) -> f64 {
    let mut lengths: Vec<f64> =
        sighting.kept_corners().flat_map(|i| [residuals.left[i].norm(), residuals.right[i].norm()]).collect();
    let middle = lengths.len() / 2;
    if lengths.is_empty() { f64::NAN } else { *lengths.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Marks the worst view where its error is far above the median view's; says whether one went. One at a time: a bad view
/// drags the solution along and makes good ones look bad. Keeps at least half of the views, and [`VIEWS_MIN`]: where more look
/// bad, the good ones are not known.
pub(super) fn reject_worst_view(sightings: &mut [Sighting], residuals: &[Residuals]) -> bool {
    let mut errors: Vec<(usize, f64)> = (0..sightings.len())
        .filter(|&view| sightings[view].is_used())
        .map(|view| (view, median_px(&sightings[view], &residuals[view])))
        .collect();
    errors.sort_by(|a, b| b.1.total_cmp(&a.1));
    let limit_px = (errors[errors.len() / 2].1 * VIEW_ERROR_RATIO_MAX).max(VIEW_ERROR_PX_MIN);
    let kept_min = sightings.len().div_ceil(2).max(VIEWS_MIN);
    let (worst, error_px) = errors[0];
    // A NaN error is a view whose pose has no solution: it goes, too.
    let goes = errors.len() > kept_min && (error_px > limit_px || error_px.is_nan());
    if goes {
        sightings[worst].problem = Some(ViewProblem::LargeError);
    }
    goes
}

/// Leaves out corners whose residual, in either picture, is too long for the scatter of all; says whether any went. Where that
/// would be more than `share_max` of all corners it is the model that is wrong, not the corners: only the worst go.
pub(super) fn reject_corners(sightings: &mut [Sighting], residuals: &[Residuals], share_max: f64) -> bool {
    let mut lengths: Vec<(f64, usize, usize)> = Vec::new();
    let mut total = 0;
    let mut gone = 0;
    for (view, (sighting, residuals)) in sightings.iter().zip(residuals).enumerate().filter(|(_, (s, _))| s.is_used()) {
        total += sighting.keep.len();
        gone += sighting.keep.iter().filter(|keep| !**keep).count();
        let worst = |i: usize| residuals.left[i].norm().max(residuals.right[i].norm());
        lengths.extend(sighting.kept_corners().map(|i| (worst(i), view, i)));
    }
    lengths.sort_by(|a, b| b.0.total_cmp(&a.0));
    // The larger of two Rayleigh lengths has its median at 1.567 standard deviations.
    let sigma_px = lengths[lengths.len() / 2].0 / 1.567;
    let spare = ((total as f64 * share_max) as usize).saturating_sub(gone);
    let mut went = false;
    let mut seen = vec![false; sightings.len()];
    for (length_px, view, i) in lengths.into_iter().take(spare) {
        // One of a view at a time: it drags the board's pose along and makes its neighbours look bad. And never so many that
        // the pose hangs on a few corners.
        let kept = sightings[view].kept_corners().count();
        let had_its_turn = std::mem::replace(&mut seen[view], true);
        if length_px > CORNER_SIGMAS_MAX * sigma_px && !had_its_turn && kept > sightings[view].keep.len() / 2 {
            sightings[view].keep[i] = false;
            went = true;
        }
    }
    went
}

/// Vertical distance between the same corner left and right after rectification.
pub(super) fn row_error(fit: &RigFit, sightings: &[Sighting], (width_px, height_px): (u32, u32)) -> Result<RowError> {
    let (left_matrix, left_distortion) = (cv::mat_from_matrix3(&fit.left.matrix())?, cv::mat_from_distortion(&fit.left)?);
    let (right_matrix, right_distortion) = (cv::mat_from_matrix3(&fit.right.matrix())?, cv::mat_from_distortion(&fit.right)?);
    let (mut r1, mut r2, mut p1, mut p2, mut q) =
        (Mat::default(), Mat::default(), Mat::default(), Mat::default(), Mat::default());
    let size = Size::new(width_px as i32, height_px as i32);
    calib3d::stereo_rectify(
        &left_matrix,
        &left_distortion,
        &right_matrix,
        &right_distortion,
        size,
        &cv::mat_from_matrix3(&fit.right_from_left)?,
        &cv::mat_from_vector3(&fit.right_from_left_m)?,
        &mut r1,
        &mut r2,
        &mut p1,
        &mut p2,
        &mut q,
        calib3d::CALIB_ZERO_DISPARITY,
        -1.0,
        size,
        None::<&mut Rect>,
        None::<&mut Rect>,
    )?;
    let (mut sum, mut count, mut max_px) = (0.0, 0_usize, 0.0_f64);
    for sighting in sightings.iter().filter(|sighting| sighting.is_used()) {
        let left: Vector<Point2f> = sighting.kept_corners().map(|i| sighting.left[i]).collect();
        let right: Vector<Point2f> = sighting.kept_corners().map(|i| sighting.right[i]).collect();
        let (mut left_rectified, mut right_rectified) = (Vector::<Point2f>::new(), Vector::<Point2f>::new());
        calib3d::undistort_points(&left, &mut left_rectified, &left_matrix, &left_distortion, &r1, &p1)?;
        calib3d::undistort_points(&right, &mut right_rectified, &right_matrix, &right_distortion, &r2, &p2)?;
        for (left, right) in left_rectified.iter().zip(&right_rectified) {
            // A rig whose cameras sit one above the other is rectified along columns.
            let along_rows = fit.right_from_left_m.x.abs() >= fit.right_from_left_m.y.abs();
            let error_px = f64::from(if along_rows { left.y - right.y } else { left.x - right.x });
            sum += error_px * error_px;
            count += 1;
            max_px = max_px.max(error_px.abs());
        }
    }
    Ok(RowError { rms_px: (sum / count as f64).sqrt(), max_px })
}

/// Share of the picture's 8 × 6 fields in which a used corner was seen.
pub(super) fn coverage<'a>(
    views: impl Iterator<Item = (&'a Sighting, &'a Vec<Point2f>)>,
    (width_px, height_px): (u32, u32),
) -> f64 {
    const COLS: usize = 8;
    const ROWS: usize = 6;
    let mut seen = [[false; COLS]; ROWS];
    for (sighting, corners) in views.filter(|(sighting, _)| sighting.is_used()) {
        for i in sighting.kept_corners() {
            let at =
                Vector2::new(f64::from(corners[i].x) / f64::from(width_px), f64::from(corners[i].y) / f64::from(height_px));
            let field = |share: f64, fields: usize| ((share * fields as f64) as usize).min(fields - 1);
            seen[field(at.y, ROWS)][field(at.x, COLS)] = true;
        }
    }
    seen.iter().flatten().filter(|seen| **seen).count() as f64 / (COLS * ROWS) as f64
}
