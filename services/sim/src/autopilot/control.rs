//! From a setpoint to body rates and thrust, by what the estimator believes.
//!
//! As on ArduCopter, a target is first shaped into a desired motion that respects speed, acceleration and jerk, and that desired
//! motion is then tracked: position error to velocity, velocity error (with an integral, which learns wind and level errors) to
//! acceleration, acceleration to lean and thrust, attitude error to body rates.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector2, Vector3};

use super::params::{Param, Params};
use crate::copter::{Actuation, AirframeConfig, GRAVITY_MPS2};
use crate::estimator::Estimate;

/// Shaping: velocity error to acceleration, 1/s.
const SHAPE_PER_S: f64 = 3.0;
/// Shaping: greatest jerk, metres per second cubed.
const JERK_MPS3: f64 = 8.0;
/// The desired position stays this close to the believed one, metres, so that a vehicle that can't keep up is not left behind.
const LEASH_M: f64 = 4.0;
/// Vertical leash, metres.
const LEASH_DOWN_M: f64 = 1.5;
/// Bound of the horizontal integral, metres per second squared.
const INTEGRAL_MAX_MPS2: f64 = 4.0;
/// Vertical integral gain, 1/s², and its bound, metres per second squared.
const DOWN_INTEGRAL: (f64, f64) = (1.5, 4.0);
/// Fastest roll and pitch, radians per second.
const LEAN_RATE_MAX_RADPS: f64 = 3.8;
/// Least thrust with the motors turning, fraction of the weight.
pub(crate) const THRUST_IDLE: f64 = 0.1;
/// Slower than this it does not turn to face the way it flies, metres per second.
const FACING_MPS: f64 = 0.5;

/// Where to go horizontally.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Horizontal {
    /// To a moving point.
    Position { ne_m: Vector2<f64>, velocity_mps: Vector2<f64>, acceleration_mps2: Vector2<f64> },
    /// At a velocity; zero holds the place where it stops.
    Velocity { velocity_mps: Vector2<f64>, acceleration_mps2: Vector2<f64> },
    /// Leaning, roll right and pitch up, radians.
    Lean { roll_rad: f64, pitch_rad: f64 },
}

impl Horizontal {
    /// Stop and stay.
    pub(crate) const HOLD: Self =
        Self::Velocity { velocity_mps: Vector2::new(0.0, 0.0), acceleration_mps2: Vector2::new(0.0, 0.0) };

    /// To a point at rest.
    pub(crate) fn to(ne_m: Vector2<f64>) -> Self {
        Self::Position { ne_m, velocity_mps: Vector2::zeros(), acceleration_mps2: Vector2::zeros() }
    }
}

/// Where to go vertically; down is positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Vertical {
    /// To a moving height.
    Position { down_m: f64, velocity_mps: f64 },
    /// At a rate; zero holds the height where it stops.
    Rate(f64),
    /// Thrust over weight.
    Thrust(f64),
}

/// Where to look.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Yaw {
    /// Leave it as it is.
    Hold,
    /// This heading, radians, turning at most so fast, radians per second.
    Fixed { heading_rad: f64, rate_radps: f64 },
    /// Turning at this rate, radians per second.
    Rate(f64),
    /// The way it flies.
    Travel,
}

/// Speed limits, metres and seconds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Limits {
    pub(crate) speed_mps: f64,
    pub(crate) up_mps: f64,
    pub(crate) down_mps: f64,
}

/// One setpoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Setpoint {
    pub(crate) horizontal: Horizontal,
    pub(crate) vertical: Vertical,
    pub(crate) yaw: Yaw,
    pub(crate) limits: Limits,
}

/// The control loops' state.
#[derive(Debug, Clone)]
pub(crate) struct Controller {
    position_m: Vector3<f64>,
    velocity_mps: Vector3<f64>,
    acceleration_mps2: Vector3<f64>,
    integral_mps2: Vector3<f64>,
    heading_rad: f64,
    thrust_ratio: f64,
}

impl Controller {
    pub(crate) fn new() -> Self {
        Self {
            position_m: Vector3::zeros(),
            velocity_mps: Vector3::zeros(),
            acceleration_mps2: Vector3::zeros(),
            integral_mps2: Vector3::zeros(),
            heading_rad: 0.0,
            thrust_ratio: 0.0,
        }
    }

    /// Forgets the desired motion: it starts from the believed one. What was learnt about wind is kept.
    pub(crate) fn start_from(&mut self, estimate: &Estimate) {
        self.position_m = estimate.position_ned_m;
        self.velocity_mps = estimate.velocity_ned_mps;
        self.acceleration_mps2 = Vector3::zeros();
        self.heading_rad = heading_rad(&estimate.ned_from_body);
    }

