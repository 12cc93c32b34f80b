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
mod tests {
    use super::*;

    const OWN: (u8, u8) = (7, 191);

    fn t(s: f64) -> Stamp {
        Stamp::from_secs_f64(1000.0).plus_secs_f64(s)
    }

    fn to() -> Address {
        Address::new(7, 1).unwrap()
    }

    fn ack(command: MavCmd, result: MavResult, target: (u8, u8)) -> ardu::COMMAND_ACK_DATA {
        ardu::COMMAND_ACK_DATA { command, result, target_system: target.0, target_component: target.1, ..Default::default() }
    }

    fn confirmations(effects: &[Effect]) -> Vec<u8> {
        let confirmation = |effect: &Effect| match effect {
            Effect::Send(MavMessage::COMMAND_LONG(data)) => Some(data.confirmation),
            _ => None,
        };
        effects.iter().filter_map(confirmation).collect()
    }

    #[test]
    fn a_clock_set_back_delays_no_retry() {
        let mut commands = Commands::default();
        commands.submit(1, Command::SetMode(FlightMode::Guided)).unwrap();
        let texts = Texts::default();
        assert_eq!(confirmations(&commands.poll(to(), &texts, t(400.0))), [0]);
        let mut sent = Vec::new();
        for step in 0..60 {
            let effects = commands.poll(to(), &texts, t(0.1 * f64::from(step)));
            sent.extend(confirmations(&effects).into_iter().map(|confirmation| (step, confirmation)));
        }
        assert_eq!(sent, [(10, 1), (20, 2), (30, 3)]);
        assert!(commands.poll(to(), &texts, t(400.0)).is_empty(), "it ended with its last try");
    }

    #[test]
    fn retried_with_confirmation_count_then_timed_out() {
        let mut commands = Commands::default();
        commands.submit(1, Command::Arm).unwrap();
        let mut seen = Vec::new();
        let mut outcome = None;
        for step in 0..100 {
            let effects = commands.poll(to(), &Texts::default(), t(f64::from(step) * 0.1));
            seen.extend(confirmations(&effects));
            outcome = outcome.or(effects.into_iter().find_map(|effect| match effect {
                Effect::Done(1, Command::Arm, outcome) => Some((step, outcome)),
                _ => None,
            }));
        }
        assert_eq!(seen, [0, 1, 2, 3]);
        assert_eq!(outcome, Some((40, Err(CommandError::TimedOut { tries: 4, percent: None }))));
    }

    /// The acknowledgement is lost, the heartbeat shows it done: whoever undoes it then is not fought with a retry. A heartbeat from before it was sent
    /// shows nothing.
    #[test]
    fn what_the_heartbeat_shows_to_be_done_is_not_asked_for_again() {
        let (guided, loiter) = (FlightMode::Guided, FlightMode::Loiter);
        for command in [Command::Arm, Command::SetMode(guided), Command::Disarm { force: false }] {
            let mut commands = Commands::default();
            commands.submit(1, command).unwrap();
            commands.poll(to(), &Texts::default(), t(0.0));
            let armed = command == Command::Arm;
            commands.observe_heartbeat(guided, armed, t(-0.5));
            assert!(commands.poll(to(), &Texts::default(), t(0.1)).is_empty());
            commands.observe_heartbeat(guided, armed, t(0.5));
            assert!(matches!(commands.poll(to(), &Texts::default(), t(0.6))[..], [Effect::Done(1, _, Ok(()))]));
            commands.observe_heartbeat(loiter, !armed, t(0.8));
            let later = (7..100).flat_map(|step| commands.poll(to(), &Texts::default(), t(0.1 * f64::from(step))));
            assert_eq!(later.count(), 0);
        }
    }

