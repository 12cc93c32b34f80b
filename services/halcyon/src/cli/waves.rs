//! `halcyon waves`

use std::path::PathBuf;
use std::process::ExitCode;

use halcyon_chassis::{ConfigError, Options};
use halcyon_ocean::Taper;
use halcyon_ocean::crests::ExceedancePoint;
use halcyon_reconstruction::files::{Output, check_outputs, has_ending, write_bytes};
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::cli::{self, Burst, VerdictReport, WavesOptions, WavesReport, ZeroCrossing};
use halcyon_wave_assessment::table::{Choice, LengthUnit, TimeUnit};

use serde::Serialize;

use super::output::significant;
use super::{bad_input, output};
use crate::report::{Chart, ChartError, Page, Series};

/// Say everything about the waves in a file of elevations: heights, periods, spectrum, quality
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: halcyon waves probe.csv
Example: halcyon waves waterlevel.csv --rate-hz 2 --burst 1024 --json
Example: halcyon waves log.txt --time-column t_ms --value-column 'eta [mm]' --plot waves.html

Commas, semicolons, tabs, bars or blanks separate columns; decimal commas, dates, headers and comments (#, %) are understood. Missing
readings (empty, NaN, NA) are filled in where gaps are short, and said. Without options the column of stamps is the one called so, or the
first if it rises; elevations are in the column called so, or the one that is left.")]
pub(super) struct Args {
    /// The file
    #[arg(value_name = "FILE", required_unless_present = "input", conflicts_with = "input")]
    file: Option<PathBuf>,
    /// The file, as an option
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    /// Name or number (from 1) of the column of stamps
    #[arg(long, value_name = "COLUMN")]
    time_column: Option<String>,
    /// Name or number (from 1) of the column of elevations
    #[arg(long, value_name = "COLUMN")]
    value_column: Option<String>,
    /// Readings a second, where there are no stamps
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate_hz: Option<f64>,
    /// Unit of the elevations: m, cm, mm or ft; otherwise the column's name tells it (eta_mm, level [cm]), and m is assumed
    #[arg(long, value_name = "UNIT", value_parser = length_unit)]
    unit: Option<LengthUnit>,
    /// Unit of numeric stamps: s, ms, us, ns, min, h or d; otherwise the column's name tells it, and s is assumed
    #[arg(long, value_name = "UNIT", value_parser = time_unit)]
    time_unit: Option<TimeUnit>,
    /// Cut the record into bursts of so many seconds, each analysed by itself
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    burst: Option<f64>,
    /// Slower movements are tide, not waves, hertz
    #[arg(long, value_name = "HZ", default_value_t = 0.05, allow_negative_numbers = true)]
    band_low: f64,
    /// Faster ones are noise, hertz; up to half of the rate anyway
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, allow_negative_numbers = true)]
    band_high: f64,
    /// Length of the spectrum's segments, seconds
    #[arg(long, value_name = "S", default_value_t = 128.0, allow_negative_numbers = true)]
    segment: f64,
    /// Their window
    #[arg(long, value_enum, default_value_t = Window::Hann)]
    window: Window,
    #[command(flatten)]
    witness: WitnessArgs,
    /// Draw it: .svg (the spectrum) or .html (everything)
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// Another sensor's record of the same waves: a probe, an ultrasonic sensor, a rangefinder.
#[derive(Debug, clap::Args)]
pub(super) struct WitnessArgs {
    /// Another sensor's record of the same waves, compared in time and frequency: without its agreement the verdict is inconclusive
    #[arg(long, value_name = "FILE")]
    witness: Option<PathBuf>,
    /// Its column of stamps
    #[arg(long, value_name = "COLUMN", requires = "witness")]
    witness_time_column: Option<String>,
    /// Its column of elevations
    #[arg(long, value_name = "COLUMN", requires = "witness")]
    witness_value_column: Option<String>,
    /// Its readings a second, where it has no stamps
    #[arg(long, value_name = "HZ", requires = "witness", allow_negative_numbers = true)]
    witness_rate_hz: Option<f64>,
    /// Its clock may be off by so much, seconds
    #[arg(long, value_name = "S", default_value_t = 2.0, requires = "witness", allow_negative_numbers = true)]
    witness_lag: f64,
    /// Noise of its readings, metres, one standard deviation: a resolution of 1 cm is 0.003
    #[arg(long, value_name = "M", default_value_t = 0.0, requires = "witness", allow_negative_numbers = true)]
    witness_noise: f64,
}

