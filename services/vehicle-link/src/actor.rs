//! The one task of the service: owns the executor and the autopilot's picture, waits for whatever comes next.
//!
//! Promises: telemetry, plans, neighbours and commands are taken in the order in which each comes; guidance ticks at its own
//! rate, late ticks are skipped. When full, the bus's inboxes drop their oldest, the link its newest. A restart forgets direct
//! commands and how long a fail-safe has lasted; the next plan brings the task back.

use std::collections::BTreeMap;
use std::time::Duration;

use anyhow::bail;
use halcyon_chassis::{Context, EventDraft, Incoming, Publisher, topics};
use halcyon_model::{CommandReply, Stamp, VehicleAction, VehicleCommand, VehicleId, VehicleState};
use tokio_util::sync::CancellationToken;
use tracing::{debug, info, trace, warn};

use crate::autopilot::Autopilot;
use crate::config::{Config, Signing};
use crate::core::coasting;
use crate::core::commands::{Command, CommandError, Effect, Ticket};
use crate::core::encode;
use crate::core::executor::{Decision, Executor, ExecutorConfig, Output, PlanAnswer, word};
use crate::core::signing::{self, Signer, Verdict};
use crate::core::transfers::Ending;
use crate::io::key;
use crate::io::link::{Link, LinkEvent, LinkOptions};

/// What the service asks for itself; nobody waits for it.
const OWN_TICKET: Ticket = 0;
/// Commands that wait for the autopilot's answer at once; more are refused.
const WAITING_MAX: usize = 16;
/// However often a leader speaks, guidance steps no more often than this, seconds.
const STEP_S_MIN: f64 = 0.02;
/// People are told how far a long transfer is this often, seconds.
const TELL_S: f64 = 5.0;
/// The last target is sent so often, so far apart.
const FAREWELLS: usize = 3;
const FAREWELL: Duration = Duration::from_millis(30);
/// A greater share of lost frames is told.
const LOSS_MAX: f64 = 0.2;
/// So long after the last frame with a foreign signature that is still told, seconds.
const REJECTED_S: f64 = 5.0;

/// Runs until `context.stop`.
///
/// # Errors
/// If the bus session is gone.
pub async fn run(context: Context, config: Config) -> anyhow::Result<()> {
    let vehicle = VehicleId::new(&config.vehicle)?;
    let mut plans = context.bus.subscribe(&topics::plan()).await?;
    let mut others = context.bus.subscribe(&topics::vehicle_states()).await?;
    let mut commands = context.bus.serve(&topics::vehicle_command(&vehicle)).await?;
    let states = context.bus.publisher(&topics::vehicle_state(&vehicle)).await?;
    // Ends after everything else, so that the last target is still sent.
    let link_stop = CancellationToken::new();
    let _link_ends = link_stop.clone().drop_guard();
    let mut link = Link::start(link_options(&config)?, context.clock.clone(), link_stop);
    let mut guidance = context.clock.every(Duration::from_secs_f64(1.0 / config.guidance_rate_hz));
    let mut publishing = context.clock.every(Duration::from_secs_f64(1.0 / config.state_rate_hz));
    let mut heartbeat = context.clock.every(Duration::from_secs(1));
    let mut service = Service::new(&context, &config, vehicle, states)?;
    info!(vehicle = config.vehicle, endpoint = config.endpoint, "vehicle link starts");
    loop {
        tokio::select! {
            () = context.stop.cancelled() => {
                service.leave(&link).await;
                return Ok(());
            }
            event = link.recv() => match event {
                Some(event) => service.observe_link(event, &link).await,
                None => bail!("the link's task has ended"),
            },
            plan = plans.recv() => {
                let answer = service.executor.observe_plan(&plan?, context.clock.now());
                match answer {
                    PlanAnswer::Accepted | PlanAnswer::Known => trace!(?answer, "plan"),
                    PlanAnswer::RefusedOlder { .. } | PlanAnswer::RefusedInvalid(_) => debug!(?answer, "plan refused"),
                }
            }
            state = others.recv() => service.neighbour(state?, &link).await,
            incoming = commands.recv() => service.command(incoming?, &link).await,
            now = guidance.tick() => service.step(now, &link).await,
            now = publishing.tick() => service.publish(now).await?,
            _ = heartbeat.tick() => link.send(service.autopilot.header(), encode::heartbeat()),
        }
    }
}

