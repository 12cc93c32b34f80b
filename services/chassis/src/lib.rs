//! What every service stands on, so that a service is only its domain.
//!
//! | module | gives |
//! |---|---|
//! | [`config`] | one TOML file, environment and flags in layers; unknown keys refused with the nearest known one |
//! | [`clock`] | the fleet's time, which in simulation may run faster than the wall |
//! | [`topics`] | **the wiring diagram**: every key, its message, its delivery |
//! | [`bus`] | publishing, subscribing, commands: typed, validated, bounded |
//! | [`supervise`] | restart with backoff; a panic never takes the process down |
//! | [`health`] | what a service says of itself, and its liveliness token |
//! | [`process`] | one process: session, logs, metrics, signals, clean shutdown |
//!
//! An actor here is a task that owns its core and selects over its bounded inboxes (the rings of [`bus`]), its ticker and the
//! stop token. There is no second mailbox between the bus and the core: a queue behind a queue hides what was dropped.
//!
//! **Invariant:** no domain logic. Nothing here knows what a wave or a mission is, beyond the names in the topic table.

pub mod bus;
pub mod clock;
pub mod config;
pub mod context;
pub mod health;
pub mod process;
mod ring;
mod session;
pub mod supervise;
pub mod telemetry;
pub mod testing;
pub mod topics;

pub use bus::{Bus, BusError, CallError, CommandServer, Incoming, Presence, Publisher, RawSample, RawSubscriber, Subscriber};
pub use clock::{Clock, Elapsed, Ticker};
pub use config::{ConfigError, Section, Settings};
pub use context::{Context, EventDraft};
pub use health::HealthHandle;
pub use process::{Options, Process, main};
pub use session::{BusConfig, Mode};
pub use telemetry::LogConfig;
pub use tokio_util::sync::CancellationToken;
pub use topics::{CommandTopic, Topic};
