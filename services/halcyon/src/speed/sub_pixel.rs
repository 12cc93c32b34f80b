//! Sub-pixel bias and noise: a texture that is known in closed form, shifted by known fractions of a pixel.

use halcyon_model::{Bytes, Image};
use halcyon_reconstruction::cli::refined;
use halcyon_reconstruction::core::disparity::Disparity;
use halcyon_reconstruction::core::matcher::{DisparityRange, Engine, match_images};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};
use serde::Serialize;

use super::BenchError;

/// What one engine makes of shifts of 20.0 to 20.9 px.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SubPixelRow {
    /// The engine; `+ least squares` where Halcyon's refinement follows it.
    pub engine: String,
    /// Largest mean error of any shift, pixels, without its sign.
    pub bias_px: f64,
    /// Root of the mean squared error over all pixels and shifts, pixels.
    pub rms_px: f64,
    /// Share of pixels matched, 0 to 1.
    pub density: f64,
}

const WIDTH_PX: u32 = 320;
const HEIGHT_PX: u32 = 240;
/// Sensor noise, grey levels.
const NOISE_SIGMA: f64 = 2.0;
/// Pixels this close to an edge are not judged: their windows reach out of a picture.
const MARGIN_PX: u32 = 24;

/// Waves of all directions, 3 to 40 px long, as bright as their length: nothing aliases, and any shift is exact.
struct Texture(Vec<[f64; 4]>);

impl Texture {
    fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut wave = |_| {
            let length_px: f64 = 3.0 * (40.0_f64 / 3.0).powf(rng.random());
            let direction: f64 = rng.random_range(0.0..std::f64::consts::TAU);
            let number = std::f64::consts::TAU / length_px;
            let phase: f64 = rng.random_range(0.0..std::f64::consts::TAU);
            [number * direction.cos(), number * direction.sin(), phase, 1.0 + 0.1 * length_px]
        };
        let mut waves: Vec<[f64; 4]> = (0..60).map(&mut wave).collect();
        // A standard deviation of 30 grey levels in all.
        let power: f64 = waves.iter().map(|wave| 0.5 * wave[3] * wave[3]).sum();
        waves.iter_mut().for_each(|wave| wave[3] *= 30.0 / power.sqrt());
        Self(waves)
    }

    fn level(&self, x_px: f64, y_px: f64) -> f64 {
        128.0 + self.0.iter().map(|[kx, ky, phase, size]| size * (kx * x_px + ky * y_px + phase).sin()).sum::<f64>()
    }

    fn picture(&self, shift_px: f64, noise: &mut impl FnMut() -> f64) -> Option<Image> {
        let mut pixels = Vec::with_capacity((WIDTH_PX * HEIGHT_PX) as usize);
        for y in 0..HEIGHT_PX {
            for x in 0..WIDTH_PX {
                pixels.push((self.level(f64::from(x) + shift_px, f64::from(y)) + noise()).round().clamp(0.0, 255.0) as u8);
            }
        }
        Image::new(WIDTH_PX, HEIGHT_PX, Bytes::from(pixels)).ok()
    }
}

/// A pair whose disparity is `shift_px` everywhere, with noise.
#[must_use]
pub fn shifted_pair(shift_px: f64, seed: u64) -> Option<(Image, Image)> {
    let texture = Texture::new(seed);
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ shift_px.to_bits());
    let normal = Normal::new(0.0, NOISE_SIGMA).ok()?;
    let mut noise = || normal.sample(&mut rng);
    Some((texture.picture(0.0, &mut noise)?, texture.picture(shift_px, &mut noise)?))
}

/// Sums over pixels.
#[derive(Default)]
struct Errors {
    bias_px: f64,
    squares: f64,
    matched: f64,
    pixels: f64,
}

impl Errors {
    fn add(&mut self, disparity: &Disparity, shift_px: f64) {
        let width = disparity.width_px as usize;
        let inner = (MARGIN_PX as usize)..(HEIGHT_PX - MARGIN_PX) as usize;
        let left = shift_px.ceil() as usize + MARGIN_PX as usize;
        let (mut sum, mut count) = (0.0, 0.0);
        for row in disparity.values_px.chunks_exact(width).take(inner.end).skip(inner.start) {
            for value in &row[left..width - MARGIN_PX as usize] {
                self.pixels += 1.0;
                if value.is_finite() {
                    let error_px = f64::from(*value) - shift_px;
                    sum += error_px;
                    count += 1.0;
                    self.squares += error_px * error_px;
                }
            }
        }
        self.matched += count;
        self.bias_px = self.bias_px.max((sum / count).abs());
    }

    fn row(&self, engine: String) -> SubPixelRow {
        let rms_px = (self.squares / self.matched).sqrt();
        SubPixelRow { engine, bias_px: self.bias_px, rms_px, density: self.matched / self.pixels }
    }
}

/// Every engine for work, as it is and refined, over `shifts` equally spaced shifts.
pub(super) fn run(shifts: u32) -> Result<Vec<SubPixelRow>, BenchError> {
    let mut errors: Vec<[Errors; 2]> = Engine::ALL.map(|_| Default::default()).into();
    for step in 0..shifts {
        // 20.0 to 20.9 in tenths, or as many of them as asked for.
        let shift_px = 20.0 + 0.1 * f64::from(10 * step / shifts);
        let Some((left, right)) = shifted_pair(shift_px, 3) else { continue };
        for (engine, [plain, fine]) in Engine::ALL.into_iter().zip(&mut errors) {
            let mut matcher = engine.matcher(engine.block_px_default());
            let disparity = match_images(matcher.as_mut(), &left, &right, DisparityRange { min_px: 0, max_px: 47 })?;
            plain.add(&disparity, shift_px);
            fine.add(&refined(&left, &right, &disparity)?, shift_px);
        }
    }
    let rows = Engine::ALL.into_iter().zip(&errors);
    Ok(rows
        .flat_map(|(engine, [plain, fine])| {
            [plain.row(engine.name().into()), fine.row(format!("{} + least squares", engine.name()))]
        })
        .collect())
}
