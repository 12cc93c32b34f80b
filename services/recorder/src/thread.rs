//! The thread that writes. Disks are slow and block; the bus is neither.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use halcyon_chassis::Clock;
use halcyon_model::{FleetId, Stamp};
use tokio::sync::oneshot;
use tracing::{info, warn};

use crate::config::{Config, bytes};
use crate::core::{RecordError, Recording, Sample};
use crate::disk;

/// What the thread has done so far.
#[derive(Debug, Default)]
pub(crate) struct Progress {
    /// Bytes of payload that wait for the disk.
    waiting: AtomicU64,
    /// Messages written.
    pub(crate) written: AtomicU64,
    /// Messages that were not written since they had one key too many.
    pub(crate) refused: AtomicU64,
}

/// Why a sample was not taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum NotTaken {
    /// The disk is behind; the sample is dropped.
    Full,
    /// The thread has ended.
    Gone,
}

/// A handle to the thread. Dropping it ends the file properly.
pub(crate) struct WriterThread {
    queue: SyncSender<Sample>,
    progress: Arc<Progress>,
    waiting_max: u64,
    result: oneshot::Receiver<anyhow::Result<()>>,
}

impl WriterThread {
    /// Begins a recording on a thread of its own.
    ///
    /// # Errors
    /// If the first file cannot be begun.
    pub(crate) async fn start(config: &Config, fleet: FleetId, clock: Clock) -> anyhow::Result<Self> {
        let (queue, samples) = sync_channel(config.queue_max_messages);
        let progress = Arc::new(Progress::default());
        let (opened, answer) = oneshot::channel();
        let (ended, result) = oneshot::channel();
        let mut writer = Writer { config: config.clone(), fleet, clock, progress: Arc::clone(&progress), file: None };
        let work = move || {
            if let Err(error) = writer.begin() {
                let _ = opened.send(Err(error));
                return;
            }
            let _ = opened.send(Ok(()));
            let _ = ended.send(writer.run(&samples));
        };
        std::thread::Builder::new().name("recorder".into()).spawn(work).context("the writing thread could not be started")?;
        answer.await.context("the writing thread ended")??;
        Ok(Self { queue, progress, waiting_max: bytes(config.queue_max_mb), result })
    }

    /// Hands over a sample. Never waits.
    pub(crate) fn try_add(&self, sample: Sample) -> Result<(), NotTaken> {
        let size = sample.payload.len() as u64;
        let waiting = self.progress.waiting.fetch_add(size, Ordering::Relaxed) + size;
        // One that is larger than the whole allowance still goes through an empty queue.
        let full = waiting > self.waiting_max && waiting > size;
        let sent = if full { Err(NotTaken::Full) } else { self.queue.try_send(sample).map_err(|error| why(&error)) };
        if sent.is_err() {
            self.progress.waiting.fetch_sub(size, Ordering::Relaxed);
        }
        sent
    }

    pub(crate) fn progress(&self) -> &Progress {
        &self.progress
    }

    /// Ends the recording and waits for it, or says why it had ended before.
    pub(crate) async fn finish(self) -> anyhow::Result<()> {
        drop(self.queue);
        self.result.await.context("the writing thread panicked")?
    }
}

fn why(error: &TrySendError<Sample>) -> NotTaken {
    match error {
        TrySendError::Full(_) => NotTaken::Full,
        TrySendError::Disconnected(_) => NotTaken::Gone,
    }
}

struct Open {
    recording: Recording<BufWriter<File>>,
    /// The same file, for syncing.
    file: File,
    path: PathBuf,
    begun: Stamp,
    dirty: bool,
}

struct Writer {
    config: Config,
    fleet: FleetId,
    clock: Clock,
    progress: Arc<Progress>,
    file: Option<Open>,
}

impl Writer {
    fn begin(&mut self) -> anyhow::Result<()> {
        let folder = PathBuf::from(&self.config.folder);
        let now = self.clock.now();
        let (file, path) = disk::create(&folder, &self.fleet, now)
            .with_context(|| format!("a recording could not be begun in {}", folder.display()))?;
        match disk::prune(&folder, &self.fleet, &path, bytes(self.config.folder_max_mb)) {
            Ok(gone) if gone.is_empty() => {}
            Ok(gone) => info!(deleted = gone.len(), "the oldest recordings made room"),
            Err(error) => warn!(%error, "the oldest recordings could not be deleted"),
        }
        let about = BTreeMap::from([
            ("fleet".to_owned(), self.fleet.to_string()),
            ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ]);
        let sink = BufWriter::new(file.try_clone().context("the recording's file handle could not be copied")?);
        let recording = Recording::new(sink, halcyon_proto::FILE_DESCRIPTOR_SET, about)?;
        info!(file = %path.display(), "recording");
        self.file = Some(Open { recording, file, path, begun: now, dirty: true });
        Ok(())
    }

