//! The parameter protocol: read one by name, read all with the gaps asked again, write one and have it confirmed.
//!
//! A PARAM_VALUE is told to everyone and carries no question's number, so answers are matched by name (ArduPilot answers one
//! element of a vector with all three) or by index. An unknown name is not answered by ArduPilot at all: from the second try on
//! the first parameter of all is asked for, too, and if that comes and the named one doesn't, there is none of that name.

use halcyon_model::transfer::PARAMETERS_MAX;
use halcyon_model::{Content, Parameter, ParameterKind, ParameterName, Stamp};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavMessage, MavParamError, MavParamType};

use super::encode::Address;
use super::transfers::{Ending, ParameterRefusal, Retry, TransferError, Transferred};

/// An answer is awaited for so long, seconds.
const RETRY_S: f64 = 0.8;
/// Asked at most so many times.
const TRIES: u8 = 4;
/// Until the first of all parameters comes, seconds.
const LIST_S: f64 = 2.0;
/// So long without a new one, and the gaps are asked for, seconds.
const QUIET_S: f64 = 1.0;
/// Gaps asked for at a time: a slow radio must not drown.
const GAPS_MAX: usize = 16;
/// When so few of those are open, the next are asked for.
const GAPS_LOW: usize = 4;
/// So many times in a row nothing new came.
const ROUNDS_MAX: u8 = 5;
/// Told when it wasn't asked for by index.
const NO_INDEX: u16 = u16::MAX;

/// How a value stands in the float that carries it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// Cast to a float: ArduPilot.
    Cast,
    /// Its own bytes in the float's place: PX4.
    Bytewise,
}

impl Encoding {
    /// The value and its kind; `None` if it is not finite, or of a kind that a float cannot hold.
    fn decode(self, raw: f32, kind: MavParamType) -> Option<(f64, ParameterKind)> {
        let kind = ParameterKind::from_number(kind as u8)?;
        let bits = raw.to_bits();
        let value = match (self, kind) {
            (Self::Cast, _) | (Self::Bytewise, ParameterKind::Real32) => f64::from(raw),
            (Self::Bytewise, ParameterKind::Uint8) => f64::from(bits as u8),
            (Self::Bytewise, ParameterKind::Int8) => f64::from(bits as u8 as i8),
            (Self::Bytewise, ParameterKind::Uint16) => f64::from(bits as u16),
            (Self::Bytewise, ParameterKind::Int16) => f64::from(bits as u16 as i16),
            (Self::Bytewise, ParameterKind::Uint32) => f64::from(bits),
            (Self::Bytewise, ParameterKind::Int32) => f64::from(bits as i32),
        };
        value.is_finite().then_some((value, kind))
    }

    /// The float that carries `value`, which was checked.
    fn encode(self, value: f64, kind: ParameterKind) -> f32 {
        match (self, kind) {
            (Self::Cast, _) | (Self::Bytewise, ParameterKind::Real32) => value as f32,
            (Self::Bytewise, ParameterKind::Uint8) => f32::from_bits(u32::from(value as u8)),
            (Self::Bytewise, ParameterKind::Int8) => f32::from_bits(u32::from(value as i8 as u8)),
            (Self::Bytewise, ParameterKind::Uint16) => f32::from_bits(u32::from(value as u16)),
            (Self::Bytewise, ParameterKind::Int16) => f32::from_bits(u32::from(value as i16 as u16)),
            (Self::Bytewise, ParameterKind::Uint32) => f32::from_bits(value as u32),
            (Self::Bytewise, ParameterKind::Int32) => f32::from_bits(value as i32 as u32),
        }
    }
}

/// Whether a parameter of `kind` can hold `value`.
fn check(name: &ParameterName, value: f64, kind: ParameterKind) -> Result<(), TransferError> {
    let (least, most) = kind.range();
    let whole = kind == ParameterKind::Real32 || value.fract() == 0.0;
    // Written so that NaN fails, too.
    if (least..=most).contains(&value) && whole {
        return Ok(());
    }
    let numbers = if kind == ParameterKind::Real32 { "numbers" } else { "whole numbers" };
    Err(TransferError::WrongValue(format!("{name} takes {numbers} from {least} to {most}, not {value}")))
}

