//! Disparity maps: their shape, and the two formats they leave in.

pub mod colour;
pub mod pfm;
pub mod score;

/// Left x minus right x for each pixel of the left rectified picture, row-major, pixels; NaN where there is no match.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Disparity {
    /// Width, pixels.
    pub width_px: u32,
    /// Height, pixels.
    pub height_px: u32,
    /// `height_px × width_px` values.
    pub values_px: Vec<f32>,
}

impl Disparity {
    /// How many pixels have a match.
    #[must_use]
    pub fn matched(&self) -> usize {
        self.values_px.iter().filter(|value| value.is_finite()).count()
    }

    /// Share of the pixels with a match, 0 to 1.
    #[must_use]
    pub fn density(&self) -> f64 {
        if self.values_px.is_empty() { 0.0 } else { self.matched() as f64 / self.values_px.len() as f64 }
    }

    /// Takes a new size; every pixel becomes NaN. Allocates only where it grows.
    pub(crate) fn reset(&mut self, width_px: u32, height_px: u32) {
        (self.width_px, self.height_px) = (width_px, height_px);
        self.values_px.clear();
        self.values_px.resize(width_px as usize * height_px as usize, f32::NAN);
    }

    /// Row `row`, left to right.
    pub(crate) fn row(&self, row: u32) -> &[f32] {
        let width = self.width_px as usize;
        &self.values_px[row as usize * width..][..width]
    }
}
