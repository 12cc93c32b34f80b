//! PX4, flown from the ground and back by Halcyon's commands alone; and its pilot, who wins.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test ends at its first surprise")]

#[path = "../onboard/mod.rs"]
mod onboard;
mod peer;

use halcyon_model::{
    Activity, FleetOrigin, FlightMode, Geodetic, LandedState, LocalPoint, Slot, Stamp, VehicleAction, VehicleId, VehicleState,
};
use halcyon_vehicle_link::Config;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};
use nalgebra::Vector3;

use onboard::{Onboard, Reply};
use peer::{LAND, LOITER, OFFBOARD, POSCTL, Px4, RTL, SYSTEM, TAKEOFF};

const DT_S: f64 = 0.02;
const STEPS_PER_TICK: usize = 5;

/// A leader that goes north at 1.5 m/s, 9 m west of home, 6 m up.
struct Leader {
    start: Stamp,
}

struct Field {
    now: Stamp,
    px4: Px4,
    onboard: Onboard,
    leader: Option<Leader>,
    count: usize,
    /// Of the last guidance step.
    sent: Vec<MavMessage>,
    /// The vehicle link lets nothing out.
    mute: bool,
}

impl Field {
    fn new() -> Self {
        let origin = FleetOrigin(Geodetic::from_deg(47.4, 8.5, 372.5));
        let now = Stamp::from_secs_f64(1.7e9);
        let config = Config { vehicle: "v".into(), role: "follower".into(), system_id: SYSTEM, ..Config::default() };
        let onboard = Onboard::new(&config, origin, now);
        let mut field = Self { now, px4: Px4::new(origin), onboard, leader: None, count: 0, sent: Vec::new(), mute: false };
        field.until(10.0, "a state", |field| field.state().is_some_and(|state| state.estimator_ok && state.home.is_some()));
        field
    }

    fn state(&self) -> Option<VehicleState> {
        self.onboard.autopilot.state(self.now).map(|(state, _)| state)
    }

    fn deliver(&mut self, sent: Vec<MavMessage>) {
        let header = self.onboard.autopilot.header();
        for message in sent.into_iter().filter(|_| !self.mute) {
            for answer in self.px4.take(header, &message) {
                let from = self.px4.header();
                let more = self.onboard.hear(from, &answer, self.now);
                assert!(more.is_empty(), "{more:?}");
            }
        }
    }

    fn step(&mut self) {
        self.now = self.now.plus_secs_f64(DT_S);
        self.px4.step(DT_S);
        for message in self.px4.say() {
            let from = self.px4.header();
            let replies = self.onboard.hear(from, &message, self.now);
            self.deliver(replies);
        }
        self.count += 1;
        if self.count.is_multiple_of(STEPS_PER_TICK) {
            if let Some(leader) = &self.leader {
                let state = leader.state(self.now, &self.state().unwrap());
                self.onboard.executor.observe_neighbour(state, self.now);
            }
            self.sent = self.onboard.tick(self.now);
            self.deliver(self.sent.clone());
        }
    }

    fn run(&mut self, seconds: f64, mut each: impl FnMut(&mut Self)) {
        for _ in 0..(seconds / DT_S).round() as usize {
            self.step();
            each(self);
        }
    }

    #[track_caller]
    fn until(&mut self, seconds: f64, what: &str, done: impl Fn(&Self) -> bool) {
        let start = self.now;
        while !done(self) {
            let (activity, detail) = (self.onboard.executor.activity(), self.onboard.executor.detail());
            let took_s = self.now.seconds_since(start);
            assert!(took_s < seconds, "no {what}: {activity:?} {detail}, {:?} at {}", self.px4.modes, self.px4.position);
            self.step();
        }
    }

    fn command(&mut self, action: VehicleAction) -> Reply {
        let (reply, sent) = self.onboard.command(action, self.now);
        self.deliver(sent);
        reply
    }

    /// A command that the autopilot decides; how it ended.
    #[track_caller]
    fn asked(&mut self, action: VehicleAction) -> Result<(), String> {
        match self.command(action) {
            Reply::Asked(ticket, _) => {
                self.until(8.0, "answer", |field| field.onboard.outcomes.contains_key(&ticket));
                self.onboard.outcomes[&ticket].clone().map_err(|error| error.to_string())
            }
            other => panic!("{other:?}"),
        }
    }

    #[track_caller]
    fn accepted(&mut self, action: VehicleAction) {
        assert_eq!(self.command(action), Reply::Accepted);
    }

    /// Up, and held by guidance.
    #[track_caller]
    fn take_off(&mut self) {
        self.accepted(VehicleAction::TakeOff { height_m: 5.0 });
        self.until(40.0, "OFFBOARD", |field| field.px4.mode == OFFBOARD);
        self.until(20.0, "hold", |field| *field.onboard.executor.activity() == Activity::Holding { settled: true });
    }

    fn is_pilots(&self) -> bool {
        *self.onboard.executor.activity() == Activity::PilotControl
    }
}

