//! A scripted autopilot on a socket of its own: streams telemetry, answers commands, remembers every frame it was sent.

use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU8, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use mavlink::dialects::ardupilotmega as ardu;
use mavlink::dialects::ardupilotmega::{MavCmd, MavMessage, MavResult};
use mavlink::{MavHeader, MavlinkReader, Message as _, SigningConfig, SigningData};

pub(crate) const SYSTEM: u8 = 42;

pub(crate) struct Shared {
    /// MAVLink system id.
    pub(crate) system: AtomicU8,
    /// Signs with this key, and reads only what is signed with it.
    pub(crate) key: Mutex<Option<[u8; 32]>>,
    /// Speaks and understands nothing but MAVLink 1.
    pub(crate) is_old: AtomicBool,
    /// Of so many frames one is numbered and not sent; 0 sends all.
    pub(crate) lose_one_of: AtomicU32,
    /// What it says it is.
    pub(crate) firmware: Mutex<(ardu::MavAutopilot, ardu::MavType)>,
    /// The bytes of every frame that it sent.
    pub(crate) said: Mutex<Vec<Vec<u8>>>,
    booted: Instant,
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
    /// Don't hear the first try to set a mode.
    pub(crate) deaf_once: AtomicBool,
    mode: Mutex<u32>,
    stop: AtomicBool,
}

impl Default for Shared {
    fn default() -> Self {
        let firmware = (ardu::MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA, ardu::MavType::MAV_TYPE_QUADROTOR);
        Self {
            system: AtomicU8::new(SYSTEM),
            key: Mutex::default(),
            is_old: AtomicBool::default(),
            lose_one_of: AtomicU32::default(),
            firmware: Mutex::new(firmware),
            said: Mutex::default(),
            booted: Instant::now(),
            frames: Mutex::default(),
            connections: Mutex::default(),
            hang_up: AtomicBool::default(),
            garbage: Mutex::default(),
            refuse_arming: AtomicBool::default(),
            deaf_once: AtomicBool::default(),
            mode: Mutex::default(),
            stop: AtomicBool::default(),
        }
    }
}

impl Shared {
    fn boot_ms(&self) -> u32 {
        u32::try_from(self.booted.elapsed().as_millis()).unwrap()
    }
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
        loop {
            match self.0.recv_from(buffer) {
                Ok((length, from)) => {
                    self.0.connect(from)?;
                    return Ok(length);
                }
                // Nobody listened yet when it spoke: that is told here.
                Err(error) if error.kind() == std::io::ErrorKind::ConnectionRefused => {}
                Err(error) => return Err(error),
            }
        }
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

    /// One that speaks first, from a port of its own, to a waiting link.
    pub(crate) fn udp_to(place: SocketAddr, system: u8) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.connect(place).unwrap();
        let address = socket.local_addr().unwrap();
        let shared = Arc::new(Shared { system: AtomicU8::new(system), ..Shared::default() });
        let theirs = shared.clone();
        thread::spawn(move || serve(&Udp(socket), &theirs));
        Self { shared, address }
    }

    pub(crate) fn mode(&self) -> u32 {
        *self.shared.mode.lock().unwrap()
    }

    pub(crate) fn set_mode(&self, mode: u32) {
        *self.shared.mode.lock().unwrap() = mode;
    }

    pub(crate) fn sent(&self, wanted: impl Fn(&MavMessage) -> bool) -> usize {
        self.shared.frames.lock().unwrap().iter().filter(|(_, message)| wanted(message)).count()
    }
}

fn signing(key: [u8; 32]) -> SigningData {
    SigningData::from_config(SigningConfig::new(key, 1, true, false))
}

