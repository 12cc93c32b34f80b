//! A point mass that answers MAVLink as PX4 does. After PX4's own sources:
//!
//! - `custom_mode` holds main and sub mode (`px4_custom_mode.h`).
//! - COMPONENT_ARM_DISARM, DO_SET_MODE and NAV_TAKEOFF are answered TEMPORARILY_REJECTED when they can't be (`Commander.cpp`).
//! - Disarmed, every mode is taken; armed, OFFBOARD only while setpoints are younger than COM_OF_LOSS_T, 1 s (`UserModeIntention.cpp`,
//!   `offboardCheck.cpp`). Its documentation wants more than 2 Hz, so this one does.
//! - OFFBOARD without setpoints for that long falls to COM_OBL_RC_ACT's default, Position mode.
//! - NAV_TAKEOFF's altitude is above mean sea level; finite latitude and longitude are where it goes. Within NAV_MC_ALT_RAD (0.8 m) of it
//!   AUTO.TAKEOFF ends in AUTO.LOITER (COM_TAKEOFF_ACT 0).
//! - After LAND the motors stop by COM_DISARM_LAND (2 s); the mode is then the last one in which it may be armed
//!   (`UserModeIntention::onDisarm`). Motors that don't take off stop after COM_DISARM_PRFLT (10 s).

use std::collections::BTreeMap;

use halcyon_model::{FleetOrigin, Geodetic};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage, MavResult, PositionTargetTypemask as Mask};
use mavlink::{MavHeader, Message as _, MessageData as _};
use nalgebra::Vector3;

pub(crate) const SYSTEM: u8 = 9;
pub(crate) const POSCTL: (u32, u32) = (3, 0);
pub(crate) const TAKEOFF: (u32, u32) = (4, 2);
pub(crate) const LOITER: (u32, u32) = (4, 3);
pub(crate) const RTL: (u32, u32) = (4, 5);
pub(crate) const LAND: (u32, u32) = (4, 6);
pub(crate) const OFFBOARD: (u32, u32) = (6, 0);
/// Altitude of the water and of home above mean sea level, metres.
const AMSL_M: f64 = 372.5;
const OF_LOSS_S: f64 = 1.0;
const RATE_HZ_MIN: usize = 2;

pub(crate) struct Px4 {
    /// Seconds since boot.
    pub(crate) t: f64,
    pub(crate) mode: (u32, u32),
    pub(crate) armed: bool,
    /// Arming checks pass.
    pub(crate) ready: bool,
    pub(crate) position: Vector3<f64>,
    pub(crate) velocity: Vector3<f64>,
    pub(crate) yaw: f64,
    /// Every mode that it was in, in order.
    pub(crate) modes: Vec<(u32, u32)>,
    /// Setpoints in the local frame, and by latitude and longitude.
    pub(crate) local_setpoints: usize,
    pub(crate) global_setpoints: usize,
    /// Setpoints with an acceleration.
    pub(crate) feeds: usize,
    /// Times that it fell out of OFFBOARD.
    pub(crate) losses: usize,
    origin: FleetOrigin,
    /// Its local frame's origin isn't the fleet's.
    local_from_fleet: Vector3<f64>,
    mode_after_disarm: (u32, u32),
    setpoint: Option<ardu::SET_POSITION_TARGET_LOCAL_NED_DATA>,
    heard: Vec<f64>,
    take_off_amsl: f64,
    hold_z: f64,
    grounded: f64,
    armed_for: f64,
    flown: bool,
    streams: BTreeMap<u32, (f64, f64)>,
    sequence: u8,
}

impl Px4 {
    pub(crate) fn new(origin: FleetOrigin) -> Self {
        Self {
            t: 20.0,
            mode: LOITER,
            armed: false,
            ready: true,
            position: Vector3::zeros(),
            velocity: Vector3::zeros(),
            yaw: 0.3,
            modes: vec![LOITER],
            local_setpoints: 0,
            global_setpoints: 0,
            feeds: 0,
            losses: 0,
            origin,
            local_from_fleet: Vector3::new(12.0, -7.0, 3.0),
            mode_after_disarm: LOITER,
            setpoint: None,
            heard: Vec::new(),
            take_off_amsl: 0.0,
            hold_z: 0.0,
            grounded: 0.0,
            armed_for: 0.0,
            flown: false,
            // Nothing but heartbeats until asked.
            streams: BTreeMap::from([(ardu::HEARTBEAT_DATA::ID, (1.0, 0.0))]),
            sequence: 0,
        }
    }

