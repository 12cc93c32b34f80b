//! Ground stations on the vehicle's link: QGroundControl, MAVProxy and Mission Planner see the vehicle, and can fly it.
//!
//! Promises: every believed frame of the vehicle's side goes to every station byte for byte, whatever message it is; so does our own
//! heartbeat, and nothing else of ours. A station's frame goes to the vehicle as it is, and to the other stations if it is for
//! everybody, as mavlink-router does. A frame that claims to come from system 0, from us or from the vehicle's autopilot is dropped.
//! A station that is slow loses its oldest frames (counted), one that doesn't read at all is dropped; the vehicle, and the other
//! stations, never wait. A station that comes and goes is no error.
//!
//! What a station commands is a person's act: guidance sees the change of mode and lets go.

use std::collections::BTreeMap;
use std::io;
use std::net::SocketAddr;
use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use halcyon_chassis::Clock;
use halcyon_model::Stamp;
use mavlink::Message as _;
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, broadcast, mpsc};
use tokio_util::sync::CancellationToken;
use tracing::{debug, info, warn};

use super::transport::{self, Reader, To, Writer};
use crate::autopilot::OWN_COMPONENT;
use crate::core::frame::{Frame, Framer};
use crate::endpoint::Endpoint;

/// Frames that wait for a station: two seconds of a busy link.
const TO_STATION: usize = 256;
/// Frames of all stations that wait for the vehicle.
const TO_VEHICLE: usize = 64;
/// Stations on one listening endpoint.
const CLIENTS_MAX: usize = 8;
/// A station that sends datagrams is forgotten after so much silence, seconds.
const SILENT_S: f64 = 60.0;
/// A station that doesn't take a frame for so long is dropped.
const WRITE: Duration = Duration::from_secs(10);
/// This much without one frame is no MAVLink station.
const GARBAGE_BYTES_MAX: usize = 64 * 1024;
/// Before the next try of an endpoint that failed.
const PAUSE: Duration = Duration::from_secs(2);

/// A frame and which station it came from; 0 is the vehicle's side.
#[derive(Debug, Clone)]
struct Sent {
    from: u64,
    frame: Frame,
}

/// The link's end of the relay.
pub(super) struct Relay {
    hub: Option<Hub>,
    from_stations: mpsc::Receiver<Frame>,
}

/// What is wrong with which endpoint.
#[derive(Debug, Clone, Default)]
pub(super) struct Stations(Arc<Mutex<BTreeMap<String, String>>>);

impl Stations {
    pub(super) fn trouble(&self) -> Option<String> {
        let troubles = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        troubles.iter().next().map(|(place, why)| format!("relay {place}: {why}"))
    }

    fn set(&self, place: &str, why: Option<String>) {
        let mut troubles = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        match why {
            Some(why) => _ = troubles.insert(place.to_owned(), why),
            None => _ = troubles.remove(place),
        }
    }
}

/// What stations share.
#[derive(Clone)]
struct Hub {
    stations: broadcast::Sender<Sent>,
    vehicle: mpsc::Sender<Frame>,
    /// The vehicle's system id, once known.
    system: Arc<AtomicU8>,
    next_id: Arc<AtomicU64>,
    troubles: Stations,
    clock: Clock,
}

impl Relay {
    /// Starts a task for each endpoint.
    pub(super) fn start(endpoints: Vec<Endpoint>, clock: &Clock, stop: &CancellationToken) -> (Self, Stations) {
        let (vehicle, from_stations) = mpsc::channel(TO_VEHICLE);
        let troubles = Stations::default();
        if endpoints.is_empty() {
            return (Self { hub: None, from_stations }, troubles);
        }
        let hub = Hub {
            stations: broadcast::Sender::new(TO_STATION),
            vehicle,
            system: Arc::default(),
            next_id: Arc::new(AtomicU64::new(1)),
            troubles: troubles.clone(),
            clock: clock.clone(),
        };
        for endpoint in endpoints {
            let (hub, stop) = (hub.clone(), stop.clone());
            tokio::spawn(async move {
                tokio::select! {
                    () = stop.cancelled() => {}
                    () = hub.keep(&endpoint, &stop) => {}
                }
            });
        }
        (Self { hub: Some(hub), from_stations }, troubles)
    }

    /// A frame for every station.
    pub(super) fn to_stations(&self, frame: &Frame) {
        if let Some(hub) = &self.hub {
            // Without a station there is nobody to take it.
            let _ = hub.stations.send(Sent { from: 0, frame: frame.clone() });
        }
    }

    /// The next frame for the vehicle. Cancel-safe.
    pub(super) async fn next_for_vehicle(&mut self) -> Frame {
        match self.from_stations.recv().await {
            Some(frame) => frame,
            None => std::future::pending().await,
        }
    }

    /// What waited while the link was down is old.
    pub(super) fn forget_waiting(&mut self) {
        while self.from_stations.try_recv().is_ok() {}
    }

    /// Who flies here.
    pub(super) fn set_vehicle(&self, system: u8) {
        if let Some(hub) = &self.hub {
            hub.system.store(system, Ordering::Relaxed);
        }
    }
}

