//! `halcyon self-calibrate`

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::core::calibrate::SIGMAS_95;
use crate::core::features::{FeatureError, MatchRule, Method, UnknownMethod, match_pictures};
use crate::core::self_calibrate::{Scale, SelfCalibrateError, SelfCalibration, Settings, Solver, self_calibrate as calibrate};
use crate::files::{
    FileError, GlobError, Output, RigFileError, check_outputs, glob, read_picture, read_rig, rig_files, write_rig,
};
use crate::limits::{OutOfRange, within};

/// Keypoints of each picture: enough to cover it, few enough to compare each with each.
const KEYPOINTS_MAX: usize = 2000;

/// Why there is no pose.
#[derive(Debug, thiserror::Error)]
pub enum SelfCalibrateCliError {
    /// `--method`
    #[error(transparent)]
    Method(#[from] UnknownMethod),
    /// `--solver`
    #[error("there is no solver {0:?}: use five or eight")]
    Solver(String),
    /// Two scales.
    #[error("the scale comes from --baseline or from --altitude, not from both")]
    TwoScales,
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
    /// A file.
    #[error(transparent)]
    File(#[from] FileError),
    /// `--rig`
    #[error(transparent)]
    Rig(#[from] RigFileError),
    /// Pictures of another size than the rig's.
    #[error("{} is {width_px}x{height_px} px, the rig's pictures are {rig_width_px}x{rig_height_px}", path.display())]
    Size {
        /// The picture.
        path: PathBuf,
        /// Its width.
        width_px: u32,
        /// Its height.
        height_px: u32,
        /// The rig's.
        rig_width_px: u32,
        /// The rig's.
        rig_height_px: u32,
    },
    /// The pictures themselves.
    #[error(transparent)]
    Features(#[from] FeatureError),
    /// What they show.
    #[error(transparent)]
    SelfCalibrate(#[from] SelfCalibrateError),
}

/// What `halcyon self-calibrate` is told.
#[derive(Debug, Clone, PartialEq)]
pub struct SelfCalibrateOptions<'a> {
    /// The calibration in force.
    pub rig: &'a Path,
    /// Pattern of the left pictures.
    pub left: &'a str,
    /// Pattern of the right pictures.
    pub right: &'a str,
    /// Feature method.
    pub method: &'a str,
    /// `five` or `eight`.
    pub solver: &'a str,
    /// Length of the baseline, metres.
    pub baseline_m: Option<f64>,
    /// Distance along the optical axis to the water, metres.
    pub altitude_m: Option<f64>,
    /// Also estimate a factor on the focal lengths.
    pub refine_focal: bool,
    /// RANSAC's threshold, pixels.
    pub ransac_px: f64,
    /// Row error beyond which a calibration has drifted, pixels RMS.
    pub drift_px_max: f64,
    /// Where the new calibration goes.
    pub out: Option<&'a Path>,
}

/// An angle with its uncertainty, degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AngleReport {
    /// Against the calibration in force.
    pub deg: f64,
    /// One standard deviation.
    pub sigma_deg: f64,
    /// 95 % bound.
    pub deg_low: f64,
    /// 95 % bound.
    pub deg_high: f64,
}

impl AngleReport {
    fn new(rad: f64, sigma_rad: f64) -> Self {
        let (deg, sigma_deg) = (rad.to_degrees(), sigma_rad.to_degrees());
        Self { deg, sigma_deg, deg_low: deg - SIGMAS_95 * sigma_deg, deg_high: deg + SIGMAS_95 * sigma_deg }
    }
}

/// Another pose that explains a flat scene as well.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AlternativeReport {
    /// Angle between the two rotations, degrees.
    pub rotation_deg: f64,
    /// Angle between the two baselines, degrees.
    pub direction_deg: f64,
}

/// One pair, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SelfViewReport {
    /// Left picture.
    pub left: PathBuf,
    /// Right picture.
    pub right: PathBuf,
    /// Matches between them.
    pub matches: usize,
}

/// The result, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SelfCalibrateReport {
    /// The feature method.
    pub method: &'static str,
    /// Each pair.
    pub views: Vec<SelfViewReport>,
    /// Matches of all pairs.
    pub matches: usize,
    /// Matches used in the end.
    pub inliers: usize,
    /// Standard deviation of a match's place in one picture, pixels.
    pub sigma_px: f64,
    /// Turn of the right camera about its x axis against the calibration in force.
    pub pitch: AngleReport,
    /// About its y axis.
    pub yaw: AngleReport,
    /// About its z axis.
    pub roll: AngleReport,
    /// Turn of the baseline towards the right camera's y axis.
    pub baseline_down: AngleReport,
    /// Turn of the baseline towards the right camera's z axis.
    pub baseline_forward: AngleReport,
    /// Length of the baseline, metres.
    pub baseline_m: f64,
    /// 95 % bound.
    pub baseline_m_low: f64,
    /// 95 % bound.
    pub baseline_m_high: f64,
    /// Factor on the focal lengths; absent where they were kept.
    pub focal_scale: Option<f64>,
    /// Its standard deviation.
    pub focal_scale_sigma: Option<f64>,
    /// Row error of the matches with the calibration in force, pixels RMS.
    pub row_error_before_px: f64,
    /// The same with the new one.
    pub row_error_after_px: f64,
    /// The part of the row error that the change of pose explains, pixels RMS.
    pub drift_px: f64,
    /// Whether the calibration in force has drifted: beyond its uncertainty, and by more than the stated row error.
    pub has_drifted: bool,
    /// Whether every pair shows a plane.
    pub is_flat: bool,
    /// For a flat scene: another pose that fits as well; the one nearer to the calibration in force was taken.
    pub alternative: Option<AlternativeReport>,
    /// What makes the result doubtful; mostly empty.
    pub warnings: Vec<String>,
}

