//! Two views and what their points say about each other (thesis 4.4, 4.5, 4.7).
//!
//! # Conventions
//! F and E take left points to lines on the right: p_rᵀ F p_l = 0 (4-1), in pixels, and p̂_rᵀ E p̂_l = 0 (4-6), in normalised
//! coordinates (x/z, y/z). X_right = R X_left + t, where t has length 1 until something gives it a scale.

mod essential;
mod fundamental;
mod hartley;
mod ransac;
mod rays;
mod triangulate;

pub use essential::{RelativePose, essential_from_fundamental, essential_from_pose, five_point, pose_from_essential};
pub use fundamental::{eight_point, sampson_px2};
pub use hartley::{HartleyError, Homographies, rectify_from_matches};
use nalgebra::Vector2;
pub use ransac::{Consensus, RansacSettings, find_fundamental};
pub use rays::{Rays, pixels_without_distortion};
pub use triangulate::{projection_matrices, triangulate};

#[cfg(test)]
mod tests;

/// The same point of the scene, seen twice: in pixels or in normalised coordinates, as the function says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointPair {
    /// In the left picture.
    pub left: Vector2<f64>,
    /// In the right picture.
    pub right: Vector2<f64>,
}

/// Why the views' geometry is not known.
#[derive(Debug, thiserror::Error)]
pub enum EpipolarError {
    /// Too few matches.
    #[error("{points} matches are too few: at least {needed} are needed")]
    TooFew {
        /// What there is.
        points: usize,
        /// What is needed.
        needed: usize,
    },
    /// Matches that leave more than one answer: all in one plane, on one line, or without a baseline.
    #[error("the matches leave the geometry open: they lie in one plane, or the two pictures were taken from one place")]
    Degenerate,
    /// No geometry that enough matches agree on.
    #[error("only {inliers} of {points} matches agree on one geometry: at least {needed} must")]
    NoConsensus {
        /// The most that agree.
        inliers: usize,
        /// Matches.
        points: usize,
        /// What is needed.
        needed: usize,
    },
    /// OpenCV failed.
    #[error("OpenCV failed while finding the geometry of two views")]
    OpenCv(#[from] opencv::Error),
}
