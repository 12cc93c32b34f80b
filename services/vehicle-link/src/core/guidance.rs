//! Where a follower should be, and a smooth way there.
//!
//! The slot is given in the leader's heading frame (forward, right, up); line abreast at separation S is the thesis's
//! (6-1 … 6-8), without its singularity at 90° and 270° since the frame is rotated, not solved for.

use nalgebra::Vector3;

use halcyon_model::{Intent, Slot, Stamp};
use serde::{Deserialize, Serialize};

use super::inverse::Loops;
use super::law::{Law, SlotLock};
use super::limits::Limits;
use super::track::Motion;

/// What the autopilot is asked to follow: position with velocity and acceleration feed-forward, in the fleet's local frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// Position, metres north, east, down of the fleet's origin.
    pub position_ned_m: Vector3<f64>,
    /// Velocity feed-forward, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
    /// Acceleration feed-forward, metres per second squared; `None` leaves it to the autopilot.
    pub acceleration_ned_mps2: Option<Vector3<f64>>,
    /// Heading, radians clockwise from north; `None` leaves it.
    pub heading_rad: Option<f64>,
}

impl Setpoint {
    /// Height above mean water, metres.
    #[must_use]
    pub fn height_m(&self) -> f64 {
        -self.position_ned_m.z
    }

    /// For those who follow.
    #[must_use]
    pub fn intent(&self, stamp: Stamp) -> Intent {
        Intent {
            stamp,
            position_ned_m: self.position_ned_m,
            velocity_ned_mps: self.velocity_ned_mps,
            acceleration_ned_mps2: self.acceleration_ned_mps2.unwrap_or_default(),
        }
    }
}

/// How slots are kept (`[vehicle_link.guidance]`).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Guidance {
    /// The law: `halcyon`, or for comparison `thesis_quadratic`, `position_only`, `position_velocity`,
    /// `position_velocity_acceleration`.
    pub law: Law,
    /// What slots turn with: `heading` (the leader's; forward is where it looks) or `north` (nothing; forward is north).
    pub slot_lock: SlotLock,
    /// What is believed of this vehicle's autopilot.
    pub loops: Loops,
}

/// Where the slot is and how it moves: the leader's motion plus, when the leader turns, the slot's swing ω × r, its centripetal
/// acceleration ω × (ω × r) and the jerk of that. The change of the turn rate is not known and left out.
#[must_use]
pub fn slot_motion(leader: &Motion, slot: &Slot) -> Motion {
    let offset_ned_m = super::law::offset_ned_m(slot, leader.heading_rad);
    let turn_radps = Vector3::new(0.0, 0.0, leader.yaw_rate_radps);
    let swing_ned_mps = turn_radps.cross(&offset_ned_m);
    let inward_ned_mps2 = turn_radps.cross(&swing_ned_mps);
    Motion {
        position_ned_m: leader.position_ned_m + offset_ned_m,
        velocity_ned_mps: leader.velocity_ned_mps + swing_ned_mps,
        acceleration_ned_mps2: leader.acceleration_ned_mps2 + inward_ned_mps2,
        jerk_ned_mps3: leader.jerk_ned_mps3 + turn_radps.cross(&inward_ned_mps2),
        ..*leader
    }
}

/// Speed at which to approach something `distance_m` away so that braking at `deceleration_mps2` just suffices, with a linear
/// law of gain `gain_hz` near the end where the square root would be too steep.
#[must_use]
pub fn approach_speed_mps(distance_m: f64, gain_hz: f64, deceleration_mps2: f64) -> f64 {
    let linear_m = deceleration_mps2 / (gain_hz * gain_hz);
    if distance_m <= linear_m { gain_hz * distance_m } else { (2.0 * deceleration_mps2 * (distance_m - 0.5 * linear_m)).sqrt() }
}

/// A goal of one guidance step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Target {
    /// Position, fleet-local, metres.
    pub position_ned_m: Vector3<f64>,
    /// Its own velocity, metres per second: zero for a fixed place.
    pub velocity_ned_mps: Vector3<f64>,
    /// Downward speed limit, metres per second.
    pub descent_mps: f64,
    /// Change limit of the reference's velocity, metres per second squared.
    pub acceleration_mps2: f64,
    /// Gain of the final approach, 1/s.
    pub gain_hz: f64,
}

