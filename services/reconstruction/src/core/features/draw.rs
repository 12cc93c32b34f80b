//! Matches before and after RANSAC, for people (thesis figures 4-16, 4-18, 4-19).

use halcyon_model::Image;
use opencv::core::{CV_8UC3, Mat, MatTrait, MatTraitConst, Point, Rect, Scalar, Vector};
use opencv::prelude::VectorToVec;
use opencv::{imgcodecs, imgproc};

use super::{FeatureStudy, Keypoint};
use crate::core::cv;

/// Room for the words above each row, pixels, for pictures 640 px wide; all of it grows with them.
const TITLE_PX: i32 = 28;
/// Between the left and the right picture, pixels.
const GAP_PX: i32 = 8;
/// Lines of a row: more of them only cover each other.
const LINES_MAX: usize = 250;

/// A PNG: the pair with all keypoints and matches above, the same with what RANSAC kept below. A line's colour goes by the height
/// of its left end, so that crossings can be followed.
///
/// # Errors
/// OpenCV's, which only memory can cause.
pub fn encode_png(left: &Image, right: &Image, study: &FeatureStudy) -> opencv::Result<Vec<u8>> {
    let (width, height) = (left.width_px().max(right.width_px()) as i32, left.height_px().max(right.height_px()) as i32);
    let zoom = (width / 640).max(1);
    let (title_px, gap_px) = (TITLE_PX * zoom, GAP_PX * zoom);
    let row_height = title_px + height;
    let mut canvas =
        Mat::new_rows_cols_with_default(2 * row_height, 2 * width + gap_px, CV_8UC3, Scalar::new(255.0, 255.0, 255.0, 0.0))?;
    let counts = study.counts();
    let name = study.method.name().to_uppercase();
    let titles = [
        format!("{name}: {} keypoints left, {} right, {} matches", counts.left, counts.right, counts.matches),
        format!("after RANSAC: {} left, {} right", counts.inliers, counts.inliers),
    ];
    for (row, title) in titles.iter().enumerate() {
        let top = row as i32 * row_height;
        put_words(&mut canvas, title, top, zoom)?;
        for (image, x) in [(left, 0), (right, width + gap_px)] {
            paste(&mut canvas, image, x, top + title_px)?;
        }
        let place = |keypoint: &Keypoint, x: i32| {
            Point::new(keypoint.x_px.round() as i32 + x, keypoint.y_px.round() as i32 + top + title_px)
        };
        if row == 0 {
            let yellow = Scalar::new(0.0, 215.0, 255.0, 0.0);
            for (features, x) in [(&study.left, 0), (&study.right, width + gap_px)] {
                for keypoint in &features.keypoints {
                    imgproc::circle(&mut canvas, place(keypoint, x), 2 * zoom, yellow, zoom, imgproc::LINE_AA, 0)?;
                }
            }
        }
        let shown: Vec<usize> = (0..study.matches.len()).filter(|index| row == 0 || study.is_inlier(*index)).collect();
        // Evenly thinned: the first would all be the strongest, which sit together.
        let every = shown.len().div_ceil(LINES_MAX).max(1);
        for index in shown.into_iter().step_by(every) {
            let m = study.matches[index];
            let (from, to) = (&study.left.keypoints[m.left], &study.right.keypoints[m.right]);
            let colour = line_colour(from.y_px / height as f32);
            let (from, to) = (place(from, 0), place(to, width + gap_px));
            imgproc::line(&mut canvas, from, to, colour, zoom, imgproc::LINE_AA, 0)?;
            for end in [from, to] {
                imgproc::circle(&mut canvas, end, 3 * zoom, colour, zoom, imgproc::LINE_AA, 0)?;
            }
        }
    }
    let mut png = Vector::<u8>::new();
    imgcodecs::imencode_def(".png", &canvas, &mut png)?;
    Ok(png.to_vec())
}

fn put_words(canvas: &mut Mat, text: &str, top: i32, zoom: i32) -> opencv::Result<()> {
    let ink = Scalar::new(40.0, 40.0, 40.0, 0.0);
    let at = Point::new(8 * zoom, top + 19 * zoom);
    imgproc::put_text(
        canvas,
        text,
        at,
        imgproc::FONT_HERSHEY_SIMPLEX,
        0.5 * f64::from(zoom),
        ink,
        zoom,
        imgproc::LINE_AA,
        false,
    )
}

fn paste(canvas: &mut Mat, image: &Image, x: i32, y: i32) -> opencv::Result<()> {
    let grey = cv::mat_from_image(image)?;
    let mut colour = Mat::default();
    imgproc::cvt_color_def(&grey, &mut colour, imgproc::COLOR_GRAY2BGR)?;
    let mut place = canvas.roi_mut(Rect::new(x, y, image.width_px() as i32, image.height_px() as i32))?;
    colour.copy_to(&mut place)
}

/// Blue over green and orange to red as `share` goes from 0 to 1.
pub(crate) fn line_colour(share: f32) -> Scalar {
    let ramp = [[230.0, 110.0, 30.0], [170.0, 190.0, 20.0], [40.0, 200.0, 90.0], [0.0, 170.0, 250.0], [60.0, 50.0, 235.0]];
    let at = share.clamp(0.0, 1.0) * (ramp.len() - 1) as f32;
    let low = (at as usize).min(ramp.len() - 2);
    let part = f64::from(at) - low as f64;
    let mix = |channel: usize| ramp[low][channel] * (1.0 - part) + ramp[low + 1][channel] * part;
    Scalar::new(mix(0), mix(1), mix(2), 0.0)
}
