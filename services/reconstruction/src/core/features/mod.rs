//! Sparse features (thesis 4.6.1): points that can be found again in another picture, and what they look like.
//!
//! SIFT, ORB and AKAZE are OpenCV's; Debian's OpenCV has no SURF, so that one is [written here](surf). All report places with
//! pixel (0, 0) in the centre of the top-left pixel.

mod draw;
mod library;
mod matching;
mod study;
pub mod surf;

use std::str::FromStr;

pub use draw::encode_png;
pub(crate) use draw::line_colour;
use halcyon_model::Image;
pub use matching::{FeatureMatch, MatchRule, match_features};
use opencv::core::{Mat, MatTraitConstManual};
pub use study::{FeatureCounts, FeatureStudy, StudySettings, match_pictures, study};

use super::cv;

/// Pictures with a shorter side are too small for any detector.
pub const SIDE_PX_MIN: u32 = 32;
/// More keypoints than this are refused: matching compares each with each.
pub const KEYPOINTS_MAX: usize = 20_000;

/// A detector with its descriptor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Scale-invariant feature transform (Lowe 2004): 128 numbers, Euclidean distance.
    Sift,
    /// Speeded-up robust features (Bay et al. 2008): 64 numbers, Euclidean distance.
    Surf,
    /// Oriented FAST, rotated BRIEF (Rublee et al. 2011): 256 bits, Hamming distance.
    Orb,
    /// Accelerated KAZE (Alcantarilla et al. 2013): 486 bits, Hamming distance.
    Akaze,
}

impl Method {
    /// All of them, in the order of the thesis's tables.
    pub const ALL: [Self; 4] = [Self::Sift, Self::Surf, Self::Orb, Self::Akaze];

    /// As on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Sift => "sift",
            Self::Surf => "surf",
            Self::Orb => "orb",
            Self::Akaze => "akaze",
        }
    }
}

/// A name that is no method.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no feature method {0:?}: use sift, surf, orb or akaze")]
pub struct UnknownMethod(String);

impl FromStr for Method {
    type Err = UnknownMethod;

    fn from_str(text: &str) -> Result<Self, UnknownMethod> {
        Self::ALL.into_iter().find(|method| method.name() == text).ok_or_else(|| UnknownMethod(text.chars().take(40).collect()))
    }
}

/// Why there are no features.
#[derive(Debug, thiserror::Error)]
pub enum FeatureError {
    /// Too small a picture.
    #[error("a picture of {width_px}x{height_px} px is too small for features: each side needs {SIDE_PX_MIN}")]
    TooSmall {
        /// Width.
        width_px: u32,
        /// Height.
        height_px: u32,
    },
    /// Too many or none.
    #[error("the number of keypoints must be 1 to {KEYPOINTS_MAX}, not {0}")]
    Count(usize),
    /// OpenCV failed.
    #[error("OpenCV failed while looking for features")]
    OpenCv(#[from] opencv::Error),
}

/// A point that can be found again.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Keypoint {
    /// Place along the row, pixels.
    pub x_px: f32,
    /// Place along the column, pixels.
    pub y_px: f32,
    /// Diameter of the neighbourhood that it stands for, pixels; what that means differs between methods.
    pub size_px: f32,
    /// Orientation, clockwise on the screen from the row's direction, radians in `[0, 2π)`.
    pub angle_rad: f32,
    /// Strength; comparable within one method only.
    pub response: f32,
    /// SURF's sign of the Laplacian: dark blobs on bright ground match dark ones only. `false` for the other methods.
    pub is_dark: bool,
}

/// What keypoints look like, one descriptor after the other.
#[derive(Debug, Clone, PartialEq)]
pub enum Descriptors {
    /// Numbers, compared by Euclidean distance.
    Float {
        /// Numbers in one.
        length: usize,
        /// All of them.
        values: Vec<f32>,
    },
    /// Bits, compared by Hamming distance.
    Binary {
        /// 64-bit words in one; spare bits are 0.
        words: usize,
        /// All of them.
        values: Vec<u64>,
    },
}

/// The features of one picture, strongest first.
#[derive(Debug, Clone, PartialEq)]
pub struct Features {
    /// Where.
    pub keypoints: Vec<Keypoint>,
    /// What they look like, in the same order.
    pub descriptors: Descriptors,
}

/// Finds the strongest `keypoints_max` features of a picture.
///
/// # Errors
/// [`FeatureError`] for a picture that is too small, or a silly number.
pub fn detect(image: &Image, method: Method, keypoints_max: usize) -> Result<Features, FeatureError> {
    detect_in(&cv::mat_from_image(image)?.clone_pointee(), method, keypoints_max)
}

