//! The simulated autopilot, which was written without knowing this, does other than it is told: a fence of its own, a ground station
//! on its channel, a storm.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test")]

use halcyon_model::{
    Activity, FleetOrigin, Geodetic, LandedState, LocalPoint, Stamp, VehicleAction, VehicleCommand, VehicleState,
};
use halcyon_sim::autopilot::{Inbound, LinkId, Outbound};
use halcyon_sim::config::SimConfig;
use halcyon_sim::vehicle::Vehicle;
use halcyon_sim::wind::WindConfig;
use halcyon_vehicle_link::Config;
use halcyon_vehicle_link::autopilot::Autopilot;
use halcyon_vehicle_link::core::commands::{Command, Effect};
use halcyon_vehicle_link::core::executor::{Decision, Executor, ExecutorConfig, Output};
use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::MavMessage;

const LINK: LinkId = LinkId(1);
const TICK_S: f64 = 0.02;
const STATION: MavHeader = MavHeader { system_id: 255, component_id: 190, sequence: 0 };

/// A simulated copter, its vehicle-link, and what it said.
struct Craft {
    vehicle: Vehicle,
    link: Autopilot,
    executor: Executor,
    now: Stamp,
    ticks: u64,
    notes: Vec<String>,
    /// Positions heard.
    positions: u32,
    slow: Vec<String>,
}

impl Craft {
    /// In the air at 6 m, holding.
    fn flying(wind: WindConfig) -> Self {
        let now = Stamp::from_secs_f64(1_760_000_000.0);
        let origin = FleetOrigin(Geodetic::from_deg(53.1, -2.9, 40.0));
        let sim = SimConfig { wind, ..SimConfig::default() };
        let mut vehicle = Vehicle::new(&sim, 0, origin, now).unwrap();
        vehicle.attach(LINK);
        let config = Config { vehicle: vehicle.id().to_string(), ..Config::default() };
        let executor = Executor::new(ExecutorConfig {
            vehicle: vehicle.id().clone(),
            limits: config.limits.clone(),
            fail_safe: config.fail_safe.clone(),
            guidance: config.guidance.clone(),
            payload: config.payload.clone(),
            home_height_m: config.home_height_m,
            frame: origin.frame(),
        });
        let link = Autopilot::new(&config, origin, now).unwrap();
        let mut craft = Self { vehicle, link, executor, now, ticks: 0, notes: Vec::new(), positions: 0, slow: Vec::new() };
        craft.until(60.0, |craft| craft.state().is_some_and(|state| state.ready_to_arm && state.estimator_ok));
        // The executor hears of it with the next position.
        craft.run(0.1);
        let decision = craft.command(VehicleAction::TakeOff { height_m: 6.0 });
        assert!(matches!(decision, Decision::Accepted(_)), "{decision:?}");
        craft.until(60.0, |craft| matches!(craft.executor.activity(), Activity::Holding { settled: true }));
        craft
    }

    fn state(&self) -> Option<VehicleState> {
        self.link.state(self.now).map(|(state, _)| state)
    }

    fn command(&mut self, action: VehicleAction) -> Decision {
        let (stamp, vehicle) = (self.now, self.vehicle.id().clone());
        let deadline = stamp.plus_secs_f64(2.0);
        self.executor.command(&VehicleCommand { stamp, deadline, who: "test".into(), vehicle, action }, stamp)
    }

    fn go(&mut self, north_m: f64, east_m: f64) -> Decision {
        self.command(VehicleAction::GoTo { point: LocalPoint::new(north_m, east_m), height_m: 6.0 })
    }

    fn station_says(&mut self, message: MavMessage) {
        self.vehicle.handle(LINK, &Inbound::Message(STATION, message));
    }

    fn set(&mut self, name: &str, value: f32) {
        let target_system = self.vehicle.autopilot().system_id();
        self.station_says(MavMessage::PARAM_SET(ardu::PARAM_SET_DATA {
            param_value: value,
            target_system,
            target_component: 1,
            param_id: name.into(),
            param_type: ardu::MavParamType::MAV_PARAM_TYPE_REAL32,
        }));
    }

