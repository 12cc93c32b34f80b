//! How good is a disparity map? Judged against a known one, as in Scharstein and Szeliski (2002).

use super::Disparity;

/// A map against its truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Pixels whose true disparity is known.
    pub known: usize,
    /// Share of these that were matched, 0 to 1.
    pub density: f64,
    /// Share of the matched ones that are off by more than 1 px, 0 to 1; NaN where none was matched.
    pub bad1: f64,
    /// Share of the matched ones that are off by more than 2 px, 0 to 1; NaN where none was matched.
    pub bad2: f64,
    /// Mean absolute error of the matched ones, pixels; NaN where none was matched.
    pub mean_error_px: f64,
}

/// Two maps of different size.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the true disparity has {truth_width_px}x{truth_height_px} px, the pictures have {width_px}x{height_px}")]
pub struct SizeError {
    truth_width_px: u32,
    truth_height_px: u32,
    width_px: u32,
    height_px: u32,
}

/// Compares `disparity` with `truth` where both are known.
///
/// # Errors
/// [`SizeError`] where they differ in size.
pub fn score(disparity: &Disparity, truth: &Disparity) -> Result<Score, SizeError> {
    let (width_px, height_px) = (disparity.width_px, disparity.height_px);
    if (width_px, height_px) != (truth.width_px, truth.height_px) {
        return Err(SizeError { truth_width_px: truth.width_px, truth_height_px: truth.height_px, width_px, height_px });
    }
    let pairs = disparity.values_px.iter().zip(&truth.values_px).filter(|(_, truth)| truth.is_finite());
    let errors = pairs.clone().filter(|(value, _)| value.is_finite()).map(|(value, truth)| f64::from((value - truth).abs()));
    let (known, matched) = (pairs.count(), errors.clone().count() as f64);
    let bad = |limit_px: f64| errors.clone().filter(|error| *error > limit_px).count() as f64 / matched;
    Ok(Score {
        known,
        density: if known == 0 { 0.0 } else { matched / known as f64 },
        bad1: bad(1.0),
        bad2: bad(2.0),
        mean_error_px: errors.clone().sum::<f64>() / matched,
    })
}

/// The truth without the pixels that only the left camera sees: beyond the right picture's left edge, or behind something nearer
/// (Scharstein and Szeliski's "non-occluded").
#[must_use]
pub fn non_occluded(truth: &Disparity) -> Disparity {
    let mut seen = truth.clone();
    let width = truth.width_px as usize;
    let mut nearest_px = vec![f32::NEG_INFINITY; width];
    for row in seen.values_px.chunks_exact_mut(width.max(1)) {
        nearest_px.fill(f32::NEG_INFINITY);
        let place = |x: usize, disparity_px: f32| {
            let right_px = (x as f32 - disparity_px).round();
            (right_px >= 0.0 && right_px < width as f32).then_some(right_px as usize)
        };
        for (x, disparity_px) in row.iter().enumerate() {
            if let Some(at) = place(x, *disparity_px) {
                nearest_px[at] = nearest_px[at].max(*disparity_px);
            }
        }
        for (x, disparity_px) in row.iter_mut().enumerate() {
            // A slanted surface may put two pixels on one: a step of more than a pixel is another surface.
            if !place(x, *disparity_px).is_some_and(|at| *disparity_px > nearest_px[at] - 1.0) {
                *disparity_px = f32::NAN;
            }
        }
    }
    seen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_foreground_hides_what_is_behind_it() {
        // A bar with disparity 3 before a wall with 1: it covers right pixels 2 to 3, where the wall's left pixels 3 and 4 would be.
        let truth = map(&[1.0, 1.0, 1.0, 1.0, 1.0, 3.0, 3.0, 1.0]);
        let seen: Vec<bool> = non_occluded(&truth).values_px.iter().map(|value| value.is_finite()).collect();
        assert_eq!(seen, [false, true, true, false, false, true, true, true]);
        assert!(non_occluded(&Disparity::default()).values_px.is_empty());
    }

    fn map(values_px: &[f32]) -> Disparity {
        Disparity { width_px: values_px.len() as u32, height_px: 1, values_px: values_px.to_vec() }
    }

    #[test]
    fn counted_by_hand() {
        let truth = map(&[5.0, 5.0, 5.0, 5.0, 5.0, f32::NAN]);
        let score = score(&map(&[5.0, 6.5, 2.0, f32::NAN, 5.5, 9.0]), &truth).unwrap();
        assert_eq!(score, Score { known: 5, density: 0.8, bad1: 0.5, bad2: 0.25, mean_error_px: 1.25 });
    }

    #[test]
    fn nothing_to_compare() {
        let empty = score(&map(&[f32::NAN]), &map(&[1.0])).unwrap();
        assert!(empty.known == 1 && empty.density == 0.0 && empty.bad1.is_nan() && empty.mean_error_px.is_nan());
        assert_eq!(score(&map(&[1.0]), &map(&[f32::NAN])).unwrap().density, 0.0);
        assert!(score(&map(&[1.0]), &map(&[1.0, 2.0])).is_err());
    }
}
