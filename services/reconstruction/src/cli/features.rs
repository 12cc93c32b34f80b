//! `halcyon features`

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use halcyon_model::{Image, RigCalibration};
use nalgebra::{Matrix3, Matrix3x4, Vector3};
use serde::Serialize;

use crate::core::epipolar::{
    PointPair, RansacSettings, Rays, essential_from_fundamental, essential_from_pose, pixels_without_distortion,
    pose_from_essential, projection_matrices, triangulate,
};
use crate::core::features::{
    FeatureError, FeatureStudy, KEYPOINTS_MAX, MatchRule, Method, StudySettings, UnknownMethod, encode_png, study,
};
use crate::files::{FileError, Output, RigFileError, check_outputs, read_picture, read_rig, rig_files, write_bytes};
use crate::limits::{OutOfRange, within};

/// Why there are no features.
#[derive(Debug, thiserror::Error)]
pub enum FeaturesCliError {
    /// `--method`
    #[error(transparent)]
    Method(#[from] UnknownMethod),
    /// A number out of range.
    #[error(transparent)]
    Range(#[from] OutOfRange),
    /// `--cloud` needs `--rig`.
    #[error("a cloud needs the rig that took the pictures: --rig")]
    CloudWithoutRig,
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
    /// OpenCV failed.
    #[error("OpenCV failed")]
    OpenCv(#[from] opencv::Error),
}

/// What `halcyon features` is told.
#[derive(Debug, Clone, PartialEq)]
pub struct FeaturesOptions<'a> {
    /// Left picture.
    pub left: &'a Path,
    /// Right picture.
    pub right: &'a Path,
    /// A method's name, or `all`.
    pub method: &'a str,
    /// The rig that took them.
    pub rig: Option<&'a Path>,
    /// RANSAC's threshold, pixels.
    pub ransac_px: f64,
    /// Keypoints of each picture at most.
    pub keypoints_max: usize,
    /// Nearest over second-nearest descriptor distance; 1 takes every nearest neighbour, as the thesis does.
    pub ratio_max: f64,
    /// Matches must be nearest in both directions.
    pub is_mutual: bool,
    /// Picture of the matches (.png).
    pub out: Option<&'a Path>,
    /// Triangulated points (.ply); needs the rig.
    pub cloud: Option<&'a Path>,
}

/// The pose in an essential matrix, as `--json` prints it. Matrices are lists of rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PoseReport {
    /// E = K_rᵀ F K_l (thesis 4-26), scaled to what \[t\]× R has with |t| = 1.
    pub essential: [[f64; 3]; 3],
    /// R of X_right = R X_left + t.
    pub rotation: [[f64; 3]; 3],
    /// t / |t|.
    pub direction: [f64; 3],
    /// Angle between R and the rig's own, degrees.
    pub rotation_off_deg: f64,
    /// Angle between t and the rig's own, degrees.
    pub direction_off_deg: f64,
    /// M_l = K_l \[I | 0\] (thesis 4-28).
    pub left_projection: [[f64; 4]; 3],
    /// M_r = K_r \[R | t\] (thesis 4-30), t as long as the rig's baseline, metres.
    pub right_projection: [[f64; 4]; 3],
    /// Matches triangulated (4-22) in front of both cameras.
    pub points: usize,
}

/// One method, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeatureRow {
    /// The method.
    pub method: &'static str,
    /// Keypoints left before RANSAC (tables 4-2, 5-1).
    pub left: usize,
    /// Keypoints right before RANSAC.
    pub right: usize,
    /// Matches before RANSAC.
    pub matches: usize,
    /// Keypoints left after RANSAC (tables 4-3, 5-2).
    pub left_after: usize,
    /// Keypoints right after RANSAC.
    pub right_after: usize,
    /// F with p_rᵀ F p_l = 0, pixels, Frobenius norm 1, f₃₃ ≥ 0; absent without a consensus. With a rig, of undistorted pixels.
    pub fundamental: Option<[[f64; 3]; 3]>,
    /// With a rig.
    pub pose: Option<PoseReport>,
}

/// The result, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FeaturesReport {
    /// Width of the left picture, pixels.
    pub width_px: u32,
    /// Height of the left picture, pixels.
    pub height_px: u32,
    /// One for each method.
    pub rows: Vec<FeatureRow>,
    /// What was written.
    pub files: Vec<PathBuf>,
    /// Clouds that were asked for and do not exist, and why.
    pub missing: Vec<MissingCloud>,
}

