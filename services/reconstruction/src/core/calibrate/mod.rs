//! Calibrates a rig from checkerboard pairs (thesis chapter 3): intrinsics, distortion and the pose of the right camera, how well
//! each is known, and what that means for depth.
//!
//! Corners are found by OpenCV, each camera alone is calibrated by OpenCV (Zhang's method), and from there on a bundle
//! adjustment of our own takes both cameras, the rig, every board pose and the board's warp together.

mod agreement;
mod board;
mod bundle;
mod by_views;
mod check;
mod coverage;
mod error;
mod fit;
mod look;
mod model;
mod rows;
mod sighting;
mod start;
#[cfg(test)]
mod tests;
mod uncertainty;

pub use board::BoardSpec;
pub use by_views::ErrorByViews;
pub use coverage::CoverageMap;
pub use error::CalibrateError;
pub use model::DistortionModel;
pub use rows::{RowError, camera_infos};
pub use sighting::ViewProblem;
pub use uncertainty::{DepthUncertainty, SIGMAS_95, Sigmas, rotation_vector_rad};

use bundle::{Free, Guess, Scene, covariance, minimise};
use fit::{RigFit, Search};
use halcyon_model::{Image, RigCalibration};
use nalgebra::{Rotation3, Vector2, Vector3};
use opencv::core::Point2f;
use sighting::{Residuals, Side, Sighting};
use start::Cameras;

/// The fewest views that fix both cameras.
pub const VIEWS_MIN: usize = 3;
/// At most this share of the corners is ever rejected as outliers; more means that something else is wrong.
const CORNERS_REJECTED_MAX: f64 = 0.03;
/// Rounds of leaving out corners; each takes at most one of every view.
const CORNER_ROUNDS: u32 = 50;

/// What a calibration is asked to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Take the board for flat; otherwise its warp is estimated where the data earn it.
    pub flat_board: bool,
    /// How many starts the joint search is given.
    pub starts: usize,
    /// Depth that the map of uncertainty is for, metres.
    pub depth_at_m: f64,
    /// Seed of the starts and of the subsets of [`ErrorByViews`].
    pub seed: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self { flat_board: false, starts: 12, depth_at_m: 1.0, seed: 1 }
    }
}

/// How one view did.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewQuality {
    /// Why it takes no part, or `None` where it does.
    pub problem: Option<ViewProblem>,
    /// Mean distance from seen to predicted corner in the left picture, pixels (3-21); NaN where no board was found.
    pub left_error_px: f64,
    /// The same on the right.
    pub right_error_px: f64,
    /// Root mean square of both, pixels.
    pub rms_px: f64,
    /// Corners left out of the left and the right picture.
    pub corners_rejected: [usize; 2],
    /// Seen minus predicted of every corner of the left picture, pixels, row-major; empty where no board was found.
    pub left_residuals_px: Vec<Vector2<f64>>,
    /// The same of the right picture.
    pub right_residuals_px: Vec<Vector2<f64>>,
}

impl ViewQuality {
    fn without_board(problem: Option<ViewProblem>) -> Self {
        Self {
            problem,
            left_error_px: f64::NAN,
            right_error_px: f64::NAN,
            rms_px: f64::NAN,
            corners_rejected: [0, 0],
            left_residuals_px: Vec::new(),
            right_residuals_px: Vec::new(),
        }
    }
}

/// A calibrated rig, and how far it can be trusted.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// The rig. `body_from_camera` and `camera_in_body_m` are the defaults: a board says nothing about the mount.
    pub rig: RigCalibration,
    /// The distortion model that the data earned.
    pub model: DistortionModel,
    /// The board's warp: how far the middle of its columns and of its rows stands out towards +z of the board (away from the
    /// cameras), metres. `None` where it was taken for flat, or no warp was earned.
    pub board_warp_m: Option<Vector2<f64>>,
    /// Standard deviations of all of these.
    pub sigmas: Sigmas,
    /// What they mean for depth.
    pub depth: DepthUncertainty,
    /// Every given pair, in order.
    pub views: Vec<ViewQuality>,
    /// Corners seen in the pairs where both boards were found, each counted once left and once right.
    pub corners_total: usize,
    /// Of those, the ones left out as outliers, and all of views left out.
    pub corners_rejected: usize,
    /// Root mean square **distance** from seen to predicted corner over both cameras and the corners used, pixels: what OpenCV's
    /// `stereoCalibrate` returns.
    pub stereo_rms_px: f64,
    /// The same before any corner or view was left out, with a flat board.
    pub stereo_rms_all_px: f64,
    /// The left camera's part of `stereo_rms_px`.
    pub left_rms_px: f64,
    /// The right camera's part.
    pub right_rms_px: f64,
    /// Mean over the used views of the mean error of both pictures (3-20), pixels.
    pub mean_error_px: f64,
    /// What is left of the vertical disparity after rectification.
    pub row_error: RowError,
    /// Where in the left picture corners were seen.
    pub coverage_left: CoverageMap,
    /// Where in the right picture.
    pub coverage_right: CoverageMap,
    /// Error against the number of views (thesis figure 3-7).
    pub error_by_views: Vec<ErrorByViews>,
    /// Starts of the joint search with the chosen model.
    pub starts: usize,
    /// Of those, how many ended at the best solution. 1 of several is a reason for doubt.
    pub starts_agreeing: usize,
}

