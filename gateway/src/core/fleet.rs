//! The latest of everything on the bus, in bounded memory.
//!
//! Each change gets a revision, so that a stream can ask for what changed since. Nothing here waits or does I/O.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

use halcyon_model::{
    DispatchPlan, Event, FleetOrigin, Health, InstanceId, Mission, MissionId, Preview, RigId, SeaState, Stamp, SurfacePatch,
    VehicleId, VehicleState,
};

use super::series::RigSeries;
use super::table::{Kept, Table};
use crate::api::dto::{self, Edge, StreamMessage};

/// Bounds and ages, from the configuration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Vehicles kept.
    pub vehicles: usize,
    /// Rigs kept.
    pub rigs: usize,
    /// Missions kept.
    pub missions: usize,
    /// Service instances kept.
    pub services: usize,
    /// Events kept.
    pub events: usize,
    /// Length of each rig's series, seconds.
    pub series_s: f64,
    /// A vehicle is stale after this, seconds.
    pub vehicle_age_s: f64,
    /// A rig's surface or sea state is stale after this, seconds.
    pub rig_age_s: f64,
    /// A service is stale after this, seconds.
    pub service_age_s: f64,
}

/// An event with its number.
#[derive(Debug, Clone)]
pub struct NumberedEvent {
    /// Counts events since the gateway started, from 1.
    pub sequence: u64,
    /// Revision at which it came.
    pub revision: u64,
    /// The event.
    pub event: Event,
}

/// Everything that the gateway knows about the fleet.
#[derive(Debug)]
pub struct Fleet {
    origin: FleetOrigin,
    limits: Limits,
    revision: u64,
    /// Vehicles' states.
    pub vehicles: Table<VehicleId, VehicleState>,
    /// Rigs' newest sea states.
    pub sea_states: Table<RigId, SeaState>,
    /// Rigs' newest surfaces.
    pub surfaces: Table<RigId, SurfacePatch>,
    /// Rigs' newest pictures.
    pub previews: Table<RigId, Preview>,
    /// Missions.
    pub missions: Table<MissionId, Mission>,
    /// Services' health.
    pub services: Table<InstanceId, Health>,
    /// Services whose presence on the bus ended.
    gone: BTreeSet<InstanceId>,
    series: BTreeMap<RigId, RigSeries>,
    plan: Option<Kept<DispatchPlan>>,
    events: VecDeque<NumberedEvent>,
    events_heard: u64,
}

impl Fleet {
    /// Knows nothing yet.
    #[must_use]
    pub fn new(origin: FleetOrigin, limits: Limits) -> Self {
        Self {
            origin,
            limits,
            revision: 0,
            vehicles: Table::new(limits.vehicles, limits.vehicle_age_s),
            sea_states: Table::new(limits.rigs, limits.rig_age_s),
            surfaces: Table::new(limits.rigs, limits.rig_age_s),
            previews: Table::new(limits.rigs, limits.rig_age_s),
            missions: Table::new(limits.missions, f64::INFINITY),
            services: Table::new(limits.services, limits.service_age_s),
            gone: BTreeSet::new(),
            series: BTreeMap::new(),
            plan: None,
            events: VecDeque::new(),
            events_heard: 0,
        }
    }

    /// Grows with every change.
    #[must_use]
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Conversion to JSON at `now`.
    #[must_use]
    pub fn edge(&self, now: Stamp) -> Edge {
        Edge::new(&self.origin, now)
    }

    fn next_revision(&mut self) -> u64 {
        self.revision += 1;
        self.revision
    }

    /// A vehicle said how it is.
    pub fn vehicle(&mut self, state: VehicleState, now: Stamp) {
        let revision = self.next_revision();
        self.vehicles.put(state.vehicle.clone(), state, now, revision);
    }

    /// A rig measured the sea.
    pub fn sea_state(&mut self, sea: SeaState, now: Stamp) {
        let revision = self.next_revision();
        let rig = sea.rig.clone();
        let known = self.series.contains_key(&rig);
        if !known && self.series.len() >= self.limits.rigs {
            // The table of sea states forgets rigs; their series go with them.
            let forgotten = self.series.keys().find(|rig| self.sea_states.get(rig).is_none()).cloned();
            let room = forgotten.or_else(|| self.series.keys().next().cloned());
            room.and_then(|rig| self.series.remove(&rig));
        }
        self.series.entry(rig.clone()).or_default().join(&sea, self.limits.series_s);
        self.sea_states.put(rig, sea, now, revision);
    }

    /// A rig's newest patch of water.
    pub fn surface(&mut self, patch: SurfacePatch, now: Stamp) {
        let revision = self.next_revision();
        self.surfaces.put(patch.rig.clone(), patch, now, revision);
    }

    /// A rig's newest pictures.
    pub fn preview(&mut self, preview: Preview, now: Stamp) {
        let revision = self.next_revision();
        self.previews.put(preview.rig.clone(), preview, now, revision);
    }

