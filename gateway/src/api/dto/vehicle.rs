//! Vehicles as JSON.

use halcyon_model as model;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Edge, Global, Point, rfc3339};

/// What a vehicle is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Role {
    /// Carries the cameras.
    Leader,
    /// Carries the payload.
    Follower,
}

impl From<model::Role> for Role {
    fn from(role: model::Role) -> Self {
        match role {
            model::Role::Leader => Self::Leader,
            model::Role::Follower => Self::Follower,
        }
    }
}

/// Where the autopilot believes that the vehicle is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LandedState {
    /// Not known.
    Unknown,
    /// On the ground or the water.
    OnGround,
    /// Leaving it.
    TakingOff,
    /// Flying.
    InAir,
    /// Coming down.
    Landing,
}

impl From<model::LandedState> for LandedState {
    fn from(state: model::LandedState) -> Self {
        match state {
            model::LandedState::Unknown => Self::Unknown,
            model::LandedState::OnGround => Self::OnGround,
            model::LandedState::TakingOff => Self::TakingOff,
            model::LandedState::InAir => Self::InAir,
            model::LandedState::Landing => Self::Landing,
        }
    }
}

/// Kind of GNSS fix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FixKind {
    /// No receiver.
    NoGps,
    /// A receiver without a fix.
    NoFix,
    /// Two-dimensional.
    #[serde(rename = "2d")]
    TwoD,
    /// Three-dimensional.
    #[serde(rename = "3d")]
    ThreeD,
    /// Differential.
    Dgps,
    /// RTK, ambiguities not resolved.
    RtkFloat,
    /// RTK, ambiguities resolved.
    RtkFixed,
    /// Another kind.
    Other,
}

/// GNSS quality.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Fix {
    /// Kind of fix.
    pub kind: FixKind,
    /// Satellites in use.
    pub satellites: u32,
    /// Horizontal standard deviation as the receiver states it, metres.
    #[schema(required = true)]
    pub horizontal_sigma_m: Option<f64>,
}

impl From<model::Fix> for Fix {
    fn from(fix: model::Fix) -> Self {
        let kind = match fix.kind {
            0 => FixKind::NoGps,
            1 => FixKind::NoFix,
            2 => FixKind::TwoD,
            3 => FixKind::ThreeD,
            4 => FixKind::Dgps,
            5 => FixKind::RtkFloat,
            6 => FixKind::RtkFixed,
            _ => FixKind::Other,
        };
        Self { kind, satellites: fix.satellites, horizontal_sigma_m: fix.horizontal_sigma_m }
    }
}

/// What the on-board guidance is doing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ActivityKind {
    /// No task.
    Idle,
    /// On the ground, waiting to be ready or for a plan.
    Preparing,
    /// Climbing to the safe height.
    TakingOff,
    /// Flying to a place.
    Transit,
    /// Holding a place.
    Holding,
    /// Keeping a slot beside a leader.
    Following,
    /// Over the landing place at the safe height.
    Approaching,
    /// Going down, cleared.
    Descending,
    /// On the water or the ground after a task.
    Landed,
    /// Flying home.
    Returning,
    /// A fail-safe is in charge.
    FailSafe,
    /// The pilot has the vehicle.
    PilotControl,
}

/// What the on-board guidance is doing, with what belongs to it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Activity {
    /// Which activity.
    pub kind: ActivityKind,
    /// Holding or following: settled there; otherwise `null`.
    #[schema(required = true)]
    pub settled: Option<bool>,
    /// Following: distance from the slot, metres; otherwise `null`.
    #[schema(required = true)]
    pub slot_error_m: Option<f64>,
    /// Fail-safe: which and why; otherwise `null`.
    #[schema(required = true)]
    pub reason: Option<String>,
}

