//! A scripted autopilot behind a bad link, after <https://mavlink.io/en/services/mission.html> and `…/parameter.html`: it shares no
//! code with what it tests. The link loses, repeats, delays and so reorders messages, by a seed.

use std::collections::VecDeque;

use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{
    MavAutopilot, MavMessage, MavMissionResult as Answer, MavMissionType, MavParamError, MavParamType,
};

/// SplitMix64.
#[derive(Debug, Clone)]
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// One direction of a link.
#[derive(Debug)]
pub(crate) struct Wire {
    pub(crate) loss: f64,
    pub(crate) repeats: f64,
    pub(crate) delay_s_max: f64,
    on_the_way: Vec<(f64, MavMessage)>,
}

impl Wire {
    pub(crate) fn new(loss: f64, repeats: f64, delay_s_max: f64) -> Self {
        Self { loss, repeats, delay_s_max, on_the_way: Vec::new() }
    }

    pub(crate) fn send(&mut self, message: &MavMessage, now_s: f64, dice: &mut Dice) {
        let copies = if dice.roll() < self.repeats { 2 } else { 1 };
        for _ in 0..copies {
            if dice.roll() >= self.loss {
                self.on_the_way.push((now_s + dice.roll() * self.delay_s_max, message.clone()));
            }
        }
    }

    pub(crate) fn arrived(&mut self, now_s: f64) -> Vec<MavMessage> {
        let (mut here, later): (Vec<_>, Vec<_>) = self.on_the_way.drain(..).partition(|(at, _)| *at <= now_s);
        self.on_the_way = later;
        here.sort_by(|a, b| a.0.total_cmp(&b.0));
        here.into_iter().map(|(_, message)| message).collect()
    }
}

#[derive(Debug)]
struct Upload {
    list: usize,
    count: u16,
    items: Vec<ardu::MISSION_ITEM_INT_DATA>,
    asked_s: f64,
    heard_s: f64,
}

/// The autopilot.
#[derive(Debug)]
pub(crate) struct Script {
    pub(crate) kind: MavAutopilot,
    /// By MAVLink's number of the list; item 0 of a mission included.
    pub(crate) lists: [Vec<ardu::MISSION_ITEM_INT_DATA>; 3],
    pub(crate) parameters: Vec<(String, f32, MavParamType)>,
    /// It says that it knows no such parameter, as newer ones do.
    pub(crate) says_errors: bool,
    /// A parameter that keeps its value.
    pub(crate) stuck: Option<usize>,
    /// A parameter that may not be set, which it says.
    pub(crate) denies: Option<usize>,
    /// It denies the same to another client, at the same time.
    pub(crate) denies_another: bool,
    /// Refuses items of this command.
    pub(crate) refuses: Option<u32>,
    /// How often it was told to stop.
    pub(crate) cancelled: usize,
    /// What it was sent.
    pub(crate) heard: Vec<MavMessage>,
    upload: Option<Upload>,
    streaming: Option<usize>,
    out: VecDeque<MavMessage>,
}

const OWN: (u8, u8) = (7, 191);

fn list(kind: MavMissionType) -> usize {
    kind as usize
}

fn kind_of(list: usize) -> MavMissionType {
    [MavMissionType::MAV_MISSION_TYPE_MISSION, MavMissionType::MAV_MISSION_TYPE_FENCE, MavMissionType::MAV_MISSION_TYPE_RALLY]
        [list]
}

impl Script {
    pub(crate) fn new(kind: MavAutopilot) -> Self {
        Self {
            kind,
            lists: Default::default(),
            parameters: Vec::new(),
            says_errors: false,
            stuck: None,
            denies: None,
            denies_another: false,
            refuses: None,
            cancelled: 0,
            heard: Vec::new(),
            upload: None,
            streaming: None,
            out: VecDeque::new(),
        }
    }

    /// As ArduPilot since 4.7 does, before it tells the value that stays.
    fn deny(&mut self, data: &ardu::PARAM_SET_DATA, (target_system, target_component): (u8, u8)) {
        self.out.push_back(MavMessage::PARAM_ERROR(ardu::PARAM_ERROR_DATA {
            param_index: -1,
            target_system,
            target_component,
            param_id: data.param_id,
            error: MavParamError::MAV_PARAM_ERROR_PERMISSION_DENIED,
        }));
    }

    fn is_ardupilot(&self) -> bool {
        self.kind == MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA
    }

    fn ack(&mut self, mavtype: Answer, list: usize) {
        self.out.push_back(MavMessage::MISSION_ACK(ardu::MISSION_ACK_DATA {
            target_system: OWN.0,
            target_component: OWN.1,
            mavtype,
            mission_type: kind_of(list),
            opaque_id: 0,
        }));
    }

    fn ask(&mut self, now_s: f64) {
        let Some(upload) = &mut self.upload else { return };
        upload.asked_s = now_s;
        let (seq, mission_type) = (upload.items.len() as u16, kind_of(upload.list));
        let (target_system, target_component) = OWN;
        self.out.push_back(if self.is_ardupilot() {
            MavMessage::MISSION_REQUEST(ardu::MISSION_REQUEST_DATA { seq, target_system, target_component, mission_type })
        } else {
            MavMessage::MISSION_REQUEST_INT(ardu::MISSION_REQUEST_INT_DATA {
                seq,
                target_system,
                target_component,
                mission_type,
            })
        });
    }

    fn tell(&mut self, index: usize, told: u16) {
        let Some((name, value, kind)) = self.parameters.get(index).cloned() else { return };
        self.out.push_back(MavMessage::PARAM_VALUE(ardu::PARAM_VALUE_DATA {
            param_value: value,
            param_count: self.parameters.len() as u16,
            param_index: told,
            param_id: name.as_str().into(),
            param_type: kind,
        }));
    }

