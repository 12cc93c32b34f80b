//! Stereo pairs in: from a survey folder or from simulated water, stamped with the pose at mid-exposure, onto the bus.
//!
//! **Reads** `vehicle/{vehicle}/state` (the autopilot's own estimate, for the pose) and, in simulation only,
//! `sim/{vehicle}/truth` (where the simulated cameras really are, for the picture). **Writes** `rig/{rig}/pair`.
//! **Units:** SI; local frame north, east, down; camera frame x right, y down, z forward.
//!
//! Promises: the newest pair wins, late ticks are skipped, nothing queues. A restart forgets the pose history, so the first
//! pairs after it may come without a pose.
//!
//! **Invariant:** the pose on a pair never comes from the simulator's truth: what is measured downstream carries the autopilot's
//! errors, as it would in the air.
//! **Invariant:** nothing under `core/` knows the time, the bus or the disk.

mod actor;
mod config;
pub mod core;
pub mod folder;
mod pictures;
mod render;
mod source;

pub use actor::run;
pub use config::{Config, SimSection, SourceKind};
pub use folder::{FolderError, Frame, SurveyFolder};
pub use render::{RenderFolderError, RenderOptions, write_survey_folder};