/// A cloud that could not be made.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MissingCloud {
    /// Where it should be.
    pub path: PathBuf,
    /// Why it is not.
    pub why: &'static str,
}

/// Finds, matches and filters the features of a pair. With `all` methods each writes its own files, its name put before the ending.
///
/// # Errors
/// [`FeaturesCliError`]: one line that says which file or what number is at fault.
pub fn features(options: &FeaturesOptions<'_>) -> Result<FeaturesReport, FeaturesCliError> {
    let methods = match options.method {
        "all" => Method::ALL.to_vec(),
        name => vec![name.parse::<Method>()?],
    };
    let settings = settings(options)?;
    if options.cloud.is_some() && options.rig.is_none() {
        return Err(FeaturesCliError::CloudWithoutRig);
    }
    let own_path = |path: &Path, method: Method| if methods.len() > 1 { with_method(path, method) } else { path.into() };
    check_files(options, &methods, &own_path)?;
    let rig = options.rig.map(read_rig).transpose()?;
    let (left, right) = (read_picture(options.left)?, read_picture(options.right)?);
    if let Some(rig) = &rig {
        check_size(options.left, &left, rig)?;
        check_size(options.right, &right, rig)?;
    }
    let (mut rows, mut files, mut missing) = (Vec::new(), Vec::new(), Vec::new());
    for method in &methods {
        let place = |pairs: &[PointPair]| match &rig {
            // OpenCV's failure here is want of memory: then the pixels as they are must do.
            Some(rig) => pixels_without_distortion(pairs, &rig.left, &rig.right).unwrap_or_else(|_| pairs.to_vec()),
            None => pairs.to_vec(),
        };
        let study = study(&left, &right, *method, &settings, &place)?;
        let (pose, points) = rig.as_ref().map(|rig| pose(&study, rig)).transpose()?.flatten().unzip();
        if let Some(out) = options.out {
            let path = own_path(out, *method);
            write_bytes(&path, &encode_png(&left, &right, &study)?)?;
            files.push(path);
        }
        if let Some(cloud) = options.cloud {
            let path = own_path(cloud, *method);
            match points {
                Some(points) if !points.is_empty() => {
                    write_bytes(&path, ply(&points).as_bytes())?;
                    files.push(path);
                }
                points => missing.push(MissingCloud { path, why: why_missing(&study, points.is_some()) }),
            }
        }
        let counts = study.counts();
        rows.push(FeatureRow {
            method: method.name(),
            left: counts.left,
            right: counts.right,
            matches: counts.matches,
            left_after: counts.inliers,
            right_after: counts.inliers,
            fundamental: study.consensus.as_ref().map(|consensus| rows3(&consensus.fundamental)),
            pose,
        });
    }
    Ok(FeaturesReport { width_px: left.width_px(), height_px: left.height_px(), rows, files, missing })
}

/// Every file that will be written, before the work: one for each method.
fn check_files(
    options: &FeaturesOptions<'_>,
    methods: &[Method],
    own_path: &dyn Fn(&Path, Method) -> PathBuf,
) -> Result<(), FileError> {
    let rig = options.rig.map(rig_files).unwrap_or_default();
    let inputs = [("--left", options.left), ("--right", options.right)];
    let inputs = inputs.into_iter().chain(rig.iter().map(|path| ("--rig", path.as_path())));
    let pictures = options.out.into_iter().flat_map(|path| methods.iter().map(move |method| (path, *method)));
    let clouds = options.cloud.into_iter().flat_map(|path| methods.iter().map(move |method| (path, *method)));
    let pictures = pictures.map(|(path, method)| Output::file("--out", own_path(path, method), &["png"]));
    let clouds = clouds.map(|(path, method)| Output::file("--cloud", own_path(path, method), &["ply"]));
    Ok(check_outputs(inputs, &pictures.chain(clouds).collect::<Vec<_>>())?)
}

fn why_missing(study: &FeatureStudy, has_pose: bool) -> &'static str {
    match (&study.consensus, has_pose) {
        (None, _) => "no epipolar geometry that enough matches agree on",
        (Some(_), false) => "no pose puts enough points in front of both cameras",
        (Some(_), true) => "no match could be triangulated in front of both cameras",
    }
}

