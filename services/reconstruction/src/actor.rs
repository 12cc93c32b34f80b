//! The shell: pairs in, patches out, newest wins.

use std::time::{Duration, Instant};

use anyhow::{Context as _, anyhow};
use halcyon_chassis::{Context, Publisher, topics};
use halcyon_model::{Preview, Stamp, StereoPair, SurfacePatch};
use metrics::{counter, histogram};
use tracing::{trace, warn};

use crate::config::Config;
use crate::core::reconstruct::{ReconstructError, Reconstructor};

/// After this many pairs in a row without a patch the service calls itself degraded.
const FAILURES_MAX: u32 = 10;

/// Reconstructs one rig's pairs until told to stop.
///
/// Pairs are taken one at a time; while one is in work the topic's ring keeps only the newest, so that a slow computer
/// measures less often but never late. A pair that makes no patch is counted and passed over: the patches that are not there
/// are what wave-assessment judges by. A restart forgets the rectification maps, the tilt statistics and the wander of the
/// level; all are back within seconds.
///
/// # Errors
/// A bad configuration, a lost session, or a panic in the core; the supervisor restarts.
pub async fn run(context: Context, config: Config) -> anyhow::Result<()> {
    let rig = config.rig().map_err(|error| anyhow!(error))?;
    let settings = config.settings().map_err(|error| anyhow!(error))?;
    opencv::core::set_num_threads(config.threads as i32).context("cannot set OpenCV's number of threads")?;
    let mut pairs = context.bus.subscribe(&topics::pair(&rig)).await?;
    let surfaces = context.bus.publisher(&topics::surface(&rig)).await?;
    let previews = context.bus.publisher(&topics::preview(&rig)).await?;
    let mut shell = Shell {
        reconstructor: Some(Reconstructor::new(settings)),
        preview: PreviewPacer::new(config.preview_rate_hz),
        failures: 0,
    };
    context.health.ready(format!("waiting for pairs of {rig}"));
    loop {
        let pair = tokio::select! {
            () = context.stop.cancelled() => return Ok(()),
            pair = pairs.recv() => pair?,
        };
        shell.take(&context, pair, &surfaces, &previews).await?;
    }
}

struct Shell {
    /// `None` only while a worker thread has it, or after that panicked.
    reconstructor: Option<Reconstructor>,
    preview: PreviewPacer,
    failures: u32,
}

/// What a worker thread brings back.
struct Work {
    reconstructor: Reconstructor,
    patch: Result<SurfacePatch, ReconstructError>,
    preview: Option<Preview>,
}

impl Shell {
    /// One pair: computes off the async threads, publishes, says how it went.
    async fn take(
        &mut self,
        context: &Context,
        pair: StereoPair,
        surfaces: &Publisher<SurfacePatch>,
        previews: &Publisher<Preview>,
    ) -> anyhow::Result<()> {
        let reconstructor = self.reconstructor.take().ok_or_else(|| anyhow!("the reconstruction was lost in a panic"))?;
        let with_preview = self.preview.is_due(pair.stamp);
        let (rig, sequence) = (pair.rig.clone(), pair.sequence);
        let work = tokio::task::spawn_blocking(move || work(reconstructor, &pair, with_preview)).await?;
        self.reconstructor = Some(work.reconstructor);
        match work.patch {
            Ok(patch) => {
                self.failures = 0;
                histogram!("reconstruction_pair_seconds").record(patch.processing_s);
                counter!("reconstruction_patches_total").increment(1);
                trace!(%rig, sequence, points = patch.points, coverage = patch.coverage, "patch");
                context.health.ready(format!(
                    "{:.0} ms a pair, coverage {:.0} %",
                    patch.processing_s * 1e3,
                    patch.coverage * 100.0
                ));
                surfaces.put(&patch).await?;
            }
            Err(error) => {
                self.failures = self.failures.saturating_add(1);
                counter!("reconstruction_pairs_failed_total").increment(1);
                trace!(%rig, sequence, error = &error as &dyn std::error::Error, "no patch");
                if self.failures == FAILURES_MAX {
                    warn!(%rig, error = &error as &dyn std::error::Error, "no water surface in {FAILURES_MAX} pairs in a row");
                }
                if self.failures >= FAILURES_MAX {
                    context.health.degraded(format!(
                        "no patch from the last {} pairs: {:#}",
                        self.failures,
                        anyhow::Error::from(error)
                    ));
                }
            }
        }
        if let Some(preview) = work.preview {
            self.preview.done(preview.stamp);
            previews.put(&preview).await?;
        }
        Ok(())
    }
}

fn work(mut reconstructor: Reconstructor, pair: &StereoPair, with_preview: bool) -> Work {
    let start = Instant::now();
    let mut patch = reconstructor.reconstruct(pair);
    if let Ok(patch) = &mut patch {
        patch.processing_s = start.elapsed().as_secs_f64();
    }
    let preview = if with_preview && patch.is_ok() {
        reconstructor.preview().unwrap_or_else(|error| {
            warn!(error = &error as &dyn std::error::Error, "no preview");
            None
        })
    } else {
        None
    };
    Work { reconstructor, patch, preview }
}

/// Lets a preview pass at most so often, by the pairs' own time.
struct PreviewPacer {
    period: Option<Duration>,
    last: Option<Stamp>,
}

impl PreviewPacer {
    fn new(rate_hz: f64) -> Self {
        Self { period: (rate_hz > 0.0).then(|| Duration::from_secs_f64(1.0 / rate_hz)), last: None }
    }

    fn is_due(&self, now: Stamp) -> bool {
        let Some(period) = self.period else { return false };
        // A stamp that went back is a restarted source: start over.
        self.last.is_none_or(|last| now < last || now >= last + period)
    }

    fn done(&mut self, stamp: Stamp) {
        self.last = Some(stamp);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn previews_keep_their_distance() {
        let mut pacer = PreviewPacer::new(1.0);
        let mut shown = Vec::new();
        for i in 0..11 {
            let stamp = Stamp::from_nanos(1_000_000_000 + i * 200_000_000);
            // The sixth pair makes no patch and so no preview: the next one is shown instead.
            if pacer.is_due(stamp) && i != 5 {
                pacer.done(stamp);
                shown.push(i);
            }
        }
        assert_eq!(shown, [0, 6]);
        assert!(pacer.is_due(Stamp::from_nanos(0)), "a restarted source is shown at once");
        assert!(!PreviewPacer::new(0.0).is_due(Stamp::from_nanos(1)));
    }
}
