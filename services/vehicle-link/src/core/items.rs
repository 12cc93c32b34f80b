//! The mission protocol, for missions, fences and rally points alike (<https://mavlink.io/en/services/mission.html>): upload,
//! download, clear.
//!
//! On upload the autopilot asks and we answer, so what is lost is asked for again by itself. If it falls silent, it has lost our
//! last answer and given up, or we its acknowledgement: the upload begins anew, which leaves the same list whatever happened. A
//! wrong sequence is the autopilot's answer to a repeated item, and no end; that it knows of no upload means to begin anew.
#![allow(deprecated, reason = "ArduPilot still asks by the old messages")]

use halcyon_model::transfer::ITEMS_MAX;
use halcyon_model::{Content, Item, ItemFrame, ItemKind, Stamp};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavCmd, MavFrame, MavMessage, MavMissionResult as Answer, MavMissionType};
use num_traits::FromPrimitive as _;

use super::encode::Address;
use super::transfers::{Ending, Retry, TransferError, Transferred};

/// An answer is awaited for so long, seconds.
const RETRY_S: f64 = 1.0;
/// And an item of a download, seconds.
const ITEM_S: f64 = 0.8;
/// Asked at most so many times.
const TRIES: u8 = 5;
/// For one item of a download.
const ITEM_TRIES: u8 = 8;
/// The autopilot asks again after about a second; silent for longer, it has given up, seconds.
const SILENT_S: f64 = 2.5;
/// Uploads begun.
const BEGINNINGS: u8 = 4;

fn wire_kind(kind: ItemKind) -> MavMissionType {
    match kind {
        ItemKind::Mission => MavMissionType::MAV_MISSION_TYPE_MISSION,
        ItemKind::Fence => MavMissionType::MAV_MISSION_TYPE_FENCE,
        ItemKind::Rally => MavMissionType::MAV_MISSION_TYPE_RALLY,
    }
}

fn words(answer: Answer) -> &'static str {
    match answer {
        Answer::MAV_MISSION_ACCEPTED => "accepted",
        Answer::MAV_MISSION_ERROR => "it did not expect this",
        Answer::MAV_MISSION_UNSUPPORTED_FRAME => "frame not supported",
        Answer::MAV_MISSION_UNSUPPORTED => "command not supported",
        Answer::MAV_MISSION_NO_SPACE => "no space",
        Answer::MAV_MISSION_INVALID => "invalid",
        Answer::MAV_MISSION_INVALID_PARAM1 => "parameter 1 is invalid",
        Answer::MAV_MISSION_INVALID_PARAM2 => "parameter 2 is invalid",
        Answer::MAV_MISSION_INVALID_PARAM3 => "parameter 3 is invalid",
        Answer::MAV_MISSION_INVALID_PARAM4 => "parameter 4 is invalid",
        Answer::MAV_MISSION_INVALID_PARAM5_X => "latitude (parameter 5) is invalid",
        Answer::MAV_MISSION_INVALID_PARAM6_Y => "longitude (parameter 6) is invalid",
        Answer::MAV_MISSION_INVALID_PARAM7 => "altitude (parameter 7) is invalid",
        Answer::MAV_MISSION_INVALID_SEQUENCE => "items out of sequence",
        Answer::MAV_MISSION_DENIED => "denied; another transfer may be under way",
        Answer::MAV_MISSION_OPERATION_CANCELLED => "cancelled by the autopilot",
    }
}

fn ack(kind: ItemKind, mavtype: Answer, to: Address) -> MavMessage {
    MavMessage::MISSION_ACK(ardu::MISSION_ACK_DATA {
        target_system: to.system(),
        target_component: to.component(),
        mavtype,
        mission_type: wire_kind(kind),
        opaque_id: 0,
    })
}

