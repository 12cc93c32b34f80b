//! The only async of recording: from the bus into the queue of the writing thread.

use std::sync::atomic::Ordering;
use std::time::Duration;

use halcyon_chassis::{Context, EventDraft, RawSample};
use halcyon_model::Stamp;

use crate::config::Config;
use crate::core::Sample;
use crate::core::keys::{self, Kind};
use crate::thread::{NotTaken, WriterThread};

/// Drops are reported as an event at most this often.
const REPORT_PERIOD_S: f64 = 10.0;

/// Records until it is told to stop; then ends the file properly.
///
/// Order: as received. When the disk is behind, new messages are dropped, counted (`recorder_messages_dropped_total`) and
/// reported.
///
/// # Errors
/// If the folder cannot be written, or the bus fails.
pub async fn run(context: Context, config: Config) -> anyhow::Result<()> {
    let mut samples = context.bus.subscribe_raw().await?;
    let writer = WriterThread::start(&config, context.fleet.clone(), context.clock.clone()).await?;
    let mut drops = Drops::default();
    let mut ticker = context.clock.every(Duration::from_secs(1));
    let outcome = loop {
        tokio::select! {
            () = context.stop.cancelled() => break Ok(()),
            sample = samples.recv() => match sample {
                Ok(sample) => match take(&writer, sample, config.pictures) {
                    Ok(()) => {}
                    Err(NotTaken::Full) => drops.add(),
                    // Its error comes out of `finish`.
                    Err(NotTaken::Gone) => break Ok(()),
                },
                Err(error) => break Err(error.into()),
            },
            _ = ticker.tick() => {
                let progress = writer.progress();
                let (written, refused) = (progress.written.load(Ordering::Relaxed), progress.refused.load(Ordering::Relaxed));
                metrics::counter!("recorder_messages_written_total").absolute(written);
                metrics::counter!("recorder_messages_refused_total").absolute(refused);
                drops.report(&context).await;
                let detail = format!("{written} messages recorded");
                if drops.behind {
                    context.health.degraded(format!("{detail}; the disk is behind, {} messages dropped", drops.total));
                } else if refused > 0 {
                    context.health.degraded(format!("{detail}; {refused} had too many different keys"));
                } else {
                    context.health.ready(detail);
                }
            }
        }
    };
    drop(samples);
    writer.finish().await.and(outcome)
}

fn take(writer: &WriterThread, sample: RawSample, pictures: bool) -> Result<(), NotTaken> {
    if !pictures && keys::suffix(&sample.key).map(keys::kind) == Some(Kind::Picture) {
        return Ok(());
    }
    let RawSample { key, encoding, payload, received } = sample;
    writer.try_add(Sample { key, encoding, payload, received })
}

/// Messages that the disk was too slow for.
#[derive(Default)]
struct Drops {
    total: u64,
    reported: u64,
    at: Option<Stamp>,
    behind: bool,
}

impl Drops {
    fn add(&mut self) {
        self.total += 1;
        metrics::counter!("recorder_messages_dropped_total").increment(1);
    }

    async fn report(&mut self, context: &Context) {
        let now = context.clock.now();
        if self.at.is_some_and(|at| now.seconds_since(at) < REPORT_PERIOD_S) {
            return;
        }
        let new = self.total - self.reported;
        self.behind = new > 0;
        if self.behind {
            self.at = Some(now);
            self.reported = self.total;
            let why = format!("the disk is behind: {new} messages were dropped, {} in all", self.total);
            context.event(EventDraft::warning("the recording has gaps", why)).await;
        }
    }
}
