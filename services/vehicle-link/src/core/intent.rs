//! What a leader's own setpoint tells of its next moments.
//!
//! A lean tells of a corner once the vehicle leans; the setpoint tells of it before. From the state, the leader's autopilot is
//! followed as it goes for the setpoint: velocity error to acceleration, limited in size and in change as ArduCopter shapes it,
//! and then the lean's own lag. Over the tenths of a second that a state is old, being wrong about another's gains by a third
//! costs millimetres.

use halcyon_model::{Intent, VehicleState};
use nalgebra::Vector3;

use super::observer::LEAN_S;
use super::track::Motion;

/// Shaping on ArduCopter: velocity error to acceleration, 1/s; greatest acceleration, metres per second squared; greatest jerk,
/// metres per second cubed (PSC_JERK_XY's order; PSC_JERK_NE since 4.7).
const SHAPE_HZ: f64 = 3.0;
const ACCELERATION_MPS2_MAX: f64 = 2.5;
const JERK_MPS3_MAX: f64 = 8.0;
/// Position error to velocity, 1/s, and the fastest that is asked for to close it, metres per second.
const POSITION_GAIN_HZ: f64 = 1.0;
const CLOSING_MPS_MAX: f64 = 2.0;
/// Steps of the integration, seconds.
const STEP_S: f64 = 0.02;

/// An intent is not believed if it is for a moment further than this from the state's, seconds; ends further than this from where
/// the vehicle is, metres; asks for a velocity further than this from its own, metres per second; or for more acceleration than
/// anything that leads others, metres per second squared.
const APART_S_MAX: f64 = 0.5;
const APART_M_MAX: f64 = 4.0;
const APART_MPS_MAX: f64 = 6.0;
const FEED_MPS2_MAX: f64 = 6.0;

/// The intent of a state, if the vehicle's own motion bears it out.
#[must_use]
pub fn plausible(state: &VehicleState) -> Option<&Intent> {
    let intent = state.intent.as_ref()?;
    let late_s = state.stamp.seconds_since(intent.stamp);
    let place_m = intent.position_ned_m + intent.velocity_ned_mps * late_s;
    // NaN is never within.
    let borne_out = late_s.abs() <= APART_S_MAX
        && (place_m - state.position_ned_m).norm() <= APART_M_MAX
        && (intent.velocity_ned_mps - state.velocity_ned_mps).norm() <= APART_MPS_MAX
        && intent.acceleration_ned_mps2.norm() <= FEED_MPS2_MAX;
    borne_out.then_some(intent)
}

/// How `state` goes on for `dt_s` towards `intent`, with what is observed of it now: acceleration, jerk, yaw rate. `place_ned_m` is
/// where it is believed to be.
#[must_use]
pub fn carried_on(state: &VehicleState, observed: &Motion, intent: &Intent, dt_s: f64) -> Motion {
    let late_s = state.stamp.seconds_since(intent.stamp);
    // In the frame of where it is believed to be.
    let shift_m = observed.position_ned_m - state.position_ned_m;
    let mut target_m =
        intent.position_ned_m + shift_m + (intent.velocity_ned_mps + intent.acceleration_ned_mps2 * (0.5 * late_s)) * late_s;
    let mut target_mps = intent.velocity_ned_mps + intent.acceleration_ned_mps2 * late_s;
    let level = |v: Vector3<f64>| Vector3::new(v.x, v.y, 0.0);
    let feed_mps2 = level(intent.acceleration_ned_mps2);
    let (mut place_m, mut velocity_mps) = (observed.position_ned_m, observed.velocity_ned_mps);
    let mut lean_mps2 = observed.acceleration_ned_mps2;
    // The demand is ahead of the lean by the lean's lag.
    let mut demand_mps2 = observed.acceleration_ned_mps2 + observed.jerk_ned_mps3 * LEAN_S;
    let steps = (dt_s / STEP_S).ceil().clamp(1.0, 100.0);
    let h_s = dt_s / steps;
    for _ in 0..steps as usize {
        let closing_mps = level((target_m - place_m) * POSITION_GAIN_HZ).cap_magnitude(CLOSING_MPS_MAX);
        // What it will have when the lean has caught up is what the autopilot's own desired motion has now.
        let desired_mps = velocity_mps + (demand_mps2 - lean_mps2) * LEAN_S;
        let wanted_mps2 =
            (level(target_mps + closing_mps - desired_mps) * SHAPE_HZ).cap_magnitude(ACCELERATION_MPS2_MAX) + feed_mps2;
        demand_mps2 += (wanted_mps2 - demand_mps2).cap_magnitude(JERK_MPS3_MAX * h_s);
        lean_mps2 += (demand_mps2 - lean_mps2) * (h_s / (LEAN_S + h_s));
        place_m += velocity_mps * h_s + lean_mps2 * (0.5 * h_s * h_s);
        velocity_mps += lean_mps2 * h_s;
        target_mps += feed_mps2 * h_s;
        target_m += target_mps * h_s;
    }
    Motion {
        position_ned_m: place_m,
        velocity_ned_mps: velocity_mps,
        acceleration_ned_mps2: lean_mps2,
        jerk_ned_mps3: (demand_mps2 - lean_mps2) / LEAN_S,
        heading_rad: (observed.heading_rad + observed.yaw_rate_radps * dt_s).rem_euclid(std::f64::consts::TAU),
        yaw_rate_radps: observed.yaw_rate_radps,
    }
}

#[cfg(test)]
mod tests {
    use halcyon_model::Stamp;
    use nalgebra::UnitQuaternion;

    use super::*;
    use crate::core::track::Track;
    use crate::core::track::tests::{state, t};

    const GRAVITY_MPS2: f64 = 9.806_65;

