//! Bytes to and from one endpoint: frames in, frames out.

use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, SocketAddr};
use std::sync::Arc;
use std::time::Duration;

use halcyon_chassis::Clock;
use halcyon_model::Stamp;
use tokio::io::{AsyncRead, AsyncReadExt as _, AsyncWrite, AsyncWriteExt as _};
use tokio::net::{TcpListener, TcpStream, UdpSocket};
use tokio_serial::SerialPortBuilderExt as _;
use tracing::warn;

use crate::core::frame::{Frame, Framer};
use crate::endpoint::Endpoint;

/// Making a connection may take this long.
pub(super) const CONNECT: Duration = Duration::from_secs(5);
/// The largest datagram, and what is read of a stream at once.
const READ_BYTES: usize = 64 * 1024;
/// A system may speak from another place once it has been silent at its own for so long, seconds: its radio or its router started anew.
const MOVED_S: f64 = 3.0;
/// Vehicles on one UDP socket whose places are remembered.
const PLACES_MAX: usize = 32;

/// Where frames come from.
pub(super) struct Reader {
    source: Source,
    buffer: Vec<u8>,
    unframed_bytes: usize,
    /// That another host speaks.
    told: bool,
}

enum Source {
    Stream(Box<dyn AsyncRead + Send + Unpin>, Framer),
    /// From everybody, or from one host only.
    Datagrams(Arc<UdpSocket>, Option<IpAddr>),
}

/// Where frames go.
pub(super) enum Writer {
    Stream(Box<dyn AsyncWrite + Send + Unpin>),
    Datagrams {
        socket: Arc<UdpSocket>,
        /// The one place that was configured; else whoever was heard.
        fixed: Option<SocketAddr>,
        places: Places,
    },
}

/// Which system was heard from where, and when last: several vehicles may share a socket.
#[derive(Debug, Default)]
pub(super) struct Places {
    by_system: BTreeMap<u8, (SocketAddr, Stamp)>,
    last: Option<SocketAddr>,
}

/// Who is meant by what is sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum To {
    /// One vehicle; before it was heard, whoever was heard last.
    System(u8),
    /// Every vehicle on the link.
    All,
}

impl Places {
    /// A system spoke from there. A frame that can't be believed must not come here: it would draw ours to its sender. Returns whether the place
    /// is the system's: while it is heard from one, whoever speaks in its name from another is not it.
    fn learn(&mut self, system: u8, from: SocketAddr, now: Stamp) -> bool {
        if let Some((place, heard)) = self.by_system.get(&system)
            && *place != from
            && (0.0..MOVED_S).contains(&now.seconds_since(*heard))
        {
            return false;
        }
        self.last = Some(from);
        if self.by_system.len() < PLACES_MAX || self.by_system.contains_key(&system) {
            self.by_system.insert(system, (from, now));
        }
        true
    }

    /// Whether the system speaks from there, as far as is known.
    fn is_from(&self, system: u8, from: SocketAddr) -> bool {
        self.by_system.get(&system).is_some_and(|(place, _)| *place == from)
    }

    fn of(&self, to: To) -> Vec<SocketAddr> {
        match to {
            To::System(system) => self.by_system.get(&system).map(|place| place.0).or(self.last).into_iter().collect(),
            To::All => {
                let mut places: Vec<SocketAddr> = self.by_system.values().map(|place| place.0).collect();
                places.sort_unstable();
                places.dedup();
                places
            }
        }
    }
}

impl Reader {
    fn new(source: Source) -> Self {
        Self { source, buffer: vec![0; READ_BYTES], unframed_bytes: 0, told: false }
    }

    /// The frames of the next bytes, perhaps none, and where they came from if that can vary. Cancel-safe.
    pub(super) async fn frames(&mut self) -> io::Result<(Vec<Frame>, Option<SocketAddr>)> {
        match &mut self.source {
            Source::Stream(stream, framer) => {
                let length = stream.read(&mut self.buffer).await?;
                if length == 0 {
                    return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the other end closed the connection"));
                }
                let frames = framer.stream(self.buffer.get(..length).unwrap_or_default());
                self.unframed_bytes = if frames.is_empty() { self.unframed_bytes.saturating_add(length) } else { 0 };
                Ok((frames, None))
            }
            Source::Datagrams(socket, host) => {
                let (length, from) = socket.recv_from(&mut self.buffer).await?;
                if host.is_some_and(|host| from.ip().to_canonical() != host) {
                    metrics::counter!("vehicle_link_frames_rejected_total", "reason" => "another_sender").increment(1);
                    if !std::mem::replace(&mut self.told, true) {
                        warn!(%from, "not heard: another host than the one that is configured");
                    }
                    return Ok((Vec::new(), Some(from)));
                }
                Ok((Framer::datagram(self.buffer.get(..length).unwrap_or_default()), Some(from)))
            }
        }
    }
}

