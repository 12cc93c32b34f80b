//! What floats on and in the water: a seeded, periodic picture of its albedo, band-limited so that cameras don't alias it.
//!
//! Ripple and turbidity are cubic B-spline noise in octaves, foam lies in streaks, flecks are sparse bright dots. The finest grain
//! is [`GRAIN_M`]: just under two pixels of the default rig at 5 m, fine enough to match and coarse enough to sample.
//! Coarser copies (each half the resolution, low-pass filtered) serve cameras that are higher up.

use rand::Rng;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

/// Texels along each side of the finest level; a power of two, so that wrapping is a mask.
const SIDE: usize = 1024;
/// Side of a texel, metres. The pattern repeats after `SIDE` of them: 7.2 m, far more than any disparity can confuse.
const TEXEL_M: f64 = 0.007;
/// Spacing of the finest noise lattice, metres.
pub const GRAIN_M: f64 = 4.0 * TEXEL_M;
/// Ground footprint of a pixel from which a coarser level is used, metres.
const FOOTPRINT_M_MAX: f64 = 0.68 * GRAIN_M;
/// Albedo of clean water seen from above.
const WATER_ALBEDO: f32 = 0.035;
/// Each octave of ripple and turbidity: lattice spacing across and along the wind's streaks, texels, whether the streaks run
/// diagonally, standard deviation of albedo, and weight in where foam gathers.
const OCTAVES: [([usize; 2], bool, f32, f32); 6] = [
    ([4, 4], false, 0.0040, 0.15),
    ([8, 16], true, 0.0048, 0.30),
    ([8, 8], false, 0.0024, 0.20),
    ([32, 128], true, 0.0026, 0.75),
    ([64, 64], false, 0.0022, 0.45),
    ([256, 256], false, 0.0020, 0.35),
];
/// Bright flecks per square metre.
const FLECKS_PER_M2: f64 = 6.0;

/// A periodic texture, finest level first. Rows run north, columns east.
#[derive(Debug, Clone)]
pub struct Texture {
    levels: Vec<Level>,
}

/// One resolution of it.
#[derive(Debug, Clone)]
pub(crate) struct Level {
    texels: Vec<f32>,
    mask: usize,
    shift: u32,
    /// Texels per metre.
    pub(crate) per_m: f64,
}

impl Texture {
    /// Water with ripples, foam and flecks.
    #[must_use]
    pub fn water(seed: u64) -> Self {
        Self::grained(seed, GRAIN_M)
    }

