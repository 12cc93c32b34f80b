//! The executor and all that it decides by, under anything: odd numbers, mutated frames, clocks that step, plans and commands of all
//! kinds, neighbours by the hundred. Whatever comes: no panic, one addressee, setpoints within the limits, the pilot left alone, and
//! memory flat. Seeded, so that a failure comes again.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at its first surprise")]

mod copter;
#[path = "../noise/mod.rs"]
mod noise;
#[path = "../onboard/mod.rs"]
mod onboard;

use std::collections::VecDeque;

use halcyon_model::{
    Activity, Assignment, CalmWindow, Clearance, DispatchPlan, FleetOrigin, FlightMode, Geodetic, ItemKind, LandedState,
    LocalPoint, ParameterName, Slot, Stamp, Task, VehicleAction, VehicleId, VehicleState, VerdictState,
};
use halcyon_vehicle_link::Config;
use halcyon_vehicle_link::core::commands::Command;
use halcyon_vehicle_link::core::frame::Framer;
use halcyon_vehicle_link::core::mode::Family;
use halcyon_vehicle_link::core::payload::{Payload, PayloadKind};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};
use mavlink::{MavHeader, Message as _};
use nalgebra::Vector3;

use copter::{Copter, PILOTS};
use noise::{Noise, mutated, resident_bytes};
use onboard::{Onboard, Reply};

const SYSTEM: u8 = 7;
const STEPS: usize = 300_000;
const SEEDS: u64 = 12;
/// OFFBOARD that a person asked for is prepared for 8 s from the next step, seconds, whatever becomes of it; and steps are held up.
const OFFBOARD_S: f64 = 16.0;
/// More than any acceleration that is fed forward, metres per second squared.
const ACCELERATION_MPS2: f64 = 5.0;
/// A setpoint is at most so much further out than the fence or the vehicle itself, metres: the leash, and a leap taken out of its place.
const BEYOND_M: f64 = 25.0;

/// What was seen, so that the test shows that it tests something.
#[derive(Debug, Default)]
struct Seen {
    setpoints: usize,
    followed: usize,
    flown_s: f64,
    take_offs: usize,
    landings: usize,
    pilots: usize,
    fail_safes: usize,
    refusals: usize,
    accepted: usize,
}

struct Scene {
    noise: Noise,
    now: Stamp,
    copter: Copter,
    onboard: Onboard,
    config: Config,
    framer: Framer,
    generation: u64,
    /// When people last asked for what flies the vehicle, by command.
    asked: VecDeque<(Stamp, Command)>,
    /// What the plans assign now.
    tasks: Vec<Assignment>,
    /// As it was heard last.
    mode: Option<FlightMode>,
    was_up: bool,
    seen: Seen,
}

impl Scene {
    fn new(seed: u64, family: Family) -> Self {
        let now = Stamp::from_secs_f64(1.7e9);
        let origin = FleetOrigin(Geodetic::from_deg(53.1, -2.9, 0.0));
        let payload = Payload { kind: PayloadKind::Servo, release_on_touchdown: true, ..Payload::default() };
        let config = Config { vehicle: "v".into(), role: "follower".into(), system_id: SYSTEM, payload, ..Config::default() };
        Self {
            noise: Noise(seed),
            now,
            copter: Copter::new(family, origin),
            onboard: Onboard::new(&config, origin, now),
            config,
            framer: Framer::default(),
            generation: 0,
            asked: VecDeque::new(),
            tasks: Vec::new(),
            mode: None,
            was_up: false,
            seen: Seen::default(),
        }
    }

    fn step(&mut self) {
        match self.noise.below(1000) {
            0..620 => {
                let message = self.copter.say(&mut self.noise);
                self.hear(&message);
            }
            620..650 => self.hear_mutated(),
            650..850 => self.tick(),
            850..950 => self.neighbour(),
            950..982 => self.plan(),
            982..992 => self.command(),
            992 if self.noise.chance(0.3) => self.copter.meddle(&mut self.noise),
            993 if self.noise.chance(0.05) => {
                let text = self.noise.of(&["EKF Failsafe: changed to LAND Mode", "PreArm: no", "Radio Failsafe Cleared"]);
                let text = ardu::STATUSTEXT_DATA { text: text.into(), ..Default::default() };
                self.hear(&MavMessage::STATUSTEXT(text));
            }
            994 if self.noise.chance(0.1) => self.onboard.executor.observe_station("told it to go"),
            995 if self.noise.chance(0.3) => self.clock(),
            996 if self.noise.chance(0.1) => {
                let sent = self.onboard.link_down(self.now);
                self.check(&sent);
            }
            _ => {
                let beat = self.copter.heartbeat();
                self.hear(&beat);
            }
        }
    }

