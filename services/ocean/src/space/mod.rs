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
//! | [`gauges`], [`mod@array`] | S(f, θ) of virtual gauges by maximum likelihood, of films shorter than their waves and without planes, too |
//! | [`snapshot`] | what one picture tells |
//! | [`entropy`] | S(f, θ) of first moments by maximum entropy |
//!
//! Which to take, and how far it was from synthesised seas (JONSWAP of T_p 2 s, γ 3.3, cos-2s, 4 Hz; means over 3 to 8 films):
//!
//! | film | take | mean direction | spread |
//! |---|---|---|---|
//! | some waves wide | [`Spectrum3::statistics`] | 1° | 2 % |
//! | 4 m, shorter than its waves, levels kept | [`Spectrum3::moments`], [`FourierMoments::smoothed`], [`DirectionalSpectrum::by_entropy`] | 1° | 2 % (one minute: 6 %) |
//! | 4 m, each frame's mean and tilt lost, four minutes | [`Array`] with [`Removed::Plane`], nothing turned | 1° | 2 % (s 3) to 11 % (s 25) too wide |
//! | the same, one minute | [`Array::new`] | 1° | 11 % too wide (s 10) |
//!
//! One minute's film scatters: by about 4° in direction and 12 % in spread at s 10. Waves above half the frame rate are seen at frequencies
//! that are not theirs, with the opposite direction: a film should be faster than twice the fastest waves that matter (in a sea of T_p 2 s,
//! 2 Hz is too slow and 4 Hz is not).

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
