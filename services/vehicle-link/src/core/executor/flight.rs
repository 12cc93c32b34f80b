//! In the air: fail-safes first, then the goal, then one setpoint through the separation filter.

use halcyon_model::{Activity, FlightMode, LocalPoint, Stamp, VehicleState};
use nalgebra::Vector3;

use super::{Executor, Goal, Output};
use crate::core::commands::Command;
use crate::core::failsafe::{Action, Alarm, Cause, Conditions, PlanHealth};
use crate::core::guidance::{PLACE_GAIN_HZ, Reference, SLOT_GAIN_HZ, Setpoint, Target, limit_velocity};
use crate::core::interlock::{self, FollowRefusal};
use crate::core::inverse::Inverse;
use crate::core::mode::Family;
use crate::core::separation;

/// The autopilot's own climb is waited for so long, seconds; then guidance takes over.
const CLIMB_S_MAX: f64 = 30.0;
/// And ends when the vehicle is up, within so much, and climbs no faster than this, or goes on climbing: metres, metres per second.
const ARRIVED_M: f64 = 0.5;
const CLIMBED_MPS: f64 = 0.5;
/// Nearer than this to its place a vehicle may go to the place's own height, and counts as there, metres.
const NEAR_M: f64 = 3.0;
/// Lower than the floor by more than this, a vehicle climbs before it goes anywhere, metres.
pub(super) const LOW_M: f64 = 0.7;
/// A velocity that the separation filter has changed by more than this is braked with an acceleration on top, up to so much: metres
/// per second, metres per second squared.
pub(super) const REFUSED_MPS: f64 = 0.3;
const BRAKING_MPS2_MAX: f64 = 4.0;
/// A climb that it has slowed by more than this is into somebody, metres per second: a climb begins slowly.
const CLIMB_REFUSED_MPS: f64 = 0.02;
/// Setpoints end this far inside the fence, metres.
const FENCE_INSIDE_M: f64 = 2.0;

/// One step's circumstances.
pub(super) struct Step<'a> {
    pub(super) own: &'a VehicleState,
    /// Own position at `now`, metres.
    pub(super) here_ned_m: Vector3<f64>,
    pub(super) dt_s: f64,
    pub(super) now: Stamp,
    pub(super) outputs: &'a mut Vec<Output>,
}

impl Step<'_> {
    pub(super) fn height_m(&self) -> f64 {
        -self.here_ned_m.z
    }

    pub(super) fn distance_m(&self, point: LocalPoint) -> f64 {
        LocalPoint::from(self.here_ned_m).distance_m(&point)
    }
}

/// A place at a height above mean water.
pub(super) fn at(point: LocalPoint, height_m: f64) -> Vector3<f64> {
    Vector3::new(point.north_m, point.east_m, -height_m)
}

