//! The ports on the real bus.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use futures::FutureExt as _;
use futures::future::BoxFuture;
use halcyon_chassis::{Bus, CallError, CancellationToken, Clock, topics};
use halcyon_model::{CommandReply, MissionCommand, RigId, VehicleCommand};
use tokio::time::Instant;

use crate::app::Store;
use crate::port::{CommandFailure, Commands, Previews};

/// Commands as queries on the bus.
pub(crate) struct BusCommands(Bus);

impl BusCommands {
    pub(crate) fn new(bus: Bus) -> Self {
        Self(bus)
    }
}

fn failure(error: &CallError, timeout: Duration) -> CommandFailure {
    match error {
        CallError::NobodyThere { .. } => CommandFailure::Nobody,
        CallError::Timeout { .. } => CommandFailure::Timeout(timeout),
        CallError::Invalid { .. } | CallError::Bus(_) => CommandFailure::Bus(error.to_string()),
    }
}

impl Commands for BusCommands {
    fn mission(&self, command: MissionCommand, timeout: Duration) -> BoxFuture<'_, Result<CommandReply, CommandFailure>> {
        async move {
            let answer = self.0.call(&topics::mission_command(), &command, timeout).await;
            answer.map_err(|error| failure(&error, timeout))
        }
        .boxed()
    }

    fn vehicle(&self, command: VehicleCommand, timeout: Duration) -> BoxFuture<'_, Result<CommandReply, CommandFailure>> {
        async move {
            let answer = self.0.call(&topics::vehicle_command(&command.vehicle), &command, timeout).await;
            answer.map_err(|error| failure(&error, timeout))
        }
        .boxed()
    }
}

/// Pictures flow for this long after someone looked, wall time.
const LOOKED_AT: Duration = Duration::from_secs(10);
/// Rigs looked at at the same time.
const RIGS_MAX: usize = 16;

/// Subscribes to a rig's pictures while someone looks at them.
pub(crate) struct BusPreviews {
    bus: Bus,
    clock: Clock,
    store: Arc<Store>,
    stop: CancellationToken,
    /// Until when each rig's pictures are wanted; an entry has a running task.
    wanted: Arc<Mutex<HashMap<RigId, Instant>>>,
}

impl BusPreviews {
    pub(crate) fn new(bus: Bus, clock: Clock, store: Arc<Store>, stop: CancellationToken) -> Self {
        Self { bus, clock, store, stop, wanted: Arc::default() }
    }
}

impl Previews for BusPreviews {
    fn want(&self, rig: &RigId) {
        let mut wanted = self.wanted.lock().unwrap_or_else(PoisonError::into_inner);
        let until = Instant::now() + LOOKED_AT;
        if let Some(held) = wanted.get_mut(rig) {
            *held = until;
        } else if wanted.len() < RIGS_MAX {
            wanted.insert(rig.clone(), until);
            let (bus, clock, store) = (self.bus.clone(), self.clock.clone(), Arc::clone(&self.store));
            let (stop, rig) = (self.stop.clone(), rig.clone());
            let mut entry = Entry { rig: rig.clone(), wanted: Arc::clone(&self.wanted), left: false };
            tokio::spawn(async move {
                if let Err(error) = look(&bus, &clock, &store, &stop, &rig, &mut entry).await {
                    tracing::warn!(%rig, %error, "pictures could not be had");
                }
            });
        }
    }
}

/// Leaves the table when the task ends, however it ends, and only once: by then the next task may own the row.
struct Entry {
    rig: RigId,
    wanted: Arc<Mutex<HashMap<RigId, Instant>>>,
    left: bool,
}

impl Entry {
    /// Until when the pictures are wanted; `None` once that has passed, and then the entry is gone.
    fn until(&mut self) -> Option<Instant> {
        let mut wanted = self.wanted.lock().unwrap_or_else(PoisonError::into_inner);
        let until = wanted.get(&self.rig).copied().filter(|until| *until > Instant::now());
        if until.is_none() {
            wanted.remove(&self.rig);
            self.left = true;
        }
        until
    }
}

impl Drop for Entry {
    fn drop(&mut self) {
        if !self.left {
            self.wanted.lock().unwrap_or_else(PoisonError::into_inner).remove(&self.rig);
        }
    }
}

async fn look(
    bus: &Bus,
    clock: &Clock,
    store: &Store,
    stop: &CancellationToken,
    rig: &RigId,
    entry: &mut Entry,
) -> Result<(), halcyon_chassis::BusError> {
    let mut previews = bus.subscribe(&topics::preview(rig)).await?;
    while let Some(until) = entry.until() {
        tokio::select! {
            () = stop.cancelled() => return Ok(()),
            () = tokio::time::sleep_until(until) => {}
            preview = previews.recv() => {
                store.write().preview(preview?, clock.now());
                store.preview_came();
            }
        }
    }
    Ok(())
}
