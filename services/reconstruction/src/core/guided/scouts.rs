//! A few windows, searched over the whole range of disparities, tell where the plane is when nobody knows.

use multiversion::multiversion;
use rayon::prelude::*;

use super::Pair;
use crate::core::matcher::DisparityRange;
use crate::core::plane::{DisparityPlane, Match};

/// Scouts across and down the picture.
const SCOUTS: (usize, usize) = (14, 10);
/// Half of a scout's window, pixels.
const HALF_PX: usize = 10;
/// A scout without texture (variance, grey levels²) knows nothing.
const VARIANCE_MIN: f32 = 2.0;
/// Correlation of the two windows that is no chance.
const CORRELATION_MIN: f32 = 0.3;
/// By so much the best must beat all that are further than [`APART_PX`] from it.
const LEAD_MIN: f32 = 0.08;
const APART_PX: i64 = 3;
/// Scouts that must agree on a plane: so many, and this share of those that found anything.
const AGREE_MIN: (usize, f32) = (12, 0.5);
/// Waves are allowed to stand this far from it, pixels, however well most agree.
const AGREE_PX: f32 = 2.0;

/// The plane that most scouts agree on; `None` where there is none.
pub(super) fn plane(pair: &Pair<'_>, range: DisparityRange) -> Option<DisparityPlane> {
    let side = 2 * HALF_PX + 1;
    if pair.width < 2 * side || pair.height < side {
        return None;
    }
    let place = |i: usize, count: usize, length: usize| HALF_PX + i * (length - side) / (count - 1);
    let found: Vec<Match> = (0..SCOUTS.0 * SCOUTS.1)
        .into_par_iter()
        .filter_map(|i| {
            let (x, y) = (place(i % SCOUTS.0, SCOUTS.0, pair.width), place(i / SCOUTS.0, SCOUTS.1, pair.height));
            let disparity_px = scout(pair, x, y, range)?;
            Some(Match { x_px: x as f32, y_px: y as f32, disparity_px, sigma_px: 0.5 })
        })
        .collect();
    let (plane, sigma_px) = DisparityPlane::robust(&found, &found, 1)?;
    let limit_px = AGREE_PX.max(3.0 * sigma_px).min(2.0 * AGREE_PX);
    let agree = found.iter().filter(|scout| plane.residual(scout).abs() <= limit_px).count();
    if agree < AGREE_MIN.0 || (agree as f32) < AGREE_MIN.1 * found.len() as f32 {
        return None;
    }
    plane.refit(&found, limit_px)
}

/// Where the window about (x, y) is in the right picture.
fn scout(pair: &Pair<'_>, x: usize, y: usize, range: DisparityRange) -> Option<f32> {
    let farthest = (range.max_px as usize).min(x - HALF_PX);
    let nearest = range.min_px as usize;
    if nearest > farthest {
        return None;
    }
    let mut correlations = vec![0.0; farthest - nearest + 1];
    correlate(pair.left, pair.right, pair.width, (x, y), nearest, &mut correlations);
    let (at, best) = correlations.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let apart = correlations.iter().enumerate().filter(|(i, _)| (*i as i64 - at as i64).abs() > APART_PX);
    let second = apart.map(|(_, correlation)| *correlation).fold(0.0, f32::max);
    (best >= CORRELATION_MIN && best - second >= LEAD_MIN).then_some((nearest + at) as f32)
}

/// Correlation (zero-mean, normalised; thesis 4-12) at every disparity from `nearest` on; 0 without texture.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl+avx512dq", "x86_64+avx2"))]
fn correlate(left: &[u8], right: &[u8], width: usize, at: (usize, usize), nearest: usize, to: &mut [f32]) {
    const SIDE: usize = 2 * HALF_PX + 1;
    let row_of = |picture: &'_ [u8], row: usize, from: usize| -> [u8; SIDE] {
        let mut pixels = [0; SIDE];
        pixels.copy_from_slice(&picture[(at.1 - HALF_PX + row) * width + from..][..SIDE]);
        pixels
    };
    let count = (SIDE * SIDE) as f32;
    let mut window = [[0_u8; SIDE]; SIDE];
    let (mut sum_l, mut sum_ll) = (0_u32, 0_u32);
    for (row, pixels) in window.iter_mut().enumerate() {
        *pixels = row_of(left, row, at.0 - HALF_PX);
        for l in pixels.iter().map(|l| u32::from(*l)) {
            sum_l += l;
            sum_ll += l * l;
        }
    }
    let mean_l = sum_l as f32 / count;
    let variance_l = sum_ll as f32 / count - mean_l * mean_l;
    if variance_l < VARIANCE_MIN {
        return;
    }
    for (step, to) in to.iter_mut().enumerate() {
        let from = at.0 - HALF_PX - nearest - step;
        let (mut sum_r, mut sum_rr, mut sum_lr) = (0_u32, 0_u32, 0_u32);
        for (row, pixels) in window.iter().enumerate() {
            for (l, r) in pixels.iter().zip(row_of(right, row, from)) {
                let (l, r) = (u32::from(*l), u32::from(r));
                sum_r += r;
                sum_rr += r * r;
                sum_lr += l * r;
            }
        }
        let mean_r = sum_r as f32 / count;
        let variance_r = sum_rr as f32 / count - mean_r * mean_r;
        let covariance = sum_lr as f32 / count - mean_l * mean_r;
        *to = if variance_r < VARIANCE_MIN { 0.0 } else { covariance / (variance_l * variance_r).sqrt() };
    }
}
