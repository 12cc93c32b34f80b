//! MAVLink frames in and out, versions 1 and 2, including what the dialect has no word for.

use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::error::ParserError;
use mavlink::{MAVLinkMessageRaw, MAVLinkV1MessageRaw, MAVLinkV2MessageRaw, MavHeader, MavlinkVersion, Message, MessageData};

use super::signing::{SIGNED, Signing};

/// Ids of COMMAND_INT and COMMAND_LONG, and where both keep the command's number, its target system and component.
const COMMAND_IDS: [u32; 2] = [75, 76];
const COMMAND_OFFSET: usize = 28;

/// A frame that was understood.
#[derive(Debug, Clone)]
#[allow(
    clippy::large_enum_variant,
    reason = "the large one is the usual one, and a box for each would be an allocation a message"
)]
pub enum Inbound {
    /// A message of the dialect.
    Message(MavHeader, MavMessage),
    /// A command whose number the dialect does not know: it must still be answered.
    UnknownCommand {
        /// Who asks.
        header: MavHeader,
        /// The number.
        command: u16,
        /// Whom.
        target_system: u8,
    },
}

impl Inbound {
    /// What a frame of valid checksum says; `None` when it says nothing that this dialect has.
    #[must_use]
    pub fn decode(raw: &MAVLinkMessageRaw) -> Option<Self> {
        let header = MavHeader { system_id: raw.system_id(), component_id: raw.component_id(), sequence: raw.sequence() };
        match MavMessage::parse(raw.version(), raw.message_id(), raw.payload()) {
            Ok(message) => Some(Self::Message(header, message)),
            Err(ParserError::InvalidEnum { enum_type: "MavCmd", .. }) if COMMAND_IDS.contains(&raw.message_id()) => {
                // MAVLink 2 leaves out trailing zeros.
                let byte = |offset: usize| raw.payload().get(offset).copied().unwrap_or(0);
                Some(Self::UnknownCommand {
                    header,
                    command: u16::from_le_bytes([byte(COMMAND_OFFSET), byte(COMMAND_OFFSET + 1)]),
                    target_system: byte(COMMAND_OFFSET + 2),
                })
            }
            Err(_) => None,
        }
    }
}

/// What the autopilot says.
#[derive(Debug, Clone)]
#[allow(
    clippy::large_enum_variant,
    reason = "the large one is the usual one, and a box for each would be an allocation a message"
)]
pub enum Outbound {
    /// A message of the dialect.
    Message(MavMessage),
    /// An answer to a number that the dialect knows as no command.
    Acknowledgement(UnlistedAck),
}

impl Outbound {
    /// The message's id.
    #[must_use]
    pub fn message_id(&self) -> u32 {
        match self {
            Self::Message(message) => message.message_id(),
            Self::Acknowledgement(_) => UnlistedAck::ID,
        }
    }

    /// Appends the frame to `bytes`. A message that MAVLink 1 can't carry is left out of a version 1 stream.
    pub fn encode(&self, version: MavlinkVersion, header: MavHeader, bytes: &mut Vec<u8>) {
        self.encode_signed(version, header, None, bytes);
    }

    /// The same, signed where the version allows it, as the link of that number.
    pub(super) fn encode_signed(
        &self,
        version: MavlinkVersion,
        header: MavHeader,
        signing: Option<(&mut Signing, u8)>,
        bytes: &mut Vec<u8>,
    ) {
        match version {
            MavlinkVersion::V2 => {
                let mut frame = MAVLinkV2MessageRaw::new();
                match (self, signing.is_some()) {
                    (Self::Message(message), false) => frame.serialize_message(header, message),
                    (Self::Message(message), true) => frame.serialize_message_for_signing(header, message),
                    (Self::Acknowledgement(ack), signed) => {
                        *frame.incompatibility_flags_mut() = if signed { SIGNED } else { 0 };
                        frame.serialize_message_data(header, ack);
                    }
                }
                if let Some((signing, link_id)) = signing {
                    signing.sign(&mut frame, link_id);
                }
                bytes.extend_from_slice(frame.raw_bytes());
            }
            MavlinkVersion::V1 if self.message_id() <= 255 && header.system_id <= 255 => {
                let mut frame = MAVLinkV1MessageRaw::new();
                match self {
                    Self::Message(message) => frame.serialize_message(header, message),
                    Self::Acknowledgement(ack) => frame.serialize_message_data(header, ack),
                }
                bytes.extend_from_slice(frame.raw_bytes());
            }
            MavlinkVersion::V1 => {}
        }
    }
}