fn is_named(data: &ardu::PARAM_VALUE_DATA, name: &ParameterName) -> bool {
    data.param_id.to_str() == Ok(name.as_str())
}

fn request(name: &str, param_index: i16, to: Address) -> MavMessage {
    MavMessage::PARAM_REQUEST_READ(ardu::PARAM_REQUEST_READ_DATA {
        param_index,
        target_system: to.system(),
        target_component: to.component(),
        param_id: name.into(),
    })
}

fn words(error: MavParamError) -> &'static str {
    match error {
        MavParamError::MAV_PARAM_ERROR_NO_ERROR => "no error",
        MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST => "it does not exist",
        MavParamError::MAV_PARAM_ERROR_VALUE_OUT_OF_RANGE => "the value is out of range",
        MavParamError::MAV_PARAM_ERROR_PERMISSION_DENIED => "permission denied",
        MavParamError::MAV_PARAM_ERROR_COMPONENT_NOT_FOUND => "component not found",
        MavParamError::MAV_PARAM_ERROR_READ_ONLY => "it is read-only",
        MavParamError::MAV_PARAM_ERROR_TYPE_UNSUPPORTED => "its type is not supported",
        MavParamError::MAV_PARAM_ERROR_TYPE_MISMATCH => "the type does not match",
        MavParamError::MAV_PARAM_ERROR_READ_FAIL => "it could not be read",
    }
}

fn refusal(name: &ParameterName, error: MavParamError) -> TransferError {
    if error == MavParamError::MAV_PARAM_ERROR_DOES_NOT_EXIST {
        TransferError::NoSuchParameter(name.clone())
    } else {
        TransferError::ParameterRefused { name: name.clone(), why: ParameterRefusal::Listed(words(error)) }
    }
}

/// Reads one parameter by name.
#[derive(Debug, Clone)]
pub(super) struct ReadOne {
    name: ParameterName,
    encoding: Encoding,
    retry: Retry,
    /// It answers for another one.
    answers: bool,
    found: Option<Result<Parameter, TransferError>>,
}

impl ReadOne {
    pub(super) fn new(name: ParameterName, encoding: Encoding) -> Self {
        Self { name, encoding, retry: Retry::default(), answers: false, found: None }
    }

    pub(super) fn observe(&mut self, message: &MavMessage) {
        match message {
            MavMessage::PARAM_VALUE(data) if is_named(data, &self.name) => {
                let found = self.encoding.decode(data.param_value, data.param_type);
                self.found = Some(match found {
                    Some((value, kind)) => Ok(Parameter { name: self.name.clone(), value, kind }),
                    None => Err(TransferError::Unreadable(format!("{} is not a number that can be told", self.name))),
                });
            }
            MavMessage::PARAM_VALUE(_) => self.answers |= self.retry.tries > 1,
            MavMessage::PARAM_ERROR(data) if data.param_id.to_str() == Ok(self.name.as_str()) => {
                self.found = Some(Err(refusal(&self.name, data.error)));
            }
            _ => {}
        }
    }

    /// Refused for a reason that isn't known.
    pub(super) fn refused(&mut self, name: &str, why: ParameterRefusal) {
        if name == self.name.as_str() {
            self.found = Some(Err(TransferError::ParameterRefused { name: self.name.clone(), why }));
        }
    }

    fn step(&mut self, to: Address, now: Stamp, out: &mut Vec<MavMessage>) -> Option<Result<Parameter, TransferError>> {
        if let Some(found) = self.found.take() {
            return Some(found);
        }
        if !self.retry.is_due(now) {
            return None;
        }
        if self.retry.tries >= TRIES {
            let name = self.name.clone();
            let silent = TransferError::TimedOut { tries: TRIES, progress: None };
            return Some(Err(if self.answers { TransferError::NoSuchParameter(name) } else { silent }));
        }
        out.push(request(self.name.as_str(), -1, to));
        if self.retry.tries > 0 {
            out.push(request("", 0, to));
        }
        self.retry.sent(now, RETRY_S);
        None
    }

    pub(super) fn poll(&mut self, to: Address, now: Stamp, out: &mut Vec<MavMessage>) -> Option<Ending> {
        let found = self.step(to, now, out)?;
        Some(found.map(|parameter| Transferred {
            what: format!("{} is {}", parameter.name, parameter.value),
            content: Some(Content::Parameters(vec![parameter])),
        }))
    }
}

