//! What services say about themselves.

use crate::id::{InstanceId, MissionId, VehicleId};
use crate::time::Stamp;

/// How a service is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum HealthState {
    /// Not yet working.
    Starting,
    /// Working.
    Ready,
    /// Working, but not as it should; the detail says what.
    Degraded,
    /// Between a failure and the next restart.
    Restarting,
}

/// A service's health; published every second, and on change.
#[derive(Debug, Clone, PartialEq)]
pub struct Health {
    /// When.
    pub stamp: Stamp,
    /// Which instance.
    pub instance: InstanceId,
    /// Which service, such as `capture`.
    pub service: String,
    /// How it is.
    pub state: HealthState,
    /// For people.
    pub detail: String,
    /// Restarts since the process started.
    pub restarts: u32,
    /// Time since the last start, seconds.
    pub uptime_s: f64,
    /// Version of the program.
    pub version: String,
}

/// How much an event matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Severity {
    /// For the record.
    Info,
    /// Someone should look.
    Warning,
    /// Someone must act.
    Critical,
}

/// Something happened: who, what, why.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// When.
    pub stamp: Stamp,
    /// Who says so.
    pub source: InstanceId,
    /// How much it matters.
    pub severity: Severity,
    /// What happened, in a few words.
    pub what: String,
    /// Why.
    pub why: String,
    /// The vehicle concerned.
    pub vehicle: Option<VehicleId>,
    /// The mission concerned.
    pub mission: Option<MissionId>,
}