/// Finds the pose of a rig's cameras from pairs without a board and writes the new calibration where asked to; `progress` is told
/// how many of all pairs have been matched.
///
/// # Errors
/// [`SelfCalibrateCliError`]: one line that says which file or what number is at fault, or why the pictures show no pose.
pub fn self_calibrate(
    options: &SelfCalibrateOptions<'_>,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<SelfCalibrateReport, SelfCalibrateCliError> {
    let method: Method = options.method.parse()?;
    let settings = settings(options)?;
    let (left, right) = (glob(options.left)?, glob(options.right)?);
    if left.len() != right.len() {
        return Err(SelfCalibrateCliError::Unpaired { left: left.len(), right: right.len() });
    }
    if let Some(out) = options.out {
        let pictures = left.iter().map(|path| ("--left", path)).chain(right.iter().map(|path| ("--right", path)));
        let files = rig_files(options.rig);
        let inputs = pictures.chain(files.iter().map(|path| ("--rig", path))).map(|(option, path)| (option, path.as_path()));
        check_outputs(inputs, &[Output::file("--out", out, &["yaml", "yml"])]).map_err(FileError::from)?;
    }
    let rig = read_rig(options.rig)?;
    let read = |path: &Path| {
        let image = read_picture(path)?;
        if (image.width_px(), image.height_px()) == (rig.width_px, rig.height_px) {
            return Ok(image);
        }
        Err(SelfCalibrateCliError::Size {
            path: path.into(),
            width_px: image.width_px(),
            height_px: image.height_px(),
            rig_width_px: rig.width_px,
            rig_height_px: rig.height_px,
        })
    };
    let (mut matches, mut views) = (Vec::with_capacity(left.len()), Vec::with_capacity(left.len()));
    for (left_path, right_path) in left.iter().zip(&right) {
        let (left_picture, right_picture) = (read(left_path)?, read(right_path)?);
        let pairs = match_pictures(&left_picture, &right_picture, method, KEYPOINTS_MAX, &MatchRule::default())?;
        views.push(SelfViewReport { left: left_path.clone(), right: right_path.clone(), matches: pairs.len() });
        matches.push(pairs);
        progress(views.len(), left.len());
    }
    let found = calibrate(&rig, &matches, &settings)?;
    if let Some(out) = options.out {
        write_rig(out, &found.rig)?;
    }
    let warnings = warnings(options, rig.baseline_m(), &found);
    Ok(report(method, views, &found, warnings))
}

