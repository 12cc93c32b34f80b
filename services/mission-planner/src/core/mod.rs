//! The pure core: synchronous, deterministic, takes `now`, does no I/O.
//!
//! - [`Planner`] holds the missions; [`Planner::step`] and [`Planner::command`] return [`Effects`].
//! - [`geometry`] places the vehicles of a mission about its spot.
//! - [`assignment`] and [`shape`] say who takes which slot of a formation of many.
//! - [`Record`] is what must be stored before anything is announced; [`Saved`] is what the store gives back.

pub mod assignment;
mod command;
mod fleet;
mod flow;
mod formation;
pub mod geometry;
mod homing;
mod live;
mod planner;
mod record;
mod release;
pub mod shape;
mod tasks;
mod waters;

pub use fleet::Ignored;
pub use formation::Formation;
pub use planner::{PLANNER, Planner};
pub use record::{Course, Effects, Notice, Record, ReleaseOrder, Saved, SavedMission};
