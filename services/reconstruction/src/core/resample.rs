//! Sampling a picture between its pixels, exactly enough for disparities of a hundredth of a pixel.
//!
//! OpenCV's cubic kernel (a = −0.75) does not even reproduce a straight ramp: it shifts gentle texture by up to 0.047 px, to
//! and fro within each pixel, which at 5 m is 8 mm of water. Lanczos-4 errs by 0.012 px. Six-point Lagrange interpolation is
//! exact for polynomials up to the fifth degree: 0.0002 px for texture of 8 px per period, 0.0008 px at 6.

use multiversion::multiversion;
use rayon::prelude::*;

/// Points that a sample is made of.
const TAPS: usize = 6;
/// Of those, how many lie before the pixel that contains the sample.
const TAPS_BEFORE: usize = 2;
/// Positions within a pixel that are told apart.
const PHASES: usize = 256;

/// Lanes that a sample is computed in: six points and two that weigh nothing.
const LANES: usize = 8;

/// Weights of the six points for every phase.
pub(crate) struct Weights(Vec<[f32; LANES]>);

impl Weights {
    pub(crate) fn new() -> Self {
        Self((0..=PHASES).map(|phase| lagrange(phase as f64 / PHASES as f64)).collect())
    }
}

/// Lagrange's basis on −2, −1, 0, 1, 2, 3 at `t` in 0 to 1.
fn lagrange(t: f64) -> [f32; LANES] {
    std::array::from_fn(|tap| {
        let node = |tap: usize| tap as f64 - TAPS_BEFORE as f64;
        let others = (0..TAPS).filter(|other| *other != tap);
        let weight: f64 = others.map(|other| (t - node(other)) / (node(tap) - node(other))).product();
        if tap < TAPS { weight as f32 } else { 0.0 }
    })
}

/// Splits a coordinate that is not negative into whole pixel and phase. NaN is 0.
#[inline(always)]
fn split(x_px: f32) -> (usize, usize) {
    let steps = (x_px * PHASES as f32 + 0.5) as usize;
    (steps / PHASES, steps % PHASES)
}

/// Sum of the lanes, always in this order.
#[inline(always)]
fn sum(x: &[f32; LANES]) -> f32 {
    ((x[0] + x[4]) + (x[2] + x[6])) + ((x[1] + x[5]) + (x[3] + x[7]))
}

/// A picture with a margin of repeated edge pixels, so that every sample has its neighbours.
#[derive(Debug, Clone, Default)]
pub(crate) struct Margined {
    width: usize,
    height: usize,
    stride: usize,
    values: Vec<f32>,
}

impl Margined {
    /// Copies `width × height` values in. Allocates only where it grows.
    pub(crate) fn fill<T: Copy + Into<f32> + Sync>(&mut self, pixels: &[T], width: usize, height: usize) {
        let stride = stride_of(width);
        (self.width, self.height, self.stride) = (width, height, stride);
        self.values.resize(stride * (height + TAPS - 1), 0.0);
        self.values.par_chunks_exact_mut(stride).enumerate().with_min_len(ROWS_A_TASK).for_each(|(row, values)| {
            let from = row.saturating_sub(TAPS_BEFORE).min(height - 1);
            let pixels = &pixels[from * width..][..width];
            let (first, last) = (pixels[0].into(), pixels[width - 1].into());
            values[..TAPS_BEFORE].fill(first);
            values[TAPS_BEFORE + width..].fill(last);
            for (value, pixel) in values[TAPS_BEFORE..][..width].iter_mut().zip(pixels) {
                *value = (*pixel).into();
            }
        });
    }

    /// How many bytes it holds.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of::<f32>() * self.values.capacity()
    }

    /// Where the neighbourhood of (x, y), held within the picture, begins, and its phases: what [`Self::sample`] takes.
    pub(crate) fn place(x_px: f32, y_px: f32, width: usize, height: usize) -> Place {
        let (x, phase_x) = split(x_px.clamp(0.0, (width - 1) as f32));
        let (y, phase_y) = split(y_px.clamp(0.0, (height - 1) as f32));
        Place { start: (y * stride_of(width) + x) as u32, phase_x: phase_x as u16, phase_y: phase_y as u16 }
    }

    /// Samples at `places`, exact and rounded to whole grey levels.
    pub(crate) fn sample(&self, places: &[Place], weights: &Weights, exact: &mut [f32], grey: &mut [u8]) {
        sample_places(&self.values, self.stride, places, &weights.0, exact, grey);
    }

    /// Samples of row `y` at x − `disparity_px` for each x, held within the picture, less `level`.
    pub(crate) fn sample_row(&self, y: usize, disparity_px: &[f32], level: f32, weights: &Weights, to: &mut [f32]) {
        let Some(row) = self.values.get((y + TAPS_BEFORE) * self.stride..).and_then(|rest| rest.get(..self.stride)) else {
            return;
        };
        sample_shifted(row, (self.width.max(1) - 1) as f32, disparity_px, level, &weights.0, to);
    }
}

/// Rows that are worth another thread.
pub(crate) const ROWS_A_TASK: usize = 16;