    /// The pilot's switch, or PX4's own change.
    pub(crate) fn enter(&mut self, mode: (u32, u32)) {
        if self.mode != mode {
            self.modes.push(mode);
        }
        self.mode = mode;
        self.hold_z = self.position.z;
        if ![LAND, RTL, TAKEOFF].contains(&mode) {
            self.mode_after_disarm = mode;
        }
    }

    fn set_armed(&mut self, armed: bool) {
        (self.armed, self.armed_for, self.flown) = (armed, 0.0, false);
        if !armed {
            self.enter(self.mode_after_disarm);
        }
    }

    pub(crate) fn landed(&self) -> bool {
        self.position.z >= -0.02 && (self.mode != TAKEOFF || !self.armed)
    }

    fn offboard_available(&self) -> bool {
        self.heard.iter().filter(|at| self.t - **at < OF_LOSS_S).count() >= RATE_HZ_MIN
    }

    fn can_run(&self, mode: (u32, u32)) -> bool {
        match mode {
            OFFBOARD => self.offboard_available(),
            POSCTL | TAKEOFF | LOITER | RTL | LAND => true,
            _ => false,
        }
    }

    /// A frame from the onboard computer; what it answers.
    pub(crate) fn take(&mut self, from: MavHeader, message: &MavMessage) -> Vec<MavMessage> {
        assert!(message.target_system_id().is_none_or(|target| target == SYSTEM), "{message:?}");
        match message {
            MavMessage::COMMAND_LONG(data) => self.command(from, data),
            MavMessage::SET_POSITION_TARGET_LOCAL_NED(data) => {
                assert_eq!(data.coordinate_frame, ardu::MavFrame::MAV_FRAME_LOCAL_NED);
                assert!(!data.type_mask.contains(Mask::POSITION_TARGET_TYPEMASK_FORCE_SET));
                self.local_setpoints += 1;
                self.feeds += usize::from(!data.type_mask.contains(Mask::POSITION_TARGET_TYPEMASK_AX_IGNORE));
                self.heard.retain(|at| self.t - at < OF_LOSS_S);
                self.heard.push(self.t);
                self.setpoint = Some(data.clone());
                Vec::new()
            }
            MavMessage::SET_POSITION_TARGET_GLOBAL_INT(_) => {
                self.global_setpoints += 1;
                Vec::new()
            }
            MavMessage::TIMESYNC(question) if question.tc1 == 0 => {
                vec![MavMessage::TIMESYNC(ardu::TIMESYNC_DATA { tc1: (self.t * 1e9) as i64, ..question.clone() })]
            }
            _ => Vec::new(),
        }
    }

    fn command(&mut self, from: MavHeader, data: &ardu::COMMAND_LONG_DATA) -> Vec<MavMessage> {
        let rejected = MavResult::MAV_RESULT_TEMPORARILY_REJECTED;
        let accepted_if = |ok: bool| if ok { MavResult::MAV_RESULT_ACCEPTED } else { rejected };
        let mut answers = Vec::new();
        let result = match data.command {
            MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if data.param1 == 1.0 => {
                let ok =
                    self.ready && ![LAND, RTL].contains(&self.mode) && (self.mode != OFFBOARD || self.offboard_available());
                if !ok {
                    answers.push(MavMessage::STATUSTEXT(ardu::STATUSTEXT_DATA {
                        severity: ardu::MavSeverity::MAV_SEVERITY_CRITICAL,
                        text: "Arming denied: Resolve system health failures first".into(),
                        ..Default::default()
                    }));
                } else if !self.armed {
                    self.set_armed(true);
                }
                accepted_if(ok)
            }
            MavCmd::MAV_CMD_COMPONENT_ARM_DISARM => {
                let ok = !self.armed || self.landed() || data.param2 == 21196.0;
                if ok && self.armed {
                    self.set_armed(false);
                }
                accepted_if(ok)
            }
            MavCmd::MAV_CMD_DO_SET_MODE => {
                assert_eq!(data.param1, 1.0, "custom mode enabled");
                let mode = (data.param2 as u32, data.param3 as u32);
                let ok = !self.armed || self.can_run(mode);
                if ok {
                    self.enter(mode);
                }
                accepted_if(ok)
            }
            MavCmd::MAV_CMD_NAV_TAKEOFF => {
                assert!([data.param4, data.param5, data.param6].iter().all(|number| number.is_nan()), "{data:?}");
                self.take_off_amsl = f64::from(data.param7);
                self.enter(TAKEOFF);
                MavResult::MAV_RESULT_ACCEPTED
            }
            MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL => {
                self.streams.insert(data.param1 as u32, (f64::from(data.param2) * 1e-6, self.t));
                MavResult::MAV_RESULT_ACCEPTED
            }
            MavCmd::MAV_CMD_DO_SET_HOME | MavCmd::MAV_CMD_REQUEST_MESSAGE => MavResult::MAV_RESULT_ACCEPTED,
            _ => MavResult::MAV_RESULT_UNSUPPORTED,
        };
        answers.push(MavMessage::COMMAND_ACK(ardu::COMMAND_ACK_DATA {
            command: data.command,
            result,
            target_system: from.system_id as u8,
            target_component: from.component_id,
            ..Default::default()
        }));
        answers
    }

