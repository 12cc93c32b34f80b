//! What can go wrong with a simulated vehicle.

use halcyon_model::VehicleId;
use serde::{Deserialize, Serialize};

/// A fault of one vehicle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// The receiver loses its fix.
    GnssLoss,
    /// The battery drops to this fraction of its charge, at once and for good.
    Battery {
        /// 0 to 1.
        fraction: f64,
    },
    /// The MAVLink link is cut: nothing gets through either way, connections stay.
    LinkDrop,
    /// The motors stop for good.
    MotorStop,
}

/// A fault that strikes by itself (`[[sim.faults]]`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScheduledFault {
    /// Which vehicle.
    #[serde(with = "crate::config::id_text")]
    pub vehicle: VehicleId,
    /// What.
    pub kind: Fault,
    /// When, seconds after the vehicle's power-up, at least 0.
    pub at_s: f64,
    /// For how long, seconds; without it for good. Means nothing to a fault that is for good anyway.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
}

impl ScheduledFault {
    /// Checks every number.
    ///
    /// # Errors
    /// One line that names the key and its range.
    pub fn validate(&self) -> Result<(), String> {
        use crate::config::range;
        range("faults at_s", self.at_s, 0.0, 1e7)?;
        if let Some(duration_s) = self.duration_s {
            range("faults duration_s", duration_s, 0.0, 1e7)?;
        }
        match self.kind {
            Fault::Battery { fraction } => range("faults battery fraction", fraction, 0.0, 1.0),
            Fault::GnssLoss | Fault::LinkDrop | Fault::MotorStop => Ok(()),
        }
    }
}
