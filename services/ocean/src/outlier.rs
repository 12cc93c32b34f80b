//! Readings that cannot be: found, and replaced by their neighbour, as in the thesis (5.2.2 by range, 7.3 by standard deviation).

use std::ops::RangeInclusive;

/// Replaces readings outside `range_m` (and those that are not finite) by the nearest good one before them, or after them at the
/// start. Returns where they were, in order. Where no reading is good nothing is replaced, and all are returned.
pub fn replace_out_of_range(samples_m: &mut [f64], range_m: &RangeInclusive<f64>) -> Vec<usize> {
    // NaN is in no range.
    replace(samples_m, &|value| range_m.contains(&value))
}

/// Replaces readings more than `sigmas` standard deviations from the mean likewise. Mean and deviation are those of all finite
/// readings, outliers included: one sweep, as in the thesis. A spike can hide another; of fewer than `sigmas`² + 1 readings none
/// can ever stand out.
pub fn replace_beyond(samples_m: &mut [f64], sigmas: f64) -> Vec<usize> {
    let finite = || samples_m.iter().copied().filter(|value| value.is_finite());
    let count = finite().count().max(1) as f64;
    let mean_m = finite().sum::<f64>() / count;
    let sigma_m = (finite().map(|value| (value - mean_m).powi(2)).sum::<f64>() / count).sqrt();
    replace(samples_m, &|value| (value - mean_m).abs() <= sigmas * sigma_m)
}

fn replace(samples_m: &mut [f64], is_good: &dyn Fn(f64) -> bool) -> Vec<usize> {
    let bad: Vec<usize> = (0..samples_m.len()).filter(|i| !is_good(samples_m[*i])).collect();
    let Some(first_good) = samples_m.iter().copied().find(|value| is_good(*value)) else { return bad };
    let mut last = first_good;
    for value in samples_m.iter_mut() {
        if is_good(*value) {
            last = *value;
        } else {
            *value = last;
        }
    }
    bad
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn out_of_range_takes_the_neighbour() {
        let mut samples_m = [f64::NAN, 0.99, 4.0, 1.01, 0.0, f64::INFINITY, 1.0];
        assert_eq!(replace_out_of_range(&mut samples_m, &(0.5..=1.5)), [0, 2, 4, 5]);
        assert_eq!(samples_m, [0.99, 0.99, 0.99, 1.01, 1.01, 1.01, 1.0]);
        let mut none = [9.0, f64::NAN];
        assert_eq!(replace_out_of_range(&mut none, &(0.5..=1.5)), [0, 1]);
        assert_eq!(none[0], 9.0, "nothing to replace it by");
        assert!(replace_out_of_range(&mut [], &(0.0..=1.0)).is_empty());
    }

    /// By hand: 99 readings of ±1 and one of 10 have mean 0.09 or so and deviation 1.4: 10 is seven of them out.
    #[test]
    fn a_spike_stands_out_and_the_waves_do_not() {
        let mut samples_m: Vec<f64> = (0..100).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        samples_m[40] = 10.0;
        assert_eq!(replace_beyond(&mut samples_m, 3.0), [40]);
        assert_eq!(samples_m[40], -1.0);
        assert!(replace_beyond(&mut samples_m, 3.0).is_empty());
        assert!(replace_beyond(&mut [2.0; 5], 3.0).is_empty(), "all alike");
        // Nine readings: none can be three deviations away.
        assert!(replace_beyond(&mut [0.0, 0.0, 0.0, 0.0, 1e6, 0.0, 0.0, 0.0, 0.0], 3.0).is_empty());
    }
}
