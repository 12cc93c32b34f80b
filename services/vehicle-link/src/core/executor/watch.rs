//! What must not change from one moment to the next, watched: positions that jump, the autopilot's own time, our clock, home, and
//! the vehicle's name.

use std::collections::{BTreeMap, VecDeque};

use halcyon_model::{Geodetic, LandedState, Severity, Stamp, VehicleId, VehicleState};
use nalgebra::Vector3;

use super::flight::{LOW_M, REFUSED_MPS, Step};
use super::{Executor, Home, Output};
use crate::core::boot::{BootWatch, Finding};
use crate::core::guidance::{Setpoint, limit_velocity};
use crate::core::jump::JumpWatch;
use crate::core::separation::{self, Obstacle};
use crate::core::track::Track;

/// Our clock is back when it is by more than this, seconds: ticks may be dated a little late.
const BACK_S: f64 = 1.0;
/// Steps further apart than this were held up, or our clock went forward, seconds.
const HELD_UP_S: f64 = 5.0;
/// Home that moved in flight by more than this is not flown to, metres.
const HOME_MOVED_M: f64 = 5.0;
/// The home that the autopilot sets when it arms may be heard so late, seconds after it left the ground.
const HOME_LATE_S: f64 = 5.0;
/// A vehicle that has been silent for so long is forgotten if another wants its place, seconds.
const FORGOTTEN_S: f64 = 60.0;
/// Own stamps remembered, to know our own voice by: several seconds of them.
const OWN_STAMPS_MAX: usize = 128;
/// So many states under our name that we didn't say are another vehicle's; and it is gone after so long a silence, seconds.
const TWIN_STATES: u32 = 3;
const TWIN_S: f64 = 10.0;

/// A jump of our own position that hasn't settled.
#[derive(Debug, Clone, Copy)]
struct Jumped {
    /// From where the vehicle would be without it, metres.
    by_m: Vector3<f64>,
    /// The last jump.
    at: Stamp,
}

/// Another vehicle's position, watched; and by how much it jumped, until when it may still be where it was.
#[derive(Debug, Clone, Default)]
struct Other {
    watch: JumpWatch,
    jumped: Option<(Vector3<f64>, Stamp)>,
}

/// Somebody else under our name.
#[derive(Debug, Clone, Copy)]
struct Twin {
    states: u32,
    heard: Stamp,
}

/// Everything that is watched.
#[derive(Debug, Clone, Default)]
pub(super) struct Watch {
    position: JumpWatch,
    boot: BootWatch,
    jumped: Option<Jumped>,
    others: BTreeMap<VehicleId, Other>,
    latest: Option<Stamp>,
    /// Home as it was when the vehicle left the ground.
    home: Option<Geodetic>,
    home_moved: bool,
    /// Home before the autopilot started again away from it: its heights were above that one.
    lost_home: Option<Geodetic>,
    off_the_ground: Option<Stamp>,
    own_stamps: VecDeque<Stamp>,
    twin: Option<Twin>,
}

impl Executor {
    /// Call first with every `now` that comes in.
    pub(super) fn watch_clock(&mut self, now: Stamp) {
        let back_s = self.watch.latest.map_or(0.0, |latest| latest.seconds_since(now));
        if back_s > BACK_S {
            self.watch.boot.clock_went_back(back_s);
            self.clock_went_back(back_s, now);
        }
        // A little back is late, not earlier.
        self.watch.latest = Some(if (0.0..=BACK_S).contains(&back_s) { now.plus_secs_f64(back_s) } else { now });
    }

