//! `[vehicle_link]`

use std::path::PathBuf;

use halcyon_chassis::Section;
use halcyon_model::{Role, VehicleId};
use serde::{Deserialize, Serialize};

use crate::core::guidance::Guidance;
use crate::core::limits::{FailSafeLimits, Limits};
use crate::core::payload::Payload;
use crate::endpoint::Endpoint;

/// One vehicle and the link to its autopilot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The vehicle's identifier in the fleet.
    pub vehicle: String,
    /// `leader` (carries cameras) or `follower` (carries the payload).
    pub role: String,
    /// Where the autopilot is: `tcpout:host:port`, `tcpin:address:port`, `udpin:address:port`, `udpout:host:port`, or
    /// `serial:device:baud`.
    pub endpoint: String,
    /// MAVLink system id of the autopilot; 0 takes the first autopilot heard on the link. Never used as an address.
    pub system_id: u8,
    /// Ground stations that see the vehicle through this link, and can fly it: `udpout:192.0.2.10:14550` sends to one,
    /// `udpin:0.0.0.0:14550` and `tcpin:0.0.0.0:5790` wait for up to eight, `tcpout:host:port` calls one. Whoever reaches a waiting port
    /// can command the vehicle: bind it to 127.0.0.1, to a network that you trust, or sign. Empty: none.
    pub relay: Vec<String>,
    /// Message signing.
    pub signing: Signing,
    /// Height of home, where the vehicle takes off, above mean water, metres.
    pub home_height_m: f64,
    /// Rate at which the vehicle's state is published, hertz.
    pub state_rate_hz: f64,
    /// Rate of guidance and setpoints, hertz.
    pub guidance_rate_hz: f64,
    /// Bounds of flight.
    pub limits: Limits,
    /// When fail-safes act.
    pub fail_safe: FailSafeLimits,
    /// How slots are kept.
    pub guidance: Guidance,
    /// What holds the payload, and when it is let go.
    pub payload: Payload,
}

/// MAVLink 2's message signing between this link and its autopilot.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Signing {
    /// File with the key: 32 bytes, or 64 hexadecimal digits, or a passphrase whose SHA-256 is the key, as in MAVProxy and Mission
    /// Planner. With it, all that goes out is signed, and what comes in unsigned or signed otherwise is dropped. Empty: no signing.
    pub key_file: PathBuf,
    /// Tells this link from others of the same vehicle that use the same key.
    pub link_id: u8,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            vehicle: "leader-1".into(),
            role: "leader".into(),
            endpoint: "tcpout:127.0.0.1:5760".into(),
            system_id: 0,
            relay: Vec::new(),
            signing: Signing::default(),
            home_height_m: 0.0,
            state_rate_hz: 10.0,
            guidance_rate_hz: 10.0,
            limits: Limits::default(),
            fail_safe: FailSafeLimits::default(),
            guidance: Guidance::default(),
            payload: Payload::default(),
        }
    }
}

impl Config {
    /// The vehicle's role.
    ///
    /// # Errors
    /// If it is neither `leader` nor `follower`.
    pub fn role(&self) -> Result<Role, String> {
        match self.role.as_str() {
            "leader" => Ok(Role::Leader),
            "follower" => Ok(Role::Follower),
            other => Err(format!("role must be leader or follower, not {other:?}")),
        }
    }
}

impl Section for Config {
    const NAME: &'static str = "vehicle_link";

    fn validate(&self) -> Result<(), String> {
        VehicleId::new(&self.vehicle).map_err(|error| format!("vehicle: {error}"))?;
        self.role()?;
        self.endpoint.parse::<Endpoint>()?;
        for place in &self.relay {
            if let Endpoint::Serial { .. } = place.parse().map_err(|problem| format!("relay: {problem}"))? {
                return Err(format!("relay: a ground station is reached over UDP or TCP, not {place:?}"));
            }
        }
        if !(-10.0..=1000.0).contains(&self.home_height_m) {
            return Err(format!("home_height_m must be in -10 to 1000, not {}", self.home_height_m));
        }
        for (key, value) in [("state_rate_hz", self.state_rate_hz), ("guidance_rate_hz", self.guidance_rate_hz)] {
            if !(1.0..=50.0).contains(&value) {
                return Err(format!("{key} must be in 1 to 50, not {value}"));
            }
        }
        self.limits.validate()?;
        self.fail_safe.validate()?;
        self.guidance.loops.validate()?;
        self.payload.validate()?;
        let (fence_m, safe_m) = (self.fail_safe.fence_height_m, self.limits.safe_height_m.max(self.limits.return_height_m));
        if fence_m < safe_m + 2.0 {
            return Err(format!(
                "fail_safe.fence_height_m must be 2 m above the safe and return heights ({safe_m}), not {fence_m}"
            ));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid_and_bad_values_are_one_clear_line() {
        assert_eq!(Config::default().validate(), Ok(()));
        let check = |config: Config, expected: &str| {
            let problem = config.validate().unwrap_err();
            assert!(problem.contains(expected) && !problem.contains('\n'), "{problem}");
        };
        for bad in ["", "tcpout", "tcpout:host", "tcpout:host:0", "udpin::1", "serial:/dev/x:fast", "file:x:1", "udpbcast:1:1"]
        {
            check(Config { endpoint: bad.into(), ..Config::default() }, "endpoint must be");
        }
        for good in ["tcpout:[::1]:5760", "udpin:0.0.0.0:14550", "serial:/dev/ttyACM0:57600", "tcpin:127.0.0.1:0"] {
            assert_eq!(Config { endpoint: good.into(), ..Config::default() }.validate(), Ok(()), "{good}");
        }
        check(
            Config { relay: vec!["udpin:0.0.0.0:14550".into(), "nowhere".into()], ..Config::default() },
            "relay: endpoint must be",
        );
        check(Config { relay: vec!["serial:/dev/ttyUSB0:57600".into()], ..Config::default() }, "over UDP or TCP");
        check(Config { role: "boss".into(), ..Config::default() }, "role must be");
        check(Config { vehicle: "a/b".into(), ..Config::default() }, "vehicle:");
        check(Config { state_rate_hz: f64::NAN, ..Config::default() }, "state_rate_hz");
    }
}
