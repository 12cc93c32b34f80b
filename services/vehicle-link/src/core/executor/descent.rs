//! Coming down: on the water with a clearance that is checked at every step, or at home.
//!
//! Down to the land-mode height the vehicle descends in GUIDED, since only there it holds an exact spot; LAND mode does the
//! rest, finds the surface and stops the motors. A landing is broken off, by a climb to the approach height, down to the commit
//! height; below that it is finished, since stopping over a wave is worse.
//!
//! Near the surface heights are the rangefinder's, averaged over waves, where there is one; while it and the autopilot's disagree,
//! LAND begins by the lower of the two and the landing is committed by the higher. Where the clearance offers calm windows, the
//! vehicle waits at the calm height, for a while, until a descent from there ends in one.

use halcyon_model::{Activity, CalmWindow, Clearance, FlightMode, LocalPoint, Severity, Stamp, VerdictState};
use nalgebra::Vector3;

use super::flight::{Step, at};
use super::{Executor, Goal};
use crate::core::commands::Command;
use crate::core::surface::{Afloat, Surface};

/// The reference aims this far below the land-mode height, so that it isn't slowed down before it gets there, metres.
const BELOW_M: f64 = 0.7;
/// The reference leads the vehicle down by at most this much, metres.
const LEAD_DOWN_M: f64 = 0.5;
/// Nearer than this to a place it is approached, metres.
const NEAR_M: f64 = 3.0;
/// The rangefinder and the autopilot's height agree within this, metres: what a barometer drifts by in a flight.
const AGREE_M: f64 = 1.0;
/// At the calm height is no further above it than this, metres.
const AT_CALM_M: f64 = 0.3;

/// Told to go down, a vehicle that sinks no faster than this for so long stands on something: metres per second, seconds.
const STOOD_MPS: f64 = 0.05;
const STOOD_S: f64 = 8.0;
/// It still has so far to go at least, metres.
const STOOD_ABOVE_M: f64 = 0.5;

/// What a landing remembers.
#[derive(Debug, Clone, Default)]
pub(super) struct Landing {
    pub(super) surface: Surface,
    /// Waits at the calm height, since then.
    pub(super) calm_since: Option<Stamp>,
    /// Has gone on from there.
    calm_over: bool,
    disagreement_noted: bool,
    /// Has not sunk for so long, seconds.
    stood_s: f64,
    afloat: Afloat,
}

impl Landing {
    /// A descent begins afresh.
    pub(super) fn start(&mut self) {
        *self = Self { surface: std::mem::take(&mut self.surface), ..Self::default() };
    }
}

