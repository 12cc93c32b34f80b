//! `halcyon calibrate`

use std::path::PathBuf;
use std::process::ExitCode;

use halcyon_reconstruction::cli;

use super::{bad_input, output};

/// Calibrate a stereo rig from pictures of a checkerboard
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon calibrate --left 'samples/left*.jpg' --right 'samples/right*.jpg' \
                        --board 9x6 --square 0.025 --out rig.yaml")]
pub(super) struct Args {
    /// Pictures of the left camera, a quoted pattern
    #[arg(long, value_name = "GLOB")]
    left: String,
    /// Pictures of the right camera, a quoted pattern; paired with the left ones in natural order
    #[arg(long, value_name = "GLOB")]
    right: String,
    /// Inner corners of the board
    #[arg(long, value_name = "COLSxROWS")]
    board: String,
    /// Side of one square, metres
    #[arg(long, value_name = "M")]
    square: f64,
    /// Write the calibration here, as OpenCV YAML
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let bar = output::bar("corners");
    let mut progress = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let report = cli::calibrate(&args.left, &args.right, &args.board, args.square, args.out.as_deref(), &mut progress);
    bar.finish_and_clear();
    let report = report.map_err(bad_input)?;
    if args.json {
        output::json(&report)?;
        return Ok(ExitCode::SUCCESS);
    }
    for view in report.views.iter().filter(|view| !view.used) {
        let problem = view.problem.unwrap_or("unknown");
        output::line(&format!("left out   {} and {}: {problem}", view.left.display(), view.right.display()))?;
    }
    output::line(&format!("views      {} of {} used", report.views_used, report.views_total))?;
    output::line(&format!("corners    {}, {} left out", report.corners_total, report.corners_rejected))?;
    output::line(&format!("stereo RMS {:.3} px", report.stereo_rms_px))?;
    output::line(&format!("row error  {:.3} px RMS, {:.3} px at most", report.row_error_rms_px, report.row_error_max_px))?;
    output::line(&format!("baseline   {:.4} m", report.baseline_m))?;
    for (name, camera) in [("left", &report.left), ("right", &report.right)] {
        output::line(&format!(
            "{name:<10} fx {:.1} fy {:.1} cx {:.1} cy {:.1} px, RMS {:.3} px",
            camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px, camera.rms_px
        ))?;
    }
    if let Some(out) = &args.out {
        output::line(&format!("written    {}", out.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}
