//! The command protocol: COMMAND_LONG and COMMAND_INT with confirmation count, acknowledgements matched by command id, retries,
//! progress, timeouts, and a typed refusal with the autopilot's own words.
//!
//! An acknowledgement names its command and nothing else, so at most one transaction a command id is open; others wait in line.
//! What was sent twice may be acknowledged twice: an acknowledgement that an ended transaction is still owed is not taken for the
//! next one's.

use std::collections::VecDeque;

use halcyon_model::{FlightMode, Stamp};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage, MavResult};

use super::encode::Address;
use super::owed::Owed;
use super::payload::PayloadCommand;
use super::streams::Stream;
use super::text::Texts;
use super::transfers::Ending;
use super::unlisted::Unlisted;

/// An answer is awaited for so long before the command is sent again, seconds.
const RETRY_S: f64 = 1.0;
/// Sent at most so many times.
const TRIES: u8 = 4;
/// After IN_PROGRESS: until the next word, and altogether, seconds.
const PROGRESS_S: f64 = 5.0;
const PROGRESS_S_MAX: f64 = 60.0;
/// The words that explain a refusal may come just after it, seconds.
const WORDS_S: f64 = 0.3;
/// And just before it, seconds.
const WORDS_AGE_S: f64 = 3.0;
/// Open and waiting transactions; more are refused.
const OPEN_MAX: usize = 32;

/// What the autopilot can be asked to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Command {
    /// Start the motors.
    Arm,
    /// Stop them; `force` even in the air.
    Disarm {
        /// In the air or not.
        force: bool,
    },
    /// Change the flight mode.
    SetMode(FlightMode),
    /// Climb from the ground to a height above home, metres.
    TakeOff {
        /// Height above home, metres.
        height_above_home_m: f64,
    },
    /// Home is here, and stays here.
    SetHome,
    /// Send a message at an interval.
    SetInterval(Stream),
    /// Open or close what holds the payload.
    Payload(PayloadCommand),
}

/// Who asked, to give the outcome back to; the caller's own number.
pub type Ticket = u64;

/// Why the autopilot refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Refusal {
    /// MAVLink's result, in words.
    #[error("{0}")]
    Listed(&'static str),
    /// A number that MAVLink's results do not have here: whatever it means, the command was not done.
    #[error("result {0}, which is not known here")]
    Unlisted(u8),
}

/// How a command ended.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CommandError {
    /// The autopilot said no.
    #[error("the autopilot refused: {result}{}", .words.as_ref().map(|words| format!(" ({words})")).unwrap_or_default())]
    Refused {
        /// Its result.
        result: Refusal,
        /// What the autopilot said about it, such as a PreArm message.
        words: Option<String>,
    },
    /// It didn't answer.
    #[error("the autopilot did not answer {tries} tries{}", .percent.map(|percent| format!(", {percent} % done")).unwrap_or_default())]
    TimedOut {
        /// How often it was sent.
        tries: u8,
        /// How far it said that it was, percent.
        percent: Option<u8>,
    },
    /// Too many commands are under way.
    #[error("{OPEN_MAX} commands are under way already")]
    Busy,
    /// There is nobody to ask.
    #[error("the autopilot is not heard")]
    NotHeard,
    /// The link went down before an answer.
    #[error("the link to the autopilot was lost before it answered")]
    LinkLost,
    /// The motors were told to stop, whatever was under way with them.
    #[error("overtaken by a termination")]
    Overtaken,
    /// The pilot took over before it was answered.
    #[error("withdrawn, since the pilot took over")]
    Withdrawn,
}

/// What [`Commands::poll`] asks of its caller.
#[derive(Debug, Clone)]
#[allow(clippy::large_enum_variant, reason = "short-lived, and only a handful a second")]
pub enum Effect {
    /// Send this.
    Send(MavMessage),
    /// A command ended.
    Done(Ticket, Command, Result<(), CommandError>),
    /// A transfer ended.
    Transferred(Ticket, Ending),
}

