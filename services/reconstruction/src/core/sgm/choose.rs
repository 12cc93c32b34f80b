//! The disparity with the least sum wins, if it is unique; neighbouring sums give the fraction of a pixel.

use super::lanes::{LANES, Lanes, all};

/// A disparity's number: a byte where that is enough, since half as many registers hold it.
pub(super) trait Number: Copy + PartialEq {
    const ZERO: Self;
    fn of(number: usize) -> Self;
    fn get(self) -> u16;
    /// `self − other`, wrapping.
    fn minus(self, other: Self) -> Self;
    /// `−1`, wrapping.
    const MINUS_ONE: Self;
    const ONE: Self;
}

impl Number for u8 {
    const ZERO: Self = 0;
    const ONE: Self = 1;
    const MINUS_ONE: Self = Self::MAX;
    #[inline(always)]
    fn of(number: usize) -> Self {
        number as Self
    }
    #[inline(always)]
    fn get(self) -> u16 {
        self.into()
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.wrapping_sub(other)
    }
}

impl Number for u16 {
    const ZERO: Self = 0;
    const ONE: Self = 1;
    const MINUS_ONE: Self = Self::MAX;
    #[inline(always)]
    fn of(number: usize) -> Self {
        number as Self
    }
    #[inline(always)]
    fn get(self) -> u16 {
        self
    }
    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.wrapping_sub(other)
    }
}

/// All bits where it is true.
#[inline(always)]
fn mask(is: bool) -> u8 {
    u8::from(is).wrapping_neg()
}

/// What won in one column, for each of 64 rows.
pub(super) struct Winners {
    /// Disparity above the least one, pixels; NaN where no one won.
    pub(super) disparity_px: [f32; LANES],
    /// Its sum.
    pub(super) sum: Lanes,
}

/// Chooses from the sums of one column: one entry a disparity.
#[inline(always)]
pub(super) fn choose<N: Number>(sums: &[Lanes], uniqueness_percent: u8) -> Winners {
    let mut least = all(u8::MAX);
    let mut best = [N::ZERO; LANES];
    for (d, sum) in sums.iter().enumerate() {
        let number = N::of(d);
        for i in 0..LANES {
            best[i] = if sum[i] < least[i] { number } else { best[i] };
            least[i] = least[i].min(sum[i]);
        }
    }
    // The best that is no neighbour, and the two neighbours; `least` where one is missing, which moves nothing (see below).
    let (mut second, mut below, mut above) = (all(u8::MAX), all(0), all(0));
    for (d, sum) in sums.iter().enumerate() {
        let number = N::of(d);
        for i in 0..LANES {
            // Masks, not branches: a choice between two bytes in memory would be made one row at a time.
            let off = number.minus(best[i]);
            let (is_below, is_above) = (mask(off == N::MINUS_ONE), mask(off == N::ONE));
            below[i] |= sum[i] & is_below;
            above[i] |= sum[i] & is_above;
            second[i] = second[i].min(sum[i] | is_below | is_above | mask(off == N::ZERO));
        }
    }
    let margin = 100 - u16::from(uniqueness_percent.min(100));
    let last = sums.len() as u16 - 1;
    let mut disparity_px = [f32::NAN; LANES];
    for i in 0..LANES {
        let number = best[i].get();
        let (sum, below, above) = (f32::from(least[i]), f32::from(below[i]), f32::from(above[i]));
        let inside = (number > 0) & (number < last);
        // Sums of absolute differences fall and rise in straight lines (Shimizu and Okutomi's equiangular fit).
        let rise = below.max(above) - sum;
        let fraction = if inside & (rise > 0.0) { 0.5 * (below - above) / rise } else { 0.0 };
        let unique = u16::from(second[i]) * margin >= u16::from(least[i]) * 100;
        // A sum at its ceiling says nothing.
        disparity_px[i] = if unique & (least[i] < u8::MAX) { f32::from(number) + fraction } else { f32::NAN };
    }
    Winners { disparity_px, sum: least }
}