    /// The same on the ground, where nothing is learnt.
    pub(crate) fn idle(&mut self, estimate: &Estimate, airframe: &AirframeConfig) -> Actuation {
        self.start_from(estimate);
        self.velocity_mps = Vector3::zeros();
        self.integral_mps2 = Vector3::zeros();
        self.thrust_ratio = THRUST_IDLE;
        Actuation { motors: true, rate_body_radps: Vector3::zeros(), thrust_n: THRUST_IDLE * airframe.weight_n() }
    }

    /// Desired position, metres.
    pub(crate) fn desired_position_m(&self) -> Vector3<f64> {
        self.position_m
    }

    /// Commanded thrust over weight.
    pub(crate) fn thrust_ratio(&self) -> f64 {
        self.thrust_ratio
    }

    /// One step of `dt_s` towards `setpoint`.
    pub(crate) fn step(
        &mut self,
        dt_s: f64,
        setpoint: &Setpoint,
        estimate: &Estimate,
        params: &Params,
        airframe: &AirframeConfig,
    ) -> Actuation {
        let yaw_rate_radps = self.turn(dt_s, setpoint, params);
        let lean_max = params.hundredths(Param::AngleMax).to_radians().tan();
        let sideways_mps2 = match setpoint.horizontal {
            Horizontal::Lean { roll_rad, pitch_rad } => {
                self.follow_horizontally(estimate);
                let (sin, cos) = heading_rad(&estimate.ned_from_body).sin_cos();
                let (ahead, right) = (-pitch_rad.tan() * GRAVITY_MPS2, roll_rad.tan() * GRAVITY_MPS2);
                Vector2::new(ahead * cos - right * sin, ahead * sin + right * cos)
            }
            other => {
                self.shape_horizontally(dt_s, other, &setpoint.limits, params);
                self.track_horizontally(dt_s, estimate, params, lean_max * GRAVITY_MPS2)
            }
        };
        let sideways_mps2 = capped(sideways_mps2, lean_max * GRAVITY_MPS2);
        let down_mps2 = if let Vertical::Thrust(ratio) = setpoint.vertical {
            self.position_m.z = estimate.position_ned_m.z;
            self.velocity_mps.z = estimate.velocity_ned_mps.z;
            (1.0 - ratio) * GRAVITY_MPS2
        } else {
            self.shape_vertically(dt_s, setpoint, params);
            self.track_vertically(dt_s, estimate, params, airframe)
        };
        self.actuate(sideways_mps2, down_mps2, yaw_rate_radps, estimate, params, airframe)
    }

    fn turn(&mut self, dt_s: f64, setpoint: &Setpoint, params: &Params) -> f64 {
        let fastest_radps = params.hundredths(Param::YawSlew).to_radians();
        let (wanted_rad, rate_radps) = match setpoint.yaw {
            Yaw::Hold => return 0.0,
            Yaw::Rate(rate_radps) => {
                let rate_radps = rate_radps.clamp(-fastest_radps, fastest_radps);
                self.heading_rad = wrapped(self.heading_rad + rate_radps * dt_s);
                return rate_radps;
            }
            Yaw::Fixed { heading_rad, rate_radps } => (heading_rad, rate_radps.min(fastest_radps)),
            Yaw::Travel => {
                let over_ground_mps = self.velocity_mps.xy();
                if over_ground_mps.norm() < FACING_MPS {
                    return 0.0;
                }
                (over_ground_mps.y.atan2(over_ground_mps.x), fastest_radps)
            }
        };
        let left_rad = wrapped(wanted_rad - self.heading_rad);
        let rate_radps = (2.0 * left_rad).clamp(-rate_radps, rate_radps);
        self.heading_rad = wrapped(self.heading_rad + rate_radps * dt_s);
        rate_radps
    }

    fn follow_horizontally(&mut self, estimate: &Estimate) {
        for axis in 0..2 {
            self.position_m[axis] = estimate.position_ned_m[axis];
            self.velocity_mps[axis] = estimate.velocity_ned_mps[axis];
            self.acceleration_mps2[axis] = 0.0;
        }
    }

