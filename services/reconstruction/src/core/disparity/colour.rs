//! Disparity for the eye: near is red, far is blue, no match is black.

use opencv::Result;
use opencv::core::{CV_8UC3, Mat, MatTraitConst, MatTraitManual, Vec3b, Vector};
use opencv::prelude::VectorToVec;
use opencv::{imgcodecs, imgproc};

use super::Disparity;

/// The map as a colour PNG, its colours spread over the disparities that occur (2nd to 98th percentile).
///
/// # Errors
/// OpenCV's, which only memory can cause.
pub fn encode_png(disparity: &Disparity) -> Result<Vec<u8>> {
    let (low, high) = percentiles(&disparity.values_px);
    let scale = 255.0 / (high - low).max(1e-3);
    let levels: Vec<u8> = disparity.values_px.iter().map(|value| ((value - low) * scale).clamp(0.0, 255.0) as u8).collect();
    let (rows, cols) = (disparity.height_px as i32, disparity.width_px as i32);
    let mut coloured = Mat::new_rows_cols_with_default(rows, cols, CV_8UC3, 0.0.into())?;
    if !levels.is_empty() {
        let grey = Mat::new_rows_cols_with_data(rows, cols, &levels)?;
        imgproc::apply_color_map(&grey, &mut coloured, imgproc::COLORMAP_TURBO)?;
        for (pixel, value) in coloured.data_typed_mut::<Vec3b>()?.iter_mut().zip(&disparity.values_px) {
            if !value.is_finite() {
                *pixel = Vec3b::default();
            }
        }
    }
    debug_assert_eq!(coloured.rows(), rows);
    let mut png = Vector::<u8>::new();
    imgcodecs::imencode(".png", &coloured, &mut png, &Vector::new())?;
    Ok(png.to_vec())
}

/// 2nd and 98th percentile of the finite values; 0 and 1 where there are none.
fn percentiles(values: &[f32]) -> (f32, f32) {
    let mut finite: Vec<f32> = values.iter().copied().filter(|value| value.is_finite()).collect();
    if finite.is_empty() {
        return (0.0, 1.0);
    }
    let last = finite.len() - 1;
    let low = *finite.select_nth_unstable_by(last / 50, f32::total_cmp).1;
    let high = *finite.select_nth_unstable_by(last - last / 50, f32::total_cmp).1;
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use opencv::core::MatTraitConstManual;

    #[test]
    fn near_is_red_far_is_blue_none_is_black() {
        let values_px: Vec<f32> = (0..100).map(|i| if i == 0 { f32::NAN } else { i as f32 }).collect();
        let png = encode_png(&Disparity { width_px: 10, height_px: 10, values_px }).unwrap();
        let read = imgcodecs::imdecode(&Mat::from_slice(&png).unwrap(), imgcodecs::IMREAD_COLOR).unwrap();
        let pixels = read.data_typed::<Vec3b>().unwrap();
        assert_eq!(pixels[0], Vec3b::default());
        let [far, near] = [pixels[20], pixels[90]];
        assert!(far[0] > far[2] && near[2] > near[0], "{far:?} {near:?}");
    }
}
