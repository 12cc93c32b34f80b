//! `halcyon reconstruct`

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use halcyon_capture::SurveyFolder;
use halcyon_chassis::clock::{Clock, ClockConfig};
use halcyon_model::PoseAtExposure;
use halcyon_reconstruction::cli::{self, MeshOf, PatchReport, PlaneReport, ReconstructOptions, SurveyFrame, SurveyStep};
use halcyon_reconstruction::core::calibrate::SIGMAS_95;
use indicatif::ProgressBar;

use super::{bad_input, output};

/// Measure the water surface in a raw pair of pictures, or in every pair of a survey folder
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: halcyon reconstruct --left l.png --right r.png --rig rig.yaml --height-m 5 --cloud c.ply --mesh m.ply
Example: halcyon reconstruct survey --grid elevation.nc --wass wass.nc

Without a height the pictures' own mean plane is level. A survey folder has rig.yaml, left/, right/ and frames.csv; its bad
pairs are named and passed over."
)]
pub(super) struct Args {
    /// A survey folder: every pair of it
    #[arg(value_name = "DIR", conflicts_with_all = ["left", "right", "rig", "height_m"])]
    folder: Option<PathBuf>,
    /// Left picture, as taken
    #[arg(long, value_name = "FILE", required_unless_present = "folder")]
    left: Option<PathBuf>,
    /// Right picture, as taken
    #[arg(long, value_name = "FILE", required_unless_present = "folder")]
    right: Option<PathBuf>,
    /// The rig's calibration, OpenCV YAML
    #[arg(long, value_name = "FILE", required_unless_present = "folder")]
    rig: Option<PathBuf>,
    #[command(flatten)]
    pose: Pose,
    #[command(flatten)]
    how: How,
    #[command(flatten)]
    outputs: Outputs,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Where the body was, for one pair.
#[derive(Debug, clap::Args)]
struct Pose {
    /// Height of the body above the mean water, metres
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    height_m: Option<f64>,
    /// Roll, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true, requires = "height_m")]
    roll_deg: f64,
    /// Pitch, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true, requires = "height_m")]
    pitch_deg: f64,
    /// Heading, degrees clockwise from true north
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true, requires = "height_m")]
    heading_deg: f64,
    /// One standard deviation of heights, metres
    #[arg(long, value_name = "M", default_value_t = 0.3, allow_negative_numbers = true)]
    height_sigma_m: f64,
    /// One standard deviation of roll and pitch, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.5, allow_negative_numbers = true)]
    attitude_sigma_deg: f64,
}

/// How pairs are reconstructed.
#[derive(Debug, clap::Args)]
pub(super) struct How {
    /// guided (about the mean plane, sgm where there is none), sgm, sgm8, or OpenCV's bm, sgbm, sgbm-3way, sgbm-hh4 or sgbm-hh; for study
    /// wta-COST or sgm-COST, where COST is sad, ssd, ncc, rank, census or mi
    #[arg(long, default_value = "guided")]
    engine: String,
    /// Cell of the elevation grid, metres; otherwise about ten pixels
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    cell: Option<f64>,
    /// Every so many pixels become a point; otherwise 1 for a pair, 2 for a survey
    #[arg(long, value_name = "PX")]
    stride: Option<u32>,
    /// Largest disparity of a full search, pixels; otherwise 40 % of the width
    #[arg(long, value_name = "PX")]
    max_disparity: Option<u32>,
}