    /// The same pattern with its finest grain `grain_m` wide (at least a tenth of a millimetre): a film in a tank, or capillary
    /// ripples, for cameras that are close. It repeats after 256 grains.
    #[must_use]
    pub fn grained(seed: u64, grain_m: f64) -> Self {
        // `max` also turns NaN into the least.
        let texel_m = grain_m.max(1e-4) / 4.0;
        let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x7465_7874_7572_6531);
        let mut albedo = vec![WATER_ALBEDO; SIDE * SIDE];
        let mut foam = vec![0.0; SIDE * SIDE];
        for (pitch, diagonal, sigma, gathers) in OCTAVES {
            let noise = spline_noise(pitch, &mut rng);
            for (at, (albedo, foam)) in albedo.iter_mut().zip(&mut foam).enumerate() {
                // A turn by 45° that keeps the pattern periodic; it is finer by √2 there.
                let (row, col) = (at / SIDE, at % SIDE);
                let turned = ((row + col) & (SIDE - 1)) * SIDE + ((SIDE + col - row) & (SIDE - 1));
                let noise = noise[if diagonal { turned } else { at }];
                *albedo += sigma * noise;
                *foam += gathers * noise;
            }
        }
        for (albedo, foam) in albedo.iter_mut().zip(&foam) {
            // A smooth step, so that edges stay as soft as the noise itself.
            let t = ((foam - 1.3) / 1.6).clamp(0.0, 1.0);
            *albedo = (*albedo + 0.034 * t * t * (3.0 - 2.0 * t)).max(0.004);
        }
        // As many as on open water, however fine the grain.
        let area_m2 = (SIDE as f64 * TEXEL_M).powi(2);
        for _ in 0..(area_m2 * FLECKS_PER_M2) as usize {
            let radius = rng.random_range(2.2..3.4_f32);
            let peak = rng.random_range(0.02..0.07_f32);
            fleck(&mut albedo, rng.random_range(0.0..SIDE as f32), rng.random_range(0.0..SIDE as f32), radius, peak);
        }
        Self::from_texels(albedo, SIDE, texel_m)
    }

    /// A texture of your own: `albedo(north_m, east_m)` on `side × side` texels of `texel_m`, repeated for ever. `side` is rounded
    /// up to a power of two. Sampling is bilinear: leave nothing finer than a few texels in it.
    #[must_use]
    pub fn from_fn(side: usize, texel_m: f64, albedo: impl Fn(f64, f64) -> f64) -> Self {
        let side = side.clamp(2, 1 << 12).next_power_of_two();
        let at = |i: usize| albedo((i / side) as f64 * texel_m, (i % side) as f64 * texel_m) as f32;
        Self::from_texels((0..side * side).map(at).collect(), side, texel_m)
    }

    /// The same pattern with `contrast` times its contrast about its mean, 0 to 1: clear water shows little of anything.
    #[must_use]
    pub fn faded(mut self, contrast: f64) -> Self {
        let contrast = if contrast.is_finite() { contrast.clamp(0.0, 1.0) as f32 } else { 0.0 };
        // The coarser levels are means of the finest, so they have its mean.
        let finest = self.levels.first().map_or(&[][..], |level| &level.texels);
        let mean = (finest.iter().map(|texel| f64::from(*texel)).sum::<f64>() / finest.len().max(1) as f64) as f32;
        for texel in self.levels.iter_mut().flat_map(|level| &mut level.texels) {
            *texel = mean + contrast * (*texel - mean);
        }
        self
    }

    fn from_texels(texels: Vec<f32>, side: usize, texel_m: f64) -> Self {
        let mut levels = vec![Level { texels, mask: side - 1, shift: side.trailing_zeros(), per_m: 1.0 / texel_m }];
        while let Some(finer) = levels.last()
            && finer.mask >= 32
        {
            let coarser = finer.halved();
            levels.push(coarser);
        }
        Self { levels }
    }

    /// The finest level that a pixel covering `footprint_m` of water does not alias.
    pub(crate) fn level(&self, footprint_m: f64) -> &Level {
        // In texels, so that it holds for a texture of any resolution.
        let finest_m = FOOTPRINT_M_MAX / TEXEL_M / self.levels[0].per_m;
        let octave = (footprint_m / finest_m).log2().ceil().clamp(0.0, (self.levels.len() - 1) as f64);
        &self.levels[octave as usize]
    }
}

impl Level {
    /// Texels after which it repeats.
    pub(crate) fn period(&self) -> f64 {
        (self.mask + 1) as f64
    }

    /// Albedo at a place in texels, bilinear; both must be positive.
    #[inline]
    pub(crate) fn sample(&self, north: f32, east: f32) -> f32 {
        let (row, col) = (north as usize, east as usize);
        let (u, v) = (north - row as f32, east - col as f32);
        let low = (row & self.mask) << self.shift;
        let high = ((row + 1) & self.mask) << self.shift;
        let (left, right) = (col & self.mask, (col + 1) & self.mask);
        let a = self.texels[low | left];
        let b = self.texels[low | right];
        let c = self.texels[high | left];
        let d = self.texels[high | right];
        let ab = a + (b - a) * v;
        let cd = c + (d - c) * v;
        ab + (cd - ab) * u
    }