/// A COMMAND_ACK for any number: the dialect's own can only name commands that it knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct UnlistedAck {
    /// The command's number.
    pub command: u16,
    /// What became of it, a MAV_RESULT.
    pub result: u8,
    /// Who asked.
    pub target_system: u8,
    /// Which component of theirs.
    pub target_component: u8,
}

impl MessageData for UnlistedAck {
    type Message = MavMessage;
    const ID: u32 = 77;
    const NAME: &'static str = "COMMAND_ACK";
    const EXTRA_CRC: u8 = 143;
    const ENCODED_LEN: usize = 10;

    fn ser(&self, version: MavlinkVersion, payload: &mut [u8]) -> usize {
        let [low, high] = self.command.to_le_bytes();
        let all = [low, high, self.result, 0, 0, 0, 0, 0, self.target_system, self.target_component];
        let length = match version {
            MavlinkVersion::V1 => 3,
            MavlinkVersion::V2 => all.len() - all.iter().rev().take_while(|byte| **byte == 0).count(),
        };
        payload[..length].copy_from_slice(&all[..length]);
        length
    }

    fn deser(_: MavlinkVersion, payload: &[u8]) -> Result<Self, ParserError> {
        let byte = |offset: usize| payload.get(offset).copied().unwrap_or(0);
        let command = u16::from_le_bytes([byte(0), byte(1)]);
        Ok(Self { command, result: byte(2), target_system: byte(8), target_component: byte(9) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mavlink::dialects::ardupilotmega as mav;

    /// The dialect's own encoder is the judge: for a number that it knows, both must agree byte for byte.
    #[test]
    fn an_unsupported_answer_is_a_command_ack() {
        let header = MavHeader { system_id: 3, component_id: 1, sequence: 9 };
        let own = UnlistedAck { command: 22, result: 3, target_system: 255, target_component: 190 };
        let theirs = mav::COMMAND_ACK_DATA {
            command: mav::MavCmd::MAV_CMD_NAV_TAKEOFF,
            result: mav::MavResult::MAV_RESULT_UNSUPPORTED,
            progress: 0,
            result_param2: 0,
            target_system: 255,
            target_component: 190,
        };
        for version in [MavlinkVersion::V1, MavlinkVersion::V2] {
            let (mut a, mut b) = (Vec::new(), Vec::new());
            Outbound::Acknowledgement(own).encode(version, header, &mut a);
            Outbound::Message(MavMessage::COMMAND_ACK(theirs.clone())).encode(version, header, &mut b);
            assert_eq!(a, b);
            assert!(!a.is_empty());
        }
    }

    #[test]
    fn an_unknown_command_is_still_a_command() {
        let mut payload = [0_u8; 33];
        payload[28..30].copy_from_slice(&64_999_u16.to_le_bytes());
        payload[30] = 7;
        let mut bytes = vec![0xFD, 33, 0, 0, 5, 255, 190, 76, 0, 0];
        bytes.extend_from_slice(&payload);
        let crc = mavlink::calculate_crc(&bytes[1..], MavMessage::extra_crc(76));
        bytes.extend_from_slice(&crc.to_le_bytes());
        let raw = mavlink::MavlinkReader::new(&bytes[..]).read_any_raw_message::<MavMessage>().expect("a valid frame");
        match Inbound::decode(&raw) {
            Some(Inbound::UnknownCommand { command: 64_999, target_system: 7, header }) => assert_eq!(header.system_id, 255),
            other => panic!("{other:?}"),
        }
    }
}
