//! Folds MAVLink messages into the vehicle's state. Unknown stays unknown: `None`, or `false` where `true` would be permission.
//!
//! # Height
//! Height above mean water is the autopilot's altitude relative to home plus home's known height above the water
//! (`home_height_m`). The other choice, GNSS altitude above mean sea level less the origin's, is off by metres (GNSS is worse
//! upwards than sideways, geoid models differ by decimetres, a lake isn't at sea level); the barometer and the estimator hold the
//! relative one to decimetres over a flight, and a jetty's height is measured with a tape. The home that counts is the one it took
//! off from: an autopilot whose home is set anew in flight, or where it is armed again after a landing elsewhere, counts its height from
//! there. That shows in one message: the height above home steps, and the altitude above the sea does not. It is made up for. The other way
//! round it is no new home: without a position ArduPilot gives its receiver's altitude, or an old one, and its estimator's height.
//!
//! # Ages
//! Every part says how old it is. Health that is old, or dated ahead of now by a clock that was set back, is unknown.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use halcyon_model::{
    Activity, Ages, Fix, FleetOrigin, FlightMode, Geodetic, LandedState, LocalFrame, Range, Role, Stamp, VehicleId,
    VehicleState,
};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{EkfStatusFlags as Ekf, EstimatorStatusFlags as Estimator, MavMessage};

use super::motion::Differentiator;

/// After so long without news, a health value is unknown again, seconds.
const HEALTH_AGE_S: f64 = 5.0;
const BATTERY_AGE_S: f64 = 10.0;
/// A range is of one moment over moving water, seconds.
const RANGE_AGE_S: f64 = 0.5;
/// DISTANCE_SENSOR says more than ArduPilot's RANGEFINDER, which counts only where the other is not heard for so long, seconds.
const DISTANCE_SENSOR_S: f64 = 2.0;
/// DISTANCE_SENSOR's word for a signal that is not valid; 0 is its word for not known.
const SIGNAL_INVALID: u8 = 1;
/// What is dated further ahead of now than this is not fresh, seconds.
const AHEAD_S: f64 = 0.5;
/// Home's altitude, the difference of the autopilot's two, steps by more than this only when home is set anew, metres.
const HOME_STEP_M: f64 = 0.2;
/// Further from home than this, it is elsewhere, metres: receivers wander.
pub(super) const HOME_WITHIN_M: f64 = 20.0;
/// A home that is higher above the water than this can be told from the water by the height, metres.
const JETTY_M: f64 = 0.5;
/// The boot clock's offset to the fleet's is the least delay seen in the last one to two of these, seconds.
const OFFSET_WINDOW_S: f64 = 10.0;

/// A value and when it came.
#[derive(Debug, Clone, Copy)]
struct Aged<T>(T, Stamp);

impl<T: Copy> Aged<T> {
    fn fresh(this: Option<Self>, now: Stamp, age_s: f64) -> Option<T> {
        this.filter(|aged| (-AHEAD_S..=age_s).contains(&now.seconds_since(aged.1))).map(|aged| aged.0)
    }

    fn age_s(this: Option<Self>, now: Stamp) -> Option<f64> {
        this.map(|aged| now.seconds_since(aged.1).max(0.0))
    }
}

#[derive(Debug, Clone, Copy)]
struct Position {
    geodetic: Geodetic,
    relative_altitude_m: f64,
    velocity_ned_mps: Vector3<f64>,
    stamp: Stamp,
}

impl Position {
    fn home_amsl_m(&self) -> f64 {
        self.geodetic.altitude_m - self.relative_altitude_m
    }

    /// By how much higher home was set since, metres: what the height above home steps by while the altitude does as the climb says.
    fn home_rise_since_m(&self, before: &Self) -> f64 {
        let rise_m = self.home_amsl_m() - before.home_amsl_m();
        let climb_mps = -0.5 * (self.velocity_ned_mps.z + before.velocity_ned_mps.z);
        let climb_m = climb_mps * self.stamp.seconds_since(before.stamp).max(0.0);
        let step_m = self.geodetic.altitude_m - before.geodetic.altitude_m - climb_m;
        if step_m.abs() < 0.5 * rise_m.abs() { rise_m } else { 0.0 }
    }
}

