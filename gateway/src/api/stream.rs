//! The live stream, as a WebSocket and as server-sent events: a snapshot first, then changes.
//!
//! Promises: messages of one kind about one thing come in order; a client that is too slow skips to a new snapshot or is
//! dropped; nothing waits for a client. See [`crate::feed`].

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::State;
use axum::extract::ws::rejection::WebSocketUpgradeRejection;
use axum::extract::ws::{CloseFrame, Message, Utf8Bytes, WebSocket, WebSocketUpgrade, close_code};
use axum::response::sse::{Event, Sse};
use axum::response::{IntoResponse, Response};
use futures::Stream;
use tokio::sync::broadcast::error::RecvError;
use tokio::sync::{OwnedSemaphorePermit, broadcast};
use tokio::time::Instant;

use super::dto::StreamMessage;
use super::problem::ApiError;
use crate::app::App;
use crate::feed::{self, Batch};

/// A client that takes longer for one message is dropped.
const SEND_MAX: Duration = Duration::from_secs(5);
/// A WebSocket is pinged this often …
const PING_EVERY: Duration = Duration::from_secs(10);
/// … and dropped when nothing came back for this long.
const SILENCE_MAX: Duration = Duration::from_secs(30);
/// Nothing of note comes from clients.
const CLIENT_MESSAGE_BYTES_MAX: usize = 4096;

/// One client's place in the feed. Dropping it makes room for another.
struct Subscription {
    app: App,
    batches: broadcast::Receiver<Arc<Batch>>,
    /// Revision that the client has.
    revision: u64,
    _permit: OwnedSemaphorePermit,
}

impl Subscription {
    fn open(app: App) -> Result<Self, ApiError> {
        if app.stop.is_cancelled() {
            return Err(ApiError::Unavailable("the gateway is stopping".into()));
        }
        let permit = Arc::clone(&app.streams).try_acquire_owned().map_err(|_| {
            ApiError::Unavailable("too many live streams are open; [gateway] streams_max sets the limit".into())
        })?;
        let batches = app.feed.subscribe();
        metrics::gauge!("gateway_stream_clients").increment(1.0);
        Ok(Self { app, batches, revision: 0, _permit: permit })
    }

    /// Everything known now.
    fn snapshot(&mut self) -> Vec<Utf8Bytes> {
        let (revision, messages) = feed::snapshot(&self.app);
        self.revision = revision;
        messages
    }

    /// The next messages, cancel-safe; `None` at the end.
    async fn next(&mut self) -> Option<Vec<Utf8Bytes>> {
        loop {
            let batch = tokio::select! {
                () = self.app.stop.cancelled() => return None,
                batch = self.batches.recv() => batch,
            };
            match batch {
                Ok(batch) => {
                    let mut messages = Vec::new();
                    // What the snapshot held already is not told again.
                    if batch.revision > self.revision {
                        self.revision = batch.revision;
                        messages.clone_from(&batch.changes);
                    }
                    messages.extend(batch.heartbeat.clone());
                    if !messages.is_empty() {
                        return Some(messages);
                    }
                }
                Err(RecvError::Lagged(_)) => {
                    metrics::counter!("gateway_stream_resyncs_total").increment(1);
                    self.batches = self.batches.resubscribe();
                    return Some(self.snapshot());
                }
                Err(RecvError::Closed) => return None,
            }
        }
    }
}

impl Drop for Subscription {
    fn drop(&mut self) {
        metrics::gauge!("gateway_stream_clients").decrement(1.0);
    }
}

/// The live stream as a WebSocket: text messages, each a `StreamMessage`.
#[utoipa::path(get, path = "/api/v1/stream", tag = "fleet", operation_id = "stream",
    responses((status = 101, description = "Switching to WebSocket"), (status = 426, description = "A WebSocket was expected")))]
pub async fn websocket(
    State(app): State<App>,
    upgrade: Result<WebSocketUpgrade, WebSocketUpgradeRejection>,
) -> Result<Response, ApiError> {
    let upgrade = upgrade.map_err(|error| ApiError::UpgradeRequired(error.body_text()))?;
    let subscription = Subscription::open(app)?;
    Ok(upgrade.max_message_size(CLIENT_MESSAGE_BYTES_MAX).on_upgrade(|socket| serve(socket, subscription)).into_response())
}

async fn serve(mut socket: WebSocket, mut subscription: Subscription) {
    let mut messages = subscription.snapshot();
    let mut heard = Instant::now();
    let mut ping_due = heard + PING_EVERY;
    loop {
        for message in messages.drain(..) {
            if send(&mut socket, Message::Text(message)).await.is_none() {
                return;
            }
        }
        tokio::select! {
            next = subscription.next() => match next {
                Some(next) => messages = next,
                None => {
                    let goodbye = CloseFrame { code: close_code::AWAY, reason: "the gateway is stopping".into() };
                    send(&mut socket, Message::Close(Some(goodbye))).await;
                    return;
                }
            },
            received = socket.recv() => match received {
                Some(Ok(Message::Close(_)) | Err(_)) | None => return,
                Some(Ok(_)) => heard = Instant::now(),
            },
            // Wall time: it is the connection's life that is watched.
            () = tokio::time::sleep_until(ping_due) => {
                ping_due = Instant::now() + PING_EVERY;
                if heard.elapsed() > SILENCE_MAX || send(&mut socket, Message::Ping(Vec::new().into())).await.is_none() {
                    return;
                }
            }
        }
    }
}

/// Sends, or gives up on the client.
async fn send(socket: &mut WebSocket, message: Message) -> Option<()> {
    tokio::time::timeout(SEND_MAX, socket.send(message)).await.ok()?.ok()
}

/// The live stream as server-sent events: the data of each is a `StreamMessage`.
#[utoipa::path(get, path = "/api/v1/events/stream", tag = "fleet", operation_id = "stream_events",
    responses((status = 200, description = "Endless", body = StreamMessage, content_type = "text/event-stream")))]
pub async fn server_sent(State(app): State<App>) -> Result<Sse<impl Stream<Item = Result<Event, Infallible>>>, ApiError> {
    let mut subscription = Subscription::open(app)?;
    let waiting = VecDeque::from(subscription.snapshot());
    let stream = futures::stream::unfold((subscription, waiting), |(mut subscription, mut waiting)| async move {
        loop {
            if let Some(message) = waiting.pop_front() {
                return Some((Ok(Event::default().data(message.as_str())), (subscription, waiting)));
            }
            waiting = subscription.next().await?.into();
        }
    });
    Ok(Sse::new(stream))
}