fn link_options(config: &Config) -> anyhow::Result<LinkOptions> {
    let Signing { key_file, link_id } = &config.signing;
    let signer = if key_file.as_os_str().is_empty() { None } else { Some(Signer::new(key::read(key_file)?, *link_id)) };
    let parse = |place: &String| place.parse().map_err(anyhow::Error::msg);
    let relay = config.relay.iter().map(parse).collect::<anyhow::Result<_>>()?;
    Ok(LinkOptions { endpoint: parse(&config.endpoint)?, signer, relay })
}

struct Service<'a> {
    context: &'a Context,
    vehicle: VehicleId,
    executor: Executor,
    autopilot: Autopilot,
    states: Publisher<VehicleState>,
    waiting: BTreeMap<Ticket, Incoming<VehicleCommand>>,
    next_ticket: Ticket,
    link_problem: Option<String>,
    signs: bool,
    rejected: Option<(Stamp, Verdict)>,
    published: Option<Stamp>,
    stepped: Option<Stamp>,
    told: Option<Stamp>,
}

impl<'a> Service<'a> {
    fn new(context: &'a Context, config: &Config, vehicle: VehicleId, states: Publisher<VehicleState>) -> anyhow::Result<Self> {
        let executor = Executor::new(ExecutorConfig {
            vehicle: vehicle.clone(),
            limits: config.limits.clone(),
            fail_safe: config.fail_safe.clone(),
            guidance: config.guidance.clone(),
            payload: config.payload.clone(),
            home_height_m: config.home_height_m,
            frame: context.origin.frame(),
        });
        let autopilot = Autopilot::new(config, context.origin, context.clock.now())?;
        let link_problem = Some(format!("connecting to {}", config.endpoint));
        Ok(Self {
            context,
            vehicle,
            executor,
            autopilot,
            states,
            waiting: BTreeMap::new(),
            next_ticket: 1,
            link_problem,
            signs: !config.signing.key_file.as_os_str().is_empty(),
            rejected: None,
            published: None,
            stepped: None,
            told: None,
        })
    }

    async fn observe_link(&mut self, event: LinkEvent, link: &Link) {
        match event {
            LinkEvent::Up => {
                self.link_problem = Some("connected, waiting for the autopilot's heartbeat".into());
                // Over UDP this is how the other end learns where we are.
                link.send(self.autopilot.header(), encode::heartbeat());
            }
            LinkEvent::Down(why) => {
                let was_found = self.autopilot.found();
                let ended = self.autopilot.link_down();
                self.carry_out(ended, link).await;
                self.link_problem = Some(why.clone());
                if was_found {
                    self.event(EventDraft::warning("link to the autopilot lost", why)).await;
                }
            }
            LinkEvent::Message(header, message) => {
                let now = self.context.clock.now();
                let heard = self.autopilot.observe(header, &message, now);
                if let Some(reply) = heard.reply {
                    link.send(self.autopilot.header(), reply);
                }
                if let Some(system) = heard.found {
                    self.link_problem = None;
                    self.event(EventDraft::info("autopilot found", format!("MAVLink system {system}"))).await;
                    self.autopilot.ask_coasting(OWN_TICKET, now);
                }
                if let Some(text) = heard.text {
                    info!(vehicle = %self.vehicle, "autopilot: {text}");
                    self.executor.observe_text(&text, now);
                }
                if heard.transfer {
                    let effects = self.autopilot.poll_transfers(now);
                    self.carry_out(effects, link).await;
                }
                if heard.state
                    && let Some((state, mode_heard)) = self.autopilot.state(now)
                {
                    self.executor.observe_self(state, mode_heard, now);
                }
            }
            LinkEvent::Station(system, what) => {
                if self.autopilot.is_system(system) {
                    self.executor.observe_station(what);
                }
            }
            LinkEvent::StationGuided(system) => {
                if self.autopilot.is_system(system) {
                    self.executor.observe_station_guided(self.context.clock.now());
                }
            }
            LinkEvent::Unread(header, answer) => {
                let now = self.context.clock.now();
                if self.autopilot.observe_unread(header, answer.as_deref(), now) {
                    let effects = self.autopilot.poll_transfers(now);
                    self.carry_out(effects, link).await;
                }
            }
            LinkEvent::Rejected(verdict) => {
                let now = self.context.clock.now();
                if self.rejected.is_none_or(|(at, _)| now.seconds_since(at) > REJECTED_S) {
                    let why = format!("dropped; the first was {}", verdict.word().replace('_', " "));
                    self.event(EventDraft::warning("frames without our signature", why)).await;
                }
                self.rejected = Some((now, verdict));
            }
        }
    }