#[derive(Debug, Clone)]
struct Transaction {
    ticket: Ticket,
    command: Command,
    phase: Phase,
    started: Option<Stamp>,
    tries: u8,
    as_int: bool,
    /// When it was sent last.
    sent: Option<Stamp>,
    /// Final acknowledgements that came.
    acks: u8,
    /// The autopilot said that it is at work on it.
    at_work: bool,
    percent: Option<u8>,
}

#[derive(Debug, Clone, Copy)]
enum Phase {
    Waiting,
    Sent {
        until: Stamp,
    },
    InProgress {
        until: Stamp,
    },
    /// Refused; waits for the words.
    Refused {
        until: Stamp,
        result: Refusal,
    },
    Accepted,
    /// By a termination.
    Overtaken,
}

/// All transactions with one autopilot.
#[derive(Debug, Clone, Default)]
pub struct Commands {
    open: VecDeque<Transaction>,
    owed: Owed,
}

impl Commands {
    /// Puts a command in line.
    ///
    /// # Errors
    /// [`CommandError::Busy`] when too many are under way.
    pub fn submit(&mut self, ticket: Ticket, command: Command) -> Result<(), CommandError> {
        let terminates = command == Command::Disarm { force: true };
        if terminates {
            self.overtake(command);
        }
        // A termination waits for no place.
        if self.open.len() >= OPEN_MAX && !(terminates && self.open.len() < 2 * OPEN_MAX) {
            return Err(CommandError::Busy);
        }
        self.open.push_back(Transaction {
            ticket,
            command,
            phase: Phase::Waiting,
            started: None,
            tries: 0,
            as_int: false,
            sent: None,
            acks: 0,
            at_work: false,
            percent: None,
        });
        Ok(())
    }

    /// Ends whatever else is under way under the same id.
    fn overtake(&mut self, command: Command) {
        let others = self.open.iter_mut().filter(|open| open.command.id() == command.id() && open.command != command);
        others.for_each(|open| open.phase = Phase::Overtaken);
    }

    /// Takes an acknowledgement from the autopilot. `own_system` and `own_component` are ours: one addressed to another client
    /// is not for us.
    pub fn observe_ack(&mut self, ack: &ardu::COMMAND_ACK_DATA, own_system: u8, own_component: u8, now: Stamp) {
        self.take(ack, Some(ack.result), Refusal::Listed(words(ack.result)), (own_system, own_component), now);
    }

    /// The same, where the result is a number of a newer MAVLink; see [`Unlisted`].
    pub fn observe_unlisted(&mut self, answer: &Unlisted, own_system: u8, own_component: u8, now: Stamp) {
        if let Unlisted::Ack(ack, number) = answer {
            self.take(ack, None, Refusal::Unlisted(*number), (own_system, own_component), now);
        }
    }

    /// An acknowledgement by its result, `None` if that is not known; `refusal` is what it says if it says no.
    fn take(
        &mut self,
        ack: &ardu::COMMAND_ACK_DATA,
        result: Option<MavResult>,
        refusal: Refusal,
        (own_system, own_component): (u8, u8),
        now: Stamp,
    ) {
        // Old firmware leaves the address empty.
        let for_us = (ack.target_system == 0 && ack.target_component == 0)
            || (ack.target_system == own_system && (ack.target_component == own_component || ack.target_component == 0));
        if !for_us {
            return;
        }
        let ends = result != Some(MavResult::MAV_RESULT_IN_PROGRESS);
        let begun = |open: &&mut Transaction| open.command.id() == ack.command && !matches!(open.phase, Phase::Waiting);
        let open = self.open.iter_mut().find(begun);
        // Taken for a late one wrongly, it is answered again when it is sent again.
        let may_be_late = open.as_ref().is_none_or(|open| open.tries <= 1 && open.acks == 0 && !open.at_work);
        if may_be_late && self.owed.settle(ack.command, ends, now) {
            return;
        }
        let Some(open) = open else { return };
        open.acks = open.acks.saturating_add(u8::from(ends));
        open.answered(ack, result, refusal, now);
    }

