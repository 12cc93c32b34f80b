//! On the ground: waiting, arming, taking off; and what counts as landed.

use halcyon_model::{Activity, FlightMode, Geodetic, LandedState, LocalPoint, Severity, Stamp, VehicleState};

use super::{Climb, Executor, Goal, Home, Output};
use crate::core::commands::Command;
use crate::core::failsafe::{FailSafes, PlanHealth};
use crate::core::interlock;
use crate::core::mode::{Family, PX4_TAKE_OFF};
use crate::core::px4::TakeOff;
use crate::core::telemetry::{HOME_WITHIN_M, is_beside_home};

/// A vehicle on the ground with a task to land counts as landed within this distance of the place, metres: after a restart of
/// this service nothing else tells.
const LANDED_WITHIN_M: f64 = 5.0;
/// A barometer drifts by no more than this in a flight, metres.
const DRIFT_M_MAX: f64 = 5.0;
/// Nothing that floats or stands has its rangefinder higher than this, metres.
const ABOVE_ALL_M: f64 = 2.0;
/// The take-off height is at least this much above the ground that it stands on, metres.
const CLIMB_M_MIN: f64 = 2.5;

impl Executor {
    /// It was in the air and is not any more.
    pub(super) fn touched_down(&mut self) {
        if let (Some(Goal::Land { point, .. }), Some(own)) = (&self.active, &self.own)
            && !self.control.hands_off()
            // A fail-safe's landing without a clearance is no landing of the task's.
            && !matches!(self.activity, Activity::FailSafe { .. })
        {
            // Nor are motors cut in the air. In LAND over its place, where the autopilot finds the ground, its height may have drifted.
            let here = LocalPoint::from(own.state.position_ned_m);
            let over_it = here.distance_m(point) <= 3.0 * self.config.limits.landing_radius_m;
            let lands = over_it && self.control.is_ours(FlightMode::Land);
            let height_m_max = self.config.limits.land_mode_height_m + if lands { DRIFT_M_MAX } else { 1.0 };
            if -own.state.position_ned_m.z <= height_m_max {
                self.touchdown = Some(here);
            }
        }
        self.landed_for_goal = true;
        if self.home == Home::Declined {
            self.home = Home::Loose;
        }
        self.restarted_at = None;
        self.take_off = TakeOff::default();
        self.fail_safes = FailSafes::default();
        self.watch_over();
        self.let_go();
    }

    /// One step on the ground.
    pub(super) fn stand(&mut self, own: &VehicleState, goal: Option<Goal>, now: Stamp, outputs: &mut Vec<Output>) {
        self.let_go();
        let Some(goal) = goal else { return self.set(Activity::Idle, "no task") };
        let flown = self.flown.as_ref().is_some_and(|flown| flown.is_same_as(&goal));
        if let Goal::Land { point, .. } = &goal {
            let here = LocalPoint::from(own.position_ned_m);
            if !self.landed_for_goal && here.distance_m(point) <= LANDED_WITHIN_M {
                // Landed before a restart.
                self.landed_for_goal = true;
                self.touchdown = Some(here);
            }
        }
        if !goal.wants_flight() || flown {
            // Motors that still turn after a flight are stopped; those that a person started are the person's.
            if own.armed && self.flown.is_some() && own.landed == LandedState::OnGround {
                self.request(Command::Disarm { force: false }, now, outputs);
            }
            let landed = self.landed_for_goal || self.flown.is_some();
            return self.set(if landed { Activity::Landed } else { Activity::Idle }, "");
        }
        match self.obstacle_to_take_off(own, &goal, now) {
            Some(reason) => {
                // Armed for a take-off that may not be: stop the motors again.
                if own.armed && self.pending.as_ref().is_some_and(|pending| pending.command == Command::Arm) {
                    self.request(Command::Disarm { force: false }, now, outputs);
                }
                self.set(Activity::Preparing, reason);
            }
            None if !self.may_take_off_in(own) => {
                let mode = Family::named(own.firmware.as_ref()).take_off_from();
                self.request(Command::SetMode(mode), now, outputs);
                self.set(Activity::Preparing, format!("setting {}", interlock::mode_name(mode)));
            }
            None if !own.armed && self.home == Home::Loose && self.is_home(own) => {
                self.request(Command::SetHome, now, outputs);
                self.set(Activity::Preparing, "fixing home here");
            }
            None if !own.armed => {
                self.request(Command::Arm, now, outputs);
                self.set(Activity::Preparing, "arming");
            }
            None => {
                let ground_m = -own.position_ned_m.z;
                let height_m = self.config.limits.safe_height_m.max(ground_m + CLIMB_M_MIN);
                // ArduCopter with a rangefinder counts from what is below instead. Too high is ended as soon as it is high enough.
                let from_m = match Family::named(own.firmware.as_ref()) {
                    Family::ArduPilot => self.config.home_height_m.min(ground_m),
                    Family::Px4 => self.config.home_height_m,
                };
                let height_above_home_m = height_m - from_m;
                let before = outputs.len();
                self.request(Command::TakeOff { height_above_home_m }, now, outputs);
                if outputs.len() > before && Family::named(own.firmware.as_ref()) == Family::Px4 {
                    self.control.expect(PX4_TAKE_OFF, now);
                    self.take_off.asked(height_m);
                }
                self.climb = Some(Climb { height_m, since: now });
                self.flown = None;
                self.set(Activity::TakingOff, format!("to {height_m:.1} m"));
            }
        }
    }

