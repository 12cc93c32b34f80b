//! Left and right must agree: a pixel of the right picture belongs to the left pixel that matches it at the least cost.

use super::strip::{Job, Output};

/// Removes matches whose right pixel belongs, more cheaply, to another one.
#[inline(always)]
pub(super) fn left_right(job: &Job<'_>, right: &mut Vec<(u8, i16)>, output: Output<'_>) {
    let Some(most_px) = job.settings.left_right_max_px else { return };
    let (width, most_px) = (job.left.width, i32::from(most_px));
    for (disparities, sums) in output.disparity_px.chunks_exact_mut(width).zip(output.sums.chunks_exact(width)) {
        right.clear();
        right.resize(width, (u8::MAX, 0));
        for (x, (disparity_px, sum)) in disparities.iter().zip(sums).enumerate() {
            let whole_px = disparity_px.round();
            // NaN is not at or above anything.
            let at_px = x as f32 - whole_px;
            if at_px >= 0.0
                && let Some(owner) = right.get_mut(at_px as usize)
                && *sum < owner.0
            {
                *owner = (*sum, whole_px as i16);
            }
        }
        for (x, disparity_px) in disparities.iter_mut().enumerate() {
            if disparity_px.is_nan() {
                continue;
            }
            // Between two pixels, either may be the one: a fraction of a pixel is no disagreement.
            let differs = |whole_px: f32| {
                let at = x as i32 - whole_px as i32;
                let owner = usize::try_from(at).ok().and_then(|at| right.get(at));
                owner.is_some_and(|(sum, owner_px)| *sum < u8::MAX && (i32::from(*owner_px) - whole_px as i32).abs() > most_px)
            };
            if differs(disparity_px.floor()) && differs(disparity_px.ceil()) {
                *disparity_px = f32::NAN;
            }
        }
    }
}