    /// A mission changed.
    pub fn mission(&mut self, mission: Mission, now: Stamp) {
        let revision = self.next_revision();
        self.missions.put(mission.id.clone(), mission, now, revision);
    }

    /// A service said how it is.
    pub fn health(&mut self, health: Health, now: Stamp) {
        let revision = self.next_revision();
        self.gone.remove(&health.instance);
        self.services.put(health.instance.clone(), health, now, revision);
    }

    /// A service came to the bus, or left it without a word.
    pub fn presence(&mut self, instance: InstanceId, alive: bool) {
        if alive {
            self.gone.remove(&instance);
        } else if self.services.get(&instance).is_some() {
            // Bounded by the table of services.
            self.gone.insert(instance);
            self.gone.retain(|instance| self.services.get(instance).is_some());
        }
    }

    /// A plan was issued; an older generation is refused, as every vehicle does.
    pub fn dispatch_plan(&mut self, plan: DispatchPlan, now: Stamp) {
        if self.plan.as_ref().is_some_and(|held| plan.generation < held.value.generation) {
            return;
        }
        let revision = self.next_revision();
        let expired = now > plan.valid_until;
        self.plan = Some(Kept { value: plan, revision, stale: false, expired });
    }

    /// Something happened.
    pub fn event(&mut self, event: Event) {
        let revision = self.next_revision();
        self.events_heard += 1;
        self.events.push_back(NumberedEvent { sequence: self.events_heard, revision, event });
        while self.events.len() > self.limits.events {
            self.events.pop_front();
        }
    }

    /// Lets time pass: what went stale or expired since counts as changed.
    pub fn refresh(&mut self, now: Stamp) {
        let revision = self.revision + 1;
        let mut changed = self.vehicles.refresh(now, revision, |_| false);
        changed |= self.sea_states.refresh(now, revision, |sea| now > sea.verdict.valid_until);
        changed |= self.services.refresh(now, revision, |health| self.gone.contains(&health.instance));
        changed |= self.surfaces.refresh(now, revision, |_| false);
        changed |= self.previews.refresh(now, revision, |_| false);
        if let Some(kept) = &mut self.plan {
            let clearance_lapsed = kept.value.assignments.iter().any(|assignment| match &assignment.task {
                halcyon_model::Task::Land { clearance: Some(clearance), .. } => now > clearance.valid_until,
                _ => false,
            });
            // `stale` is free for the clearance: a plan's own age does not matter, only its validity.
            let judgement = (clearance_lapsed, now > kept.value.valid_until);
            if judgement != (kept.stale, kept.expired) {
                (kept.stale, kept.expired) = judgement;
                kept.revision = revision;
                changed = true;
            }
        }
        if changed {
            self.revision = revision;
        }
    }

    /// The newest plan.
    #[must_use]
    pub fn plan(&self) -> Option<&DispatchPlan> {
        self.plan.as_ref().map(|kept| &kept.value)
    }

    /// A rig's series.
    #[must_use]
    pub fn series(&self, rig: &RigId) -> Option<&RigSeries> {
        self.series.get(rig)
    }

    /// Events, newest first.
    pub fn events(&self) -> impl Iterator<Item = &NumberedEvent> {
        self.events.iter().rev()
    }

    /// A mission as JSON.
    #[must_use]
    pub fn mission_json(&self, id: &MissionId, now: Stamp) -> Option<dto::Mission> {
        self.missions.get(id).map(|kept| dto::Mission::new(&kept.value, &self.edge(now)))
    }

    /// What changed after `revision`, as the stream tells it; of events at most the newest `events_max`, oldest first.
    #[must_use]
    pub fn changes_since(&self, revision: u64, events_max: usize, now: Stamp) -> Vec<StreamMessage> {
        let edge = self.edge(now);
        let mut messages = Vec::new();
        messages.extend(
            self.services
                .since(revision)
                .map(|kept| StreamMessage::Service(dto::Service::new(&kept.value, kept.stale || kept.expired, &edge))),
        );
        messages.extend(
            self.vehicles.since(revision).map(|kept| StreamMessage::Vehicle(dto::Vehicle::new(&kept.value, kept.stale, &edge))),
        );
        messages.extend(
            self.sea_states
                .since(revision)
                .map(|kept| StreamMessage::SeaState(Box::new(dto::SeaState::new(&kept.value, kept.stale, &edge)))),
        );
        messages
            .extend(self.missions.since(revision).map(|kept| StreamMessage::Mission(dto::Mission::new(&kept.value, &edge))));
        let plan = self.plan.iter().filter(|kept| kept.revision > revision);
        messages.extend(plan.map(|kept| StreamMessage::Plan(dto::Plan::new(&kept.value, &edge))));

        let new_events = self.events.iter().rev().take_while(|event| event.revision > revision).take(events_max).count();
        let events = self.events.iter().skip(self.events.len() - new_events);
        messages.extend(events.map(|event| StreamMessage::Event(dto::Event::new(event.sequence, &event.event))));
        messages
    }
}
