//! Which version of MAVLink to speak: 2, unless all that the autopilot says, and goes on saying, is 1.
//!
//! An ArduPilot whose port is set to MAVLink 1 changes to 2 when it hears 2; an autopilot that knows only 1 never will, and doesn't
//! understand what we say. So 2 is spoken first, and 1 after some seconds of hearing nothing else.

use halcyon_model::Stamp;
use mavlink::MavlinkVersion;

/// So long it may take to change over, seconds: a few of our heartbeats.
const PATIENCE_S: f64 = 3.0;

/// What the other end speaks.
#[derive(Debug, Clone, Copy, Default)]
pub struct Version {
    first_v1: Option<Stamp>,
    heard_v2: bool,
}

impl Version {
    /// A frame came from an autopilot.
    pub fn observe(&mut self, version: MavlinkVersion, now: Stamp) {
        match version {
            MavlinkVersion::V1 => _ = self.first_v1.get_or_insert(now),
            MavlinkVersion::V2 => self.heard_v2 = true,
        }
    }

    /// What to speak.
    #[must_use]
    pub fn to_speak(&self, now: Stamp) -> MavlinkVersion {
        let only_v1 = self.first_v1.is_some_and(|first| !self.heard_v2 && now.seconds_since(first) >= PATIENCE_S);
        if only_v1 { MavlinkVersion::V1 } else { MavlinkVersion::V2 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_is_spoken_only_to_who_speaks_nothing_else() {
        let t = |s: f64| Stamp::from_secs_f64(1000.0 + s);
        let mut version = Version::default();
        assert_eq!(version.to_speak(t(9.0)), MavlinkVersion::V2);
        version.observe(MavlinkVersion::V1, t(10.0));
        assert_eq!(version.to_speak(t(12.9)), MavlinkVersion::V2);
        assert_eq!(version.to_speak(t(13.0)), MavlinkVersion::V1);
        version.observe(MavlinkVersion::V2, t(20.0));
        version.observe(MavlinkVersion::V1, t(21.0));
        assert_eq!(version.to_speak(t(30.0)), MavlinkVersion::V2);
    }
}
