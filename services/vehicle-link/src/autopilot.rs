//! One autopilot on a link: finds it, asks for its streams, keeps its telemetry and the commands under way. Synchronous: messages
//! in, messages to send out.

use halcyon_model::{FleetOrigin, Stamp, VehicleState};
use mavlink::dialects::ardupilotmega::{MavAutopilot, MavMessage};
use mavlink::{MavHeader, Message as _};

use crate::config::Config;
use crate::core::commands::{Command, CommandError, Commands, Effect, Ticket};
use crate::core::encode::{self, Address, Datum};
use crate::core::guidance::Setpoint;
use crate::core::local::LocalFinder;
use crate::core::streams::Streams;
use crate::core::telemetry::Telemetry;
use crate::core::text::Texts;
use crate::core::transfers::{Request, TransferError, Transfers};

/// MAV_COMP_ID_ONBOARD_COMPUTER.
const OWN_COMPONENT: u8 = 191;
/// MAV_COMP_ID_AUTOPILOT1.
const AUTOPILOT_COMPONENT: u8 = 1;
/// Our system id before the vehicle's is known: not a ground station's (255), not a likely vehicle's.
const SYSTEM_BEFORE: u8 = 245;

/// What a message brought.
#[derive(Debug, Default)]
pub struct Heard {
    /// The vehicle's picture moved on.
    pub state: bool,
    /// The autopilot said this.
    pub text: Option<String>,
    /// This is the first time that the autopilot was heard.
    pub found: Option<u8>,
    /// A transfer may have something to answer: [`Autopilot::poll_transfers`].
    pub transfer: bool,
}

/// The autopilot of one vehicle.
#[derive(Debug)]
pub struct Autopilot {
    wanted: Option<u8>,
    address: Option<Address>,
    datum: Datum,
    local: LocalFinder,
    telemetry: Telemetry,
    streams: Streams,
    texts: Texts,
    commands: Commands,
    transfers: Transfers,
    started: Stamp,
}

impl Autopilot {
    /// As configured; `role` and `vehicle` were validated.
    ///
    /// # Errors
    /// If they were not.
    pub fn new(config: &Config, origin: FleetOrigin, now: Stamp) -> anyhow::Result<Self> {
        let vehicle = halcyon_model::VehicleId::new(&config.vehicle)?;
        let role = config.role().map_err(anyhow::Error::msg)?;
        Ok(Self {
            wanted: (config.system_id != 0).then_some(config.system_id),
            address: None,
            datum: Datum { frame: origin.frame(), home_height_m: config.home_height_m },
            local: LocalFinder::default(),
            telemetry: Telemetry::new(vehicle, role, origin, config.home_height_m),
            streams: Streams::default(),
            texts: Texts::default(),
            commands: Commands::default(),
            transfers: Transfers::default(),
            started: now,
        })
    }

    /// Takes a message from the link; what others say is not heard.
    pub fn observe(&mut self, header: MavHeader, message: &MavMessage, now: Stamp) -> Heard {
        let mut heard = Heard::default();
        if header.component_id != AUTOPILOT_COMPONENT {
            return heard;
        }
        let Ok(system) = u8::try_from(header.system_id) else { return heard };
        if self.address.is_none()
            && let MavMessage::HEARTBEAT(data) = message
            && data.autopilot != MavAutopilot::MAV_AUTOPILOT_INVALID
            && self.wanted.is_none_or(|wanted| wanted == system)
        {
            self.address = Address::new(system, AUTOPILOT_COMPONENT);
            heard.found = self.address.map(Address::system);
        }
        if self.address.is_none_or(|address| address.system() != system) {
            return heard;
        }
        self.streams.observe(message.message_id(), now);
        self.local.observe(message, &self.datum, now);
        heard.transfer = self.transfers.observe(message, (system, OWN_COMPONENT), now);
        match message {
            MavMessage::STATUSTEXT(data) => heard.text = self.texts.observe(data, now).map(|text| text.text.clone()),
            MavMessage::COMMAND_ACK(data) => self.commands.observe_ack(data, system, OWN_COMPONENT, now),
            other => heard.state = self.telemetry.observe(other, now),
        }
        heard
    }

    /// Whether the autopilot has been heard.
    #[must_use]
    pub fn found(&self) -> bool {
        self.address.is_some()
    }

    /// The state, if it is complete, and when its mode was heard.
    #[must_use]
    pub fn state(&self, now: Stamp) -> Option<(VehicleState, Stamp)> {
        Some((self.telemetry.state(now)?, self.telemetry.heartbeat_heard()?))
    }

