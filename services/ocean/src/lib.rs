//! Wave theory and wave statistics. Pure: numbers in, numbers out; no I/O, no clock, no panic.
//!
//! | module | holds |
//! |---|---|
//! | [`dispersion`] | linear dispersion in water of any depth |
//! | [`spectrum`] | JONSWAP and Pierson-Moskowitz spectra, their moments |
//! | [`spreading`] | cos-2s directional spreading |
//! | [`record`] | an evenly sampled record, checked |
//! | [`crossing`] | zero-crossing analysis: waves, H_m, H_s, H_1/10, H_max, T_z, T_1/3 |
//! | [`welch`] | Welch's spectrum, H_m0, T_p, T_m01, T_m02, T_e |
//! | [`height`] | Rayleigh heights, the expected highest wave |
//! | [`interval`] | 95 % intervals of wave statistics: bootstrap by groups, spectra |
//! | [`confidence`] | confidence limits of variances |
//! | [`outlier`] | readings that cannot be, replaced by their neighbour |
//! | [`quality`] | the QARTOD tests of a record, its repair, rotor ripples |
//! | [`crests`] | crest and height distributions, the highest wave in time and in space |
//! | [`forecast`] | the sea some seconds ahead at a spot, with its errors, and its quiet moments |
//! | [`space`] | length, direction and spread of waves from a film of the surface |
//! | [`shape`] | what a spectrum says beyond moments: its scatter, peak, noise, wave systems, fits of JONSWAP and Pierson-Moskowitz |
//! | [`witness`] | a second sensor beside the elevation: lag, regression, coherence, and whether the two agree |
//! | [`filter`], [`spline`] | splitting a record by frequency; uneven samples to even ones |
//!
//! Elevation is positive up, metres; densities are one-sided, m²/Hz.
//!
//! **Invariant:** nothing here knows of patches, vehicles or messages; both the simulator and the estimators use it, and so it
//! holds theory and no simulation.

pub mod confidence;
pub mod crests;
pub mod crossing;
pub mod dispersion;
pub mod filter;
pub mod forecast;
pub mod height;
pub mod interval;
pub mod outlier;
mod plans;
pub mod quality;
pub mod record;
pub mod shape;
pub mod space;
mod special;
pub mod spectrum;
pub mod spline;
pub mod spreading;
pub mod welch;
pub mod witness;

pub use crossing::{Crossing, Wave, WaveStatistics};
pub use dispersion::{Depth, GRAVITY_MPS2};
pub use record::{Record, RecordError};
pub use spectrum::{Jonswap, PiersonMoskowitz, Spectrum, SpectrumError};
pub use spline::{Knots, Spline};
pub use spreading::CosTwoS;
pub use welch::{SampledError, SampledSpectrum, SpectralStatistics, Taper, Welch};
