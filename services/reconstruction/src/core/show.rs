//! Pictures of pictures, for people: grey levels, keypoints, and a pair before and after rectification, as PNG.

use halcyon_model::{Image, RigCalibration};
use nalgebra::Vector2;
use opencv::core::{Mat, MatTraitConst, Point, Rect, Scalar, Size, ToInputArray, Vector};
use opencv::prelude::{MatTrait, VectorToVec};
use opencv::{imgcodecs, imgproc};

use super::camera;
use super::cv;
use super::features::{Features, line_colour};
use super::rectify::{Rectifier, RectifyError};

/// Lines across a pair.
const LINES: u32 = 12;
/// Points of an epipolar line, from two baselines away to beyond ten thousand.
const DEPTHS: i32 = 48;

/// The picture as it is.
///
/// # Errors
/// OpenCV's, which only memory can cause.
pub fn grey_png(image: &Image) -> opencv::Result<Vec<u8>> {
    encode(&cv::mat_from_image(image)?)
}

/// The picture with a circle round each keypoint, as large as the feature (thesis figures 4-16 and 5-3).
///
/// # Errors
/// OpenCV's, which only memory can cause.
pub fn keypoints_png(image: &Image, features: &Features) -> opencv::Result<Vec<u8>> {
    let mut canvas = coloured(&cv::mat_from_image(image)?)?;
    for keypoint in &features.keypoints {
        let at = Point::new(keypoint.x_px.round() as i32, keypoint.y_px.round() as i32);
        let radius = (0.5 * keypoint.size_px).round().clamp(2.0, 60.0) as i32;
        imgproc::circle(&mut canvas, at, radius, Scalar::new(0.0, 215.0, 255.0, 0.0), 1, imgproc::LINE_AA, 0)?;
    }
    encode(&canvas)
}

/// The pair as it was taken with epipolar lines in the right picture above, and rectified with rows below: on the lower pair each
/// point lies on one line in both pictures (thesis figures 4-4 and 4-22).
///
/// # Errors
/// [`RectifyError`] for a rig that cannot be rectified, or pictures of another size.
pub fn rectification_png(left: &Image, right: &Image, rig: &RigCalibration) -> Result<Vec<u8>, RectifyError> {
    let mut rectifier = Rectifier::new(rig)?;
    rectifier.rectify(left, right)?;
    let (width, height) = (left.width_px() as i32, left.height_px() as i32);
    let white = Scalar::new(255.0, 255.0, 255.0, 0.0);
    let mut canvas = Mat::new_rows_cols_with_default(2 * height + 8, 2 * width + 8, opencv::core::CV_8UC3, white)?;
    let above = [coloured(&cv::mat_from_image(left)?)?, coloured(&cv::mat_from_image(right)?)?];
    let (grey_left, grey_right) = rectifier.grey();
    let below = [coloured(grey_left)?, coloured(grey_right)?];
    for (row, pair) in [above, below].into_iter().enumerate() {
        for (col, picture) in pair.into_iter().enumerate() {
            let place = Rect::new(col as i32 * (width + 8), row as i32 * (height + 8), width, height);
            picture.copy_to(&mut canvas.roi_mut(place)?)?;
        }
    }
    let baseline_m = rig.baseline_m();
    for line in 0..LINES {
        let colour = line_colour(line as f32 / LINES as f32);
        let y = (f64::from(line) + 0.5) * f64::from(height) / f64::from(LINES);
        let at = Vector2::new(0.5 * f64::from(width), y);
        imgproc::circle(&mut canvas, pixel(at), 5, colour, 2, imgproc::LINE_AA, 0)?;
        // Where the right camera may see what the left one sees in that pixel: from near to far, lenses and all.
        let Some(ray) = camera::unproject(&rig.left, at) else { continue };
        let mut side = canvas.roi_mut(Rect::new(width + 8, 0, width, height))?;
        let seen: Vec<Vector2<f64>> = (0..=DEPTHS)
            .map(|step| rig.right_from_left * ray * (baseline_m * 2.0 * 1.2_f64.powi(step)) + rig.right_from_left_m)
            .filter(|point_m| point_m.z > 0.0)
            .map(|point_m| camera::project(&rig.right, &point_m))
            .collect();
        for ends in seen.windows(2) {
            imgproc::line(&mut side, pixel(ends[0]), pixel(ends[1]), colour, 1, imgproc::LINE_AA, 0)?;
        }
        let row = height + 8 + y.round() as i32;
        imgproc::line(&mut canvas, Point::new(0, row), Point::new(2 * width + 7, row), colour, 1, imgproc::LINE_AA, 0)?;
    }
    Ok(encode(&canvas)?)
}

