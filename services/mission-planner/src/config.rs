//! `[mission_planner]`: the planner's limits, distances and patience.

use serde::{Deserialize, Serialize};

use crate::core::geometry;

/// Configuration of the mission planner, TOML section `[mission_planner]`. Distances in metres, times in seconds of fleet time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Where missions are stored: a file, made if it is not there, or `:memory:` to forget them at the end.
    pub store: String,
    /// Time between two looks at the world.
    pub step_s: f64,
    /// An unchanged plan is issued again after this, under a new generation, to extend its validity. At most 1.
    pub plan_period_s: f64,
    /// How long a plan is valid. A vehicle whose plan lapsed flies its fail-safe.
    pub plan_validity_s: f64,
    /// How far from the fleet's origin a mission may be. The stand-off and the slots reach further: keep it well inside the
    /// vehicles' own fence.
    pub range_max_m: f64,
    /// Lowest survey height above mean water.
    pub survey_height_min_m: f64,
    /// Greatest survey height above mean water.
    pub survey_height_max_m: f64,
    /// Missions that may be under way at once.
    pub missions_max: usize,
    /// Spots of missions under way must be this far from each other, so that their vehicles keep `separation_m`.
    pub spot_separation_m: f64,
    /// Least distance between two vehicles, anywhere.
    pub separation_m: f64,
    /// The follower's slot: metres abreast of the leader, on the side from which it comes.
    pub slot_abreast_m: f64,
    /// The follower's slot: metres ahead of the leader.
    pub slot_forward_m: f64,
    /// The follower's slot: metres above the leader.
    pub slot_up_m: f64,
    /// How far the leader moves ahead, along its heading, to clear the spot.
    pub stand_off_m: f64,
    /// Height above mean water from which the follower descends.
    pub approach_height_m: f64,
    /// A vehicle state older than this is not fresh.
    pub vehicle_age_max_s: f64,
    /// A vehicle in a mission that is silent for longer is lost.
    pub vehicle_lost_s: f64,
    /// A fail-safe, a pilot in control or an unexpected landing that lasts longer ends the mission.
    pub fault_grace_s: f64,
    /// A vehicle with less battery, 0 to 1, or with an unknown one, is not sent.
    pub battery_min: f64,
    /// A vehicle on the ground farther from its home than this (a follower on the water) is sent only if the mission names it.
    pub home_radius_m: f64,
    /// A leader within this distance of its place, and settled, is on station.
    pub station_radius_m: f64,
    /// How long a leader has been over the water of the spot when it first says that it has settled: what was measured since
    /// then counts.
    pub settling_s: f64,
    /// Sea states measured farther from the spot say nothing about it.
    pub sea_distance_max_m: f64,
    /// A sea state issued longer ago is not fresh.
    pub sea_age_max_s: f64,
    /// A clearance ends this long after its sea state was issued, or with the verdict if that is sooner.
    pub clearance_s: f64,
    /// A verdict that stays unsafe for so long fails the mission.
    pub unsafe_s: f64,
    /// A touchdown farther from the spot is not the mission's.
    pub touchdown_error_max_m: f64,
    /// A command stamped further in the future than this is refused; so is what vehicles and rigs say.
    pub clock_skew_max_s: f64,
    /// How long to wait for a leader.
    pub waiting_max_s: f64,
    /// How long the leader may take to get there.
    pub transit_max_s: f64,
    /// How long to wait for a verdict.
    pub assessing_max_s: f64,
    /// How long to wait for approval.
    pub awaiting_approval_max_s: f64,
    /// How long an approved mission may wait for the dispatch command or for a follower.
    pub approved_max_s: f64,
    /// How long the leader may hold over the spot before the dispatch, in all.
    pub station_max_s: f64,
    /// How long a follower may take to join the leader.
    pub joining_max_s: f64,
    /// How long clearing the spot may take, until the water is found safe again from beside it.
    pub clearing_max_s: f64,
    /// How long the landing may take, waiting for clearance included.
    pub landing_max_s: f64,
    /// How long a vehicle that landed may take to answer that its payload is let go.
    pub release_answer_s: f64,
    /// How long a person may take to choose when it was not.
    pub release_wait_max_s: f64,
    /// How long a mission may be paused.
    pub paused_max_s: f64,
    /// A vehicle that isn't home so long after its mission is reported.
    pub return_max_s: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self {
            store: "data/missions.sqlite".into(),
            step_s: 0.2,
            plan_period_s: 0.5,
            plan_validity_s: 5.0,
            range_max_m: 450.0,
            survey_height_min_m: 3.0,
            survey_height_max_m: 30.0,
            missions_max: 16,
            spot_separation_m: 30.0,
            separation_m: 5.0,
            slot_abreast_m: 7.0,
            slot_forward_m: 0.0,
            slot_up_m: 0.0,
            stand_off_m: 10.0,
            approach_height_m: 5.0,
            vehicle_age_max_s: 2.0,
            vehicle_lost_s: 8.0,
            fault_grace_s: 15.0,
            battery_min: 0.4,
            home_radius_m: 20.0,
            station_radius_m: 4.0,
            settling_s: 8.0,
            sea_distance_max_m: 20.0,
            sea_age_max_s: 5.0,
            clearance_s: 5.0,
            unsafe_s: 20.0,
            touchdown_error_max_m: 10.0,
            clock_skew_max_s: 2.0,
            waiting_max_s: 600.0,
            transit_max_s: 600.0,
            assessing_max_s: 180.0,
            awaiting_approval_max_s: 600.0,
            approved_max_s: 300.0,
            station_max_s: 900.0,
            joining_max_s: 600.0,
            clearing_max_s: 180.0,
            landing_max_s: 180.0,
            release_answer_s: 10.0,
            release_wait_max_s: 600.0,
            paused_max_s: 600.0,
            return_max_s: 900.0,
        }
    }
}

