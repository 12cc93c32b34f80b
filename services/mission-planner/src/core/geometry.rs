//! Where the vehicles of one mission are to each other, horizontally.
//!
//! With the leader's heading h as the axis and the spot as the origin (forward, right), metres:
//!
//! | phase | leader | follower |
//! |---|---|---|
//! | joining | (0, 0) | slot (f, ±a) |
//! | clearing | → (L, 0) | slot (L + f, ±a) |
//! | landing | (L, 0) | (L + f, ±a) → (0, 0) |
//!
//! With L = 10, a = 7, f = 0 the follower passes the leader at no less than L a / √(L² + a²) = 5.73 m.

use halcyon_model::LocalPoint;
use nalgebra::Vector2;

use crate::config::Config;

/// The point `forward_m` ahead and `right_m` to the right of `point`, in the frame of a heading.
#[must_use]
pub fn offset(point: LocalPoint, heading_rad: f64, forward_m: f64, right_m: f64) -> LocalPoint {
    let (sin, cos) = heading_rad.sin_cos();
    LocalPoint::new(point.north_m + forward_m * cos - right_m * sin, point.east_m + forward_m * sin + right_m * cos)
}

/// Heading from `from` to `to`, radians clockwise from north, in [0, 2π); `None` where they are too close for it to mean much.
#[must_use]
pub fn bearing_rad(from: LocalPoint, to: LocalPoint) -> Option<f64> {
    let way = to.vector() - from.vector();
    (way.norm() >= 2.0).then(|| way.y.atan2(way.x).rem_euclid(std::f64::consts::TAU))
}

/// `1` if `place` is to the right of the line through `point` along the heading, else `-1`.
#[must_use]
pub fn side(point: LocalPoint, heading_rad: f64, place: LocalPoint) -> f64 {
    let (sin, cos) = heading_rad.sin_cos();
    let from = place.vector() - point.vector();
    if -from.x * sin + from.y * cos >= 0.0 { 1.0 } else { -1.0 }
}

/// Least distance of `place` from the straight way between `from` and `to`, metres.
#[must_use]
pub fn distance_from_way_m(place: LocalPoint, from: LocalPoint, to: LocalPoint) -> f64 {
    let way: Vector2<f64> = to.vector() - from.vector();
    let length_squared = way.norm_squared();
    let share =
        if length_squared > 0.0 { ((place.vector() - from.vector()).dot(&way) / length_squared).clamp(0.0, 1.0) } else { 0.0 };
    (place.vector() - from.vector() - share * way).norm()
}

/// The least distance between the leader at its stand-off and the follower on its way from the slot to the spot, metres.
#[must_use]
pub fn least_path_distance_m(config: &Config) -> f64 {
    distance_from_way_m(
        LocalPoint::new(config.stand_off_m, 0.0),
        LocalPoint::new(config.stand_off_m + config.slot_forward_m, config.slot_abreast_m),
        LocalPoint::new(0.0, 0.0),
    )
}

/// How far from its spot any vehicle of a mission is placed, metres.
#[must_use]
pub fn reach_m(config: &Config) -> f64 {
    config
        .stand_off_m
        .max((config.stand_off_m + config.slot_forward_m).hypot(config.slot_abreast_m))
        .max(config.slot_forward_m.hypot(config.slot_abreast_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn cardinal_headings() {
        let p = LocalPoint::new(100.0, 50.0);
        let east = offset(p, std::f64::consts::FRAC_PI_2, 10.0, 7.0);
        assert!((east.north_m - 93.0).abs() < 1e-9 && (east.east_m - 60.0).abs() < 1e-9, "{east:?}");
        assert_eq!(bearing_rad(p, LocalPoint::new(100.0, 40.0)), Some(1.5 * std::f64::consts::PI));
        assert_eq!(bearing_rad(p, p), None);
        assert_eq!(side(p, 0.0, LocalPoint::new(0.0, 60.0)), 1.0);
        assert_eq!(side(p, std::f64::consts::PI, LocalPoint::new(0.0, 60.0)), -1.0);
    }

    proptest! {
        /// Walks the follower along its way in small steps, so that the closed form is not what checks itself.
        #[test]
        fn the_leader_is_never_within_separation_of_the_followers_way(
            heading_rad in 0.0f64..std::f64::consts::TAU, n in -2e3f64..2e3, e in -2e3f64..2e3, right in any::<bool>(),
        ) {
            let config = Config::default();
            let spot = LocalPoint::new(n, e);
            let abreast_m = if right { config.slot_abreast_m } else { -config.slot_abreast_m };
            let leader = offset(spot, heading_rad, config.stand_off_m, 0.0);
            let slot = offset(leader, heading_rad, config.slot_forward_m, abreast_m);
            prop_assert!((leader.distance_m(&spot) - 10.0).abs() < 1e-9);
            prop_assert!((leader.distance_m(&slot) - 7.0).abs() < 1e-9);
            let least_m = (0..=1000).map(|i| {
                let s = f64::from(i) / 1000.0;
                let at = LocalPoint::new(slot.north_m + s * (n - slot.north_m), slot.east_m + s * (e - slot.east_m));
                at.distance_m(&leader)
            }).fold(f64::INFINITY, f64::min);
            prop_assert!(least_m >= config.separation_m);
            prop_assert!((least_m - 70.0 / 149f64.sqrt()).abs() < 1e-3, "{}", least_m);
            prop_assert!((distance_from_way_m(leader, slot, spot) - least_m).abs() < 1e-3);
        }
    }
}
