//! What a ground station sends that flies a vehicle in GUIDED.
//!
//! It changes no mode, so that only the relay sees it; guidance's next setpoint would undo it, which is a fight with a person.

use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};

/// Whether the message asks ArduCopter for GUIDED: where that is the mode already, nothing else tells.
#[must_use]
#[allow(deprecated, reason = "ground stations still send SET_MODE")]
pub fn sets_guided(message: &MavMessage) -> bool {
    const GUIDED: u32 = 4;
    match message {
        MavMessage::SET_MODE(data) => data.custom_mode == GUIDED,
        MavMessage::COMMAND_LONG(data) => data.command == MavCmd::MAV_CMD_DO_SET_MODE && data.param2 == GUIDED as f32,
        MavMessage::COMMAND_INT(data) => data.command == MavCmd::MAV_CMD_DO_SET_MODE && data.param2 == GUIDED as f32,
        _ => false,
    }
}

/// What the message asks for, in words, if it moves the vehicle; `None` for everything else. Changes of mode are seen in the
/// heartbeat, arming is nobody's flight yet, and a joystick that lies on the table speaks all the time, and flies nothing in GUIDED.
#[must_use]
#[allow(deprecated, reason = "Mission Planner still sends MISSION_ITEM")]
pub fn flies(message: &MavMessage) -> Option<&'static str> {
    match message {
        MavMessage::SET_POSITION_TARGET_LOCAL_NED(_) | MavMessage::SET_POSITION_TARGET_GLOBAL_INT(_) => Some("sends targets"),
        MavMessage::SET_ATTITUDE_TARGET(_) => Some("sends attitudes"),
        MavMessage::COMMAND_LONG(data) => by_command(data.command, data.param1),
        MavMessage::COMMAND_INT(data) => by_command(data.command, data.param1),
        // 2: fly there now; 3: change height.
        MavMessage::MISSION_ITEM(data) if matches!(data.current, 2 | 3) => Some("sends it to a point"),
        MavMessage::MISSION_ITEM_INT(data) if matches!(data.current, 2 | 3) => Some("sends it to a point"),
        _ => None,
    }
}

fn by_command(command: MavCmd, param1: f32) -> Option<&'static str> {
    match command {
        MavCmd::MAV_CMD_DO_REPOSITION => Some("sends it to a point"),
        MavCmd::MAV_CMD_NAV_TAKEOFF => Some("has it take off"),
        MavCmd::MAV_CMD_CONDITION_YAW => Some("turns it"),
        MavCmd::MAV_CMD_DO_CHANGE_SPEED => Some("changes its speed"),
        MavCmd::MAV_CMD_DO_ORBIT => Some("has it circle"),
        // 1: go on, as it does.
        MavCmd::MAV_CMD_DO_PAUSE_CONTINUE if param1 != 1.0 => Some("pauses it"),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use mavlink::dialects::ardupilotmega as ardu;

    use super::*;

    fn long(command: MavCmd) -> MavMessage {
        MavMessage::COMMAND_LONG(ardu::COMMAND_LONG_DATA { command, ..Default::default() })
    }

    fn pause(param1: f32) -> MavMessage {
        let command = MavCmd::MAV_CMD_DO_PAUSE_CONTINUE;
        MavMessage::COMMAND_LONG(ardu::COMMAND_LONG_DATA { command, param1, ..Default::default() })
    }

    #[test]
    fn what_a_station_says_all_the_time_flies_nothing() {
        let chatter = [
            MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA::default()),
            MavMessage::PARAM_REQUEST_LIST(ardu::PARAM_REQUEST_LIST_DATA::default()),
            MavMessage::MISSION_ITEM_INT(ardu::MISSION_ITEM_INT_DATA::default()),
            MavMessage::MISSION_ITEM_INT(ardu::MISSION_ITEM_INT_DATA { current: 1, ..Default::default() }),
            long(MavCmd::MAV_CMD_REQUEST_MESSAGE),
            long(MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL),
            long(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM),
            pause(1.0),
        ];
        assert!(chatter.iter().all(|message| flies(message).is_none()));
    }

    #[test]
    #[allow(deprecated, reason = "Mission Planner still sends MISSION_ITEM")]
    fn whatever_moves_it_in_guided_does() {
        let moves = [
            MavMessage::SET_POSITION_TARGET_GLOBAL_INT(ardu::SET_POSITION_TARGET_GLOBAL_INT_DATA::default()),
            MavMessage::MISSION_ITEM(ardu::MISSION_ITEM_DATA { current: 2, ..Default::default() }),
            MavMessage::COMMAND_INT(ardu::COMMAND_INT_DATA { command: MavCmd::MAV_CMD_DO_REPOSITION, ..Default::default() }),
            long(MavCmd::MAV_CMD_NAV_TAKEOFF),
            pause(0.0),
        ];
        assert!(moves.iter().all(|message| flies(message).is_some()));
    }
}
