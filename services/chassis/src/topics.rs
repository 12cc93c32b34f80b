//! The wiring diagram: every key on the bus, the message on it, who writes and reads it, and how it is delivered.
//!
//! All keys begin with `halcyon/v1/{fleet}/`, which the [`Bus`](crate::Bus) adds. Identifiers are checked when they are made, so
//! none can hold a `/` or a wildcard and be misrouted.

use std::marker::PhantomData;

use halcyon_model::{
    DispatchPlan, Event, Health, InstanceId, Mission, MissionCommand, MissionId, Preview, RigId, SeaState, SimTruth,
    StereoPair, SurfacePatch, VehicleCommand, VehicleId, VehicleState,
};
use zenoh::qos::Priority;

/// How a topic travels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Delivery {
    /// Zenoh's priority.
    pub priority: Priority,
    /// Send at once, without batching.
    pub express: bool,
    /// Samples that a publisher keeps for those who join late or were cut off; 0 is best effort, newest wins.
    pub history: usize,
    /// Messages that a reader's inbox holds before the oldest goes.
    pub inbox: usize,
}

/// Pictures and pictures' children: lowest priority, dropped first.
const PICTURES: Delivery = Delivery { priority: Priority::Background, express: false, history: 0, inbox: 1 };
/// Patches: small, every one is wanted, none is worth waiting for.
const MEASUREMENT: Delivery = Delivery { priority: Priority::DataLow, express: false, history: 0, inbox: 32 };
/// Vehicle state: real-time, best effort. The inbox serves a reader of all vehicles.
const STATE: Delivery = Delivery { priority: Priority::RealTime, express: true, history: 0, inbox: 256 };
/// What must arrive, late joiners and healed partitions included.
const RELIABLE: Delivery = Delivery { priority: Priority::InteractiveHigh, express: false, history: 32, inbox: 256 };
/// The last value is kept for late joiners.
const LAST_KEPT: Delivery = Delivery { priority: Priority::Data, express: false, history: 1, inbox: 256 };
/// Events: reliable, with a longer memory.
const EVENTS: Delivery = Delivery { priority: Priority::Data, express: false, history: 256, inbox: 1024 };

/// A key, or a pattern of keys, and the message on it.
#[derive(Debug)]
pub struct Topic<M> {
    pub(crate) key: String,
    /// For metrics and logs: the same for every vehicle and rig.
    pub(crate) name: &'static str,
    pub(crate) delivery: Delivery,
    message: PhantomData<fn() -> M>,
}

impl<M> Topic<M> {
    fn new(name: &'static str, key: String, delivery: Delivery) -> Self {
        Self { key, name, delivery, message: PhantomData }
    }
}

/// A key that is asked: a command and its typed answer.
#[derive(Debug)]
pub struct CommandTopic<C> {
    pub(crate) key: String,
    pub(crate) name: &'static str,
    command: PhantomData<fn() -> C>,
}

macro_rules! topics {
    ($($(#[$doc:meta])* $one:ident($id:ident: $Id:ty), $(#[$all_doc:meta])* $all:ident => $name:literal $key:literal $Message:ty, $delivery:expr;)*) => {
        $(
            $(#[$doc])*
            #[must_use]
            pub fn $one($id: &$Id) -> Topic<$Message> {
                Topic::new($name, format!($key, $id), $delivery)
            }

            /// The same for all of them; for reading only.
            #[must_use]
            pub fn $all() -> Topic<$Message> {
                Topic::new($name, format!($key, "*"), $delivery)
            }
        )*
    };
}

topics! {
    /// capture → reconstruction.
    pair(rig: RigId), pairs => "pair" "rig/{}/pair" StereoPair, PICTURES;
    /// reconstruction → wave-assessment, gateway, recorder.
    surface(rig: RigId), surfaces => "surface" "rig/{}/surface" SurfacePatch, MEASUREMENT;
    /// reconstruction → gateway, at most 2 Hz.
    preview(rig: RigId), previews => "preview" "rig/{}/preview" Preview, PICTURES;
    /// wave-assessment → mission-planner, gateway.
    sea_state(rig: RigId), sea_states => "sea_state" "rig/{}/sea-state" SeaState, RELIABLE;
    /// vehicle-link → followers, capture, planner, gateway.
    vehicle_state(vehicle: VehicleId), vehicle_states => "vehicle_state" "vehicle/{}/state" VehicleState, STATE;
    /// every service → gateway.
    health(instance: InstanceId), healths => "health" "service/{}/health" Health, LAST_KEPT;
    /// mission-planner → gateway: the state of each mission.
    mission(mission: MissionId), missions => "mission" "mission/{}/state" Mission, LAST_KEPT;
    /// simulator → simulated cameras and the final report. Nothing that flies may read it.
    sim_truth(vehicle: VehicleId), sim_truths => "sim_truth" "sim/{}/truth" SimTruth, STATE;
}

/// mission-planner → vehicle-link, gateway.
#[must_use]
pub fn plan() -> Topic<DispatchPlan> {
    Topic::new("plan", "plan".into(), RELIABLE)
}

/// any → gateway, recorder.
#[must_use]
pub fn event() -> Topic<Event> {
    Topic::new("event", "event".into(), EVENTS)
}

/// gateway → mission-planner: create, approve, dispatch, pause, resume, abort.
#[must_use]
pub fn mission_command() -> CommandTopic<MissionCommand> {
    CommandTopic { key: "mission/command".into(), name: "mission_command", command: PhantomData }
}

/// gateway, planner → vehicle-link: works with the planner down.
#[must_use]
pub fn vehicle_command(vehicle: &VehicleId) -> CommandTopic<VehicleCommand> {
    CommandTopic { key: format!("vehicle/{vehicle}/command"), name: "vehicle_command", command: PhantomData }
}

/// Liveliness token of an instance.
pub(crate) fn presence_key(instance: &str) -> String {
    format!("service/{instance}/alive")
}