    pub(crate) fn step(&mut self, dt: f64) {
        self.t += dt;
        if self.mode == OFFBOARD && self.armed && !self.offboard_available() {
            self.losses += 1;
            self.enter(POSCTL);
        }
        let home_m = -Vector3::new(self.position.x, self.position.y, 0.0);
        let down = Vector3::new(0.0, 0.0, 0.7);
        let hold = Vector3::new(0.0, 0.0, self.hold_z - self.position.z);
        let wanted = match self.mode {
            OFFBOARD => self.setpoint.as_ref().map_or_else(Vector3::zeros, |data| {
                let place = Vector3::new(data.x.into(), data.y.into(), data.z.into()) - self.local_from_fleet;
                if !data.type_mask.contains(Mask::POSITION_TARGET_TYPEMASK_YAW_IGNORE) {
                    self.yaw = data.yaw.into();
                }
                Vector3::new(data.vx.into(), data.vy.into(), data.vz.into()) + (place - self.position)
            }),
            TAKEOFF => {
                let left = self.take_off_amsl - (AMSL_M - self.position.z);
                if left < 0.8 && self.armed {
                    self.enter(LOITER);
                    self.hold_z = -(self.take_off_amsl - AMSL_M);
                }
                Vector3::new(0.0, 0.0, -left.clamp(-1.5, 1.5))
            }
            RTL if home_m.norm() > 0.5 => home_m.cap_magnitude(3.0),
            LAND | RTL => down,
            _ => hold,
        };
        if self.armed {
            self.armed_for += dt;
            self.velocity += ((wanted - self.velocity) / 0.4).cap_magnitude(4.0) * dt;
            self.position += self.velocity * dt;
        }
        if self.position.z >= 0.0 {
            self.position.z = 0.0;
            self.velocity = Vector3::zeros();
        }
        self.flown |= self.armed && self.position.z < -0.3;
        self.grounded = if self.landed() { self.grounded + dt } else { 0.0 };
        let limit_s = if self.flown { 2.0 } else { 10.0 };
        if self.armed && self.grounded > limit_s && self.armed_for > limit_s {
            self.set_armed(false);
        }
    }

    fn geodetic(&self) -> Geodetic {
        self.origin.frame().geodetic_from_ned(self.position)
    }

    /// What is due, each with its header.
    pub(crate) fn say(&mut self) -> Vec<MavMessage> {
        let mut said = Vec::new();
        let ids: Vec<u32> = self.streams.keys().copied().collect();
        for id in ids {
            let Some((interval, due)) = self.streams.get(&id).copied() else { continue };
            if self.t >= due
                && let Some(message) = self.message(id)
            {
                self.streams.insert(id, (interval, self.t + interval - 1e-6));
                said.push(message);
            }
        }
        said
    }

    pub(crate) fn header(&mut self) -> MavHeader {
        self.sequence = self.sequence.wrapping_add(1);
        MavHeader { system_id: SYSTEM.into(), component_id: 1, sequence: self.sequence }
    }

