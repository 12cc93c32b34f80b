//! Waves in space: their length, direction and spread from a film of the surface.
//!
//! North and east are the axes; directions are where waves come **from**, radians clockwise from north; wavenumbers are vectors to where they go.
//!
//! | module | holds |
//! |---|---|
//! | [`film`] | elevation on a grid over time, checked, its holes filled |
//! | [`welch3`] | the spectrum over wavenumber and frequency |

mod fill;
pub mod film;
#[cfg(test)]
mod synthetic;
#[cfg(test)]
mod tests;
pub mod welch3;

pub use film::{Film, FilmError, Shape};
pub use welch3::{SpaceError, SpectralCell, Spectrum3, Welch3};
