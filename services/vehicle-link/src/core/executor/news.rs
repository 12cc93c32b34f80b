//! What the autopilot, and stations on its link, let the executor know; and who has the vehicle by it.

use halcyon_model::{FlightMode, LandedState, Severity, Stamp, VehicleState};

use super::{Executor, Goal, Home, Own, Pending, describe, is_same};
use crate::core::commands::{Command, CommandError};
use crate::core::control::Change;
use crate::core::interlock::mode_name;
use crate::core::mode::Family;
use crate::core::px4;

/// A termination stops the motors within this time, or not at all; and motors that stop within this time after it came down by itself were
/// not stopped for a landing, seconds.
const TERMINATED_S: f64 = 10.0;
const FELL_S: f64 = 20.0;

impl Executor {
    /// The vehicle's own state; `mode_heard` is when its mode was last heard.
    pub fn observe_self(&mut self, state: VehicleState, mode_heard: Stamp, now: Stamp) {
        self.watch_clock(now);
        self.watch_self(&state, now);
        self.landing.surface.observe(&state);
        let first = self.own.is_none();
        let stopped = self.stopped_by_others(&state);
        if self.is_autopilots_own_change(&state) {
            self.control.expect(state.mode, now);
        }
        match self.control.observe(state.mode, state.armed, now) {
            Change::None => {}
            Change::ChosenAnew => self.withdraw = true,
            Change::TakenOver => {
                self.withdraw = true;
                self.pending = None;
                self.take_off = px4::TakeOff::default();
                // Once the pilot had it, it doesn't take off by itself for the same task again.
                self.flown = self.goal();
                // Its own flight from the ground, with nothing for us to do, ends with it; what was ours is given back by a person only.
                if !first && (self.airborne || self.flown.as_ref().is_some_and(Goal::wants_flight)) {
                    self.control.let_go();
                }
                let mode = mode_name(state.mode);
                match self.autopilot_fail_safe(now) {
                    Some(words) => self.note(Severity::Critical, format!("the autopilot changed to {mode}"), words),
                    None => self.note(Severity::Warning, "the pilot has the vehicle", format!("mode {mode}, not set by us")),
                }
            }
            Change::HandedBack => {
                if state.mode == FlightMode::Guided && !self.airborne {
                    self.flown = None;
                }
                self.found_taken = false;
                self.note(Severity::Info, "the vehicle was handed back", mode_name(state.mode));
            }
            Change::Over => {
                self.note(Severity::Info, "the pilot's flight is over", mode_name(state.mode));
                // A task that came while he flew, or that our predecessor may have lost it in, doesn't start the motors in his hands.
                if std::mem::take(&mut self.found_taken) || self.goal().is_some_and(|goal| goal.wants_flight()) {
                    self.flown = self.goal();
                    self.control.let_go();
                }
            }
        }
        self.found_taken |= first && self.control.hands_off();
        if stopped {
            self.stands_down("the motors were stopped, not by us");
        }
        let recent = |at: Stamp, for_s: f64| (0.0..=for_s).contains(&now.seconds_since(at));
        if !state.armed && self.terminated.take().is_some_and(|at| recent(at, TERMINATED_S)) {
            self.stands_down("the motors were stopped by a termination");
        }
        let was_airborne = self.airborne;
        self.airborne = is_airborne(&state);
        if first && self.airborne {
            self.restarted_at = Some(now);
        }
        self.continuity.observe(state.stamp, state.position_ned_m, state.velocity_ned_mps);
        if was_airborne && !self.airborne && self.falls(&state) {
            self.fell = Some(now);
        }
        if self.airborne {
            self.fell = None;
        }
        let armed = state.armed;
        self.own = Some(Own { state, mode_heard });
        if was_airborne && !self.airborne {
            self.touched_down();
        }
        if !armed && self.fell.take().is_some_and(|at| recent(at, FELL_S)) {
            self.stands_down("it came down though it was not to land");
        }
    }

    /// Whether PX4 changed its mode by itself, at the end of what we had asked for.
    fn is_autopilots_own_change(&self, state: &VehicleState) -> bool {
        let Some(before) = self.own.as_ref().map(|own| &own.state).filter(|before| self.control.is_ours(before.mode)) else {
            return false;
        };
        Family::named(state.firmware.as_ref()) == Family::Px4
            && (self.take_off.ends(before, state) || px4::is_back_after_landing(before, state))
    }

    /// A ground station on our link asked the autopilot for something that moves the vehicle; `what` of [`crate::core::station::flies`]. In
    /// GUIDED our next setpoint would undo it: that is the pilot's hand on the stick.
    pub fn observe_station(&mut self, what: &str) {
        let guided = self.own.as_ref().is_some_and(|own| own.state.mode == FlightMode::Guided && own.state.armed);
        if !guided || self.control.hands_off() {
            return;
        }
        self.control.let_go();
        self.withdraw = true;
        self.pending = None;
        self.flown = self.goal();
        self.note(Severity::Warning, "the pilot has the vehicle", format!("a ground station {what}; set GUIDED to hand back"));
    }

    /// A ground station on our link asked the autopilot for GUIDED: that hands it back, though it may be GUIDED already.
    pub fn observe_station_guided(&mut self, now: Stamp) {
        if self.own.as_ref().is_some_and(|own| Family::named(own.state.firmware.as_ref()) == Family::ArduPilot) {
            self.control.expect(FlightMode::Guided, now);
        }
    }

    /// The autopilot said something.
    pub fn observe_text(&mut self, text: &str, now: Stamp) {
        if text.to_ascii_lowercase().contains("failsafe") {
            self.autopilot_words = Some((now, text.to_owned()));
        }
        self.words = Some((now, text.to_owned()));
    }

    /// How a request ended.
    pub fn observe_outcome(&mut self, command: &Command, outcome: &Result<(), CommandError>, now: Stamp) {
        self.observe_payload(command, outcome);
        let ours = self.pending.as_ref().is_some_and(|pending| is_same(&pending.command, command));
        if let Command::TakeOff { .. } = command {
            self.take_off.answered(outcome.is_ok());
        }
        let declined = matches!(outcome, Err(CommandError::Refused { .. }));
        if *command == Command::SetHome {
            match outcome {
                Ok(()) => self.home = Home::Fixed,
                // It is as without: the autopilot takes home where it is armed.
                Err(_) if declined && self.home == Home::Loose => self.home = Home::Declined,
                Err(_) => {}
            }
        }
        if let (true, Err(error)) = (ours, outcome) {
            self.pending = Some(Pending { command: *command, at: now, failed: true, declined });
            self.detail = error.to_string();
            let what = format!("{} was not done: {error}", describe(command));
            if *error != CommandError::Withdrawn && self.refusal_noted.as_ref() != Some(&what) {
                self.note(Severity::Warning, format!("{} was not done", describe(command)), error.to_string());
                self.refusal_noted = Some(what);
            }
        } else if ours {
            // Accepted: what it brings is observed. Asked again only if that doesn't come.
            self.pending = Some(Pending { command: *command, at: now, failed: false, declined: false });
        }
    }
}

/// Whether the vehicle is off the ground: unknown counts as in the air once it is armed and up.
fn is_airborne(state: &VehicleState) -> bool {
    state.armed
        && match state.landed {
            LandedState::OnGround => false,
            LandedState::InAir | LandedState::TakingOff | LandedState::Landing => true,
            LandedState::Unknown => -state.position_ned_m.z > 1.0 || state.velocity_ned_mps.norm() > 1.0,
        }
}
