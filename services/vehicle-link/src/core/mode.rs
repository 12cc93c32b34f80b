//! What flies the vehicle, and its flight modes: ArduCopter and PX4 number them differently.
//!
//! PX4's `custom_mode` holds a main mode in bits 16 to 23 and a sub mode in bits 24 to 31. Modes are matched by what they do: OFFBOARD is
//! GUIDED, since both fly a companion's setpoints; HOLD is LOITER. A mode without a counterpart stays as its number, and comes back
//! as the same number.

use halcyon_model::{Firmware, FlightMode};
use mavlink::dialects::ardupilotmega::{HEARTBEAT_DATA, MavAutopilot, MavType};

/// Which family of firmware numbers the modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Family {
    /// ArduCopter, and whatever says that it is something else.
    #[default]
    ArduPilot,
    /// PX4.
    Px4,
}

/// What PX4 calls itself in [`Firmware`].
const PX4_NAME: &str = "PX4";
/// PX4's AUTO.TAKEOFF, which no mode of ours is like.
pub const PX4_TAKE_OFF: FlightMode = FlightMode::Other(2 << 24 | 4 << 16);

/// PX4's modes by main and sub mode (`px4_custom_mode.h`), the preferred one of each of ours first.
const PX4: [(FlightMode, u32, u32); 10] = [
    (FlightMode::Guided, 6, 0),
    (FlightMode::Loiter, 4, 3),
    (FlightMode::Rtl, 4, 5),
    (FlightMode::Land, 4, 6),
    (FlightMode::Auto, 4, 4),
    (FlightMode::PosHold, 3, 0),
    (FlightMode::AltHold, 2, 0),
    (FlightMode::Stabilize, 7, 0),
    // Precision landing lands.
    (FlightMode::Land, 4, 9),
    // PX4 has no BRAKE: its HOLD stops as hard as it may.
    (FlightMode::Brake, 4, 3),
];

impl Family {
    /// By a heartbeat.
    #[must_use]
    pub fn of(heartbeat: &HEARTBEAT_DATA) -> Self {
        if heartbeat.autopilot == MavAutopilot::MAV_AUTOPILOT_PX4 { Self::Px4 } else { Self::ArduPilot }
    }

    /// By what is known of the firmware; nothing known is ArduPilot.
    #[must_use]
    pub fn named(firmware: Option<&Firmware>) -> Self {
        if firmware.is_some_and(|firmware| firmware.autopilot == PX4_NAME) { Self::Px4 } else { Self::ArduPilot }
    }

    /// The mode in which it is armed and told to take off: PX4's OFFBOARD would have to be fed already on the ground.
    #[must_use]
    pub fn take_off_from(self) -> FlightMode {
        match self {
            Self::ArduPilot => FlightMode::Guided,
            Self::Px4 => FlightMode::Loiter,
        }
    }

    /// The mode in which it climbs after NAV_TAKEOFF.
    #[must_use]
    pub fn climbs_in(self) -> FlightMode {
        match self {
            Self::ArduPilot => FlightMode::Guided,
            Self::Px4 => PX4_TAKE_OFF,
        }
    }

    /// From `custom_mode`.
    #[must_use]
    pub fn mode(self, custom_mode: u32) -> FlightMode {
        match self {
            Self::ArduPilot => FlightMode::from_copter(custom_mode),
            Self::Px4 => {
                let known = |&&(_, main, sub): &&(FlightMode, u32, u32)| custom_mode == px4_number(main, sub);
                PX4.iter().find(known).map_or(FlightMode::Other(custom_mode), |entry| entry.0)
            }
        }
    }

    /// Parameters 2 and 3 of MAV_CMD_DO_SET_MODE; `None` for a mode that this firmware doesn't have.
    #[must_use]
    pub fn set_mode_parameters(self, mode: FlightMode) -> Option<[u32; 2]> {
        match (self, mode) {
            (Self::ArduPilot, mode) => Some([mode.copter_number(), 0]),
            (Self::Px4, FlightMode::Other(number)) => Some([number >> 16 & 0xFF, number >> 24]),
            (Self::Px4, mode) => PX4.iter().find(|entry| entry.0 == mode).map(|entry| [entry.1, entry.2]),
        }
    }
}

/// A mode from a heartbeat.
#[must_use]
pub fn from_heartbeat(heartbeat: &HEARTBEAT_DATA) -> FlightMode {
    Family::of(heartbeat).mode(heartbeat.custom_mode)
}

fn px4_number(main: u32, sub: u32) -> u32 {
    main << 16 | sub << 24
}

/// What a heartbeat says of who sent it; the version comes by AUTOPILOT_VERSION.
#[must_use]
pub fn firmware(heartbeat: &HEARTBEAT_DATA) -> Firmware {
    let autopilot = match heartbeat.autopilot {
        MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA => "ArduPilot".to_owned(),
        MavAutopilot::MAV_AUTOPILOT_PX4 => PX4_NAME.to_owned(),
        other => plain(&format!("{other:?}"), "MAV_AUTOPILOT_"),
    };
    Firmware { autopilot, vehicle: plain(&format!("{:?}", heartbeat.mavtype), "MAV_TYPE_"), version: String::new() }
}

