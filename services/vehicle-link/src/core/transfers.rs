//! What is read from the autopilot and written to it as a whole: parameters ([`super::parameters`]) and lists of items
//! ([`super::items`]). One transfer at a time; others wait in a short line. Each ends: with what was read, with a reason, or at
//! its deadline.
//!
//! | autopilot | parameters on the wire | item 0 of a mission |
//! |---|---|---|
//! | ArduPilot | every value cast to a float | home, which it keeps itself: added on upload, left out on download |
//! | PX4 | the value's own bytes in the float's place | the first item |
//! | others | as their capabilities say; cast, if they don't | the first item |
#![allow(deprecated, reason = "ArduPilot still asks by the old messages")]

use std::collections::VecDeque;

use halcyon_model::{Content, Item, ItemKind, ParameterName, Stamp};
use mavlink::dialects::ardupilotmega::{MavAutopilot, MavMessage, MavProtocolCapability as Can};

use super::commands::{Effect, Ticket};
use super::encode::Address;
use super::items::{Clear, Download, Upload};
use super::parameters::{Encoding, ReadAll, ReadOne, SetOne};
use super::renames;
use super::unlisted::Unlisted;

/// Transfers that wait; more are refused.
const WAITING_MAX: usize = 16;
/// However late the deadline is, seconds.
const TRANSFER_S_MAX: f64 = 600.0;

/// What can be asked of the autopilot here.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// Read one parameter.
    Read(ParameterName),
    /// Read all of them.
    ReadAll,
    /// Write one.
    Set(ParameterName, f64),
    /// Read a list of items.
    Download(ItemKind),
    /// Replace a list; an empty one clears it.
    Upload(ItemKind, Vec<Item>),
    /// Empty a list.
    Clear(ItemKind),
}

impl Request {
    /// In words.
    #[must_use]
    pub fn describe(&self) -> String {
        match self {
            Self::Read(name) => format!("reading {name}"),
            Self::ReadAll => "reading all parameters".into(),
            Self::Set(name, value) => format!("setting {name} to {value}"),
            Self::Download(kind) => format!("{} download", kind.name()),
            Self::Upload(kind, _) => format!("{} upload", kind.name()),
            Self::Clear(kind) => format!("clearing the {}", kind.name()),
        }
    }
}

/// Why the autopilot refused a parameter.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum ParameterRefusal {
    /// MAVLink's error, in words.
    #[error("{0}")]
    Listed(&'static str),
    /// A number that MAVLink's errors do not have here.
    #[error("error {0}, which is not known here")]
    Unlisted(u8),
}

/// How a transfer failed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TransferError {
    /// It answers for others, not for this one.
    #[error("the autopilot knows no parameter {name}{hint}", name = .0, hint = renames::hint(.0))]
    NoSuchParameter(ParameterName),
    /// It said why not.
    #[error("the autopilot refused {name}: {why}")]
    ParameterRefused {
        /// Which.
        name: ParameterName,
        /// Its error.
        why: ParameterRefusal,
    },
    /// The parameter cannot hold the value; nothing was sent.
    #[error("{0}")]
    WrongValue(String),
    /// It was told, and kept another value.
    #[error("{name} stays at {value}")]
    StaysAt {
        /// Which.
        name: ParameterName,
        /// What the autopilot says.
        value: f64,
    },
    /// It refused a list of items.
    #[error("the autopilot refused the {list}: {why}{}", .item.map(|item| format!(" (item {item})")).unwrap_or_default())]
    ItemsRefused {
        /// Which list.
        list: &'static str,
        /// Its result, in words.
        why: &'static str,
        /// The item that was sent last, the first being 1.
        item: Option<usize>,
    },
    /// What it sent, or what it would be sent, has no form on this side.
    #[error("{0}")]
    Unreadable(String),
    /// It fell silent.
    #[error("the autopilot did not answer {tries} tries{}", .progress.map(|(done, total)| format!(", {done} of {total} done")).unwrap_or_default())]
    TimedOut {
        /// How often it was asked.
        tries: u8,
        /// How far it went.
        progress: Option<(usize, usize)>,
    },
    /// The time allowed was over.
    #[error("not done in time{}", .progress.map(|(done, total)| format!(", {done} of {total} done")).unwrap_or_default())]
    Late {
        /// How far it went.
        progress: Option<(usize, usize)>,
    },
    /// Somebody ended it.
    #[error("cancelled")]
    Cancelled,
    /// Too many wait.
    #[error("{WAITING_MAX} transfers are under way already")]
    Busy,
    /// There is nobody to ask.
    #[error("the autopilot is not heard")]
    NotHeard,
    /// The link went down before the end.
    #[error("the link to the autopilot was lost before it was done")]
    LinkLost,
}