    fn carry_out(&mut self, effects: Vec<Effect>) {
        for effect in effects {
            match effect {
                Effect::Send(message) => self.vehicle.handle(LINK, &Inbound::Message(self.link.header(), message)),
                Effect::Done(_, Command::SetInterval(_), _) | Effect::Transferred(..) => {}
                Effect::Done(_, command, outcome) => self.executor.observe_outcome(&command, &outcome, self.now),
            }
        }
    }

    fn tick(&mut self) {
        self.ticks += 1;
        self.now = self.now.plus_secs_f64(TICK_S);
        self.vehicle.advance(self.now, &|_, _| 0.0);
        let header = MavHeader { system_id: self.vehicle.autopilot().system_id().into(), component_id: 1, sequence: 0 };
        let said: Vec<_> = self.vehicle.take_outbox().map(|(_, outbound)| outbound).collect();
        for outbound in said {
            let Outbound::Message(message) = outbound else { continue };
            self.positions += u32::from(matches!(message, MavMessage::GLOBAL_POSITION_INT(_)));
            let heard = self.link.observe(header, &message, self.now);
            if let Some(text) = heard.text {
                self.executor.observe_text(&text, self.now);
            }
            if heard.state
                && let Some((state, mode_heard)) = self.link.state(self.now)
            {
                self.executor.observe_self(state, mode_heard, self.now);
            }
        }
        if self.ticks.is_multiple_of(5) {
            for output in self.executor.step(self.now) {
                match output {
                    Output::Setpoint(setpoint) => {
                        let message = self.link.setpoint(&setpoint, self.now);
                        self.carry_out(message.map(Effect::Send).into_iter().collect());
                    }
                    Output::Request(command) => self.link.submit(0, command).unwrap(),
                    Output::Note(note) => self.notes.push(format!("{}: {}", note.what, note.why)),
                    Output::Withdraw | Output::AskStreams => {}
                }
            }
            let effects = self.link.poll(self.now);
            self.carry_out(effects);
            self.slow.extend(self.link.slow_streams());
        }
    }

    fn run(&mut self, seconds: f64) {
        (0..(seconds / TICK_S) as u32).for_each(|_| self.tick());
    }

    #[track_caller]
    fn until(&mut self, seconds: f64, done: impl Fn(&Self) -> bool) {
        let begun = self.now;
        while !done(self) {
            let (activity, detail) = (self.executor.activity(), self.executor.detail());
            assert!(self.now.seconds_since(begun) < seconds, "{activity:?}, {detail}, {:?}", self.notes);
            self.tick();
        }
    }

    fn unheeded(&self) -> bool {
        matches!(self.executor.activity(), Activity::FailSafe { reason } if reason.contains("does not follow its targets"))
    }

    fn alarms(&self) -> usize {
        self.notes.iter().filter(|note| note.contains("does not follow its targets")).count()
    }
}

/// A fence that only reports, 30 m about home; the place to go to is 100 m away.
#[test]
fn a_place_outside_the_autopilots_own_fence_is_given_up_and_reached_once_the_fence_is_gone() {
    let mut craft = Craft::flying(WindConfig::default());
    let home = craft.state().unwrap().position_ned_m;
    for (name, value) in [("FENCE_TYPE", 2.0), ("FENCE_ACTION", 0.0), ("FENCE_RADIUS", 30.0), ("FENCE_ENABLE", 1.0)] {
        craft.set(name, value);
    }
    let away_m = |craft: &Craft| (craft.state().unwrap().position_ned_m - home).xy().norm();
    assert!(matches!(craft.go(home.x + 100.0, home.y), Decision::Accepted(_)));
    craft.until(40.0, Craft::unheeded);
    // ArduCopter moves its last target on for GUID_TIMEOUT, 3 s, and stands there.
    let stood_m = away_m(&craft);
    assert!((30.0..50.0).contains(&stood_m), "{stood_m}");
    assert!(craft.notes.iter().any(|note| note.contains("it said: Circle fence breached")), "{:?}", craft.notes);
    craft.run(60.0);
    assert!(craft.unheeded() && (away_m(&craft) - stood_m).abs() < 3.0, "{} from {stood_m}", away_m(&craft));
    assert_eq!(craft.alarms(), 1, "{:?}", craft.notes);
    let refused = craft.go(home.x + 100.0, home.y);
    assert!(matches!(&refused, Decision::Refused(why) if why.contains("does not follow its targets")), "{refused:?}");
    craft.set("FENCE_ENABLE", 0.0);
    craft.until(120.0, |craft| matches!(craft.executor.activity(), Activity::Holding { settled: true }));
    assert!((away_m(&craft) - 100.0).abs() < 1.5, "{}", away_m(&craft));
    assert_eq!(craft.alarms(), 1, "{:?}", craft.notes);
}

