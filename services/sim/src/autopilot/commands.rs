//! COMMAND_LONG and COMMAND_INT.

use mavlink::dialects::ardupilotmega as mav;
use nalgebra::Vector3;

use super::control::{Yaw, heading_rad};
use super::guided::Guided;
use super::streams::is_streamable;
use super::{Autopilot, LinkId, Mode, Param};

/// The number that forces arming, and the one that forces disarming in the air.
const FORCE_ARM: f32 = 2989.0;
const FORCE_DISARM: f32 = 21196.0;

/// A command, whichever message brought it.
pub(super) struct Command {
    pub(super) link: LinkId,
    pub(super) from: (u8, u8),
    pub(super) command: mav::MavCmd,
    /// Parameters 1 to 4.
    pub(super) params: [f32; 4],
    /// Parameters 5 to 7: a place for COMMAND_INT (10⁻⁷ degrees), numbers for COMMAND_LONG.
    pub(super) place: Place,
}

/// The last three parameters.
pub(super) enum Place {
    Long([f32; 3]),
    Int { frame: mav::MavFrame, x: i32, y: i32, z: f32 },
}

impl Place {
    fn z(&self) -> f32 {
        match self {
            Self::Long([_, _, z]) | Self::Int { z, .. } => *z,
        }
    }
}

impl Autopilot {
    /// Does the command and acknowledges it.
    pub(super) fn run_command(&mut self, command: &Command) {
        let result = self.do_command(command);
        let ack = mav::COMMAND_ACK_DATA {
            command: command.command,
            result,
            progress: 0,
            result_param2: 0,
            target_system: command.from.0,
            target_component: command.from.1,
        };
        self.reply(command.link, mav::MavMessage::COMMAND_ACK(ack));
    }

    fn do_command(&mut self, command: &Command) -> mav::MavResult {
        use mav::MavCmd as Cmd;
        use mav::MavResult as Result;
        let [p1, p2, p3, p4] = command.params;
        match command.command {
            Cmd::MAV_CMD_COMPONENT_ARM_DISARM => self.arm_or_disarm(p1, p2),
            Cmd::MAV_CMD_DO_SET_MODE => self.mode_by_number(p1 as u32, p2 as u32),
            Cmd::MAV_CMD_NAV_TAKEOFF => self.take_off(f64::from(command.place.z())),
            Cmd::MAV_CMD_NAV_LAND => outcome(self.set_mode(Mode::Land).is_ok()),
            Cmd::MAV_CMD_NAV_RETURN_TO_LAUNCH => outcome(self.set_mode(Mode::Rtl).is_ok()),
            Cmd::MAV_CMD_NAV_LOITER_UNLIM => outcome(self.set_mode(Mode::Loiter).is_ok()),
            Cmd::MAV_CMD_MISSION_START => self.mission_start(),
            Cmd::MAV_CMD_CONDITION_YAW => self.turn_to(p1, p2, p3, p4),
            Cmd::MAV_CMD_DO_CHANGE_SPEED => self.change_speed(p1, p2),
            Cmd::MAV_CMD_DO_REPOSITION => self.reposition(command),
            Cmd::MAV_CMD_DO_SET_HOME => self.home_by_command(p1, &command.place),
            Cmd::MAV_CMD_DO_FLIGHTTERMINATION => {
                if p1 > 0.5 {
                    self.disarm();
                    Result::MAV_RESULT_ACCEPTED
                } else {
                    Result::MAV_RESULT_FAILED
                }
            }
            Cmd::MAV_CMD_DO_SET_SERVO => self.set_servo(p1, p2),
            Cmd::MAV_CMD_DO_GRIPPER => self.move_gripper(p2),
            Cmd::MAV_CMD_DO_SET_RELAY => self.set_relay(p1, p2),
            Cmd::MAV_CMD_DO_FENCE_ENABLE => self.enable_fence(p1),
            Cmd::MAV_CMD_DO_SET_MISSION_CURRENT => outcome(p1 >= 0.0 && self.set_current(p1 as u16)),
            Cmd::MAV_CMD_SET_MESSAGE_INTERVAL => self.set_interval(command.link, p1, p2),
            Cmd::MAV_CMD_GET_MESSAGE_INTERVAL => self.tell_interval(command.link, p1),
            Cmd::MAV_CMD_REQUEST_MESSAGE => self.tell_once(command.link, p1),
            Cmd::MAV_CMD_GET_HOME_POSITION => self.tell_once(command.link, 242.0),
            Cmd::MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES => self.tell_once(command.link, 148.0),
            Cmd::MAV_CMD_RUN_PREARM_CHECKS => {
                if self.armed {
                    return Result::MAV_RESULT_TEMPORARILY_REJECTED;
                }
                self.told_prearm_at = None;
                Result::MAV_RESULT_ACCEPTED
            }
            _ => Result::MAV_RESULT_UNSUPPORTED,
        }
    }