/// A transfer that was done.
#[derive(Debug, Clone, PartialEq)]
pub struct Transferred {
    /// In words.
    pub what: String,
    /// What was read.
    pub content: Option<Content>,
}

/// How a transfer ended.
pub type Ending = Result<Transferred, TransferError>;

/// What an autopilot's ways are.
#[derive(Debug, Clone, Copy, Default)]
struct Ways {
    autopilot: Option<MavAutopilot>,
    capabilities: Option<Can>,
}

impl Ways {
    fn observe(&mut self, message: &MavMessage) {
        match message {
            MavMessage::HEARTBEAT(data) => self.autopilot = Some(data.autopilot),
            MavMessage::AUTOPILOT_VERSION(data) => self.capabilities = Some(data.capabilities),
            _ => {}
        }
    }

    fn encoding(self) -> Encoding {
        let says = |bit: Can| self.capabilities.is_some_and(|can| can.contains(bit));
        if says(Can::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE) {
            Encoding::Bytewise
        } else if says(Can::MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST) {
            Encoding::Cast
        } else if self.autopilot == Some(MavAutopilot::MAV_AUTOPILOT_PX4) {
            Encoding::Bytewise
        } else {
            Encoding::Cast
        }
    }

    fn home_is_item_0(self, kind: ItemKind) -> bool {
        kind == ItemKind::Mission && self.autopilot == Some(MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA)
    }
}

/// Counts tries, and tells when the next is due.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Retry {
    pub(super) tries: u8,
    due: Option<Stamp>,
}

impl Retry {
    /// Nothing was sent yet, or the wait is over.
    pub(super) fn is_due(&self, now: Stamp) -> bool {
        self.due.is_none_or(|due| now >= due)
    }

    /// A try was sent.
    pub(super) fn sent(&mut self, now: Stamp, wait_s: f64) {
        self.tries = self.tries.saturating_add(1);
        self.due = Some(now.plus_secs_f64(wait_s));
    }
}

/// One transfer under way.
#[derive(Debug, Clone)]
enum Job {
    Read(ReadOne),
    ReadAll(ReadAll),
    Set(SetOne),
    Download(Download),
    Upload(Upload),
    Clear(Clear),
}

impl Job {
    fn new(request: &Request, ways: Ways) -> Result<Self, TransferError> {
        Ok(match request {
            Request::Read(name) => Self::Read(ReadOne::new(name.clone(), ways.encoding())),
            Request::ReadAll => Self::ReadAll(ReadAll::new(ways.encoding())),
            Request::Set(name, value) => Self::Set(SetOne::new(name.clone(), *value, ways.encoding())),
            Request::Download(kind) => Self::Download(Download::new(*kind, ways.home_is_item_0(*kind))),
            Request::Upload(kind, items) if !items.is_empty() => {
                Self::Upload(Upload::new(*kind, items, ways.home_is_item_0(*kind))?)
            }
            Request::Upload(kind, _) | Request::Clear(kind) => Self::Clear(Clear::new(*kind)),
        })
    }

