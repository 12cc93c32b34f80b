//! The airframe: a multicopter as a rigid body with its rate loop closed.
//!
//! Translation is Newton's law with thrust along the body axis, gravity, quadratic drag against the air, and contact with what is
//! below. Rotation is the attitude's kinematics driven by body rates that follow the commanded ones with a first-order lag: on a
//! real multicopter the innermost loop has that effect, an order of magnitude faster than anything that navigates. Thrust follows
//! its command with the motors' lag. Semi-implicit Euler at a fixed small step.

use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// Standard gravity, metres per second squared.
pub const GRAVITY_MPS2: f64 = 9.806_65;
/// Density of air at sea level, kilograms per cubic metre (ISA).
pub const AIR_DENSITY_KGPM3: f64 = 1.225;
/// Without motors, body rates decay in the air with this time constant, seconds.
const TUMBLE_DECAY_S: f64 = 1.0;
/// In contact, a vehicle that does not lift itself settles level with this rate, 1/s.
const SETTLE_PER_S: f64 = 5.0;

/// The airframe (`[sim.airframe]`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AirframeConfig {
    /// Take-off mass, kilograms, 0.1 to 100.
    pub mass_kg: f64,
    /// Drag coefficient times frontal area, square metres, 0 to 5.
    pub drag_area_m2: f64,
    /// Greatest thrust over weight, 1.2 to 10.
    pub thrust_to_weight: f64,
    /// Lag of the motors, seconds, 0.005 to 0.5.
    pub motor_lag_s: f64,
    /// Lag of the closed rate loop, seconds, 0.005 to 0.5.
    pub rate_lag_s: f64,
    /// Electrical power to hover, watts, 10 to 20 000.
    pub hover_power_w: f64,
    /// Electrical power of everything else, watts, 0 to 1000.
    pub avionics_power_w: f64,
}

impl Default for AirframeConfig {
    /// A 3.2 kg quadrotor that leans 11° against 10 m/s.
    fn default() -> Self {
        Self {
            mass_kg: 3.2,
            drag_area_m2: 0.1,
            thrust_to_weight: 2.2,
            motor_lag_s: 0.05,
            rate_lag_s: 0.04,
            hover_power_w: 420.0,
            avionics_power_w: 12.0,
        }
    }
}

impl AirframeConfig {
    /// Checks every number.
    ///
    /// # Errors
    /// One line that names the key and its range.
    pub fn validate(&self) -> Result<(), String> {
        use crate::config::range;
        range("airframe.mass_kg", self.mass_kg, 0.1, 100.0)?;
        range("airframe.drag_area_m2", self.drag_area_m2, 0.0, 5.0)?;
        range("airframe.thrust_to_weight", self.thrust_to_weight, 1.2, 10.0)?;
        range("airframe.motor_lag_s", self.motor_lag_s, 0.005, 0.5)?;
        range("airframe.rate_lag_s", self.rate_lag_s, 0.005, 0.5)?;
        range("airframe.hover_power_w", self.hover_power_w, 10.0, 20_000.0)?;
        range("airframe.avionics_power_w", self.avionics_power_w, 0.0, 1000.0)
    }

    /// Weight, newtons.
    #[must_use]
    pub fn weight_n(&self) -> f64 {
        self.mass_kg * GRAVITY_MPS2
    }

    /// Greatest thrust, newtons.
    #[must_use]
    pub fn thrust_max_n(&self) -> f64 {
        self.weight_n() * self.thrust_to_weight
    }
}

/// True motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Position of the feet in the fleet's local frame, metres.
    pub position_ned_m: Vector3<f64>,
    /// Velocity, metres per second.
    pub velocity_ned_mps: Vector3<f64>,
    /// Attitude.
    pub ned_from_body: UnitQuaternion<f64>,
    /// Body rates (forward, right, down), radians per second.
    pub rate_body_radps: Vector3<f64>,
    /// What an accelerometer would show (forward, right, down), metres per second squared.
    pub specific_force_body_mps2: Vector3<f64>,
}

