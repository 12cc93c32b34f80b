//! The point cloud of a pair (thesis 4-22, figs. 4-20, 4-25, 5-9, 5-16, 7-6 a): every match that belongs to the water,
//! triangulated, with its standard deviation and its grey level.

use nalgebra::Vector3;
use opencv::core::{Mat, MatTraitConst, MatTraitConstManual};

use super::disparity::Disparity;
use super::plane::Match;
use super::reconstruct::WorldFromRectified;
use super::rectify::RectifiedRig;

/// What the axes of a cloud or mesh stand for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CloudFrame {
    /// x east, y north, z up from the local frame's origin, by the autopilot's attitude and height.
    Gravity,
    /// z up from the fitted mean water plane, y towards the top of the rectified left picture, x to its right; the origin is
    /// the point on the water next to the left camera.
    Plane,
}

impl CloudFrame {
    /// For headers and reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Gravity => "gravity",
            Self::Plane => "plane",
        }
    }

    /// One line for people: axes and origin.
    #[must_use]
    pub fn describe(self) -> &'static str {
        match self {
            Self::Gravity => "x east, y north, z up from the local origin, gravity-aligned by the autopilot",
            Self::Plane => "x right, y to the top of the picture, z up from the fitted mean water plane",
        }
    }
}

/// One point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPoint {
    /// Place in the cloud's frame, metres.
    pub at_m: Vector3<f64>,
    /// One standard deviation of the vertical coordinate, metres.
    pub sigma_m: f32,
    /// Grey level of the rectified left picture.
    pub grey: u8,
    /// Its pixel of the rectified left picture, column and row.
    pub pixel: (u32, u32),
}

/// A cloud: points in rows of the rectified left picture, top to bottom, each row left to right.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCloud {
    /// The axes.
    pub frame: CloudFrame,
    /// The points.
    pub points: Vec<CloudPoint>,
}

/// Triangulates `matches` (in pixel order; outliers already gone) in closed form and turns them into the world.
///
/// A disparity error sigma moves a point along its ray by depth² / (f b) · sigma times the ray's length; `sigma_m` is the
/// vertical share of that. `left` is the rectified left picture, 8-bit.
///
/// # Errors
/// OpenCV's, where `left` is no 8-bit picture. A match outside `left` gets grey level 0.
pub fn point_cloud(
    matches: &[Match],
    rig: &RectifiedRig,
    world: &WorldFromRectified,
    frame: CloudFrame,
    left: &Mat,
) -> opencv::Result<PointCloud> {
    let (grey, width) = (left.data_typed::<u8>()?, left.cols() as usize);
    let focal_baseline = rig.focal_px * rig.baseline_m;
    let point = |m: &Match| {
        let disparity_px = f64::from(m.disparity_px);
        let ray = world.rotation * rig.ray(f64::from(m.x_px), f64::from(m.y_px));
        let depth_m = focal_baseline / disparity_px;
        let ned_m = ray * depth_m + world.origin_ned_m;
        let sigma_m = f64::from(m.sigma_px) * depth_m / disparity_px * ray.z.abs();
        let pixel = (m.x_px.round() as u32, m.y_px.round() as u32);
        CloudPoint {
            at_m: Vector3::new(ned_m.y, ned_m.x, -ned_m.z),
            sigma_m: sigma_m as f32,
            grey: grey.get(pixel.1 as usize * width + pixel.0 as usize).copied().unwrap_or(0),
            pixel,
        }
    };
    Ok(PointCloud { frame, points: matches.iter().map(point).collect() })
}

/// Every `stride_px`-th pixel with a disparity as a match, cleaned of nothing: for scenes that are no water (figs. 4-24, 4-25),
/// and for counting. All get the same `sigma_px`.
#[must_use]
pub fn all_matches(disparity: &Disparity, sigma_px: f32, stride_px: u32) -> Vec<Match> {
    let step = stride_px.max(1) as usize;
    let mut matches = Vec::new();
    for y in (0..disparity.height_px).step_by(step) {
        let row = disparity.row(y).iter().enumerate().step_by(step);
        // At infinity and beyond there is no point; comparisons with NaN are false.
        matches.extend(row.filter(|(_, disparity_px)| **disparity_px > 0.0).map(|(x, disparity_px)| Match {
            x_px: x as f32,
            y_px: y as f32,
            disparity_px: *disparity_px,
            sigma_px,
        }));
    }
    matches
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_matches_are_those_with_a_disparity() {
        let values_px = vec![1.0, f32::NAN, 2.0, 0.0, 3.0, -1.0, 4.0, f32::NAN, 5.0];
        let disparity = Disparity { width_px: 3, height_px: 3, values_px };
        let of = |stride| all_matches(&disparity, 0.1, stride).iter().map(|m| m.disparity_px).collect::<Vec<_>>();
        assert_eq!((of(1), of(2)), (vec![1.0, 2.0, 3.0, 4.0, 5.0], vec![1.0, 2.0, 4.0, 5.0]));
    }
    use nalgebra::Matrix3;

    const RIG: RectifiedRig = RectifiedRig {
        width_px: 320,
        height_px: 240,
        focal_px: 400.0,
        cx_px: 160.0,
        cy_px: 120.0,
        baseline_m: 0.5,
        camera_from_rectified: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    };

    /// By hand: f b = 200, disparity 40 → 5 m deep; 80 px right of the middle is 1 m to the right, 40 px up is 0.5 m up in the
    /// picture. Depth noise: 25 m² / 200 px m · 0.1 px = 12.5 mm.
    #[test]
    fn a_point_by_hand() {
        let plane = halcyon_model::Plane { normal: Vector3::z(), distance_m: 5.2, rms_m: 0.0 };
        let world = WorldFromRectified::from_plane(&plane);
        let left = Mat::new_rows_cols_with_default(240, 320, opencv::core::CV_8UC1, opencv::core::Scalar::all(77.0)).unwrap();
        let m = Match { x_px: 240.0, y_px: 80.0, disparity_px: 40.0, sigma_px: 0.1 };
        let cloud = point_cloud(&[m], &RIG, &world, CloudFrame::Plane, &left).unwrap();
        let point = cloud.points[0];
        assert!((point.at_m - Vector3::new(1.0, 0.5, 0.2)).norm() < 1e-12, "{}", point.at_m);
        assert!((point.sigma_m - 0.0125).abs() < 1e-7);
        assert_eq!((point.grey, point.pixel), (77, (240, 80)));
    }
}
