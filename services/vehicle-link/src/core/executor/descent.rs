//! Coming down: on the water with a clearance that is checked at every step, or at home.
//!
//! Down to the land-mode height the vehicle descends in GUIDED, since only there it holds an exact spot; LAND mode does the
//! rest, finds the surface and stops the motors. A landing is broken off, by a climb to the approach height, down to the commit
//! height; below that it is finished, since stopping over a wave is worse.

use halcyon_model::{Activity, Clearance, FlightMode, LocalPoint, Severity, Stamp, VerdictState};
use nalgebra::Vector3;

use super::flight::{Step, at};
use super::{Executor, Goal};
use crate::core::commands::Command;

/// The reference aims this far below the land-mode height, so that it isn't slowed down before it gets there, metres.
const BELOW_M: f64 = 0.7;
/// The reference leads the vehicle down by at most this much, metres.
const LEAD_DOWN_M: f64 = 0.5;
/// Nearer than this to a place it is approached, metres.
const NEAR_M: f64 = 3.0;

/// Why a clearance does not permit a descent now; `None` if it does.
#[must_use]
pub(super) fn clearance_problem(clearance: Option<&Clearance>, now: Stamp) -> Option<&'static str> {
    match clearance {
        None => Some("there is no clearance"),
        Some(clearance) if clearance.verdict != VerdictState::Safe => Some("the verdict is not safe"),
        Some(clearance) if now > clearance.valid_until => Some("the clearance lapsed"),
        Some(_) => None,
    }
}

impl Executor {
    /// Approach, wait for the clearance, descend.
    pub(super) fn land(&mut self, point: LocalPoint, approach_height_m: f64, clearance: Option<&Clearance>, step: &mut Step) {
        let problem = clearance_problem(clearance, step.now);
        if let (true, Some(problem)) = (self.descending, problem) {
            self.break_off(problem, step.now);
        }
        if self.descending {
            return self.descend(point, 0.0, Activity::Descending, step);
        }
        let limits = &self.config.limits;
        let (safe_m, radius_m, settle_s) = (limits.safe_height_m, limits.landing_radius_m, limits.settle_s);
        let place = at(point, approach_height_m.max(safe_m));
        self.drive(place, Vector3::zeros(), None, safe_m, step);
        let error_m = (place - step.here_ned_m).norm();
        let over = self.settle.step(error_m, radius_m, settle_s, step.now);
        match problem {
            None if over => {
                self.descending = true;
                self.set(Activity::Descending, "");
            }
            Some(problem) if self.uncleared.is_some() && step.height_m() < safe_m - 1.0 => {
                let reason = format!("{problem}: stopped and climbing");
                self.set(Activity::FailSafe { reason }, "");
            }
            _ if step.distance_m(point) > NEAR_M => self.set(Activity::Transit, format!("{error_m:.0} m to go")),
            problem => {
                if problem.is_some() {
                    self.uncleared.get_or_insert(step.now);
                }
                self.set(Activity::Approaching, problem.unwrap_or_default());
            }
        }
    }

    /// Home, and down.
    pub(super) fn go_home(&mut self, step: &mut Step) {
        let Some(home) = step.own.home else {
            self.request(Command::SetMode(FlightMode::Rtl), step.now, step.outputs);
            return self.set(Activity::Returning, "home unknown here: the autopilot's own RTL");
        };
        let home = LocalPoint::from(self.config.frame.ned_from_geodetic(home));
        if self.descending {
            return self.descend(home, self.config.home_height_m, Activity::Returning, step);
        }
        let limits = &self.config.limits;
        let (safe_m, radius_m, settle_s) = (limits.safe_height_m, limits.landing_radius_m, limits.settle_s);
        let place = at(home, limits.return_height_m.max(safe_m));
        self.drive(place, Vector3::zeros(), None, safe_m, step);
        let error_m = (place - step.here_ned_m).norm();
        self.descending = self.settle.step(error_m, radius_m, settle_s, step.now);
        self.set(Activity::Returning, format!("{:.0} m to go", step.distance_m(home)));
    }

    /// Down over `point` to the land-mode height above a ground at `ground_m`, then LAND.
    fn descend(&mut self, point: LocalPoint, ground_m: f64, activity: Activity, step: &mut Step) {
        let above_ground_m = step.height_m() - ground_m;
        if above_ground_m <= self.config.limits.land_mode_height_m {
            self.request(Command::SetMode(FlightMode::Land), step.now, step.outputs);
        }
        let limits = &self.config.limits;
        let off_m = step.distance_m(point);
        // Blown aside: back over the place first, at this height.
        let goes_down = off_m <= 2.0 * limits.landing_radius_m;
        let bottom_m = ground_m + (limits.land_mode_height_m - BELOW_M).max(0.1);
        let height_m = if goes_down { bottom_m } else { step.height_m().max(bottom_m) };
        let floor_m =
            (step.height_m() - LEAD_DOWN_M).clamp(bottom_m.min(limits.safe_height_m), limits.safe_height_m.max(bottom_m));
        self.drive(at(point, height_m), Vector3::zeros(), None, floor_m, step);
        self.set(activity, format!("{above_ground_m:.1} m up, {off_m:.1} m off"));
    }

    /// In LAND mode, which we set.
    pub(super) fn in_land_mode(&mut self, goal: &Goal, step: &mut Step) {
        self.reference = None;
        let limits = &self.config.limits;
        let home = step.own.home.map(|home| LocalPoint::from(self.config.frame.ned_from_geodetic(home)));
        let at_home = home.is_some_and(|home| step.distance_m(home) <= 3.0 * limits.landing_radius_m);
        let ground_m = if at_home { self.config.home_height_m } else { 0.0 };
        let committed = step.height_m() - ground_m <= limits.commit_height_m;
        let problem = match goal {
            Goal::LandHere => None,
            Goal::Return => (!at_home).then_some("returning instead"),
            // A clearance is for one place: in LAND elsewhere, by a fail-safe that is over, it permits nothing.
            Goal::Land { point, .. } if step.distance_m(*point) > 3.0 * limits.landing_radius_m => {
                Some("not over the landing place")
            }
            Goal::Land { clearance, .. } => clearance_problem(clearance.as_ref(), step.now),
            Goal::Stay | Goal::Go { .. } | Goal::Follow { .. } => Some("there is something else to do"),
        };
        match problem {
            Some(problem) if !committed => {
                self.break_off(problem, step.now);
                self.request(Command::SetMode(FlightMode::Guided), step.now, step.outputs);
                self.set(Activity::FailSafe { reason: format!("{problem}: stopped and climbing") }, "");
            }
            _ if *goal == Goal::Return => self.set(Activity::Returning, "landing at home"),
            _ => self.set(Activity::Descending, if committed { "committed" } else { "in LAND" }),
        }
    }

    fn break_off(&mut self, problem: &str, now: Stamp) {
        if self.descending {
            self.note(Severity::Critical, "descent broken off", problem);
        }
        self.descending = false;
        self.settle.reset();
        self.uncleared.get_or_insert(now);
    }
}
