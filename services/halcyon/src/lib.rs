//! The command line, and the whole fleet in one process.
//!
//! **Invariant:** nothing here measures, decides or flies; it puts services together, and calls their entry points.
//! [`witness`] reads the simulator's truth to judge the fleet, and nothing of the fleet reads the witness.

pub mod accuracy;
pub mod cli;
pub mod fleet;
pub mod lab;
pub mod report;
pub mod simulator;
pub mod speed;
pub mod witness;
