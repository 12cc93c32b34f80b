//! Whether the autopilot does what its targets say. ArduCopter in GUIDED drops a target outside its own fence without a word, and goes
//! on to the last one that it took; so does whatever else it finds fault with.
//!
//! What it was told to move and what it moved are summed up over a few seconds. A vehicle that lags, starts slowly or is blown about
//! makes part of the way; one that does not listen makes none of it, for as long as it is told. One that leans into its way tries:
//! wind holds it, or its load. Descents are left out, since they may end on something.

use std::collections::VecDeque;

use halcyon_model::VehicleState;
use nalgebra::Vector3;

/// What is looked back at, seconds.
const WINDOW_S: f64 = 4.0;
/// Told to move by less than this in that time, nothing can be told, metres.
const TOLD_M_MIN: f64 = 2.5;
/// Having moved less than this share of it, it doesn't follow; and more than that one, it does.
const IGNORED_SHARE: f64 = 0.15;
const FOLLOWED_SHARE: f64 = 0.5;
/// For so long without a break before it counts, seconds: longer than any lag.
const IGNORED_S: f64 = 3.0;
/// A lean that pushes it this hard along the way is a try, metres per second squared.
const TRIES_MPS2: f64 = 3.0;
/// Steeper down than this, a way is a descent: the sine.
const DESCENT: f64 = 0.7;
/// A state older than this tells nothing, seconds.
const STALE_S: f64 = 1.5;
/// Held for so long before the target is tried again, seconds; twice as long each time, up to the last.
const HOLD_S: f64 = 15.0;
const HOLD_S_MAX: f64 = 60.0;
/// A try that tells nothing in this time is over, seconds: nothing was asked of the autopilot.
const TRY_S: f64 = 10.0;
const GRAVITY_MPS2: f64 = 9.806_65;

/// The autopilot does not follow its targets.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the autopilot does not follow its targets; its own fence?{}", .words.as_ref().map(|words| format!(" (it said: {words})")).unwrap_or_default())]
pub struct NotFollowed {
    /// What it said last, if it said something lately.
    pub words: Option<String>,
}

/// What a step brought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    /// It does not follow.
    Ignored,
    /// It follows again, or nothing is asked of it any more.
    Heeded,
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    dt_s: f64,
    told_m: Vector3<f64>,
    flown_m: Vector3<f64>,
    position_m: Vector3<f64>,
}

#[derive(Debug, Clone, Copy, Default, PartialEq)]
enum State {
    #[default]
    Watching,
    Holding {
        left_s: f64,
    },
    Trying {
        for_s: f64,
    },
}

/// Watches one autopilot.
#[derive(Debug, Clone, Default)]
pub struct Heed {
    window: VecDeque<Sample>,
    ignored_s: f64,
    state: State,
    holds_s: Option<f64>,
}

impl Heed {
    /// Something else is flown, or by somebody else: what was is of no account.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Whether it was found not to follow, and hasn't since.
    #[must_use]
    pub fn is_ignored(&self) -> bool {
        self.state != State::Watching
    }

    /// Whether to hold where it is rather than to try the target.
    #[must_use]
    pub fn holds(&self) -> bool {
        matches!(self.state, State::Holding { .. })
    }

    /// A step of `dt_s` in which the autopilot was told to move at `told_mps` (north, east, down), or not told anything. `age_s` is how
    /// old its own state is.
    pub fn step(&mut self, told_mps: Option<Vector3<f64>>, own: &VehicleState, age_s: f64, dt_s: f64) -> Option<Change> {
        let told_mps = told_mps.filter(|_| age_s <= STALE_S && own.estimator_ok);
        if let Some(told_mps) = told_mps {
            self.look(told_mps, own, dt_s);
        } else {
            self.window.clear();
            self.ignored_s = 0.0;
        }
        let follows = self.share(own).is_some_and(|share| share >= FOLLOWED_SHARE);
        let ignores = self.ignored_s >= IGNORED_S;
        let (state, change) = match self.state {
            State::Watching if ignores => (self.hold(), Some(Change::Ignored)),
            State::Holding { .. } | State::Trying { .. } if follows => (State::Watching, Some(Change::Heeded)),
            State::Holding { left_s } if left_s <= dt_s => {
                self.window.clear();
                self.ignored_s = 0.0;
                (State::Trying { for_s: 0.0 }, None)
            }
            State::Holding { left_s } => (State::Holding { left_s: left_s - dt_s }, None),
            State::Trying { .. } if ignores => (self.hold(), None),
            State::Trying { for_s } if for_s > TRY_S && self.ignored_s <= 0.0 => (State::Watching, Some(Change::Heeded)),
            State::Trying { for_s } => (State::Trying { for_s: for_s + dt_s }, None),
            State::Watching => (State::Watching, None),
        };
        if state == State::Watching {
            self.holds_s = self.holds_s.filter(|_| change.is_none());
        }
        self.state = state;
        change
    }

    fn hold(&mut self) -> State {
        let left_s = self.holds_s.map_or(HOLD_S, |held_s| (2.0 * held_s).min(HOLD_S_MAX));
        self.holds_s = Some(left_s);
        self.window.clear();
        self.ignored_s = 0.0;
        State::Holding { left_s }
    }

    fn look(&mut self, told_mps: Vector3<f64>, own: &VehicleState, dt_s: f64) {
        let (told_m, flown_m) = (told_mps * dt_s, own.velocity_ned_mps * dt_s);
        self.window.push_back(Sample { dt_s, told_m, flown_m, position_m: own.position_ned_m });
        let mut length_s: f64 = self.window.iter().map(|sample| sample.dt_s).sum();
        while length_s > WINDOW_S {
            length_s -= self.window.pop_front().map_or(length_s, |sample| sample.dt_s);
        }
        let ignores = self.share(own).is_some_and(|share| share < IGNORED_SHARE) && !self.tries(own);
        self.ignored_s = if ignores { self.ignored_s + dt_s } else { 0.0 };
    }

    fn told_m(&self) -> Vector3<f64> {
        self.window.iter().map(|sample| sample.told_m).sum()
    }

    /// Which share of what it was told to move it has moved, by the better of two witnesses: its velocity, and its place. `None` if it
    /// wasn't told enough.
    fn share(&self, own: &VehicleState) -> Option<f64> {
        let told_m = self.told_m();
        let length_m = told_m.norm();
        if length_m < TOLD_M_MIN || told_m.z > DESCENT * length_m {
            return None;
        }
        let flown_m: Vector3<f64> = self.window.iter().map(|sample| sample.flown_m).sum();
        let moved_m = own.position_ned_m - self.window.front()?.position_m;
        Some(flown_m.dot(&told_m).max(moved_m.dot(&told_m)) / length_m.powi(2))
    }

    /// Whether it leans into its way.
    fn tries(&self, own: &VehicleState) -> bool {
        let up = own.ned_from_body * Vector3::new(0.0, 0.0, -1.0);
        // Upside down it tries nothing.
        let push_mps2 = Vector3::new(up.x, up.y, 0.0) * (GRAVITY_MPS2 / (-up.z).max(0.1));
        let told_m = self.told_m();
        told_m.norm() > 0.0 && push_mps2.dot(&told_m) / told_m.norm() >= TRIES_MPS2
    }
}
