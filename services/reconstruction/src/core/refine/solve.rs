//! The normal equations of one window.

/// A correction beyond this, pixels, means that the start was wrong, not rough.
const CORRECTION_MAX_PX: f32 = 1.0;
/// Contrast of two cameras that look at the same water differs by less than this factor.
const GAIN_MAX: f32 = 3.0;
/// Texture must exceed what rounding to whole grey levels makes (variance 1/12), grey levels² per px².
const SLOPE_VARIANCE_MIN: f32 = 0.1;

/// What is summed over a window: left, warped right and slope, their products, and the disparity of the start.
pub(super) const SUMS: usize = 10;

/// A row of results.
pub(super) struct Solved<'a> {
    pub(super) disparity_px: &'a mut [f32],
    pub(super) sigma_px: &'a mut [f32],
}

/// The disparity and its standard deviation for each pixel of a row, from the sums over its window of `samples` pixels; where there is no
/// texture, or the two pictures do not fit, `before` (NaN after the last round) and NaN.
///
/// With the offset gone (covariances), left = a · warped − p · slope, p = a δ: two normal equations. Written without branches, so that
/// many pixels are solved at once.
#[inline(always)]
pub(super) fn solve(sums: [&[f32]; SUMS], samples: f32, base_px: f32, before: &[f32], is_last: bool, to: &mut Solved<'_>) {
    let width = before.len();
    let [l, r, g, ll, rr, gg, lr, lg, rg, start] = sums;
    let (l, r, g, start) = (&l[..width], &r[..width], &g[..width], &start[..width]);
    let (ll, rr, gg) = (&ll[..width], &rr[..width], &gg[..width]);
    let (lr, lg, rg) = (&lr[..width], &lg[..width], &rg[..width]);
    let (values, sigmas) = (&mut to.disparity_px[..width], &mut to.sigma_px[..width]);
    let (per_sample, freedom) = (1.0 / samples, 1.0 / (samples - 3.0));
    for x in 0..width {
        let (l, r, g) = (l[x] * per_sample, r[x] * per_sample, g[x] * per_sample);
        let (ll, rr, gg) = (ll[x] * per_sample - l * l, rr[x] * per_sample - r * r, gg[x] * per_sample - g * g);
        let (lr, lg, rg) = (lr[x] * per_sample - l * r, lg[x] * per_sample - l * g, rg[x] * per_sample - r * g);
        let determinant = gg * rr - rg * rg;
        let inverse = 1.0 / determinant;
        let p = (rg * lr - rr * lg) * inverse;
        let gain = (gg * lr - rg * lg) * inverse;
        let correction_px = p / gain;
        let fits = (gg >= SLOPE_VARIANCE_MIN)
            & (determinant > 1e-3 * gg * rr)
            & (gain > 1.0 / GAIN_MAX)
            & (gain < GAIN_MAX)
            & (correction_px.abs() < CORRECTION_MAX_PX)
            & !before[x].is_nan();
        let unexplained = ll - gain * lr + p * lg;
        let variance = unexplained * freedom * rr * inverse / (gain * gain);
        // Rounding may leave less than nothing unexplained.
        let sigma_px = (if variance > 0.0 { variance } else { 0.0 }).sqrt();
        let otherwise = if is_last { f32::NAN } else { before[x] };
        values[x] = if fits { base_px + start[x] * per_sample + correction_px } else { otherwise };
        sigmas[x] = if fits { sigma_px } else { f32::NAN };
    }
}
