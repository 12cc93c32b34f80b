//! What to simulate (`[sim]`).

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use halcyon_model::{Role, VehicleId};
use serde::{Deserialize, Serialize};

use crate::battery::BatteryConfig;
use crate::copter::AirframeConfig;
use crate::estimator::EstimatorConfig;
use crate::fault::ScheduledFault;
use crate::gnss::GnssConfig;
use crate::rangefinder::RangefinderConfig;
use crate::rig::RigConfig;
use crate::sea::SeaConfig;
use crate::wind::WindConfig;

/// First MAVLink port, and how many lie between two vehicles: ArduPilot's own simulator's.
const PORT_FIRST: u16 = 5760;
const PORT_STEP: u16 = 10;
/// Metres between neighbours on the jetty.
const JETTY_SPACING_M: f64 = 8.0;
/// Most vehicles: a system id is one byte and 0 and 255 are taken.
const VEHICLES_MAX: usize = 250;

/// Everything that is simulated. The same seed and the same inputs at the same times give the same flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SimConfig {
    /// Seed of the sea, the wind and every sensor.
    pub seed: u64,
    /// Address that the vehicles' MAVLink ports listen on.
    pub bind: IpAddr,
    /// The sea.
    pub sea: SeaConfig,
    /// The leaders' cameras.
    pub rig: RigConfig,
    /// The wind.
    pub wind: WindConfig,
    /// The vehicles' GNSS receivers.
    pub gnss: GnssConfig,
    /// The vehicles' other sensors and their filter.
    pub estimator: EstimatorConfig,
    /// The vehicles' rangefinders.
    pub rangefinder: RangefinderConfig,
    /// The vehicles' batteries.
    pub battery: BatteryConfig,
    /// The vehicles' airframe.
    pub airframe: AirframeConfig,
    /// Who flies. At most 250.
    pub vehicles: Vec<SimVehicle>,
    /// What goes wrong, and when.
    pub faults: Vec<ScheduledFault>,
}

impl Default for SimConfig {
    /// One leader and two followers on a jetty by a small lake.
    fn default() -> Self {
        Self {
            seed: 1,
            bind: IpAddr::V4(Ipv4Addr::LOCALHOST),
            sea: SeaConfig::default(),
            rig: RigConfig::default(),
            wind: WindConfig::default(),
            gnss: GnssConfig::default(),
            estimator: EstimatorConfig::default(),
            rangefinder: RangefinderConfig::default(),
            battery: BatteryConfig::default(),
            airframe: AirframeConfig::default(),
            vehicles: SimVehicle::fleet(1, 2),
            faults: Vec::new(),
        }
    }
}

/// One simulated vehicle (`[[sim.vehicles]]`). Its home is on a jetty at height 0, the mean water level.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimVehicle {
    /// Name, unique in the fleet.
    #[serde(with = "id_text")]
    pub id: VehicleId,
    /// `leader` (carries cameras) or `follower`.
    #[serde(with = "role_text")]
    pub role: Role,
    /// Home, metres north of the fleet's origin.
    #[serde(default)]
    pub north_m: f64,
    /// Home, metres east of the fleet's origin.
    #[serde(default)]
    pub east_m: f64,
    /// Heading at the start, degrees clockwise from true north.
    #[serde(default)]
    pub heading_deg: f64,
    /// TCP port of its MAVLink server; 0 takes a free one.
    #[serde(default)]
    pub mavlink_port: u16,
    /// MAVLink system id, 1 to 250; by default its place in the list.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub system_id: Option<u8>,
    /// Also speak MAVLink over UDP to this address, such as a ground station's `127.0.0.1:14550`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub udp_out: Option<SocketAddr>,
}

impl SimVehicle {
    /// `leaders` and `followers` in a line on the jetty: leader-1 at the origin, each next one 8 m further west, ports from 5760 up
    /// in tens as ArduPilot's simulator has them. More vehicles than there are letters for are left out: see [`SimConfig::validate`].
    #[must_use]
    pub fn fleet(leaders: usize, followers: usize) -> Vec<Self> {
        let leader = (1..=leaders).map(|number| (format!("leader-{number}"), Role::Leader));
        let follower = (1..=followers).map(|number| (format!("follower-{number}"), Role::Follower));
        leader
            .chain(follower)
            .take(VEHICLES_MAX + 1)
            .enumerate()
            .filter_map(|(index, (name, role))| {
                Some(Self {
                    id: VehicleId::new(name).ok()?,
                    role,
                    north_m: 0.0,
                    east_m: 0.0 - JETTY_SPACING_M * index as f64,
                    heading_deg: 0.0,
                    mavlink_port: PORT_FIRST + PORT_STEP * index as u16,
                    system_id: None,
                    udp_out: None,
                })
            })
            .collect()
    }
}

