//! The payload: let go on the ground or the water only.
//!
//! In the air it is never released, however low: height is known to a metre or so, and what falls into the water from two may
//! break. On the ground counts what the autopilot says is landed, or a vehicle with its motors off that it doesn't call in the
//! air: on moving water its landed detection may be late, and with the motors off nothing flies.

use halcyon_model::{Activity, LandedState, Severity, Stamp, VehicleState};

use super::command::Decision;
use super::{Executor, Goal, Output};
use crate::core::commands::{Command, CommandError};

/// Tries by itself after a touchdown; then people are told.
const TRIES: u8 = 3;

/// The payload of one landing.
#[derive(Debug, Default)]
pub(super) struct Release {
    done: bool,
    tries: u8,
}

impl Executor {
    /// A person asks for it.
    pub(super) fn payload(&self, own: &VehicleState, releases: bool) -> Result<Decision, String> {
        let command = self.config.payload.command(releases).ok_or("no payload is configured (vehicle_link.payload.kind)")?;
        if releases {
            on_ground_or_water(own)?;
        }
        Ok(Decision::Ask(Command::Payload(command)))
    }

    /// After a planned landing, if it was asked for in the configuration.
    pub(super) fn release_on_touchdown(&mut self, own: &VehicleState, now: Stamp, outputs: &mut Vec<Output>) {
        let planned = self.direct.is_none() && matches!(self.active, Some(Goal::Land { .. }));
        if !planned || self.airborne {
            self.release = Release::default();
            return;
        }
        let landed = self.activity == Activity::Landed && self.touchdown.is_some() && !own.armed;
        if !self.config.payload.release_on_touchdown || self.release.done || !landed || on_ground_or_water(own).is_err() {
            return;
        }
        let Some(command) = self.config.payload.command(true) else { return };
        let before = outputs.len();
        self.request(Command::Payload(command), now, outputs);
        if outputs.len() > before {
            self.release.tries += 1;
        }
    }

    /// How a request about the payload ended.
    pub(super) fn observe_payload(&mut self, command: &Command, outcome: &Result<(), CommandError>) {
        if !matches!(command, Command::Payload(payload) if payload.releases) || self.release.done {
            return;
        }
        if outcome.is_ok() {
            self.release.done = true;
            self.note(Severity::Info, "payload released", "after touchdown");
        } else if self.release.tries >= TRIES {
            self.release.done = true;
            self.note(Severity::Warning, "payload not released", format!("after {TRIES} tries; release it by command"));
        }
    }
}

fn on_ground_or_water(own: &VehicleState) -> Result<(), String> {
    match own.landed {
        LandedState::OnGround => Ok(()),
        LandedState::Unknown if !own.armed => Ok(()),
        LandedState::Unknown => Err("not known to be on the ground or the water".into()),
        LandedState::TakingOff | LandedState::InAir | LandedState::Landing => {
            Err("in the air: the payload is released on the ground or the water".into())
        }
    }
}