impl Executor {
    /// One step in the air, with the vehicle ours.
    pub(super) fn fly(&mut self, own: &VehicleState, goal: Option<Goal>, dt_s: f64, now: Stamp, outputs: &mut Vec<Output>) {
        let family = Family::named(own.firmware.as_ref());
        let goal = match goal {
            Some(goal) => goal,
            // Without setpoints PX4 wouldn't stay; and whatever flies by our targets flies on by the last one.
            None if own.mode == FlightMode::Guided && (family == Family::Px4 || self.reference.is_some()) => Goal::Stay,
            None if self.plan_health(now) == PlanHealth::Lapsed => Goal::Stay,
            None if self.restarted_at.is_some() => {
                return self.set(Activity::Holding { settled: false }, "restarted in flight, waiting for a plan");
            }
            None => return self.set(Activity::Idle, "in the air, but not by us"),
        };
        self.flown = Some(goal.clone());
        let alarm = self.alarm(own, &goal, now);
        let age_s = now.seconds_since(own.stamp).clamp(0.0, 0.5);
        let here_ned_m = own.position_ned_m + own.velocity_ned_mps * age_s;
        let land_now = alarm.as_ref().is_some_and(|alarm| alarm.action == Action::Land);
        if let Some(climb) = self.climb.filter(|_| own.mode == family.climbs_in() && !land_now) {
            // PX4 says by its mode that it has arrived.
            let short_m = climb.height_m + here_ned_m.z;
            let is_up = (short_m <= ARRIVED_M && own.velocity_ned_mps.z.abs() < CLIMBED_MPS) || short_m <= 0.0;
            let arrived = own.mode == FlightMode::Guided && is_up;
            if !arrived && now.seconds_since(climb.since) < CLIMB_S_MAX {
                // A setpoint now would end the autopilot's own take-off.
                return self.set(Activity::TakingOff, format!("to {:.1} m", climb.height_m));
            }
        }
        self.climb = None;
        let tries = alarm.as_ref().is_some_and(|alarm| alarm.cause == Cause::Unheeded) && !self.heed.holds();
        let effective = match alarm.as_ref().map(|alarm| alarm.action) {
            None => goal,
            // Tried again now and then, to see whether the autopilot follows.
            Some(Action::Hold) if tries => goal,
            Some(Action::Hold) => Goal::Stay,
            Some(Action::Return) => Goal::Return,
            Some(Action::Land) => Goal::LandHere,
        };
        if !self.flying.as_ref().is_some_and(|flying| flying.is_same_as(&effective)) {
            self.settle.reset();
            self.descending = false;
            self.landing.start();
            self.held = None;
            self.left_slot();
            self.inverse = Inverse::default();
            if self.continuity.shift_ned_m().norm() > 0.0 {
                // Formation is flown by another place than all else.
                self.reference = None;
            }
        }
        self.flying = Some(effective.clone());
        let mut step = Step { own, here_ned_m, dt_s, now, outputs };
        match own.mode {
            // Whatever else is the matter, a place that has jumped is not flown by.
            FlightMode::Guided if self.has_jumped() && alarm.is_some() => {
                self.ride_out(&mut step);
                if land_now {
                    self.land_here(&mut step);
                }
            }
            FlightMode::Guided => self.guide(&effective, &mut step),
            FlightMode::Land => self.in_land_mode(&effective, &mut step),
            // Ours only on the way home without a known home.
            FlightMode::Rtl if effective == Goal::Return => self.set(Activity::Returning, "by the autopilot's own RTL"),
            // PX4 after its take-off, or a mode that something else was asked for in.
            _ if effective == Goal::LandHere => self.land_here(&mut step),
            _ => self.request(Command::SetMode(FlightMode::Guided), now, step.outputs),
        }
        if let Some(alarm) = alarm {
            self.activity = Activity::FailSafe { reason: alarm.reason };
        }
    }

    /// The fail-safe in charge, those of a landing included.
    fn alarm(&mut self, own: &VehicleState, goal: &Goal, now: Stamp) -> Option<Alarm> {
        let follow = match goal {
            Goal::Follow { leader, .. } => {
                let track = self.neighbours.get(leader);
                let jumped = self.other_jumped_m(leader, now).is_some();
                let may = interlock::may_follow(leader, track, &self.config.limits, &self.config.fail_safe, now);
                Some(may.and(if jumped { Err(FollowRefusal::Jumped { leader: leader.clone() }) } else { Ok(()) }))
            }
            _ => None,
        };
        let homeward = matches!(goal, Goal::Return | Goal::LandHere);
        let (jumped_m, home_s) = (self.jumped_m(own, now), self.time_home_s(own));
        let (plan, unheeded) = (self.plan_health(now), self.unheeded.as_ref());
        let conditions = Conditions { own, plan, follow, homeward, jumped_m, home_s, unheeded };
        let alarm = self.fail_safes.step(&conditions, &self.config.fail_safe, now);
        if let Goal::Land { clearance, .. } = goal {
            if super::descent::clearance_problem(clearance.as_ref(), now).is_none() {
                self.uncleared = None;
            }
            let waited_s = self.uncleared.map_or(0.0, |since| now.seconds_since(since));
            if alarm.is_none() && waited_s > self.config.fail_safe.clearance_wait_s {
                let reason = format!("no clearance to land for {:.0} s", self.config.fail_safe.clearance_wait_s);
                return Some(Alarm { cause: Cause::Clearance, action: Action::Return, reason });
            }
        }
        alarm
    }

