//! How good a calibration is, and which views and corners do not belong.

use super::VIEWS_MIN;
use super::sighting::{Residuals, Side, Sighting, ViewProblem};

/// A view goes when its error is this many times the median view's …
const VIEW_ERROR_RATIO_MAX: f64 = 3.0;
/// … and above this, pixels: with near-perfect pictures ratios mean nothing.
const VIEW_ERROR_PX_MIN: f64 = 0.25;
/// A corner goes when its residual is this many standard deviations long, where one in four million would by chance.
const CORNER_SIGMAS_MAX: f64 = 5.5;

/// Root mean square residual of the kept corners of some pictures, pixels; NaN where there are none.
pub(super) fn rms_px<'a>(views: impl Iterator<Item = (&'a Sighting, &'a Residuals)>, sides: &[Side]) -> f64 {
    let (mut sum, mut count) = (0.0, 0_usize);
    for (sighting, residuals) in views {
        for &side in sides {
            for i in sighting.kept(side) {
                sum += residuals.of(side)[i].norm_squared();
                count += 1;
            }
        }
    }
    (sum / count as f64).sqrt()
}

/// Median residual of a view's kept corners, pixels. Robust: a single bad corner does not make a bad view.
fn median_px(sighting: &Sighting, residuals: &Residuals) -> f64 {
    let mut lengths: Vec<f64> =
        Side::BOTH.into_iter().flat_map(|side| sighting.kept(side).map(move |i| residuals.of(side)[i].norm())).collect();
    let middle = lengths.len() / 2;
    if lengths.is_empty() { f64::NAN } else { *lengths.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// Marks the worst view where its error is far above the median view's; says whether one went. One at a time: a bad view
/// drags the solution along and makes good ones look bad. Keeps at least half of the views, and [`VIEWS_MIN`]: where more look
/// bad, the good ones are not known.
pub(super) fn reject_worst_view(sightings: &mut [Sighting], residuals: &[Residuals]) -> bool {
    let mut errors: Vec<(usize, f64)> = (0..sightings.len())
        .filter(|&view| sightings[view].is_used())
        .map(|view| (view, median_px(&sightings[view], &residuals[view])))
        .collect();
    errors.sort_by(|a, b| b.1.total_cmp(&a.1));
    let limit_px = (errors[errors.len() / 2].1 * VIEW_ERROR_RATIO_MAX).max(VIEW_ERROR_PX_MIN);
    let kept_min = sightings.len().div_ceil(2).max(VIEWS_MIN);
    let (worst, error_px) = errors[0];
    // A NaN error is a view whose pose has no solution: it goes, too.
    let goes = errors.len() > kept_min && (error_px > limit_px || error_px.is_nan());
    if goes {
        sightings[worst].problem = Some(ViewProblem::LargeError);
    }
    goes
}

/// Leaves out corners whose residual is too long for the scatter of all; says whether any went. Where that would be more than
/// `share_max` of all corners it is the model that is wrong, not the corners: only the worst go.
pub(super) fn reject_corners(sightings: &mut [Sighting], residuals: &[Residuals], share_max: f64) -> bool {
    let mut lengths: Vec<(f64, usize, Side, usize)> = Vec::new();
    let (mut total, mut kept) = (0, 0);
    for (view, (sighting, residuals)) in sightings.iter().zip(residuals).enumerate().filter(|(_, (s, _))| s.is_used()) {
        total += 2 * sighting.left.len();
        kept += sighting.kept_count();
        for side in Side::BOTH {
            lengths.extend(sighting.kept(side).map(|i| (residuals.of(side)[i].norm(), view, side, i)));
        }
    }
    lengths.sort_by(|a, b| b.0.total_cmp(&a.0));
    // The length of a normal error in two coordinates (Rayleigh) has its median at 1.1774 standard deviations.
    let sigma_px = lengths[lengths.len() / 2].0 / 1.1774;
    let spare = ((total as f64 * share_max) as usize).saturating_sub(total - kept);
    let mut went = false;
    let mut seen = vec![false; sightings.len()];
    for (length_px, view, side, i) in lengths.into_iter().take(spare) {
        // One of a view at a time: it drags the board's pose along and makes its neighbours look bad. And never so many that
        // the pose hangs on a few corners.
        let kept = sightings[view].kept(side).count();
        let had_its_turn = std::mem::replace(&mut seen[view], true);
        if length_px > CORNER_SIGMAS_MAX * sigma_px && !had_its_turn && kept > sightings[view].left.len() / 2 {
            sightings[view].drop_corner(side, i);
            went = true;
        }
    }
    went
}
