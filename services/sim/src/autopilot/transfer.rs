//! Parameter and mission transfer.

use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::MavMessage;
use nalgebra::Vector3;

use super::mission::{ITEMS_MAX, Item, Upload};
use super::{Autopilot, LinkId, Outbound, Params};

/// What the index of a parameter says when it was not asked for by index.
const NO_INDEX: u16 = u16::MAX;

impl Autopilot {
    /// Messages of the two transfer protocols; everything else is left alone.
    pub(super) fn transfer(&mut self, link: LinkId, from: (u8, u8), message: &MavMessage) {
        match message {
            MavMessage::PARAM_REQUEST_LIST(_) => {
                if let Some(link) = self.links.iter_mut().find(|known| known.id == link) {
                    link.next_param = Some(0);
                }
            }
            MavMessage::PARAM_REQUEST_READ(data) => {
                let found = match usize::try_from(data.param_index) {
                    Ok(index) => Some((index, data.param_index as u16)),
                    Err(_) => data.param_id.to_str().ok().and_then(Params::find).map(|index| (index, NO_INDEX)),
                };
                if let Some((index, told_index)) = found
                    && let Some(value) = self.param_value(index, told_index)
                {
                    self.reply(link, value);
                }
            }
            MavMessage::PARAM_SET(data) => {
                // An unknown name is not answered, as on ArduPilot; a bad value is answered with the one that stays.
                if let Some(index) = data.param_id.to_str().ok().and_then(Params::find) {
                    self.params.set(index, data.param_value);
                    if let Some(value) = self.param_value(index, NO_INDEX) {
                        self.say(None, Outbound::Message(value));
                    }
                }
            }
            MavMessage::MISSION_REQUEST_LIST(data) => {
                let count = if is_mission(data.mission_type) { self.mission.count() } else { 0 };
                let answer = mav::MISSION_COUNT_DATA {
                    count,
                    target_system: from.0,
                    target_component: from.1,
                    mission_type: data.mission_type,
                    opaque_id: 0,
                };
                self.reply(link, MavMessage::MISSION_COUNT(answer));
            }
            MavMessage::MISSION_REQUEST_INT(data) => self.tell_item(link, from, data.seq, data.mission_type),
            MavMessage::MISSION_REQUEST(data) => self.tell_item(link, from, data.seq, data.mission_type),
            MavMessage::MISSION_COUNT(data) => self.begin_upload(link, from, data),
            MavMessage::MISSION_ITEM_INT(data) => self.take_item(link, from, data),
            MavMessage::MISSION_CLEAR_ALL(data) => {
                let ours = is_mission(data.mission_type) || data.mission_type == mav::MavMissionType::MAV_MISSION_TYPE_ALL;
                if ours {
                    self.mission.clear();
                }
                let result = if ours { Answer::MAV_MISSION_ACCEPTED } else { Answer::MAV_MISSION_UNSUPPORTED };
                self.acknowledge(link, from, result, data.mission_type);
            }
            MavMessage::MISSION_SET_CURRENT(data) => {
                if self.mission.item(data.seq).is_some() {
                    self.mission.current = data.seq;
                    self.mission.complete = false;
                    self.flight.reached_at = None;
                }
                if let Some(current) = self.telemetry(42) {
                    self.say(None, Outbound::Message(current));
                }
            }
            _ => {}
        }
    }

    /// Sends the next parameter of each list under way: one a step is 400 a second, which no link chokes on.
    pub(super) fn pump_params(&mut self) {
        for place in 0..self.links.len() {
            let (link, next) = (self.links[place].id, self.links[place].next_param);
            let Some(index) = next else { continue };
            match self.param_value(index, index as u16) {
                Some(value) => {
                    self.links[place].next_param = Some(index + 1);
                    self.reply(link, value);
                }
                None => self.links[place].next_param = None,
            }
        }
    }

    fn param_value(&self, index: usize, told_index: u16) -> Option<MavMessage> {
        let (name, param_value, param_type) = self.params.at(index)?;
        Some(MavMessage::PARAM_VALUE(mav::PARAM_VALUE_DATA {
            param_value,
            param_count: Params::count(),
            param_index: told_index,
            param_id: name.into(),
            param_type,
        }))
    }

    fn acknowledge(&mut self, link: LinkId, to: (u8, u8), result: Answer, mission_type: mav::MavMissionType) {
        let ack =
            mav::MISSION_ACK_DATA { target_system: to.0, target_component: to.1, mavtype: result, mission_type, opaque_id: 0 };
        self.reply(link, MavMessage::MISSION_ACK(ack));
    }

