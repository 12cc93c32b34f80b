//! The mission protocol: mission, fence and rally points are each told, uploaded and cleared by themselves.
//!
//! As on ArduPilot, items of a mission and rally points replace the stored ones as they come, so that an upload that breaks off
//! leaves a mixture, while a fence changes as a whole or not at all.

use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::MavMessage;

use super::fence::{self, FenceItem};
use super::guided::Guided;
use super::mission::{self, Item, RallyPoint};
use super::places::{as_floats, as_integers, tenths_of_micro_deg};
use super::{Autopilot, LinkId, Mode, Param};
use mav::MavMissionResult as Answer;

/// An item that doesn't come is asked for again after this, and given up after that, seconds.
const ASK_AGAIN_S: f64 = 1.0;
const GIVE_UP_S: f64 = 8.0;

/// What can be stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Store {
    Mission,
    Fence,
    Rally,
}

impl Store {
    const ALL: [Self; 3] = [Self::Mission, Self::Fence, Self::Rally];

    /// `None` for what this autopilot does not store, "all" included.
    fn of(mission_type: mav::MavMissionType) -> Option<Self> {
        Self::ALL.into_iter().find(|store| store.mission_type() == mission_type)
    }

    fn mission_type(self) -> mav::MavMissionType {
        match self {
            Self::Mission => mav::MavMissionType::MAV_MISSION_TYPE_MISSION,
            Self::Fence => mav::MavMissionType::MAV_MISSION_TYPE_FENCE,
            Self::Rally => mav::MavMissionType::MAV_MISSION_TYPE_RALLY,
        }
    }

    fn items_max(self) -> u16 {
        match self {
            Self::Mission => mission::ITEMS_MAX,
            Self::Fence => fence::ITEMS_MAX,
            Self::Rally => mission::RALLY_MAX,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Mission => "Mission",
            Self::Fence => "Fence",
            Self::Rally => "Rally",
        }
    }
}

/// An upload under way.
#[derive(Debug, Clone)]
struct Upload {
    link: LinkId,
    from: (u8, u8),
    count: u16,
    next: u16,
    asked_at: Stamp,
    heard_at: Stamp,
    /// A fence's items, until all are there.
    fence: Vec<FenceItem>,
}

/// At most one upload to each store.
#[derive(Debug, Clone, Default)]
pub(super) struct Uploads([Option<Upload>; 3]);

impl Uploads {
    fn of(&mut self, store: Store) -> &mut Option<Upload> {
        &mut self.0[store as usize]
    }

    /// Forgets what came over a link that is gone.
    pub(super) fn detach(&mut self, link: LinkId) {
        for upload in &mut self.0 {
            upload.take_if(|upload| upload.link == link);
        }
    }
}

impl Autopilot {
    /// Messages of the mission protocol; everything else is left alone.
    pub(super) fn mission_protocol(&mut self, link: LinkId, from: (u8, u8), message: &MavMessage) {
        match message {
            MavMessage::MISSION_REQUEST_LIST(data) => self.tell_count(link, from, data.mission_type),
            MavMessage::MISSION_REQUEST_INT(data) => {
                let uploading = Store::of(data.mission_type).is_some_and(|store| self.uploads.of(store).is_some());
                if uploading {
                    return self.acknowledge(link, from, Answer::MAV_MISSION_DENIED, data.mission_type);
                }
                match self.item_for(from, data.seq, data.mission_type) {
                    Ok(item) => self.reply(link, MavMessage::MISSION_ITEM_INT(item)),
                    Err(problem) => self.acknowledge(link, from, problem, data.mission_type),
                }
            }
            MavMessage::MISSION_REQUEST(data) => match self.item_for(from, data.seq, data.mission_type) {
                Ok(item) => self.reply(link, MavMessage::MISSION_ITEM(as_floats(&item))),
                Err(problem) => self.acknowledge(link, from, problem, data.mission_type),
            },
            MavMessage::MISSION_COUNT(data) => self.begin_upload(link, from, data),
            MavMessage::MISSION_ITEM_INT(data) => self.take_item(link, from, data),
            MavMessage::MISSION_ITEM(data) if data.current == 2 => self.fly_to_item(link, from, data),
            MavMessage::MISSION_ITEM(data) => self.take_item(link, from, &as_integers(data)),
            MavMessage::MISSION_CLEAR_ALL(data) => self.clear_store(link, from, data.mission_type),
            MavMessage::MISSION_SET_CURRENT(data) => {
                self.set_current(data.seq);
                if let Some(current) = self.telemetry(42) {
                    self.reply(link, current);
                }
            }
            _ => {}
        }
    }

    /// Makes an item the one that is flown; `false` when there is none.
    pub(super) fn set_current(&mut self, seq: u16) -> bool {
        let there = self.mission.item(seq).is_some();
        if there {
            self.mission.current = seq;
            self.mission.complete = false;
            self.flight.reached_at = None;
        }
        there
    }