    /// Whether somebody else stopped the motors that we had started to take off with: in a mode of ours, and not at our request.
    pub(super) fn stopped_by_others(&self, state: &VehicleState) -> bool {
        let were_on = self.own.as_ref().is_some_and(|own| own.state.armed);
        let asked =
            self.pending.as_ref().is_some_and(|pending| matches!(pending.command, Command::Disarm { .. }) && !pending.failed);
        let to_fly = matches!(self.activity, Activity::Preparing | Activity::TakingOff) && self.may_take_off_in(state);
        were_on && !state.armed && !self.airborne && to_fly && !asked
    }

    /// Whether it came down, as `state` says, though it was not to: its motors were stopped in the air, by a crash or by somebody, or it
    /// sank onto something. In GUIDED anywhere but in a descent, which may end on the water; in every mode from higher than a height is wrong.
    pub(super) fn falls(&self, state: &VehicleState) -> bool {
        let Some(before) = self.own.as_ref().map(|own| &own.state) else { return false };
        let knows = !state.armed || state.landed == LandedState::OnGround;
        let guided = before.mode == FlightMode::Guided && !self.descending;
        let rises = self.climb.is_some() && before.mode == Family::named(before.firmware.as_ref()).climbs_in();
        let range_m = before.range.map(|range| range.distance_m);
        let high_m = self.config.limits.land_mode_height_m + DRIFT_M_MAX;
        let high = range_m.map_or(-before.position_ned_m.z > high_m, |range_m| range_m > ABOVE_ALL_M);
        knows && !self.control.hands_off() && (guided || rises || high)
    }

    /// Hands off until GUIDED is set: starting the motors again would be a fight with whoever stopped them, who may stand beside them.
    pub(super) fn stands_down(&mut self, what: &str) {
        self.control.let_go();
        self.withdraw = true;
        self.pending = None;
        self.take_off = TakeOff::default();
        self.flown = self.goal();
        self.note(Severity::Warning, what, "it does not take off until GUIDED is set");
    }

    /// Whether it may be armed and told to take off in its present mode. PX4's HOLD is anybody's: only once we have asked for it, it is
    /// ours, and so is its AUTO.TAKEOFF until it leaves the ground.
    fn may_take_off_in(&self, own: &VehicleState) -> bool {
        match Family::named(own.firmware.as_ref()) {
            Family::ArduPilot => own.mode == FlightMode::Guided,
            Family::Px4 => {
                let ready = own.mode == Family::Px4.take_off_from() || (own.armed && own.mode == PX4_TAKE_OFF);
                ready && self.control.is_ours(own.mode)
            }
        }
    }

    /// Whether it stands where it is at home. ArduCopter takes home anew wherever it is armed, unless home was set: one that is armed
    /// on the water again would return to the water.
    fn is_home(&self, own: &VehicleState) -> bool {
        let is_down = is_beside_home(-own.position_ned_m.z, self.config.home_height_m);
        own.home.is_none_or(|home| !is_down && self.is_near(own, home))
    }

    pub(super) fn is_near(&self, own: &VehicleState, home: Geodetic) -> bool {
        (self.config.frame.ned_from_geodetic(home).xy() - own.position_ned_m.xy()).norm() <= HOME_WITHIN_M
    }

    /// Why it may not take off for `goal` now, if it may not.
    pub(super) fn obstacle_to_take_off(&self, own: &VehicleState, goal: &Goal, now: Stamp) -> Option<String> {
        let planned = self.direct.is_none();
        if planned && (self.plan_health(now) == PlanHealth::Lapsed || self.plan.as_ref().is_none_or(|plan| !plan.assigned)) {
            return Some("waiting for a valid plan".into());
        }
        if self.has_twin(now) {
            return Some(format!("another vehicle calls itself {}", self.config.vehicle));
        }
        if self.lost_home(own) {
            let what = "the autopilot started again away from home, and its height above the water is not known";
            return Some(format!("{what}: bring it home"));
        }
        if !own.estimator_ok {
            return Some("waiting for the estimator's position".into());
        }
        if !own.armed && matches!(own.landed, LandedState::InAir | LandedState::TakingOff | LandedState::Landing) {
            return Some("the autopilot says that it is in the air".into());
        }
        if !own.armed && !own.ready_to_arm {
            return Some("waiting for the autopilot's arming checks".into());
        }
        let needed = self.config.fail_safe.battery_take_off_fraction;
        match own.battery_fraction {
            None => return Some("battery unknown".into()),
            Some(fraction) if fraction < needed => {
                return Some(format!("battery {:.0} %, needs {:.0} %", 100.0 * fraction, 100.0 * needed));
            }
            Some(_) => {}
        }
        if own.home.is_none() && own.armed {
            return Some("waiting for the autopilot's home".into());
        }
        if let Goal::Follow { leader, .. } = goal {
            let track = self.neighbours.get(leader);
            let may = interlock::may_follow(leader, track, &self.config.limits, &self.config.fail_safe, now);
            if let Err(refusal) = may {
                return Some(refusal.to_string());
            }
        }
        let keep_m = self.config.limits.separation_m_min;
        let near = self.neighbours.iter().find(|(_, track)| {
            let away_m = (track.predict(now, 0.0).position_ned_m - own.position_ned_m).xy().norm();
            away_m < if track.parked() { self.config.limits.separation_parked_m } else { keep_m } && track.unheard_s(now) < 30.0
        });
        near.map(|(vehicle, _)| format!("{vehicle} is too near to take off"))
    }
}
