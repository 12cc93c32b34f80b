//! The shell: pairs in, patches out, newest wins.

use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context as _, anyhow};
use halcyon_chassis::{Context, EventDraft, Publisher, topics};
use halcyon_model::{Preview, RigCalibration, RigId, Stamp, StereoPair, SurfacePatch};
use metrics::{counter, gauge, histogram};
use tracing::{trace, warn};

use crate::config::Config;
use crate::core::reconstruct::{ReconstructError, Reconstructor};
use crate::core::self_calibrate::{Drift, DriftWatch, row_matches};

/// After this many pairs in a row without a patch the service calls itself degraded.
const FAILURES_MAX: u32 = 10;

/// Reconstructs one rig's pairs until told to stop.
///
/// Pairs are taken one at a time; while one is in work the topic's ring keeps only the newest, so that a slow computer
/// measures less often but never late. A pair that makes no patch is counted and passed over: the patches that are not there
/// are what wave-assessment judges by. A restart forgets the rectification maps, the tilt statistics and the wander of the
/// level; all are back within seconds. Now and then, after a pair, the calibration is checked by the rows of its features; one
/// that has drifted makes the service degraded, and an event, until it is put right. A restart forgets that, too, for a period.
///
/// # Errors
/// A bad configuration, a lost session, or a panic in the core; the supervisor restarts.
pub async fn run(context: Context, config: Config) -> anyhow::Result<()> {
    let rig = config.rig().map_err(|error| anyhow!(error))?;
    let settings = config.settings().map_err(|error| anyhow!(error))?;
    opencv::core::set_num_threads(config.threads as i32).context("cannot set OpenCV's number of threads")?;
    let threads = rayon::ThreadPoolBuilder::new().num_threads(config.threads as usize);
    let threads = Arc::new(threads.build().context("cannot start the engines' threads")?);
    let mut pairs = context.bus.subscribe(&topics::pair(&rig)).await?;
    let surfaces = context.bus.publisher(&topics::surface(&rig)).await?;
    let previews = context.bus.publisher(&topics::preview(&rig)).await?;
    let mut shell = Shell {
        reconstructor: Some(Reconstructor::new(settings)),
        preview: Pacer::new(1.0 / config.preview_rate_hz),
        watch: Some(CalibrationWatch::default()),
        check: Pacer::new(config.drift_period_s),
        drift: None,
        failures: 0,
        threads,
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
    preview: Pacer,
    /// As `reconstructor`.
    watch: Option<CalibrationWatch>,
    check: Pacer,
    /// What the last check that said anything said.
    drift: Option<Drift>,
    failures: u32,
    /// As many as the configuration allows.
    threads: Arc<rayon::ThreadPool>,
}

/// What a worker thread brings back.
struct Work {
    reconstructor: Reconstructor,
    patch: Result<SurfacePatch, ReconstructError>,
    preview: Option<Preview>,
    watch: CalibrationWatch,
    drift: Option<Drift>,
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
        let watch = self.watch.take().ok_or_else(|| anyhow!("the calibration's watch was lost in a panic"))?;
        let (with_preview, with_check) = (self.preview.is_due(pair.stamp), self.check.is_due(pair.stamp));
        if with_check {
            self.check.done(pair.stamp);
        }
        let (rig, sequence) = (pair.rig.clone(), pair.sequence);
        let threads = Arc::clone(&self.threads);
        let work = move || threads.install(|| work(reconstructor, watch, &pair, with_preview, with_check));
        let work = tokio::task::spawn_blocking(work).await?;
        (self.reconstructor, self.watch) = (Some(work.reconstructor), Some(work.watch));
        if with_check {
            self.take_drift(context, &rig, work.drift).await;
        }
        match work.patch {
            Ok(patch) => {
                self.failures = 0;
                histogram!("reconstruction_pair_seconds").record(patch.processing_s);
                counter!("reconstruction_patches_total").increment(1);
                trace!(%rig, sequence, points = patch.points, coverage = patch.coverage, "patch");
                let detail = format!("{:.0} ms a pair, coverage {:.0} %", patch.processing_s * 1e3, patch.coverage * 100.0);
                match self.drift.filter(|drift| drift.has_drifted) {
                    Some(drift) => context.health.degraded(format!("{}; {detail}", drift_text(&drift))),
                    None => context.health.ready(detail),
                }
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
                    let failures = self.failures;
                    let why = format!("no patch from the last {failures} pairs: {:#}", anyhow::Error::from(error));
                    context.health.degraded(match self.drift.filter(|drift| drift.has_drifted) {
                        Some(drift) => format!("{}; {why}", drift_text(&drift)),
                        None => why,
                    });
                }
            }
        }
        if let Some(preview) = work.preview {
            self.preview.done(preview.stamp);
            previews.put(&preview).await?;
        }
        Ok(())
    }

    /// What a check of the calibration said: into the metrics, and an event when it changes its mind.
    async fn take_drift(&mut self, context: &Context, rig: &RigId, drift: Option<Drift>) {
        // Too few matches say nothing, for or against.
        let Some(drift) = drift else { return };
        gauge!("reconstruction_row_error_pixels").set(drift.row_rms_px);
        gauge!("reconstruction_row_error_sigma_pixels").set(drift.row_sigma_px);
        let had_drifted = self.drift.is_some_and(|before| before.has_drifted);
        self.drift = Some(drift);
        if drift.has_drifted && !had_drifted {
            context.event(EventDraft::warning(format!("calibration of {rig} has drifted"), drift_text(&drift))).await;
        } else if had_drifted && !drift.has_drifted {
            let why = format!("rows are off by {:.1} ± {:.1} px", drift.row_rms_px, drift.row_sigma_px);
            context.event(EventDraft::info(format!("calibration of {rig} holds again"), why)).await;
        }
    }
}