impl WitnessArgs {
    pub(super) fn file(&self) -> Option<&std::path::Path> {
        self.witness.as_deref()
    }

    pub(super) fn witness(&self) -> Option<cli::Witness> {
        Some(cli::Witness {
            input: self.witness.clone()?,
            choice: Choice {
                time_column: self.witness_time_column.clone(),
                value_column: self.witness_value_column.clone(),
                rate_hz: self.witness_rate_hz,
                time_unit: None,
                unit: None,
            },
            max_lag_s: self.witness_lag,
            noise_m: self.witness_noise,
        })
    }
}

/// A witness's comparison with its names and units.
pub(super) fn witness_rows(report: &cli::WitnessReport) -> Vec<(String, String)> {
    let mut rows = vec![("second witness".to_owned(), report.verdict.to_owned())];
    rows.extend(report.why.iter().map(|why| ("  because".to_owned(), why.clone())));
    let Some(c) = &report.comparison else { return rows };
    let mut add = |name: &str, text: String| rows.push((format!("  {name}"), text));
    add(
        "time in common, lag",
        format!("{:.1} s, {}", c.common_s, c.lag_s.map_or("unknown".into(), |lag| format!("{lag:.3} s"))),
    );
    add("H_m0 of both", format!("{} and {} m", four(c.h_m0_a_m), four(c.h_m0_b_m)));
    if let (Some(value), low, high) = (c.height_ratio, c.height_ratio_low, c.height_ratio_high) {
        let bounds = low.zip(high).map(|(low, high)| format!(" (95 %: {} to {})", four(low), four(high)));
        add("ratio of heights", format!("{}{}", four(value), bounds.unwrap_or_default()));
    }
    add("regression: slope, reduced axis, R²", format!("{}, {}, {}", four(c.slope), four(c.slope_reduced), four(c.r_squared)));
    add("bias, RMS difference", format!("{} m, {} m", four(c.bias_m), four(c.rmse_m)));
    if let Some(coherence) = c.coherence {
        add("coherence at the peak", four(coherence));
    }
    rows
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Window {
    Hann,
    Hamming,
    /// None at all: with one segment the plain periodogram
    Rectangle,
}

impl Window {
    fn taper(self) -> Taper {
        match self {
            Self::Hann => Taper::Hann,
            Self::Hamming => Taper::Hamming,
            Self::Rectangle => Taper::Rectangle,
        }
    }
}

fn length_unit(text: &str) -> Result<LengthUnit, String> {
    LengthUnit::named(text).ok_or_else(|| format!("use one of {}", LengthUnit::NAMES.join(", ")))
}

fn time_unit(text: &str) -> Result<TimeUnit, String> {
    TimeUnit::named(text).ok_or_else(|| format!("use one of {}", TimeUnit::NAMES.join(", ")))
}

pub(super) fn run(options: &Options, args: &Args) -> anyhow::Result<ExitCode> {
    let Some(input) = args.file.as_ref().or(args.input.as_ref()) else {
        return Err(ConfigError::new("name the file of readings").into());
    };
    if let Some(plot) = &args.plot {
        let inputs = [("FILE", input.as_path())].into_iter().chain(args.witness.file().map(|path| ("--witness", path)));
        check_outputs(inputs, &[Output::file("--plot", plot, &["svg", "html", "htm"])]).map_err(bad_input)?;
    }
    let config: Config = options.settings()?.section()?;
    let options = WavesOptions {
        input: input.clone(),
        choice: Choice {
            time_column: args.time_column.clone(),
            value_column: args.value_column.clone(),
            rate_hz: args.rate_hz,
            time_unit: args.time_unit,
            unit: args.unit,
        },
        burst_s: args.burst,
        band_hz: (args.band_low, args.band_high),
        segment_s: args.segment,
        taper: args.window.taper(),
        witness: args.witness.witness(),
        window_s: config.window_s,
        waves_min: config.waves_min,
    };
    let report = cli::waves(&options).map_err(bad_input)?;
    if let Some(path) = &args.plot {
        let drawn = if has_ending(path, &["svg"]) { spectrum(&report.first)?.svg()? } else { page(&report, &options)?.html() };
        write_bytes(path, drawn.as_bytes()).map_err(bad_input)?;
    }
    let mut verdict = cli::newest(&report, &config);
    if let Some(witness) = &report.witness {
        witness.weigh(&mut verdict);
    }
    let states: Vec<BurstVerdict> = report.bursts.iter().map(|burst| BurstVerdict::of(burst, &config)).collect();
    if args.json {
        output::json(&Judged { report: &report, burst_verdicts: &states, verdict: &verdict })?;
        return Ok(ExitCode::SUCCESS);
    }
    print(&report, &states, &verdict)?;
    Ok(ExitCode::SUCCESS)
}

/// Four digits: no wave is known better.
pub(super) fn four(value: f64) -> String {
    significant(value, 4)
}

/// As `--json` prints it.
#[derive(Debug, Serialize)]
struct Judged<'a> {
    #[serde(flatten)]
    report: &'a WavesReport,
    /// Of each burst by itself.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    burst_verdicts: &'a [BurstVerdict],
    /// On the newest waves: the last part of the record, or of its last burst.
    verdict: &'a VerdictReport,
}