/// [`calibrate_with`] with default options and without progress.
///
/// # Errors
/// As [`calibrate_with`].
pub fn calibrate(views: &[(Image, Image)], board: BoardSpec) -> Result<Calibration, CalibrateError> {
    calibrate_with(views, board, &Options::default(), &mut |_, _| {})
}

/// Calibrates a rig from pairs of pictures (left, right) of `board`, taken at the same instant each.
///
/// `progress` is told how many of all pairs have been searched for corners.
///
/// # Errors
/// [`CalibrateError`] where pictures differ in size or are given twice, the board is nowhere or another one, fewer than
/// [`VIEWS_MIN`] pairs can be used, left and right are swapped, or the views do not determine the cameras.
pub fn calibrate_with(
    views: &[(Image, Image)],
    board: BoardSpec,
    options: &Options,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Calibration, CalibrateError> {
    let size = look::common_size(views)?;
    look::require_different(views)?;
    let (sightings, quality) = look::look(views, &board, progress)?;
    if sightings.len() < VIEWS_MIN {
        return Err(look::explain_missing(views, &board, sightings.len())?);
    }
    look::require_whole(views, &board, &sightings)?;
    calibrate_sightings(sightings, quality, &board, size, options)
}

/// Where both cameras saw the corners of a board, pixels, in the board's row-major order.
#[derive(Debug, Clone, PartialEq)]
pub struct CornerPair {
    /// In the left picture.
    pub left: Vec<Vector2<f64>>,
    /// In the right picture.
    pub right: Vec<Vector2<f64>>,
}

/// Calibrates from corners that are known already, of another detector or of a simulation; `size` is the pictures' width and
/// height, pixels.
///
/// # Errors
/// As [`calibrate_with`], and [`CalibrateError::Corners`] where a view has not one finite pixel for each corner.
pub fn calibrate_corners(
    views: &[CornerPair],
    board: BoardSpec,
    size: (u32, u32),
    options: &Options,
) -> Result<Calibration, CalibrateError> {
    let mut sightings = Vec::with_capacity(views.len());
    for (view, pair) in views.iter().enumerate() {
        let expected = board.corners();
        let finite = pair.left.iter().chain(&pair.right).all(|pixel| pixel.iter().all(|at| at.is_finite()));
        if pair.left.len() != expected || pair.right.len() != expected || !finite {
            return Err(CalibrateError::Corners { view, left: pair.left.len(), right: pair.right.len(), expected });
        }
        let points = |pixels: &[Vector2<f64>]| pixels.iter().map(|p| Point2f::new(p.x as f32, p.y as f32)).collect();
        sightings.push(Sighting::new(view, points(&pair.left), points(&pair.right)));
    }
    require_views(&sightings, views.len())?;
    calibrate_sightings(sightings, vec![ViewQuality::without_board(None); views.len()], &board, size, options)
}

fn calibrate_sightings(
    mut sightings: Vec<Sighting>,
    mut quality: Vec<ViewQuality>,
    board: &BoardSpec,
    size: (u32, u32),
    options: &Options,
) -> Result<Calibration, CalibrateError> {
    let distance_m = options.depth_at_m;
    if !(distance_m.is_finite() && distance_m > 0.0) {
        return Err(CalibrateError::Distance { distance_m });
    }
    let found = sightings.len();
    let degenerate = || CalibrateError::Degenerate { views: found };
    let alone = start::alone(&sightings, board, size)?.ok_or_else(degenerate)?;
    agreement::settle(&mut sightings, board, &alone.0, &alone.1)?;
    require_views(&sightings, quality.len())?;

    let work = Work { board, size, options };
    let plain = work.plain(&sightings, alone)?.ok_or_else(degenerate)?;
    let (fit, residuals) = work.reject_outliers(&mut sightings, &plain)?.ok_or_else(degenerate)?;
    require_views(&sightings, quality.len())?;
    let (search, residuals) = work.verify(&sightings, alone, fit, residuals)?;
    let fit = search.best;

    let scene = Scene::new(&sightings, board);
    let rig = rig_from_guess(&fit.solved.guess, size);
    let baseline_m = rig.baseline_m();
    let centre_m = -(rig.right_from_left.transpose() * rig.right_from_left_m);
    if centre_m.x < 0.0 && centre_m.x.abs() > centre_m.y.abs() {
        return Err(CalibrateError::Swapped { baseline_m });
    }
    let covariance = covariance(&scene, &fit.solved, &fit.free()).ok_or_else(degenerate)?;

    for (sighting, residuals) in sightings.iter().zip(&residuals) {
        quality[sighting.view] = view_quality(sighting, residuals);
    }
    let used = || sightings.iter().zip(&residuals).filter(|(sighting, _)| sighting.is_used());
    let corners_total = 2 * sightings.len() * board.corners();
    let corners_used: usize = used().map(|(sighting, _)| sighting.kept_count()).sum();
    let errors: Vec<f64> = quality
        .iter()
        .filter(|view| view.problem.is_none())
        .map(|view| (view.left_error_px + view.right_error_px) / 2.0)
        .collect();
    Ok(Calibration {
        rig,
        model: fit.model,
        board_warp_m: fit.warp.then_some(fit.solved.guess.warp_m),
        sigmas: Sigmas::new(&rig, &covariance),
        depth: DepthUncertainty::new(&rig, &covariance, distance_m),
        corners_total,
        corners_rejected: corners_total - corners_used,
        stereo_rms_px: fit.rms_px,
        stereo_rms_all_px: plain.rms_px,
        left_rms_px: check::rms_px(used(), &[Side::Left]),
        right_rms_px: check::rms_px(used(), &[Side::Right]),
        mean_error_px: errors.iter().sum::<f64>() / errors.len() as f64,
        row_error: rows::row_error(&rig, &sightings)?,
        coverage_left: CoverageMap::new(&sightings, Side::Left, size),
        coverage_right: CoverageMap::new(&sightings, Side::Right, size),
        error_by_views: by_views::error_by_views(&scene, &fit, size, options.seed),
        starts: search.starts,
        starts_agreeing: search.agreeing,
        views: quality,
    })
}

fn require_views(sightings: &[Sighting], views: usize) -> Result<(), CalibrateError> {
    let usable = sightings.iter().filter(|sighting| sighting.is_used()).count();
    if usable < VIEWS_MIN { Err(CalibrateError::TooFewViews { views, usable }) } else { Ok(()) }
}

/// What every step of one calibration needs.
struct Work<'a> {
    board: &'a BoardSpec,
    size: (u32, u32),
    options: &'a Options,
}