fn drift_text(drift: &Drift) -> String {
    format!(
        "the calibration has drifted: rows are off by {:.1} ± {:.1} px; run halcyon self-calibrate or calibrate",
        drift.row_rms_px, drift.row_sigma_px
    )
}

fn work(
    mut reconstructor: Reconstructor,
    mut watch: CalibrationWatch,
    pair: &StereoPair,
    with_preview: bool,
    with_check: bool,
) -> Work {
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
    // A bent rig is the very one whose pairs make no patch: it is checked all the same.
    let is_held = !matches!(patch, Err(ReconstructError::Rectify(_)));
    let drift = if with_check && is_held { watch.look(&reconstructor) } else { None };
    Work { reconstructor, patch, preview, watch, drift }
}

/// The watch, and the calibration that it has watched.
#[derive(Default)]
struct CalibrationWatch {
    watch: DriftWatch,
    calibration: Option<RigCalibration>,
}

impl CalibrationWatch {
    /// Looks at the pair that a reconstructor has just had.
    fn look(&mut self, reconstructor: &Reconstructor) -> Option<Drift> {
        let rectifier = reconstructor.rectifier()?;
        if self.calibration.as_ref() != Some(rectifier.calibration()) {
            self.watch.reset();
            self.calibration = Some(*rectifier.calibration());
        }
        match row_matches(rectifier) {
            Ok(matches) => self.watch.observe(&matches, rectifier.rig()),
            Err(error) => {
                warn!(error = &error as &dyn std::error::Error, "the calibration could not be checked");
                None
            }
        }
    }
}

/// Lets something be done at most so often, by the pairs' own time.
struct Pacer {
    period: Option<Duration>,
    last: Option<Stamp>,
}

impl Pacer {
    /// Every `period_s`; 0, or one over a rate of 0, is never.
    fn new(period_s: f64) -> Self {
        let period = (period_s > 0.0).then(|| Duration::try_from_secs_f64(period_s).ok()).flatten();
        Self { period, last: None }
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
        let mut pacer = Pacer::new(1.0);
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
        for never in [0.0, 1.0 / 0.0] {
            assert!(!Pacer::new(never).is_due(Stamp::from_nanos(1)));
        }
    }
}