    fn find(&self, name: &str) -> Option<usize> {
        self.parameters.iter().position(|row| row.0 == name)
    }

    pub(crate) fn take(&mut self, message: &MavMessage, now_s: f64) {
        self.heard.push(message.clone());
        match message {
            MavMessage::PARAM_REQUEST_LIST(_) => self.streaming = Some(0),
            MavMessage::PARAM_REQUEST_READ(data) if data.param_index >= 0 => {
                self.tell(data.param_index as usize, data.param_index as u16);
            }
            MavMessage::PARAM_REQUEST_READ(data) => {
                let name = data.param_id.to_str().unwrap().to_owned();
                match self.find(&name) {
                    Some(index) => self.tell(index, u16::MAX),
                    None if self.says_errors => {
                        self.out.push_back(MavMessage::PARAM_ERROR(ardu::PARAM_ERROR_DATA {
                            param_index: -1,
                            target_system: OWN.0,
                            target_component: OWN.1,
                            param_id: data.param_id,
                            error: MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST,
                        }));
                    }
                    None => {}
                }
            }
            MavMessage::PARAM_SET(data) => {
                if self.denies_another {
                    self.deny(data, (255, 190));
                }
                if self.denies.is_some_and(|index| self.find(data.param_id.to_str().unwrap()) == Some(index)) {
                    self.deny(data, OWN);
                } else if let Some(index) = self.find(data.param_id.to_str().unwrap()) {
                    if self.stuck != Some(index) {
                        self.parameters[index].1 = data.param_value;
                    }
                    // One of a vector brings its neighbours.
                    for near in [index.saturating_sub(1), index, index + 1] {
                        self.tell(near, u16::MAX);
                    }
                }
            }
            MavMessage::MISSION_COUNT(data) => {
                let list = list(data.mission_type);
                if data.count == 0 {
                    self.lists[list].clear();
                    return self.ack(Answer::MAV_MISSION_ACCEPTED, list);
                }
                self.upload = Some(Upload { list, count: data.count, items: Vec::new(), asked_s: now_s, heard_s: now_s });
                self.ask(now_s);
            }
            MavMessage::MISSION_ITEM_INT(data) => self.take_item(data, now_s),
            MavMessage::MISSION_REQUEST_LIST(data) => {
                let count = self.lists[list(data.mission_type)].len() as u16;
                self.out.push_back(MavMessage::MISSION_COUNT(ardu::MISSION_COUNT_DATA {
                    count,
                    target_system: OWN.0,
                    target_component: OWN.1,
                    mission_type: data.mission_type,
                    opaque_id: 0,
                }));
            }
            MavMessage::MISSION_REQUEST_INT(data) => match self.lists[list(data.mission_type)].get(usize::from(data.seq)) {
                Some(item) => self.out.push_back(MavMessage::MISSION_ITEM_INT(ardu::MISSION_ITEM_INT_DATA {
                    seq: data.seq,
                    target_system: OWN.0,
                    target_component: OWN.1,
                    ..item.clone()
                })),
                None => self.ack(Answer::MAV_MISSION_INVALID_SEQUENCE, list(data.mission_type)),
            },
            MavMessage::MISSION_CLEAR_ALL(data) => {
                self.lists[list(data.mission_type)].clear();
                self.ack(Answer::MAV_MISSION_ACCEPTED, list(data.mission_type));
            }
            MavMessage::MISSION_ACK(data) if data.mavtype == Answer::MAV_MISSION_OPERATION_CANCELLED => {
                self.cancelled += 1;
                self.upload = None;
            }
            _ => {}
        }
    }

    fn take_item(&mut self, data: &ardu::MISSION_ITEM_INT_DATA, now_s: f64) {
        let ardupilot = self.is_ardupilot();
        let Some(upload) = self.upload.as_mut().filter(|upload| upload.list == list(data.mission_type)) else {
            return self.ack(Answer::MAV_MISSION_ERROR, list(data.mission_type));
        };
        let list = upload.list;
        if usize::from(data.seq) != upload.items.len() {
            // ArduPilot complains and goes on waiting; others just ask again.
            return if ardupilot { self.ack(Answer::MAV_MISSION_INVALID_SEQUENCE, list) } else { self.ask(now_s) };
        }
        if self.refuses == Some(data.command as u32) {
            self.upload = None;
            return self.ack(Answer::MAV_MISSION_UNSUPPORTED, list);
        }
        upload.items.push(data.clone());
        upload.heard_s = now_s;
        if upload.items.len() < usize::from(upload.count) {
            return self.ask(now_s);
        }
        self.lists[list] = std::mem::take(&mut upload.items);
        self.upload = None;
        self.ack(Answer::MAV_MISSION_ACCEPTED, list);
    }

    /// What it does by itself: asks again after a second, gives up after eight; streams its parameters.
    pub(crate) fn step(&mut self, now_s: f64) {
        if let Some(upload) = &self.upload {
            if now_s - upload.heard_s > 8.0 {
                self.upload = None;
            } else if now_s - upload.asked_s > 1.0 {
                self.ask(now_s);
            }
        }
        for _ in 0..10 {
            let Some(index) = self.streaming else { break };
            self.tell(index, index as u16);
            self.streaming = (index + 1 < self.parameters.len()).then_some(index + 1);
        }
    }

    pub(crate) fn answers(&mut self) -> Vec<MavMessage> {
        self.out.drain(..).collect()
    }
}