impl Leader {
    fn state(&self, now: Stamp, like: &VehicleState) -> VehicleState {
        let gone_m = 1.5 * now.seconds_since(self.start);
        VehicleState {
            stamp: now,
            vehicle: VehicleId::new("l").unwrap(),
            position_ned_m: Vector3::new(gone_m, -9.0, -6.0),
            velocity_ned_mps: Vector3::new(1.5, 0.0, 0.0),
            heading_rad: 0.0,
            mode: FlightMode::Guided,
            armed: true,
            landed: LandedState::InAir,
            acceleration_ned_mps2: Some(Vector3::zeros()),
            intent: None,
            ..like.clone()
        }
    }
}

/// Whether this flies the vehicle.
fn flies(message: &MavMessage) -> bool {
    match message {
        MavMessage::SET_POSITION_TARGET_LOCAL_NED(_) | MavMessage::SET_POSITION_TARGET_GLOBAL_INT(_) => true,
        MavMessage::COMMAND_LONG(data) => matches!(
            data.command,
            MavCmd::MAV_CMD_DO_SET_MODE | MavCmd::MAV_CMD_NAV_TAKEOFF | MavCmd::MAV_CMD_COMPONENT_ARM_DISARM
        ),
        _ => false,
    }
}

#[test]
fn from_the_ground_to_the_ground_by_our_commands_alone() {
    let mut field = Field::new();
    field.px4.ready = false;
    let refusal = field.asked(VehicleAction::Arm).unwrap_err();
    assert!(refusal.contains("temporarily rejected") && refusal.contains("Arming denied"), "{refusal}");
    field.px4.ready = true;
    assert_eq!(field.asked(VehicleAction::Arm), Ok(()));
    field.until(3.0, "armed", |field| field.state().unwrap().armed);
    field.run(1.0, |field| assert!(!field.is_pilots()));
    field.accepted(VehicleAction::TakeOff { height_m: 5.0 });
    field.until(40.0, "OFFBOARD", |field| {
        assert!(!field.is_pilots(), "{:?}", field.px4.modes);
        field.px4.mode == OFFBOARD
    });
    assert_eq!(field.px4.modes, [LOITER, TAKEOFF, LOITER, OFFBOARD]);
    assert!((-field.px4.position.z - 5.0).abs() < 1.0, "{}", field.px4.position);

    let there = LocalPoint::new(15.0, 10.0);
    field.accepted(VehicleAction::GoTo { point: there, height_m: 7.0 });
    field.until(60.0, "arrival", |field| *field.onboard.executor.activity() == Activity::Holding { settled: true });
    let off_m = (field.px4.position - Vector3::new(15.0, 10.0, -7.0)).norm();
    assert!(off_m < 1.0, "{off_m}");

    field.leader = Some(Leader { start: field.now.plus_secs_f64(-15.0) });
    field.run(1.0, |_| {});
    let (feeds, slot) = (field.px4.feeds, Slot { forward_m: 0.0, right_m: 9.0, up_m: 0.0 });
    field.accepted(VehicleAction::Follow { leader: VehicleId::new("l").unwrap(), slot });
    field.until(60.0, "slot", |field| matches!(field.onboard.executor.activity(), Activity::Following { settled: true, .. }));
    field.run(20.0, |field| {
        assert_eq!(field.px4.mode, OFFBOARD);
        let leader = field.leader.as_ref().unwrap().state(field.now, &field.state().unwrap());
        let off_m = (field.px4.position - leader.position_ned_m - Vector3::new(0.0, 9.0, 0.0)).norm();
        assert!(off_m < 1.0, "{off_m}");
    });
    assert!(field.px4.feeds > feeds + 100, "accelerations are fed forward: {}", field.px4.feeds - feeds);

    field.accepted(VehicleAction::Land);
    field.until(60.0, "motors off", |field| !field.px4.armed);
    assert_eq!(field.px4.mode, OFFBOARD, "the mode that it was armed to be in");
    assert_eq!(field.px4.modes[3..], [OFFBOARD, LAND, OFFBOARD]);
    field.run(3.0, |field| assert!(!field.is_pilots()));
    assert_eq!(field.asked(VehicleAction::Disarm), Ok(()));
    assert_eq!((field.px4.losses, field.px4.global_setpoints), (0, 0), "never out of OFFBOARD, and all in its own frame");

    // And again, from where it came down.
    field.leader = None;
    field.run(35.0, |_| {});
    field.take_off();
    assert_eq!(field.px4.losses, 0);
}

#[test]
fn landed_out_of_hold_it_is_not_the_pilots_and_takes_off_again() {
    let mut field = Field::new();
    field.accepted(VehicleAction::TakeOff { height_m: 5.0 });
    field.until(40.0, "HOLD", |field| field.px4.modes.ends_with(&[TAKEOFF, LOITER]));
    field.accepted(VehicleAction::Land);
    field.until(60.0, "motors off", |field| field.px4.modes.contains(&LAND) && !field.px4.armed);
    assert_eq!(field.px4.mode, LOITER);
    field.run(3.0, |field| assert!(!field.is_pilots()));
    field.take_off();
}

