//! A recording back onto a bus, at the pace at which it was made.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use halcyon_chassis::{BusError, Context};
use halcyon_model::Stamp;
use tokio::sync::mpsc;

use crate::core::keys::{self, Kind};
use crate::core::{ReadError, Reading, Recorded, Sample};

/// Messages read ahead of their time.
const READ_AHEAD: usize = 256;

/// How to replay.
#[derive(Debug, Clone, PartialEq)]
pub struct ReplayOptions {
    /// Recorded seconds per second of fleet time, 0.01 to 1000.
    pub speed: f64,
    /// Also publish dispatch plans and whatever else makes vehicles move. Never onto the bus of a fleet that flies.
    pub orders: bool,
}

impl Default for ReplayOptions {
    fn default() -> Self {
        Self { speed: 1.0, orders: false }
    }
}

/// What was replayed.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReplayReport {
    /// Messages published.
    pub published: u64,
    /// Messages held back, by key: orders, and keys that are not in the table of topics.
    pub held_back: BTreeMap<String, u64>,
    /// Recorded time from the first to the last message, seconds.
    pub recorded_s: f64,
    /// Whether the recording was ended properly; one that was cut off is replayed as far as it goes.
    pub complete: bool,
    /// Whether the end was reached, rather than a stop.
    pub finished: bool,
}

/// A recording could not be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The speed makes no sense.
    #[error("the speed must be in 0.01 to 1000, not {0}")]
    Speed(f64),
    /// The file cannot be opened.
    #[error("{path} could not be opened")]
    Open {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: std::io::Error,
    },
    /// The file cannot be read.
    #[error("{path} could not be replayed")]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        #[source]
        source: ReadError,
    },
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}

/// Publishes what a recording holds under this fleet's keys, message after message, with the recorded pauses divided by
/// `options.speed`. Payloads go out as they are: their stamps are those of the recording, so that nothing that asks for fresh
/// data takes them for new.
///
/// Dispatch plans, commands and unknown keys are held back unless `options.orders` is set, and counted in the report: on the
/// bus of a live fleet they would make vehicles move.
///
/// Ends at the end of the file, or when `context.stop` is cancelled.
///
/// # Errors
/// [`ReplayError`]; a file that was cut off is no error.
pub async fn replay(context: &Context, path: &Path, options: &ReplayOptions) -> Result<ReplayReport, ReplayError> {
    if !(0.01..=1000.0).contains(&options.speed) {
        return Err(ReplayError::Speed(options.speed));
    }
    let mut samples = read(path.to_path_buf()).await?;
    let mut report = ReplayReport::default();
    let mut start: Option<(Stamp, Stamp)> = None;
    loop {
        let next = tokio::select! {
            () = context.stop.cancelled() => return Ok(report),
            next = samples.recv() => next,
        };
        let sample = match next {
            Some(Ok(Recorded::Sample(sample))) => sample,
            Some(Ok(Recorded::End { complete })) => {
                report.complete = complete;
                report.finished = true;
                return Ok(report);
            }
            Some(Err(source)) => return Err(ReplayError::Read { path: path.into(), source }),
            None => return Ok(report),
        };
        let (first, began) = *start.get_or_insert((sample.received, context.clock.now()));
        let recorded_s = sample.received.seconds_since(first);
        report.recorded_s = report.recorded_s.max(recorded_s);
        let Some(key) = permitted(&context.fleet.to_string(), &sample, options) else {
            *report.held_back.entry(sample.key).or_default() += 1;
            continue;
        };
        tokio::select! {
            () = context.stop.cancelled() => return Ok(report),
            () = context.clock.sleep_until(began.plus_secs_f64(recorded_s / options.speed)) => {}
        }
        context.bus.put_raw(&key, &sample.encoding, sample.payload).await?;
        report.published += 1;
    }
}

/// The key to publish a sample under; `None` for one that is held back.
fn permitted(fleet: &str, sample: &Sample, options: &ReplayOptions) -> Option<String> {
    let suffix = keys::suffix(&sample.key)?;
    match keys::kind(suffix) {
        Kind::Picture | Kind::Report => {}
        Kind::Order | Kind::Unknown if options.orders => {}
        Kind::Order | Kind::Unknown => return None,
    }
    Some(format!("halcyon/v1/{fleet}/{suffix}"))
}

/// Reads on a thread that may block, a little ahead.
async fn read(path: PathBuf) -> Result<mpsc::Receiver<Result<Recorded, ReadError>>, ReplayError> {
    let (queue, samples) = mpsc::channel(READ_AHEAD);
    let open = path.clone();
    let opened = tokio::task::spawn_blocking(move || File::open(open)).await;
    let file = opened.map_err(std::io::Error::other).flatten().map_err(|source| ReplayError::Open { path, source })?;
    tokio::task::spawn_blocking(move || {
        let mut reading = Reading::new(BufReader::new(file));
        loop {
            let next = reading.next_sample();
            let last = !matches!(next, Ok(Recorded::Sample(_)));
            // The replay was stopped, or this is all there is.
            if queue.blocking_send(next).is_err() || last {
                return;
            }
        }
    });
    Ok(samples)
}
