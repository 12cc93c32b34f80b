//! `halcyon calibrate`

use std::path::PathBuf;
use std::process::ExitCode;

use halcyon_model::RigCalibration;
use halcyon_reconstruction::cli::{self, CalibrateReport, CalibrateRequest, CameraReport};
use halcyon_reconstruction::core::calibrate::{Options, SIGMAS_95};
use halcyon_reconstruction::files::write_bytes;

use super::{bad_input, output};

mod page;

/// Calibrate a stereo rig from pictures of a checkerboard, or convert a calibration
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  halcyon calibrate --left 'samples/left*.jpg' --right 'samples/right*.jpg' --board 9x6 --square 0.025 --out rig.yaml --report report.html
  halcyon calibrate --from ros_folder --out rig.yaml")]
pub(super) struct Args {
    /// Pictures of the left camera, a quoted pattern
    #[arg(long, value_name = "GLOB", required_unless_present = "from")]
    left: Option<String>,
    /// Pictures of the right camera, a quoted pattern; paired with the left ones in natural order
    #[arg(long, value_name = "GLOB", required_unless_present = "from")]
    right: Option<String>,
    /// Inner corners of the board
    #[arg(long, value_name = "COLSxROWS", required_unless_present = "from")]
    board: Option<String>,
    /// Side of one square, metres: 0.025 for 25 mm
    #[arg(long, value_name = "M", required_unless_present = "from", allow_negative_numbers = true)]
    square: Option<f64>,
    /// Convert this calibration instead: an OpenCV YAML file, or a folder with ROS's left.yaml and right.yaml
    #[arg(long, value_name = "PATH", conflicts_with_all = ["left", "right", "board", "square", "report"])]
    from: Option<PathBuf>,
    /// Write the calibration here, as OpenCV YAML (.yaml or .yml)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Write the calibration into this folder, as ROS camera_info: left.yaml and right.yaml
    #[arg(long, value_name = "DIR")]
    ros: Option<PathBuf>,
    /// Write a report here, one HTML page to look at (.html)
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Take the board for flat; otherwise its warp is estimated where the pictures show one
    #[arg(long)]
    flat_board: bool,
    /// Distance that depth uncertainty is told for, metres
    #[arg(long, value_name = "M", default_value_t = 1.0, allow_negative_numbers = true)]
    distance: f64,
    /// Starts of the search for the best solution
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u16).range(1..=1000))]
    starts: u16,
    /// Seed of the random starts
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if let Some(from) = &args.from {
        let rig = cli::convert_rig(from, args.out.as_deref(), args.ros.as_deref()).map_err(bad_input)?;
        return show_rig(args, &rig);
    }
    let request = request(args);
    request.check(args.report.as_deref()).map_err(bad_input)?;
    let bar = output::bar("corners");
    let mut progress = |done: usize, total: usize| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let done = cli::calibrate(&request, &mut progress);
    bar.finish_and_clear();
    let (report, calibration) = done.map_err(bad_input)?;
    if let Some(path) = &args.report {
        let page = page::page(&report, &calibration)?;
        write_bytes(path, page.as_bytes()).map_err(bad_input)?;
    }
    if args.json {
        output::json(&report)?;
        return Ok(ExitCode::SUCCESS);
    }
    show(args, &report)
}

fn request(args: &Args) -> CalibrateRequest<'_> {
    CalibrateRequest {
        left: args.left.as_deref().unwrap_or_default(),
        right: args.right.as_deref().unwrap_or_default(),
        board: args.board.as_deref().unwrap_or_default(),
        square_m: args.square.unwrap_or(f64::NAN),
        options: Options {
            flat_board: args.flat_board,
            starts: usize::from(args.starts),
            depth_at_m: args.distance,
            seed: args.seed,
        },
        out: args.out.as_deref(),
        ros: args.ros.as_deref(),
    }
}

