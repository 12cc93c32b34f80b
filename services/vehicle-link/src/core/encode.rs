//! From setpoints and commands to MAVLink messages for exactly one vehicle.

use halcyon_model::LocalFrame;
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavMessage, PositionTargetTypemask as Mask};
use nalgebra::Vector3;

use super::guidance::Setpoint;

/// Who is addressed; never system 0, which is everybody.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Address {
    system: u8,
    component: u8,
}

impl Address {
    /// Checks and wraps; `None` for system 0.
    #[must_use]
    pub fn new(system: u8, component: u8) -> Option<Self> {
        (system != 0).then_some(Self { system, component })
    }

    /// MAVLink system id, 1 to 255.
    #[must_use]
    pub fn system(self) -> u8 {
        self.system
    }

    /// MAVLink component id.
    #[must_use]
    pub fn component(self) -> u8 {
        self.component
    }
}

/// Height of the autopilot's home above mean water turns our heights into the autopilot's and back.
#[derive(Debug, Clone, Copy)]
pub struct Datum {
    /// The fleet's local frame.
    pub frame: LocalFrame,
    /// Height of home above mean water, metres.
    pub home_height_m: f64,
}

/// A setpoint as SET_POSITION_TARGET_GLOBAL_INT: position, velocity and yaw; altitude relative to home, so that neither the
/// geoid nor the estimator's own origin enters. `None` if a number is not finite: such a setpoint is never sent.
#[must_use]
#[allow(deprecated, reason = "the message's own definition still names the _INT frames, and PX4 takes no others")]
pub fn setpoint(setpoint: &Setpoint, datum: &Datum, to: Address, boot_ms: u32) -> Option<MavMessage> {
    let Setpoint { position_ned_m, velocity_ned_mps, heading_rad } = *setpoint;
    let finite = |v: Vector3<f64>| v.iter().all(|x| x.is_finite());
    if !finite(position_ned_m) || !finite(velocity_ned_mps) || heading_rad.is_some_and(|heading| !heading.is_finite()) {
        return None;
    }
    let position = datum.frame.geodetic_from_ned(position_ned_m);
    let mut mask = Mask::POSITION_TARGET_TYPEMASK_AX_IGNORE
        | Mask::POSITION_TARGET_TYPEMASK_AY_IGNORE
        | Mask::POSITION_TARGET_TYPEMASK_AZ_IGNORE
        | Mask::POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE;
    if heading_rad.is_none() {
        mask |= Mask::POSITION_TARGET_TYPEMASK_YAW_IGNORE;
    }
    Some(MavMessage::SET_POSITION_TARGET_GLOBAL_INT(ardu::SET_POSITION_TARGET_GLOBAL_INT_DATA {
        time_boot_ms: boot_ms,
        lat_int: (position.latitude_deg() * 1e7).round() as i32,
        lon_int: (position.longitude_deg() * 1e7).round() as i32,
        alt: (-position_ned_m.z - datum.home_height_m) as f32,
        vx: velocity_ned_mps.x as f32,
        vy: velocity_ned_mps.y as f32,
        vz: velocity_ned_mps.z as f32,
        yaw: heading_rad.map_or(0.0, super::track::wrap_rad) as f32,
        type_mask: mask,
        target_system: to.system,
        target_component: to.component,
        coordinate_frame: ardu::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT,
        ..Default::default()
    }))
}

/// Our own heartbeat: an onboard computer that is active.
#[must_use]
pub fn heartbeat() -> MavMessage {
    MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA {
        custom_mode: 0,
        mavtype: ardu::MavType::MAV_TYPE_ONBOARD_CONTROLLER,
        autopilot: ardu::MavAutopilot::MAV_AUTOPILOT_INVALID,
        base_mode: ardu::MavModeFlag::empty(),
        system_status: ardu::MavState::MAV_STATE_ACTIVE,
        mavlink_version: 3,
    })
}