    fn message(&self, id: u32) -> Option<MavMessage> {
        let boot_ms = (self.t * 1e3) as u32;
        let height = -self.position.z;
        let place = self.geodetic();
        let (lat, lon) = ((place.latitude_deg() * 1e7).round() as i32, (place.longitude_deg() * 1e7).round() as i32);
        Some(match id {
            ardu::HEARTBEAT_DATA::ID => {
                let mut base_mode = ardu::MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED;
                base_mode.set(ardu::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED, self.armed);
                MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA {
                    custom_mode: self.mode.0 << 16 | self.mode.1 << 24,
                    mavtype: ardu::MavType::MAV_TYPE_QUADROTOR,
                    autopilot: ardu::MavAutopilot::MAV_AUTOPILOT_PX4,
                    base_mode,
                    ..Default::default()
                })
            }
            ardu::GLOBAL_POSITION_INT_DATA::ID => MavMessage::GLOBAL_POSITION_INT(ardu::GLOBAL_POSITION_INT_DATA {
                time_boot_ms: boot_ms,
                lat,
                lon,
                alt: ((AMSL_M + height) * 1e3) as i32,
                relative_alt: (height * 1e3) as i32,
                vx: (self.velocity.x * 1e2) as i16,
                vy: (self.velocity.y * 1e2) as i16,
                vz: (self.velocity.z * 1e2) as i16,
                ..Default::default()
            }),
            ardu::LOCAL_POSITION_NED_DATA::ID => {
                let local = self.position + self.local_from_fleet;
                MavMessage::LOCAL_POSITION_NED(ardu::LOCAL_POSITION_NED_DATA {
                    time_boot_ms: boot_ms,
                    x: local.x as f32,
                    y: local.y as f32,
                    z: local.z as f32,
                    vx: self.velocity.x as f32,
                    vy: self.velocity.y as f32,
                    vz: self.velocity.z as f32,
                })
            }
            ardu::ATTITUDE_QUATERNION_DATA::ID => {
                let (sin, cos) = (0.5 * self.yaw).sin_cos();
                MavMessage::ATTITUDE_QUATERNION(ardu::ATTITUDE_QUATERNION_DATA {
                    time_boot_ms: boot_ms,
                    q1: cos as f32,
                    q4: sin as f32,
                    ..Default::default()
                })
            }
            ardu::EXTENDED_SYS_STATE_DATA::ID => {
                let landed_state = match (self.landed(), self.mode) {
                    (true, _) => ardu::MavLandedState::MAV_LANDED_STATE_ON_GROUND,
                    (false, TAKEOFF) => ardu::MavLandedState::MAV_LANDED_STATE_TAKEOFF,
                    (false, LAND) => ardu::MavLandedState::MAV_LANDED_STATE_LANDING,
                    (false, _) => ardu::MavLandedState::MAV_LANDED_STATE_IN_AIR,
                };
                MavMessage::EXTENDED_SYS_STATE(ardu::EXTENDED_SYS_STATE_DATA { landed_state, ..Default::default() })
            }
            ardu::SYS_STATUS_DATA::ID => {
                let prearm = ardu::MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK;
                MavMessage::SYS_STATUS(ardu::SYS_STATUS_DATA {
                    onboard_control_sensors_present: prearm,
                    onboard_control_sensors_enabled: prearm,
                    onboard_control_sensors_health: if self.ready { prearm } else { ardu::MavSysStatusSensor::empty() },
                    battery_remaining: 90,
                    voltage_battery: 15_800,
                    ..Default::default()
                })
            }
            ardu::ESTIMATOR_STATUS_DATA::ID => {
                // ATTITUDE 1, velocities 2 and 4, horizontal position relative 8 and absolute 16, vertical absolute 32.
                let flags = ardu::EstimatorStatusFlags::from_bits_truncate(63);
                MavMessage::ESTIMATOR_STATUS(ardu::ESTIMATOR_STATUS_DATA { flags, ..Default::default() })
            }
            ardu::GPS_RAW_INT_DATA::ID => MavMessage::GPS_RAW_INT(ardu::GPS_RAW_INT_DATA {
                fix_type: ardu::GpsFixType::GPS_FIX_TYPE_3D_FIX,
                satellites_visible: 14,
                ..Default::default()
            }),
            ardu::HOME_POSITION_DATA::ID => {
                let home = self.origin.frame().geodetic_from_ned(Vector3::zeros());
                MavMessage::HOME_POSITION(ardu::HOME_POSITION_DATA {
                    latitude: (home.latitude_deg() * 1e7).round() as i32,
                    longitude: (home.longitude_deg() * 1e7).round() as i32,
                    altitude: (AMSL_M * 1e3) as i32,
                    ..Default::default()
                })
            }
            _ => return None,
        })
    }
}