    /// A clock is set, by a little or a lot, either way.
    fn clock(&mut self) {
        let scale_s = self.noise.of(&[0.5, 2.0, 20.0, 400.0, 1e6]);
        let by_s = self.noise.between(-scale_s, scale_s);
        self.now = self.now.plus_secs_f64(by_s);
        self.asked.iter_mut().for_each(|(at, _)| *at = at.plus_secs_f64(by_s));
    }

    fn header(&mut self) -> MavHeader {
        MavHeader { system_id: SYSTEM.into(), component_id: 1, sequence: self.noise.next() as u8 }
    }

    fn hear(&mut self, message: &MavMessage) {
        let header = self.header();
        self.take(header, message);
    }

    fn take(&mut self, header: MavHeader, message: &MavMessage) {
        let sent = self.onboard.hear(header, message, self.now);
        let mode = self.onboard.autopilot.state(self.now).map(|(state, _)| state.mode);
        if mode.is_some() && mode != self.mode {
            // What was asked for before the pilot chose is overtaken.
            self.asked.retain(|(_, command)| matches!(command, Command::Disarm { .. }));
            self.mode = mode;
        }
        self.deliver(&sent);
    }

    fn hear_mutated(&mut self) {
        let id =
            self.noise.of(&[0, 1, 22, 24, 30, 31, 32, 33, 44, 47, 51, 73, 77, 111, 132, 147, 148, 193, 230, 242, 245, 253]);
        let Some(message) = MavMessage::default_message_from_id(id) else { return };
        // Who it is must come from the copter: else half the flights are another firmware's.
        if id == 0 && self.noise.chance(0.9) {
            return;
        }
        let bytes = mutated(&mut self.noise, &message);
        for frame in self.framer.stream(&bytes) {
            if let Some(message) = frame.message() {
                self.take(frame.header(), &message);
            }
        }
    }

    fn deliver(&mut self, sent: &[MavMessage]) {
        self.check(sent);
        for message in sent {
            if let Some(answer) = self.copter.take(message, &mut self.noise) {
                let header = self.header();
                self.take(header, &answer);
            }
        }
    }

    fn tick(&mut self) {
        let dt_s = if self.noise.chance(0.002) { self.noise.between(0.0, 7.0) } else { self.noise.between(0.05, 0.15) };
        self.now = self.now.plus_secs_f64(dt_s);
        self.copter.step(dt_s.min(0.2));
        let sent = self.onboard.tick(self.now);
        self.check_setpoints();
        self.deliver(&sent);
        let now = self.now;
        self.asked.retain(|(at, _)| (0.0..OFFBOARD_S).contains(&now.seconds_since(*at)));
        self.onboard.outcomes.clear();
        let up = self.copter.flies();
        self.seen.take_offs += usize::from(up && !self.was_up);
        self.seen.landings += usize::from(!up && self.was_up);
        self.was_up = up;
        if up {
            self.seen.flown_s += dt_s;
        }
        match self.onboard.executor.activity() {
            Activity::Following { .. } => self.seen.followed += 1,
            Activity::PilotControl => self.seen.pilots += 1,
            // The autopilot's words about a mode that isn't ours.
            Activity::FailSafe { reason } if reason.starts_with("autopilot:") => self.seen.pilots += 1,
            Activity::FailSafe { .. } => self.seen.fail_safes += 1,
            _ => {}
        }
        assert!(self.onboard.notes.len() < 20, "{:?}", self.onboard.notes);
        assert!(self.onboard.open.len() <= 17, "{:?}", self.onboard.open);
    }

