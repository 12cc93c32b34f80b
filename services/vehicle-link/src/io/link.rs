//! A MAVLink connection that comes back: over TCP, UDP or serial, with every wait bounded.
//!
//! Promises: messages arrive in order; when the reader is slow the newest are dropped and counted; what is sent while the link is
//! down is dropped, since a setpoint that waits is worse than none. End of file, an error, a write that blocks, and a silence
//! longer than [`SILENCE`] end the connection; the next try comes after a growing pause. With a key, what is not signed with it is
//! dropped and told. Ground stations ([`super::relay`]) get what the vehicle's side says, byte for byte; what they send goes out
//! after our own, at no more than a share of the link.

use std::collections::BTreeMap;
use std::time::Duration;

use halcyon_chassis::Clock;
use halcyon_model::Stamp;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{MavHeader, MavlinkVersion};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;
use tracing::debug;

use super::relay::{Relay, Stations};
use super::transport::{self, Reader, To, Writer};
use crate::core::budget::Budget;
use crate::core::frame::Frame;
use crate::core::signing::{Signer, Verdict};
use crate::core::station;
use crate::core::unlisted::Unlisted;
use crate::core::version::Version;
use crate::endpoint::Endpoint;

/// A connection that says nothing for so long is given up. A booting autopilot needs a few seconds before its first word.
const SILENCE: Duration = Duration::from_secs(10);
/// Writing may take this long.
const WRITE: Duration = Duration::from_secs(1);
/// Pauses between tries.
const PAUSE_MIN: Duration = Duration::from_millis(200);
const PAUSE_MAX: Duration = Duration::from_secs(5);
/// Messages that wait for the reader: half a second of a busy link.
const INBOX: usize = 256;
const OUTBOX: usize = 64;
/// MAV_COMP_ID_AUTOPILOT1.
const AUTOPILOT_COMPONENT: u8 = 1;
/// Systems on the link whose version of the protocol is remembered.
const SYSTEMS_MAX: usize = 32;
/// Stations get half of a serial port (ten bits a byte), and plenty of a network.
const SERIAL_SHARE: f64 = 0.5 / 10.0;
const NETWORK_RATE_BPS: f64 = 200_000.0;
/// What they may send at once: a few frames.
const BURST_BYTES: f64 = 1024.0;

/// What happens on a link.
#[derive(Debug)]
pub enum LinkEvent {
    /// A connection stands. Whether anyone is at the other end is not known yet.
    Up,
    /// A message with its sender.
    Message(MavHeader, Box<MavMessage>),
    /// A frame that was whole, of a message or a value that we don't know; and what it answers, as far as that can be told.
    Unread(MavHeader, Option<Box<Unlisted>>),
    /// A frame whose signature is not ours; told at most once a second.
    Rejected(Verdict),
    /// A ground station sends this system something that flies it: [`crate::core::station::flies`].
    Station(u8, &'static str),
    /// A ground station asks this system for GUIDED.
    StationGuided(u8),
    /// The connection is gone, and why.
    Down(String),
}

/// What a link is told once.
#[derive(Debug)]
pub struct LinkOptions {
    /// The autopilot's end.
    pub endpoint: Endpoint,
    /// With a key, every frame is signed and checked.
    pub signer: Option<Signer>,
    /// Where ground stations are, or are waited for.
    pub relay: Vec<Endpoint>,
}

/// Our end of a link.
#[derive(Debug)]
pub struct Link {
    events: mpsc::Receiver<LinkEvent>,
    out: mpsc::Sender<(MavHeader, MavMessage)>,
    stations: Stations,
}

impl Link {
    /// Starts the tasks that keep the link connected, and its stations, until `stop`.
    #[must_use]
    pub fn start(options: LinkOptions, clock: Clock, stop: CancellationToken) -> Self {
        let (events_in, events) = mpsc::channel(INBOX);
        let (out, outbox) = mpsc::channel(OUTBOX);
        let LinkOptions { endpoint, signer, relay } = options;
        let (relay, stations) = Relay::start(relay, &clock, &stop);
        tokio::spawn(async move {
            // Ends with `stop`, or when the reader has gone.
            let mut keeper = Keeper {
                endpoint,
                clock,
                events: events_in,
                outbox,
                relay,
                signer,
                sequence: 0,
                systems: BTreeMap::new(),
                told: None,
            };
            tokio::select! {
                () = stop.cancelled() => {}
                () = keeper.keep() => {}
            }
        });
        Self { events, out, stations }
    }

