//! Orientation and descriptor (Bay et al. 2008, section 4).

use std::f32::consts::{FRAC_PI_3, TAU};

use super::DESCRIPTOR_LENGTH;
use super::hessian::Blob;
use super::integral::Integral;

/// Samples of the orientation lie within this many σ.
const ORIENTATION_RADIUS: i32 = 6;
/// Directions at which the sliding sector of π/3 is tried.
const SECTORS: usize = 72;
/// Samples along one side of the descriptor's window of 20 σ.
const SAMPLES: i32 = 20;
/// Subregions along a side.
const REGIONS: usize = 4;

/// Responses of the two Haar wavelets of side `side_px` centred at (x, y): right less left, below less above.
fn haar(integral: &Integral, x_px: f32, y_px: f32, side_px: f32) -> (f32, f32) {
    let quarter_px = side_px / 4.0;
    let at = |dx: f32, dy: f32| integral.mean_around(x_px + dx * quarter_px, y_px + dy * quarter_px, side_px / 2.0);
    let (top_left, top_right, bottom_left, bottom_right) = (at(-1.0, -1.0), at(1.0, -1.0), at(-1.0, 1.0), at(1.0, 1.0));
    (top_right + bottom_right - top_left - bottom_left, bottom_left + bottom_right - top_left - top_right)
}

/// The direction in which most of the gradient points: the longest sum of wavelet responses in any sector of π/3.
pub(super) fn orientation_rad(integral: &Integral, blob: &Blob) -> f32 {
    let sigma = blob.sigma_px;
    let mut samples = [(0.0_f32, 0.0_f32, 0.0_f32); ((2 * ORIENTATION_RADIUS + 1) * (2 * ORIENTATION_RADIUS + 1)) as usize];
    let mut count = 0;
    for v in -ORIENTATION_RADIUS..=ORIENTATION_RADIUS {
        for u in -ORIENTATION_RADIUS..=ORIENTATION_RADIUS {
            let squared = u * u + v * v;
            if squared > ORIENTATION_RADIUS * ORIENTATION_RADIUS {
                continue;
            }
            let (dx, dy) = haar(integral, blob.x_px + u as f32 * sigma, blob.y_px + v as f32 * sigma, 4.0 * sigma);
            let weight = (-(squared as f32) / (2.0 * 2.0 * 2.0)).exp();
            let (dx, dy) = (dx * weight, dy * weight);
            samples[count] = (dy.atan2(dx).rem_euclid(TAU), dx, dy);
            count += 1;
        }
    }
    let samples = &samples[..count];
    let (mut best, mut longest) = (0.0, 0.0);
    for sector in 0..SECTORS {
        let start = sector as f32 * TAU / SECTORS as f32;
        let (mut x, mut y) = (0.0, 0.0);
        for (angle, dx, dy) in samples {
            if (angle - start).rem_euclid(TAU) < FRAC_PI_3 {
                x += dx;
                y += dy;
            }
        }
        let length = x * x + y * y;
        if length > longest {
            (best, longest) = (y.atan2(x), length);
        }
    }
    best
}

/// The two subregions, along one side, whose middles a sample lies between, and its share in each: the nearer, the more. With the
/// paper's hard borders a small error in place or direction moves whole samples to the neighbour (Agrawal et al. 2008).
fn shares(sample: i32) -> [(usize, f32); 2] {
    let at = (sample as f32 + 0.5) * REGIONS as f32 / SAMPLES as f32 - 0.5;
    let last = (REGIONS - 1) as f32;
    let low = at.floor();
    let part = at - low;
    // Before the first and beyond the last middle there is one neighbour only.
    [
        (low.clamp(0.0, last) as usize, if low < 0.0 { 0.0 } else { 1.0 - part }),
        ((low + 1.0).clamp(0.0, last) as usize, if low + 1.0 > last { 0.0 } else { part }),
    ]
}

/// Σdx, Σ|dx|, Σdy, Σ|dy| in each of 4 × 4 subregions of a window of 20 σ, turned by `angle_rad`; of unit length, so that
/// contrast does not matter.
pub(super) fn descriptor(integral: &Integral, blob: &Blob, angle_rad: f32) -> [f32; DESCRIPTOR_LENGTH] {
    let sigma = blob.sigma_px;
    let (sin, cos) = angle_rad.sin_cos();
    // Mean grey levels of squares of side σ on a turned lattice of step σ: differences of two by two of them are wavelets of side 2 σ
    // along the blob's own axes. The paper turns the responses of upright ones instead, which small blobs, of few pixels, suffer from.
    const CORNERS: usize = SAMPLES as usize + 1;
    let mut levels = [[0.0_f32; CORNERS]; CORNERS];
    let centre = SAMPLES as f32 / 2.0;
    for (v, row) in levels.iter_mut().enumerate() {
        for (u, level) in row.iter_mut().enumerate() {
            let (along, across) = (sigma * (u as f32 - centre), sigma * (v as f32 - centre));
            let (x_px, y_px) = (blob.x_px + cos * along - sin * across, blob.y_px + sin * along + cos * across);
            *level = integral.mean_around(x_px, y_px, sigma);
        }
    }
    let mut sums = [0.0_f32; DESCRIPTOR_LENGTH];
    for v in 0..SAMPLES {
        for u in 0..SAMPLES {
            let at = |du: i32, dv: i32| levels[(v + dv) as usize][(u + du) as usize];
            let dx = at(1, 0) + at(1, 1) - at(0, 0) - at(0, 1);
            let dy = at(0, 1) + at(1, 1) - at(0, 0) - at(1, 0);
            let (along, across) = (u as f32 - centre + 0.5, v as f32 - centre + 0.5);
            let weight = (-(along * along + across * across) / (2.0 * 3.3 * 3.3)).exp();
            let (dx, dy) = (weight * dx, weight * dy);
            for (row, row_share) in shares(v) {
                for (col, col_share) in shares(u) {
                    let share = row_share * col_share;
                    let sums = &mut sums[4 * (row * REGIONS + col)..][..4];
                    sums[0] += share * dx;
                    sums[1] += share * dx.abs();
                    sums[2] += share * dy;
                    sums[3] += share * dy.abs();
                }
            }
        }
    }
    let length = sums.iter().map(|sum| sum * sum).sum::<f32>().sqrt();
    if length > 0.0 {
        for sum in &mut sums {
            *sum /= length;
        }
    }
    sums
}