    fn run(&mut self, samples: &Receiver<Sample>) -> anyhow::Result<()> {
        let period = Duration::from_secs_f64(self.config.flush_s);
        let mut flush_at = Instant::now() + period;
        loop {
            match samples.recv_timeout(flush_at.saturating_duration_since(Instant::now())) {
                Ok(sample) => {
                    self.progress.waiting.fetch_sub(sample.payload.len() as u64, Ordering::Relaxed);
                    self.add(&sample)?;
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return self.end(),
            }
            if Instant::now() >= flush_at {
                self.flush()?;
                flush_at = Instant::now() + period;
            }
        }
    }

    fn add(&mut self, sample: &Sample) -> anyhow::Result<()> {
        if self.file.as_ref().is_some_and(|open| self.is_over(open, sample.received)) {
            self.end()?;
            self.begin()?;
        }
        let Some(open) = &mut self.file else { anyhow::bail!("no recording is open") };
        match open.recording.add(sample) {
            Ok(()) => {
                open.dirty = true;
                self.progress.written.fetch_add(1, Ordering::Relaxed);
                Ok(())
            }
            Err(RecordError::TooManyKeys { .. }) => {
                self.progress.refused.fetch_add(1, Ordering::Relaxed);
                Ok(())
            }
            Err(error) => Err(error).with_context(|| format!("recording {} failed", open.path.display())),
        }
    }

    fn is_over(&self, open: &Open, now: Stamp) -> bool {
        open.recording.bytes() >= bytes(self.config.file_max_mb) || now.seconds_since(open.begun) >= self.config.file_max_s
    }

    /// Everything so far onto the disk itself, so that it outlives a crash of the machine too.
    fn flush(&mut self) -> anyhow::Result<()> {
        let Some(open) = self.file.as_mut().filter(|open| open.dirty) else { return Ok(()) };
        open.dirty = false;
        let flushed = open.recording.flush().map_err(anyhow::Error::from).and_then(|()| Ok(open.file.sync_data()?));
        flushed.with_context(|| format!("recording {} failed", open.path.display()))
    }

    fn end(&mut self) -> anyhow::Result<()> {
        let Some(open) = self.file.take() else { return Ok(()) };
        let messages = open.recording.messages();
        let finished = open.recording.finish().map_err(anyhow::Error::from).and_then(|mut sink| {
            sink.flush()?;
            Ok(open.file.sync_all()?)
        });
        finished.with_context(|| format!("recording {} could not be ended", open.path.display()))?;
        info!(file = %open.path.display(), messages, "recorded");
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use halcyon_chassis::Section as _;
    use halcyon_chassis::clock::ClockConfig;
    use halcyon_model::Bytes;

    fn sample(size: usize) -> Sample {
        Sample {
            key: "halcyon/v1/alpha/event".into(),
            encoding: "application/octet-stream".into(),
            payload: Bytes::from(vec![7; size]),
            received: Stamp::from_nanos(1_760_000_000_000_000_000),
        }
    }

    /// A thread that never takes anything: the slowest disk there is.
    fn stuck(messages: usize, waiting_max: u64) -> (WriterThread, Receiver<Sample>) {
        let (queue, samples) = sync_channel(messages);
        let (_ended, result) = oneshot::channel();
        (WriterThread { queue, progress: Arc::default(), waiting_max, result }, samples)
    }

    #[test]
    fn a_disk_that_stands_still_costs_messages_and_neither_time_nor_memory() {
        let (writer, samples) = stuck(3, 1_000_000);
        let taken = (0..1000).filter(|_| writer.try_add(sample(10)).is_ok()).count();
        assert_eq!((taken, writer.progress.waiting.load(Ordering::Relaxed)), (3, 30));

        let (large, _samples) = stuck(1000, 100);
        let taken = (0..1000).filter(|_| large.try_add(sample(30)).is_ok()).count();
        assert_eq!(taken, 3, "90 bytes of 100");
        let (huge, _samples) = stuck(1000, 100);
        assert_eq!((huge.try_add(sample(500)), huge.try_add(sample(1))), (Ok(()), Err(NotTaken::Full)));

        drop(samples);
        assert_eq!(writer.try_add(sample(1)), Err(NotTaken::Gone));
    }

    #[tokio::test]
    async fn files_change_over_at_their_size_and_the_oldest_go() {
        let folder = tempfile::tempdir().unwrap();
        let config = Config {
            folder: folder.path().to_string_lossy().into_owned(),
            file_max_mb: 1.0,
            folder_max_mb: 3.0,
            queue_max_mb: 100.0,
            ..Config::default()
        };
        config.validate().unwrap();
        let fleet = FleetId::new("alpha").unwrap();
        let writer = WriterThread::start(&config, fleet, Clock::new(&ClockConfig::default())).await.unwrap();
        // Noise, so that compression does not shrink it: a linear congruential generator's high byte.
        let mut state = 1u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 56) as u8
        };
        for _ in 0..80 {
            let payload: Vec<u8> = (0..100_000).map(|_| noise()).collect();
            writer.try_add(Sample { payload: Bytes::from(payload), ..sample(0) }).unwrap();
        }
        writer.finish().await.unwrap();
        let sizes: Vec<u64> =
            std::fs::read_dir(folder.path()).unwrap().map(|file| file.unwrap().metadata().unwrap().len()).collect();
        // 8 MB in files of 1 MB, of which those that fit into 3 MB are left, and the last one.
        assert!((3..=4).contains(&sizes.len()), "{sizes:?}");
        assert!(sizes.iter().all(|size| *size < 1_200_000), "{sizes:?}");
    }

    #[tokio::test]
    async fn a_folder_that_cannot_be_made_is_a_clear_error() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let config = Config { folder: file.path().join("under").to_string_lossy().into_owned(), ..Config::default() };
        let fleet = FleetId::new("alpha").unwrap();
        let error = WriterThread::start(&config, fleet, Clock::new(&ClockConfig::default())).await.err().unwrap();
        assert!(error.to_string().contains("could not be begun in"), "{error}");
    }
}
