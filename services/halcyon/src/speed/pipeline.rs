//! Raw pair to gridded patch: the whole chain, against rectifying, SGBM and reprojecting as OpenCV's users do.

use halcyon_model::StereoPair;
use halcyon_reconstruction::cli::{Spent, THESIS_SIZES_PX, Threads, median_spent, spent};
use halcyon_reconstruction::core::matcher::{DisparityRange, Engine, MatchError, SgbmMode};
use halcyon_reconstruction::core::peer::OpenCvChain;
use halcyon_reconstruction::core::reconstruct::{Reconstructor, Settings};
use halcyon_sim::rig::RigConfig;
use halcyon_sim::sea::SeaConfig;
use nalgebra::{UnitQuaternion, Vector3};

use super::{BenchError, SpeedRow, ratio, thread_counts};
use crate::accuracy::{Scene, thesis_rig};

/// OpenCV's steps, as a row calls them.
const PEER: &str = "opencv: remap, sgbm, reproject";

/// What ocean stereo systems use.
const LARGE_PX: (u32, u32) = (2448, 2048);

/// The sizes: the thesis's, and larger.
pub(super) fn sizes(quick: bool) -> Vec<(u32, u32)> {
    let all: Vec<_> = THESIS_SIZES_PX.into_iter().chain([LARGE_PX]).collect();
    if quick { all[..2].to_vec() } else { all }
}

/// A regular sea under the thesis's cameras at 0.99 m, `repeats` different pairs after one to warm up.
pub(super) fn run((width_px, height_px): (u32, u32), repeats: usize) -> Result<Vec<SpeedRow>, BenchError> {
    let scale = f64::from(width_px) / 640.0;
    let rig = RigConfig { width_px, height_px, ..thesis_rig(0.092, scale) };
    let mut scene = Scene::new(&rig, &SeaConfig::regular(0.04, 0.8, 270.0), 0.0035 / scale, 5)?;
    let at_m = Vector3::new(0.0, 0.0, -0.99);
    let pairs = (0..=repeats)
        .map(|i| scene.pair(0.3 * i as f64, at_m, &UnitQuaternion::identity(), None))
        .collect::<Result<Vec<_>, _>>()?;
    // Down to half a metre from the water, at any resolution.
    let range = DisparityRange { min_px: 0, max_px: (96.0 * scale) as u32 - 1 };
    let mut rows = Vec::new();
    for threads in thread_counts() {
        rows.extend(times(&pairs, range, threads)?);
    }
    Ok(rows)
}

fn times(pairs: &[StereoPair], range: DisparityRange, threads: usize) -> Result<Vec<SpeedRow>, BenchError> {
    let pool = Threads::new(threads).map_err(|error| BenchError::Threads(std::io::Error::other(error)))?;
    let engines: Vec<Engine> = chains();
    let settings = Settings { cell_m: 0.04, fixed_rig: true, range, ..Settings::default() };
    let chain = |engine: &Engine| {
        Reconstructor::new(Settings { engine: *engine, block_px: engine.block_px_default(), ..settings.clone() })
    };
    let mut chains: Vec<Reconstructor> = engines.iter().map(chain).collect();
    let mut peer = OpenCvChain::new(&pairs[0].calibration, range, Engine::Sgbm(SgbmMode::FivePaths).block_px_default())?;
    let mut runs = vec![Vec::new(); engines.len()];
    let mut peer_runs = Vec::new();
    for (round, pair) in pairs.iter().enumerate() {
        // The first warms caches, maps and buffers.
        let counts = round > 0;
        let (points, took) = pool.run(|| spent(|| peer.points(&pair.left, &pair.right))).map_err(MatchError::from)?;
        points?;
        peer_runs.extend(counts.then_some(took));
        for (chain, runs) in chains.iter_mut().zip(&mut runs) {
            let (patch, took) = pool.run(|| spent(|| chain.reconstruct(pair))).map_err(MatchError::from)?;
            patch?;
            runs.extend(counts.then_some(took));
        }
    }
    let row = |engine: String, time: Spent, ratio: f64| SpeedRow {
        what: "pair to patch, water".into(),
        size: format!("{}x{}", pairs[0].left.width_px(), pairs[0].left.height_px()),
        engine,
        threads,
        cpu_ms: time.cpu_ms,
        wall_ms: time.wall_ms,
        ratio_to: PEER,
        ratio,
        disparities: None,
        mde_per_s: None,
        quality: None,
        memory_mib: None,
    };
    let Some(peer) = median_spent(&peer_runs) else { return Ok(Vec::new()) };
    let mut rows = vec![row(PEER.into(), peer, 1.0)];
    for (engine, runs) in engines.iter().zip(&runs) {
        rows.extend(median_spent(runs).map(|time| row(engine.name().into(), time, ratio(time, peer, threads))));
    }
    Ok(rows)
}

/// The engines that are worth a whole chain.
fn chains() -> Vec<Engine> {
    vec![Settings::default().engine, Engine::Sgbm(SgbmMode::FivePaths)]
}
