//! A lithium battery: charge, open-circuit voltage, internal resistance.

use serde::{Deserialize, Serialize};

/// Open-circuit voltage of a lithium-polymer cell at 0, 10, … 100 % of its charge, volts.
const CELL_V: [f64; 11] = [3.27, 3.61, 3.69, 3.73, 3.77, 3.80, 3.85, 3.92, 4.00, 4.09, 4.20];

/// The flight battery (`[sim.battery]`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BatteryConfig {
    /// Charge when full, ampere hours, 0.1 to 1000.
    pub capacity_ah: f64,
    /// Cells in series, 1 to 24.
    pub cells: u8,
    /// Internal resistance of the whole pack, ohms, 0 to 1.
    pub resistance_ohm: f64,
    /// Charge at the start, fraction of full, 0 to 1.
    pub initial_fraction: f64,
}

impl Default for BatteryConfig {
    /// Six cells that carry the default airframe for about half an hour.
    fn default() -> Self {
        Self { capacity_ah: 10.0, cells: 6, resistance_ohm: 0.025, initial_fraction: 1.0 }
    }
}

impl BatteryConfig {
    /// Checks every number.
    ///
    /// # Errors
    /// One line that names the key and its range.
    pub fn validate(&self) -> Result<(), String> {
        use crate::config::range;
        range("battery.capacity_ah", self.capacity_ah, 0.1, 1000.0)?;
        range("battery.cells", f64::from(self.cells), 1.0, 24.0)?;
        range("battery.resistance_ohm", self.resistance_ohm, 0.0, 1.0)?;
        range("battery.initial_fraction", self.initial_fraction, 0.0, 1.0)
    }
}

/// The battery of one vehicle.
#[derive(Debug, Clone)]
pub struct Battery {
    config: BatteryConfig,
    remaining_ah: f64,
    drawn_ah: f64,
    drawn_wh: f64,
    current_a: f64,
    voltage_v: f64,
}

impl Battery {
    /// At its initial charge, with no load.
    #[must_use]
    pub fn new(config: BatteryConfig) -> Self {
        let remaining_ah = config.capacity_ah * config.initial_fraction;
        let mut battery = Self { config, remaining_ah, drawn_ah: 0.0, drawn_wh: 0.0, current_a: 0.0, voltage_v: 0.0 };
        battery.voltage_v = battery.open_circuit_v();
        battery
    }

    fn open_circuit_v(&self) -> f64 {
        let place = self.fraction() * (CELL_V.len() - 1) as f64;
        let below = (place as usize).min(CELL_V.len() - 2);
        let within = place - below as f64;
        (CELL_V[below] + (CELL_V[below + 1] - CELL_V[below]) * within) * f64::from(self.config.cells)
    }

    /// Draws `power_w` for `dt_s`: I solves V I = P with V = V_oc − R I.
    pub fn step(&mut self, dt_s: f64, power_w: f64) {
        let open_v = self.open_circuit_v();
        let resistance_ohm = self.config.resistance_ohm.max(1e-9);
        // Past the most that the pack can give, it gives that.
        let root = (open_v * open_v - 4.0 * resistance_ohm * power_w).max(0.0).sqrt();
        self.current_a = if self.remaining_ah > 0.0 { (open_v - root) / (2.0 * resistance_ohm) } else { 0.0 };
        self.voltage_v = open_v - resistance_ohm * self.current_a;
        let drawn_ah = (self.current_a * dt_s / 3600.0).min(self.remaining_ah);
        self.remaining_ah -= drawn_ah;
        self.drawn_ah += drawn_ah;
        self.drawn_wh += drawn_ah * self.voltage_v;
    }

    /// Sets the charge, for a fault.
    pub fn set_fraction(&mut self, fraction: f64) {
        self.remaining_ah = self.config.capacity_ah * fraction.clamp(0.0, 1.0);
        self.voltage_v = self.open_circuit_v() - self.config.resistance_ohm * self.current_a;
    }

    /// Charge left, fraction of full, 0 to 1.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        (self.remaining_ah / self.config.capacity_ah).clamp(0.0, 1.0)
    }

    /// Whether it can still turn the motors.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.remaining_ah <= 0.0
    }

    /// Charge left, ampere hours.
    #[must_use]
    pub fn remaining_ah(&self) -> f64 {
        self.remaining_ah
    }

    /// Charge drawn since the start, ampere hours.
    #[must_use]
    pub fn drawn_ah(&self) -> f64 {
        self.drawn_ah
    }

    /// Energy drawn since the start, watt hours.
    #[must_use]
    pub fn drawn_wh(&self) -> f64 {
        self.drawn_wh
    }

    /// Present current, amperes.
    #[must_use]
    pub fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Present voltage under load, volts.
    #[must_use]
    pub fn voltage_v(&self) -> f64 {
        self.voltage_v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_is_voltage_times_current_and_charge_is_current_times_time() {
        let mut battery = Battery::new(BatteryConfig::default());
        let full_v = battery.voltage_v();
        assert!((full_v - 25.2).abs() < 1e-9);
        for _ in 0..600 {
            battery.step(1.0, 450.0);
            assert!((battery.voltage_v() * battery.current_a() - 450.0).abs() < 1e-6);
        }
        // 450 W at about 24 V for ten minutes is about 3.1 Ah.
        assert!((battery.drawn_ah() - 3.15).abs() < 0.1, "{}", battery.drawn_ah());
        assert!((battery.fraction() - (1.0 - battery.drawn_ah() / 10.0)).abs() < 1e-9);
        assert!((battery.drawn_wh() - 75.0).abs() < 0.01, "{}", battery.drawn_wh());
    }

    #[test]
    fn an_empty_battery_gives_nothing() {
        let mut battery = Battery::new(BatteryConfig { initial_fraction: 0.001, ..BatteryConfig::default() });
        for _ in 0..100 {
            battery.step(1.0, 450.0);
        }
        assert!(battery.is_empty() && battery.current_a() == 0.0 && battery.fraction() == 0.0);
    }
}
