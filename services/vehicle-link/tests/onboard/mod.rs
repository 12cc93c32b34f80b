//! What the actor does between link and bus, without either: an executor and an autopilot's picture, stepped by hand.

#![allow(dead_code, reason = "each test uses its own part")]
#![allow(clippy::unwrap_used, reason = "a test ends at its first surprise")]

use std::collections::BTreeMap;

use halcyon_model::{FleetOrigin, Stamp, VehicleAction, VehicleCommand, VehicleId, VehicleState};
use halcyon_vehicle_link::Config;
use halcyon_vehicle_link::autopilot::Autopilot;
use halcyon_vehicle_link::core::commands::{Command, CommandError, Effect, Ticket};
use halcyon_vehicle_link::core::executor::{Decision, Executor, ExecutorConfig, Note, Output};
use halcyon_vehicle_link::core::guidance::Setpoint;
use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega::MavMessage;

/// Commands that people may have open at once, as the actor has it.
const WAITING_MAX: usize = 16;

/// How a person's command stands.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Reply {
    Accepted,
    Refused(String),
    /// The autopilot decides; [`Onboard::outcomes`] will say.
    Asked(Ticket, Command),
}

pub(crate) struct Onboard {
    pub(crate) executor: Executor,
    pub(crate) autopilot: Autopilot,
    pub(crate) vehicle: VehicleId,
    /// Of people's commands.
    pub(crate) outcomes: BTreeMap<Ticket, Result<(), CommandError>>,
    /// Open commands of people.
    pub(crate) open: BTreeMap<Ticket, Command>,
    /// Of the last step.
    pub(crate) setpoints: Vec<Setpoint>,
    pub(crate) notes: Vec<Note>,
    /// As the executor was told last.
    pub(crate) own: Option<VehicleState>,
    next_ticket: Ticket,
}

impl Onboard {
    pub(crate) fn new(config: &Config, origin: FleetOrigin, now: Stamp) -> Self {
        let vehicle = VehicleId::new(&config.vehicle).unwrap();
        let executor = Executor::new(ExecutorConfig {
            vehicle: vehicle.clone(),
            limits: config.limits.clone(),
            fail_safe: config.fail_safe.clone(),
            guidance: config.guidance.clone(),
            payload: config.payload.clone(),
            home_height_m: config.home_height_m,
            frame: origin.frame(),
        });
        Self {
            executor,
            autopilot: Autopilot::new(config, origin, now).unwrap(),
            vehicle,
            outcomes: BTreeMap::new(),
            open: BTreeMap::new(),
            setpoints: Vec::new(),
            notes: Vec::new(),
            own: None,
            next_ticket: 1,
        }
    }

    /// A frame came; what is sent at once.
    pub(crate) fn hear(&mut self, header: MavHeader, message: &MavMessage, now: Stamp) -> Vec<MavMessage> {
        let heard = self.autopilot.observe(header, message, now);
        let mut sent: Vec<_> = heard.reply.into_iter().collect();
        if let Some(text) = heard.text {
            self.executor.observe_text(&text, now);
        }
        if heard.transfer {
            let effects = self.autopilot.poll_transfers(now);
            self.carry_out(effects, now, &mut sent);
        }
        if heard.state
            && let Some((state, mode_heard)) = self.autopilot.state(now)
        {
            self.own = Some(state.clone());
            self.executor.observe_self(state, mode_heard, now);
        }
        sent
    }

    /// One guidance step; what is sent.
    pub(crate) fn tick(&mut self, now: Stamp) -> Vec<MavMessage> {
        let mut sent = Vec::new();
        self.setpoints.clear();
        self.notes.clear();
        for output in self.executor.step(now) {
            match output {
                Output::Setpoint(setpoint) => {
                    sent.extend(self.autopilot.setpoint(&setpoint, now));
                    self.setpoints.push(setpoint);
                }
                Output::Request(command) => {
                    if let Err(error) = self.autopilot.submit(0, command) {
                        self.executor.observe_outcome(&command, &Err(error), now);
                    }
                }
                Output::Withdraw => {
                    let ended = self.autopilot.withdraw(now);
                    self.carry_out(ended, now, &mut sent);
                }
                Output::AskStreams => self.autopilot.started_again(),
                Output::Note(note) => self.notes.push(note),
            }
        }
        let effects = self.autopilot.poll(now);
        self.carry_out(effects, now, &mut sent);
        sent
    }

    /// The link went down; what is sent.
    pub(crate) fn link_down(&mut self, now: Stamp) -> Vec<MavMessage> {
        let mut sent = Vec::new();
        let ended = self.autopilot.link_down();
        self.carry_out(ended, now, &mut sent);
        sent
    }

    /// A person's command, and what is sent at once.
    pub(crate) fn command(&mut self, action: VehicleAction, now: Stamp) -> (Reply, Vec<MavMessage>) {
        let (vehicle, deadline) = (self.vehicle.clone(), now.plus_secs_f64(30.0));
        let command = VehicleCommand { stamp: now, deadline, who: "test".into(), vehicle, action };
        let mut sent = Vec::new();
        let ticket = self.next_ticket;
        self.next_ticket += 1;
        let refused = |error: &dyn std::error::Error| Reply::Refused(error.to_string());
        let full = self.open.len() >= WAITING_MAX;
        let reply = match self.executor.command(&command, now) {
            Decision::Accepted(_) => Reply::Accepted,
            Decision::Refused(why) => Reply::Refused(why),
            Decision::Ask(command) if full && command != (Command::Disarm { force: true }) => refused(&CommandError::Busy),
            Decision::Ask(command) => match self.autopilot.submit(ticket, command) {
                Ok(()) => {
                    self.open.insert(ticket, command);
                    Reply::Asked(ticket, command)
                }
                Err(error) => refused(&error),
            },
            Decision::Transfer(request) => match self.autopilot.transfer(ticket, request, deadline) {
                Ok(()) => {
                    let effects = self.autopilot.poll_transfers(now);
                    self.carry_out(effects, now, &mut sent);
                    Reply::Accepted
                }
                Err(error) => refused(&error),
            },
            Decision::CancelTransfers => {
                let (_, ended) = self.autopilot.cancel_transfers();
                self.carry_out(ended, now, &mut sent);
                Reply::Accepted
            }
        };
        (reply, sent)
    }

    fn carry_out(&mut self, effects: Vec<Effect>, now: Stamp, sent: &mut Vec<MavMessage>) {
        for effect in effects {
            match effect {
                Effect::Send(message) => sent.push(message),
                Effect::Done(_, Command::SetInterval(_), _) | Effect::Transferred(..) => {}
                Effect::Done(ticket, command, outcome) => match self.open.remove(&ticket) {
                    Some(_) => drop(self.outcomes.insert(ticket, outcome)),
                    None => self.executor.observe_outcome(&command, &outcome, now),
                },
            }
        }
    }
}
