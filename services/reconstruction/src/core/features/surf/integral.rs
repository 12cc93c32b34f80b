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

    /// The same for a rectangle that may reach beyond the picture: only what lies inside counts.
    #[inline]
    pub(super) fn sum_inside(&self, x: i32, y: i32, cols: i32, rows: i32) -> f32 {
        let clip = |at: i32, limit: usize| at.clamp(0, limit as i32) as usize;
        let (x0, x1) = (clip(x, self.width), clip(x + cols, self.width));
        let (y0, y1) = (clip(y, self.height), clip(y + rows, self.height));
        self.sum(x0, y0, x1 - x0, y1 - y0)
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
            assert_eq!(integral.sum_inside(x as i32, y as i32, cols as i32, rows as i32), by_hand as f32);
        }
        assert_eq!(integral.sum_inside(-3, -2, 20, 20), integral.sum(0, 0, 7, 5));
        assert_eq!(integral.sum_inside(8, 0, 3, 3), 0.0);
    }

    /// 4200 × 4200 white pixels sum to more than 2³²: boxes in the far corner are still exact.
    #[test]
    fn large_pictures_wrap_without_harm() {
        let side = 4200;
        let integral = Integral::new(&vec![255; side * side], side, side);
        assert_eq!(integral.sum(side - 99, side - 99, 99, 99), 99.0 * 99.0 * 255.0);
    }
}