impl Reader {
    /// What has come of a stream since its last frame.
    pub(super) fn unframed_bytes(&self) -> usize {
        self.unframed_bytes
    }
}

impl Writer {
    /// Sends one frame. Over UDP before anyone was heard there is nobody to send to, which is no error.
    pub(super) async fn send(&mut self, bytes: &[u8], to: To) -> io::Result<()> {
        match self {
            Self::Stream(stream) => {
                stream.write_all(bytes).await?;
                stream.flush().await
            }
            Self::Datagrams { socket, fixed: Some(place), .. } => socket.send_to(bytes, *place).await.map(|_| ()),
            Self::Datagrams { socket, fixed: None, places } => {
                for place in places.of(to) {
                    socket.send_to(bytes, place).await?;
                }
                Ok(())
            }
        }
    }

    /// A frame of `system` came from there; whether it speaks from there. Only one that is `sound`, with a checksum that was right, teaches its
    /// place.
    pub(super) fn learn(&mut self, system: u8, from: Option<SocketAddr>, sound: bool, now: Stamp) -> bool {
        match (self, from) {
            (Self::Datagrams { places, .. }, Some(from)) if sound => places.learn(system, from, now),
            (Self::Datagrams { places, .. }, Some(from)) => places.is_from(system, from),
            _ => true,
        }
    }
}

/// Both directions of a stream.
fn stream<S: AsyncRead + AsyncWrite + Send + Unpin + 'static>(stream: S) -> (Reader, Writer) {
    let (read, write) = tokio::io::split(stream);
    (Reader::new(Source::Stream(Box::new(read), Framer::default())), Writer::Stream(Box::new(write)))
}

/// Both directions of a TCP connection.
pub(super) fn tcp(connection: TcpStream) -> io::Result<(Reader, Writer)> {
    connection.set_nodelay(true)?;
    Ok(stream(connection))
}

fn datagrams(socket: UdpSocket, fixed: Option<SocketAddr>) -> (Reader, Writer) {
    let socket = Arc::new(socket);
    let reader = Reader::new(Source::Datagrams(socket.clone(), fixed.and_then(host)));
    (reader, Writer::Datagrams { socket, fixed, places: Places::default() })
}

/// Who answers from there: one host, from whatever port; `None` if it may be several.
fn host(place: SocketAddr) -> Option<IpAddr> {
    let ip = place.ip().to_canonical();
    // A network's mask is not known here: 255 at the end may be everybody in it.
    let is_many = ip.is_multicast() || matches!(ip, IpAddr::V4(ip) if ip.octets()[3] == 255);
    (!is_many && !ip.is_unspecified()).then_some(ip)
}

/// Opens an endpoint. A listener waits for its caller as long as that takes; the others must succeed soon.
pub(super) async fn open(endpoint: &Endpoint, clock: &Clock) -> Result<(Reader, Writer), String> {
    match endpoint {
        Endpoint::TcpOut(place) => {
            let connecting = TcpStream::connect(resolve(place, clock).await?);
            let connected = clock.timeout(CONNECT, connecting).await.map_err(|_| "no connection in 5 s".to_owned())?;
            connected.and_then(tcp).map_err(|error| format!("{place}: {error}"))
        }
        Endpoint::TcpIn(place) => {
            let listener =
                TcpListener::bind(resolve(place, clock).await?).await.map_err(|error| format!("{place}: {error}"))?;
            let (connection, _) = listener.accept().await.map_err(|error| format!("{place}: {error}"))?;
            tcp(connection).map_err(|error| format!("{place}: {error}"))
        }
        Endpoint::UdpOut(place) => {
            let place = resolve(place, clock).await?;
            Ok(datagrams(any_port(place).await.map_err(|error| format!("{place}: {error}"))?, Some(place)))
        }
        Endpoint::UdpIn(place) => {
            let socket = UdpSocket::bind(resolve(place, clock).await?).await.map_err(|error| format!("{place}: {error}"))?;
            Ok(datagrams(socket, None))
        }
        Endpoint::Serial { device, baud_bps } => {
            let port =
                tokio_serial::new(device, *baud_bps).open_native_async().map_err(|error| format!("{device}: {error}"))?;
            Ok(stream(port))
        }
    }
}

