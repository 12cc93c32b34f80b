//! Plans of Fourier transforms, kept for the lengths that were asked for last.
//!
//! To plan one takes longer than to carry it out, and whoever looks at a record again and again as it grows asks for the same few lengths. What is kept is
//! bounded, each thread has its own, and no result hangs on it.

use std::cell::RefCell;
use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// Lengths that are kept. Longer plans are not: they are megabytes, and then planning is the smaller part.
const KEPT: usize = 12;
const LENGTH_MAX: usize = 1 << 14;

type Forward = Arc<dyn RealToComplex<f64>>;
type Inverse = Arc<dyn ComplexToReal<f64>>;

thread_local! {
    static FORWARD: RefCell<Vec<(usize, Forward)>> = const { RefCell::new(Vec::new()) };
    static INVERSE: RefCell<Vec<(usize, Inverse)>> = const { RefCell::new(Vec::new()) };
}

/// From so many real samples to components.
pub(crate) fn forward(length: usize) -> Forward {
    FORWARD.with_borrow_mut(|kept| newest(kept, length, || RealFftPlanner::new().plan_fft_forward(length)))
}

/// From components to so many real samples.
pub(crate) fn inverse(length: usize) -> Inverse {
    INVERSE.with_borrow_mut(|kept| newest(kept, length, || RealFftPlanner::new().plan_fft_inverse(length)))
}

/// The plan of this length, first in the list afterwards; the one that was not asked for the longest gives way.
fn newest<P: Clone>(kept: &mut Vec<(usize, P)>, length: usize, plan: impl FnOnce() -> P) -> P {
    if length > LENGTH_MAX {
        return plan();
    }
    if let Some(place) = kept.iter().position(|(of, _)| *of == length) {
        kept[..=place].rotate_right(1);
    } else {
        kept.insert(0, (length, plan()));
        kept.truncate(KEPT);
    }
    kept[0].1.clone()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_asked_for_last_is_kept_and_no_more() {
        let mut kept = Vec::new();
        let mut planned = Vec::new();
        for length in [1, 2, 1, 3, LENGTH_MAX + 1, 2, LENGTH_MAX + 1].into_iter().chain(4..=13).chain([2, 1]) {
            let found = newest(&mut kept, length, || {
                planned.push(length);
                10 * length
            });
            assert_eq!(found, 10 * length);
            assert!(kept.len() <= KEPT);
        }
        // After 1, 3 and 2 came ten others, which leave room for 3 and 2; 1 was asked for before them.
        let expected: Vec<usize> = [1, 2, 3, LENGTH_MAX + 1, LENGTH_MAX + 1].into_iter().chain(4..=13).chain([1]).collect();
        assert_eq!(planned, expected);
        assert_eq!((forward(100).len(), inverse(100).len(), forward(100).len()), (100, 100, 100));
    }
}
