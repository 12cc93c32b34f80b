//! Wave theory and wave statistics. Pure: numbers in, numbers out; no I/O, no clock, no panic.
//!
//! | module | holds |
//! |---|---|
//! | [`dispersion`] | linear dispersion in water of any depth |
//! | [`spectrum`] | JONSWAP and Pierson-Moskowitz spectra, their moments |
//! | [`spreading`] | cos-2s directional spreading |
//!
//! Elevation is positive up, metres; densities are one-sided, m²/Hz.
//!
//! **Invariant:** nothing here knows of patches, vehicles or messages; both the simulator and the estimators use it, and so it
//! holds theory and no simulation.

pub mod dispersion;
mod special;
pub mod spectrum;
pub mod spreading;

pub use dispersion::{Depth, GRAVITY_MPS2};
pub use spectrum::{Jonswap, PiersonMoskowitz, Spectrum, SpectrumError};
pub use spreading::CosTwoS;
