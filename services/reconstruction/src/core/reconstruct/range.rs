//! Which disparities can the water have? Known height and attitude leave a few of hundreds.

use super::world::WorldFromRectified;
use crate::core::matcher::DisparityRange;
use crate::core::rectify::RectifiedRig;

/// The range of disparities at which both cameras see level water at `level_m` ± `margin_m` above the datum; `None` where
/// part of the picture looks above the horizon, or the camera is not above the water.
pub(super) fn expected_range(
    world: &WorldFromRectified,
    rig: &RectifiedRig,
    level_m: f64,
    margin_m: f64,
) -> Option<DisparityRange> {
    let height_m = -world.origin_ned_m.z - level_m;
    let (right_px, bottom_px) = (f64::from(rig.width_px) - 1.0, f64::from(rig.height_px) - 1.0);
    // Disparity of level water is affine in the pixel: its extremes are in the corners.
    let downwards = [(0.0, 0.0), (right_px, 0.0), (0.0, bottom_px), (right_px, bottom_px)]
        .map(|(x_px, y_px)| (world.rotation * rig.ray(x_px, y_px)).z);
    let least = downwards.into_iter().fold(f64::INFINITY, f64::min);
    let most = downwards.into_iter().fold(0.0, f64::max);
    // Negated so that NaN is refused, too.
    if !(height_m > 0.05 && least > 0.1) {
        return None;
    }
    let focal_baseline = rig.focal_px * rig.baseline_m;
    // Close to the water the margin is bounded by a share of the height: the rest of it would be below the camera's chin.
    let nearest_m = (height_m - margin_m).max(0.5 * height_m);
    let min_px = (focal_baseline * least / (height_m + margin_m)).floor();
    let max_px = (focal_baseline * most / nearest_m).ceil();
    (max_px < 2000.0).then_some(DisparityRange { min_px: min_px as u32, max_px: max_px as u32 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix3, Vector3};

    const RIG: RectifiedRig = RectifiedRig {
        width_px: 320,
        height_px: 240,
        focal_px: 343.0,
        cx_px: 159.5,
        cy_px: 119.5,
        baseline_m: 0.4,
        camera_from_rectified: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    };

    #[test]
    fn level_at_five_metres_few_disparities_are_left() {
        let world = WorldFromRectified { rotation: Matrix3::identity(), origin_ned_m: Vector3::new(0.0, 0.0, -5.0) };
        // f b = 137.2: 137.2 / 5.5 = 24.9, 137.2 / 4.5 = 30.5.
        assert_eq!(expected_range(&world, &RIG, 0.0, 0.5), Some(DisparityRange { min_px: 24, max_px: 31 }));
        // The autopilot has wandered: water seen 0.5 m above the datum is nearer.
        assert_eq!(expected_range(&world, &RIG, 0.5, 0.5), Some(DisparityRange { min_px: 27, max_px: 35 }));
    }

    #[test]
    fn on_the_ground_or_towards_the_horizon_nothing_is_known() {
        let ground = WorldFromRectified { rotation: Matrix3::identity(), origin_ned_m: Vector3::zeros() };
        assert_eq!(expected_range(&ground, &RIG, 0.0, 0.5), None);
        let forward = WorldFromRectified {
            rotation: Matrix3::new(0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0),
            origin_ned_m: Vector3::new(0.0, 0.0, -5.0),
        };
        assert_eq!(expected_range(&forward, &RIG, 0.0, 0.5), None);
    }
}
