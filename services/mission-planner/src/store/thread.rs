//! The store on a thread of its own, so that a slow disk never holds up the runtime.

use std::path::PathBuf;
use std::time::Duration;

use tokio::sync::{mpsc, oneshot};

use super::{Store, StoreError};
use crate::core::{Record, Saved};

/// Batches in flight. The planner waits for each, so that more than one is rare.
const QUEUE: usize = 4;
/// A disk that takes longer is broken. Wall time: disks know no simulated one.
const ANSWER_WAIT: Duration = Duration::from_secs(10);

type Job = (Vec<Record>, oneshot::Sender<Result<(), StoreError>>);

/// A handle to the thread. Dropping it closes the store, once the batch in hand is done.
#[derive(Debug)]
pub struct StoreThread {
    jobs: mpsc::Sender<Job>,
}

impl StoreThread {
    /// Opens the store on a new thread, and reads what it holds.
    ///
    /// # Errors
    /// [`StoreError`], as [`Store::open`] and [`Store::load`].
    pub async fn open(path: PathBuf) -> Result<(Self, Saved), StoreError> {
        let (jobs, mut queue) = mpsc::channel::<Job>(QUEUE);
        let (opened, answer) = oneshot::channel();
        let work = move || {
            let store = Store::open(&path).and_then(|store| Ok((store.load()?, store)));
            let mut store = match store {
                Ok((saved, store)) => {
                    let _ = opened.send(Ok(saved));
                    store
                }
                Err(error) => {
                    let _ = opened.send(Err(error));
                    return;
                }
            };
            while let Some((records, reply)) = queue.blocking_recv() {
                let _ = reply.send(store.append(&records));
            }
        };
        std::thread::Builder::new().name("mission-store".into()).spawn(work).map_err(|_| StoreError::Silent)?;
        let saved = answered(answer).await?;
        Ok((Self { jobs }, saved))
    }

    /// Stores a batch, all or nothing, and returns once it is on the disk.
    ///
    /// # Errors
    /// [`StoreError::Write`], or [`StoreError::Silent`] when it is not known what became of it.
    pub async fn append(&self, records: Vec<Record>) -> Result<(), StoreError> {
        if records.is_empty() {
            return Ok(());
        }
        let (reply, answer) = oneshot::channel();
        self.jobs.try_send((records, reply)).map_err(|_| StoreError::Silent)?;
        answered(answer).await
    }
}

async fn answered<T>(answer: oneshot::Receiver<Result<T, StoreError>>) -> Result<T, StoreError> {
    match tokio::time::timeout(ANSWER_WAIT, answer).await {
        Ok(Ok(result)) => result,
        _ => Err(StoreError::Silent),
    }
}
