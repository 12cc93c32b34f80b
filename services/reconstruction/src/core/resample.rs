//! Sampling a picture between its pixels, exactly enough for disparities of a hundredth of a pixel.
//!
//! OpenCV's cubic kernel (a = −0.75) does not even reproduce a straight ramp: it shifts gentle texture by up to 0.047 px, to
//! and fro within each pixel, which at 5 m is 8 mm of water. Lanczos-4 errs by 0.012 px. Six-point Lagrange interpolation is
//! exact for polynomials up to the fifth degree: 0.0002 px for texture of 8 px per period, 0.0008 px at 6.
//!
//! Where samples come from changes little from pixel to pixel, so neighbours share the whole part of their shift: they are computed
//! side by side from six plain vectors of pixels, whose weights are polynomials of the fraction. No table, no gathering.

use multiversion::multiversion;

/// Points that a sample is made of.
const TAPS: usize = 6;
/// Of those, how many lie before the pixel that contains the sample.
const TAPS_BEFORE: usize = 2;
/// Samples that are computed side by side.
const LANES: usize = 16;
/// Values that [`shifted`] needs before and after a row, because lanes that are not wanted are computed, too.
pub(crate) const MARGIN: usize = LANES + TAPS;

/// A row of values with its ends repeated on both sides, for [`shifted`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Row(Vec<f32>);

impl Row {
    /// For `width` values. Allocates only where it grows.
    pub(crate) fn resize(&mut self, width: usize) {
        self.0.resize(width + 2 * MARGIN, 0.0);
    }

    /// Its values, to be written before [`Self::repeat_ends`].
    pub(crate) fn values_mut(&mut self) -> &mut [f32] {
        let end = self.0.len().saturating_sub(MARGIN);
        self.0.get_mut(MARGIN..end).unwrap_or_default()
    }

    /// Repeats the first and the last value.
    pub(crate) fn repeat_ends(&mut self) {
        let end = self.0.len().saturating_sub(MARGIN);
        if end > MARGIN {
            let (first, last) = (self.0[MARGIN], self.0[end - 1]);
            self.0[..MARGIN].fill(first);
            self.0[end..].fill(last);
        }
    }

    /// How many bytes it holds.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of::<f32>() * self.0.capacity()
    }
}

/// How far from `x` to go to be at `to`, held within `count` pixels. NaN goes to the first.
#[inline(always)]
pub(crate) fn shift(x: usize, to: f32, count: usize) -> f32 {
    to.max(0.0).min((count - 1) as f32) - x as f32
}

/// Samples of `row` at x + `shift_px[x]` for each x, which [`shift`] holds within the row.
#[inline(always)]
pub(crate) fn shifted(row: &Row, shift_px: &[f32], to: &mut [f32]) {
    let blocks = shift_px.chunks(LANES).zip(to.chunks_mut(LANES)).enumerate();
    for (block, (shift_px, to)) in blocks {
        let mut lanes = Lanes::new(shift_px);
        let mut values = [0.0; LANES];
        while let Some(whole) = lanes.next_whole() {
            // Written so that no path can panic: a shift beyond the margin finds nothing.
            let start = (MARGIN + block * LANES) as i64 + i64::from(whole) - TAPS_BEFORE as i64;
            let points =
                usize::try_from(start).ok().and_then(|start| row.0.get(start..)?.first_chunk::<{ LANES + TAPS - 1 }>());
            let points = points.unwrap_or(&[0.0; LANES + TAPS - 1]);
            let mut taps = [[0.0; LANES]; TAPS];
            for (tap, to) in taps.iter_mut().enumerate() {
                to.copy_from_slice(&points[tap..tap + LANES]);
            }
            lanes.interpolate(whole, &taps, &mut values);
        }
        put(&values, to);
    }
}

/// Samples of the columns of an 8-bit picture at `row` + `shift_px[x]` for each column x.
#[inline(always)]
fn shifted_down(picture: &[u8], width: usize, row: usize, shift_px: &[f32], to: &mut [f32]) {
    let last = (picture.len() / width) as i64 - 1;
    for (block, (shift_px, to)) in shift_px.chunks(LANES).zip(to.chunks_mut(LANES)).enumerate() {
        let mut lanes = Lanes::new(shift_px);
        let mut values = [0.0; LANES];
        while let Some(whole) = lanes.next_whole() {
            let mut taps = [[0.0; LANES]; TAPS];
            for (tap, to) in taps.iter_mut().enumerate() {
                let at = (row as i64 + i64::from(whole) + tap as i64 - TAPS_BEFORE as i64).clamp(0, last) as usize;
                let pixels = &picture[at * width + block * LANES..];
                let mut padded = [0; LANES];
                let pixels = match pixels.first_chunk::<LANES>() {
                    Some(pixels) => pixels,
                    // The last few of the last row.
                    None => {
                        padded[..pixels.len()].copy_from_slice(pixels);
                        &padded
                    }
                };
                for lane in 0..LANES {
                    to[lane] = f32::from(pixels[lane]);
                }
            }
            lanes.interpolate(whole, &taps, &mut values);
        }
        put(&values, to);
    }
}

