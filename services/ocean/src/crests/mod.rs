//! How high crests and waves get: distributions, the highest of many, the highest in space and time, and observations against them.
//!
//! The comparison that the thesis asks for (8.2.2). Theory comes in two kinds. *Crests* (η above the mean level): [`Rayleigh`] for a linear
//! sea, [`Tayfun`] with second-order bound waves, [`forristall_2000`] fitted to second-order simulations, [`Rice`] for all maxima of a broad
//! linear sea. *Heights* (crest to trough): [`Rayleigh`] for a narrow band (Longuet-Higgins 1952), corrected for its width
//! ([`Rayleigh::heights_of_width`], Longuet-Higgins 1980), [`Boccotti`] for any band, [`forristall_1978`] fitted to storms.
//!
//! | module | holds |
//! |---|---|
//! | [`sea`] | widths, steepness and shallowness from spectral moments; ψ* from the autocovariance |
//! | [`distribution`] | the distributions |
//! | [`maximum`] | the highest of N waves, or of a duration, with its interval |
//! | [`space_time`] | the highest crest over an area and a time |
//! | [`observed`] | exceedance points and goodness of fit |

pub mod distribution;
pub mod maximum;
pub mod observed;
pub mod sea;
pub mod space_time;

pub use distribution::{Boccotti, Exceedance, Rayleigh, Rice, Spread, Tayfun, Weibull, forristall_1978, forristall_2000};
pub use maximum::{Extreme, highest, waves_in};
pub use observed::{Comparison, ExceedancePoint, compare};
pub use sea::{NarrowBand, SeaMoments};
pub use space_time::{Region, SpaceTime, WaveComponent};
