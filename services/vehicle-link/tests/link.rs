//! The service against a scripted autopilot on real sockets.

#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test ends at its first surprise")]

mod peer;

use std::sync::atomic::Ordering;
use std::time::Duration;

use halcyon_chassis::{Context, testing, topics};
use halcyon_model::{CommandReply, FlightMode, VehicleAction, VehicleCommand, VehicleId, VehicleState};
use halcyon_vehicle_link::{Config, run};
use mavlink::Message as _;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};

use peer::{Peer, SYSTEM};

const PATIENCE: Duration = Duration::from_secs(30);

struct Rig {
    context: Context,
    peer: Peer,
    states: halcyon_chassis::Subscriber<VehicleState>,
    service: tokio::task::JoinHandle<anyhow::Result<()>>,
}

impl Rig {
    async fn start(peer: Peer, scheme: &str) -> Self {
        Self::with(peer, scheme, Config::default()).await
    }

    async fn with(peer: Peer, scheme: &str, config: Config) -> Self {
        let endpoint = format!("{scheme}:{}", peer.address);
        Self::at(peer, Config { endpoint, ..config }).await
    }

    async fn at(peer: Peer, config: Config) -> Self {
        let context = testing::context("vehicle-link.test").await;
        let states = context.bus.subscribe(&topics::vehicle_states()).await.unwrap();
        let config = Config { vehicle: "v".into(), role: "follower".into(), ..config };
        let service = tokio::spawn(run(context.clone(), config));
        Self { context, peer, states, service }
    }

    /// The first state for which `wanted` holds.
    async fn state(&mut self, wanted: impl Fn(&VehicleState) -> bool) -> VehicleState {
        let search = async {
            loop {
                let state = self.states.recv().await.unwrap();
                if wanted(&state) {
                    return state;
                }
            }
        };
        self.context.clock.timeout(PATIENCE, search).await.expect("no such state came")
    }

    async fn call(&self, action: VehicleAction) -> CommandReply {
        let now = self.context.clock.now();
        let vehicle = VehicleId::new("v").unwrap();
        let command =
            VehicleCommand { stamp: now, deadline: now + PATIENCE, who: "test".into(), vehicle: vehicle.clone(), action };
        self.context.bus.call(&topics::vehicle_command(&vehicle), &command, PATIENCE).await.unwrap()
    }

    /// Waits for a condition, bounded.
    async fn wait(&mut self, condition: impl Fn(&Peer) -> bool) {
        let peer = &self.peer;
        let clock = &self.context.clock;
        let poll = async {
            while !condition(peer) {
                clock.sleep(Duration::from_millis(20)).await;
            }
        };
        clock.timeout(PATIENCE, poll).await.expect("the condition did not come true");
    }

    async fn stop(self) {
        self.context.stop.cancel();
        self.service.await.unwrap().unwrap();
    }
}

fn asks_for_streams(message: &MavMessage) -> bool {
    matches!(message, MavMessage::COMMAND_LONG(data) if data.command == MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL)
}

