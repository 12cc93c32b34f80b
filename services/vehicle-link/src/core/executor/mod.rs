//! Makes reality match the newest plan, or a person's direct command, step by step. Deterministic and idempotent: each step
//! looks at what is observed and says what should be sent now.
//!
//! # Who decides
//! 1. The pilot: a mode that Halcyon didn't ask for ends everything here until GUIDED is set again ([`super::control`]).
//! 2. The fail-safes ([`super::failsafe`]).
//! 3. A direct command. It stands in place of the plan until the plan's task for this vehicle *changes* (a renewed validity or
//!    clearance is no change, an abort's Return is), or until `SetMode(GUIDED)` gives the vehicle back to the plan. Who commands
//!    directly takes the responsibility: a lapsed plan is then no fail-safe, all others are.
//! 4. The plan. A newer one without this vehicle leaves it what it was doing, and no longer lapses for it.
//!
//! # After a restart in flight
//! Nothing is sent until the first plan or command (ArduCopter holds by itself in GUIDED; PX4 in OFFBOARD is told to); with none within
//! [`RESTART_GRACE_S`], the fail-safe of a lapsed plan follows: hold, then return. A LAND or RTL that was under way is taken for
//! our own if the plan asks for just that, else left alone.
//!
//! # What makes it take off
//! A valid plan that assigns it a survey or a slot, or a direct take-off; only with a good estimator, enough battery, the
//! autopilot's consent, and nobody flying within the separation. Never to land, and never again for a task it has flown: a
//! vehicle that came down, whoever brought it down, stays down until the task changes.

mod command;
mod descent;
mod flight;
mod goal;
mod ground;
mod heed;
mod intake;
mod news;
mod payload;
mod settle;
mod slot;
mod watch;

use std::collections::BTreeMap;

use halcyon_model::{Activity, FlightMode, Intent, LocalFrame, LocalPoint, Severity, Slot, Stamp, VehicleId, VehicleState};
use nalgebra::Vector3;

pub use command::Decision;
pub use goal::Goal;
pub use intake::PlanAnswer;

use super::commands::Command;
use super::continuity::Continuity;
use super::control::Control;
use super::failsafe::{FailSafes, PlanHealth};
use super::guidance::{Guidance, Reference, Setpoint};
use super::heed::{Heed, NotFollowed};
use super::interlock::mode_name;
use super::inverse::Inverse;
use super::limits::{FailSafeLimits, Limits};
use super::payload::Payload;
use super::px4;
use super::track::Track;
use descent::Landing;
use payload::Release;
use settle::Settle;
use watch::Watch;

/// After a restart in flight, so long without a plan or a command is a lapsed plan, seconds.
pub const RESTART_GRACE_S: f64 = 10.0;
/// A request that was refused or unanswered is made again after this time, seconds.
const AGAIN_S: f64 = 5.0;
/// What was asked of the autopilot is what the vehicle means to do for so long, seconds.
const INTENT_S_MAX: f64 = 0.5;
/// Neighbours remembered; the fleet is smaller.
const NEIGHBOURS_MAX: usize = 64;

/// What the executor is told once.
#[derive(Debug, Clone)]
pub struct ExecutorConfig {
    /// Which vehicle this is.
    pub vehicle: VehicleId,
    /// Bounds of flight.
    pub limits: Limits,
    /// When fail-safes act.
    pub fail_safe: FailSafeLimits,
    /// How slots are kept.
    pub guidance: Guidance,
    /// What holds the payload.
    pub payload: Payload,
    /// Height of home above mean water, metres.
    pub home_height_m: f64,
    /// The fleet's frame.
    pub frame: LocalFrame,
}

/// What a step asks of its caller.
#[derive(Debug, Clone, PartialEq)]
pub enum Output {
    /// Send this setpoint.
    Setpoint(Setpoint),
    /// Ask the autopilot; tell the outcome with [`Executor::observe_outcome`].
    Request(Command),
    /// Stop asking: the pilot took over, or the autopilot started again.
    Withdraw,
    /// Ask for every stream again, and forget what the autopilot's frame was: it started again.
    AskStreams,
    /// Tell people.
    Note(Note),
}

/// Something people should know.
#[derive(Debug, Clone, PartialEq)]
pub struct Note {
    /// How much it matters.
    pub severity: Severity,
    /// What.
    pub what: String,
    /// Why.
    pub why: String,
}

