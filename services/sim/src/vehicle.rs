//! One simulated vehicle: airframe, wind, sensors, battery and autopilot, stepped together.

use halcyon_model::{FleetOrigin, LocalPoint, SimTruth, Stamp, VehicleId};
use mavlink::{MAVLinkMessageRaw, MavlinkVersion};
use nalgebra::Vector3;

use crate::autopilot::{Autopilot, Inbound, LinkId, Outbound, Sensed};
use crate::battery::Battery;
use crate::config::SimConfig;
use crate::copter::{Actuation, Copter, Support};
use crate::estimator::{Estimate, Estimator};
use crate::fault::{Fault, ScheduledFault};
use crate::rangefinder::Rangefinder;
use crate::wind::Wind;

/// The fixed step of the simulation: 400 a second.
pub const STEP_NS: i64 = 2_500_000;
const STEP_S: f64 = STEP_NS as f64 * 1e-9;
/// The jetty at each home, metres from it.
const JETTY_RADIUS_M: f64 = 2.5;
/// Higher than this no crest reaches it, metres above mean water.
const CLEAR_M: f64 = 6.0;

/// The water's elevation, metres above mean, at a place and a time.
pub type Elevation<'a> = &'a dyn Fn(LocalPoint, Stamp) -> f64;

/// One vehicle. The same configuration, seed and inputs at the same times give the same flight.
#[derive(Debug, Clone)]
pub struct Vehicle {
    id: VehicleId,
    home: LocalPoint,
    now: Stamp,
    boot: Stamp,
    copter: Copter,
    wind: Wind,
    estimator: Estimator,
    battery: Battery,
    rangefinder: Option<Rangefinder>,
    autopilot: Autopilot,
    actuation: Actuation,
    wind_ned_mps: Vector3<f64>,
    /// The water's height below it in the last step, for how fast it rises.
    water_m: Option<f64>,
    motors_stopped: bool,
    link_cut: bool,
    faults: Vec<ScheduledFault>,
    battery_struck: bool,
}

impl Vehicle {
    /// The vehicle at `index` of the configuration, powered up at `now`; `None` when there is none.
    #[must_use]
    pub fn new(config: &SimConfig, index: usize, origin: FleetOrigin, now: Stamp) -> Option<Self> {
        let vehicle = config.vehicles.get(index)?;
        let name = vehicle.id.as_str();
        let home = LocalPoint::new(vehicle.north_m, vehicle.east_m);
        let place_m = Vector3::new(home.north_m, home.east_m, 0.0);
        let copter = Copter::new(config.airframe.clone(), place_m, vehicle.heading_deg.to_radians());
        let mut estimator = Estimator::new(config.estimator.clone(), config.gnss.clone(), config.seed, name);
        let battery = Battery::new(config.battery.clone());
        let estimate = estimator.step(0.0, copter.motion());
        let sensed = sense(&copter, &estimator, &battery, None, estimate);
        let fitted = config.rangefinder.is_fitted(vehicle.role);
        let rangefinder = fitted.then(|| Rangefinder::new(config.rangefinder.clone(), config.seed, name));
        let mut autopilot = Autopilot::new(
            config.system_id(index),
            origin.frame(),
            config.airframe.clone(),
            config.battery.capacity_ah,
            sensed,
            now,
        );
        if fitted {
            autopilot.fit_rangefinder(config.rangefinder.least_m, config.rangefinder.most_m);
        }
        Some(Self {
            id: vehicle.id.clone(),
            home,
            now,
            boot: now,
            copter,
            wind: Wind::new(config.wind.clone(), config.seed, name),
            estimator,
            battery,
            rangefinder,
            autopilot,
            actuation: Actuation::OFF,
            wind_ned_mps: Vector3::zeros(),
            water_m: None,
            motors_stopped: false,
            link_cut: false,
            faults: config.faults.iter().filter(|fault| fault.vehicle == vehicle.id).cloned().collect(),
            battery_struck: false,
        })
    }

    /// Its name.
    #[must_use]
    pub fn id(&self) -> &VehicleId {
        &self.id
    }

    /// How far it has been simulated.
    #[must_use]
    pub fn now(&self) -> Stamp {
        self.now
    }

    /// Its autopilot.
    #[must_use]
    pub fn autopilot(&self) -> &Autopilot {
        &self.autopilot
    }

    /// Its battery.
    #[must_use]
    pub fn battery(&self) -> &Battery {
        &self.battery
    }

    /// Opens a link to a client: `false` when there are too many.
    pub fn attach(&mut self, link: LinkId) -> bool {
        self.autopilot.attach(link)
    }

    /// Closes a link.
    pub fn detach(&mut self, link: LinkId) {
        self.autopilot.detach(link);
    }

    /// Takes what a client says. Lost while the link is cut.
    pub fn handle(&mut self, link: LinkId, inbound: &Inbound) {
        if !self.link_cut {
            self.autopilot.handle(self.now, link, inbound);
        }
    }

    /// Takes a frame from a client, whose signature is looked at when the autopilot signs. Lost while the link is cut.
    pub fn receive(&mut self, link: LinkId, frame: &MAVLinkMessageRaw) {
        if !self.link_cut {
            self.autopilot.receive(self.now, link, frame);
        }
    }

    /// Appends what it says on a link to `bytes`, as a frame.
    pub fn encode(&mut self, link: LinkId, outbound: &Outbound, version: MavlinkVersion, sequence: u8, bytes: &mut Vec<u8>) {
        self.autopilot.encode(link, outbound, version, sequence, bytes);
    }

