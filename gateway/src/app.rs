//! What every request handler shares.

use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::time::Duration;

use halcyon_model::{FleetId, FleetOrigin, Stamp};
use tokio::sync::{Semaphore, watch};
use tokio_util::sync::CancellationToken;

use crate::api::idempotency::Cache;
use crate::config::Config;
use crate::core::fleet::Fleet;
use crate::feed::Feed;
use crate::port::{Commands, Previews};

/// The fleet behind a lock that is only ever held for a moment, never across an await.
#[derive(Debug)]
pub struct Store {
    fleet: RwLock<Fleet>,
    preview_came: watch::Sender<()>,
}

impl Store {
    /// Wraps a fleet.
    #[must_use]
    pub fn new(fleet: Fleet) -> Self {
        Self { fleet: RwLock::new(fleet), preview_came: watch::Sender::new(()) }
    }

    /// To read. A panic elsewhere cannot leave a table half-written, so poison is ignored.
    pub fn read(&self) -> RwLockReadGuard<'_, Fleet> {
        self.fleet.read().unwrap_or_else(PoisonError::into_inner)
    }

    /// To write.
    pub fn write(&self) -> RwLockWriteGuard<'_, Fleet> {
        self.fleet.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// A preview was put in: wakes whoever waits for one.
    pub fn preview_came(&self) {
        self.preview_came.send_replace(());
    }

    /// Wakes at the next [`Self::preview_came`].
    #[must_use]
    pub fn preview_news(&self) -> watch::Receiver<()> {
        self.preview_came.subscribe()
    }
}

/// What an [`App`] is made of.
pub struct Parts {
    /// Section `[gateway]`.
    pub config: Config,
    /// The fleet's name.
    pub fleet: FleetId,
    /// Origin of the local frame.
    pub origin: FleetOrigin,
    /// The fleet's clock.
    pub now: Box<dyn Fn() -> Stamp + Send + Sync>,
    /// Fleet time that passes in one second of wall time.
    pub speed: f64,
    /// The command plane.
    pub commands: Box<dyn Commands>,
    /// Pictures on demand.
    pub previews: Box<dyn Previews>,
    /// All metrics of this process in Prometheus' text format.
    pub metrics: fn() -> String,
    /// Ends the streams.
    pub stop: CancellationToken,
    /// Whether only this host can reach the gateway.
    pub loopback: bool,
}

/// What every request handler shares.
#[derive(Clone)]
pub struct App(Arc<Inner>);

/// See [`App`].
pub struct Inner {
    /// What it is made of.
    pub parts: Parts,
    /// What is known about the fleet.
    pub store: Arc<Store>,
    /// The live stream's source.
    pub feed: Feed,
    /// Answers to requests that carried an idempotency key.
    pub idempotency: Mutex<Cache>,
    /// Live streams that may still be opened.
    pub streams: Arc<Semaphore>,
}

impl App {
    /// Puts it together; `store` is shared with whoever feeds it.
    #[must_use]
    pub fn new(parts: Parts, store: Arc<Store>) -> Self {
        let streams = Arc::new(Semaphore::new(parts.config.streams_max));
        Self(Arc::new(Inner { parts, store, feed: Feed::default(), idempotency: Mutex::default(), streams }))
    }

    /// The present on the fleet's clock.
    #[must_use]
    pub fn now(&self) -> Stamp {
        (self.parts.now)()
    }

    /// How long a command may wait for its answer, in wall time, and the stamp after which it must not be carried out.
    #[must_use]
    pub fn command_limit(&self, issued: Stamp) -> (Duration, Stamp) {
        let timeout_s = self.config.command_timeout_s;
        (Duration::from_secs_f64(timeout_s), issued.plus_secs_f64(timeout_s * self.speed))
    }
}

impl App {
    /// The same for what is read from an autopilot or written to it as a whole.
    #[must_use]
    pub fn transfer_limit(&self, issued: Stamp) -> (Duration, Stamp) {
        let timeout_s = self.config.transfer_timeout_s;
        // The vehicle's own reason for being late comes before we stop listening.
        (Duration::from_secs_f64(timeout_s), issued.plus_secs_f64(0.95 * timeout_s * self.speed))
    }
}

impl std::ops::Deref for App {
    type Target = Inner;
    fn deref(&self) -> &Inner {
        &self.0
    }
}

impl std::ops::Deref for Inner {
    type Target = Parts;
    fn deref(&self) -> &Parts {
        &self.parts
    }
}
