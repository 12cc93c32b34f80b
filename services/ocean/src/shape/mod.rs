//! What a spectrum says beyond its moments.
//!
//! | module | holds |
//! |---|---|
//! | [`scatter`] | degrees of freedom of a Welch estimate, 95 % intervals of its densities |
//! | [`peak`] | peak periods that do not hang on a single line |
//! | [`fit`] | JONSWAP and Pierson-Moskowitz spectra fitted by maximum likelihood |

pub mod fit;
mod likelihood;
pub mod peak;
pub mod scatter;

pub use fit::{Estimate, FitError, Goodness, JonswapFit, PiersonMoskowitzFit};
pub use peak::PeakPeriods;
pub use scatter::Scatter;

#[cfg(test)]
mod tests;
