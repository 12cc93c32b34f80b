//! How it is and what it can, as messages.

use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::MavMessage;

use super::{Autopilot, Param};

/// ArduCopter 4.6.0, an official release, as AUTOPILOT_VERSION writes it.
const VERSION: u32 = 0x0406_00FF;

impl Autopilot {
    pub(super) fn heartbeat(&self) -> MavMessage {
        use mav::MavModeFlag as Flag;
        let mut base_mode = Flag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
            | Flag::MAV_MODE_FLAG_STABILIZE_ENABLED
            | Flag::MAV_MODE_FLAG_MANUAL_INPUT_ENABLED;
        if self.mode.is_guided() {
            base_mode |= Flag::MAV_MODE_FLAG_GUIDED_ENABLED;
        }
        if self.armed {
            base_mode |= Flag::MAV_MODE_FLAG_SAFETY_ARMED;
        }
        let system_status = if self.failsafe.any() {
            mav::MavState::MAV_STATE_CRITICAL
        } else if self.armed && !self.landed {
            mav::MavState::MAV_STATE_ACTIVE
        } else {
            mav::MavState::MAV_STATE_STANDBY
        };
        MavMessage::HEARTBEAT(mav::HEARTBEAT_DATA {
            custom_mode: self.mode.number(),
            mavtype: mav::MavType::MAV_TYPE_QUADROTOR,
            autopilot: mav::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
            base_mode,
            system_status,
            mavlink_version: 3,
        })
    }

    pub(super) fn sys_status(&self) -> MavMessage {
        use mav::MavSysStatusSensor as Sensor;
        let mut present = Sensor::MAV_SYS_STATUS_SENSOR_3D_GYRO
            | Sensor::MAV_SYS_STATUS_SENSOR_3D_ACCEL
            | Sensor::MAV_SYS_STATUS_SENSOR_3D_MAG
            | Sensor::MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
            | Sensor::MAV_SYS_STATUS_SENSOR_GPS
            | Sensor::MAV_SYS_STATUS_SENSOR_ANGULAR_RATE_CONTROL
            | Sensor::MAV_SYS_STATUS_SENSOR_ATTITUDE_STABILIZATION
            | Sensor::MAV_SYS_STATUS_SENSOR_YAW_POSITION
            | Sensor::MAV_SYS_STATUS_SENSOR_Z_ALTITUDE_CONTROL
            | Sensor::MAV_SYS_STATUS_SENSOR_XY_POSITION_CONTROL
            | Sensor::MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
            | Sensor::MAV_SYS_STATUS_AHRS
            | Sensor::MAV_SYS_STATUS_SENSOR_BATTERY
            | Sensor::MAV_SYS_STATUS_PREARM_CHECK;
        if self.params.get(Param::RangefinderType) != 0.0 {
            present |= Sensor::MAV_SYS_STATUS_SENSOR_LASER_POSITION;
        }
        if self.params.get(Param::FenceEnable) != 0.0 {
            present |= Sensor::MAV_SYS_STATUS_GEOFENCE;
        }
        let mut enabled = present;
        if !self.armed {
            enabled -= Sensor::MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS;
        }
        let mut health = present;
        if self.sensed.gnss.is_none() {
            health -= Sensor::MAV_SYS_STATUS_SENSOR_GPS;
        }
        if !self.sensed.estimate.attitude_ok {
            health -= Sensor::MAV_SYS_STATUS_AHRS;
        }
        if self.params.get(Param::RangefinderType) != 0.0 && self.sensed.range_m.is_none() {
            health -= Sensor::MAV_SYS_STATUS_SENSOR_LASER_POSITION;
        }
        if self.fence.is_breached() {
            health -= Sensor::MAV_SYS_STATUS_GEOFENCE;
        }
        if self.failsafe.battery_stage > 0 {
            health -= Sensor::MAV_SYS_STATUS_SENSOR_BATTERY;
        }
        if self.prearm_problem().is_some() {
            health -= Sensor::MAV_SYS_STATUS_PREARM_CHECK;
        }
        MavMessage::SYS_STATUS(mav::SYS_STATUS_DATA {
            onboard_control_sensors_present: present,
            onboard_control_sensors_enabled: enabled,
            onboard_control_sensors_health: health,
            load: 250,
            voltage_battery: (self.sensed.battery_v * 1e3) as u16,
            current_battery: (self.sensed.battery_a * 1e2) as i16,
            battery_remaining: (self.sensed.battery_fraction * 100.0).round() as i8,
            ..Default::default()
        })
    }

