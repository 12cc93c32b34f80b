//! A MAVLink connection that comes back: over TCP, UDP or serial, with every wait bounded.
//!
//! Promises: messages arrive in order; when the reader is slow the newest are dropped and counted; what is sent while the link is
//! down is dropped, since a setpoint that waits is worse than none. End of file, an error, a write that blocks, and a silence
//! longer than [`SILENCE`] end the connection; the next try comes after a growing pause.

use std::time::Duration;

use halcyon_chassis::Clock;
use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::error::MessageReadError;
use mavlink::{AsyncConnection, AsyncMavConnection, MavHeader, MavlinkVersion, connect_async};
use tokio::sync::mpsc;
use tokio_util::sync::CancellationToken;
use tracing::debug;

/// A connection that says nothing for so long is given up. A booting autopilot needs a few seconds before its first word.
const SILENCE: Duration = Duration::from_secs(10);
/// Making a connection, and writing to one, may take this long.
const CONNECT: Duration = Duration::from_secs(5);
const WRITE: Duration = Duration::from_secs(1);
/// Pauses between tries.
const PAUSE_MIN: Duration = Duration::from_millis(200);
const PAUSE_MAX: Duration = Duration::from_secs(5);
/// Messages that wait for the reader: half a second of a busy link.
const INBOX: usize = 256;
const OUTBOX: usize = 64;

/// What happens on a link.
#[derive(Debug)]
pub enum LinkEvent {
    /// A connection stands. Whether anyone is at the other end is not known yet.
    Up,
    /// A message with its sender.
    Message(MavHeader, Box<MavMessage>),
    /// The connection is gone, and why.
    Down(String),
}

/// Our end of a link.
#[derive(Debug)]
pub struct Link {
    events: mpsc::Receiver<LinkEvent>,
    out: mpsc::Sender<(MavHeader, MavMessage)>,
}

impl Link {
    /// Starts the task that keeps `endpoint` connected until `stop`. Addresses are the mavlink crate's: `tcpout:host:port`,
    /// `tcpin:…`, `udpin:…`, `udpout:…`, `serial:device:baud`.
    #[must_use]
    pub fn start(endpoint: String, clock: Clock, stop: CancellationToken) -> Self {
        let (events_in, events) = mpsc::channel(INBOX);
        let (out, outbox) = mpsc::channel(OUTBOX);
        tokio::spawn(async move {
            // Ends with `stop`, or when the reader has gone.
            let mut keeper = Keeper { endpoint, clock, events: events_in, outbox };
            tokio::select! {
                () = stop.cancelled() => {}
                () = keeper.keep() => {}
            }
        });
        Self { events, out }
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
}

struct Keeper {
    endpoint: String,
    clock: Clock,
    events: mpsc::Sender<LinkEvent>,
    outbox: mpsc::Receiver<(MavHeader, MavMessage)>,
}

impl Keeper {
    async fn keep(&mut self) {
        let mut pause = PAUSE_MIN;
        while !self.events.is_closed() {
            let why = match self.connect().await {
                Ok(connection) => {
                    if self.events.send(LinkEvent::Up).await.is_err() {
                        return;
                    }
                    // What waited while the link was down is old.
                    while self.outbox.try_recv().is_ok() {}
                    let (heard, why) = self.serve(&connection).await;
                    if heard {
                        pause = PAUSE_MIN;
                    }
                    why
                }
                Err(why) => why,
            };
            debug!(endpoint = self.endpoint, why, "link down");
            metrics::counter!("vehicle_link_connections_lost_total").increment(1);
            if self.events.send(LinkEvent::Down(why)).await.is_err() {
                return;
            }
            self.clock.sleep(pause).await;
            pause = (pause * 2).min(PAUSE_MAX);
        }
    }

    async fn connect(&self) -> Result<AsyncConnection<MavMessage>, String> {
        let endpoint = self.resolved().await?;
        // A listener waits for its caller as long as that takes; the others must succeed soon.
        let connected = if endpoint.starts_with("tcpin:") {
            connect_async::<MavMessage>(&endpoint).await
        } else {
            let connecting = connect_async::<MavMessage>(&endpoint);
            self.clock.timeout(CONNECT, connecting).await.map_err(|_| "no connection in 5 s".to_owned())?
        };
        let mut connection = connected.map_err(|error| error.to_string())?;
        connection.set_protocol_version(MavlinkVersion::V2);
        connection.set_allow_recv_any_version(true);
        Ok(connection)
    }

    /// The mavlink crate resolves names by blocking the thread; so it gets numbers.
    async fn resolved(&self) -> Result<String, String> {
        let Some((scheme @ ("tcpout" | "udpout"), host)) = self.endpoint.split_once(':') else {
            return Ok(self.endpoint.clone());
        };
        let lookup = self.clock.timeout(CONNECT, tokio::net::lookup_host(host)).await;
        let mut addresses =
            lookup.map_err(|_| format!("{host}: no answer to its name"))?.map_err(|error| format!("{host}: {error}"))?;
        let address = addresses.next().ok_or_else(|| format!("{host} has no address"))?;
        Ok(format!("{scheme}:{address}"))
    }

    /// Until the connection ends; whether anything was heard, and why it ended.
    async fn serve(&mut self, connection: &AsyncConnection<MavMessage>) -> (bool, String) {
        let mut heard = false;
        let mut silent_since = self.clock.now();
        loop {
            let quiet_left = SILENCE.as_secs_f64() - self.clock.now().seconds_since(silent_since);
            let wait = Duration::from_secs_f64(quiet_left.max(0.0));
            tokio::select! {
                received = self.clock.timeout(wait, connection.recv()) => match received {
                    Err(_) => return (heard, format!("silent for {} s", SILENCE.as_secs())),
                    Ok(Ok((header, message))) => {
                        heard = true;
                        silent_since = self.clock.now();
                        let event = LinkEvent::Message(header, Box::new(message));
                        match self.events.try_send(event) {
                            Ok(()) => {}
                            Err(mpsc::error::TrySendError::Full(_)) => {
                                metrics::counter!("vehicle_link_messages_dropped_total", "direction" => "in").increment(1);
                            }
                            Err(mpsc::error::TrySendError::Closed(_)) => return (heard, "stopped".into()),
                        }
                    }
                    // Unknown messages and values of newer dialects: the frame was whole, the stream goes on.
                    Ok(Err(MessageReadError::Parse(error))) => {
                        metrics::counter!("vehicle_link_messages_unread_total").increment(1);
                        debug!(%error, "message not understood");
                    }
                    Ok(Err(MessageReadError::Io(error))) => return (heard, error.to_string()),
                },
                outgoing = self.outbox.recv() => {
                    let Some((header, message)) = outgoing else { return (heard, "stopped".into()) };
                    // A write that is given up may have been half done: the connection is then of no use.
                    match self.clock.timeout(WRITE, connection.send(&header, &message)).await {
                        Err(_) => return (heard, "the other end does not read".into()),
                        Ok(Err(error)) => return (heard, error.to_string()),
                        Ok(Ok(_)) => {}
                    }
                }
            }
        }
    }
}