impl From<&model::Activity> for Activity {
    fn from(activity: &model::Activity) -> Self {
        use model::Activity as From;
        let mut json = Self { kind: ActivityKind::Idle, settled: None, slot_error_m: None, reason: None };
        json.kind = match activity {
            From::Idle => ActivityKind::Idle,
            From::Preparing => ActivityKind::Preparing,
            From::TakingOff => ActivityKind::TakingOff,
            From::Transit => ActivityKind::Transit,
            From::Holding { settled } => {
                json.settled = Some(*settled);
                ActivityKind::Holding
            }
            From::Following { settled, slot_error_m } => {
                json.settled = Some(*settled);
                json.slot_error_m = Some(*slot_error_m);
                ActivityKind::Following
            }
            From::Approaching => ActivityKind::Approaching,
            From::Descending => ActivityKind::Descending,
            From::Landed => ActivityKind::Landed,
            From::Returning => ActivityKind::Returning,
            From::FailSafe { reason } => {
                json.reason = Some(reason.clone());
                ActivityKind::FailSafe
            }
            From::PilotControl => {
                json.reason = Some("not flown by Halcyon: set GUIDED to hand it back, which may start its motors".into());
                ActivityKind::PilotControl
            }
        };
        json
    }
}

/// A WGS-84 position with its altitude above mean sea level.
pub type Position = Global;

/// A position in the fleet's local frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LocalPosition {
    /// Metres north of the fleet's origin.
    pub north_m: f64,
    /// Metres east of the fleet's origin.
    pub east_m: f64,
    /// Metres above the mean water level.
    pub height_m: f64,
}

/// Velocity over ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct VelocityNed {
    /// Metres per second northwards.
    pub north_mps: f64,
    /// Metres per second eastwards.
    pub east_mps: f64,
    /// Metres per second downwards.
    pub down_mps: f64,
}

/// The link between a vehicle's computer and its autopilot.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LinkQuality {
    /// Share of the autopilot's messages lost lately, percent.
    pub loss_percent: f64,
    /// There and back, milliseconds; `null` if not measured.
    #[schema(required = true)]
    pub round_trip_ms: Option<f64>,
    /// Messages since the link was opened.
    pub received: u64,
    /// They are signed with the fleet's key.
    pub signed: bool,
}

impl From<model::LinkQuality> for LinkQuality {
    fn from(link: model::LinkQuality) -> Self {
        Self {
            loss_percent: 100.0 * link.loss,
            round_trip_ms: link.round_trip_s.map(|round_trip_s| 1000.0 * round_trip_s),
            received: link.received,
            signed: link.is_signed,
        }
    }
}

/// What flies a vehicle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Firmware {
    /// Such as `ArduPilot`.
    pub autopilot: String,
    /// Such as `quadrotor`.
    pub vehicle: String,
    /// Such as `4.6.0`; empty if it does not say.
    pub version: String,
}

impl From<&model::Firmware> for Firmware {
    fn from(firmware: &model::Firmware) -> Self {
        let model::Firmware { autopilot, vehicle, version } = firmware.clone();
        Self { autopilot, vehicle, version }
    }
}

/// Seconds since each part of the state was heard when it was sent; `null` if never.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Ages {
    /// Flight mode.
    #[schema(required = true)]
    pub mode_s: Option<f64>,
    /// Attitude.
    #[schema(required = true)]
    pub attitude_s: Option<f64>,
    /// Landed or not.
    #[schema(required = true)]
    pub landed_s: Option<f64>,
    /// Battery.
    #[schema(required = true)]
    pub battery_s: Option<f64>,
    /// GNSS.
    #[schema(required = true)]
    pub fix_s: Option<f64>,
    /// The estimator's health.
    #[schema(required = true)]
    pub estimator_s: Option<f64>,
    /// Home.
    #[schema(required = true)]
    pub home_s: Option<f64>,
}

impl From<model::Ages> for Ages {
    fn from(ages: model::Ages) -> Self {
        let model::Ages { mode_s, attitude_s, landed_s, battery_s, fix_s, estimator_s, home_s } = ages;
        Self { mode_s, attitude_s, landed_s, battery_s, fix_s, estimator_s, home_s }
    }
}

/// Acceleration without gravity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AccelerationNed {
    /// Metres per second squared northwards.
    pub north_mps2: f64,
    /// Metres per second squared eastwards.
    pub east_mps2: f64,
    /// Metres per second squared downwards.
    pub down_mps2: f64,
}