    fn acknowledge(&mut self, link: LinkId, to: (u8, u8), result: Answer, mission_type: mav::MavMissionType) {
        let ack =
            mav::MISSION_ACK_DATA { target_system: to.0, target_component: to.1, mavtype: result, mission_type, opaque_id: 0 };
        self.reply(link, MavMessage::MISSION_ACK(ack));
    }

    fn count(&self, store: Store) -> u16 {
        match store {
            Store::Mission => self.mission.count(),
            Store::Fence => self.fence.items.len() as u16,
            Store::Rally => self.rally.len() as u16,
        }
    }

    fn tell_count(&mut self, link: LinkId, to: (u8, u8), mission_type: mav::MavMissionType) {
        let Some(store) = Store::of(mission_type) else {
            return self.acknowledge(link, to, Answer::MAV_MISSION_UNSUPPORTED, mission_type);
        };
        if self.uploads.of(store).is_some() {
            return self.acknowledge(link, to, Answer::MAV_MISSION_DENIED, mission_type);
        }
        let (target_system, target_component) = to;
        let count = self.count(store);
        let answer = mav::MISSION_COUNT_DATA { count, target_system, target_component, mission_type, opaque_id: 0 };
        self.reply(link, MavMessage::MISSION_COUNT(answer));
    }

