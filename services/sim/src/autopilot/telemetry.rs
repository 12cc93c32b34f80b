//! What the autopilot says by itself or when asked.

use std::f64::consts::TAU;

use mavlink::MessageData;
use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::MavMessage;
use nalgebra::Vector3;

use super::control::heading_rad;
use super::guided::Guided;
use super::{Autopilot, Mode, Outbound};

impl Autopilot {
    /// Sends what is due on each link.
    pub(super) fn stream(&mut self) {
        self.pump_params();
        let now = self.now;
        for place in 0..self.links.len() {
            // Taken out while messages are built, so that building may look at everything.
            let mut due = [0_u32; 64];
            let mut count = 0;
            let link = &mut self.links[place];
            let id = link.id;
            link.due(now, |message_id| {
                if let Some(free) = due.get_mut(count) {
                    *free = message_id;
                    count += 1;
                }
            });
            for message_id in &due[..count] {
                if let Some(message) = self.telemetry(*message_id) {
                    self.say(Some(id), Outbound::Message(message));
                }
            }
        }
    }

    /// Sends the next heartbeats at once, so that a change of mode or arming is seen without waiting.
    pub(super) fn hurry_heartbeat(&mut self) {
        let now = self.now;
        for link in &mut self.links {
            link.hurry(mav::HEARTBEAT_DATA::ID, now);
        }
    }

    /// One message by its id; `None` for one that it does not have, or not yet.
    pub(super) fn telemetry(&self, message_id: u32) -> Option<MavMessage> {
        Some(match message_id {
            mav::HEARTBEAT_DATA::ID => self.heartbeat(),
            mav::SYS_STATUS_DATA::ID => self.sys_status(),
            mav::SYSTEM_TIME_DATA::ID => {
                MavMessage::SYSTEM_TIME(mav::SYSTEM_TIME_DATA { time_unix_usec: self.unix_us(), time_boot_ms: self.boot_ms() })
            }
            mav::GPS_RAW_INT_DATA::ID => self.gps_raw(),
            mav::RAW_IMU_DATA::ID => self.raw_imu(),
            mav::SCALED_IMU_DATA::ID => self.scaled_imu(),
            mav::SCALED_IMU2_DATA::ID => self.scaled_imu2(),
            mav::SCALED_PRESSURE_DATA::ID => self.pressure(),
            mav::ATTITUDE_DATA::ID => self.attitude(),
            mav::ATTITUDE_QUATERNION_DATA::ID => self.attitude_quaternion(),
            mav::LOCAL_POSITION_NED_DATA::ID => self.local_position()?,
            mav::GLOBAL_POSITION_INT_DATA::ID => self.global_position(),
            mav::RC_CHANNELS_DATA::ID => self.rc_channels(),
            mav::SERVO_OUTPUT_RAW_DATA::ID => self.servo_outputs(),
            mav::MISSION_CURRENT_DATA::ID => self.mission_current(),
            mav::VFR_HUD_DATA::ID => self.hud(),
            mav::POSITION_TARGET_LOCAL_NED_DATA::ID => self.local_setpoint()?,
            mav::POSITION_TARGET_GLOBAL_INT_DATA::ID => self.global_setpoint()?,
            mav::BATTERY_STATUS_DATA::ID => self.battery(),
            mav::DISTANCE_SENSOR_DATA::ID => self.distance_sensor()?,
            mav::RANGEFINDER_DATA::ID => self.rangefinder()?,
            mav::FENCE_STATUS_DATA::ID => self.fence_status()?,
            mav::RELAY_STATUS_DATA::ID => self.relay_status()?,
            mav::AUTOPILOT_VERSION_DATA::ID => self.version(),
            mav::SIMSTATE_DATA::ID => self.simulator_state(),
            mav::EKF_STATUS_REPORT_DATA::ID => self.ekf_status(),
            mav::HOME_POSITION_DATA::ID => self.home_message()?,
            mav::EXTENDED_SYS_STATE_DATA::ID => self.extended_state(),
            mav::GPS_GLOBAL_ORIGIN_DATA::ID => self.origin_message()?,
            _ => return None,
        })
    }

    /// Unix time in microseconds, or 0 until GNSS has told it.
    fn unix_us(&self) -> u64 {
        if self.clock_is_set { (self.now.as_nanos() / 1000).max(0) as u64 } else { 0 }
    }

    fn attitude(&self) -> MavMessage {
        let (roll, pitch, yaw) = self.sensed.estimate.ned_from_body.euler_angles();
        let rate = self.sensed.estimate.rate_body_radps;
        MavMessage::ATTITUDE(mav::ATTITUDE_DATA {
            time_boot_ms: self.boot_ms(),
            roll: roll as f32,
            pitch: pitch as f32,
            yaw: yaw as f32,
            rollspeed: rate.x as f32,
            pitchspeed: rate.y as f32,
            yawspeed: rate.z as f32,
        })
    }