/// A socket from which `place` can be reached.
pub(super) async fn any_port(place: SocketAddr) -> io::Result<UdpSocket> {
    UdpSocket::bind(if place.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" }).await
}

/// A name's address, without holding up the thread.
pub(super) async fn resolve(place: &str, clock: &Clock) -> Result<SocketAddr, String> {
    let lookup = clock.timeout(CONNECT, tokio::net::lookup_host(place)).await;
    let mut addresses =
        lookup.map_err(|_| format!("{place}: no answer to its name"))?.map_err(|error| format!("{place}: {error}"))?;
    addresses.next().ok_or_else(|| format!("{place} has no address"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_host_answers_or_any_of_a_network() {
        let host = |place: &str| host(place.parse().unwrap()).map(|ip| ip.to_string());
        assert_eq!(host("10.0.0.7:14550").as_deref(), Some("10.0.0.7"));
        assert_eq!(host("[::ffff:10.0.0.7]:14550").as_deref(), Some("10.0.0.7"));
        for many in ["10.0.0.255:14550", "255.255.255.255:14550", "239.1.2.3:14550", "[ff02::1]:14550", "0.0.0.0:14550"] {
            assert_eq!(host(many), None, "{many}");
        }
    }

    /// A stranger speaks to the socket from which one autopilot is flown: what it says is not heard.
    #[tokio::test]
    async fn a_stranger_is_not_heard_where_the_place_is_fixed() {
        let vehicle = UdpSocket::bind("127.0.0.1:0").await.unwrap();
        let stranger = UdpSocket::bind("127.0.0.2:0").await.unwrap();
        let place = vehicle.local_addr().unwrap();
        let (mut reader, mut writer) = datagrams(any_port(place).await.unwrap(), Some(place));
        writer.send(b"hello", To::All).await.unwrap();
        let mut buffer = [0; 16];
        let (_, ours) = vehicle.recv_from(&mut buffer).await.unwrap();
        let heartbeat = mavlink::dialects::ardupilotmega::HEARTBEAT_DATA::default();
        let message = mavlink::dialects::ardupilotmega::MavMessage::HEARTBEAT(heartbeat);
        let frame = Frame::encode(mavlink::MavlinkVersion::V2, mavlink::MavHeader::default(), &message).unwrap();
        stranger.send_to(frame.bytes(), ours).await.unwrap();
        vehicle.send_to(frame.bytes(), ours).await.unwrap();
        assert!(reader.frames().await.unwrap().0.is_empty());
        assert_eq!(reader.frames().await.unwrap().0.len(), 1);
    }

    #[test]
    fn each_vehicle_on_a_socket_is_answered_where_it_spoke() {
        let place = |port| SocketAddr::from(([127, 0, 0, 1], port));
        let mut places = Places::default();
        assert!(places.of(To::System(7)).is_empty());
        let t = |s: f64| Stamp::from_secs_f64(1000.0).plus_secs_f64(s);
        assert!(places.learn(7, place(1007), t(0.0)) && places.learn(8, place(1008), t(0.0)));
        assert_eq!(places.of(To::System(7)), [place(1007)]);
        assert_eq!(places.of(To::System(9)), [place(1008)], "not heard: whoever spoke last");
        assert_eq!(places.of(To::All), [place(1007), place(1008)]);
        // In its name from elsewhere, while it speaks itself; once it is silent it may have moved.
        assert!(!places.learn(7, place(6666), t(2.9)));
        assert_eq!(places.of(To::System(7)), [place(1007)]);
        assert!(places.learn(7, place(6666), t(3.1)));
        assert_eq!(places.of(To::System(7)), [place(6666)]);
        assert!(places.is_from(7, place(6666)) && !places.is_from(7, place(1007)) && !places.is_from(9, place(6666)));
        for system in 0..=255 {
            places.learn(system, place(2000), t(10.0));
        }
        assert!(places.by_system.len() <= PLACES_MAX);
    }
}
