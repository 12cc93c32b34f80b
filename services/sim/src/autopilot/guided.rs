//! GUIDED: targets over MAVLink.

use halcyon_model::{Geodetic, Stamp};
use mavlink::dialects::ardupilotmega as mav;
use nalgebra::{Rotation2, Vector3};

use super::control::{Horizontal, Setpoint, Vertical, Yaw, heading_rad};
use super::{Autopilot, Mode, Param};

/// What GUIDED is doing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Guided {
    /// Stop and stay.
    Hold,
    /// Up to this height.
    TakeOff { down_m: f64 },
    /// To a point.
    Position { ned_m: Vector3<f64> },
    /// At a velocity, until it lapses.
    Velocity { velocity_mps: Vector3<f64>, acceleration_mps2: Vector3<f64>, at: Stamp },
    /// To a moving point, until its motion lapses.
    Moving { ned_m: Vector3<f64>, velocity_mps: Vector3<f64>, acceleration_mps2: Vector3<f64>, at: Stamp },
}

/// A target's parts, after frames are taken care of; `None` is ignored.
struct Parts {
    ned_m: Option<Vector3<f64>>,
    velocity_mps: Option<Vector3<f64>>,
    acceleration_mps2: Option<Vector3<f64>>,
    yaw_rad: Option<f64>,
    yaw_rate_radps: Option<f64>,
}

impl Autopilot {
    /// The setpoint of GUIDED.
    pub(super) fn guided_setpoint(&mut self, dt_s: f64) -> Setpoint {
        let lapsed = |at: Stamp| self.now.seconds_since(at) > self.params.get(Param::GuidedTimeout);
        let (horizontal, vertical) = match &mut self.guided {
            Guided::Hold => (Horizontal::HOLD, Vertical::Rate(0.0)),
            Guided::TakeOff { down_m } => (Horizontal::HOLD, Vertical::Position { down_m: *down_m, velocity_mps: 0.0 }),
            Guided::Position { ned_m } => {
                (Horizontal::to(ned_m.xy()), Vertical::Position { down_m: ned_m.z, velocity_mps: 0.0 })
            }
            Guided::Velocity { velocity_mps, acceleration_mps2, at } => {
                if lapsed(*at) {
                    self.guided = Guided::Hold;
                    self.flight.stop_turning();
                    (Horizontal::HOLD, Vertical::Rate(0.0))
                } else {
                    let horizontal =
                        Horizontal::Velocity { velocity_mps: velocity_mps.xy(), acceleration_mps2: acceleration_mps2.xy() };
                    (horizontal, Vertical::Rate(velocity_mps.z))
                }
            }
            Guided::Moving { ned_m, velocity_mps, acceleration_mps2, at } => {
                if lapsed(*at) {
                    let ned_m = *ned_m;
                    self.guided = Guided::Position { ned_m };
                    self.flight.stop_turning();
                    (Horizontal::to(ned_m.xy()), Vertical::Position { down_m: ned_m.z, velocity_mps: 0.0 })
                } else {
                    *velocity_mps += *acceleration_mps2 * dt_s;
                    *ned_m += *velocity_mps * dt_s;
                    let horizontal = Horizontal::Position {
                        ne_m: ned_m.xy(),
                        velocity_mps: velocity_mps.xy(),
                        acceleration_mps2: acceleration_mps2.xy(),
                    };
                    (horizontal, Vertical::Position { down_m: ned_m.z, velocity_mps: velocity_mps.z })
                }
            }
        };
        let limits = self.limits();
        Setpoint { horizontal, vertical, yaw: self.flight.yaw, limits }
    }

    /// Ends a take-off that has arrived.
    pub(super) fn finish_take_off(&mut self) {
        if let Guided::TakeOff { down_m } = self.guided {
            let position_m = self.sensed.estimate.position_ned_m;
            if (position_m.z - down_m).abs() < 0.2 && self.sensed.estimate.velocity_ned_mps.z.abs() < 0.4 {
                let here_m = self.controller.desired_position_m();
                self.guided = Guided::Position { ned_m: Vector3::new(here_m.x, here_m.y, down_m) };
            }
        }
    }

    /// SET_POSITION_TARGET_LOCAL_NED.
    pub(super) fn local_target(&mut self, data: &mav::SET_POSITION_TARGET_LOCAL_NED_DATA) {
        use mav::MavFrame as Frame;
        let Some(origin_m) = self.guided_origin() else { return };
        let body = matches!(data.coordinate_frame, Frame::MAV_FRAME_BODY_NED | Frame::MAV_FRAME_BODY_OFFSET_NED);
        let offset = body || data.coordinate_frame == Frame::MAV_FRAME_LOCAL_OFFSET_NED;
        if !offset && data.coordinate_frame != Frame::MAV_FRAME_LOCAL_NED {
            self.stop_guided();
            return;
        }
        let heading = Rotation2::new(heading_rad(&self.sensed.estimate.ned_from_body));
        let turned = |x: f32, y: f32, z: f32| {
            let vector = Vector3::new(f64::from(x), f64::from(y), f64::from(z));
            if body { (heading * vector.xy()).push(vector.z) } else { vector }
        };
        let base_m = if offset { self.sensed.estimate.position_ned_m } else { origin_m };
        let [position, velocity, acceleration] = used(data.type_mask);
        let mut parts = Parts {
            ned_m: position.then(|| base_m + turned(data.x, data.y, data.z)),
            velocity_mps: velocity.then(|| turned(data.vx, data.vy, data.vz)),
            acceleration_mps2: acceleration.then(|| turned(data.afx, data.afy, data.afz)),
            ..yaw_parts(data.type_mask, data.yaw, data.yaw_rate)
        };
        if body {
            let here_rad = heading_rad(&self.sensed.estimate.ned_from_body);
            parts.yaw_rad = parts.yaw_rad.map(|yaw_rad| here_rad + yaw_rad);
        }
        self.take_target(data.type_mask, &parts);
    }

