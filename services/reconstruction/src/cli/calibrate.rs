//! `halcyon calibrate`

use std::path::Path;

use halcyon_model::{Image, RigCalibration};

use crate::core::calibrate::{BoardSpec, CalibrateError, Calibration, Options, calibrate_with, camera_infos};
use crate::files::{FileError, GlobError, RigFileError, glob, read_pair, read_rig, write_rig, write_ros};

mod report;

pub use report::{CalibrateReport, CameraReport, CoverageReport, DepthReport, ErrorByViewsReport, ViewReport};

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
    /// A picture or an output.
    #[error(transparent)]
    File(#[from] FileError),
    /// A calibration to convert.
    #[error(transparent)]
    Rig(#[from] RigFileError),
    /// The pictures themselves.
    #[error(transparent)]
    Calibrate(#[from] CalibrateError),
}

/// What `halcyon calibrate` is asked.
#[derive(Debug, Clone, Copy)]
pub struct CalibrateRequest<'a> {
    /// Pattern of the left pictures.
    pub left: &'a str,
    /// Pattern of the right ones, paired in natural order.
    pub right: &'a str,
    /// `COLSxROWS` inner corners.
    pub board: &'a str,
    /// Side of a square, metres.
    pub square_m: f64,
    /// How to go about it.
    pub options: Options,
    /// Where OpenCV's YAML goes.
    pub out: Option<&'a Path>,
    /// The folder where ROS's two files go.
    pub ros: Option<&'a Path>,
}

/// Calibrates from the pictures that two patterns name, and writes the outputs asked for. Gives what `--json` prints, and all
/// there is to draw.
///
/// `progress` is told how many of all pairs have been searched.
///
/// # Errors
/// [`CalibrateCliError`]: one line that says which file or what number is at fault.
pub fn calibrate(
    request: &CalibrateRequest<'_>,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<(CalibrateReport, Calibration), CalibrateCliError> {
    let board = parse_board(request.board, request.square_m)?;
    let (left, right) = (glob(request.left)?, glob(request.right)?);
    if left.len() != right.len() {
        return Err(CalibrateCliError::Unpaired { left: left.len(), right: right.len() });
    }
    let views: Vec<(Image, Image)> =
        left.iter().zip(&right).map(|(left, right)| read_pair(left, right)).collect::<Result<_, FileError>>()?;
    let calibration = calibrate_with(&views, board, &request.options, progress)?;
    write(&calibration.rig, request.out, request.ros)?;
    Ok((CalibrateReport::new(&calibration, &left, &right), calibration))
}

/// Reads a calibration (an OpenCV YAML file, or a folder with ROS's `left.yaml` and `right.yaml`) and writes the outputs asked
/// for.
///
/// # Errors
/// [`CalibrateCliError`]: one line that says which file, line and key is at fault.
pub fn convert_rig(from: &Path, out: Option<&Path>, ros: Option<&Path>) -> Result<RigCalibration, CalibrateCliError> {
    let rig = read_rig(from)?;
    write(&rig, out, ros)?;
    Ok(rig)
}

fn write(rig: &RigCalibration, out: Option<&Path>, ros: Option<&Path>) -> Result<(), CalibrateCliError> {
    if let Some(out) = out {
        write_rig(out, rig)?;
    }
    if let Some(folder) = ros {
        write_ros(folder, &camera_infos(rig)?)?;
    }
    Ok(())
}

fn parse_board(text: &str, square_m: f64) -> Result<BoardSpec, CalibrateCliError> {
    let sides =
        text.split_once(['x', 'X', '×']).and_then(|(cols, rows)| Some((cols.trim().parse().ok()?, rows.trim().parse().ok()?)));
    let (cols, rows) = sides.ok_or_else(|| CalibrateCliError::Board(text.chars().take(40).collect()))?;
    Ok(BoardSpec::new(cols, rows, square_m)?)
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
