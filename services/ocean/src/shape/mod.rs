//! What a spectrum says beyond its moments.
//!
//! | module | holds |
//! |---|---|
//! | [`scatter`] | degrees of freedom of a Welch estimate, 95 % intervals of its densities |
//! | [`peak`] | peak periods that do not hang on a single line |
//! | [`noise`] | white noise of the measurement, found or known, taken off |
//! | [`mod@systems`] | wind sea and swell, each with its own height and periods |
//! | [`fit`] | JONSWAP and Pierson-Moskowitz spectra fitted by maximum likelihood |

pub mod fit;
mod likelihood;
pub mod noise;
pub mod peak;
pub mod scatter;
pub mod systems;

pub use fit::{Estimate, FitError, Goodness, JonswapFit, PiersonMoskowitzFit};
pub use noise::NoiseFloor;
pub use peak::PeakPeriods;
pub use scatter::Scatter;
pub use systems::{Kind, System, systems, together};

#[cfg(test)]
mod tests;
