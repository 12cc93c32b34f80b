//! Ground stations beside the service: what they see of the vehicle, what they can do, and what they can't.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test ends at its first surprise")]

#[allow(dead_code, reason = "shared with other tests")]
mod peer;

use std::net::{SocketAddr, TcpListener, UdpSocket};
use std::time::Duration;

use halcyon_chassis::{Context, testing, topics};
use halcyon_model::{FlightMode, VehicleState};
use halcyon_vehicle_link::core::frame::{Frame, Framer};
use halcyon_vehicle_link::{Config, run};
use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};
use mavlink::{MavHeader, MavlinkVersion};
use tokio::io::{AsyncReadExt as _, AsyncWriteExt as _};
use tokio::net::TcpStream;

use peer::{Peer, SYSTEM};

const PATIENCE: Duration = Duration::from_secs(30);

struct Rig {
    context: Context,
    peer: Peer,
    states: halcyon_chassis::Subscriber<VehicleState>,
    service: tokio::task::JoinHandle<anyhow::Result<()>>,
    tcp: SocketAddr,
    udp: SocketAddr,
}

impl Rig {
    async fn start() -> Self {
        let context = testing::context("vehicle-link.test").await;
        let states = context.bus.subscribe(&topics::vehicle_states()).await.unwrap();
        let peer = Peer::tcp();
        let tcp = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
        let udp = SocketAddr::from(([127, 0, 0, 1], peer::free_udp_port()));
        let config = Config {
            vehicle: "v".into(),
            endpoint: format!("tcpout:{}", peer.address),
            relay: vec![format!("tcpin:{tcp}"), format!("udpin:{udp}")],
            ..Config::default()
        };
        let service = tokio::spawn(run(context.clone(), config));
        let mut rig = Self { context, peer, states, service, tcp, udp };
        rig.state(|_| true).await;
        rig
    }

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

    async fn wait(&self, condition: impl Fn(&Peer) -> bool) {
        let poll = async {
            while !condition(&self.peer) {
                self.context.clock.sleep(Duration::from_millis(20)).await;
            }
        };
        self.context.clock.timeout(PATIENCE, poll).await.expect("the condition did not come true");
    }

    /// Connects, as soon as the port is open.
    async fn station(&self) -> TcpStream {
        let connect = async {
            loop {
                if let Ok(stream) = TcpStream::connect(self.tcp).await {
                    return stream;
                }
                self.context.clock.sleep(Duration::from_millis(20)).await;
            }
        };
        self.context.clock.timeout(PATIENCE, connect).await.unwrap()
    }

    async fn stop(self) {
        self.context.stop.cancel();
        self.service.await.unwrap().unwrap();
    }
}

fn set_mode(sender: (u8, u8), mode: f32) -> Frame {
    let header = MavHeader { system_id: sender.0.into(), component_id: sender.1, sequence: 0 };
    let command = ardu::COMMAND_LONG_DATA {
        command: MavCmd::MAV_CMD_DO_SET_MODE,
        target_system: SYSTEM,
        target_component: 1,
        param1: 1.0,
        param2: mode,
        ..Default::default()
    };
    Frame::encode(MavlinkVersion::V2, header, &MavMessage::COMMAND_LONG(command)).unwrap()
}

/// Reads frames until there are so many of the vehicle's.
async fn vehicles_frames(station: &mut TcpStream, count: usize) -> Vec<Frame> {
    let (mut framer, mut frames, mut buffer) = (Framer::default(), Vec::new(), vec![0; 65_536]);
    while frames.len() < count {
        let length = station.read(&mut buffer).await.unwrap();
        assert!(length > 0, "the station was dropped");
        frames.extend(framer.stream(&buffer[..length]).into_iter().filter(|frame| frame.header().component_id != 191));
    }
    frames
}

/// A message that no dialect has.
fn unknown(sequence: u8) -> Vec<u8> {
    vec![0xFD, 3, 0, 0, sequence, SYSTEM, 1, 0x40, 0xE2, 0x01, 1, 2, 3, 0xAB, 0xCD]
}