    /// Another vehicle's state. The leader's is worth a step at once: waiting for the next tick would be the greatest part of the
    /// follower's lag.
    async fn neighbour(&mut self, state: VehicleState, link: &Link) {
        let now = self.context.clock.now();
        let leads = self.executor.is_led_by(&state.vehicle);
        self.executor.observe_neighbour(state, now);
        if leads && self.stepped.is_none_or(|stepped| now.seconds_since(stepped) >= STEP_S_MIN) {
            self.step(now, link).await;
        }
    }

    /// Nobody will guide any more: has the vehicle stop, and waits until that is sent.
    async fn leave(&self, link: &Link) {
        let now = self.context.clock.now();
        let Some(message) = self.executor.farewell(now).and_then(|stop| self.autopilot.setpoint(&stop, now)) else { return };
        // One of them may be lost.
        for _ in 0..FAREWELLS {
            link.send(self.autopilot.header(), message.clone());
            self.context.clock.sleep(FAREWELL).await;
        }
    }

    /// One guidance step, and whatever the command protocol has due.
    async fn step(&mut self, now: Stamp, link: &Link) {
        self.stepped = Some(now);
        for output in self.executor.step(now) {
            match output {
                Output::Setpoint(setpoint) => {
                    if let Some(message) = self.autopilot.setpoint(&setpoint, now) {
                        link.send(self.autopilot.header(), message);
                    }
                }
                Output::Request(command) => {
                    if let Err(error) = self.autopilot.submit(0, command) {
                        self.executor.observe_outcome(&command, &Err(error), now);
                    }
                }
                Output::Withdraw => {
                    let ended = self.autopilot.withdraw(now);
                    self.carry_out(ended, link).await;
                }
                Output::AskStreams => self.autopilot.started_again(),
                Output::Note(note) => self.event(EventDraft::new(note.severity, note.what, note.why)).await,
            }
        }
        let effects = self.autopilot.poll(now);
        self.carry_out(effects, link).await;
        if let Some(slow) = self.autopilot.slow_streams() {
            let why = format!("{slow}; asked for again (a ground station may have lowered it, or the link is too slow)");
            self.event(EventDraft::warning("telemetry comes less often than asked for", why)).await;
        }
        self.tell_progress(now).await;
        self.report(now, link);
    }

    async fn carry_out(&mut self, effects: Vec<Effect>, link: &Link) {
        for effect in effects {
            match effect {
                Effect::Send(message) => link.send(self.autopilot.header(), message),
                Effect::Done(_, Command::SetInterval(stream), outcome) => {
                    if let Err(error) = outcome {
                        debug!(message_id = stream.message_id, %error, "stream not set");
                    }
                }
                Effect::Transferred(OWN_TICKET, ending) => {
                    if let Some(why) = coasting::problem(&ending) {
                        self.event(EventDraft::warning("the autopilot flies on for long without us", why)).await;
                    }
                }
                Effect::Transferred(ticket, ending) => {
                    if let Some(incoming) = self.waiting.remove(&ticket) {
                        self.answer_transfer(incoming, ending, self.context.clock.now()).await;
                    }
                }
                Effect::Done(ticket, command, outcome) => {
                    let now = self.context.clock.now();
                    match self.waiting.remove(&ticket) {
                        Some(incoming) => self.answer(incoming, &outcome, now).await,
                        None => self.executor.observe_outcome(&command, &outcome, now),
                    }
                }
            }
        }
    }

    async fn answer(&self, incoming: Incoming<VehicleCommand>, outcome: &Result<(), CommandError>, now: Stamp) {
        let reply = match outcome {
            Ok(()) => CommandReply::accepted(now, "done by the autopilot"),
            Err(error) => CommandReply::refused(now, error.to_string()),
        };
        incoming.reply(&reply).await;
    }

    /// Whatever was written is told to people.
    async fn answer_transfer(&self, incoming: Incoming<VehicleCommand>, ending: Ending, now: Stamp) {
        let who = incoming.command.who.clone();
        let reads = matches!(
            incoming.command.action,
            VehicleAction::ReadParameter { .. } | VehicleAction::ReadParameters | VehicleAction::DownloadItems { .. }
        );
        let reply = match ending {
            Ok(done) => CommandReply { content: done.content, ..CommandReply::accepted(now, done.what) },
            Err(error) => CommandReply::refused(now, error.to_string()),
        };
        if !reads {
            let why = format!("for {who}");
            let event = if reply.accepted {
                EventDraft::info(reply.reason.clone(), why)
            } else {
                EventDraft::warning(format!("transfer failed: {}", reply.reason), why)
            };
            self.event(event).await;
        }
        if reply.content.is_some() {
            incoming.reply_twice(reply);
        } else {
            incoming.reply(&reply).await;
        }
    }

