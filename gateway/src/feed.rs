//! The live stream's source: ten times a second whatever changed is turned into JSON once and offered to every client.
//!
//! A vehicle that reports at 50 Hz so appears at most ten times a second, newest value first to last. A client that falls more
//! than [`BATCHES_KEPT`] batches behind loses them and starts anew from a snapshot; nobody ever waits for it.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use axum::extract::ws::Utf8Bytes;
use tokio::sync::broadcast;
use tokio::time::Instant;

use crate::api::dto::{Heartbeat, Hello, StreamMessage, rfc3339};
use crate::app::App;

/// Time between batches. People watch in wall time, however fast the fleet's clock runs.
pub const PERIOD: Duration = Duration::from_millis(100);
/// A heartbeat goes out with every so many batches.
const BATCHES_PER_HEARTBEAT: u64 = 10;
/// Batches that a slow client may fall behind.
const BATCHES_KEPT: usize = 32;
/// Events in a snapshot.
const SNAPSHOT_EVENTS: usize = 200;

/// What changed within one period.
#[derive(Debug)]
pub struct Batch {
    /// The store's revision that it leads to.
    pub revision: u64,
    /// What changed, as JSON.
    pub changes: Vec<Utf8Bytes>,
    /// A heartbeat, for every client, whatever it knows.
    pub heartbeat: Option<Utf8Bytes>,
}

/// See the module.
#[derive(Debug)]
pub struct Feed {
    sender: broadcast::Sender<Arc<Batch>>,
    sent: Mutex<(u64, u64)>,
}

impl Default for Feed {
    fn default() -> Self {
        Self { sender: broadcast::Sender::new(BATCHES_KEPT), sent: Mutex::default() }
    }
}

impl Feed {
    /// From now on.
    #[must_use]
    pub fn subscribe(&self) -> broadcast::Receiver<Arc<Batch>> {
        self.sender.subscribe()
    }
}

/// A message as JSON.
fn json(message: &StreamMessage) -> Option<Utf8Bytes> {
    match serde_json::to_string(message) {
        Ok(text) => Some(text.into()),
        Err(error) => {
            tracing::error!(%error, "a stream message could not be written");
            None
        }
    }
}

/// Everything known now, and the revision that it stands for.
#[must_use]
pub fn snapshot(app: &App) -> (u64, Vec<Utf8Bytes>) {
    let now = app.now();
    let hello = StreamMessage::Hello(Hello {
        api: "1".into(),
        version: env!("CARGO_PKG_VERSION").into(),
        fleet: app.fleet.to_string(),
        origin: app.origin.0.into(),
        now: rfc3339(now),
        speed: app.speed,
    });
    let (revision, messages) = {
        let fleet = app.store.read();
        (fleet.revision(), fleet.changes_since(0, SNAPSHOT_EVENTS, now))
    };
    (revision, std::iter::once(&hello).chain(&messages).filter_map(json).collect())
}

/// Offers whatever changed since the last call to every client.
pub fn flush(app: &App) {
    let now = app.now();
    let mut sent = app.feed.sent.lock().unwrap_or_else(PoisonError::into_inner);
    let (sent_revision, batches) = *sent;
    let heartbeat = batches % BATCHES_PER_HEARTBEAT == 0;
    let listeners = app.feed.sender.receiver_count() > 0;
    let (revision, changes) = {
        let mut fleet = app.store.write();
        fleet.refresh(now);
        let changes = if listeners { fleet.changes_since(sent_revision, usize::MAX, now) } else { Vec::new() };
        (fleet.revision(), changes)
    };
    *sent = (revision, batches + 1);
    if listeners && (heartbeat || !changes.is_empty()) {
        let heartbeat = heartbeat.then(|| StreamMessage::Heartbeat(Heartbeat { now: rfc3339(now) }));
        let batch = Batch {
            revision,
            changes: changes.iter().filter_map(json).collect(),
            heartbeat: heartbeat.as_ref().and_then(json),
        };
        // Fails only when the last listener has just left.
        let _ = app.feed.sender.send(Arc::new(batch));
    }
}

/// Flushes until the gateway stops.
pub async fn run(app: App) {
    let mut due = Instant::now();
    loop {
        // Wall time on purpose; see PERIOD. A late flush is not made up for.
        due = (due + PERIOD).max(Instant::now());
        tokio::select! {
            () = app.stop.cancelled() => return,
            () = tokio::time::sleep_until(due) => flush(&app),
        }
    }
}