fn show(args: &Args, report: &CalibrateReport) -> anyhow::Result<ExitCode> {
    for view in report.views.iter().filter(|view| !view.used) {
        let problem = view.problem.unwrap_or("unknown");
        output::line(&format!("left out   {} and {}: {problem}", view.left.display(), view.right.display()))?;
    }
    output::line(&format!("views      {} of {} used", report.views_used, report.views_total))?;
    output::line(&format!("corners    {}, {} left out", report.corners_total, report.corners_rejected))?;
    output::line(&format!(
        "stereo RMS {:.3} px ({:.3} px with every corner and a flat board)",
        report.stereo_rms_px, report.stereo_rms_all_px
    ))?;
    output::line(&format!("row error  {:.3} px RMS, {:.3} px at most", report.row_error_rms_px, report.row_error_max_px))?;
    output::line(&format!("starts     {} of {} end here", report.starts_agreeing, report.starts))?;
    output::line(&format!("baseline   {:.5} m ± {:.5} (95 %)", report.baseline_m, report.baseline_m_high - report.baseline_m))?;
    for (name, camera) in [("left", &report.left), ("right", &report.right)] {
        output::line(&format!("{name:<10} {}", camera_line(camera)))?;
    }
    if let (Some(warp), Some(high)) = (report.board_warp_m, report.board_warp_m_high) {
        let [along_rows, along_columns] = [0, 1].map(|k| format!("{:.3} ± {:.3} mm", 1e3 * warp[k], 1e3 * (high[k] - warp[k])));
        output::line(&format!("board warp {along_rows} along rows, {along_columns} along columns (95 %)"))?;
    }
    let depth = &report.depth_uncertainty;
    if let (Some(median_m), Some(max_m)) = (depth.median_m, depth.max_m) {
        let [median_mm, max_mm] = [median_m, max_m].map(|sigma_m| 1e3 * SIGMAS_95 * sigma_m);
        output::line(&format!(
            "depth      at {} m known to ± {median_mm:.1} mm (95 %, median over the picture), ± {max_mm:.1} mm at worst",
            depth.distance_m
        ))?;
    }
    written(args)
}

fn camera_line(camera: &CameraReport) -> String {
    let CameraReport { fx_px, fy_px, cx_px, cy_px, rms_px, .. } = camera;
    format!(
        "fx {fx_px:.2} ± {:.2} fy {fy_px:.2} ± {:.2} cx {cx_px:.2} ± {:.2} cy {cy_px:.2} ± {:.2} px (95 %), RMS {rms_px:.3} px",
        camera.fx_px_high - fx_px,
        camera.fy_px_high - fy_px,
        camera.cx_px_high - cx_px,
        camera.cy_px_high - cy_px
    )
}

fn show_rig(args: &Args, rig: &RigCalibration) -> anyhow::Result<ExitCode> {
    let camera = |camera: &halcyon_model::CameraIntrinsics| {
        let halcyon_model::CameraIntrinsics { fx_px, fy_px, cx_px, cy_px, distortion } = *camera;
        serde_json::json!({ "fx_px": fx_px, "fy_px": fy_px, "cx_px": cx_px, "cy_px": cy_px, "distortion": distortion })
    };
    if args.json {
        output::json(&serde_json::json!({
            "width_px": rig.width_px, "height_px": rig.height_px, "baseline_m": rig.baseline_m(),
            "left": camera(&rig.left), "right": camera(&rig.right),
        }))?;
        return Ok(ExitCode::SUCCESS);
    }
    output::line(&format!("size       {} x {} px", rig.width_px, rig.height_px))?;
    output::line(&format!("baseline   {:.5} m", rig.baseline_m()))?;
    for (name, camera) in [("left", &rig.left), ("right", &rig.right)] {
        let halcyon_model::CameraIntrinsics { fx_px, fy_px, cx_px, cy_px, .. } = *camera;
        output::line(&format!("{name:<10} fx {fx_px:.2} fy {fy_px:.2} cx {cx_px:.2} cy {cy_px:.2} px"))?;
    }
    written(args)
}

fn written(args: &Args) -> anyhow::Result<ExitCode> {
    for path in [&args.out, &args.ros, &args.report].into_iter().flatten() {
        output::line(&format!("written    {}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}
