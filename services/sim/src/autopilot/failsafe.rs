//! What the autopilot does by itself when something is lost.

use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega::MavSeverity;

use super::{Autopilot, Mode, Param};

/// Seconds without a trusted position before the fail-safe.
const POSITION_GRACE_S: f64 = 1.0;
/// Seconds of low voltage before the fail-safe: a sag is not an empty battery.
const VOLTAGE_GRACE_S: f64 = 10.0;
/// Seconds after which an RC override lapses.
const OVERRIDE_LAPSE_S: f64 = 3.0;

/// What the fail-safes remember.
#[derive(Debug, Clone, Default)]
pub(super) struct State {
    position_lost_at: Option<Stamp>,
    pub(super) position: bool,
    pub(super) gcs_heard_at: Option<Stamp>,
    pub(super) gcs: bool,
    /// 0 none, 1 low, 2 critical.
    pub(super) battery_stage: u8,
    below_volt_since: [Option<Stamp>; 2],
}

impl State {
    /// Whether any is in force.
    pub(super) fn any(&self) -> bool {
        self.position || self.gcs || self.battery_stage > 0
    }
}

impl Autopilot {
    pub(super) fn check_failsafes(&mut self) {
        self.check_position();
        self.check_ground_station();
        self.check_battery();
        if self.sticks.is_some_and(|sticks| self.now.seconds_since(sticks.at) > OVERRIDE_LAPSE_S) {
            self.sticks = None;
        }
    }

    fn check_position(&mut self) {
        if self.sensed.estimate.position_ok {
            self.failsafe.position_lost_at = None;
            if self.failsafe.position {
                self.failsafe.position = false;
                self.text(MavSeverity::MAV_SEVERITY_CRITICAL, "EKF Failsafe Cleared");
            }
            return;
        }
        if !self.armed || self.failsafe.position {
            return;
        }
        let since = *self.failsafe.position_lost_at.get_or_insert(self.now);
        if self.now.seconds_since(since) < POSITION_GRACE_S {
            return;
        }
        self.failsafe.position = true;
        if !self.mode.needs_position() {
            return;
        }
        let mode = if self.params.get(Param::EkfAction) == 2.0 { Mode::AltHold } else { Mode::Land };
        self.text(MavSeverity::MAV_SEVERITY_CRITICAL, &format!("EKF Failsafe: changed to {} Mode", mode.name()));
        self.enter_mode(mode);
    }

    fn check_ground_station(&mut self) {
        let enabled = self.params.get(Param::GcsFailsafe);
        // As on ArduPilot, one that never was there can't be lost.
        let Some(heard_at) = self.failsafe.gcs_heard_at.filter(|_| enabled != 0.0) else {
            self.failsafe.gcs = false;
            return;
        };
        let lost = self.now.seconds_since(heard_at) > self.params.get(Param::GcsTimeout);
        if lost == self.failsafe.gcs {
            return;
        }
        self.failsafe.gcs = lost;
        if !lost {
            self.text(MavSeverity::MAV_SEVERITY_WARNING, "GCS Failsafe Cleared");
        } else if self.armed && !self.landed {
            self.text(MavSeverity::MAV_SEVERITY_WARNING, "GCS Failsafe");
            let action = if enabled == 5.0 { Mode::Land } else { Mode::Rtl };
            self.act_on_failsafe(action);
        } else if self.armed {
            self.disarm();
        }
    }

    fn check_battery(&mut self) {
        let stages = [
            (Param::BatteryLowVolt, Param::BatteryLowCharge, Param::BatteryLowAction, "low"),
            (Param::BatteryCriticalVolt, Param::BatteryCriticalCharge, Param::BatteryCriticalAction, "critical"),
        ];
        for (index, (volt, charge, action, name)) in stages.into_iter().enumerate() {
            let (least_v, least_mah) = (self.params.get(volt), self.params.get(charge));
            let low_voltage = least_v > 0.0 && self.sensed.battery_v < least_v;
            let since = &mut self.failsafe.below_volt_since[index];
            *since = if low_voltage { since.or(Some(self.now)) } else { None };
            let sagged = since.is_some_and(|since| self.now.seconds_since(since) >= VOLTAGE_GRACE_S);
            let drained = least_mah > 0.0 && self.sensed.battery_ah.0 * 1e3 < least_mah;
            let stage = index as u8 + 1;
            if (!sagged && !drained) || self.failsafe.battery_stage >= stage {
                continue;
            }
            self.failsafe.battery_stage = stage;
            let (volts, used_mah) = (self.sensed.battery_v, self.sensed.battery_ah.1 * 1e3);
            self.text(MavSeverity::MAV_SEVERITY_WARNING, &format!("Battery 1 is {name} {volts:.2}V used {used_mah:.0} mAh"));
            let mode = match self.params.get(action) as u32 {
                0 => continue,
                2 | 3 => Mode::Rtl,
                _ => Mode::Land,
            };
            if self.armed && self.landed {
                self.disarm();
            } else if self.armed {
                self.act_on_failsafe(mode);
            }
        }
    }

    /// Enters `mode`, or lands where that is impossible. What already lands goes on landing.
    fn act_on_failsafe(&mut self, mode: Mode) {
        if self.mode != Mode::Land && self.set_mode(mode).is_err() {
            self.enter_mode(Mode::Land);
        }
    }
}