impl Work<'_> {
    /// The best of many starts with everything that was seen and a flat board; `None` where the views do not determine it.
    fn plain(&self, sightings: &[Sighting], alone: Cameras) -> Result<Option<RigFit>, CalibrateError> {
        let starts = start::cameras(alone, self.size, self.options.starts.max(1), self.options.seed);
        let simple = (DistortionModel::Radial2, false);
        let Some(search) = fit::search(sightings, self.board, self.size, &starts, simple)? else { return Ok(None) };
        let scene = Scene::new(sightings, self.board);
        Ok(fit::choose(&scene, &search.best.solved.guess, false, self.size))
    }

    /// Leaves out views and corners that do not belong, one view or one round of corners at a time, and solves again in between.
    /// The board's warp is free already: a warped board makes good corners look bad.
    fn reject_outliers(
        &self,
        sightings: &mut [Sighting],
        plain: &RigFit,
    ) -> Result<Option<(RigFit, Vec<Residuals>)>, CalibrateError> {
        let scene = Scene::new(sightings, self.board);
        let may_warp = !self.options.flat_board;
        let Some(mut fit) = fit::choose(&scene, &plain.solved.guess, may_warp, self.size) else { return Ok(None) };
        let mut residuals = self.residuals(sightings, &fit.solved.guess)?;
        let mut corner_rounds = 0;
        // Ends: each round takes out a view, of which half stay, or is one of a few rounds of corners.
        loop {
            let before: Vec<bool> = sightings.iter().map(Sighting::is_used).collect();
            if !check::reject_worst_view(sightings, &residuals) {
                if corner_rounds == CORNER_ROUNDS || !check::reject_corners(sightings, &residuals, CORNERS_REJECTED_MAX) {
                    break;
                }
                corner_rounds += 1;
            }
            let mut from = fit.solved.guess.clone();
            let mut used = before.iter().zip(sightings.iter()).filter(|(before, _)| **before).map(|(_, now)| now.is_used());
            from.poses.retain(|_| used.next().unwrap_or(false));
            let Some(next) = fit.again(&Scene::new(sightings, self.board), &from, self.size) else { return Ok(None) };
            fit = next;
            residuals = self.residuals(sightings, &fit.solved.guess)?;
        }
        // What went may have been what a richer model was for.
        let scene = Scene::new(sightings, self.board);
        let Some(fit) = fit::choose(&scene, &fit.solved.guess, may_warp, self.size) else { return Ok(None) };
        let residuals = self.residuals(sightings, &fit.solved.guess)?;
        Ok(Some((fit, residuals)))
    }

    /// The final model once more from many starts; takes what is better, should there be any.
    fn verify(
        &self,
        sightings: &[Sighting],
        alone: Cameras,
        fit: RigFit,
        residuals: Vec<Residuals>,
    ) -> Result<(Search, Vec<Residuals>), CalibrateError> {
        let starts = start::cameras(alone, self.size, self.options.starts.max(1), self.options.seed.wrapping_add(1));
        let search = fit::search(sightings, self.board, self.size, &starts, (fit.model, fit.warp))?;
        match search {
            Some(search) if search.best.rms_px < fit.rms_px * (1.0 - fit::SAME_END) => {
                let residuals = self.residuals(sightings, &search.best.solved.guess)?;
                Ok((search, residuals))
            }
            Some(search) => Ok((Search { best: fit, ..search }, residuals)),
            None => Ok((Search { best: fit, starts: starts.len(), agreeing: 0 }, residuals)),
        }
    }

    /// Of every view; one that takes no part gets the board pose that suits it best.
    fn residuals(&self, sightings: &[Sighting], guess: &Guess) -> Result<Vec<Residuals>, CalibrateError> {
        let mut poses = guess.poses.iter();
        let mut all = Vec::with_capacity(sightings.len());
        for sighting in sightings {
            let pose = match sighting.is_used() {
                true => poses.next().copied(),
                false => self.place(sighting, guess)?,
            };
            all.push(match pose {
                Some(pose) => sighting.residuals(self.board, guess, &pose),
                None => Residuals::unknown(sighting.left.len()),
            });
        }
        Ok(all)
    }

    fn place(&self, sighting: &Sighting, guess: &Guess) -> Result<Option<sighting::Pose>, CalibrateError> {
        let Some(pose) = sighting::Pose::of_board(self.board, &sighting.left, &guess.left)? else { return Ok(None) };
        let scene = Scene { board: *self.board, views: vec![bundle::View::new(sighting)] };
        let placed = minimise(&scene, &Guess { poses: vec![pose], ..guess.clone() }, &Free::POSES);
        Ok(Some(placed.map_or(pose, |placed| placed.guess.poses[0])))
    }
}

