//! What `halcyon waves` does: a file of readings in, every statistic of its waves out. No arguments are parsed and nothing is printed here.

mod crests;
mod lists;
mod report;
mod shape;
mod survey;
mod verdict;
mod witness;

use std::path::{Path, PathBuf};

use halcyon_ocean::Taper;
use halcyon_ocean::quality::{Finding, Flag, Limits, Ordered, RawSeries, assess};

pub use crests::CrestReport;
pub use report::{Band, Burst, FlagReport, Spectrum, Unusable, WavesReport, ZeroCrossing};
pub use shape::{Fit, Shape, System};
pub use survey::{ComplaintReport, DirectionReport, Heights, SeaReport, Survey, SurveyError};
pub use verdict::{ReasonReport, VerdictReport, newest, verdict};
pub use witness::{ComparisonReport, Witness, WitnessReport};

use crate::core::quality_limits;
use crate::table::{Choice, ChoiceError, Readings, Table, TableError};

/// Files larger than this are refused: 30 hours at 1 kHz are smaller.
const FILE_BYTES_MAX: u64 = 1 << 32;

/// What to read, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct WavesOptions {
    /// The file.
    pub input: PathBuf,
    /// Its columns.
    pub choice: Choice,
    /// Length of a burst, seconds: each is analysed by itself. `None` analyses the whole record.
    pub burst_s: Option<f64>,
    /// The waves' frequencies, hertz: what is slower is tide, what is faster is noise.
    pub band_hz: (f64, f64),
    /// Length of the spectrum's segments, seconds.
    pub segment_s: f64,
    /// What they are multiplied by.
    pub taper: Taper,
    /// Another sensor's record of the same waves.
    pub witness: Option<Witness>,
    /// A verdict is about so much of the end of a record, seconds, or as much as has the waves that it needs.
    pub window_s: f64,
    /// So many.
    pub waves_min: u32,
}

/// Why a file has no waves to speak of.
#[derive(Debug, thiserror::Error)]
pub enum WavesError {
    /// The file cannot be read.
    #[error("{} cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// A folder, a device, a pipe or a giant.
    #[error("{} is no file of readings: {what}", path.display())]
    NoFile {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        what: &'static str,
    },
    /// No table.
    #[error("{}", path.display())]
    Table {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: TableError,
    },
    /// A table without the columns.
    #[error("{}", path.display())]
    Choice {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: ChoiceError,
    },
    /// An option that is out of range.
    #[error("{option} must be {must}, not {value}")]
    Option {
        /// The option.
        option: &'static str,
        /// Its range, with the unit.
        must: String,
        /// As given.
        value: f64,
    },
    /// Readings that make no record.
    #[error("{}: {reason}", path.display())]
    NoRecord {
        /// The file.
        path: PathBuf,
        /// In words.
        reason: String,
    },
}

/// Analyses a file.
///
/// # Errors
/// [`WavesError`], one clear line with its causes.
pub fn waves(options: &WavesOptions) -> Result<WavesReport, WavesError> {
    check(options)?;
    let readings = readings(&options.input, &options.choice)?;
    let raw = RawSeries { stamp_s: &readings.stamp_s, elevation_m: &readings.elevation_m };
    let (found, latest) = match options.burst_s {
        None => {
            let first = burst(raw, options)?;
            let latest = latest(raw, &first, options);
            ((first, Vec::new(), Vec::new()), latest)
        }
        Some(burst_s) => bursts(raw, burst_s, options)?,
    };
    let witness = options.witness.as_ref().map(|witness| WitnessReport::of(raw, witness, options.band_hz)).transpose()?;
    Ok(WavesReport::new(&readings, found, latest, witness))
}

