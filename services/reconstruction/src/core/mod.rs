//! The domain: pictures in, surfaces out. Synchronous, deterministic, and ignorant of time, bus and disk.

pub mod calibrate;
pub mod camera;
mod cv;
pub mod disparity;
pub mod grid;
pub mod matcher;
pub mod plane;
pub mod reconstruct;
pub mod rectify;
pub mod refine;
mod resample;
mod scatter;
pub mod study;
pub mod tilt;
