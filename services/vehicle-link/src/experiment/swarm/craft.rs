//! A copter as a point with an autopilot's cascade: position to velocity to acceleration to lean. Independent of the simulator
//! crate, and a hundred times as fast.

use halcyon_model::{
    Activity, Ages, Fix, FleetOrigin, FlightMode, Geodetic, LandedState, LocalFrame, Role, Stamp, VehicleId, VehicleState,
};
use nalgebra::{UnitQuaternion, Vector3};

use super::super::chance::Chance;
use crate::core::guidance::Setpoint;
use crate::core::track::wrap_rad;

const GRAVITY_MPS2: f64 = 9.806_65;
/// Fastest it flies and leans: metres per second, metres per second squared.
const SPEED_MPS_MAX: f64 = 10.0;
const ACCELERATION_MPS2_MAX: f64 = 5.0;
/// How ArduCopter shapes a velocity: 1/s; what WPNAV_ACCEL and the jerk limit allow.
const SHAPE_HZ: f64 = 3.0;
const STICK_MPS2_MAX: f64 = 2.5;
const STICK_MPS3_MAX: f64 = 8.0;
/// Fastest turn, radians per second.
const TURN_RADPS_MAX: f64 = 1.0;
/// And how fast a stick's turn sets in, radians per second squared.
const TURN_RADPS2_MAX: f64 = 2.0;
/// Memory of a gust and of a receiver's error, seconds.
const GUST_S: f64 = 2.0;
const WANDER_S: f64 = 60.0;

/// An airframe and its autopilot. Guidance believes in its own defaults, whatever these are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Airframe {
    pub(super) position_gain_hz: f64,
    pub(super) velocity_gain_hz: f64,
    pub(super) lean_lag_s: f64,
    /// Standard deviation of what the wind's gusts push it, metres per second squared.
    pub(super) gust_mps2: f64,
    /// Standard deviation of the receiver's error on each axis, metres, wandering over a minute.
    pub(super) wander_m: f64,
}

pub(super) struct Craft {
    pub(super) id: VehicleId,
    pub(super) position_m: Vector3<f64>,
    pub(super) velocity_mps: Vector3<f64>,
    pub(super) heading_rad: f64,
    pub(super) mode: FlightMode,
    /// Added to what the receiver says, metres.
    pub(super) jump_m: Vector3<f64>,
    pub(super) setpoint: Option<Setpoint>,
    airframe: Airframe,
    turn_radps: f64,
    /// What the sticks are shaped into.
    shaped_mps: Vector3<f64>,
    shaped_mps2: Vector3<f64>,
    lean_mps2: Vector3<f64>,
    gust_mps2: Vector3<f64>,
    wander_m: Vector3<f64>,
    chance: Chance,
    frame: LocalFrame,
}

impl Craft {
    pub(super) fn new(id: VehicleId, position_m: Vector3<f64>, airframe: Airframe, mut chance: Chance) -> Self {
        let mut normal3 = |sigma: f64| Vector3::new(chance.normal(), chance.normal(), 0.5 * chance.normal()) * sigma;
        let (gust_mps2, wander_m) = (normal3(airframe.gust_mps2), normal3(airframe.wander_m));
        Self {
            id,
            position_m,
            velocity_mps: Vector3::zeros(),
            heading_rad: 0.0,
            mode: FlightMode::Guided,
            jump_m: Vector3::zeros(),
            setpoint: None,
            airframe,
            turn_radps: 0.0,
            shaped_mps: Vector3::zeros(),
            shaped_mps2: Vector3::zeros(),
            lean_mps2: Vector3::zeros(),
            gust_mps2,
            wander_m,
            chance,
            frame: frame(),
        }
    }

    /// Where it believes it is.
    fn believed_m(&self) -> Vector3<f64> {
        self.position_m + self.wander_m + self.jump_m
    }

    /// Flies on towards its setpoint, which moves on by itself as ArduCopter's does.
    pub(super) fn step(&mut self, dt_s: f64) {
        let mut demand_mps2 = -self.velocity_mps * self.airframe.velocity_gain_hz;
        let here_m = self.believed_m();
        if let Some(setpoint) = &mut self.setpoint {
            let feed_mps2 = setpoint.acceleration_ned_mps2.unwrap_or_default();
            setpoint.velocity_ned_mps += feed_mps2 * dt_s;
            setpoint.position_ned_m += setpoint.velocity_ned_mps * dt_s;
            let behind_m = setpoint.position_ned_m - here_m;
            let wanted_mps =
                (setpoint.velocity_ned_mps + behind_m * self.airframe.position_gain_hz).cap_magnitude(SPEED_MPS_MAX);
            demand_mps2 = feed_mps2 + (wanted_mps - self.velocity_mps) * self.airframe.velocity_gain_hz;
            if let Some(heading_rad) = setpoint.heading_rad {
                let most_rad = TURN_RADPS_MAX * dt_s;
                let turn_rad = wrap_rad(heading_rad - self.heading_rad).clamp(-most_rad, most_rad);
                self.heading_rad = wrap_rad(self.heading_rad + turn_rad);
            }
        }
        self.push(demand_mps2, dt_s);
    }

