//! The domain: pictures in, surfaces out. Synchronous, deterministic, and ignorant of time, bus and disk.

pub mod calibrate;
pub mod camera;
pub mod cloud;
pub(crate) mod cv;
pub mod disparity;
pub mod epipolar;
pub mod features;
pub mod grid;
pub mod guided;
pub mod matcher;
pub mod mesh;
pub mod peer;
pub mod plane;
pub mod reconstruct;
pub mod rectify;
pub mod refine;
mod resample;
pub mod rig_budget;
mod scatter;
pub mod self_calibrate;
pub mod sgm;
pub mod show;
pub mod study;
pub mod tilt;
mod window;