impl Motion {
    /// Standing level at a place, with a heading in radians.
    #[must_use]
    pub fn at_rest(position_ned_m: Vector3<f64>, heading_rad: f64) -> Self {
        Self {
            position_ned_m,
            velocity_ned_mps: Vector3::zeros(),
            ned_from_body: UnitQuaternion::from_euler_angles(0.0, 0.0, heading_rad),
            rate_body_radps: Vector3::zeros(),
            specific_force_body_mps2: Vector3::new(0.0, 0.0, -GRAVITY_MPS2),
        }
    }
}

/// What the autopilot asks of the airframe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actuation {
    /// Whether the motors turn at all.
    pub motors: bool,
    /// Body rates to reach, radians per second.
    pub rate_body_radps: Vector3<f64>,
    /// Thrust to reach, newtons.
    pub thrust_n: f64,
}

impl Actuation {
    /// Motors stopped.
    pub const OFF: Self = Self { motors: false, rate_body_radps: Vector3::new(0.0, 0.0, 0.0), thrust_n: 0.0 };
}

/// What a vehicle can stand on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Support {
    /// Its height above mean water, metres, positive up.
    pub height_m: f64,
    /// How fast it rises, metres per second.
    pub rise_mps: f64,
    /// Water, which gives way, or ground.
    pub water: bool,
}

/// The airframe in motion.
#[derive(Debug, Clone)]
pub struct Copter {
    config: AirframeConfig,
    motion: Motion,
    thrust_n: f64,
    touching: bool,
}

impl Copter {
    /// Standing at a place with a heading, motors off.
    #[must_use]
    pub fn new(config: AirframeConfig, position_ned_m: Vector3<f64>, heading_rad: f64) -> Self {
        Self { config, motion: Motion::at_rest(position_ned_m, heading_rad), thrust_n: 0.0, touching: false }
    }

    /// The airframe.
    #[must_use]
    pub fn config(&self) -> &AirframeConfig {
        &self.config
    }

    /// True motion.
    #[must_use]
    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    /// Whether the ground or the water carries any of it.
    #[must_use]
    pub fn touching(&self) -> bool {
        self.touching
    }

    /// Present thrust, newtons.
    #[must_use]
    pub fn thrust_n(&self) -> f64 {
        self.thrust_n
    }

    /// Present electrical power, watts: induced power goes with thrust to the 3/2.
    #[must_use]
    pub fn power_w(&self) -> f64 {
        let ratio = (self.thrust_n / self.config.weight_n()).max(0.0);
        self.config.avionics_power_w + self.config.hover_power_w * ratio * ratio.sqrt()
    }

    /// Drag on the vehicle in this wind, newtons: ½ ρ C_d A |v| v against the air.
    #[must_use]
    pub fn drag_n(&self, wind_ned_mps: Vector3<f64>) -> Vector3<f64> {
        let air_mps = self.motion.velocity_ned_mps - wind_ned_mps;
        air_mps * (-0.5 * AIR_DENSITY_KGPM3 * self.config.drag_area_m2 * air_mps.norm())
    }

    /// Advances by `dt_s`. `support` is what lies below, if it can be reached.
    pub fn step(&mut self, dt_s: f64, actuation: &Actuation, wind_ned_mps: Vector3<f64>, support: Option<Support>) {
        let wanted_n = if actuation.motors { actuation.thrust_n.clamp(0.0, self.config.thrust_max_n()) } else { 0.0 };
        self.thrust_n += (wanted_n - self.thrust_n) * (1.0 - (-dt_s / self.config.motor_lag_s).exp());

        let mass_kg = self.config.mass_kg;
        let thrust_mps2 = self.motion.ned_from_body * Vector3::new(0.0, 0.0, -self.thrust_n / mass_kg);
        let mut force_mps2 = thrust_mps2 + self.drag_n(wind_ned_mps) / mass_kg;
        let contact = support.and_then(|support| self.contact(support));
        self.touching = contact.is_some();
        if let Some(contact) = contact {
            force_mps2.z -= contact.lift_mps2;
        }
        self.motion.specific_force_body_mps2 = self.motion.ned_from_body.inverse_transform_vector(&force_mps2);
        self.motion.velocity_ned_mps += (force_mps2 + Vector3::new(0.0, 0.0, GRAVITY_MPS2)) * dt_s;
        if let Some(contact) = contact {
            let keep = (-dt_s / contact.friction_s).exp();
            self.motion.velocity_ned_mps.x *= keep;
            self.motion.velocity_ned_mps.y *= keep;
        }
        self.motion.position_ned_m += self.motion.velocity_ned_mps * dt_s;
        self.rotate(dt_s, actuation);
    }