/// What is said of one burst.
#[derive(Debug, Serialize)]
struct BurstVerdict {
    burst: usize,
    state: &'static str,
}

impl BurstVerdict {
    fn of(burst: &Burst, config: &Config) -> Self {
        Self { burst: burst.number.unwrap_or(0), state: cli::verdict(burst, config).state }
    }
}

fn print(report: &WavesReport, states: &[BurstVerdict], verdict: &VerdictReport) -> anyhow::Result<()> {
    let stamps = report.time_column.as_ref().map_or_else(|| "stated rate".to_owned(), |name| format!("{name:?}"));
    output::line(&format!("elevation {:?} ({}), stamps: {stamps}", report.value_column, report.unit))?;
    for (name, row) in report.witness.iter().flat_map(witness_rows) {
        output::line(&format!("{name:<36} {row}"))?;
    }
    if report.bursts.is_empty() {
        print_burst(&report.first)?;
        return print_verdict(verdict);
    }
    output::line("burst  H_m0 m   T_p s    f_p Hz   H_s m    H_m m    T_z s    T_1/3 s  waves  verdict       quality")?;
    for (burst, state) in report.bursts.iter().zip(states) {
        let cell = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), four);
        let up = |pick: fn(&ZeroCrossing) -> f64| cell(burst.zero_up.as_ref().map(pick));
        let spectrum = burst.spectrum.as_ref();
        output::line(&format!(
            "{:<6} {:<8} {:<8} {:<8} {:<8} {:<8} {:<8} {:<8} {:<6} {:<13} {}",
            state.burst,
            cell(spectrum.map(|s| s.h_m0_m)),
            cell(spectrum.map(|s| s.t_p_s)),
            cell(spectrum.map(|s| s.f_p_hz)),
            up(|z| z.h_s_m),
            up(|z| z.h_mean_m),
            up(|z| z.t_z_s),
            up(|z| z.t_third_s),
            burst.zero_up.map_or(0, |z| z.waves),
            state.state,
            complaints(burst).join(", ")
        ))?;
    }
    for one in &report.unusable {
        output::line(&format!("burst {} is unusable: {}", one.burst, one.reason))?;
    }
    print_verdict(verdict)
}

