//! Is there anything to match in a picture?

use std::path::Path;

use halcyon_model::Image;

/// A window about as wide as those that are compared.
const REACH_PX: usize = 16;
/// Rounding and compression make differences of up to so many grey levels out of nothing.
const NOISE_LEVELS: u8 = 2;

/// Whether grey levels anywhere differ along a row by more than noise. Where they do not, every disparity fits as well as any
/// other, and whatever a matcher says is invented.
#[must_use]
pub(super) fn has_texture(image: &Image) -> bool {
    let width = (image.width_px() as usize).max(1);
    let varies = |window: &[u8]| {
        let (least, most) = window.iter().fold((u8::MAX, 0), |(least, most), level| (least.min(*level), most.max(*level)));
        most.saturating_sub(least) > NOISE_LEVELS
    };
    image.pixels().chunks_exact(width).any(|row| row.windows(REACH_PX.min(width)).step_by(REACH_PX / 2).any(varies))
}

/// Names the first of these pictures in which there is nothing to match.
pub(super) fn without_texture<'a>(pictures: [(&'a Path, &Image); 2]) -> Option<&'a Path> {
    pictures.into_iter().find(|(_, image)| !has_texture(image)).map(|(path, _)| path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(level: impl Fn(u32, u32) -> u8, expected: bool) {
        let (width, height) = (100, 40);
        let pixels: Vec<u8> = (0..width * height).map(|i| level(i % width, i / width)).collect();
        assert_eq!(has_texture(&Image::new(width, height, pixels.into()).unwrap()), expected);
    }

    #[test]
    fn blank_noisy_and_striped_pictures_have_none() {
        check(|_, _| 0, false);
        check(|_, _| 255, false);
        check(|x, y| 100 + ((x * 7 + y * 13) % 3) as u8, false);
        // Stripes along the rows: nothing tells one column from the next.
        check(|_, y| (6 * y) as u8, false);
    }

    #[test]
    fn one_faint_edge_is_texture() {
        check(|x, y| if x > 90 && y == 39 { 13 } else { 10 }, true);
        check(|x, _| (2 * x) as u8, true);
    }
}
