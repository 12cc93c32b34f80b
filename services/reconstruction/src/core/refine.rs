//! Sub-pixel refinement by least squares, with a standard deviation for every pixel.
//!
//! A semi-global matcher interpolates its costs to 1/16 px and is drawn towards whole pixels ("pixel locking"). Here each
//! pixel's disparity is fitted to the pictures themselves: over a window, left(u) ≈ a · right(u − d − δ) + b, solved for the
//! correction δ, gain a and offset b together (Lucas and Kanade 1981; Tian and Huhns 1986 for stereo), a few times over. The
//! residual says how well it fits, and so how far δ can be trusted.
//!
//! A window's δ corrects the window's mean disparity, so the result is that mean plus δ: the pixel's own start drops out.
//!
//! Everything is a box filter over products of pictures, so the cost does not grow with the window.

use opencv::Result;
use opencv::core::{self as cvcore, BORDER_REFLECT_101, BORDER_REPLICATE, CV_32F, CV_32FC1, Mat, Point, Scalar, Size};
use opencv::imgproc;
use opencv::prelude::*;

use super::disparity::Disparity;
use super::resample::{Margined, Weights};

/// A correction beyond this, pixels, means that the start was wrong, not rough.
const CORRECTION_MAX_PX: f32 = 1.0;
/// Contrast of two cameras that look at the same water differs by less than this factor.
const GAIN_MAX: f32 = 3.0;
/// A start that differs from the mean around it by more than this, pixels, is left out of that mean.
const START_SPREAD_MAX_PX: f32 = 1.0;
/// Mid-grey; products of centred pictures keep more digits.
const MID_GREY: f64 = 128.0;

/// Refines disparity maps of one size; keeps its buffers between calls.
pub struct Refiner {
    window_px: u32,
    iterations: u32,
    pictures: Pictures,
    means: Means,
    start: Vec<f32>,
    weight: Mat,
    weighted: Mat,
    mean_weight: Mat,
    mean_weighted: Mat,
    /// The disparity of the round, without holes, and its window means.
    whole: Mat,
    mean_whole: Mat,
    right: Margined,
    resampling: Weights,
}

/// Pictures and their products.
#[derive(Default)]
struct Pictures {
    left: Mat,
    warped: Mat,
    slope: Mat,
    sum: Mat,
    product: Mat,
}

/// Window means of the pictures and of their products: `l` left, `r` warped right, `g` slope.
#[derive(Default)]
struct Means {
    l: Mat,
    r: Mat,
    g: Mat,
    ll: Mat,
    rr: Mat,
    gg: Mat,
    lr: Mat,
    lg: Mat,
    rg: Mat,
}

impl Refiner {
    /// With `window_px × window_px` windows (made odd) and this many rounds of correction.
    #[must_use]
    pub fn new(window_px: u32, iterations: u32) -> Self {
        Self {
            window_px: window_px | 1,
            iterations,
            pictures: Pictures::default(),
            means: Means::default(),
            start: Vec::new(),
            weight: Mat::default(),
            weighted: Mat::default(),
            mean_weight: Mat::default(),
            mean_weighted: Mat::default(),
            whole: Mat::default(),
            mean_whole: Mat::default(),
            right: Margined::default(),
            resampling: Weights::new(),
        }
    }

    /// Side of the window, pixels: errors of pixels closer than this are correlated.
    #[must_use]
    pub fn window_px(&self) -> u32 {
        self.window_px
    }

    /// Refines `disparity` against the rectified pictures (`f32`) that it came from, and fills `sigma_px` with one standard
    /// deviation for each pixel (row-major; NaN with the disparity). Pixels whose fit fails become NaN; small holes in smooth
    /// surroundings are filled.
    ///
    /// # Errors
    /// OpenCV's, where the sizes differ.
    pub fn refine(&mut self, left: &Mat, right: &Mat, disparity: &mut Disparity, sigma_px: &mut Vec<f32>) -> Result<()> {
        self.prepare(left, right, disparity)?;
        sigma_px.clear();
        sigma_px.resize(disparity.values_px.len(), f32::NAN);
        self.smooth_start(disparity)?;
        for round in 0..self.iterations {
            self.warp(disparity)?;
            self.average()?;
            // Between rounds a doubtful pixel may recover; after the last it may not.
            let last = round + 1 == self.iterations;
            self.correct(disparity, sigma_px, last)?;
        }
        Ok(())
    }

