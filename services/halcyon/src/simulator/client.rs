//! One client's connection: bounded queues between its socket and the vehicle.

use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
use std::task::{Context, Poll};

use halcyon_model::Bytes;
use halcyon_sim::autopilot::{LinkId, Outbound};
use halcyon_sim::vehicle::Vehicle;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::{AsyncMavlinkReader, MAVLinkMessageRaw, MavlinkReader, MavlinkVersion};
use tokio::io::{AsyncRead, AsyncWriteExt, ReadBuf};
use tokio::net::{TcpStream, UdpSocket};
use tokio::sync::mpsc;
use tokio_util::sync::{CancellationToken, DropGuard};

/// Messages from a client that wait for the vehicle; then TCP makes the client wait.
const INBOUND_MAX: usize = 64;
/// Batches to a client that wait for its socket; then the client is dropped.
const OUTBOUND_MAX: usize = 512;
/// This much without one MAVLink frame is not a MAVLink client.
const GARBAGE_MAX_BYTES: usize = 64 * 1024;
/// What is sent at once, over TCP and in one datagram.
const TCP_BATCH_BYTES: usize = 16 * 1024;
const UDP_BATCH_BYTES: usize = 1200;

/// The vehicle's end of a connection. Dropping it closes the connection.
pub(super) struct Client {
    pub(super) link: LinkId,
    inbound: mpsc::Receiver<MAVLinkMessageRaw>,
    outbound: mpsc::Sender<Bytes>,
    spoken: Arc<AtomicU8>,
    sequence: u8,
    batch: Vec<u8>,
    batch_max: usize,
    /// A datagram that is lost is lost; a stream that stalls is dropped.
    lossy: bool,
    _close: DropGuard,
}

/// Why a client is dropped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub(super) enum Gone {
    #[error("it closed the connection")]
    Closed,
    #[error("it does not read what it is sent")]
    Stalled,
}

impl Client {
    fn new(link: LinkId, batch_max: usize, lossy: bool) -> (Self, Ends) {
        let (inbound_sender, inbound) = mpsc::channel(INBOUND_MAX);
        let (outbound, outbound_receiver) = mpsc::channel(OUTBOUND_MAX);
        let close = CancellationToken::new();
        let spoken = Arc::new(AtomicU8::new(0));
        let ends =
            Ends { inbound: inbound_sender, outbound: outbound_receiver, close: close.clone(), spoken: Arc::clone(&spoken) };
        let batch = Vec::with_capacity(batch_max + 512);
        let _close = close.drop_guard();
        (Self { link, inbound, outbound, spoken, sequence: 0, batch, batch_max, lossy, _close }, ends)
    }

    /// A client on a TCP connection.
    pub(super) fn tcp(link: LinkId, stream: TcpStream) -> Self {
        let (client, ends) = Self::new(link, TCP_BATCH_BYTES, false);
        tokio::spawn(ends.serve_tcp(stream));
        client
    }

    /// The address that a connected UDP socket speaks to.
    pub(super) fn udp(link: LinkId, socket: UdpSocket) -> Self {
        let (client, ends) = Self::new(link, UDP_BATCH_BYTES, true);
        tokio::spawn(ends.serve_udp(socket));
        client
    }

    /// Up to a queueful of what it said; `None` once it is gone.
    pub(super) fn heard(&mut self, mut each: impl FnMut(&MAVLinkMessageRaw)) -> Result<(), Gone> {
        for _ in 0..INBOUND_MAX {
            match self.inbound.try_recv() {
                Ok(frame) => each(&frame),
                Err(mpsc::error::TryRecvError::Empty) => break,
                Err(mpsc::error::TryRecvError::Disconnected) => return Err(Gone::Closed),
            }
        }
        Ok(())
    }

    /// Adds a message of the vehicle's to the batch.
    pub(super) fn say(&mut self, vehicle: &mut Vehicle, outbound: &Outbound) -> Result<(), Gone> {
        // As ArduPilot: MAVLink 2, unless all that was heard is MAVLink 1.
        let version = if self.spoken.load(Ordering::Relaxed) == 1 { MavlinkVersion::V1 } else { MavlinkVersion::V2 };
        vehicle.encode(self.link, outbound, version, self.sequence, &mut self.batch);
        self.sequence = self.sequence.wrapping_add(1);
        // A frame is at most 280 bytes: the next might not fit.
        if self.batch.len() + 280 > self.batch_max { self.flush() } else { Ok(()) }
    }