    fn observe(&mut self, message: &MavMessage, now: Stamp) {
        match self {
            Self::Read(job) => job.observe(message),
            Self::ReadAll(job) => job.observe(message, now),
            Self::Set(job) => job.observe(message),
            Self::Download(job) => job.observe(message),
            Self::Upload(job) => job.observe(message, now),
            Self::Clear(job) => job.observe(message),
        }
    }

    fn refused(&mut self, name: &str, why: ParameterRefusal) {
        match self {
            Self::Read(job) => job.refused(name, why),
            Self::Set(job) => job.refused(name, why),
            Self::ReadAll(_) | Self::Download(_) | Self::Upload(_) | Self::Clear(_) => {}
        }
    }

    fn poll(&mut self, to: Address, now: Stamp, out: &mut Vec<MavMessage>) -> Option<Ending> {
        match self {
            Self::Read(job) => job.poll(to, now, out),
            Self::ReadAll(job) => job.poll(to, now, out),
            Self::Set(job) => job.poll(to, now, out),
            Self::Download(job) => job.poll(to, now, out),
            Self::Upload(job) => job.poll(to, now, out),
            Self::Clear(job) => job.poll(to, now, out),
        }
    }

    fn progress(&self) -> Option<(usize, usize)> {
        match self {
            Self::Read(_) | Self::Set(_) | Self::Clear(_) => None,
            Self::ReadAll(job) => job.progress(),
            Self::Download(job) => job.progress(),
            Self::Upload(job) => Some(job.progress()),
        }
    }

    /// What tells the autopilot that this will not go on.
    fn farewell(&self, to: Address) -> Option<MavMessage> {
        match self {
            Self::Read(_) | Self::ReadAll(_) | Self::Set(_) | Self::Clear(_) => None,
            Self::Download(job) => Some(job.farewell(to)),
            Self::Upload(job) => Some(job.farewell(to)),
        }
    }
}

#[derive(Debug, Clone)]
struct Waiting {
    ticket: Ticket,
    request: Request,
    deadline: Stamp,
}

#[derive(Debug, Clone)]
struct Active {
    ticket: Ticket,
    what: String,
    deadline: Stamp,
    started: Stamp,
    job: Job,
}

/// All transfers with one autopilot.
#[derive(Debug, Clone, Default)]
pub struct Transfers {
    ways: Ways,
    active: Option<Active>,
    waiting: VecDeque<Waiting>,
}

impl Transfers {
    /// Puts a request in line. It ends at `deadline`, whatever happens.
    ///
    /// # Errors
    /// [`TransferError::Busy`] when too many wait.
    pub fn submit(&mut self, ticket: Ticket, request: Request, deadline: Stamp) -> Result<(), TransferError> {
        if self.waiting.len() >= WAITING_MAX {
            return Err(TransferError::Busy);
        }
        self.waiting.push_back(Waiting { ticket, request, deadline });
        Ok(())
    }

    /// Takes a message of the autopilot. `own` is our system and component: what is addressed to another client is not for us.
    /// Returns whether [`Self::poll`] may have something to answer at once.
    pub fn observe(&mut self, message: &MavMessage, own: (u8, u8), now: Stamp) -> bool {
        self.ways.observe(message);
        let Some(active) = self.active.as_mut() else { return false };
        let ours = match message {
            // Told to everyone.
            MavMessage::PARAM_VALUE(_) => true,
            MavMessage::PARAM_ERROR(data) => is_for(own, data.target_system, data.target_component),
            MavMessage::MISSION_ACK(data) => is_for(own, data.target_system, data.target_component),
            MavMessage::MISSION_COUNT(data) => is_for(own, data.target_system, data.target_component),
            MavMessage::MISSION_REQUEST(data) => is_for(own, data.target_system, data.target_component),
            MavMessage::MISSION_REQUEST_INT(data) => is_for(own, data.target_system, data.target_component),
            MavMessage::MISSION_ITEM(data) => is_for(own, data.target_system, data.target_component),
            MavMessage::MISSION_ITEM_INT(data) => is_for(own, data.target_system, data.target_component),
            _ => false,
        };
        if ours {
            active.job.observe(message, now);
        }
        ours
    }

