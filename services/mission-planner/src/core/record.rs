//! What is stored before it is announced, and what comes back after a restart.

use halcyon_model::{Mission, MissionId, MissionPhase, MissionSpec, Severity, Stamp, Transition, VehicleId};

use super::formation::Formation;

/// What a mission needs besides [`Mission`] to go on after a restart.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Course {
    /// In which phase it was paused.
    pub paused_from: Option<MissionPhase>,
    /// The leader's heading over the spot, radians; the stand-off lies ahead and the slot abreast of it.
    pub heading_rad: Option<f64>,
    /// The follower's slot: metres to the right of the leader, negative to the left.
    pub abreast_m: f64,
    /// A person asked for the dispatch.
    pub dispatch: bool,
    /// It has been in the landing phase: a follower that is down has landed rather than not taken off.
    pub reached_landing: bool,
    /// Since when the leader has been settled over the spot.
    pub station_since: Option<Stamp>,
    /// When it first was.
    pub first_on_station: Option<Stamp>,
}

/// A line of the store. Lines are only ever added.
#[derive(Debug, Clone, PartialEq)]
pub enum Record {
    /// A new mission.
    Created {
        /// Which.
        id: MissionId,
        /// What it is to do.
        spec: MissionSpec,
    },
    /// A mission changed phase or crew.
    Entered {
        /// The mission as it is now. Of its history, only the last transition is new.
        mission: Box<Mission>,
        /// How it goes on from here.
        course: Course,
        /// The transition.
        transition: Transition,
    },
    /// A vehicle is home, or rests where it landed, and may be used again.
    Released {
        /// Of which mission.
        mission: MissionId,
        /// Which.
        vehicle: VehicleId,
        /// When.
        stamp: Stamp,
    },
    /// A formation was ordered, or changed; without members it is disbanded.
    Formed {
        /// As it is now.
        formation: Formation,
        /// Who ordered it.
        who: String,
        /// When.
        stamp: Stamp,
    },
    /// Plans up to this generation may have been issued; a restart begins above it. Stored in large steps, since a plan is
    /// issued twice a second.
    Reserved {
        /// The last generation that may be issued before the next such line.
        generation: u64,
    },
}

/// A mission as the store gives it back.
#[derive(Debug, Clone, PartialEq)]
pub struct SavedMission {
    /// The mission, with all its history.
    pub mission: Mission,
    /// How it goes on.
    pub course: Course,
    /// Vehicles that flew for it at some time and have not been released.
    pub crew: Vec<VehicleId>,
}

/// Everything that the store gives back.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Saved {
    /// Generations up to this one may have been used.
    pub generation: u64,
    /// Missions, in the order in which they were created.
    pub missions: Vec<SavedMission>,
    /// Formations in force.
    pub formations: Vec<Formation>,
}

/// Something to tell people.
#[derive(Debug, Clone, PartialEq)]
pub struct Notice {
    /// How much it matters.
    pub severity: Severity,
    /// What happened.
    pub what: String,
    /// Why.
    pub why: String,
    /// The vehicle concerned.
    pub vehicle: Option<VehicleId>,
    /// The mission concerned.
    pub mission: Option<MissionId>,
}

/// Ask a vehicle to let its payload go, and tell the planner the answer by [`super::Planner::observe_release`].
#[derive(Debug, Clone, PartialEq)]
pub struct ReleaseOrder {
    /// For which mission.
    pub mission: MissionId,
    /// Whom.
    pub vehicle: VehicleId,
    /// Which request of the mission's this is, to know its answer by.
    pub attempt: u32,
    /// Now.
    pub stamp: Stamp,
    /// After this no answer is waited for, and it must not be carried out.
    pub deadline: Stamp,
}

/// What came of a step or a command. Store `records` first, all or none; announce the rest only then.
#[derive(Debug, Clone, PartialEq, Default)]
#[must_use]
pub struct Effects {
    /// To be stored.
    pub records: Vec<Record>,
    /// A new plan, if there is one.
    pub plan: Option<halcyon_model::DispatchPlan>,
    /// Missions that changed.
    pub missions: Vec<Mission>,
    /// Events.
    pub notices: Vec<Notice>,
    /// Payloads to let go.
    pub releases: Vec<ReleaseOrder>,
}
