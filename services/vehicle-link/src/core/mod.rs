//! The pure core: synchronous, deterministic, takes `now`, does no I/O.

pub mod budget;
pub mod commands;
pub mod control;
pub mod encode;
pub mod executor;
pub mod failsafe;
pub mod frame;
pub mod guidance;
pub mod identity;
pub mod interlock;
pub mod inverse;
pub mod law;
pub mod limits;
pub mod local;
pub mod loss;
pub mod mode;
pub mod observer;
pub mod px4;
pub mod separation;
pub mod signing;
pub mod streams;
pub mod telemetry;
pub mod text;
pub mod timesync;
pub mod track;
pub mod version;

#[cfg(test)]
mod tests;
