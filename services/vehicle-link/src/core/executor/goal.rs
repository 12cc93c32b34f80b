//! What the vehicle is after: the plan's task, or a person's direct command in its place.

use halcyon_model::{Clearance, LocalPoint, Slot, Task, VehicleId};

/// One thing to do. Plan tasks and direct commands become this.
#[derive(Debug, Clone, PartialEq)]
pub enum Goal {
    /// Stay on the ground, or hold where it is.
    Stay,
    /// Take off if needed, go to a place at a height above mean water, hold there.
    Go {
        /// Over this place.
        point: LocalPoint,
        /// Height above mean water, metres.
        height_m: f64,
        /// With this heading, radians.
        heading_rad: Option<f64>,
    },
    /// Take off if needed, keep a slot beside a leader.
    Follow {
        /// Whom.
        leader: VehicleId,
        /// Where beside it.
        slot: Slot,
    },
    /// Approach a place, go down while cleared, land on it. Never a reason to take off.
    Land {
        /// On this place.
        point: LocalPoint,
        /// From this height above mean water, metres.
        approach_height_m: f64,
        /// Permission.
        clearance: Option<Clearance>,
    },
    /// LAND mode, here and now.
    LandHere,
    /// Fly home and land there.
    Return,
}

impl Goal {
    /// From a plan's task.
    #[must_use]
    pub fn from_task(task: &Task) -> Self {
        match task.clone() {
            Task::Hold => Self::Stay,
            Task::Survey { point, height_m, heading_rad } => Self::Go { point, height_m, heading_rad },
            Task::Follow { leader, slot } => Self::Follow { leader, slot },
            Task::Land { point, approach_height_m, clearance } => Self::Land { point, approach_height_m, clearance },
            Task::Return => Self::Return,
        }
    }

    /// The same but for what is renewed all the time: a clearance that comes, goes or is extended is no new goal.
    #[must_use]
    pub fn is_same_as(&self, other: &Self) -> bool {
        match (self, other) {
            (
                Self::Land { point: a, approach_height_m: ha, clearance: _ },
                Self::Land { point: b, approach_height_m: hb, clearance: _ },
            ) => a.distance_m(b) < 0.01 && (ha - hb).abs() < 0.01,
            _ => self == other,
        }
    }

    /// Whether a vehicle on the ground takes off for it.
    #[must_use]
    pub fn wants_flight(&self) -> bool {
        matches!(self, Self::Go { .. } | Self::Follow { .. })
    }

    /// The fixed place that it leads to.
    #[must_use]
    pub fn place(&self) -> Option<LocalPoint> {
        match self {
            Self::Go { point, .. } | Self::Land { point, .. } => Some(*point),
            _ => None,
        }
    }

    /// The height above mean water that it asks for, metres.
    #[must_use]
    pub fn height_m(&self) -> Option<f64> {
        match self {
            Self::Go { height_m, .. } => Some(*height_m),
            Self::Land { approach_height_m, .. } => Some(*approach_height_m),
            _ => None,
        }
    }

    /// Whether every number is finite.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        let heading = match self {
            Self::Go { heading_rad, .. } => heading_rad.unwrap_or(0.0),
            Self::Follow { slot, .. } => slot.forward_m + slot.right_m + slot.up_m,
            _ => 0.0,
        };
        let place = self.place().map_or(0.0, |point| point.north_m + point.east_m);
        (heading + place + self.height_m().unwrap_or(0.0)).is_finite()
    }
}
