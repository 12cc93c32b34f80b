//! The domain: patches in, sea states out.
//!
//! | noun | is |
//! |---|---|
//! | gauge | a spot of water, fixed in the local frame, whose elevation is read from every patch that covers it |
//! | frame | what is kept of one patch: the gauges' readings, slope, level, coverage |
//! | window | the frames of the last while over the same spot |
//! | series | one gauge's elevation over the window, broken where patches are missing |
//! | film | the window's grids over one piece of water, for directions |
//! | glance | a look around, apart from the patches: directions, quiet moments, rotors' ripples, the witness |
//! | witness | the rig's rangefinder, which has to see the same waves |
//! | ripples | rings that the vehicle's own rotors press into the water: no waves of the sea |
//! | hidden part | waves longer than the footprint: a patch's own mean level takes them out of its grid |
//!
//! Nothing here knows the bus, the disk or a clock: `now` is an argument.

mod ahead;
mod around;
mod assessor;
mod correlation;
mod direction;
mod film;
mod gauge;
mod hidden;
mod moments;
#[cfg(test)]
mod oracle;
mod patch;
mod quality;
mod records;
mod ripples;
mod sampling;
mod series;
mod smooth;
mod spectrum;
mod statistics;
#[cfg(test)]
mod synthetic;
mod verdict;
mod window;
mod witness;

pub use around::{Around, Glance};
pub use assessor::Assessor;
pub use patch::PatchError;
pub(crate) use quality::limits as quality_limits;
pub(crate) use statistics::Statistics;
pub(crate) use verdict::{Evidence, Judgement, judge};