fn print_verdict(verdict: &VerdictReport) -> anyhow::Result<()> {
    output::line(&format!("verdict on the last {:.1} s: {}", verdict.judged_s, verdict.state))?;
    for reason in &verdict.reasons {
        output::line(&format!("  {} {}", if reason.passed { "+" } else { "-" }, reason.text))?;
    }
    Ok(())
}

fn complaints(burst: &Burst) -> Vec<String> {
    let bad = burst.quality.iter().filter(|flag| flag.flag >= 3);
    bad.map(|flag| format!("{} {}", flag.test, if flag.flag == 3 { "suspect" } else { "failed" })).collect()
}

fn print_burst(burst: &Burst) -> anyhow::Result<()> {
    output::line(&format!(
        "{} samples at {} Hz ({:.1} s), {} of them filled in; mean {} m, standard deviation {} m",
        burst.samples,
        four(burst.rate_hz),
        burst.duration_s,
        burst.filled,
        four(burst.mean_m),
        four(burst.deviation_m)
    ))?;
    if let Some(left_out_s) = burst.left_out_s {
        let stretch = format!("{:.1} to {:.1} s", burst.start_s, burst.start_s + burst.duration_s);
        output::line(&format!("only the longest stretch without a long gap, {stretch}: {left_out_s:.1} s are left out"))?;
    }
    if let Some(slow_m) = burst.slow_deviation_m {
        output::line(&format!("slower than the waves, and taken off: {} m (tide, seiche or drift)", four(slow_m)))?;
    }
    for (name, row) in rows(burst) {
        output::line(&format!("{name:<36} {row}"))?;
    }
    for flag in burst.quality.iter().filter(|flag| flag.flag >= 3) {
        output::line(&format!("{} {}: {}", flag.test, if flag.flag == 3 { "suspect" } else { "failed" }, flag.reason))?;
    }
    Ok(())
}

/// A number with its interval, where it has one.
fn with_bounds(value: f64, low: Option<f64>, high: Option<f64>, unit: &str) -> String {
    match (low, high) {
        (Some(low), Some(high)) => format!("{} {unit} (95 %: {} to {} {unit})", four(value), four(low), four(high)),
        _ => format!("{} {unit}", four(value)),
    }
}