#[test]
fn the_pilot_takes_over_in_posctl_and_has_it_until_it_is_handed_back() {
    let mut field = Field::new();
    field.take_off();
    field.accepted(VehicleAction::GoTo { point: LocalPoint::new(40.0, 0.0), height_m: 6.0 });
    field.run(3.0, |_| {});
    field.px4.enter(POSCTL);
    field.run(0.4, |_| {});
    let setpoints = field.px4.local_setpoints;
    field.run(20.0, |field| {
        assert!(field.is_pilots() && field.px4.mode == POSCTL);
        assert!(!field.sent.iter().any(flies), "{:?}", field.sent);
    });
    assert_eq!(field.px4.local_setpoints, setpoints);
    assert!(matches!(field.command(VehicleAction::Hold), Reply::Refused(why) if why.contains("pilot")));
    // Handed back, it holds: PX4 wouldn't by itself.
    assert_eq!(field.asked(VehicleAction::SetMode(FlightMode::Guided)), Ok(()));
    field.run(10.0, |field| assert_eq!(field.px4.mode, OFFBOARD));
    assert_eq!(field.px4.losses, 0);
    field.accepted(VehicleAction::Land);
    field.until(60.0, "motors off", |field| !field.px4.armed);
}

/// In HOLD, the pilot chose it: halfway up, out of OFFBOARD, after a take-off of its own. Another mode at the end of our take-off is
/// the pilot's, too.
#[test]
fn hold_at_any_other_time_is_the_pilots_and_so_is_another_mode_at_the_end() {
    #[track_caller]
    fn is_left_alone(field: &mut Field, mode: (u32, u32)) {
        field.run(0.4, |_| {});
        field.run(15.0, |field| {
            assert!(field.is_pilots() && field.px4.mode == mode, "{:?}", field.px4.modes);
            assert!(!field.sent.iter().any(flies), "{:?}", field.sent);
        });
    }
    let mut field = Field::new();
    field.accepted(VehicleAction::TakeOff { height_m: 8.0 });
    field.until(40.0, "climb", |field| field.px4.position.z < -3.0);
    assert_eq!(field.px4.mode, TAKEOFF);
    field.px4.enter(LOITER);
    is_left_alone(&mut field, LOITER);

    let mut field = Field::new();
    field.take_off();
    field.px4.enter(LOITER);
    is_left_alone(&mut field, LOITER);

    let mut field = Field::new();
    field.accepted(VehicleAction::TakeOff { height_m: 5.0 });
    field.until(40.0, "climb", |field| field.px4.position.z < -4.0);
    field.px4.enter(POSCTL);
    is_left_alone(&mut field, POSCTL);

    // By a ground station: nobody asked us.
    let mut field = Field::new();
    let take_off = mavlink::dialects::ardupilotmega::COMMAND_LONG_DATA {
        param1: 1.0,
        command: MavCmd::MAV_CMD_COMPONENT_ARM_DISARM,
        target_system: SYSTEM,
        ..Default::default()
    };
    let station = mavlink::MavHeader { system_id: 255u8.into(), component_id: 190, sequence: 0 };
    let take = |field: &mut Field, data| drop(field.px4.take(station, &MavMessage::COMMAND_LONG(data)));
    take(&mut field, take_off.clone());
    let nan = f32::NAN;
    let up = mavlink::dialects::ardupilotmega::COMMAND_LONG_DATA {
        command: MavCmd::MAV_CMD_NAV_TAKEOFF,
        param4: nan,
        param5: nan,
        param6: nan,
        param7: 378.0,
        ..take_off
    };
    take(&mut field, up);
    field.until(40.0, "HOLD", |field| field.px4.modes.ends_with(&[TAKEOFF, LOITER]));
    is_left_alone(&mut field, LOITER);
}

/// Whether the script does refuse and fall out, so that the flights above show something.
#[test]
fn the_scripted_px4_refuses_offboard_without_setpoints_and_falls_out_of_it() {
    let mut field = Field::new();
    field.take_off();
    field.mute = true;
    field.until(2.0, "loss", |field| field.px4.losses == 1);
    assert_eq!(field.px4.mode, POSCTL);
    field.run(2.0, |_| {});
    field.mute = false;
    assert!(field.is_pilots(), "its fail-safe isn't fought");
    let header = field.onboard.autopilot.header();
    let offboard = mavlink::dialects::ardupilotmega::COMMAND_LONG_DATA {
        command: MavCmd::MAV_CMD_DO_SET_MODE,
        param1: 1.0,
        param2: 6.0,
        target_system: SYSTEM,
        ..Default::default()
    };
    let _ = field.px4.take(header, &MavMessage::COMMAND_LONG(offboard));
    assert_eq!(field.px4.mode, POSCTL);
    assert_eq!(field.asked(VehicleAction::SetMode(FlightMode::Guided)), Ok(()), "after a second of setpoints");
    // A person's RTL is PX4's own, and a person's.
    assert_eq!(field.asked(VehicleAction::SetMode(FlightMode::Rtl)), Ok(()));
    field.until(60.0, "home", |field| !field.px4.armed);
    assert!(field.px4.modes.contains(&RTL));
}
