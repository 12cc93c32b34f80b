//! Numbers that bound what the guidance may do. All SI; every key has its default here.

use serde::{Deserialize, Serialize};

use halcyon_model::FlightMode;

/// Speeds, heights, distances and tolerances of flight.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Limits {
    /// Height above mean water that a vehicle climbs to before anything else, and never leaves downwards except to land or to
    /// measure, metres (thesis §6.8: 5 m).
    pub safe_height_m: f64,
    /// Least height above mean water of a survey, metres.
    pub survey_height_m_min: f64,
    /// Height above mean water on the way home, metres; the safe height if that is more.
    pub return_height_m: f64,
    /// Horizontal speed in transit, metres per second.
    pub cruise_mps: f64,
    /// Horizontal speed never exceeded, following and evading included, metres per second.
    pub speed_mps_max: f64,
    /// Climb speed, metres per second.
    pub climb_mps: f64,
    /// Speed of every descent above the land-mode height, metres per second; at most 0.5.
    pub descent_mps: f64,
    /// Acceleration of ordinary setpoints, metres per second squared.
    pub acceleration_mps2: f64,
    /// Acceleration of setpoints that follow a leader, metres per second squared: more than a leader uses, or the follower
    /// falls behind at each of its turns.
    pub follow_acceleration_mps2: f64,
    /// Least distance to every flying vehicle, metres; at least 5 (thesis §6.8).
    pub separation_m_min: f64,
    /// Distance kept on top of `separation_m_min` for control lag and position noise, metres.
    pub separation_margin_m: f64,
    /// Within a formation the distance kept is at most this much less than the one that the plan has two vehicles at, metres: else
    /// a slot at the least separation itself could not be taken.
    pub slot_slack_m: f64,
    /// Least distance to a vehicle that stands disarmed, metres: it can't move, and homes lie close together.
    pub separation_parked_m: f64,
    /// Within this distance of a place it counts as reached, metres.
    pub settle_radius_m: f64,
    /// For so long, seconds, before it counts as settled.
    pub settle_s: f64,
    /// Horizontal tolerance over the landing place; the descent waits outside it, metres.
    pub landing_radius_m: f64,
    /// Height above the landing place at which GUIDED descent hands over to LAND mode, metres.
    pub land_mode_height_m: f64,
    /// Height below which a landing is no longer broken off, metres.
    pub commit_height_m: f64,
    /// Height above the landing place at which a vehicle waits for a calm window, where one is offered, metres.
    pub calm_height_m: f64,
    /// For so long at most, seconds: then it goes on, since the clearance alone permits the landing.
    pub calm_wait_s: f64,
    /// Time by which the follower aims ahead of the leader's present, seconds. The age of the leader's state is made up for
    /// already; this is for a lag of the follower's own autopilot. On the simulated ArduCopter 0 is best.
    pub latency_s: f64,
    /// Flight modes of the leader in which it may be followed. The thesis allowed LOITER; our leader is flown by its own
    /// vehicle-link, in GUIDED, so that is allowed too.
    pub leader_modes: Vec<String>,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            safe_height_m: 5.0,
            survey_height_m_min: 2.0,
            return_height_m: 6.0,
            cruise_mps: 5.0,
            speed_mps_max: 8.0,
            climb_mps: 1.5,
            descent_mps: 0.5,
            acceleration_mps2: 1.5,
            follow_acceleration_mps2: 3.0,
            separation_m_min: 5.0,
            separation_margin_m: 1.0,
            slot_slack_m: 0.75,
            separation_parked_m: 3.0,
            settle_radius_m: 1.0,
            settle_s: 2.0,
            landing_radius_m: 1.0,
            land_mode_height_m: 1.0,
            commit_height_m: 0.5,
            calm_height_m: 2.0,
            calm_wait_s: 20.0,
            latency_s: 0.0,
            leader_modes: vec!["LOITER".into(), "GUIDED".into()],
        }
    }
}

