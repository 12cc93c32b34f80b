//! Missions as JSON.

use halcyon_model as model;
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::ToSchema;

use super::{Edge, Estimate, Point, VerdictState, rfc3339};
use crate::core::can;

/// Who may say that a follower goes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Approval {
    /// A person, by the approve command.
    #[default]
    Manual,
    /// The verdict alone.
    Automatic,
}

impl From<model::Approval> for Approval {
    fn from(approval: model::Approval) -> Self {
        match approval {
            model::Approval::Manual => Self::Manual,
            model::Approval::Automatic => Self::Automatic,
        }
    }
}

impl From<Approval> for model::Approval {
    fn from(approval: Approval) -> Self {
        match approval {
            Approval::Manual => Self::Manual,
            Approval::Automatic => Self::Automatic,
        }
    }
}

/// Where a mission is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum MissionPhase {
    /// Waiting for a leader that is ready.
    Waiting,
    /// The leader flies to the point.
    Transit,
    /// The leader holds over the water and measures.
    Assessing,
    /// The verdict is safe; a person must approve.
    AwaitingApproval,
    /// Approved; waiting for the dispatch command or for a follower.
    Approved,
    /// The follower takes off and joins the leader's slot.
    Joining,
    /// The leader clears the spot, the follower beside it.
    Clearing,
    /// The follower approaches, descends and lands.
    Landing,
    /// The follower has landed, and lets its payload go; or a person must choose, since it didn't.
    Releasing,
    /// Paused by a person: all hold.
    Paused,
    /// The follower landed.
    Completed,
    /// Aborted: all return.
    Aborted,
    /// Could not go on.
    Failed,
}

impl From<model::MissionPhase> for MissionPhase {
    fn from(phase: model::MissionPhase) -> Self {
        match phase {
            model::MissionPhase::Waiting => Self::Waiting,
            model::MissionPhase::Transit => Self::Transit,
            model::MissionPhase::Assessing => Self::Assessing,
            model::MissionPhase::AwaitingApproval => Self::AwaitingApproval,
            model::MissionPhase::Approved => Self::Approved,
            model::MissionPhase::Joining => Self::Joining,
            model::MissionPhase::Clearing => Self::Clearing,
            model::MissionPhase::Landing => Self::Landing,
            model::MissionPhase::Releasing => Self::Releasing,
            model::MissionPhase::Paused => Self::Paused,
            model::MissionPhase::Completed => Self::Completed,
            model::MissionPhase::Aborted => Self::Aborted,
            model::MissionPhase::Failed => Self::Failed,
        }
    }
}

/// One step of a mission: what changed, who did it, and why.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MissionTransition {
    /// When.
    pub stamp: String,
    /// Into which phase.
    pub phase: MissionPhase,
    /// `planner`, or the person or client who commanded it.
    pub who: String,
    /// Why.
    pub why: String,
}

impl From<&model::Transition> for MissionTransition {
    fn from(transition: &model::Transition) -> Self {
        Self {
            stamp: rfc3339(transition.stamp),
            phase: transition.phase.into(),
            who: transition.who.clone(),
            why: transition.why.clone(),
        }
    }
}

/// Whether something can be done now, and if not, why not.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct Possibility {
    /// Whether it can be done.
    pub allowed: bool,
    /// Why not; empty when it can.
    pub why: String,
}

impl From<Result<(), String>> for Possibility {
    fn from(verdict: Result<(), String>) -> Self {
        Self { allowed: verdict.is_ok(), why: verdict.err().unwrap_or_default() }
    }
}

/// What can be done with a mission now. The planner has the last word.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
pub struct MissionAbilities {
    /// Say that the follower may go.
    pub approve: Possibility,
    /// Send the follower.
    pub dispatch: Possibility,
    /// Let everyone hold.
    pub pause: Possibility,
    /// Go on.
    pub resume: Possibility,
    /// Let everyone return.
    pub abort: Possibility,
    /// Try once more to let the payload go.
    pub release: Possibility,
    /// Complete the mission though the payload was not let go.
    pub skip_release: Possibility,
}

/// A mission: survey one point, assess it, send one follower to land there.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Mission {
    /// Which.
    pub id: String,
    /// For people.
    pub name: String,
    /// When it last changed.
    pub stamp: String,
    /// Seconds since then when this was sent.
    pub age_s: f64,
    /// Where to look and to land.
    pub point: Point,
    /// Height of the survey above mean water, metres.
    pub survey_height_m: f64,
    /// Who approves.
    pub approval: Approval,
    /// Whether approval dispatches at once.
    pub dispatch_on_approval: bool,
    /// Where it is.
    pub phase: MissionPhase,
    /// The leader in use, or the one asked for.
    #[schema(required = true)]
    pub leader: Option<String>,
    /// The follower in use, or the one asked for.
    #[schema(required = true)]
    pub follower: Option<String>,
    /// The newest verdict on the spot.
    #[schema(required = true)]
    pub verdict: Option<VerdictState>,
    /// The significant height on which the dispatch was decided, metres.
    #[schema(required = true)]
    pub h_s_m: Option<Estimate>,
    /// Where the follower came down, by its own position.
    #[schema(required = true)]
    pub touchdown: Option<Point>,
    /// Distance of that from the point, metres.
    #[schema(required = true)]
    pub touchdown_error_m: Option<f64>,
    /// Why the payload was not let go, if it was to be.
    #[schema(required = true)]
    pub release_problem: Option<String>,
    /// Every transition, oldest first.
    pub history: Vec<MissionTransition>,
    /// What can be done now.
    pub can: MissionAbilities,
}

