//! `halcyon rig`

use std::path::PathBuf;
use std::process::ExitCode;

use halcyon_chassis::ConfigError;
use halcyon_reconstruction::cli::{self, BudgetRow, RigOptions, RigReport, RigSource};
use halcyon_reconstruction::core::calibrate::SIGMAS_95;
use halcyon_reconstruction::files::{Output, check_outputs, has_ending, rig_files, write_bytes};

use super::output::significant;
use super::{bad_input, output};
use crate::report::{Chart, ChartError, Page, Series};

/// Say what a rig can measure, from which altitude: footprint, elevation noise, smallest waves, best altitude
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon rig --rig rig.yaml --wave-height 0.05 --plot rig.html
Example: halcyon rig --fov-deg 64 --width 640 --height 480 --baseline-m 0.092 --altitudes 0.5..5

For a rig that looks straight down. Elevation noise of a point is altitude² / (f b) times the disparity's; waves without a
given length are those of a fully developed sea, 39 times as long as high. What a wave loses in the footprint's own mean plane
is the worst case: height and attitude give some of it back.")]
pub(super) struct Args {
    /// The rig's calibration, OpenCV YAML
    #[arg(long, value_name = "FILE", conflicts_with_all = ["fov_deg", "width", "height", "baseline_m"])]
    rig: Option<PathBuf>,
    /// Instead of a calibration: horizontal field of view, degrees
    #[arg(long, value_name = "DEG", required_unless_present = "rig", allow_negative_numbers = true)]
    fov_deg: Option<f64>,
    /// Width of the pictures, pixels
    #[arg(long, value_name = "PX", required_unless_present = "rig")]
    width: Option<u32>,
    /// Height of the pictures, pixels
    #[arg(long, value_name = "PX", required_unless_present = "rig")]
    height: Option<u32>,
    /// Distance between the cameras, metres
    #[arg(long, value_name = "M", required_unless_present = "rig", allow_negative_numbers = true)]
    baseline_m: Option<f64>,
    /// Altitudes of the table, metres
    #[arg(long, value_name = "LOW..HIGH", default_value = "0.5..20", allow_hyphen_values = true)]
    altitudes: String,
    /// One standard deviation of a disparity, pixels
    #[arg(long, value_name = "PX", default_value_t = cli::DISPARITY_SIGMA_PX, allow_negative_numbers = true)]
    disparity_sigma_px: f64,
    /// Largest disparity that is searched, pixels; otherwise a quarter of the picture must be in common
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    max_disparity: Option<f64>,
    /// Cell of the elevation grid, metres; otherwise the matching window on the water
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    cell: Option<f64>,
    /// Name the best altitude for waves of this height, metres
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    wave_height: Option<f64>,
    /// Their length, metres; otherwise 39 times their height
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    wavelength: Option<f64>,
    /// Draw it: .svg (one chart) or .html (all of them, and the tables)
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if let Some(plot) = &args.plot {
        let files = args.rig.as_deref().map(rig_files).unwrap_or_default();
        let inputs = files.iter().map(|path| ("--rig", path.as_path()));
        check_outputs(inputs, &[Output::file("--plot", plot, &["svg", "html", "htm"])]).map_err(bad_input)?;
    }
    let report = cli::rig(&options(args)?).map_err(bad_input)?;
    if let Some(path) = &args.plot {
        let drawn = if has_ending(path, &["svg"]) { noise(&report).svg()? } else { page(&report)? };
        write_bytes(path, drawn.as_bytes()).map_err(bad_input)?;
    }
    if args.json {
        output::json(&report)?;
        return Ok(ExitCode::SUCCESS);
    }
    print(&report)?;
    if let Some(path) = &args.plot {
        output::line(&format!("\nwritten {}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn options(args: &Args) -> anyhow::Result<RigOptions> {
    let source = match (&args.rig, args.fov_deg, args.width, args.height, args.baseline_m) {
        (Some(path), ..) => RigSource::File(path.clone()),
        (None, Some(fov_deg), Some(width_px), Some(height_px), Some(baseline_m)) => {
            RigSource::Plan { fov_deg, width_px, height_px, baseline_m }
        }
        // The command line demands them.
        _ => return Err(ConfigError::new("give --rig, or --fov-deg, --width, --height and --baseline-m".to_owned()).into()),
    };
    Ok(RigOptions {
        source,
        altitudes: args.altitudes.clone(),
        disparity_sigma_px: args.disparity_sigma_px,
        disparity_max_px: args.max_disparity,
        cell_m: args.cell,
        wave_height_m: args.wave_height,
        wavelength_m: args.wavelength,
    })
}

const COLUMNS: [&str; 9] = [
    "altitude m",
    "disparity px",
    "shared m",
    "overlap %",
    "pixel mm",
    "point ± mm (95 %)",
    "cell ± mm (95 %)",
    "lengths m",
    "sea heights m",
];
/// Neighbours in the table differ by a few percent: fewer digits would make them the same.
const DIGITS: i32 = 4;

fn columns(row: &BudgetRow) -> [String; 9] {
    let range = |low: Option<f64>, high: Option<f64>| match (low, high) {
        (Some(low), Some(high)) if low <= high => format!("{} – {}", number(low), number(high)),
        _ => "–".into(),
    };
    [
        number(row.altitude_m),
        number(row.disparity_px),
        format!("{} x {}", number(row.shared_m[0]), number(row.shared_m[1])),
        format!("{:.1}", row.overlap * 100.0),
        number(row.pixel_m * 1e3),
        number(SIGMAS_95 * row.point_sigma_m * 1e3),
        number(SIGMAS_95 * row.cell_sigma_m * 1e3),
        range(Some(row.wavelength_m_min), Some(row.wavelength_m_max)),
        range(row.wave_height_m_min, row.wave_height_m_max),
    ]
}

fn number(value: f64) -> String {
    significant(value, DIGITS)
}

const BEST_COLUMNS: [&str; 4] = ["wave height m", "its length m", "best altitude m", "10 % from – to m"];

fn best_columns(best: &cli::BestRow) -> [String; 4] {
    let range = match (best.altitude_m_min, best.altitude_m_max) {
        (Some(low_m), Some(high_m)) => format!("{} – {}", number(low_m), number(high_m)),
        _ => "nowhere".into(),
    };
    [
        number(best.wave_height_m),
        number(best.wavelength_m),
        format!("{} (error {} %)", number(best.altitude_m), significant(best.error * 100.0, 2)),
        range,
    ]
}

/// Altitudes that can be flown.
fn usable(report: &RigReport) -> impl Iterator<Item = &BudgetRow> {
    report.rows.iter().filter(|row| row.usable)
}

fn summary(report: &RigReport) -> String {
    let rig = &report.rig;
    format!(
        "{} x {} px, f {:.1} px ({:.1}° wide), baseline {:.4} m, disparity ± {} px (95 %), window {} px; least altitude {} m",
        rig.width_px,
        rig.height_px,
        rig.focal_px,
        rig.fov_deg,
        rig.baseline_m,
        significant(SIGMAS_95 * rig.disparity_sigma_px, 2),
        rig.window_px,
        number(report.altitude_m_min)
    )
}

fn print(report: &RigReport) -> anyhow::Result<()> {
    output::line(&summary(report))?;
    output::line("")?;
    table(&COLUMNS, usable(report).map(columns))?;
    output::line("")?;
    table(&BEST_COLUMNS, report.best.iter().map(best_columns))
}

fn table<const N: usize>(header: &[&str; N], rows: impl Iterator<Item = [String; N]>) -> anyhow::Result<()> {
    let rows: Vec<[String; N]> = std::iter::once(header.map(str::to_owned)).chain(rows).collect();
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: [usize; N] = std::array::from_fn(width);
    for row in &rows {
        let cells: Vec<String> = row.iter().zip(widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
        output::line(&cells.join("  "))?;
    }
    Ok(())
}

/// Noise and what it allows, against altitude.
fn noise(report: &RigReport) -> Chart {
    let series = |value: fn(&BudgetRow) -> Option<f64>| -> Vec<(f64, f64)> {
        usable(report).map(|row| (row.altitude_m, value(row).unwrap_or(f64::NAN))).collect()
    };
    Chart::new("altitude, m", "metres")
        .with(Series::line("elevation noise of a point, ± (95 %)", series(|row| Some(SIGMAS_95 * row.point_sigma_m))))
        .with(Series::line("elevation noise of a cell, ± (95 %)", series(|row| Some(SIGMAS_95 * row.cell_sigma_m))))
        .with(Series::dashed("wave height that still water reads", series(|row| Some(row.still_height_m))))
        .with(Series::line("lowest sea within 10 %", series(|row| row.wave_height_m_min)))
        .with(Series::line("highest sea within 10 %", series(|row| row.wave_height_m_max)))
        .log_y()
        .low_legend()
}

/// Footprint and wave lengths, against altitude.
fn lengths(report: &RigReport) -> Chart {
    let series =
        |value: fn(&BudgetRow) -> f64| usable(report).map(|row| (row.altitude_m, value(row))).collect::<Vec<(f64, f64)>>();
    Chart::new("altitude, m", "metres")
        .with(Series::line("shared footprint, across", series(|row| row.shared_m[0])))
        .with(Series::line("shared footprint, along", series(|row| row.shared_m[1])))
        .with(Series::dashed("longest wave that fits", series(|row| row.wavelength_m_max)))
        .with(Series::line("shortest wave that is resolved", series(|row| row.wavelength_m_min)))
        .with(Series::line("a pixel on the water", series(|row| row.pixel_m)))
        .log_y()
        .low_legend()
}

fn disparities(report: &RigReport) -> Chart {
    let series =
        |value: fn(&BudgetRow) -> f64| usable(report).map(|row| (row.altitude_m, value(row))).collect::<Vec<(f64, f64)>>();
    Chart::new("altitude, m", "disparity, px; overlap, %")
        .with(Series::line("disparity of the water", series(|row| row.disparity_px)))
        .with(Series::line("overlap of the pictures", series(|row| row.overlap * 100.0)))
        .from_zero()
}

fn page(report: &RigReport) -> Result<String, ChartError> {
    let mut page = Page::new("What this rig can measure");
    page.paragraph(&summary(report));
    page.heading("Best altitude for a wave height");
    let best: Vec<_> = report.best.iter().map(best_columns).collect();
    page.table(&BEST_COLUMNS, &best);
    page.heading("Elevation noise and wave height");
    page.figure(
        &noise(report).svg()?,
        "Half of the 95 % interval of one point and of a cell's mean; the significant wave height that still water would read; and \
         the fully developed seas whose height comes out within 10 %.",
    );
    page.heading("Footprint and wave length");
    page.figure(
        &lengths(report).svg()?,
        "What both cameras see, and the waves between the longest that fits and the shortest that window and cell leave.",
    );
    page.heading("Disparity and overlap");
    page.figure(&disparities(report).svg()?, "The water's disparity, and the share of the picture that both cameras see.");
    page.heading("Numbers");
    let rows: Vec<_> = usable(report).map(columns).collect();
    page.table(&COLUMNS, &rows);
    Ok(page.html())
}