impl SimConfig {
    /// Checks every number and name.
    ///
    /// # Errors
    /// One line that names the key, its range and the value.
    pub fn validate(&self) -> Result<(), String> {
        self.sea.validate().map_err(|error| format!("{error}"))?;
        self.rig.validate().map_err(|error| format!("{error}"))?;
        self.wind.validate()?;
        self.gnss.validate()?;
        self.estimator.validate()?;
        self.rangefinder.validate()?;
        self.battery.validate()?;
        self.airframe.validate()?;
        if self.vehicles.len() > VEHICLES_MAX {
            return Err(format!("vehicles must be at most {VEHICLES_MAX}, not {}", self.vehicles.len()));
        }
        for (index, vehicle) in self.vehicles.iter().enumerate() {
            let id = &vehicle.id;
            range(&format!("vehicles ({id}) north_m"), vehicle.north_m, -10_000.0, 10_000.0)?;
            range(&format!("vehicles ({id}) east_m"), vehicle.east_m, -10_000.0, 10_000.0)?;
            range(&format!("vehicles ({id}) heading_deg"), vehicle.heading_deg, -360.0, 360.0)?;
            range(&format!("vehicles ({id}) system_id"), f64::from(self.system_id(index)), 1.0, 250.0)?;
            for (other_index, other) in self.vehicles[..index].iter().enumerate() {
                if other.id == *id {
                    return Err(format!("two vehicles are called {id}"));
                }
                if self.system_id(other_index) == self.system_id(index) {
                    return Err(format!("{} and {id} have the same system_id", other.id));
                }
                if vehicle.mavlink_port != 0 && vehicle.mavlink_port == other.mavlink_port {
                    return Err(format!("{} and {id} have the same mavlink_port {}", other.id, other.mavlink_port));
                }
            }
        }
        self.faults.iter().try_for_each(|fault| {
            fault.validate()?;
            if self.vehicles.iter().any(|vehicle| vehicle.id == fault.vehicle) {
                Ok(())
            } else {
                Err(format!("a fault is for {}, which no vehicle is called", fault.vehicle))
            }
        })
    }

    /// MAVLink system id of the vehicle at `index`.
    #[must_use]
    pub fn system_id(&self, index: usize) -> u8 {
        let by_place = u8::try_from(index + 1).unwrap_or(u8::MAX);
        self.vehicles.get(index).and_then(|vehicle| vehicle.system_id).unwrap_or(by_place)
    }
}

/// Refuses what is not in `least..=most`, NaN included, in one line.
pub(crate) fn range(key: &str, value: f64, least: f64, most: f64) -> Result<(), String> {
    if (least..=most).contains(&value) { Ok(()) } else { Err(format!("{key} must be {least} to {most}, not {value}")) }
}

/// A vehicle's name as text: the model's nouns know no serde.
pub(crate) mod id_text {
    use super::{Deserialize, VehicleId};
    use serde::{Deserializer, Serializer, de::Error};

    pub(crate) fn serialize<S: Serializer>(id: &VehicleId, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(id.as_str())
    }

    pub(crate) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<VehicleId, D::Error> {
        VehicleId::new(String::deserialize(deserializer)?).map_err(D::Error::custom)
    }
}

mod role_text {
    use super::{Deserialize, Role};
    use serde::{Deserializer, Serializer, de::Error};

    pub(super) fn serialize<S: Serializer>(role: &Role, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(match role {
            Role::Leader => "leader",
            Role::Follower => "follower",
        })
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Role, D::Error> {
        match String::deserialize(deserializer)?.as_str() {
            "leader" => Ok(Role::Leader),
            "follower" => Ok(Role::Follower),
            other => Err(D::Error::unknown_variant(other, &["leader", "follower"])),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_fleet_stands_on_the_jetty() {
        let config = SimConfig::default();
        assert_eq!(config.validate(), Ok(()));
        let homes: Vec<_> = config.vehicles.iter().map(|vehicle| (vehicle.id.as_str(), vehicle.east_m)).collect();
        assert_eq!(homes, [("leader-1", 0.0), ("follower-1", -8.0), ("follower-2", -16.0)]);
    }

    #[test]
    fn bad_values_are_refused_by_name() {
        let check = |change: fn(&mut SimConfig), part: &str| {
            let mut config = SimConfig::default();
            change(&mut config);
            let error = config.validate().expect_err(part);
            assert!(error.contains(part), "{error}");
        };
        check(|config| config.gnss.rate_hz = f64::NAN, "gnss.rate_hz must be 1 to 50, not NaN");
        check(|config| config.wind.speed_mps = -1.0, "wind.speed_mps");
        check(|config| config.vehicles[1].id = config.vehicles[0].id.clone(), "two vehicles are called leader-1");
        check(|config| config.vehicles[1].system_id = Some(1), "same system_id");
        check(|config| config.vehicles[1].mavlink_port = 5760, "same mavlink_port");
        check(|config| config.vehicles = SimVehicle::fleet(1, 300), "at most 250");
    }
}