/// Gain of the final approach to a place, and to a slot, 1/s.
pub const PLACE_GAIN_HZ: f64 = 1.0;
/// See [`PLACE_GAIN_HZ`].
pub const SLOT_GAIN_HZ: f64 = 1.5;
/// The reference never runs further ahead of the vehicle than this, metres.
const LEASH_M: f64 = 3.0;

/// The moving reference that becomes the setpoint. Its velocity is limited in size and change, so that every setpoint is
/// flyable and the separation filter has the last word on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reference {
    /// Position, metres.
    pub position_ned_m: Vector3<f64>,
    /// Velocity, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
}

impl Reference {
    /// The velocity that goes for `target`, before separation.
    #[must_use]
    pub fn wanted_mps(&self, target: &Target, limits: &Limits, dt_s: f64) -> Vector3<f64> {
        let error_m = target.position_ned_m - self.position_ned_m;
        let across_m = Vector3::new(error_m.x, error_m.y, 0.0);
        let distance_m = across_m.norm();
        // Braking is planned softer than the limit, so that the change limit below doesn't make it overshoot.
        let closing_mps = approach_speed_mps(distance_m, target.gain_hz, 0.7 * limits.acceleration_mps2).min(limits.cruise_mps);
        let mut wanted = target.velocity_ned_mps;
        if distance_m > 1e-9 {
            wanted += across_m * (closing_mps / distance_m);
        }
        let vertical_mps =
            approach_speed_mps(error_m.z.abs(), target.gain_hz, 0.5 * limits.acceleration_mps2) * error_m.z.signum();
        wanted.z += vertical_mps;
        limit_velocity(&mut wanted, limits, target.descent_mps);
        // Change limit.
        let change = wanted - self.velocity_ned_mps;
        let change_max_mps = target.acceleration_mps2 * dt_s;
        if change.norm() > change_max_mps { self.velocity_ned_mps + change * (change_max_mps / change.norm()) } else { wanted }
    }

    /// Moves on by `dt_s` at `velocity`, leashed to where the vehicle is.
    pub fn advance(&mut self, velocity_ned_mps: Vector3<f64>, own_position_ned_m: Vector3<f64>, dt_s: f64) {
        self.velocity_ned_mps = velocity_ned_mps;
        self.position_ned_m += velocity_ned_mps * dt_s;
        let lead_m = self.position_ned_m - own_position_ned_m;
        if lead_m.norm() > LEASH_M {
            self.position_ned_m = own_position_ned_m + lead_m * (LEASH_M / lead_m.norm());
        }
    }
}