fn view_quality(sighting: &Sighting, residuals: &Residuals) -> ViewQuality {
    let mean = |side: Side| {
        let (sum, count) =
            sighting.kept(side).fold((0.0, 0), |(sum, count), i| (sum + residuals.of(side)[i].norm(), count + 1));
        sum / f64::from(count)
    };
    let rejected = |side: Side| sighting.keep(side).iter().filter(|keep| !**keep).count();
    ViewQuality {
        problem: sighting.problem,
        left_error_px: mean(Side::Left),
        right_error_px: mean(Side::Right),
        rms_px: check::rms_px(std::iter::once((sighting, residuals)), &Side::BOTH),
        corners_rejected: [rejected(Side::Left), rejected(Side::Right)],
        left_residuals_px: residuals.left.clone(),
        right_residuals_px: residuals.right.clone(),
    }
}

fn rig_from_guess(guess: &Guess, (width_px, height_px): (u32, u32)) -> RigCalibration {
    // Many small turns leave rounding in a matrix; a quaternion has none of it.
    let rotation = Rotation3::from_matrix_unchecked(guess.right_from_left);
    let rotation = nalgebra::UnitQuaternion::from_rotation_matrix(&rotation).to_rotation_matrix();
    RigCalibration {
        width_px,
        height_px,
        left: guess.left,
        right: guess.right,
        right_from_left: rotation.into_inner(),
        right_from_left_m: guess.right_from_left_m,
        body_from_camera: RigCalibration::LOOKING_DOWN,
        camera_in_body_m: Vector3::zeros(),
    }
}
