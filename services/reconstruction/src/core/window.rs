//! Sums over square windows that slide: down a band of rows one row is added and one taken away, along a row powers of two are
//! added up. The cost hardly grows with the window.

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

/// `to[x]` becomes the sum of `window` values of `from` from x on; `from` is longer than `to` by window − 1.
#[inline(always)]
pub(crate) fn sums<T: Addend>(from: &[T], window: usize, scratch: &mut [Vec<T>; 2], to: &mut [T]) {
    let count = to.len();
    let [power, next] = scratch;
    power.clear();
    power.extend_from_slice(&from[..count + window - 1]);
    next.resize(power.len(), T::default());
    // `power[x]` is the sum of `span` values from x on; each bit of the window takes one such sum.
    let (mut span, mut offset, mut rest, mut first) = (1, 0, window, true);
    loop {
        if rest & 1 == 1 {
            let shifted = &power[offset..offset + count];
            if first {
                to.copy_from_slice(shifted);
                first = false;
            } else {
                for (to, value) in to.iter_mut().zip(shifted) {
                    *to = *to + *value;
                }
            }
            offset += span;
        }
        rest >>= 1;
        if rest == 0 {
            return;
        }
        let left = power.len() - span;
        for (next, (a, b)) in next[..left].iter_mut().zip(power[..left].iter().zip(&power[span..])) {
            *next = *a + *b;
        }
        power.truncate(left);
        next.truncate(left);
        std::mem::swap(power, next);
        next.resize(power.len(), T::default());
        span *= 2;
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
        let from: Vec<u16> = (0..60).map(|i| i * i % 37).collect();
        for window in 1..20 {
            let mut to = vec![0; from.len() + 1 - window];
            sums(&from, window, &mut Default::default(), &mut to);
            let plain: Vec<u16> = from.windows(window).map(|w| w.iter().sum()).collect();
            assert_eq!(to, plain, "{window}");
        }
    }
}
