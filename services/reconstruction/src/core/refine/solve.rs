//! The normal equations of one window.

/// A correction beyond this, pixels, means that the start was wrong, not rough.
const CORRECTION_MAX_PX: f32 = 1.0;
/// Contrast of two cameras that look at the same water differs by less than this factor.
const GAIN_MAX: f32 = 3.0;
/// Texture must exceed what rounding to whole grey levels makes (variance 1/12), grey levels² per px².
const SLOPE_VARIANCE_MIN: f32 = 0.1;

/// What is summed over a window: left, warped right and slope, their products, and the disparity of the start.
pub(super) const SUMS: usize = 10;

/// The disparity and its standard deviation for each pixel of a row, from the sums over its window of `samples` pixels; `None` where
/// there is no texture, or where the two pictures do not fit.
///
/// With the offset gone (covariances), left = a · warped − p · slope, p = a δ: two normal equations. Written without branches, so that
/// several pixels are solved at once.
#[inline(always)]
pub(super) fn solve(sums: [f32; SUMS], samples: f32) -> (bool, f32, f32) {
    let [l, r, g, ll, rr, gg, lr, lg, rg, start_px] = sums.map(|sum| sum / samples);
    let (ll, rr, gg) = (ll - l * l, rr - r * r, gg - g * g);
    let (lr, lg, rg) = (lr - l * r, lg - l * g, rg - r * g);
    let determinant = gg * rr - rg * rg;
    let p = (rg * lr - rr * lg) / determinant;
    let gain = (gg * lr - rg * lg) / determinant;
    let correction_px = p / gain;
    let fits = (gg >= SLOPE_VARIANCE_MIN)
        & (determinant > 1e-3 * gg * rr)
        & (gain > 1.0 / GAIN_MAX)
        & (gain < GAIN_MAX)
        & (correction_px.abs() < CORRECTION_MAX_PX);
    let unexplained = (ll - gain * lr + p * lg).max(0.0) * samples / (samples - 3.0);
    let variance = unexplained * rr / (samples * determinant * gain * gain);
    (fits, start_px + correction_px, variance.max(0.0).sqrt())
}
