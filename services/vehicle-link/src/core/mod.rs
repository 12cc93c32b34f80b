//! The pure core: synchronous, deterministic, takes `now`, does no I/O.

pub mod boot;
pub mod commands;
pub mod continuity;
pub mod control;
pub mod encode;
pub mod energy;
pub mod executor;
pub mod failsafe;
pub mod guidance;
pub mod intent;
pub mod interlock;
pub mod inverse;
pub mod items;
pub mod jump;
pub mod law;
pub mod limits;
pub mod local;
pub mod motion;
pub mod observer;
pub mod parameters;
pub mod payload;
pub mod separation;
pub mod streams;
pub mod surface;
pub mod telemetry;
pub mod text;
pub mod track;
pub mod transfers;

#[cfg(test)]
mod tests;
