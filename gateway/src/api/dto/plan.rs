//! The dispatch plan as JSON.

use halcyon_model as model;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::{Edge, Point, SlotOffset, VerdictState, rfc3339};

/// Permission to descend, and how long it lasts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct LandingClearance {
    /// The verdict it rests on.
    pub verdict: VerdictState,
    /// When that verdict was issued.
    pub sea_state_stamp: String,
    /// After this the vehicle stops and climbs.
    pub valid_until: String,
    /// Whether that time has passed.
    pub expired: bool,
}

/// What one vehicle is to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum PlanTask {
    /// Stay on the ground, or hold if flying.
    Hold,
    /// Take off if needed, fly to a point, hold there.
    Survey {
        /// Over this place.
        point: Point,
        /// Height above mean water, metres.
        height_m: f64,
        /// Heading, degrees; `null` leaves it free.
        #[schema(required = true)]
        heading_deg: Option<f64>,
    },
    /// Take off to the safe height if needed, then keep a slot beside a leader.
    Follow {
        /// Whom.
        leader: String,
        /// Where beside it.
        slot: SlotOffset,
    },
    /// Approach a point, descend while cleared, land.
    Land {
        /// On this place.
        point: Point,
        /// From this height, metres.
        approach_height_m: f64,
        /// Permission; `null` means approach and wait.
        #[schema(required = true)]
        clearance: Option<LandingClearance>,
    },
    /// Fly home and land there.
    Return,
}

impl PlanTask {
    /// From the model.
    #[must_use]
    pub fn new(task: &model::Task, edge: &Edge) -> Self {
        match task {
            model::Task::Hold => Self::Hold,
            model::Task::Survey { point, height_m, heading_rad } => Self::Survey {
                point: edge.point(*point),
                height_m: *height_m,
                heading_deg: heading_rad.map(|rad| rad.to_degrees().rem_euclid(360.0)),
            },
            model::Task::Follow { leader, slot } => Self::Follow { leader: leader.to_string(), slot: (*slot).into() },
            model::Task::Land { point, approach_height_m, clearance } => Self::Land {
                point: edge.point(*point),
                approach_height_m: *approach_height_m,
                clearance: clearance.as_ref().map(|clearance| LandingClearance {
                    verdict: clearance.verdict.into(),
                    sea_state_stamp: rfc3339(clearance.sea_state_stamp),
                    valid_until: rfc3339(clearance.valid_until),
                    expired: edge.now > clearance.valid_until,
                }),
            },
            model::Task::Return => Self::Return,
        }
    }
}

/// One vehicle's task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PlanAssignment {
    /// Who.
    pub vehicle: String,
    /// What.
    pub task: PlanTask,
}

/// Who goes where, valid until when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Plan {
    /// Strictly increasing.
    pub generation: u64,
    /// When it was issued.
    pub stamp: String,
    /// Seconds since then when this was sent.
    pub age_s: f64,
    /// The mission it serves; `null` when none runs.
    #[schema(required = true)]
    pub mission: Option<String>,
    /// After this each assigned vehicle flies its fail-safe.
    pub valid_until: String,
    /// Whether that time has passed.
    pub expired: bool,
    /// At most one a vehicle.
    pub assignments: Vec<PlanAssignment>,
}

impl Plan {
    /// From the model.
    #[must_use]
    pub fn new(plan: &model::DispatchPlan, edge: &Edge) -> Self {
        let assignments = plan.assignments.iter().map(|assignment| PlanAssignment {
            vehicle: assignment.vehicle.to_string(),
            task: PlanTask::new(&assignment.task, edge),
        });
        Self {
            generation: plan.generation,
            stamp: rfc3339(plan.stamp),
            age_s: edge.age_s(plan.stamp),
            mission: plan.mission.as_ref().map(ToString::to_string),
            valid_until: rfc3339(plan.valid_until),
            expired: edge.now > plan.valid_until,
            assignments: assignments.collect(),
        }
    }
}