    /// What is missing for a state.
    #[must_use]
    pub fn missing(&self) -> &'static str {
        self.telemetry.missing()
    }

    /// Puts a command in line. Never before the autopilot is heard: what waited for it would be carried out when whoever asked has
    /// long given up.
    ///
    /// # Errors
    /// [`CommandError::NotHeard`], or as [`Commands::submit`].
    pub fn submit(&mut self, ticket: Ticket, command: Command) -> Result<(), CommandError> {
        if self.address.is_none() {
            return Err(CommandError::NotHeard);
        }
        self.commands.submit(ticket, command)
    }

    /// Stops asking for anything that moves the vehicle.
    pub fn withdraw(&mut self) -> Vec<Effect> {
        self.commands.withdraw(self.address, self.telemetry.mode())
    }

    /// The connection was lost: whoever answers next may be another program, or the autopilot after a restart.
    pub fn link_down(&mut self) -> Vec<Effect> {
        self.address = None;
        self.local = LocalFinder::default();
        self.streams = Streams::default();
        let mut ended = self.commands.abandon();
        ended.extend(self.transfers.abandon());
        ended
    }

    /// Puts a transfer in line; it ends at `deadline`.
    ///
    /// # Errors
    /// [`TransferError::NotHeard`], or as [`Transfers::submit`].
    pub fn transfer(&mut self, ticket: Ticket, request: Request, deadline: Stamp) -> Result<(), TransferError> {
        if self.address.is_none() {
            return Err(TransferError::NotHeard);
        }
        self.transfers.submit(ticket, request, deadline)
    }

    /// What a transfer has to send or to tell now.
    pub fn poll_transfers(&mut self, now: Stamp) -> Vec<Effect> {
        self.address.map_or_else(Vec::new, |address| self.transfers.poll(address, now))
    }

    /// Ends the transfers; returns how many there were.
    pub fn cancel_transfers(&mut self) -> (usize, Vec<Effect>) {
        self.transfers.cancel(self.address)
    }

    /// What is being transferred, since when, and how much of how much is done.
    #[must_use]
    pub fn transferring(&self) -> Option<(&str, Stamp, usize, usize)> {
        self.transfers.progress()
    }

    /// The autopilot started again: its streams are asked for afresh, and its local frame is another.
    pub fn started_again(&mut self) {
        self.local = LocalFinder::default();
        self.streams = Streams::default();
    }

    /// What is due: commands to send or to end, streams to ask for.
    pub fn poll(&mut self, now: Stamp) -> Vec<Effect> {
        let Some(address) = self.address else { return Vec::new() };
        for stream in self.streams.due(now) {
            // A full line is tried again with the next retry of the stream.
            let _ = self.commands.submit(0, Command::SetInterval(stream));
        }
        let mut effects = self.commands.poll(address, &self.texts, now);
        effects.extend(self.transfers.poll(address, now));
        effects
    }

    /// A setpoint for the autopilot; `None` before it was heard, or if a number is not finite.
    #[must_use]
    pub fn setpoint(&self, setpoint: &Setpoint, now: Stamp) -> Option<MavMessage> {
        let boot_ms = (now.seconds_since(self.started) * 1e3) as u64 as u32;
        encode::setpoint(setpoint, &self.datum, self.local.shift_ned_m(now), self.address?, boot_ms)
    }

    /// Our header: same system as the vehicle, as its onboard computer.
    #[must_use]
    pub fn header(&self) -> MavHeader {
        let system = self.address.map(Address::system).or(self.wanted).unwrap_or(SYSTEM_BEFORE);
        MavHeader { system_id: system.into(), component_id: OWN_COMPONENT, sequence: 0 }
    }
}

#[cfg(test)]
mod tests {
    use mavlink::dialects::ardupilotmega as ardu;

    use super::*;

    fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
    }

    fn heartbeat() -> (MavHeader, MavMessage) {
        let data =
            ardu::HEARTBEAT_DATA { autopilot: MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA, custom_mode: 4, ..Default::default() };
        (MavHeader { system_id: 7u8.into(), component_id: AUTOPILOT_COMPONENT, sequence: 0 }, MavMessage::HEARTBEAT(data))
    }

    fn terminations(effects: &[Effect]) -> usize {
        let is_one =
            |effect: &&Effect| matches!(effect, Effect::Send(MavMessage::COMMAND_LONG(data)) if data.param2 == 21196.0);
        effects.iter().filter(is_one).count()
    }

    #[test]
    fn a_command_does_not_wait_for_an_autopilot_that_comes_back_later() {
        let origin = FleetOrigin(halcyon_model::Geodetic::from_deg(53.1, -2.9, 0.0));
        let mut autopilot = Autopilot::new(&Config::default(), origin, t(0.0)).unwrap();
        let (header, message) = heartbeat();
        assert_eq!(autopilot.submit(1, Command::Arm), Err(CommandError::NotHeard));
        autopilot.observe(header, &message, t(0.0));
        assert_eq!(autopilot.submit(2, Command::SetMode(halcyon_model::FlightMode::Loiter)), Ok(()));
        autopilot.link_down();
        assert_eq!(autopilot.submit(3, Command::Disarm { force: true }), Err(CommandError::NotHeard));
        autopilot.observe(header, &message, t(9.0));
        assert_eq!(terminations(&autopilot.poll(t(9.0))), 0, "the motors would stop nine seconds after the refusal");
    }
}
