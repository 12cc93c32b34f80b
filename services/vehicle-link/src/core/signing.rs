//! MAVLink 2's message signing: SHA-256 over key and frame, and a clock that only goes forward.
//!
//! Every signed frame bears a 48-bit time in units of 10 µs since 2015, which must be later than that of the frame before it from
//! the same sender on the same link; so nobody can play old frames again. A restart keeps that only if the clock does: the time is the wall's,
//! never earlier than any that was signed or accepted, and before 2015 nothing is signed at all.

use std::collections::BTreeMap;

use halcyon_model::Stamp;
use mavlink::{MAVLinkV2MessageRaw, MavlinkVersion};
use sha2::{Digest as _, Sha256};

use super::frame::Frame;

/// 1 January 2015, seconds since the Unix epoch.
const EPOCH_S: i64 = 1_420_070_400;
/// A sender that was not heard yet may be so far behind, in units of 10 µs: a minute, as the specification says.
const BEHIND_MAX: u64 = 6_000_000;
/// And so far ahead: it would lock out everybody else's clock. An hour forgives a vehicle without GNSS a badly set clock.
const AHEAD_MAX: u64 = 360_000_000;
/// Senders whose last time is remembered; more than fly on one link.
const SENDERS_MAX: usize = 64;
const TRAILER_BYTES: usize = 13;
/// RADIO_STATUS: a telemetry radio makes it and knows no key. As in ArduPilot, the one message that needs no signature.
const RADIO_STATUS: u32 = 109;

/// The shared secret. Never printed.
#[derive(Clone, PartialEq, Eq)]
pub struct Key([u8; 32]);

impl std::fmt::Debug for Key {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Key(…)")
    }
}

/// Why a key file is no key.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// Nothing, or next to nothing.
    #[error("the key file holds {0} bytes: a passphrase needs 8 or more")]
    Short(usize),
    /// All zero, which is how MAVLink says that signing is off.
    #[error("the key is all zeros, which MAVLink takes for none")]
    Zero,
}

impl Key {
    /// From a key file's bytes: 32 raw bytes; or 64 hexadecimal digits; or else a passphrase, whose SHA-256 (of the UTF-8 text without
    /// the line's end) is the key, as in MAVProxy's `signing setup` and Mission Planner.
    ///
    /// # Errors
    /// If it is too short for a passphrase, or all zeros.
    pub fn from_file_bytes(bytes: &[u8]) -> Result<Self, KeyError> {
        let text = bytes.trim_ascii_end();
        let key = if let Ok(raw) = <[u8; 32]>::try_from(bytes) {
            raw
        } else if let Some(key) = from_hex(text) {
            key
        } else if text.len() < 8 {
            return Err(KeyError::Short(text.len()));
        } else {
            Sha256::digest(text).into()
        };
        if key == [0; 32] { Err(KeyError::Zero) } else { Ok(Self(key)) }
    }
}

fn from_hex(text: &[u8]) -> Option<[u8; 32]> {
    let digits: Vec<u8> = text.iter().map(|c| char::from(*c).to_digit(16).map(|digit| digit as u8)).collect::<Option<_>>()?;
    let bytes: Vec<u8> = digits.chunks_exact(2).filter_map(|pair| Some(pair.first()? << 4 | pair.get(1)?)).collect();
    (digits.len() == 64).then(|| bytes.try_into().ok()).flatten()
}

/// What a frame from the link is worth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Signed with our key, and new.
    Signed,
    /// Needs no signature.
    Exempt,
    /// Not signed.
    Unsigned,
    /// Signed with another key.
    WrongKey,
    /// Signed with our key, with a time that is past, or far in the future.
    WrongTime,
}

impl Verdict {
    /// Whether the frame may be believed.
    #[must_use]
    pub fn is_good(self) -> bool {
        matches!(self, Self::Signed | Self::Exempt)
    }

    /// In a word, for a metric's label.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Signed => "signed",
            Self::Exempt => "exempt",
            Self::Unsigned => "unsigned",
            Self::WrongKey => "wrong_key",
            Self::WrongTime => "wrong_time",
        }
    }
}

/// Signs what goes out and checks what comes in.
#[derive(Debug, Clone)]
pub struct Signer {
    key: Key,
    link_id: u8,
    /// The last time signed, or accepted.
    newest: u64,
    senders: BTreeMap<(u8, u8, u8), u64>,
}

impl Signer {
    /// With a key; `link_id` tells this link from others of the same sender.
    #[must_use]
    pub fn new(key: Key, link_id: u8) -> Self {
        Self { key, link_id, newest: 0, senders: BTreeMap::new() }
    }