/// A vehicle, as it last said.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Vehicle {
    /// Which.
    pub id: String,
    /// What it is for.
    pub role: Role,
    /// When the position was measured.
    pub stamp: String,
    /// Seconds since then when this was sent.
    pub age_s: f64,
    /// Silent for longer than allowed: everything here is history.
    pub stale: bool,
    /// Global position.
    pub position: Position,
    /// Position in the fleet's local frame.
    pub local: LocalPosition,
    /// Velocity over ground.
    pub velocity: VelocityNed,
    /// Heading, degrees clockwise from true north, 0 to 360.
    pub heading_deg: f64,
    /// Roll, degrees, right side down positive.
    pub roll_deg: f64,
    /// Pitch, degrees, nose up positive.
    pub pitch_deg: f64,
    /// Flight mode in ArduCopter's words, such as `GUIDED`; `MODE_` and its number where it has no name here.
    pub mode: String,
    /// Motors armed.
    pub armed: bool,
    /// On the ground or in the air.
    pub landed: LandedState,
    /// Remaining battery, percent; `null` if not measured.
    #[schema(required = true)]
    pub battery_percent: Option<f64>,
    /// Battery voltage; `null` if not measured.
    #[schema(required = true)]
    pub battery_v: Option<f64>,
    /// GNSS quality; `null` if never heard.
    #[schema(required = true)]
    pub fix: Option<Fix>,
    /// The estimator's position is good enough to fly by.
    pub estimator_ok: bool,
    /// The autopilot would let it arm.
    pub ready_to_arm: bool,
    /// Seconds since the autopilot booted.
    pub boot_s: f64,
    /// What the guidance is doing.
    pub activity: Activity,
    /// Generation of the newest plan it has accepted; 0 before any.
    pub plan_generation: u64,
    /// Home, if the autopilot has one.
    #[schema(required = true)]
    pub home: Option<Position>,
    /// Where it touched down for its last landing task, by its own position.
    #[schema(required = true)]
    pub touchdown: Option<Point>,
    /// Acceleration; `null` if not measured.
    #[schema(required = true)]
    pub acceleration: Option<AccelerationNed>,
    /// Downward rangefinder, metres along the body's down axis; `null` without one, or out of its range.
    #[schema(required = true)]
    pub range_m: Option<f64>,
    /// How old each part of this is.
    pub ages: Ages,
    /// The link to the autopilot; `null` until something was heard.
    #[schema(required = true)]
    pub link: Option<LinkQuality>,
    /// What flies it; `null` until it says.
    #[schema(required = true)]
    pub firmware: Option<Firmware>,
    /// It carries something that it can let go.
    pub has_payload: bool,
}

impl Vehicle {
    /// From the model; `stale` is the store's judgement.
    #[must_use]
    pub fn new(state: &model::VehicleState, stale: bool, edge: &Edge) -> Self {
        let (roll_rad, pitch_rad, _) = state.ned_from_body.euler_angles();
        let (position_ned_m, velocity_ned_mps) = (state.position_ned_m, state.velocity_ned_mps);
        Self {
            id: state.vehicle.to_string(),
            role: state.role.into(),
            stamp: rfc3339(state.stamp),
            age_s: edge.age_s(state.stamp),
            stale,
            position: state.position.into(),
            local: LocalPosition { north_m: position_ned_m.x, east_m: position_ned_m.y, height_m: -position_ned_m.z },
            velocity: VelocityNed { north_mps: velocity_ned_mps.x, east_mps: velocity_ned_mps.y, down_mps: velocity_ned_mps.z },
            heading_deg: state.heading_rad.to_degrees().rem_euclid(360.0),
            roll_deg: roll_rad.to_degrees(),
            pitch_deg: pitch_rad.to_degrees(),
            mode: state.mode.name().map_or_else(|| format!("MODE_{}", state.mode.copter_number()), Into::into),
            armed: state.armed,
            landed: state.landed.into(),
            battery_percent: state.battery_fraction.map(|fraction| fraction * 100.0),
            battery_v: state.battery_v,
            fix: state.fix.map(Into::into),
            estimator_ok: state.estimator_ok,
            ready_to_arm: state.ready_to_arm,
            boot_s: state.boot_s,
            activity: (&state.activity).into(),
            plan_generation: state.plan_generation,
            home: state.home.map(Into::into),
            touchdown: state.touchdown.map(|point| edge.point(point)),
            acceleration: state.acceleration_ned_mps2.map(|acceleration| AccelerationNed {
                north_mps2: acceleration.x,
                east_mps2: acceleration.y,
                down_mps2: acceleration.z,
            }),
            range_m: state.range.map(|range| range.distance_m),
            ages: state.ages.into(),
            link: state.link.map(Into::into),
            firmware: state.firmware.as_ref().map(Into::into),
            has_payload: state.has_payload,
        }
    }
}
