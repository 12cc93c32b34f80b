//! Arming, disarming and their checks.

use std::borrow::Cow;

use mavlink::dialects::ardupilotmega::MavSeverity;

use super::{Autopilot, Param};

/// Seconds between two tellings of why it would not arm.
const PREARM_EVERY_S: f64 = 30.0;

impl Autopilot {
    /// Why it would not arm in any mode; `None` when it would.
    pub(super) fn prearm_problem(&self) -> Option<Cow<'static, str>> {
        if self.params.get(Param::ArmingCheck) != 0.0 && self.fence.is_breached() {
            return Some(Cow::Owned(format!("vehicle outside {}", self.fence.names())));
        }
        self.sensor_problem().map(Cow::Borrowed)
    }

    fn sensor_problem(&self) -> Option<&'static str> {
        if self.params.get(Param::ArmingCheck) == 0.0 {
            return None;
        }
        let estimate = &self.sensed.estimate;
        let arm_v = self.params.get(Param::BatteryArmVolt);
        if !estimate.attitude_ok {
            Some("AHRS: not healthy")
        } else if self.sensed.gnss.is_none() {
            Some("GPS 1: Bad fix")
        } else if !estimate.position_ok {
            Some("Need Position Estimate")
        } else if arm_v > 0.0 && self.sensed.battery_v < arm_v {
            Some("Battery 1 below minimum arming voltage")
        } else if self.failsafe.battery_stage > 0 {
            Some("Battery 1 low voltage failsafe")
        } else {
            None
        }
    }

    /// Arms, or says why not.
    pub(super) fn arm(&mut self, force: bool) -> bool {
        if self.armed {
            return true;
        }
        let problem = if force {
            None
        } else if let Some(problem) = self.prearm_problem() {
            Some(problem.into_owned())
        } else if !self.mode.may_arm() {
            Some(format!("{} mode not armable", self.mode.name()))
        } else if self.mode.needs_position() && !self.sensed.estimate.position_ok {
            Some("Need Position Estimate".to_owned())
        } else {
            None
        };
        if let Some(problem) = problem {
            self.text(MavSeverity::MAV_SEVERITY_CRITICAL, &format!("Arm: {problem}"));
            return false;
        }
        self.armed = true;
        self.landed = true;
        self.idle_since = Some(self.now);
        if !self.home_is_set && self.sensed.estimate.position_ok {
            self.set_home(self.sensed.estimate.position_ned_m);
        }
        self.enter_mode(self.mode);
        self.text(MavSeverity::MAV_SEVERITY_INFO, "Arming motors");
        self.hurry_heartbeat();
        true
    }

    /// Stops the motors, in the air too.
    pub(super) fn disarm(&mut self) {
        if !self.armed {
            return;
        }
        self.armed = false;
        // As ArduCopter has it, wherever it is.
        self.landed = true;
        self.idle_since = None;
        self.text(MavSeverity::MAV_SEVERITY_INFO, "Disarming motors");
        self.hurry_heartbeat();
    }

    /// DISARM_DELAY: armed on the ground for that long without a take-off.
    pub(super) fn disarm_when_idle(&mut self) {
        if !self.armed || !self.landed {
            self.idle_since = None;
            return;
        }
        let since = *self.idle_since.get_or_insert(self.now);
        let delay_s = self.params.get(Param::DisarmDelay);
        if delay_s > 0.0 && self.now.seconds_since(since) >= delay_s {
            self.disarm();
        }
    }

    /// Says every half minute why it would not arm.
    pub(super) fn tell_prearm(&mut self) {
        if self.armed || self.told_prearm_at.is_some_and(|at| self.now.seconds_since(at) < PREARM_EVERY_S) {
            return;
        }
        // Silent for a second after power-up, while everything still starts.
        if self.now.seconds_since(self.boot) < 1.0 {
            return;
        }
        if let Some(problem) = self.prearm_problem() {
            self.told_prearm_at = Some(self.now);
            self.text(MavSeverity::MAV_SEVERITY_CRITICAL, &format!("PreArm: {problem}"));
        }
    }
}
