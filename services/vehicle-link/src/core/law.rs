//! Guidance laws: how a follower's place is worked out from what is heard of its leader. All but the default are kept for
//! comparison; `experiment` flies them side by side.

use halcyon_model::{Slot, Stamp};
use nalgebra::{Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use super::guidance::slot_motion;
use super::track::{Motion, Track};

/// A guidance law (`vehicle_link.guidance.law`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// The thesis's quadratic for a place abreast (6-1 … 6-8), position only, from the leader's last state as it is. Within 1° of
    /// 90° and 270° the heading is replaced by one that is 1° away, as the thesis does. Knows no place ahead or behind.
    ThesisQuadratic,
    /// The slot of the leader's last state as it is, position only.
    PositionOnly,
    /// The same with its velocity fed forward.
    PositionVelocity,
    /// Extrapolated to now by the state's age, velocity and acceleration fed forward; acceleration and yaw rate by filtered
    /// differences.
    PositionVelocityAcceleration,
    /// Extrapolated to now: towards the leader's own setpoint where it says it, else with acceleration and jerk by its lean. The
    /// follower's own lag is made up for.
    #[default]
    Halcyon,
}

/// What the slot turns with (`vehicle_link.guidance.slot_lock`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SlotLock {
    /// With the leader's heading: forward is where it looks.
    #[default]
    Heading,
    /// With nothing: forward is north, right is east.
    North,
}

/// Where the follower should be at `now`, by this law, `ahead_s` later. What a law doesn't feed forward is zero.
#[must_use]
pub fn aim(law: Law, lock: SlotLock, track: &Track, slot: &Slot, now: Stamp, ahead_s: f64) -> Motion {
    let place = |leader: Motion| match lock {
        SlotLock::Heading => slot_motion(&leader, slot),
        SlotLock::North => {
            let north = slot_motion(&Motion { heading_rad: 0.0, yaw_rate_radps: 0.0, ..leader }, slot);
            Motion { heading_rad: leader.heading_rad, yaw_rate_radps: leader.yaw_rate_radps, ..north }
        }
    };
    let none = Vector3::zeros();
    match law {
        Law::ThesisQuadratic => {
            let leader = track.as_heard();
            let heading_rad = if lock == SlotLock::North { 0.0 } else { leader.heading_rad };
            let position_ned_m = quadratic_place(leader.position_ned_m, heading_rad, slot);
            Motion { position_ned_m, velocity_ned_mps: none, acceleration_ned_mps2: none, jerk_ned_mps3: none, ..leader }
        }
        Law::PositionOnly => {
            let slot = place(track.as_heard());
            Motion { velocity_ned_mps: none, acceleration_ned_mps2: none, jerk_ned_mps3: none, ..slot }
        }
        Law::PositionVelocity => Motion { acceleration_ned_mps2: none, jerk_ned_mps3: none, ..place(track.as_heard()) },
        Law::PositionVelocityAcceleration => {
            Motion { jerk_ned_mps3: none, ..place(track.predict_by_differences(now, ahead_s)) }
        }
        Law::Halcyon => place(track.predict(now, ahead_s)),
    }
}

/// The thesis's place for the follower. Its x axis points east and its y axis south, so that the separation line, a quarter turn
/// clockwise from the heading H, is inclined by φ = H (6-2).
fn quadratic_place(leader_ned_m: Vector3<f64>, heading_rad: f64, slot: &Slot) -> Vector3<f64> {
    let separation_m = slot.right_m.abs();
    let heading_deg = away_from_singularity_deg(heading_rad.to_degrees().rem_euclid(360.0));
    let (x1_m, y1_m) = (leader_ned_m.y, -leader_ned_m.x);
    let tan = heading_deg.to_radians().tan();
    // (6-4), (6-5). As printed, (6-6) has lost a factor β under its root.
    let beta = 1.0 + tan * tan;
    let (a, b, c) = (beta, -2.0 * x1_m * beta, x1_m * x1_m * beta - separation_m * separation_m);
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    let to_the_right = slot.right_m >= 0.0;
    let front = heading_deg <= 90.0 || heading_deg >= 270.0;
    let x2_m = if front == to_the_right { (-b + root) / (2.0 * a) } else { (-b - root) / (2.0 * a) };
    // (6-7), (6-8); the slot's own height is ours.
    let y2_m = (x2_m - x1_m) * tan + y1_m;
    Vector3::new(-y2_m, x2_m, leader_ned_m.z - slot.up_m)
}

/// "Reject H which gave rise to mathematically undefined solutions and select H (±1°)" (§6.7.2).
fn away_from_singularity_deg(heading_deg: f64) -> f64 {
    for singular_deg in [90.0, 270.0] {
        if (heading_deg - singular_deg).abs() < 1.0 {
            return if heading_deg <= singular_deg { singular_deg - 1.0 } else { singular_deg + 1.0 };
        }
    }
    heading_deg
}

/// Turns a slot's offset into north, east, down for a heading in radians.
#[must_use]
pub fn offset_ned_m(slot: &Slot, heading_rad: f64) -> Vector3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), heading_rad) * Vector3::new(slot.forward_m, slot.right_m, -slot.up_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (6-1): the distance is S. (6-2): the line is at right angles to the heading, but for the degree that the thesis gives up at
    /// its singularities; the right side stays the right side.
    #[test]
    fn the_quadratics_place_is_abreast_and_off_by_a_degree_where_it_is_singular() {
        let leader = Vector3::new(12.0, -7.0, -6.0);
        for right_m in [5.0, -7.0] {
            let slot = Slot { forward_m: 0.0, right_m, up_m: 0.0 };
            for tenth_deg in 0..3600 {
                let heading_deg = f64::from(tenth_deg) * 0.1;
                let place = quadratic_place(leader, heading_deg.to_radians(), &slot);
                let true_place = leader + offset_ned_m(&slot, heading_deg.to_radians());
                assert!(((place - leader).norm() - right_m.abs()).abs() < 1e-6, "{heading_deg}");
                let miss_m = (place - true_place).norm();
                let singular = (heading_deg - 90.0).abs() < 1.0 - 1e-9 || (heading_deg - 270.0).abs() < 1.0 - 1e-9;
                let most_m = if singular { right_m.abs() * 1.001f64.to_radians() } else { 1e-6 };
                assert!(miss_m <= most_m, "{heading_deg}: {miss_m}");
            }
            let at_singularity = quadratic_place(leader, 90.0f64.to_radians(), &slot);
            let miss_m = (at_singularity - leader - offset_ned_m(&slot, 90.0f64.to_radians())).norm();
            // The chord of one degree.
            assert!((miss_m - 2.0 * right_m.abs() * 0.5f64.to_radians().sin()).abs() < 1e-6, "{miss_m}");
        }
    }

    #[test]
    fn laws_and_locks_have_their_names_and_others_are_refused() {
        let law = |name: &str| Law::deserialize(serde::de::value::StrDeserializer::<serde::de::value::Error>::new(name));
        assert_eq!(law("thesis_quadratic"), Ok(Law::ThesisQuadratic));
        assert_eq!(law("position_only"), Ok(Law::PositionOnly));
        assert_eq!(law("position_velocity"), Ok(Law::PositionVelocity));
        assert_eq!(law("position_velocity_acceleration"), Ok(Law::PositionVelocityAcceleration));
        assert_eq!(law("halcyon"), Ok(Law::default()));
        assert!(law("thesis").unwrap_err().to_string().contains("thesis_quadratic"));
    }
}
