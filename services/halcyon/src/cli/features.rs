//! `halcyon features`

use std::path::PathBuf;
use std::process::ExitCode;

use halcyon_reconstruction::cli;

use super::{bad_input, output};

/// Find and match features of a pair: counts before and after RANSAC, fundamental matrix, pose
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: halcyon features --left samples/aloeL.jpg --right samples/aloeR.jpg --method all --out matches.png"
)]
pub(super) struct Args {
    /// Left picture
    #[arg(long, value_name = "FILE")]
    left: PathBuf,
    /// Right picture
    #[arg(long, value_name = "FILE")]
    right: PathBuf,
    /// sift, surf, orb, akaze or all
    #[arg(long, default_value = "sift")]
    method: String,
    /// The rig that took the pictures (OpenCV YAML): adds essential matrix, pose, projection matrices and points
    #[arg(long, value_name = "FILE")]
    rig: Option<PathBuf>,
    /// Matches within this distance of the epipolar geometry are kept, pixels
    #[arg(long, value_name = "PX", default_value_t = 1.0, allow_negative_numbers = true)]
    ransac_px: f64,
    /// The strongest so many keypoints of each picture
    #[arg(long, value_name = "N", default_value_t = 2000)]
    keypoints: usize,
    /// Nearest over second-nearest distance of descriptors; 1 takes every nearest neighbour, as the thesis does
    #[arg(long, value_name = "RATIO", default_value_t = 0.8, allow_negative_numbers = true)]
    ratio: f64,
    /// Keep matches that are nearest in one direction only
    #[arg(long)]
    one_way: bool,
    /// Picture of the matches before and after RANSAC (.png); with all methods, one each
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Triangulated matches (.ply), metres; needs --rig. Exit code 1 where there are none
    #[arg(long, value_name = "FILE")]
    cloud: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let spinner = output::spinner();
    spinner.set_message("features");
    let report = cli::features(&cli::FeaturesOptions {
        left: &args.left,
        right: &args.right,
        method: &args.method,
        rig: args.rig.as_deref(),
        ransac_px: args.ransac_px,
        keypoints_max: args.keypoints,
        ratio_max: args.ratio,
        is_mutual: !args.one_way,
        out: args.out.as_deref(),
        cloud: args.cloud.as_deref(),
    });
    spinner.finish_and_clear();
    let report = report.map_err(bad_input)?;
    // What there is, is shown; that a file asked for is not there is a failure all the same.
    for cloud in &report.missing {
        output::note(&format!("error: --cloud {} is not written: {}", cloud.path.display(), cloud.why));
    }
    let code = if report.missing.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    if args.json {
        output::json(&report)?;
        return Ok(code);
    }
    output::line("           before RANSAC            after RANSAC")?;
    output::line("method      left   right  matches    left   right")?;
    for row in &report.rows {
        output::line(&format!(
            "{:<8} {:>7} {:>7} {:>8} {:>7} {:>7}",
            row.method, row.left, row.right, row.matches, row.left_after, row.right_after
        ))?;
    }
    for row in &report.rows {
        let Some(fundamental) = &row.fundamental else {
            output::line(&format!("{}: no epipolar geometry that enough matches agree on", row.method))?;
            continue;
        };
        output::line(&format!("{}:", row.method))?;
        matrix("F", fundamental)?;
        if let Some(pose) = &row.pose {
            matrix("E", &pose.essential)?;
            matrix("R", &pose.rotation)?;
            matrix("t", &[pose.direction])?;
            matrix("Ml", &pose.left_projection)?;
            matrix("Mr", &pose.right_projection)?;
            output::line(&format!(
                "  {} points; R {:.3}°, t {:.3}° off the rig's",
                pose.points, pose.rotation_off_deg, pose.direction_off_deg
            ))?;
        }
    }
    for file in &report.files {
        output::line(&format!("written    {}", file.display()))?;
    }
    Ok(code)
}

fn matrix<const N: usize>(name: &str, rows: &[[f64; N]]) -> anyhow::Result<()> {
    for (i, row) in rows.iter().enumerate() {
        let numbers: Vec<String> = row.iter().map(|number| format!("{number:>13.5e}")).collect();
        output::line(&format!("  {:<3}{}", if i == 0 { name } else { "" }, numbers.join(" ")))?;
    }
    Ok(())
}