    /// The autopilot's heartbeat, which came at `heard`. What it shows to be done is not asked for again, though no acknowledgement came: the
    /// pilot may undo it any moment. But for a termination, which ends when the autopilot says so: the heartbeat may be older than it.
    pub fn observe_heartbeat(&mut self, mode: FlightMode, armed: bool, heard: Stamp) {
        for open in &mut self.open {
            let done = match open.command {
                Command::Arm => armed,
                Command::Disarm { force } => !armed && !force,
                Command::SetMode(wanted) => mode == wanted,
                Command::TakeOff { .. } | Command::SetHome | Command::SetInterval(_) | Command::Payload(_) => false,
            };
            let asked = matches!(open.phase, Phase::Sent { .. } | Phase::InProgress { .. });
            if done && asked && open.sent.is_some_and(|sent| sent < heard) {
                open.phase = Phase::Accepted;
            }
        }
    }

    /// Sends what is due, ends what has ended.
    pub fn poll(&mut self, to: Address, texts: &Texts, now: Stamp) -> Vec<Effect> {
        let mut effects = Vec::new();
        let mut busy: Vec<MavCmd> = Vec::new();
        self.open.retain_mut(|open| {
            let id = open.command.id();
            if busy.contains(&id) {
                return true;
            }
            busy.push(id);
            let keep = open.step(to, texts, now, &mut effects);
            if !keep {
                busy.pop();
                self.owed.remember(open.owes(), now);
            }
            keep
        });
        effects
    }

    /// Stops sending whatever would change mode or motors: the vehicle went into `mode`, which guidance didn't ask for. If a
    /// person asked for it here, that was done, whether or not the acknowledgement has come. What the autopilot `to` is at work on
    /// is cancelled there, too.
    pub fn withdraw(&mut self, to: Option<Address>, mode: Option<FlightMode>, now: Stamp) -> Vec<Effect> {
        let mut ended = Vec::new();
        self.open.retain(|open| {
            // A person's termination stands: whoever has the vehicle, its motors are to stop.
            let terminates = open.ticket != 0 && open.command == Command::Disarm { force: true };
            let keep = terminates || matches!(open.command, Command::SetInterval(_));
            if !keep {
                ended.extend(to.and_then(|to| open.cancellation(to)).map(Effect::Send));
                let reached = mode.is_some_and(|mode| open.command == Command::SetMode(mode));
                let outcome = if reached { Ok(()) } else { open.cut_short(CommandError::Withdrawn) };
                ended.push(Effect::Done(open.ticket, open.command, outcome));
                self.owed.remember(open.owes(), now);
            }
            keep
        });
        ended
    }

    /// The link is down: what was not acknowledged has no outcome.
    pub fn abandon(&mut self) -> Vec<Effect> {
        self.owed = Owed::default();
        let end = |open: Transaction| Effect::Done(open.ticket, open.command, open.cut_short(CommandError::LinkLost));
        self.open.drain(..).map(end).collect()
    }
}

impl Transaction {
    /// Its acknowledgement came.
    fn answered(&mut self, ack: &ardu::COMMAND_ACK_DATA, result: Option<MavResult>, refusal: Refusal, now: Stamp) {
        let sent_again = matches!(self.phase, Phase::Sent { .. });
        if !sent_again && !matches!(self.phase, Phase::InProgress { .. }) {
            return;
        }
        self.phase = match result {
            Some(MavResult::MAV_RESULT_ACCEPTED) => Phase::Accepted,
            Some(MavResult::MAV_RESULT_IN_PROGRESS) => {
                // 255: not known.
                self.percent = Some(ack.progress).filter(|percent| *percent <= 100).or(self.percent);
                self.at_work = true;
                Phase::InProgress { until: now.plus_secs_f64(PROGRESS_S) }
            }
            // Asked again for what it is at work on, it may say that it is busy: with this. That refuses the second, not the first.
            Some(MavResult::MAV_RESULT_TEMPORARILY_REJECTED) if self.at_work && sent_again => {
                Phase::InProgress { until: now.plus_secs_f64(PROGRESS_S) }
            }
            Some(MavResult::MAV_RESULT_COMMAND_INT_ONLY) if !self.as_int => {
                self.as_int = true;
                Phase::Sent { until: now }
            }
            Some(_) | None => Phase::Refused { until: now.plus_secs_f64(WORDS_S), result: refusal },
        };
    }