    /// Our clock lost `by_s`: whatever is dated by it, is dated back, so that nothing holds longer and nothing looks newer.
    fn clock_went_back(&mut self, by_s: f64, now: Stamp) {
        let earlier = |stamp: &mut Stamp| *stamp = stamp.plus_secs_f64(-by_s);
        self.shift_timers(-by_s);
        if let Some(own) = &mut self.own {
            earlier(&mut own.state.stamp);
            earlier(&mut own.mode_heard);
        }
        if let Some(plan) = &mut self.plan {
            earlier(&mut plan.valid_until);
        }
        let goals = self.plan_goal.iter_mut().chain(self.direct.iter_mut().map(|direct| &mut direct.goal));
        for goal in goals {
            if let super::Goal::Land { clearance: Some(clearance), .. } = goal {
                earlier(&mut clearance.valid_until);
            }
        }
        self.control.clock_went_back(by_s);
        self.watch.position.clock_went_back(by_s);
        for track in self.neighbours.values_mut() {
            let mut state = track.state.clone();
            state.stamp = state.stamp.min(now);
            *track = Track::new(state, now);
        }
        for other in self.watch.others.values_mut() {
            other.watch = JumpWatch::default();
        }
        self.watch.own_stamps.clear();
        self.watch.twin = None;
        self.landing.surface.reset();
        self.settle.reset();
        let why = format!("by {by_s:.0} s: set back, or stood still; plans and clearances end when they would have");
        self.note(Severity::Warning, "the clock of this computer lost time", why);
    }

    /// What waits for a time to pass goes on waiting as long as it would have.
    fn shift_timers(&mut self, by_s: f64) {
        let timers = [&mut self.restarted_at, &mut self.uncleared, &mut self.stepped, &mut self.landing.calm_since];
        let others = self.pending.iter_mut().map(|pending| &mut pending.at);
        let others = others.chain(self.climb.iter_mut().map(|climb| &mut climb.since));
        let others = others.chain(self.autopilot_words.iter_mut().map(|(at, _)| at));
        let others = others.chain(self.watch.jumped.iter_mut().map(|jumped| &mut jumped.at));
        let others =
            others.chain(self.watch.others.values_mut().filter_map(|other| other.jumped.as_mut().map(|(_, until)| until)));
        for timer in timers.into_iter().filter_map(Option::as_mut).chain(others) {
            *timer = timer.plus_secs_f64(by_s);
        }
    }

    /// A step came: was it held up, or did our clock go forward? Plans and clearances lapse by that; nothing else is rushed.
    pub(super) fn watch_steps(&mut self, now: Stamp) {
        let gap_s = self.stepped.map_or(0.0, |stepped| now.seconds_since(stepped));
        if gap_s > HELD_UP_S {
            self.shift_timers(gap_s);
            let why = format!("for {gap_s:.0} s, or this computer's clock went forward");
            self.note(Severity::Warning, "guidance stood still", why);
        }
    }

    /// The next own state, before it is taken in.
    pub(super) fn watch_self(&mut self, state: &VehicleState, now: Stamp) {
        match self.watch.boot.observe(state.boot_s, now) {
            Some(Finding::Restarted) => self.autopilot_restarted(),
            Some(Finding::WentBack(by_s)) => self.clock_went_back(by_s, now),
            Some(Finding::WentForward(by_s)) => {
                let why = format!("by {by_s:.0} s: plans and clearances may have lapsed early");
                self.note(Severity::Warning, "the clock of this computer went forward", why);
            }
            None => {}
        }
        if self.watch.own_stamps.back() != Some(&state.stamp) {
            self.watch.own_stamps.push_back(state.stamp);
            if self.watch.own_stamps.len() > OWN_STAMPS_MAX {
                self.watch.own_stamps.pop_front();
            }
        }
        if let Some(by_m) = self.watch.position.observe(state, self.config.fail_safe.jump_m)
            && self.airborne
        {
            let before_m = self.watch.jumped.map_or_else(Vector3::zeros, |jumped| jumped.by_m);
            if self.watch.jumped.is_none() {
                let why = format!("by {:.1} m: holding until it has settled", by_m.norm());
                self.note(Severity::Critical, "own position jumped", why);
            }
            self.watch.jumped = Some(Jumped { by_m: before_m + by_m, at: now });
        }
        self.watch_home(state, now);
    }

