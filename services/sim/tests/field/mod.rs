//! What tests of whole flights share.
#![allow(dead_code, reason = "each test file uses its part")]

use halcyon_model::{FleetOrigin, Geodetic, LocalPoint, Stamp};
use halcyon_sim::autopilot::{Inbound, LinkId, Mode, Outbound};
use halcyon_sim::estimator::EstimatorConfig;
use halcyon_sim::gnss::GnssConfig;
use halcyon_sim::vehicle::Vehicle;
use halcyon_sim::wind::WindConfig;
use halcyon_sim::{SimConfig, SimVehicle};
use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage, MavResult};

pub(crate) const LINK: LinkId = LinkId(1);
/// Position only; velocity only.
pub(crate) const POSITION: u16 = 0b1101_1111_1000;
pub(crate) const VELOCITY: u16 = 0b1101_1100_0111;

/// A vehicle, the water below it, and a client that keeps all it hears.
pub(crate) struct Field {
    pub(crate) vehicle: Vehicle,
    pub(crate) water: Box<dyn Fn(LocalPoint, Stamp) -> f64>,
    pub(crate) heard: Vec<MavMessage>,
    /// Answers to numbers that are no commands: number and result.
    pub(crate) unlisted: Vec<(u16, u8)>,
}

impl Field {
    pub(crate) fn new(config: &SimConfig) -> Self {
        let origin = FleetOrigin(Geodetic::from_deg(53.1, -2.9, 40.0));
        let mut vehicle = Vehicle::new(config, 0, origin, Stamp::from_nanos(1_760_000_000_000_000_000)).expect("a vehicle");
        assert!(vehicle.attach(LINK));
        Self { vehicle, water: Box::new(|_, _| 0.0), heard: Vec::new(), unlisted: Vec::new() }
    }

    pub(crate) fn say(&mut self, message: MavMessage) {
        self.vehicle.handle(LINK, &Inbound::Message(MavHeader { system_id: 255, component_id: 190, sequence: 0 }, message));
        self.listen();
    }

    pub(crate) fn listen(&mut self) {
        for (_, outbound) in self.vehicle.take_outbox() {
            match outbound {
                Outbound::Message(message) => self.heard.push(message),
                Outbound::Acknowledgement(ack) => self.unlisted.push((ack.command, ack.result)),
            }
        }
    }

    pub(crate) fn run(&mut self, seconds: f64) {
        let until = self.vehicle.now().plus_secs_f64(seconds + 1e-4);
        while self.vehicle.now().plus_secs_f64(0.0025) < until {
            self.vehicle.advance(self.vehicle.now().plus_secs_f64(0.01), &*self.water);
            self.listen();
        }
    }

    /// Runs until `done`, and returns after how many seconds.
    #[track_caller]
    pub(crate) fn until(&mut self, seconds_max: f64, what: &str, done: impl Fn(&Vehicle) -> bool) -> f64 {
        let mut seconds = 0.0;
        while !done(&self.vehicle) {
            assert!(seconds < seconds_max, "{what}: not after {seconds_max} s; {:?}; {:?}", self.vehicle.truth(), self.texts());
            self.run(0.05);
            seconds += 0.05;
        }
        seconds
    }

    pub(crate) fn command(&mut self, command: MavCmd, params: [f32; 7]) -> MavResult {
        self.heard.retain(|message| !matches!(message, MavMessage::COMMAND_ACK(_)));
        let [param1, param2, param3, param4, param5, param6, param7] = params;
        self.say(MavMessage::COMMAND_LONG(mav::COMMAND_LONG_DATA {
            param1,
            param2,
            param3,
            param4,
            param5,
            param6,
            param7,
            command,
            target_system: 1,
            target_component: 1,
            confirmation: 0,
        }));
        let acks: Vec<_> = self
            .heard
            .iter()
            .filter_map(|message| match message {
                MavMessage::COMMAND_ACK(ack) if ack.command == command => Some(ack.result),
                _ => None,
            })
            .collect();
        assert_eq!(acks.len(), 1, "exactly one answer to {command:?}");
        acks[0]
    }

    pub(crate) fn set_mode(&mut self, mode: Mode) -> MavResult {
        self.command(MavCmd::MAV_CMD_DO_SET_MODE, [1.0, mode.number() as f32, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    pub(crate) fn arm(&mut self) -> MavResult {
        self.command(MavCmd::MAV_CMD_COMPONENT_ARM_DISARM, [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    }

    pub(crate) fn set_param(&mut self, name: &str, param_value: f32) {
        self.say(MavMessage::PARAM_SET(mav::PARAM_SET_DATA {
            param_value,
            target_system: 1,
            target_component: 1,
            param_id: name.into(),
            param_type: mav::MavParamType::MAV_PARAM_TYPE_REAL32,
        }));
    }

    pub(crate) fn target(&mut self, mask: u16, position: [f32; 3], velocity: [f32; 3]) {
        self.say(MavMessage::SET_POSITION_TARGET_LOCAL_NED(mav::SET_POSITION_TARGET_LOCAL_NED_DATA {
            x: position[0],
            y: position[1],
            z: position[2],
            vx: velocity[0],
            vy: velocity[1],
            vz: velocity[2],
            type_mask: mav::PositionTargetTypemask::from_bits_retain(mask),
            target_system: 1,
            target_component: 1,
            coordinate_frame: mav::MavFrame::MAV_FRAME_LOCAL_NED,
            ..Default::default()
        }));
    }

    pub(crate) fn texts(&self) -> Vec<String> {
        let text = |message: &MavMessage| match message {
            MavMessage::STATUSTEXT(data) => data.text.to_str().ok().map(str::to_owned),
            _ => None,
        };
        self.heard.iter().filter_map(text).collect()
    }

    pub(crate) fn heard_text(&self, part: &str) -> bool {
        self.texts().iter().any(|text| text.contains(part))
    }

    /// Ready, GUIDED, armed, and up at `height_m`.
    pub(crate) fn take_off(&mut self, height_m: f32) {
        while self.arm_when_ready() != MavResult::MAV_RESULT_ACCEPTED {
            self.run(0.5);
        }
        let up = self.command(MavCmd::MAV_CMD_NAV_TAKEOFF, [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, height_m]);
        assert_eq!(up, MavResult::MAV_RESULT_ACCEPTED);
        let wanted_m = -f64::from(height_m);
        self.until(30.0, "take-off", |vehicle| (vehicle.truth().position_ned_m.z - wanted_m).abs() < 0.4);
        self.run(4.0);
    }

    pub(crate) fn arm_when_ready(&mut self) -> MavResult {
        assert!(self.vehicle.truth().stamp.as_nanos() < 1_760_000_600_000_000_000, "never ready: {:?}", self.texts());
        self.set_mode(Mode::Guided);
        self.arm()
    }
}

pub(crate) fn perfect() -> SimConfig {
    SimConfig {
        wind: WindConfig::calm(),
        gnss: GnssConfig::perfect(),
        estimator: EstimatorConfig::perfect(),
        vehicles: SimVehicle::fleet(1, 0),
        ..SimConfig::default()
    }
}

pub(crate) fn real() -> SimConfig {
    SimConfig { vehicles: SimVehicle::fleet(1, 0), ..SimConfig::default() }
}
