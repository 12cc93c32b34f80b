//! MAVLink 2 message signing, as ArduPilot does it: one key for the vehicle, set by SETUP_SIGNING, in force on every link at once.
//!
//! ArduPilot trusts its USB port without a signature; no link is one here.

use mavlink::dialects::ardupilotmega as mav;
use mavlink::{MAVLinkMessageRaw, MAVLinkV2MessageRaw, MessageData};

/// The bit of the incompatibility flags that says "signed".
pub(super) const SIGNED: u8 = 0x01;
/// Signing's epoch, 1 January 2015, as Unix microseconds; its unit is 10 µs.
const EPOCH_US: i64 = 1_420_070_400_000_000;
/// A stream never heard before may be this far behind: a minute.
const NEW_STREAM_BEHIND: u64 = 6_000_000;
/// Most streams (link, system, component) that are remembered; a further one is refused.
const STREAMS_MAX: usize = 16;
/// What is taken unsigned: a telemetry radio can't sign.
const UNSIGNED_TAKEN: [u32; 2] = [mav::RADIO_STATUS_DATA::ID, mav::RADIO_DATA::ID];

/// The key, the clock and who was heard when.
#[derive(Debug, Clone)]
pub(super) struct Signing {
    secret_key: [u8; 32],
    timestamp: u64,
    streams: Vec<((u8, u8, u8), u64)>,
}

impl Signing {
    /// What a SETUP_SIGNING sets up: nothing when all of it is zero.
    pub(super) fn from_setup(data: &mav::SETUP_SIGNING_DATA) -> Option<Self> {
        let none = data.initial_timestamp == 0 && data.secret_key == [0; 32];
        (!none).then(|| Self { secret_key: data.secret_key, timestamp: data.initial_timestamp, streams: Vec::new() })
    }

    /// The clock goes on with GNSS time, Unix microseconds; never back.
    pub(super) fn tell_time(&mut self, unix_us: i64) {
        let ticks = u64::try_from((unix_us - EPOCH_US) / 10).unwrap_or(0);
        self.timestamp = self.timestamp.max(ticks);
    }

    /// Whether a frame may pass: rightly signed and newer than the last of its stream, or of a kind that is taken unsigned.
    pub(super) fn accepts(&mut self, frame: &MAVLinkMessageRaw) -> bool {
        let signed = match frame {
            MAVLinkMessageRaw::V2(frame) if frame.incompatibility_flags() & SIGNED != 0 => self.verifies(frame),
            _ => false,
        };
        signed || UNSIGNED_TAKEN.contains(&frame.message_id())
    }

    fn verifies(&mut self, frame: &MAVLinkV2MessageRaw) -> bool {
        let mut expected = [0; 6];
        frame.calculate_signature(&self.secret_key, &mut expected);
        if frame.signature_value() != expected {
            return false;
        }
        let timestamp = frame.signature_timestamp();
        let stream = (frame.signature_link_id(), frame.system_id() as u8, frame.component_id());
        let is_full = self.streams.len() >= STREAMS_MAX;
        match self.streams.iter_mut().find(|(known, _)| *known == stream) {
            // Heard before: a repetition.
            Some((_, last)) if timestamp <= *last => return false,
            Some((_, last)) => *last = timestamp,
            None if is_full || timestamp + NEW_STREAM_BEHIND < self.timestamp => return false,
            None => self.streams.push((stream, timestamp)),
        }
        self.timestamp = self.timestamp.max(timestamp);
        true
    }

    /// Signs a frame whose flags say that it is signed.
    pub(super) fn sign(&mut self, frame: &mut MAVLinkV2MessageRaw, link_id: u8) {
        self.timestamp += 1;
        let [bytes @ .., _, _] = self.timestamp.to_le_bytes();
        frame.signature_timestamp_bytes_mut().copy_from_slice(&bytes);
        *frame.signature_link_id_mut() = link_id;
        let mut value = [0; 6];
        frame.calculate_signature(&self.secret_key, &mut value);
        frame.signature_value_mut().copy_from_slice(&value);
    }
}
