//! An autopilot that mostly does what it is asked, and says what it likes: the executor must get into the air to be at fault there.

use halcyon_model::{FleetOrigin, FlightMode, Geodetic};
use halcyon_vehicle_link::core::mode::{Family, PX4_TAKE_OFF};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage, MavResult};
use nalgebra::Vector3;

use crate::noise::Noise;

/// Modes that a pilot flies in, and that neither guidance nor this test's people ever ask for.
pub(crate) const PILOTS: [FlightMode; 3] = [FlightMode::Stabilize, FlightMode::AltHold, FlightMode::PosHold];

pub(crate) struct Copter {
    pub(crate) family: Family,
    pub(crate) mode: FlightMode,
    pub(crate) armed: bool,
    pub(crate) position: Vector3<f64>,
    velocity: Vector3<f64>,
    origin: FleetOrigin,
    target: Option<Vector3<f64>>,
    climb_to_m: Option<f64>,
    boot_s: f64,
    battery: f64,
    home: Geodetic,
}

impl Copter {
    pub(crate) fn new(family: Family, origin: FleetOrigin) -> Self {
        let home = origin.frame().geodetic_from_ned(Vector3::zeros());
        Self {
            family,
            mode: FlightMode::Loiter,
            armed: false,
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            origin,
            target: None,
            climb_to_m: None,
            // Soon around.
            boot_s: f64::from(u32::MAX) * 1e-3 - 600.0,
            battery: 95.0,
            home,
        }
    }

    pub(crate) fn flies(&self) -> bool {
        self.position.z < -0.3
    }

    /// The pilot, or a fresh battery, or whoever carries it home.
    pub(crate) fn meddle(&mut self, noise: &mut Noise) {
        match noise.below(6) {
            0 | 1 => self.mode = noise.of(&PILOTS),
            2 => self.mode = noise.of(&[FlightMode::Loiter, FlightMode::Land, FlightMode::Rtl, FlightMode::Auto]),
            3 => self.mode = FlightMode::Guided,
            4 => self.armed = noise.chance(0.5),
            _ if self.flies() || self.armed => self.battery = 95.0,
            _ => self.position = Vector3::zeros(),
        }
    }

    pub(crate) fn step(&mut self, dt_s: f64) {
        self.boot_s += dt_s;
        self.battery = if self.armed { self.battery - 0.02 * dt_s } else { 95.0 };
        let wanted = match self.mode {
            FlightMode::Guided => self.target.map_or_else(Vector3::zeros, |target| target - self.position),
            FlightMode::Land | FlightMode::Rtl => Vector3::new(0.0, 0.0, 0.6),
            _ => Vector3::zeros(),
        };
        let climb = self.climb_to_m.filter(|_| self.mode == self.family.climbs_in() && self.target.is_none());
        let wanted = climb.map_or(wanted, |height_m| Vector3::new(0.0, 0.0, -height_m - self.position.z));
        let motors = if self.armed { wanted.cap_magnitude(5.0) } else { Vector3::new(0.0, 0.0, 4.0) };
        self.velocity += (motors - self.velocity).cap_magnitude(4.0 * dt_s);
        self.position += self.velocity * dt_s;
        if self.mode == PX4_TAKE_OFF && climb.is_some_and(|height_m| -self.position.z > height_m - 0.8) {
            self.mode = FlightMode::Loiter;
        }
        if self.position.z >= 0.0 {
            self.position.z = 0.0;
            self.velocity = Vector3::zeros();
            if matches!(self.mode, FlightMode::Land | FlightMode::Rtl) {
                self.armed = false;
            }
        }
    }