    /// The next event; `None` once the task has ended. Cancel-safe.
    pub async fn recv(&mut self) -> Option<LinkEvent> {
        self.events.recv().await
    }

    /// Sends, or drops and counts if the outbox is full. Never waits.
    pub fn send(&self, header: MavHeader, message: MavMessage) {
        if self.out.try_send((header, message)).is_err() {
            metrics::counter!("vehicle_link_messages_dropped_total", "direction" => "out").increment(1);
        }
    }

    /// What is wrong with a ground station's end, if something is.
    #[must_use]
    pub fn station_trouble(&self) -> Option<String> {
        self.stations.trouble()
    }
}

struct Keeper {
    endpoint: Endpoint,
    clock: Clock,
    events: mpsc::Sender<LinkEvent>,
    outbox: mpsc::Receiver<(MavHeader, MavMessage)>,
    relay: Relay,
    signer: Option<Signer>,
    sequence: u8,
    systems: BTreeMap<u8, Version>,
    /// When a rejected frame was told.
    told: Option<Stamp>,
}

impl Keeper {
    async fn keep(&mut self) {
        let mut pause = PAUSE_MIN;
        while !self.events.is_closed() {
            let why = match transport::open(&self.endpoint, &self.clock).await {
                Ok((mut reader, mut writer)) => {
                    if self.events.send(LinkEvent::Up).await.is_err() {
                        return;
                    }
                    // What waited while the link was down is old.
                    while self.outbox.try_recv().is_ok() {}
                    self.relay.forget_waiting();
                    self.systems.clear();
                    let (heard, why) = self.serve(&mut reader, &mut writer).await;
                    if heard {
                        pause = PAUSE_MIN;
                    }
                    why
                }
                Err(why) => why,
            };
            debug!(endpoint = ?self.endpoint, why, "link down");
            metrics::counter!("vehicle_link_connections_lost_total").increment(1);
            if self.events.send(LinkEvent::Down(why)).await.is_err() {
                return;
            }
            self.clock.sleep(pause).await;
            pause = (pause * 2).min(PAUSE_MAX);
        }
    }

    /// Until the connection ends; whether anything was heard, and why it ended.
    async fn serve(&mut self, reader: &mut Reader, writer: &mut Writer) -> (bool, String) {
        let mut heard = false;
        let mut silent_since = self.clock.now();
        let mut budget = match self.endpoint {
            Endpoint::Serial { baud_bps, .. } => Budget::new(f64::from(baud_bps) * SERIAL_SHARE, BURST_BYTES),
            _ => Budget::new(NETWORK_RATE_BPS, 16.0 * BURST_BYTES),
        };
        loop {
            let now = self.clock.now();
            let quiet_left_s = SILENCE.as_secs_f64() - now.seconds_since(silent_since);
            let wait = Duration::from_secs_f64(quiet_left_s.clamp(0.0, SILENCE.as_secs_f64()));
            let station_wait_s = budget.wait_s(now);
            let sent = tokio::select! {
                biased;
                outgoing = self.outbox.recv() => {
                    let Some((header, message)) = outgoing else { return (heard, "stopped".into()) };
                    self.own_frame(header, &message).map(|frame| (frame, To::System(header.system_id as u8)))
                }
                received = self.clock.timeout(wait, reader.frames()) => {
                    match received {
                        Err(_) => return (heard, format!("silent for {} s", SILENCE.as_secs())),
                        // A datagram that nobody took comes back as an error of the next one; only a stream's error is its end.
                        Ok(Err(_)) if matches!(writer, Writer::Datagrams { .. }) => self.clock.sleep(PAUSE_MIN).await,
                        Ok(Err(error)) => return (heard, error.to_string()),
                        Ok(Ok((frames, from))) => {
                            for frame in frames {
                                if self.incoming(&frame, from, writer) {
                                    heard = true;
                                    silent_since = self.clock.now();
                                }
                            }
                            if self.events.is_closed() {
                                return (heard, "stopped".into());
                            }
                        }
                    }
                    None
                }
                frame = self.relay.next_for_vehicle(), if station_wait_s <= 0.0 => {
                    budget.spend(frame.bytes().len());
                    let message = frame.message();
                    let target = message.as_ref().and_then(mavlink::Message::target_system_id).unwrap_or(0);
                    let flies = message.as_ref().and_then(station::flies).map(|what| LinkEvent::Station(target, what));
                    let guided = message.as_ref().is_some_and(station::sets_guided).then_some(LinkEvent::StationGuided(target));
                    if let Some(event) = flies.or(guided) {
                        // Told before it is sent on, so that no setpoint of ours comes after it. The queue is read all the time.
                        let _ = self.clock.timeout(WRITE, self.events.send(event)).await;
                    }
                    Some((frame, if target == 0 { To::All } else { To::System(target) }))
                }
                () = self.clock.sleep(Duration::from_secs_f64(station_wait_s.clamp(0.0, 1.0))), if station_wait_s > 0.0 => None,
            };
            let Some((frame, to)) = sent else { continue };
            // A write that is given up may have been half done: the connection is then of no use.
            match self.clock.timeout(WRITE, writer.send(frame.bytes(), to)).await {
                Err(_) => return (heard, "the other end does not read".into()),
                Ok(Err(_)) if matches!(writer, Writer::Datagrams { .. }) => {
                    metrics::counter!("vehicle_link_messages_dropped_total", "direction" => "out").increment(1);
                }
                Ok(Err(error)) => return (heard, error.to_string()),
                Ok(Ok(())) => {}
            }
        }
    }