    fn rotate(&mut self, dt_s: f64, actuation: &Actuation) {
        let (wanted_radps, lag_s) = if self.touching && self.thrust_n < self.config.weight_n() {
            // The feet decide: level, heading as it is.
            let up_body = self.motion.ned_from_body.inverse_transform_vector(&Vector3::new(0.0, 0.0, -1.0));
            let level = Vector3::new(0.0, 0.0, -1.0).cross(&up_body);
            (level * SETTLE_PER_S, self.config.rate_lag_s)
        } else if actuation.motors {
            (actuation.rate_body_radps, self.config.rate_lag_s)
        } else {
            (Vector3::zeros(), TUMBLE_DECAY_S)
        };
        self.motion.rate_body_radps += (wanted_radps - self.motion.rate_body_radps) * (1.0 - (-dt_s / lag_s).exp());
        let turned = UnitQuaternion::from_scaled_axis(self.motion.rate_body_radps * dt_s);
        self.motion.ned_from_body *= turned;
        self.motion.ned_from_body.renormalize_fast();
    }

    /// A damped spring that only pushes: stiff feet on the ground, floats that sink a hand's breadth into the water.
    fn contact(&self, support: Support) -> Option<Contact> {
        let depth_m = support.height_m + self.motion.position_ned_m.z;
        if depth_m <= 0.0 {
            return None;
        }
        let (stiffness_radps, damping, friction_s) = if support.water { (12.0, 0.5, 0.8) } else { (40.0, 0.7, 0.05) };
        let closing_mps = self.motion.velocity_ned_mps.z + support.rise_mps;
        let lift_mps2 = stiffness_radps * stiffness_radps * depth_m + 2.0 * damping * stiffness_radps * closing_mps;
        Some(Contact { lift_mps2: lift_mps2.max(0.0), friction_s })
    }
}

#[derive(Clone, Copy)]
struct Contact {
    lift_mps2: f64,
    friction_s: f64,
}

#[cfg(test)]
mod tests {
    use super::*;

    const DT_S: f64 = 0.0025;

    fn aloft(config: AirframeConfig) -> Copter {
        let mut copter = Copter::new(config, Vector3::new(0.0, 0.0, -1000.0), 0.0);
        copter.thrust_n = copter.config.weight_n();
        copter
    }

    fn run(copter: &mut Copter, seconds: f64, actuation: &Actuation, wind: Vector3<f64>, support: Option<Support>) {
        for _ in 0..(seconds / DT_S).round() as usize {
            copter.step(DT_S, actuation, wind, support);
        }
    }

    fn level(thrust_n: f64) -> Actuation {
        Actuation { motors: true, rate_body_radps: Vector3::zeros(), thrust_n }
    }

    #[test]
    fn thrust_equal_to_weight_hovers() {
        let mut copter = aloft(AirframeConfig::default());
        let weight_n = copter.config.weight_n();
        run(&mut copter, 60.0, &level(weight_n), Vector3::zeros(), None);
        assert!(copter.motion.velocity_ned_mps.norm() < 1e-9, "{}", copter.motion.velocity_ned_mps);
        assert!((copter.motion.specific_force_body_mps2.z + GRAVITY_MPS2).abs() < 1e-9);
    }