/// Degrees as MAVLink's 10⁻⁷ degrees, or, without a place, a parameter as it is.
fn coordinate(value: Option<f64>, frame: ItemFrame) -> i32 {
    let scale = if frame == ItemFrame::None { 1.0 } else { 1e7 };
    // `as` saturates; the greatest number says "not given".
    value.map_or(i32::MAX, |value| (value * scale).round() as i32)
}

fn coordinate_back(value: i32, frame: ItemFrame) -> Option<f64> {
    let scale = if frame == ItemFrame::None { 1.0 } else { 1e7 };
    (value != i32::MAX).then(|| f64::from(value) / scale)
}

fn wire(item: &Item, seq: u16, kind: ItemKind) -> Result<ardu::MISSION_ITEM_INT_DATA, TransferError> {
    let number = |value: Option<f64>| value.map_or(f32::NAN, |value| value as f32);
    let command = MavCmd::from_u16(item.command)
        .ok_or_else(|| TransferError::Unreadable(format!("command {} is not one of MAVLink's", item.command)))?;
    let frame = match item.frame {
        ItemFrame::SeaLevel => MavFrame::MAV_FRAME_GLOBAL,
        ItemFrame::Home => MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT,
        ItemFrame::Terrain => MavFrame::MAV_FRAME_GLOBAL_TERRAIN_ALT,
        ItemFrame::None => MavFrame::MAV_FRAME_MISSION,
    };
    let [param1, param2, param3, param4] = item.parameters.map(number);
    Ok(ardu::MISSION_ITEM_INT_DATA {
        param1,
        param2,
        param3,
        param4,
        x: coordinate(item.latitude_deg, item.frame),
        y: coordinate(item.longitude_deg, item.frame),
        z: number(item.altitude_m),
        seq,
        command,
        target_system: 0,
        target_component: 0,
        frame,
        current: u8::from(seq == 0),
        autocontinue: item.autocontinue.into(),
        mission_type: wire_kind(kind),
    })
}

fn item(data: &ardu::MISSION_ITEM_INT_DATA) -> Result<Item, TransferError> {
    let number = |value: f32| value.is_finite().then(|| f64::from(value));
    let frame = ItemFrame::from_number(data.frame as u8)
        .ok_or_else(|| TransferError::Unreadable(format!("item {} is in a frame that is not supported", data.seq)))?;
    let command = u16::try_from(data.command as u32)
        .map_err(|_| TransferError::Unreadable(format!("item {} has no known command", data.seq)))?;
    Ok(Item {
        command,
        frame,
        parameters: [data.param1, data.param2, data.param3, data.param4].map(number),
        latitude_deg: coordinate_back(data.x, frame),
        longitude_deg: coordinate_back(data.y, frame),
        altitude_m: number(data.z),
        autocontinue: data.autocontinue != 0,
    })
}

/// The old item, whose places are floats, as the new one.
fn as_int(data: &ardu::MISSION_ITEM_DATA) -> ardu::MISSION_ITEM_INT_DATA {
    let frame = ItemFrame::from_number(data.frame as u8).unwrap_or(ItemFrame::None);
    let place = |value: f32| coordinate(value.is_finite().then(|| f64::from(value)), frame);
    ardu::MISSION_ITEM_INT_DATA {
        param1: data.param1,
        param2: data.param2,
        param3: data.param3,
        param4: data.param4,
        x: place(data.x),
        y: place(data.y),
        z: data.z,
        seq: data.seq,
        command: data.command,
        target_system: data.target_system,
        target_component: data.target_component,
        frame: data.frame,
        current: data.current,
        autocontinue: data.autocontinue,
        mission_type: data.mission_type,
    }
}

/// Replaces a list.
#[derive(Debug, Clone)]
pub(super) struct Upload {
    kind: ItemKind,
    /// As they go on the wire, home included where the autopilot wants it.
    items: Vec<ardu::MISSION_ITEM_INT_DATA>,
    home: bool,
    retry: Retry,
    beginnings: u8,
    /// It has asked for an item since the last beginning.
    asked: bool,
    /// The item that it waits for.
    wanted: Option<u16>,
    /// The furthest item sent since the last beginning: a late repetition of a request takes nothing back.
    sent: Option<u16>,
    begin_anew: bool,
    /// What it said that may be why it is silent.
    complaint: Option<Answer>,
    ended: Option<Result<(), Answer>>,
}

