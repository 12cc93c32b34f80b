//! Commands to vehicles, and the answer to any command.

use halcyon_model as model;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{PointInput, rfc3339};

/// A place beside a leader, in the leader's heading frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SlotOffset {
    /// Metres ahead of the leader along its heading.
    #[schema(minimum = -1000, maximum = 1000)]
    pub forward_m: f64,
    /// Metres to the right of the leader.
    #[schema(minimum = -1000, maximum = 1000)]
    pub right_m: f64,
    /// Metres above the leader.
    #[schema(minimum = -1000, maximum = 1000)]
    pub up_m: f64,
}

impl From<model::Slot> for SlotOffset {
    fn from(slot: model::Slot) -> Self {
        Self { forward_m: slot.forward_m, right_m: slot.right_m, up_m: slot.up_m }
    }
}

/// A command to one vehicle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "action", content = "parameters", rename_all = "snake_case", deny_unknown_fields)]
pub enum VehicleCommandRequest {
    /// Arm the motors.
    Arm,
    /// Disarm on the ground.
    Disarm,
    /// Climb.
    TakeOff {
        /// Height above the take-off point, metres.
        #[schema(exclusive_minimum = 0, maximum = 1000)]
        height_m: f64,
    },
    /// Fly to a place.
    GoTo {
        /// Where.
        point: PointInput,
        /// Height above mean water, metres.
        #[schema(exclusive_minimum = 0, maximum = 1000)]
        height_m: f64,
    },
    /// Keep a slot beside a leader.
    Follow {
        /// Whom.
        #[schema(pattern = "^[A-Za-z0-9._-]{1,64}$")]
        leader: String,
        /// Where beside it.
        slot: SlotOffset,
    },
    /// Stop and hold.
    Hold,
    /// Land here.
    Land,
    /// Fly home and land.
    Return,
    /// Change the flight mode.
    SetMode {
        /// In ArduCopter's words, in any case.
        #[schema(pattern = "^(STABILIZE|ALT_HOLD|AUTO|GUIDED|LOITER|RTL|LAND|BRAKE|SMART_RTL|POSHOLD)$")]
        mode: String,
    },
    /// Turn.
    SetHeading {
        /// Heading, degrees clockwise from true north.
        #[schema(minimum = -360, maximum = 360)]
        heading_deg: f64,
    },
    /// Stop the motors now, in the air or not.
    Terminate,
    /// Let the payload go. Only on the ground or the water.
    ReleasePayload,
    /// Hold the payload.
    SecurePayload,
    /// End the transfer of parameters or items that is under way, and those that wait.
    CancelTransfer,
}

/// The answer to an accepted command. It is being carried out; watch `watch`, or the live stream, to see it done.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct CommandResult {
    /// When it was decided.
    pub stamp: String,
    /// Always `true`: a refused command is a problem with status 409.
    pub accepted: bool,
    /// What was done.
    pub reason: String,
    /// The mission concerned, for a mission command.
    #[schema(required = true)]
    pub mission: Option<String>,
    /// The resource to watch, also in `Location`.
    pub watch: String,
}

impl CommandResult {
    /// From an accepting reply.
    #[must_use]
    pub fn new(reply: &model::CommandReply, watch: String) -> Self {
        Self {
            stamp: rfc3339(reply.stamp),
            accepted: reply.accepted,
            reason: reply.reason.clone(),
            mission: reply.mission.as_ref().map(ToString::to_string),
            watch,
        }
    }
}
