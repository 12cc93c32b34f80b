//! Small things on pictures that experiments need.

use bytes::Bytes;
use halcyon_model::Image;
use halcyon_reconstruction::core::disparity::Disparity;

use super::context::{LabError, Object};

/// A picture from its pixels, row by row.
pub(super) fn image(width_px: u32, height_px: u32, pixels: Vec<u8>) -> Result<Image, LabError> {
    Image::new(width_px, height_px, Bytes::from(pixels)).map_err(|error| LabError::Draw(error.to_string()))
}

/// Half as wide and high: means of 2 × 2 pixels, disparities halved. An odd last row or column is left out.
pub(super) fn halved(object: &Object) -> Result<Object, LabError> {
    let (width, height) = ((object.left.width_px() / 2) as usize, (object.left.height_px() / 2) as usize);
    let shrunk = |from: &Image| {
        let stride = from.width_px() as usize;
        let mean = |i: usize| {
            let at = i / width * 2 * stride + i % width * 2;
            let sum: u32 = [at, at + 1, at + stride, at + stride + 1].iter().map(|i| u32::from(from.pixels()[*i])).sum();
            ((sum + 2) / 4) as u8
        };
        image(width as u32, height as u32, (0..width * height).map(mean).collect())
    };
    let stride = object.truth.width_px as usize;
    let values_px = (0..width * height).map(|i| 0.5 * object.truth.values_px[i / width * 2 * stride + i % width * 2]).collect();
    let truth = Disparity { width_px: width as u32, height_px: height as u32, values_px };
    let mut range = object.range;
    (range.min_px, range.max_px) = (range.min_px / 2, range.max_px.div_ceil(2));
    Ok(Object { left: shrunk(&object.left)?, right: shrunk(&object.right)?, truth, range })
}

/// Numbers as grey levels, least black, largest white.
pub(super) fn stretched(values: &[f32]) -> Vec<u8> {
    let low = values.iter().copied().fold(f32::INFINITY, f32::min);
    let high = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let scale = 255.0 / (high - low).max(1e-6);
    values.iter().map(|value| ((value - low) * scale).round() as u8).collect()
}

/// Left and right in one.
pub(super) fn side_by_side(left: &Image, right: &Image) -> Result<Image, LabError> {
    let (width, height) = (left.width_px() as usize, left.height_px().min(right.height_px()) as usize);
    let rows = left.pixels().chunks_exact(width).zip(right.pixels().chunks_exact(right.width_px() as usize)).take(height);
    let pixels: Vec<u8> = rows.flat_map(|(left, right)| left.iter().chain(&[255; 8]).chain(right).copied()).collect();
    image(left.width_px() + 8 + right.width_px(), height as u32, pixels)
}

#[cfg(test)]
mod tests {
    use super::*;
    use halcyon_reconstruction::core::matcher::DisparityRange;

    #[test]
    fn halves_are_means_of_four() {
        let left = image(5, 2, vec![0, 4, 9, 9, 7, 8, 12, 9, 9, 7]).unwrap();
        let truth = Disparity { width_px: 5, height_px: 2, values_px: (0..10_u8).map(f32::from).collect() };
        let whole = Object { right: left.clone(), left, truth, range: DisparityRange { min_px: 1, max_px: 9 } };
        let half = halved(&whole).unwrap();
        assert_eq!((half.left.pixels().as_ref(), half.truth.values_px.as_slice()), (&[6, 9][..], &[0.0, 1.0][..]));
        assert_eq!(half.range, DisparityRange { min_px: 0, max_px: 5 });
        assert_eq!(stretched(&[2.0, 3.0, 4.0]), [0, 128, 255]);
        assert_eq!(side_by_side(&half.left, &half.right).unwrap().pixels().len(), 2 + 8 + 2);
    }
}