impl Upload {
    pub(super) fn new(kind: ItemKind, items: &[Item], home: bool) -> Result<Self, TransferError> {
        if items.len() > ITEMS_MAX {
            return Err(TransferError::Unreadable(format!("{} items; at most {ITEMS_MAX}", items.len())));
        }
        if let Some((at, problem)) =
            items.iter().enumerate().find_map(|(at, item)| item.problem(kind).map(|problem| (at, problem)))
        {
            return Err(TransferError::Unreadable(format!("item {}: {problem}", at + 1)));
        }
        // ArduPilot puts its own home into this item, whatever it says.
        let place = Item {
            command: 16,
            frame: ItemFrame::SeaLevel,
            parameters: [Some(0.0); 4],
            latitude_deg: Some(0.0),
            longitude_deg: Some(0.0),
            altitude_m: Some(0.0),
            autocontinue: true,
        };
        let all = home.then_some(&place).into_iter().chain(items);
        let items: Result<Vec<_>, _> = all.zip(0..).map(|(item, seq)| wire(item, seq, kind)).collect();
        Ok(Self {
            kind,
            items: items?,
            home,
            retry: Retry::default(),
            beginnings: 0,
            asked: false,
            wanted: None,
            sent: None,
            begin_anew: true,
            complaint: None,
            ended: None,
        })
    }

    fn count(&self) -> u16 {
        u16::try_from(self.items.len()).unwrap_or(u16::MAX)
    }

    fn all_sent(&self) -> bool {
        self.sent.is_some_and(|sent| sent + 1 == self.count())
    }

    pub(super) fn progress(&self) -> (usize, usize) {
        (self.sent.map_or(0, |sent| usize::from(sent) + 1), self.items.len())
    }

    pub(super) fn farewell(&self, to: Address) -> MavMessage {
        ack(self.kind, Answer::MAV_MISSION_OPERATION_CANCELLED, to)
    }

    pub(super) fn observe(&mut self, message: &MavMessage, now: Stamp) {
        let ours = wire_kind(self.kind);
        match message {
            // Both are answered alike, as the old one's own definition has it.
            MavMessage::MISSION_REQUEST_INT(data) if data.mission_type == ours => self.observe_request(data.seq, now),
            MavMessage::MISSION_REQUEST(data) if data.mission_type == ours => self.observe_request(data.seq, now),
            MavMessage::MISSION_ACK(data) if data.mission_type == ours => match data.mavtype {
                // One from before the last item was sent is an old one.
                Answer::MAV_MISSION_ACCEPTED => {
                    if self.all_sent() {
                        self.ended = Some(Ok(()));
                    }
                }
                Answer::MAV_MISSION_INVALID_SEQUENCE => self.complaint = Some(data.mavtype),
                Answer::MAV_MISSION_ERROR => {
                    self.complaint = Some(data.mavtype);
                    self.begin_anew |= self.asked;
                }
                refused => self.ended = Some(Err(refused)),
            },
            _ => {}
        }
    }

    fn observe_request(&mut self, seq: u16, now: Stamp) {
        if seq < self.count() {
            self.asked = true;
            self.wanted = Some(seq);
            // It is at work: silence counts from here.
            self.retry = Retry::default();
            self.retry.sent(now, SILENT_S);
        }
    }