    fn tell_item(&mut self, link: LinkId, to: (u8, u8), seq: u16, mission_type: mav::MavMissionType) {
        let item = match self.mission.item(seq) {
            _ if !is_mission(mission_type) => None,
            Some(item) => Some(item.clone()),
            None if seq == 0 && !self.mission.items.is_empty() => self.home_item(),
            None => None,
        };
        let Some(item) = item else {
            self.acknowledge(link, to, Answer::MAV_MISSION_INVALID_SEQUENCE, mission_type);
            return;
        };
        let [param1, param2, param3, param4] = item.params;
        let data = mav::MISSION_ITEM_INT_DATA {
            param1,
            param2,
            param3,
            param4,
            x: item.x,
            y: item.y,
            z: item.z,
            seq,
            command: item.command,
            target_system: to.0,
            target_component: to.1,
            frame: item.frame,
            current: u8::from(seq == self.mission.current),
            autocontinue: 1,
            mission_type,
        };
        self.reply(link, MavMessage::MISSION_ITEM_INT(data));
    }

    fn home_item(&self) -> Option<Item> {
        let home = self.frame.geodetic_from_ned(self.home_ned_m?);
        Some(Item {
            command: mav::MavCmd::MAV_CMD_NAV_WAYPOINT,
            frame: mav::MavFrame::MAV_FRAME_GLOBAL,
            params: [0.0; 4],
            x: tenths_of_micro_deg(home.latitude_deg()),
            y: tenths_of_micro_deg(home.longitude_deg()),
            z: home.altitude_m as f32,
        })
    }

    fn begin_upload(&mut self, link: LinkId, from: (u8, u8), data: &mav::MISSION_COUNT_DATA) {
        if !is_mission(data.mission_type) {
            self.acknowledge(link, from, Answer::MAV_MISSION_UNSUPPORTED, data.mission_type);
        } else if self.mission.upload.as_ref().is_some_and(|upload| upload.link != link) {
            self.acknowledge(link, from, Answer::MAV_MISSION_DENIED, data.mission_type);
        } else if data.count > ITEMS_MAX {
            self.acknowledge(link, from, Answer::MAV_MISSION_NO_SPACE, data.mission_type);
        } else if data.count == 0 {
            self.mission.clear();
            self.acknowledge(link, from, Answer::MAV_MISSION_ACCEPTED, data.mission_type);
        } else {
            self.mission.upload = Some(Upload { link, from, count: data.count, items: Vec::new() });
            self.ask_item(link, from, 0);
        }
    }

    fn ask_item(&mut self, link: LinkId, to: (u8, u8), seq: u16) {
        // The float request: what ArduPilot sends too, and what every client answers.
        let data = mav::MISSION_REQUEST_DATA {
            seq,
            target_system: to.0,
            target_component: to.1,
            mission_type: mav::MavMissionType::MAV_MISSION_TYPE_MISSION,
        };
        self.reply(link, MavMessage::MISSION_REQUEST(data));
    }

    fn take_item(&mut self, link: LinkId, from: (u8, u8), data: &mav::MISSION_ITEM_INT_DATA) {
        let Some(upload) = self.mission.upload.as_mut().filter(|upload| upload.link == link && upload.from == from) else {
            self.acknowledge(link, from, Answer::MAV_MISSION_ERROR, data.mission_type);
            return;
        };
        let expected = upload.items.len() as u16;
        if data.seq < expected {
            // A repetition: it has it already.
            self.ask_item(link, from, expected);
            return;
        }
        if data.seq > expected {
            self.acknowledge(link, from, Answer::MAV_MISSION_INVALID_SEQUENCE, data.mission_type);
            return;
        }
        let checked = if data.seq == 0 {
            // Item 0 is home, which an upload does not move: keep its place in the count, whatever it is.
            Item::check(&mav::MISSION_ITEM_INT_DATA {
                command: mav::MavCmd::MAV_CMD_NAV_WAYPOINT,
                frame: mav::MavFrame::MAV_FRAME_GLOBAL,
                z: 0.0,
                ..data.clone()
            })
        } else {
            Item::check(data)
        };
        match checked {
            Ok(item) => upload.items.push(item),
            Err(problem) => {
                self.mission.upload = None;
                self.acknowledge(link, from, problem, data.mission_type);
                return;
            }
        }
        let (have, count) = (upload.items.len() as u16, upload.count);
        if have < count {
            self.ask_item(link, from, have);
            return;
        }
        let mut items = std::mem::take(&mut upload.items);
        items.remove(0);
        self.mission.clear();
        self.mission.items = items;
        self.flight.auto_started = false;
        self.acknowledge(link, from, Answer::MAV_MISSION_ACCEPTED, data.mission_type);
    }

    /// A place as MAVLink's 10⁻⁷ degrees and metres.
    pub(super) fn global_e7(&self, ned_m: Vector3<f64>) -> (i32, i32, f64) {
        let place = self.frame.geodetic_from_ned(ned_m);
        // The plane's height, not the ellipsoid's: what the fleet calls height stays the same far from the origin.
        let altitude_m = self.frame.origin().altitude_m - ned_m.z;
        (tenths_of_micro_deg(place.latitude_deg()), tenths_of_micro_deg(place.longitude_deg()), altitude_m)
    }
}

use mav::MavMissionResult as Answer;

fn is_mission(mission_type: mav::MavMissionType) -> bool {
    mission_type == mav::MavMissionType::MAV_MISSION_TYPE_MISSION
}

fn tenths_of_micro_deg(deg: f64) -> i32 {
    (deg * 1e7).round() as i32
}
