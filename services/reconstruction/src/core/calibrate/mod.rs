//! Calibrates a rig from checkerboard pairs (thesis chapter 3): intrinsics, distortion and the pose of the right camera.

mod agreement;
mod board;
mod check;
mod fit;
mod sighting;
#[cfg(test)]
mod tests;

pub use board::BoardSpec;
pub use check::RowError;
pub use fit::DistortionModel;
use fit::{Points, RigFit};
use halcyon_model::{CameraIntrinsics, Image, RigCalibration};
use nalgebra::Vector3;
pub use sighting::ViewProblem;
use sighting::{Residuals, Sighting};

/// The fewest views that fix both cameras.
pub const VIEWS_MIN: usize = 3;
/// At most this share of the corners is ever rejected as outliers; more means that something else is wrong.
const CORNERS_REJECTED_MAX: f64 = 0.03;
/// Rounds of leaving out corners: after the first few nothing new turns up.
const CORNER_ROUNDS: u32 = 6;

/// Why there is no calibration.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateError {
    /// No such board.
    #[error("a board needs 3 to 64 inner corners a side and squares wider than 0 m, not {cols}x{rows} of {square_m} m")]
    Board {
        /// Inner corners along a row.
        cols: u32,
        /// Inner corners along a column.
        rows: u32,
        /// Side of a square, metres.
        square_m: f64,
    },
    /// Pictures of different sizes.
    #[error(
        "pair {} has pictures of {left_width_px}x{left_height_px} and {right_width_px}x{right_height_px} px, the first left one \
         has {width_px}x{height_px}: all must be of one size",
        view + 1
    )]
    MixedSizes {
        /// The first pair that differs, from 0.
        view: usize,
        /// Its left picture's width.
        left_width_px: u32,
        /// Its left picture's height.
        left_height_px: u32,
        /// Its right picture's width.
        right_width_px: u32,
        /// Its right picture's height.
        right_height_px: u32,
        /// What the first left picture has.
        width_px: u32,
        /// What the first left picture has.
        height_px: u32,
    },
    /// No board anywhere.
    #[error("no board of {cols}x{rows} inner corners was found in any of {pictures} pictures")]
    NoBoard {
        /// Inner corners along a row, as asked.
        cols: u32,
        /// Inner corners along a column, as asked.
        rows: u32,
        /// How many were searched.
        pictures: usize,
    },
    /// A board, but another one.
    #[error("no board of {cols}x{rows} inner corners was found; the pictures seem to show one of {seen_cols}x{seen_rows}")]
    WrongBoard {
        /// Inner corners along a row, as asked.
        cols: u32,
        /// Inner corners along a column, as asked.
        rows: u32,
        /// What a picture shows.
        seen_cols: u32,
        /// What a picture shows.
        seen_rows: u32,
    },
    /// Too few views to fix the cameras.
    #[error(
        "{usable} of {views} pairs can be used (the board seen whole on both sides, and left agreeing with right); at least {VIEWS_MIN} are needed"
    )]
    TooFewViews {
        /// Pairs given.
        views: usize,
        /// Pairs that can be used.
        usable: usize,
    },
    /// Views that do not fix a camera.
    #[error("{views} views do not determine the cameras: show the board tilted in several directions, near and far")]
    Degenerate {
        /// Views that were tried.
        views: usize,
    },
    /// OpenCV failed in a way that none of the above explains.
    #[error("OpenCV failed during calibration")]
    OpenCv(#[from] opencv::Error),
}

/// How one view did.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ViewQuality {
    /// Why it takes no part, or `None` where it does.
    pub problem: Option<ViewProblem>,
    /// Mean distance from seen to predicted corner in the left picture, pixels (3-21); NaN where no board was found.
    pub left_error_px: f64,
    /// The same on the right.
    pub right_error_px: f64,
    /// Root mean square of both, pixels.
    pub rms_px: f64,
}

/// A calibrated rig, and how far it can be trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The rig. `body_from_camera` and `camera_in_body_m` are the defaults: a board says nothing about the mount.
    pub rig: RigCalibration,
    /// The distortion model that the data earned.
    pub model: DistortionModel,
    /// Every given pair, in order.
    pub views: Vec<ViewQuality>,
    /// Corners seen in the pairs where both boards were found; each counts once for left and right together.
    pub corners_total: usize,
    /// Of those, the ones left out as outliers, and those of views left out.
    pub corners_rejected: usize,
    /// Root mean square distance from seen to predicted corner over both cameras and the corners used, pixels.
    pub stereo_rms_px: f64,
    /// The same before any corner or view was left out.
    pub stereo_rms_all_px: f64,
    /// The left camera's part of `stereo_rms_px`.
    pub left_rms_px: f64,
    /// The right camera's part.
    pub right_rms_px: f64,
    /// Mean over the used views of the mean error of both pictures (3-20), pixels.
    pub mean_error_px: f64,
    /// What is left of the vertical disparity after rectification.
    pub row_error: RowError,
    /// Share of the left picture, in 8 × 6 fields, in which a corner was seen.
    pub coverage_left: f64,
    /// Share of the right picture.
    pub coverage_right: f64,
    /// Starts of the joint search with the chosen model.
    pub starts: u32,
    /// Of those, how many ended at the best solution. 1 of several is a reason for doubt.
    pub starts_agreeing: u32,
}

