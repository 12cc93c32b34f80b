//! Whatever comes over the link: no panic, no wrong command, and memory stays flat. Seeded, so that a failure comes again.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at its first surprise")]

mod noise;

use halcyon_model::{FleetOrigin, Geodetic, Stamp};
use halcyon_vehicle_link::Config;
use halcyon_vehicle_link::autopilot::Autopilot;
use halcyon_vehicle_link::core::commands::{Command, Effect};
use halcyon_vehicle_link::core::frame::{Frame, Framer};
use halcyon_vehicle_link::core::unlisted::Unlisted;
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};
use mavlink::{MavHeader, MavlinkVersion, Message as _};

use noise::{Noise, mutated, resident_bytes};

const BYTES: usize = 10_000_000;
const FRAMES: usize = 100_000;

struct Scene {
    autopilot: Autopilot,
    framer: Framer,
    now: Stamp,
    heard: usize,
    understood: usize,
}

impl Scene {
    fn new(wanted: u8) -> Self {
        let config = Config { system_id: wanted, ..Config::default() };
        let now = Stamp::from_secs_f64(1.7e9);
        let origin = FleetOrigin(Geodetic::from_deg(53.1, -2.9, 0.0));
        let autopilot = Autopilot::new(&config, origin, now).unwrap();
        Self { autopilot, framer: Framer::default(), now, heard: 0, understood: 0 }
    }

    /// As the actor does it: bytes in, and each 100 ms whatever is due.
    fn take(&mut self, bytes: &[u8]) {
        for frame in self.framer.stream(bytes) {
            self.heard += 1;
            match frame.message() {
                Some(message) => {
                    self.understood += 1;
                    let heard = self.autopilot.observe(frame.header(), &message, self.now);
                    heard.reply.iter().for_each(allowed);
                }
                None => {
                    let answer = Unlisted::of(&frame);
                    self.autopilot.observe_unread(frame.header(), answer.as_ref(), self.now);
                }
            }
        }
    }

    fn tick(&mut self) {
        self.now = self.now.plus_secs_f64(0.1);
        for effect in self.autopilot.poll(self.now) {
            match effect {
                Effect::Send(message) => allowed(&message),
                Effect::Done(_, command, _) => assert!(matches!(command, Command::SetInterval(_)), "{command:?}"),
                Effect::Transferred(_, ending) => panic!("nobody asked for a transfer: {ending:?}"),
            }
        }
        if let Some((state, _)) = self.autopilot.state(self.now) {
            assert!(state.position.is_valid() && state.position_ned_m.iter().all(|x| x.is_finite()), "{state:?}");
            assert!(state.heading_rad.is_finite() && state.velocity_ned_mps.iter().all(|x| x.is_finite()), "{state:?}");
            assert!(state.battery_fraction.is_none_or(|fraction| (0.0..=1.0).contains(&fraction)), "{state:?}");
            let behind_s = self.now.seconds_since(state.stamp);
            assert!(behind_s >= 0.0, "{state:?} is from the future");
        }
    }
}

/// What may leave when nobody has asked for anything: questions, never to everybody.
#[track_caller]
fn allowed(message: &MavMessage) {
    assert!(message.target_system_id().is_some_and(|target| target != 0), "{message:?}");
    let harmless = match message {
        MavMessage::TIMESYNC(_) => true,
        MavMessage::COMMAND_LONG(data) => {
            matches!(data.command, MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL | MavCmd::MAV_CMD_REQUEST_MESSAGE)
        }
        MavMessage::COMMAND_INT(data) => {
            matches!(data.command, MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL | MavCmd::MAV_CMD_REQUEST_MESSAGE)
        }
        _ => false,
    };
    assert!(harmless, "{message:?}");
}

/// One frame of every message that the dialect has.
fn messages() -> Vec<MavMessage> {
    (0..20_000).filter_map(MavMessage::default_message_from_id).collect()
}

#[test]
fn ten_million_bytes_of_noise() {
    let (mut noise, mut scene) = (Noise(1), Scene::new(0));
    let (mut left, mut buffer) = (BYTES, vec![0; 700]);
    while left > 0 {
        let length = (1 + noise.below(buffer.len())).min(left);
        noise.fill(&mut buffer[..length]);
        // Starts of frames more often than chance has them.
        for _ in 0..4 {
            buffer[noise.below(length)] = if noise.below(2) == 0 { 0xFD } else { 0xFE };
        }
        scene.take(&buffer[..length]);
        scene.tick();
        left -= length;
    }
    assert!(scene.heard < 50, "{} frames in noise", scene.heard);
}

#[test]
fn a_hundred_thousand_mutated_frames() {
    let (mut noise, mut scene) = (Noise(2), Scene::new(7));
    let messages = messages();
    assert!(messages.len() > 200, "{}", messages.len());
    let heartbeat = ardu::HEARTBEAT_DATA {
        autopilot: ardu::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
        mavtype: ardu::MavType::MAV_TYPE_QUADROTOR,
        ..Default::default()
    };
    let header = MavHeader { system_id: 7, component_id: 1, sequence: 0 };
    let heartbeat = Frame::encode(MavlinkVersion::V2, header, &MavMessage::HEARTBEAT(heartbeat)).unwrap();
    scene.take(heartbeat.bytes());
    assert!(scene.autopilot.found());
    let mut resident = 0;
    for index in 0..FRAMES {
        // What the service listens to, more often than what it ignores.
        let id = [0, 1, 24, 30, 31, 32, 33, 77, 111, 147, 148, 193, 230, 242, 245, 253];
        let message = match noise.below(2) {
            0 => MavMessage::default_message_from_id(id[noise.below(id.len())]).unwrap(),
            _ => messages[noise.below(messages.len())].clone(),
        };
        scene.take(&mutated(&mut noise, &message));
        if index % 8 == 0 {
            scene.tick();
        }
        if index == FRAMES / 2 {
            resident = resident_bytes();
        }
    }
    let grown_bytes = resident_bytes().saturating_sub(resident);
    assert!(grown_bytes < 2_000_000, "{grown_bytes} bytes more after the second half");
    // Most are whole, and of those many are understood: else this tests the sum only.
    assert!(scene.heard > FRAMES / 2 && scene.understood > FRAMES / 4, "{} {}", scene.heard, scene.understood);
}