/// At 15 m/s it leans as far as its autopilot lets it, 20°, and makes no way.
#[test]
fn a_storm_is_no_disobedience() {
    for wind in [WindConfig::steady(9.0, 0.0), WindConfig { speed_mps: 8.0, direction_from_deg: 0.0, gust_scale: 1.5 }] {
        let mut craft = Craft::flying(wind);
        let home = craft.state().unwrap().position_ned_m;
        for (north_m, east_m) in [(60.0, 0.0), (0.0, 40.0), (-40.0, 0.0), (30.0, 0.0)] {
            assert!(matches!(craft.go(home.x + north_m, home.y + east_m), Decision::Accepted(_)));
            craft.run(30.0);
        }
        assert_eq!(craft.alarms(), 0, "{:?}", craft.notes);
        assert!(matches!(craft.command(VehicleAction::Return), Decision::Accepted(_)));
        craft.until(180.0, |craft| craft.state().is_some_and(|state| state.landed == LandedState::OnGround && !state.armed));
        assert_eq!(craft.alarms(), 0, "{:?}", craft.notes);
    }
    let mut craft = Craft::flying(WindConfig::steady(15.0, 0.0));
    let home = craft.state().unwrap().position_ned_m;
    craft.set("ANGLE_MAX", 2000.0);
    assert!(matches!(craft.go(home.x + 100.0, home.y), Decision::Accepted(_)));
    craft.run(30.0);
    let way_m = craft.state().unwrap().position_ned_m.x - home.x;
    assert!(way_m < 5.0 && craft.alarms() == 0, "{way_m}, {:?}", craft.notes);
}

#[test]
fn a_ground_station_that_lowers_the_rates_does_not_keep_them_low() {
    let mut craft = Craft::flying(WindConfig::calm());
    let rate_hz = |craft: &mut Craft, seconds: f64| {
        let before = craft.positions;
        craft.run(seconds);
        f64::from(craft.positions - before) / seconds
    };
    assert!((rate_hz(&mut craft, 10.0) - 10.0).abs() < 0.5);
    assert!(craft.slow.is_empty(), "{:?}", craft.slow);
    let target_system = craft.vehicle.autopilot().system_id();
    #[allow(deprecated, reason = "ground stations still ask by it")]
    let request = |req_message_rate| {
        MavMessage::REQUEST_DATA_STREAM(ardu::REQUEST_DATA_STREAM_DATA {
            req_message_rate,
            target_system,
            target_component: 1,
            req_stream_id: ardu::MavDataStream::MAV_DATA_STREAM_ALL,
            start_stop: 1,
        })
    };
    craft.station_says(request(1));
    assert!((rate_hz(&mut craft, 4.0) - 1.0).abs() < 0.5);
    craft.run(10.0);
    assert!((rate_hz(&mut craft, 10.0) - 10.0).abs() < 0.5);
    assert_eq!(craft.slow.len(), 1, "{:?}", craft.slow);
    // Faster than ours is nobody's harm.
    craft.station_says(request(20));
    craft.run(10.0);
    assert!(rate_hz(&mut craft, 10.0) > 19.0);
}