    fn autopilot_restarted(&mut self) {
        let flies = self.goal().is_some_and(|goal| goal.wants_flight());
        let own = self.own.as_ref().map(|own| &own.state);
        self.watch.lost_home = self.watch.home.filter(|home| own.is_some_and(|own| !self.is_near(own, *home)));
        if self.airborne || flies {
            // On the ground, too: who changed its battery may hold it.
            self.control.let_go();
            self.flown = self.goal();
        } else {
            self.control.started_again();
        }
        let (severity, what) = if self.airborne {
            (Severity::Critical, "the autopilot started again in flight")
        } else {
            (Severity::Warning, "the autopilot started again")
        };
        // It knows nothing of what it was asked for.
        self.withdraw = true;
        self.ask_streams = true;
        self.pending = None;
        self.home = Home::Loose;
        self.watch.position = JumpWatch::default();
        let why =
            if self.airborne || flies { "hands off until GUIDED is set" } else { "what it was asked for is asked for again" };
        self.note(severity, what, why);
    }

    fn watch_home(&mut self, state: &VehicleState, now: Stamp) {
        self.watch.off_the_ground = self.airborne.then(|| self.watch.off_the_ground.unwrap_or(now));
        // In the air already when it was first heard, its home is as good as any.
        let late = self.own.is_some() && self.watch.off_the_ground.is_none_or(|at| now.seconds_since(at) < HOME_LATE_S);
        if late && state.home.is_some() {
            self.watch.home = state.home;
            self.watch.home_moved = false;
            return;
        }
        let Some(home) = state.home else { return };
        let kept = *self.watch.home.get_or_insert(home);
        let frame = &self.config.frame;
        let moved_m = (frame.ned_from_geodetic(home) - frame.ned_from_geodetic(kept)).norm();
        if moved_m > HOME_MOVED_M && !self.watch.home_moved {
            self.watch.home_moved = true;
            let why = format!("by {moved_m:.0} m: a return goes to where it took off");
            self.note(Severity::Warning, "home moved in flight", why);
        }
    }

    /// Whether the autopilot started again away from home, and hasn't been there since.
    pub(super) fn lost_home(&self, own: &VehicleState) -> bool {
        self.watch.lost_home.is_some_and(|home| !self.is_near(own, home))
    }

    /// Where a return goes: home as it was when the vehicle left the ground.
    pub(super) fn home(&self, own: &VehicleState) -> Option<Geodetic> {
        self.watch.home.filter(|_| self.airborne).or(own.home)
    }

    /// By how much our own position jumped, metres, until it has settled: no jump for a while, and a good estimator.
    pub(super) fn jumped_m(&mut self, own: &VehicleState, now: Stamp) -> Option<f64> {
        let jumped = self.watch.jumped?;
        if own.estimator_ok && now.seconds_since(jumped.at) >= self.config.fail_safe.jump_settle_s {
            self.watch.jumped = None;
            let why = format!("{:.1} m from where it was thought to be", jumped.by_m.norm());
            self.note(Severity::Warning, "the position has settled", why);
            return None;
        }
        Some(jumped.by_m.norm())
    }

    /// Whether our own position jumped and has not settled.
    pub(super) fn has_jumped(&self) -> bool {
        self.watch.jumped.is_some()
    }

    /// Down: what was watched in flight is over.
    pub(super) fn watch_over(&mut self) {
        self.watch.jumped = None;
        self.watch.home_moved = false;
    }

    /// Stops by velocity: the place that is sent is the one that the autopilot believes in, so that it goes after nothing. Everyone
    /// is kept clear of from where it is and from where it was.
    pub(super) fn ride_out(&mut self, step: &mut Step) {
        let limits = &self.config.limits;
        let low = step.height_m() < limits.safe_height_m - LOW_M;
        let wanted = Vector3::new(0.0, 0.0, if low { -limits.climb_mps } else { 0.0 });
        let by_m = self.watch.jumped.map_or_else(Vector3::zeros, |jumped| jumped.by_m);
        let here = step.here_ned_m;
        let mut velocity_ned_mps = separation::filter(wanted, [here, here - by_m], here, &self.obstacles(step.now), limits);
        limit_velocity(&mut velocity_ned_mps, limits, limits.descent_mps);
        if low {
            velocity_ned_mps.z = velocity_ned_mps.z.min(0.0);
        }
        let above_m = if velocity_ned_mps.z > wanted.z + REFUSED_MPS { step.height_m() } else { limits.safe_height_m };
        let position_ned_m = Vector3::new(here.x, here.y, here.z.min(-above_m));
        step.outputs.push(Output::Setpoint(Setpoint {
            position_ned_m,
            velocity_ned_mps,
            acceleration_ned_mps2: None,
            heading_rad: None,
        }));
        self.reference = None;
        self.held = None;
        self.left_slot();
        self.settle.reset();
    }