    fn prepare(&mut self, left: &Mat, right: &Mat, disparity: &Disparity) -> Result<()> {
        left.convert_to(&mut self.pictures.left, CV_32F, 1.0, -MID_GREY)?;
        self.right.fill(right.data_typed::<f32>()?, disparity.width_px as usize, disparity.height_px as usize);
        let (rows, cols) = (disparity.height_px as i32, disparity.width_px as i32);
        if self.weight.rows() != rows || self.weight.cols() != cols {
            for mat in [&mut self.weight, &mut self.weighted, &mut self.whole, &mut self.pictures.warped] {
                *mat = Mat::new_rows_cols_with_default(rows, cols, CV_32FC1, Scalar::default())?;
            }
        }
        Ok(())
    }

    /// Replaces each disparity by the mean around it, twice: the second time without those that stand out. A window's
    /// correction is one number, so what it corrects should be smooth.
    fn smooth_start(&mut self, disparity: &mut Disparity) -> Result<()> {
        self.start.clone_from(&disparity.values_px);
        for round in 0..2 {
            let (weights, weighted) = (self.weight.data_typed_mut::<f32>()?, self.weighted.data_typed_mut::<f32>()?);
            for ((start, mean), (weight, weighted)) in
                self.start.iter().zip(&disparity.values_px).zip(weights.iter_mut().zip(weighted))
            {
                let counts = start.is_finite() && (round == 0 || (start - mean).abs() <= START_SPREAD_MAX_PX);
                (*weight, *weighted) = if counts { (1.0, *start) } else { (0.0, 0.0) };
            }
            box_mean(&self.weight, &mut self.mean_weight, self.window_px)?;
            box_mean(&self.weighted, &mut self.mean_weighted, self.window_px)?;
            let (weights, weighted) = (self.mean_weight.data_typed::<f32>()?, self.mean_weighted.data_typed::<f32>()?);
            for (mean, (weight, weighted)) in disparity.values_px.iter_mut().zip(weights.iter().zip(weighted)) {
                // At least half of the window must have been matched.
                *mean = if *weight >= 0.5 { weighted / weight } else { f32::NAN };
            }
        }
        Ok(())
    }

    /// Warps the right picture onto the left one by the disparity so far. Holes take the nearest disparity on their left (the
    /// first, at the edge): windows beside them must not compare the wrong water.
    fn warp(&mut self, disparity: &Disparity) -> Result<()> {
        let width = disparity.width_px as usize;
        let whole = self.whole.data_typed_mut::<f32>()?;
        let warped = self.pictures.warped.data_typed_mut::<f32>()?;
        let mut last = disparity.values_px.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
        let rows =
            disparity.values_px.chunks_exact(width).zip(whole.chunks_exact_mut(width).zip(warped.chunks_exact_mut(width)));
        for (y, (values, (whole, warped))) in rows.enumerate() {
            last = values.iter().copied().find(|value| value.is_finite()).unwrap_or(last);
            for (x, (value, (whole, warped))) in values.iter().zip(whole.iter_mut().zip(warped)).enumerate() {
                if value.is_finite() {
                    last = *value;
                }
                *whole = last;
                *warped = self.right.sample_row(x as f32 - last, y, &self.resampling) - MID_GREY as f32;
            }
        }
        box_mean(&self.whole, &mut self.mean_whole, self.window_px)
    }

