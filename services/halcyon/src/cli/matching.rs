//! `halcyon match`

use std::path::PathBuf;
use std::process::ExitCode;

use halcyon_reconstruction::cli::{self, MatchOptions};

use super::{bad_input, output};

/// Match a rectified pair of pictures to a disparity map
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Examples: halcyon match --left samples/aloeL.jpg --right samples/aloeR.jpg --max-disparity 256 --out d.pfm
          halcyon match --left samples/aloeL.jpg --right samples/aloeR.jpg --max-disparity 223 \\
                        --engine sgm-census --paths 16 --truth samples/aloeGT.png --out d.png"
)]
pub(super) struct Args {
    /// Left picture, rectified
    #[arg(long, value_name = "FILE")]
    left: PathBuf,
    /// Right picture, rectified
    #[arg(long, value_name = "FILE")]
    right: PathBuf,
    /// Largest disparity to search, pixels. OpenCV's engines search up to the next multiple of 16; what they find beyond this is dropped
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    max_disparity: f64,
    /// For work guided (about a plane, sgm where there is none), sgm, sgm8, or OpenCV's bm, sgbm, sgbm-3way, sgbm-hh4 or sgbm-hh.
    /// For study the reference matcher: wta-COST (winner takes all) or sgm-COST (semi-global), where COST is sad, ssd, ncc, rank,
    /// census or mi
    #[arg(long, default_value = "guided")]
    engine: String,
    /// Side of the window, pixels, odd; without it what suits the engine
    #[arg(long, value_name = "PX")]
    window: Option<u32>,
    /// Where the disparity goes: .pfm (numbers, NaN for no match) or .png (colours)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// The true disparity, to count bad pixels against: a PFM, or a picture whose grey levels stand for pixels, 0 for unknown
    #[arg(long, value_name = "FILE")]
    truth: Option<PathBuf>,
    /// Pixels of disparity for one grey level of the truth
    #[arg(long, value_name = "PX", default_value_t = 1.0, allow_negative_numbers = true)]
    truth_scale: f32,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    study: Study,
}

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Reference matcher (wta-…, sgm-…)")]
struct Study {
    /// One window, or the best of 9 that contain the pixel (Fusiello 1997)
    #[arg(long, value_name = "1|9")]
    windows: Option<u32>,
    /// -rank, -census: side of the neighbourhood that is ranked, pixels, odd, 3 to 11
    #[arg(long, value_name = "PX")]
    transform: Option<u32>,
    /// sgm-: from how many directions paths come
    #[arg(long, value_name = "4|8|16")]
    paths: Option<u32>,
    /// sgm-: penalty for a step of disparity by one pixel, in the unit of the cost for one pixel
    #[arg(long, value_name = "COST", allow_negative_numbers = true)]
    p1: Option<f32>,
    /// sgm-: penalty for a larger step
    #[arg(long, value_name = "COST", allow_negative_numbers = true)]
    p2: Option<f32>,
    /// sgm-: lower P2 where brightness steps as well
    #[arg(long)]
    adaptive_p2: bool,
    /// Keep matches on which left and right disagree
    #[arg(long)]
    no_lr_check: bool,
    /// By how many percent the best cost must beat all others
    #[arg(long, value_name = "PERCENT", allow_negative_numbers = true)]
    uniqueness: Option<f32>,
    /// Whole pixels only
    #[arg(long)]
    no_sub_pixel: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let options = MatchOptions {
        window_px: args.window,
        windows: args.study.windows,
        transform_px: args.study.transform,
        paths: args.study.paths,
        p1: args.study.p1,
        p2: args.study.p2,
        adaptive_p2: args.study.adaptive_p2,
        no_left_right_check: args.study.no_lr_check,
        uniqueness_percent: args.study.uniqueness,
        no_sub_pixel: args.study.no_sub_pixel,
        truth: args.truth.clone(),
        truth_scale_px: args.truth_scale,
    };
    let spinner = output::spinner();
    spinner.set_message("matching");
    let report = cli::match_pair(&args.left, &args.right, args.max_disparity, &args.engine, &options, &args.out);
    spinner.finish_and_clear();
    let report = report.map_err(bad_input)?;
    output::warnings(&report.warnings);
    if args.json {
        output::json(&report)?;
        return Ok(ExitCode::SUCCESS);
    }
    output::line(&format!(
        "{}: {} x {} px, {:.1} % matched, {:.0} ms; written {}",
        report.engine,
        report.width_px,
        report.height_px,
        100.0 * report.density,
        report.wall_ms,
        args.out.display()
    ))?;
    if let Some(truth) = report.truth {
        output::line(&format!(
            "truth: {} px known, {:.1} % of them matched; of these {:.2} % off by more than 1 px, {:.2} % by more than 2 px; \
             mean error {:.2} px",
            truth.known,
            100.0 * truth.density,
            100.0 * truth.bad1,
            100.0 * truth.bad2,
            truth.mean_error_px
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
