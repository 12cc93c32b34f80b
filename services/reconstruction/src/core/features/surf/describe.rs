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

/// Responses of the two Haar wavelets of side 2 `half_px` centred between pixels at (x, y): right less left, below less above.
fn haar(integral: &Integral, x_px: f32, y_px: f32, half_px: i32) -> (f32, f32) {
    // An even box is centred on the corner before pixel `col`, half a pixel up and left of it.
    let (col, row) = ((x_px + 0.5).round() as i32, (y_px + 0.5).round() as i32);
    let (left, top, side) = (col - half_px, row - half_px, 2 * half_px);
    let dx = integral.sum_inside(col, top, half_px, side) - integral.sum_inside(left, top, half_px, side);
    let dy = integral.sum_inside(left, row, side, half_px) - integral.sum_inside(left, top, side, half_px);
    (dx, dy)
}

/// The direction in which most of the gradient points: the longest sum of wavelet responses in any sector of π/3.
pub(super) fn orientation_rad(integral: &Integral, blob: &Blob) -> f32 {
    let sigma = blob.sigma_px;
    let half_px = (2.0 * sigma).round() as i32;
    let mut samples = [(0.0_f32, 0.0_f32, 0.0_f32); ((2 * ORIENTATION_RADIUS + 1) * (2 * ORIENTATION_RADIUS + 1)) as usize];
    let mut count = 0;
    for v in -ORIENTATION_RADIUS..=ORIENTATION_RADIUS {
        for u in -ORIENTATION_RADIUS..=ORIENTATION_RADIUS {
            let squared = u * u + v * v;
            if squared > ORIENTATION_RADIUS * ORIENTATION_RADIUS {
                continue;
            }
            let (dx, dy) = haar(integral, blob.x_px + u as f32 * sigma, blob.y_px + v as f32 * sigma, half_px);
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

/// Σdx, Σ|dx|, Σdy, Σ|dy| in each of 4 × 4 subregions of a window of 20 σ, turned by `angle_rad`; of unit length, so that
/// contrast does not matter.
pub(super) fn descriptor(integral: &Integral, blob: &Blob, angle_rad: f32) -> [f32; DESCRIPTOR_LENGTH] {
    let sigma = blob.sigma_px;
    let half_px = (sigma.round() as i32).max(1);
    let (sin, cos) = angle_rad.sin_cos();
    let mut sums = [0.0_f32; DESCRIPTOR_LENGTH];
    for v in 0..SAMPLES {
        for u in 0..SAMPLES {
            let centre = SAMPLES as f32 / 2.0 - 0.5;
            let (along, across) = (u as f32 - centre, v as f32 - centre);
            let x_px = blob.x_px + sigma * (cos * along - sin * across);
            let y_px = blob.y_px + sigma * (sin * along + cos * across);
            let (dx, dy) = haar(integral, x_px, y_px, half_px);
            let weight = (-(along * along + across * across) / (2.0 * 3.3 * 3.3)).exp();
            let (dx, dy) = (weight * (cos * dx + sin * dy), weight * (cos * dy - sin * dx));
            let region = (v as usize * REGIONS / SAMPLES as usize) * REGIONS + u as usize * REGIONS / SAMPLES as usize;
            let sums = &mut sums[4 * region..][..4];
            sums[0] += dx;
            sums[1] += dx.abs();
            sums[2] += dy;
            sums[3] += dy.abs();
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