#[derive(Debug, Clone, PartialEq)]
enum Slot {
    Missing,
    /// Came, but holds what cannot be told.
    Skipped,
    Found(Parameter),
}

/// Reads all parameters.
#[derive(Debug, Clone)]
pub(super) struct ReadAll {
    encoding: Encoding,
    slots: Vec<Slot>,
    missing: usize,
    retry: Retry,
    /// When the last new one came.
    heard: Option<Stamp>,
    /// Gaps asked for and still open.
    asked: Vec<u16>,
    /// The list has come to its end, with gaps.
    filling: bool,
    rounds: u8,
    too_many: Option<u16>,
}

impl ReadAll {
    pub(super) fn new(encoding: Encoding) -> Self {
        Self {
            encoding,
            slots: Vec::new(),
            missing: 0,
            retry: Retry::default(),
            heard: None,
            asked: Vec::new(),
            filling: false,
            rounds: 0,
            too_many: None,
        }
    }

    pub(super) fn progress(&self) -> Option<(usize, usize)> {
        (!self.slots.is_empty()).then_some((self.slots.len() - self.missing, self.slots.len()))
    }

    pub(super) fn observe(&mut self, message: &MavMessage, now: Stamp) {
        let MavMessage::PARAM_VALUE(data) = message else { return };
        let (index, count) = (usize::from(data.param_index), usize::from(data.param_count));
        // Somebody else's question, answered by name.
        if data.param_index == NO_INDEX || index >= count {
            return;
        }
        if count > PARAMETERS_MAX {
            self.too_many = Some(data.param_count);
            return;
        }
        if self.slots.len() != count {
            // Switching a feature on brings parameters with it.
            self.slots.resize(count, Slot::Missing);
            self.asked.retain(|index| usize::from(*index) < count);
            self.missing = self.slots.iter().filter(|slot| **slot == Slot::Missing).count();
        }
        let Some(slot) = self.slots.get_mut(index) else { return };
        let name = data.param_id.to_str().ok().and_then(|name| ParameterName::new(name).ok());
        let found = name.zip(self.encoding.decode(data.param_value, data.param_type));
        if *slot == Slot::Missing {
            self.missing -= 1;
            self.heard = Some(now);
            self.rounds = 0;
            self.asked.retain(|asked| *asked != data.param_index);
        }
        *slot = found.map_or(Slot::Skipped, |(name, (value, kind))| Slot::Found(Parameter { name, value, kind }));
    }

    pub(super) fn poll(&mut self, to: Address, now: Stamp, out: &mut Vec<MavMessage>) -> Option<Ending> {
        if let Some(count) = self.too_many {
            return Some(Err(TransferError::Unreadable(format!("{count} parameters; at most {PARAMETERS_MAX} can be read"))));
        }
        if !self.slots.is_empty() && self.missing == 0 {
            return Some(Ok(self.done()));
        }
        let Some(heard) = self.heard else {
            if !self.retry.is_due(now) {
                return None;
            }
            if self.retry.tries >= TRIES {
                return Some(Err(TransferError::TimedOut { tries: TRIES, progress: None }));
            }
            out.push(MavMessage::PARAM_REQUEST_LIST(ardu::PARAM_REQUEST_LIST_DATA {
                target_system: to.system(),
                target_component: to.component(),
            }));
            self.retry.sent(now, LIST_S);
            return None;
        };
        let quiet = now.seconds_since(heard) >= QUIET_S && self.retry.is_due(now);
        // Once it has come to gaps, the next are asked for as those before are filled.
        let filling = self.filling && self.rounds == 0 && self.asked.len() <= GAPS_LOW;
        if quiet {
            self.filling = true;
            self.asked.clear();
            self.rounds += 1;
            if self.rounds > ROUNDS_MAX {
                return Some(Err(TransferError::TimedOut { tries: ROUNDS_MAX, progress: self.progress() }));
            }
            self.retry.sent(now, QUIET_S);
        }
        if quiet || filling {
            self.ask_for_gaps(to, out);
        }
        None
    }