    pub(super) fn poll(&mut self, to: Address, now: Stamp, out: &mut Vec<MavMessage>) -> Option<Ending> {
        if let Some(ended) = self.ended.take() {
            return Some(match ended {
                Ok(()) => {
                    let count = self.items.len() - usize::from(self.home);
                    Ok(Transferred { what: format!("{count} items uploaded"), content: None })
                }
                Err(answer) => Err(self.refused(answer)),
            });
        }
        if let Some(item) = self.wanted.take().and_then(|seq| self.items.get(usize::from(seq))) {
            self.sent = self.sent.max(Some(item.seq));
            out.push(MavMessage::MISSION_ITEM_INT(ardu::MISSION_ITEM_INT_DATA {
                target_system: to.system(),
                target_component: to.component(),
                ..item.clone()
            }));
            return None;
        }
        if !self.retry.is_due(now) && !self.begin_anew {
            return None;
        }
        if self.asked || self.begin_anew {
            if self.beginnings >= BEGINNINGS {
                return Some(Err(self.gave_up()));
            }
            self.beginnings += 1;
            self.begin_anew = false;
            self.asked = false;
            self.sent = None;
            self.retry = Retry::default();
        }
        if self.retry.tries >= TRIES {
            return Some(Err(self.gave_up()));
        }
        out.push(MavMessage::MISSION_COUNT(ardu::MISSION_COUNT_DATA {
            count: self.count(),
            target_system: to.system(),
            target_component: to.component(),
            mission_type: wire_kind(self.kind),
            opaque_id: 0,
        }));
        self.retry.sent(now, RETRY_S);
        None
    }

    fn gave_up(&self) -> TransferError {
        match self.complaint {
            Some(answer) => self.refused(answer),
            None => TransferError::TimedOut { tries: self.retry.tries.max(self.beginnings), progress: Some(self.progress()) },
        }
    }

    fn refused(&self, answer: Answer) -> TransferError {
        // With home in front, the number on the wire is the item's own.
        let item = self.sent.map(|sent| usize::from(sent) + usize::from(!self.home)).filter(|item| *item > 0);
        TransferError::ItemsRefused { list: self.kind.name(), why: words(answer), item }
    }
}

/// Reads a list.
#[derive(Debug, Clone)]
pub(super) struct Download {
    kind: ItemKind,
    home: bool,
    retry: Retry,
    count: Option<u16>,
    /// Items that came; the next to ask for has this number.
    got: u16,
    items: Vec<Item>,
    failed: Option<TransferError>,
}

impl Download {
    pub(super) fn new(kind: ItemKind, home: bool) -> Self {
        Self { kind, home, retry: Retry::default(), count: None, got: 0, items: Vec::new(), failed: None }
    }

    pub(super) fn progress(&self) -> Option<(usize, usize)> {
        self.count.map(|count| (self.got.into(), count.into()))
    }

    pub(super) fn farewell(&self, to: Address) -> MavMessage {
        ack(self.kind, Answer::MAV_MISSION_OPERATION_CANCELLED, to)
    }

    pub(super) fn observe(&mut self, message: &MavMessage) {
        let ours = wire_kind(self.kind);
        match message {
            MavMessage::MISSION_COUNT(data) if data.mission_type == ours && self.count.is_none() => {
                if usize::from(data.count) > ITEMS_MAX + usize::from(self.home) {
                    let problem = format!("{} items; at most {ITEMS_MAX} can be read", data.count);
                    self.failed = Some(TransferError::Unreadable(problem));
                }
                self.count = Some(data.count);
                // Home is not asked for.
                self.got = u16::from(self.home).min(data.count);
                self.retry = Retry::default();
            }
            MavMessage::MISSION_ITEM_INT(data) if data.mission_type == ours => self.take(data),
            MavMessage::MISSION_ITEM(data) if data.mission_type == ours => self.take(&as_int(data)),
            MavMessage::MISSION_ACK(data) if data.mission_type == ours && data.mavtype != Answer::MAV_MISSION_ACCEPTED => {
                let (list, why) = (self.kind.name(), words(data.mavtype));
                self.failed = Some(TransferError::ItemsRefused { list, why, item: None });
            }
            _ => {}
        }
    }

