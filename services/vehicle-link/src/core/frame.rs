//! MAVLink frames as bytes: found in a stream, told apart by sender, and passed on untouched.
//!
//! The mavlink crate's reader knows only its dialect's messages: what it doesn't know it skips, since the checksum's seed is part of
//! a message's definition. A relay must pass on all of them. So a frame of an unknown message is taken here when its place vouches
//! for it: it follows a frame that was good (or begins the datagram), and what follows it begins another or nothing. Such a frame is
//! never decoded.

use halcyon_model::Bytes;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{MavHeader, MavlinkVersion, Message as _, calculate_crc};

/// First byte of a MAVLink 1 frame.
const STX_V1: u8 = 0xFE;
/// First byte of a MAVLink 2 frame.
const STX_V2: u8 = 0xFD;
/// The incompatibility flag of a signed frame, the only one that is known; a frame with any other must be dropped.
const FLAG_SIGNED: u8 = 0x01;
const SIGNATURE_BYTES: usize = 13;
/// The longest frame.
pub const FRAME_BYTES_MAX: usize = 10 + 255 + 2 + SIGNATURE_BYTES;
/// What waits to become a frame: a frame, and the largest read.
const PENDING_BYTES_MAX: usize = 64 * 1024;

/// One whole frame. Cheap to clone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    bytes: Bytes,
    is_known: bool,
}

impl Frame {
    /// The bytes, as they came.
    #[must_use]
    pub fn bytes(&self) -> &Bytes {
        &self.bytes
    }

    /// Which version of the protocol.
    #[must_use]
    pub fn version(&self) -> MavlinkVersion {
        if self.at(0) == STX_V1 { MavlinkVersion::V1 } else { MavlinkVersion::V2 }
    }

    /// The sender and its sequence number.
    #[must_use]
    pub fn header(&self) -> MavHeader {
        let [sequence, system, component] = match self.version() {
            MavlinkVersion::V1 => [2, 3, 4],
            MavlinkVersion::V2 => [4, 5, 6],
        };
        MavHeader { system_id: self.at(system).into(), component_id: self.at(component), sequence: self.at(sequence) }
    }

    /// MAVLink's number of the message.
    #[must_use]
    pub fn message_id(&self) -> u32 {
        match self.version() {
            MavlinkVersion::V1 => self.at(5).into(),
            MavlinkVersion::V2 => u32::from_le_bytes([self.at(7), self.at(8), self.at(9), 0]),
        }
    }

    /// Whether it bears a signature, of whomever.
    #[must_use]
    pub fn is_signed(&self) -> bool {
        self.version() == MavlinkVersion::V2 && self.at(2) & FLAG_SIGNED != 0
    }

    /// What it says; `None` if the dialect doesn't have the message, or a value in it.
    #[must_use]
    pub fn message(&self) -> Option<MavMessage> {
        MavMessage::parse(self.version(), self.message_id(), self.payload()?).ok()
    }

    /// The payload, as it came; `None` if the dialect doesn't have the message, so that nothing vouches for it.
    pub(super) fn payload(&self) -> Option<&[u8]> {
        let start = if self.version() == MavlinkVersion::V1 { 6 } else { 10 };
        self.bytes.get(start..start + usize::from(self.at(1))).filter(|_| self.is_known)
    }

    /// A message of ours as a frame; `None` for one that MAVLink 1 can't number.
    #[must_use]
    pub fn encode(version: MavlinkVersion, header: MavHeader, message: &MavMessage) -> Option<Self> {
        let mut bytes = Vec::with_capacity(FRAME_BYTES_MAX);
        match version {
            MavlinkVersion::V1 if message.message_id() > 255 => return None,
            MavlinkVersion::V1 => mavlink::write_v1_msg(&mut bytes, header, message),
            MavlinkVersion::V2 => mavlink::write_v2_msg(&mut bytes, header, message),
        }
        .ok()?;
        Some(Self { bytes: bytes.into(), is_known: true })
    }