    /// What was sent to it; what it answers.
    pub(crate) fn take(&mut self, message: &MavMessage, noise: &mut Noise) -> Option<MavMessage> {
        let data = match message {
            MavMessage::SET_POSITION_TARGET_GLOBAL_INT(data) => {
                let place = Geodetic::from_deg(f64::from(data.lat_int) * 1e-7, f64::from(data.lon_int) * 1e-7, 0.0);
                let ned_m = self.origin.frame().ned_from_geodetic(place);
                self.target = Some(Vector3::new(ned_m.x, ned_m.y, -f64::from(data.alt)));
                return None;
            }
            MavMessage::SET_POSITION_TARGET_LOCAL_NED(data) => {
                self.target = Some(Vector3::new(data.x.into(), data.y.into(), data.z.into()));
                return None;
            }
            MavMessage::COMMAND_LONG(data) => data,
            _ => return None,
        };
        let obeys = noise.chance(0.85);
        match data.command {
            MavCmd::MAV_CMD_DO_SET_MODE if obeys => {
                self.mode = match self.family {
                    Family::ArduPilot => self.family.mode(data.param2 as u32),
                    Family::Px4 => self.family.mode((data.param2 as u32) << 16 | (data.param3 as u32) << 24),
                };
                (self.target, self.climb_to_m) = (None, None);
            }
            MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if obeys => self.armed = data.param1 == 1.0,
            MavCmd::MAV_CMD_NAV_TAKEOFF if obeys => {
                (self.target, self.climb_to_m) = (None, Some(6.0));
                self.mode = self.family.climbs_in();
            }
            _ => {}
        }
        let results = [
            MavResult::MAV_RESULT_ACCEPTED,
            MavResult::MAV_RESULT_TEMPORARILY_REJECTED,
            MavResult::MAV_RESULT_IN_PROGRESS,
            MavResult::MAV_RESULT_COMMAND_INT_ONLY,
            MavResult::MAV_RESULT_FAILED,
        ];
        let result = if obeys { MavResult::MAV_RESULT_ACCEPTED } else { noise.of(&results) };
        let ack = ardu::COMMAND_ACK_DATA { command: data.command, result, progress: noise.next() as u8, ..Default::default() };
        noise.chance(0.95).then_some(MavMessage::COMMAND_ACK(ack))
    }

