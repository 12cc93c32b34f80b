//! The fail-safes that watch over every flight. Each row names its test, in `tests/failsafes.rs`, `tests/mishaps.rs` or `tests/pilot.rs`.
//!
//! | what happens | what it does | until | test |
//! |---|---|---|---|
//! | autopilot silent | sends nothing; the autopilot hovers by itself | it is heard | `a_silent_autopilot_is_sent_nothing_and_taken_up_again` |
//! | autopilot starts again in flight | hands off, everything under way withdrawn, streams asked for again | GUIDED is set | `an_autopilot_that_starts_again_in_flight_is_left_alone_until_guided_is_set` |
//! | pilot changes the mode | hands off, commands under way withdrawn; after he has landed, too | GUIDED is set again | `the_pilot_is_never_fought_and_hands_back_with_guided` |
//! | a ground station on the relay flies it in GUIDED | the same | the same | `a_ground_station_that_flies_it_in_guided_is_a_pilot` |
//! | the autopilot's own fail-safe changes it | the same | the same | `the_autopilots_own_fail_safe_is_not_fought_either_and_is_named` |
//! | somebody stops the motors before a take-off | the same | the same | `motors_that_somebody_stopped_on_the_ground_stay_off_until_guided_is_set` |
//! | motors stop in the air, or by a termination | the same | the same | `motors_that_stopped_in_the_air_stay_off_until_guided_is_set` |
//! | guidance has nothing more to do in the air | holds | a task | `with_nothing_more_to_do_it_holds_and_does_not_fly_on` |
//! | estimator or GNSS bad | stops; then asks for LAND | it is good again; once in LAND, for 5 s | `a_bad_estimator_stops_then_lands` |
//! | battery under the land fraction | LAND where it is | disarmed | `battery_low_returns_and_stays_returning_battery_empty_lands_here` |
//! | own position jumps | stops on velocity, no setpoint goes after it; then asks for LAND if it jumps on | it has settled and the estimator is good; once in LAND, for 5 s | `a_position_that_jumps_is_not_flown_after_and_is_believed_once_settled` |
//! | outside the fence | returns | inside, and a new task | `outside_the_fence_it_returns_and_a_task_outside_is_refused` |
//! | battery under the return fraction | returns | disarmed | `battery_low_returns_and_stays_returning_battery_empty_lands_here` |
//! | battery just enough for the way home | returns | disarmed | `a_battery_that_just_suffices_for_the_way_home_sends_it_there` |
//! | battery unknown too long | returns | disarmed | `battery_unknown_for_long_returns` |
//! | plan lapsed (planner, bus or mesh lost) | holds, then returns; a descent stops and climbs | a newer plan | `a_lapsed_plan_holds_then_returns_and_a_newer_one_is_taken_up_again` |
//! | leader silent | predicted for 1 s, held for until 5 s, then returns | it is heard | `a_silent_leader_is_predicted_then_waited_for_then_given_up` |
//! | leader in another mode, or not flying | holds, then returns | it may be followed again | `a_leader_that_leaves_the_allowed_modes_ends_the_following` |
//! | leader's position jumps | holds; both places are kept clear | it has settled | `a_leader_that_jumps_is_not_followed_and_both_places_are_kept_clear` |
//! | autopilot does not follow its targets (outside its own fence, or for another reason) | holds, with its last words; tries again after 15 s, 30 s, 60 s …; not on the way home, where it is said | it follows, or a new task | `targets_that_the_autopilot_ignores_are_held_for_and_tried_again` |
//! | clearance lapsed or withdrawn in a descent | stops, climbs to the approach height, waits, then returns | a new clearance | `a_withdrawn_clearance_stops_the_descent_climbs_waits_and_returns` |
//! | our clock set back, or stood still | everything dated goes back with it: nothing lasts longer | | `a_clock_that_goes_back_lengthens_nothing` |
//! | our clock set forward | plans and clearances lapse; nothing else is rushed | a newer plan | `a_clock_that_goes_forward_lapses_permissions_and_rushes_nothing` |
//! | home moves in flight | said, and flown to where it took off | | `a_home_that_moves_in_flight_is_not_flown_to` |
//! | another vehicle with the same name | said; no take-off | it is silent | `another_vehicle_with_the_same_name_is_told_and_not_taken_off_beside` |
//! | rangefinder and autopilot's height disagree in a descent | said, and the safer counts | they agree | `a_rangefinder_that_disagrees_makes_it_careful` |
//! | a descent sinks no further, though the height says that there is further to go | LAND, and said | | `a_descent_ends_on_the_water_though_the_height_says_that_there_is_further_to_go` |
//! | this service is stopped in flight | a last target that stops the vehicle | | `the_last_target_stops_the_vehicle` |
//! | afloat in LAND with motors on | asks to stop them; at the surface by two witnesses and refused, stops them | | `afloat_on_waves_the_motors_stop_though_the_autopilot_finds_no_end` |
//!
//! What a landing needs is in [`super::executor`], beside what it interrupts; the others are decided here, the weightiest first.
//! A pilot, or an autopilot's own fail-safe, is above them all ([`super::control`]).