    /// How long the way home takes, climb and landing included, seconds; `None` if home is unknown.
    fn time_home_s(&self, own: &VehicleState) -> Option<f64> {
        let home = self.config.frame.ned_from_geodetic(self.home(own)?);
        let limits = &self.config.limits;
        let distance_m = (home - own.position_ned_m).xy().norm();
        let height_m = limits.return_height_m.max(limits.safe_height_m);
        let climb_s = (height_m + own.position_ned_m.z).max(0.0) / limits.climb_mps;
        let descent_s = height_m.max(-own.position_ned_m.z) / limits.descent_mps;
        Some(climb_s + distance_m / limits.cruise_mps + descent_s)
    }

    /// Guidance in GUIDED.
    fn guide(&mut self, goal: &Goal, step: &mut Step) {
        match goal {
            Goal::Stay => {
                let settled = self.hold(None, step);
                self.set(Activity::Holding { settled }, "");
            }
            Goal::Go { point, height_m, heading_rad } => self.go(*point, *height_m, *heading_rad, step),
            Goal::Follow { leader, slot } => self.follow(leader, slot, step),
            Goal::Land { point, approach_height_m, clearance } => {
                self.land(*point, *approach_height_m, clearance.as_ref(), step);
            }
            Goal::LandHere => {
                // Until it is in LAND it must be told where to be.
                self.hold(None, step);
                self.land_here(step);
            }
            Goal::Return => self.go_home(step),
        }
    }

    fn land_here(&mut self, step: &mut Step) {
        self.request(Command::SetMode(FlightMode::Land), step.now, step.outputs);
        self.set(Activity::Descending, "landing here");
    }

    /// Where a vehicle that is at `here_ned_m` now comes to a stop, so that it doesn't fly back; not below the safe height.
    pub(super) fn stop_ned_m(&self, own: &VehicleState, here_ned_m: Vector3<f64>) -> Vector3<f64> {
        let limits = &self.config.limits;
        let velocity = own.velocity_ned_mps;
        let speed_mps = velocity.xy().norm().min(limits.speed_mps_max);
        let stop_s = speed_mps / (1.4 * limits.acceleration_mps2);
        let height_m = (-here_ned_m.z).max(limits.safe_height_m);
        Vector3::new(here_ned_m.x + velocity.x * stop_s, here_ned_m.y + velocity.y * stop_s, -height_m)
    }

    /// Stops and holds; returns whether settled. Below the safe height it climbs to it.
    pub(super) fn hold(&mut self, heading_rad: Option<f64>, step: &mut Step) -> bool {
        let limits = &self.config.limits;
        let here_ned_m = step.here_ned_m;
        let held = self.held.unwrap_or_else(|| self.stop_ned_m(step.own, here_ned_m));
        self.held = Some(held);
        let floor_m = limits.safe_height_m;
        let (radius_m, settle_s) = (limits.settle_radius_m, limits.settle_s);
        self.drive(held, Vector3::zeros(), heading_rad, floor_m, step);
        self.settle.step((held - here_ned_m).norm(), radius_m, settle_s, step.now)
    }

    fn go(&mut self, point: LocalPoint, height_m: f64, heading_rad: Option<f64>, step: &mut Step) {
        let limits = &self.config.limits;
        let near = step.distance_m(point) <= NEAR_M;
        // The way there is flown at the safe height or above; only the place itself may be lower.
        let floor_m = if near { limits.safe_height_m.min(height_m) } else { limits.safe_height_m };
        let place = at(point, height_m.max(floor_m));
        let (radius_m, settle_s) = (limits.settle_radius_m, limits.settle_s);
        self.drive(place, Vector3::zeros(), heading_rad, floor_m, step);
        let error_m = (at(point, height_m) - step.here_ned_m).norm();
        let settled = self.settle.step(error_m, radius_m, settle_s, step.now);
        if near && error_m <= NEAR_M {
            self.set(Activity::Holding { settled }, "");
        } else {
            self.set(Activity::Transit, format!("{error_m:.0} m to go"));
        }
    }