/// `MAV_TYPE_GROUND_ROVER` → `ground rover`.
fn plain(name: &str, prefix: &str) -> String {
    name.trim_start_matches(prefix).replace('_', " ").to_lowercase()
}

/// Whether it flies as a multicopter or a helicopter does: hovers, and obeys our setpoints.
#[must_use]
pub fn is_copter(kind: MavType) -> bool {
    matches!(
        kind,
        MavType::MAV_TYPE_QUADROTOR
            | MavType::MAV_TYPE_COAXIAL
            | MavType::MAV_TYPE_HELICOPTER
            | MavType::MAV_TYPE_HEXAROTOR
            | MavType::MAV_TYPE_OCTOROTOR
            | MavType::MAV_TYPE_TRICOPTER
            | MavType::MAV_TYPE_DODECAROTOR
            | MavType::MAV_TYPE_DECAROTOR
    )
}

/// `4.6.0` from AUTOPILOT_VERSION's `flight_sw_version`: four bytes, major first, the last the kind of release. ArduPilot and PX4
/// agree about it.
#[must_use]
pub fn version(flight_sw_version: u32) -> String {
    let [major, minor, patch, kind] = flight_sw_version.to_be_bytes();
    let suffix = match kind {
        0..64 => "-dev",
        64..128 => "-alpha",
        128..192 => "-beta",
        192..255 => "-rc",
        255 => "",
    };
    if flight_sw_version == 0 { String::new() } else { format!("{major}.{minor}.{patch}{suffix}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn px4s_modes_are_those_of_its_own_header() {
        // From PX4's px4_custom_mode.h: main modes MANUAL 1, ALTCTL 2, POSCTL 3, AUTO 4, ACRO 5, OFFBOARD 6, STABILIZED 7; of AUTO
        // READY 1, TAKEOFF 2, LOITER 3, MISSION 4, RTL 5, LAND 6, FOLLOW_TARGET 8, PRECLAND 9.
        let check = |number: u32, mode: FlightMode| assert_eq!(Family::Px4.mode(number), mode, "{number:#010x}");
        check(0x0006_0000, FlightMode::Guided);
        check(0x0304_0000, FlightMode::Loiter);
        check(0x0404_0000, FlightMode::Auto);
        check(0x0504_0000, FlightMode::Rtl);
        check(0x0604_0000, FlightMode::Land);
        check(0x0904_0000, FlightMode::Land);
        check(0x0003_0000, FlightMode::PosHold);
        check(0x0002_0000, FlightMode::AltHold);
        check(0x0007_0000, FlightMode::Stabilize);
        check(0x0204_0000, PX4_TAKE_OFF);
        check(4, FlightMode::Other(4));
        assert_eq!(Family::ArduPilot.mode(4), FlightMode::Guided);
    }

    #[test]
    fn what_is_set_is_what_is_heard() {
        for number in [0x0006_0000, 0x0304_0000, 0x0504_0000, 0x0604_0000, 0x0404_0000, 0x0003_0000, 0x0204_0000, 0x0804_0000] {
            let [main, sub] = Family::Px4.set_mode_parameters(Family::Px4.mode(number)).unwrap();
            assert_eq!(px4_number(main, sub), number, "{number:#010x}");
        }
        assert_eq!(Family::Px4.set_mode_parameters(FlightMode::Brake), Some([4, 3]));
        assert_eq!(Family::Px4.set_mode_parameters(FlightMode::SmartRtl), None);
        for number in 0..30 {
            assert_eq!(Family::ArduPilot.set_mode_parameters(Family::ArduPilot.mode(number)), Some([number, 0]));
        }
    }

    #[test]
    fn names_and_versions_as_people_write_them() {
        let heartbeat = HEARTBEAT_DATA {
            autopilot: MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
            mavtype: MavType::MAV_TYPE_GROUND_ROVER,
            ..Default::default()
        };
        let firmware = firmware(&heartbeat);
        assert_eq!((firmware.autopilot.as_str(), firmware.vehicle.as_str()), ("ArduPilot", "ground rover"));
        assert!(!is_copter(heartbeat.mavtype) && is_copter(MavType::MAV_TYPE_HEXAROTOR));
        assert_eq!(Family::named(Some(&firmware)), Family::ArduPilot);
        let px4 = super::firmware(&HEARTBEAT_DATA { autopilot: MavAutopilot::MAV_AUTOPILOT_PX4, ..heartbeat });
        assert_eq!((Family::named(Some(&px4)), Family::named(None)), (Family::Px4, Family::ArduPilot));
        assert_eq!(version(0x0406_00FF), "4.6.0");
        assert_eq!(version(0x010F_0140), "1.15.1-alpha");
        assert_eq!(version(0x0405_07C0), "4.5.7-rc");
        assert_eq!(version(0), "");
    }
}