    fn arm_or_disarm(&mut self, arm: f32, magic: f32) -> mav::MavResult {
        if arm == 1.0 {
            outcome(self.arm(magic == FORCE_ARM))
        } else if arm == 0.0 {
            // In the air only by force.
            if self.armed && !self.landed && magic != FORCE_DISARM {
                return mav::MavResult::MAV_RESULT_FAILED;
            }
            self.disarm();
            mav::MavResult::MAV_RESULT_ACCEPTED
        } else {
            mav::MavResult::MAV_RESULT_UNSUPPORTED
        }
    }

    /// A mode by its number, as a message or a command asks for it.
    pub(super) fn mode_by_number(&mut self, base_mode: u32, number: u32) -> mav::MavResult {
        if base_mode & 1 == 0 {
            // Without MAV_MODE_FLAG_CUSTOM_MODE_ENABLED the number means nothing here.
            return mav::MavResult::MAV_RESULT_DENIED;
        }
        outcome(self.request_mode(number))
    }

    fn enable_fence(&mut self, enable: f32) -> mav::MavResult {
        let wanted = match enable as i32 {
            0 => 0.0,
            1 => 1.0,
            // Only a floor, which this fence has not.
            2 => return mav::MavResult::MAV_RESULT_ACCEPTED,
            _ => return mav::MavResult::MAV_RESULT_FAILED,
        };
        self.params.assign(Param::FenceEnable, wanted);
        mav::MavResult::MAV_RESULT_ACCEPTED
    }

    /// A mode by its number; `false` when it can't be.
    pub(super) fn request_mode(&mut self, number: u32) -> bool {
        let Some(mode) = Mode::from_number(number) else {
            self.text(mav::MavSeverity::MAV_SEVERITY_WARNING, &format!("No such mode {number}"));
            return false;
        };
        self.set_mode(mode).is_ok()
    }

    fn take_off(&mut self, height_m: f64) -> mav::MavResult {
        let allowed = self.mode == Mode::Guided && self.armed && self.landed && self.sensed.estimate.position_ok;
        let Some(home_m) = self.home_ned_m.filter(|_| allowed) else {
            return mav::MavResult::MAV_RESULT_FAILED;
        };
        let down_m = home_m.z - height_m;
        if !height_m.is_finite() || down_m >= self.sensed.estimate.position_ned_m.z {
            return mav::MavResult::MAV_RESULT_FAILED;
        }
        self.guided = Guided::TakeOff { down_m };
        mav::MavResult::MAV_RESULT_ACCEPTED
    }

    fn mission_start(&mut self) -> mav::MavResult {
        if self.mission.items.is_empty() || !self.armed || (self.mode != Mode::Auto && self.set_mode(Mode::Auto).is_err()) {
            return mav::MavResult::MAV_RESULT_FAILED;
        }
        self.start_mission();
        mav::MavResult::MAV_RESULT_ACCEPTED
    }

    fn turn_to(&mut self, angle_deg: f32, rate_degps: f32, direction: f32, relative: f32) -> mav::MavResult {
        if !(0.0..=360.0).contains(&angle_deg) || (relative != 0.0 && relative != 1.0) || !rate_degps.is_finite() {
            return mav::MavResult::MAV_RESULT_DENIED;
        }
        if !matches!(self.mode, Mode::Guided | Mode::Auto) {
            return mav::MavResult::MAV_RESULT_FAILED;
        }
        let angle_rad = f64::from(angle_deg).to_radians();
        let heading_rad = if relative == 1.0 {
            heading_rad(&self.sensed.estimate.ned_from_body) + if direction < 0.0 { -angle_rad } else { angle_rad }
        } else {
            angle_rad
        };
        let rate_radps = if rate_degps > 0.0 { f64::from(rate_degps).to_radians() } else { f64::INFINITY };
        self.flight.yaw = Yaw::Fixed { heading_rad, rate_radps };
        mav::MavResult::MAV_RESULT_ACCEPTED
    }

