//! The pure core: synchronous, deterministic, takes `now`, does no I/O.

pub mod boot;
pub mod budget;
pub mod coasting;
pub mod commands;
pub mod continuity;
pub mod control;
pub mod encode;
pub mod energy;
pub mod executor;
pub mod failsafe;
pub mod frame;
pub mod guidance;
pub mod heed;
pub mod identity;
pub mod intent;
pub mod interlock;
pub mod inverse;
pub mod items;
pub mod jump;
pub mod law;
pub mod limits;
pub mod local;
pub mod loss;
pub mod mode;
pub mod motion;
pub mod observer;
mod owed;
pub mod parameters;
pub mod payload;
pub mod px4;
pub mod renames;
pub mod separation;
pub mod signing;
pub mod station;
pub mod streams;
pub mod surface;
pub mod telemetry;
pub mod text;
pub mod timesync;
pub mod track;
pub mod transfers;
pub mod unlisted;
pub mod version;

#[cfg(test)]
mod tests;
