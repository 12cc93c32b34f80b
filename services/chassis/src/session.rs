//! One Zenoh session, configured from `[bus]`.

use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::config::Section;

/// How this session takes part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Mode {
    /// Forwards for others: one per vehicle or station. Zenoh's peers do not relay to each other, routers do.
    Router,
    /// Attaches to the router of its host.
    Client,
}

/// `[bus]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BusConfig {
    /// `router` for the one process of a host that forwards, `client` for the others.
    pub mode: Mode,
    /// Endpoints to listen on, such as `tcp/0.0.0.0:7447` or `udp/0.0.0.0:7447`. A router without any only connects.
    pub listen: Vec<String>,
    /// Endpoints of neighbours, or of the host's router for a client.
    pub connect: Vec<String>,
    /// Look for neighbours by multicast. Off: endpoints are explicit.
    pub multicast: bool,
    /// A neighbour silent for this long is gone, milliseconds.
    pub lease_ms: u64,
}

impl Default for BusConfig {
    fn default() -> Self {
        Self { mode: Mode::Router, listen: Vec::new(), connect: Vec::new(), multicast: false, lease_ms: 1000 }
    }
}

impl Section for BusConfig {
    const NAME: &'static str = "bus";

    fn validate(&self) -> Result<(), String> {
        if !(200..=60_000).contains(&self.lease_ms) {
            return Err(format!("lease_ms must be in 200 to 60000, not {}", self.lease_ms));
        }
        if self.mode == Mode::Client && self.connect.is_empty() && !self.multicast {
            return Err("mode = \"client\" needs the router's endpoint in connect, such as [\"tcp/127.0.0.1:7447\"]".into());
        }
        for endpoint in self.listen.iter().chain(&self.connect) {
            endpoint.parse::<zenoh::config::EndPoint>().map_err(|error| format!("endpoint {endpoint:?}: {error}"))?;
        }
        Ok(())
    }
}

impl BusConfig {
    /// The Zenoh configuration. Every key is explicit: a default that changes upstream must not change the fleet.
    pub(crate) fn zenoh(&self) -> Result<zenoh::Config, zenoh::Error> {
        let mode = match self.mode {
            Mode::Router => "router",
            Mode::Client => "client",
        };
        let config = json!({
            "mode": mode,
            "listen": { "endpoints": self.listen },
            "connect": {
                "endpoints": self.connect,
                // Never give up: the other host may be switched on later.
                "timeout_ms": -1,
                "exit_on_failure": false,
                "retry": { "period_init_ms": 200, "period_max_ms": 1000, "period_increase_factor": 2 },
            },
            "scouting": { "multicast": { "enabled": self.multicast }, "gossip": { "enabled": false } },
            // Histories are ordered by time, so clients stamp as well.
            "timestamping": { "enabled": { "router": true, "peer": true, "client": true } },
            "transport": { "link": { "tx": { "lease": self.lease_ms, "keep_alive": 4 } } },
        });
        zenoh::Config::from_json5(&config.to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_client_without_a_router_is_refused() {
        let client = BusConfig { mode: Mode::Client, ..BusConfig::default() };
        assert!(client.validate().unwrap_err().contains("connect"));
        assert!(BusConfig { listen: vec!["127.0.0.1:7447".into()], ..BusConfig::default() }.validate().is_err());
    }

    #[test]
    fn the_configuration_is_accepted() {
        let config = BusConfig { listen: vec!["tcp/127.0.0.1:0".into()], ..BusConfig::default() };
        let zenoh = config.zenoh().unwrap();
        assert!(zenoh.get_json("transport/link/tx/lease").unwrap().contains("1000"));
    }
}