    fn intent(stamp: Stamp, position_ned_m: Vector3<f64>, velocity_ned_mps: Vector3<f64>) -> Intent {
        Intent { stamp, position_ned_m, velocity_ned_mps, acceleration_ned_mps2: Vector3::zeros() }
    }

    #[test]
    fn an_intent_that_is_old_far_off_or_no_number_changes_nothing() {
        let flying = VehicleState { velocity_ned_mps: Vector3::new(3.0, 0.0, 0.0), ..state(t(0.0), 2.0) };
        let here_m = flying.position_ned_m;
        let good = intent(t(0.0), here_m, Vector3::new(0.0, 3.0, 0.0));
        let plain = Track::new(flying.clone(), t(0.0)).predict(t(0.2), 0.0);
        let with = |intent: Intent| {
            let flying = VehicleState { intent: Some(intent), ..flying.clone() };
            Track::new(flying, t(0.0)).predict(t(0.2), 0.0)
        };
        assert_ne!(with(good), plain);
        let bad = [
            Intent { stamp: t(-0.6), ..good },
            Intent { stamp: t(0.6), ..good },
            Intent { position_ned_m: here_m + Vector3::new(0.0, 4.1, 0.0), ..good },
            Intent { position_ned_m: Vector3::new(f64::NAN, 0.0, 0.0), ..good },
            Intent { velocity_ned_mps: Vector3::new(0.0, 6.0, 0.0), ..good },
            Intent { velocity_ned_mps: Vector3::new(0.0, f64::NAN, 0.0), ..good },
            Intent { acceleration_ned_mps2: Vector3::new(f64::INFINITY, 0.0, 0.0), ..good },
        ];
        for intent in bad {
            assert_eq!(with(intent), plain, "{intent:?}");
        }
    }

    /// Straight on, as it says: nothing to correct.
    #[test]
    fn a_steady_leader_is_carried_on_steadily() {
        let velocity = Vector3::new(2.0, -1.0, 0.0);
        let flying = VehicleState { velocity_ned_mps: velocity, ..state(t(0.0), 2.0) };
        let flying = VehicleState { intent: Some(intent(t(0.0), flying.position_ned_m, velocity)), ..flying };
        let motion = Track::new(flying.clone(), t(0.0)).predict(t(0.3), 0.0);
        assert!((motion.position_ned_m - flying.position_ned_m - velocity * 0.3).norm() < 1e-9);
        assert!((motion.velocity_ned_mps - velocity).norm() < 1e-9 && motion.acceleration_ned_mps2.norm() < 1e-9);
    }

    /// An autopilot written out by itself: a shaped target, a cascade with gains that nobody told, a lag. At a corner the setpoint
    /// changes at once; the vehicle is predicted from its states of before the corner and from that one setpoint.
    #[test]
    fn a_corner_is_seen_coming() {
        for scale in [0.7, 1.0, 1.3] {
            let (dt_s, position_hz, velocity_hz, lag_s) = (0.002, scale, 2.0 * scale, 0.25 / scale);
            let (mut p, mut v, mut a) = (Vector3::zeros(), Vector3::new(3.0, 0.0, 0.0), Vector3::<f64>::zeros());
            let (mut pd, mut vd, mut ad) = (p, v, a);
            let mut track: Option<Track> = None;
            let (mut with, mut without) = (Vec::new(), Vec::new());
            for step in 0..=1150 {
                let time_s = dt_s * f64::from(step);
                let asked = if time_s < 2.0 { Vector3::new(3.0, 0.0, 0.0) } else { Vector3::new(0.0, 3.0, 0.0) };
                // States at 10 Hz up to the corner, the last one with the new setpoint.
                if step % 50 == 0 && time_s <= 2.0 {
                    let up = (a - Vector3::new(0.0, 0.0, GRAVITY_MPS2)).normalize();
                    let lean = UnitQuaternion::rotation_between(&Vector3::new(0.0, 0.0, -1.0), &up).unwrap();
                    let flying =
                        VehicleState { position_ned_m: p, velocity_ned_mps: v, ned_from_body: lean, ..state(t(time_s), 0.0) };
                    let flying = VehicleState { intent: Some(intent(t(time_s), p, asked)), ..flying };
                    match &mut track {
                        Some(track) => track.observe(flying, t(time_s)),
                        None => track = Some(Track::new(flying, t(time_s))),
                    }
                }
                if time_s > 2.15 && step % 50 == 0 {
                    let known = track.clone().unwrap();
                    let mut dumb = known.clone();
                    dumb.state.intent = None;
                    let miss = |track: &Track| {
                        let motion = track.predict(t(time_s), 0.0);
                        ((motion.velocity_ned_mps - v).norm(), (motion.acceleration_ned_mps2 - a).norm())
                    };
                    with.push(miss(&known));
                    without.push(miss(&dumb));
                }
                let wanted = ((asked - vd) * 3.0).cap_magnitude(2.5);
                ad += (wanted - ad).cap_magnitude(8.0 * dt_s);
                vd += ad * dt_s;
                pd += vd * dt_s;
                let demand = ad + (vd + (pd - p) * position_hz - v) * velocity_hz;
                a += (demand - a) * (dt_s / lag_s);
                v += a * dt_s;
                p += v * dt_s;
            }
            assert_eq!(with.len(), 2);
            for ((velocity, acceleration), (dumb_velocity, dumb_acceleration)) in with.into_iter().zip(without) {
                let share = if scale == 1.0 { 0.3 } else { 0.75 };
                assert!(velocity < share * dumb_velocity, "{scale}: {velocity} m/s off, {dumb_velocity} without");
                assert!(
                    acceleration < share * dumb_acceleration,
                    "{scale}: {acceleration} m/s² off, {dumb_acceleration} without"
                );
            }
        }
    }
}