/// Neighbours whose samples are interpolated side by side: for each whole part among their shifts, rising, all of them are computed and
/// those kept that have it.
struct Lanes {
    wholes: [i32; LANES],
    fractions: [f32; LANES],
    whole: Option<i32>,
}

impl Lanes {
    #[inline(always)]
    fn new(shift_px: &[f32]) -> Self {
        let mut fractions = [0.0; LANES];
        match shift_px.first_chunk::<LANES>() {
            Some(all) => fractions = *all,
            None => {
                // Lanes that are not there do as the first.
                fractions.fill(shift_px.first().copied().unwrap_or(0.0));
                fractions[..shift_px.len()].copy_from_slice(shift_px);
            }
        }
        let mut wholes = [0; LANES];
        for lane in 0..LANES {
            let whole = fractions[lane].floor();
            wholes[lane] = small_whole(whole);
            fractions[lane] -= whole;
        }
        Self { wholes, fractions, whole: None }
    }

    #[inline(always)]
    fn next_whole(&mut self) -> Option<i32> {
        let after = self.whole.unwrap_or(i32::MIN);
        let mut larger = [i32::MAX; LANES];
        for (larger, whole) in larger.iter_mut().zip(self.wholes) {
            *larger = if whole > after { whole } else { i32::MAX };
        }
        let next = least(larger);
        self.whole = (next != i32::MAX).then_some(next);
        self.whole
    }

    /// Lagrange's polynomial through `taps` at −2, −1, 0, 1, 2 and 3, for the lanes from `whole` on.
    #[inline(always)]
    fn interpolate(&self, whole: i32, taps: &[[f32; LANES]; TAPS], values: &mut [f32; LANES]) {
        for lane in 0..LANES {
            let value = lagrange(
                [taps[0][lane], taps[1][lane], taps[2][lane], taps[3][lane], taps[4][lane], taps[5][lane]],
                self.fractions[lane],
            );
            values[lane] = if self.wholes[lane] >= whole { value } else { values[lane] };
        }
    }
}

/// The integer that a whole number of less than 2²² is; of others, any. A cast saturates, which is not vectorised; this is one addition.
#[inline(always)]
fn small_whole(whole: f32) -> i32 {
    const MAGIC: f32 = 12_582_912.0;
    ((whole + MAGIC).to_bits() as i32).wrapping_sub(MAGIC.to_bits() as i32)
}

/// Written as a tree, which stays in vectors.
#[inline(always)]
fn least(x: [i32; LANES]) -> i32 {
    let (mut eight, mut four) = ([0; 8], [0; 4]);
    for lane in 0..8 {
        eight[lane] = x[lane].min(x[lane + 8]);
    }
    for lane in 0..4 {
        four[lane] = eight[lane].min(eight[lane + 4]);
    }
    (four[0].min(four[2])).min(four[1].min(four[3]))
}

#[inline(always)]
fn put(values: &[f32; LANES], to: &mut [f32]) {
    match to.first_chunk_mut::<LANES>() {
        Some(to) => *to = *values,
        None => to.copy_from_slice(&values[..to.len()]),
    }
}

/// Lagrange's polynomial through values at −2, −1, 0, 1, 2 and 3, at `t` in 0 to 1.
#[inline(always)]
fn lagrange(p: [f32; TAPS], t: f32) -> f32 {
    // Distances to the nodes; each basis polynomial is the product of the five others over a constant.
    let (a, b, d, e, g) = (t + 2.0, t + 1.0, 1.0 - t, 2.0 - t, 3.0 - t);
    let (ab, cd, eg) = (a * b, t * d, e * g);
    let before = (b * (1.0 / 120.0)) * p[0] - (a * (1.0 / 24.0)) * p[1];
    let about = (d * (1.0 / 12.0)) * p[2] + (t * (1.0 / 12.0)) * p[3];
    let after = (e * (1.0 / 120.0)) * p[5] - (g * (1.0 / 24.0)) * p[4];
    (cd * eg) * before + (ab * eg) * about + (ab * cd) * after
}

/// A row of a rectified picture: where its pixels come from, and scratch.
pub(crate) struct Warp<'a> {
    /// The picture, 8-bit, row-major.
    pub(crate) picture: &'a [u8],
    /// Its width.
    pub(crate) width: usize,
    /// For each column of the picture, how far below the rectified row it is met, pixels.
    pub(crate) down_px: &'a [f32],
    /// For each rectified pixel, how far to its right it is met, pixels.
    pub(crate) across_px: &'a [f32],
}