    /// What it has to say: to one link, or to all. Nothing while the link is cut.
    pub fn take_outbox(&mut self) -> impl Iterator<Item = (Option<LinkId>, Outbound)> + '_ {
        let cut = self.link_cut;
        self.autopilot.take_outbox().filter(move |_| !cut)
    }

    /// Simulates up to `until` in whole steps; less than a step is left for the next time.
    pub fn advance(&mut self, until: Stamp, elevation: Elevation<'_>) {
        while until.as_nanos() - self.now.as_nanos() >= STEP_NS {
            self.step(elevation);
        }
    }

    /// Passes over time without simulating it, for a host that was asleep.
    pub fn skip_to(&mut self, now: Stamp) {
        self.now = self.now.max(now);
    }

    fn step(&mut self, elevation: Elevation<'_>) {
        self.now = Stamp::from_nanos(self.now.as_nanos() + STEP_NS);
        self.strike_scheduled();
        let motion = *self.copter.motion();
        let air_mps = (motion.velocity_ned_mps - self.wind_ned_mps).norm();
        self.wind_ned_mps = self.wind.step(STEP_S, -motion.position_ned_m.z, air_mps);
        let support = self.support(elevation);
        let actuation = if self.motors_stopped || self.battery.is_empty() { Actuation::OFF } else { self.actuation };
        self.copter.step(STEP_S, &actuation, self.wind_ned_mps, support);
        self.battery.step(STEP_S, self.copter.power_w());
        let estimate = self.estimator.step(STEP_S, self.copter.motion());
        self.measure_range(elevation);
        let range_m = self.rangefinder.as_ref().and_then(Rangefinder::measured_m);
        let sensed = sense(&self.copter, &self.estimator, &self.battery, range_m, estimate);
        self.actuation = self.autopilot.step(self.now, STEP_S, sensed);
    }

    fn measure_range(&mut self, elevation: Elevation<'_>) {
        let (home, now) = (self.home, self.now);
        let surface_m = |place_m: Vector3<f64>| {
            let place = LocalPoint::from(place_m);
            if place.distance_m(&home) < JETTY_RADIUS_M { 0.0 } else { elevation(place, now) }
        };
        if let Some(rangefinder) = &mut self.rangefinder {
            rangefinder.step(STEP_S, self.copter.motion(), surface_m);
        }
    }

    fn support(&mut self, elevation: Elevation<'_>) -> Option<Support> {
        let position_ned_m = self.copter.motion().position_ned_m;
        if -position_ned_m.z > CLEAR_M {
            self.water_m = None;
            return None;
        }
        let place = LocalPoint::from(position_ned_m);
        if place.distance_m(&self.home) < JETTY_RADIUS_M {
            self.water_m = None;
            return Some(Support { height_m: 0.0, rise_mps: 0.0, water: false });
        }
        let height_m = elevation(place, self.now);
        let rise_mps = self.water_m.map_or(0.0, |before_m| (height_m - before_m) / STEP_S);
        self.water_m = Some(height_m);
        Some(Support { height_m, rise_mps, water: true })
    }

    /// The truth about it.
    #[must_use]
    pub fn truth(&self) -> SimTruth {
        let motion = self.copter.motion();
        SimTruth {
            stamp: self.now,
            vehicle: self.id.clone(),
            position_ned_m: motion.position_ned_m,
            velocity_ned_mps: motion.velocity_ned_mps,
            ned_from_body: motion.ned_from_body,
            rate_body_radps: motion.rate_body_radps,
            landed: self.copter.touching(),
        }
    }

    /// Makes a fault happen now.
    pub fn strike(&mut self, fault: Fault) {
        match fault {
            Fault::GnssLoss => self.estimator.gnss_mut().set_lost(true),
            Fault::Battery { fraction } => self.battery.set_fraction(fraction),
            Fault::LinkDrop => self.link_cut = true,
            Fault::MotorStop => self.motors_stopped = true,
        }
    }

    /// Ends a fault that can end.
    pub fn mend(&mut self, fault: Fault) {
        match fault {
            Fault::GnssLoss => self.estimator.gnss_mut().set_lost(false),
            Fault::LinkDrop => self.link_cut = false,
            Fault::Battery { .. } | Fault::MotorStop => {}
        }
    }

    fn strike_scheduled(&mut self) {
        if self.faults.is_empty() {
            return;
        }
        let time_s = self.now.seconds_since(self.boot);
        let mut faults = std::mem::take(&mut self.faults);
        faults.retain_mut(|fault| {
            if time_s < fault.at_s {
                return true;
            }
            let ends_s = fault.duration_s.map(|duration_s| fault.at_s + duration_s);
            if ends_s.is_some_and(|ends_s| time_s >= ends_s) {
                self.mend(fault.kind);
                return false;
            }
            // A battery is drained once; what has a state is held in it.
            if !matches!(fault.kind, Fault::Battery { .. }) || !self.battery_struck {
                self.battery_struck |= matches!(fault.kind, Fault::Battery { .. });
                self.strike(fault.kind);
            }
            ends_s.is_some()
        });
        self.faults = faults;
    }
}

fn sense(copter: &Copter, estimator: &Estimator, battery: &Battery, range_m: Option<f64>, estimate: Estimate) -> Sensed {
    let gnss = estimator.gnss();
    Sensed {
        estimate,
        gnss: estimator.gnss_reading(),
        satellites: if gnss.has_fix() { gnss.config().satellites } else { 0 },
        gnss_sigma_m: (gnss.config().horizontal_sigma_m, gnss.config().vertical_sigma_m),
        specific_force_body_mps2: copter.motion().specific_force_body_mps2,
        battery_v: battery.voltage_v(),
        battery_a: battery.current_a(),
        battery_fraction: battery.fraction(),
        battery_ah: (battery.remaining_ah(), battery.drawn_ah()),
        battery_wh: battery.drawn_wh(),
        range_m,
        simulator: *copter.motion(),
    }
}
