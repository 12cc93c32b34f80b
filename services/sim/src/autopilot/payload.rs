//! What moves beside the propellers: servo outputs, gripper, relays.

use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega as mav;

use super::{Autopilot, Param};

/// Outputs; the first four turn the propellers.
const OUTPUTS: usize = 16;
const MOTORS: usize = 4;
/// SERVOn_FUNCTION of a gripper, and of a channel that is passed through by hand.
const FUNCTION_GRIPPER: f64 = 28.0;
const FUNCTION_MANUAL: f64 = 1.0;
/// A gripper's servo has arrived after this, seconds.
const GRIPPER_MOVES_S: f64 = 0.5;

const FUNCTIONS: [Param; OUTPUTS - MOTORS] = [
    Param::Servo5,
    Param::Servo6,
    Param::Servo7,
    Param::Servo8,
    Param::Servo9,
    Param::Servo10,
    Param::Servo11,
    Param::Servo12,
    Param::Servo13,
    Param::Servo14,
    Param::Servo15,
    Param::Servo16,
];
const RELAYS: [Param; 2] = [Param::Relay1, Param::Relay2];

/// Where a gripper is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Gripper {
    Neutral,
    Moving { grabs: bool, since: Stamp },
    Still { grabs: bool },
}

/// The state of all of it.
#[derive(Debug, Clone)]
pub(super) struct Payload {
    /// Pulse widths last commanded, microseconds; 0 before any.
    servos_us: [u16; OUTPUTS],
    gripper: Gripper,
    relays: [bool; RELAYS.len()],
}

impl Payload {
    pub(super) fn new() -> Self {
        Self { servos_us: [0; OUTPUTS], gripper: Gripper::Neutral, relays: [false; RELAYS.len()] }
    }
}

impl Autopilot {
    /// Pulse width on a servo output (1 to 16), microseconds; 0 for none. What releases a payload. The propellers' are not told here.
    #[must_use]
    pub fn servo_us(&self, output: usize) -> u16 {
        let Some(index) = output.checked_sub(1) else { return 0 };
        let is_gripper = self.output_function(index) == Some(FUNCTION_GRIPPER) && self.params.get(Param::GripperEnable) != 0.0;
        match self.payload.servos_us.get(index).copied().unwrap_or(0) {
            0 if is_gripper => self.params.get(Param::GripperNeutral) as u16,
            width_us => width_us,
        }
    }

    /// SERVOn_FUNCTION of an output by its index; `None` for a propeller or none at all.
    fn output_function(&self, index: usize) -> Option<f64> {
        FUNCTIONS.get(index.checked_sub(MOTORS)?).map(|param| self.params.get(*param))
    }

    /// MAV_CMD_DO_SET_SERVO.
    pub(super) fn set_servo(&mut self, output: f32, width_us: f32) -> mav::MavResult {
        let index = (output as usize).wrapping_sub(1);
        let free = match self.output_function(index) {
            Some(function) => function <= 0.0 || function == FUNCTION_MANUAL || function == FUNCTION_GRIPPER,
            None if index < MOTORS => false,
            None => return mav::MavResult::MAV_RESULT_FAILED,
        };
        if !free {
            let text = format!("ServoRelayEvent: Channel {} is already in use", index + 1);
            self.text(mav::MavSeverity::MAV_SEVERITY_INFO, &text);
            return mav::MavResult::MAV_RESULT_FAILED;
        }
        match self.payload.servos_us.get_mut(index) {
            Some(servo_us) if (500.0..=2500.0).contains(&width_us) => {
                *servo_us = width_us as u16;
                mav::MavResult::MAV_RESULT_ACCEPTED
            }
            _ => mav::MavResult::MAV_RESULT_FAILED,
        }
    }

    /// MAV_CMD_DO_GRIPPER: the instance is not looked at, as on ArduPilot, which has one.
    pub(super) fn move_gripper(&mut self, action: f32) -> mav::MavResult {
        if self.params.get(Param::GripperEnable) == 0.0 {
            return mav::MavResult::MAV_RESULT_FAILED;
        }
        let grabs = match action as i32 {
            0 => false,
            1 => true,
            _ => return mav::MavResult::MAV_RESULT_FAILED,
        };
        match self.payload.gripper {
            Gripper::Moving { grabs: now, .. } if now == grabs => {}
            Gripper::Still { grabs: now } if now == grabs => self.tell_gripper(grabs),
            _ => {
                self.payload.gripper = Gripper::Moving { grabs, since: self.now };
                let width_us = self.params.get(if grabs { Param::GripperGrab } else { Param::GripperRelease }) as u16;
                for index in MOTORS..OUTPUTS {
                    if self.output_function(index) == Some(FUNCTION_GRIPPER) {
                        self.payload.servos_us[index] = width_us;
                    }
                }
                let text = if grabs { "Gripper load grabbing" } else { "Gripper load releasing" };
                self.text(mav::MavSeverity::MAV_SEVERITY_INFO, text);
            }
        }
        mav::MavResult::MAV_RESULT_ACCEPTED
    }

    fn tell_gripper(&mut self, grabs: bool) {
        let text = if grabs { "Gripper load grabbed" } else { "Gripper load released" };
        self.text(mav::MavSeverity::MAV_SEVERITY_INFO, text);
    }

    /// Says that the gripper has arrived.
    pub(super) fn watch_gripper(&mut self) {
        if let Gripper::Moving { grabs, since } = self.payload.gripper
            && self.now.seconds_since(since) >= GRIPPER_MOVES_S
        {
            self.payload.gripper = Gripper::Still { grabs };
            self.tell_gripper(grabs);
        }
    }

    /// MAV_CMD_DO_SET_RELAY: 0 off, 1 on, anything else the other way round.
    pub(super) fn set_relay(&mut self, number: f32, state: f32) -> mav::MavResult {
        let index = number as usize;
        let there = number >= 0.0 && RELAYS.get(index).is_some_and(|param| self.params.get(*param) == 1.0);
        let Some(relay) = self.payload.relays.get_mut(index).filter(|_| there) else {
            return mav::MavResult::MAV_RESULT_FAILED;
        };
        *relay = match state as i32 {
            0 => false,
            1 => true,
            _ => !*relay,
        };
        mav::MavResult::MAV_RESULT_ACCEPTED
    }

    /// RELAY_STATUS; `None` without a relay.
    pub(super) fn relay_status(&self) -> Option<mav::MavMessage> {
        let bits =
            |on: &dyn Fn(usize) -> bool| (0..RELAYS.len()).filter(|index| on(*index)).fold(0_u16, |bits, n| bits | (1 << n));
        let present = bits(&|index| self.params.get(RELAYS[index]) == 1.0);
        let on = bits(&|index| self.payload.relays[index]) & present;
        let data = mav::RELAY_STATUS_DATA { time_boot_ms: self.boot_ms(), on, present };
        (present != 0).then_some(mav::MavMessage::RELAY_STATUS(data))
    }
}