#[derive(Debug, Clone)]
struct Own {
    state: VehicleState,
    mode_heard: Stamp,
}

#[derive(Debug, Clone)]
struct Direct {
    goal: Goal,
    who: String,
    /// The plan's task when the command came; another one ends the command.
    instead_of: Option<Goal>,
}

/// The newest plan, as far as it concerns this vehicle.
#[derive(Debug, Clone)]
struct PlanSeen {
    generation: u64,
    valid_until: Stamp,
    assigned: bool,
}

/// A request under way.
#[derive(Debug, Clone)]
struct Pending {
    command: Command,
    at: Stamp,
    /// It ended, and was not done.
    failed: bool,
    /// The autopilot said no, in as many words.
    declined: bool,
}

/// The climb that the autopilot flies after NAV_TAKEOFF.
#[derive(Debug, Clone, Copy)]
struct Climb {
    height_m: f64,
    since: Stamp,
}

/// Whether the autopilot's home is fixed where it first took off, since it started last.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
enum Home {
    #[default]
    Loose,
    Fixed,
    /// It would not, for this take-off.
    Declined,
}

/// One vehicle's executor.
#[derive(Debug)]
pub struct Executor {
    config: ExecutorConfig,
    control: Control,
    fail_safes: FailSafes,
    own: Option<Own>,
    neighbours: BTreeMap<VehicleId, Track>,
    plan: Option<PlanSeen>,
    plan_goal: Option<Goal>,
    direct: Option<Direct>,
    /// In the air when first heard: our predecessor flew it.
    restarted_at: Option<Stamp>,
    pending: Option<Pending>,
    climb: Option<Climb>,
    /// PX4's way up; ArduCopter stays in GUIDED.
    take_off: px4::TakeOff,
    /// The goal of this flight or the last: not taken off for again.
    flown: Option<Goal>,
    airborne: bool,
    reference: Option<Reference>,
    /// What is left between the reference and the slot that it has joined, metres.
    slot_left_m: Option<Vector3<f64>>,
    inverse: Inverse,
    /// The vehicle's own place, short of its receiver's leaps: what formation is flown by.
    continuity: Continuity,
    /// What was last asked of the autopilot, for those who follow.
    intent: Option<Intent>,
    /// Who follows whom where, by the newest plan.
    formation: BTreeMap<VehicleId, (VehicleId, Slot)>,
    held: Option<Vector3<f64>>,
    settle: Settle,
    descending: bool,
    /// Over the landing place and not cleared since.
    uncleared: Option<Stamp>,
    landed_for_goal: bool,
    touchdown: Option<LocalPoint>,
    release: Release,
    stepped: Option<Stamp>,
    active: Option<Goal>,
    /// The goal that the last step in the air flew: the active one, or a fail-safe's.
    flying: Option<Goal>,
    refusal_noted: Option<String>,
    activity: Activity,
    detail: String,
    /// The autopilot's last words about a fail-safe of its own.
    autopilot_words: Option<(Stamp, String)>,
    /// Its last words about anything.
    words: Option<(Stamp, String)>,
    heed: Heed,
    /// The autopilot does not follow its targets.
    unheeded: Option<NotFollowed>,
    watch: Watch,
    landing: Landing,
    notes: Vec<Note>,
    withdraw: bool,
    home: Home,
    /// A person wants the motors stopped, whatever it does.
    terminated: Option<Stamp>,
    /// Somebody flew it when it was first heard: he may have taken it from our predecessor.
    found_taken: bool,
    /// It came down though it was not to.
    fell: Option<Stamp>,
    ask_streams: bool,
}

impl Executor {
    /// A vehicle of which nothing is known yet.
    #[must_use]
    pub fn new(config: ExecutorConfig) -> Self {
        Self {
            config,
            control: Control::default(),
            fail_safes: FailSafes::default(),
            own: None,
            neighbours: BTreeMap::new(),
            plan: None,
            plan_goal: None,
            direct: None,
            restarted_at: None,
            pending: None,
            climb: None,
            take_off: px4::TakeOff::default(),
            flown: None,
            airborne: false,
            reference: None,
            slot_left_m: None,
            inverse: Inverse::default(),
            continuity: Continuity::default(),
            intent: None,
            formation: BTreeMap::new(),
            held: None,
            settle: Settle::default(),
            descending: false,
            uncleared: None,
            landed_for_goal: false,
            touchdown: None,
            release: Release::default(),
            stepped: None,
            active: None,
            flying: None,
            refusal_noted: None,
            activity: Activity::Idle,
            detail: "waiting for the autopilot".into(),
            autopilot_words: None,
            words: None,
            heed: Heed::default(),
            unheeded: None,
            watch: Watch::default(),
            landing: Landing::default(),
            notes: Vec::new(),
            withdraw: false,
            home: Home::default(),
            terminated: None,
            found_taken: false,
            fell: None,
            ask_streams: false,
        }
    }