    fn ask_for_gaps(&mut self, to: Address, out: &mut Vec<MavMessage>) {
        let gaps = self.slots.iter().enumerate().filter(|(_, slot)| **slot == Slot::Missing);
        let gaps = gaps.filter_map(|(index, _)| u16::try_from(index).ok()).filter(|index| !self.asked.contains(index));
        let gaps: Vec<u16> = gaps.take(GAPS_MAX - self.asked.len().min(GAPS_MAX)).collect();
        // PARAMETERS_MAX is far below what an i16 holds.
        out.extend(gaps.iter().filter_map(|index| i16::try_from(*index).ok()).map(|index| request("", index, to)));
        self.asked.extend(gaps);
    }

    fn done(&mut self) -> Transferred {
        let slots = std::mem::take(&mut self.slots);
        let skipped = slots.iter().filter(|slot| **slot == Slot::Skipped).count();
        let found = slots.into_iter().filter_map(|slot| match slot {
            Slot::Found(parameter) => Some(parameter),
            Slot::Missing | Slot::Skipped => None,
        });
        let found: Vec<Parameter> = found.collect();
        let more = if skipped == 0 { String::new() } else { format!(", {skipped} more hold no number that can be told") };
        Transferred { what: format!("{} parameters read{more}", found.len()), content: Some(Content::Parameters(found)) }
    }
}

/// Writes one parameter: reads it for its kind, checks the value, sends it, and awaits the value that comes back.
#[derive(Debug, Clone)]
pub(super) struct SetOne {
    read: ReadOne,
    value: f64,
    write: Option<Write>,
}

#[derive(Debug, Clone)]
struct Write {
    kind: ParameterKind,
    raw: f32,
    retry: Retry,
    /// What it said last, if that is something else.
    stays: Option<f64>,
    ended: Option<Result<(), TransferError>>,
}

impl SetOne {
    pub(super) fn new(name: ParameterName, value: f64, encoding: Encoding) -> Self {
        Self { read: ReadOne::new(name, encoding), value, write: None }
    }

    pub(super) fn observe(&mut self, message: &MavMessage) {
        let Some(write) = self.write.as_mut() else { return self.read.observe(message) };
        let (name, encoding) = (&self.read.name, self.read.encoding);
        match message {
            MavMessage::PARAM_VALUE(data) if is_named(data, name) => {
                let told = encoding.decode(data.param_value, data.param_type).map(|(value, _)| value);
                let asked = encoding.decode(write.raw, data.param_type).map(|(value, _)| value);
                if told.is_some() && told == asked {
                    write.ended = Some(Ok(()));
                } else {
                    // Perhaps an answer to the question before; so it's told once more before that is believed.
                    write.stays = told;
                }
            }
            MavMessage::PARAM_ERROR(data) if data.param_id.to_str() == Ok(name.as_str()) => {
                write.ended = Some(Err(refusal(name, data.error)));
            }
            _ => {}
        }
    }

    /// Refused for a reason that isn't known.
    pub(super) fn refused(&mut self, name: &str, why: ParameterRefusal) {
        match self.write.as_mut() {
            None => self.read.refused(name, why),
            Some(write) if name == self.read.name.as_str() => {
                write.ended = Some(Err(TransferError::ParameterRefused { name: self.read.name.clone(), why }));
            }
            Some(_) => {}
        }
    }

    pub(super) fn poll(&mut self, to: Address, now: Stamp, out: &mut Vec<MavMessage>) -> Option<Ending> {
        if self.write.is_none() {
            let kind = match self.read.step(to, now, out)? {
                Ok(parameter) => parameter.kind,
                Err(error) => return Some(Err(error)),
            };
            if let Err(error) = check(&self.read.name, self.value, kind) {
                return Some(Err(error));
            }
            let raw = self.read.encoding.encode(self.value, kind);
            self.write = Some(Write { kind, raw, retry: Retry::default(), stays: None, ended: None });
        }
        let write = self.write.as_mut()?;
        let name = &self.read.name;
        if let Some(ended) = write.ended.take() {
            let value = self.read.encoding.decode(write.raw, wire_kind(write.kind)).map_or(self.value, |(value, _)| value);
            return Some(ended.map(|()| Transferred {
                what: format!("{name} is {value}"),
                content: Some(Content::Parameters(vec![Parameter { name: name.clone(), value, kind: write.kind }])),
            }));
        }
        if !write.retry.is_due(now) {
            return None;
        }
        if let Some(value) = write.stays.filter(|_| write.retry.tries >= 2) {
            return Some(Err(TransferError::StaysAt { name: name.clone(), value }));
        }
        if write.retry.tries >= TRIES {
            return Some(Err(TransferError::TimedOut { tries: TRIES, progress: None }));
        }
        out.push(MavMessage::PARAM_SET(ardu::PARAM_SET_DATA {
            param_value: write.raw,
            target_system: to.system(),
            target_component: to.component(),
            param_id: name.as_str().into(),
            param_type: wire_kind(write.kind),
        }));
        write.retry.sent(now, RETRY_S);
        None
    }
}