use halcyon_model::{Stamp, VehicleState};

use super::energy::Consumption;
use super::heed::NotFollowed;
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
    Jump,
    Fence,
    BatteryReturn,
    StalePlan,
    Leader,
    Unheeded,
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
    /// Its position jumped and hasn't settled: by how much, metres.
    pub jumped_m: Option<f64>,
    /// How long the way home would take in still air, landing included, seconds; `None` if home is unknown.
    pub home_s: Option<f64>,
    /// The autopilot does not follow its targets.
    pub unheeded: Option<&'a NotFollowed>,
}

/// For how long something has been so, seconds, as far as it was watched: a clock that leaps makes nothing last longer.
#[derive(Debug, Clone, Copy, Default)]
struct Lasting(Option<f64>);

impl Lasting {
    fn step(&mut self, is_so: bool, dt_s: f64) -> Option<f64> {
        self.0 = is_so.then(|| self.0.map_or(0.0, |for_s| for_s + dt_s));
        self.0
    }
}

/// A landing that was begun for a bad estimator or a jump goes on until that has been over for so long, seconds: what comes and goes
/// would have it go up and down.
const RECOVERED_S: f64 = 5.0;
/// Two steps are taken to be no further apart than this, seconds.
const STEP_S_MAX: f64 = 1.5;

/// Watches one flight.
#[derive(Debug, Clone, Default)]
pub struct FailSafes {
    stepped: Option<Stamp>,
    estimator_bad: Lasting,
    battery_unknown: Lasting,
    battery_short: Lasting,
    battery_out: Lasting,
    consumption: Consumption,
    battery_low: Option<String>,
    battery_empty: bool,
    jumped: Lasting,
    outside: bool,
    plan_lapsed: Lasting,
    leader_lost: Lasting,
    /// The landing that was begun, and for how long its reason has been gone, seconds.
    landing: Option<(Alarm, f64)>,
}

impl FailSafes {
    /// A new task was given inside the fence: a breach that is over is forgotten.
    pub fn new_task(&mut self) {
        self.outside = false;
    }

    /// Somebody else flies: what was begun for a bad estimator is over, and what is bad counts from when it is handed back.
    pub fn released(&mut self) {
        self.landing = None;
        self.estimator_bad = Lasting::default();
        self.jumped = Lasting::default();
    }

    /// The charge that the way home needs, reserve included, as a fraction.
    fn fraction_home(&self, home_s: f64, limits: &FailSafeLimits) -> f64 {
        let rate_hz = self.consumption.rate_hz(limits.battery_endurance_s);
        limits.battery_land_fraction + rate_hz * home_s * limits.battery_home_factor
    }

    /// Looks at the battery. A reading that isn't a number is none; one that is low counts once it has been so for a while.
    fn watch_battery(&mut self, conditions: &Conditions, limits: &FailSafeLimits, dt_s: f64) {
        let fraction = conditions.own.battery_fraction.filter(|fraction| fraction.is_finite());
        self.consumption.observe(fraction, dt_s);
        let unknown_s = self.battery_unknown.step(fraction.is_none(), dt_s);
        if unknown_s.is_some_and(|unknown_s| unknown_s >= limits.battery_unknown_s) {
            self.battery_low.get_or_insert_with(|| "battery unknown: returning".into());
        }
        // Unknown for a moment, a low battery is not full again.
        let Some(fraction) = fraction else { return };
        let percent = 100.0 * fraction;
        let for_home = conditions.home_s.map(|home_s| self.fraction_home(home_s, limits));
        let short = fraction <= limits.battery_return_fraction || for_home.is_some_and(|needed| fraction <= needed);
        let counts = |for_s: Option<f64>| for_s.is_some_and(|for_s| for_s >= limits.battery_low_s);
        self.battery_empty |= counts(self.battery_out.step(fraction <= limits.battery_land_fraction, dt_s));
        if counts(self.battery_short.step(short, dt_s)) {
            let reason = match for_home {
                Some(needed) if fraction > limits.battery_return_fraction => {
                    format!("battery {percent:.0} %, and {:.0} % needed for the way home: returning", 100.0 * needed)
                }
                _ => format!("battery {percent:.0} %: returning"),
            };
            self.battery_low.get_or_insert(reason);
        }
    }