    /// What the vehicle is doing.
    #[must_use]
    pub fn activity(&self) -> &Activity {
        &self.activity
    }

    /// More about it, for people: what is waited for, and why.
    #[must_use]
    pub fn detail(&self) -> &str {
        &self.detail
    }

    /// Generation of the newest plan accepted; 0 before any.
    #[must_use]
    pub fn plan_generation(&self) -> u64 {
        self.plan.as_ref().map_or(0, |plan| plan.generation)
    }

    /// Where it touched down for its last landing task.
    #[must_use]
    pub fn touchdown(&self) -> Option<LocalPoint> {
        self.touchdown
    }

    /// Fills in what the executor knows of the state.
    pub fn complete(&self, state: &mut VehicleState) {
        state.activity = self.activity.clone();
        state.plan_generation = self.plan_generation();
        state.touchdown = self.touchdown;
        state.has_payload = self.config.payload.command(true).is_some();
        let in_force = |intent: &Intent| state.stamp.seconds_since(intent.stamp).abs() <= INTENT_S_MAX;
        state.intent = self.intent.filter(|intent| state.mode == FlightMode::Guided && in_force(intent));
    }

    /// Whether this vehicle keeps a slot beside `other` now: news of it is worth a step at once.
    #[must_use]
    pub fn is_led_by(&self, other: &VehicleId) -> bool {
        matches!(&self.flying, Some(Goal::Follow { leader, .. }) if leader == other)
    }

    /// Whether this vehicle is reckoned with.
    #[must_use]
    pub fn knows(&self, vehicle: &VehicleId) -> bool {
        self.neighbours.contains_key(vehicle)
    }

    /// Another vehicle's state.
    pub fn observe_neighbour(&mut self, state: VehicleState, now: Stamp) {
        self.watch_clock(now);
        if !Track::believable(&state) {
            return;
        }
        if state.vehicle == self.config.vehicle {
            return self.watch_name(&state, now);
        }
        self.watch_other(&state, now);
        if let Some(track) = self.neighbours.get_mut(&state.vehicle) {
            track.observe(state, now);
        } else if self.has_room_for_another(now) {
            self.neighbours.insert(state.vehicle.clone(), Track::new(state, now));
        }
    }

    /// The last target, for when nobody will guide any more: to stop, and stay. Without it the autopilot would fly on at the last velocity until
    /// its own timeout. `None` where it is not flown by targets now.
    #[must_use]
    pub fn farewell(&self, now: Stamp) -> Option<Setpoint> {
        let own = &self.own.as_ref()?.state;
        let flown = self.reference.is_some() && own.mode == FlightMode::Guided && self.airborne && !self.control.hands_off();
        let age_s = now.seconds_since(own.stamp).clamp(0.0, 0.5);
        flown.then(|| Setpoint {
            position_ned_m: self.stop_ned_m(own, own.position_ned_m + own.velocity_ned_mps * age_s),
            velocity_ned_mps: Vector3::zeros(),
            acceleration_ned_mps2: None,
            heading_rad: None,
        })
    }

    /// One guidance step. Call at about 10 Hz.
    pub fn step(&mut self, now: Stamp) -> Vec<Output> {
        self.watch_clock(now);
        self.watch_steps(now);
        let dt_s = self.stepped.map_or(0.1, |stepped| now.seconds_since(stepped)).clamp(0.0, 0.5);
        self.stepped = Some(now);
        let mut outputs = Vec::new();
        if std::mem::take(&mut self.withdraw) {
            outputs.push(Output::Withdraw);
        }
        if std::mem::take(&mut self.ask_streams) {
            outputs.push(Output::AskStreams);
        }
        let before = self.activity.clone();
        match self.own.clone() {
            None => self.activity = Activity::Idle,
            Some(own) => self.step_with(&own, dt_s, now, &mut outputs),
        }
        self.note_change(&before);
        self.intent = outputs.iter().rev().find_map(|output| match output {
            Output::Setpoint(setpoint) => Some(setpoint.intent(now)),
            _ => None,
        });
        outputs.extend(self.notes.drain(..).map(Output::Note));
        outputs
    }