    fn item_for(
        &self,
        to: (u8, u8),
        seq: u16,
        mission_type: mav::MavMissionType,
    ) -> Result<mav::MISSION_ITEM_INT_DATA, Answer> {
        let index = usize::from(seq);
        let item = match Store::of(mission_type).ok_or(Answer::MAV_MISSION_UNSUPPORTED)? {
            Store::Mission => match self.mission.item(seq) {
                Some(item) => Some(item.clone()),
                None if seq == 0 && !self.mission.items.is_empty() => self.home_item(),
                None => None,
            },
            // As ArduPilot tells it: the frame that came is not kept.
            Store::Fence => self.fence.items.get(index).map(|item| Item {
                command: item.command,
                frame: mav::MavFrame::MAV_FRAME_GLOBAL,
                params: [item.param1, 0.0, 0.0, 0.0],
                x: item.x,
                y: item.y,
                z: 0.0,
            }),
            Store::Rally => self.rally.get(index).map(|point| Item {
                command: mav::MavCmd::MAV_CMD_NAV_RALLY_POINT,
                frame: mav::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT,
                params: [0.0; 4],
                x: point.x,
                y: point.y,
                z: f32::from(point.height_m),
            }),
        };
        let item = item.ok_or(Answer::MAV_MISSION_INVALID_SEQUENCE)?;
        let [param1, param2, param3, param4] = item.params;
        let is_mission = mission_type == mav::MavMissionType::MAV_MISSION_TYPE_MISSION;
        Ok(mav::MISSION_ITEM_INT_DATA {
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
            current: u8::from(is_mission && seq == self.mission.current),
            autocontinue: u8::from(is_mission),
            mission_type,
        })
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

    fn clear_store(&mut self, link: LinkId, from: (u8, u8), mission_type: mav::MavMissionType) {
        let Some(store) = Store::of(mission_type) else {
            return self.acknowledge(link, from, Answer::MAV_MISSION_UNSUPPORTED, mission_type);
        };
        if self.uploads.of(store).is_some() {
            return self.acknowledge(link, from, Answer::MAV_MISSION_ERROR, mission_type);
        }
        self.empty(store);
        self.acknowledge(link, from, Answer::MAV_MISSION_ACCEPTED, mission_type);
    }

    fn empty(&mut self, store: Store) {
        match store {
            Store::Mission => self.mission.clear(),
            Store::Fence => {
                self.store_fence(Vec::new());
            }
            Store::Rally => {
                self.rally.clear();
                self.params.assign(Param::RallyTotal, 0.0);
            }
        }
    }

    fn begin_upload(&mut self, link: LinkId, from: (u8, u8), data: &mav::MISSION_COUNT_DATA) {
        let mission_type = data.mission_type;
        let Some(store) = Store::of(mission_type) else {
            return self.acknowledge(link, from, Answer::MAV_MISSION_UNSUPPORTED, mission_type);
        };
        // Whoever uploads may start over; nobody else may come between.
        if self.uploads.of(store).as_ref().is_some_and(|upload| upload.from != from) {
            return self.acknowledge(link, from, Answer::MAV_MISSION_DENIED, mission_type);
        }
        *self.uploads.of(store) = None;
        if data.count > store.items_max() {
            let text = format!("Only {} items are supported", store.items_max());
            self.text(mav::MavSeverity::MAV_SEVERITY_WARNING, &text);
            return self.acknowledge(link, from, Answer::MAV_MISSION_NO_SPACE, mission_type);
        }
        let upload =
            Upload { link, from, count: data.count, next: 0, asked_at: self.now, heard_at: self.now, fence: Vec::new() };
        match store {
            Store::Mission => self.mission.items.truncate(usize::from(data.count.saturating_sub(1))),
            Store::Rally => self.rally.truncate(usize::from(data.count)),
            Store::Fence => {}
        }
        if data.count == 0 {
            return self.end_upload(store, upload);
        }
        *self.uploads.of(store) = Some(upload);
        self.ask_item(store);
    }

    fn ask_item(&mut self, store: Store) {
        let now = self.now;
        let Some(upload) = self.uploads.of(store) else { return };
        upload.asked_at = now;
        // The float request: what ArduPilot sends, and what every client answers.
        let data = mav::MISSION_REQUEST_DATA {
            seq: upload.next,
            target_system: upload.from.0,
            target_component: upload.from.1,
            mission_type: store.mission_type(),
        };
        let link = upload.link;
        self.reply(link, MavMessage::MISSION_REQUEST(data));
    }

    fn take_item(&mut self, link: LinkId, from: (u8, u8), data: &mav::MISSION_ITEM_INT_DATA) {
        let mission_type = data.mission_type;
        let Some(store) = Store::of(mission_type) else {
            return self.acknowledge(link, from, Answer::MAV_MISSION_UNSUPPORTED, mission_type);
        };
        let Some(mut upload) = self.uploads.of(store).take() else {
            return self.acknowledge(link, from, Answer::MAV_MISSION_ERROR, mission_type);
        };
        let problem = if data.seq != upload.next {
            Some(Answer::MAV_MISSION_INVALID_SEQUENCE)
        } else if from != upload.from {
            Some(Answer::MAV_MISSION_DENIED)
        } else {
            None
        };
        if let Some(problem) = problem {
            // The upload goes on.
            *self.uploads.of(store) = Some(upload);
            return self.acknowledge(link, from, problem, mission_type);
        }
        if let Err(problem) = self.put_item(store, &mut upload, data) {
            return self.acknowledge(link, from, problem, mission_type);
        }
        upload.next += 1;
        upload.heard_at = self.now;
        if upload.next >= upload.count {
            return self.end_upload(store, upload);
        }
        *self.uploads.of(store) = Some(upload);
        self.ask_item(store);
    }

    fn put_item(&mut self, store: Store, upload: &mut Upload, data: &mav::MISSION_ITEM_INT_DATA) -> Result<(), Answer> {
        match store {
            // Item 0 is home, which an upload does not move: it keeps its place in the count, whatever it is.
            Store::Mission if data.seq == 0 => {}
            Store::Mission => put(&mut self.mission.items, usize::from(data.seq - 1), Item::check(data)?),
            Store::Fence => upload.fence.push(FenceItem::check(data)?),
            Store::Rally => put(&mut self.rally, usize::from(data.seq), RallyPoint::check(data)?),
        }
        Ok(())
    }

    fn end_upload(&mut self, store: Store, upload: Upload) {
        let result = match store {
            Store::Mission => {
                self.mission.current = 0;
                self.mission.complete = false;
                self.flight.auto_started = false;
                self.text(mav::MavSeverity::MAV_SEVERITY_INFO, "Flight plan received");
                Answer::MAV_MISSION_ACCEPTED
            }
            Store::Fence if self.store_fence(upload.fence) => Answer::MAV_MISSION_ACCEPTED,
            Store::Fence => Answer::MAV_MISSION_ERROR,
            Store::Rally => {
                self.params.assign(Param::RallyTotal, self.rally.len() as f64);
                self.text(mav::MavSeverity::MAV_SEVERITY_INFO, "Rally points received");
                Answer::MAV_MISSION_ACCEPTED
            }
        };
        self.acknowledge(upload.link, upload.from, result, store.mission_type());
    }

    /// Asks again for what doesn't come, and gives up in the end.
    pub(super) fn pump_uploads(&mut self) {
        for store in Store::ALL {
            let Some(upload) = self.uploads.of(store).as_ref() else { continue };
            let (link, from, heard_at, asked_at) = (upload.link, upload.from, upload.heard_at, upload.asked_at);
            if self.now.seconds_since(heard_at) > GIVE_UP_S {
                *self.uploads.of(store) = None;
                self.text(mav::MavSeverity::MAV_SEVERITY_WARNING, &format!("{} upload timeout", store.name()));
                self.acknowledge(link, from, Answer::MAV_MISSION_OPERATION_CANCELLED, store.mission_type());
            } else if self.now.seconds_since(asked_at) > ASK_AGAIN_S {
                self.ask_item(store);
            }
        }
    }

    /// A single item with `current` 2: how old ground stations say "fly there".
    fn fly_to_item(&mut self, link: LinkId, from: (u8, u8), data: &mav::MISSION_ITEM_DATA) {
        let item = as_integers(data);
        let place = self.place(item.frame, item.x, item.y, f64::from(item.z)).filter(|place| self.fence_allows(*place));
        let result = match place {
            Some(ned_m) if self.mode == Mode::Guided && self.armed && !self.landed => {
                self.guided = Guided::Position { ned_m };
                Answer::MAV_MISSION_ACCEPTED
            }
            _ => Answer::MAV_MISSION_ERROR,
        };
        self.acknowledge(link, from, result, data.mission_type);
    }
}

/// Replaces the item at `index`, or adds it at the end.
fn put<T>(items: &mut Vec<T>, index: usize, item: T) {
    match items.get_mut(index) {
        Some(place) => *place = item,
        None => items.push(item),
    }
}