/// The last part of a record that was found to be `whole`, where that is much longer than what a verdict is about.
fn latest(raw: RawSeries<'_>, whole: &Burst, options: &WavesOptions) -> Result<Option<Burst>, String> {
    /// Waves more than are needed: a few are lost at the ends.
    const WAVES: f64 = 1.3;
    /// A record that is longer by less is judged as a whole.
    const LONGER: f64 = 1.25;
    let Some(waves) = &whole.zero_up else { return Ok(None) };
    let length_s = options.window_s.max(WAVES * f64::from(options.waves_min) * waves.t_z_s);
    if whole.duration_s <= LONGER * length_s {
        return Ok(None);
    }
    let last_s = raw.stamp_s.iter().copied().filter(|stamp| stamp.is_finite()).fold(f64::NEG_INFINITY, f64::max);
    let both = raw.stamp_s.iter().zip(raw.elevation_m).filter(|(stamp_s, _)| **stamp_s > last_s - length_s);
    let (stamp_s, elevation_m): (Vec<f64>, Vec<f64>) = both.unzip();
    let raw = RawSeries { stamp_s: &stamp_s, elevation_m: &elevation_m };
    analyse(raw, options.segment_s.min(0.5 * length_s), options.taper, options.band_hz).map(Some)
}

/// The first usable burst, all usable ones, those that are not, and the last part of the last one.
type Bursts = ((Burst, Vec<Burst>, Vec<Unusable>), Result<Option<Burst>, String>);

/// The readings of a file.
fn readings(path: &Path, choice: &Choice) -> Result<Readings, WavesError> {
    let bytes = read(path)?;
    let table = Table::read(&bytes).map_err(|source| WavesError::Table { path: path.into(), source })?;
    drop(bytes);
    table.readings(choice).map_err(|source| WavesError::Choice { path: path.into(), source })
}

fn check(options: &WavesOptions) -> Result<(), WavesError> {
    let within = |option, value: f64, is_good: bool, must: &str| {
        if is_good { Ok(()) } else { Err(WavesError::Option { option, must: must.into(), value }) }
    };
    let (low_hz, high_hz) = options.band_hz;
    within("--band-low", low_hz, low_hz >= 0.0 && low_hz.is_finite(), "at least 0 Hz")?;
    within("--band-high", high_hz, high_hz > low_hz, "above --band-low, Hz")?;
    within("--segment", options.segment_s, options.segment_s > 0.0 && options.segment_s.is_finite(), "above 0 s")?;
    if let Some(burst_s) = options.burst_s {
        within("--burst", burst_s, burst_s > 0.0 && burst_s.is_finite(), "above 0 s")?;
    }
    Ok(())
}

fn read(path: &Path) -> Result<Vec<u8>, WavesError> {
    let error = |source| WavesError::Read { path: path.into(), source };
    let about = std::fs::metadata(path).map_err(error)?;
    let no_file = |what| Err(WavesError::NoFile { path: path.into(), what });
    match () {
        () if about.is_dir() => no_file("it is a folder"),
        () if !about.is_file() => no_file("it is a device or a pipe"),
        () if about.len() > FILE_BYTES_MAX => no_file("it has more than 4 GiB"),
        () => std::fs::read(path).map_err(error),
    }
}