    /// What an autopilot says of itself, one message after another; now and then with numbers that can't be.
    pub(crate) fn say(&mut self, noise: &mut Noise) -> MavMessage {
        let odd = noise.chance(0.003);
        let boot_ms = if odd { noise.next() as u32 } else { (self.boot_s * 1e3) as u64 as u32 };
        let mut place = self.origin.frame().geodetic_from_ned(self.position);
        if odd && noise.chance(0.5) {
            place = self.origin.frame().geodetic_from_ned(self.position + Vector3::new(noise.between(-60.0, 60.0), 9.0, 0.0));
        }
        let wild = |noise: &mut Noise| noise.next() as i32;
        let degrees = |deg: f64| (deg * 1e7).round() as i32;
        match noise.below(14) {
            0 | 1 => self.heartbeat(),
            2..=4 => {
                let (lat, lon) = (degrees(place.latitude_deg()), degrees(place.longitude_deg()));
                let relative_alt = (-self.position.z * 1e3) as i32;
                let [vx, vy, vz] = [0, 1, 2].map(|axis| (self.velocity[axis] * 100.0) as i16);
                let position = ardu::GLOBAL_POSITION_INT_DATA {
                    time_boot_ms: boot_ms,
                    lat,
                    lon,
                    alt: relative_alt,
                    relative_alt,
                    vx,
                    vy,
                    vz,
                    hdg: 0,
                };
                let wrong = ardu::GLOBAL_POSITION_INT_DATA {
                    lat: noise.of(&[lat, 0, i32::MAX, i32::MIN, 900_000_000]),
                    lon: noise.of(&[lon, 0, i32::MAX, i32::MIN, 1_799_999_999]),
                    relative_alt: noise.of(&[relative_alt, i32::MAX, i32::MIN]),
                    vx: noise.of(&[vx, i16::MAX, i16::MIN]),
                    vz: noise.of(&[vz, i16::MAX, i16::MIN]),
                    ..position.clone()
                };
                MavMessage::GLOBAL_POSITION_INT(if odd && noise.chance(0.3) { wrong } else { position })
            }
            5 => {
                let at = |noise: &mut Noise, value: f64| if odd { noise.number(-9.0, 9.0) as f32 } else { value as f32 };
                let [x, y, z] = [0, 1, 2].map(|axis| self.position[axis]);
                let [vx, vy, vz] = [0, 1, 2].map(|axis| self.velocity[axis]);
                MavMessage::LOCAL_POSITION_NED(ardu::LOCAL_POSITION_NED_DATA {
                    time_boot_ms: boot_ms,
                    x: at(noise, x),
                    y: at(noise, y),
                    z: at(noise, z),
                    vx: at(noise, vx),
                    vy: at(noise, vy),
                    vz: at(noise, vz),
                })
            }
            6 => {
                let q1 = if odd { noise.number(-1.0, 1.0) as f32 } else { 1.0 };
                MavMessage::ATTITUDE_QUATERNION(ardu::ATTITUDE_QUATERNION_DATA { q1, ..Default::default() })
            }
            7 => {
                let states = [
                    ardu::MavLandedState::MAV_LANDED_STATE_UNDEFINED,
                    ardu::MavLandedState::MAV_LANDED_STATE_ON_GROUND,
                    ardu::MavLandedState::MAV_LANDED_STATE_IN_AIR,
                    ardu::MavLandedState::MAV_LANDED_STATE_TAKEOFF,
                    ardu::MavLandedState::MAV_LANDED_STATE_LANDING,
                ];
                let landed_state = if odd { noise.of(&states) } else { states[if self.flies() { 2 } else { 1 }] };
                MavMessage::EXTENDED_SYS_STATE(ardu::EXTENDED_SYS_STATE_DATA { landed_state, ..Default::default() })
            }
            8 => {
                let prearm = ardu::MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK;
                MavMessage::SYS_STATUS(ardu::SYS_STATUS_DATA {
                    onboard_control_sensors_present: prearm,
                    onboard_control_sensors_enabled: prearm,
                    onboard_control_sensors_health: if odd { ardu::MavSysStatusSensor::empty() } else { prearm },
                    battery_remaining: if odd { noise.next() as i8 } else { self.battery as i8 },
                    ..Default::default()
                })
            }
            9 => {
                let velocity_variance = if odd { noise.number(0.0, 2.0) as f32 } else { 0.1 };
                let flags = ardu::EkfStatusFlags::from_bits_truncate(831);
                MavMessage::EKF_STATUS_REPORT(ardu::EKF_STATUS_REPORT_DATA { flags, velocity_variance, ..Default::default() })
            }
            10 => {
                let flags = ardu::EstimatorStatusFlags::from_bits_truncate(if odd { noise.next() as u16 } else { 63 });
                MavMessage::ESTIMATOR_STATUS(ardu::ESTIMATOR_STATUS_DATA { flags, ..Default::default() })
            }
            11 => MavMessage::GPS_RAW_INT(ardu::GPS_RAW_INT_DATA {
                fix_type: if odd { ardu::GpsFixType::GPS_FIX_TYPE_NO_FIX } else { ardu::GpsFixType::GPS_FIX_TYPE_3D_FIX },
                satellites_visible: 12,
                ..Default::default()
            }),
            12 => {
                if noise.chance(0.02) {
                    let moved = Vector3::new(noise.between(-80.0, 80.0), noise.between(-80.0, 80.0), noise.between(-9.0, 9.0));
                    self.home = self.origin.frame().geodetic_from_ned(moved);
                }
                MavMessage::HOME_POSITION(ardu::HOME_POSITION_DATA {
                    latitude: if odd { wild(noise) } else { degrees(self.home.latitude_deg()) },
                    longitude: degrees(self.home.longitude_deg()),
                    altitude: if odd { wild(noise) } else { 0 },
                    ..Default::default()
                })
            }
            _ => {
                let distance = if odd { noise.number(-9.0, 9.0) } else { -self.position.z.min(-0.1) };
                MavMessage::RANGEFINDER(ardu::RANGEFINDER_DATA { distance: distance as f32, voltage: 0.0 })
            }
        }
    }

    pub(crate) fn heartbeat(&self) -> MavMessage {
        let [main, sub] = self.family.set_mode_parameters(self.mode).unwrap_or_default();
        let mut base_mode = ardu::MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
        base_mode.set(ardu::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, self.armed);
        let (autopilot, custom_mode) = match self.family {
            Family::ArduPilot => (ardu::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA, main),
            Family::Px4 => (ardu::MavAutopilot::MAV_AUTOPILOT_PX4, main << 16 | sub << 24),
        };
        let mavtype = ardu::MavType::MAV_TYPE_QUADROTOR;
        MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA { custom_mode, mavtype, autopilot, base_mode, ..Default::default() })
    }
}
