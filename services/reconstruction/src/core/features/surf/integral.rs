//! Sums over rectangles in four look-ups.

/// Sums of all pixels above and to the left, kept modulo 2³²: a sum over a rectangle of up to 16 million pixels, more than any
/// filter covers, comes out exact whatever the size of the picture.
pub(super) struct Integral {
    pub(super) width: usize,
    pub(super) height: usize,
    /// `(height + 1) × (width + 1)`, the first row and column 0.
    sums: Vec<u32>,
}

impl Integral {
    pub(super) fn new(pixels: &[u8], width: usize, height: usize) -> Self {
        let stride = width + 1;
        let mut sums = vec![0_u32; stride * (height + 1)];
        for (y, row) in pixels.chunks_exact(width).take(height).enumerate() {
            let (above, below) = sums.split_at_mut((y + 1) * stride);
            let above = &above[y * stride..];
            let mut run = 0_u32;
            for (x, value) in row.iter().enumerate() {
                run = run.wrapping_add(u32::from(*value));
                below[x + 1] = above[x + 1].wrapping_add(run);
            }
        }
        Self { width, height, sums }
    }

    /// Sum of the `cols × rows` pixels whose top-left one is (x, y). Must lie inside.
    #[inline]
    pub(super) fn sum(&self, x: usize, y: usize, cols: usize, rows: usize) -> f32 {
        let stride = self.width + 1;
        let (top, bottom) = (y * stride + x, (y + rows) * stride + x);
        let sum = self.sums[bottom + cols]
            .wrapping_sub(self.sums[bottom])
            .wrapping_sub(self.sums[top + cols])
            .wrapping_add(self.sums[top]);
        sum as f32
    }

    /// Mean grey level of a square of any `side_px` about any place, pixels (0, 0 in the centre of the first); edges cut pixels.
    /// Beyond the picture counts as 0.
    pub(super) fn mean_around(&self, x_px: f32, y_px: f32, side_px: f32) -> f32 {
        // The integral between its samples is linear in x and in y, exactly so for pixels of even brightness.
        let cut = |at_px: f32, limit: usize| {
            let at = at_px.clamp(0.0, limit as f32);
            let low = (at as usize).min(limit - 1);
            (low, f64::from(at) - low as f64)
        };
        let (x_px, y_px, half_px) = (x_px + 0.5, y_px + 0.5, side_px / 2.0);
        let (left, right) = (cut(x_px - half_px, self.width), cut(x_px + half_px, self.width));
        let (top, bottom) = (cut(y_px - half_px, self.height), cut(y_px + half_px, self.height));
        let stride = self.width + 1;
        // Relative to the first corner, so that it is small whatever the wrapping.
        let base = self.sums[top.0 * stride + left.0];
        let value = |(col, u): (usize, f64), (row, v): (usize, f64)| {
            let at = |index: usize| f64::from(self.sums[index].wrapping_sub(base) as i32);
            let first = row * stride + col;
            let upper = at(first) * (1.0 - u) + at(first + 1) * u;
            let lower = at(first + stride) * (1.0 - u) + at(first + stride + 1) * u;
            upper * (1.0 - v) + lower * v
        };
        let sum = value(right, bottom) - value(left, bottom) - value(right, top) + value(left, top);
        sum as f32 / (side_px * side_px)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_sums() {
        let pixels: Vec<u8> = (0..35).map(|i| (i * 37 % 251) as u8).collect();
        let integral = Integral::new(&pixels, 7, 5);
        for (x, y, cols, rows) in [(0, 0, 7, 5), (2, 1, 3, 2), (6, 4, 1, 1), (3, 3, 0, 2)] {
            let by_hand: u32 =
                (y..y + rows).flat_map(|v| (x..x + cols).map(move |u| v * 7 + u)).map(|i| u32::from(pixels[i])).sum();
            assert_eq!(integral.sum(x, y, cols, rows), by_hand as f32);
        }
    }

    #[test]
    fn squares_cut_pixels() {
        let pixels = [0, 100, 200, 0, 100, 200, 0, 100, 200];
        let integral = Integral::new(&pixels, 3, 3);
        assert!((integral.mean_around(1.0, 1.0, 1.0) - 100.0).abs() < 1e-3);
        // Half a pixel of 100, half one of 200.
        assert!((integral.mean_around(1.5, 1.0, 1.0) - 150.0).abs() < 1e-3);
        // From 0.2 to 1.8 across: 0.3 of the first column, all of the second, 0.3 of the third.
        assert!((integral.mean_around(1.0, 1.0, 1.6) - (100.0 + 0.3 * 200.0) / 1.6).abs() < 1e-3);
        assert_eq!(integral.mean_around(-9.0, 1.0, 2.0), 0.0);
    }

    /// 4200 × 4200 white pixels sum to more than 2³²: boxes in the far corner are still exact.
    #[test]
    fn large_pictures_wrap_without_harm() {
        let side = 4200;
        let integral = Integral::new(&vec![255; side * side], side, side);
        assert_eq!(integral.sum(side - 99, side - 99, 99, 99), 99.0 * 99.0 * 255.0);
        assert!((integral.mean_around(4100.3, 4100.7, 25.5) - 255.0).abs() < 1e-3);
    }
}
