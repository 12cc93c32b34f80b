//! `halcyon bench`

use std::path::PathBuf;
use std::process::ExitCode;

use serde::Serialize;

use super::output;
use crate::accuracy::{self, AccuracyRow, Extent};
use crate::speed::{Bench, SpeedReport, SpeedRow};

/// Measure how fast and how exact Halcyon is, beside OpenCV
///
/// Without --accuracy: every matching engine on the same pairs in one run, with one thread and with all; bad pixels against the truth;
/// sub-pixel bias; and the whole chain from pair to patch.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples: halcyon bench
          halcyon bench --quick --json
          halcyon bench --accuracy

--accuracy exits with 1 where a figure is not good enough.")]
pub(super) struct Args {
    /// Judge the measurement chain against simulated water that is known exactly: planes, still water, wave tank, flights, stated
    /// uncertainty, beside the thesis's
    #[arg(long)]
    accuracy: bool,
    /// Smaller pictures and fewer of them: about a minute instead of several
    #[arg(long)]
    quick: bool,
    /// Where `make samples` put OpenCV's sample pictures; without them the aloe pair is left out
    #[arg(long, value_name = "DIR", default_value = "samples")]
    samples: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// As `--json` prints it.
#[derive(Debug, Serialize)]
struct Report<T> {
    machine: Machine,
    #[serde(flatten)]
    results: T,
}

#[derive(Debug, Serialize)]
struct Accuracy {
    rows: Vec<AccuracyRow>,
}

/// What it ran on. Accuracy does not depend on it.
#[derive(Debug, Serialize)]
struct Machine {
    /// As the system calls it; absent where it does not say.
    processor: Option<String>,
    threads: usize,
}

impl Machine {
    fn this() -> Self {
        let info = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let name = info.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
        let threads = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
        Self { processor: name.map(|(_, name)| name.trim().to_owned()), threads }
    }
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let bar = output::bar("experiments");
    let mut progress = |done: usize, total: usize, next: &str| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
        bar.set_message(next.to_owned());
    };
    let extent = if args.quick { Extent::Quick } else { Extent::Full };
    if args.accuracy {
        let rows = accuracy::run(extent, &mut progress);
        bar.finish_and_clear();
        let rows = rows?;
        let passed = rows.iter().all(|row| row.passed);
        if args.json {
            output::json(&Report { machine: Machine::this(), results: Accuracy { rows } })?;
        } else {
            print_accuracy(&rows)?;
        }
        return Ok(if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE });
    }
    let report = Bench { extent, samples: args.samples.clone() }.run(&mut progress);
    bar.finish_and_clear();
    let report = report?;
    if args.json {
        output::json(&Report { machine: Machine::this(), results: report })?;
    } else {
        print_speed(&report)?;
    }
    Ok(ExitCode::SUCCESS)
}

fn print_accuracy(rows: &[AccuracyRow]) -> anyhow::Result<()> {
    output::line(&format!("{:<46} {:<36} {:>10} {:>16} {:>8}", "experiment", "figure", "measured", "wanted", "thesis"))?;
    for row in rows {
        let wanted = match row.wanted {
            (0.0, high) => format!("at most {high:.4}"),
            (low, high) => format!("{low} to {high}"),
        };
        let thesis = row.thesis.map_or_else(|| "-".into(), |thesis| format!("{thesis}"));
        let mark = if row.passed { "" } else { "  MISSED" };
        let (what, figure, unit) = (&row.what, row.figure, row.unit);
        let figure = if unit == "1" { figure.to_owned() } else { format!("{figure}, {unit}") };
        output::line(&format!("{what:<46} {figure:<36} {:>10.4} {wanted:>16} {thesis:>8}{mark}", row.value))?;
    }
    Ok(())
}

fn print_speed(report: &SpeedReport) -> anyhow::Result<()> {
    let machine = Machine::this();
    let processor = machine.processor.as_deref().unwrap_or("a processor without a name");
    output::line(&format!("{processor}, {} threads", machine.threads))?;
    let mut group = None;
    for row in &report.rows {
        let this = (&row.what, &row.size);
        if group != Some(this) {
            group = Some(this);
            let range = row.disparities.map_or(String::new(), |count| format!(", {count} disparities"));
            output::line(&format!("\n{}, {}{range}; ratios to {}", row.what, row.size, row.ratio_to))?;
            output::line(&format!(
                "  {:<32} {:>7} {:>10} {:>10} {:>7} {:>8} {:>9} {:>8}",
                "engine", "threads", "CPU, ms", "wall, ms", "ratio", "MDE/s", "density", "bad 1 px"
            ))?;
        }
        output::line(&speed_line(row))?;
    }
    output::line("\nshifts of 20.0 to 20.9 px of a textured pair, noise of 2 grey levels")?;
    output::line(&format!("  {:<32} {:>10} {:>10} {:>9}", "engine", "bias, px", "RMS, px", "density"))?;
    for row in &report.sub_pixel {
        let (bias_px, rms_px, density) = (row.bias_px, row.rms_px, 100.0 * row.density);
        output::line(&format!("  {:<32} {bias_px:>10.4} {rms_px:>10.4} {density:>7.1} %", row.engine))?;
    }
    Ok(())
}

fn speed_line(row: &SpeedRow) -> String {
    let or_dash = |text: Option<String>| text.unwrap_or_else(|| "-".into());
    let cpu = or_dash(row.cpu_ms.map(|ms| format!("{ms:.1}")));
    let mde = or_dash(row.mde_per_s.map(|mde| format!("{mde:.0}")));
    let density = or_dash(row.quality.map(|quality| format!("{:.1} %", 100.0 * quality.density)));
    let bad = or_dash(row.quality.map(|quality| format!("{:.2} %", 100.0 * quality.bad1)));
    let (engine, threads, wall_ms, ratio) = (&row.engine, row.threads, row.wall_ms, row.ratio);
    format!("  {engine:<32} {threads:>7} {cpu:>10} {wall_ms:>10.1} {ratio:>7.3} {mde:>8} {density:>9} {bad:>8}")
}
