//! Seeded simulation: water, wind, sensors, camera rig, multicopter.
//!
//! Everything is a pure function of configuration, seed and inputs: no clock, no thread, no socket. The same seed and the same
//! inputs at the same times give the same flight and the same water, in one process or in ten.
//!
//! **Reads:** nothing. **Writes:** nothing. The shells in `capture` and `halcyon` step it and publish what comes out.
//! **Units:** SI; local frame north, east, down with down 0 at the mean water level; water elevation positive up.
//! **Invariant:** what a vehicle is told ([`estimator::Estimate`]) and what is true ([`copter::Motion`]) are different types; the
//! autopilot sees the first only.
//! **Invariant:** no estimator of the measurement chain is used here: simulation does not borrow the estimator it judges.

pub mod autopilot;
pub mod battery;
pub mod config;
pub mod copter;
pub mod estimator;
pub mod fault;
pub mod gnss;
pub mod noise;
pub mod rangefinder;
pub mod render;
pub mod rig;
pub mod sea;
pub mod texture;
pub mod vehicle;
pub mod water;
pub mod wind;

pub use config::{SimConfig, SimVehicle};