impl Config {
    /// Whether the planner may run by this.
    ///
    /// # Errors
    /// The first key that is out of range, and why.
    pub fn check(&self) -> Result<(), String> {
        // A comparison with NaN is false, so that every test below also refuses NaN.
        let positive = [
            ("step_s", self.step_s),
            ("plan_period_s", self.plan_period_s),
            ("plan_validity_s", self.plan_validity_s),
            ("range_max_m", self.range_max_m),
            ("survey_height_min_m", self.survey_height_min_m),
            ("separation_m", self.separation_m),
            ("slot_abreast_m", self.slot_abreast_m),
            ("stand_off_m", self.stand_off_m),
            ("approach_height_m", self.approach_height_m),
            ("vehicle_age_max_s", self.vehicle_age_max_s),
            ("vehicle_lost_s", self.vehicle_lost_s),
            ("fault_grace_s", self.fault_grace_s),
            ("home_radius_m", self.home_radius_m),
            ("station_radius_m", self.station_radius_m),
            ("sea_distance_max_m", self.sea_distance_max_m),
            ("sea_age_max_s", self.sea_age_max_s),
            ("clearance_s", self.clearance_s),
            ("unsafe_s", self.unsafe_s),
            ("touchdown_error_max_m", self.touchdown_error_max_m),
            ("clock_skew_max_s", self.clock_skew_max_s),
            ("waiting_max_s", self.waiting_max_s),
            ("transit_max_s", self.transit_max_s),
            ("assessing_max_s", self.assessing_max_s),
            ("awaiting_approval_max_s", self.awaiting_approval_max_s),
            ("approved_max_s", self.approved_max_s),
            ("station_max_s", self.station_max_s),
            ("joining_max_s", self.joining_max_s),
            ("clearing_max_s", self.clearing_max_s),
            ("landing_max_s", self.landing_max_s),
            ("release_answer_s", self.release_answer_s),
            ("release_wait_max_s", self.release_wait_max_s),
            ("paused_max_s", self.paused_max_s),
            ("return_max_s", self.return_max_s),
        ];
        for (key, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(format!("{key} must be above 0, not {value}"));
            }
        }
        let require = |ok: bool, text: String| if ok { Ok(()) } else { Err(text) };
        require(!self.store.trim().is_empty(), "store must name a file or be \":memory:\"".into())?;
        require(self.step_s <= 1.0, format!("step_s must be at most 1, not {}", self.step_s))?;
        require(self.plan_period_s <= 1.0, format!("plan_period_s must be at most 1, not {}", self.plan_period_s))?;
        require(
            self.plan_validity_s >= 2.0 * self.plan_period_s && self.plan_validity_s <= 60.0,
            format!("plan_validity_s must be at least two plan periods and at most 60, not {}", self.plan_validity_s),
        )?;
        require(
            self.survey_height_max_m >= self.survey_height_min_m && self.survey_height_max_m.is_finite(),
            format!("survey_height_max_m must be at least survey_height_min_m, not {}", self.survey_height_max_m),
        )?;
        require((1..=1000).contains(&self.missions_max), format!("missions_max must be 1 to 1000, not {}", self.missions_max))?;
        require((0.0..1.0).contains(&self.battery_min), format!("battery_min must be in 0 to 1, not {}", self.battery_min))?;
        require(
            self.settling_s >= 0.0 && self.settling_s.is_finite(),
            format!("settling_s must be 0 or more, not {}", self.settling_s),
        )?;
        require(
            self.slot_forward_m.is_finite() && self.slot_up_m.is_finite(),
            "slot_forward_m and slot_up_m must be numbers".into(),
        )?;
        // A fault must be given more time than a plan takes to lapse, or a restart of the planner would fail its missions.
        require(
            self.fault_grace_s > self.plan_validity_s,
            format!("fault_grace_s must be above plan_validity_s ({}), not {}", self.plan_validity_s, self.fault_grace_s),
        )?;
        self.check_geometry(require)
    }

    fn check_geometry(&self, require: impl Fn(bool, String) -> Result<(), String>) -> Result<(), String> {
        let abreast_m = self.slot_forward_m.hypot(self.slot_abreast_m);
        require(
            abreast_m >= self.separation_m,
            format!("the slot is {abreast_m:.1} m from the leader, separation_m is {}", self.separation_m),
        )?;
        let path_m = geometry::least_path_distance_m(self);
        require(
            path_m >= self.separation_m,
            format!(
                "the follower's way from its slot to the spot passes the leader at {path_m:.1} m, separation_m is {}",
                self.separation_m
            ),
        )?;
        let apart_m = 2.0 * geometry::reach_m(self) + self.separation_m;
        require(
            self.spot_separation_m >= apart_m && self.spot_separation_m.is_finite(),
            format!(
                "spot_separation_m must be at least {apart_m:.1} by slot, stand-off and separation, not {}",
                self.spot_separation_m
            ),
        )?;
        // Otherwise the leader at its stand-off could no longer vouch for the spot.
        require(
            self.sea_distance_max_m >= self.stand_off_m,
            format!("sea_distance_max_m must be at least stand_off_m ({}), not {}", self.stand_off_m, self.sea_distance_max_m),
        )
    }
}