    /// m u' = −k u² gives u(t) = u0 / (1 + k u0 t / m) for the speed u against the air.
    #[test]
    fn a_level_vehicle_drifts_up_to_the_wind_as_quadratic_drag_says() {
        let config = AirframeConfig::default();
        let per_m = 0.5 * AIR_DENSITY_KGPM3 * config.drag_area_m2 / config.mass_kg;
        let wind_mps = 8.0;
        for seconds in [1.0, 5.0, 20.0, 60.0] {
            let mut copter = aloft(config.clone());
            let weight_n = copter.config.weight_n();
            run(&mut copter, seconds, &level(weight_n), Vector3::new(wind_mps, 0.0, 0.0), None);
            let expected_mps = wind_mps - wind_mps / (1.0 + per_m * wind_mps * seconds);
            let drift_mps = copter.motion.velocity_ned_mps.x;
            assert!((drift_mps - expected_mps).abs() < 2e-3, "{seconds} s: {drift_mps} against {expected_mps}");
        }
    }

    /// v(t) = v_t tanh(g t / v_t), v_t = √(2 m g / (ρ C_d A)).
    #[test]
    fn a_vehicle_without_motors_falls_as_the_closed_form_says() {
        let config = AirframeConfig::default();
        let terminal_mps = (2.0 * config.weight_n() / (AIR_DENSITY_KGPM3 * config.drag_area_m2)).sqrt();
        for seconds in [1.0, 3.0, 30.0] {
            let mut copter = Copter::new(config.clone(), Vector3::new(0.0, 0.0, -2000.0), 0.0);
            run(&mut copter, seconds, &Actuation::OFF, Vector3::zeros(), None);
            let expected_mps = terminal_mps * (GRAVITY_MPS2 * seconds / terminal_mps).tanh();
            let fall_mps = copter.motion.velocity_ned_mps.z;
            assert!((fall_mps - expected_mps).abs() < 0.02, "{seconds} s: {fall_mps} against {expected_mps}");
        }
    }

    /// On a spring of ω² per metre a unit mass rests g / ω² deep.
    #[test]
    fn it_rests_on_the_ground_and_floats_on_the_water() {
        for (water, depth_m) in [(false, GRAVITY_MPS2 / 1600.0), (true, GRAVITY_MPS2 / 144.0)] {
            let mut copter = Copter::new(AirframeConfig::default(), Vector3::new(0.0, 0.0, -0.3), 0.0);
            copter.motion.ned_from_body = UnitQuaternion::from_euler_angles(0.1, -0.1, 1.0);
            copter.motion.velocity_ned_mps.x = 0.4;
            let support = Support { height_m: 0.2, rise_mps: 0.0, water };
            run(&mut copter, 20.0, &Actuation::OFF, Vector3::zeros(), Some(support));
            let rest_m = copter.motion.position_ned_m.z + 0.2;
            assert!(copter.touching() && (rest_m - depth_m).abs() < 1e-4, "water {water}: {rest_m} against {depth_m}");
            assert!(copter.motion.velocity_ned_mps.norm() < 1e-3);
            let (roll, pitch, heading) = copter.motion.ned_from_body.euler_angles();
            assert!(roll.abs() < 0.01 && pitch.abs() < 0.01 && (heading - 1.0).abs() < 0.02, "{roll} {pitch} {heading}");
        }
    }

    #[test]
    fn a_commanded_rate_is_reached_and_turns_the_body() {
        let mut copter = aloft(AirframeConfig::default());
        let weight_n = copter.config.weight_n();
        let turn = Actuation { motors: true, rate_body_radps: Vector3::new(0.0, 0.0, 0.5), thrust_n: weight_n };
        run(&mut copter, 2.0, &turn, Vector3::zeros(), None);
        // ω t minus the lag of the first-order response.
        let expected_rad = 0.5 * (2.0 - copter.config.rate_lag_s);
        let heading_rad = copter.motion.ned_from_body.euler_angles().2;
        assert!((heading_rad - expected_rad).abs() < 2e-3, "{heading_rad} against {expected_rad}");
    }
}
