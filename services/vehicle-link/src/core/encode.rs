//! From setpoints and commands to MAVLink messages for exactly one vehicle.

use halcyon_model::LocalFrame;
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavMessage, PositionTargetTypemask as Mask};
use nalgebra::Vector3;

use super::guidance::Setpoint;

const NO_ACCELERATION: Mask = Mask::POSITION_TARGET_TYPEMASK_AX_IGNORE
    .union(Mask::POSITION_TARGET_TYPEMASK_AY_IGNORE)
    .union(Mask::POSITION_TARGET_TYPEMASK_AZ_IGNORE);

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
    /// Height above mean water of the home that the autopilot counts from now, metres.
    pub home_height_m: f64,
}

/// A setpoint for one vehicle. With an acceleration, or for an autopilot that takes local places better (`prefers_local`), it goes as
/// SET_POSITION_TARGET_LOCAL_NED where the autopilot's local frame is known (`local_shift_ned_m`, of [`super::local`]): the only form in
/// which ArduCopter takes place, velocity and acceleration together. Else as SET_POSITION_TARGET_GLOBAL_INT without the acceleration.
/// `None` if a number is not finite: such a setpoint is never sent.
#[must_use]
pub fn setpoint(
    setpoint: &Setpoint,
    datum: &Datum,
    local_shift_ned_m: Option<Vector3<f64>>,
    prefers_local: bool,
    to: Address,
    boot_ms: u32,
) -> Option<MavMessage> {
    let Setpoint { position_ned_m, velocity_ned_mps, acceleration_ned_mps2, heading_rad } = *setpoint;
    let finite = |v: Vector3<f64>| v.iter().all(|x| x.is_finite());
    if !finite(position_ned_m) || !finite(velocity_ned_mps) || heading_rad.is_some_and(|heading| !heading.is_finite()) {
        return None;
    }
    if acceleration_ned_mps2.is_some_and(|acceleration| !finite(acceleration)) {
        return None;
    }
    match local_shift_ned_m {
        Some(shift_ned_m) if prefers_local || acceleration_ned_mps2.is_some() => {
            let place_m = position_ned_m + shift_ned_m;
            finite(place_m).then(|| local(place_m, velocity_ned_mps, acceleration_ned_mps2, heading_rad, to, boot_ms))
        }
        _ => Some(global(setpoint, datum, to, boot_ms)),
    }
}

fn local(
    place_m: Vector3<f64>,
    velocity_mps: Vector3<f64>,
    acceleration_mps2: Option<Vector3<f64>>,
    heading_rad: Option<f64>,
    to: Address,
    boot_ms: u32,
) -> MavMessage {
    let mut mask = Mask::POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE;
    if heading_rad.is_none() {
        mask |= Mask::POSITION_TARGET_TYPEMASK_YAW_IGNORE;
    }
    if acceleration_mps2.is_none() {
        mask |= NO_ACCELERATION;
    }
    let acceleration_mps2 = acceleration_mps2.unwrap_or_default();
    MavMessage::SET_POSITION_TARGET_LOCAL_NED(ardu::SET_POSITION_TARGET_LOCAL_NED_DATA {
        time_boot_ms: boot_ms,
        x: place_m.x as f32,
        y: place_m.y as f32,
        z: place_m.z as f32,
        vx: velocity_mps.x as f32,
        vy: velocity_mps.y as f32,
        vz: velocity_mps.z as f32,
        afx: acceleration_mps2.x as f32,
        afy: acceleration_mps2.y as f32,
        afz: acceleration_mps2.z as f32,
        yaw: heading_rad.map_or(0.0, super::track::wrap_rad) as f32,
        yaw_rate: 0.0,
        type_mask: mask,
        target_system: to.system,
        target_component: to.component,
        coordinate_frame: ardu::MavFrame::MAV_FRAME_LOCAL_NED,
    })
}

