//! A survey folder, played at its own pace as if it were happening now.

use std::path::Path;
use std::sync::Arc;

use anyhow::Context as _;
use halcyon_chassis::Clock;
use halcyon_model::Stamp;

use super::{Exposure, Next, StereoSource};
use crate::config::Config;
use crate::folder::SurveyFolder;

/// Plays the frames with the intervals of their stamps; stamps are moved to the present, since everything downstream asks how old
/// a measurement is. A frame whose time has passed before it could be read is skipped.
pub(crate) struct FolderSource {
    clock: Clock,
    folder: Arc<SurveyFolder>,
    next: usize,
    /// Fleet time at which the first frame is (or was) due.
    start: Stamp,
    repeat: bool,
    height_sigma_m: f64,
    attitude_sigma_rad: f64,
}

impl FolderSource {
    pub(crate) async fn open(clock: Clock, config: &Config) -> anyhow::Result<Self> {
        let path = config.folder.clone();
        let folder = tokio::task::spawn_blocking(move || SurveyFolder::open(Path::new(&path))).await??;
        Ok(Self {
            start: clock.now(),
            clock,
            folder: Arc::new(folder),
            next: 0,
            repeat: config.folder_loop,
            height_sigma_m: config.height_sigma_m,
            attitude_sigma_rad: config.attitude_sigma_deg.to_radians(),
        })
    }

    /// When a frame is due.
    fn due(&self, index: usize) -> Stamp {
        let frames = self.folder.frames();
        self.start.plus_secs_f64(frames[index].stamp().seconds_since(frames[0].stamp()))
    }

    /// The start of the next round: one mean interval after the last frame.
    fn next_round(&self) -> Stamp {
        let frames = self.folder.frames();
        let last = frames.len() - 1;
        let length_s = self.due(last).seconds_since(self.start);
        let interval_s = if last == 0 { 1.0 } else { length_s / last as f64 };
        self.start.plus_secs_f64(length_s + interval_s)
    }
}

impl StereoSource for FolderSource {
    async fn next(&mut self) -> anyhow::Result<Next> {
        let count = self.folder.frames().len();
        if self.next == count {
            if !self.repeat {
                return Ok(Next::Ended(format!("all {count} frames of the folder have been played")));
            }
            self.next = 0;
            self.start = self.next_round();
        }
        while self.next + 1 < count && self.due(self.next + 1) <= self.clock.now() {
            metrics::counter!("capture_frames_skipped_total").increment(1);
            self.next += 1;
        }
        let (index, folder) = (self.next, Arc::clone(&self.folder));
        self.next += 1;
        let pictures = tokio::task::spawn_blocking(move || folder.read(&folder.frames()[index]));
        let (left, right) = pictures.await.context("reading a pair")??;
        let stamp = self.due(index);
        self.clock.sleep_until(stamp).await;
        Ok(Next::Pair(Box::new(Exposure {
            stamp,
            left,
            right,
            // The folder doesn't say.
            exposure_s: 0.0,
            calibration: *self.folder.rig(),
            pose: self.folder.frames()[index].pose(self.height_sigma_m, self.attitude_sigma_rad),
            pose_missing: None,
        })))
    }
}
