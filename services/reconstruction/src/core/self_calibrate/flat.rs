//! Flat scenes: the matches of a plane obey a homography, and a homography holds up to two poses that keep all points in front.

use nalgebra::Matrix3;
use opencv::calib3d;
use opencv::core::{Mat, MatTraitConst, Point2d, Vector};

use super::bundle::Pose;
use crate::core::cv;
use crate::core::epipolar::PointPair;

/// A pair is flat when this share of its matches obeys one homography.
const SHARE_MIN: f64 = 0.9;
/// Pairs with fewer matches say nothing.
const MATCHES_MIN: usize = 20;

/// The homography, normalised coordinates, of each pair, where all pairs are flat; `None` as soon as one is not.
pub(super) fn homographies(
    rays: &[PointPair],
    used: &[usize],
    view_of: &[usize],
    threshold: f64,
) -> opencv::Result<Option<Vec<Matrix3<f64>>>> {
    let mut found = Vec::new();
    // Matches come view by view.
    for view in used.chunk_by(|a, b| view_of[*a] == view_of[*b]).filter(|view| view.len() >= MATCHES_MIN) {
        let points = |side: fn(&PointPair) -> nalgebra::Vector2<f64>| -> Vector<Point2d> {
            view.iter().map(|&i| side(&rays[i])).map(|ray| Point2d::new(ray.x, ray.y)).collect()
        };
        let (left, right) = (points(|ray| ray.left), points(|ray| ray.right));
        let mut mask = Mat::default();
        let homography = calib3d::find_homography(&left, &right, &mut mask, calib3d::RANSAC, threshold)?;
        if homography.empty() {
            return Ok(None);
        }
        let homography = cv::matrix3_from_mat(&homography)?;
        // Counted anew: OpenCV's mask is that of four noisy points, before its own refinement.
        let agrees = |ray: &PointPair| {
            let moved = homography * ray.left.push(1.0);
            (moved.xy() / moved.z - ray.right).norm() <= threshold
        };
        let agreeing = view.iter().filter(|&&i| agrees(&rays[i])).count();
        if (agreeing as f64) < SHARE_MIN * view.len() as f64 {
            return Ok(None);
        }
        found.push(homography);
    }
    Ok((!found.is_empty()).then_some(found))
}

/// All poses in the first and the last homography (Malis and Vargas 2007, as OpenCV has it).
pub(super) fn poses(homographies: &[Matrix3<f64>]) -> opencv::Result<Vec<Pose>> {
    let identity = cv::mat_from_matrix3(&Matrix3::identity())?;
    let mut poses = Vec::new();
    let ends = [homographies.first(), homographies.last().filter(|_| homographies.len() > 1)];
    for homography in ends.into_iter().flatten() {
        let (mut rotations, mut translations, mut normals) = (Vector::<Mat>::new(), Vector::<Mat>::new(), Vector::<Mat>::new());
        calib3d::decompose_homography_mat(
            &cv::mat_from_matrix3(homography)?,
            &identity,
            &mut rotations,
            &mut translations,
            &mut normals,
        )?;
        for (rotation, translation) in rotations.iter().zip(&translations) {
            let t = cv::vector3_from_mat(&translation)?;
            let sound = t.norm() > 1e-9 && t.iter().all(|number| number.is_finite());
            if sound {
                poses.push(Pose::new(cv::matrix3_from_mat(&rotation)?, t.normalize()));
            }
        }
    }
    Ok(poses)
}
