//! An autopilot that a MAVLink client cannot tell from ArduCopter 4.6 in what it uses: modes, arming checks, GUIDED targets, LAND,
//! RTL, missions, parameters, streams, acknowledgements, fail-safes.
//!
//! Pure: [`Autopilot::handle`] takes messages, [`Autopilot::step`] takes what the sensors say and returns what the motors are to do,
//! [`Autopilot::take_outbox`] gives what it says. Differences from the original that a client may notice: nothing but heartbeats,
//! texts and home is sent on any link unless asked; sticks count as centred until RC_CHANNELS_OVERRIDE says otherwise; there is no
//! fence, rally point, log or file transfer.

#![allow(deprecated, reason = "ArduPilot and its clients still speak much that MAVLink has deprecated")]

mod arming;
mod commands;
mod control;
mod failsafe;
mod flight;
mod guided;
mod inbound;
mod mission;
mod mode;
mod params;
mod streams;
mod telemetry;
mod transfer;
mod wire;

use std::collections::VecDeque;

use halcyon_model::{LocalFrame, Stamp};
use mavlink::dialects::ardupilotmega as mav;
use nalgebra::Vector3;

pub use mode::Mode;
pub use params::{Param, Params};
pub use streams::LinkId;
pub use wire::{Inbound, Outbound, UnknownCommandAck};

use crate::copter::{Actuation, AirframeConfig, Motion};
use crate::estimator::{Estimate, GnssReading};
use control::Controller;
use flight::Flight;
use guided::Guided;
use mission::Mission;
use streams::Link;

/// Messages waiting for the shell; past this the oldest go.
const OUTBOX_MAX: usize = 4096;
/// Clients at once; a further one is refused.
pub const LINKS_MAX: usize = 32;

/// What the autopilot is told each step.
#[derive(Debug, Clone, Copy)]
pub struct Sensed {
    /// The filter's belief.
    pub estimate: Estimate,
    /// What the receiver last delivered; `None` without a fix.
    pub gnss: Option<GnssReading>,
    /// Satellites in use.
    pub satellites: u8,
    /// Accuracy that the receiver states, metres, horizontal and vertical.
    pub gnss_sigma_m: (f64, f64),
    /// Accelerometer (forward, right, down), metres per second squared.
    pub specific_force_body_mps2: Vector3<f64>,
    /// Battery voltage under load, volts.
    pub battery_v: f64,
    /// Battery current, amperes.
    pub battery_a: f64,
    /// Charge left, fraction.
    pub battery_fraction: f64,
    /// Charge left and drawn, ampere hours.
    pub battery_ah: (f64, f64),
    /// Energy drawn, watt hours.
    pub battery_wh: f64,
    /// The truth, which goes out as SIMSTATE and nowhere else.
    pub simulator: Motion,
}

/// The sticks and switches of a transmitter, as overridden over MAVLink: pulse widths, microseconds; 0 is not overridden.
#[derive(Debug, Clone, Copy)]
struct Sticks {
    channels_us: [u16; 8],
    at: Stamp,
}

/// The autopilot of one vehicle.
#[derive(Debug, Clone)]
pub struct Autopilot {
    frame: LocalFrame,
    airframe: AirframeConfig,
    params: Params,
    links: Vec<Link>,
    outbox: VecDeque<(Option<LinkId>, Outbound)>,
    boot: Stamp,
    now: Stamp,
    sensed: Sensed,
    controller: Controller,
    mode: Mode,
    armed: bool,
    landed: bool,
    flight: Flight,
    guided: Guided,
    mission: Mission,
    /// Home and the filter's origin in the fleet's local frame, metres; `None` until there is a position.
    home_ned_m: Option<Vector3<f64>>,
    home_is_set: bool,
    origin_ned_m: Option<Vector3<f64>>,
    sticks: Option<Sticks>,
    switch: Option<usize>,
    failsafe: failsafe::State,
    servos_us: [u16; 16],
    /// Armed on the ground since.
    idle_since: Option<Stamp>,
    told_prearm_at: Option<Stamp>,
}

impl Autopilot {
    /// Powered up at `now`, in the fleet's local `frame`.
    #[must_use]
    pub fn new(
        system_id: u8,
        frame: LocalFrame,
        airframe: AirframeConfig,
        battery_capacity_ah: f64,
        sensed: Sensed,
        now: Stamp,
    ) -> Self {
        let mut params = Params::new();
        params.assign(Param::SystemId, f64::from(system_id));
        params.assign(Param::BatteryCapacity, battery_capacity_ah * 1e3);
        Self {
            frame,
            airframe,
            params,
            links: Vec::new(),
            outbox: VecDeque::new(),
            boot: now,
            now,
            sensed,
            controller: Controller::new(),
            mode: Mode::Stabilize,
            armed: false,
            landed: true,
            flight: Flight::new(now),
            guided: Guided::Hold,
            mission: Mission::default(),
            home_ned_m: None,
            home_is_set: false,
            origin_ned_m: None,
            sticks: None,
            switch: None,
            failsafe: failsafe::State::default(),
            servos_us: [0; 16],
            idle_since: None,
            told_prearm_at: None,
        }
    }

