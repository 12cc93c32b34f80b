//! Which feature of the left picture is which of the right one: the nearest by descriptor (thesis 4.6.1), if it is clearly so.

use super::{Descriptors, Features};

/// What a nearest neighbour must be to be a match.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MatchRule {
    /// The distance must be under this share of that to the second nearest (Lowe 2004, 7.1); `None` asks for no ratio, as the
    /// thesis does.
    pub ratio_max: Option<f32>,
    /// The match must be the nearest in both directions.
    pub is_mutual: bool,
}

impl Default for MatchRule {
    fn default() -> Self {
        Self { ratio_max: Some(0.8), is_mutual: true }
    }
}

/// A pair of features, by their place in the two lists.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeatureMatch {
    /// Of the left picture.
    pub left: usize,
    /// Of the right picture.
    pub right: usize,
    /// Distance of the descriptors: Euclidean, or the number of bits that differ.
    pub distance: f32,
}

/// Nearest and second nearest, as squared distances (or bits).
#[derive(Clone, Copy)]
struct Nearest {
    index: usize,
    first: f32,
    second: f32,
}

const NOTHING: Nearest = Nearest { index: usize::MAX, first: f32::INFINITY, second: f32::INFINITY };

impl Nearest {
    fn offer(&mut self, index: usize, distance: f32) {
        if distance < self.first {
            *self = Self { index, first: distance, second: self.first };
        } else if distance < self.second {
            self.second = distance;
        }
    }
}

/// Matches by nearest descriptor, comparing each with each; in the order of the left features. Descriptors of different kinds
/// never match.
#[must_use]
pub fn match_features(left: &Features, right: &Features, rule: &MatchRule) -> Vec<FeatureMatch> {
    match (&left.descriptors, &right.descriptors) {
        (Descriptors::Float { length, values }, Descriptors::Float { length: other, values: right_values })
            if length == other && *length > 0 =>
        {
            // Squared, so the ratio is, too.
            let ratio = rule.ratio_max.map(|ratio| ratio * ratio);
            let found = search(left, right, rule, ratio, |i, j| {
                squared_distance(&values[i * length..][..*length], &right_values[j * length..][..*length])
            });
            found.into_iter().map(|m| FeatureMatch { distance: m.distance.sqrt(), ..m }).collect()
        }
        (Descriptors::Binary { words, values }, Descriptors::Binary { words: other, values: right_values })
            if words == other && *words > 0 =>
        {
            search(left, right, rule, rule.ratio_max, |i, j| {
                let bits: u32 = values[i * words..][..*words]
                    .iter()
                    .zip(&right_values[j * words..][..*words])
                    .map(|(a, b)| (a ^ b).count_ones())
                    .sum();
                bits as f32
            })
        }
        _ => Vec::new(),
    }
}

fn search(
    left: &Features,
    right: &Features,
    rule: &MatchRule,
    ratio: Option<f32>,
    distance: impl Fn(usize, usize) -> f32,
) -> Vec<FeatureMatch> {
    let mut backward = vec![NOTHING; right.keypoints.len()];
    let mut matches = Vec::new();
    for (i, keypoint) in left.keypoints.iter().enumerate() {
        let mut forward = NOTHING;
        for (j, other) in right.keypoints.iter().enumerate() {
            if keypoint.is_dark == other.is_dark {
                let distance = distance(i, j);
                forward.offer(j, distance);
                backward[j].offer(i, distance);
            }
        }
        // Negated, so that a NaN descriptor is no match. A lone candidate has nothing to be told apart from.
        let is_clear = ratio.is_none_or(|ratio| forward.second.is_finite() && forward.first < ratio * forward.second);
        if forward.index != usize::MAX && is_clear {
            matches.push(FeatureMatch { left: i, right: forward.index, distance: forward.first });
        }
    }
    if rule.is_mutual {
        matches.retain(|m| backward[m.right].index == m.left);
    }
    matches
}

fn squared_distance(a: &[f32], b: &[f32]) -> f32 {
    // Eight sums side by side, which the compiler makes vectors of.
    let mut sums = [0.0_f32; 8];
    for (a, b) in a.chunks_exact(8).zip(b.chunks_exact(8)) {
        for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
            *sum += (a - b) * (a - b);
        }
    }
    let rest = a.chunks_exact(8).remainder().iter().zip(b.chunks_exact(8).remainder());
    sums.iter().sum::<f32>() + rest.map(|(a, b)| (a - b) * (a - b)).sum::<f32>()
}

#[cfg(test)]
mod tests {
    use opencv::core::{DMatch, Mat, MatTraitConst, Vector};
    use opencv::features2d::BFMatcher;
    use opencv::prelude::DescriptorMatcherTrait;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::Keypoint;
    use super::*;