    fn attitude_quaternion(&self) -> MavMessage {
        let q = self.sensed.estimate.ned_from_body;
        let rate = self.sensed.estimate.rate_body_radps;
        MavMessage::ATTITUDE_QUATERNION(mav::ATTITUDE_QUATERNION_DATA {
            time_boot_ms: self.boot_ms(),
            q1: q.w as f32,
            q2: q.i as f32,
            q3: q.j as f32,
            q4: q.k as f32,
            rollspeed: rate.x as f32,
            pitchspeed: rate.y as f32,
            yawspeed: rate.z as f32,
            repr_offset_q: [0.0; 4],
        })
    }

    /// Relative to the filter's origin, which is where it first had a position and not the fleet's.
    fn local_position(&self) -> Option<MavMessage> {
        let estimate = &self.sensed.estimate;
        let place_m = estimate.position_ned_m - self.origin_ned_m?;
        let velocity_mps = estimate.velocity_ned_mps;
        Some(MavMessage::LOCAL_POSITION_NED(mav::LOCAL_POSITION_NED_DATA {
            time_boot_ms: self.boot_ms(),
            x: place_m.x as f32,
            y: place_m.y as f32,
            z: place_m.z as f32,
            vx: velocity_mps.x as f32,
            vy: velocity_mps.y as f32,
            vz: velocity_mps.z as f32,
        }))
    }

    fn global_position(&self) -> MavMessage {
        let estimate = &self.sensed.estimate;
        let known = self.origin_ned_m.is_some();
        let (lat, lon, altitude_m) = if known { self.global_e7(estimate.position_ned_m) } else { (0, 0, 0.0) };
        let velocity = estimate.velocity_ned_mps * 100.0;
        let heading_deg = heading_rad(&estimate.ned_from_body).rem_euclid(TAU).to_degrees();
        MavMessage::GLOBAL_POSITION_INT(mav::GLOBAL_POSITION_INT_DATA {
            time_boot_ms: self.boot_ms(),
            lat,
            lon,
            alt: (altitude_m * 1e3).round() as i32,
            relative_alt: (self.height_m() * 1e3).round() as i32,
            vx: velocity.x.round() as i16,
            vy: velocity.y.round() as i16,
            vz: velocity.z.round() as i16,
            hdg: (heading_deg * 100.0) as u16,
        })
    }

    fn rc_channels(&self) -> MavMessage {
        let us = self.sticks.map_or([0; 8], |sticks| sticks.channels_us);
        MavMessage::RC_CHANNELS(mav::RC_CHANNELS_DATA {
            time_boot_ms: self.boot_ms(),
            chan1_raw: us[0],
            chan2_raw: us[1],
            chan3_raw: us[2],
            chan4_raw: us[3],
            chan5_raw: us[4],
            chan6_raw: us[5],
            chan7_raw: us[6],
            chan8_raw: us[7],
            chancount: if self.sticks.is_some() { 8 } else { 0 },
            rssi: u8::MAX,
            ..Default::default()
        })
    }

    fn servo_outputs(&self) -> MavMessage {
        let ratio = if self.armed { self.controller.thrust_ratio() / self.airframe.thrust_to_weight } else { 0.0 };
        let motor_us = 1000 + (ratio.clamp(0.0, 1.0) * 1000.0) as u16;
        let us: [u16; 16] = std::array::from_fn(|index| self.servo_us(index + 1));
        MavMessage::SERVO_OUTPUT_RAW(mav::SERVO_OUTPUT_RAW_DATA {
            time_usec: self.boot_ms().wrapping_mul(1000),
            servo1_raw: motor_us,
            servo2_raw: motor_us,
            servo3_raw: motor_us,
            servo4_raw: motor_us,
            servo5_raw: us[4],
            servo6_raw: us[5],
            servo7_raw: us[6],
            servo8_raw: us[7],
            servo9_raw: us[8],
            servo10_raw: us[9],
            servo11_raw: us[10],
            servo12_raw: us[11],
            servo13_raw: us[12],
            servo14_raw: us[13],
            servo15_raw: us[14],
            servo16_raw: us[15],
            ..Default::default()
        })
    }

    fn mission_current(&self) -> MavMessage {
        let mission_state = if self.mission.items.is_empty() {
            mav::MissionState::MISSION_STATE_NO_MISSION
        } else if self.mission.complete {
            mav::MissionState::MISSION_STATE_COMPLETE
        } else if self.flight.auto_started {
            mav::MissionState::MISSION_STATE_ACTIVE
        } else {
            mav::MissionState::MISSION_STATE_NOT_STARTED
        };
        MavMessage::MISSION_CURRENT(mav::MISSION_CURRENT_DATA {
            seq: self.mission.current,
            total: self.mission.items.len() as u16,
            mission_state,
            ..Default::default()
        })
    }

