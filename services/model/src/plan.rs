//! The dispatch plan: immutable, numbered, and short-lived.

use crate::geo::LocalPoint;
use crate::id::{MissionId, VehicleId};
use crate::sea::{CalmWindow, VerdictState};
use crate::time::Stamp;

/// A place beside a leader, in the leader's heading frame. Line abreast at separation S (thesis 6-1 … 6-8) is
/// `{ forward_m: 0, right_m: ±S, up_m: 0 }`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slot {
    /// Metres ahead of the leader along its heading.
    pub forward_m: f64,
    /// Metres to the right of the leader.
    pub right_m: f64,
    /// Metres above the leader.
    pub up_m: f64,
}

/// Permission to descend, and how long it lasts.
#[derive(Debug, Clone, PartialEq)]
pub struct Clearance {
    /// The verdict it rests on. Only `Safe` lets a vehicle descend.
    pub verdict: VerdictState,
    /// When that verdict was issued.
    pub sea_state_stamp: Stamp,
    /// After this the vehicle stops and climbs.
    pub valid_until: Stamp,
    /// Quiet moments ahead at the spot, soonest first, to touch down in: an improvement, never a condition. Empty where none is known.
    pub windows: Vec<CalmWindow>,
}

/// What one vehicle is to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Task {
    /// Nothing: stay on the ground, or hold if flying.
    Hold,
    /// Take off if needed, fly to a point, hold there with a heading.
    Survey {
        /// Over this place.
        point: LocalPoint,
        /// At this height above mean water, metres.
        height_m: f64,
        /// With this heading, radians; `None` leaves it free.
        heading_rad: Option<f64>,
    },
    /// Take off to the safe height if needed, then keep a slot beside a leader.
    Follow {
        /// Whom.
        leader: VehicleId,
        /// Where beside it.
        slot: Slot,
    },
    /// Approach a point at the safe height, descend while cleared, land.
    Land {
        /// On this place.
        point: LocalPoint,
        /// From this height, metres.
        approach_height_m: f64,
        /// Permission; `None` means approach and wait.
        clearance: Option<Clearance>,
    },
    /// Fly home and land there.
    Return,
}

/// One vehicle's task.
#[derive(Debug, Clone, PartialEq)]
pub struct Assignment {
    /// Who.
    pub vehicle: VehicleId,
    /// What.
    pub task: Task,
}

/// Who goes where, under which limits, valid until when. A vehicle refuses an older generation than it has seen, and flies its
/// fail-safe once the newest has lapsed.
#[derive(Debug, Clone, PartialEq)]
pub struct DispatchPlan {
    /// When it was issued.
    pub stamp: Stamp,
    /// Strictly increasing over the planner's whole life, restarts included.
    pub generation: u64,
    /// The mission it serves; `None` when no mission runs.
    pub mission: Option<MissionId>,
    /// After this, each assigned vehicle flies its fail-safe.
    pub valid_until: Stamp,
    /// At most one assignment a vehicle; a vehicle without one keeps what it was doing under its own responsibility.
    pub assignments: Vec<Assignment>,
}

impl DispatchPlan {
    /// The task for `vehicle`, if the plan has one.
    #[must_use]
    pub fn task_for(&self, vehicle: &VehicleId) -> Option<&Task> {
        self.assignments.iter().find(|assignment| &assignment.vehicle == vehicle).map(|assignment| &assignment.task)
    }
}