    #[test]
    fn only_our_acknowledgement_of_this_command_counts() {
        let mut commands = Commands::default();
        commands.submit(1, Command::Arm).unwrap();
        commands.poll(to(), &Texts::default(), t(0.0));
        let arm = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
        commands.observe_ack(&ack(MavCmd::MAV_CMD_NAV_TAKEOFF, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(0.1));
        commands.observe_ack(&ack(arm, MavResult::MAV_RESULT_ACCEPTED, (255, 190)), OWN.0, OWN.1, t(0.1));
        assert!(commands.poll(to(), &Texts::default(), t(0.2)).is_empty());
        commands.observe_ack(&ack(arm, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(0.3));
        assert!(matches!(commands.poll(to(), &Texts::default(), t(0.3))[..], [Effect::Done(1, Command::Arm, Ok(()))]));
    }

    #[test]
    fn a_termination_goes_out_at_once_and_another_commands_answer_is_not_taken_for_its_own() {
        let mut commands = Commands::default();
        for ticket in 1..=OPEN_MAX as u64 {
            let command = if ticket % 2 == 0 { Command::Arm } else { Command::Disarm { force: false } };
            commands.submit(ticket, command).unwrap();
        }
        commands.poll(to(), &Texts::default(), t(0.0));
        assert_eq!(commands.submit(98, Command::Arm), Err(CommandError::Busy));
        commands.submit(99, Command::Disarm { force: true }).unwrap();
        let effects = commands.poll(to(), &Texts::default(), t(0.1));
        let overtaken = |effect: &&Effect| matches!(effect, Effect::Done(_, _, Err(CommandError::Overtaken)));
        assert_eq!(effects.iter().filter(overtaken).count(), OPEN_MAX);
        let stop = |effects: &[Effect]| {
            let is_stop =
                |effect: &&Effect| matches!(effect, Effect::Send(MavMessage::COMMAND_LONG(data)) if data.param2 == 21196.0);
            effects.iter().filter(is_stop).count()
        };
        assert_eq!(stop(&effects), 1);
        // The first one's answer comes now; the termination itself was lost, and is sent again.
        let accepted = ack(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, MavResult::MAV_RESULT_ACCEPTED, OWN);
        commands.observe_ack(&accepted, OWN.0, OWN.1, t(0.2));
        let effects = commands.poll(to(), &Texts::default(), t(1.2));
        assert_eq!(stop(&effects), 1);
        // Not even the pilot's mode change withdraws it, if a person asked.
        assert!(commands.withdraw(None, None, t(1.5)).is_empty());
        commands.observe_ack(&accepted, OWN.0, OWN.1, t(1.3));
        let effects = commands.poll(to(), &Texts::default(), t(1.3));
        assert!(matches!(effects[..], [Effect::Done(99, Command::Disarm { force: true }, Ok(()))]), "{effects:?}");
        // Our own is.
        commands.submit(0, Command::Disarm { force: true }).unwrap();
        assert_eq!(commands.withdraw(None, None, t(1.5)).len(), 1);
    }

    #[test]
    fn a_refusal_carries_the_autopilots_words_even_if_they_come_after_it() {
        let mut commands = Commands::default();
        let mut texts = Texts::default();
        commands.submit(9, Command::Arm).unwrap();
        commands.poll(to(), &texts, t(0.0));
        let refused = ack(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, MavResult::MAV_RESULT_FAILED, OWN);
        commands.observe_ack(&refused, OWN.0, OWN.1, t(0.1));
        assert!(commands.poll(to(), &texts, t(0.15)).is_empty());
        let text = ardu::STATUSTEXT_DATA {
            severity: ardu::MavSeverity::MAV_SEVERITY_CRITICAL,
            text: "PreArm: Need Position Estimate".into(),
            ..Default::default()
        };
        texts.observe(&text, t(0.2));
        let effects = commands.poll(to(), &texts, t(0.5));
        let [Effect::Done(9, _, Err(error))] = &effects[..] else { panic!("{effects:?}") };
        assert_eq!(error.to_string(), "the autopilot refused: failed (PreArm: Need Position Estimate)");
    }

    #[test]
    fn progress_extends_the_wait_but_not_for_ever_and_int_only_is_sent_as_int() {
        let mut commands = Commands::default();
        let takeoff = Command::TakeOff { height_above_home_m: 5.0 };
        commands.submit(1, takeoff).unwrap();
        commands.poll(to(), &Texts::default(), t(0.0));
        let id = MavCmd::MAV_CMD_NAV_TAKEOFF;
        commands.observe_ack(&ack(id, MavResult::MAV_RESULT_COMMAND_INT_ONLY, OWN), OWN.0, OWN.1, t(0.1));
        let effects = commands.poll(to(), &Texts::default(), t(0.1));
        let [Effect::Send(MavMessage::COMMAND_INT(data))] = &effects[..] else { panic!("{effects:?}") };
        assert_eq!((data.z, data.target_system, data.target_component), (5.0, 7, 1));
        let mut ended = None;
        for step in 2..2000 {
            let now = t(f64::from(step) * 0.1);
            commands.observe_ack(&ack(id, MavResult::MAV_RESULT_IN_PROGRESS, OWN), OWN.0, OWN.1, now);
            for effect in commands.poll(to(), &Texts::default(), now) {
                if let Effect::Done(_, _, outcome) = effect {
                    ended = Some((step, outcome));
                }
            }
            if ended.is_some() {
                break;
            }
        }
        assert!(matches!(ended, Some((599..=602, Err(CommandError::TimedOut { .. })))), "{ended:?}");
    }

    /// The new mode's heartbeat often overtakes the acknowledgement, and both come within one step.
    #[test]
    fn a_mode_that_a_person_asked_for_and_got_was_not_withdrawn() {
        let asked = |acknowledged: bool, mode: FlightMode| {
            let mut commands = Commands::default();
            commands.submit(5, Command::SetMode(FlightMode::Loiter)).unwrap();
            commands.poll(to(), &Texts::default(), t(0.0));
            if acknowledged {
                let ack = ack(MavCmd::MAV_CMD_DO_SET_MODE, MavResult::MAV_RESULT_ACCEPTED, OWN);
                commands.observe_ack(&ack, OWN.0, OWN.1, t(0.1));
            }
            let [Effect::Done(5, _, outcome)] = &commands.withdraw(None, Some(mode), t(0.2))[..] else { panic!("no outcome") };
            outcome.clone()
        };
        assert_eq!(asked(true, FlightMode::Loiter), Ok(()));
        assert_eq!(asked(false, FlightMode::Loiter), Ok(()));
        assert_eq!(asked(false, FlightMode::Stabilize), Err(CommandError::Withdrawn));
    }

    /// MAVLink: progress 0 to 100, 255 if not known; COMMAND_CANCEL names the command and its target.
    #[test]
    fn what_is_in_progress_is_cancelled_when_it_is_withdrawn_and_tells_how_far_it_was() {
        let takeoff = Command::TakeOff { height_above_home_m: 5.0 };
        let id = MavCmd::MAV_CMD_NAV_TAKEOFF;
        let progress =
            |percent| ardu::COMMAND_ACK_DATA { progress: percent, ..ack(id, MavResult::MAV_RESULT_IN_PROGRESS, OWN) };
        let begun = || {
            let mut commands = Commands::default();
            commands.submit(1, takeoff).unwrap();
            commands.poll(to(), &Texts::default(), t(0.0));
            commands
        };
        let mut commands = begun();
        assert!(matches!(commands.withdraw(Some(to()), None, t(0.3))[..], [Effect::Done(1, _, Err(CommandError::Withdrawn))]));
        let mut commands = begun();
        commands.observe_ack(&progress(40), OWN.0, OWN.1, t(0.1));
        commands.observe_ack(&progress(255), OWN.0, OWN.1, t(0.2));
        let effects = commands.withdraw(Some(to()), None, t(0.3));
        let [Effect::Send(MavMessage::COMMAND_CANCEL(data)), Effect::Done(1, _, Err(CommandError::Withdrawn))] = &effects[..]
        else {
            panic!("{effects:?}")
        };
        assert_eq!((data.command, data.target_system, data.target_component), (id, 7, 1));
        let mut commands = begun();
        commands.observe_ack(&progress(40), OWN.0, OWN.1, t(0.1));
        let outcomes = (0..300).flat_map(|step| commands.poll(to(), &Texts::default(), t(f64::from(step) * 0.1)));
        let outcome = outcomes.filter_map(|effect| if let Effect::Done(_, _, outcome) = effect { Some(outcome) } else { None });
        let errors: Vec<_> = outcome.filter_map(Result::err).map(|error| error.to_string()).collect();
        assert_eq!(errors, ["the autopilot did not answer 4 tries, 40 % done"]);
    }

    /// MAVLink has results 0 to 10 here; ArduPilot and PX4 may get more.
    #[test]
    fn a_result_that_is_not_known_is_a_refusal_that_names_its_number() {
        let mut commands = Commands::default();
        commands.submit(1, Command::Arm).unwrap();
        commands.poll(to(), &Texts::default(), t(0.0));
        let arm = MavCmd::MAV_CMD_COMPONENT_ARM_DISARM;
        let answer = |target| Unlisted::Ack(ack(arm, MavResult::MAV_RESULT_TEMPORARILY_REJECTED, target), 77);
        commands.observe_unlisted(&answer((255, 190)), OWN.0, OWN.1, t(0.1));
        assert!(commands.poll(to(), &Texts::default(), t(0.5)).is_empty(), "another client's");
        commands.observe_unlisted(&answer(OWN), OWN.0, OWN.1, t(0.5));
        let effects = commands.poll(to(), &Texts::default(), t(0.9));
        let [Effect::Done(1, _, Err(error))] = &effects[..] else { panic!("{effects:?}") };
        assert_eq!(*error, CommandError::Refused { result: Refusal::Unlisted(77), words: None });
        assert_eq!(error.to_string(), "the autopilot refused: result 77, which is not known here");
    }

    /// GUIDED is sent twice, since its acknowledgement is slow; LAND after it was refused, and its refusal must not be missed for the
    /// second acknowledgement of GUIDED.
    #[test]
    fn a_late_second_acknowledgement_is_not_taken_for_the_next_commands() {
        let mut commands = Commands::default();
        let id = MavCmd::MAV_CMD_DO_SET_MODE;
        let sent = |effects: &[Effect]| effects.iter().filter(|effect| matches!(effect, Effect::Send(_))).count();
        commands.submit(1, Command::SetMode(FlightMode::Guided)).unwrap();
        commands.poll(to(), &Texts::default(), t(0.0));
        assert_eq!(sent(&commands.poll(to(), &Texts::default(), t(1.0))), 1);
        commands.observe_ack(&ack(id, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(1.1));
        commands.submit(2, Command::SetMode(FlightMode::Land)).unwrap();
        let effects = commands.poll(to(), &Texts::default(), t(1.1));
        assert!(matches!(effects[..], [Effect::Done(1, _, Ok(())), Effect::Send(_)]), "{effects:?}");
        commands.observe_ack(&ack(id, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(1.9));
        assert!(commands.poll(to(), &Texts::default(), t(1.9)).is_empty(), "that was for GUIDED");
        commands.observe_ack(&ack(id, MavResult::MAV_RESULT_FAILED, OWN), OWN.0, OWN.1, t(2.0));
        let effects = commands.poll(to(), &Texts::default(), t(2.4));
        assert!(matches!(effects[..], [Effect::Done(2, _, Err(CommandError::Refused { .. }))]), "{effects:?}");
        // Lost, rather than late, it costs one more try, and no more than that.
        commands.submit(3, Command::SetMode(FlightMode::Guided)).unwrap();
        commands.poll(to(), &Texts::default(), t(10.0));
        commands.poll(to(), &Texts::default(), t(11.0));
        commands.observe_ack(&ack(id, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(11.1));
        commands.submit(4, Command::SetMode(FlightMode::Land)).unwrap();
        let mut answered_s = None;
        for tenth in 111..150 {
            let now = t(f64::from(tenth) * 0.1);
            for effect in commands.poll(to(), &Texts::default(), now) {
                match effect {
                    Effect::Send(_) => {
                        commands.observe_ack(&ack(id, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, now);
                    }
                    Effect::Done(4, _, Ok(())) => answered_s = Some(f64::from(tenth) * 0.1),
                    _ => {}
                }
            }
        }
        assert!(answered_s.is_some_and(|s| s < 12.5), "{answered_s:?}");
        // Nor is it waited for once it is too late to come.
        commands.submit(5, Command::SetMode(FlightMode::Loiter)).unwrap();
        commands.poll(to(), &Texts::default(), t(30.0));
        commands.observe_ack(&ack(id, MavResult::MAV_RESULT_ACCEPTED, OWN), OWN.0, OWN.1, t(30.1));
        assert!(matches!(commands.poll(to(), &Texts::default(), t(30.1))[..], [Effect::Done(5, _, Ok(()))]));
    }

    /// MAVLink: whatever else comes while a long command runs is typically rejected with TEMPORARILY_REJECTED, a repetition included.
    #[test]
    fn busy_with_what_it_was_asked_twice_is_no_refusal_and_given_up_it_is_cancelled() {
        let id = MavCmd::MAV_CMD_NAV_TAKEOFF;
        let answer = |commands: &mut Commands, result, now| {
            commands.observe_ack(&ack(id, result, OWN), OWN.0, OWN.1, now);
        };
        let begun = || {
            let mut commands = Commands::default();
            commands.submit(1, Command::TakeOff { height_above_home_m: 5.0 }).unwrap();
            commands.poll(to(), &Texts::default(), t(0.0));
            answer(&mut commands, MavResult::MAV_RESULT_IN_PROGRESS, t(0.1));
            commands
        };
        let mut commands = begun();
        let effects = commands.poll(to(), &Texts::default(), t(5.2));
        assert!(matches!(effects[..], [Effect::Send(MavMessage::COMMAND_LONG(_))]), "{effects:?}");
        answer(&mut commands, MavResult::MAV_RESULT_TEMPORARILY_REJECTED, t(5.3));
        assert!(commands.poll(to(), &Texts::default(), t(9.0)).is_empty(), "it is at work");
        answer(&mut commands, MavResult::MAV_RESULT_ACCEPTED, t(9.1));
        assert!(matches!(commands.poll(to(), &Texts::default(), t(9.1))[..], [Effect::Done(1, _, Ok(()))]));
        // Not asked twice, it is one.
        let mut commands = begun();
        answer(&mut commands, MavResult::MAV_RESULT_TEMPORARILY_REJECTED, t(0.2));
        assert!(matches!(commands.poll(to(), &Texts::default(), t(1.0))[..], [Effect::Done(1, _, Err(_))]));
        // Silent from then on.
        let mut commands = begun();
        let effects: Vec<Effect> =
            (1..300).flat_map(|step| commands.poll(to(), &Texts::default(), t(f64::from(step) * 0.1))).collect();
        let [.., Effect::Send(MavMessage::COMMAND_CANCEL(data)), Effect::Done(1, _, Err(CommandError::TimedOut { .. }))] =
            &effects[..]
        else {
            panic!("{effects:?}")
        };
        assert_eq!(data.command, id);
    }

    #[test]
    fn one_command_id_at_a_time_and_a_bounded_line() {
        let mut commands = Commands::default();
        commands.submit(1, Command::SetMode(FlightMode::Guided)).unwrap();
        commands.submit(2, Command::SetMode(FlightMode::Land)).unwrap();
        commands.submit(3, Command::Arm).unwrap();
        assert_eq!(commands.poll(to(), &Texts::default(), t(0.0)).len(), 2);
        let mode = ack(MavCmd::MAV_CMD_DO_SET_MODE, MavResult::MAV_RESULT_ACCEPTED, OWN);
        commands.observe_ack(&mode, OWN.0, OWN.1, t(0.1));
        let effects = commands.poll(to(), &Texts::default(), t(0.1));
        assert!(matches!(effects[..], [Effect::Done(1, _, Ok(())), Effect::Send(_)]), "{effects:?}");
        while commands.submit(4, Command::Arm).is_ok() {}
        assert_eq!(commands.submit(4, Command::Arm), Err(CommandError::Busy));
        let ended = commands.abandon();
        assert_eq!(ended.len(), OPEN_MAX);
    }
}
