//! `halcyon bench`

use std::process::ExitCode;

use serde::Serialize;

use super::output;
use crate::accuracy::{self, AccuracyRow, Extent};

/// Judge the measurement chain against water that is known exactly
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon bench --accuracy --quick\n\nExits with 1 where a figure is not good enough.")]
pub(super) struct Args {
    /// Accuracy on simulated water, beside the thesis's: planes, still water, wave tank, flights, stated uncertainty
    #[arg(long, required = true)]
    accuracy: bool,
    /// Smaller pictures and fewer pairs: about a minute instead of ten
    #[arg(long)]
    quick: bool,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// As `--json` prints it.
#[derive(Debug, Serialize)]
struct Report {
    machine: Machine,
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
    let rows = accuracy::run(if args.quick { Extent::Quick } else { Extent::Full }, &mut progress);
    bar.finish_and_clear();
    let rows = rows?;
    let passed = rows.iter().all(|row| row.passed);
    if args.json {
        output::json(&Report { machine: Machine::this(), rows })?;
    } else {
        output::line(&format!("{:<46} {:<36} {:>10} {:>16} {:>8}", "experiment", "figure", "measured", "wanted", "thesis"))?;
        for row in &rows {
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
    }
    Ok(if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
