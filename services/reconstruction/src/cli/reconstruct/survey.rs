//! `halcyon reconstruct DIR`: every pair of a survey folder, whoever has opened it.

use std::path::PathBuf;

use halcyon_model::{PoseAtExposure, RigCalibration, Stamp, SurfacePatch};
use serde::Serialize;

use super::{
    Chain, Doubt, Doubts, PatchReport, PlaneReport, ReconstructCliError, ReconstructOptions, check_pose, read_stereo_pair,
};
use crate::cli::speed::Spent;
use crate::core::cloud::CloudFrame;
use crate::core::reconstruct::Settings;
use crate::files::check_rig;
use crate::files::netcdf::Series;

/// One pair of a survey.
#[derive(Debug, Clone, PartialEq)]
pub struct SurveyFrame {
    /// Its name.
    pub name: String,
    /// Mid-exposure.
    pub stamp: Stamp,
    /// Left picture.
    pub left: PathBuf,
    /// Right picture.
    pub right: PathBuf,
    /// The carrier's pose, if known.
    pub pose: Option<PoseAtExposure>,
}

/// A pair that made no patch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FailedPair {
    /// Its name.
    pub name: String,
    /// Why, in one line.
    pub why: String,
}

/// How far a survey is, and what the last pair gave.
#[derive(Debug, Clone, Copy)]
pub struct SurveyStep<'a> {
    /// Pairs done.
    pub done: usize,
    /// Of so many.
    pub total: usize,
    /// The last one's patch, or why there is none; `None` before the first.
    pub outcome: Option<Result<&'a SurfacePatch, &'a FailedPair>>,
}

/// All pairs, as `--json` prints it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SurveyReport {
    /// The engine.
    pub engine: &'static str,
    /// `gravity` or `plane`: what elevations are aligned to.
    pub frame: &'static str,
    /// Pairs in the folder.
    pub pairs: usize,
    /// Patches that were made.
    pub patches: usize,
    /// The others.
    pub failed: Vec<FailedPair>,
    /// From the first patch to the last, seconds.
    pub duration_s: f64,
    /// Triangulated points, mean over the patches.
    pub points: f64,
    /// The mean water plane: means over the patches, root mean square of `rms_m`.
    pub plane: PlaneReport,
    /// The grid: means over the patches, root mean squares of `sigma_m` and `elevation_rms_m`; rows and columns of the last.
    pub patch: PatchReport,
    /// Processor time of the chain, all threads and pairs, milliseconds; absent where the system does not tell.
    pub cpu_ms: Option<f64>,
    /// Time of the chain, all pairs, milliseconds.
    pub wall_ms: f64,
    /// What makes the result doubtful, one line a sort; mostly empty.
    pub warnings: Vec<String>,
}