/// Row `row` of a rectified picture: first down the columns to where the row meets them, then across (Catmull and Smith 1980). Exact and
/// rounded to whole grey levels.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl+avx512dq", "x86_64+avx2"))]
pub(crate) fn warp_row(warp: &Warp, row: usize, scratch: &mut Row, exact: &mut [f32], grey: &mut [u8]) {
    scratch.resize(warp.width);
    shifted_down(warp.picture, warp.width, row, warp.down_px, scratch.values_mut());
    scratch.repeat_ends();
    shifted(scratch, warp.across_px, exact);
    for (grey, exact) in grey.iter_mut().zip(exact) {
        *grey = small_whole((*exact + 0.5).clamp(0.0, 255.0).floor()) as u8;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fifth_degree_polynomials_are_exact() {
        let polynomial = |x: f64| 1.0 + x * (0.5 + x * (-0.2 + x * (0.03 + x * (0.01 - x * 0.002))));
        let points = std::array::from_fn(|tap| polynomial(tap as f64 - 2.0) as f32);
        for t in (0..=256).map(|step| step as f32 / 256.0) {
            let value = f64::from(lagrange(points, t));
            assert!((value - polynomial(f64::from(t))).abs() < 1e-5, "{t} {value}");
        }
    }

    /// Row 4 of a ramp at any places.
    fn across(width: usize, to_px: &[f32]) -> Vec<f32> {
        let mut row = Row::default();
        row.resize(width);
        row.values_mut().iter_mut().enumerate().for_each(|(x, value)| *value = 3.0 * x as f32 + 40.0);
        row.repeat_ends();
        let shifts: Vec<f32> = to_px.iter().enumerate().map(|(x, to_px)| shift(x, *to_px, width)).collect();
        let mut to = vec![0.0; to_px.len()];
        shifted(&row, &shifts, &mut to);
        to
    }

    #[test]
    fn a_ramp_stays_a_ramp_wherever_its_samples_come_from() {
        for width in [1, 2, 5, 15, 16, 17, 40, 100] {
            // Forth, back, and all over the place.
            for stretch in [1.0, 0.3, -1.0, 7.7, 0.0] {
                let last = (width - 1) as f32;
                let at = |x: usize| (x as f32 * stretch + 1.3).rem_euclid(last.max(1.0)).min(last);
                let to_px: Vec<f32> = (0..width).map(at).collect();
                for (value, to_px) in across(width, &to_px).iter().zip(&to_px) {
                    // Next to an end the repeated values bend the ramp.
                    if (2.0..last - 3.0).contains(to_px) {
                        assert!((value - (3.0 * to_px + 40.0)).abs() < 1e-3, "{width} {stretch} {to_px} {value}");
                    }
                }
            }
        }
    }

    #[test]
    fn beyond_an_end_the_end_is_met_and_nothing_panics() {
        let met = across(20, &[f32::NAN, f32::INFINITY, -1e30, 1e30, f32::NEG_INFINITY, -0.0, 19.0]);
        for (value, expected) in met.iter().zip([40.0, 97.0, 40.0, 97.0, 40.0, 40.0, 97.0]) {
            assert!((value - expected).abs() < 1e-3, "{met:?}");
        }
        // Shifts that nobody held within the row.
        let mut to = [0.0; 4];
        shifted(&Row(vec![1.0; 2 * MARGIN + 4]), &[f32::NAN, 1e30, -1e30, 1e5], &mut to);
        shifted(&Row::default(), &[0.0; 4], &mut to);
    }

    #[test]
    fn a_slanted_row_is_met_where_it_is() {
        let (width, height) = (37, 12);
        let pixels: Vec<u8> = (0..width * height).map(|i| (3 * (i % width) + 10 * (i / width)) as u8).collect();
        let down_px: Vec<f32> = (0..width).map(|x| 0.75 + 0.02 * x as f32).collect();
        let across_px: Vec<f32> = (0..width).map(|x| shift(x, x as f32 * 0.9 + 1.3125, width)).collect();
        let warp = Warp { picture: &pixels, width, down_px: &down_px, across_px: &across_px };
        let (mut exact, mut grey) = (vec![0.0; width], vec![0; width]);
        warp_row(&warp, 4, &mut Row::default(), &mut exact, &mut grey);
        for x in 3..30 {
            let u = x as f32 * 0.9 + 1.3125;
            let expected = 3.0 * u + 10.0 * (4.0 + 0.75 + 0.02 * u);
            assert!((exact[x] - expected).abs() < 1e-2, "{x} {} {expected}", exact[x]);
            assert_eq!(f32::from(grey[x]), (exact[x] + 0.5).floor());
        }
    }
}