    /// A pilot's sticks: a velocity and a turn, as the autopilot shapes them.
    pub(super) fn steer(&mut self, velocity_mps: Vector3<f64>, turn_radps: f64, dt_s: f64) {
        let most_radps = TURN_RADPS2_MAX * dt_s;
        self.turn_radps += (turn_radps - self.turn_radps).clamp(-most_radps, most_radps);
        self.heading_rad = wrap_rad(self.heading_rad + self.turn_radps * dt_s);
        let wanted_mps2 = ((velocity_mps - self.shaped_mps) * SHAPE_HZ).cap_magnitude(STICK_MPS2_MAX);
        self.shaped_mps2 += (wanted_mps2 - self.shaped_mps2).cap_magnitude(STICK_MPS3_MAX * dt_s);
        self.shaped_mps += self.shaped_mps2 * dt_s;
        self.push(self.shaped_mps2 + (self.shaped_mps - self.velocity_mps) * self.airframe.velocity_gain_hz, dt_s);
    }

    fn push(&mut self, demand_mps2: Vector3<f64>, dt_s: f64) {
        let demand_mps2 = demand_mps2.cap_magnitude(ACCELERATION_MPS2_MAX);
        self.lean_mps2 += (demand_mps2 - self.lean_mps2) * (dt_s / self.airframe.lean_lag_s.max(dt_s));
        // Its controller's integral has learnt the mean wind; gusts push it.
        let chance = &mut self.chance;
        let mut wandered = |value: &mut Vector3<f64>, sigma: f64, memory_s: f64| {
            let spread = sigma * (2.0 * dt_s / memory_s).sqrt();
            let news = Vector3::new(chance.normal(), chance.normal(), 0.5 * chance.normal());
            *value += news * spread - *value * (dt_s / memory_s);
        };
        wandered(&mut self.gust_mps2, self.airframe.gust_mps2, GUST_S);
        wandered(&mut self.wander_m, self.airframe.wander_m, WANDER_S);
        self.velocity_mps += (self.lean_mps2 + self.gust_mps2) * dt_s;
        self.position_m += self.velocity_mps * dt_s;
        self.position_m.z = self.position_m.z.min(0.0);
    }

    /// What its autopilot says.
    pub(super) fn state(&self, now: Stamp) -> VehicleState {
        let up = (self.lean_mps2 - Vector3::new(0.0, 0.0, GRAVITY_MPS2)).normalize();
        let upright = Vector3::new(0.0, 0.0, -1.0);
        let lean = UnitQuaternion::rotation_between(&upright, &up).unwrap_or_default();
        let position_ned_m = self.believed_m();
        let role = if self.id.as_str().starts_with("leader") { Role::Leader } else { Role::Follower };
        VehicleState {
            stamp: now,
            vehicle: self.id.clone(),
            role,
            position: self.frame.geodetic_from_ned(position_ned_m),
            position_ned_m,
            velocity_ned_mps: self.velocity_mps,
            ned_from_body: lean * UnitQuaternion::from_euler_angles(0.0, 0.0, self.heading_rad),
            heading_rad: self.heading_rad.rem_euclid(std::f64::consts::TAU),
            home: Some(self.frame.geodetic_from_ned(Vector3::zeros())),
            mode: self.mode,
            armed: true,
            landed: LandedState::InAir,
            battery_fraction: Some(0.9),
            battery_v: None,
            fix: Some(Fix { kind: 3, satellites: 12, horizontal_sigma_m: None }),
            estimator_ok: true,
            ready_to_arm: true,
            boot_s: 100.0,
            activity: Activity::Idle,
            plan_generation: 0,
            touchdown: None,
            acceleration_ned_mps2: None,
            intent: None,
            range: None,
            ages: Ages::default(),
            link: None,
            firmware: None,
            has_payload: false,
        }
    }
}

/// The fleet's frame.
pub(super) fn frame() -> LocalFrame {
    FleetOrigin(Geodetic::from_deg(53.1, -2.9, 0.0)).frame()
}