/// [`calibrate_with`] without progress.
///
/// # Errors
/// As [`calibrate_with`].
pub fn calibrate(views: &[(Image, Image)], board: BoardSpec) -> Result<Calibration, CalibrateError> {
    calibrate_with(views, board, &mut |_, _| {})
}

/// Calibrates a rig from pairs of pictures (left, right) of `board`, taken at the same instant each.
///
/// `progress` is told how many of all pairs have been searched for corners.
///
/// # Errors
/// [`CalibrateError`] where pictures differ in size, the board is nowhere or another one, fewer than [`VIEWS_MIN`] pairs can
/// be used, or the views do not determine the cameras.
pub fn calibrate_with(
    views: &[(Image, Image)],
    board: BoardSpec,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Calibration, CalibrateError> {
    let size = common_size(views)?;
    let (mut sightings, mut quality) = look(views, &board, progress)?;
    if sightings.len() < VIEWS_MIN {
        return Err(explain_missing(views, &board, sightings.len())?);
    }
    let degenerate = || CalibrateError::Degenerate { views: sightings.len() };
    let alone = Points::new(&sightings, &board, size).cameras(DistortionModel::Radial2)?.ok_or_else(degenerate)?;
    agreement::settle(&mut sightings, &board, &alone.0, &alone.1)?;
    require_views(&sightings, views.len())?;

    let (first, _) = solve(&sightings, &board, size)?;
    let stereo_rms_all_px = first.rms_px;
    let (fit, residuals) = reject_outliers(&mut sightings, &board, size, first)?;
    require_views(&sightings, views.len())?;

    for (sighting, residuals) in sightings.iter().zip(&residuals) {
        let (left, right) = (mean_error_px(sighting, &residuals.left), mean_error_px(sighting, &residuals.right));
        let rms_px = check::rms_px(std::iter::once((sighting, residuals)), check::Side::Both);
        quality[sighting.view] = ViewQuality { problem: sighting.problem, left_error_px: left, right_error_px: right, rms_px };
    }
    let used = || sightings.iter().zip(&residuals).filter(|(sighting, _)| sighting.is_used());
    let corners_total = sightings.len() * board.corners();
    let corners_used: usize = used().map(|(sighting, _)| sighting.kept_corners().count()).sum();
    let errors: Vec<f64> = quality
        .iter()
        .filter(|view| view.problem.is_none())
        .map(|view| (view.left_error_px + view.right_error_px) / 2.0)
        .collect();
    Ok(Calibration {
        rig: rig_from_fit(&fit, size),
        model: fit.model,
        corners_total,
        corners_rejected: corners_total - corners_used,
        stereo_rms_px: fit.rms_px,
        stereo_rms_all_px,
        left_rms_px: check::rms_px(used(), check::Side::Left),
        right_rms_px: check::rms_px(used(), check::Side::Right),
        mean_error_px: errors.iter().sum::<f64>() / errors.len() as f64,
        row_error: check::row_error(&fit, &sightings, size)?,
        coverage_left: check::coverage(sightings.iter().map(|sighting| (sighting, &sighting.left)), size),
        coverage_right: check::coverage(sightings.iter().map(|sighting| (sighting, &sighting.right)), size),
        starts: fit.starts,
        starts_agreeing: fit.starts_agreeing,
        views: quality,
    })
}

/// The size that all pictures share.
fn common_size(views: &[(Image, Image)]) -> Result<(u32, u32), CalibrateError> {
    let Some((first, _)) = views.first() else { return Err(CalibrateError::TooFewViews { views: 0, usable: 0 }) };
    let (width_px, height_px) = (first.width_px(), first.height_px());
    let differs = |image: &Image| (image.width_px(), image.height_px()) != (width_px, height_px);
    match views.iter().position(|(left, right)| differs(left) || differs(right)) {
        None => Ok((width_px, height_px)),
        Some(view) => Err(CalibrateError::MixedSizes {
            view,
            left_width_px: views[view].0.width_px(),
            left_height_px: views[view].0.height_px(),
            right_width_px: views[view].1.width_px(),
            right_height_px: views[view].1.height_px(),
            width_px,
            height_px,
        }),
    }
}

/// Searches every picture for the board.
fn look(
    views: &[(Image, Image)],
    board: &BoardSpec,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<(Vec<Sighting>, Vec<ViewQuality>), CalibrateError> {
    let mut sightings = Vec::new();
    let mut quality = Vec::with_capacity(views.len());
    for (view, (left, right)) in views.iter().enumerate() {
        let problem = match (board::find(left, board)?, board::find(right, board)?) {
            (Some(left), Some(right)) => {
                sightings.push(Sighting::new(view, left, right));
                None
            }
            (None, Some(_)) => Some(ViewProblem::NotFoundLeft),
            (Some(_), None) => Some(ViewProblem::NotFoundRight),
            (None, None) => Some(ViewProblem::NotFound),
        };
        quality.push(ViewQuality { problem, left_error_px: f64::NAN, right_error_px: f64::NAN, rms_px: f64::NAN });
        progress(view + 1, views.len());
    }
    Ok((sightings, quality))
}

/// Too few views have the board: because it is another one, because there is none, or just so.
fn explain_missing(views: &[(Image, Image)], board: &BoardSpec, usable: usize) -> Result<CalibrateError, CalibrateError> {
    let (cols, rows) = (board.cols(), board.rows());
    if usable > 0 {
        return Ok(CalibrateError::TooFewViews { views: views.len(), usable });
    }
    // A few pictures tell; all of them would take long for nothing.
    for (left, _) in views.iter().take(5) {
        if let Some((seen_cols, seen_rows)) = board::find_any(left)?
            && (seen_cols, seen_rows) != (cols, rows)
        {
            return Ok(CalibrateError::WrongBoard { cols, rows, seen_cols, seen_rows });
        }
    }
    Ok(CalibrateError::NoBoard { cols, rows, pictures: 2 * views.len() })
}

fn require_views(sightings: &[Sighting], views: usize) -> Result<(), CalibrateError> {
    let usable = sightings.iter().filter(|sighting| sighting.is_used()).count();
    if usable < VIEWS_MIN { Err(CalibrateError::TooFewViews { views, usable }) } else { Ok(()) }
}

fn solve(sightings: &[Sighting], board: &BoardSpec, size: (u32, u32)) -> Result<(RigFit, Vec<Residuals>), CalibrateError> {
    let used = sightings.iter().filter(|sighting| sighting.is_used()).count();
    let fit = Points::new(sightings, board, size).solve()?.ok_or(CalibrateError::Degenerate { views: used })?;
    let residuals = sightings.iter().map(|sighting| sighting.residuals(&fit, board)).collect::<Result<_, _>>()?;
    Ok((fit, residuals))
}

/// Leaves out views and corners that do not belong, one view or one round of corners at a time, and solves again in between.
fn reject_outliers(
    sightings: &mut [Sighting],
    board: &BoardSpec,
    size: (u32, u32),
    first: RigFit,
) -> Result<(RigFit, Vec<Residuals>), CalibrateError> {
    let residuals_of = |sightings: &[Sighting], fit: &RigFit| -> Result<Vec<Residuals>, CalibrateError> {
        Ok(sightings.iter().map(|sighting| sighting.residuals(fit, board)).collect::<Result<_, _>>()?)
    };
    let mut residuals = residuals_of(sightings, &first)?;
    let mut fit = first;
    let mut corner_rounds = 0;
    let mut went = false;
    // Ends: each round takes out a view, of which half stay, or is one of a few rounds of corners.
    loop {
        let view_went = check::reject_worst_view(sightings, &residuals);
        if !view_went {
            if corner_rounds == CORNER_ROUNDS || !check::reject_corners(sightings, &residuals, CORNERS_REJECTED_MAX) {
                break;
            }
            corner_rounds += 1;
        }
        went = true;
        let used = sightings.iter().filter(|sighting| sighting.is_used()).count();
        fit = Points::new(sightings, board, size).refine(&fit)?.ok_or(CalibrateError::Degenerate { views: used })?;
        residuals = residuals_of(sightings, &fit)?;
    }
    // What went may have been what a richer model was for.
    if went { solve(sightings, board, size) } else { Ok((fit, residuals)) }
}

fn mean_error_px(sighting: &Sighting, residuals: &[nalgebra::Vector2<f64>]) -> f64 {
    let (sum, count) = sighting.kept_corners().fold((0.0, 0), |(sum, count), i| (sum + residuals[i].norm(), count + 1));
    sum / f64::from(count)
}

fn rig_from_fit(fit: &RigFit, (width_px, height_px): (u32, u32)) -> RigCalibration {
    let camera = |camera: &CameraIntrinsics| *camera;
    RigCalibration {
        width_px,
        height_px,
        left: camera(&fit.left),
        right: camera(&fit.right),
        right_from_left: fit.right_from_left,
        right_from_left_m: fit.right_from_left_m,
        body_from_camera: RigCalibration::LOOKING_DOWN,
        camera_in_body_m: Vector3::zeros(),
    }
}