/// Heights above what lies below, metres.
#[derive(Debug, Clone, Copy)]
struct Heights {
    /// By which LAND begins.
    low_m: f64,
    /// By which the landing is committed.
    high_m: f64,
    /// What the autopilot's height lacks, as far as it is believed.
    correction_m: f64,
}

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
            let windows = clearance.map_or(&[][..], |clearance| clearance.windows.as_slice());
            return self.descend(point, 0.0, Activity::Descending, windows, step);
        }
        let limits = &self.config.limits;
        let (safe_m, radius_m, settle_s) = (limits.safe_height_m, limits.landing_radius_m, limits.settle_s);
        let place = at(point, approach_height_m.max(safe_m));
        self.drive(place, Vector3::zeros(), None, safe_m, step);
        let error_m = (place - step.here_ned_m).norm();
        let over = self.settle.step(error_m, radius_m, settle_s, step.now);
        match problem {
            None if over => {
                self.landing.start();
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
        let Some(home) = self.home(step.own) else {
            self.hold(None, step);
            self.request(Command::SetMode(FlightMode::Rtl), step.now, step.outputs);
            return self.set(Activity::Returning, "home unknown here: the autopilot's own RTL");
        };
        let home = LocalPoint::from(self.config.frame.ned_from_geodetic(home));
        if self.descending {
            return self.descend(home, self.config.home_height_m, Activity::Returning, &[], step);
        }
        let limits = &self.config.limits;
        let (safe_m, radius_m, settle_s) = (limits.safe_height_m, limits.landing_radius_m, limits.settle_s);
        let place = at(home, limits.return_height_m.max(safe_m));
        self.drive(place, Vector3::zeros(), None, safe_m, step);
        let error_m = (place - step.here_ned_m).norm();
        self.descending = self.settle.step(error_m, radius_m, settle_s, step.now);
        self.set(Activity::Returning, format!("{:.0} m to go", step.distance_m(home)));
    }

    /// Heights above a ground that is at `ground_m`. The rangefinder and the autopilot's together, where both are at hand and agree;
    /// the autopilot's alone without a rangefinder; the safer where they disagree.
    fn heights(&mut self, ground_m: f64, step: &Step) -> Heights {
        let by_autopilot_m = step.height_m() - ground_m;
        let Some(correction_m) = self.landing.surface.correction_m(step.now).map(|correction_m| correction_m + ground_m) else {
            return Heights { low_m: by_autopilot_m, high_m: by_autopilot_m, correction_m: 0.0 };
        };
        let by_range_m = by_autopilot_m + correction_m;
        if correction_m.abs() <= AGREE_M {
            self.landing.disagreement_noted = false;
            return Heights { low_m: by_range_m, high_m: by_range_m, correction_m };
        }
        if !std::mem::replace(&mut self.landing.disagreement_noted, true) {
            let why = format!("{by_range_m:.1} m and {by_autopilot_m:.1} m above what is below: the safer counts");
            self.note(Severity::Warning, "rangefinder and autopilot's height disagree", why);
        }
        Heights { low_m: by_range_m.min(by_autopilot_m), high_m: by_range_m.max(by_autopilot_m), correction_m: 0.0 }
    }

    /// Down over `point` to the land-mode height above a ground at `ground_m`, then LAND.
    fn descend(&mut self, point: LocalPoint, ground_m: f64, activity: Activity, windows: &[CalmWindow], step: &mut Step) {
        let heights = self.heights(ground_m, step);
        let above_ground_m = heights.low_m;
        let waits = self.waits_for_calm(above_ground_m, windows, step.now);
        if above_ground_m <= self.config.limits.land_mode_height_m && !waits {
            self.request(Command::SetMode(FlightMode::Land), step.now, step.outputs);
        }
        let limits = &self.config.limits;
        let off_m = step.distance_m(point);
        // Blown aside: back over the place first, at this height.
        let goes_down = off_m <= 2.0 * limits.landing_radius_m;
        let above_m = if waits { limits.calm_height_m } else { (limits.land_mode_height_m - BELOW_M).max(0.1) };
        // In the autopilot's heights, since it is the autopilot who flies there.
        let bottom_m = ground_m + above_m - heights.correction_m;
        let height_m = if goes_down { bottom_m } else { step.height_m().max(bottom_m) };
        let floor_m =
            (step.height_m() - LEAD_DOWN_M).clamp(bottom_m.min(limits.safe_height_m), limits.safe_height_m.max(bottom_m));
        self.drive(at(point, height_m), Vector3::zeros(), None, floor_m, step);
        if self.stands(goes_down && step.height_m() > bottom_m + STOOD_ABOVE_M, step) {
            self.request(Command::SetMode(FlightMode::Land), step.now, step.outputs);
        }
        let calm = if waits { ", waiting for calm" } else { "" };
        self.set(activity, format!("{above_ground_m:.1} m up, {off_m:.1} m off{calm}"));
    }

    /// Whether it stands on something though the autopilot's height says that there is further to go: a barometer drifts by metres, and without
    /// a rangefinder nothing else tells. LAND finds the ground, and stops the motors.
    fn stands(&mut self, goes_down: bool, step: &Step) -> bool {
        let sinks = !goes_down || step.own.velocity_ned_mps.z > STOOD_MPS;
        self.landing.stood_s = if sinks { 0.0 } else { self.landing.stood_s + step.dt_s };
        let stands = self.landing.stood_s >= STOOD_S;
        if stands && self.landing.stood_s - step.dt_s < STOOD_S {
            let why = format!("{:.1} m up by the autopilot, and it sinks no further: LAND", step.height_m());
            self.note(Severity::Warning, "the descent has ended early", why);
        }
        stands
    }

    /// Whether to wait at the calm height: windows are offered, none is where a descent from there would end, and it hasn't waited
    /// too long. Once it goes on it doesn't stop again: the clearance alone permits the landing.
    fn waits_for_calm(&mut self, above_ground_m: f64, windows: &[CalmWindow], now: Stamp) -> bool {
        if self.landing.calm_over || windows.is_empty() {
            return false;
        }
        let limits = &self.config.limits;
        if above_ground_m > limits.calm_height_m + AT_CALM_M {
            return true;
        }
        let touchdown = now.plus_secs_f64(above_ground_m.max(0.0) / limits.descent_mps);
        let calm = windows.iter().any(|window| window.from <= touchdown && touchdown <= window.to);
        let since = *self.landing.calm_since.get_or_insert(now);
        self.landing.calm_over = calm || now.seconds_since(since) >= limits.calm_wait_s;
        !self.landing.calm_over
    }

    /// In LAND mode, which we set.
    pub(super) fn in_land_mode(&mut self, goal: &Goal, step: &mut Step) {
        self.reference = None;
        let home = self.home(step.own).map(|home| LocalPoint::from(self.config.frame.ned_from_geodetic(home)));
        let limits = &self.config.limits;
        let at_home = home.is_some_and(|home| step.distance_m(home) <= 3.0 * limits.landing_radius_m);
        let ground_m = if at_home { self.config.home_height_m } else { 0.0 };
        let commit_m = limits.commit_height_m;
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
        let committed = self.heights(ground_m, step).high_m <= commit_m;
        match problem {
            Some(problem) if !committed => {
                self.break_off(problem, step.now);
                self.request(Command::SetMode(FlightMode::Guided), step.now, step.outputs);
                return self.set(Activity::FailSafe { reason: format!("{problem}: stopped and climbing") }, "");
            }
            _ if *goal == Goal::Return => self.set(Activity::Returning, "landing at home"),
            _ => self.set(Activity::Descending, if committed { "committed" } else { "in LAND" }),
        }
        self.stop_afloat(ground_m, step);
    }

    /// Floating with the motors on, it asks the autopilot to stop them, which refuses in the air. Only when it has refused, and two
    /// witnesses have said for twice the time that the vehicle is on the surface and stays there, are they stopped all the same:
    /// the autopilot's height, within a metre of it and no lower than waves make it for all of LAND's coming down, and the
    /// rangefinder, at every reading.
    fn stop_afloat(&mut self, ground_m: f64, step: &mut Step) {
        let by_range_m = self.landing.surface.range_height_m(step.now);
        self.landing.afloat.step(step.height_m() - ground_m, by_range_m, step.dt_s);
        let (afloat, afloat_s) = (self.landing.afloat, self.config.fail_safe.afloat_s);
        let sure = afloat.witnessed_s() >= 2.0 * afloat_s && by_range_m.is_some();
        let refused = self
            .pending
            .as_ref()
            .is_some_and(|pending| pending.declined && pending.command == Command::Disarm { force: false });
        if sure && refused {
            let why =
                format!("on the surface for {:.0} s by height and rangefinder, and the autopilot refused", afloat.for_s());
            self.note(Severity::Critical, "stopping the motors afloat", why);
            self.request(Command::Disarm { force: true }, step.now, step.outputs);
        } else if afloat.for_s() >= afloat_s {
            self.request(Command::Disarm { force: false }, step.now, step.outputs);
        }
    }

    fn break_off(&mut self, problem: &str, now: Stamp) {
        if self.descending {
            self.note(Severity::Critical, "descent broken off", problem);
        }
        self.descending = false;
        self.landing.start();
        self.settle.reset();
        self.uncleared.get_or_insert(now);
    }
}