    /// Whether one more vehicle can be remembered. What has long been silent and was parked, or is silent for minutes, is forgotten for it.
    pub(super) fn has_room_for_another(&mut self, now: Stamp) -> bool {
        if self.neighbours.len() >= super::NEIGHBOURS_MAX {
            let silent = self.neighbours.iter().map(|(vehicle, track)| (track.unheard_s(now), vehicle));
            let longest = silent.filter(|(unheard_s, _)| *unheard_s >= FORGOTTEN_S).max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some(vehicle) = longest.map(|(_, vehicle)| vehicle.clone()) {
                self.neighbours.remove(&vehicle);
                self.watch.others.remove(&vehicle);
            }
        }
        self.neighbours.len() < super::NEIGHBOURS_MAX
    }

    /// Another vehicle's state, before it is taken in.
    pub(super) fn watch_other(&mut self, state: &VehicleState, now: Stamp) {
        if !self.watch.others.contains_key(&state.vehicle) {
            if self.watch.others.len() >= super::NEIGHBOURS_MAX {
                self.watch.others.retain(|vehicle, _| self.neighbours.contains_key(vehicle));
            }
            if self.watch.others.len() >= super::NEIGHBOURS_MAX {
                return;
            }
            self.watch.others.insert(state.vehicle.clone(), Other::default());
        }
        let fail_safe = &self.config.fail_safe;
        let Some(other) = self.watch.others.get_mut(&state.vehicle) else { return };
        if let Some(by_m) = other.watch.observe(state, fail_safe.jump_m)
            && state.armed
            && state.landed != LandedState::OnGround
        {
            other.jumped = Some((by_m, now.plus_secs_f64(fail_safe.jump_settle_s)));
        }
    }

    /// By how much another vehicle's position has just jumped, metres.
    pub(super) fn other_jumped_m(&self, vehicle: &VehicleId, now: Stamp) -> Option<Vector3<f64>> {
        let (by_m, until) = self.watch.others.get(vehicle)?.jumped?;
        (now < until).then_some(by_m)
    }

    /// The same obstacle at the other place where it may be: where it says that it is, while a leap is taken out of its place; else
    /// where it would be if it hadn't jumped.
    pub(super) fn elsewhere(&self, vehicle: &VehicleId, track: &Track, obstacle: &Obstacle, now: Stamp) -> Option<Obstacle> {
        let leap_m = track.leap_ned_m();
        let off_m = if leap_m.norm() > 0.0 { leap_m } else { -self.other_jumped_m(vehicle, now)? };
        Some(Obstacle { position_ned_m: obstacle.position_ned_m + off_m, ..*obstacle })
    }

    /// A state under our own name: our own voice, or another vehicle's?
    pub(super) fn watch_name(&mut self, state: &VehicleState, now: Stamp) {
        let stamps = &self.watch.own_stamps;
        let oldest = stamps.front();
        // What is older than anything remembered may be our own, before a restart of this service.
        if oldest.is_none_or(|oldest| state.stamp <= *oldest) || stamps.contains(&state.stamp) {
            return;
        }
        let before = self.watch.twin.filter(|twin| now.seconds_since(twin.heard) < TWIN_S);
        let states = before.map_or(0, |twin| twin.states).saturating_add(1);
        self.watch.twin = Some(Twin { states, heard: now });
        if states == TWIN_STATES {
            let why = "two vehicles, or two programs for one, would follow the same plan: give each its own identifier";
            self.note(Severity::Critical, format!("another vehicle calls itself {}", self.config.vehicle), why);
        }
    }

    /// Whether another vehicle under our name has been heard lately.
    pub(super) fn has_twin(&self, now: Stamp) -> bool {
        self.watch.twin.is_some_and(|twin| twin.states >= TWIN_STATES && now.seconds_since(twin.heard) < TWIN_S)
    }
}
