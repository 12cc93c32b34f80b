//! What the whole fleet agrees on before anything flies.

use crate::geo::{Geodetic, LocalFrame};

/// The origin of the fleet's local frame: its altitude is the mean water level. Every host of a fleet is configured with the
/// same one; local positions on the bus mean nothing without it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FleetOrigin(pub Geodetic);

impl FleetOrigin {
    /// The local frame about this origin.
    #[must_use]
    pub fn frame(&self) -> LocalFrame {
        LocalFrame::new(self.0)
    }
}