/// Altitude relative to home, so that neither the geoid nor the estimator's own origin enters.
#[allow(deprecated, reason = "the message's own definition still names the _INT frames, and PX4 takes no others")]
fn global(setpoint: &Setpoint, datum: &Datum, to: Address, boot_ms: u32) -> MavMessage {
    let Setpoint { position_ned_m, velocity_ned_mps, heading_rad, .. } = *setpoint;
    let position = datum.frame.geodetic_from_ned(position_ned_m);
    let mut mask = NO_ACCELERATION | Mask::POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE;
    if heading_rad.is_none() {
        mask |= Mask::POSITION_TARGET_TYPEMASK_YAW_IGNORE;
    }
    MavMessage::SET_POSITION_TARGET_GLOBAL_INT(ardu::SET_POSITION_TARGET_GLOBAL_INT_DATA {
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
    })
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

#[cfg(test)]
mod tests {
    use halcyon_model::{FleetOrigin, Geodetic};

    use super::*;

    fn sent(asked: &Setpoint, shift_ned_m: Option<Vector3<f64>>) -> Option<MavMessage> {
        let datum = Datum { frame: FleetOrigin(Geodetic::from_deg(53.1, -2.9, 40.0)).frame(), home_height_m: 1.0 };
        setpoint(asked, &datum, shift_ned_m, false, Address::new(7, 1)?, 1234)
    }

    fn asked() -> Setpoint {
        Setpoint {
            position_ned_m: Vector3::new(10.0, 20.0, -6.0),
            velocity_ned_mps: Vector3::new(1.0, -2.0, 0.5),
            acceleration_ned_mps2: Some(Vector3::new(0.25, -0.5, 0.0)),
            heading_rad: Some(1.0),
        }
    }

    /// MAVLink's type mask: a set bit ignores; 1024 is yaw, 2048 yaw rate.
    #[test]
    fn with_an_acceleration_all_three_go_in_the_autopilots_local_frame() {
        let Some(MavMessage::SET_POSITION_TARGET_LOCAL_NED(data)) = sent(&asked(), Some(Vector3::new(4.0, -3.0, 1.5))) else {
            panic!("not local")
        };
        assert_eq!((data.x, data.y, data.z), (14.0, 17.0, -4.5));
        assert_eq!((data.vx, data.vy, data.vz, data.afx, data.afy, data.afz), (1.0, -2.0, 0.5, 0.25, -0.5, 0.0));
        assert_eq!((data.type_mask.bits(), data.yaw, data.target_system), (2048, 1.0, 7));
        let unturned = Setpoint { heading_rad: None, ..asked() };
        let Some(MavMessage::SET_POSITION_TARGET_LOCAL_NED(data)) = sent(&unturned, Some(Vector3::zeros())) else {
            panic!("not local")
        };
        assert_eq!(data.type_mask.bits(), 2048 + 1024);
    }

    #[test]
    fn without_one_or_without_the_frame_it_goes_by_latitude_and_longitude() {
        for (asked, shift) in [(asked(), None), (Setpoint { acceleration_ned_mps2: None, ..asked() }, Some(Vector3::zeros()))] {
            let Some(MavMessage::SET_POSITION_TARGET_GLOBAL_INT(data)) = sent(&asked, shift) else { panic!("not global") };
            assert_eq!((data.type_mask.bits(), data.alt), (2048 + 64 + 128 + 256, 5.0));
        }
    }

    #[test]
    fn where_local_places_are_taken_better_all_go_there_without_an_acceleration_too() {
        let datum = Datum { frame: FleetOrigin(Geodetic::from_deg(53.1, -2.9, 40.0)).frame(), home_height_m: 1.0 };
        let asked = Setpoint { acceleration_ned_mps2: None, ..asked() };
        let to = Address::new(7, 1).unwrap();
        let Some(MavMessage::SET_POSITION_TARGET_LOCAL_NED(data)) =
            setpoint(&asked, &datum, Some(Vector3::new(4.0, -3.0, 1.5)), true, to, 0)
        else {
            panic!("not local")
        };
        assert_eq!((data.type_mask.bits(), data.x, data.y, data.z), (2048 + 64 + 128 + 256, 14.0, 17.0, -4.5));
        assert!(matches!(setpoint(&asked, &datum, None, true, to, 0), Some(MavMessage::SET_POSITION_TARGET_GLOBAL_INT(_))));
    }

    #[test]
    fn what_is_not_finite_is_never_sent() {
        for bad in [f64::NAN, f64::INFINITY] {
            for axis in 0..3 {
                for shift in [None, Some(Vector3::zeros())] {
                    let mut place = asked();
                    place.position_ned_m[axis] = bad;
                    let mut velocity = asked();
                    velocity.velocity_ned_mps[axis] = bad;
                    assert!(sent(&place, shift).is_none() && sent(&velocity, shift).is_none());
                }
                let mut acceleration = asked();
                acceleration.acceleration_ned_mps2.as_mut().unwrap()[axis] = bad;
                assert!(sent(&acceleration, Some(Vector3::zeros())).is_none());
            }
            assert!(sent(&Setpoint { heading_rad: Some(bad), ..asked() }, None).is_none());
        }
    }
}
