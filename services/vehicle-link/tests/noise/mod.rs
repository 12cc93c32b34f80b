//! Seeded noise, and frames that it has been at.

#![allow(dead_code, reason = "each test uses its own part")]
#![allow(clippy::unwrap_used, reason = "a test ends at its first surprise")]

use halcyon_vehicle_link::core::frame::Frame;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{MavHeader, MavlinkVersion, Message as _, calculate_crc};

/// SplitMix64.
pub(crate) struct Noise(pub(crate) u64);

impl Noise {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    pub(crate) fn below(&mut self, bound: usize) -> usize {
        (self.next() % bound as u64) as usize
    }

    /// In [0, 1).
    pub(crate) fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.share()
    }

    pub(crate) fn chance(&mut self, share: f64) -> bool {
        self.share() < share
    }

    /// A usual number; now and then one that is none, or far too large.
    pub(crate) fn number(&mut self, low: f64, high: f64) -> f64 {
        const ODD: [f64; 8] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 1e9, f64::MIN_POSITIVE, -0.0];
        if self.chance(0.05) { ODD[self.below(ODD.len())] } else { self.between(low, high) }
    }

    pub(crate) fn of<T: Copy>(&mut self, choices: &[T]) -> T {
        choices[self.below(choices.len())]
    }

    pub(crate) fn fill(&mut self, bytes: &mut [u8]) {
        for chunk in bytes.chunks_mut(8) {
            chunk.copy_from_slice(&self.next().to_le_bytes()[..chunk.len()]);
        }
    }
}

/// Resident memory, bytes.
pub(crate) fn resident_bytes() -> usize {
    let statm = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
    statm.split_whitespace().nth(1).and_then(|pages| pages.parse::<usize>().ok()).unwrap_or(0) * 4096
}

/// A frame with some bytes changed; with a sum that is right again three times of four.
pub(crate) fn mutated(noise: &mut Noise, message: &MavMessage) -> Vec<u8> {
    let version = if noise.below(4) == 0 { MavlinkVersion::V1 } else { MavlinkVersion::V2 };
    let header = MavHeader { system_id: 7, component_id: 1, sequence: noise.next() as u8 };
    let frame = Frame::encode(version, header, message).or_else(|| Frame::encode(MavlinkVersion::V2, header, message)).unwrap();
    let mut bytes = frame.bytes().to_vec();
    let (start, v2) = if frame.version() == MavlinkVersion::V1 { (6, false) } else { (10, true) };
    // A payload of full length and of any content: zeros at its end are cut off in MAVLink 2, so that default messages are short.
    if v2 && noise.below(2) == 0 {
        let mut payload = vec![0; 1 + noise.below(255)];
        noise.fill(&mut payload);
        bytes.truncate(start);
        bytes[1] = payload.len() as u8;
        bytes.extend(payload);
        bytes.extend([0, 0]);
    }
    let end = bytes.len() - 2;
    for _ in 0..=noise.below(8) {
        let at = start + noise.below((end - start).max(1));
        if at < end {
            bytes[at] = noise.next() as u8;
        }
    }
    if noise.below(16) == 0 {
        // Of anybody.
        bytes[if v2 { 5 } else { 3 }] = noise.next() as u8;
    }
    let sum = calculate_crc(&bytes[1..end], MavMessage::extra_crc(message.message_id())).to_le_bytes();
    bytes[end..].copy_from_slice(&sum);
    if noise.below(4) == 0 {
        let at = noise.below(bytes.len());
        bytes[at] = noise.next() as u8;
    }
    bytes
}
