//! The only async: patches in, sea states out.

use std::time::Duration;

use anyhow::Context as _;
use halcyon_chassis::{Context, EventDraft, topics};
use halcyon_model::{RigId, SeaState, VehicleId, VerdictState};
use metrics::{counter, gauge};
use tokio::task::{JoinError, JoinHandle, spawn_blocking};
use tracing::{trace, warn};

use crate::config::Config;
use crate::core::{Around, Assessor, Glance, PatchError};

/// How often silence is looked for, and whether it is time to look around.
const TICK: Duration = Duration::from_millis(500);

/// Assesses one rig's patches until told to stop.
///
/// Patches that come faster than they are used are replaced by newer ones on the way; one that comes late takes its place in time. A restart forgets the window.
///
/// # Errors
/// If the configuration has no valid rig, or the bus is gone.
pub async fn run(context: Context, config: Config) -> anyhow::Result<()> {
    let rig = RigId::new(&config.rig).context("rig")?;
    let vehicle = VehicleId::new(&config.rig).context("rig")?;
    let mut assessor = Assessor::new(config)?;
    let mut patches = context.bus.subscribe(&topics::surface(&rig)).await?;
    // A rig is called after the vehicle that carries it; a fixed one has none, and nobody speaks.
    let mut vehicle_states = context.bus.subscribe(&topics::vehicle_state(&vehicle)).await?;
    let sea_states = context.bus.publisher(&topics::sea_state(&rig)).await?;
    let mut ticker = context.clock.every(TICK);
    let mut shell = Shell { context: &context, rig: &rig, verdict: None };
    // One look around at a time, beside the patches: it takes a hundred times as long as one of them.
    let mut looking: Option<JoinHandle<Around>> = None;
    context.health.ready("waiting for surface patches");
    loop {
        let sea_state = tokio::select! {
            () = context.stop.cancelled() => return Ok(()),
            patch = patches.recv() => {
                let patch = patch?;
                match assessor.observe(&patch, context.clock.now()) {
                    Ok(sea_state) => sea_state,
                    Err(error) => {
                        reject(&error);
                        None
                    }
                }
            }
            state = vehicle_states.recv() => {
                assessor.hear(&state?, context.clock.now());
                None
            }
            around = finished(&mut looking) => {
                assessor.notice(around.context("look around")?);
                None
            }
            now = ticker.tick() => {
                if looking.is_none() {
                    looking = assessor.glance().map(|glance: Glance| spawn_blocking(|| glance.look()));
                }
                if let Some(silent_s) = assessor.silent_s(now) {
                    gauge!("assessment_patch_age_seconds").set(silent_s);
                }
                assessor.tick(now)
            }
        };
        if let Some(sea_state) = sea_state {
            sea_states.put(&sea_state).await?;
            shell.tell(&sea_state).await;
        }
    }
}

/// What a look around found, once it is done; never without one.
async fn finished(looking: &mut Option<JoinHandle<Around>>) -> Result<Around, JoinError> {
    let found = match looking {
        Some(handle) => handle.await,
        None => std::future::pending().await,
    };
    *looking = None;
    found
}

/// Counts and logs a patch that was not used; it costs nothing else.
fn reject(error: &PatchError) {
    let reason = match error {
        PatchError::OtherRig { .. } => "other_rig",
        PatchError::OutOfOrder { .. } => "out_of_order",
        PatchError::Duplicate { .. } => "duplicate",
        PatchError::Crowded { .. } => "crowded",
        PatchError::Future { .. } => "future",
        PatchError::Late { .. } => "late",
        PatchError::Shape { .. } => "shape",
        PatchError::Value { .. } => "value",
    };
    counter!("assessment_patches_rejected_total", "reason" => reason).increment(1);
    warn!(error = %error, "surface patch refused");
}

/// What people and monitoring are told.
struct Shell<'a> {
    context: &'a Context,
    rig: &'a RigId,
    verdict: Option<VerdictState>,
}

impl Shell<'_> {
    async fn tell(&mut self, sea_state: &SeaState) {
        let state = sea_state.verdict.state;
        let reason = sea_state.verdict.reasons.first().map_or("", |reason| reason.text.as_str());
        trace!(rig = %self.rig, patches = sea_state.patches, state = state.as_str(), "sea state");
        if let Some(h_s_m) = sea_state.h_s_m {
            gauge!("assessment_significant_height_metres").set(h_s_m.value);
        }
        if sea_state.verdict.reasons.iter().any(|r| r.check == "fresh" && !r.passed) {
            self.context.health.degraded(reason);
        } else {
            self.context.health.ready(format!("{} patches, {}", sea_state.patches, state.as_str()));
        }
        if self.verdict != Some(state) {
            // The first of all is inconclusive because nothing was seen yet, which is no news.
            if self.verdict.is_some() {
                let why = match state {
                    VerdictState::Safe => "every bound is under its limit",
                    VerdictState::Unsafe | VerdictState::Inconclusive => reason,
                };
                self.context.event(EventDraft::info(format!("water under {} is {}", self.rig, state.as_str()), why)).await;
            }
            self.verdict = Some(state);
        }
    }
}
