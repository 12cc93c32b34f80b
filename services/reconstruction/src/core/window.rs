//! Sums over square windows that slide: down a band of rows one row is added and one taken away, along a row each sum is added up in
//! registers.

/// Rows that one task works through. Fixed, so that rounding, and with it the result, does not depend on how many threads there are.
pub(crate) const BAND_ROWS: usize = 64;

/// An index beyond an end, mirrored about the first or last sample (OpenCV's `BORDER_REFLECT_101`).
#[inline(always)]
pub(crate) fn mirrored(index: isize, count: usize) -> usize {
    if count < 2 {
        return 0;
    }
    let period = 2 * (count as isize - 1);
    let at = index.rem_euclid(period);
    (if at < count as isize { at } else { period - at }) as usize
}

/// Fills the `margin` values before and after the inner ones with their mirror images.
#[inline(always)]
pub(crate) fn mirror_ends<T: Copy>(padded: &mut [T], margin: usize) {
    let count = padded.len() - 2 * margin;
    for i in 1..=margin {
        padded[margin - i] = padded[margin + mirrored(-(i as isize), count)];
        padded[margin + count - 1 + i] = padded[margin + mirrored((count - 1 + i) as isize, count)];
    }
}

/// What a sum can be made of.
pub(crate) trait Addend: Copy + Default + std::ops::Add<Output = Self> {}
impl Addend for f32 {}
impl Addend for u16 {}

/// Values that are worked on side by side.
const LANES: usize = 32;

/// `to[x]` becomes the sum of `window` values of `from` from x on; `from` is longer than `to` by window − 1.
#[inline(always)]
pub(crate) fn sums<T: Addend>(from: &[T], window: usize, to: &mut [T]) {
    let (blocks, rest) = to.as_chunks_mut::<LANES>();
    let done = blocks.len() * LANES;
    for (block, to) in blocks.iter_mut().enumerate() {
        let from = &from[block * LANES..][..LANES + window - 1];
        let mut sum = [T::default(); LANES];
        for step in 0..window {
            let Some(from) = from[step..].first_chunk::<LANES>() else { break };
            for (sum, from) in sum.iter_mut().zip(from) {
                *sum = *sum + *from;
            }
        }
        *to = sum;
    }
    for (to, from) in rest.iter_mut().zip(from[done..].windows(window)) {
        *to = from.iter().fold(T::default(), |sum, value| sum + *value);
    }
}

/// `to[i]` becomes the sum of `window` (odd) values of `from` from 2 i on.
#[inline(always)]
pub(crate) fn sums_of_every_second<T: Addend>(from: &[T], window: usize, scratch: &mut [Vec<T>; 2], to: &mut [T]) {
    let half = window / 2;
    let [pairs, evens] = scratch;
    pairs.resize(to.len() + half, T::default());
    evens.resize(to.len() + half, T::default());
    for ((pair, even), from) in pairs.iter_mut().zip(evens.iter_mut()).zip(from.as_chunks::<2>().0) {
        *pair = from[0] + from[1];
        *even = from[0];
    }
    // The last value may have no partner.
    if let (true, Some(last), Some(even)) = (from.len() % 2 == 1, from.last(), evens.get_mut(from.len() / 2)) {
        *even = *last;
    }
    match half {
        0 => to.copy_from_slice(&evens[..to.len()]),
        half => {
            let count = to.len();
            sums(&pairs[..count + half - 1], half, to);
            for (to, even) in to.iter_mut().zip(&evens[half..]) {
                *to = *to + *even;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_mirrored_without_repeating_them() {
        let mut padded = [0, 0, 0, 1, 2, 3, 4, 0, 0, 0];
        mirror_ends(&mut padded, 3);
        assert_eq!(padded, [4, 3, 2, 1, 2, 3, 4, 3, 2, 1]);
        let mut one = [0, 0, 7, 0, 0];
        mirror_ends(&mut one, 2);
        assert_eq!(one, [7; 5]);
        let mut two = [0, 0, 0, 1, 2, 0, 0, 0];
        mirror_ends(&mut two, 3);
        assert_eq!(two, [2, 1, 2, 1, 2, 1, 2, 1]);
    }

    #[test]
    fn windows_of_any_width_are_summed() {
        let from: Vec<u16> = (0..297).map(|i| i * i % 37).collect();
        for (window, from) in (1..24).flat_map(|window| [(window, &from[..]), (window, &from[1..])]) {
            let mut to = vec![0; from.len() + 1 - window];
            sums(from, window, &mut to);
            let plain: Vec<u16> = from.windows(window).map(|w| w.iter().sum()).collect();
            assert_eq!(to, plain, "{window}");
            if window % 2 == 1 {
                let mut to = vec![0; plain.len().div_ceil(2)];
                sums_of_every_second(from, window, &mut Default::default(), &mut to);
                assert_eq!(to, plain.iter().copied().step_by(2).collect::<Vec<_>>(), "every second of {window}");
            }
        }
    }
}
