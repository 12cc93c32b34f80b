//! Surface patches over a window to sea state and verdict.
//!
//! | | |
//! |---|---|
//! | reads | `rig/{rig}/surface` ([`SurfacePatch`](halcyon_model::SurfacePatch)) |
//! | writes | `rig/{rig}/sea-state` ([`SeaState`](halcyon_model::SeaState)), about once a second |
//! | units | metres, seconds, radians; elevation positive up |
//!
//! A restart forgets the window: the verdict is inconclusive until it has filled again.
//!
//! **Invariant:** unknown is never safe. Safe needs every upper 95 % bound under its limit; whatever cannot be told from noise or
//! drift raises the bounds and never lowers them.
//! **Invariant:** nothing under `core` knows the time, the bus or the disk, and nothing here knows a vehicle.

pub mod cli;
pub mod core;
pub mod table;

mod actor;
mod config;

pub use actor::run;
pub use config::{Airframe, AirframeConfig, Config, PROFILES};
