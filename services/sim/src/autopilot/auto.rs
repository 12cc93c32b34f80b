//! AUTO: the stored mission.

use mavlink::dialects::ardupilotmega as mav;
use nalgebra::Vector3;

use super::control::{Horizontal, Setpoint, Vertical};
use super::mission::Item;
use super::{Autopilot, Outbound, Param};

impl Autopilot {
    /// Starts the mission from its first item, or goes on with it.
    pub(super) fn start_mission(&mut self) {
        self.flight.auto_started = true;
        self.flight.reached_at = None;
        if self.mission.current == 0 || self.mission.complete {
            self.mission.complete = false;
            self.mission.current = 1;
        }
    }

    pub(super) fn auto_setpoint(&mut self) -> Setpoint {
        use mav::MavCmd as Cmd;
        self.do_immediate_items();
        let hold = self.hold_setpoint();
        let Some(item) = self.mission.item(self.mission.current).filter(|_| self.flight.auto_started).cloned() else {
            return hold;
        };
        let here_m = self.sensed.estimate.position_ned_m;
        let home_down_m = self.home_ned_m.map_or(here_m.z, |home_m| home_m.z);
        // No place means here; AUTO stays where it entered then.
        let desired_m = self.controller.desired_position_m();
        let place_m = if item.x == 0 && item.y == 0 {
            let down_m = if item.is_relative() { home_down_m } else { self.frame.origin().altitude_m } - f64::from(item.z);
            Vector3::new(desired_m.x, desired_m.y, down_m)
        } else {
            self.place(item.frame, item.x, item.y, f64::from(item.z)).unwrap_or(desired_m)
        };
        let radius_m = self.params.hundredths(Param::WaypointRadius);
        let arrived = match item.command {
            Cmd::MAV_CMD_NAV_TAKEOFF => (here_m.z - place_m.z).abs() < 0.3,
            Cmd::MAV_CMD_NAV_WAYPOINT => (here_m - place_m).norm() < radius_m,
            Cmd::MAV_CMD_NAV_LAND => self.landed,
            _ => false,
        };
        if arrived {
            let since = *self.flight.reached_at.get_or_insert(self.now);
            let wait_s = if item.command == Cmd::MAV_CMD_NAV_WAYPOINT { f64::from(item.params[0]) } else { 0.0 };
            if self.now.seconds_since(since) >= wait_s {
                self.next_item();
            }
        }
        match item.command {
            Cmd::MAV_CMD_NAV_RETURN_TO_LAUNCH => {
                if self.flight.reached_at.is_none() {
                    self.flight.reached_at = Some(self.now);
                    self.start_rtl();
                }
                self.rtl_setpoint()
            }
            Cmd::MAV_CMD_NAV_LAND if (here_m - place_m).xy().norm() < radius_m => self.land_setpoint(Some(place_m.xy())),
            // Towards its landing place it keeps its height.
            Cmd::MAV_CMD_NAV_LAND => Setpoint { horizontal: Horizontal::to(place_m.xy()), ..hold },
            Cmd::MAV_CMD_NAV_TAKEOFF => {
                Setpoint { vertical: Vertical::Position { down_m: place_m.z, velocity_mps: 0.0 }, ..hold }
            }
            _ => Setpoint {
                horizontal: Horizontal::to(place_m.xy()),
                vertical: Vertical::Position { down_m: place_m.z, velocity_mps: 0.0 },
                ..hold
            },
        }
    }

    pub(super) fn next_item(&mut self) {
        let reached = mav::MISSION_ITEM_REACHED_DATA { seq: self.mission.current };
        self.say(None, Outbound::Message(mav::MavMessage::MISSION_ITEM_REACHED(reached)));
        self.advance_item();
    }

    fn advance_item(&mut self) {
        self.flight.reached_at = None;
        if usize::from(self.mission.current) < self.mission.items.len() {
            self.mission.current += 1;
        } else {
            // Nothing left: it holds where it is.
            self.mission.complete = true;
            self.flight.auto_started = false;
        }
    }

    /// Does what takes no time, up to the next place.
    fn do_immediate_items(&mut self) {
        while self.flight.auto_started
            && let Some(item) = self.mission.item(self.mission.current).filter(|item| item.is_immediate()).cloned()
        {
            self.do_item(&item);
            self.advance_item();
        }
    }

    fn do_item(&mut self, item: &Item) {
        use mav::MavCmd as Cmd;
        let [p1, p2, ..] = item.params;
        // As on ArduPilot, what can't be done is passed over.
        let _ = match item.command {
            Cmd::MAV_CMD_DO_CHANGE_SPEED => self.change_speed(p1, p2),
            Cmd::MAV_CMD_DO_SET_SERVO => self.set_servo(p1, p2),
            Cmd::MAV_CMD_DO_SET_RELAY => self.set_relay(p1, p2),
            _ => self.move_gripper(p2),
        };
    }
}
