//! Repairs of evenly sampled readings, each with an account of what it changed.
//!
//! The rules are those of [`crate::outlier`] (the thesis, 5.2.2 and 7.3) and of [`super::phase_space`].

use std::ops::RangeInclusive;

use crate::outlier::{replace_beyond, replace_out_of_range};

/// Readings after a repair, and which of them were something else before.
#[derive(Debug, Clone, PartialEq)]
pub struct Repaired {
    /// All readings, metres. Where nothing good was there to replace by, those that were to be replaced are as they were.
    pub samples_m: Vec<f64>,
    /// What was found to be wrong, in order.
    pub changes: Vec<Change>,
}

/// One reading that was replaced.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// Its index.
    pub index: usize,
    /// What it was, metres; NaN where it was missing.
    pub before_m: f64,
    /// What it is now, metres.
    pub after_m: f64,
}

impl Repaired {
    /// Of samples as they were and as they are, with the indices that were replaced.
    pub(super) fn of(before_m: &[f64], samples_m: Vec<f64>, indices: &[usize]) -> Self {
        let changes = indices
            .iter()
            .filter_map(|&index| Some(Change { index, before_m: *before_m.get(index)?, after_m: *samples_m.get(index)? }))
            .collect();
        Self { samples_m, changes }
    }
}

/// Replaces what is more than `sigmas` standard deviations from the mean by its neighbour: the thesis's rule (7.3) with 3.
#[must_use]
pub fn beyond(samples_m: &[f64], sigmas: f64) -> Repaired {
    let mut mended = samples_m.to_vec();
    let indices = replace_beyond(&mut mended, sigmas);
    Repaired::of(samples_m, mended, &indices)
}

/// Replaces what is outside `range_m` by its neighbour: the thesis's rule for the ultrasonic probe (5.2.2).
#[must_use]
pub fn out_of_range(samples_m: &[f64], range_m: &RangeInclusive<f64>) -> Repaired {
    let mut mended = samples_m.to_vec();
    let indices = replace_out_of_range(&mut mended, range_m);
    Repaired::of(samples_m, mended, &indices)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_changed_is_told() {
        let found = out_of_range(&[1.0, 4.0, 1.1], &(0.5..=1.5));
        assert_eq!(found.samples_m, [1.0, 1.0, 1.1]);
        assert_eq!(found.changes, [Change { index: 1, before_m: 4.0, after_m: 1.0 }]);
        let mut samples_m: Vec<f64> = (0..100).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        samples_m[40] = 10.0;
        let found = beyond(&samples_m, 3.0);
        assert_eq!(found.changes, [Change { index: 40, before_m: 10.0, after_m: -1.0 }]);
        assert!(beyond(&found.samples_m, 3.0).changes.is_empty());
        assert!(beyond(&[], 3.0).changes.is_empty());
    }
}