fn settings(options: &SelfCalibrateOptions<'_>) -> Result<Settings, SelfCalibrateCliError> {
    let solver = match options.solver {
        "five" => Solver::FivePoint,
        "eight" => Solver::EightPoint,
        other => return Err(SelfCalibrateCliError::Solver(other.chars().take(40).collect())),
    };
    let scale = match (options.baseline_m, options.altitude_m) {
        (None, None) => Scale::Given,
        (Some(baseline_m), None) => {
            within("--baseline", baseline_m, 1e-3, 100.0, " m")?;
            Scale::Baseline(baseline_m)
        }
        (None, Some(altitude_m)) => {
            within("--altitude", altitude_m, 1e-2, 10_000.0, " m")?;
            Scale::Altitude(altitude_m)
        }
        (Some(_), Some(_)) => return Err(SelfCalibrateCliError::TwoScales),
    };
    within("--ransac-px", options.ransac_px, 0.01, 100.0, " px")?;
    within("--drift-px", options.drift_px_max, 0.0, 1000.0, " px")?;
    Ok(Settings {
        solver,
        scale,
        threshold_px: options.ransac_px,
        refine_focal: options.refine_focal,
        drift_px_max: options.drift_px_max,
        ..Settings::default()
    })
}

/// A length that is off by more than this share was given in another unit, or belongs to another rig.
const BASELINE_OFF_MAX: f64 = 0.1;

/// The calibration in force says how far apart the cameras are. What the options say of it, or the water's distance, should agree.
fn warnings(options: &SelfCalibrateOptions<'_>, in_force_m: f64, found: &SelfCalibration) -> Vec<String> {
    let off_m = (found.baseline_m - in_force_m).abs();
    let half_m = SIGMAS_95 * found.baseline_sigma_m;
    let doubt = match (options.baseline_m, options.altitude_m) {
        (Some(stated_m), _) if off_m > BASELINE_OFF_MAX * in_force_m => format!(
            "--baseline {stated_m} m is {:.3} times the {in_force_m:.4} m of the calibration in force: pictures without a known \
             length cannot tell which is right, and every distance scales with it",
            stated_m / in_force_m
        ),
        (None, Some(altitude_m)) if off_m > half_m.max(BASELINE_OFF_MAX * in_force_m) => format!(
            "with --altitude {altitude_m} m the baseline comes out at {:.4} m (95 %: {:.4} to {:.4} m), far from the \
             {in_force_m:.4} m of the calibration in force: one of the two is wrong",
            found.baseline_m,
            found.baseline_m - half_m,
            found.baseline_m + half_m
        ),
        _ => return Vec::new(),
    };
    vec![doubt]
}

fn report(method: Method, views: Vec<SelfViewReport>, found: &SelfCalibration, warnings: Vec<String>) -> SelfCalibrateReport {
    let (turn, turn_sigma) = (found.turn_rad, found.turn_sigma_rad);
    let (direction, direction_sigma) = (found.direction_rad, found.direction_sigma_rad);
    SelfCalibrateReport {
        method: method.name(),
        views,
        matches: found.matches,
        inliers: found.inliers,
        sigma_px: found.sigma_px,
        pitch: AngleReport::new(turn.x, turn_sigma.x),
        yaw: AngleReport::new(turn.y, turn_sigma.y),
        roll: AngleReport::new(turn.z, turn_sigma.z),
        baseline_down: AngleReport::new(direction.x, direction_sigma.x),
        baseline_forward: AngleReport::new(direction.y, direction_sigma.y),
        baseline_m: found.baseline_m,
        baseline_m_low: found.baseline_m - SIGMAS_95 * found.baseline_sigma_m,
        baseline_m_high: found.baseline_m + SIGMAS_95 * found.baseline_sigma_m,
        focal_scale: found.focal_scale.map(|(scale, _)| scale),
        focal_scale_sigma: found.focal_scale.map(|(_, sigma)| sigma),
        row_error_before_px: found.before.rms_px,
        row_error_after_px: found.after.rms_px,
        drift_px: found.drift_px,
        has_drifted: found.has_drifted,
        is_flat: found.is_flat,
        alternative: found.alternative.map(|other| AlternativeReport {
            rotation_deg: other.rotation_rad.to_degrees(),
            direction_deg: other.direction_rad.to_degrees(),
        }),
        warnings,
    }
}
