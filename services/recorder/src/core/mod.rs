//! The pure part: what a key is, and MCAP onto any sink. No bus, no clock, no file.

pub mod keys;
mod reading;
mod recording;

pub use reading::{ReadError, Reading, Recorded};
pub use recording::{RecordError, Recording, Sample};