/// A picture as a page shows it: at most `width_px_max` wide, as JPEG, which is a tenth of a photograph's PNG.
///
/// # Errors
/// OpenCV's, for what is no picture.
pub fn for_page(picture: &[u8], width_px_max: u32) -> opencv::Result<Vec<u8>> {
    let whole = imgcodecs::imdecode(&Mat::from_slice(picture)?, imgcodecs::IMREAD_COLOR)?;
    let scale = f64::from(width_px_max) / f64::from(whole.cols().max(1));
    let mut shown = Mat::default();
    if scale < 1.0 {
        imgproc::resize(&whole, &mut shown, Size::default(), scale, scale, imgproc::INTER_AREA)?;
    } else {
        shown = whole;
    }
    let mut jpeg = Vector::<u8>::new();
    imgcodecs::imencode(".jpg", &shown, &mut jpeg, &Vector::from_slice(&[imgcodecs::IMWRITE_JPEG_QUALITY, 80]))?;
    Ok(jpeg.to_vec())
}

fn pixel(at: Vector2<f64>) -> Point {
    // Far outside is as good as outside.
    let whole = |x: f64| x.round().clamp(-1e5, 1e5) as i32;
    Point::new(whole(at.x), whole(at.y))
}

fn coloured(grey: &impl ToInputArray) -> opencv::Result<Mat> {
    let mut colour = Mat::default();
    imgproc::cvt_color_def(grey, &mut colour, imgproc::COLOR_GRAY2BGR)?;
    Ok(colour)
}

fn encode(picture: &impl ToInputArray) -> opencv::Result<Vec<u8>> {
    let mut png = Vector::<u8>::new();
    imgcodecs::imencode_def(".png", picture, &mut png)?;
    Ok(png.to_vec())
}

#[cfg(test)]
mod tests {
    use halcyon_model::Bytes;
    use opencv::core::{MatTraitConstManual, Vec3b};

    use super::*;
    use crate::core::features::{Method, detect};

    fn decoded(png: &[u8]) -> Mat {
        imgcodecs::imdecode(&Mat::from_slice(png).unwrap(), imgcodecs::IMREAD_COLOR).unwrap()
    }

    /// Wider than the margin of 31 px that ORB keeps to every edge.
    const SIDE_PX: u32 = 160;

    fn blobs() -> Image {
        let level = |i: u32| if (i % SIDE_PX / 8 + i / SIDE_PX / 8).is_multiple_of(2) { 40 } else { 200 };
        Image::new(SIDE_PX, SIDE_PX, Bytes::from_iter((0..SIDE_PX * SIDE_PX).map(level))).unwrap()
    }

    #[test]
    fn levels_come_back_as_they_were() {
        let image = blobs();
        let read = decoded(&grey_png(&image).unwrap());
        for (pixel, level) in read.data_typed::<Vec3b>().unwrap().iter().zip(image.pixels()) {
            assert_eq!(pixel.0, [*level; 3]);
        }
    }

    #[test]
    fn a_pages_picture_is_small_and_of_the_same_shape() {
        let png = grey_png(&blobs()).unwrap();
        let small = decoded(&for_page(&png, 80).unwrap());
        assert_eq!((small.cols(), small.rows()), (80, 80));
        assert_eq!(decoded(&for_page(&png, 1000).unwrap()).cols(), SIDE_PX as i32);
        // The middle of a dark square, four pixels wide by now.
        assert!(small.at_2d::<Vec3b>(2, 2).unwrap()[0] < 80 && small.at_2d::<Vec3b>(2, 6).unwrap()[0] > 160);
        assert!(for_page(b"no picture", 80).is_err());
    }

    #[test]
    fn keypoints_are_drawn_where_they_are() {
        let image = blobs();
        let features = detect(&image, Method::Orb, 5).unwrap();
        assert!(!features.keypoints.is_empty());
        let read = decoded(&keypoints_png(&image, &features).unwrap());
        let yellow = read.data_typed::<Vec3b>().unwrap().iter().filter(|pixel| pixel[2] > 150 && pixel[0] < 100).count();
        assert!(yellow > 10, "{yellow}");
    }
}