    /// Under which id how many acknowledgements may still come, and when it was sent last. An acknowledgement of one stream is as
    /// good as another's, and their line is long.
    fn owes(&self) -> Option<(MavCmd, u8, Stamp)> {
        let count = self.tries.saturating_sub(self.acks);
        let counts = count > 0 && !matches!(self.command, Command::SetInterval(_));
        self.sent.filter(|_| counts).map(|sent| (self.command.id(), count, sent))
    }

    /// What stops the autopilot, if it said that it is at work on this.
    fn cancellation(&self, to: Address) -> Option<MavMessage> {
        self.at_work.then(|| {
            MavMessage::COMMAND_CANCEL(ardu::COMMAND_CANCEL_DATA {
                command: self.command.id(),
                target_system: to.system(),
                target_component: to.component(),
            })
        })
    }

    /// The outcome if it ends now, because of `error`.
    fn cut_short(&self, error: CommandError) -> Result<(), CommandError> {
        if matches!(self.phase, Phase::Accepted) { Ok(()) } else { Err(error) }
    }

    /// Our clock may have been set back: nothing is awaited for longer than it would have been, or a retry would leave when whoever
    /// asked has long given up.
    fn watch_clock(&mut self, now: Stamp) {
        let at_most = |until: &mut Stamp, for_s: f64| *until = (*until).min(now.plus_secs_f64(for_s));
        match &mut self.phase {
            Phase::Sent { until } => at_most(until, RETRY_S),
            Phase::InProgress { until } => at_most(until, PROGRESS_S),
            Phase::Refused { until, .. } => at_most(until, WORDS_S),
            Phase::Waiting | Phase::Accepted | Phase::Overtaken => {}
        }
        self.started.iter_mut().for_each(|started| at_most(started, 0.0));
    }

    /// Whether the transaction goes on.
    fn step(&mut self, to: Address, texts: &Texts, now: Stamp, effects: &mut Vec<Effect>) -> bool {
        self.watch_clock(now);
        let outcome = match self.phase {
            Phase::Accepted => Ok(()),
            Phase::Overtaken => Err(CommandError::Overtaken),
            Phase::Refused { until, .. } if now < until => return true,
            Phase::Refused { result, .. } => Err(CommandError::Refused { result, words: self.explanation(texts, now) }),
            _ if self.started.is_some_and(|started| now.seconds_since(started) > PROGRESS_S_MAX) => {
                Err(CommandError::TimedOut { tries: self.tries, percent: self.percent })
            }
            Phase::Sent { until } | Phase::InProgress { until } if now < until => return true,
            _ if self.tries >= TRIES => Err(CommandError::TimedOut { tries: self.tries, percent: self.percent }),
            Phase::Waiting | Phase::Sent { .. } | Phase::InProgress { .. } => {
                effects.push(Effect::Send(self.command.message(to, self.tries, self.as_int)));
                self.tries += 1;
                self.sent = Some(now);
                self.started.get_or_insert(now);
                self.phase = Phase::Sent { until: now.plus_secs_f64(RETRY_S) };
                return true;
            }
        };
        if matches!(outcome, Err(CommandError::TimedOut { .. })) {
            // Given up here, it is not to go on there.
            effects.extend(self.cancellation(to).map(Effect::Send));
        }
        effects.push(Effect::Done(self.ticket, self.command, outcome));
        false
    }

