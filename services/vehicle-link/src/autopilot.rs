//! One autopilot on a link: finds it, asks for its streams, keeps its telemetry and the commands under way. Synchronous: messages
//! in, messages to send out.

use halcyon_model::{FleetOrigin, FlightMode, LinkQuality, Stamp, VehicleState};
use mavlink::dialects::ardupilotmega::{MavAutopilot, MavCmd, MavMessage};
use mavlink::{MavHeader, Message as _};

use crate::config::Config;
use crate::core::coasting;
use crate::core::commands::{Command, CommandError, Commands, Effect, Refusal, Ticket};
use crate::core::encode::{self, Address, Datum};
use crate::core::guidance::Setpoint;
use crate::core::identity::{self, Identity};
use crate::core::local::LocalFinder;
use crate::core::loss::Loss;
use crate::core::mode::Family;
use crate::core::px4::{self, Offboard};
use crate::core::streams::Streams;
use crate::core::telemetry::Telemetry;
use crate::core::text::Texts;
use crate::core::timesync::TimeSync;
use crate::core::transfers::{Request, TransferError, Transfers};
use crate::core::unlisted::Unlisted;

/// MAV_COMP_ID_ONBOARD_COMPUTER.
pub(crate) const OWN_COMPONENT: u8 = 191;
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
    /// To be answered with this.
    pub reply: Option<MavMessage>,
}

