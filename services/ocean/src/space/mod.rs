//! Waves in space: their length, direction and spread from a film of the surface.
//!
//! North and east are the axes; directions are where waves come **from**, radians clockwise from north; wavenumbers are vectors to where they go.
//!
//! | module | holds |
//! |---|---|
//! | [`film`] | elevation on a grid over time, checked, its holes filled |
//! | [`welch3`] | the spectrum over wavenumber and frequency |
//! | [`water`], [`shell`] | dispersion over a current; what of a spectrum lies on it |
//! | [`moments`], [`statistics`] | directions by frequency; wavelength, direction, spread, slopes |
//! | [`directional`] | S(f, θ) and the plane waves it stands for |
//! | [`gauges`], [`array`] | S(f, θ) of virtual gauges by maximum likelihood, of films shorter than their waves and without planes, too |
//! | [`snapshot`] | what one picture tells |
//! | [`entropy`] | S(f, θ) of first moments by maximum entropy |

pub mod array;
pub mod directional;
pub mod entropy;
mod fill;
pub mod film;
pub mod gauges;
mod hermitian;
mod likelihood;
pub mod moments;
#[cfg(test)]
mod sea_tests;
pub mod shell;
pub mod snapshot;
pub mod statistics;
#[cfg(test)]
mod synthetic;
#[cfg(test)]
mod tests;
pub mod water;
pub mod welch3;

pub use array::Array;
pub use directional::{DirectionalSpectrum, WaveLine};
pub use entropy::maximum_entropy;
pub use film::{Film, FilmError, Shape};
pub use gauges::{Gauges, Removed};
pub use moments::FourierMoments;
pub use shell::{OnShell, Shell};
pub use snapshot::{Snapshot, WaveAxis};
pub use statistics::FilmStatistics;
pub use water::Water;
pub use welch3::{SpaceError, SpectralCell, Spectrum3, Welch3};
