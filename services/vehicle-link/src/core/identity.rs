//! Who the autopilot is: firmware and kind of vehicle by its heartbeat, the version by AUTOPILOT_VERSION, which is asked for.

use halcyon_model::{Firmware, Stamp};
use mavlink::MessageData as _;
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage, MavType};

use super::encode::Address;
use super::mode::{self, Family};

/// The version is asked for so often, with so much between; old firmware has no answer.
const ASKED_MAX: u32 = 5;
const AGAIN_S: f64 = 3.0;

/// What is known of one autopilot.
#[derive(Debug, Clone, Default)]
pub struct Identity {
    family: Family,
    firmware: Option<Firmware>,
    has_version: bool,
    asked: u32,
    asked_at: Option<Stamp>,
}

impl Identity {
    /// A message came from the autopilot.
    pub fn observe(&mut self, message: &MavMessage) {
        match message {
            MavMessage::HEARTBEAT(data) => {
                self.family = Family::of(data);
                let version = self.firmware.take().map(|firmware| firmware.version).unwrap_or_default();
                self.firmware = Some(Firmware { version, ..mode::firmware(data) });
            }
            MavMessage::AUTOPILOT_VERSION(data) => {
                self.has_version = true;
                if let Some(firmware) = &mut self.firmware {
                    firmware.version = mode::version(data.flight_sw_version);
                }
            }
            _ => {}
        }
    }

    /// How the firmware numbers its modes.
    #[must_use]
    pub fn family(&self) -> Family {
        self.family
    }

    /// What flies the vehicle; `None` before its heartbeat.
    #[must_use]
    pub fn firmware(&self) -> Option<&Firmware> {
        self.firmware.as_ref()
    }

    /// The question for the version, when it is due. Its acknowledgement tells nothing that the answer doesn't.
    pub fn ask(&mut self, to: Address, now: Stamp) -> Option<MavMessage> {
        let waited = self.asked_at.is_none_or(|asked| !(0.0..AGAIN_S).contains(&now.seconds_since(asked)));
        if self.has_version || self.asked >= ASKED_MAX || !waited {
            return None;
        }
        self.asked += 1;
        self.asked_at = Some(now);
        Some(MavMessage::COMMAND_LONG(ardu::COMMAND_LONG_DATA {
            command: MavCmd::MAV_CMD_REQUEST_MESSAGE,
            param1: ardu::AUTOPILOT_VERSION_DATA::ID as f32,
            target_system: to.system(),
            target_component: to.component(),
            ..Default::default()
        }))
    }
}

/// Why this heartbeat's vehicle can't be flown by our setpoints, if it can't. One that doesn't say what it is may be a copter that
/// is not set up yet.
#[must_use]
pub fn unfit(heartbeat: &ardu::HEARTBEAT_DATA) -> Option<String> {
    let kind = heartbeat.mavtype;
    let fits = mode::is_copter(kind) || kind == MavType::MAV_TYPE_GENERIC;
    (!fits).then(|| format!("a {} is not a multicopter", mode::firmware(heartbeat).vehicle))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_version_is_asked_for_until_it_comes_and_never_for_ever() {
        let to = Address::new(7, 1).unwrap();
        let t = |step: i32| Stamp::from_secs_f64(1000.0 + f64::from(step) * 0.1);
        let mut silent = Identity::default();
        assert_eq!((0..1000).filter(|step| silent.ask(to, t(*step)).is_some()).count(), 5);
        let mut identity = Identity::default();
        identity.observe(&MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA::default()));
        let Some(MavMessage::COMMAND_LONG(question)) = identity.ask(to, t(0)) else { panic!("not asked") };
        assert_eq!((question.target_system, question.param1), (7, 148.0));
        let version = ardu::AUTOPILOT_VERSION_DATA { flight_sw_version: 0x0406_00FF, ..Default::default() };
        identity.observe(&MavMessage::AUTOPILOT_VERSION(version));
        identity.observe(&MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA::default()));
        assert_eq!(identity.firmware().unwrap().version, "4.6.0");
        assert!((0..1000).all(|step| identity.ask(to, t(step)).is_none()));
    }
}