    fn hud(&self) -> MavMessage {
        let estimate = &self.sensed.estimate;
        let speed_mps = estimate.velocity_ned_mps.xy().norm() as f32;
        let heading_deg = heading_rad(&estimate.ned_from_body).rem_euclid(TAU).to_degrees();
        let ratio = if self.armed { self.controller.thrust_ratio() / self.airframe.thrust_to_weight } else { 0.0 };
        MavMessage::VFR_HUD(mav::VFR_HUD_DATA {
            airspeed: speed_mps,
            groundspeed: speed_mps,
            alt: (self.frame.origin().altitude_m - estimate.position_ned_m.z) as f32,
            climb: -estimate.velocity_ned_mps.z as f32,
            heading: heading_deg as i16,
            throttle: (ratio * 100.0) as u16,
        })
    }

    /// GUIDED's target as it was given, in the filter's own frame; no other mode has one.
    fn local_setpoint(&self) -> Option<MavMessage> {
        let none = Vector3::zeros();
        let here_m = self.controller.desired_position_m();
        // Which of position, velocity and acceleration are not said; heading never is.
        const YAW: u16 = 0o6000;
        let (ignored, place_m, velocity_mps, acceleration_mps2) = match self.guided {
            _ if self.mode != Mode::Guided => return None,
            Guided::Hold => (0o7, none, none, none),
            Guided::TakeOff { down_m } => (0o770, Vector3::new(here_m.x, here_m.y, down_m), none, none),
            Guided::Position { ned_m } => (0o770, ned_m, none, none),
            Guided::Velocity { velocity_mps, acceleration_mps2, .. } => (0o7, none, velocity_mps, acceleration_mps2),
            Guided::Moving { ned_m, velocity_mps, acceleration_mps2, .. } => (0, ned_m, velocity_mps, acceleration_mps2),
        };
        let place_m = if ignored & 0o7 == 0 { place_m - self.origin_ned_m? } else { none };
        Some(MavMessage::POSITION_TARGET_LOCAL_NED(mav::POSITION_TARGET_LOCAL_NED_DATA {
            time_boot_ms: self.boot_ms(),
            x: place_m.x as f32,
            y: place_m.y as f32,
            z: place_m.z as f32,
            vx: velocity_mps.x as f32,
            vy: velocity_mps.y as f32,
            vz: velocity_mps.z as f32,
            afx: acceleration_mps2.x as f32,
            afy: acceleration_mps2.y as f32,
            afz: acceleration_mps2.z as f32,
            type_mask: mav::PositionTargetTypemask::from_bits_retain(ignored | YAW),
            coordinate_frame: mav::MavFrame::MAV_FRAME_LOCAL_NED,
            ..Default::default()
        }))
    }

    /// Where GUIDED is going, on the map, while it goes to a place at rest.
    fn global_setpoint(&self) -> Option<MavMessage> {
        let ned_m = match self.guided {
            Guided::Position { ned_m } if self.mode == Mode::Guided => ned_m,
            _ => return None,
        };
        let (lat_int, lon_int, altitude_m) = self.global_e7(ned_m);
        Some(MavMessage::POSITION_TARGET_GLOBAL_INT(mav::POSITION_TARGET_GLOBAL_INT_DATA {
            time_boot_ms: self.boot_ms(),
            lat_int,
            lon_int,
            alt: altitude_m as f32,
            type_mask: mav::PositionTargetTypemask::from_bits_retain(0xFFF8),
            coordinate_frame: mav::MavFrame::MAV_FRAME_GLOBAL,
            ..Default::default()
        }))
    }

    fn simulator_state(&self) -> MavMessage {
        let truth = &self.sensed.simulator;
        let (roll, pitch, yaw) = truth.ned_from_body.euler_angles();
        let (lat, lng, _) = self.global_e7(truth.position_ned_m);
        let (force, rate) = (truth.specific_force_body_mps2, truth.rate_body_radps);
        MavMessage::SIMSTATE(mav::SIMSTATE_DATA {
            roll: roll as f32,
            pitch: pitch as f32,
            yaw: yaw as f32,
            xacc: force.x as f32,
            yacc: force.y as f32,
            zacc: force.z as f32,
            xgyro: rate.x as f32,
            ygyro: rate.y as f32,
            zgyro: rate.z as f32,
            lat,
            lng,
        })
    }

    pub(super) fn home_message(&self) -> Option<MavMessage> {
        let home_m = self.home_ned_m?;
        let (latitude, longitude, altitude_m) = self.global_e7(home_m);
        let local_m = home_m - self.origin_ned_m?;
        Some(MavMessage::HOME_POSITION(mav::HOME_POSITION_DATA {
            latitude,
            longitude,
            altitude: (altitude_m * 1e3).round() as i32,
            x: local_m.x as f32,
            y: local_m.y as f32,
            z: local_m.z as f32,
            q: [1.0, 0.0, 0.0, 0.0],
            time_usec: self.boot_us(),
            ..Default::default()
        }))
    }

    pub(super) fn origin_message(&self) -> Option<MavMessage> {
        let (latitude, longitude, altitude_m) = self.global_e7(self.origin_ned_m?);
        Some(MavMessage::GPS_GLOBAL_ORIGIN(mav::GPS_GLOBAL_ORIGIN_DATA {
            latitude,
            longitude,
            altitude: (altitude_m * 1e3).round() as i32,
            time_usec: self.boot_us(),
        }))
    }
}