/// Everything heard from one autopilot.
#[derive(Debug, Clone)]
pub struct Telemetry {
    vehicle: VehicleId,
    role: Role,
    frame: LocalFrame,
    home_height_m: f64,
    boot: BootClock,
    heartbeat: Option<Aged<(FlightMode, bool)>>,
    position: Option<Position>,
    attitude: Option<Aged<UnitQuaternion<f64>>>,
    home: Option<Aged<Geodetic>>,
    /// Home when it last left the ground.
    home_of_flight: Option<Geodetic>,
    off_the_ground: bool,
    /// By how much home is higher than the one that it took off from, metres.
    home_rise_m: f64,
    motion: Differentiator,
    /// `None` within: out of its range.
    range: Option<Aged<Option<f64>>>,
    distance_sensor_heard: Option<Stamp>,
    landed: Option<Aged<LandedState>>,
    battery: Option<Aged<(Option<f64>, Option<f64>)>>,
    /// Of the first and the second receiver.
    fixes: [Option<Aged<Fix>>; 2],
    estimator_ok: Option<Aged<bool>>,
    prearm_ok: Option<Aged<bool>>,
    heard: Option<Stamp>,
}

impl Telemetry {
    /// For one vehicle in the fleet's frame. `home_height_m`: height of its home above mean water, metres.
    #[must_use]
    pub fn new(vehicle: VehicleId, role: Role, origin: FleetOrigin, home_height_m: f64) -> Self {
        Self {
            vehicle,
            role,
            frame: origin.frame(),
            home_height_m,
            boot: BootClock::default(),
            heartbeat: None,
            position: None,
            attitude: None,
            home: None,
            home_of_flight: None,
            off_the_ground: false,
            home_rise_m: 0.0,
            motion: Differentiator::default(),
            range: None,
            distance_sensor_heard: None,
            landed: None,
            battery: None,
            fixes: [None; 2],
            estimator_ok: None,
            prearm_ok: None,
            heard: None,
        }
    }

