//! A pair of pictures by one method: keypoints before and after RANSAC, as in the thesis's tables 4-2, 4-3, 5-1 and 5-2.

use halcyon_model::Image;
use nalgebra::Vector2;

use super::{FeatureError, FeatureMatch, Features, MatchRule, Method, detect, match_features};
use crate::core::epipolar::{Consensus, PointPair, RansacSettings, find_fundamental};

/// How a pair is studied.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StudySettings {
    /// The strongest so many keypoints of each picture.
    pub keypoints_max: usize,
    /// What is a match.
    pub rule: MatchRule,
    /// RANSAC on the fundamental matrix.
    pub ransac: RansacSettings,
}

impl Default for StudySettings {
    fn default() -> Self {
        Self { keypoints_max: 2000, rule: MatchRule::default(), ransac: RansacSettings::default() }
    }
}

/// A row of the thesis's tables.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FeatureCounts {
    /// The method.
    pub method: Method,
    /// Keypoints of the left picture (tables 4-2, 5-1).
    pub left: usize,
    /// Keypoints of the right picture.
    pub right: usize,
    /// Nearest neighbours that are matches (figure 4-18).
    pub matches: usize,
    /// Matches that RANSAC keeps: keypoints of either picture after it (tables 4-3, 5-2; figure 4-19).
    pub inliers: usize,
}

/// What a method finds in a pair.
#[derive(Debug, Clone)]
pub struct FeatureStudy {
    /// The method.
    pub method: Method,
    /// Features of the left picture (figures 4-16, 5-3).
    pub left: Features,
    /// Features of the right picture.
    pub right: Features,
    /// Matches before RANSAC.
    pub matches: Vec<FeatureMatch>,
    /// F and which matches keep to it; `None` where there is no consensus.
    pub consensus: Option<Consensus>,
}

impl FeatureStudy {
    /// The row of the tables.
    #[must_use]
    pub fn counts(&self) -> FeatureCounts {
        FeatureCounts {
            method: self.method,
            left: self.left.keypoints.len(),
            right: self.right.keypoints.len(),
            matches: self.matches.len(),
            inliers: self.consensus.as_ref().map_or(0, |consensus| consensus.inliers),
        }
    }

    /// The matches as points, pixels; in their order.
    #[must_use]
    pub fn points(&self) -> Vec<PointPair> {
        self.matches.iter().map(|m| point_pair(&self.left, &self.right, m)).collect()
    }

    /// Whether RANSAC kept the match at `index`.
    #[must_use]
    pub fn is_inlier(&self, index: usize) -> bool {
        self.consensus.as_ref().is_some_and(|consensus| consensus.is_inlier[index])
    }
}

/// Where the two features of a match are.
fn point_pair(left: &Features, right: &Features, m: &FeatureMatch) -> PointPair {
    let at = |features: &Features, index: usize| {
        let keypoint = &features.keypoints[index];
        Vector2::new(f64::from(keypoint.x_px), f64::from(keypoint.y_px))
    };
    PointPair { left: at(left, m.left), right: at(right, m.right) }
}

/// Detects, matches and filters. `place` moves pixels to where an ideal lens would have put them, so that the fundamental matrix
/// need not explain distortion; where the lens is not known, pass the pixels on as they are.
///
/// # Errors
/// [`FeatureError`] for pictures too small. No consensus is a result, not an error.
pub fn study(
    left: &Image,
    right: &Image,
    method: Method,
    settings: &StudySettings,
    place: &dyn Fn(&[PointPair]) -> Vec<PointPair>,
) -> Result<FeatureStudy, FeatureError> {
    let (left, right) = (detect(left, method, settings.keypoints_max)?, detect(right, method, settings.keypoints_max)?);
    let matches = match_features(&left, &right, &settings.rule);
    let points: Vec<PointPair> = matches.iter().map(|m| point_pair(&left, &right, m)).collect();
    let consensus = find_fundamental(&place(&points), &settings.ransac).ok();
    Ok(FeatureStudy { method, left, right, matches, consensus })
}

/// The matched points of two pictures, pixels, each place of the left picture once: methods that put several features on one
/// place, in several directions or scales, would count one error several times.
///
/// # Errors
/// [`FeatureError`] for pictures too small.
pub fn match_pictures(
    left: &Image,
    right: &Image,
    method: Method,
    keypoints_max: usize,
    rule: &MatchRule,
) -> Result<Vec<PointPair>, FeatureError> {
    let (left, right) = (detect(left, method, keypoints_max)?, detect(right, method, keypoints_max)?);
    let mut taken = std::collections::HashSet::new();
    let mut pairs: Vec<PointPair> = match_features(&left, &right, rule).iter().map(|m| point_pair(&left, &right, m)).collect();
    pairs.retain(|pair| taken.insert((pair.left.x.round() as i32, pair.left.y.round() as i32)));
    Ok(pairs)
}