    /// A frame of ours with its signature; `None` for MAVLink 1, which has none, and while the clock is before 2015.
    #[must_use]
    pub fn sign(&mut self, frame: &Frame, now: Stamp) -> Option<Frame> {
        let time = signing_time(now)?.max(self.newest + 1);
        if frame.version() == MavlinkVersion::V1 || frame.is_signed() {
            return None;
        }
        let bytes = frame.bytes();
        let body = bytes.len().checked_sub(2)?;
        let message = frame.message()?;
        let mut raw = MAVLinkV2MessageRaw::new();
        raw.serialize_message_for_signing(frame.header(), &message);
        raw.signature_timestamp_bytes_mut().copy_from_slice(time.to_le_bytes().get(..6)?);
        *raw.signature_link_id_mut() = self.link_id;
        let mut signature = [0; 6];
        raw.calculate_signature(&self.key.0, &mut signature);
        raw.signature_value_mut().copy_from_slice(&signature);
        debug_assert_eq!(raw.raw_bytes().len(), body + 2 + TRAILER_BYTES);
        self.newest = time;
        Some(Frame::from_known(raw.raw_bytes().to_vec()))
    }

    /// Checks a frame from the link.
    #[must_use]
    pub fn check(&mut self, frame: &Frame, now: Stamp) -> Verdict {
        if !frame.is_signed() {
            let is_radio = frame.message_id() == RADIO_STATUS && frame.message().is_some();
            return if is_radio { Verdict::Exempt } else { Verdict::Unsigned };
        }
        let Some((signed, signature)) = frame.bytes().split_last_chunk::<6>() else { return Verdict::WrongKey };
        let mut hasher = Sha256::new();
        hasher.update(self.key.0);
        hasher.update(signed);
        // Compared in full: how far it is right must not show in the time that takes.
        let differing = hasher.finalize().iter().zip(signature).fold(0, |differing, (a, b)| differing | (a ^ b));
        if differing != 0 {
            return Verdict::WrongKey;
        }
        let Some((rest, time)) = signed.split_last_chunk::<6>() else { return Verdict::WrongKey };
        let [a, b, c, d, e, f] = *time;
        let time = u64::from_le_bytes([a, b, c, d, e, f, 0, 0]);
        let link = rest.last().copied().unwrap_or(0);
        let header = frame.header();
        let sender = (header.system_id as u8, header.component_id, link);
        let ours = signing_time(now).unwrap_or(0).max(self.newest);
        let is_new = match self.senders.get(&sender) {
            Some(last) => time > *last,
            None => time + BEHIND_MAX >= ours && self.senders.len() < SENDERS_MAX,
        };
        // A clock that was never set judges nobody's.
        let is_ahead = signing_time(now).is_some_and(|now| time > now.max(self.newest) + AHEAD_MAX);
        if !is_new || is_ahead {
            return Verdict::WrongTime;
        }
        self.senders.insert(sender, time);
        self.newest = self.newest.max(time);
        Verdict::Signed
    }
}

/// Units of 10 µs since 2015; `None` before that.
fn signing_time(now: Stamp) -> Option<u64> {
    u64::try_from(now.as_nanos() / 10_000 - EPOCH_S * 100_000).ok().filter(|time| *time > 0)
}

/// Whether the clock can sign.
#[must_use]
pub fn clock_can_sign(now: Stamp) -> bool {
    signing_time(now).is_some()
}

#[cfg(test)]
mod tests {
    use mavlink::dialects::ardupilotmega as ardu;
    use mavlink::dialects::ardupilotmega::MavMessage;
    use mavlink::{MavHeader, MavlinkReader, SigningConfig, SigningData};

    use super::*;

    fn t(s: f64) -> Stamp {
        Stamp::from_nanos(EPOCH_S * 1_000_000_000).plus_secs_f64(350e6 + s)
    }

    fn key(byte: u8) -> Key {
        Key([byte; 32])
    }

    fn frame(sequence: u8) -> Frame {
        let header = MavHeader { system_id: 7, component_id: 1, sequence };
        let message = MavMessage::SYSTEM_TIME(ardu::SYSTEM_TIME_DATA { time_unix_usec: 12, time_boot_ms: 0 });
        Frame::encode(MavlinkVersion::V2, header, &message).unwrap()
    }

    /// Independent of the code above: the crate's own check, with the machine's clock.
    #[test]
    fn the_mavlink_crate_accepts_what_we_sign_and_we_what_it_signs() {
        #[allow(clippy::disallowed_methods, reason = "the crate's check reads the machine's clock")]
        let wall = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
        let now = Stamp::from_nanos(i64::try_from(wall.as_nanos()).unwrap());
        let data = SigningData::from_config(SigningConfig::new([5; 32], 3, true, false));
        let signed = Signer::new(key(5), 2).sign(&frame(1), now).unwrap();
        let read = |bytes: &[u8]| MavlinkReader::new(bytes).read_any_message_signed::<MavMessage>(Some(&data));
        assert_eq!(Some(read(signed.bytes()).unwrap().1), frame(1).message());
        let other = Signer::new(key(6), 2).sign(&frame(1), now).unwrap();
        assert!(read(other.bytes()).is_err(), "another key");
        let mut theirs = Vec::new();
        mavlink::write_v2_msg_signed(&mut theirs, frame(2).header(), &frame(2).message().unwrap(), Some(&data)).unwrap();
        let theirs = super::super::frame::Framer::datagram(&theirs).remove(0);
        assert_eq!(Signer::new(key(5), 0).check(&theirs, now), Verdict::Signed);
        assert_eq!(Signer::new(key(6), 0).check(&theirs, now), Verdict::WrongKey);
    }

