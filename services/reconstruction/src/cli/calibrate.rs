//! `halcyon calibrate`

use std::path::{Path, PathBuf};

use halcyon_model::{Image, RigCalibration};

use crate::core::calibrate::{BoardSpec, CalibrateError, Calibration, Options, calibrate_with, camera_infos};
use crate::files::{
    FileError, GlobError, Output, RigFileError, check_outputs, glob, read_pair, read_rig, rig_files, write_rig, write_ros,
};
use crate::limits::{OutOfRange, within};

mod report;

pub use report::{CalibrateReport, CameraReport, CoverageReport, DepthReport, ErrorByViewsReport, ViewReport};

/// Why there is no calibration.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateCliError {
    /// `--board` is not two numbers.
    #[error("a board is given as COLSxROWS inner corners, such as 9x6, not {0:?}")]
    Board(String),
    /// A number out of range.
    #[error(transparent)]
    Range(#[from] OutOfRange),
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

impl CalibrateRequest<'_> {
    /// Checks numbers, pictures' names and outputs before any work, with a `report` that somebody else will write. Gives the board, and
    /// the pictures of both sides.
    ///
    /// # Errors
    /// [`CalibrateCliError`]: one line that names the option.
    pub fn check(&self, report: Option<&Path>) -> Result<(BoardSpec, [Vec<PathBuf>; 2]), CalibrateCliError> {
        let board = parse_board(self.board, self.square_m)?;
        within("--distance", self.options.depth_at_m, 1e-3, 1e4, " m")?;
        let (left, right) = (glob(self.left)?, glob(self.right)?);
        if left.len() != right.len() {
            return Err(CalibrateCliError::Unpaired { left: left.len(), right: right.len() });
        }
        let inputs = left.iter().map(|path| ("--left", path)).chain(right.iter().map(|path| ("--right", path)));
        let page = report.map(|path| Output::file("--report", path, &["html", "htm"]));
        let outputs: Vec<Output> = outputs(self.out, self.ros).into_iter().chain(page).collect();
        check_outputs(inputs.map(|(option, path)| (option, path.as_path())), &outputs).map_err(FileError::from)?;
        Ok((board, [left, right]))
    }
}

fn outputs(out: Option<&Path>, ros: Option<&Path>) -> Vec<Output> {
    let out = out.map(|path| Output::file("--out", path, &["yaml", "yml"]));
    out.into_iter().chain(ros.into_iter().flat_map(|folder| Output::ros("--ros", folder))).collect()
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
    let (board, [left, right]) = request.check(None)?;
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
    let files = rig_files(from);
    let inputs = files.iter().map(|path| ("--from", path.as_path()));
    check_outputs(inputs, &outputs(out, ros)).map_err(FileError::from)?;
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
    // The core takes what is geometrically possible; nobody carries a board of squares this large.
    let hint = if (1.0..=1000.0).contains(&square_m) {
        format!(": --square is in metres, and {square_m} mm are {} m", square_m / 1e3)
    } else {
        String::new()
    };
    within("--square", square_m, SQUARE_M_MIN, SQUARE_M_MAX, " m").map_err(|error| error.with_hint(hint))?;
    Ok(BoardSpec::new(cols, rows, square_m)?)
}

/// Sides of a square that a board can have, metres: a stage micrometer, and a wall.
const SQUARE_M_MIN: f64 = 1e-4;
const SQUARE_M_MAX: f64 = 1.0;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn boards_are_two_numbers() {
        assert!(parse_board("9x6", 0.03).is_ok());
        for bad in ["", "9", "9x", "x6", "9x6x1", "-9x6", "9.5x6", "9 by 6"] {
            assert!(matches!(parse_board(bad, 0.03), Err(CalibrateCliError::Board(_))), "{bad}");
        }
        for (square_m, hint) in
            [(25.0, "25 mm are 0.025 m"), (f64::NAN, "0.0001 to 1 m"), (0.0, "to 1 m"), (-1.0, "to 1 m"), (1e9, "to 1 m")]
        {
            let error = parse_board("9x6", square_m).unwrap_err().to_string();
            assert!(error.starts_with("--square must be") && error.contains(hint), "{error}");
        }
        assert!(matches!(parse_board("1x1", 0.03), Err(CalibrateCliError::Calibrate(CalibrateError::Board { .. }))));
    }
}