/// Reconstructs the pairs of a survey in order. Pairs that make no patch are passed over and listed; `heard` hears of every step.
///
/// # Errors
/// [`ReconstructCliError`]: bad options, an output that cannot be written, or not one patch.
pub fn reconstruct_survey(
    calibration: &RigCalibration,
    frames: &[SurveyFrame],
    options: &ReconstructOptions,
    heard: &mut dyn FnMut(SurveyStep<'_>),
) -> Result<SurveyReport, ReconstructCliError> {
    for (path, flag) in [(&options.cloud, "--cloud"), (&options.mesh, "--mesh"), (&options.disparity, "--disparity")] {
        if path.is_some() {
            return Err(ReconstructCliError::OnePair(flag));
        }
    }
    let pictures = frames.iter().flat_map(|frame| [frame.left.as_path(), frame.right.as_path()]);
    options.check_outputs(pictures.map(|path| ("DIR", path)))?;
    check_rig(calibration)?;
    // "Without attitude the rig is taken as fixed."
    let fixed_rig = frames.iter().all(|frame| frame.pose.is_none());
    let frame = if fixed_rig { CloudFrame::Plane } else { CloudFrame::Gravity };
    let settings = Settings { fixed_rig, ..options.settings(calibration, 2)? };
    let mut series = match options.series_file() {
        Some(path) => Some(Series::beside(path, frame)?),
        None => None,
    };
    let mut chain = Chain::new(settings, options.cell_m.is_none());
    let (mut sums, mut doubts) = (Sums::default(), Doubts::default());
    let (mut failed, mut first_error) = (Vec::new(), None);
    let total = frames.len();
    heard(SurveyStep { done: 0, total, outcome: None });
    for (index, frame) in frames.iter().enumerate() {
        let done = index + 1;
        match one(&mut chain, calibration, frame, index as u64) {
            Ok((patch, timing, of_pair)) => {
                doubts.add(&frame.name, of_pair);
                if let Some(series) = &mut series {
                    series.push(&patch)?;
                }
                sums.add(&patch, timing);
                heard(SurveyStep { done, total, outcome: Some(Ok(&patch)) });
            }
            Err(error) => {
                let failure = FailedPair { name: frame.name.clone(), why: one_line(&error) };
                first_error.get_or_insert((frame.name.clone(), error));
                heard(SurveyStep { done, total, outcome: Some(Err(&failure)) });
                failed.push(failure);
            }
        }
    }
    match (sums.report(chain.engine, frame.name(), frames.len(), failed), first_error) {
        (Some(report), _) => {
            if let Some(series) = &mut series {
                options.write_series(series, calibration)?;
            }
            Ok(SurveyReport { warnings: doubts.lines(), ..report })
        }
        (None, Some((name, error))) => Err(ReconstructCliError::NoPatch { pairs: frames.len(), name, source: Box::new(error) }),
        (None, None) => Err(crate::files::netcdf::SeriesError::Empty.into()),
    }
}

fn one(
    chain: &mut Chain,
    calibration: &RigCalibration,
    frame: &SurveyFrame,
    sequence: u64,
) -> Result<(SurfacePatch, Spent, Vec<Doubt>), ReconstructCliError> {
    let mut doubts = frame.pose.as_ref().map_or(Ok(Vec::new()), |pose| check_pose(pose, calibration))?;
    let pair = read_stereo_pair(*calibration, [&frame.left, &frame.right], frame.pose, frame.stamp, sequence)?;
    let (patch, took) = chain.timed(&pair)?;
    doubts.extend(chain.check(&pair, &patch)?);
    Ok((patch, took, doubts))
}

/// An error and its causes on one line.
fn one_line(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text
}

/// Running sums over the patches.
#[derive(Default)]
struct Sums {
    patches: usize,
    first: Option<Stamp>,
    last: Option<(Stamp, PatchReport)>,
    points: f64,
    normal: nalgebra::Vector3<f64>,
    distance_m: f64,
    coverage: f64,
    level_m: f64,
    /// Squares: plane r.m.s., cell sigma, elevation, level sigma.
    squares: [f64; 4],
    cpu_ms: Option<f64>,
    wall_ms: f64,
}

impl Sums {
    fn add(&mut self, patch: &SurfacePatch, timing: Spent) {
        let report = PatchReport::from(patch);
        self.patches += 1;
        self.first.get_or_insert(patch.stamp);
        self.points += f64::from(patch.points);
        self.normal += patch.plane.normal;
        self.distance_m += patch.plane.distance_m;
        self.coverage += patch.coverage;
        self.level_m += patch.level_m.unwrap_or(0.0);
        let values = [patch.plane.rms_m, report.sigma_m, report.elevation_rms_m, patch.level_sigma_m.unwrap_or(0.0)];
        for (sum, value) in self.squares.iter_mut().zip(values) {
            *sum += value * value;
        }
        self.cpu_ms = match (self.patches, self.cpu_ms, timing.cpu_ms) {
            (1, _, cpu_ms) => cpu_ms,
            (_, Some(sum), Some(cpu_ms)) => Some(sum + cpu_ms),
            _ => None,
        };
        self.wall_ms += timing.wall_ms;
        self.last = Some((patch.stamp, report));
    }

    fn report(self, engine: &'static str, frame: &'static str, pairs: usize, failed: Vec<FailedPair>) -> Option<SurveyReport> {
        let (first, (last, mut patch)) = (self.first?, self.last?);
        let count = self.patches as f64;
        let [plane_rms_m, sigma_m, elevation_rms_m, level_sigma_m] = self.squares.map(|sum| (sum / count).sqrt());
        (patch.coverage, patch.sigma_m, patch.elevation_rms_m) = (self.coverage / count, sigma_m, elevation_rms_m);
        patch.set_level(patch.level_m.map(|_| (self.level_m / count, level_sigma_m)));
        let normal = self.normal.normalize().into();
        Some(SurveyReport {
            engine,
            frame,
            pairs,
            patches: self.patches,
            failed,
            duration_s: last.seconds_since(first),
            points: self.points / count,
            plane: PlaneReport { normal, distance_m: self.distance_m / count, rms_m: plane_rms_m },
            patch,
            cpu_ms: self.cpu_ms,
            wall_ms: self.wall_ms,
            warnings: Vec::new(),
        })
    }
}
