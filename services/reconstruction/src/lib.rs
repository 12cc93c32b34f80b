//! Turns stereo pairs into gridded patches of water surface: calibrate, rectify, match, triangulate, fit the plane, grid.
//!
//! | | topic | message | units |
//! |---|---|---|---|
//! | reads | `rig/{rig}/pair` | [`StereoPair`](halcyon_model::StereoPair) | 8-bit grey, pose in metres and radians |
//! | writes | `rig/{rig}/surface` | [`SurfacePatch`](halcyon_model::SurfacePatch) | metres, positive up |
//! | writes | `rig/{rig}/preview` | [`Preview`](halcyon_model::Preview) | JPEG and PNG, at most 2 Hz |
//!
//! [`core`] is the domain, [`cli`] what `halcyon calibrate` and `halcyon match` do, [`files`] their pictures on disk.
//!
//! # Conventions
//! Rectified left camera frame: x right, y down, z forward, metres. Disparity: left x minus right x, pixels, NaN where there is
//! no match. Grid elevation: above the patch's own mean, positive up; the level of that mean travels beside it, so that the
//! autopilot's wander is never mistaken for a wave.
//!
//! **Invariant:** nothing under [`core`] knows the time, the bus or the disk; a pair goes in, a patch comes out.
//! **Invariant:** it never sees a vehicle. Pose and calibration arrive stamped on the pair.
//! **Invariant:** the same pairs in the same order give the same patches: every random choice is seeded.

mod actor;
pub mod cli;
mod config;
pub mod core;
pub mod files;
mod limits;

pub use actor::run;
pub use config::Config;
