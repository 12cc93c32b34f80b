//! How fast and how exact every matching engine is, on the same pairs in one run: `halcyon bench`.
//!
//! Times depend on the machine, so that what counts are ratios: each row names its peer. One-thread ratios are of processor time,
//! others of wall time. Engines take turns, so that whatever else the machine does falls on all of them. OpenCV's engines are timed
//! as its users call them, and judged with the margin that lets them match the left edge, as Halcyon calls them.

mod matching;
mod pipeline;
mod scenes;
mod sub_pixel;

use std::path::PathBuf;

use halcyon_reconstruction::cli::Spent;
use halcyon_reconstruction::core::disparity::score::SizeError;
use halcyon_reconstruction::core::matcher::MatchError;
use halcyon_reconstruction::core::reconstruct::ReconstructError;
use halcyon_reconstruction::files::FileError;
use serde::Serialize;
pub use sub_pixel::{SubPixelRow, shifted_pair};

use crate::accuracy::{Extent, SceneError};

/// What a run of the bench is about.
#[derive(Debug, Clone)]
pub struct Bench {
    /// How often each engine runs.
    pub extent: Extent,
    /// Where OpenCV's sample pictures are; without them the aloe pair is left out.
    pub samples: PathBuf,
}

/// Time and quality of one engine for one size of picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpeedRow {
    /// `match` (rectified pair to disparity) or `pair to patch` (the whole chain), and what is seen.
    pub what: String,
    /// Width and height, pixels, such as `640x480`.
    pub size: String,
    /// The engine.
    pub engine: String,
    /// Worker threads.
    pub threads: usize,
    /// Median processor time of all threads, milliseconds; absent where the system does not tell.
    pub cpu_ms: Option<f64>,
    /// Median wall time, milliseconds.
    pub wall_ms: f64,
    /// Which engine `ratio` is to.
    pub ratio_to: &'static str,
    /// Time over that engine's with as many threads: of processors with one thread, of the wall clock with more.
    pub ratio: f64,
    /// Disparities searched.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub disparities: Option<u32>,
    /// Million disparity evaluations a second of wall time: pixels times disparities. Engines that search less do better than
    /// it says.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mde_per_s: Option<f64>,
    /// Against the truth.
    #[serde(flatten)]
    pub quality: Option<Quality>,
    /// Buffers of the chain, MiB.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_mib: Option<f64>,
}

/// A disparity map against its truth, where both cameras see it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Quality {
    /// Share of the known pixels that were matched, 0 to 1.
    pub density: f64,
    /// Share of the matched ones that are off by more than 1 px, 0 to 1.
    pub bad1: f64,
}

/// Everything, as `halcyon bench --json` prints it under `machine`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SpeedReport {
    /// Times and bad pixels.
    pub rows: Vec<SpeedRow>,
    /// Sub-pixel bias and noise.
    pub sub_pixel: Vec<SubPixelRow>,
}

/// Why a bench could not be run.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An engine.
    #[error(transparent)]
    Match(#[from] MatchError),
    /// The chain.
    #[error(transparent)]
    Reconstruct(#[from] ReconstructError),
    /// A sample picture that is there, but broken.
    #[error(transparent)]
    File(#[from] FileError),
    /// A truth of another size than its pictures.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// No threads.
    #[error("the system gives no threads")]
    Threads(#[source] std::io::Error),
}

impl Bench {
    /// Runs it. `progress` hears how many of how many steps are done, and which is next.
    ///
    /// # Errors
    /// [`BenchError`].
    pub fn run(&self, progress: &mut dyn FnMut(usize, usize, &str)) -> Result<SpeedReport, BenchError> {
        let quick = self.extent == Extent::Quick;
        let scenes = scenes::all(&self.samples, quick)?;
        let sizes = pipeline::sizes(quick);
        let total = scenes.len() + sizes.len() + 1;
        let mut rows = Vec::new();
        for (done, scene) in scenes.iter().enumerate() {
            progress(done, total, &scene.name);
            rows.extend(matching::run(scene, if quick { 1 } else { 3 })?);
        }
        progress(scenes.len(), total, "sub-pixel bias");
        let sub_pixel = sub_pixel::run(if quick { 3 } else { 10 })?;
        for (done, size) in sizes.iter().enumerate() {
            progress(scenes.len() + 1 + done, total, &format!("pair to patch, {}x{}", size.0, size.1));
            rows.extend(pipeline::run(*size, if quick { 3 } else { 7 })?);
        }
        progress(total, total, "done");
        Ok(SpeedReport { rows, sub_pixel })
    }
}

/// Numbers of threads to try: one, and as many as the machine has.
fn thread_counts() -> Vec<usize> {
    let all = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    if all > 1 { vec![1, all] } else { vec![1] }
}

/// One over the other: processor time with one thread, wall time with more.
fn ratio(one: Spent, peer: Spent, threads: usize) -> f64 {
    match (threads, one.cpu_ms, peer.cpu_ms) {
        (1, Some(one_ms), Some(peer_ms)) if peer_ms > 0.0 => one_ms / peer_ms,
        _ => one.wall_ms / peer.wall_ms,
    }
}
