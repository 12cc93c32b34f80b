//! An autopilot that a MAVLink client cannot tell from ArduCopter 4.6 in what it uses: modes, arming checks, GUIDED targets, LAND,
//! RTL, missions, parameters, streams, acknowledgements, fail-safes.
//!
//! Pure: [`Autopilot::handle`] takes messages, [`Autopilot::step`] takes what the sensors say and returns what the motors are to do,
//! [`Autopilot::take_outbox`] gives what it says. Differences from the original that a client may notice: nothing but heartbeats,
//! texts, home and TIMESYNC is sent on any link unless asked; messages are not passed on between links; sticks count as centred
//! until RC_CHANNELS_OVERRIDE says otherwise; a parameter keeps to its documented range; a target of acceleration alone is a stop;
//! the fence acts but does not slow a vehicle down before it (AVOID_ENABLE); there is no log, terrain or file transfer.

#![allow(deprecated, reason = "ArduPilot and its clients still speak much that MAVLink has deprecated")]

mod arming;
mod auto;
mod commands;
mod control;
mod failsafe;
mod fence;
mod flight;
mod guided;
mod health;
mod inbound;
mod items;
mod mission;
mod mode;
mod parameters;
mod params;
mod payload;
mod places;
mod sensors;
mod signing;
mod streams;
mod telemetry;
mod wire;

use std::collections::VecDeque;

use halcyon_model::{LocalFrame, Stamp};
use mavlink::dialects::ardupilotmega as mav;
use mavlink::{MavHeader, MavlinkVersion};
use nalgebra::Vector3;

pub use mode::Mode;
pub use params::{Param, Params};
pub use streams::LinkId;
pub use wire::{Inbound, Outbound, UnlistedAck};

use crate::copter::{Actuation, AirframeConfig, Motion};
use crate::estimator::{Estimate, GnssReading};
use control::Controller;
use fence::Fence;
use flight::Flight;
use guided::Guided;
use items::Uploads;
use mission::{Mission, RallyPoint};
use payload::Payload;
use signing::Signing;
use streams::Link;