/// Every number with its name and unit.
pub(super) fn rows(burst: &Burst) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    let mut add = |name: &str, text: String| rows.push((name.to_owned(), text));
    for (kind, of) in [("up", &burst.zero_up), ("down", &burst.zero_down)] {
        let Some(z) = of else {
            add(&format!("waves (zero-{kind})"), "none".into());
            continue;
        };
        add(&format!("waves (zero-{kind})"), z.waves.to_string());
        add("  H_m", with_bounds(z.h_mean_m, z.h_mean_m_low, z.h_mean_m_high, "m"));
        add("  H_rms", with_bounds(z.h_rms_m, z.h_rms_m_low, z.h_rms_m_high, "m"));
        add("  H_s (H_1/3)", with_bounds(z.h_s_m, z.h_s_m_low, z.h_s_m_high, "m"));
        add("  H_1/10", with_bounds(z.h_tenth_m, z.h_tenth_m_low, z.h_tenth_m_high, "m"));
        add("  H_max", format!("{} m", four(z.h_max_m)));
        add("  T_z", with_bounds(z.t_z_s, z.t_z_s_low, z.t_z_s_high, "s"));
        add("  T_1/3", with_bounds(z.t_third_s, z.t_third_s_low, z.t_third_s_high, "s"));
        add("  highest crest, lowest trough", format!("{}, {} m", four(z.crest_max_m), four(z.trough_min_m)));
    }
    match &burst.spectrum {
        None => add("spectrum", "no energy".into()),
        Some(s) => {
            add("spectrum", format!("{} to {} Hz", four(s.band.low_hz), four(s.band.high_hz)));
            add("  H_m0", with_bounds(s.h_m0_m, s.h_m0_m_low, s.h_m0_m_high, "m"));
            add("  T_p", with_bounds(s.t_p_s, s.t_p_s_low, s.t_p_s_high, "s"));
            add("  f_p", format!("{} Hz", four(s.f_p_hz)));
            add("  T_m01", with_bounds(s.t_m01_s, s.t_m01_s_low, s.t_m01_s_high, "s"));
            add("  T_m02", with_bounds(s.t_m02_s, s.t_m02_s_low, s.t_m02_s_high, "s"));
            add("  T_e", with_bounds(s.t_e_s, s.t_e_s_low, s.t_e_s_high, "s"));
            add(
                "  widths ε, ν; peakedness Q_p",
                format!("{}, {}; {}", four(s.width_epsilon), four(s.width_nu), four(s.peakedness_q_p)),
            );
            add("  m0", format!("{:.4e} m²", s.m0));
        }
    }
    if let Some(shape) = &burst.shape {
        shape_rows(shape, &mut add);
    }
    if burst.skewness.is_finite() {
        add("skewness, kurtosis", format!("{}, {}", four(burst.skewness), four(burst.kurtosis)));
    }
    for of in &burst.crest_statistics {
        add(
            &format!("highest of {}, {}", of.of, of.theory),
            format!(
                "{} m (95 %: {} to {} m), seen {} m; Kolmogorov-Smirnov p {:.2}",
                four(of.highest_m),
                four(of.highest_m_low),
                four(of.highest_m_high),
                four(of.observed_m),
                of.ks_probability
            ),
        );
    }
    rows
}

/// What the spectrum says beyond its moments.
fn shape_rows(shape: &cli::Shape, add: &mut impl FnMut(&str, String)) {
    add(
        "  T_p by parabola, Young, T_pc, Delft",
        format!(
            "{}, {}, {}, {} s",
            four(shape.t_p_parabola_s),
            four(shape.t_p_young_s),
            four(shape.t_pc_s),
            four(shape.t_pd_s)
        ),
    );
    match (shape.noise_m2_per_hz, shape.noise_error_m2_per_hz, shape.h_m0_less_noise_m) {
        (Some(noise), Some(error), Some(h_m0_m)) => {
            add("  noise floor", format!("{noise:.2e} ± {error:.2e} m²/Hz; H_m0 without it {} m", four(h_m0_m)));
        }
        _ => add("  noise floor", "none that stands out".into()),
    }
    for system in &shape.systems {
        let (h, t_p, t_m02, ratio) =
            (four(system.h_m0_m), four(system.t_p_s), four(system.t_m02_s), significant(system.grown_ratio, 2));
        add(
            &format!("  {}", system.kind),
            format!("H_m0 {h} m, T_p {t_p} s, T_m02 {t_m02} s; peak {ratio} of a fully grown sea's"),
        );
    }
    let fits = [("JONSWAP fitted", &shape.jonswap), ("Pierson-Moskowitz fitted", &shape.pierson_moskowitz)];
    for (name, fit) in fits.into_iter().filter_map(|(name, fit)| Some((name, fit.as_ref()?))) {
        let gamma = match (fit.gamma, fit.gamma_low, fit.gamma_high) {
            (Some(gamma), Some(low), Some(high)) => format!(", γ {} ({} to {})", four(gamma), four(low), four(high)),
            _ => String::new(),
        };
        let shape = if fit.misfit_sigmas > 3.0 { "; the sea has another shape" } else { "" };
        add(
            &format!("  {name}"),
            format!(
                "H_m0 {} m ({} to {}), T_p {} s ({} to {}){gamma}{shape}",
                four(fit.h_m0_m),
                four(fit.h_m0_m_low),
                four(fit.h_m0_m_high),
                four(fit.t_p_s),
                four(fit.t_p_s_low),
                four(fit.t_p_s_high)
            ),
        );
    }
}