    fn explanation(&self, texts: &Texts, now: Stamp) -> Option<String> {
        let arming = matches!(self.command, Command::Arm | Command::TakeOff { .. });
        if arming && let Some(complaint) = texts.arming_complaint(now, 60.0) {
            return Some(complaint.to_owned());
        }
        // Severity 4 is a warning; beyond that it's chatter.
        texts.newest(now, WORDS_AGE_S, |text| text.severity <= 4).map(|text| text.text.clone())
    }
}

impl Command {
    /// MAVLink's number for it.
    #[must_use]
    pub fn id(&self) -> MavCmd {
        match self {
            Self::Arm | Self::Disarm { .. } => MavCmd::MAV_CMD_COMPONENT_ARM_DISARM,
            Self::SetMode(_) => MavCmd::MAV_CMD_DO_SET_MODE,
            Self::TakeOff { .. } => MavCmd::MAV_CMD_NAV_TAKEOFF,
            Self::SetHome => MavCmd::MAV_CMD_DO_SET_HOME,
            Self::SetInterval(_) => MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL,
            Self::Payload(payload) => payload.id,
        }
    }

    /// The seven parameters.
    fn parameters(&self) -> [f32; 7] {
        /// ArduPilot's and PX4's word for "even in the air".
        const FORCE: f32 = 21196.0;
        match *self {
            // 1: the present place.
            Self::Arm | Self::SetHome => [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            Self::Disarm { force } => [0.0, if force { FORCE } else { 0.0 }, 0.0, 0.0, 0.0, 0.0, 0.0],
            // 1: MAV_MODE_FLAG_CUSTOM_MODE_ENABLED.
            Self::SetMode(mode) => [1.0, mode.copter_number() as f32, 0.0, 0.0, 0.0, 0.0, 0.0],
            Self::TakeOff { height_above_home_m } => [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height_above_home_m as f32],
            Self::Payload(PayloadCommand { parameters: [first, second], .. }) => [first, second, 0.0, 0.0, 0.0, 0.0, 0.0],
            Self::SetInterval(stream) => [stream.message_id as f32, stream.interval_us as f32, 0.0, 0.0, 0.0, 0.0, 0.0],
        }
    }

    fn message(&self, to: Address, confirmation: u8, as_int: bool) -> MavMessage {
        let [param1, param2, param3, param4, param5, param6, param7] = self.parameters();
        let (command, target_system, target_component) = (self.id(), to.system(), to.component());
        if as_int {
            return MavMessage::COMMAND_INT(ardu::COMMAND_INT_DATA {
                param1,
                param2,
                param3,
                param4,
                x: param5 as i32,
                y: param6 as i32,
                z: param7,
                command,
                target_system,
                target_component,
                frame: ardu::MavFrame::MAV_FRAME_GLOBAL_RELATIVE_ALT,
                current: 0,
                autocontinue: 0,
            });
        }
        MavMessage::COMMAND_LONG(ardu::COMMAND_LONG_DATA {
            param1,
            param2,
            param3,
            param4,
            param5,
            param6,
            param7,
            command,
            target_system,
            target_component,
            confirmation,
        })
    }
}

fn words(result: MavResult) -> &'static str {
    match result {
        MavResult::MAV_RESULT_ACCEPTED => "accepted",
        MavResult::MAV_RESULT_TEMPORARILY_REJECTED => "temporarily rejected",
        MavResult::MAV_RESULT_DENIED => "denied",
        MavResult::MAV_RESULT_UNSUPPORTED => "unsupported",
        MavResult::MAV_RESULT_FAILED => "failed",
        MavResult::MAV_RESULT_IN_PROGRESS => "in progress",
        MavResult::MAV_RESULT_CANCELLED => "cancelled",
        MavResult::MAV_RESULT_COMMAND_LONG_ONLY | MavResult::MAV_RESULT_COMMAND_INT_ONLY => "wrong form of command",
        MavResult::MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME => "unsupported frame",
        MavResult::MAV_RESULT_NOT_IN_CONTROL => "not in control",
    }
}

#[cfg(test)]
mod tests;