/// Messages waiting for the shell; past this the oldest go.
const OUTBOX_MAX: usize = 4096;
/// Clients at once; a further one is refused.
pub const LINKS_MAX: usize = 32;
/// A STATUSTEXT's characters; a longer text goes in parts.
const TEXT_MAX: usize = 50;

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
    /// What the rangefinder measures along the body's down axis, metres; `None` without one.
    pub range_m: Option<f64>,
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
    rally: Vec<RallyPoint>,
    fence: Fence,
    uploads: Uploads,
    /// Home and the filter's origin in the fleet's local frame, metres; `None` until there is a position.
    home_ned_m: Option<Vector3<f64>>,
    home_is_set: bool,
    origin_ned_m: Option<Vector3<f64>>,
    sticks: Option<Sticks>,
    switch: Option<usize>,
    failsafe: failsafe::State,
    payload: Payload,
    signing: Option<Signing>,
    /// Of the last text that came in parts.
    text_id: u16,
    timesync_at: Stamp,
    /// GNSS has told the time.
    clock_is_set: bool,
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
            rally: Vec::new(),
            fence: Fence::default(),
            uploads: Uploads::default(),
            home_ned_m: None,
            home_is_set: false,
            origin_ned_m: None,
            sticks: None,
            switch: None,
            failsafe: failsafe::State::default(),
            payload: Payload::new(),
            signing: None,
            text_id: 0,
            timesync_at: now,
            clock_is_set: false,
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

    /// Gives it a rangefinder that looks down and measures so far, metres, as its parameters say it.
    pub fn fit_rangefinder(&mut self, least_m: f64, most_m: f64) {
        /// The type that is simulated.
        const SIMULATED: f64 = 100.0;
        self.params.assign(Param::RangefinderType, SIMULATED);
        self.params.assign(Param::RangefinderMin, least_m * 100.0);
        self.params.assign(Param::RangefinderMax, most_m * 100.0);
    }

    /// Whether frames are signed and must be.
    #[must_use]
    pub fn is_signing(&self) -> bool {
        self.signing.is_some()
    }

    /// Appends what it says on a link to `bytes`, signed when a key is set.
    pub fn encode(&mut self, link: LinkId, outbound: &Outbound, version: MavlinkVersion, sequence: u8, bytes: &mut Vec<u8>) {
        let header = MavHeader { system_id: u32::from(self.system_id()), component_id: 1, sequence };
        let signing = self.signing.as_mut().map(|signing| (signing, link.0 as u8));
        outbound.encode_signed(version, header, signing, bytes);
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
        self.uploads.detach(link);
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
        self.keep_time();
        self.check_failsafes();
        self.check_fence();
        let actuation = self.fly(dt_s);
        self.detect_landing(dt_s);
        self.disarm_when_idle();
        self.tell_prearm();
        self.watch_gripper();
        self.pump_uploads();
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

    /// A STATUSTEXT to every link; what is longer than one carries goes in parts with a common number.
    fn text(&mut self, severity: mav::MavSeverity, text: &str) {
        let parts = text_parts(text);
        let id = if parts.len() > 1 {
            self.text_id = self.text_id.checked_add(1).unwrap_or(1);
            self.text_id
        } else {
            0
        };
        for (chunk_seq, part) in (0..=u8::MAX).zip(parts) {
            let message = mav::STATUSTEXT_DATA { severity, text: part.into(), id, chunk_seq };
            self.say(None, Outbound::Message(mav::MavMessage::STATUSTEXT(message)));
        }
    }

    fn boot_ms(&self) -> u32 {
        (self.now.seconds_since(self.boot) * 1e3) as u32
    }

    fn boot_us(&self) -> u64 {
        (self.now.seconds_since(self.boot) * 1e6) as u64
    }

    /// Time from GNSS, for its clock and for signing, and a TIMESYNC on every link now and then, as ArduPilot asks for its logs.
    fn keep_time(&mut self) {
        const TIMESYNC_S: f64 = 10.0;
        self.clock_is_set |= self.sensed.gnss.is_some();
        if let (Some(signing), true) = (&mut self.signing, self.clock_is_set) {
            signing.tell_time(self.now.as_nanos() / 1000);
        }
        if self.now.seconds_since(self.timesync_at) >= TIMESYNC_S {
            self.timesync_at = self.now;
            // Its system id in the last digits tells its own answers apart.
            let ts1 = (self.boot_us() * 1000) as i64 + i64::from(self.system_id());
            let ask = mav::TIMESYNC_DATA { tc1: 0, ts1, target_system: 0, target_component: 0 };
            self.say(None, Outbound::Message(mav::MavMessage::TIMESYNC(ask)));
        }
    }

    /// What the rangefinder says, metres along the body's down axis, while it looks down and is in its range.
    fn range_m(&self) -> Option<f64> {
        let in_use = self.params.get(Param::RangefinderType) != 0.0 && self.params.get(Param::RangefinderOrientation) == 25.0;
        let (least_m, most_m) = (self.params.hundredths(Param::RangefinderMin), self.params.hundredths(Param::RangefinderMax));
        self.sensed.range_m.filter(|range_m| in_use && (least_m..=most_m).contains(range_m))
    }

    /// Height above what lies below by the rangefinder, metres.
    fn height_by_range_m(&self) -> Option<f64> {
        let cos_tilt = (self.sensed.estimate.ned_from_body * Vector3::z()).z;
        self.range_m().map(|range_m| range_m * cos_tilt.max(0.707))
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

/// A text in the parts that STATUSTEXT carries: the last is the first that is not full, empty if it must be.
fn text_parts(text: &str) -> Vec<&str> {
    let mut parts = Vec::new();
    let mut rest = text;
    // Texts are ASCII; what can't be cut ends the text.
    while let Some((part, left)) = rest.split_at_checked(TEXT_MAX).filter(|(_, left)| !left.is_empty() || !parts.is_empty()) {
        parts.push(part);
        rest = left;
    }
    parts.push(rest);
    parts
}

#[cfg(test)]
mod tests {
    use super::text_parts;

    #[test]
    fn a_long_text_ends_with_a_part_that_is_not_full() {
        let text = "x".repeat(120);
        for (length, expected) in [(0, vec![0]), (49, vec![49]), (50, vec![50]), (51, vec![50, 1]), (100, vec![50, 50, 0])] {
            let parts = text_parts(&text[..length]);
            assert_eq!(parts.iter().map(|part| part.len()).collect::<Vec<_>>(), expected);
            assert_eq!(parts.concat(), text[..length]);
        }
    }
}