/// The same for a picture that OpenCV already has: one channel, 8 bits, rows without gaps.
pub(crate) fn detect_in(picture: &Mat, method: Method, keypoints_max: usize) -> Result<Features, FeatureError> {
    let (width_px, height_px) = cv::size_px(picture);
    if width_px.min(height_px) < SIDE_PX_MIN {
        return Err(FeatureError::TooSmall { width_px, height_px });
    }
    if !(1..=KEYPOINTS_MAX).contains(&keypoints_max) {
        return Err(FeatureError::Count(keypoints_max));
    }
    match method {
        Method::Surf => {
            let settings = surf::Settings { keypoints_max, ..surf::Settings::default() };
            Ok(surf::detect(picture.data_bytes()?, width_px as usize, height_px as usize, &settings))
        }
        Method::Sift => Ok(library::sift(picture, keypoints_max)?),
        Method::Orb => Ok(library::orb(picture, keypoints_max)?),
        Method::Akaze => Ok(library::akaze(picture, keypoints_max)?),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn methods_have_names() {
        for method in Method::ALL {
            assert_eq!(method.name().parse(), Ok(method));
        }
        assert!("harris".parse::<Method>().unwrap_err().to_string().contains("harris"));
    }

    #[test]
    fn pictures_without_features_and_sizes_out_of_range() {
        let flat = |side: u32| Image::new(side, side, vec![90; (side * side) as usize].into()).unwrap();
        for method in Method::ALL {
            assert_eq!(detect(&flat(64), method, 100).unwrap().keypoints, []);
            assert!(matches!(detect(&flat(31), method, 100), Err(FeatureError::TooSmall { .. })));
            assert!(matches!(detect(&flat(64), method, 0), Err(FeatureError::Count(0))));
            assert!(matches!(detect(&flat(64), method, KEYPOINTS_MAX + 1), Err(FeatureError::Count(_))));
        }
    }

    /// Bright and dark discs at known places between pixels: every method finds most of them, and none is biased. OpenCV's own
    /// places are: SIFT's by a quarter of a pixel, ORB's by up to a pixel in its small levels.
    #[test]
    fn places_are_right_and_unbiased() {
        let (width, height) = (400, 400);
        let mut centres = Vec::new();
        for i in 0..49 {
            let (col, row) = (f64::from(i % 7), f64::from(i / 7));
            // Offsets walk through all phases of the pixel grid.
            centres.push((40.0 + 53.0 * col + 0.137 * f64::from(i), 40.0 + 53.0 * row + (0.617 * f64::from(i)) % 1.0));
        }
        let pixels: Vec<u8> = (0..width * height)
            .map(|at| {
                let (x, y) = (f64::from(at % width), f64::from(at / width));
                let blobs = centres.iter().enumerate().map(|(i, (cx, cy))| {
                    let r = (x - cx).hypot(y - cy) / (4.0 + 0.06 * i as f64);
                    (if i % 2 == 0 { 90.0 } else { -90.0 }) / (1.0 + (4.0 * (r - 1.0)).exp())
                });
                (128.0 + blobs.sum::<f64>()).round() as u8
            })
            .collect();
        let picture = Image::new(width as u32, height as u32, pixels.into()).unwrap();
        for method in Method::ALL {
            let features = detect(&picture, method, 2000).unwrap();
            // Corner detectors sit around the rim of a disc, evenly: the mean of what is near one is its centre.
            let (mut found, mut bias_x, mut bias_y) = (0.0, 0.0, 0.0);
            for (cx, cy) in &centres {
                let near: Vec<_> = features
                    .keypoints
                    .iter()
                    .map(|k| (f64::from(k.x_px) - cx, f64::from(k.y_px) - cy))
                    .filter(|(dx, dy)| dx.hypot(*dy) < 3.0)
                    .collect();
                if !near.is_empty() {
                    found += 1.0;
                    bias_x += near.iter().map(|d| d.0).sum::<f64>() / near.len() as f64;
                    bias_y += near.iter().map(|d| d.1).sum::<f64>() / near.len() as f64;
                }
            }
            let (bias_x, bias_y) = (bias_x / found, bias_y / found);
            println!("{}: {found} of 49 discs, bias {bias_x:.3}, {bias_y:.3} px", method.name());
            assert!(found >= 30.0, "{} found {found}", method.name());
            let margin_px = if method == Method::Orb { 0.2 } else { 0.06 };
            assert!(bias_x.abs() < margin_px && bias_y.abs() < margin_px, "{}: {bias_x} {bias_y}", method.name());
        }
    }
}