#[tokio::test(flavor = "multi_thread")]
async fn a_station_sees_every_frame_byte_for_byte_and_flies_the_vehicle() {
    let mut rig = Rig::start().await;
    let mut station = rig.station().await;
    let (mut framer, mut frames, mut buffer) = (Framer::default(), Vec::<Frame>::new(), vec![0; 65_536]);
    let is_unknown = |frame: &Frame| frame.message_id() == 123_456;
    let mut asked = false;
    while frames.len() < 60 || frames.iter().filter(|frame| is_unknown(frame)).count() < 2 {
        let length = station.read(&mut buffer).await.unwrap();
        frames.extend(framer.stream(&buffer[..length]).into_iter().filter(|frame| frame.header().component_id != 191));
        if frames.len() >= 20 && !asked {
            asked = true;
            *rig.peer.shared.garbage.lock().unwrap() = [unknown(1), unknown(2)].concat();
        }
    }
    let (unknowns, frames): (Vec<Frame>, Vec<Frame>) = frames.into_iter().partition(is_unknown);
    let said = rig.peer.shared.said.lock().unwrap().clone();
    let first = said.iter().position(|said| said[..] == frames[0].bytes()[..]).expect("not what the vehicle said");
    for (frame, said) in frames.iter().zip(&said[first..]) {
        assert_eq!(frame.bytes()[..], said[..]);
    }
    let unknowns: Vec<Vec<u8>> = unknowns.iter().map(|frame| frame.bytes().to_vec()).collect();
    assert_eq!(unknowns, [unknown(1), unknown(2)]);
    let command = set_mode((255, 190), 5.0);
    station.write_all(command.bytes()).await.unwrap();
    rig.state(|state| state.mode == FlightMode::Loiter).await;
    let from_station = |(header, _): &&(MavHeader, MavMessage)| header.system_id == 255 && header.component_id == 190;
    assert_eq!(rig.peer.shared.frames.lock().unwrap().iter().filter(from_station).count(), 1);
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_station_over_udp_is_heard_and_answered_and_broadcasts_reach_the_other_stations() {
    let mut rig = Rig::start().await;
    let mut other = rig.station().await;
    let station = UdpSocket::bind("127.0.0.1:0").unwrap();
    station.connect(rig.udp).unwrap();
    station.set_nonblocking(true).unwrap();
    let station = tokio::net::UdpSocket::from_std(station).unwrap();
    let header = MavHeader { system_id: 254, component_id: 190, sequence: 0 };
    let beat = Frame::encode(MavlinkVersion::V2, header, &MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA::default())).unwrap();
    let mut buffer = vec![0; 65_536];
    let talk = async {
        loop {
            // Lost if the socket is not open yet.
            let _ = station.send(beat.bytes()).await;
            if let Ok(Ok(length)) = rig.context.clock.timeout(Duration::from_millis(200), station.recv(&mut buffer)).await {
                return Framer::datagram(&buffer[..length]);
            }
        }
    };
    let frames = rig.context.clock.timeout(PATIENCE, talk).await.unwrap();
    assert!(frames.iter().all(|frame| frame.header().system_id == u32::from(SYSTEM)));
    let (mut framer, mut is_there, mut stream) = (Framer::default(), false, vec![0; 65_536]);
    while !is_there {
        let length = other.read(&mut stream).await.unwrap();
        is_there = framer.stream(&stream[..length]).iter().any(|frame| frame == &beat);
    }
    // What is addressed to the vehicle is not for the other station.
    station.send(set_mode((254, 190), 6.0).bytes()).await.unwrap();
    rig.state(|state| state.mode == FlightMode::Rtl).await;
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_claims_to_be_us_the_vehicle_or_nobody_is_not_passed_on_and_neither_is_noise() {
    let mut rig = Rig::start().await;
    let mut station = rig.station().await;
    rig.wait(|peer| peer.sent(|message| matches!(message, MavMessage::HEARTBEAT(_))) >= 2).await;
    for sender in [(0, 1), (SYSTEM, 191), (SYSTEM, 1)] {
        station.write_all(set_mode(sender, 6.0).bytes()).await.unwrap();
    }
    let mut broken = set_mode((255, 190), 6.0).bytes().to_vec();
    broken[20] ^= 0x10;
    station.write_all(&broken).await.unwrap();
    station.write_all(set_mode((255, 190), 5.0).bytes()).await.unwrap();
    rig.state(|state| state.mode == FlightMode::Loiter).await;
    let strangers = |(header, message): &&(MavHeader, MavMessage)| {
        matches!(message, MavMessage::COMMAND_LONG(data) if data.param2 == 6.0) || header.system_id == 0
    };
    assert_eq!(rig.peer.shared.frames.lock().unwrap().iter().filter(strangers).count(), 0);
    // Who sends nothing but noise is dropped; the vehicle stays.
    let noise: Vec<u8> = (0..200_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 13) as u8).collect();
    let _ = station.write_all(&noise).await;
    let mut buffer = vec![0; 65_536];
    let dropped = async { while station.read(&mut buffer).await.is_ok_and(|length| length > 0) {} };
    rig.context.clock.timeout(PATIENCE, dropped).await.unwrap();
    rig.peer.set_mode(9);
    rig.state(|state| state.mode == FlightMode::Land).await;
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_station_that_does_not_read_holds_up_nobody() {
    let mut rig = Rig::start().await;
    let _deaf = rig.station().await;
    let mut station = rig.station().await;
    vehicles_frames(&mut station, 5).await;
    // Far more than the socket's buffers hold.
    let header = MavHeader { system_id: SYSTEM.into(), component_id: 1, sequence: 0 };
    let big = ardu::FILE_TRANSFER_PROTOCOL_DATA { payload: [7; 251], ..Default::default() };
    let big = Frame::encode(MavlinkVersion::V2, header, &MavMessage::FILE_TRANSFER_PROTOCOL(big)).unwrap();
    *rig.peer.shared.garbage.lock().unwrap() = big.bytes().repeat(60_000);
    let (mut framer, mut seen, mut buffer) = (Framer::default(), 0, vec![0; 65_536]);
    let reading = async {
        while seen < 1_000 {
            let length = station.read(&mut buffer).await.unwrap();
            seen += framer.stream(&buffer[..length]).len();
        }
    };
    rig.context.clock.timeout(PATIENCE, reading).await.expect("the other station waits");
    rig.peer.set_mode(9);
    rig.state(|state| state.mode == FlightMode::Land).await;
    rig.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_second_service_flies_its_own_vehicle_through_the_relay_of_the_first() {
    // Two vehicles on one socket; the first service has the socket, the second only the first one's relay.
    let place = SocketAddr::from(([127, 0, 0, 1], peer::free_udp_port()));
    let (seven, eight) = (Peer::udp_to(place, 7), Peer::udp_to(place, 8));
    let tcp = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let context = testing::context("vehicle-link.test").await;
    let mut states = context.bus.subscribe(&topics::vehicle_states()).await.unwrap();
    let first = Config {
        vehicle: "seven".into(),
        endpoint: format!("udpin:{place}"),
        system_id: 7,
        relay: vec![format!("tcpin:{tcp}")],
        ..Config::default()
    };
    let second = Config { vehicle: "eight".into(), endpoint: format!("tcpout:{tcp}"), system_id: 8, ..Config::default() };
    let services = [first, second].map(|config| tokio::spawn(run(context.clone(), config)));
    seven.set_mode(5);
    eight.set_mode(6);
    let both = async {
        let mut modes = std::collections::BTreeMap::new();
        while modes.len() < 2 {
            let state = states.recv().await.unwrap();
            if matches!(state.mode, FlightMode::Loiter | FlightMode::Rtl) {
                modes.insert(state.vehicle.to_string(), state.mode);
            }
        }
        modes
    };
    let modes = context.clock.timeout(PATIENCE, both).await.unwrap();
    assert_eq!((modes["seven"], modes["eight"]), (FlightMode::Loiter, FlightMode::Rtl));
    let poll = async {
        while eight.sent(|message| matches!(message, MavMessage::COMMAND_LONG(_))) < 10 {
            context.clock.sleep(Duration::from_millis(20)).await;
        }
    };
    context.clock.timeout(PATIENCE, poll).await.unwrap();
    for (peer, system) in [(&seven, 7), (&eight, 8)] {
        let to_it = |message: &MavMessage| matches!(message, MavMessage::COMMAND_LONG(data) if data.target_system != system);
        assert_eq!(peer.sent(to_it), 0, "system {system} was sent another one's commands");
    }
    context.stop.cancel();
    for service in services {
        service.await.unwrap().unwrap();
    }
}
