//! `halcyon lab`

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use halcyon_chassis::ConfigError;
use halcyon_chassis::clock::{Clock, ClockConfig};
use serde::Serialize;

use super::output;
use crate::accuracy::Extent;
use crate::lab::{self, Exhibit, Experiment, Finding, Lab, LabError, Part};

/// Make the thesis's tables and figures again, its values beside ours
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: halcyon lab --quick --out lab, then open lab/index.html\n         halcyon lab \"table 5-1\" 5-17 \"chapter 3\""
)]
pub(super) struct Args {
    /// Which: a name of --list, a table or figure (5-17, "table 5-1"), a chapter ("chapter 4"); all where none is named
    #[arg(value_name = "EXPERIMENT")]
    experiments: Vec<String>,
    /// List the experiments and end
    #[arg(long)]
    list: bool,
    /// Smaller pictures and fewer pairs: about two minutes instead of half an hour
    #[arg(long)]
    quick: bool,
    /// OpenCV's sample pictures, as `make samples` fetches them
    #[arg(long, value_name = "FOLDER", default_value = "samples")]
    samples: PathBuf,
    /// Report with every figure (index.html), clouds and meshes (.ply): written after each experiment, beside what earlier runs have left there
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// One experiment, as `--json` prints it.
#[derive(Debug, Serialize)]
struct Row<'a> {
    name: &'static str,
    shows: &'static [&'static str],
    about: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    findings: Option<&'a [Finding]>,
}

impl<'a> Row<'a> {
    fn new(experiment: &Experiment, findings: Option<&'a [Finding]>) -> Self {
        Self { name: experiment.name, shows: experiment.shows, about: experiment.about, findings }
    }
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    experiments: Vec<Row<'a>>,
}

pub(super) fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let chosen = lab::select(&args.experiments)
        .map_err(|name| ConfigError::new(format!("no experiment is called {name:?}: `halcyon lab --list` names them")))?;
    if args.list {
        return list(&chosen, args.json);
    }
    let lab = Lab::new(args.samples.clone(), if args.quick { Extent::Quick } else { Extent::Full });
    if let Some(out) = &args.out {
        let is_writable = std::fs::create_dir_all(out).and_then(|()| tempfile::tempfile_in(out).map(drop));
        is_writable.map_err(|error| ConfigError::new(format!("--out {}: {error}", out.display())))?;
    }
    let bar = output::bar("experiments");
    bar.set_length(chosen.len() as u64);
    let lab = lab.heard_by({
        let bar = bar.clone();
        move |done, of| bar.set_message(format!("{done} of {of}"))
    });
    let total = chosen.len();
    let mut exhibits: Vec<(&Experiment, Exhibit)> = Vec::new();
    for (number, experiment) in chosen.into_iter().enumerate() {
        bar.set_message(experiment.name);
        let begun = Instant::now();
        let exhibit = match experiment.run(&lab) {
            Ok(exhibit) => exhibit,
            Err(error) => {
                bar.finish_and_clear();
                return Err(failed(experiment, error));
            }
        };
        // What is done is safe, whatever becomes of the rest.
        if let Some(out) = &args.out {
            let part = Part::new(experiment, &exhibit, &run_of(args.quick));
            lab::write(out, &part, &exhibit).map_err(|error| ConfigError::new(format!("{}: {error}", out.display())))?;
        }
        output::step(&bar, &format!("[{}/{total}] {}: {:.1} s", number + 1, experiment.name, begun.elapsed().as_secs_f64()));
        exhibits.push((experiment, exhibit));
        bar.inc(1);
    }
    bar.finish_and_clear();
    if args.json {
        let experiments = exhibits.iter().map(|(experiment, exhibit)| Row::new(experiment, Some(&exhibit.findings))).collect();
        output::json(&Report { experiments })?;
    } else {
        print(&exhibits)?;
        if let Some(out) = &args.out {
            output::line(&format!("written    {}", out.join("index.html").display()))?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Which run a part of the report is of.
fn run_of(quick: bool) -> String {
    let now =
        jiff::Timestamp::from_second(Clock::new(&ClockConfig::default()).now().as_nanos() / 1_000_000_000).unwrap_or_default();
    let extent = if quick { "Quick run (smaller pictures, fewer pairs than the text may say)" } else { "Full run" };
    format!("{extent} of {}.", now.strftime("%Y-%m-%d %H:%M UTC"))
}

/// Missing pictures are bad input; what cannot be measured is a failure.
fn failed(experiment: &Experiment, error: LabError) -> anyhow::Error {
    match error {
        LabError::Samples(_) | LabError::File(_) => super::bad_input(error),
        other => anyhow::Error::new(other).context(format!("experiment {}", experiment.name)),
    }
}

fn list(chosen: &[&Experiment], json: bool) -> anyhow::Result<ExitCode> {
    if json {
        output::json(&Report { experiments: chosen.iter().map(|experiment| Row::new(experiment, None)).collect() })?;
        return Ok(ExitCode::SUCCESS);
    }
    for experiment in chosen {
        output::line(&format!("{:<16} {}", experiment.name, experiment.about))?;
        output::line(&format!("{:<16}   {}", "", experiment.shows.join(", ")))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn print(exhibits: &[(&Experiment, Exhibit)]) -> anyhow::Result<()> {
    output::line(&format!("{:<16} {:<62} {:>12} {:>10}", "experiment", "figure", "measured", "thesis"))?;
    for (experiment, exhibit) in exhibits {
        for finding in &exhibit.findings {
            let figure =
                if finding.unit == "1" { finding.figure.clone() } else { format!("{}, {}", finding.figure, finding.unit) };
            let thesis = finding.thesis.map_or_else(|| "-".to_owned(), lab::number);
            output::line(&format!("{:<16} {figure:<62} {:>12} {thesis:>10}", experiment.name, lab::number(finding.value)))?;
        }
    }
    Ok(())
}
