//! Where stereo pairs come from.

use std::future::Future;

use halcyon_model::{Image, PoseAtExposure, RigCalibration, Stamp};

mod folder;
mod sim;

pub(crate) use folder::FolderSource;
pub(crate) use sim::SimSource;

/// Two pictures of one instant, before they are numbered and named.
#[derive(Debug)]
pub(crate) struct Exposure {
    /// Mid-exposure.
    pub(crate) stamp: Stamp,
    pub(crate) left: Image,
    pub(crate) right: Image,
    pub(crate) exposure_s: f64,
    pub(crate) calibration: RigCalibration,
    pub(crate) pose: Option<PoseAtExposure>,
    /// Why there is no pose although there should be one.
    pub(crate) pose_missing: Option<String>,
}

/// What a source has to say.
#[derive(Debug)]
pub(crate) enum Next {
    /// A pair.
    Pair(Box<Exposure>),
    /// None this time, as it should be; says why.
    Idle(String),
    /// None this time, and something is wrong; says what.
    Blind(String),
    /// None any more.
    Ended(String),
}

/// A camera rig, a recording, or simulated water.
pub(crate) trait StereoSource: Send {
    /// Waits until a pair is due and returns it, or why there is none. Not cancel-safe: a source that was cancelled is finished.
    fn next(&mut self) -> impl Future<Output = anyhow::Result<Next>> + Send;
}
