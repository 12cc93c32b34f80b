//! The gateway's configuration: section `[gateway]`.

use std::net::SocketAddr;

use serde::{Deserialize, Serialize};

use crate::core::fleet::Limits;

/// Section `[gateway]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Address and port of the dashboard and the REST API. Port 0 takes any free one. Whoever reaches it commands the fleet, so
    /// the default is this host alone.
    pub listen: SocketAddr,
    /// Host names, beside this host's own and plain addresses, under which the gateway may be reached. A web page elsewhere can
    /// point a name of its own at this address, so that unknown names are refused.
    pub allowed_hosts: Vec<String>,
    /// How long a command may take to be accepted or refused, seconds.
    pub command_timeout_s: f64,
    /// How long parameters, a mission, a fence or rally points may take to be read or written, seconds. All parameters of an
    /// autopilot take half a minute over a slow radio.
    pub transfer_timeout_s: f64,
    /// How long any other request may take to be answered, seconds.
    pub request_timeout_s: f64,
    /// A connection on which nothing moves for this long is closed, seconds.
    pub idle_timeout_s: f64,
    /// Largest request body, bytes.
    pub body_bytes_max: usize,
    /// Most connections at a time; more wait to be accepted.
    pub connections_max: usize,
    /// Most live streams at a time; more are refused.
    pub streams_max: usize,
    /// A vehicle that is silent for longer is shown as stale, seconds.
    pub vehicle_stale_s: f64,
    /// A rig that is silent for longer is shown as stale, seconds.
    pub rig_stale_s: f64,
    /// A service that is silent for longer is shown as stale, seconds.
    pub service_stale_s: f64,
    /// Most vehicles kept; the one silent for longest is forgotten first.
    pub vehicles_max: usize,
    /// Most rigs kept.
    pub rigs_max: usize,
    /// Most missions kept.
    pub missions_max: usize,
    /// Most service instances kept.
    pub services_max: usize,
    /// Most events kept.
    pub events_max: usize,
    /// Length of each rig's elevation series, seconds.
    pub series_s: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from(([127, 0, 0, 1], 8080)),
            allowed_hosts: Vec::new(),
            command_timeout_s: 5.0,
            transfer_timeout_s: 50.0,
            request_timeout_s: 30.0,
            idle_timeout_s: 60.0,
            body_bytes_max: 64 * 1024,
            connections_max: 256,
            streams_max: 64,
            vehicle_stale_s: 2.0,
            rig_stale_s: 5.0,
            service_stale_s: 5.0,
            vehicles_max: 256,
            rigs_max: 64,
            missions_max: 1000,
            services_max: 512,
            events_max: 2000,
            series_s: 600.0,
        }
    }
}

impl Config {
    /// The store's bounds.
    #[must_use]
    pub fn limits(&self) -> Limits {
        Limits {
            vehicles: self.vehicles_max,
            rigs: self.rigs_max,
            missions: self.missions_max,
            services: self.services_max,
            events: self.events_max,
            series_s: self.series_s,
            vehicle_age_s: self.vehicle_stale_s,
            rig_age_s: self.rig_stale_s,
            service_age_s: self.service_stale_s,
        }
    }
}

impl halcyon_chassis::Section for Config {
    const NAME: &'static str = "gateway";

    fn validate(&self) -> Result<(), String> {
        let seconds = [
            ("command_timeout_s", self.command_timeout_s),
            ("transfer_timeout_s", self.transfer_timeout_s),
            ("request_timeout_s", self.request_timeout_s),
            ("idle_timeout_s", self.idle_timeout_s),
            ("vehicle_stale_s", self.vehicle_stale_s),
            ("rig_stale_s", self.rig_stale_s),
            ("service_stale_s", self.service_stale_s),
            ("series_s", self.series_s),
        ];
        for (key, value) in seconds {
            // Written so that NaN fails, too.
            if !(value > 0.0 && value <= 86_400.0) {
                return Err(format!("[gateway] {key} must be above 0 and at most 86400, not {value}"));
            }
        }
        if self.request_timeout_s <= self.command_timeout_s {
            return Err(format!(
                "[gateway] request_timeout_s must be above command_timeout_s ({}), not {}",
                self.command_timeout_s, self.request_timeout_s
            ));
        }
        // A connection must outlive the request that it carries.
        for (key, value) in [("request_timeout_s", self.request_timeout_s), ("transfer_timeout_s", self.transfer_timeout_s)] {
            if self.idle_timeout_s <= value {
                return Err(format!("[gateway] idle_timeout_s must be above {key} ({value}), not {}", self.idle_timeout_s));
            }
        }
        let counts = [
            ("connections_max", self.connections_max),
            ("streams_max", self.streams_max),
            ("vehicles_max", self.vehicles_max),
            ("rigs_max", self.rigs_max),
            ("missions_max", self.missions_max),
            ("services_max", self.services_max),
            ("events_max", self.events_max),
        ];
        for (key, value) in counts {
            if !(1..=1_000_000).contains(&value) {
                return Err(format!("[gateway] {key} must be 1 to 1000000, not {value}"));
            }
        }
        if !(1024..=16 * 1024 * 1024).contains(&self.body_bytes_max) {
            return Err(format!("[gateway] body_bytes_max must be 1024 to 16777216, not {}", self.body_bytes_max));
        }
        for host in &self.allowed_hosts {
            let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '.' | '_');
            if host.is_empty() || !host.chars().all(allowed) {
                return Err(format!("[gateway] allowed_hosts holds {host:?}, which is not a host name (no scheme, no port)"));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use halcyon_chassis::Section;

    use super::*;

    #[test]
    fn the_defaults_are_valid() {
        assert_eq!(Config::default().validate(), Ok(()));
    }

    #[test]
    fn every_bad_value_is_named() {
        #[track_caller]
        fn check(key: &str, spoil: impl FnOnce(&mut Config)) {
            let mut config = Config::default();
            spoil(&mut config);
            let error = config.validate().unwrap_err();
            assert!(error.starts_with("[gateway]") && error.contains(key), "{error}");
        }
        check("command_timeout_s", |config| config.command_timeout_s = f64::NAN);
        check("vehicle_stale_s", |config| config.vehicle_stale_s = -1.0);
        check("request_timeout_s", |config| config.request_timeout_s = 1.0);
        check("idle_timeout_s", |config| config.idle_timeout_s = 20.0);
        check("idle_timeout_s", |config| config.transfer_timeout_s = 90.0);
        check("streams_max", |config| config.streams_max = 0);
        check("body_bytes_max", |config| config.body_bytes_max = 0);
        check("allowed_hosts", |config| config.allowed_hosts = vec!["http://x".into()]);
    }
}
