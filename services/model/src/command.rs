//! Commands: each is a query with a typed answer, accepted or refused with a reason, never lost in silence.

use crate::formation::FormationSpec;
use crate::geo::LocalPoint;
use crate::id::{MissionId, VehicleId};
use crate::mission::MissionSpec;
use crate::plan::Slot;
use crate::time::Stamp;
use crate::transfer::{Content, Item, ItemKind, ParameterName};
use crate::vehicle::FlightMode;

/// The answer to any command.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandReply {
    /// When it was decided.
    pub stamp: Stamp,
    /// Accepted or refused.
    pub accepted: bool,
    /// Why it was refused, or what was done.
    pub reason: String,
    /// The mission concerned, for mission commands that were accepted.
    pub mission: Option<MissionId>,
    /// What was read, for commands that read.
    pub content: Option<Content>,
}

impl CommandReply {
    /// Accepted.
    #[must_use]
    pub fn accepted(stamp: Stamp, reason: impl Into<String>) -> Self {
        Self { stamp, accepted: true, reason: reason.into(), mission: None, content: None }
    }

    /// Refused.
    #[must_use]
    pub fn refused(stamp: Stamp, reason: impl Into<String>) -> Self {
        Self { stamp, accepted: false, reason: reason.into(), mission: None, content: None }
    }
}

/// What to do with a mission.
#[derive(Debug, Clone, PartialEq)]
pub enum MissionAction {
    /// A new one under this id; the same id with the same content again is answered as before.
    Create(MissionId, MissionSpec),
    /// A person says that the follower may go.
    Approve(MissionId),
    /// Send the follower now.
    Dispatch(MissionId),
    /// Everyone holds.
    Pause(MissionId),
    /// Go on.
    Resume(MissionId),
    /// Everyone returns. Works from every state.
    Abort(MissionId),
    /// Try once more to let the payload go.
    Release(MissionId),
    /// Complete the mission though the payload was not let go.
    SkipRelease(MissionId),
    /// Followers keep a shape about a leader, until they are told otherwise. The same again is answered as before; another shape, or
    /// others, changes the formation that the leader has.
    Form(FormationSpec),
    /// The followers of this leader return.
    Disband(VehicleId),
}

/// A command to the mission planner.
#[derive(Debug, Clone, PartialEq)]
pub struct MissionCommand {
    /// When it was issued.
    pub stamp: Stamp,
    /// After this it must not be carried out.
    pub deadline: Stamp,
    /// Who issued it.
    pub who: String,
    /// What.
    pub action: MissionAction,
}

/// What to do with a vehicle.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleAction {
    /// Arm the motors.
    Arm,
    /// Disarm on the ground.
    Disarm,
    /// Climb to a height above the take-off point, metres.
    TakeOff {
        /// Height, metres.
        height_m: f64,
    },
    /// Fly to a place at a height above mean water.
    GoTo {
        /// Where.
        point: LocalPoint,
        /// Height, metres.
        height_m: f64,
    },
    /// Keep a slot beside a leader.
    Follow {
        /// Whom.
        leader: VehicleId,
        /// Where.
        slot: Slot,
    },
    /// Stop and hold.
    Hold,
    /// Land here.
    Land,
    /// Fly home and land.
    Return,
    /// Change the flight mode.
    SetMode(FlightMode),
    /// Turn to a heading, radians clockwise from true north.
    SetHeading {
        /// Heading, radians.
        heading_rad: f64,
    },
    /// Stop the motors now, in the air or not.
    Terminate,
    /// Read one parameter of the autopilot.
    ReadParameter {
        /// Which.
        name: ParameterName,
    },
    /// Read all of them.
    ReadParameters,
    /// Write one, and have it confirmed.
    SetParameter {
        /// Which.
        name: ParameterName,
        /// Its new value, in the autopilot's unit.
        value: f64,
        /// Also while the motors turn: some parameters are dangerous in flight.
        even_in_flight: bool,
    },
    /// Read a list of items.
    DownloadItems {
        /// Which.
        kind: ItemKind,
    },
    /// Replace a list of items.
    UploadItems {
        /// Which.
        kind: ItemKind,
        /// By what; nothing clears it.
        items: Vec<Item>,
    },
    /// Empty a list of items.
    ClearItems {
        /// Which.
        kind: ItemKind,
    },
    /// End the transfer under way and those that wait.
    CancelTransfer,
    /// Let the payload go. Only on the ground or the water.
    ReleasePayload,
    /// Hold the payload: closes what [`Self::ReleasePayload`] opens.
    SecurePayload,
}

/// A command to one vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct VehicleCommand {
    /// When it was issued.
    pub stamp: Stamp,
    /// After this it must not be carried out.
    pub deadline: Stamp,
    /// Who issued it.
    pub who: String,
    /// To which vehicle; a vehicle refuses what is meant for another.
    pub vehicle: VehicleId,
    /// What.
    pub action: VehicleAction,
}