    /// Our message as it goes out: numbered, in the version that the vehicle speaks, signed.
    fn own_frame(&mut self, header: MavHeader, message: &MavMessage) -> Option<Frame> {
        let now = self.clock.now();
        let system = u8::try_from(header.system_id).ok()?;
        let version = match self.systems.get(&system) {
            Some(version) if self.signer.is_none() => version.to_speak(now),
            _ => MavlinkVersion::V2,
        };
        self.relay.set_vehicle(system);
        let header = MavHeader { sequence: self.sequence, ..header };
        let frame = Frame::encode(version, header, message);
        let frame = match (&mut self.signer, frame) {
            (Some(signer), Some(frame)) => signer.sign(&frame, now),
            (_, frame) => frame,
        };
        let Some(frame) = frame else {
            metrics::counter!("vehicle_link_messages_dropped_total", "direction" => "out").increment(1);
            return None;
        };
        self.sequence = self.sequence.wrapping_add(1);
        // Stations may know that a computer flies with the vehicle; what it says to the autopilot is not for them.
        if matches!(message, MavMessage::HEARTBEAT(_)) {
            self.relay.to_stations(&frame);
        }
        Some(frame)
    }

    /// A frame came; whether it is to be believed.
    fn incoming(&mut self, frame: &Frame, from: Option<std::net::SocketAddr>, writer: &mut Writer) -> bool {
        let now = self.clock.now();
        if let Some(signer) = &mut self.signer {
            let verdict = signer.check(frame, now);
            if !verdict.is_good() {
                metrics::counter!("vehicle_link_frames_rejected_total", "reason" => verdict.word()).increment(1);
                if self.told.is_none_or(|told| !(0.0..1.0).contains(&now.seconds_since(told))) {
                    self.told = Some(now);
                    let _ = self.events.try_send(LinkEvent::Rejected(verdict));
                }
                return false;
            }
        }
        let header = frame.header();
        let Ok(system) = u8::try_from(header.system_id) else { return false };
        let message = frame.message();
        if header.component_id == AUTOPILOT_COMPONENT {
            if self.systems.len() < SYSTEMS_MAX || self.systems.contains_key(&system) {
                self.systems.entry(system).or_default().observe(frame.version(), now);
            }
            // The checksum of a message that is not known here is not known, either; our signature is as good.
            let sound = message.is_some() || self.signer.is_some();
            if !writer.learn(system, from, sound, now) {
                metrics::counter!("vehicle_link_frames_rejected_total", "reason" => "another_sender").increment(1);
                return false;
            }
        }
        let event = match message {
            Some(message) => LinkEvent::Message(header, Box::new(message)),
            // Unknown messages and values of newer dialects: the frame was whole, the stream goes on.
            None => {
                metrics::counter!("vehicle_link_messages_unread_total").increment(1);
                LinkEvent::Unread(header, Unlisted::of(frame).map(Box::new))
            }
        };
        self.relay.to_stations(frame);
        if self.events.try_send(event).is_err() {
            metrics::counter!("vehicle_link_messages_dropped_total", "direction" => "in").increment(1);
        }
        true
    }
}