    /// The same for an answer with a value that isn't known.
    pub fn observe_unlisted(&mut self, answer: &Unlisted, own: (u8, u8)) -> bool {
        let (Some(active), Unlisted::ParamError(data, number)) = (self.active.as_mut(), answer) else { return false };
        let ours = is_for(own, data.target_system, data.target_component);
        if let (true, Ok(name)) = (ours, data.param_id.to_str()) {
            active.job.refused(name, ParameterRefusal::Unlisted(*number));
        }
        ours
    }

    /// Sends what is due, ends what has ended, begins what waits.
    pub fn poll(&mut self, to: Address, now: Stamp) -> Vec<Effect> {
        let mut effects = Vec::new();
        self.waiting.retain(|waiting| {
            let late = now > waiting.deadline;
            if late {
                effects.push(Effect::Transferred(waiting.ticket, Err(TransferError::Late { progress: None })));
            }
            !late
        });
        loop {
            if self.active.is_none() {
                let Some(Waiting { ticket, request, deadline }) = self.waiting.pop_front() else { return effects };
                match Job::new(&request, self.ways) {
                    Ok(job) => {
                        let what = request.describe();
                        self.active = Some(Active { ticket, what, deadline, started: now, job });
                    }
                    Err(error) => {
                        effects.push(Effect::Transferred(ticket, Err(error)));
                        continue;
                    }
                }
            }
            let Some(active) = self.active.as_mut() else { return effects };
            let mut out = Vec::new();
            let mut ending = active.job.poll(to, now, &mut out);
            if ending.is_none() && (now > active.deadline || now.seconds_since(active.started) > TRANSFER_S_MAX) {
                out.extend(active.job.farewell(to));
                ending = Some(Err(TransferError::Late { progress: active.job.progress() }));
            }
            effects.extend(out.into_iter().map(Effect::Send));
            let Some(ending) = ending else { return effects };
            effects.push(Effect::Transferred(active.ticket, ending));
            self.active = None;
        }
    }

    /// Ends all of them, for a person's word. Returns how many there were, too.
    pub fn cancel(&mut self, to: Option<Address>) -> (usize, Vec<Effect>) {
        let farewell = self.active.as_ref().zip(to).and_then(|(active, to)| active.job.farewell(to));
        let ended = self.end(&TransferError::Cancelled);
        let count = ended.len();
        (count, farewell.into_iter().map(Effect::Send).chain(ended).collect())
    }

    /// The link is down: whoever comes back may be another autopilot.
    pub fn abandon(&mut self) -> Vec<Effect> {
        self.ways = Ways::default();
        self.end(&TransferError::LinkLost)
    }

    fn end(&mut self, error: &TransferError) -> Vec<Effect> {
        let active = self.active.take().map(|active| active.ticket);
        let tickets = active.into_iter().chain(self.waiting.drain(..).map(|waiting| waiting.ticket));
        tickets.map(|ticket| Effect::Transferred(ticket, Err(error.clone()))).collect()
    }

    /// What is under way, since when, and how much of how much is done.
    #[must_use]
    pub fn progress(&self) -> Option<(&str, Stamp, usize, usize)> {
        let active = self.active.as_ref()?;
        let (done, total) = active.job.progress()?;
        Some((&active.what, active.started, done, total))
    }
}

/// Whether a message to this system and component is for us; old firmware leaves the component empty.
fn is_for(own: (u8, u8), system: u8, component: u8) -> bool {
    (system == own.0 && (component == own.1 || component == 0)) || (system == 0 && component == 0)
}