    /// SET_POSITION_TARGET_GLOBAL_INT.
    pub(super) fn global_target(&mut self, data: &mav::SET_POSITION_TARGET_GLOBAL_INT_DATA) {
        if self.guided_origin().is_none() {
            return;
        }
        let [position, velocity, acceleration] = used(data.type_mask);
        let place = self.place(data.coordinate_frame, data.lat_int, data.lon_int, f64::from(data.alt));
        if position && place.is_none() {
            self.stop_guided();
            return;
        }
        let vector = |x: f32, y: f32, z: f32| Vector3::new(f64::from(x), f64::from(y), f64::from(z));
        let parts = Parts {
            ned_m: place.filter(|_| position),
            velocity_mps: velocity.then(|| vector(data.vx, data.vy, data.vz)),
            // As on ArduCopter: with a position, acceleration is dropped here.
            acceleration_mps2: (acceleration && !position).then(|| vector(data.afx, data.afy, data.afz)),
            ..yaw_parts(data.type_mask, data.yaw, data.yaw_rate)
        };
        self.take_target(data.type_mask, &parts);
    }

    /// A global place in the fleet's local frame; `None` for a frame that is not global or numbers that are no place.
    pub(super) fn place(&self, frame: mav::MavFrame, lat: i32, lon: i32, altitude_m: f64) -> Option<Vector3<f64>> {
        use mav::MavFrame as Frame;
        let place = Geodetic::from_deg(f64::from(lat) * 1e-7, f64::from(lon) * 1e-7, self.frame.origin().altitude_m);
        if !place.is_valid() || !altitude_m.is_finite() {
            return None;
        }
        let flat_m = self.frame.ned_from_geodetic(place);
        let down_m = match frame {
            Frame::MAV_FRAME_GLOBAL | Frame::MAV_FRAME_GLOBAL_INT => self.frame.origin().altitude_m - altitude_m,
            Frame::MAV_FRAME_GLOBAL_RELATIVE_ALT | Frame::MAV_FRAME_GLOBAL_RELATIVE_ALT_INT => self.home_ned_m?.z - altitude_m,
            _ => return None,
        };
        Some(Vector3::new(flat_m.x, flat_m.y, down_m))
    }

    /// The local frame's origin, while targets are taken at all.
    fn guided_origin(&self) -> Option<Vector3<f64>> {
        self.origin_ned_m.filter(|_| self.mode == Mode::Guided)
    }

    fn stop_guided(&mut self) {
        self.guided = Guided::Hold;
    }

    fn take_target(&mut self, mask: mav::PositionTargetTypemask, parts: &Parts) {
        let finite = |vector: &Option<Vector3<f64>>| vector.is_none_or(|vector| vector.iter().all(|x| x.is_finite()));
        let all_finite = finite(&parts.ned_m) && finite(&parts.velocity_mps) && finite(&parts.acceleration_mps2);
        let yaw_finite = parts.yaw_rad.is_none_or(f64::is_finite) && parts.yaw_rate_radps.is_none_or(f64::is_finite);
        if !all_finite || !yaw_finite {
            return;
        }
        if mask.contains(mav::PositionTargetTypemask::POSITION_TARGET_TYPEMASK_FORCE_SET) {
            self.stop_guided();
            return;
        }
        // As on ArduCopter, any target ends a take-off. Before it has lifted off that leaves the vehicle where it stands: on the
        // ground only a take-off leaves it.
        if self.landed {
            return self.stop_guided();
        }
        // A place outside the fence is not gone to; what was under way goes on.
        if parts.ned_m.is_some_and(|ned_m| !self.fence_allows(ned_m)) {
            return;
        }
        let none = Vector3::zeros();
        self.guided = match (parts.ned_m, parts.velocity_mps, parts.acceleration_mps2) {
            (Some(ned_m), Some(velocity_mps), acceleration) => {
                Guided::Moving { ned_m, velocity_mps, acceleration_mps2: acceleration.unwrap_or(none), at: self.now }
            }
            (None, Some(velocity_mps), acceleration) => {
                Guided::Velocity { velocity_mps, acceleration_mps2: acceleration.unwrap_or(none), at: self.now }
            }
            (Some(ned_m), None, None) => Guided::Position { ned_m },
            _ => Guided::Hold,
        };
        match (parts.yaw_rad, parts.yaw_rate_radps) {
            (Some(heading_rad), rate) => {
                let rate_radps = rate.map_or(f64::INFINITY, f64::abs);
                self.flight.yaw = Yaw::Fixed { heading_rad, rate_radps };
            }
            (None, Some(rate_radps)) => self.flight.yaw = Yaw::Rate(rate_radps),
            (None, None) => {}
        }
    }
}

/// Which of position, velocity and acceleration a mask uses: as on ArduCopter, one ignored component ignores all three.
fn used(mask: mav::PositionTargetTypemask) -> [bool; 3] {
    let bits = mask.bits();
    [bits & 0o7 == 0, bits & 0o70 == 0, bits & 0o700 == 0]
}

fn yaw_parts(mask: mav::PositionTargetTypemask, yaw: f32, yaw_rate: f32) -> Parts {
    use mav::PositionTargetTypemask as Mask;
    Parts {
        ned_m: None,
        velocity_mps: None,
        acceleration_mps2: None,
        yaw_rad: (!mask.contains(Mask::POSITION_TARGET_TYPEMASK_YAW_IGNORE)).then(|| f64::from(yaw)),
        yaw_rate_radps: (!mask.contains(Mask::POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE)).then(|| f64::from(yaw_rate)),
    }
}