    fn shape_horizontally(&mut self, dt_s: f64, horizontal: Horizontal, limits: &Limits, params: &Params) {
        let accel_max_mps2 = params.hundredths(Param::Acceleration);
        let (position_m, velocity_mps) = (self.position_m.xy(), self.velocity_mps.xy());
        let (wanted_mps, feed_mps2) = match horizontal {
            Horizontal::Position { ne_m, velocity_mps, acceleration_mps2 } => {
                let to_go_m = ne_m - position_m;
                let distance_m = to_go_m.norm();
                let closing_mps = approach_mps(distance_m, params.get(Param::PositionGain), 0.7 * accel_max_mps2);
                let towards = if distance_m > 1e-6 { to_go_m / distance_m } else { Vector2::zeros() };
                (velocity_mps + towards * closing_mps, acceleration_mps2)
            }
            Horizontal::Velocity { velocity_mps, acceleration_mps2 } => (velocity_mps, acceleration_mps2),
            Horizontal::Lean { .. } => return,
        };
        let wanted_mps = capped(wanted_mps, limits.speed_mps);
        // As ArduCopter's shape_vel_accel_xy in GUIDED: the correction is limited, what is fed forward comes on top of it.
        let wanted_mps2 = capped((wanted_mps - velocity_mps) * SHAPE_PER_S, accel_max_mps2) + feed_mps2;
        let acceleration_mps2 = self.acceleration_mps2.xy();
        let acceleration_mps2 = acceleration_mps2 + capped(wanted_mps2 - acceleration_mps2, JERK_MPS3 * dt_s);
        let velocity_mps = velocity_mps + acceleration_mps2 * dt_s;
        let position_m = position_m + velocity_mps * dt_s;
        self.acceleration_mps2 = acceleration_mps2.push(self.acceleration_mps2.z);
        self.velocity_mps = velocity_mps.push(self.velocity_mps.z);
        self.position_m = position_m.push(self.position_m.z);
    }

    fn track_horizontally(&mut self, dt_s: f64, estimate: &Estimate, params: &Params, accel_max_mps2: f64) -> Vector2<f64> {
        let behind_m = capped(self.position_m.xy() - estimate.position_ned_m.xy(), LEASH_M);
        let desired_m = estimate.position_ned_m.xy() + behind_m;
        self.position_m = desired_m.push(self.position_m.z);
        let wanted_mps = self.velocity_mps.xy() + behind_m * params.get(Param::PositionGain);
        let error_mps = wanted_mps - estimate.velocity_ned_mps.xy();
        let demand_mps2 = self.acceleration_mps2.xy() + error_mps * params.get(Param::VelocityGain) + self.integral_mps2.xy();
        // No winding up against the lean limit.
        if demand_mps2.norm() < accel_max_mps2 || error_mps.dot(&self.integral_mps2.xy()) < 0.0 {
            let integral = self.integral_mps2.xy() + error_mps * (params.get(Param::VelocityIntegral) * dt_s);
            self.integral_mps2 = capped(integral, INTEGRAL_MAX_MPS2).push(self.integral_mps2.z);
        }
        demand_mps2
    }

    fn shape_vertically(&mut self, dt_s: f64, setpoint: &Setpoint, params: &Params) {
        let accel_max_mps2 = params.hundredths(Param::AccelerationZ);
        let wanted_mps = match setpoint.vertical {
            Vertical::Position { down_m, velocity_mps } => {
                let to_go_m = down_m - self.position_m.z;
                let closing_mps = approach_mps(to_go_m.abs(), params.get(Param::HeightGain), 0.7 * accel_max_mps2);
                velocity_mps + closing_mps.copysign(to_go_m)
            }
            Vertical::Rate(rate_mps) => rate_mps,
            Vertical::Thrust(_) => return,
        };
        let wanted_mps = wanted_mps.clamp(-setpoint.limits.up_mps, setpoint.limits.down_mps);
        let wanted_mps2 = ((wanted_mps - self.velocity_mps.z) * SHAPE_PER_S).clamp(-accel_max_mps2, accel_max_mps2);
        let change = (wanted_mps2 - self.acceleration_mps2.z).clamp(-JERK_MPS3 * dt_s, JERK_MPS3 * dt_s);
        self.acceleration_mps2.z += change;
        self.velocity_mps.z += self.acceleration_mps2.z * dt_s;
        self.position_m.z += self.velocity_mps.z * dt_s;
    }

    fn track_vertically(&mut self, dt_s: f64, estimate: &Estimate, params: &Params, airframe: &AirframeConfig) -> f64 {
        let behind_m = (self.position_m.z - estimate.position_ned_m.z).clamp(-LEASH_DOWN_M, LEASH_DOWN_M);
        self.position_m.z = estimate.position_ned_m.z + behind_m;
        let error_mps = self.velocity_mps.z + behind_m * params.get(Param::HeightGain) - estimate.velocity_ned_mps.z;
        let demand_mps2 = self.acceleration_mps2.z + error_mps * params.get(Param::ClimbGain) + self.integral_mps2.z;
        let least_mps2 = -GRAVITY_MPS2 * (airframe.thrust_to_weight - 1.0);
        let most_mps2 = GRAVITY_MPS2 * (1.0 - THRUST_IDLE);
        if (least_mps2..most_mps2).contains(&demand_mps2) || error_mps * self.integral_mps2.z < 0.0 {
            let (gain, bound) = DOWN_INTEGRAL;
            self.integral_mps2.z = (self.integral_mps2.z + error_mps * gain * dt_s).clamp(-bound, bound);
        }
        demand_mps2.clamp(least_mps2, most_mps2)
    }