impl Hub {
    fn id(&self) -> u64 {
        self.next_id.fetch_add(1, Ordering::Relaxed)
    }

    /// A station said this.
    fn heard(&self, from: u64, frame: Frame) {
        let header = frame.header();
        let ours = header.system_id == u32::from(self.system.load(Ordering::Relaxed));
        if header.system_id == 0 || (ours && matches!(header.component_id, 1 | OWN_COMPONENT)) {
            metrics::counter!("vehicle_link_relay_dropped_total", "reason" => "sender").increment(1);
            return;
        }
        let target = frame.message().and_then(|message| message.target_system_id()).unwrap_or(0);
        if target == 0 {
            let _ = self.stations.send(Sent { from, frame: frame.clone() });
        }
        if self.vehicle.try_send(frame).is_err() {
            metrics::counter!("vehicle_link_relay_dropped_total", "reason" => "vehicle_busy").increment(1);
        }
    }

    /// Keeps one endpoint going for good.
    async fn keep(&self, endpoint: &Endpoint, stop: &CancellationToken) {
        let name = format!("{endpoint:?}");
        loop {
            let ended = match endpoint {
                Endpoint::TcpIn(place) => self.tcp_in(place, &name, stop).await,
                Endpoint::UdpIn(place) => self.udp_in(place, &name).await,
                Endpoint::UdpOut(place) => self.udp_out(place, &name).await,
                Endpoint::TcpOut(_) => self.tcp_out(endpoint).await,
                Endpoint::Serial { .. } => Err("a relay is no serial port".into()),
            };
            if let Err(why) = ended {
                let is_caller = matches!(endpoint, Endpoint::TcpOut(_));
                // Who is called may well be away; who can't listen is set up wrongly.
                if !is_caller && self.troubles.trouble().is_none() {
                    warn!(endpoint = name, why, "no ground station can be served");
                }
                self.troubles.set(&name, (!is_caller).then_some(why));
            }
            self.clock.sleep(PAUSE).await;
        }
    }

    async fn tcp_in(&self, place: &str, name: &str, stop: &CancellationToken) -> Result<(), String> {
        let listener = TcpListener::bind(transport::resolve(place, &self.clock).await?).await.map_err(|e| e.to_string())?;
        self.troubles.set(name, None);
        let seats = Arc::new(Semaphore::new(CLIENTS_MAX));
        loop {
            let (connection, from) = listener.accept().await.map_err(|error| error.to_string())?;
            let Ok(seat) = seats.clone().try_acquire_owned() else {
                warn!(%from, "a ground station was turned away: {CLIENTS_MAX} are connected");
                continue;
            };
            let (hub, stop) = (self.clone(), stop.clone());
            tokio::spawn(async move {
                tokio::select! {
                    () = stop.cancelled() => {}
                    () = hub.tcp_station(connection, from, seat) => {}
                }
            });
        }
    }

    async fn tcp_out(&self, endpoint: &Endpoint) -> Result<(), String> {
        let (reader, writer) = transport::open(endpoint, &self.clock).await?;
        let why = self.station(reader, writer).await;
        debug!(?endpoint, why, "ground station gone");
        Ok(())
    }

    async fn tcp_station(&self, connection: TcpStream, from: SocketAddr, _seat: OwnedSemaphorePermit) {
        info!(%from, "ground station connected");
        let why = match transport::tcp(connection) {
            Ok((reader, writer)) => self.station(reader, writer).await,
            Err(error) => error.to_string(),
        };
        info!(%from, why, "ground station gone");
    }

    /// One station on a stream, until it goes; returns why.
    async fn station(&self, mut reader: Reader, mut writer: Writer) -> String {
        let id = self.id();
        let mut from_hub = self.stations.subscribe();
        let reading = async {
            loop {
                match reader.frames().await {
                    Ok((frames, _)) => frames.into_iter().for_each(|frame| self.heard(id, frame)),
                    Err(error) => return error.to_string(),
                }
                if reader.unframed_bytes() > GARBAGE_BYTES_MAX {
                    return "what it sends is not MAVLink".to_owned();
                }
            }
        };
        let writing = async {
            loop {
                let Some(frame) = next(&mut from_hub, id).await else { return "stopped".to_owned() };
                match self.clock.timeout(WRITE, writer.send(frame.bytes(), To::All)).await {
                    Ok(Ok(())) => {}
                    Ok(Err(error)) => return error.to_string(),
                    Err(_) => return "it does not read".to_owned(),
                }
            }
        };
        tokio::select! {
            why = reading => why,
            why = writing => why,
        }
    }

    async fn udp_in(&self, place: &str, name: &str) -> Result<(), String> {
        let place = transport::resolve(place, &self.clock).await?;
        let socket = UdpSocket::bind(place).await.map_err(|error| error.to_string())?;
        self.troubles.set(name, None);
        self.udp_stations(&socket, None).await.map_err(|error| error.to_string())
    }

    async fn udp_out(&self, place: &str, name: &str) -> Result<(), String> {
        let place = transport::resolve(place, &self.clock).await?;
        let socket = transport::any_port(place).await.map_err(|error| error.to_string())?;
        self.troubles.set(name, None);
        self.udp_stations(&socket, Some(place)).await.map_err(|error| error.to_string())
    }

