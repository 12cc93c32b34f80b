//! What the API needs of the bus, as ports, so that tests can answer in its place.

use std::time::Duration;

use futures::future::BoxFuture;
use halcyon_model::{CommandReply, MissionCommand, RigId, VehicleCommand};

/// Why a command got no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CommandFailure {
    /// Nobody serves it now; it was not carried out.
    #[error("nobody answers")]
    Nobody,
    /// No answer in time; whether it was carried out is not known.
    #[error("no answer within {0:?}")]
    Timeout(Duration),
    /// The bus failed.
    #[error("{0}")]
    Bus(String),
}

/// The command plane.
pub trait Commands: Send + Sync + 'static {
    /// Asks the mission planner; answered or failed within `timeout`.
    fn mission(&self, command: MissionCommand, timeout: Duration) -> BoxFuture<'_, Result<CommandReply, CommandFailure>>;

    /// Asks a vehicle; answered or failed within `timeout`.
    fn vehicle(&self, command: VehicleCommand, timeout: Duration) -> BoxFuture<'_, Result<CommandReply, CommandFailure>>;
}

/// Pictures on demand.
pub trait Previews: Send + Sync + 'static {
    /// Says that someone looks at `rig`: its pictures flow into the store from now on, and stop some seconds after the last call.
    fn want(&self, rig: &RigId);
}
