//! Rectified pair to disparity map.

use halcyon_reconstruction::cli::{Spent, Threads, median_spent, spent};
use halcyon_reconstruction::core::disparity::score::score;
use halcyon_reconstruction::core::matcher::{Engine, MatchError, SgbmMode, match_images};

use super::scenes::Rectified;
use super::{BenchError, Quality, SpeedRow, ratio, thread_counts};

/// OpenCV's fastest semi-global matcher.
const PEER: Engine = Engine::Sgbm(SgbmMode::ThreePaths);

/// Every engine for work on one pair, `repeats` times after one to warm up.
pub(super) fn run(scene: &Rectified, repeats: usize) -> Result<Vec<SpeedRow>, BenchError> {
    let qualities = Engine::ALL.into_iter().map(|engine| quality(scene, engine)).collect::<Result<Vec<_>, _>>()?;
    let mut rows = Vec::new();
    for threads in thread_counts() {
        let times = times(scene, threads, repeats)?;
        let peer = Engine::ALL.iter().position(|engine| *engine == PEER).map_or(times[0], |at| times[at]);
        for ((engine, time), quality) in Engine::ALL.into_iter().zip(times).zip(&qualities) {
            let disparities = engine.disparities(scene.range);
            let evaluations = f64::from(scene.left.width_px()) * f64::from(scene.left.height_px()) * f64::from(disparities);
            rows.push(SpeedRow {
                what: format!("match, {}", scene.name),
                size: format!("{}x{}", scene.left.width_px(), scene.left.height_px()),
                engine: engine.name().into(),
                threads,
                cpu_ms: time.cpu_ms,
                wall_ms: time.wall_ms,
                ratio_to: PEER.name(),
                ratio: ratio(time, peer, threads),
                disparities: Some(disparities),
                mde_per_s: Some(1e-3 * evaluations / time.wall_ms),
                quality: Some(*quality),
                memory_mib: None,
            });
        }
    }
    Ok(rows)
}

fn quality(scene: &Rectified, engine: Engine) -> Result<Quality, BenchError> {
    let mut matcher = engine.matcher(engine.block_px_default());
    let disparity = match_images(matcher.as_mut(), &scene.left, &scene.right, scene.range)?;
    let score = score(&disparity, &scene.truth)?;
    Ok(Quality { density: score.density, bad1: score.bad1 })
}

/// The median time of each engine, in turns.
fn times(scene: &Rectified, threads: usize, repeats: usize) -> Result<Vec<Spent>, BenchError> {
    let threads = Threads::new(threads).map_err(|error| BenchError::Threads(std::io::Error::other(error)))?;
    let block = Engine::block_px_default;
    let mut matchers: Vec<_> = Engine::ALL.map(|engine| engine.peer().unwrap_or_else(|| engine.matcher(block(engine)))).into();
    let mut runs = vec![Vec::new(); matchers.len()];
    for round in 0..=repeats {
        for (matcher, runs) in matchers.iter_mut().zip(&mut runs) {
            let work = || spent(|| match_images(matcher.as_mut(), &scene.left, &scene.right, scene.range));
            let (outcome, took) = threads.run(work).map_err(MatchError::from)?;
            outcome?;
            // The first warms caches and buffers.
            runs.extend((round > 0).then_some(took));
        }
    }
    Ok(runs.iter().filter_map(|runs| median_spent(runs)).collect())
}
