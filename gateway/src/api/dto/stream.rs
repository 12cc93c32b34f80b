//! Messages of the live stream.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Event, Global, Mission, Plan, SeaState, Service, Vehicle};

/// The first message of a stream, and again after a client fell so far behind that it must start anew. A full snapshot follows,
/// so whatever came before may be forgotten.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Hello {
    /// Version of this API.
    pub api: String,
    /// Version of the program.
    pub version: String,
    /// The fleet.
    pub fleet: String,
    /// Origin of the fleet's local frame; its altitude is the mean water level.
    pub origin: Global,
    /// The present on the fleet's clock.
    pub now: String,
    /// Fleet time that passes in one second of wall time; 1 outside simulation.
    pub speed: f64,
}

/// Sent every second, so that a client can tell a quiet fleet from a dead connection, and knows the fleet's clock.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Heartbeat {
    /// The present on the fleet's clock.
    pub now: String,
}

/// One message of the live stream. After `hello` comes one message for everything known, then one for whatever changes: the whole
/// new value, at most ten a second for one vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "type", content = "data", rename_all = "snake_case")]
pub enum StreamMessage {
    /// A snapshot follows.
    Hello(Hello),
    /// Still here.
    Heartbeat(Heartbeat),
    /// A vehicle's state.
    Vehicle(Vehicle),
    /// A sea state.
    SeaState(Box<SeaState>),
    /// A mission.
    Mission(Mission),
    /// The plan.
    Plan(Plan),
    /// A service's health.
    Service(Service),
    /// An event. The snapshot holds the newest ones, oldest first; `sequence` tells repeats.
    Event(Event),
}
