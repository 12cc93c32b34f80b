//! Sampling a picture between its pixels, exactly enough for disparities of a hundredth of a pixel.
//!
//! OpenCV's cubic kernel (a = −0.75) does not even reproduce a straight ramp: it shifts gentle texture by up to 0.047 px, to
//! and fro within each pixel, which at 5 m is 8 mm of water. Lanczos-4 errs by 0.012 px. Six-point Lagrange interpolation is
//! exact for polynomials up to the fifth degree: 0.0002 px for texture of 8 px per period, 0.0008 px at 6.

/// Points that a sample is made of.
pub(crate) const TAPS: usize = 6;
/// Of those, how many lie before the pixel that contains the sample.
pub(crate) const TAPS_BEFORE: usize = 2;
/// Positions within a pixel that are told apart.
pub(crate) const PHASES: usize = 256;

/// Weights of the six points for every phase.
pub(crate) struct Weights(Vec<[f32; TAPS]>);

impl Weights {
    pub(crate) fn new() -> Self {
        Self((0..=PHASES).map(|phase| lagrange(phase as f64 / PHASES as f64)).collect())
    }

    /// The weights at `phase / PHASES` of a pixel.
    pub(crate) fn at(&self, phase: usize) -> &[f32; TAPS] {
        &self.0[phase]
    }
}

/// Lagrange's basis on −2, −1, 0, 1, 2, 3 at `t` in 0 to 1.
fn lagrange(t: f64) -> [f32; TAPS] {
    std::array::from_fn(|tap| {
        let node = |tap: usize| tap as f64 - TAPS_BEFORE as f64;
        let others = (0..TAPS).filter(|other| *other != tap);
        others.map(|other| (t - node(other)) / (node(tap) - node(other))).product::<f64>() as f32
    })
}

/// Splits a coordinate into whole pixel and phase.
pub(crate) fn split(x_px: f32) -> (i32, usize) {
    let steps = (x_px * PHASES as f32).round() as i32;
    (steps.div_euclid(PHASES as i32), steps.rem_euclid(PHASES as i32) as usize)
}

/// Weighted sum of six neighbours.
pub(crate) fn dot(points: &[f32; TAPS], weights: &[f32; TAPS]) -> f32 {
    points[0] * weights[0]
        + points[1] * weights[1]
        + points[2] * weights[2]
        + points[3] * weights[3]
        + points[4] * weights[4]
        + points[5] * weights[5]
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
    pub(crate) fn fill<T: Copy + Into<f32>>(&mut self, pixels: &[T], width: usize, height: usize) {
        let stride = width + TAPS - 1;
        (self.width, self.height, self.stride) = (width, height, stride);
        self.values.resize(stride * (height + TAPS - 1), 0.0);
        for (row, values) in self.values.chunks_exact_mut(stride).enumerate() {
            let from = row.saturating_sub(TAPS_BEFORE).min(height - 1);
            let pixels = &pixels[from * width..][..width];
            let (first, last) = (pixels[0].into(), pixels[width - 1].into());
            values[..TAPS_BEFORE].fill(first);
            values[TAPS_BEFORE + width..].fill(last);
            for (value, pixel) in values[TAPS_BEFORE..][..width].iter_mut().zip(pixels) {
                *value = (*pixel).into();
            }
        }
    }

    /// The sample on row `y` at `x_px`, which is held within the picture.
    pub(crate) fn sample_row(&self, x_px: f32, y: usize, weights: &Weights) -> f32 {
        let (x, phase) = split(x_px.clamp(0.0, (self.width - 1) as f32));
        let start = (y + TAPS_BEFORE) * self.stride + x as usize;
        six(&self.values, start).map_or(0.0, |points| dot(points, weights.at(phase)))
    }

    /// Where the neighbourhood of (x, y), held within the picture, begins, and its phases: what [`Self::sample`] takes.
    pub(crate) fn place(x_px: f32, y_px: f32, width: usize, height: usize) -> Place {
        let (x, phase_x) = split(x_px.clamp(0.0, (width - 1) as f32));
        let (y, phase_y) = split(y_px.clamp(0.0, (height - 1) as f32));
        let stride = width + TAPS - 1;
        Place { start: (y as usize * stride + x as usize) as u32, phase_x: phase_x as u16, phase_y: phase_y as u16 }
    }

    /// The sample at a place.
    pub(crate) fn sample(&self, place: Place, weights: &Weights) -> f32 {
        let (across, down) = (weights.at(place.phase_x.into()), weights.at(place.phase_y.into()));
        let start = place.start as usize;
        let mut sum = 0.0;
        for (row, weight) in down.iter().enumerate() {
            if let Some(points) = six(&self.values, start + row * self.stride) {
                sum += weight * dot(points, across);
            }
        }
        sum
    }
}

/// A place between pixels, worked out once and sampled many times.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    start: u32,
    phase_x: u16,
    phase_y: u16,
}

fn six(values: &[f32], start: usize) -> Option<&[f32; TAPS]> {
    values.get(start..start + TAPS).and_then(|six| six.try_into().ok())
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
        let sample = |x: f32, y: f32| picture.sample(Margined::place(x, y, 20, 10), &weights);
        assert!((sample(7.3125, 4.75) - (3.0 * 7.3125 + 47.5)).abs() < 1e-3);
        assert!((picture.sample_row(7.3125, 4, &weights) - (3.0 * 7.3125 + 40.0)).abs() < 1e-3);
        // Beyond the edge the edge is repeated, at the edge it is met.
        assert_eq!(sample(-5.0, -5.0), 0.0);
        assert_eq!(sample(19.0, 9.0), 3.0 * 19.0 + 90.0);
        assert_eq!(sample(f32::NAN, 0.0), sample(0.0, 0.0), "NaN maps come from impossible lenses and must not panic");
    }
}