    /// Finite, and within the limits.
    fn check_setpoints(&mut self) {
        let limits = &self.config.limits;
        let own = self.onboard.own.as_ref().map(|state| (state.position_ned_m, state.velocity_ned_mps));
        let (own, own_mps) = own.unwrap_or_default();
        // It is predicted by up to half a second.
        let beyond_m = BEYOND_M + 0.5 * own_mps.norm();
        for setpoint in &self.onboard.setpoints {
            self.seen.setpoints += 1;
            let (place, velocity) = (setpoint.position_ned_m, setpoint.velocity_ned_mps);
            let acceleration = setpoint.acceleration_ned_mps2.unwrap_or_default();
            let finite = |vector: &Vector3<f64>| vector.iter().all(|number| number.is_finite());
            assert!(finite(&place) && finite(&velocity) && finite(&acceleration), "{setpoint:?}");
            assert!(setpoint.heading_rad.is_none_or(f64::is_finite), "{setpoint:?}");
            assert!(velocity.xy().norm() <= limits.speed_mps_max + 1e-6, "{setpoint:?}");
            assert!((-limits.climb_mps - 1e-6..=limits.descent_mps + 1e-6).contains(&velocity.z), "{setpoint:?}");
            assert!(acceleration.norm() <= ACCELERATION_MPS2 + 1e-6, "{setpoint:?}");
            let out_m = self.config.fail_safe.fence_radius_m.max(own.xy().norm()) + beyond_m;
            assert!(place.xy().norm() <= out_m, "{setpoint:?} at {own}");
            let top_m = self.config.fail_safe.fence_height_m.max(-own.z) + beyond_m;
            assert!((-top_m..=0.0).contains(&place.z), "{setpoint:?} at {own}");
        }
    }

    /// Every frame that leaves: to the one vehicle, with finite numbers, and none against its pilot.
    #[track_caller]
    fn check(&mut self, sent: &[MavMessage]) {
        let state = self.onboard.autopilot.state(self.now).map(|(state, _)| state);
        // In whatever mode, once it was taken.
        let is_taken = *self.onboard.executor.activity() == Activity::PilotControl;
        let pilots = is_taken || state.as_ref().is_some_and(|state| state.armed && PILOTS.contains(&state.mode));
        let asked = |wanted: &dyn Fn(&Command) -> bool| self.asked.iter().any(|(_, command)| wanted(command));
        for message in sent {
            assert_eq!(message.target_system_id(), Some(SYSTEM), "{message:?}");
            let numbers: &[f32] = match message {
                MavMessage::SET_POSITION_TARGET_LOCAL_NED(s) => &[s.x, s.y, s.z, s.vx, s.vy, s.vz, s.afx, s.afy, s.afz, s.yaw],
                MavMessage::SET_POSITION_TARGET_GLOBAL_INT(s) => &[s.alt, s.vx, s.vy, s.vz, s.yaw],
                _ => &[],
            };
            assert!(numbers.iter().all(|number| number.is_finite()), "{message:?}");
            let permitted = match message {
                MavMessage::SET_POSITION_TARGET_LOCAL_NED(_) | MavMessage::SET_POSITION_TARGET_GLOBAL_INT(_) => {
                    let is_px4 = self.copter.family == Family::Px4;
                    is_px4 && asked(&|command| *command == Command::SetMode(FlightMode::Guided))
                }
                MavMessage::COMMAND_LONG(data) => match data.command {
                    MavCmd::MAV_CMD_DO_SET_MODE => asked(&|command| matches!(command, Command::SetMode(_))),
                    MavCmd::MAV_CMD_NAV_TAKEOFF => false,
                    MavCmd::MAV_CMD_COMPONENT_ARM_DISARM if data.param1 == 1.0 => asked(&|command| *command == Command::Arm),
                    MavCmd::MAV_CMD_COMPONENT_ARM_DISARM => asked(&|command| matches!(command, Command::Disarm { .. })),
                    _ => true,
                },
                _ => true,
            };
            assert!(!pilots || permitted, "{message:?} in {:?}, {:?}", state.map(|state| state.mode), self.asked);
        }
    }

    fn vehicle(&mut self) -> VehicleId {
        let name = match self.noise.below(40) {
            0 => "v".to_owned(),
            1..6 => format!("n{}", self.noise.below(200)),
            _ => format!("n{}", self.noise.below(3)),
        };
        VehicleId::new(name).unwrap()
    }

    fn point(&mut self) -> LocalPoint {
        let scale_m = self.noise.of(&[5.0, 30.0, 30.0, 600.0]);
        LocalPoint::new(self.noise.number(-scale_m, scale_m), self.noise.number(-scale_m, scale_m))
    }