    /// Says every few seconds how far a long transfer is.
    async fn tell_progress(&mut self, now: Stamp) {
        let Some((what, since, done, total)) = self.autopilot.transferring() else {
            self.told = None;
            return;
        };
        if now.seconds_since(self.told.unwrap_or(since).max(since)) >= TELL_S {
            let draft = EventDraft::info(what.to_owned(), format!("{done} of {total}"));
            self.told = Some(now);
            self.event(draft).await;
        }
    }

    async fn command(&mut self, incoming: Incoming<VehicleCommand>, link: &Link) {
        let now = self.context.clock.now();
        let reply = match self.executor.command(&incoming.command, now) {
            Decision::Accepted(what) => CommandReply::accepted(now, what),
            Decision::Refused(why) => {
                warn!(vehicle = %self.vehicle, who = incoming.command.who, why, "command refused");
                CommandReply::refused(now, why)
            }
            Decision::CancelTransfers => {
                let (count, ended) = self.autopilot.cancel_transfers();
                self.carry_out(ended, link).await;
                CommandReply::accepted(now, format!("{count} transfers cancelled"))
            }
            Decision::Transfer(_) if self.waiting.len() >= WAITING_MAX => {
                CommandReply::refused(now, CommandError::Busy.to_string())
            }
            Decision::Transfer(request) => {
                let ticket = self.next_ticket;
                self.next_ticket += 1;
                match self.autopilot.transfer(ticket, request, incoming.command.deadline) {
                    Ok(()) => {
                        self.waiting.insert(ticket, incoming);
                        let effects = self.autopilot.poll_transfers(now);
                        self.carry_out(effects, link).await;
                        return;
                    }
                    Err(error) => CommandReply::refused(now, error.to_string()),
                }
            }
            // A termination waits for no place.
            Decision::Ask(command) if self.waiting.len() >= WAITING_MAX && command != (Command::Disarm { force: true }) => {
                CommandReply::refused(now, CommandError::Busy.to_string())
            }
            Decision::Ask(command) => {
                let ticket = self.next_ticket;
                self.next_ticket += 1;
                match self.autopilot.submit(ticket, command) {
                    Ok(()) => {
                        self.waiting.insert(ticket, incoming);
                        return;
                    }
                    Err(error) => CommandReply::refused(now, error.to_string()),
                }
            }
        };
        incoming.reply(&reply).await;
    }

    /// Publishes the newest state; nothing new is said again once a second, with its old stamp, so that its age shows.
    async fn publish(&mut self, now: Stamp) -> anyhow::Result<()> {
        let Some((mut state, _)) = self.autopilot.state(now) else { return Ok(()) };
        self.executor.complete(&mut state);
        let silent_s = now.seconds_since(state.stamp);
        let repeat = self.published.is_some_and(|published| now.seconds_since(published) < 1.0);
        if silent_s > 1.0 && repeat {
            return Ok(());
        }
        self.published = Some(now);
        self.states.put(&state).await?;
        Ok(())
    }

    /// What is wrong though messages come.
    fn link_flaw(&self, now: Stamp, link: &Link) -> Option<String> {
        if self.signs && !signing::clock_can_sign(now) {
            return Some("the clock is before 2015: nothing can be signed, so nothing is sent".into());
        }
        if let Some((at, verdict)) = self.rejected
            && now.seconds_since(at) <= REJECTED_S
        {
            return Some(format!("frames without our signature ({})", verdict.word().replace('_', " ")));
        }
        if self.autopilot.loss() > LOSS_MAX {
            return Some("more than 20 % of the autopilot's frames are lost".into());
        }
        link.station_trouble()
    }

    fn report(&self, now: Stamp, link: &Link) {
        let flaw = self.link_flaw(now, link);
        match (self.link_problem.as_ref().or(flaw.as_ref()), self.autopilot.missing()) {
            // While nobody else is found, the one that won't be flown is what people must know.
            (Some(_), unfit) if !self.autopilot.found() && unfit.contains("not a multicopter") => {
                self.context.health.degraded(unfit);
            }
            (Some(problem), _) => self.context.health.degraded(problem.clone()),
            (None, "") => {
                let (activity, detail) = (word(self.executor.activity()), self.executor.detail());
                // Running numbers would make a change of health of every step.
                let shifting = detail.chars().any(|c| c.is_ascii_digit()) || detail.is_empty();
                self.context.health.ready(if shifting { activity.to_owned() } else { format!("{activity}: {detail}") });
            }
            (None, missing) => self.context.health.degraded(missing),
        }
    }

    async fn event(&self, draft: EventDraft) {
        self.context.event(draft.vehicle(&self.vehicle)).await;
    }
}