impl halcyon_chassis::Section for Config {
    const NAME: &'static str = "mission_planner";

    fn validate(&self) -> Result<(), String> {
        self.check()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_are_valid() {
        assert_eq!(Config::default().check(), Ok(()));
    }

    #[track_caller]
    fn refused(change: impl FnOnce(&mut Config), key: &str) {
        let mut config = Config::default();
        change(&mut config);
        let error = config.check().expect_err(key);
        assert!(error.contains(key), "{error}");
    }

    #[test]
    fn values_that_would_endanger_someone_are_refused() {
        refused(|c| c.separation_m = f64::NAN, "separation_m");
        refused(|c| c.plan_period_s = 1.5, "plan_period_s");
        refused(|c| c.plan_validity_s = 0.6, "plan_validity_s");
        refused(|c| c.slot_abreast_m = 4.0, "slot");
        // 10 m ahead and 5.2 m abreast: the slot is far enough, the way to the spot passes at 4.6 m.
        refused(|c| c.slot_abreast_m = 5.2, "passes the leader at 4.6 m");
        refused(|c| c.spot_separation_m = 20.0, "spot_separation_m");
        refused(|c| c.sea_distance_max_m = 9.0, "sea_distance_max_m");
        refused(|c| c.battery_min = 1.5, "battery_min");
        refused(|c| c.fault_grace_s = 4.0, "fault_grace_s");
        refused(|c| c.store = " ".into(), "store");
        refused(|c| c.survey_height_max_m = 1.0, "survey_height_max_m");
        refused(|c| c.missions_max = 0, "missions_max");
    }
}
