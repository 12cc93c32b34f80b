//! `[vehicle_link.payload]`: what holds the payload, and the command that lets it go.

use mavlink::dialects::ardupilotmega::MavCmd;
use serde::{Deserialize, Serialize};

/// What holds the payload.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PayloadKind {
    /// Nothing: no payload can be released.
    #[default]
    None,
    /// A servo on an output of the autopilot.
    Servo,
    /// A gripper that the autopilot knows as one.
    Gripper,
    /// A relay.
    Relay,
}

/// What holds the payload, and when it is let go.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Payload {
    /// `none`, `servo`, `gripper` or `relay`.
    pub kind: PayloadKind,
    /// Servo: the autopilot's output, from 1.
    pub servo_channel: u8,
    /// Servo: pulse that lets go, microseconds.
    pub open_us: u16,
    /// Servo: pulse that holds, microseconds.
    pub closed_us: u16,
    /// Gripper: its number, from 1.
    pub gripper_instance: u8,
    /// Relay: its number, from 0. On lets go.
    pub relay_instance: u8,
    /// Let the payload go by itself once a planned landing is done and the motors are off.
    pub release_on_touchdown: bool,
}

impl Default for Payload {
    fn default() -> Self {
        Self {
            kind: PayloadKind::None,
            servo_channel: 9,
            open_us: 1900,
            closed_us: 1100,
            gripper_instance: 1,
            relay_instance: 0,
            release_on_touchdown: false,
        }
    }
}

/// Opens or closes what holds the payload.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PayloadCommand {
    /// MAVLink's command.
    pub(super) id: MavCmd,
    /// Its first two parameters.
    pub(super) parameters: [f32; 2],
    /// It lets go.
    pub releases: bool,
}

impl Payload {
    /// The command that lets go, or holds; `None` without a payload.
    #[must_use]
    pub fn command(&self, releases: bool) -> Option<PayloadCommand> {
        let (id, parameters) = match self.kind {
            PayloadKind::None => return None,
            PayloadKind::Servo => {
                let pulse_us = if releases { self.open_us } else { self.closed_us };
                (MavCmd::MAV_CMD_DO_SET_SERVO, [f32::from(self.servo_channel), f32::from(pulse_us)])
            }
            // GRIPPER_ACTION_RELEASE is 0, GRIPPER_ACTION_GRAB 1.
            PayloadKind::Gripper => {
                (MavCmd::MAV_CMD_DO_GRIPPER, [f32::from(self.gripper_instance), if releases { 0.0 } else { 1.0 }])
            }
            PayloadKind::Relay => {
                (MavCmd::MAV_CMD_DO_SET_RELAY, [f32::from(self.relay_instance), if releases { 1.0 } else { 0.0 }])
            }
        };
        Some(PayloadCommand { id, parameters, releases })
    }

    pub(crate) fn validate(&self) -> Result<(), String> {
        for (key, value) in [("open_us", self.open_us), ("closed_us", self.closed_us)] {
            if !(500..=2500).contains(&value) {
                return Err(format!("payload.{key} must be in 500 to 2500, not {value}"));
            }
        }
        if !(1..=32).contains(&self.servo_channel) {
            return Err(format!("payload.servo_channel must be in 1 to 32, not {}", self.servo_channel));
        }
        if self.kind == PayloadKind::None && self.release_on_touchdown {
            return Err("payload.release_on_touchdown needs a payload.kind".into());
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers by MAVLink's common.xml: 183 channel, pulse; 211 gripper, 0 release 1 grab; 181 relay, 1 on 0 off.
    #[test]
    fn each_kind_by_its_command() {
        let sent = |kind, releases| {
            let payload = Payload { kind, servo_channel: 7, relay_instance: 2, ..Payload::default() };
            payload.command(releases).map(|command| (command.id as u32, command.parameters))
        };
        assert_eq!(sent(PayloadKind::None, true), None);
        assert_eq!(sent(PayloadKind::Servo, true), Some((183, [7.0, 1900.0])));
        assert_eq!(sent(PayloadKind::Servo, false), Some((183, [7.0, 1100.0])));
        assert_eq!(sent(PayloadKind::Gripper, true), Some((211, [1.0, 0.0])));
        assert_eq!(sent(PayloadKind::Gripper, false), Some((211, [1.0, 1.0])));
        assert_eq!(sent(PayloadKind::Relay, true), Some((181, [2.0, 1.0])));
        assert_eq!(sent(PayloadKind::Relay, false), Some((181, [2.0, 0.0])));
    }

    #[test]
    fn bad_values_are_named() {
        let problem = |payload: Payload| payload.validate().unwrap_err();
        assert!(problem(Payload { open_us: 3000, ..Payload::default() }).contains("open_us"));
        assert!(problem(Payload { servo_channel: 0, ..Payload::default() }).contains("servo_channel"));
        assert!(problem(Payload { release_on_touchdown: true, ..Payload::default() }).contains("kind"));
    }
}
