//! `halcyon calibrate`

use std::path::{Path, PathBuf};

use halcyon_model::{CameraIntrinsics, Image};
use serde::Serialize;

use crate::core::calibrate::{BoardSpec, CalibrateError, Calibration, ViewProblem, ViewQuality, calibrate_with};
use crate::files::{FileError, GlobError, glob, read_picture, write_bytes};

/// Why there is no calibration.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateCliError {
    /// `--board` is not two numbers.
    #[error("a board is given as COLSxROWS inner corners, such as 9x6, not {0:?}")]
    Board(String),
    /// A pattern without files.
    #[error(transparent)]
    Glob(#[from] GlobError),
    /// A left picture without a right one.
    #[error("{left} left and {right} right pictures: every left one needs its right one")]
    Unpaired {
        /// Left pictures.
        left: usize,
        /// Right pictures.
        right: usize,
    },
    /// A file.
    #[error(transparent)]
    File(#[from] FileError),
    /// The pictures themselves.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
}

/// One camera, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraReport {
    /// Focal length along x, pixels.
    pub fx_px: f64,
    /// Focal length along y, pixels.
    pub fy_px: f64,
    /// Principal point x, pixels.
    pub cx_px: f64,
    /// Principal point y, pixels.
    pub cy_px: f64,
    /// k1, k2, p1, p2, k3.
    pub distortion: [f64; 5],
    /// Its part of the stereo reprojection error, pixels.
    pub rms_px: f64,
    /// Share of the picture in which corners were seen, 0 to 1.
    pub coverage: f64,
}

impl CameraReport {
    fn new(camera: &CameraIntrinsics, rms_px: f64, coverage: f64) -> Self {
        let CameraIntrinsics { fx_px, fy_px, cx_px, cy_px, distortion } = *camera;
        Self { fx_px, fy_px, cx_px, cy_px, distortion, rms_px, coverage }
    }
}

/// One pair, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ViewReport {
    /// Left picture.
    pub left: PathBuf,
    /// Right picture.
    pub right: PathBuf,
    /// Whether it took part.
    pub used: bool,
    /// Why not.
    pub problem: Option<&'static str>,
    /// Mean reprojection error of the left picture, pixels (thesis 3-21); absent where no board was found.
    pub left_error_px: Option<f64>,
    /// The same of the right picture.
    pub right_error_px: Option<f64>,
    /// Root mean square of both.
    pub rms_px: Option<f64>,
}

impl ViewReport {
    fn new(left: &Path, right: &Path, quality: &ViewQuality) -> Self {
        let known = |value: f64| value.is_finite().then_some(value);
        Self {
            left: left.into(),
            right: right.into(),
            used: quality.problem.is_none(),
            problem: quality.problem.map(ViewProblem::name),
            left_error_px: known(quality.left_error_px),
            right_error_px: known(quality.right_error_px),
            rms_px: known(quality.rms_px),
        }
    }
}

/// The result, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CalibrateReport {
    /// Pairs given.
    pub views_total: usize,
    /// Pairs that took part.
    pub views_used: usize,
    /// Corners found, each once for left and right together.
    pub corners_total: usize,
    /// Corners left out.
    pub corners_rejected: usize,
    /// Root mean square reprojection error of the corners used, pixels.
    pub stereo_rms_px: f64,
    /// The same before anything was left out.
    pub stereo_rms_all_px: f64,
    /// Mean over the views of the mean error of both pictures, pixels (thesis 3-20).
    pub mean_error_px: f64,
    /// Distance between the cameras, metres.
    pub baseline_m: f64,
    /// Root mean square vertical disparity after rectification, pixels.
    pub row_error_rms_px: f64,
    /// Largest vertical disparity after rectification, pixels.
    pub row_error_max_px: f64,
    /// Free distortion coefficients.
    pub distortion_model: &'static str,
    /// Starts of the search.
    pub starts: u32,
    /// Starts that ended at the best solution.
    pub starts_agreeing: u32,
    /// Picture width, pixels.
    pub width_px: u32,
    /// Picture height, pixels.
    pub height_px: u32,
    /// The left camera.
    pub left: CameraReport,
    /// The right camera.
    pub right: CameraReport,
    /// Each pair.
    pub views: Vec<ViewReport>,
}