fn settings(options: &FeaturesOptions<'_>) -> Result<StudySettings, OutOfRange> {
    within("--ransac-px", options.ransac_px, 0.01, 100.0, " px")?;
    within("--ratio", options.ratio_max, 0.1, 1.0, "")?;
    within("--keypoints", options.keypoints_max as f64, 1.0, KEYPOINTS_MAX as f64, "")?;
    Ok(StudySettings {
        keypoints_max: options.keypoints_max,
        rule: MatchRule {
            ratio_max: (options.ratio_max < 1.0).then_some(options.ratio_max as f32),
            is_mutual: options.is_mutual,
        },
        ransac: RansacSettings { threshold_px: options.ransac_px, ..RansacSettings::default() },
    })
}

fn check_size(path: &Path, image: &Image, rig: &RigCalibration) -> Result<(), FeaturesCliError> {
    let (width_px, height_px) = (image.width_px(), image.height_px());
    if (width_px, height_px) == (rig.width_px, rig.height_px) {
        return Ok(());
    }
    Err(FeaturesCliError::Size {
        path: path.into(),
        width_px,
        height_px,
        rig_width_px: rig.width_px,
        rig_height_px: rig.height_px,
    })
}

/// What a pose reports, and its points in the left camera frame, metres.
type PoseAndPoints = (PoseReport, Vec<Vector3<f64>>);

/// E, R, t and points from F and a rig; `None` without a consensus.
fn pose(study: &FeatureStudy, rig: &RigCalibration) -> Result<Option<PoseAndPoints>, opencv::Error> {
    let Some(consensus) = &study.consensus else { return Ok(None) };
    let (left_matrix, right_matrix) = (rig.left.matrix(), rig.right.matrix());
    let essential = essential_from_fundamental(&consensus.fundamental, &left_matrix, &right_matrix);
    let inliers: Vec<PointPair> =
        study.points().into_iter().zip(&consensus.is_inlier).filter(|(_, inlier)| **inlier).map(|(pair, _)| pair).collect();
    let rays = Rays::new(&rig.left, &rig.right)?.of(&inliers)?;
    let Some(pose) = pose_from_essential(&essential, &rays) else { return Ok(None) };
    let t_m = pose.direction * rig.baseline_m();
    let (left, right) = projection_matrices(&left_matrix, &right_matrix, &pose.right_from_left, &t_m);
    let ideal = pixels_without_distortion(&inliers, &rig.left, &rig.right)?;
    let points: Vec<Vector3<f64>> = ideal
        .iter()
        .filter_map(|pair| triangulate(&left, &right, pair))
        .filter(|point| point.z > 0.0 && (pose.right_from_left * point + t_m).z > 0.0)
        .collect();
    let turn = nalgebra::Rotation3::from_matrix_unchecked(pose.right_from_left * rig.right_from_left.transpose());
    // F has no scale and no sign, and so has E: give it those of its own pose.
    let of_pose = essential_from_pose(&pose.right_from_left, &pose.direction);
    let scaled = essential * (of_pose.dot(&essential).signum() * of_pose.norm() / essential.norm());
    let report = PoseReport {
        essential: rows3(&scaled),
        rotation: rows3(&pose.right_from_left),
        direction: pose.direction.into(),
        rotation_off_deg: turn.angle().to_degrees(),
        direction_off_deg: pose.direction.angle(&rig.right_from_left_m).to_degrees(),
        left_projection: rows4(&left),
        right_projection: rows4(&right),
        points: points.len(),
    };
    Ok(Some((report, points)))
}

fn rows3(matrix: &Matrix3<f64>) -> [[f64; 3]; 3] {
    matrix.transpose().into()
}

fn rows4(matrix: &Matrix3x4<f64>) -> [[f64; 4]; 3] {
    matrix.transpose().into()
}

/// `matches.png` becomes `matches-sift.png`.
fn with_method(path: &Path, method: Method) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(format!("-{}", method.name()));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

/// A few points as PLY text, left camera frame, metres.
fn ply(points: &[Vector3<f64>]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\ncomment left camera frame: x right, y down, z forward, metres\nelement vertex {}\n\
         property float x\nproperty float y\nproperty float z\nend_header\n",
        points.len()
    );
    for point in points {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{:.6} {:.6} {:.6}", point.x, point.y, point.z);
    }
    text
}
