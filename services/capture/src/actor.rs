//! The only async part that the bus sees: asks the source, publishes what comes.

use halcyon_chassis::{Context, EventDraft, topics};
use halcyon_model::{RigId, StereoPair};
use tracing::trace;

use crate::config::{Config, SourceKind};
use crate::source::{FolderSource, Next, SimSource, StereoSource};

/// Runs the service until `context.stop` is cancelled.
///
/// # Errors
/// When the source or the bus fails: a folder that can't be read, a session that is gone.
pub async fn run(context: Context, config: Config) -> anyhow::Result<()> {
    match config.source {
        SourceKind::Sim => {
            let source = SimSource::open(&context, &config).await?;
            play(&context, &config, source).await
        }
        SourceKind::Folder => {
            let source = FolderSource::open(context.clock.clone(), &config).await?;
            play(&context, &config, source).await
        }
    }
}

async fn play(context: &Context, config: &Config, mut source: impl StereoSource) -> anyhow::Result<()> {
    let rig = RigId::new(&config.rig)?;
    let pairs = context.bus.publisher(&topics::pair(&rig)).await?;
    let published = metrics::counter!("capture_pairs_published_total", "rig" => config.rig.clone());
    let without_pose = metrics::counter!("capture_pairs_without_pose_total", "rig" => config.rig.clone());
    let mut sequence = 0;
    loop {
        let next = tokio::select! {
            () = context.stop.cancelled() => return Ok(()),
            next = source.next() => next?,
        };
        match next {
            Next::Pair(exposure) => {
                match &exposure.pose_missing {
                    None => context.health.ready(format!(
                        "publishing pairs of {} x {} px",
                        exposure.left.width_px(),
                        exposure.left.height_px()
                    )),
                    Some(why) => {
                        without_pose.increment(1);
                        context.health.degraded(why.as_str());
                    }
                }
                let pair = StereoPair {
                    stamp: exposure.stamp,
                    rig: rig.clone(),
                    sequence,
                    left: exposure.left,
                    right: exposure.right,
                    exposure_s: exposure.exposure_s,
                    calibration: exposure.calibration,
                    pose: exposure.pose,
                };
                sequence += 1;
                trace!(sequence, "pair");
                pairs.put(&pair).await?;
                published.increment(1);
            }
            Next::Idle(why) => context.health.ready(format!("publishing nothing: {why}")),
            Next::Blind(why) => context.health.degraded(format!("publishing nothing: {why}")),
            Next::Ended(why) => {
                context.health.ready(why.as_str());
                context.event(EventDraft::info(format!("rig {rig} has no more pairs"), why)).await;
                context.stop.cancelled().await;
                return Ok(());
            }
        }
    }
}