    /// Takes one message of the vehicle's autopilot, received at `now`. Returns whether it was one that moves the vehicle's
    /// picture on (position, attitude or heartbeat).
    pub fn observe(&mut self, message: &MavMessage, now: Stamp) -> bool {
        self.heard = Some(now);
        match message {
            MavMessage::HEARTBEAT(data) => {
                let armed = data.base_mode.contains(ardu::MavModeFlag::MAV_MODE_FLAG_SAFETY_ARMED);
                self.heartbeat = Some(Aged((super::mode::from_heartbeat(data), armed), now));
                return true;
            }
            MavMessage::GLOBAL_POSITION_INT(data) => {
                if self.boot.is_new_life(data.time_boot_ms) {
                    self.started_again();
                }
                let stamp = self.boot.stamp(data.time_boot_ms, now);
                self.observe_position(position(data, stamp));
                return true;
            }
            MavMessage::ATTITUDE_QUATERNION(data) => {
                let q = [data.q1, data.q2, data.q3, data.q4].map(f64::from);
                let quaternion = Quaternion::new(q[0], q[1], q[2], q[3]);
                // A quaternion far from unit length is no attitude.
                if (quaternion.norm() - 1.0).abs() < 0.1 {
                    self.attitude = Some(Aged(UnitQuaternion::from_quaternion(quaternion), now));
                }
                return true;
            }
            MavMessage::ATTITUDE(data) => {
                let [roll, pitch, yaw] = [data.roll, data.pitch, data.yaw].map(f64::from);
                if [roll, pitch, yaw].iter().all(|angle| angle.is_finite()) {
                    self.attitude = Some(Aged(UnitQuaternion::from_euler_angles(roll, pitch, yaw), now));
                }
                return true;
            }
            MavMessage::HOME_POSITION(data) => {
                self.home = geodetic(data.latitude, data.longitude, data.altitude).map(|home| Aged(home, now));
            }
            MavMessage::LOCAL_POSITION_NED(data) => self.motion.observe(data, now),
            MavMessage::DISTANCE_SENSOR(data)
                if data.orientation == ardu::MavSensorOrientation::MAV_SENSOR_ROTATION_PITCH_270 =>
            {
                self.distance_sensor_heard = Some(now);
                let inside = data.current_distance >= data.min_distance && data.current_distance < data.max_distance;
                let valid = inside && data.current_distance > 0 && data.signal_quality != SIGNAL_INVALID;
                self.range = Some(Aged(valid.then(|| f64::from(data.current_distance) * 1e-2), now));
            }
            MavMessage::RANGEFINDER(data)
                if self.distance_sensor_heard.is_none_or(|heard| now.seconds_since(heard) > DISTANCE_SENSOR_S) =>
            {
                // It knows no limits of its own; nothing is nearer than 0, and that is its word for no reading.
                let distance_m = f64::from(data.distance);
                self.range = Some(Aged((distance_m > 0.0 && distance_m.is_finite()).then_some(distance_m), now));
            }
            MavMessage::EXTENDED_SYS_STATE(data) => {
                self.landed = Some(Aged(landed(data.landed_state), now));
                let armed = self.heartbeat.is_some_and(|heartbeat| heartbeat.0.1);
                let is_up = !matches!(landed(data.landed_state), LandedState::OnGround | LandedState::Unknown);
                let was_off = std::mem::replace(&mut self.off_the_ground, armed && is_up);
                if self.off_the_ground && !was_off {
                    self.home_of_flight = self.home.map(|home| home.0);
                }
            }
            MavMessage::SYS_STATUS(data) => self.observe_sys_status(data, now),
            MavMessage::BATTERY_STATUS(data) if data.id == 0 => self.observe_battery(data, now),
            MavMessage::GPS_RAW_INT(data) => {
                self.fixes[0] = Some(Aged(fix(data.fix_type, data.satellites_visible, data.h_acc), now));
            }
            MavMessage::GPS2_RAW(data) => {
                self.fixes[1] = Some(Aged(fix(data.fix_type, data.satellites_visible, data.h_acc), now));
            }
            MavMessage::EKF_STATUS_REPORT(data) => {
                let need = Ekf::EKF_ATTITUDE
                    | Ekf::EKF_VELOCITY_HORIZ
                    | Ekf::EKF_VELOCITY_VERT
                    | Ekf::EKF_POS_HORIZ_ABS
                    | Ekf::EKF_POS_VERT_ABS;
                let refuse = Ekf::EKF_CONST_POS_MODE | Ekf::EKF_UNINITIALIZED | Ekf::EKF_GPS_GLITCHING;
                // Innovations over 1 are outside the estimator's gate (ArduPilot's FS_EKF_THRESH acts from 0.8); NaN fails.
                let inside = data.velocity_variance < 1.0 && data.pos_horiz_variance < 1.0;
                let ok = data.flags.contains(need) && !data.flags.intersects(refuse) && inside;
                self.estimator_ok = Some(Aged(ok, now));
            }
            // PX4's way to say the same.
            MavMessage::ESTIMATOR_STATUS(data) => {
                let need = Estimator::ESTIMATOR_ATTITUDE
                    | Estimator::ESTIMATOR_VELOCITY_HORIZ
                    | Estimator::ESTIMATOR_VELOCITY_VERT
                    | Estimator::ESTIMATOR_POS_HORIZ_ABS
                    | Estimator::ESTIMATOR_POS_VERT_ABS;
                let refuse = Estimator::ESTIMATOR_CONST_POS_MODE | Estimator::ESTIMATOR_GPS_GLITCH;
                self.estimator_ok = Some(Aged(data.flags.contains(need) && !data.flags.intersects(refuse), now));
            }
            MavMessage::SYSTEM_TIME(data) => {
                if self.boot.is_new_life(data.time_boot_ms) {
                    self.started_again();
                }
                let _ = self.boot.stamp(data.time_boot_ms, now);
            }
            _ => {}
        }
        false
    }

    /// What TIMESYNC says of the autopilot's clock: our time at its boot, nanoseconds; `None` while it says nothing.
    pub fn set_boot_offset_ns(&mut self, offset_ns: Option<i64>) {
        self.boot.synced_ns = offset_ns;
    }