    /// A frame of these bytes, which were one already.
    pub(super) fn from_known(bytes: Vec<u8>) -> Self {
        Self { bytes: bytes.into(), is_known: true }
    }

    fn at(&self, index: usize) -> u8 {
        self.bytes.get(index).copied().unwrap_or(0)
    }
}

/// Finds frames in what comes from one sender. Holds at most [`PENDING_BYTES_MAX`].
#[derive(Debug, Clone, Default)]
pub struct Framer {
    pending: Vec<u8>,
    start: usize,
    /// The last bytes were a frame, so that this place begins another.
    aligned: bool,
}

/// What begins at some place.
enum Candidate {
    Frame {
        length: usize,
        is_known: bool,
    },
    /// The bytes end before the frame would.
    Short,
    Nothing,
}

impl Framer {
    /// Takes bytes of a stream; frames that are complete now come out in their order.
    pub fn stream(&mut self, bytes: &[u8]) -> Vec<Frame> {
        self.pending.extend_from_slice(bytes.get(..bytes.len().min(PENDING_BYTES_MAX)).unwrap_or(bytes));
        let frames = self.drain(false);
        self.pending.drain(..self.start);
        self.start = 0;
        frames
    }

    /// Takes a datagram; frames never straddle two.
    #[must_use]
    pub fn datagram(bytes: &[u8]) -> Vec<Frame> {
        let mut framer = Self { pending: bytes.to_vec(), start: 0, aligned: true };
        framer.drain(true)
    }

    fn drain(&mut self, ends: bool) -> Vec<Frame> {
        let mut frames = Vec::new();
        while let Some(rest) = self.pending.get(self.start..).filter(|rest| !rest.is_empty()) {
            match candidate(rest, self.aligned, ends) {
                Candidate::Frame { length, is_known } => {
                    let bytes = Bytes::copy_from_slice(rest.get(..length).unwrap_or(rest));
                    frames.push(Frame { bytes, is_known });
                    self.start += length;
                    self.aligned = true;
                }
                Candidate::Short if !ends => break,
                // Searched again from the next byte: a frame may hide in what a false start seemed to claim.
                Candidate::Short | Candidate::Nothing => {
                    self.start += 1;
                    self.aligned = false;
                }
            }
        }
        frames
    }
}

fn candidate(bytes: &[u8], aligned: bool, ends: bool) -> Candidate {
    let at = |index: usize| bytes.get(index).copied();
    let (header, signature) = match at(0) {
        Some(STX_V1) => (6, 0),
        Some(STX_V2) => match at(2) {
            None => return Candidate::Short,
            Some(0) => (10, 0),
            Some(FLAG_SIGNED) => (10, SIGNATURE_BYTES),
            Some(_) => return Candidate::Nothing,
        },
        _ => return Candidate::Nothing,
    };
    let Some(payload) = at(1) else { return Candidate::Short };
    let checked = header + usize::from(payload);
    let length = checked + 2 + signature;
    let Some(frame) = bytes.get(..length) else { return Candidate::Short };
    let id = match (header, frame) {
        (6, [_, _, _, _, _, id, ..]) => u32::from(*id),
        (_, [_, _, _, _, _, _, _, low, middle, high, ..]) => u32::from_le_bytes([*low, *middle, *high, 0]),
        _ => return Candidate::Nothing,
    };
    if MavMessage::default_message_from_id(id).is_none() {
        let next = at(length);
        let is_followed = next.map_or(ends, |next| next == STX_V1 || next == STX_V2);
        return match (aligned, is_followed) {
            (true, true) => Candidate::Frame { length, is_known: false },
            // The next read tells.
            (true, false) if next.is_none() => Candidate::Short,
            _ => Candidate::Nothing,
        };
    }
    let sum = frame.get(1..checked).map(|checked| calculate_crc(checked, MavMessage::extra_crc(id)).to_le_bytes());
    match (sum, frame.get(checked..checked + 2)) {
        (Some(sum), Some(said)) if sum == said => Candidate::Frame { length, is_known: true },
        _ => Candidate::Nothing,
    }
}

