//! In formation: the slot by the law in force, joined smoothly, kept tightly, and left when the separation filter says so.

use halcyon_model::{Activity, Slot, Stamp, VehicleId};
use nalgebra::Vector3;

use super::flight::Step;
use super::{Executor, Goal, Output};
use crate::core::guidance::{Reference, SLOT_GAIN_HZ, Setpoint, limit_velocity};
use crate::core::law::{self, Law};
use crate::core::separation::{self, Obstacle};
use crate::core::track::{Motion, Track};

/// The reference has joined the slot when it is this near, metres, and this nearly as fast, metres per second. What is left of both
/// then dies away, and every correction of the slot goes through at once.
const JOIN_M: f64 = 1.0;
const JOIN_MPS: f64 = 1.0;
/// So much of the velocity still missing is asked for on top, up to that of so many metres per second: the autopilot's own velocity
/// loop, made a little stiffer. More of it gains nothing, less of it loses 2 cm, and with receivers that wander it costs 1 cm.
const TRIM: f64 = 0.2;
const TRIM_MPS_MAX: f64 = 1.0;
/// The slot is not sent when the vehicle has fallen this far behind it, metres: it approaches afresh.
const LOST_M: f64 = 8.0;
/// The most that is fed forward, metres per second squared: a lean of 27°, within every autopilot's limit.
const FEED_MPS2_MAX: f64 = 5.0;
/// A change of velocity by the separation filter that is more than rounding, metres per second.
const CHANGED_MPS: f64 = 1e-6;

impl Executor {
    /// Keeps the slot. Flown by a place without leaps, which the autopilot's own place has: what is sent is put back into that.
    pub(super) fn follow(&mut self, leader: &VehicleId, slot: &Slot, step: &mut Step) {
        let shift_m = self.continuity.shift_ned_m();
        let before = step.outputs.len();
        step.here_ned_m -= shift_m;
        self.keep_formation(leader, slot, step);
        step.here_ned_m += shift_m;
        for output in step.outputs.iter_mut().skip(before) {
            if let Output::Setpoint(setpoint) = output {
                setpoint.position_ned_m += shift_m;
            }
        }
    }

    fn keep_formation(&mut self, leader: &VehicleId, slot: &Slot, step: &mut Step) {
        let Some(track) = self.neighbours.get(leader) else {
            // The interlock has refused this already; hold all the same.
            self.hold(None, step);
            return self.set(Activity::Following { settled: false, slot_error_m: f64::MAX }, "leader unknown");
        };
        let (limits, guidance) = (&self.config.limits, &self.config.guidance);
        let lock = guidance.slot_lock;
        let present = law::aim(Law::Halcyon, lock, track, slot, step.now, 0.0);
        let mut aim = law::aim(guidance.law, lock, track, slot, step.now, limits.latency_s);
        let silent_s = track.silent_s(step.now);
        let (floor_m, radius_m, settle_s) = (limits.safe_height_m, limits.settle_radius_m, limits.settle_s);
        let above_floor = |place: Vector3<f64>| Vector3::new(place.x, place.y, place.z.min(-floor_m));
        let slot_error_m = (above_floor(present.position_ned_m) - step.here_ned_m).norm();
        if silent_s > self.config.fail_safe.leader_predict_s {
            self.hold(None, step);
            self.settle.reset();
            self.left_slot();
            let detail = format!("leader silent for {silent_s:.1} s, holding");
            return self.set(Activity::Following { settled: false, slot_error_m }, detail);
        }
        self.held = None;
        aim.position_ned_m = above_floor(aim.position_ned_m);
        if guidance.law == Law::Halcyon {
            let slower_mps = aim.velocity_ned_mps - step.own.velocity_ned_mps;
            aim = self.inverse.step(&aim, &guidance.loops, step.dt_s);
            let trim_mps = Vector3::new(slower_mps.x, slower_mps.y, 0.0).cap_magnitude(TRIM_MPS_MAX) * TRIM;
            aim.velocity_ned_mps += trim_mps;
        }
        if !self.keep_slot(&aim, floor_m, step) {
            // The thesis's second condition: the same heading as the leader's.
            self.drive(aim.position_ned_m, aim.velocity_ned_mps, Some(aim.heading_rad), floor_m, step);
        }
        let settled = self.settle.step(slot_error_m, radius_m, settle_s, step.now);
        self.set(Activity::Following { settled, slot_error_m }, "");
    }