    fn actuate(
        &mut self,
        sideways_mps2: Vector2<f64>,
        down_mps2: f64,
        yaw_rate_radps: f64,
        estimate: &Estimate,
        params: &Params,
        airframe: &AirframeConfig,
    ) -> Actuation {
        // The thrust must make up gravity and the demand; lean keeps within the limit even when it barely pulls.
        let lift_mps2 = (GRAVITY_MPS2 - down_mps2).max(GRAVITY_MPS2 * THRUST_IDLE);
        let lean_mps2 = lift_mps2.max(0.5 * GRAVITY_MPS2);
        let down_ned = Vector3::new(-sideways_mps2.x, -sideways_mps2.y, lean_mps2).normalize();
        let wanted = attitude(down_ned, self.heading_rad);
        let cos_tilt = (estimate.ned_from_body * Vector3::z()).z.max(0.5);
        self.thrust_ratio = (lift_mps2 / (GRAVITY_MPS2 * cos_tilt)).clamp(THRUST_IDLE, airframe.thrust_to_weight);
        let error_rad = (estimate.ned_from_body.inverse() * wanted).scaled_axis();
        let gain = Vector3::new(params.get(Param::RollGain), params.get(Param::PitchGain), params.get(Param::YawGain));
        // The lag of the rate loop allows somewhat more than the nominal gain on lean; feed the turn forward.
        let rate = error_rad.component_mul(&gain) + Vector3::new(0.0, 0.0, yaw_rate_radps);
        let limit = LEAN_RATE_MAX_RADPS;
        Actuation {
            motors: true,
            rate_body_radps: Vector3::new(rate.x.clamp(-limit, limit), rate.y.clamp(-limit, limit), rate.z.clamp(-2.0, 2.0)),
            thrust_n: self.thrust_ratio * airframe.weight_n(),
        }
    }
}

/// Heading of an attitude, radians.
pub(crate) fn heading_rad(ned_from_body: &UnitQuaternion<f64>) -> f64 {
    let forward = ned_from_body * Vector3::x();
    forward.y.atan2(forward.x)
}

/// To (−π, π].
pub(crate) fn wrapped(angle_rad: f64) -> f64 {
    let turn = std::f64::consts::TAU;
    let angle_rad = angle_rad.rem_euclid(turn);
    if angle_rad > std::f64::consts::PI { angle_rad - turn } else { angle_rad }
}

/// How fast to close a distance: proportional when near, at constant deceleration when far, smooth between.
fn approach_mps(distance_m: f64, gain_per_s: f64, deceleration_mps2: f64) -> f64 {
    let linear_m = deceleration_mps2 / (gain_per_s * gain_per_s);
    if distance_m > linear_m {
        (2.0 * deceleration_mps2 * (distance_m - 0.5 * linear_m)).sqrt()
    } else {
        distance_m * gain_per_s
    }
}

fn capped(vector: Vector2<f64>, most: f64) -> Vector2<f64> {
    let norm = vector.norm();
    if norm > most { vector * (most / norm) } else { vector }
}

/// The attitude with its down axis along `down_ned` and its nose towards `heading_rad`.
fn attitude(down_ned: Vector3<f64>, heading_rad: f64) -> UnitQuaternion<f64> {
    let nose = Vector3::new(heading_rad.cos(), heading_rad.sin(), 0.0);
    let right = down_ned.cross(&nose).normalize();
    let forward = right.cross(&down_ned);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[forward, right, down_ned])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attitude_has_the_down_axis_and_heading_asked_for() {
        let down = Vector3::new(0.2, -0.1, 0.9).normalize();
        let attitude = attitude(down, 2.0);
        assert!((attitude * Vector3::z() - down).norm() < 1e-12);
        let forward = attitude * Vector3::x();
        // The nose lies in the vertical plane of the heading.
        let nose = Vector3::new(2.0_f64.cos(), 2.0_f64.sin(), 0.0);
        assert!(forward.dot(&down.cross(&nose)).abs() < 1e-12 && forward.dot(&nose) > 0.9);
    }

    /// Braking from v over v²/2a: the speed allowed at a distance never needs more than the deceleration.
    #[test]
    fn the_approach_can_always_brake() {
        for distance_m in [0.1, 0.5, 2.0, 10.0, 100.0] {
            let speed = approach_mps(distance_m, 1.0, 1.75);
            let step_m = 1e-6;
            let slope = (speed - approach_mps(distance_m - step_m, 1.0, 1.75)) / step_m;
            assert!(speed * slope <= 1.75 + 1e-3, "{distance_m}: {}", speed * slope);
        }
    }
}