    /// Sends the batch.
    pub(super) fn flush(&mut self) -> Result<(), Gone> {
        if self.batch.is_empty() {
            return Ok(());
        }
        let batch = Bytes::copy_from_slice(&self.batch);
        self.batch.clear();
        match self.outbound.try_send(batch) {
            Ok(()) => Ok(()),
            Err(mpsc::error::TrySendError::Full(_)) if self.lossy => Ok(()),
            Err(mpsc::error::TrySendError::Full(_)) => Err(Gone::Stalled),
            Err(mpsc::error::TrySendError::Closed(_)) => Err(Gone::Closed),
        }
    }
}

/// The socket's end.
struct Ends {
    inbound: mpsc::Sender<MAVLinkMessageRaw>,
    outbound: mpsc::Receiver<Bytes>,
    close: CancellationToken,
    spoken: Arc<AtomicU8>,
}

/// Notes the newest version that was spoken, and passes on what was said; `false` once nobody listens.
async fn pass(frame: MAVLinkMessageRaw, spoken: &AtomicU8, inbound: &mpsc::Sender<MAVLinkMessageRaw>) -> bool {
    let number = if frame.version() == MavlinkVersion::V1 { 1 } else { 2 };
    spoken.fetch_max(number, Ordering::Relaxed);
    inbound.send(frame).await.is_ok()
}

impl Ends {
    async fn serve_tcp(self, stream: TcpStream) {
        let Self { inbound, mut outbound, close, spoken } = self;
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "MAVLink to a client may be delayed");
        }
        let (read, mut write) = stream.into_split();
        let unframed = Arc::new(AtomicUsize::new(0));
        let mut reader = AsyncMavlinkReader::new(Framed { read, unframed: Arc::clone(&unframed) });
        let reading = async {
            while let Ok(raw) = reader.read_any_raw_message::<MavMessage>().await {
                unframed.store(0, Ordering::Relaxed);
                if !pass(raw, &spoken, &inbound).await {
                    break;
                }
            }
        };
        let writing = async {
            while let Some(batch) = outbound.recv().await {
                if write.write_all(&batch).await.is_err() {
                    break;
                }
            }
        };
        // Whichever ends first ends the connection: both halves and both queues go with this task.
        tokio::select! {
            () = close.cancelled() => {}
            () = reading => {}
            () = writing => {}
        }
    }

    async fn serve_udp(self, socket: UdpSocket) {
        let Self { inbound, mut outbound, close, spoken } = self;
        let reading = async {
            let mut datagram = vec![0_u8; 65_536];
            loop {
                // An error here is the network's word that nobody listens yet. It comes once per datagram sent, so it can't spin.
                let Ok(length) = socket.recv(&mut datagram).await else { continue };
                let mut reader = MavlinkReader::new(&datagram[..length]);
                while let Ok(raw) = reader.read_any_raw_message::<MavMessage>() {
                    if !pass(raw, &spoken, &inbound).await {
                        return;
                    }
                }
            }
        };
        let writing = async {
            while let Some(batch) = outbound.recv().await {
                // Lost when nobody listens, as datagrams are.
                let _lost = socket.send(&batch).await;
            }
        };
        tokio::select! {
            () = close.cancelled() => {}
            () = reading => {}
            () = writing => {}
        }
    }
}

/// A reader that fails after too much without a frame.
struct Framed<R> {
    read: R,
    unframed: Arc<AtomicUsize>,
}

impl<R: AsyncRead + Unpin> AsyncRead for Framed<R> {
    fn poll_read(mut self: Pin<&mut Self>, context: &mut Context<'_>, buffer: &mut ReadBuf<'_>) -> Poll<std::io::Result<()>> {
        if self.unframed.load(Ordering::Relaxed) > GARBAGE_MAX_BYTES {
            let error = std::io::Error::new(std::io::ErrorKind::InvalidData, "not a MAVLink client");
            return Poll::Ready(Err(error));
        }
        let before = buffer.filled().len();
        let polled = Pin::new(&mut self.read).poll_read(context, buffer);
        self.unframed.fetch_add(buffer.filled().len() - before, Ordering::Relaxed);
        polled
    }
}