/// The autopilot of one vehicle.
#[derive(Debug)]
pub struct Autopilot {
    wanted: Option<u8>,
    address: Option<Address>,
    /// With the home that it took off from.
    datum_of_flight: Datum,
    local: LocalFinder,
    telemetry: Telemetry,
    streams: Streams,
    texts: Texts,
    commands: Commands,
    transfers: Transfers,
    identity: Identity,
    offboard: Offboard,
    sync: TimeSync,
    loss: Loss,
    is_signed: bool,
    /// Who was heard, and won't be flown.
    unfit: Option<String>,
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
            datum_of_flight: Datum { frame: origin.frame(), home_height_m: config.home_height_m },
            local: LocalFinder::default(),
            telemetry: Telemetry::new(vehicle, role, origin, config.home_height_m),
            streams: Streams::default(),
            texts: Texts::default(),
            commands: Commands::default(),
            transfers: Transfers::default(),
            identity: Identity::default(),
            offboard: Offboard::default(),
            sync: TimeSync::default(),
            loss: Loss::default(),
            is_signed: !config.signing.key_file.as_os_str().is_empty(),
            unfit: None,
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
            self.unfit = identity::unfit(data).map(|why| format!("MAVLink system {system}: {why}"));
            if self.unfit.is_none() {
                self.address = Address::new(system, AUTOPILOT_COMPONENT);
                heard.found = self.address.map(Address::system);
            }
        }
        let Some(address) = self.address.filter(|address| address.system() == system) else { return heard };
        self.count(header, now);
        self.identity.observe(message);
        self.telemetry.set_boot_offset_ns(self.sync.offset_ns(now));
        self.streams.observe(message.message_id(), now);
        heard.transfer = self.transfers.observe(message, (system, OWN_COMPONENT), now);
        match message {
            MavMessage::STATUSTEXT(data) => heard.text = self.texts.observe(data, now).map(|text| text.text.clone()),
            MavMessage::TIMESYNC(data) => heard.reply = self.sync.observe(data, address, now),
            MavMessage::COMMAND_ACK(data) => self.commands.observe_ack(data, system, OWN_COMPONENT, now),
            other => heard.state = self.telemetry.observe(other, now),
        }
        // After the telemetry, which knows by this message whether home was set anew.
        self.local.observe(message, &self.datum(), now);
        heard
    }

    /// A frame of a message or a value that is not known: it counts as received. Returns whether a transfer may have something to
    /// answer, for what it says all the same.
    pub fn observe_unread(&mut self, header: MavHeader, answer: Option<&Unlisted>, now: Stamp) -> bool {
        let from_it = |address: &Address| u32::from(address.system()) == header.system_id;
        let Some(address) = self.address.filter(from_it).filter(|_| header.component_id == AUTOPILOT_COMPONENT) else {
            return false;
        };
        self.count(header, now);
        let Some(answer) = answer else { return false };
        self.commands.observe_unlisted(answer, address.system(), OWN_COMPONENT, now);
        self.transfers.observe_unlisted(answer, (address.system(), OWN_COMPONENT))
    }

    fn count(&mut self, header: MavHeader, now: Stamp) {
        let missing = self.loss.observe(header.sequence, now);
        if missing > 0 {
            metrics::counter!("vehicle_link_frames_lost_total").increment(missing.into());
        }
    }

    /// Share of the autopilot's frames lost lately, 0 to 1.
    #[must_use]
    pub fn loss(&self) -> f64 {
        self.loss.share()
    }

    /// Whether a message for `system` is for our autopilot; 0 is everybody.
    #[must_use]
    pub fn is_system(&self, system: u8) -> bool {
        self.address.is_some_and(|address| system == 0 || address.system() == system)
    }

    /// Whether the autopilot has been heard.
    #[must_use]
    pub fn found(&self) -> bool {
        self.address.is_some()
    }

    /// The state, if it is complete, and when its mode was heard.
    #[must_use]
    pub fn state(&self, now: Stamp) -> Option<(VehicleState, Stamp)> {
        let mut state = self.telemetry.state(now)?;
        state.link = Some(LinkQuality {
            loss: self.loss.share(),
            round_trip_s: self.sync.round_trip_s(now),
            received: self.loss.received(),
            is_signed: self.is_signed,
        });
        state.firmware = self.identity.firmware().cloned();
        Some((state, self.telemetry.heartbeat_heard()?))
    }

    /// What is missing for a state.
    #[must_use]
    pub fn missing(&self) -> &str {
        match &self.unfit {
            Some(unfit) if self.address.is_none() => unfit,
            _ => self.telemetry.missing(),
        }
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
        if let Command::SetMode(mode) = command {
            let family = self.identity.family();
            if family.set_mode_parameters(mode).is_none() {
                let words = Some("it has no such mode".into());
                return Err(CommandError::Refused { result: Refusal::Listed("unsupported"), words });
            }
            if family == Family::Px4 && mode == FlightMode::Guided {
                return self.offboard.want(ticket);
            }
        }
        self.commands.submit(ticket, command)
    }

    /// Stops asking for anything that moves the vehicle.
    pub fn withdraw(&mut self, now: Stamp) -> Vec<Effect> {
        let mut ended = self.offboard.end(&CommandError::Withdrawn);
        ended.extend(self.commands.withdraw(self.address, self.telemetry.mode(), now));
        ended
    }

    /// The connection was lost: whoever answers next may be another program, or the autopilot after a restart.
    pub fn link_down(&mut self) -> Vec<Effect> {
        self.address = None;
        self.local = LocalFinder::default();
        self.streams = Streams::default();
        self.identity = Identity::default();
        self.sync = TimeSync::default();
        self.loss = Loss::default();
        self.unfit = None;
        let mut ended = self.offboard.end(&CommandError::LinkLost);
        ended.extend(self.commands.abandon());
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

    /// Asks ArduPilot for what its behaviour depends on, as [`super::core::coasting`] says; the answer bears `ticket`.
    pub fn ask_coasting(&mut self, ticket: Ticket, now: Stamp) {
        const ANSWER_S: f64 = 3.0;
        if let Some(request) = coasting::request().filter(|_| self.identity.family() == Family::ArduPilot) {
            // Without an answer nothing is told.
            let _ = self.transfer(ticket, request, now.plus_secs_f64(ANSWER_S));
        }
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

    /// Which streams come less often than was asked for, in words; once.
    pub fn slow_streams(&mut self) -> Option<String> {
        self.streams.complaint()
    }

    /// The autopilot started again: its streams are asked for afresh, and its local frame is another.
    pub fn started_again(&mut self) {
        self.local = LocalFinder::default();
        self.streams = Streams::default();
        self.sync = TimeSync::default();
    }

    /// What is due: commands to send or to end, streams to ask for.
    pub fn poll(&mut self, now: Stamp) -> Vec<Effect> {
        let Some(address) = self.address else { return Vec::new() };
        let family = self.identity.family();
        for stream in self.streams.due(self.loss.share(), now).into_iter().filter(|stream| stream.suits(family)) {
            // A full line is tried again with the next retry of the stream.
            let _ = self.commands.submit(0, Command::SetInterval(stream));
        }
        let (streams, due) = self.offboard.step(self.telemetry.mode(), now);
        let mut effects = Vec::new();
        for ticket in due {
            let command = Command::SetMode(FlightMode::Guided);
            if let Err(error) = self.commands.submit(ticket, command) {
                effects.push(Effect::Done(ticket, command, Err(error)));
            }
        }
        if let (Some((mode, armed)), Some(heard)) = (self.telemetry.mode_and_armed(), self.telemetry.heartbeat_heard()) {
            self.commands.observe_heartbeat(mode, armed, heard);
        }
        effects.extend(self.commands.poll(address, &self.texts, now));
        self.count_from_home(&mut effects);
        if family == Family::Px4 {
            effects = effects.into_iter().filter_map(|effect| self.fitted(effect)).collect();
        }
        if streams {
            effects.extend(self.hold(now).map(Effect::Send));
        }
        effects.extend(self.transfers.poll(address, now));
        effects.extend(self.sync.ask(address, now).map(Effect::Send));
        effects.extend(self.identity.ask(address, now).map(Effect::Send));
        effects
    }

    /// A take-off's height is above the home that the autopilot counts from now.
    fn count_from_home(&self, effects: &mut [Effect]) {
        let rise_m = self.telemetry.home_rise_m() as f32;
        for effect in effects {
            match effect {
                Effect::Send(MavMessage::COMMAND_LONG(data)) if data.command == MavCmd::MAV_CMD_NAV_TAKEOFF => {
                    data.param7 -= rise_m;
                }
                Effect::Send(MavMessage::COMMAND_INT(data)) if data.command == MavCmd::MAV_CMD_NAV_TAKEOFF => data.z -= rise_m,
                _ => {}
            }
        }
    }

    fn fitted(&self, effect: Effect) -> Option<Effect> {
        match effect {
            Effect::Send(message) => px4::fitted(message, self.telemetry.home_amsl_m()).map(Effect::Send),
            other @ (Effect::Done(..) | Effect::Transferred(..)) => Some(other),
        }
    }

    /// A setpoint where the vehicle is.
    fn hold(&self, now: Stamp) -> Option<MavMessage> {
        let place = Setpoint {
            position_ned_m: self.telemetry.state(now)?.position_ned_m,
            velocity_ned_mps: nalgebra::Vector3::zeros(),
            acceleration_ned_mps2: None,
            heading_rad: None,
        };
        self.setpoint(&place, now)
    }

    /// A setpoint for the autopilot; `None` before it was heard, or if a number is not finite.
    #[must_use]
    pub fn setpoint(&self, setpoint: &Setpoint, now: Stamp) -> Option<MavMessage> {
        let boot_ms = (now.seconds_since(self.started) * 1e3) as u64 as u32;
        let prefers_local = self.identity.family() == Family::Px4;
        encode::setpoint(setpoint, &self.datum(), self.local.shift_ned_m(now), prefers_local, self.address?, boot_ms)
    }

    /// Its home may have been set anew in flight: it counts heights from there.
    fn datum(&self) -> Datum {
        let home_height_m = self.datum_of_flight.home_height_m + self.telemetry.home_rise_m();
        Datum { home_height_m, ..self.datum_of_flight }
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

    /// What the autopilot says takes 80 ms to come, always: only TIMESYNC can tell.
    #[test]
    fn positions_are_dated_by_timesync() {
        let origin = FleetOrigin(halcyon_model::Geodetic::from_deg(53.1, -2.9, 0.0));
        let mut autopilot = Autopilot::new(&Config::default(), origin, t(0.0)).unwrap();
        let (mut header, beat) = heartbeat();
        autopilot.observe(header, &beat, t(0.0));
        autopilot.observe(header, &MavMessage::ATTITUDE(ardu::ATTITUDE_DATA::default()), t(0.0));
        for step in 1..50 {
            header.sequence += 1;
            let now_s = f64::from(step) * 0.1;
            let questions = autopilot.poll(t(now_s)).into_iter().filter_map(|effect| match effect {
                Effect::Send(MavMessage::TIMESYNC(question)) => Some(question),
                _ => None,
            });
            let questions: Vec<_> = questions.collect();
            let boot_ms = 100_000 + step as u32 * 100;
            let position = ardu::GLOBAL_POSITION_INT_DATA {
                time_boot_ms: boot_ms,
                lat: 531_000_000,
                lon: -29_000_000,
                ..Default::default()
            };
            autopilot.observe(header, &MavMessage::GLOBAL_POSITION_INT(position), t(now_s + 0.08));
            let (state, _) = autopilot.state(t(now_s + 0.08)).unwrap();
            let error_s = state.stamp.seconds_since(t(now_s));
            if step == 1 {
                assert!((error_s - 0.08).abs() < 1e-3, "before the answer: {error_s}");
            } else if step > 3 {
                assert!(error_s.abs() < 1e-3, "{step}: {error_s}");
                assert!((state.link.unwrap().round_trip_s.unwrap() - 0.16).abs() < 1e-3);
            }
            for question in questions {
                // There in 80 ms, back in 80 ms; booted at t(-100).
                let answer = ardu::TIMESYNC_DATA { tc1: ((100.0 + now_s + 0.08) * 1e9) as i64, ..question };
                autopilot.observe(header, &MavMessage::TIMESYNC(answer), t(now_s + 0.16));
            }
        }
    }

    /// Home set anew where it hovers, 5 m up: it counts from there, so that its own place is at 0 for it, in both forms of a setpoint.
    #[test]
    fn a_setpoint_counts_from_a_home_that_was_set_anew_in_flight() {
        let origin = FleetOrigin(halcyon_model::Geodetic::from_deg(53.1, -2.9, 0.0));
        let mut autopilot = Autopilot::new(&Config::default(), origin, t(0.0)).unwrap();
        let (header, MavMessage::HEARTBEAT(beat)) = heartbeat() else { panic!() };
        let armed = ardu::HEARTBEAT_DATA { base_mode: ardu::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, ..beat };
        let landed_state = ardu::MavLandedState::MAV_LANDED_STATE_IN_AIR;
        let home = |altitude| {
            let (latitude, longitude) = (531_000_000, -29_000_000);
            MavMessage::HOME_POSITION(ardu::HOME_POSITION_DATA { latitude, longitude, altitude, ..Default::default() })
        };
        let position = |relative_alt| {
            MavMessage::GLOBAL_POSITION_INT(ardu::GLOBAL_POSITION_INT_DATA {
                time_boot_ms: 1000,
                lat: 531_000_000,
                lon: -29_000_000,
                alt: 45_000,
                relative_alt,
                ..Default::default()
            })
        };
        let local = ardu::LOCAL_POSITION_NED_DATA { time_boot_ms: 1000, x: 2.0, y: 3.0, z: -7.0, ..Default::default() };
        let landed = ardu::EXTENDED_SYS_STATE_DATA { landed_state, ..Default::default() };
        let mut hear = |message: MavMessage, at_s: f64| drop(autopilot.observe(header, &message, t(at_s)));
        hear(MavMessage::HEARTBEAT(armed), 0.0);
        hear(MavMessage::ATTITUDE(ardu::ATTITUDE_DATA::default()), 0.0);
        hear(home(40_000), 0.0);
        hear(MavMessage::EXTENDED_SYS_STATE(landed), 0.0);
        hear(position(5_000), 9.0);
        hear(home(45_000), 9.5);
        hear(position(0), 9.6);
        hear(MavMessage::LOCAL_POSITION_NED(local), 9.6);
        let (state, _) = autopilot.state(t(9.6)).unwrap();
        assert!((state.position_ned_m.z + 5.0).abs() < 1e-9, "{}", state.position_ned_m);
        let here = |acceleration_ned_mps2| Setpoint {
            position_ned_m: state.position_ned_m,
            velocity_ned_mps: nalgebra::Vector3::zeros(),
            acceleration_ned_mps2,
            heading_rad: None,
        };
        let Some(MavMessage::SET_POSITION_TARGET_GLOBAL_INT(sent)) = autopilot.setpoint(&here(None), t(9.6)) else { panic!() };
        assert!(sent.alt.abs() < 1e-6, "{}", sent.alt);
        let with = here(Some(nalgebra::Vector3::zeros()));
        let Some(MavMessage::SET_POSITION_TARGET_LOCAL_NED(sent)) = autopilot.setpoint(&with, t(9.6)) else { panic!() };
        assert!((sent.z + 7.0).abs() < 1e-6, "{}", sent.z);
        autopilot.submit(1, Command::TakeOff { height_above_home_m: 5.0 }).unwrap();
        let take_off = autopilot.poll(t(9.6)).into_iter().find_map(|effect| match effect {
            Effect::Send(MavMessage::COMMAND_LONG(data)) if data.command == MavCmd::MAV_CMD_NAV_TAKEOFF => Some(data.param7),
            _ => None,
        });
        assert_eq!(take_off, Some(0.0), "home is as high as it was to climb");
        // No home is a thousand kilometres lower.
        autopilot.observe(header, &home(-1_000_000_000), t(9.7));
        autopilot.observe(header, &position(5_000), t(9.7));
        assert!((autopilot.state(t(9.7)).unwrap().0.position_ned_m.z + 5.0).abs() < 1e-9);
    }

    /// The link hands over what the dialect can't read; answers among it are answers.
    #[test]
    fn an_unread_answer_counts_if_it_is_its_own() {
        let origin = FleetOrigin(halcyon_model::Geodetic::from_deg(53.1, -2.9, 0.0));
        let mut autopilot = Autopilot::new(&Config::default(), origin, t(0.0)).unwrap();
        let (header, beat) = heartbeat();
        autopilot.observe(header, &beat, t(0.0));
        autopilot.submit(3, Command::Arm).unwrap();
        autopilot.poll(t(0.0));
        let ack = ardu::COMMAND_ACK_DATA {
            command: ardu::MavCmd::MAV_CMD_COMPONENT_ARM_DISARM,
            target_system: 7,
            target_component: OWN_COMPONENT,
            ..Default::default()
        };
        let answer = Unlisted::Ack(ack, 11);
        let refusals = |effects: Vec<Effect>| {
            effects.iter().filter(|effect| matches!(effect, Effect::Done(3, _, Err(CommandError::Refused { .. })))).count()
        };
        autopilot.observe_unread(MavHeader { system_id: 8, ..header }, Some(&answer), t(0.1));
        assert_eq!(refusals(autopilot.poll(t(0.5))), 0, "another vehicle's");
        autopilot.observe_unread(header, Some(&answer), t(0.5));
        assert_eq!(refusals(autopilot.poll(t(0.9))), 1);
    }

    #[test]
    fn another_vehicle_or_another_component_is_not_heard() {
        let origin = FleetOrigin(halcyon_model::Geodetic::from_deg(53.1, -2.9, 0.0));
        let mut autopilot = Autopilot::new(&Config::default(), origin, t(0.0)).unwrap();
        let (header, beat) = heartbeat();
        let zero = MavHeader { system_id: 0, ..header };
        assert_eq!(autopilot.observe(zero, &beat, t(0.0)).found, None, "system 0 is everybody");
        let gimbal = MavHeader { component_id: 154, ..header };
        assert_eq!(autopilot.observe(gimbal, &beat, t(0.0)).found, None);
        assert_eq!(autopilot.observe(header, &beat, t(0.0)).found, Some(7));
        let other = MavHeader { system_id: 8, sequence: 99, ..header };
        assert_eq!(autopilot.observe(other, &beat, t(0.1)).found, None);
        assert!(!autopilot.observe(other, &beat, t(0.1)).state);
        assert!(autopilot.loss() < 1e-9, "the other one's numbers are not its own");
    }
}
