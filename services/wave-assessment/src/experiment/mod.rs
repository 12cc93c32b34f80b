//! Verdicts on random seas whose truth is known, for `halcyon lab verdicts` and the tests.
//!
//! | module | holds |
//! |---|---|
//! | [`sea`] | a sea as a sum of wave systems, and what is true of it |
//! | [`film`] | patches of it as a rig would deliver them |
//! | [`trial`] | one sea and what was said of it; many of them, counted |
//!
//! **Invariant:** nothing here uses the estimator to make water or its truth: densities, directions, slopes and heights are integrals of their own.

pub mod film;
pub mod sea;
pub mod trial;

#[cfg(test)]
mod tests;

pub use film::Camera;
pub use sea::{Sea, System, Truth};
pub use trial::{CONDITIONS, Conditions, Drawn, Tally, Water, draw, severity_of};

/// Standard gravity, metres per second squared.
const GRAVITY_MPS2: f64 = 9.80665;