/// Until hung up: one thread reads and answers, this one streams.
fn serve(wire: &dyn Wire, shared: &Arc<Shared>) {
    let (reading, mut writing) = (wire.twin(), wire.twin());
    let answers = Arc::new(Mutex::new(Vec::<MavMessage>::new()));
    let (theirs, out) = (shared.clone(), answers.clone());
    thread::spawn(move || read(reading, &theirs, &out));
    let key = shared.key.lock().unwrap().map(signing);
    let mut sequence = 0_u8;
    let mut count = 0_u32;
    while !shared.stop.load(Ordering::Relaxed) && !shared.hang_up.swap(false, Ordering::Relaxed) {
        let mut messages = telemetry(shared);
        messages.append(&mut answers.lock().unwrap());
        let garbage = std::mem::take(&mut *shared.garbage.lock().unwrap());
        if writing.write_all(&garbage).is_err() {
            return;
        }
        for message in messages {
            let mut frame = Vec::new();
            let system_id = shared.system.load(Ordering::Relaxed).into();
            let header = MavHeader { system_id, component_id: 1, sequence };
            sequence = sequence.wrapping_add(1);
            count += 1;
            let lose = shared.lose_one_of.load(Ordering::Relaxed);
            if count.is_multiple_of(lose) {
                continue;
            }
            if shared.is_old.load(Ordering::Relaxed) {
                mavlink::write_v1_msg(&mut frame, header, &message).unwrap();
            } else {
                mavlink::write_v2_msg_signed(&mut frame, header, &message, key.as_ref()).unwrap();
            }
            if writing.write_all(&frame).is_err() {
                return;
            }
            shared.said.lock().unwrap().push(frame);
        }
        // An answer is sent at once.
        for _ in 0..25 {
            thread::sleep(Duration::from_millis(2));
            if !answers.lock().unwrap().is_empty() {
                break;
            }
        }
    }
}

fn read(reading: Box<dyn Wire>, shared: &Shared, out: &Mutex<Vec<MavMessage>>) {
    let mut reader = MavlinkReader::new(reading);
    let key = shared.key.lock().unwrap().map(signing);
    loop {
        let read = if shared.is_old.load(Ordering::Relaxed) {
            reader.read_message::<MavMessage>(mavlink::MavlinkVersion::V1)
        } else {
            reader.read_any_message_signed::<MavMessage>(key.as_ref())
        };
        let (header, message) = match read {
            Ok(read) => read,
            Err(mavlink::error::MessageReadError::Parse(_)) => continue,
            Err(_) => return,
        };
        // ArduPilot takes what is for it or for everybody.
        let own = shared.system.load(Ordering::Relaxed);
        let is_for_it = message.target_system_id().is_none_or(|target| target == 0 || target == own);
        match &message {
            MavMessage::COMMAND_LONG(command)
                if command.command == MavCmd::MAV_CMD_DO_SET_MODE && shared.deaf_once.swap(false, Ordering::Relaxed) => {}
            MavMessage::COMMAND_LONG(command) if is_for_it => {
                out.lock().unwrap().extend(answer(command, header, shared));
            }
            MavMessage::TIMESYNC(question) if is_for_it && question.tc1 == 0 => {
                let tc1 = i64::try_from(shared.booted.elapsed().as_nanos()).unwrap();
                out.lock().unwrap().push(MavMessage::TIMESYNC(ardu::TIMESYNC_DATA { tc1, ..question.clone() }));
            }
            _ => {}
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
        let is_px4 = shared.firmware.lock().unwrap().0 == ardu::MavAutopilot::MAV_AUTOPILOT_PX4;
        let (main, sub) = (command.param2 as u32, command.param3 as u32);
        *shared.mode.lock().unwrap() = if is_px4 { main << 16 | sub << 24 } else { main };
    }
    if command.command == MavCmd::MAV_CMD_REQUEST_MESSAGE && command.param1 == 148.0 {
        let version = ardu::AUTOPILOT_VERSION_DATA { flight_sw_version: 0x0406_00FF, ..Default::default() };
        answers.push(MavMessage::AUTOPILOT_VERSION(version));
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

fn telemetry(shared: &Shared) -> Vec<MavMessage> {
    let (boot_ms, mode) = (shared.boot_ms(), *shared.mode.lock().unwrap());
    let (autopilot, mavtype) = *shared.firmware.lock().unwrap();
    vec![
        MavMessage::HEARTBEAT(ardu::HEARTBEAT_DATA {
            custom_mode: mode,
            mavtype,
            autopilot,
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

/// A port that nobody holds just now.
pub(crate) fn free_udp_port() -> u16 {
    UdpSocket::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port()
}
