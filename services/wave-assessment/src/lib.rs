//! Surface patches over a window to sea state and verdict.
//!
//! | | |
//! |---|---|
//! | reads | `rig/{rig}/surface` ([`SurfacePatch`](halcyon_model::SurfacePatch)) |
//! | reads | `vehicle/{rig}/state` ([`VehicleState`](halcyon_model::VehicleState)): the rangefinder of the vehicle that carries the rig, a second witness |
//! | writes | `rig/{rig}/sea-state` ([`SeaState`](halcyon_model::SeaState)), about once a second |
//! | units | metres, seconds, radians; elevation positive up |
//!
//! A restart forgets the window: the verdict is inconclusive until it has filled again.
//!
//! **Invariant:** unknown is never safe. Safe needs every upper 95 % bound under its limit; whatever cannot be told from noise or
//! drift raises the bounds and never lowers them.
//! **Invariant:** nothing under `core` knows the time, the bus or the disk. Of a vehicle only its rangefinder is heard, and it can make
//! a verdict inconclusive, never safe.

pub mod cli;
pub mod core;
#[cfg(feature = "experiment")]
pub mod experiment;
pub mod table;

mod actor;
mod config;

pub use actor::run;
pub use config::{Airframe, AirframeConfig, Config, PROFILES};