impl Limits {
    /// Checks every range.
    ///
    /// # Errors
    /// One line that names the key.
    pub fn validate(&self) -> Result<(), String> {
        let positive = [
            ("safe_height_m", self.safe_height_m),
            ("survey_height_m_min", self.survey_height_m_min),
            ("return_height_m", self.return_height_m),
            ("cruise_mps", self.cruise_mps),
            ("climb_mps", self.climb_mps),
            ("descent_mps", self.descent_mps),
            ("acceleration_mps2", self.acceleration_mps2),
            ("follow_acceleration_mps2", self.follow_acceleration_mps2),
            ("separation_parked_m", self.separation_parked_m),
            ("settle_radius_m", self.settle_radius_m),
            ("settle_s", self.settle_s),
            ("landing_radius_m", self.landing_radius_m),
            ("land_mode_height_m", self.land_mode_height_m),
            ("commit_height_m", self.commit_height_m),
            ("calm_height_m", self.calm_height_m),
        ];
        check_each(&positive, "limits", |value| value > 0.0, "above 0")?;
        let not_negative = [
            ("separation_margin_m", self.separation_margin_m),
            ("latency_s", self.latency_s),
            ("calm_wait_s", self.calm_wait_s),
        ];
        check_each(&[("slot_slack_m", self.slot_slack_m)], "limits", |value| (0.0..=2.0).contains(&value), "in 0 to 2")?;
        check_each(&not_negative, "limits", |value| value >= 0.0, "0 or more")?;
        check_each(&[("separation_m_min", self.separation_m_min)], "limits", |value| value >= 5.0, "at least 5")?;
        check_each(&[("descent_mps", self.descent_mps)], "limits", |value| value <= 0.5, "at most 0.5")?;
        check_each(
            &[("speed_mps_max", self.speed_mps_max)],
            "limits",
            |value| value >= self.cruise_mps,
            "at least cruise_mps",
        )?;
        check_each(
            &[("land_mode_height_m", self.land_mode_height_m)],
            "limits",
            |value| value >= self.commit_height_m && value < self.safe_height_m,
            "between commit_height_m and safe_height_m",
        )?;
        check_each(
            &[("calm_height_m", self.calm_height_m)],
            "limits",
            |value| value >= self.land_mode_height_m && value < self.safe_height_m,
            "between land_mode_height_m and safe_height_m",
        )?;
        for name in &self.leader_modes {
            if FlightMode::from_name(name).is_none() {
                return Err(format!("limits.leader_modes: no flight mode is called {name:?}"));
            }
        }
        Ok(())
    }

    /// The leader's modes in which it may be followed; names that are no mode were refused by [`Self::validate`].
    #[must_use]
    pub fn leader_may_be_in(&self, mode: FlightMode) -> bool {
        self.leader_modes.iter().any(|name| FlightMode::from_name(name) == Some(mode))
    }
}

/// When each fail-safe acts. See [`super::failsafe`] for what it does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FailSafeLimits {
    /// Nothing from the autopilot for so long: the link is lost, seconds.
    pub autopilot_silent_s: f64,
    /// The estimator or the GNSS fix bad for so long: stop, seconds.
    pub estimator_bad_s: f64,
    /// And for so long after that: ask the autopilot to LAND, seconds.
    pub estimator_land_s: f64,
    /// Battery fraction at which the vehicle returns.
    pub battery_return_fraction: f64,
    /// Battery fraction at which it lands where it is.
    pub battery_land_fraction: f64,
    /// Battery fraction needed to take off.
    pub battery_take_off_fraction: f64,
    /// Battery unknown in flight for so long: return, seconds.
    pub battery_unknown_s: f64,
    /// A charge that is too low must be so for this long before it counts: a sag under load is none, seconds.
    pub battery_low_s: f64,
    /// From full to empty in flight, seconds, until the flight itself has told how fast the battery empties.
    pub battery_endurance_s: f64,
    /// What the way home is reckoned to take more than in still air.
    pub battery_home_factor: f64,
    /// A position that moves by so much more than speed, acceleration and the receiver's stated accuracy allow has jumped, metres.
    pub jump_m: f64,
    /// After a jump: hold for so long without another before the new position is flown by, seconds.
    pub jump_settle_s: f64,
    /// Jumping on for so long: ask the autopilot to LAND, seconds.
    pub jump_land_s: f64,
    /// In LAND, at the surface by height and by rangefinder for so long: ask to stop the motors, seconds. For twice as long, and
    /// refused because the autopilot finds no end of a landing on waves: stop them.
    pub afloat_s: f64,
    /// Fence: horizontal distance from the fleet's origin, metres.
    pub fence_radius_m: f64,
    /// Fence: height above mean water, metres.
    pub fence_height_m: f64,
    /// A leader silent for so long is no longer predicted: the follower stops, seconds.
    pub leader_predict_s: f64,
    /// A leader silent for so long is lost: the follower returns, seconds (thesis §6.7.4.4: 5 s).
    pub leader_silent_s: f64,
    /// After a lapsed plan, or a leader that may not be followed: hold for so long, then return, seconds.
    pub hold_s: f64,
    /// Over the landing place without a clearance for so long: return, seconds.
    pub clearance_wait_s: f64,
    /// No plan and no clearance is believed for longer than this after it was received, whatever it says, seconds. Nor for longer
    /// than from its plan's stamp to its own end: a clock that is behind gives no time.
    pub validity_s_max: f64,
}

