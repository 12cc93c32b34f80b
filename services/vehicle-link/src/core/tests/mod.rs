//! The executor flown in a small world of its own: double integrators with ArduCopter's modes, no noise, no bus.

mod commands;
mod failsafes;
mod flights;
mod formation;
mod heed;
mod mishaps;
mod payload;
mod pilot;
mod properties;
mod world;
