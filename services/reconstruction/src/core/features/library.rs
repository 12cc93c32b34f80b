//! OpenCV's SIFT, ORB and AKAZE, bounded in number and freed of their biases in place.

use opencv::Result;
use opencv::core::{KeyPoint, KeyPointTraitConst, Mat, MatTraitConst, MatTraitConstManual, Vector};
use opencv::features2d::{AKAZE, AKAZE_DescriptorType, KAZE_DiffusivityType, ORB, ORB_ScoreType, SIFT};
use opencv::prelude::Feature2DTrait;

use super::{Descriptors, Features, Keypoint};

/// Ratio of the levels of ORB's pyramid.
const ORB_LEVEL_RATIO: f32 = 1.2;
const ORB_LEVELS: i32 = 8;
/// OpenCV's default, 31, leaves a wide empty border in the small pictures of a drone.
const ORB_EDGE_PX: i32 = 19;

pub(super) fn sift(picture: &Mat, keypoints_max: usize) -> Result<Features> {
    let mut sift = SIFT::create(keypoints_max as i32, 3, 0.04, 10.0, 1.6)?;
    // OpenCV 4.6 starts from a picture enlarged about its corner and divides by two: everything lands a quarter pixel off.
    run(&mut sift, picture, keypoints_max, |_| -0.25)
}

pub(super) fn orb(picture: &Mat, keypoints_max: usize) -> Result<Features> {
    let mut orb =
        ORB::create(keypoints_max as i32, ORB_LEVEL_RATIO, ORB_LEVELS, ORB_EDGE_PX, 0, 2, ORB_ScoreType::HARRIS_SCORE, 31, 20)?;
    // A pixel u of a level is (u + 1/2) s − 1/2 of the picture; OpenCV says u s.
    run(&mut orb, picture, keypoints_max, |point| 0.5 * (ORB_LEVEL_RATIO.powi(point.octave()) - 1.0))
}

pub(super) fn akaze(picture: &Mat, keypoints_max: usize) -> Result<Features> {
    let mut akaze = AKAZE::create(AKAZE_DescriptorType::DESCRIPTOR_MLDB, 0, 3, 0.001, 4, 4, KAZE_DiffusivityType::DIFF_PM_G2)?;
    run(&mut akaze, picture, keypoints_max, |_| 0.0)
}

/// Runs a detector; `offset_px` is what its places need, along x and y alike.
fn run(
    detector: &mut impl Feature2DTrait,
    picture: &Mat,
    keypoints_max: usize,
    offset_px: impl Fn(&KeyPoint) -> f32,
) -> Result<Features> {
    let (mut keypoints, mut rows) = (Vector::<KeyPoint>::new(), Mat::default());
    detector.detect_and_compute(picture, &Mat::default(), &mut keypoints, &mut rows, false)?;
    let keypoints: Vec<KeyPoint> = keypoints.iter().collect();
    let mut order: Vec<usize> = (0..keypoints.len()).collect();
    // Ties by place, so that the order is the same on every machine.
    order.sort_by(|&a, &b| {
        let key = |i: usize| (keypoints[i].pt().y, keypoints[i].pt().x);
        let place = key(a).0.total_cmp(&key(b).0).then(key(a).1.total_cmp(&key(b).1));
        keypoints[b].response().total_cmp(&keypoints[a].response()).then(place)
    });
    order.truncate(keypoints_max);
    if order.is_empty() {
        return Ok(Features { keypoints: Vec::new(), descriptors: Descriptors::Binary { words: 0, values: Vec::new() } });
    }
    let descriptors = if rows.typ() == opencv::core::CV_32F {
        let length = rows.cols() as usize;
        let all = rows.data_typed::<f32>()?;
        Descriptors::Float { length, values: order.iter().flat_map(|&i| &all[i * length..][..length]).copied().collect() }
    } else {
        let (bytes, all) = (rows.cols() as usize, rows.data_bytes()?);
        let words = bytes.div_ceil(8);
        let mut values = Vec::with_capacity(order.len() * words);
        for &i in &order {
            for chunk in all[i * bytes..][..bytes].chunks(8) {
                values.push(chunk.iter().rev().fold(0, |word, byte| word << 8 | u64::from(*byte)));
            }
        }
        Descriptors::Binary { words, values }
    };
    let keypoints = order
        .iter()
        .map(|&i| {
            let (point, offset_px) = (&keypoints[i], offset_px(&keypoints[i]));
            Keypoint {
                x_px: point.pt().x + offset_px,
                y_px: point.pt().y + offset_px,
                size_px: point.size(),
                angle_rad: point.angle().max(0.0).to_radians(),
                response: point.response(),
                is_dark: false,
            }
        })
        .collect();
    Ok(Features { keypoints, descriptors })
}