#[derive(Debug, clap::Args)]
struct Outputs {
    /// Write the point cloud, PLY
    #[arg(long, value_name = "FILE.ply")]
    cloud: Option<PathBuf>,
    /// Write a triangle mesh, PLY
    #[arg(long, value_name = "FILE.ply")]
    mesh: Option<PathBuf>,
    /// What the mesh is made of: the cloud's points, or the smoother elevation grid
    #[arg(long, value_enum, default_value_t = MeshFrom::Cloud)]
    mesh_of: MeshFrom,
    /// Write the disparity map: .pfm (numbers, NaN for no match) or .png (colours)
    #[arg(long, value_name = "FILE")]
    disparity: Option<PathBuf>,
    /// Write elevation maps over time, NetCDF-4 with CF names
    #[arg(long, value_name = "FILE.nc")]
    grid: Option<PathBuf>,
    /// Write them in the layout of WASS
    #[arg(long, value_name = "FILE.nc")]
    wass: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum MeshFrom {
    Cloud,
    Grid,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let options = options(args);
    match (&args.folder, &args.left, &args.right, &args.rig) {
        (Some(folder), ..) => survey(folder, args, &options),
        (None, Some(left), Some(right), Some(rig)) => pair(left, right, rig, args, &options),
        // The command line demands them.
        _ => Err(halcyon_chassis::ConfigError::new("give a survey folder, or --left, --right and --rig".to_owned()).into()),
    }
}

fn options(args: &Args) -> ReconstructOptions {
    let (how, outputs) = (&args.how, &args.outputs);
    ReconstructOptions {
        cloud: outputs.cloud.clone(),
        mesh: outputs.mesh.clone(),
        mesh_of: if outputs.mesh_of == MeshFrom::Grid { MeshOf::Grid } else { MeshOf::Cloud },
        disparity: outputs.disparity.clone(),
        grid: outputs.grid.clone(),
        wass: outputs.wass.clone(),
        ..how.options()
    }
}

impl How {
    /// Without outputs.
    pub(super) fn options(&self) -> ReconstructOptions {
        ReconstructOptions {
            engine: self.engine.clone(),
            cell_m: self.cell,
            stride_px: self.stride,
            max_disparity_px: self.max_disparity,
            now: Clock::new(&ClockConfig::default()).now(),
            command: as_typed(),
            ..ReconstructOptions::default()
        }
    }
}

/// The command as typed, but without the paths of the machine it was typed on: for the history of files.
pub(super) fn as_typed() -> String {
    let words = std::env::args_os().skip(1).map(|word| match Path::new(&word).file_name() {
        Some(name) if Path::new(&word).is_absolute() => name.to_string_lossy().into_owned(),
        _ => word.to_string_lossy().into_owned(),
    });
    format!("halcyon {}", words.collect::<Vec<_>>().join(" "))
}

fn pair(left: &Path, right: &Path, rig: &Path, args: &Args, options: &ReconstructOptions) -> anyhow::Result<ExitCode> {
    let pose = args.pose.given().map_err(bad_input)?;
    let spinner = output::spinner();
    spinner.set_message("reconstructing");
    let report = cli::reconstruct_pair(left, right, rig, pose, options);
    spinner.finish_and_clear();
    let report = report.map_err(bad_input)?;
    output::warnings(&report.warnings);
    if args.json {
        output::json(&report)?;
        return Ok(ExitCode::SUCCESS);
    }
    output::line(&format!(
        "points     {} of {} x {} px, {:.0} ms",
        report.points, report.width_px, report.height_px, report.wall_ms
    ))?;
    surface(&report.plane, &report.patch)?;
    written(options)
}

fn survey(folder: &Path, args: &Args, options: &ReconstructOptions) -> anyhow::Result<ExitCode> {
    // Checks the standard deviations: the folder has the rest.
    cli::given_pose([0.0; 3], 1.0, args.pose.height_sigma_m, args.pose.attitude_sigma_deg).map_err(bad_input)?;
    let survey = SurveyFolder::open_tolerant(folder).map_err(bad_input)?;
    let frames = frames(&survey, args.pose.height_sigma_m, args.pose.attitude_sigma_deg);
    let bar = output::bar("pairs");
    let report = cli::reconstruct_survey(survey.rig(), &frames, options, &mut |step| show(&bar, step));
    bar.finish_and_clear();
    let report = report.map_err(bad_input)?;
    output::warnings(&report.warnings);
    if args.json {
        output::json(&report)?;
        return Ok(ExitCode::SUCCESS);
    }
    for failure in &report.failed {
        output::line(&format!("left out   {}: {}", failure.name, failure.why))?;
    }
    output::line(&format!(
        "patches    {} of {} pairs, {:.1} s, {:.0} points each, {:.0} ms a pair",
        report.patches,
        report.pairs,
        report.duration_s,
        report.points,
        report.wall_ms / report.patches as f64
    ))?;
    surface(&report.plane, &report.patch)?;
    written(options)
}

/// The pairs of a survey with what is known of the carrier's poses.
pub(super) fn frames(survey: &SurveyFolder, height_sigma_m: f64, attitude_sigma_deg: f64) -> Vec<SurveyFrame> {
    let frame = |frame: &halcyon_capture::Frame| SurveyFrame {
        name: frame.row.name.clone(),
        stamp: frame.stamp(),
        left: frame.left().to_owned(),
        right: frame.right().to_owned(),
        pose: frame.pose(height_sigma_m, attitude_sigma_deg.to_radians()),
    };
    survey.frames().iter().map(frame).collect()
}

/// How far a survey is, and what was left out of it.
pub(super) fn show(bar: &ProgressBar, step: SurveyStep<'_>) {
    bar.set_length(step.total as u64);
    bar.set_position(step.done as u64);
    if let Some(Err(failure)) = step.outcome {
        bar.println(format!("left out   {}: {}", failure.name, failure.why));
    }
}

impl Pose {
    fn given(&self) -> Result<Option<PoseAtExposure>, cli::ReconstructCliError> {
        let attitude_deg = [self.roll_deg, self.pitch_deg, self.heading_deg];
        let pose = |height_m| cli::given_pose(attitude_deg, height_m, self.height_sigma_m, self.attitude_sigma_deg);
        self.height_m.map(pose).transpose()
    }
}

fn surface(plane: &PlaneReport, patch: &PatchReport) -> anyhow::Result<()> {
    let [x, y, z] = plane.normal;
    output::line(&format!(
        "plane      {:.4} m from the left camera, normal ({x:.4}, {y:.4}, {z:.4}), RMS {:.2} mm",
        plane.distance_m,
        plane.rms_m * 1e3
    ))?;
    output::line(&format!(
        "patch      {} x {} cells of {} m, {:.1} % measured, each to ± {:.2} mm (95 %), elevation RMS {:.2} mm",
        patch.rows,
        patch.cols,
        patch.cell_m,
        patch.coverage * 100.0,
        SIGMAS_95 * patch.sigma_m * 1e3,
        patch.elevation_rms_m * 1e3
    ))?;
    if let (Some(level_m), Some(low_m), Some(high_m)) = (patch.level_m, patch.level_m_low, patch.level_m_high) {
        output::line(&format!("level      {level_m:.3} m above the datum (95 %: {low_m:.3} to {high_m:.3} m)"))?;
    }
    Ok(())
}

fn written(options: &ReconstructOptions) -> anyhow::Result<ExitCode> {
    for path in [&options.cloud, &options.mesh, &options.disparity, &options.grid, &options.wass].into_iter().flatten() {
        output::line(&format!("written    {}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}
