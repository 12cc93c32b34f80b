//! What goes over HTTP: the nouns of `halcyon-model` as JSON.
//!
//! Degrees at this edge, metres and seconds; keys are `snake_case` and end in their unit; enumerations are lower-case strings;
//! stamps are RFC 3339 in UTC to the millisecond, with `age_s` beside them where freshness matters (the fleet's clock may run
//! faster than the reader's). A key that can be unknown is always present and `null` then. Numbers are never NaN.

mod command;
mod mission;
mod plan;
mod sea;
mod service;
mod stream;
mod surface;
mod transfer;
mod vehicle;

use halcyon_model::{FleetOrigin, Geodetic, LocalFrame, LocalPoint, Stamp};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

pub use command::{CommandResult, SlotOffset, VehicleCommandRequest};
pub use mission::{
    Approval, CreateMission, Mission, MissionAbilities, MissionPhase, MissionTransition, PointInput, Possibility,
};
pub use plan::{LandingClearance, Plan, PlanAssignment, PlanTask};
pub use sea::{
    Calm, CalmWindow, Directional, Estimate, QualityFlag, SeaState, Spectrum, TraceSample, Verdict, VerdictCheck, VerdictState,
};
pub use service::{Event, HealthState, Readiness, ReadinessCheck, Service, Severity};
pub use stream::{Heartbeat, Hello, StreamMessage};
pub use surface::{Preview, Series, SeriesSample, Surface, WaveHeightSample};
pub use transfer::{
    CommandId, Frame, Item, ItemList, ItemUpload, ListKind, Parameter, ParameterList, ParameterType, SetParameter,
};
pub use vehicle::{
    AccelerationNed, Activity, ActivityKind, Ages, Firmware, Fix, FixKind, LandedState, LinkQuality, LocalPosition, Position,
    Role, Vehicle, VelocityNed,
};

/// What conversion to JSON needs beside the noun itself: the fleet's local frame and the present.
#[derive(Debug, Clone, Copy)]
pub struct Edge {
    /// The fleet's local frame.
    pub frame: LocalFrame,
    /// The present on the fleet's clock.
    pub now: Stamp,
}

impl Edge {
    /// The edge of a fleet about `origin` at `now`.
    #[must_use]
    pub fn new(origin: &FleetOrigin, now: Stamp) -> Self {
        Self { frame: origin.frame(), now }
    }

    /// Seconds since `stamp`; negative when it lies ahead.
    #[must_use]
    pub fn age_s(&self, stamp: Stamp) -> f64 {
        self.now.seconds_since(stamp)
    }

    /// A place on the mean water, both globally and locally.
    #[must_use]
    pub fn point(&self, point: LocalPoint) -> Point {
        let global = self.frame.geodetic_from_ned(point.vector().push(0.0));
        Point {
            latitude_deg: global.latitude_deg(),
            longitude_deg: global.longitude_deg(),
            north_m: point.north_m,
            east_m: point.east_m,
        }
    }
}

/// RFC 3339 in UTC, to the millisecond.
#[must_use]
pub fn rfc3339(stamp: Stamp) -> String {
    // Every i64 of nanoseconds lies in the years 1677 to 2262, which jiff can hold.
    let time = jiff::Timestamp::from_nanosecond(i128::from(stamp.as_nanos())).unwrap_or_default();
    format!("{time:.3}")
}

/// A place on the mean water, both globally (WGS-84) and in the fleet's local frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Point {
    /// Latitude, degrees, positive north.
    pub latitude_deg: f64,
    /// Longitude, degrees, positive east.
    pub longitude_deg: f64,
    /// Metres north of the fleet's origin.
    pub north_m: f64,
    /// Metres east of the fleet's origin.
    pub east_m: f64,
}

/// A WGS-84 position with its altitude.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Global {
    /// Latitude, degrees, positive north.
    pub latitude_deg: f64,
    /// Longitude, degrees, positive east.
    pub longitude_deg: f64,
    /// Altitude above mean sea level, metres.
    pub altitude_m: f64,
}

impl From<Geodetic> for Global {
    fn from(position: Geodetic) -> Self {
        Self { latitude_deg: position.latitude_deg(), longitude_deg: position.longitude_deg(), altitude_m: position.altitude_m }
    }
}

/// A page of a list.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Page<T> {
    /// The items, in the list's order.
    pub items: Vec<T>,
    /// Give this as `after` to get the next page; `null` on the last one.
    #[schema(required = true)]
    pub next: Option<String>,
}

/// Why a request failed (RFC 9457, `application/problem+json`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Problem {
    /// Which kind of problem, as a stable URI: `urn:halcyon:problem:` and a word.
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind in words.
    pub title: String,
    /// The HTTP status code.
    pub status: u16,
    /// What went wrong this time, for people.
    pub detail: String,
    /// The path that was asked for.
    pub instance: String,
}