async fn finds_it_and_publishes(peer: Peer, scheme: &str) {
    let mut rig = Rig::start(peer, scheme).await;
    let state = rig.state(|_| true).await;
    // The context's origin is at that very place.
    assert!(state.position_ned_m.norm() < 0.1, "{}", state.position_ned_m);
    assert!((state.heading_rad - 0.5).abs() < 1e-6);
    assert!(!state.armed && !state.estimator_ok && !state.ready_to_arm && state.battery_fraction.is_none());
    rig.wait(|peer| peer.sent(asks_for_streams) >= 10).await;
    rig.wait(|peer| peer.sent(|message| matches!(message, MavMessage::HEARTBEAT(_))) >= 2).await;
    let frames = rig.peer.shared.frames.lock().unwrap().clone();
    for (header, message) in &frames {
        assert_eq!(header.component_id, 191, "we are the onboard computer");
        if let Some(target) = message.target_system_id() {
            assert_eq!(target, SYSTEM, "{message:?}");
        }
    }
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn the_clock_the_round_trip_the_firmware_and_the_loss_are_told() {
    let mut rig = Rig::start(Peer::udp(), "udpout").await;
    let told = |state: &VehicleState| {
        state.link.is_some_and(|link| link.round_trip_s.is_some())
            && state.firmware.as_ref().is_some_and(|f| !f.version.is_empty())
    };
    let state = rig.state(told).await;
    let link = state.link.unwrap();
    assert!(link.round_trip_s.unwrap() < 1.0 && link.received > 0 && !link.is_signed, "{link:?}");
    assert!(link.loss < 1e-9, "{link:?}");
    let firmware = state.firmware.unwrap();
    assert_eq!((&*firmware.autopilot, &*firmware.vehicle, &*firmware.version), ("ArduPilot", "quadrotor", "4.6.0"));
    rig.peer.shared.lose_one_of.store(4, Ordering::Relaxed);
    let lossy = rig.state(|state| state.link.is_some_and(|link| link.loss > 0.15)).await;
    assert!(lossy.link.unwrap().loss < 0.3);
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn an_autopilot_that_knows_only_mavlink_1_is_spoken_to_in_it() {
    let peer = Peer::tcp();
    peer.shared.is_old.store(true, Ordering::Relaxed);
    let mut rig = Rig::start(peer, "tcpout").await;
    rig.state(|_| true).await;
    // It reads nothing else.
    rig.wait(|peer| peer.sent(asks_for_streams) >= 5).await;
    let reply = rig.call(VehicleAction::SetMode(FlightMode::Guided)).await;
    assert!(reply.accepted, "{reply:?}");
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn px4s_modes_are_set_and_heard_by_its_own_numbers() {
    let peer = Peer::tcp();
    let px4 = mavlink::dialects::ardupilotmega::MavAutopilot::MAV_AUTOPILOT_PX4;
    peer.shared.firmware.lock().unwrap().0 = px4;
    peer.set_mode(0x0003_0000);
    let mut rig = Rig::start(peer, "tcpout").await;
    let state = rig.state(|state| state.mode == FlightMode::PosHold).await;
    assert_eq!(state.firmware.unwrap().autopilot, "PX4");
    let reply = rig.call(VehicleAction::SetMode(FlightMode::Guided)).await;
    assert!(reply.accepted, "{reply:?}");
    rig.state(|state| state.mode == FlightMode::Guided).await;
    assert_eq!(rig.peer.mode(), 0x0006_0000, "OFFBOARD");
    // Setpoints came first, or it would have refused.
    let frames = rig.peer.shared.frames.lock().unwrap().clone();
    let is_mode =
        |message: &MavMessage| matches!(message, MavMessage::COMMAND_LONG(data) if data.command == MavCmd::MAV_CMD_DO_SET_MODE);
    let asked = frames.iter().position(|(_, message)| is_mode(message)).unwrap();
    let is_setpoint = |(_, message): &&(_, MavMessage)| matches!(message, MavMessage::SET_POSITION_TARGET_GLOBAL_INT(_));
    assert!(frames[..asked].iter().filter(is_setpoint).count() >= 5);
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn what_is_no_multicopter_is_not_touched() {
    let peer = Peer::tcp();
    peer.shared.firmware.lock().unwrap().1 = mavlink::dialects::ardupilotmega::MavType::MAV_TYPE_FIXED_WING;
    let mut rig = Rig::start(peer, "tcpout").await;
    rig.wait(|peer| peer.sent(|message| matches!(message, MavMessage::HEARTBEAT(_))) >= 3).await;
    let reply = rig.call(VehicleAction::SetMode(FlightMode::Guided)).await;
    assert!(!reply.accepted, "{reply:?}");
    assert_eq!(rig.peer.sent(|message| !matches!(message, MavMessage::HEARTBEAT(_))), 0);
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn of_two_vehicles_on_one_socket_only_the_chosen_one_is_spoken_to() {
    let port = peer::free_udp_port();
    let place = std::net::SocketAddr::from(([127, 0, 0, 1], port));
    let config = Config { endpoint: format!("udpin:{place}"), system_id: 8, ..Config::default() };
    // The other speaks first, and goes on.
    let other = Peer::udp_to(place, 7);
    let mut rig = Rig::at(Peer::udp_to(place, 8), config).await;
    rig.state(|_| true).await;
    rig.wait(|peer| peer.sent(asks_for_streams) >= 10).await;
    let reply = rig.call(VehicleAction::SetMode(FlightMode::Guided)).await;
    assert!(reply.accepted, "{reply:?}");
    assert_eq!((rig.peer.mode(), other.mode()), (4, 0));
    assert_eq!(other.sent(|message| !matches!(message, MavMessage::HEARTBEAT(_))), 0);
    let frames = rig.peer.shared.frames.lock().unwrap().clone();
    assert!(frames.iter().all(|(_, message)| message.target_system_id().is_none_or(|target| target == 8)));
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_tcp() {
    finds_it_and_publishes(Peer::tcp(), "tcpout").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn over_udp() {
    finds_it_and_publishes(Peer::udp(), "udpout").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn commands_are_answered_with_the_autopilots_words() {
    let mut rig = Rig::start(Peer::tcp(), "tcpout").await;
    rig.state(|_| true).await;
    rig.peer.shared.refuse_arming.store(true, Ordering::Relaxed);
    let reply = rig.call(VehicleAction::Arm).await;
    assert!(!reply.accepted && reply.reason.contains("PreArm: Compass not calibrated"), "{reply:?}");
    let reply = rig.call(VehicleAction::Return).await;
    assert!(!reply.accepted && reply.reason.contains("on the ground"), "{reply:?}");
    // The first try is not heard; the second is.
    rig.wait(|peer| peer.sent(asks_for_streams) >= 10).await;
    rig.peer.shared.deaf_once.store(true, Ordering::Relaxed);
    let reply = rig.call(VehicleAction::SetMode(FlightMode::Guided)).await;
    assert!(reply.accepted, "{reply:?}");
    rig.state(|state| state.mode == FlightMode::Guided).await;
    let is_mode =
        |message: &MavMessage| matches!(message, MavMessage::COMMAND_LONG(data) if data.command == MavCmd::MAV_CMD_DO_SET_MODE);
    assert!(rig.peer.sent(is_mode) >= 2);
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_connection_comes_back_and_garbage_does_no_harm() {
    let mut rig = Rig::start(Peer::tcp(), "tcpout").await;
    rig.state(|_| true).await;
    // Noise with false starts of frames of both versions in it.
    let noise: Vec<u8> = (0..20_000u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let mut noise = noise;
    for at in (0..noise.len()).step_by(97) {
        noise[at] = if at % 2 == 0 { 0xFD } else { 0xFE };
    }
    *rig.peer.shared.garbage.lock().unwrap() = noise;
    rig.peer.set_mode(5);
    rig.state(|state| state.mode == FlightMode::Loiter).await;
    rig.peer.shared.hang_up.store(true, Ordering::Relaxed);
    rig.wait(|peer| *peer.shared.connections.lock().unwrap() == 2).await;
    rig.peer.set_mode(6);
    rig.state(|state| state.mode == FlightMode::Rtl).await;
    rig.stop().await;
}