    fn features(descriptors: Descriptors, count: usize) -> Features {
        let keypoint = Keypoint { x_px: 0.0, y_px: 0.0, size_px: 1.0, angle_rad: 0.0, response: 1.0, is_dark: false };
        Features { keypoints: vec![keypoint; count], descriptors }
    }

    /// OpenCV's brute-force matcher, by the same rules.
    fn library(left: &Mat, right: &Mat, norm: i32, ratio: f32) -> Vec<(usize, usize)> {
        let knn = |from: &Mat, to: &Mat| {
            let (mut matcher, mut found) = (BFMatcher::new(norm, false).unwrap(), Vector::<Vector<DMatch>>::new());
            matcher.add(&Vector::<Mat>::from_iter([to.clone()])).unwrap();
            matcher.knn_match_def(from, &mut found, 2).unwrap();
            found
        };
        let back = knn(right, left);
        knn(left, right)
            .iter()
            .filter_map(|two| {
                let (first, second) = (two.get(0).unwrap(), two.get(1).unwrap());
                let (i, j) = (first.query_idx as usize, first.train_idx as usize);
                let mutual = back.get(j).unwrap().get(0).unwrap().train_idx as usize == i;
                (first.distance < ratio * second.distance && mutual).then_some((i, j))
            })
            .collect()
    }

    #[test]
    fn the_same_matches_as_the_librarys() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let (n, length) = (150, 64);
        let left: Vec<f32> = (0..n * length).map(|_| random.random_range(0.0..1.0)).collect();
        let right: Vec<f32> = left.iter().rev().map(|v| v + random.random_range(-0.4..0.4)).collect();
        let mat = |values: &[f32]| Mat::from_slice(values).unwrap().reshape(1, n as i32).unwrap().try_clone().unwrap();
        let expected = library(&mat(&left), &mat(&right), opencv::core::NORM_L2, 0.9);
        let of = |values: &[f32]| features(Descriptors::Float { length, values: values.to_vec() }, n);
        let rule = MatchRule { ratio_max: Some(0.9), is_mutual: true };
        let ours: Vec<_> = match_features(&of(&left), &of(&right), &rule).iter().map(|m| (m.left, m.right)).collect();
        assert_eq!(ours, expected);
        assert!(ours.len() < n && !ours.is_empty());

        let left: Vec<u8> = (0..n * 32).map(|_| random.random()).collect();
        let right: Vec<u8> = left.iter().map(|v| v ^ (random.random::<u8>() & random.random::<u8>())).collect();
        let mat = |values: &[u8]| Mat::from_slice(values).unwrap().reshape(1, n as i32).unwrap().try_clone().unwrap();
        let expected = library(&mat(&left), &mat(&right), opencv::core::NORM_HAMMING, 0.75);
        let of = |bytes: &[u8]| {
            let values = bytes.chunks_exact(8).map(|c| u64::from_le_bytes(c.try_into().unwrap())).collect();
            features(Descriptors::Binary { words: 4, values }, n)
        };
        let rule = MatchRule { ratio_max: Some(0.75), is_mutual: true };
        let ours: Vec<_> = match_features(&of(&left), &of(&right), &rule).iter().map(|m| (m.left, m.right)).collect();
        assert_eq!(ours, expected);
        assert!(ours.len() < n && !ours.is_empty());
    }

    #[test]
    fn no_ratio_no_mutuality_everything_matches_and_nothing_does_no_harm() {
        let of = |values: &[f32]| features(Descriptors::Float { length: 1, values: values.to_vec() }, values.len());
        let (left, right) = (of(&[0.0, 0.1, 5.0]), of(&[0.04, 9.0]));
        let pairs = |rule| match_features(&left, &right, &rule).iter().map(|m| (m.left, m.right)).collect::<Vec<_>>();
        assert_eq!(pairs(MatchRule { ratio_max: None, is_mutual: false }), [(0, 0), (1, 0), (2, 1)]);
        assert_eq!(pairs(MatchRule { ratio_max: None, is_mutual: true }), [(0, 0), (2, 1)]);
        let none = of(&[]);
        assert_eq!(match_features(&left, &none, &MatchRule::default()), []);
        assert_eq!(match_features(&none, &left, &MatchRule::default()), []);
        let bits = features(Descriptors::Binary { words: 1, values: vec![1, 2] }, 2);
        assert_eq!(match_features(&left, &bits, &MatchRule::default()), []);
        let nan = of(&[f32::NAN, f32::NAN]);
        assert_eq!(match_features(&nan, &right, &MatchRule { ratio_max: None, is_mutual: false }), []);
    }
}