fn stride_of(width: usize) -> usize {
    width + LANES
}

/// A place between pixels, worked out once and sampled many times.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    start: u32,
    phase_x: u16,
    phase_y: u16,
}

#[inline(always)]
fn lanes(values: &[f32], start: usize) -> &[f32; LANES] {
    // Every place has its neighbours; written so that no path can panic.
    values.get(start..start + LANES).and_then(|lanes| lanes.try_into().ok()).unwrap_or(&[0.0; LANES])
}

/// Samples that are worked on together: their lanes are added up after all are there, which keeps both steps vectorised.
const BLOCK: usize = 16;

/// Six rows are weighed and added lane by lane, then the lanes.
#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl+avx512dq", "x86_64+avx2"))]
fn sample_places(
    values: &[f32],
    stride: usize,
    places: &[Place],
    weights: &[[f32; LANES]],
    exact: &mut [f32],
    grey: &mut [u8],
) {
    let mut products = [[0.0_f32; LANES]; BLOCK];
    let outputs = exact.chunks_mut(BLOCK).zip(grey.chunks_mut(BLOCK));
    for (places, (exact, grey)) in places.chunks(BLOCK).zip(outputs) {
        for (place, product) in places.iter().zip(&mut products) {
            let (across, down) = (&weights[usize::from(place.phase_x)], &weights[usize::from(place.phase_y)]);
            let mut column = [0.0_f32; LANES];
            for (row, weight) in down.iter().enumerate().take(TAPS) {
                let points = lanes(values, place.start as usize + row * stride);
                for lane in 0..LANES {
                    column[lane] += weight * points[lane];
                }
            }
            for lane in 0..LANES {
                product[lane] = column[lane] * across[lane];
            }
        }
        for ((exact, grey), product) in exact.iter_mut().zip(grey).zip(&products) {
            *exact = sum(product);
            *grey = (*exact + 0.5) as u8;
        }
    }
}

#[multiversion(targets("x86_64+avx512f+avx512bw+avx512vl+avx512dq", "x86_64+avx2"))]
fn sample_shifted(row: &[f32], last_px: f32, disparity_px: &[f32], level: f32, weights: &[[f32; LANES]], to: &mut [f32]) {
    let mut products = [[0.0_f32; LANES]; BLOCK];
    for (block, (disparity_px, to)) in disparity_px.chunks(BLOCK).zip(to.chunks_mut(BLOCK)).enumerate() {
        for (x, (disparity_px, product)) in disparity_px.iter().zip(&mut products).enumerate() {
            let (start, phase) = split(((block * BLOCK + x) as f32 - disparity_px).clamp(0.0, last_px));
            let (points, weights) = (lanes(row, start), &weights[phase]);
            for lane in 0..LANES {
                product[lane] = points[lane] * weights[lane];
            }
        }
        for (to, product) in to.iter_mut().zip(&products) {
            *to = sum(product) - level;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fifth_degree_polynomials_are_exact() {
        let polynomial = |x: f64| 1.0 + x * (0.5 + x * (-0.2 + x * (0.03 + x * (0.01 - x * 0.002))));
        for phase in 0..=PHASES {
            let t = phase as f64 / PHASES as f64;
            let sum: f64 = lagrange(t).iter().enumerate().map(|(tap, w)| f64::from(*w) * polynomial(tap as f64 - 2.0)).sum();
            assert!((sum - polynomial(t)).abs() < 1e-5, "{t} {sum}");
        }
    }

    #[test]
    fn a_ramp_stays_a_ramp_in_both_directions() {
        let pixels: Vec<u8> = (0..20 * 10).map(|i| (3 * (i % 20) + 10 * (i / 20)) as u8).collect();
        let mut picture = Margined::default();
        picture.fill(&pixels, 20, 10);
        let weights = Weights::new();
        let sample = |x: f32, y: f32| {
            let (mut exact, mut grey) = ([0.0], [0]);
            picture.sample(&[Margined::place(x, y, 20, 10)], &weights, &mut exact, &mut grey);
            assert_eq!(f32::from(grey[0]), (exact[0] + 0.5).floor());
            exact[0]
        };
        assert!((sample(7.3125, 4.75) - (3.0 * 7.3125 + 47.5)).abs() < 1e-3);
        let mut row = [0.0; 9];
        picture.sample_row(4, &[1.6875; 9], 2.0, &weights, &mut row);
        assert!((row[8] - (3.0 * 6.3125 + 40.0 - 2.0)).abs() < 1e-3);
        // Beyond the edge the edge is repeated, at the edge it is met.
        assert_eq!(sample(-5.0, -5.0), 0.0);
        assert_eq!(sample(19.0, 9.0), 3.0 * 19.0 + 90.0);
        assert_eq!(sample(f32::NAN, 0.0), sample(0.0, 0.0), "NaN maps come from impossible lenses and must not panic");
        picture.sample_row(4, &[f32::NAN, f32::INFINITY, -1e30, 1e30], 0.0, &weights, &mut row);
        assert_eq!(row[..4], [40.0, 40.0, 97.0, 40.0]);
    }
}