    /// Sends the slot itself, once the reference has joined it. Returns whether it did: not while it is still on its way, nor when
    /// the separation filter or a limit has something against it; then the reference goes on by itself.
    fn keep_slot(&mut self, aim: &Motion, floor_m: f64, step: &mut Step) -> bool {
        let Some(left_m) = self.joined(aim, step) else { return false };
        let left_m = left_m * (-SLOT_GAIN_HZ * step.dt_s).exp();
        let place_m = aim.position_ned_m + left_m;
        let wanted_mps = aim.velocity_ned_mps - left_m * SLOT_GAIN_HZ;
        let limits = &self.config.limits;
        let mut velocity_mps = wanted_mps;
        limit_velocity(&mut velocity_mps, limits, limits.descent_mps);
        let points = [step.here_ned_m, place_m];
        velocity_mps = separation::filter(velocity_mps, points, aim.position_ned_m, &self.obstacles(step.now), limits);
        let changed = (velocity_mps.xy() - wanted_mps.xy()).norm() > CHANGED_MPS;
        if changed || (place_m - step.here_ned_m).norm() > LOST_M {
            self.left_slot();
            return false;
        }
        self.slot_left_m = Some(left_m);
        let reference = Reference { position_ned_m: place_m, velocity_ned_mps: velocity_mps };
        let Reference { position_ned_m, velocity_ned_mps } = self.bounded(reference, floor_m, step);
        let acceleration = aim.acceleration_ned_mps2 + left_m * (SLOT_GAIN_HZ * SLOT_GAIN_HZ);
        let most_mps2 = FEED_MPS2_MAX;
        // Heights change slowly; a leader's vertical acceleration is mostly noise.
        let level = Vector3::new(acceleration.x, acceleration.y, 0.0).cap_magnitude(most_mps2);
        let feeds_forward = matches!(self.config.guidance.law, Law::Halcyon | Law::PositionVelocityAcceleration);
        step.outputs.push(Output::Setpoint(Setpoint {
            position_ned_m,
            velocity_ned_mps,
            acceleration_ned_mps2: feeds_forward.then_some(level),
            heading_rad: Some(aim.heading_rad),
        }));
        true
    }

    /// What is left between the reference and the slot, metres, if they have joined.
    fn joined(&self, aim: &Motion, step: &Step) -> Option<Vector3<f64>> {
        if step.height_m() < self.config.limits.safe_height_m - super::flight::LOW_M {
            return None;
        }
        if let Some(left_m) = self.slot_left_m {
            return Some(left_m);
        }
        let reference = self.reference?;
        let left_m = reference.position_ned_m + reference.velocity_ned_mps * step.dt_s - aim.position_ned_m;
        let faster_mps = reference.velocity_ned_mps - aim.velocity_ned_mps;
        (left_m.norm() <= JOIN_M && faster_mps.norm() <= JOIN_MPS).then_some(left_m)
    }

    /// The reference is on its own again.
    pub(super) fn left_slot(&mut self) {
        self.slot_left_m = None;
    }

    /// Everyone to stay clear of.
    pub(super) fn obstacles(&self, now: Stamp) -> Vec<Obstacle> {
        let limits = &self.config.limits;
        let follows = matches!(self.flying, Some(Goal::Follow { .. }));
        let near = |(id, track): (&VehicleId, &Track)| {
            let usual_m = limits.separation_m_min + limits.separation_margin_m;
            let closer_m = self.planned_apart_m(id).map_or(0.0, |apart_m| (usual_m - (apart_m - limits.slot_slack_m)).max(0.0));
            let here = separation::obstacle(track, follows, limits, now);
            let onward = separation::onward(track, follows, limits, now);
            // One whose position has jumped may be at either place.
            let elsewhere = here.as_ref().and_then(|here| self.elsewhere(id, track, here, now));
            here.into_iter()
                .chain(onward)
                .chain(elsewhere)
                .map(move |obstacle| Obstacle { keep_m: obstacle.keep_m - closer_m, ..obstacle })
        };
        self.neighbours.iter().flat_map(near).collect()
    }

    /// How far apart the formation has this vehicle and another, metres.
    fn planned_apart_m(&self, other: &VehicleId) -> Option<f64> {
        let offset = |slot: &Slot| Vector3::new(slot.forward_m, slot.right_m, slot.up_m);
        let place = |(leader, slot): &(VehicleId, Slot)| (leader.clone(), offset(slot));
        let theirs = self.formation.get(other).map(place);
        match (&self.flying, theirs) {
            (Some(Goal::Follow { leader, slot }), _) if leader == other => Some(offset(slot).norm()),
            (Some(Goal::Follow { leader, slot }), Some((their_leader, their_offset))) if *leader == their_leader => {
                Some((offset(slot) - their_offset).norm())
            }
            (_, Some((their_leader, their_offset))) if their_leader == self.config.vehicle => Some(their_offset.norm()),
            _ => None,
        }
    }
}
