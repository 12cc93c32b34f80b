//! Missions as the planner keeps them and everyone else sees them.

use crate::geo::LocalPoint;
use crate::id::{MissionId, VehicleId};
use crate::sea::{Estimate, VerdictState};
use crate::time::Stamp;

/// Who may say that a follower goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Approval {
    /// A person, by the approve command.
    Manual,
    /// The verdict alone.
    Automatic,
}

/// What a mission is to do: survey one point, assess it, dispatch one follower to land there.
#[derive(Debug, Clone, PartialEq)]
pub struct MissionSpec {
    /// For people.
    pub name: String,
    /// Where to look and to land.
    pub point: LocalPoint,
    /// Height of the survey above mean water, metres.
    pub survey_height_m: f64,
    /// Who approves.
    pub approval: Approval,
    /// Whether approval dispatches at once; if not, a dispatch command is needed as well.
    pub dispatch_on_approval: bool,
    /// The leader to use; `None` lets the planner choose.
    pub leader: Option<VehicleId>,
    /// The follower to use; `None` lets the planner choose.
    pub follower: Option<VehicleId>,
}

/// Where a mission is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
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
    /// Could not go on; the last transition says why.
    Failed,
}

impl MissionPhase {
    /// Every phase, in the order of their numbers on the wire.
    pub const ALL: [Self; 13] = [
        Self::Waiting,
        Self::Transit,
        Self::Assessing,
        Self::AwaitingApproval,
        Self::Approved,
        Self::Joining,
        Self::Clearing,
        Self::Landing,
        Self::Paused,
        Self::Completed,
        Self::Aborted,
        Self::Failed,
        Self::Releasing,
    ];

    /// Lower-case name with underscores, as REST and the store write it.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Transit => "transit",
            Self::Assessing => "assessing",
            Self::AwaitingApproval => "awaiting_approval",
            Self::Approved => "approved",
            Self::Joining => "joining",
            Self::Clearing => "clearing",
            Self::Landing => "landing",
            Self::Releasing => "releasing",
            Self::Paused => "paused",
            Self::Completed => "completed",
            Self::Aborted => "aborted",
            Self::Failed => "failed",
        }
    }

    /// The inverse of [`Self::as_str`].
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|phase| phase.as_str() == name)
    }

    /// Whether nothing more will happen.
    #[must_use]
    pub fn is_final(self) -> bool {
        matches!(self, Self::Completed | Self::Aborted | Self::Failed)
    }
}

/// One step of a mission: what changed, who did it, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Transition {
    /// When.
    pub stamp: Stamp,
    /// Into which phase.
    pub phase: MissionPhase,
    /// Who: `planner`, or the person or client who commanded it.
    pub who: String,
    /// Why.
    pub why: String,
}

/// A mission.
#[derive(Debug, Clone, PartialEq)]
pub struct Mission {
    /// When this was last changed.
    pub stamp: Stamp,
    /// Which.
    pub id: MissionId,
    /// What it is to do.
    pub spec: MissionSpec,
    /// Where it is.
    pub phase: MissionPhase,
    /// The leader in use.
    pub leader: Option<VehicleId>,
    /// The follower in use.
    pub follower: Option<VehicleId>,
    /// The newest verdict on the spot.
    pub verdict: Option<VerdictState>,
    /// The significant height on which the dispatch was decided, metres.
    pub h_s_m: Option<Estimate>,
    /// Where the follower came down, by its own position.
    pub touchdown: Option<LocalPoint>,
    /// Why the payload was not let go, if it was to be: a person tries again, or goes on without.
    pub release_problem: Option<String>,
    /// Every transition, oldest first.
    pub history: Vec<Transition>,
}
