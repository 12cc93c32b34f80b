//! What a service is given.

use halcyon_model::{Event, FleetId, FleetOrigin, InstanceId, MissionId, Severity, VehicleId};
use tokio_util::sync::CancellationToken;
use tracing::{error, info, warn};

use crate::bus::{Bus, Publisher};
use crate::clock::Clock;
use crate::health::HealthHandle;

/// Everything that a service's actor needs of the world.
#[derive(Clone)]
pub struct Context {
    /// The fleet.
    pub fleet: FleetId,
    /// This instance, such as `capture.leader-1`.
    pub instance: InstanceId,
    /// The origin of the fleet's local frame.
    pub origin: FleetOrigin,
    /// The bus.
    pub bus: Bus,
    /// The fleet's clock.
    pub clock: Clock,
    /// Cancelled when the process ends: finish within a few seconds.
    pub stop: CancellationToken,
    /// Say here how the service is.
    pub health: HealthHandle,
    pub(crate) events: std::sync::Arc<Publisher<Event>>,
}

impl Context {
    /// Tells the fleet that something happened, and logs it. Never fails: an event that cannot be sent is still in the log.
    pub async fn event(&self, draft: EventDraft) {
        let event = Event {
            stamp: self.clock.now(),
            source: self.instance.clone(),
            severity: draft.severity,
            what: draft.what,
            why: draft.why,
            vehicle: draft.vehicle,
            mission: draft.mission,
        };
        match event.severity {
            Severity::Info => info!(instance = %self.instance, why = event.why, "{}", event.what),
            Severity::Warning => warn!(instance = %self.instance, why = event.why, "{}", event.what),
            Severity::Critical => error!(instance = %self.instance, why = event.why, "{}", event.what),
        }
        if let Err(problem) = self.events.put(&event).await {
            warn!(instance = %self.instance, error = %problem, "an event could not be sent");
        }
    }
}

/// An event before it is stamped.
#[derive(Debug, Clone, PartialEq)]
pub struct EventDraft {
    severity: Severity,
    what: String,
    why: String,
    vehicle: Option<VehicleId>,
    mission: Option<MissionId>,
}

impl EventDraft {
    /// An event of any severity.
    pub fn new(severity: Severity, what: impl Into<String>, why: impl Into<String>) -> Self {
        Self { severity, what: what.into(), why: why.into(), vehicle: None, mission: None }
    }

    /// For the record.
    pub fn info(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self::new(Severity::Info, what, why)
    }

    /// Someone should look.
    pub fn warning(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self::new(Severity::Warning, what, why)
    }

    /// Someone must act.
    pub fn critical(what: impl Into<String>, why: impl Into<String>) -> Self {
        Self::new(Severity::Critical, what, why)
    }

    /// About this vehicle.
    #[must_use]
    pub fn vehicle(mut self, vehicle: &VehicleId) -> Self {
        self.vehicle = Some(vehicle.clone());
        self
    }

    /// About this mission.
    #[must_use]
    pub fn mission(mut self, mission: &MissionId) -> Self {
        self.mission = Some(mission.clone());
        self
    }
}