    fn step_with(&mut self, own: &Own, dt_s: f64, now: Stamp, outputs: &mut Vec<Output>) {
        let silent_s = now.seconds_since(own.state.stamp).max(now.seconds_since(own.mode_heard));
        if silent_s > self.config.fail_safe.autopilot_silent_s {
            self.let_go();
            self.set(Activity::FailSafe { reason: "autopilot link lost".into() }, format!("silent for {silent_s:.0} s"));
            return;
        }
        self.try_adopt(&own.state);
        if self.control.hands_off() {
            self.let_go();
            self.fail_safes.released();
            let how = how_to_hand_back(&own.state);
            match self.autopilot_fail_safe(now) {
                Some(words) => self.set(Activity::FailSafe { reason: format!("autopilot: {words}") }, how),
                None => self.set(Activity::PilotControl, how),
            }
            return;
        }
        let goal = self.goal();
        let same = match (&self.active, &goal) {
            (Some(active), Some(goal)) => goal.is_same_as(active),
            (active, goal) => active.is_none() && goal.is_none(),
        };
        if !same {
            self.goal_changed(goal.as_ref());
        }
        self.active.clone_from(&goal);
        if self.airborne {
            self.fly(&own.state, goal, dt_s, now, outputs);
            self.watch_heed(&own.state, dt_s, now, outputs);
        } else {
            self.stand(&own.state, goal, now, outputs);
            self.release_on_touchdown(&own.state, now, outputs);
        }
    }

    /// The goal in force; `None` if nobody has ever asked anything of this vehicle.
    fn goal(&self) -> Option<Goal> {
        self.direct.as_ref().map(|direct| direct.goal.clone()).or_else(|| self.plan_goal.clone())
    }

    fn goal_changed(&mut self, goal: Option<&Goal>) {
        self.settle.reset();
        self.descending = false;
        self.landing.start();
        self.uncleared = None;
        self.landed_for_goal = false;
        self.held = None;
        self.forget_heed();
        self.fail_safes.new_task();
        if matches!(goal, Some(Goal::Land { .. })) {
            self.touchdown = None;
        }
    }

    /// How the plan stands that the vehicle acts under.
    fn plan_health(&self, now: Stamp) -> PlanHealth {
        if self.direct.is_some() {
            return PlanHealth::Good;
        }
        let lapsed = match (&self.plan, &self.plan_goal) {
            (Some(plan), Some(_)) => plan.assigned && now > plan.valid_until,
            // Never a task in this life: a lapsed plan if our predecessor flew it.
            _ => self.restarted_at.is_some_and(|at| now.seconds_since(at) > RESTART_GRACE_S),
        };
        if lapsed { PlanHealth::Lapsed } else { PlanHealth::Good }
    }

    /// Asks for `command` unless it is under way, or was asked for a moment ago.
    fn request(&mut self, command: Command, now: Stamp, outputs: &mut Vec<Output>) {
        if let Some(pending) = &self.pending {
            let same = is_same(&pending.command, &command);
            // A new wish waits for the old one's answer, unless that is overdue: the transaction layer gives up within 5 s.
            let wait_s = if same || pending.failed { AGAIN_S } else { 0.5 };
            if (same || !pending.failed) && now.seconds_since(pending.at) < wait_s {
                return;
            }
        }
        if let Command::SetMode(mode) = command {
            self.control.expect(mode, now);
        }
        self.pending = Some(Pending { command, at: now, failed: false, declined: false });
        outputs.push(Output::Request(command));
    }

    /// Forgets what guidance was doing, so that it starts smoothly from where the vehicle then is.
    fn let_go(&mut self) {
        self.forget_heed();
        self.reference = None;
        self.left_slot();
        self.inverse = Inverse::default();
        self.flying = None;
        self.held = None;
        self.climb = None;
        self.descending = false;
        self.landing.start();
        self.settle.reset();
    }

