//! The nouns that cross a service edge: units, frames, identifiers, time and messages. No I/O, no async, no wire format.
//!
//! # Conventions
//!
//! SI everywhere; a plain number's name ends in its unit (`altitude_m`, `stamp_ns`). Rotations and transforms read
//! `a_from_b`. Frames:
//!
//! | frame | axes |
//! |---|---|
//! | camera | x right, y down, z forward |
//! | body | forward, right, down |
//! | local (NED) | north, east, down from a stated geodetic origin (WGS-84); down 0 is the mean water level |
//!
//! Heading is clockwise from true north. Water elevation is positive up. Pixel (0, 0) is the centre of the top-left pixel.
//! Wave direction is where waves come **from**. Disparity is left x minus right x; no match is NaN.
//!
//! **Invariant:** nothing here knows serde, prost, tokio or Zenoh, so the nouns are free to change shape.

pub mod camera_info;
pub mod command;
pub mod fleet;
pub mod geo;
pub mod grid_error;
pub mod id;
pub mod mav_cmd;
pub mod mission;
pub mod plan;
pub mod rig_yaml;
pub mod sea;
pub mod service;
pub mod stereo;
pub mod time;
pub mod transfer;
pub mod vehicle;
mod yaml;

pub use bytes::Bytes;
pub use command::{CommandReply, MissionAction, MissionCommand, VehicleAction, VehicleCommand};
pub use fleet::FleetOrigin;
pub use geo::{Geodetic, LocalFrame, LocalPoint};
pub use id::{FleetId, IdError, InstanceId, MissionId, RigId, VehicleId};
pub use mission::{Approval, Mission, MissionPhase, MissionSpec, Transition};
pub use plan::{Assignment, Clearance, DispatchPlan, Slot, Task};
pub use sea::{
    CalmForecast, CalmWindow, Directional, Estimate, QualityFlag, SeaState, TracePoint, Verdict, VerdictReason, VerdictState,
    WaveSpectrum,
};
pub use service::{Event, Health, HealthState, Severity};
pub use stereo::{
    CameraIntrinsics, ElevationGrid, Image, Plane, PoseAtExposure, Preview, RigCalibration, StereoPair, SurfacePatch,
};
pub use time::Stamp;
pub use transfer::{Content, Item, ItemFrame, ItemKind, Parameter, ParameterKind, ParameterName, ParameterNameError};
pub use vehicle::{
    Activity, Ages, Firmware, Fix, FlightMode, Intent, LandedState, LinkQuality, Range, Role, SimTruth, VehicleState,
};