    #[test]
    fn no_frame_twice_none_from_the_past_and_none_from_far_ahead() {
        let (mut here, mut there) = (Signer::new(key(1), 0), Signer::new(key(1), 0));
        let first = there.sign(&frame(1), t(0.0)).unwrap();
        let second = there.sign(&frame(2), t(0.0)).unwrap();
        assert_eq!(here.check(&second, t(0.0)), Verdict::Signed);
        assert_eq!(here.check(&second, t(0.0)), Verdict::WrongTime, "the same again");
        assert_eq!(here.check(&first, t(0.0)), Verdict::WrongTime, "an older one");
        assert_eq!(here.check(&frame(3), t(0.0)), Verdict::Unsigned);
        let late = Signer::new(key(1), 9).sign(&frame(4), t(-61.0)).unwrap();
        assert_eq!(here.check(&late, t(0.0)), Verdict::WrongTime, "a new sender a minute behind");
        let early = Signer::new(key(1), 8).sign(&frame(4), t(7200.0)).unwrap();
        assert_eq!(here.check(&early, t(0.0)), Verdict::WrongTime);
        let mut broken = there.sign(&frame(5), t(1.0)).unwrap().bytes().to_vec();
        broken[10] ^= 1;
        assert_eq!(here.check(&Frame::from_known(broken), t(1.0)), Verdict::WrongKey);
    }

    #[test]
    fn the_time_goes_forward_whatever_the_clock_does() {
        let mut signer = Signer::new(key(1), 0);
        let time = |frame: &Frame| {
            let bytes = frame.bytes();
            let mut time = [0; 8];
            time[..6].copy_from_slice(&bytes[bytes.len() - 12..bytes.len() - 6]);
            u64::from_le_bytes(time)
        };
        let mut last = 0;
        for now in [t(0.0), t(0.0), t(-5.0), t(1.0)] {
            let signed = signer.sign(&frame(1), now).unwrap();
            assert!(time(&signed) > last);
            last = time(&signed);
        }
        assert_eq!(last, 350e11 as u64 + 100_000);
        // What others sign later than our clock moves ours on, so that after a restart with a slow clock nothing old is signed.
        let ahead = Signer::new(key(1), 7).sign(&frame(1), t(100.0)).unwrap();
        assert_eq!(signer.check(&ahead, t(1.0)), Verdict::Signed);
        assert!(time(&signer.sign(&frame(1), t(1.0)).unwrap()) > time(&ahead));
        assert!(Signer::new(key(1), 0).sign(&frame(1), Stamp::from_secs_f64(1e9)).is_none(), "2001");
        assert!(!clock_can_sign(Stamp::from_secs_f64(1e9)) && clock_can_sign(t(0.0)));
    }

    #[test]
    fn a_telemetry_radio_needs_no_signature() {
        let header = MavHeader { system_id: 51, component_id: 68, sequence: 0 };
        let radio = MavMessage::RADIO_STATUS(ardu::RADIO_STATUS_DATA::default());
        let radio = Frame::encode(MavlinkVersion::V2, header, &radio).unwrap();
        assert_eq!(Signer::new(key(1), 0).check(&radio, t(0.0)), Verdict::Exempt);
    }

    #[test]
    fn senders_are_remembered_within_bounds() {
        let mut here = Signer::new(key(1), 0);
        for link in 0..=255 {
            let signed = Signer::new(key(1), link).sign(&frame(1), t(0.0)).unwrap();
            let _ = here.check(&signed, t(0.0));
        }
        assert_eq!(here.senders.len(), SENDERS_MAX);
    }

    #[test]
    fn key_files() {
        let hex = "000102030405060708090a0b0c0d0e0f101112131415161718191A1B1C1D1E1F\n";
        let raw: Vec<u8> = (0..32).collect();
        assert_eq!(Key::from_file_bytes(hex.as_bytes()), Key::from_file_bytes(&raw));
        // FIPS 180-2's two-block example, as a passphrase with a line's end.
        let words = "abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq\n";
        let digest = "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1";
        assert_eq!(Key::from_file_bytes(words.as_bytes()), Key::from_file_bytes(digest.as_bytes()));
        assert_eq!(Key::from_file_bytes(b"abc\n"), Err(KeyError::Short(3)));
        assert_eq!(Key::from_file_bytes(b""), Err(KeyError::Short(0)));
        assert_eq!(Key::from_file_bytes(&[0; 32]), Err(KeyError::Zero));
        assert_eq!(format!("{:?}", Signer::new(key(7), 0)).matches("7, 7").count(), 0, "the key is never printed");
    }
}
