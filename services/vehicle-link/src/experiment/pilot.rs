//! The leader's pilot: takes off, then flies by velocity and yaw rate, as sticks do.

use halcyon_model::{FlightMode, Intent, LandedState, Stamp};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::MavMessage;
use nalgebra::Vector3;

use super::flyer::Craft;
use super::scene::Flight;
use crate::core::commands::Command;

/// Height of the flight above home, metres.
const HEIGHT_M: f64 = 6.0;
/// A command is given again after this time, seconds.
const AGAIN_S: f64 = 2.0;
/// Velocity and yaw rate: position, acceleration and yaw are ignored.
const VELOCITY_AND_TURN: u16 = 0b0101_1100_0111;

pub(super) struct Pilot {
    flight: Flight,
    asked: Option<Stamp>,
    up: bool,
    intent: Option<Intent>,
}

impl Pilot {
    pub(super) fn new(flight: Flight) -> Self {
        Self { flight, asked: None, up: false, intent: None }
    }

    /// Whether the leader has taken off.
    pub(super) fn is_up(&self) -> bool {
        self.up
    }

    /// What was last asked for, as the leader's own vehicle-link would tell it: a velocity, from where the vehicle was.
    pub(super) fn intent(&self) -> Option<Intent> {
        self.intent
    }

    pub(super) fn step(&mut self, craft: &mut Craft, flown_s: f64, now: Stamp) {
        let Some((state, _)) = craft.link.state(now) else { return };
        if self.up {
            let (velocity_mps, yaw_rate_radps) = self.flight.wish(flown_s);
            self.intent = Some(Intent {
                stamp: now,
                position_ned_m: state.position_ned_m + state.velocity_ned_mps * now.seconds_since(state.stamp),
                velocity_ned_mps: velocity_mps,
                acceleration_ned_mps2: Vector3::zeros(),
            });
            craft.say(MavMessage::SET_POSITION_TARGET_LOCAL_NED(ardu::SET_POSITION_TARGET_LOCAL_NED_DATA {
                vx: velocity_mps.x as f32,
                vy: velocity_mps.y as f32,
                vz: velocity_mps.z as f32,
                yaw_rate: yaw_rate_radps as f32,
                type_mask: ardu::PositionTargetTypemask::from_bits_retain(VELOCITY_AND_TURN),
                target_system: craft.system_id(),
                target_component: 1,
                coordinate_frame: ardu::MavFrame::MAV_FRAME_LOCAL_NED,
                ..Default::default()
            }));
            return;
        }
        let in_air = state.armed && state.landed == LandedState::InAir;
        if in_air && -state.position_ned_m.z > HEIGHT_M - 0.3 && state.velocity_ned_mps.z.abs() < 0.2 {
            self.up = true;
            return;
        }
        if in_air || self.asked.is_some_and(|at| now.seconds_since(at) < AGAIN_S) || !state.estimator_ok || !state.ready_to_arm
        {
            return;
        }
        self.asked = Some(now);
        let command = match (state.mode, state.armed) {
            (FlightMode::Guided, false) => Command::Arm,
            (FlightMode::Guided, true) => Command::TakeOff { height_above_home_m: HEIGHT_M },
            _ => Command::SetMode(FlightMode::Guided),
        };
        // A full line is tried again.
        let _ = craft.link.submit(0, command);
    }
}
