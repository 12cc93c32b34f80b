//! A scripted autopilot on a socket of its own: streams telemetry, answers commands, remembers every frame it was sent.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::Duration;

use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage, MavResult};
use mavlink::{MavHeader, MavlinkReader};

pub(crate) const SYSTEM: u8 = 42;

#[derive(Default)]
pub(crate) struct Shared {
    /// Every frame that came.
    pub(crate) frames: Mutex<Vec<(MavHeader, MavMessage)>>,
    /// Connections taken.
    pub(crate) connections: Mutex<u32>,
    /// Close the present connection.
    pub(crate) hang_up: AtomicBool,
    /// Send this once.
    pub(crate) garbage: Mutex<Vec<u8>>,
    /// Answer arming with a refusal.
    pub(crate) refuse_arming: AtomicBool,
    /// Don't answer the first try of anything.
    pub(crate) deaf_once: AtomicBool,
    mode: Mutex<u32>,
    stop: AtomicBool,
}

pub(crate) struct Peer {
    pub(crate) shared: Arc<Shared>,
    pub(crate) address: SocketAddr,
}

impl Drop for Peer {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }
}

trait Wire: Read + Write + Send {
    fn twin(&self) -> Box<dyn Wire>;
}

impl Wire for TcpStream {
    fn twin(&self) -> Box<dyn Wire> {
        Box::new(self.try_clone().unwrap())
    }
}

struct Udp(UdpSocket);

impl Read for Udp {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        let (length, from) = self.0.recv_from(buffer)?;
        self.0.connect(from)?;
        Ok(length)
    }
}

impl Write for Udp {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        // Before anyone was heard there is nobody to send to.
        let _ = self.0.send(bytes);
        Ok(bytes.len())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Wire for Udp {
    fn twin(&self) -> Box<dyn Wire> {
        Box::new(Udp(self.0.try_clone().unwrap()))
    }
}

impl Peer {
    pub(crate) fn tcp() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let shared = Arc::new(Shared::default());
        let theirs = shared.clone();
        thread::spawn(move || {
            for stream in listener.incoming() {
                if theirs.stop.load(Ordering::Relaxed) {
                    return;
                }
                let stream = stream.unwrap();
                *theirs.connections.lock().unwrap() += 1;
                serve(&stream, &theirs);
                let _ = stream.shutdown(std::net::Shutdown::Both);
            }
        });
        Self { shared, address }
    }

    pub(crate) fn udp() -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        let address = socket.local_addr().unwrap();
        let shared = Arc::new(Shared::default());
        let theirs = shared.clone();
        thread::spawn(move || serve(&Udp(socket), &theirs));
        Self { shared, address }
    }

    pub(crate) fn set_mode(&self, mode: u32) {
        *self.shared.mode.lock().unwrap() = mode;
    }

    pub(crate) fn sent(&self, wanted: impl Fn(&MavMessage) -> bool) -> usize {
        self.shared.frames.lock().unwrap().iter().filter(|(_, message)| wanted(message)).count()
    }
}

/// Until hung up: one thread reads and answers, this one streams.
fn serve(wire: &dyn Wire, shared: &Arc<Shared>) {
    let (reading, mut writing) = (wire.twin(), wire.twin());
    let answers = Arc::new(Mutex::new(Vec::<MavMessage>::new()));
    let (theirs, out) = (shared.clone(), answers.clone());
    thread::spawn(move || read(reading, &theirs, &out));
    let mut boot_ms = 0;
    while !shared.stop.load(Ordering::Relaxed) && !shared.hang_up.swap(false, Ordering::Relaxed) {
        let mut messages = telemetry(boot_ms, *shared.mode.lock().unwrap());
        messages.append(&mut answers.lock().unwrap());
        let garbage = std::mem::take(&mut *shared.garbage.lock().unwrap());
        if writing.write_all(&garbage).is_err() {
            return;
        }
        for message in messages {
            let mut frame = Vec::new();
            let header = MavHeader { system_id: SYSTEM.into(), component_id: 1, sequence: 0 };
            mavlink::write_v2_msg(&mut frame, header, &message).unwrap();
            if writing.write_all(&frame).is_err() {
                return;
            }
        }
        thread::sleep(Duration::from_millis(50));
        boot_ms += 50;
    }
}

fn read(reading: Box<dyn Wire>, shared: &Shared, out: &Mutex<Vec<MavMessage>>) {
    let mut reader = MavlinkReader::new(reading);
    while let Ok((header, message)) = reader.read_any_message::<MavMessage>() {
        if let MavMessage::COMMAND_LONG(command) = &message
            && !shared.deaf_once.swap(false, Ordering::Relaxed)
        {
            out.lock().unwrap().extend(answer(command, header, shared));
        }
        shared.frames.lock().unwrap().push((header, message));
    }
}

fn answer(command: &ardu::COMMAND_LONG_DATA, from: MavHeader, shared: &Shared) -> Vec<MavMessage> {
    let mut answers = Vec::new();
    let mut result = MavResult::MAV_RESULT_ACCEPTED;
    if command.command == MavCmd::MAV_CMD_COMPONENT_ARM_DISARM && shared.refuse_arming.load(Ordering::Relaxed) {
        result = MavResult::MAV_RESULT_FAILED;
        answers.push(MavMessage::STATUSTEXT(ardu::STATUSTEXT_DATA {
            severity: ardu::MavSeverity::MAV_SEVERITY_CRITICAL,
            text: "PreArm: Compass not calibrated".into(),
            ..Default::default()
        }));
    }
    if command.command == MavCmd::MAV_CMD_DO_SET_MODE {
        *shared.mode.lock().unwrap() = command.param2 as u32;
    }
    answers.insert(
        0,
        MavMessage::COMMAND_ACK(ardu::COMMAND_ACK_DATA {
            command: command.command,
            result,
            target_system: from.system_id as u8,
            target_component: from.component_id,
            ..Default::default()
        }),
    );
    answers
}

fn telemetry(boot_ms: u32, mode: u32) -> Vec<MavMessage> {
    vec![
        MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA {
            custom_mode: mode,
            mavtype: ardu::MavType::MAV_TYPE_QUADROTOR,
            autopilot: ardu::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
            base_mode: ardu::MavModeFlag::MAV_MODE_FLAG_CUSTOM_MODE_ENABLED,
            ..Default::default()
        }),
        MavMessage::GLOBAL_POSITION_INT(ardu::GLOBAL_POSITION_INT_DATA {
            time_boot_ms: boot_ms,
            lat: 531_172_740,
            lon: -29_053_470,
            alt: 12_000,
            relative_alt: 0,
            ..Default::default()
        }),
        MavMessage::ATTITUDE(ardu::ATTITUDE_DATA { time_boot_ms: boot_ms, yaw: 0.5, ..Default::default() }),
        MavMessage::EXTENDED_SYS_STATE(ardu::EXTENDED_SYS_STATE_DATA {
            landed_state: ardu::MavLandedState::MAV_LANDED_STATE_ON_GROUND,
            ..Default::default()
        }),
    ]
}
