//! The stored mission and rally points.

use halcyon_model::Geodetic;
use mavlink::dialects::ardupilotmega as mav;

/// Most items, item 0 (home) included.
pub(crate) const ITEMS_MAX: u16 = 724;

/// One item that AUTO can fly.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Item {
    pub(crate) command: mav::MavCmd,
    pub(crate) frame: mav::MavFrame,
    pub(crate) params: [f32; 4],
    /// Latitude and longitude, 10⁻⁷ degrees.
    pub(crate) x: i32,
    pub(crate) y: i32,
    pub(crate) z: f32,
}

impl Item {
    /// Takes an item off the wire, or says why not.
    pub(crate) fn check(data: &mav::MISSION_ITEM_INT_DATA) -> Result<Self, mav::MavMissionResult> {
        use mav::MavCmd as Cmd;
        let known = matches!(
            data.command,
            Cmd::MAV_CMD_NAV_WAYPOINT
                | Cmd::MAV_CMD_NAV_TAKEOFF
                | Cmd::MAV_CMD_NAV_LAND
                | Cmd::MAV_CMD_NAV_RETURN_TO_LAUNCH
                | Cmd::MAV_CMD_NAV_LOITER_UNLIM
                | Cmd::MAV_CMD_DO_CHANGE_SPEED
                | Cmd::MAV_CMD_DO_SET_SERVO
                | Cmd::MAV_CMD_DO_SET_RELAY
                | Cmd::MAV_CMD_DO_GRIPPER
        );
        let frame_ok = matches!(
            data.frame,
            mav::MavFrame::MAV_FRAME_GLOBAL
                | mav::MavFrame::MAV_FRAME_GLOBAL_INT
                | mav::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT
                | mav::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT
                | mav::MavFrame::MAV_FRAME_MISSION
        );
        if !known {
            Err(mav::MavMissionResult::MAV_MISSION_UNSUPPORTED)
        } else if !frame_ok {
            Err(mav::MavMissionResult::MAV_MISSION_UNSUPPORTED_FRAME)
        } else if !data.z.is_finite() {
            Err(mav::MavMissionResult::MAV_MISSION_INVALID_PARAM7)
        } else {
            Ok(Self {
                command: data.command,
                frame: data.frame,
                params: [data.param1, data.param2, data.param3, data.param4],
                x: data.x,
                y: data.y,
                z: data.z,
            })
        }
    }

    /// Whether it is done at once, on the way to the next place.
    pub(crate) fn is_immediate(&self) -> bool {
        use mav::MavCmd as Cmd;
        matches!(
            self.command,
            Cmd::MAV_CMD_DO_CHANGE_SPEED | Cmd::MAV_CMD_DO_SET_SERVO | Cmd::MAV_CMD_DO_SET_RELAY | Cmd::MAV_CMD_DO_GRIPPER
        )
    }

    /// Whether its altitude counts from home.
    pub(crate) fn is_relative(&self) -> bool {
        matches!(self.frame, mav::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT | mav::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
    }
}

/// Most rally points; ArduPilot's depend on its storage.
pub(crate) const RALLY_MAX: u16 = 20;

/// A place to return to instead of home.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RallyPoint {
    /// Latitude and longitude, 10⁻⁷ degrees.
    pub(crate) x: i32,
    pub(crate) y: i32,
    /// Above home, whole metres as ArduPilot stores them.
    pub(crate) height_m: i16,
}

impl RallyPoint {
    /// Takes a point off the wire, or says why not.
    pub(crate) fn check(data: &mav::MISSION_ITEM_INT_DATA) -> Result<Self, mav::MavMissionResult> {
        use mav::MavFrame as Frame;
        let relative = matches!(data.frame, Frame::MAV_FRAME_GLOBAL_RELATIVE_ALT | Frame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT);
        let place = Geodetic::from_deg(f64::from(data.x) * 1e-7, f64::from(data.y) * 1e-7, 0.0);
        if data.command != mav::MavCmd::MAV_CMD_NAV_RALLY_POINT {
            Err(mav::MavMissionResult::MAV_MISSION_UNSUPPORTED)
        } else if !relative {
            Err(mav::MavMissionResult::MAV_MISSION_UNSUPPORTED_FRAME)
        } else if !place.is_valid() {
            Err(mav::MavMissionResult::MAV_MISSION_INVALID_PARAM5_X)
        } else if !(f32::from(i16::MIN)..=f32::from(i16::MAX)).contains(&data.z) {
            Err(mav::MavMissionResult::MAV_MISSION_INVALID_PARAM7)
        } else {
            Ok(Self { x: data.x, y: data.y, height_m: data.z as i16 })
        }
    }
}

/// The stored mission. Item 0 is home, as on ArduPilot, and not stored here.
#[derive(Debug, Clone, Default)]
pub(crate) struct Mission {
    /// Items 1 and up.
    pub(crate) items: Vec<Item>,
    /// Item being flown; 0 before the start.
    pub(crate) current: u16,
    pub(crate) complete: bool,
}

impl Mission {
    /// Items on the wire: none, or home and the stored ones.
    pub(crate) fn count(&self) -> u16 {
        if self.items.is_empty() { 0 } else { self.items.len() as u16 + 1 }
    }

    /// The item at a sequence number from 1 up.
    pub(crate) fn item(&self, sequence: u16) -> Option<&Item> {
        self.items.get(usize::from(sequence).checked_sub(1)?)
    }

    /// Forgets the mission.
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }
}