    /// All window means that the normal equations need.
    fn average(&mut self) -> Result<()> {
        let Pictures { left, warped, slope, sum, product } = &mut self.pictures;
        // Slope of the mean of both pictures: central differences, which the scale of half a pixel each makes px⁻¹.
        cvcore::add_weighted(left, 0.5, warped, 0.5, 0.0, sum, -1)?;
        imgproc::sobel(sum, slope, CV_32F, 1, 0, 1, 0.5, 0.0, BORDER_REPLICATE)?;
        let window_px = self.window_px;
        let means = &mut self.means;
        box_mean(left, &mut means.l, window_px)?;
        box_mean(warped, &mut means.r, window_px)?;
        box_mean(slope, &mut means.g, window_px)?;
        let mut mean_of_product = |a: &Mat, b: &Mat, to: &mut Mat| {
            cvcore::multiply(a, b, product, 1.0, -1)?;
            box_mean(product, to, window_px)
        };
        mean_of_product(left, left, &mut means.ll)?;
        mean_of_product(warped, warped, &mut means.rr)?;
        mean_of_product(slope, slope, &mut means.gg)?;
        mean_of_product(left, warped, &mut means.lr)?;
        mean_of_product(left, slope, &mut means.lg)?;
        mean_of_product(warped, slope, &mut means.rg)
    }

    /// Solves each window's normal equations and moves the disparity.
    fn correct(&self, disparity: &mut Disparity, sigma_px: &mut [f32], last: bool) -> Result<()> {
        let m = &self.means;
        let (l, r, g) = (m.l.data_typed::<f32>()?, m.r.data_typed::<f32>()?, m.g.data_typed::<f32>()?);
        let (ll, rr, gg) = (m.ll.data_typed::<f32>()?, m.rr.data_typed::<f32>()?, m.gg.data_typed::<f32>()?);
        let (lr, lg, rg) = (m.lr.data_typed::<f32>()?, m.lg.data_typed::<f32>()?, m.rg.data_typed::<f32>()?);
        let whole = self.mean_whole.data_typed::<f32>()?;
        let samples = (self.window_px * self.window_px) as f32;
        for (i, (value, sigma)) in disparity.values_px.iter_mut().zip(sigma_px).enumerate() {
            if value.is_nan() {
                continue;
            }
            let window = Window {
                ll: ll[i] - l[i] * l[i],
                rr: rr[i] - r[i] * r[i],
                gg: gg[i] - g[i] * g[i],
                lr: lr[i] - l[i] * r[i],
                lg: lg[i] - l[i] * g[i],
                rg: rg[i] - r[i] * g[i],
            };
            match window.solve(samples) {
                Some((correction_px, sigma_of_it)) => (*value, *sigma) = (whole[i] + correction_px, sigma_of_it),
                None if last => (*value, *sigma) = (f32::NAN, f32::NAN),
                None => {}
            }
        }
        Ok(())
    }
}

/// Covariances within one window.
struct Window {
    ll: f32,
    rr: f32,
    gg: f32,
    lr: f32,
    lg: f32,
    rg: f32,
}

impl Window {
    /// The correction and its standard deviation, pixels; `None` without texture, or where the two pictures do not fit.
    ///
    /// With the offset gone (covariances), left = a · warped − p · slope, p = a δ: two normal equations.
    fn solve(&self, samples: f32) -> Option<(f32, f32)> {
        let determinant = self.gg * self.rr - self.rg * self.rg;
        // Texture must exceed what rounding to whole grey levels makes (variance 1/12).
        if self.gg < 0.1 || determinant <= 1e-3 * self.gg * self.rr {
            return None;
        }
        let p = (self.rg * self.lr - self.rr * self.lg) / determinant;
        let gain = (self.gg * self.lr - self.rg * self.lg) / determinant;
        let correction_px = p / gain;
        if !(gain > 1.0 / GAIN_MAX && gain < GAIN_MAX && correction_px.abs() < CORRECTION_MAX_PX) {
            return None;
        }
        let unexplained = (self.ll - gain * self.lr + p * self.lg).max(0.0) * samples / (samples - 3.0);
        let variance = unexplained * self.rr / (samples * determinant * gain * gain);
        Some((correction_px, variance.sqrt()))
    }
}

fn box_mean(from: &Mat, to: &mut Mat, window_px: u32) -> Result<()> {
    let size = Size::new(window_px as i32, window_px as i32);
    imgproc::box_filter(from, to, -1, size, Point::new(-1, -1), true, BORDER_REFLECT_101)
}
