//! Random sample consensus on F (Fischler and Bolles 1981; thesis 4.4.1).

use nalgebra::Matrix3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::fundamental::POINTS_MIN;
use super::{EpipolarError, PointPair, eight_point, sampson_px2};

/// Rounds of least squares over the inliers, after which they are counted anew.
const POLISH_ROUNDS: u32 = 8;
/// However good the first sample, so many are drawn: the best of a few is better than the first.
const SAMPLES_MIN: u32 = 50;

/// What RANSAC can be told.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RansacSettings {
    /// Matches within this Sampson distance keep to F, pixels.
    pub threshold_px: f64,
    /// Wanted probability of at least one sample without outliers.
    pub confidence: f64,
    /// Samples at most.
    pub samples_max: u32,
    /// Fewer inliers are no consensus. Eight points always agree with themselves.
    pub inliers_min: usize,
    /// For the random choices.
    pub seed: u64,
}

impl Default for RansacSettings {
    fn default() -> Self {
        Self { threshold_px: 1.0, confidence: 0.999, samples_max: 4000, inliers_min: 15, seed: 1 }
    }
}

/// F, and who agrees.
#[derive(Debug, Clone, PartialEq)]
pub struct Consensus {
    /// Least squares over the inliers.
    pub fundamental: Matrix3<f64>,
    /// For each match, whether it keeps to F.
    pub is_inlier: Vec<bool>,
    /// How many do.
    pub inliers: usize,
    /// Samples drawn.
    pub samples: u32,
}

/// Finds F among matches of which many may be wrong. The same seed and matches give the same F.
///
/// Samples are scored by the truncated sum of squared distances (Torr and Zisserman 2000), which prefers the better of two
/// equally popular hypotheses; their number adapts to the share of inliers seen so far.
///
/// # Errors
/// [`EpipolarError`] with too few matches or no consensus.
pub fn find_fundamental(pairs: &[PointPair], settings: &RansacSettings) -> Result<Consensus, EpipolarError> {
    let needed = settings.inliers_min.max(POINTS_MIN);
    if pairs.len() < needed {
        return Err(EpipolarError::TooFew { points: pairs.len(), needed });
    }
    let limit_px2 = settings.threshold_px * settings.threshold_px;
    let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
    let mut best: Option<(f64, Matrix3<f64>)> = None;
    let mut sample_cost = f64::INFINITY;
    let (mut samples, mut wanted) = (0, settings.samples_max);
    while samples < wanted {
        samples += 1;
        let sample = draw(&mut random, pairs.len());
        let Ok(f) = eight_point(sample.iter().map(|&i| &pairs[i])) else { continue };
        let (cost, inliers) = score(&f, pairs, limit_px2);
        // Samples compete with samples: eight noisy points seldom beat what was polished, and might still polish better.
        if cost < sample_cost {
            sample_cost = cost;
            wanted = samples_for(inliers as f64 / pairs.len() as f64, settings).max(SAMPLES_MIN).min(settings.samples_max);
            let (cost, f) = polish(f, pairs, limit_px2);
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, f));
            }
        }
    }
    let (_, f) = best.ok_or(EpipolarError::Degenerate)?;
    let is_inlier: Vec<bool> = pairs.iter().map(|pair| sampson_px2(&f, pair) <= limit_px2).collect();
    let inliers = is_inlier.iter().filter(|is_inlier| **is_inlier).count();
    if inliers < needed {
        return Err(EpipolarError::NoConsensus { inliers, points: pairs.len(), needed });
    }
    Ok(Consensus { fundamental: f, is_inlier, inliers, samples })
}

/// Least squares over the inliers, again and again as long as the cost falls (locally optimised RANSAC, Chum et al. 2003); from twice
/// the threshold down, so that a start that fits one corner of the picture can grow to the others.
fn polish(start: Matrix3<f64>, pairs: &[PointPair], limit_px2: f64) -> (f64, Matrix3<f64>) {
    let mut best = (score(&start, pairs, limit_px2).0, start);
    let mut f = start;
    for round in 0..POLISH_ROUNDS {
        let widen = if round < 2 { 4.0 } else { 1.0 };
        let inliers = pairs.iter().filter(|pair| sampson_px2(&f, pair) <= widen * limit_px2);
        let Ok(polished) = eight_point(inliers) else { break };
        let cost = score(&polished, pairs, limit_px2).0;
        f = polished;
        if cost < best.0 {
            best = (cost, f);
        } else if round >= 2 {
            break;
        }
    }
    best
}

/// Eight different indices.
fn draw(random: &mut ChaCha8Rng, count: usize) -> [usize; POINTS_MIN] {
    let mut sample = [usize::MAX; POINTS_MIN];
    for i in 0..POINTS_MIN {
        sample[i] = loop {
            let index = random.random_range(0..count);
            if !sample[..i].contains(&index) {
                break index;
            }
        };
    }
    sample
}

/// Truncated sum of squares, and inliers.
fn score(f: &Matrix3<f64>, pairs: &[PointPair], limit_px2: f64) -> (f64, usize) {
    pairs.iter().fold((0.0, 0), |(cost, inliers), pair| {
        let squared = sampson_px2(f, pair);
        // A NaN is no inlier and costs as one outlier does.
        if squared <= limit_px2 { (cost + squared, inliers + 1) } else { (cost + limit_px2, inliers) }
    })
}

fn samples_for(inlier_share: f64, settings: &RansacSettings) -> u32 {
    let all_good = inlier_share.powi(POINTS_MIN as i32);
    if all_good >= 1.0 {
        return 1;
    }
    let wanted = (1.0 - settings.confidence).ln() / (1.0 - all_good).ln();
    // NaN and infinity, from no inliers, become the maximum.
    if wanted < f64::from(settings.samples_max) { wanted.ceil() as u32 } else { settings.samples_max }
}
