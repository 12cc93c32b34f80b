//! What is flown: the flight, the weather, the receivers, the radio.

use std::collections::VecDeque;

use halcyon_model::{Stamp, VehicleState};
use halcyon_sim::estimator::EstimatorConfig;
use halcyon_sim::gnss::GnssConfig;
use halcyon_sim::wind::WindConfig;
use halcyon_sim::{SimConfig, SimVehicle};
use nalgebra::Vector3;

use super::chance::Chance;
use crate::core::law::{Law, SlotLock};

/// The thesis's wind: 8 mph, metres per second.
pub const WIND_MPS: f64 = 3.576;

/// What the leader flies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Flight {
    /// A square with a fixed heading, by velocity: corners as sharp as the autopilot flies them (thesis, experiment 1).
    Square {
        /// Speed, metres per second.
        speed_mps: f64,
        /// Time on each side, seconds.
        side_s: f64,
        /// Times round.
        laps: u32,
    },
    /// One turn of the heading of a standing leader (thesis, experiment 2).
    Sweep {
        /// Turn rate, degrees per second.
        rate_degps: f64,
        /// Times round.
        turns: f64,
    },
}

impl Flight {
    /// The thesis's square at the 3 m/s, twice round.
    pub const SQUARE: Self = Self::Square { speed_mps: 3.0, side_s: 10.0, laps: 2 };
    /// The thesis's sweep, at 10°/s.
    pub const SWEEP: Self = Self::Sweep { rate_degps: 10.0, turns: 1.0 };

    /// How long it lasts, seconds; with a rest of five seconds at its end.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        5.0 + self.motion_s()
    }

    pub(super) fn motion_s(&self) -> f64 {
        match *self {
            Self::Square { side_s, laps, .. } => 4.0 * side_s * f64::from(laps),
            Self::Sweep { rate_degps, turns } => turns * 360.0 / rate_degps.abs().max(0.1),
        }
    }

    /// Velocity (metres per second) and yaw rate (radians per second) that the pilot asks for after `flown_s`.
    pub(super) fn wish(&self, flown_s: f64) -> (Vector3<f64>, f64) {
        if !(0.0..self.motion_s()).contains(&flown_s) {
            return (Vector3::zeros(), 0.0);
        }
        match *self {
            Self::Square { speed_mps, side_s, .. } => {
                let quarter = std::f64::consts::FRAC_PI_2 * (flown_s / side_s).floor();
                (Vector3::new(speed_mps * quarter.cos(), speed_mps * quarter.sin(), 0.0), 0.0)
            }
            Self::Sweep { rate_degps, .. } => (Vector3::zeros(), rate_degps.to_radians()),
        }
    }
}

/// The receivers of both vehicles, independent of each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gnss {
    /// No error in any sensor.
    Perfect,
    /// The thesis's: 2.5 m (CEP, u-blox), wandering over a minute, 10 Hz, with an ordinary autopilot's sensors.
    Thesis,
    /// Fixed RTK: 1.4 cm, 10 Hz, with the same sensors.
    Rtk,
}

impl Gnss {
    fn configs(self) -> (GnssConfig, EstimatorConfig) {
        let receiver = |sigma_m: f64, white_sigma_m: f64, velocity_sigma_mps: f64| GnssConfig {
            horizontal_sigma_m: sigma_m,
            vertical_sigma_m: 1.5 * sigma_m,
            correlation_s: 60.0,
            white_sigma_m,
            velocity_sigma_mps,
            rate_hz: 10.0,
            ..GnssConfig::default()
        };
        match self {
            Self::Perfect => (GnssConfig::perfect(), EstimatorConfig::perfect()),
            // Half of all fixes lie within the CEP, so that σ = CEP / √(2 ln 2) on each axis.
            Self::Thesis => (receiver(2.5 / (2.0 * 2.0_f64.ln()).sqrt(), 0.05, 0.05), EstimatorConfig::default()),
            Self::Rtk => (receiver(0.014, 0.005, 0.03), EstimatorConfig::default()),
        }
    }
}

/// The radio between the vehicles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Radio {
    /// From the leader's computer to the follower's, seconds.
    pub delay_s: f64,
    /// Fraction of states lost.
    pub loss: f64,
}

/// One flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// The law under test.
    pub law: Law,
    /// What its slot turns with.
    pub slot_lock: SlotLock,
    /// What the leader flies.
    pub flight: Flight,
    /// The slot's distance to the leader's right, metres.
    pub slot_m: f64,
    /// Mean wind at 10 m, metres per second; gusts by the Dryden model.
    pub wind_mps: f64,
    /// Receivers.
    pub gnss: Gnss,
    /// Radio.
    pub radio: Radio,
    /// The follower's autopilot's gains over those that guidance believes in.
    pub gain_scale: f64,
    /// Whether the separation filter keeps its distance; without it a poor law shows how near it would come.
    pub separation: bool,
    /// Whether a setpoint follows each state heard at once, or only the next tick.
    pub on_arrival: bool,
    /// Whether the leader says what it asks of its own autopilot, as one that its vehicle-link flies does; a pilot's doesn't.
    pub shares_intent: bool,
    /// Seed of wind, sensors and losses.
    pub seed: u64,
}

impl Scenario {
    /// The conditions: 5 m to the right, 8 mph with gusts, 100 ms and 5 % loss, no GNSS error.
    #[must_use]
    pub fn new(law: Law, flight: Flight) -> Self {
        Self {
            law,
            slot_lock: SlotLock::Heading,
            flight,
            slot_m: 5.0,
            wind_mps: WIND_MPS,
            gnss: Gnss::Perfect,
            radio: Radio { delay_s: 0.1, loss: 0.05 },
            gain_scale: 1.0,
            separation: true,
            on_arrival: true,
            shares_intent: false,
            seed: 1,
        }
    }

    pub(super) fn sim(&self) -> Result<SimConfig, String> {
        let (gnss, estimator) = self.gnss.configs();
        let mut vehicles = SimVehicle::fleet(1, 1);
        if let Some(follower) = vehicles.get_mut(1) {
            follower.east_m = self.slot_m + 3.0;
        }
        let wind = WindConfig { speed_mps: self.wind_mps, direction_from_deg: 240.0, gust_scale: 1.0 };
        let config = SimConfig { seed: self.seed, wind, gnss, estimator, vehicles, ..SimConfig::default() };
        config.validate()?;
        Ok(config)
    }
}

/// States under way.
pub(super) struct Channel {
    radio: Radio,
    random: Chance,
    under_way: VecDeque<(Stamp, VehicleState)>,
}

impl Channel {
    pub(super) fn new(scenario: &Scenario) -> Self {
        Self { radio: scenario.radio, random: Chance::new(scenario.seed), under_way: VecDeque::new() }
    }

    pub(super) fn send(&mut self, state: VehicleState, now: Stamp) {
        if self.random.unit() >= self.radio.loss {
            self.under_way.push_back((now.plus_secs_f64(self.radio.delay_s), state));
        }
    }

    pub(super) fn receive(&mut self, now: Stamp) -> Vec<VehicleState> {
        let mut arrived = Vec::new();
        while self.under_way.front().is_some_and(|(due, _)| *due <= now) {
            arrived.extend(self.under_way.pop_front().map(|(_, state)| state));
        }
        arrived
    }
}
