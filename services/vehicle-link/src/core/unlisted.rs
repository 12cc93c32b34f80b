//! Answers with a value that MAVLink has got since the dialect was made: the mavlink crate reads none of the message, though all but
//! that value is known. An answer that isn't heard is waited for, so it is read here, from the frame's bytes.

use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{Message as _, MessageData as _};

use super::frame::Frame;

/// Where the value stands in the payload: MAVLink sorts fields by size, extensions come last.
const ACK_RESULT: usize = 2;
const PARAM_ERROR_ERROR: usize = 20;
/// Stands in for it, while the rest is read: an error in both.
const STAND_IN: u8 = 1;

/// An answer, and the number in it that the dialect doesn't have; what stands in the message in its place means nothing.
#[derive(Debug, Clone, PartialEq)]
pub enum Unlisted {
    /// With its result.
    Ack(ardu::COMMAND_ACK_DATA, u8),
    /// With its error.
    ParamError(ardu::PARAM_ERROR_DATA, u8),
}

impl Unlisted {
    /// What a frame says whose message couldn't be read; `None` if it is no such answer.
    #[must_use]
    pub fn of(frame: &Frame) -> Option<Self> {
        let id = frame.message_id();
        let at = match id {
            ardu::COMMAND_ACK_DATA::ID => ACK_RESULT,
            ardu::PARAM_ERROR_DATA::ID => PARAM_ERROR_ERROR,
            _ => return None,
        };
        let mut payload = frame.payload()?.to_vec();
        let number = std::mem::replace(payload.get_mut(at)?, STAND_IN);
        match MavMessage::parse(frame.version(), id, &payload).ok()? {
            MavMessage::COMMAND_ACK(data) => Some(Self::Ack(data, number)),
            MavMessage::PARAM_ERROR(data) => Some(Self::ParamError(data, number)),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use mavlink::dialects::ardupilotmega::{MavCmd, MavParamError, MavResult};
    use mavlink::{MavHeader, MavlinkVersion, calculate_crc};

    use super::*;
    use crate::core::frame::Framer;

    /// `message` with its value, at `at` of the payload, made `number`; the checksum by MAVLink's own rule and `extra`, its seed from
    /// the XML (COMMAND_ACK 143, PARAM_ERROR 209).
    fn altered(version: MavlinkVersion, message: &MavMessage, at: usize, number: u8, extra: u8) -> Frame {
        let header = MavHeader { system_id: 7, component_id: 1, sequence: 0 };
        let mut bytes = Frame::encode(version, header, message).unwrap().bytes().to_vec();
        let start = if version == MavlinkVersion::V1 { 6 } else { 10 };
        bytes[start + at] = number;
        let end = start + usize::from(bytes[1]);
        let sum = calculate_crc(&bytes[1..end], extra).to_le_bytes();
        bytes[end..end + 2].copy_from_slice(&sum);
        Framer::datagram(&bytes).remove(0)
    }

    #[test]
    fn an_acknowledgement_with_a_result_of_a_newer_mavlink_is_read() {
        let ack = ardu::COMMAND_ACK_DATA {
            command: MavCmd::MAV_CMD_COMPONENT_ARM_DISARM,
            result: MavResult::MAV_RESULT_FAILED,
            progress: 3,
            result_param2: -7,
            target_system: 7,
            target_component: 191,
        };
        for version in [MavlinkVersion::V1, MavlinkVersion::V2] {
            let frame = altered(version, &MavMessage::COMMAND_ACK(ack.clone()), 2, 77, 143);
            assert_eq!(frame.message(), None, "if the dialect has it now, take another number");
            let Some(Unlisted::Ack(read, 77)) = Unlisted::of(&frame) else { panic!("{:?}", Unlisted::of(&frame)) };
            assert_eq!(read.command, ack.command);
            // MAVLink 1 has no extensions.
            let target = if version == MavlinkVersion::V1 { (0, 0) } else { (7, 191) };
            assert_eq!((read.target_system, read.target_component), target);
        }
        let other = MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA::default());
        let header = MavHeader { system_id: 7, component_id: 1, sequence: 0 };
        assert_eq!(Unlisted::of(&Frame::encode(MavlinkVersion::V2, header, &other).unwrap()), None);
    }

    #[test]
    fn a_parameter_error_of_a_newer_mavlink_is_read() {
        let error = ardu::PARAM_ERROR_DATA {
            param_index: -1,
            target_system: 7,
            target_component: 191,
            param_id: "RTL_ALT".into(),
            error: MavParamError::MAV_PARAM_ERROR_READ_FAIL,
        };
        let frame = altered(MavlinkVersion::V2, &MavMessage::PARAM_ERROR(error), 20, 99, 209);
        assert_eq!(frame.message(), None);
        let Some(Unlisted::ParamError(read, 99)) = Unlisted::of(&frame) else { panic!("{:?}", Unlisted::of(&frame)) };
        assert_eq!((read.param_id.to_str(), read.param_index, read.target_component), (Ok("RTL_ALT"), -1, 191));
    }
}
