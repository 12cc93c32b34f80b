//! Clients of every manner, on real sockets.

use std::time::Duration;

use halcyon_chassis::testing;
use halcyon_sim::{SimConfig, SimVehicle};
use mavlink::dialects::ardupilotmega as mav;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage};
use mavlink::{AsyncMavlinkReader, MavHeader, MavlinkVersion};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;
use tokio::net::tcp::{OwnedReadHalf, OwnedWriteHalf};

use super::{bind, run_with};

fn one_vehicle() -> SimConfig {
    let mut vehicles = SimVehicle::fleet(1, 0);
    vehicles[0].mavlink_port = 0;
    SimConfig { vehicles, ..SimConfig::default() }
}

struct Field {
    context: halcyon_chassis::Context,
    address: std::net::SocketAddr,
    task: tokio::task::JoinHandle<anyhow::Result<()>>,
}

impl Field {
    async fn new(speed: f64) -> Self {
        let context = testing::context_at_speed("sim", speed).await;
        let config = one_vehicle();
        let listeners = bind(&config).await.expect("a free port");
        let address = listeners.address(&config.vehicles[0].id).expect("an address");
        let task = tokio::spawn(run_with(context.clone(), listeners, config));
        Self { context, address, task }
    }

    async fn client(&self) -> Client {
        let (read, write) = TcpStream::connect(self.address).await.expect("connected").into_split();
        Client { reader: AsyncMavlinkReader::new(read), write }
    }

    async fn stop(self) {
        self.context.stop.cancel();
        let ended = tokio::time::timeout(Duration::from_secs(10), self.task).await.expect("it stops");
        ended.expect("no panic").expect("no error");
    }
}

struct Client {
    reader: AsyncMavlinkReader<OwnedReadHalf>,
    write: OwnedWriteHalf,
}

impl Client {
    async fn say(&mut self, version: MavlinkVersion, message: &MavMessage) {
        let mut bytes = Vec::new();
        mavlink::write_versioned_msg(&mut bytes, version, MavHeader::default(), message).expect("it encodes");
        self.write.write_all(&bytes).await.expect("it is sent");
    }

    async fn ask(&mut self, version: MavlinkVersion, command: MavCmd, param1: f32, param2: f32) {
        let data =
            mav::COMMAND_LONG_DATA { command, param1, param2, target_system: 1, target_component: 1, ..Default::default() };
        self.say(version, &MavMessage::COMMAND_LONG(data)).await;
    }

    /// The next message that `pick` wants, within 20 s.
    async fn hear<T>(&mut self, pick: impl Fn(&MavMessage) -> Option<T>) -> T {
        let listening = async {
            loop {
                let (_, message) = self.reader.read_any_message::<MavMessage>().await.expect("still connected");
                if let Some(found) = pick(&message) {
                    return found;
                }
            }
        };
        tokio::time::timeout(Duration::from_secs(20), listening).await.expect("heard in time")
    }

    async fn hear_heartbeat(&mut self) {
        self.hear(|message| matches!(message, MavMessage::HEARTBEAT(_)).then_some(())).await;
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn clients_do_not_disturb_each_other() {
    let field = Field::new(10.0).await;
    let mut steady = field.client().await;
    steady.hear_heartbeat().await;
    // Garbage, half a frame, and away.
    let mut rude = field.client().await;
    rude.write.write_all(&[0xFD, 33, 0, 0, 5, 255, 190, 76, 0, 0, 1, 2, 3]).await.expect("sent");
    drop(rude);
    // Nothing but garbage, until it is thrown out.
    let mut loud = field.client().await;
    let thrown_out = async {
        let junk = vec![0xA5_u8; 16 * 1024];
        while loud.write.write_all(&junk).await.is_ok() {}
    };
    tokio::time::timeout(Duration::from_secs(20), thrown_out).await.expect("garbage is thrown out");
    // Streams are each client's own.
    let mut asking = field.client().await;
    asking.ask(MavlinkVersion::V2, MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, 30.0, 20_000.0).await;
    asking.hear(|message| matches!(message, MavMessage::ATTITUDE(_)).then_some(())).await;
    for _ in 0..5 {
        let only = steady.hear(|message| match message {
            MavMessage::HEARTBEAT(_) => Some(true),
            MavMessage::ATTITUDE(_) => Some(false),
            _ => None,
        });
        assert!(only.await, "another client's stream came here");
    }
    field.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_that_never_reads_is_dropped_and_the_others_are_not() {
    let field = Field::new(50.0).await;
    let mut stalled = field.client().await;
    for message_id in [24, 27, 29, 30, 31, 32, 33, 35, 36, 74, 147, 164] {
        stalled.ask(MavlinkVersion::V2, MavCmd::MAV_CMD_SET_MESSAGE_INTERVAL, message_id as f32, 5_000.0).await;
    }
    let mut steady = field.client().await;
    // The server says by closing that it has dropped it: then its writes fail, without a read.
    let dropped = async {
        loop {
            steady.hear_heartbeat().await;
            let mut bytes = Vec::new();
            let heartbeat = MavMessage::HEARTBEAT(mav::HEARTBEAT_DATA::default());
            mavlink::write_versioned_msg(&mut bytes, MavlinkVersion::V2, MavHeader::default(), &heartbeat).expect("it encodes");
            if stalled.write.write_all(&bytes).await.is_err() {
                return;
            }
        }
    };
    tokio::time::timeout(Duration::from_secs(60), dropped).await.expect("it is dropped");
    steady.hear_heartbeat().await;
    field.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn who_speaks_mavlink_1_is_answered_in_mavlink_1() {
    let field = Field::new(1.0).await;
    let mut stream = TcpStream::connect(field.address).await.expect("connected");
    let data = mav::COMMAND_LONG_DATA {
        command: MavCmd::MAV_CMD_REQUEST_MESSAGE,
        param1: 1.0,
        target_system: 1,
        target_component: 1,
        ..Default::default()
    };
    let mut bytes = Vec::new();
    let command = MavMessage::COMMAND_LONG(data);
    mavlink::write_versioned_msg(&mut bytes, MavlinkVersion::V1, MavHeader::default(), &command).expect("it encodes");
    stream.write_all(&bytes).await.expect("sent");
    // What was on its way before may be MAVLink 2; the answer (SYS_STATUS, id 1) is a version 1 frame of length 31.
    let answered = async {
        let mut all = Vec::new();
        let mut byte = [0_u8; 512];
        while !all.windows(6).any(|frame: &[u8]| frame[0] == 0xFE && frame[1] == 31 && frame[5] == 1) {
            let count = stream.read(&mut byte).await.expect("still connected");
            assert!(count > 0, "closed");
            all.extend_from_slice(&byte[..count]);
        }
    };
    tokio::time::timeout(Duration::from_secs(20), answered).await.expect("an answer in time");
    field.stop().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_taken_port_is_one_clear_error() {
    let taken = tokio::net::TcpListener::bind("127.0.0.1:0").await.expect("a free port");
    let mut config = one_vehicle();
    config.vehicles[0].mavlink_port = taken.local_addr().expect("an address").port();
    let error = format!("{:#}", bind(&config).await.expect_err("the port is taken"));
    assert!(error.contains("leader-1") && error.contains(&config.vehicles[0].mavlink_port.to_string()), "{error}");
}
