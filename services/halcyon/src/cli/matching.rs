//! `halcyon match`

use std::path::PathBuf;
use std::process::ExitCode;

use halcyon_reconstruction::cli;

use super::{bad_input, output};

/// Match a rectified pair of pictures to a disparity map
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: halcyon match --left samples/aloeL.jpg --right samples/aloeR.jpg --max-disparity 256 --out d.pfm"
)]
pub(super) struct Args {
    /// Left picture, rectified
    #[arg(long, value_name = "FILE")]
    left: PathBuf,
    /// Right picture, rectified
    #[arg(long, value_name = "FILE")]
    right: PathBuf,
    /// Largest disparity to search, pixels
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    max_disparity: f64,
    /// bm, sgbm, sgbm-3way or sgbm-hh
    #[arg(long, default_value = "sgbm")]
    engine: String,
    /// Where the disparity goes: .pfm (numbers, NaN for no match) or .png (colours)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let spinner = output::spinner();
    spinner.set_message("matching");
    let report = cli::match_pair(&args.left, &args.right, args.max_disparity, &args.engine, &args.out);
    spinner.finish_and_clear();
    let report = report.map_err(bad_input)?;
    if args.json {
        output::json(&report)?;
    } else {
        output::line(&format!(
            "{}: {} x {} px, {:.1} % matched, {:.0} ms; written {}",
            report.engine,
            report.width_px,
            report.height_px,
            100.0 * report.density,
            report.wall_ms,
            args.out.display()
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
