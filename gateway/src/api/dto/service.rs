//! Services and events as JSON.

use halcyon_model as model;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Edge, rfc3339};

/// How a service is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum HealthState {
    /// Not yet working.
    Starting,
    /// Working.
    Ready,
    /// Working, but not as it should.
    Degraded,
    /// Between a failure and the next restart.
    Restarting,
}

impl From<model::HealthState> for HealthState {
    fn from(state: model::HealthState) -> Self {
        match state {
            model::HealthState::Starting => Self::Starting,
            model::HealthState::Ready => Self::Ready,
            model::HealthState::Degraded => Self::Degraded,
            model::HealthState::Restarting => Self::Restarting,
        }
    }
}

/// A service's health, as it last said.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Service {
    /// Which instance, such as `capture.leader-1`.
    pub instance: String,
    /// Which service, such as `capture`.
    pub service: String,
    /// How it is.
    pub state: HealthState,
    /// For people.
    pub detail: String,
    /// Restarts since the process started.
    pub restarts: u32,
    /// Seconds since the last start.
    pub uptime_s: f64,
    /// Version of the program.
    pub version: String,
    /// When it said so.
    pub stamp: String,
    /// Seconds since then when this was sent.
    pub age_s: f64,
    /// Silent for longer than allowed: take it for dead.
    pub stale: bool,
}

impl Service {
    /// From the model; `stale` is the store's judgement.
    #[must_use]
    pub fn new(health: &model::Health, stale: bool, edge: &Edge) -> Self {
        Self {
            instance: health.instance.to_string(),
            service: health.service.clone(),
            state: health.state.into(),
            detail: health.detail.clone(),
            restarts: health.restarts,
            uptime_s: health.uptime_s,
            version: health.version.clone(),
            stamp: rfc3339(health.stamp),
            age_s: edge.age_s(health.stamp),
            stale,
        }
    }
}

/// How much an event matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// For the record.
    Info,
    /// Someone should look.
    Warning,
    /// Someone must act.
    Critical,
}

impl From<model::Severity> for Severity {
    fn from(severity: model::Severity) -> Self {
        match severity {
            model::Severity::Info => Self::Info,
            model::Severity::Warning => Self::Warning,
            model::Severity::Critical => Self::Critical,
        }
    }
}

/// Something happened: who, what, why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Event {
    /// Counts the events that this gateway has heard; the cursor of the event list.
    pub sequence: u64,
    /// When.
    pub stamp: String,
    /// Who says so.
    pub source: String,
    /// How much it matters.
    pub severity: Severity,
    /// What happened, in a few words.
    pub what: String,
    /// Why.
    pub why: String,
    /// The vehicle concerned.
    #[schema(required = true)]
    pub vehicle: Option<String>,
    /// The mission concerned.
    #[schema(required = true)]
    pub mission: Option<String>,
}

impl Event {
    /// From the model and its number in the store.
    #[must_use]
    pub fn new(sequence: u64, event: &model::Event) -> Self {
        Self {
            sequence,
            stamp: rfc3339(event.stamp),
            source: event.source.to_string(),
            severity: event.severity.into(),
            what: event.what.clone(),
            why: event.why.clone(),
            vehicle: event.vehicle.as_ref().map(ToString::to_string),
            mission: event.mission.as_ref().map(ToString::to_string),
        }
    }
}

/// One condition of readiness.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ReadinessCheck {
    /// Stable name.
    pub check: String,
    /// Whether it holds.
    pub passed: bool,
    /// For people.
    pub text: String,
}

/// Whether the gateway can do its work.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Readiness {
    /// Every check passed.
    pub ready: bool,
    /// The checks.
    pub checks: Vec<ReadinessCheck>,
}