fn wire_kind(kind: ParameterKind) -> MavParamType {
    match kind {
        ParameterKind::Uint8 => MavParamType::MAV_PARAM_TYPE_UINT8,
        ParameterKind::Int8 => MavParamType::MAV_PARAM_TYPE_INT8,
        ParameterKind::Uint16 => MavParamType::MAV_PARAM_TYPE_UINT16,
        ParameterKind::Int16 => MavParamType::MAV_PARAM_TYPE_INT16,
        ParameterKind::Uint32 => MavParamType::MAV_PARAM_TYPE_UINT32,
        ParameterKind::Int32 => MavParamType::MAV_PARAM_TYPE_INT32,
        ParameterKind::Real32 => MavParamType::MAV_PARAM_TYPE_REAL32,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values by C's own rules of casts and two's complement, written out by hand.
    #[test]
    fn both_encodings_by_their_bytes() {
        let check = |encoding: Encoding, kind: ParameterKind, value: f64, bytes: [u8; 4]| {
            let raw = encoding.encode(value, kind);
            assert_eq!(raw.to_bits().to_le_bytes(), bytes, "{encoding:?} {kind:?} {value}");
            assert_eq!(encoding.decode(raw, wire_kind(kind)), Some((value, kind)));
        };
        check(Encoding::Bytewise, ParameterKind::Int8, -1.0, [0xFF, 0, 0, 0]);
        check(Encoding::Bytewise, ParameterKind::Uint8, 200.0, [200, 0, 0, 0]);
        check(Encoding::Bytewise, ParameterKind::Int16, -2.0, [0xFE, 0xFF, 0, 0]);
        check(Encoding::Bytewise, ParameterKind::Uint16, 513.0, [1, 2, 0, 0]);
        check(Encoding::Bytewise, ParameterKind::Int32, -3.0, [0xFD, 0xFF, 0xFF, 0xFF]);
        check(Encoding::Bytewise, ParameterKind::Int32, 16_909_060.0, [4, 3, 2, 1]);
        check(Encoding::Bytewise, ParameterKind::Uint32, 4_294_967_295.0, [0xFF; 4]);
        check(Encoding::Bytewise, ParameterKind::Real32, 1.0, [0, 0, 0x80, 0x3F]);
        check(Encoding::Cast, ParameterKind::Int16, -2.0, [0, 0, 0, 0xC0]);
        check(Encoding::Cast, ParameterKind::Int32, 1500.0, [0, 0x80, 0xBB, 0x44]);
        assert_eq!(Encoding::Cast.decode(f32::NAN, MavParamType::MAV_PARAM_TYPE_REAL32), None);
        assert_eq!(Encoding::Cast.decode(1.0, MavParamType::MAV_PARAM_TYPE_INT64), None);
    }

    #[test]
    fn a_value_that_does_not_fit_is_refused_before_it_is_sent() {
        let name = ParameterName::new("X").unwrap();
        let fits = |value, kind| check(&name, value, kind).is_ok();
        assert!(fits(-128.0, ParameterKind::Int8) && !fits(-129.0, ParameterKind::Int8) && !fits(1.5, ParameterKind::Int8));
        assert!(fits(65_535.0, ParameterKind::Uint16) && !fits(65_536.0, ParameterKind::Uint16));
        assert!(!fits(-1.0, ParameterKind::Uint32) && fits(1.5, ParameterKind::Real32) && !fits(1e39, ParameterKind::Real32));
        for kind in ParameterKind::ALL {
            assert!(!fits(f64::NAN, kind) && !fits(f64::INFINITY, kind));
        }
    }
}
