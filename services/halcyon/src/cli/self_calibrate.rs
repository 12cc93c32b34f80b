//! `halcyon self-calibrate`

use std::path::PathBuf;
use std::process::ExitCode;

use halcyon_reconstruction::cli;
use halcyon_reconstruction::core::calibrate::SIGMAS_95;

use super::{bad_input, output};

/// Find the pose of a rig's cameras from pairs without a board, and whether its calibration has drifted
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: halcyon self-calibrate --rig rig.yaml --left 'flight/left/*.png' --right 'flight/right/*.png' \
                        --altitude 5.0 --out new.yaml"
)]
pub(super) struct Args {
    /// The calibration in force (OpenCV YAML): its lenses are kept, its pose is checked
    #[arg(long, value_name = "FILE")]
    rig: PathBuf,
    /// Pictures of the left camera, a quoted pattern
    #[arg(long, value_name = "GLOB")]
    left: String,
    /// Pictures of the right camera, a quoted pattern; paired with the left ones in natural order
    #[arg(long, value_name = "GLOB")]
    right: String,
    /// Distance between the cameras, metres; without it and --altitude the calibration's is kept
    #[arg(long, value_name = "M", allow_negative_numbers = true, conflicts_with = "altitude")]
    baseline: Option<f64>,
    /// Distance from the left camera along its optical axis to the water, metres
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    altitude: Option<f64>,
    /// sift, surf, orb or akaze
    #[arg(long, default_value = "sift")]
    method: String,
    /// five (copes with flat water) or eight (thesis; needs depth)
    #[arg(long, default_value = "five")]
    solver: String,
    /// Also estimate one factor on the focal lengths; refused where the pictures leave it open
    #[arg(long)]
    refine_focal: bool,
    /// Matches within this distance of the epipolar geometry are kept, pixels
    #[arg(long, value_name = "PX", default_value_t = 1.0, allow_negative_numbers = true)]
    ransac_px: f64,
    /// Row error beyond which the calibration has drifted, pixels RMS
    #[arg(long, value_name = "PX", default_value_t = 0.5, allow_negative_numbers = true)]
    drift_px: f64,
    /// Write the new calibration here, as OpenCV YAML
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let bar = output::bar("matches");
    let mut progress = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let options = cli::SelfCalibrateOptions {
        rig: &args.rig,
        left: &args.left,
        right: &args.right,
        method: &args.method,
        solver: &args.solver,
        baseline_m: args.baseline,
        altitude_m: args.altitude,
        refine_focal: args.refine_focal,
        ransac_px: args.ransac_px,
        drift_px_max: args.drift_px,
        out: args.out.as_deref(),
    };
    let report = cli::self_calibrate(&options, &mut progress);
    bar.finish_and_clear();
    let report = report.map_err(bad_input)?;
    output::warnings(&report.warnings);
    if args.json {
        output::json(&report)?;
        return Ok(ExitCode::SUCCESS);
    }
    output::line(&format!(
        "matches    {} of {} pairs by {}, {} used, each known to ± {:.2} px (95 %)",
        report.matches,
        report.views.len(),
        report.method,
        report.inliers,
        SIGMAS_95 * report.sigma_px
    ))?;
    output::line("against the calibration in force, the right camera has turned (95 %)")?;
    for (name, angle) in [("pitch", report.pitch), ("yaw", report.yaw), ("roll", report.roll)] {
        output::line(&format!("  {name:<8} {:>8.4}° ± {:.4}°", angle.deg, angle.deg_high - angle.deg))?;
    }
    output::line("and the baseline (95 %)")?;
    for (name, angle) in [("down", report.baseline_down), ("forward", report.baseline_forward)] {
        output::line(&format!("  {name:<8} {:>8.4}° ± {:.4}°", angle.deg, angle.deg_high - angle.deg))?;
    }
    let source = match (args.baseline, args.altitude) {
        (Some(_), _) => "as given".to_owned(),
        (None, Some(_)) => format!("95 %: {:.4} to {:.4} m", report.baseline_m_low, report.baseline_m_high),
        (None, None) => "kept from the calibration".to_owned(),
    };
    output::line(&format!("baseline   {:.4} m ({source})", report.baseline_m))?;
    if let (Some(scale), Some(sigma)) = (report.focal_scale, report.focal_scale_sigma) {
        output::line(&format!("focal      × {scale:.5} ± {:.5} (95 %)", SIGMAS_95 * sigma))?;
    }
    output::line(&format!(
        "row error  {:.3} px RMS before, {:.3} px after; {:.3} px of it is the pose's",
        report.row_error_before_px, report.row_error_after_px, report.drift_px
    ))?;
    if let Some(other) = report.alternative {
        output::line(&format!(
            "ambiguous  the scene is flat, and a second pose fits as well ({:.1}° turned, baseline {:.1}° off): \
             the one nearer to the calibration was taken",
            other.rotation_deg, other.direction_deg
        ))?;
    }
    let verdict = if report.has_drifted { "the calibration has drifted" } else { "the calibration holds" };
    output::line(&format!("verdict    {verdict}"))?;
    if let Some(out) = &args.out {
        output::line(&format!("written    {}", out.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}