    fn vector(&mut self, scale: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.noise.number(-scale, scale))
    }

    fn slot(&mut self) -> Slot {
        Slot {
            forward_m: self.noise.number(-9.0, 9.0),
            right_m: self.noise.number(-12.0, 12.0),
            up_m: self.noise.number(-2.0, 4.0),
        }
    }

    fn neighbour(&mut self) {
        let Some((like, _)) = self.onboard.autopilot.state(self.now) else { return };
        let vehicle = self.vehicle();
        // The first few fly a course; the rest are anywhere.
        let course = if vehicle.as_str().len() == 2 && !self.noise.chance(0.03) {
            let (t, index) =
                (self.now.seconds_since(Stamp::from_secs_f64(1.7e9)), f64::from(vehicle.as_str().as_bytes()[1] - b'0'));
            let angle = 0.1 * (t % 1e4) + 2.0 * index;
            let (sin, cos) = angle.sin_cos();
            let place = Vector3::new(20.0 * cos, 20.0 * sin, -6.0 - index);
            (place, Vector3::new(-2.0 * sin, 2.0 * cos, 0.0), angle)
        } else {
            (self.vector(60.0), self.vector(6.0), self.noise.number(-7.0, 7.0))
        };
        let late_s = if self.noise.chance(0.02) { self.noise.number(-30.0, 30.0) } else { self.noise.between(0.0, 0.2) };
        let late_s = if late_s.is_finite() { late_s } else { 1e9 };
        let modes = [FlightMode::Guided, FlightMode::Guided, FlightMode::Loiter, FlightMode::Land];
        let states = [LandedState::InAir, LandedState::InAir, LandedState::InAir, LandedState::OnGround, LandedState::Unknown];
        let state = VehicleState {
            stamp: self.now.plus_secs_f64(-late_s),
            vehicle,
            position_ned_m: course.0,
            velocity_ned_mps: course.1,
            heading_rad: course.2,
            mode: if self.noise.chance(0.9) { FlightMode::Guided } else { self.noise.of(&modes) },
            armed: self.noise.chance(0.95),
            landed: if self.noise.chance(0.9) { LandedState::InAir } else { self.noise.of(&states) },
            acceleration_ned_mps2: self.noise.chance(0.5).then(|| self.vector(3.0)),
            boot_s: self.noise.number(0.0, 1e4),
            ..like
        };
        self.onboard.executor.observe_neighbour(state, self.now);
    }

    fn clearance(&mut self) -> Option<Clearance> {
        let stamp = |noise: &mut Noise, now: Stamp| now.plus_secs_f64(noise.between(-20.0, 90.0));
        let window = |scene: &mut Self| {
            let from = stamp(&mut scene.noise, scene.now);
            CalmWindow { from, to: from.plus_secs_f64(scene.noise.between(-1.0, 4.0)) }
        };
        let windows = (0..self.noise.below(4)).map(|_| window(self)).collect();
        let verdicts = [VerdictState::Safe, VerdictState::Safe, VerdictState::Unsafe, VerdictState::Inconclusive];
        self.noise.chance(0.8).then(|| Clearance {
            verdict: self.noise.of(&verdicts),
            sea_state_stamp: self.now,
            valid_until: stamp(&mut self.noise, self.now),
            windows,
        })
    }

    fn task(&mut self) -> Task {
        let height_m = self.noise.number(3.0, 12.0);
        // On the ground mostly to fly, or it would stand there all day.
        match if !self.copter.flies() && self.noise.chance(0.7) { 1 + self.noise.below(4) } else { self.noise.below(8) } {
            0 => Task::Hold,
            1 | 2 => {
                let heading_rad = self.noise.chance(0.5).then(|| self.noise.number(-7.0, 7.0));
                Task::Survey { point: self.point(), height_m, heading_rad }
            }
            3 | 4 => Task::Follow { leader: self.vehicle(), slot: self.slot() },
            5 | 6 => Task::Land { point: self.point(), approach_height_m: height_m, clearance: self.clearance() },
            _ => Task::Return,
        }
    }

    /// Mostly the last task again, under a new number.
    fn plan(&mut self) {
        let changes = self.noise.chance(0.05);
        let generation = match self.noise.below(20) {
            0 => self.noise.next() >> 32,
            1 => self.generation,
            _ => self.generation + 1,
        };
        // A number far ahead would end all plans of this run.
        let generation = if generation > self.generation + 1000 { self.generation / 2 } else { generation };
        self.generation = self.generation.max(generation);
        let own = if self.noise.chance(0.9) { self.onboard.vehicle.clone() } else { self.vehicle() };
        if changes || self.tasks.is_empty() {
            let (task, other) = (self.task(), self.vehicle());
            let theirs = Task::Follow { leader: self.vehicle(), slot: self.slot() };
            self.tasks = vec![Assignment { vehicle: own, task }, Assignment { vehicle: other, task: theirs }];
        }
        let stamp = self.now.plus_secs_f64(self.noise.between(-2.0, 1.0));
        let valid_s = if self.noise.chance(0.02) { self.noise.between(-5.0, 1e7) } else { 5.0 };
        let plan = DispatchPlan {
            stamp,
            generation,
            mission: None,
            valid_until: stamp.plus_secs_f64(valid_s),
            assignments: self.tasks.clone(),
        };
        let seen = self.onboard.executor.plan_generation();
        self.onboard.executor.observe_plan(&plan, self.now);
        assert!(self.onboard.executor.plan_generation() >= seen, "the number went back");
    }

    fn command(&mut self) {
        let name = ParameterName::new("WPNAV_SPEED").unwrap();
        let kind = self.noise.of(&[ItemKind::Mission, ItemKind::Fence, ItemKind::Rally]);
        // Mostly it is given back.
        let modes = [FlightMode::Loiter, FlightMode::Land, FlightMode::Rtl];
        let mode = if self.noise.chance(0.9) { FlightMode::Guided } else { self.noise.of(&modes) };
        // Whoever took it gives it back sooner or later, and carries it home where it must, or nothing would fly.
        if self.noise.chance(0.3) && !self.copter.flies() && !self.copter.armed {
            self.copter.position = Vector3::zeros();
        }
        let is_taken = match self.onboard.executor.activity() {
            Activity::FailSafe { reason } => reason.starts_with("autopilot:"),
            activity => *activity == Activity::PilotControl,
        };
        let action = match if is_taken && self.noise.chance(0.6) { 24 } else { self.noise.below(40) } {
            0..4 => VehicleAction::Arm,
            4 => VehicleAction::Disarm,
            5..12 => VehicleAction::TakeOff { height_m: self.noise.number(1.0, 12.0) },
            12..16 => VehicleAction::GoTo { point: self.point(), height_m: self.noise.number(4.0, 12.0) },
            16..21 => VehicleAction::Follow { leader: self.vehicle(), slot: self.slot() },
            21 => VehicleAction::Hold,
            22 => VehicleAction::Land,
            23 => VehicleAction::Return,
            24..32 => VehicleAction::SetMode(mode),
            32 => VehicleAction::SetHeading { heading_rad: self.noise.number(-9.0, 9.0) },
            33 if self.noise.chance(0.2) => VehicleAction::Terminate,
            34 => VehicleAction::ReadParameters,
            35 => VehicleAction::SetParameter { name, value: self.noise.number(0.0, 9.0), even_in_flight: true },
            36 => VehicleAction::DownloadItems { kind },
            37 => VehicleAction::ClearItems { kind },
            38 => VehicleAction::CancelTransfer,
            _ if self.noise.chance(0.5) => VehicleAction::ReleasePayload,
            _ => VehicleAction::SecurePayload,
        };
        let (reply, sent) = self.onboard.command(action, self.now);
        match reply {
            Reply::Accepted => self.seen.accepted += 1,
            Reply::Refused(_) => self.seen.refusals += 1,
            Reply::Asked(_, command) => self.asked.push_back((self.now, command)),
        }
        self.deliver(&sent);
    }
}