    /// MAVLink system id: SYSID_THISMAV.
    #[must_use]
    pub fn system_id(&self) -> u8 {
        self.params.get(Param::SystemId) as u8
    }

    /// Flight mode.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
    }

    /// Whether the motors are armed.
    #[must_use]
    pub fn is_armed(&self) -> bool {
        self.armed
    }

    /// Whether it believes itself to be on the ground or the water.
    #[must_use]
    pub fn is_landed(&self) -> bool {
        self.landed
    }

    /// Parameters.
    #[must_use]
    pub fn params(&self) -> &Params {
        &self.params
    }

    /// Pulse width last commanded for a servo output (1 to 16), microseconds; 0 before any. What releases a payload.
    #[must_use]
    pub fn servo_us(&self, output: usize) -> u16 {
        output.checked_sub(1).and_then(|index| self.servos_us.get(index)).copied().unwrap_or(0)
    }

    /// Opens a link: `false` when there are too many already.
    pub fn attach(&mut self, link: LinkId) -> bool {
        if self.links.len() >= LINKS_MAX || self.links.iter().any(|known| known.id == link) {
            return false;
        }
        self.links.push(Link::new(link, self.now));
        true
    }

    /// Closes a link.
    pub fn detach(&mut self, link: LinkId) {
        self.links.retain(|known| known.id != link);
        if self.mission.upload.as_ref().is_some_and(|upload| upload.link == link) {
            self.mission.upload = None;
        }
    }

    /// What it has to say since the last call: to one link, or to all.
    pub fn take_outbox(&mut self) -> impl Iterator<Item = (Option<LinkId>, Outbound)> + '_ {
        self.outbox.drain(..)
    }

    /// One step of `dt_s`, ending at `now`.
    pub fn step(&mut self, now: Stamp, dt_s: f64, sensed: Sensed) -> Actuation {
        self.now = now;
        self.sensed = sensed;
        self.find_home();
        self.check_failsafes();
        let actuation = self.fly(dt_s);
        self.detect_landing(dt_s);
        self.disarm_when_idle();
        self.tell_prearm();
        self.stream();
        actuation
    }

    fn say(&mut self, link: Option<LinkId>, message: Outbound) {
        if self.outbox.len() >= OUTBOX_MAX {
            self.outbox.pop_front();
        }
        self.outbox.push_back((link, message));
    }

    fn reply(&mut self, link: LinkId, message: mav::MavMessage) {
        self.say(Some(link), Outbound::Message(message));
    }

    /// A STATUSTEXT to every link; MAVLink cuts it at 50 characters.
    fn text(&mut self, severity: mav::MavSeverity, text: &str) {
        let message = mav::STATUSTEXT_DATA { severity, text: text.into(), id: 0, chunk_seq: 0 };
        self.say(None, Outbound::Message(mav::MavMessage::STATUSTEXT(message)));
    }

    fn boot_ms(&self) -> u32 {
        (self.now.seconds_since(self.boot) * 1e3) as u32
    }

    /// Height above home by its own belief, metres.
    fn height_m(&self) -> f64 {
        self.home_ned_m.map_or(0.0, |home_m| home_m.z - self.sensed.estimate.position_ned_m.z)
    }

    /// Home is where the position first was good, and again where it arms, unless a person has set it.
    fn find_home(&mut self) {
        let estimate = &self.sensed.estimate;
        if self.origin_ned_m.is_none() && estimate.position_ok {
            let here_m = estimate.position_ned_m;
            self.origin_ned_m = Some(here_m);
            self.text(mav::MavSeverity::MAV_SEVERITY_INFO, "EKF3 IMU0 is using GPS");
            self.text(mav::MavSeverity::MAV_SEVERITY_INFO, "EKF3 IMU0 origin set");
            if let Some(origin) = self.origin_message() {
                self.say(None, Outbound::Message(origin));
            }
            if self.home_ned_m.is_none() {
                self.set_home(here_m);
            }
        }
    }

    fn set_home(&mut self, home_ned_m: Vector3<f64>) {
        self.home_ned_m = Some(home_ned_m);
        if let Some(home) = self.home_message() {
            self.say(None, Outbound::Message(home));
        }
    }
}