    /// Repetitions, and what comes out of turn, are asked for again in their turn.
    fn take(&mut self, data: &ardu::MISSION_ITEM_INT_DATA) {
        if self.count.is_none_or(|count| data.seq >= count) || data.seq != self.got {
            return;
        }
        match item(data) {
            Ok(item) => self.items.push(item),
            Err(error) => self.failed = Some(error),
        }
        self.got += 1;
        self.retry = Retry::default();
    }

    pub(super) fn poll(&mut self, to: Address, now: Stamp, out: &mut Vec<MavMessage>) -> Option<Ending> {
        if let Some(error) = self.failed.take() {
            out.push(self.farewell(to));
            return Some(Err(error));
        }
        if self.count.is_some_and(|count| self.got >= count) {
            out.push(ack(self.kind, Answer::MAV_MISSION_ACCEPTED, to));
            let items = std::mem::take(&mut self.items);
            return Some(Ok(Transferred { what: format!("{} items read", items.len()), content: Some(Content::Items(items)) }));
        }
        if !self.retry.is_due(now) {
            return None;
        }
        let tries = if self.count.is_some() { ITEM_TRIES } else { TRIES };
        if self.retry.tries >= tries {
            return Some(Err(TransferError::TimedOut { tries, progress: self.progress() }));
        }
        let (target_system, target_component, mission_type) = (to.system(), to.component(), wire_kind(self.kind));
        let seq = self.got;
        match self.count {
            None => {
                let list = ardu::MISSION_REQUEST_LIST_DATA { target_system, target_component, mission_type };
                out.push(MavMessage::MISSION_REQUEST_LIST(list));
                self.retry.sent(now, RETRY_S);
            }
            // Old firmware knows the old request alone.
            Some(_) if self.retry.tries % 2 == 1 && self.retry.tries > 2 => {
                let old = ardu::MISSION_REQUEST_DATA { seq, target_system, target_component, mission_type };
                out.push(MavMessage::MISSION_REQUEST(old));
                self.retry.sent(now, ITEM_S);
            }
            Some(_) => {
                let next = ardu::MISSION_REQUEST_INT_DATA { seq, target_system, target_component, mission_type };
                out.push(MavMessage::MISSION_REQUEST_INT(next));
                self.retry.sent(now, ITEM_S);
            }
        }
        None
    }
}

/// Empties a list.
#[derive(Debug, Clone)]
pub(super) struct Clear {
    kind: ItemKind,
    retry: Retry,
    answer: Option<Answer>,
}

impl Clear {
    pub(super) fn new(kind: ItemKind) -> Self {
        Self { kind, retry: Retry::default(), answer: None }
    }

    pub(super) fn observe(&mut self, message: &MavMessage) {
        if let MavMessage::MISSION_ACK(data) = message
            && data.mission_type == wire_kind(self.kind)
        {
            self.answer = Some(data.mavtype);
        }
    }

    pub(super) fn poll(&mut self, to: Address, now: Stamp, out: &mut Vec<MavMessage>) -> Option<Ending> {
        let list = self.kind.name();
        match self.answer.take() {
            Some(Answer::MAV_MISSION_ACCEPTED) => {
                return Some(Ok(Transferred { what: format!("{list} cleared"), content: None }));
            }
            Some(refused) => return Some(Err(TransferError::ItemsRefused { list, why: words(refused), item: None })),
            None if !self.retry.is_due(now) => return None,
            None if self.retry.tries >= TRIES => {
                return Some(Err(TransferError::TimedOut { tries: TRIES, progress: None }));
            }
            None => {}
        }
        out.push(MavMessage::MISSION_CLEAR_ALL(ardu::MISSION_CLEAR_ALL_DATA {
            target_system: to.system(),
            target_component: to.component(),
            mission_type: wire_kind(self.kind),
        }));
        self.retry.sent(now, RETRY_S);
        None
    }
}
