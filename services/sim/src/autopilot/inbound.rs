//! Messages from clients.

use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{MAVLinkMessageRaw, MavHeader, Message, MessageData};

use super::commands::{Command, Place};
use super::signing::Signing;
use super::{Autopilot, Inbound, LinkId, Outbound, Param, Sticks, UnlistedAck};

/// The autopilot's component id.
const COMPONENT: u8 = 1;
/// MAV_RESULT_UNSUPPORTED.
const UNSUPPORTED: u8 = 3;

impl Autopilot {
    /// Takes a frame of valid checksum that came in on a link. With a key set, what is not rightly signed is not looked at.
    pub fn receive(&mut self, now: Stamp, link: LinkId, frame: &MAVLinkMessageRaw) {
        if self.signing.as_mut().is_none_or(|signing| signing.accepts(frame))
            && let Some(inbound) = Inbound::decode(frame)
        {
            self.handle(now, link, &inbound);
        }
    }

    /// Takes what came in on a link, signatures apart. What is for another system or component is not touched.
    pub fn handle(&mut self, now: Stamp, link: LinkId, inbound: &Inbound) {
        self.now = now;
        match inbound {
            Inbound::Message(header, message) => {
                let system = message.target_system_id().unwrap_or(0);
                let component = message.target_component_id().unwrap_or(0);
                let for_us = (system == 0 || system == self.system_id()) && (component == 0 || component == COMPONENT);
                if for_us {
                    self.dispatch(link, header, message);
                }
            }
            Inbound::UnknownCommand { header, command, target_system } => {
                if *target_system == 0 || *target_system == self.system_id() {
                    let (target_system, target_component) = (header.system_id as u8, header.component_id);
                    let ack = UnlistedAck { command: *command, result: UNSUPPORTED, target_system, target_component };
                    self.say(Some(link), Outbound::Acknowledgement(ack));
                }
            }
        }
    }

    fn dispatch(&mut self, link: LinkId, header: &MavHeader, message: &MavMessage) {
        let from = (header.system_id as u8, header.component_id);
        let from_pilot = f64::from(header.system_id) == self.params.get(Param::GroundStationId);
        match message {
            MavMessage::HEARTBEAT(_) if from_pilot => self.failsafe.gcs_heard_at = Some(self.now),
            MavMessage::COMMAND_LONG(data) => self.run_command(&Command {
                link,
                from,
                command: data.command,
                params: [data.param1, data.param2, data.param3, data.param4],
                place: Place::Long([data.param5, data.param6, data.param7]),
            }),
            MavMessage::COMMAND_INT(data) => self.run_command(&Command {
                link,
                from,
                command: data.command,
                params: [data.param1, data.param2, data.param3, data.param4],
                place: Place::Int { frame: data.frame, x: data.x, y: data.y, z: data.z },
            }),
            MavMessage::SET_MODE(data) => {
                let result = self.mode_by_number(data.base_mode.bits().into(), data.custom_mode) as u8;
                // ArduPilot acknowledges this message by its own number as if it were a command.
                let (target_system, target_component) = from;
                let ack = UnlistedAck { command: mav::SET_MODE_DATA::ID as u16, result, target_system, target_component };
                self.say(Some(link), Outbound::Acknowledgement(ack));
            }
            MavMessage::SET_POSITION_TARGET_LOCAL_NED(data) => self.local_target(data),
            MavMessage::SET_POSITION_TARGET_GLOBAL_INT(data) => self.global_target(data),
            MavMessage::REQUEST_DATA_STREAM(data) => {
                let now = self.now;
                let rate_hz = if data.start_stop == 0 { 0 } else { data.req_message_rate };
                if let Some(link) = self.links.iter_mut().find(|known| known.id == link) {
                    link.set_group(data.req_stream_id, rate_hz, now);
                }
            }
            MavMessage::RC_CHANNELS_OVERRIDE(data) if from_pilot => self.take_override(data),
            MavMessage::TIMESYNC(data) if data.tc1 == 0 => {
                let tc1 = (self.now.seconds_since(self.boot) * 1e9) as i64;
                let answer = mav::TIMESYNC_DATA { tc1, ts1: data.ts1, target_system: from.0, target_component: from.1 };
                self.reply(link, MavMessage::TIMESYNC(answer));
            }
            MavMessage::SETUP_SIGNING(data) => self.set_up_signing(data),
            MavMessage::PING(data) if data.target_system == 0 => {
                let answer = mav::PING_DATA { target_system: from.0, target_component: from.1, ..data.clone() };
                self.reply(link, MavMessage::PING(answer));
            }
            other => {
                if !self.parameter_protocol(link, other) {
                    self.mission_protocol(link, from, other);
                }
            }
        }
    }

    fn set_up_signing(&mut self, data: &mav::SETUP_SIGNING_DATA) {
        if self.armed {
            self.text(mav::MavSeverity::MAV_SEVERITY_ERROR, "ERROR: Won't setup signing when armed");
        } else {
            self.signing = Signing::from_setup(data);
        }
    }

    fn take_override(&mut self, data: &mav::RC_CHANNELS_OVERRIDE_DATA) {
        let asked_us = [
            data.chan1_raw,
            data.chan2_raw,
            data.chan3_raw,
            data.chan4_raw,
            data.chan5_raw,
            data.chan6_raw,
            data.chan7_raw,
            data.chan8_raw,
        ];
        let before_us = self.sticks.map_or([0; 8], |sticks| sticks.channels_us);
        // 65535 leaves a channel as it is, 0 gives it back.
        let mut channels_us = before_us;
        for (channel_us, asked_us) in channels_us.iter_mut().zip(asked_us) {
            if asked_us != u16::MAX {
                *channel_us = asked_us;
            }
        }
        self.sticks = channels_us.iter().any(|width_us| *width_us != 0).then_some(Sticks { channels_us, at: self.now });
        self.read_switch(&channels_us);
    }

    /// The mode switch acts when it moves, so that it does not fight a ground station.
    fn read_switch(&mut self, channels_us: &[u16; 8]) {
        let channel = (self.params.get(Param::ModeChannel) as usize).wrapping_sub(1);
        let Some(width_us) = channels_us.get(channel).copied().filter(|width_us| (900..=2200).contains(width_us)) else {
            self.switch = None;
            return;
        };
        let position = [1230, 1360, 1490, 1620, 1750].iter().filter(|edge_us| width_us > **edge_us).count();
        if self.switch == Some(position) {
            return;
        }
        self.switch = Some(position);
        let modes = [Param::Mode1, Param::Mode2, Param::Mode3, Param::Mode4, Param::Mode5, Param::Mode6];
        if let Some(param) = modes.get(position) {
            self.request_mode(self.params.get(*param) as u32);
        }
    }
}