/// Cuts a series by its stamps, from the first one on. What is left over at the end makes no burst. One that is unusable spoils no other.
fn bursts(raw: RawSeries<'_>, burst_s: f64, options: &WavesOptions) -> Result<Bursts, WavesError> {
    /// A day of bursts of ten seconds.
    const BURSTS_MAX: usize = 8640;
    let finite = || raw.stamp_s.iter().copied().filter(|stamp| stamp.is_finite());
    let (first_s, last_s) = (finite().fold(f64::INFINITY, f64::min), finite().fold(f64::NEG_INFINITY, f64::max));
    // The last reading of a record stands for an interval, too.
    let interval_s = (last_s - first_s) / (raw.stamp_s.len().max(2) - 1) as f64;
    let count = ((last_s - first_s + 1.5 * interval_s) / burst_s).floor();
    if !(1.0..=BURSTS_MAX as f64).contains(&count) {
        let reason = format!(
            "a record of {:.1} s holds {count} bursts of {burst_s} s: 1 to {BURSTS_MAX} are possible",
            last_s - first_s
        );
        return Err(WavesError::NoRecord { path: options.input.clone(), reason });
    }
    let mut cut: Vec<(Vec<f64>, Vec<f64>)> = vec![Default::default(); count as usize];
    for (stamp_s, elevation_m) in raw.stamp_s.iter().zip(raw.elevation_m) {
        // Half an interval: a stamp that belongs to a burst may be written a little before it.
        let place = (stamp_s - first_s + 0.5 * interval_s) / burst_s;
        if let Some((stamps, elevations)) = (place >= 0.0).then(|| cut.get_mut(place as usize)).flatten() {
            stamps.push(*stamp_s);
            elevations.push(*elevation_m);
        }
    }
    let (mut usable, mut unusable) = (Vec::new(), Vec::new());
    for (i, (stamp_s, elevation_m)) in cut.iter().enumerate() {
        let raw = RawSeries { stamp_s, elevation_m };
        match analyse(raw, options.segment_s, options.taper, options.band_hz) {
            Ok(burst) => usable.push(Burst { number: Some(i + 1), ..burst }),
            Err(reason) => unusable.push(Unusable { burst: i + 1, reason }),
        }
    }
    let (Some(first), Some(last)) = (usable.first().cloned(), usable.last()) else {
        let why = unusable.first().map_or("", |one| one.reason.as_str());
        let reason = format!("no burst of {burst_s} s is usable; the first: {why}");
        return Err(WavesError::NoRecord { path: options.input.clone(), reason });
    };
    let latest = last
        .number
        .and_then(|number| cut.get(number - 1))
        .map_or(Ok(None), |(stamp_s, elevation_m)| latest(RawSeries { stamp_s, elevation_m }, last, options));
    Ok(((first, usable, unusable), latest))
}

fn burst(raw: RawSeries<'_>, options: &WavesOptions) -> Result<Burst, WavesError> {
    analyse(raw, options.segment_s, options.taper, options.band_hz)
        .map_err(|reason| WavesError::NoRecord { path: options.input.clone(), reason })
}

/// One record's quality and statistics; in words why there are none.
fn analyse(raw: RawSeries<'_>, segment_s: f64, taper: Taper, band_hz: (f64, f64)) -> Result<Burst, String> {
    let assessment = assess(raw, &Limits { segment_s, ..quality_limits() });
    let Some(even) = &assessment.even else { return Err(too_long(raw).unwrap_or_else(|| why_none(&assessment.findings))) };
    let burst = Burst::new(even, &assessment, (segment_s, taper), band_hz).map_err(|error| error.to_string())?;
    // A stray reading or two at its ends are no part that was left out.
    let left_out_s = span_s(raw) - burst.duration_s;
    Ok(Burst { left_out_s: (left_out_s > 0.02 * burst.duration_s).then_some(left_out_s), ..burst })
}

/// From the first to the last stamp, seconds; below zero where there is none.
fn span_s(raw: RawSeries<'_>) -> f64 {
    let finite = || raw.stamp_s.iter().copied().filter(|stamp| stamp.is_finite());
    finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min)
}

/// Whether there are more readings than are analysed at once.
fn too_long(raw: RawSeries<'_>) -> Option<String> {
    let count = raw.stamp_s.len();
    (count > Ordered::SAMPLES_MAX)
        .then(|| format!("{count} readings, and {} are analysed at once: cut them with --burst", Ordered::SAMPLES_MAX))
}

/// What is wrong with readings that make no record, in words.
fn why_none(findings: &[Finding]) -> String {
    let bad = |finding: &&Finding| matches!(finding.flag, Flag::Fail | Flag::Missing);
    let reasons: Vec<&str> = findings.iter().filter(bad).map(|finding| finding.reason.as_str()).collect();
    if reasons.is_empty() { "too few readings in a row".into() } else { reasons.join("; ") }
}