fn fly(seed: u64, family: Family) -> Seen {
    let mut scene = Scene::new(seed, family);
    let mut resident = 0;
    for step in 0..STEPS {
        scene.step();
        if step == STEPS / 2 {
            resident = resident_bytes();
        }
    }
    let grown_bytes = resident_bytes().saturating_sub(resident);
    assert!(grown_bytes < 4_000_000, "{grown_bytes} bytes more after the second half");
    scene.seen
}

/// It did get around: else nothing was tested.
#[track_caller]
fn check(seen: &Seen) {
    assert!(seen.take_offs > 2 && seen.landings > 2 && seen.flown_s > 200.0, "{seen:?}");
    assert!(seen.setpoints > 1000 && seen.followed > 100 && seen.pilots > 1000 && seen.fail_safes > 100, "{seen:?}");
    assert!(seen.accepted > 100 && seen.refusals > 100, "{seen:?}");
}

// One test, so that nobody else's memory counts.
#[test]
fn millions_of_steps_of_anything() {
    let (mut take_offs, mut flown_s, mut setpoints) = (0, 0.0, 0);
    for seed in 1..=SEEDS {
        let seen = fly(seed, if seed % 2 == 1 { Family::ArduPilot } else { Family::Px4 });
        check(&seen);
        take_offs += seen.take_offs;
        flown_s += seen.flown_s;
        setpoints += seen.setpoints;
    }
    assert!(take_offs > 100 && flown_s > 10_000.0 && setpoints > 50_000, "{take_offs} {flown_s} {setpoints}");
}
