//! The flight recorder: everything on the bus to MCAP, and replay.
//!
//! Reads everything below `halcyon/v1/{fleet}/` that is published (commands are queries and leave their trace as events and
//! mission transitions). Writes [MCAP](https://mcap.dev) files: one channel a key, protobuf messages with their schema, log time
//! is the fleet time of arrival, nanoseconds since the Unix epoch. They open in Foxglove and with any MCAP library.
//!
//! Pictures are left out unless `pictures` is set. Files change over at a size and an age, and the oldest go when the folder
//! reaches its limit.
//!
//! **Invariant:** a slow disk never holds up the bus. Between the bus and the disk is one bounded queue; what does not fit is
//! dropped, counted and reported.
//!
//! **Invariant:** what was recorded more than `flush_s` ago is on the disk, and can be read even if the recorder is killed.
//!
//! **Invariant:** [`replay()`] publishes only what was measured and reported. Commands and plans never go back onto a bus unless
//! asked for by name: there may be a live fleet on it.

mod actor;
pub mod config;
pub mod core;
mod disk;
mod replay;
mod thread;

pub use actor::run;
pub use config::Config;
pub use replay::{ReplayError, ReplayOptions, ReplayReport, replay};
