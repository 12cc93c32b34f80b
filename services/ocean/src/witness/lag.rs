//! By how much one series comes later than the other.

use super::CompareError;
use super::align::Pair;

/// Products of a search, at most: some seconds of work.
const PRODUCTS_MAX: usize = 1 << 31;

/// The lag at which the correlation is highest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Best {
    /// How much later `b` comes, seconds.
    pub(super) lag_s: f64,
    /// Pearson's correlation there, of the parabola through the three highest.
    pub(super) correlation: f64,
    /// The lowest of the sampled correlations.
    pub(super) lowest: f64,
    /// Not at an end of the search, where the true highest may lie outside.
    pub(super) inside: bool,
}

/// Within ± `max_lag_s`; trends must be off. `None` where nothing correlates: too few samples in common, or one of them flat.
///
/// The highest of the sampled correlations and its neighbours give a parabola, whose top is the lag between samples: within 1 %
/// of a sample for ten samples a wave, as the correlation of waves is a cosine near its top.
pub(super) fn best(pair: &Pair, max_lag_s: f64) -> Result<Option<Best>, CompareError> {
    let n = pair.samples();
    // Half of the samples must remain at the largest lag.
    let reach = ((max_lag_s * pair.rate_hz).ceil() as usize).min(n / 2);
    if n.saturating_mul(2 * reach + 1) > PRODUCTS_MAX {
        return Err(CompareError::TooLong { samples: n });
    }
    // One more to either side, so that a lag of just the largest has neighbours.
    let found: Vec<f64> = (-(reach as isize) - 1..=reach as isize + 1).map(|shift| correlation(pair, shift)).collect();
    let Some((top, &highest)) = found.iter().enumerate().filter(|(_, r)| r.is_finite()).max_by(|a, b| a.1.total_cmp(b.1))
    else {
        return Ok(None);
    };
    let lowest = found.iter().copied().fold(f64::INFINITY, f64::min);
    let at = |index: usize| (index as f64 - reach as f64 - 1.0) / pair.rate_hz;
    if top == 0 || top + 1 == found.len() {
        return Ok(Some(Best { lag_s: at(top), correlation: highest, lowest, inside: false }));
    }
    let (before, after) = (found[top - 1], found[top + 1]);
    let bend = before - 2.0 * highest + after;
    let offset = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
    let correlation = (highest - 0.25 * (before - after) * offset).min(1.0);
    Ok(Some(Best { lag_s: at(top) + offset / pair.rate_hz, correlation, lowest, inside: true }))
}

/// Of `a` with `b` taken `shift` samples later, over the instants that both have.
fn correlation(pair: &Pair, shift: isize) -> f64 {
    let later = shift.unsigned_abs();
    let (a_m, b_m) = if shift >= 0 { (&pair.a_m[..], &pair.b_m[later..]) } else { (&pair.a_m[later..], &pair.b_m[..]) };
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in a_m.iter().zip(b_m).filter(|(a, b)| a.is_finite() && b.is_finite()) {
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    ab / (aa * bb).sqrt()
}
