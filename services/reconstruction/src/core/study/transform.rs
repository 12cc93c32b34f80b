//! Rank and census (Zabih and Woodfill 1994): a pixel as the order of the grey levels around it, which no monotone change of
//! brightness alters. Beyond the picture's edge the nearest pixel repeats.

/// The largest neighbourhood: 120 bits of census fit into a `u128`.
pub const SIDE_PX_MAX: u32 = 11;

/// How many of the `side_px × side_px` pixels around each pixel are darker than it (4-13, fig. 4-7). Row-major, like `pixels`,
/// which are rows of `width`.
#[must_use]
pub fn rank(pixels: &[u8], width: usize, side_px: u32) -> Vec<f32> {
    transform(pixels, width, side_px, |rank: f32, darker| rank + f32::from(u8::from(darker)))
}

/// One bit for each neighbour of each pixel, row by row from the top left, the pixel itself left out: 1 where the neighbour is
/// darker (fig. 4-8). The last neighbour is the lowest bit; `side_px` is at most [`SIDE_PX_MAX`].
#[must_use]
pub fn census(pixels: &[u8], width: usize, side_px: u32) -> Vec<u128> {
    transform(pixels, width, side_px, |bits: u128, darker| (bits << 1) | u128::from(darker))
}

/// Folds "is this neighbour darker?" over the neighbourhood of every pixel.
fn transform<T: Default + Copy>(pixels: &[u8], width: usize, side_px: u32, fold: impl Fn(T, bool) -> T) -> Vec<T> {
    let height = pixels.len() / width.max(1);
    let half = (side_px / 2) as isize;
    let mut out = vec![T::default(); pixels.len()];
    // Neighbour by neighbour over the whole picture: each bit is a comparison of two rows.
    for dy in -half..=half {
        for dx in (-half..=half).filter(|dx| (*dx, dy) != (0, 0)) {
            for (y, out) in out.chunks_exact_mut(width).enumerate() {
                let neighbours = &pixels[y.saturating_add_signed(dy).min(height - 1) * width..][..width];
                for (x, out) in out.iter_mut().enumerate() {
                    let neighbour = neighbours[x.saturating_add_signed(dx).min(width - 1)];
                    *out = fold(*out, neighbour < pixels[y * width + x]);
                }
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    const FIGURE: [u8; 9] = [89, 63, 72, 67, 55, 64, 58, 51, 49];

    #[test]
    fn figure_4_7() {
        assert_eq!(rank(&FIGURE, 3, 3)[4], 2.0);
    }

    #[test]
    fn figure_4_8() {
        assert_eq!(format!("{:08b}", census(&FIGURE, 3, 3)[4]), "00000011");
        // By hand: 60 for 51 clears the last but one bit, 50 for 89 sets the first: a distance of two.
        let other = [50, 63, 72, 67, 55, 64, 58, 60, 49];
        assert_eq!(format!("{:08b}", census(&other, 3, 3)[4]), "10000001");
        assert_eq!((census(&FIGURE, 3, 3)[4] ^ census(&other, 3, 3)[4]).count_ones(), 2);
    }

    #[test]
    fn the_edge_repeats() {
        // The corner 89 sees, row by row: 89 89 63, 89 . 63, 67 67 55.
        assert_eq!(rank(&FIGURE, 3, 3)[0], 5.0);
        assert_eq!(census(&FIGURE, 3, 3)[0], 0b0010_1111);
    }

    #[test]
    fn the_largest_neighbourhood_has_120_bits() {
        let mut pixels = vec![0_u8; 121];
        pixels[60] = 1;
        assert_eq!(census(&pixels, 11, 11)[60], (1 << 120) - 1);
        assert_eq!(rank(&pixels, 11, 11)[60], 120.0);
    }
}