    /// The stations on one socket: a fixed one, or those that speak up.
    async fn udp_stations(&self, socket: &UdpSocket, fixed: Option<SocketAddr>) -> io::Result<()> {
        let mut from_hub = self.stations.subscribe();
        let mut clients = Clients { fixed: fixed.map(|place| (place, self.id())), ..Clients::default() };
        let mut buffer = vec![0; 64 * 1024];
        loop {
            tokio::select! {
                received = socket.recv_from(&mut buffer) => {
                    // An error here is the network's word that nobody listens at some place: it is sent to nevertheless.
                    let Ok((length, from)) = received else {
                        self.clock.sleep(Duration::from_millis(100)).await;
                        continue;
                    };
                    let frames = Framer::datagram(buffer.get(..length).unwrap_or_default());
                    let id = if frames.is_empty() { None } else { clients.id(from, self.clock.now(), || self.id()) };
                    match id {
                        Some(id) => frames.into_iter().for_each(|frame| self.heard(id, frame)),
                        None => metrics::counter!("vehicle_link_relay_dropped_total", "reason" => "stranger").increment(1),
                    }
                }
                received = from_hub.recv() => {
                    let Some(Sent { from, frame }) = passed(received)? else { continue };
                    for place in clients.except(from, self.clock.now()) {
                        if socket.send_to(frame.bytes(), place).await.is_err() {
                            metrics::counter!("vehicle_link_relay_dropped_total", "reason" => "network").increment(1);
                        }
                    }
                }
            }
        }
    }
}

/// Who speaks on a UDP socket.
#[derive(Debug, Default)]
struct Clients {
    fixed: Option<(SocketAddr, u64)>,
    heard: BTreeMap<SocketAddr, (u64, Stamp)>,
}

impl Clients {
    /// The number of whoever speaks from there; `None` for a stranger that has no place here.
    fn id(&mut self, from: SocketAddr, now: Stamp, new: impl FnOnce() -> u64) -> Option<u64> {
        if let Some((place, id)) = self.fixed {
            return (place == from).then_some(id);
        }
        self.forget_silent(now);
        if self.heard.len() >= CLIENTS_MAX && !self.heard.contains_key(&from) {
            return None;
        }
        let client = self.heard.entry(from).or_insert_with(|| {
            info!(%from, "ground station heard");
            (new(), now)
        });
        client.1 = now;
        Some(client.0)
    }

    fn except(&mut self, sender: u64, now: Stamp) -> Vec<SocketAddr> {
        self.forget_silent(now);
        let heard = self.heard.iter().map(|(place, (id, _))| (*place, *id));
        self.fixed.into_iter().chain(heard).filter(|(_, id)| *id != sender).map(|(place, _)| place).collect()
    }

    fn forget_silent(&mut self, now: Stamp) {
        self.heard.retain(|_, (_, heard)| now.seconds_since(*heard) <= SILENT_S);
    }
}

/// The next frame that is not this station's own; `None` when the hub is gone.
async fn next(from_hub: &mut broadcast::Receiver<Sent>, id: u64) -> Option<Frame> {
    loop {
        match passed(from_hub.recv().await) {
            Ok(Some(Sent { from, frame })) if from != id => return Some(frame),
            Ok(_) => {}
            Err(_) => return None,
        }
    }
}

/// Counts what a slow station missed.
fn passed(received: Result<Sent, broadcast::error::RecvError>) -> io::Result<Option<Sent>> {
    match received {
        Ok(sent) => Ok(Some(sent)),
        Err(broadcast::error::RecvError::Lagged(missed)) => {
            metrics::counter!("vehicle_link_relay_dropped_total", "reason" => "slow_station").increment(missed);
            Ok(None)
        }
        Err(broadcast::error::RecvError::Closed) => Err(io::Error::other("stopped")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stations_that_fall_silent_make_room_for_others() {
        let place = |port| SocketAddr::from(([127, 0, 0, 1], port));
        let t = |s: f64| Stamp::from_secs_f64(1000.0 + s);
        let mut clients = Clients::default();
        for port in 0..20 {
            let taken = clients.id(place(1000 + port), t(f64::from(port)), || u64::from(port) + 1);
            assert_eq!(taken.is_some(), usize::from(port) < CLIENTS_MAX);
        }
        assert_eq!(clients.id(place(1000), t(30.0), || 99), Some(1), "known");
        assert_eq!(clients.except(1, t(30.0)).len(), CLIENTS_MAX - 1);
        assert_eq!(clients.except(0, t(80.0)), [place(1000)]);
        assert_eq!(clients.id(place(5000), t(80.0), || 99), Some(99));
        let mut fixed = Clients { fixed: Some((place(1), 5)), ..Clients::default() };
        assert_eq!((fixed.id(place(1), t(0.0), || 6), fixed.id(place(2), t(0.0), || 6)), (Some(5), None));
        assert_eq!(fixed.except(0, t(1e6)), [place(1)]);
    }
}