    /// MAV_CMD_DO_CHANGE_SPEED: only the modes that navigate by themselves have a speed.
    pub(super) fn change_speed(&mut self, kind: f32, speed_mps: f32) -> mav::MavResult {
        if !matches!(self.mode, Mode::Guided | Mode::Auto | Mode::Rtl)
            || !speed_mps.is_finite()
            || !(0.05..=20.0).contains(&speed_mps)
        {
            return mav::MavResult::MAV_RESULT_FAILED;
        }
        let speed_mps = Some(f64::from(speed_mps));
        match kind as i32 {
            0 | 1 => self.flight.speed_mps = speed_mps,
            2 => self.flight.up_mps = speed_mps,
            3 => self.flight.down_mps = speed_mps,
            _ => return mav::MavResult::MAV_RESULT_FAILED,
        }
        mav::MavResult::MAV_RESULT_ACCEPTED
    }

    fn reposition(&mut self, command: &Command) -> mav::MavResult {
        let Place::Int { frame, x, y, z } = command.place else {
            return mav::MavResult::MAV_RESULT_COMMAND_INT_ONLY;
        };
        let change_mode = command.params[1] as u32 & 1 != 0;
        if self.mode != Mode::Guided && !change_mode {
            return mav::MavResult::MAV_RESULT_DENIED;
        }
        let Some(ned_m) = self.place(frame, x, y, f64::from(z)).filter(|_| x != 0 || y != 0) else {
            return mav::MavResult::MAV_RESULT_DENIED;
        };
        if self.mode != Mode::Guided && self.set_mode(Mode::Guided).is_err() {
            return mav::MavResult::MAV_RESULT_DENIED;
        }
        if !self.fence_allows(ned_m) {
            return mav::MavResult::MAV_RESULT_FAILED;
        }
        if self.armed && !self.landed {
            self.guided = Guided::Position { ned_m };
        }
        mav::MavResult::MAV_RESULT_ACCEPTED
    }

    fn home_by_command(&mut self, here: f32, place: &Place) -> mav::MavResult {
        let here_m = Some(self.sensed.estimate.position_ned_m).filter(|_| self.sensed.estimate.position_ok);
        let home_m = match *place {
            // No place means here too.
            Place::Int { x: 0, y: 0, .. } => here_m,
            Place::Long([latitude_deg, longitude_deg, _]) if latitude_deg == 0.0 && longitude_deg == 0.0 => here_m,
            _ if here == 1.0 => here_m,
            Place::Int { frame, x, y, z } => self.place(frame, x, y, f64::from(z)),
            Place::Long([latitude_deg, longitude_deg, z]) => {
                let tenths = |degrees: f32| (f64::from(degrees) * 1e7) as i32;
                self.place(mav::MavFrame::MAV_FRAME_GLOBAL, tenths(latitude_deg), tenths(longitude_deg), f64::from(z))
            }
        };
        let Some(home_m) = home_m.filter(|home_m: &Vector3<f64>| self.origin_ned_m.is_some() && home_m.norm() < 1e6) else {
            return mav::MavResult::MAV_RESULT_FAILED;
        };
        self.home_is_set = true;
        self.set_home(home_m);
        mav::MavResult::MAV_RESULT_ACCEPTED
    }

    fn set_interval(&mut self, link: LinkId, message_id: f32, interval_us: f32) -> mav::MavResult {
        let id = message_id as u32;
        if !is_streamable(id) {
            self.text(mav::MavSeverity::MAV_SEVERITY_INFO, &format!("No ap_message for mavlink id ({id})"));
        }
        if !is_streamable(id) || !interval_us.is_finite() || interval_us < -1.0 {
            return mav::MavResult::MAV_RESULT_DENIED;
        }
        let now = self.now;
        if let Some(link) = self.links.iter_mut().find(|known| known.id == link) {
            link.set_interval(id, interval_us as i64, now);
        }
        mav::MavResult::MAV_RESULT_ACCEPTED
    }

    fn tell_interval(&mut self, link: LinkId, message_id: f32) -> mav::MavResult {
        let id = message_id as u16;
        let known = is_streamable(u32::from(id));
        let interval_us = self.links.iter().find(|other| other.id == link).and_then(|link| link.interval_us(u32::from(id)));
        let interval_us = if known { interval_us.map_or(-1, |interval_us| interval_us as i32) } else { 0 };
        self.reply(link, mav::MavMessage::MESSAGE_INTERVAL(mav::MESSAGE_INTERVAL_DATA { interval_us, message_id: id }));
        outcome(known)
    }

    fn tell_once(&mut self, link: LinkId, message_id: f32) -> mav::MavResult {
        match self.telemetry(message_id as u32) {
            Some(message) => {
                self.reply(link, message);
                mav::MavResult::MAV_RESULT_ACCEPTED
            }
            None => mav::MavResult::MAV_RESULT_FAILED,
        }
    }
}

fn outcome(done: bool) -> mav::MavResult {
    if done { mav::MavResult::MAV_RESULT_ACCEPTED } else { mav::MavResult::MAV_RESULT_FAILED }
}
