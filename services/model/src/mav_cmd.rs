//! Names of the MAVLink commands that make up missions, fences and rally points (common.xml and ArduPilot's).

const NAMES: &[(u16, &str)] = &[
    (16, "NAV_WAYPOINT"),
    (17, "NAV_LOITER_UNLIM"),
    (18, "NAV_LOITER_TURNS"),
    (19, "NAV_LOITER_TIME"),
    (20, "NAV_RETURN_TO_LAUNCH"),
    (21, "NAV_LAND"),
    (22, "NAV_TAKEOFF"),
    (30, "NAV_CONTINUE_AND_CHANGE_ALT"),
    (31, "NAV_LOITER_TO_ALT"),
    (82, "NAV_SPLINE_WAYPOINT"),
    (84, "NAV_VTOL_TAKEOFF"),
    (85, "NAV_VTOL_LAND"),
    (92, "NAV_GUIDED_ENABLE"),
    (93, "NAV_DELAY"),
    (94, "NAV_PAYLOAD_PLACE"),
    (112, "CONDITION_DELAY"),
    (114, "CONDITION_DISTANCE"),
    (115, "CONDITION_YAW"),
    (176, "DO_SET_MODE"),
    (177, "DO_JUMP"),
    (178, "DO_CHANGE_SPEED"),
    (179, "DO_SET_HOME"),
    (181, "DO_SET_RELAY"),
    (182, "DO_REPEAT_RELAY"),
    (183, "DO_SET_SERVO"),
    (184, "DO_REPEAT_SERVO"),
    (189, "DO_LAND_START"),
    (195, "DO_SET_ROI_LOCATION"),
    (197, "DO_SET_ROI_NONE"),
    (201, "DO_SET_ROI"),
    (203, "DO_DIGICAM_CONTROL"),
    (205, "DO_MOUNT_CONTROL"),
    (206, "DO_SET_CAM_TRIGG_DIST"),
    (207, "DO_FENCE_ENABLE"),
    (208, "DO_PARACHUTE"),
    (211, "DO_GRIPPER"),
    (222, "DO_GUIDED_LIMITS"),
    (600, "JUMP_TAG"),
    (601, "DO_JUMP_TAG"),
    (2000, "IMAGE_START_CAPTURE"),
    (2001, "IMAGE_STOP_CAPTURE"),
    (5000, "NAV_FENCE_RETURN_POINT"),
    (5001, "NAV_FENCE_POLYGON_VERTEX_INCLUSION"),
    (5002, "NAV_FENCE_POLYGON_VERTEX_EXCLUSION"),
    (5003, "NAV_FENCE_CIRCLE_INCLUSION"),
    (5004, "NAV_FENCE_CIRCLE_EXCLUSION"),
    (5100, "NAV_RALLY_POINT"),
];

/// The name of a command, `MAV_CMD_` left out; `None` for one without a name here.
#[must_use]
pub fn name(number: u16) -> Option<&'static str> {
    NAMES.iter().find(|row| row.0 == number).map(|row| row.1)
}

/// The number of a command by its name, in any case, with or without `MAV_CMD_`.
#[must_use]
pub fn number(name: &str) -> Option<u16> {
    let upper = name.to_ascii_uppercase();
    let short = upper.strip_prefix("MAV_CMD_").unwrap_or(&upper);
    NAMES.iter().find(|row| row.1 == short).map(|row| row.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_and_back_in_any_case() {
        for (one, text) in NAMES {
            assert_eq!((name(*one), number(&format!("mav_cmd_{}", text.to_lowercase()))), (Some(*text), Some(*one)));
        }
        assert!(NAMES.is_sorted_by(|a, b| a.0 < b.0));
        assert_eq!((name(1), number("NAV_NOWHERE")), (None, None));
    }
}