impl Default for FailSafeLimits {
    fn default() -> Self {
        Self {
            autopilot_silent_s: 3.0,
            estimator_bad_s: 1.0,
            estimator_land_s: 5.0,
            battery_return_fraction: 0.25,
            battery_land_fraction: 0.10,
            battery_take_off_fraction: 0.35,
            battery_unknown_s: 15.0,
            battery_low_s: 3.0,
            battery_endurance_s: 1200.0,
            battery_home_factor: 1.5,
            jump_m: 3.0,
            jump_settle_s: 5.0,
            jump_land_s: 30.0,
            afloat_s: 10.0,
            fence_radius_m: 500.0,
            fence_height_m: 60.0,
            leader_predict_s: 1.0,
            leader_silent_s: 5.0,
            hold_s: 10.0,
            clearance_wait_s: 120.0,
            validity_s_max: 60.0,
        }
    }
}

impl FailSafeLimits {
    /// Checks every range.
    ///
    /// # Errors
    /// One line that names the key.
    pub fn validate(&self) -> Result<(), String> {
        let positive = [
            ("autopilot_silent_s", self.autopilot_silent_s),
            ("estimator_bad_s", self.estimator_bad_s),
            ("estimator_land_s", self.estimator_land_s),
            ("battery_unknown_s", self.battery_unknown_s),
            ("battery_low_s", self.battery_low_s),
            ("battery_endurance_s", self.battery_endurance_s),
            ("jump_m", self.jump_m),
            ("jump_settle_s", self.jump_settle_s),
            ("jump_land_s", self.jump_land_s),
            ("afloat_s", self.afloat_s),
            ("fence_radius_m", self.fence_radius_m),
            ("fence_height_m", self.fence_height_m),
            ("leader_predict_s", self.leader_predict_s),
            ("hold_s", self.hold_s),
            ("clearance_wait_s", self.clearance_wait_s),
            ("validity_s_max", self.validity_s_max),
        ];
        check_each(&positive, "fail_safe", |value| value > 0.0, "above 0")?;
        let (land, back, off) = (self.battery_land_fraction, self.battery_return_fraction, self.battery_take_off_fraction);
        if !(0.0 <= land && land <= back && back <= off && off <= 1.0) {
            return Err(format!(
                "fail_safe: battery fractions must be 0 <= land <= return <= take off <= 1, not {land}, {back}, {off}"
            ));
        }
        check_each(&[("battery_home_factor", self.battery_home_factor)], "fail_safe", |value| value >= 1.0, "at least 1")?;
        let ordered = |value: f64| value >= self.leader_predict_s;
        check_each(&[("leader_silent_s", self.leader_silent_s)], "fail_safe", ordered, "at least leader_predict_s")
    }
}

fn check_each(keys: &[(&str, f64)], table: &str, ok: impl Fn(f64) -> bool, must: &str) -> Result<(), String> {
    match keys.iter().find(|(_, value)| !(value.is_finite() && ok(*value))) {
        Some((key, value)) => Err(format!("{table}.{key} must be {must}, not {value}")),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn defaults_are_valid_and_bad_values_are_named() {
        assert_eq!(Limits::default().validate(), Ok(()));
        assert_eq!(FailSafeLimits::default().validate(), Ok(()));
        let close = Limits { separation_m_min: 4.9, ..Limits::default() };
        assert!(close.validate().unwrap_err().contains("separation_m_min"));
        let nan = Limits { cruise_mps: f64::NAN, ..Limits::default() };
        assert!(nan.validate().unwrap_err().contains("cruise_mps"));
        let mode = Limits { leader_modes: vec!["HOVER".into()], ..Limits::default() };
        assert!(mode.validate().unwrap_err().contains("HOVER"));
        let battery = FailSafeLimits { battery_land_fraction: 0.5, ..FailSafeLimits::default() };
        assert!(battery.validate().is_err());
    }
}
