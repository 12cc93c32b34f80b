//! The fail-safes that watch over every flight.
//!
//! | what happens | what it does | until |
//! |---|---|---|
//! | autopilot silent | sends nothing; the autopilot hovers by itself | it is heard |
//! | pilot, or the autopilot's own fail-safe, changes the mode | hands off, commands under way withdrawn | GUIDED is set again |
//! | estimator or GNSS bad | stops; then asks for LAND | it is good again, before LAND |
//! | battery under the land fraction | LAND where it is | disarmed |
//! | outside the fence | returns | inside, and a new task |
//! | battery under the return fraction, or unknown too long | returns | disarmed |
//! | plan lapsed (planner, bus or mesh lost) | holds, then returns; a descent stops and climbs | a newer plan |
//! | leader silent, not flying, or in another mode | holds, then returns | it may be followed again |
//! | clearance lapsed in a descent | stops, climbs to the approach height, waits, then returns | a new clearance |
//!
//! The first two and the last are in [`super::executor`], beside what they interrupt; the others are decided here, the weightiest first.

use halcyon_model::{Stamp, VehicleState};

use super::interlock::FollowRefusal;
use super::limits::FailSafeLimits;

/// Over the fence by more than this is a breach, metres: setpoints end inside it.
const FENCE_MARGIN_M: f64 = 5.0;

/// Which fail-safe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the table above says it")]
pub enum Cause {
    Estimator,
    BatteryLand,
    Fence,
    BatteryReturn,
    StalePlan,
    Leader,
    Clearance,
}

/// What it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Stop and hold here.
    Hold,
    /// Fly home and land.
    Return,
    /// LAND mode, here.
    Land,
}

/// A fail-safe in charge.
#[derive(Debug, Clone, PartialEq)]
pub struct Alarm {
    /// Which.
    pub cause: Cause,
    /// What it does now.
    pub action: Action,
    /// For people.
    pub reason: String,
}

/// How the plan stands that the vehicle acts under.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum PlanHealth {
    /// It holds, or no plan is needed for what the vehicle does.
    Good,
    /// It lapsed, or never came after a restart in flight.
    Lapsed,
}

/// What is looked at.
#[derive(Debug)]
pub struct Conditions<'a> {
    /// The vehicle's own state.
    pub own: &'a VehicleState,
    /// How the plan stands.
    pub plan: PlanHealth,
    /// For a follower that follows: whether it may.
    pub follow: Option<Result<(), FollowRefusal>>,
    /// Whether it is on its way home already.
    pub homeward: bool,
}

/// Watches one flight.
#[derive(Debug, Clone, Default)]
pub struct FailSafes {
    estimator_bad: Option<Stamp>,
    battery_unknown: Option<Stamp>,
    battery_low: bool,
    battery_empty: bool,
    outside: bool,
    plan_lapsed: Option<Stamp>,
    leader_lost: Option<Stamp>,
}

impl FailSafes {
    /// A new task was given inside the fence: a breach that is over is forgotten.
    pub fn new_task(&mut self) {
        self.outside = false;
    }

    /// The alarm in charge at `now`, if any. Call at every step in flight.
    pub fn step(&mut self, conditions: &Conditions, limits: &FailSafeLimits, now: Stamp) -> Option<Alarm> {
        let own = conditions.own;
        let since = |start: &mut Option<Stamp>, bad: bool| -> Option<f64> {
            *start = bad.then(|| start.unwrap_or(now));
            start.map(|start| now.seconds_since(start))
        };
        let estimator_s = since(&mut self.estimator_bad, !own.estimator_ok);
        let unknown_s = since(&mut self.battery_unknown, own.battery_fraction.is_none());
        let lapsed_s = since(&mut self.plan_lapsed, conditions.plan == PlanHealth::Lapsed);
        let refused = conditions.follow.as_ref().and_then(|follow| follow.as_ref().err());
        let leader_s = since(&mut self.leader_lost, refused.is_some());
        if let Some(fraction) = own.battery_fraction {
            self.battery_empty |= fraction <= limits.battery_land_fraction;
            self.battery_low |= fraction <= limits.battery_return_fraction;
        }
        self.battery_low |= unknown_s.is_some_and(|unknown_s| unknown_s >= limits.battery_unknown_s);
        let distance_m = own.position_ned_m.xy().norm();
        let height_m = -own.position_ned_m.z;
        // Where a bad estimator believes itself to be says nothing.
        self.outside |= own.estimator_ok
            && (distance_m > limits.fence_radius_m + FENCE_MARGIN_M || height_m > limits.fence_height_m + FENCE_MARGIN_M);

        let alarm = |cause, action, reason: String| Some(Alarm { cause, action, reason });
        let hold_then_return = |held_s: f64| if held_s >= limits.hold_s { Action::Return } else { Action::Hold };
        if let Some(bad_s) = estimator_s.filter(|bad_s| *bad_s >= limits.estimator_bad_s) {
            let fix = own.fix.map_or("no fix heard".to_owned(), |fix| format!("fix kind {}", fix.kind));
            let land = bad_s >= limits.estimator_bad_s + limits.estimator_land_s;
            let action = if land { Action::Land } else { Action::Hold };
            return alarm(Cause::Estimator, action, format!("position not good enough to fly by ({fix})"));
        }
        let percent = own.battery_fraction.map_or("unknown".to_owned(), |fraction| format!("{:.0} %", 100.0 * fraction));
        if self.battery_empty {
            return alarm(Cause::BatteryLand, Action::Land, format!("battery {percent}: landing here"));
        }
        if self.outside {
            let reason = format!("outside the fence ({distance_m:.0} m out, {height_m:.0} m up)");
            return alarm(Cause::Fence, Action::Return, reason);
        }
        if self.battery_low {
            return alarm(Cause::BatteryReturn, Action::Return, format!("battery {percent}: returning"));
        }
        if conditions.homeward {
            // Already doing what the rest would have it do.
            return None;
        }
        if let Some(lapsed_s) = lapsed_s {
            return alarm(Cause::StalePlan, hold_then_return(lapsed_s), "no valid plan".into());
        }
        if let (Some(leader_s), Some(refused)) = (leader_s, refused) {
            return alarm(Cause::Leader, hold_then_return(leader_s), refused.to_string());
        }
        None
    }
}