    fn observe_sys_status(&mut self, data: &ardu::SYS_STATUS_DATA, now: Stamp) {
        let prearm = ardu::MavSysStatusSensor::MAV_SYS_STATUS_PREARM_CHECK;
        let ok = data.onboard_control_sensors_present.contains(prearm)
            && data.onboard_control_sensors_enabled.contains(prearm)
            && data.onboard_control_sensors_health.contains(prearm);
        self.prearm_ok = Some(Aged(ok, now));
        let fraction = (0..=100).contains(&data.battery_remaining).then(|| f64::from(data.battery_remaining) * 0.01);
        let volts =
            (data.voltage_battery != u16::MAX && data.voltage_battery != 0).then(|| f64::from(data.voltage_battery) * 1e-3);
        self.merge_battery(fraction, volts, now);
    }

    fn observe_battery(&mut self, data: &ardu::BATTERY_STATUS_DATA, now: Stamp) {
        let fraction = (0..=100).contains(&data.battery_remaining).then(|| f64::from(data.battery_remaining) * 0.01);
        let cells = data.voltages.iter().filter(|cell| **cell != u16::MAX && **cell != 0);
        let volts: f64 = cells.map(|cell| f64::from(*cell) * 1e-3).sum();
        self.merge_battery(fraction, (volts > 0.0).then_some(volts), now);
    }

    /// One message may know the charge and another the voltage; one that knows neither says nothing, and so ages.
    fn merge_battery(&mut self, fraction: Option<f64>, volts: Option<f64>, now: Stamp) {
        if fraction.is_some() || volts.is_some() {
            let (old_fraction, old_volts) = Aged::fresh(self.battery, now, BATTERY_AGE_S).unwrap_or_default();
            // The charge decides about safety: it may not be kept alive by voltages.
            let stamp = if fraction.is_some() { now } else { self.battery.map_or(now, |aged| aged.1) };
            self.battery = Some(Aged((fraction.or(old_fraction), volts.or(old_volts)), stamp));
        }
    }

    fn observe_position(&mut self, position: Option<Position>) {
        let rise_m = self.position.zip(position).map_or(0.0, |(before, now)| now.home_rise_since_m(&before));
        if rise_m.abs() >= HOME_STEP_M {
            // At home it is where the vehicle stands again, without the barometer's drift.
            let elsewhere = self.off_the_ground || self.position.is_some_and(|before| self.is_away(&before));
            self.home_rise_m = if elsewhere { self.home_rise_m + rise_m } else { 0.0 };
        }
        self.position = position;
    }

    /// Whether it has flown, and is not where it took off, but on the water.
    fn is_away(&self, position: &Position) -> bool {
        let ned_m = |place| self.frame.ned_from_geodetic(place);
        let away_m = |home| (ned_m(home) - ned_m(position.geodetic)).xy().norm();
        let height_m = position.relative_altitude_m + self.home_height_m + self.home_rise_m;
        let is_down = is_beside_home(height_m, self.home_height_m);
        self.home_of_flight.is_some_and(|home| is_down || away_m(home) > HOME_WITHIN_M)
    }

    /// The autopilot started again: its home is another, and whatever was known of it is of the life before.
    fn started_again(&mut self) {
        self.position = None;
        self.home = None;
        self.home_of_flight = None;
        self.off_the_ground = false;
        self.home_rise_m = 0.0;
    }

    /// What the autopilot's relative altitude lacks because its home was set anew, metres. What is sent to it is short of that, too.
    #[must_use]
    pub fn home_rise_m(&self) -> f64 {
        self.home_rise_m
    }

    /// When the autopilot was last heard.
    #[must_use]
    pub fn heard(&self) -> Option<Stamp> {
        self.heard
    }

    /// When its mode was last heard.
    #[must_use]
    pub fn heartbeat_heard(&self) -> Option<Stamp> {
        self.heartbeat.map(|heartbeat| heartbeat.1)
    }

    /// The mode that was last heard.
    #[must_use]
    pub fn mode(&self) -> Option<FlightMode> {
        self.heartbeat.map(|heartbeat| heartbeat.0.0)
    }

    /// The mode that was last heard, and whether the motors were on.
    #[must_use]
    pub fn mode_and_armed(&self) -> Option<(FlightMode, bool)> {
        self.heartbeat.map(|heartbeat| heartbeat.0)
    }

    /// Altitude of home above mean sea level, metres, by the autopilot's two altitudes.
    #[must_use]
    pub fn home_amsl_m(&self) -> Option<f64> {
        self.position.map(|position| position.home_amsl_m())
    }

