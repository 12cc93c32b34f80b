//! The only async: receives, steps the core, stores, publishes.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::Context as _;
use halcyon_chassis::{Context, EventDraft, Publisher, topics};
use halcyon_model::{CommandReply, DispatchPlan, Mission, MissionId, VehicleAction, VehicleCommand};
use tokio::task::JoinSet;
use tracing::{debug, trace};

use crate::config::Config;
use crate::core::{Effects, Ignored, Notice, Planner, ReleaseOrder};
use crate::store::StoreThread;

/// Finished missions whose last state stays available to those who join later.
const FINISHED_KEPT: usize = 200;

/// Runs the planner until it is told to stop.
///
/// Ordering: commands are carried out one after another; each is answered once what it changed is stored. A plan is published
/// after the store has its generation.
///
/// # Errors
/// If the store cannot be opened or written, or the bus fails. Nothing that was not stored has been announced.
pub async fn run(context: Context, config: Config) -> anyhow::Result<()> {
    let mut vehicles = context.bus.subscribe(&topics::vehicle_states()).await?;
    let mut seas = context.bus.subscribe(&topics::sea_states()).await?;
    let (store, saved) = StoreThread::open(PathBuf::from(&config.store)).await?;
    let mut answers = JoinSet::new();
    let mut out = Outlet {
        store,
        plans: context.bus.publisher(&topics::plan()).await?,
        missions: BTreeMap::new(),
        finished: VecDeque::new(),
        context: context.clone(),
    };
    let step = Duration::from_secs_f64(config.step_s);
    let (mut planner, effects) = Planner::restore(config, saved, context.clock.now());
    out.announce(effects, &mut answers).await?;
    // Served only now: a command must find the missions that the store knows.
    let mut commands = context.bus.serve(&topics::mission_command()).await?;
    let mut ticker = context.clock.every(step);
    loop {
        tokio::select! {
            () = context.stop.cancelled() => return Ok(()),
            state = vehicles.recv() => {
                let state = state?;
                let vehicle = state.vehicle.clone();
                ignored(planner.observe_vehicle(state, context.clock.now()), "vehicle_state", vehicle.as_str());
            }
            sea = seas.recv() => {
                let sea = sea?;
                let rig = sea.rig.clone();
                let now = context.clock.now();
                ignored(planner.observe_sea(sea, now), "sea_state", rig.as_str());
                // A verdict that turned must not wait for the next tick.
                out.announce(planner.step(now), &mut answers).await?;
            }
            Some(answered) = answers.join_next() => {
                let Answered { mission, attempt, answer } = answered.context("a release was given up")?;
                debug!(%mission, ?answer, "payload");
                out.announce(planner.observe_release(&mission, attempt, answer, context.clock.now()), &mut answers).await?;
            }
            incoming = commands.recv() => {
                let incoming = incoming?;
                let (reply, effects) = planner.command(&incoming.command, context.clock.now());
                debug!(who = incoming.command.who, accepted = reply.accepted, reason = reply.reason, "mission command");
                metrics::counter!("planner_commands_total", "accepted" => reply.accepted.to_string()).increment(1);
                if let Err(error) = out.announce(effects, &mut answers).await {
                    incoming.reply(&CommandReply::refused(reply.stamp, format!("it could not be stored: {error:#}"))).await;
                    return Err(error);
                }
                incoming.reply(&reply).await;
            }
            _ = ticker.tick() => {
                out.announce(planner.step(context.clock.now()), &mut answers).await?;
                let under_way = planner.missions().count();
                metrics::gauge!("planner_missions").set(under_way as f64);
                context.health.ready(format!("missions under way: {under_way}"));
            }
        }
    }
}

fn ignored(taken: Result<(), Ignored>, topic: &'static str, sender: &str) {
    match taken {
        Ok(()) => {}
        // Late arrivals are normal on a mesh, and after a history.
        Err(Ignored::Old) => trace!(topic, sender, "an older message came late"),
        Err(reason) => {
            metrics::counter!("planner_messages_ignored_total", "topic" => topic).increment(1);
            debug!(topic, sender, %reason, "message ignored");
        }
    }
}

/// Where effects go.
struct Outlet {
    store: StoreThread,
    plans: Publisher<DispatchPlan>,
    missions: BTreeMap<MissionId, Publisher<Mission>>,
    /// Finished missions that still have a publisher, oldest first.
    finished: VecDeque<MissionId>,
    context: Context,
}

impl Outlet {
    /// Stores, then announces.
    async fn announce(&mut self, effects: Effects, answers: &mut JoinSet<Answered>) -> anyhow::Result<()> {
        let Effects { records, plan, missions, notices, releases } = effects;
        self.store.append(records).await.context("what the planner decided was not stored, and so not announced")?;
        if let Some(plan) = plan {
            self.plans.put(&plan).await?;
            metrics::counter!("planner_plans_total").increment(1);
        }
        for mission in missions {
            self.publish(&mission).await?;
        }
        for notice in notices {
            self.context.event(draft(notice)).await;
        }
        // Each is waited for beside everything else. There is at most one a mission.
        for order in releases {
            answers.spawn(release(self.context.clone(), order));
        }
        Ok(())
    }

    async fn publish(&mut self, mission: &Mission) -> anyhow::Result<()> {
        if !self.missions.contains_key(&mission.id) {
            let publisher = self.context.bus.publisher(&topics::mission(&mission.id)).await?;
            self.missions.insert(mission.id.clone(), publisher);
        }
        if let Some(publisher) = self.missions.get(&mission.id) {
            publisher.put(mission).await?;
        }
        if mission.phase.is_final() {
            self.finished.push_back(mission.id.clone());
            if self.finished.len() > FINISHED_KEPT
                && let Some(oldest) = self.finished.pop_front()
            {
                self.missions.remove(&oldest);
            }
        }
        Ok(())
    }
}

/// What came of a request to let a payload go.
struct Answered {
    mission: MissionId,
    attempt: u32,
    answer: Result<(), String>,
}

/// Asks the vehicle, and waits until its deadline.
async fn release(context: Context, order: ReleaseOrder) -> Answered {
    let ReleaseOrder { mission, vehicle, attempt, stamp, deadline } = order;
    let who = format!("mission {mission}");
    let topic = topics::vehicle_command(&vehicle);
    let command = VehicleCommand { stamp, deadline, who, vehicle, action: VehicleAction::ReleasePayload };
    // Fleet time may be faster than the wall's; longer than this nobody waits.
    let timeout = Duration::from_secs_f64(deadline.seconds_since(stamp).max(0.1));
    let answer = match context.bus.call(&topic, &command, timeout).await {
        Ok(reply) if reply.accepted => Ok(()),
        Ok(reply) => Err(reply.reason),
        Err(error) => Err(error.to_string()),
    };
    Answered { mission, attempt, answer }
}

fn draft(notice: Notice) -> EventDraft {
    let mut draft = EventDraft::new(notice.severity, notice.what, notice.why);
    if let Some(vehicle) = &notice.vehicle {
        draft = draft.vehicle(vehicle);
    }
    if let Some(mission) = &notice.mission {
        draft = draft.mission(mission);
    }
    draft
}