    /// After a restart: a LAND or RTL under way is ours if the goal asks for just that.
    fn try_adopt(&mut self, own: &VehicleState) {
        if !self.control.may_adopt() {
            return;
        }
        let matches = match (own.mode, self.goal()) {
            (FlightMode::Land, Some(Goal::Land { point, .. })) => {
                let near = LocalPoint::from(own.position_ned_m).distance_m(&point) <= 3.0 * self.config.limits.landing_radius_m;
                near && -own.position_ned_m.z <= 2.0 * self.config.limits.land_mode_height_m
            }
            (FlightMode::Rtl | FlightMode::Land, Some(Goal::Return)) => true,
            _ => false,
        };
        if matches {
            self.control.adopt();
            self.note(Severity::Info, format!("going on with {} after a restart", mode_name(own.mode)), "the plan asks for it");
        }
    }

    fn autopilot_fail_safe(&self, now: Stamp) -> Option<String> {
        // The words stay true while the mode that they explain stays.
        let recent = |at: Stamp| self.control.hands_off() && now.seconds_since(at) < 600.0;
        self.autopilot_words.as_ref().filter(|(at, _)| recent(*at)).map(|(_, words)| words.clone())
    }

    fn set(&mut self, activity: Activity, detail: impl Into<String>) {
        self.activity = activity;
        self.detail = detail.into();
    }

    fn note(&mut self, severity: Severity, what: impl Into<String>, why: impl Into<String>) {
        self.notes.push(Note { severity, what: what.into(), why: why.into() });
    }

    /// Tells people of a change of activity; the error of a slot is no change.
    fn note_change(&mut self, before: &Activity) {
        let same = match (before, &self.activity) {
            (Activity::Following { settled: a, .. }, Activity::Following { settled: b, .. }) => a == b,
            (a, b) => a == b,
        };
        if same {
            return;
        }
        match &self.activity {
            Activity::FailSafe { reason } => {
                let reason = reason.clone();
                // Reasons with running numbers are one fail-safe, told once.
                if !matches!(before, Activity::FailSafe { .. }) || kind(&reason) != kind(before_reason(before)) {
                    self.note(Severity::Critical, "fail-safe", reason);
                }
            }
            activity => {
                let what = word(activity).to_owned();
                let why = if self.detail.is_empty() { format!("after {}", word(before)) } else { self.detail.clone() };
                self.note(Severity::Info, what, why);
            }
        }
    }
}

/// How whoever has it hands it back, for people.
pub(super) fn how_to_hand_back(state: &VehicleState) -> String {
    // Set by a transmitter or past the relay, only a change shows.
    let again = if state.mode == FlightMode::Guided { " again (with a transmitter: another mode first)" } else { "" };
    let starts = if state.armed { "" } else { ", which may start the motors at once" };
    format!("mode {}; set GUIDED{again} to hand back{starts}", mode_name(state.mode))
}

/// Whether it is one wish: the height of a take-off is by where it stands, which is not known to the last millimetre.
fn is_same(a: &Command, b: &Command) -> bool {
    a == b || matches!((a, b), (Command::TakeOff { .. }, Command::TakeOff { .. }))
}

fn before_reason(activity: &Activity) -> &str {
    if let Activity::FailSafe { reason } = activity { reason } else { "" }
}

/// A reason without its numbers.
fn kind(reason: &str) -> String {
    reason.chars().filter(|c| c.is_alphabetic()).collect()
}

/// An activity in a word or two.
#[must_use]
pub fn word(activity: &Activity) -> &'static str {
    match activity {
        Activity::Idle => "idle",
        Activity::Preparing => "preparing",
        Activity::TakingOff => "taking off",
        Activity::Transit => "in transit",
        Activity::Holding { settled: true } => "holding, settled",
        Activity::Holding { settled: false } => "holding",
        Activity::Following { settled: true, .. } => "following, settled",
        Activity::Following { settled: false, .. } => "following",
        Activity::Approaching => "approaching",
        Activity::Descending => "descending",
        Activity::Landed => "landed",
        Activity::Returning => "returning",
        Activity::FailSafe { .. } => "fail-safe",
        Activity::PilotControl => "pilot control",
    }
}

fn describe(command: &Command) -> String {
    match command {
        Command::Arm => "arming".into(),
        Command::Disarm { force: false } => "disarming".into(),
        Command::Disarm { force: true } => "termination".into(),
        Command::SetMode(mode) => format!("mode {}", mode_name(*mode)),
        Command::TakeOff { height_above_home_m } => format!("take-off to {height_above_home_m:.1} m"),
        Command::SetHome => "fixing home".into(),
        Command::SetInterval(stream) => format!("the stream of message {}", stream.message_id),
        Command::Payload(payload) if payload.releases => "releasing the payload".into(),
        Command::Payload(_) => "securing the payload".into(),
    }
}