/// Clamps horizontal and vertical speed.
pub fn limit_velocity(velocity_ned_mps: &mut Vector3<f64>, limits: &Limits, descent_mps: f64) {
    let across_mps = velocity_ned_mps.xy().norm();
    if across_mps > limits.speed_mps_max {
        let scale = limits.speed_mps_max / across_mps;
        velocity_ned_mps.x *= scale;
        velocity_ned_mps.y *= scale;
    }
    velocity_ned_mps.z = velocity_ned_mps.z.clamp(-limits.climb_mps, descent_mps);
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;
    use std::f64::consts::{PI, TAU};

    fn leader(heading_rad: f64) -> Motion {
        Motion {
            position_ned_m: Vector3::new(10.0, -4.0, -6.0),
            velocity_ned_mps: Vector3::new(1.0, 0.5, -0.1),
            acceleration_ned_mps2: Vector3::zeros(),
            jerk_ned_mps3: Vector3::zeros(),
            heading_rad,
            yaw_rate_radps: 0.3,
        }
    }

    /// The thesis's closed form (6-6, 6-7) where it isn't singular: x2 = x1 ± S cos φ, y2 = y1 + (x2 − x1) tan φ, with φ the
    /// inclination of the separation line, here across the heading.
    #[test]
    fn line_abreast_is_the_thesiss_place() {
        for heading_deg in [0.0f64, 30.0, 60.0, 120.0, 200.0, 300.0] {
            let heading_rad = heading_deg.to_radians();
            let leader = leader(heading_rad);
            let slot = slot_motion(&leader, &Slot { forward_m: 0.0, right_m: 7.0, up_m: 0.0 });
            let delta = slot.position_ned_m - leader.position_ned_m;
            // (6-1) the distance is S, (6-8) the height is the leader's, and the line is orthogonal to the heading.
            assert_relative_eq!(delta.xy().norm(), 7.0, epsilon = 1e-12);
            assert_relative_eq!(delta.z, 0.0);
            assert_relative_eq!(delta.x * heading_rad.cos() + delta.y * heading_rad.sin(), 0.0, epsilon = 1e-12);
            // To the right: the heading turned clockwise by a right angle.
            assert_relative_eq!(
                delta.y.atan2(delta.x).rem_euclid(2.0 * PI),
                (heading_rad + PI / 2.0).rem_euclid(2.0 * PI),
                epsilon = 1e-9
            );
        }
    }

    proptest! {
        /// The slot's velocity is the time derivative of its position, for a leader on a circle.
        #[test]
        fn slot_velocity_is_the_derivative(heading in 0.0f64..TAU, rate in -1.0f64..1.0, f in -9.0f64..9.0, r in -9.0f64..9.0) {
            let slot = Slot { forward_m: f, right_m: r, up_m: 1.0 };
            let at = |t: f64| {
                let leader = Motion {
                    position_ned_m: Vector3::new(2.0, 1.0, -5.0) * t,
                    velocity_ned_mps: Vector3::new(2.0, 1.0, -5.0),
                    acceleration_ned_mps2: Vector3::zeros(),
                    jerk_ned_mps3: Vector3::zeros(),
                    heading_rad: heading + rate * t,
                    yaw_rate_radps: rate,
                };
                slot_motion(&leader, &slot)
            };
            let h = 1e-5;
            let numeric = (at(h).position_ned_m - at(-h).position_ned_m) / (2.0 * h);
            prop_assert!((numeric - at(0.0).velocity_ned_mps).norm() < 1e-6);
            // Each derivative is that of the one before it, through every heading.
            let numeric = (at(h).velocity_ned_mps - at(-h).velocity_ned_mps) / (2.0 * h);
            prop_assert!((numeric - at(0.0).acceleration_ned_mps2).norm() < 1e-6);
            let numeric = (at(h).acceleration_ned_mps2 - at(-h).acceleration_ned_mps2) / (2.0 * h);
            prop_assert!((numeric - at(0.0).jerk_ned_mps3).norm() < 1e-6);
        }
    }

    /// A slot that swings round a standing leader flies a circle: v²/r, towards the leader.
    #[test]
    fn a_turning_leaders_slot_is_drawn_inwards_by_v_squared_over_r() {
        for heading_deg in [0.0f64, 89.9, 90.0, 180.0, 270.0, 359.9] {
            let standing = Motion { velocity_ned_mps: Vector3::zeros(), ..leader(heading_deg.to_radians()) };
            let slot = slot_motion(&standing, &Slot { forward_m: 3.0, right_m: -4.0, up_m: 0.0 });
            let speed_mps = slot.velocity_ned_mps.norm();
            assert_relative_eq!(speed_mps, 0.3 * 5.0, epsilon = 1e-12);
            let inward = (standing.position_ned_m - slot.position_ned_m) / 5.0;
            assert_relative_eq!(slot.acceleration_ned_mps2, inward * (speed_mps * speed_mps / 5.0), epsilon = 1e-12);
        }
    }

    #[test]
    fn the_reference_arrives_without_overshoot_and_within_its_limits() {
        let limits = Limits::default();
        let mut reference = Reference { position_ned_m: Vector3::new(0.0, 0.0, -5.0), velocity_ned_mps: Vector3::zeros() };
        let goal = Vector3::new(60.0, 0.0, -8.0);
        let target = Target {
            position_ned_m: goal,
            velocity_ned_mps: Vector3::zeros(),
            descent_mps: 0.5,
            acceleration_mps2: 1.5,
            gain_hz: 1.0,
        };
        for _ in 0..400 {
            let before = reference.velocity_ned_mps;
            let velocity = reference.wanted_mps(&target, &limits, 0.1);
            assert!((velocity - before).norm() <= limits.acceleration_mps2 * 0.1 + 1e-9);
            assert!(velocity.xy().norm() <= limits.cruise_mps + 1e-9 && velocity.z.abs() <= limits.climb_mps + 1e-9);
            let own = reference.position_ned_m;
            reference.advance(velocity, own, 0.1);
            assert!(reference.position_ned_m.x < 60.3, "{}", reference.position_ned_m.x);
        }
        assert!((reference.position_ned_m - goal).norm() < 0.05, "{}", reference.position_ned_m);
    }
}