    /// Half the resolution, after a 1-4-6-4-1 low-pass filter in both directions, which leaves everything in its place.
    fn halved(&self) -> Self {
        const WEIGHTS: [f32; 5] = [0.0625, 0.25, 0.375, 0.25, 0.0625];
        let side = self.texels.len() >> (self.shift + 1);
        // Two texels before `at`, wrapped: adding the mask is subtracting one.
        let tap = |at: usize, k: usize| (2 * at + 2 * self.mask + k) & self.mask;
        let mut texels = vec![0.0; side * side];
        let mut row_sums = vec![0.0; self.mask + 1];
        for row in 0..side {
            for (col, sum) in row_sums.iter_mut().enumerate() {
                *sum = (0..5).map(|k| WEIGHTS[k] * self.texels[(tap(row, k) << self.shift) | col]).sum::<f32>();
            }
            for col in 0..side {
                texels[row * side + col] = (0..5).map(|k| WEIGHTS[k] * row_sums[tap(col, k)]).sum::<f32>();
            }
        }
        Self { texels, mask: side - 1, shift: self.shift - 1, per_m: 0.5 * self.per_m }
    }
}

/// Periodic noise of zero mean and unit variance: cubic B-splines over a lattice of random numbers, `pitch` texels apart down and
/// across.
fn spline_noise([down, across]: [usize; 2], rng: &mut ChaCha8Rng) -> Vec<f32> {
    let (rows, cols) = (SIDE / down, SIDE / across);
    let lattice: Vec<f32> = (0..rows * cols).map(|_| rng.random_range(-1.0..1.0)).collect();
    // Along each lattice row first, then down.
    let weights = spline_weights(across);
    let mut stretched = vec![0.0; rows * SIDE];
    for row in 0..rows {
        for col in 0..SIDE {
            let (node, w) = (col / across, &weights[col % across]);
            let at = |k: usize| lattice[row * cols + (node + cols + k - 1) % cols];
            stretched[row * SIDE + col] = w[0] * at(0) + w[1] * at(1) + w[2] * at(2) + w[3] * at(3);
        }
    }
    let weights = spline_weights(down);
    let mut noise = Vec::with_capacity(SIDE * SIDE);
    for row in 0..SIDE {
        let (node, w) = (row / down, &weights[row % down]);
        let at = |k: usize| &stretched[(node + rows + k - 1) % rows * SIDE..][..SIDE];
        let (a, b, c, d) = (at(0), at(1), at(2), at(3));
        noise.extend((0..SIDE).map(|col| w[0] * a[col] + w[1] * b[col] + w[2] * c[col] + w[3] * d[col]));
    }
    let count = noise.len() as f32;
    let mean = noise.iter().sum::<f32>() / count;
    let sigma = (noise.iter().map(|n| (n - mean) * (n - mean)).sum::<f32>() / count).sqrt();
    noise.iter_mut().for_each(|n| *n = (*n - mean) / sigma);
    noise
}

/// The uniform cubic B-spline's four weights at each of `pitch` places between two nodes.
fn spline_weights(pitch: usize) -> Vec<[f32; 4]> {
    let at = |i: usize| {
        let t = i as f32 / pitch as f32;
        let s = 1.0 - t;
        let inner = |x: f32| (4.0 - 6.0 * x * x + 3.0 * x * x * x) / 6.0;
        [s * s * s / 6.0, inner(t), inner(s), t * t * t / 6.0]
    };
    (0..pitch).map(at).collect()
}

/// Adds a round bright spot with a Gaussian profile of `radius` texels (one standard deviation).
fn fleck(albedo: &mut [f32], row: f32, col: f32, radius: f32, peak: f32) {
    let reach = (3.5 * radius) as isize;
    for i in -reach..=reach {
        for j in -reach..=reach {
            let (y, x) = (row.floor() + i as f32, col.floor() + j as f32);
            let gauss = (-((y - row).powi(2) + (x - col).powi(2)) / (2.0 * radius * radius)).exp();
            let wrapped = |v: f32| (v as isize).rem_euclid(SIDE as isize) as usize;
            albedo[wrapped(y) * SIDE + wrapped(x)] += peak * gauss;
        }
    }
}