/// How often heights are exceeded, seen and by theory.
fn exceedance(burst: &Burst, of: &str) -> Chart {
    let mut chart = Chart::new(format!("{of}, m"), "exceeded by, share").log_y();
    for (number, report) in burst.crest_statistics.iter().filter(|report| report.of == of).enumerate() {
        let points =
            |pick: fn(&ExceedancePoint) -> f64| report.points.iter().map(|point| (point.value_m, pick(point))).collect();
        // Observations are the same for all but those that begin at a threshold.
        if number == 0 {
            chart = chart.with(Series::points("seen", points(|point| point.observed)));
        }
        let is_whole = report.theory != "Boccotti";
        if is_whole {
            chart = chart.with(Series::line(report.theory, points(|point| point.theory)));
        }
    }
    chart
}

pub(super) fn spectrum(burst: &Burst) -> Result<Chart, ChartError> {
    let Some(density) = &burst.density else { return Err(ChartError::Empty) };
    let band = burst.spectrum.map_or((0.0, f64::INFINITY), |s| (s.band.low_hz, s.band.high_hz));
    let points = density.density_m2_per_hz().iter().enumerate().map(|(i, d)| (i as f64 * density.df_hz(), *d));
    let points = points.filter(|(f, _)| *f > 0.0 && (band.0..=band.1).contains(f)).collect();
    Ok(Chart::new("frequency, Hz", "variance density, m²/Hz").with(Series::line("", points)).from_zero())
}

fn page(report: &WavesReport, options: &WavesOptions) -> Result<Page, ChartError> {
    let name = options.input.file_name().unwrap_or(options.input.as_os_str());
    let mut page = Page::new(format!("Waves of {}", name.display()));
    if let Some(witness) = &report.witness {
        let rows: Vec<[String; 2]> = witness_rows(witness).into_iter().map(|(name, value)| [name, value]).collect();
        page.table(&["second witness", "value"], &rows);
    }
    let bursts = if report.bursts.is_empty() { std::slice::from_ref(&report.first) } else { &report.bursts[..] };
    for (i, burst) in bursts.iter().enumerate() {
        if bursts.len() > 1 {
            page.heading(&format!("Burst {}", i + 1));
        }
        draw(&mut page, burst)?;
    }
    Ok(page)
}

/// Everything about one record.
pub(super) fn draw(page: &mut Page, burst: &Burst) -> Result<(), ChartError> {
    page.paragraph(&format!(
        "{} samples at {} Hz, {:.1} s, {} of them filled in.",
        burst.samples,
        four(burst.rate_hz),
        burst.duration_s,
        burst.filled
    ));
    let step_s = 1.0 / burst.rate_hz;
    let series = burst.elevation_m.iter().enumerate().map(|(i, z)| (i as f64 * step_s, *z)).collect();
    let elevation = Chart::new("time, s", "elevation, m").with(Series::line("", series));
    page.figure(&elevation.svg()?, "Elevation about its trend");
    if let Ok(svg) = spectrum(burst).and_then(|chart| chart.svg()) {
        page.figure(&svg, "Variance density spectrum");
    }
    for (of, caption) in
        [("crests", "Crests above the mean, seen and by theory"), ("heights", "Wave heights, seen and by theory")]
    {
        if let Ok(svg) = exceedance(burst, of).svg() {
            page.figure(&svg, caption);
        }
    }
    let numbers: Vec<[String; 2]> = rows(burst).into_iter().map(|(name, value)| [name, value]).collect();
    page.table(&["quantity", "value"], &numbers);
    let flags: Vec<[String; 4]> = burst
        .quality
        .iter()
        .map(|f| {
            let number = f.qartod.map_or_else(String::new, |number| number.to_string());
            [f.test.to_owned(), number, f.flag.to_string(), f.reason.clone()]
        })
        .collect();
    page.table(&["quality test", "QARTOD", "flag", "reason"], &flags);
    Ok(())
}