impl Mission {
    /// From the model.
    #[must_use]
    pub fn new(mission: &model::Mission, edge: &Edge) -> Self {
        let spec = &mission.spec;
        let id_text = |used: &Option<model::VehicleId>, asked: &Option<model::VehicleId>| {
            used.as_ref().or(asked.as_ref()).map(ToString::to_string)
        };
        Self {
            id: mission.id.to_string(),
            name: spec.name.clone(),
            stamp: rfc3339(mission.stamp),
            age_s: edge.age_s(mission.stamp),
            point: edge.point(spec.point),
            survey_height_m: spec.survey_height_m,
            approval: spec.approval.into(),
            dispatch_on_approval: spec.dispatch_on_approval,
            phase: mission.phase.into(),
            leader: id_text(&mission.leader, &spec.leader),
            follower: id_text(&mission.follower, &spec.follower),
            verdict: mission.verdict.map(Into::into),
            h_s_m: mission.h_s_m.map(Into::into),
            touchdown: mission.touchdown.map(|point| edge.point(point)),
            touchdown_error_m: mission.touchdown.map(|point| point.distance_m(&spec.point)),
            release_problem: mission.release_problem.clone(),
            history: mission.history.iter().map(Into::into).collect(),
            can: MissionAbilities {
                approve: can::approve(mission).into(),
                dispatch: can::dispatch(mission).into(),
                pause: can::pause(mission).into(),
                resume: can::resume(mission).into(),
                abort: can::abort(mission).into(),
                release: can::release(mission).into(),
                skip_release: can::release(mission).into(),
            },
        }
    }
}

/// A place: either globally or in the fleet's local frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum PointInput {
    /// By WGS-84 latitude and longitude.
    Global {
        /// Latitude, degrees, positive north.
        #[schema(minimum = -90, maximum = 90)]
        latitude_deg: f64,
        /// Longitude, degrees, positive east.
        #[schema(minimum = -180, maximum = 180)]
        longitude_deg: f64,
    },
    /// By metres from the fleet's origin.
    Local {
        /// Metres north of the fleet's origin.
        #[schema(minimum = -100_000, maximum = 100_000)]
        north_m: f64,
        /// Metres east of the fleet's origin.
        #[schema(minimum = -100_000, maximum = 100_000)]
        east_m: f64,
    },
}

impl<'de> Deserialize<'de> for PointInput {
    /// By hand, since serde's own untagged enumeration cannot say which key was wrong.
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct Keys {
            latitude_deg: Option<f64>,
            longitude_deg: Option<f64>,
            north_m: Option<f64>,
            east_m: Option<f64>,
        }
        match Keys::deserialize(deserializer)? {
            Keys { latitude_deg: Some(latitude_deg), longitude_deg: Some(longitude_deg), north_m: None, east_m: None } => {
                Ok(Self::Global { latitude_deg, longitude_deg })
            }
            Keys { latitude_deg: None, longitude_deg: None, north_m: Some(north_m), east_m: Some(east_m) } => {
                Ok(Self::Local { north_m, east_m })
            }
            _ => Err(serde::de::Error::custom("a point has latitude_deg and longitude_deg, or north_m and east_m")),
        }
    }
}

/// A new mission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct CreateMission {
    /// Where to look and to land.
    pub point: PointInput,
    /// For people; the identifier if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(max_length = 200)]
    pub name: Option<String>,
    /// A name of the client's choice; made up if left out. Creating the same mission again under the same one changes nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(pattern = "^[A-Za-z0-9._-]{1,64}$")]
    pub id: Option<String>,
    /// Height of the survey above mean water, metres; 5 if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0, maximum = 1000)]
    pub survey_height_m: Option<f64>,
    /// Who approves; a person if left out.
    #[serde(default)]
    pub approval: Approval,
    /// Whether approval dispatches at once; it does if left out.
    #[serde(default = "yes")]
    pub dispatch_on_approval: bool,
    /// The leader to use; the planner chooses if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(pattern = "^[A-Za-z0-9._-]{1,64}$")]
    pub leader: Option<String>,
    /// The follower to use; the planner chooses if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(pattern = "^[A-Za-z0-9._-]{1,64}$")]
    pub follower: Option<String>,
}

/// Serde needs a function for a default of `true`.
fn yes() -> bool {
    true
}