/// Calibrates from the pictures that two patterns name, paired in natural order, and writes `out` (OpenCV YAML) where given.
///
/// `board` is `COLSxROWS` inner corners; `progress` is told how many of all pairs have been searched.
///
/// # Errors
/// [`CalibrateCliError`]: one line that says which file or what number is at fault.
pub fn calibrate(
    left_glob: &str,
    right_glob: &str,
    board: &str,
    square_m: f64,
    out: Option<&Path>,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<CalibrateReport, CalibrateCliError> {
    let board = parse_board(board, square_m)?;
    let (left, right) = (glob(left_glob)?, glob(right_glob)?);
    if left.len() != right.len() {
        return Err(CalibrateCliError::Unpaired { left: left.len(), right: right.len() });
    }
    let views: Vec<(Image, Image)> = left
        .iter()
        .zip(&right)
        .map(|(left, right)| Ok((read_picture(left)?, read_picture(right)?)))
        .collect::<Result<_, FileError>>()?;
    let calibration = calibrate_with(&views, board, progress)?;
    if let Some(out) = out {
        write_bytes(out, halcyon_model::rig_yaml::write(&calibration.rig).as_bytes())?;
    }
    Ok(report(&calibration, &left, &right))
}

fn parse_board(text: &str, square_m: f64) -> Result<BoardSpec, CalibrateCliError> {
    let sides =
        text.split_once(['x', 'X', '×']).and_then(|(cols, rows)| Some((cols.trim().parse().ok()?, rows.trim().parse().ok()?)));
    let (cols, rows) = sides.ok_or_else(|| CalibrateCliError::Board(text.chars().take(40).collect()))?;
    Ok(BoardSpec::new(cols, rows, square_m)?)
}

fn report(calibration: &Calibration, left: &[PathBuf], right: &[PathBuf]) -> CalibrateReport {
    let rig = &calibration.rig;
    let views: Vec<ViewReport> = calibration
        .views
        .iter()
        .zip(left.iter().zip(right))
        .map(|(view, (left, right))| ViewReport::new(left, right, view))
        .collect();
    CalibrateReport {
        views_total: views.len(),
        views_used: views.iter().filter(|view| view.used).count(),
        corners_total: calibration.corners_total,
        corners_rejected: calibration.corners_rejected,
        stereo_rms_px: calibration.stereo_rms_px,
        stereo_rms_all_px: calibration.stereo_rms_all_px,
        mean_error_px: calibration.mean_error_px,
        baseline_m: rig.baseline_m(),
        row_error_rms_px: calibration.row_error.rms_px,
        row_error_max_px: calibration.row_error.max_px,
        distortion_model: calibration.model.name(),
        starts: calibration.starts,
        starts_agreeing: calibration.starts_agreeing,
        width_px: rig.width_px,
        height_px: rig.height_px,
        left: CameraReport::new(&rig.left, calibration.left_rms_px, calibration.coverage_left),
        right: CameraReport::new(&rig.right, calibration.right_rms_px, calibration.coverage_right),
        views,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_are_two_numbers() {
        assert!(parse_board("9x6", 0.03).is_ok());
        for bad in ["", "9", "9x", "x6", "9x6x1", "-9x6", "9.5x6", "9 by 6"] {
            assert!(matches!(parse_board(bad, 0.03), Err(CalibrateCliError::Board(_))), "{bad}");
        }
        assert!(matches!(parse_board("1x1", 0.03), Err(CalibrateCliError::Calibrate(CalibrateError::Board { .. }))));
    }
}
