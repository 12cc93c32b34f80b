//! Left and right must agree: a pixel of the right picture belongs to the left pixel that matches it at the least sum.

use super::strip::{Job, Output};

/// To whom the pixels of one row of the right picture belong; kept from row to row.
#[derive(Debug, Default)]
pub(super) struct Owners {
    /// Sum (high half) and disparity's number (low half) of the cheapest match; the last one takes what has none.
    owners: Vec<u32>,
    /// For each left pixel: its match in the right picture, and its disparity's number.
    matches: Vec<(u32, u32)>,
}

impl Owners {
    /// Removes matches whose right pixel belongs to one whose disparity differs by more than is allowed.
    ///
    /// Without branches: which way they go is as random as the picture.
    #[inline(always)]
    pub(super) fn left_right(&mut self, job: &Job<'_>, output: &mut Output<'_>) {
        let Some(most) = job.settings.left_right_max_px.map(u32::from) else { return };
        let (width, min_px) = (job.left.width, job.min_px);
        self.matches.resize(width, (0, 0));
        for (disparities, sums) in output.disparity_px.chunks_exact_mut(width).zip(output.sums.chunks_exact(width)) {
            for (x, (to, disparity_px)) in self.matches.iter_mut().zip(disparities.iter()).enumerate() {
                let number = (disparity_px - min_px as f32 + 0.5) as i32;
                let at = x as i32 - min_px - number;
                *to = (if disparity_px.is_nan() { width as u32 } else { at as u32 }, number as u32);
            }
            self.owners.clear();
            self.owners.resize(width + 1, u32::MAX);
            for ((at, number), sum) in self.matches.iter().zip(sums) {
                if let Some(owner) = self.owners.get_mut(*at as usize) {
                    *owner = (*owner).min(u32::from(*sum) << 16 | number);
                }
            }
            for ((at, number), disparity_px) in self.matches.iter().zip(disparities) {
                let owner = self.owners.get(*at as usize).map_or(u32::MAX, |owner| owner & 0xffff);
                *disparity_px = if owner.abs_diff(*number) <= most { *disparity_px } else { f32::NAN };
            }
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        self.owners.capacity() * size_of::<u32>() + self.matches.capacity() * size_of::<(u32, u32)>()
    }
}
