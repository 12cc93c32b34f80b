//! What becomes of it when the autopilot does not follow its targets ([`crate::core::heed`]): held, tried again now and then, and
//! refused to those who ask for the same.

use halcyon_model::{Severity, Stamp, VehicleState};

use super::{Executor, Goal, Output};
use crate::core::heed::{Change, NotFollowed};

/// What the autopilot said no longer ago than this may explain it, seconds.
const WORDS_S: f64 = 30.0;
/// Places and heights nearer to each other than this are the same, metres.
const SAME_M: f64 = 1.0;

impl Executor {
    /// A step in the air is over: was what the autopilot was told before done?
    pub(super) fn watch_heed(&mut self, own: &VehicleState, dt_s: f64, now: Stamp, outputs: &[Output]) {
        let told_mps = outputs.iter().rev().find_map(|output| match output {
            Output::Setpoint(setpoint) => Some(setpoint.velocity_ned_mps),
            _ => None,
        });
        let age_s = now.seconds_since(own.stamp);
        match self.heed.step(told_mps, own, age_s, dt_s) {
            None => {}
            Some(Change::Heeded) => self.unheeded = None,
            Some(Change::Ignored) => {
                let lately = |(at, _): &&(Stamp, String)| (0.0..=WORDS_S).contains(&now.seconds_since(*at));
                let words = self.words.as_ref().filter(lately).map(|(_, words)| words.clone());
                let refusal = NotFollowed { words };
                if matches!(self.flying, Some(Goal::Return)) {
                    // Nothing is held for: to be home is all that is left. But people must know.
                    self.note(Severity::Critical, "not on its way home", refusal.to_string());
                }
                self.unheeded = Some(refusal);
            }
        }
    }

    /// Something else is to be done, or somebody else flies.
    pub(super) fn forget_heed(&mut self) {
        self.heed.reset();
        self.unheeded = None;
    }

    /// Whether the autopilot is known not to follow where `goal` leads.
    pub(super) fn heeds(&self, goal: &Goal) -> Result<(), NotFollowed> {
        let (Some(refusal), Some(active)) = (&self.unheeded, &self.active) else { return Ok(()) };
        let near = |a: Option<f64>, b: Option<f64>| a.zip(b).is_some_and(|(a, b)| (a - b).abs() < SAME_M);
        let away_m = active.place().zip(goal.place()).map(|(a, b)| a.distance_m(&b));
        let same_place = near(away_m, Some(0.0)) && near(active.height_m(), goal.height_m());
        if same_place || active.is_same_as(goal) { Err(refusal.clone()) } else { Ok(()) }
    }
}