    /// The alarm in charge at `now`, if any. Call at every step in flight.
    pub fn step(&mut self, conditions: &Conditions, limits: &FailSafeLimits, now: Stamp) -> Option<Alarm> {
        let dt_s = self.stepped.map_or(0.0, |stepped| now.seconds_since(stepped)).clamp(0.0, STEP_S_MAX);
        self.stepped = Some(now);
        let alarm = self.now(conditions, limits, dt_s);
        if let Some(alarm) = alarm.as_ref().filter(|alarm| alarm.action == Action::Land) {
            self.landing = Some((alarm.clone(), 0.0));
        }
        let Some((landing, gone_s)) = &mut self.landing else { return alarm };
        let is_bad = !conditions.own.estimator_ok || conditions.jumped_m.is_some();
        *gone_s = if is_bad { 0.0 } else { *gone_s + dt_s };
        if *gone_s < RECOVERED_S {
            return Some(landing.clone());
        }
        self.landing = None;
        alarm
    }

    /// As things stand, whatever was begun.
    fn now(&mut self, conditions: &Conditions, limits: &FailSafeLimits, dt_s: f64) -> Option<Alarm> {
        let own = conditions.own;
        let estimator_s = self.estimator_bad.step(!own.estimator_ok, dt_s);
        let lapsed_s = self.plan_lapsed.step(conditions.plan == PlanHealth::Lapsed, dt_s);
        let refused = conditions.follow.as_ref().and_then(|follow| follow.as_ref().err());
        let leader_s = self.leader_lost.step(refused.is_some(), dt_s);
        let jumped_s = self.jumped.step(conditions.jumped_m.is_some(), dt_s);
        self.watch_battery(conditions, limits, dt_s);
        let distance_m = own.position_ned_m.xy().norm();
        let height_m = -own.position_ned_m.z;
        // Where a bad estimator believes itself to be says nothing.
        self.outside |= own.estimator_ok
            && conditions.jumped_m.is_none()
            && (distance_m > limits.fence_radius_m + FENCE_MARGIN_M || height_m > limits.fence_height_m + FENCE_MARGIN_M);

        let alarm = |cause, action, reason: String| Some(Alarm { cause, action, reason });
        let hold_then_return = |held_s: f64| if held_s >= limits.hold_s { Action::Return } else { Action::Hold };
        if let Some(bad_s) = estimator_s.filter(|bad_s| *bad_s >= limits.estimator_bad_s) {
            let fix = own.fix.map_or("no fix heard".to_owned(), |fix| format!("fix kind {}", fix.kind));
            let land = bad_s >= limits.estimator_bad_s + limits.estimator_land_s;
            let action = if land { Action::Land } else { Action::Hold };
            return alarm(Cause::Estimator, action, format!("position not good enough to fly by ({fix})"));
        }
        if self.battery_empty {
            let percent = own.battery_fraction.map_or("unknown".to_owned(), |fraction| format!("{:.0} %", 100.0 * fraction));
            return alarm(Cause::BatteryLand, Action::Land, format!("battery {percent}: landing here"));
        }
        if let (Some(by_m), Some(jumped_s)) = (conditions.jumped_m, jumped_s) {
            let action = if jumped_s >= limits.jump_land_s { Action::Land } else { Action::Hold };
            return alarm(Cause::Jump, action, format!("own position jumped by {by_m:.0} m"));
        }
        if self.outside {
            let reason = format!("outside the fence ({distance_m:.0} m out, {height_m:.0} m up)");
            return alarm(Cause::Fence, Action::Return, reason);
        }
        if let Some(reason) = &self.battery_low {
            return alarm(Cause::BatteryReturn, Action::Return, reason.clone());
        }
        if conditions.homeward {
            // Already doing what the rest would have it do.
            return None;
        }
        if let Some(lapsed_s) = lapsed_s {
            return alarm(Cause::StalePlan, hold_then_return(lapsed_s), "no valid plan".into());
        }
        if let (Some(leader_s), Some(refused)) = (leader_s, refused) {
            let action = match refused {
                // It was waited for already, predicted and then held for, while it was followed. Never heard, it may yet come.
                FollowRefusal::Silent { silent_s, .. } if silent_s.is_finite() => Action::Return,
                _ => hold_then_return(leader_s),
            };
            return alarm(Cause::Leader, action, refused.to_string());
        }
        conditions.unheeded.and_then(|refusal| alarm(Cause::Unheeded, Action::Hold, refusal.to_string()))
    }
}