    /// What is still missing before there is a state, for people.
    #[must_use]
    pub fn missing(&self) -> &'static str {
        match (self.heartbeat, self.position, self.attitude) {
            (None, _, _) => "waiting for the autopilot's heartbeat",
            (_, None, _) => "waiting for the autopilot's position",
            (_, _, None) => "waiting for the autopilot's attitude",
            _ => "",
        }
    }

    /// The better of the receivers' fixes, if any is fresh; else the newest. With either the autopilot may fly: whether it can, its
    /// estimator says.
    fn best_fix(&self, now: Stamp) -> Option<Aged<Fix>> {
        let is_fresh = |aged: &Aged<Fix>| Aged::fresh(Some(*aged), now, HEALTH_AGE_S).is_some();
        let sigma_m = |aged: &Aged<Fix>| aged.0.horizontal_sigma_m.unwrap_or(f64::INFINITY);
        let fixes = self.fixes.iter().rev().flatten().copied();
        let best =
            fixes.clone().filter(is_fresh).max_by(|a, b| a.0.kind.cmp(&b.0.kind).then(sigma_m(b).total_cmp(&sigma_m(a))));
        best.or_else(|| fixes.max_by_key(|aged| aged.1))
    }

    /// The state at `now`; `None` until mode, position and attitude have been heard. Activity, plan, touchdown and payload are the
    /// executor's to fill in.
    #[must_use]
    pub fn state(&self, now: Stamp) -> Option<VehicleState> {
        let (position, attitude) = (self.position?, self.attitude?.0);
        let (mode, armed) = self.heartbeat?.0;
        let height_m = position.relative_altitude_m + self.home_height_m + self.home_rise_m;
        // North and east from the map, down from the height above water: see the module's documentation.
        let at_height = Geodetic { altitude_m: self.frame.origin().altitude_m + height_m, ..position.geodetic };
        let mut position_ned_m = self.frame.ned_from_geodetic(at_height);
        position_ned_m.z = -height_m;
        let (battery_fraction, battery_v) = Aged::fresh(self.battery, now, BATTERY_AGE_S).unwrap_or_default();
        let aged_fix = self.best_fix(now);
        let fix = Aged::fresh(aged_fix, now, HEALTH_AGE_S);
        let estimator_ok = Aged::fresh(self.estimator_ok, now, HEALTH_AGE_S).unwrap_or(false);
        let ready_to_arm = Aged::fresh(self.prearm_ok, now, HEALTH_AGE_S).unwrap_or(false);
        Some(VehicleState {
            stamp: position.stamp,
            vehicle: self.vehicle.clone(),
            role: self.role,
            position: position.geodetic,
            position_ned_m,
            velocity_ned_mps: position.velocity_ned_mps,
            ned_from_body: attitude,
            heading_rad: attitude.euler_angles().2.rem_euclid(std::f64::consts::TAU),
            home: self.home.map(|home| home.0),
            mode,
            armed,
            landed: Aged::fresh(self.landed, now, HEALTH_AGE_S).unwrap_or(LandedState::Unknown),
            battery_fraction,
            battery_v,
            fix,
            estimator_ok: estimator_ok && fix.is_some_and(|fix| fix.kind >= 3),
            ready_to_arm,
            boot_s: f64::from(self.boot.last_ms.unwrap_or(0)) * 1e-3,
            activity: Activity::Idle,
            plan_generation: 0,
            touchdown: None,
            acceleration_ned_mps2: self.motion.ned_mps2(now),
            intent: None,
            range: Aged::fresh(self.range, now, RANGE_AGE_S)
                .flatten()
                .zip(self.range)
                .map(|(distance_m, aged)| Range { stamp: aged.1, distance_m }),
            ages: Ages {
                mode_s: Aged::age_s(self.heartbeat, now),
                attitude_s: Aged::age_s(self.attitude, now),
                landed_s: Aged::age_s(self.landed, now),
                battery_s: Aged::age_s(self.battery, now),
                fix_s: Aged::age_s(aged_fix, now),
                estimator_s: Aged::age_s(self.estimator_ok, now),
                home_s: Aged::age_s(self.home, now),
            },
            link: None,
            firmware: None,
            has_payload: false,
        })
    }
}