    pub(super) fn battery(&self) -> MavMessage {
        let mut voltages = [u16::MAX; 10];
        voltages[0] = (self.sensed.battery_v * 1e3) as u16;
        MavMessage::BATTERY_STATUS(mav::BATTERY_STATUS_DATA {
            current_consumed: (self.sensed.battery_ah.1 * 1e3) as i32,
            // Hectojoules.
            energy_consumed: (self.sensed.battery_wh * 36.0) as i32,
            temperature: i16::MAX,
            voltages,
            current_battery: (self.sensed.battery_a * 1e2) as i16,
            battery_function: mav::MavBatteryFunction::MAV_BATTERY_FUNCTION_ALL,
            mavtype: mav::MavBatteryType::MAV_BATTERY_TYPE_LIPO,
            battery_remaining: (self.sensed.battery_fraction * 100.0).round() as i8,
            charge_state: match self.failsafe.battery_stage {
                0 => mav::MavBatteryChargeState::MAV_BATTERY_CHARGE_STATE_OK,
                1 => mav::MavBatteryChargeState::MAV_BATTERY_CHARGE_STATE_LOW,
                _ => mav::MavBatteryChargeState::MAV_BATTERY_CHARGE_STATE_CRITICAL,
            },
            ..Default::default()
        })
    }

    pub(super) fn ekf_status(&self) -> MavMessage {
        use mav::EkfStatusFlags as Flag;
        let estimate = &self.sensed.estimate;
        let mut flags = Flag::empty();
        if estimate.attitude_ok {
            flags |= Flag::EKF_ATTITUDE | Flag::EKF_VELOCITY_VERT | Flag::EKF_POS_VERT_ABS;
        } else {
            flags |= Flag::EKF_UNINITIALIZED;
        }
        if estimate.position_ok {
            flags |= Flag::EKF_VELOCITY_HORIZ
                | Flag::EKF_POS_HORIZ_REL
                | Flag::EKF_POS_HORIZ_ABS
                | Flag::EKF_PRED_POS_HORIZ_REL
                | Flag::EKF_PRED_POS_HORIZ_ABS;
        } else {
            flags |= Flag::EKF_CONST_POS_MODE;
        }
        MavMessage::EKF_STATUS_REPORT(mav::EKF_STATUS_REPORT_DATA {
            velocity_variance: 0.05,
            pos_horiz_variance: if estimate.position_ok { 0.05 } else { 1.0 },
            pos_vert_variance: 0.02,
            compass_variance: 0.03,
            flags,
            ..Default::default()
        })
    }

    pub(super) fn extended_state(&self) -> MavMessage {
        let landed_state = if !self.armed && !self.landed {
            // Motors stopped in the air: it falls.
            mav::MavLandedState::MAV_LANDED_STATE_IN_AIR
        } else if self.landed {
            mav::MavLandedState::MAV_LANDED_STATE_ON_GROUND
        } else if self.is_landing() {
            mav::MavLandedState::MAV_LANDED_STATE_LANDING
        } else if self.is_taking_off() {
            mav::MavLandedState::MAV_LANDED_STATE_TAKEOFF
        } else {
            mav::MavLandedState::MAV_LANDED_STATE_IN_AIR
        };
        MavMessage::EXTENDED_SYS_STATE(mav::EXTENDED_SYS_STATE_DATA {
            vtol_state: mav::MavVtolState::MAV_VTOL_STATE_UNDEFINED,
            landed_state,
        })
    }

    pub(super) fn version(&self) -> MavMessage {
        use mav::MavProtocolCapability as Can;
        let mut uid2 = [0; 18];
        uid2[..10].copy_from_slice(b"HALCYONSIM");
        uid2[17] = self.system_id();
        MavMessage::AUTOPILOT_VERSION(mav::AUTOPILOT_VERSION_DATA {
            capabilities: Can::MAV_PROTOCOL_CAPABILITY_MISSION_INT
                | Can::MAV_PROTOCOL_CAPABILITY_COMMAND_INT
                | Can::MAV_PROTOCOL_CAPABILITY_PARAM_FLOAT
                | Can::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
                | Can::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
                | Can::MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
                | Can::MAV_PROTOCOL_CAPABILITY_FLIGHT_TERMINATION
                | Can::MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
                | Can::MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
                | Can::MAV_PROTOCOL_CAPABILITY_MAVLINK2,
            flight_sw_version: VERSION,
            flight_custom_version: *b"halcyon0",
            uid: u64::from(self.system_id()),
            uid2,
            ..Default::default()
        })
    }
}