    /// Moves the reference towards a place and sends it: never below `floor_m`, never outside the fence, never too near to
    /// anyone. Low, it climbs before it goes sideways.
    pub(super) fn drive(
        &mut self,
        place_ned_m: Vector3<f64>,
        velocity_ned_mps: Vector3<f64>,
        heading_rad: Option<f64>,
        floor_m: f64,
        step: &mut Step,
    ) {
        let limits = &self.config.limits;
        let start = Reference { position_ned_m: step.here_ned_m, velocity_ned_mps: step.own.velocity_ned_mps };
        let mut reference = self.reference.unwrap_or(start);
        let follows = matches!(self.flying, Some(Goal::Follow { .. }));
        let mut target = Target {
            position_ned_m: place_ned_m,
            velocity_ned_mps,
            descent_mps: limits.descent_mps,
            acceleration_mps2: if follows { limits.follow_acceleration_mps2 } else { limits.acceleration_mps2 },
            gain_hz: if follows { SLOT_GAIN_HZ } else { PLACE_GAIN_HZ },
        };
        if step.height_m() < floor_m - LOW_M {
            target.position_ned_m = Vector3::new(reference.position_ned_m.x, reference.position_ned_m.y, place_ned_m.z);
            target.velocity_ned_mps = Vector3::zeros();
        }
        let wanted = reference.wanted_mps(&target, limits, step.dt_s);
        let obstacles = self.obstacles(step.now);
        let points = [step.here_ned_m, reference.position_ned_m];
        let mut velocity = separation::filter(wanted, points, target.position_ned_m, &obstacles, limits);
        limit_velocity(&mut velocity, limits, limits.descent_mps);
        reference.advance(velocity, step.here_ned_m, step.dt_s);
        // The floor lifts nobody into whoever is above.
        let is_under = velocity.z > wanted.z + CLIMB_REFUSED_MPS && wanted.z < 0.0;
        let floor_m = if is_under { floor_m.min(step.height_m()) } else { floor_m };
        let Reference { position_ned_m, velocity_ned_mps } = self.bounded(reference, floor_m, step);
        // Somebody is in the way: what the velocity loop would do in half a second is asked for at once.
        let refused_mps = (velocity - wanted).norm();
        let braking_mps2 = (velocity_ned_mps - step.own.velocity_ned_mps).cap_magnitude(BRAKING_MPS2_MAX);
        let level_mps2 = Vector3::new(braking_mps2.x, braking_mps2.y, 0.0);
        let acceleration_ned_mps2 = (refused_mps > REFUSED_MPS).then_some(level_mps2);
        let setpoint = Setpoint { position_ned_m, velocity_ned_mps, acceleration_ned_mps2, heading_rad };
        step.outputs.push(Output::Setpoint(setpoint));
    }

    /// Keeps the reference above the floor and inside the fence, and remembers it.
    pub(super) fn bounded(&mut self, mut reference: Reference, floor_m: f64, step: &Step) -> Reference {
        if reference.position_ned_m.z > -floor_m {
            reference.position_ned_m.z = -floor_m;
            let climbing = step.height_m() < floor_m - 0.3;
            let climb_mps = self.config.limits.climb_mps;
            reference.velocity_ned_mps.z = if climbing { -climb_mps } else { reference.velocity_ned_mps.z.min(0.0) };
        }
        let ceiling_m = self.config.fail_safe.fence_height_m - FENCE_INSIDE_M;
        if reference.position_ned_m.z < -ceiling_m {
            reference.position_ned_m.z = -ceiling_m;
            reference.velocity_ned_mps.z = 0.0;
        }
        let radius_m = self.config.fail_safe.fence_radius_m - FENCE_INSIDE_M;
        let out_m = reference.position_ned_m.xy().norm();
        if out_m > radius_m {
            reference.position_ned_m.x *= radius_m / out_m;
            reference.position_ned_m.y *= radius_m / out_m;
            reference.velocity_ned_mps.x = 0.0;
            reference.velocity_ned_mps.y = 0.0;
        }
        self.reference = Some(reference);
        reference
    }
}