#[cfg(test)]
mod tests {
    use mavlink::dialects::ardupilotmega as ardu;
    use proptest::prelude::*;

    use super::*;

    fn header(sequence: u8) -> MavHeader {
        MavHeader { system_id: 7, component_id: 1, sequence }
    }

    fn heartbeat(version: MavlinkVersion) -> Frame {
        Frame::encode(version, header(9), &MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA::default())).unwrap()
    }

    /// A message that no dialect has, with a checksum that only its author can check.
    fn unknown() -> Vec<u8> {
        vec![STX_V2, 3, 0, 0, 5, 7, 1, 0x40, 0xE2, 0x01, STX_V1, 2, 3, 0xAB, 0xCD]
    }

    #[test]
    fn a_frame_says_what_the_crates_own_reader_says() {
        for version in [MavlinkVersion::V1, MavlinkVersion::V2] {
            let frame = heartbeat(version);
            assert_eq!((frame.header(), frame.message_id(), frame.version()), (header(9), 0, version));
            let mut reader = mavlink::MavlinkReader::new(&frame.bytes()[..]);
            let (theirs, message) = reader.read_any_message::<MavMessage>().unwrap();
            assert_eq!((theirs, Some(message)), (frame.header(), frame.message()));
            assert!(!frame.is_signed());
        }
        let too_new = MavMessage::EXTENDED_SYS_STATE(ardu::EXTENDED_SYS_STATE_DATA::default());
        assert!(Frame::encode(MavlinkVersion::V1, header(0), &too_new).is_some(), "245 fits");
        let too_new = MavMessage::SETUP_SIGNING(ardu::SETUP_SIGNING_DATA::default());
        assert!(Frame::encode(MavlinkVersion::V1, header(0), &too_new).is_none(), "256 does not");
    }

    #[test]
    fn unknown_messages_pass_where_their_place_vouches_for_them() {
        let beat = heartbeat(MavlinkVersion::V2);
        let stream = [&beat.bytes()[..], &unknown(), &unknown(), beat.bytes()].concat();
        for chunk in 1..stream.len() {
            let mut framer = Framer::default();
            let frames: Vec<Frame> = stream.chunks(chunk).flat_map(|chunk| framer.stream(chunk)).collect();
            let joined: Vec<u8> = frames.iter().flat_map(|frame| frame.bytes().to_vec()).collect();
            assert_eq!((frames.len(), joined), (4, stream.clone()), "in chunks of {chunk}");
            assert_eq!(frames[1].message_id(), 123_456);
            assert!(frames[1].message().is_none());
        }
        assert_eq!(Framer::datagram(&unknown()).len(), 1, "alone in a datagram");
        assert!(Framer::datagram(&[&[0][..], &unknown()].concat()).is_empty(), "not after noise");
    }

    #[test]
    fn a_false_start_hides_no_frame() {
        let beat = heartbeat(MavlinkVersion::V2);
        let noise = [STX_V2, 255, 0, 0, 0, 0, 0, 0, 0, 0];
        let stream = [&noise[..], &beat.bytes()[..].repeat(20)].concat();
        assert_eq!(Framer::default().stream(&stream).len(), 20);
        // Flags that nobody knows: the frame must be dropped.
        let mut flagged = beat.bytes().to_vec();
        flagged[2] = 0x82;
        assert!(Framer::datagram(&flagged).is_empty());
    }

    proptest! {
        #[test]
        fn whatever_comes_nothing_is_kept_for_long(bytes in proptest::collection::vec(any::<u8>(), 0..2000), chunk in 1_usize..300) {
            let mut framer = Framer::default();
            for chunk in bytes.chunks(chunk) {
                framer.stream(chunk);
                prop_assert!(framer.pending.len() <= FRAME_BYTES_MAX);
            }
        }
    }
}
