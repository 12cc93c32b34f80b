//! `halcyon survey`

use std::path::PathBuf;
use std::process::ExitCode;

use halcyon_capture::SurveyFolder;
use halcyon_chassis::{ConfigError, Options};
use halcyon_reconstruction::cli::{self as reconstruction, ReconstructOptions, SurveyReport};
use halcyon_reconstruction::files::{Output, check_outputs, write_bytes};
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::cli::{SeaReport, Survey};
use serde::Serialize;

use super::reconstruct::{How, frames, show};
use super::waves::{WitnessArgs, draw, four, rows, witness_rows};
use super::{bad_input, output};
use crate::report::{ChartError, Page};

/// Judge the sea state of a survey folder: heights with intervals, verdict, maps, report
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon survey lake --report lake.html --grid lake.nc
Example: halcyon survey lake --window 60 --json --set wave_assessment.h_s_m_max=0.1

A survey folder has rig.yaml, left/, right/ and frames.csv (name,stamp_s and roll_deg,pitch_deg,heading_deg,height_m where a carrier knew
them; without, the rig is taken as fixed). `halcyon sim render` writes one. The verdict is by the limits of [wave_assessment].")]
pub(super) struct Args {
    /// The survey folder
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Judge the last so many seconds; otherwise the whole survey
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    window: Option<f64>,
    /// Length of the spectrum's segments, seconds
    #[arg(long, value_name = "S", default_value_t = 32.0, allow_negative_numbers = true)]
    segment: f64,
    #[command(flatten)]
    how: How,
    /// One standard deviation of heights, metres
    #[arg(long, value_name = "M", default_value_t = 0.3, allow_negative_numbers = true)]
    height_sigma_m: f64,
    /// One standard deviation of roll and pitch, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.5, allow_negative_numbers = true)]
    attitude_sigma_deg: f64,
    #[command(flatten)]
    witness: WitnessArgs,
    /// Write elevation maps over time, NetCDF-4 with CF names
    #[arg(long, value_name = "FILE.nc")]
    grid: Option<PathBuf>,
    /// Write them in the layout of WASS
    #[arg(long, value_name = "FILE.nc")]
    wass: Option<PathBuf>,
    /// Write a report
    #[arg(long, value_name = "FILE.html")]
    report: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// As `--json` prints it.
#[derive(Debug, Serialize)]
struct Judged {
    /// The reconstruction.
    #[serde(flatten)]
    survey: SurveyReport,
    sea_state: SeaReport,
    verdict: halcyon_wave_assessment::cli::VerdictReport,
}

pub(super) fn run(options: &Options, args: &Args) -> anyhow::Result<ExitCode> {
    // Checks the standard deviations: the folder has the rest.
    reconstruction::given_pose([0.0; 3], 1.0, args.height_sigma_m, args.attitude_sigma_deg).map_err(bad_input)?;
    let config: Config = options.settings()?.section()?;
    let seconds = |option: &str, value: f64| {
        let is_good = (1.0..=86_400.0).contains(&value);
        is_good.then_some(value).ok_or_else(|| ConfigError::new(format!("{option} must be 1 to 86400 s, not {value}")))
    };
    let segment_s = seconds("--segment", args.segment)?;
    let folder = SurveyFolder::open_tolerant(&args.folder).map_err(bad_input)?;
    let frames = frames(&folder, args.height_sigma_m, args.attitude_sigma_deg);
    let window_s = match (args.window, frames.first(), frames.last()) {
        (Some(window_s), ..) => seconds("--window", window_s)?,
        (None, Some(first), Some(last)) => last.stamp.seconds_since(first.stamp).clamp(1.0, 86_400.0) + 1.0,
        (None, ..) => 1.0,
    };
    let report = args.report.as_ref().map(|path| Output::file("--report", path, &["html", "htm"]));
    let maps = [("--grid", &args.grid), ("--wass", &args.wass)];
    let maps = maps.into_iter().filter_map(|(option, path)| Some(Output::plain_file(option, path.as_ref()?, &["nc", "nc4"])));
    let pictures = frames.iter().flat_map(|frame| [frame.left.as_path(), frame.right.as_path()]);
    let outputs: Vec<Output> = report.into_iter().chain(maps).collect();
    let inputs = pictures.map(|path| ("DIR", path)).chain(args.witness.file().map(|path| ("--witness", path)));
    check_outputs(inputs, &outputs).map_err(bad_input)?;
    let how = ReconstructOptions { grid: args.grid.clone(), wass: args.wass.clone(), ..args.how.options() };
    let is_fixed = frames.iter().all(|frame| frame.pose.is_none());
    let rig = halcyon_model::RigId::new("rig")?;
    let mut sea = Survey::new(&config, &rig, window_s, is_fixed).map_err(bad_input)?;
    let bar = output::bar("pairs");
    let survey = reconstruction::reconstruct_survey(folder.rig(), &frames, &how, &mut |step| {
        show(&bar, step);
        if let Some(Ok(patch)) = step.outcome {
            sea.observe(patch);
        }
    });
    bar.finish_and_clear();
    let survey = survey.map_err(bad_input)?;
    let sea_state = sea.report(segment_s, args.witness.witness().as_ref()).map_err(bad_input)?;
    output::warnings(&survey.warnings);
    let judged = Judged { survey, verdict: sea_state.verdict.clone(), sea_state };
    if let Some(path) = &args.report {
        let page = page(&judged, args)?;
        write_bytes(path, page.html().as_bytes()).map_err(bad_input)?;
    }
    if args.json {
        output::json(&judged)?;
        return Ok(ExitCode::SUCCESS);
    }
    print(&judged)?;
    for path in [&args.grid, &args.wass, &args.report].into_iter().flatten() {
        output::line(&format!("written    {}", path.display()))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn heights(sea: &SeaReport) -> Vec<[String; 2]> {
    let h = &sea.heights;
    let all = [
        ("H_m", h.h_mean_m, h.h_mean_m_low, h.h_mean_m_high, "m"),
        ("H_s", h.h_s_m, h.h_s_m_low, h.h_s_m_high, "m"),
        ("highest wave", h.h_max_m, h.h_max_m_low, h.h_max_m_high, "m"),
        ("H_rms", h.h_rms_m, h.h_rms_m_low, h.h_rms_m_high, "m"),
        ("H_1/10", h.h_tenth_m, h.h_tenth_m_low, h.h_tenth_m_high, "m"),
        ("H_m0", h.h_m0_m, h.h_m0_m_low, h.h_m0_m_high, "m"),
        ("T_z", h.t_z_s, h.t_z_s_low, h.t_z_s_high, "s"),
        ("T_p", h.t_p_s, h.t_p_s_low, h.t_p_s_high, "s"),
        ("T_m01", h.t_m01_s, h.t_m01_s_low, h.t_m01_s_high, "s"),
        ("T_m02", h.t_m02_s, h.t_m02_s_low, h.t_m02_s_high, "s"),
        ("T_e", h.t_e_s, h.t_e_s_low, h.t_e_s_high, "s"),
        ("RMS slope", h.slope_rms_rad, h.slope_rms_rad_low, h.slope_rms_rad_high, "rad"),
        ("RMS rise", h.vertical_speed_rms_mps, h.vertical_speed_rms_mps_low, h.vertical_speed_rms_mps_high, "m/s"),
    ];
    let text = |(name, value, low, high, unit): (&str, Option<f64>, Option<f64>, Option<f64>, &str)| {
        let text = match (value, low, high) {
            (Some(value), Some(low), Some(high)) => {
                format!("{} {unit} (95 %: {} to {} {unit})", four(value), four(low), four(high))
            }
            _ => "not known".to_owned(),
        };
        [name.to_owned(), text]
    };
    let direction = sea.direction.map_or_else(
        || "not known".to_owned(),
        |found| {
            format!(
                "{:.0}° ± {:.0}°, spread {:.0}°, wavelength at the peak {} m",
                found.from_deg,
                found.from_error_deg,
                found.spread_deg,
                four(found.wavelength_peak_m)
            )
        },
    );
    all.into_iter().map(text).chain([["waves come from".to_owned(), direction]]).collect()
}

fn print(judged: &Judged) -> anyhow::Result<()> {
    let Judged { survey, sea_state, verdict } = judged;
    output::line(&format!("verdict    {}", verdict.state))?;
    for reason in &verdict.reasons {
        output::line(&format!("           {} {}", if reason.passed { "+" } else { "-" }, reason.text))?;
    }
    output::line(&format!(
        "patches    {} of {} pairs used, {:.1} s, {:.1} % measured, {} waves at all gauges",
        sea_state.patches,
        survey.pairs,
        sea_state.window_s,
        sea_state.coverage * 100.0,
        sea_state.waves
    ))?;
    for [name, text] in heights(sea_state) {
        output::line(&format!("{name:<32} {text}"))?;
    }
    for (name, text) in sea_state.witness.iter().flat_map(witness_rows) {
        output::line(&format!("{name:<32} {text}"))?;
    }
    if let Some(centre) = &sea_state.centre {
        output::line("at the middle of the patches:")?;
        for (name, text) in rows(centre) {
            output::line(&format!("{name:<32} {text}"))?;
        }
    }
    Ok(())
}

fn page(judged: &Judged, args: &Args) -> Result<Page, ChartError> {
    let Judged { survey, sea_state, verdict } = judged;
    let name = args.folder.file_name().map_or_else(|| args.folder.display().to_string(), |name| name.display().to_string());
    let mut page = Page::new(format!("Survey {name}: {}", verdict.state));
    page.paragraph(&format!(
        "{} of {} pairs used, over {:.1} s; {:.1} % of the patches measured.",
        sea_state.patches,
        survey.pairs,
        sea_state.window_s,
        sea_state.coverage * 100.0
    ));
    page.heading("Verdict");
    let reasons: Vec<[String; 3]> = verdict
        .reasons
        .iter()
        .map(|reason| [reason.check.clone(), if reason.passed { "passed" } else { "failed" }.to_owned(), reason.text.clone()])
        .collect();
    page.table(&["check", "", "what was found"], &reasons);
    page.heading("Sea state").table(&["quantity", "value"], &heights(sea_state));
    if let Some(witness) = &sea_state.witness {
        let rows: Vec<[String; 2]> = witness_rows(witness).into_iter().map(|(name, value)| [name, value]).collect();
        page.table(&["second witness", "value"], &rows);
    }
    if let Some(centre) = &sea_state.centre {
        page.heading("At the middle of the patches");
        draw(&mut page, centre)?;
    }
    Ok(page)
}