/// Whether what stands or floats at a height above the water is beside a home at `home_height_m`, on the water, and not on it; both metres.
pub(super) fn is_beside_home(height_m: f64, home_height_m: f64) -> bool {
    home_height_m > JETTY_M && height_m < 0.5 * home_height_m
}

fn position(data: &ardu::GLOBAL_POSITION_INT_DATA, stamp: Stamp) -> Option<Position> {
    Some(Position {
        geodetic: geodetic(data.lat, data.lon, data.alt)?,
        relative_altitude_m: f64::from(data.relative_alt) * 1e-3,
        velocity_ned_mps: Vector3::new(data.vx.into(), data.vy.into(), data.vz.into()) * 1e-2,
        stamp,
    })
}

fn fix(kind: ardu::GpsFixType, satellites_visible: u8, sigma_mm: u32) -> Fix {
    Fix {
        // Kinds beyond 6 (static, PPP) are at least three-dimensional.
        kind: (kind as u32).min(6),
        satellites: if satellites_visible == u8::MAX { 0 } else { satellites_visible.into() },
        horizontal_sigma_m: (sigma_mm != 0).then(|| f64::from(sigma_mm) * 1e-3),
    }
}

/// From MAVLink's 1e-7 degrees and millimetres; (0, 0) is how autopilots say that they don't know.
fn geodetic(latitude: i32, longitude: i32, altitude_mm: i32) -> Option<Geodetic> {
    let place = Geodetic::from_deg(f64::from(latitude) * 1e-7, f64::from(longitude) * 1e-7, f64::from(altitude_mm) * 1e-3);
    (place.is_valid() && (latitude != 0 || longitude != 0)).then_some(place)
}

fn landed(state: ardu::MavLandedState) -> LandedState {
    match state {
        ardu::MavLandedState::MAV_LANDED_STATE_UNDEFINED => LandedState::Unknown,
        ardu::MavLandedState::MAV_LANDED_STATE_ON_GROUND => LandedState::OnGround,
        ardu::MavLandedState::MAV_LANDED_STATE_IN_AIR => LandedState::InAir,
        ardu::MavLandedState::MAV_LANDED_STATE_TAKEOFF => LandedState::TakingOff,
        ardu::MavLandedState::MAV_LANDED_STATE_LANDING => LandedState::Landing,
    }
}

/// Turns the autopilot's time since boot into the fleet's time. The offset is TIMESYNC's ([`super::timesync`]) while that is fresh, and
/// else the least seen lately, so that queueing delay doesn't date a position later than it was measured.
#[derive(Debug, Clone, Copy, Default)]
struct BootClock {
    last_ms: Option<u32>,
    synced_ns: Option<i64>,
    window: Option<(Stamp, i64, i64)>,
}

impl BootClock {
    /// Back by more than a second: the autopilot started again.
    fn is_new_life(&self, boot_ms: u32) -> bool {
        self.last_ms.is_some_and(|last| boot_ms.saturating_add(1000) < last)
    }

    fn stamp(&mut self, boot_ms: u32, now: Stamp) -> Stamp {
        let offset_ns = now.as_nanos().saturating_sub(i64::from(boot_ms) * 1_000_000);
        if self.is_new_life(boot_ms) {
            self.window = None;
        }
        self.last_ms = Some(boot_ms);
        let (since, current, previous) = self.window.unwrap_or((now, i64::MAX, i64::MAX));
        let current = current.min(offset_ns);
        let best = current.min(previous);
        self.window = Some(if now.seconds_since(since) > OFFSET_WINDOW_S {
            (now, i64::MAX, current)
        } else {
            (since, current, previous)
        });
        // One that is a second off the other belongs to a boot that is over, or to a counter that has wrapped.
        let synced_ns = self.synced_ns.filter(|synced_ns| synced_ns.abs_diff(best) < 1_000_000_000);
        let stamp = Stamp::from_nanos((i64::from(boot_ms) * 1_000_000).saturating_add(synced_ns.unwrap_or(best)));
        // However wrong that clock is: never ahead of now, never more than a second behind it.
        stamp.clamp(now.plus_secs_f64(-1.0), now)
    }
}

#[cfg(test)]
mod tests;
