//! The bus: typed, validated, bounded.
//!
//! Promises: a reader never blocks a writer or the router. When a reader's inbox is full the oldest message goes and is counted
//! (`bus_messages_dropped_total`). A message that cannot be decoded, or fails validation, is dropped, counted
//! (`bus_messages_refused_total`) and logged once in a while; it never reaches a core. Within one writer and topic the order is
//! kept; across writers there is none.

use std::marker::PhantomData;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use halcyon_model::{CommandReply, FleetId, InstanceId, Stamp};
use halcyon_proto::Wire;
use tracing::{debug, warn};
use zenoh::bytes::{Encoding, ZBytes};
use zenoh::qos::{CongestionControl, Reliability};
use zenoh::sample::{Sample, SampleKind};
use zenoh_ext::{
    AdvancedPublisher, AdvancedPublisherBuilderExt as _, AdvancedSubscriber, AdvancedSubscriberBuilderExt as _, CacheConfig,
    HistoryConfig, MissDetectionConfig, RecoveryConfig,
};

use crate::clock::Clock;
use crate::ring::Ring;
use crate::topics::{CommandTopic, Topic, presence_key};

/// The bus failed.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// Zenoh refused an operation.
    #[error("the bus could not {operation} {key}")]
    Zenoh {
        /// What was tried.
        operation: &'static str,
        /// On which key.
        key: String,
        /// Zenoh's word.
        #[source]
        source: zenoh::Error,
    },
    /// The session is closed.
    #[error("the bus session is closed")]
    Closed,
}

/// A command got no answer that can be used.
#[derive(Debug, thiserror::Error)]
pub enum CallError {
    /// Nobody serves that command now.
    #[error("nobody answers {command}: the service is not running or not reachable")]
    NobodyThere {
        /// Which command.
        command: &'static str,
    },
    /// The answer did not come in time.
    #[error("no answer to {command} within {timeout_s} s")]
    Timeout {
        /// Which command.
        command: &'static str,
        /// Time allowed, seconds.
        timeout_s: f64,
    },
    /// The answer could not be read.
    #[error("the answer to {command} could not be read: {problem}")]
    Invalid {
        /// Which command.
        command: &'static str,
        /// Why.
        problem: String,
    },
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}

/// A handle on this process's session. Cheap to clone.
#[derive(Clone)]
pub struct Bus {
    session: zenoh::Session,
    fleet: FleetId,
    clock: Clock,
}

impl Bus {
    /// Wraps an open session.
    pub(crate) fn new(session: zenoh::Session, fleet: FleetId, clock: Clock) -> Self {
        Self { session, fleet, clock }
    }

    /// The Zenoh session, for what this wrapper does not offer.
    #[must_use]
    pub fn session(&self) -> &zenoh::Session {
        &self.session
    }

    fn key(&self, suffix: &str) -> String {
        format!("halcyon/v1/{}/{suffix}", self.fleet)
    }

    /// Declares a writer.
    ///
    /// # Errors
    /// [`BusError::Zenoh`] if the session refuses.
    pub async fn publisher<M: Wire>(&self, topic: &Topic<M>) -> Result<Publisher<M>, BusError> {
        let key = self.key(&topic.key);
        let builder = self
            .session
            .declare_publisher(key.clone())
            .encoding(encoding::<M>())
            .priority(topic.delivery.priority)
            .express(topic.delivery.express)
            // Never `Block`: one stalled link must not stall the router. What matters is recovered from the history.
            .congestion_control(CongestionControl::Drop);
        let failed = |source| BusError::Zenoh { operation: "publish on", key: key.clone(), source };
        let inner = if topic.delivery.history > 0 {
            let builder = builder
                .reliability(Reliability::Reliable)
                .cache(CacheConfig::default().max_samples(topic.delivery.history))
                .sample_miss_detection(MissDetectionConfig::default().heartbeat(Duration::from_millis(500)))
                .publisher_detection();
            AnyPublisher::Kept(builder.await.map_err(failed)?)
        } else {
            AnyPublisher::Plain(builder.reliability(Reliability::BestEffort).await.map_err(failed)?)
        };
        let sent = metrics::counter!("bus_messages_sent_total", "topic" => topic.name);
        Ok(Publisher { inner, key, sent, message: PhantomData })
    }

    /// Declares a reader, whose inbox starts to fill at once (with the history, where the topic keeps one).
    ///
    /// # Errors
    /// [`BusError::Zenoh`] if the session refuses.
    pub async fn subscribe<M: Wire>(&self, topic: &Topic<M>) -> Result<Subscriber<M>, BusError> {
        let (inbox, guard) =
            self.listen(&self.key(&topic.key), topic.name, topic.delivery.inbox, topic.delivery.history).await?;
        let refused = metrics::counter!("bus_messages_refused_total", "topic" => topic.name);
        Ok(Subscriber { inbox, _guard: guard, name: topic.name, refused, message: PhantomData })
    }

    async fn listen(
        &self,
        key: &str,
        name: &'static str,
        depth: usize,
        history: usize,
    ) -> Result<(Arc<Ring<Sample>>, Guard), BusError> {
        let inbox = Ring::new(depth, name);
        let filled = Arc::clone(&inbox);
        let builder = self.session.declare_subscriber(key.to_owned()).callback(move |sample| filled.push(sample));
        let failed = |source| BusError::Zenoh { operation: "subscribe to", key: key.to_owned(), source };
        let guard = if history > 0 {
            let builder = builder
                .history(HistoryConfig::default().detect_late_publishers().max_samples(history))
                .recovery(RecoveryConfig::default().heartbeat())
                .subscriber_detection();
            Guard::Kept { _subscriber: builder.await.map_err(failed)? }
        } else {
            Guard::Plain { _subscriber: builder.await.map_err(failed)? }
        };
        Ok((inbox, guard))
    }

    /// Everything of this fleet, undecoded: for the recorder. Includes what is only best effort.
    ///
    /// # Errors
    /// [`BusError::Zenoh`] if the session refuses.
    pub async fn subscribe_raw(&self) -> Result<RawSubscriber, BusError> {
        let (inbox, guard) = self.listen(&self.key("**"), "raw", 4096, 0).await?;
        Ok(RawSubscriber { inbox, _guard: guard, clock: self.clock.clone() })
    }

    /// Publishes bytes as they are: for replay.
    ///
    /// # Errors
    /// [`BusError::Zenoh`] if the session refuses.
    pub async fn put_raw(&self, key: &str, encoding: &str, payload: Bytes) -> Result<(), BusError> {
        let put = self.session.put(key.to_owned(), ZBytes::from(payload.to_vec())).encoding(Encoding::from(encoding));
        put.await.map_err(|source| BusError::Zenoh { operation: "publish on", key: key.to_owned(), source })
    }

    /// Declares a server of a command.
    ///
    /// # Errors
    /// [`BusError::Zenoh`] if the session refuses.
    pub async fn serve<C: Wire>(&self, topic: &CommandTopic<C>) -> Result<CommandServer<C>, BusError> {
        let key = self.key(&topic.key);
        let inbox = Ring::new(64, topic.name);
        let filled = Arc::clone(&inbox);
        let queryable = self
            .session
            .declare_queryable(key.clone())
            .callback(move |query| filled.push(query))
            .await
            .map_err(|source| BusError::Zenoh { operation: "serve", key, source })?;
        Ok(CommandServer { inbox, _queryable: queryable, clock: self.clock.clone(), name: topic.name, command: PhantomData })
    }

    /// Sends a command and waits for its answer, at most `timeout` of wall time.
    ///
    /// # Errors
    /// [`CallError`]; a refusal is no error but an answer.
    pub async fn call<C: Wire>(
        &self,
        topic: &CommandTopic<C>,
        command: &C,
        timeout: Duration,
    ) -> Result<CommandReply, CallError> {
        let key = self.key(&topic.key);
        let replies = self
            .session
            .get(key.clone())
            .payload(halcyon_proto::encode(command))
            .encoding(encoding::<C>())
            .priority(zenoh::qos::Priority::InteractiveHigh)
            // The answer inherits it: a vehicle must not wait for a stalled link in order to say no.
            .congestion_control(CongestionControl::Drop)
            // The first answer is the answer; nothing is held back until the query has ended.
            .consolidation(zenoh::query::ConsolidationMode::None)
            .timeout(timeout)
            .with(zenoh::handlers::FifoChannel::new(4))
            .await
            .map_err(|source| BusError::Zenoh { operation: "call", key, source })?;
        let started = std::time::Instant::now();
        // Zenoh ends the channel at its own timeout; the outer one holds even if it should not.
        let reply = tokio::time::timeout(timeout + Duration::from_millis(200), replies.recv_async()).await;
        let timed_out = || CallError::Timeout { command: topic.name, timeout_s: timeout.as_secs_f64() };
        let reply = match reply {
            Err(_) => return Err(timed_out()),
            Ok(Err(_)) if started.elapsed() >= timeout => return Err(timed_out()),
            Ok(Err(_)) => return Err(CallError::NobodyThere { command: topic.name }),
            Ok(Ok(reply)) => reply,
        };
        let invalid = |problem: String| CallError::Invalid { command: topic.name, problem };
        match reply.result() {
            Ok(sample) => halcyon_proto::decode(shared(sample.payload())).map_err(|error| invalid(chain(&error))),
            Err(error) => match error.payload().try_to_string() {
                Ok(text) if text.eq_ignore_ascii_case("timeout") => Err(timed_out()),
                Ok(text) => Err(invalid(text.into_owned())),
                Err(_) => Err(invalid("an error that is no text".into())),
            },
        }
    }

    /// Shows that `instance` is alive for as long as the token is held.
    ///
    /// # Errors
    /// [`BusError::Zenoh`] if the session refuses.
    pub async fn announce(&self, instance: &InstanceId) -> Result<zenoh::liveliness::LivelinessToken, BusError> {
        let key = self.key(&presence_key(instance.as_str()));
        let token = self.session.liveliness().declare_token(key.clone()).await;
        token.map_err(|source| BusError::Zenoh { operation: "announce", key, source })
    }

    /// Who comes and goes; begins with those who are there.
    ///
    /// # Errors
    /// [`BusError::Zenoh`] if the session refuses.
    pub async fn presence(&self) -> Result<PresenceSubscriber, BusError> {
        let key = self.key(&presence_key("*"));
        let inbox = Ring::new(256, "presence");
        let filled = Arc::clone(&inbox);
        let subscriber = self
            .session
            .liveliness()
            .declare_subscriber(key.clone())
            .history(true)
            .callback(move |sample| filled.push(sample))
            .await
            .map_err(|source| BusError::Zenoh { operation: "watch", key, source })?;
        Ok(PresenceSubscriber { inbox, _subscriber: subscriber })
    }
}

fn encoding<M: Wire>() -> Encoding {
    Encoding::APPLICATION_PROTOBUF.with_schema(format!("halcyon.v1.{}", M::NAME))
}

/// An error with its causes on one line.
pub(crate) fn chain(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        text = format!("{text}: {cause}");
        source = cause.source();
    }
    text
}

/// The payload as bytes; shares the memory where it is in one piece, as it is unless it was fragmented on the way.
fn shared(payload: &ZBytes) -> Bytes {
    struct OnePiece(ZBytes);
    impl AsRef<[u8]> for OnePiece {
        fn as_ref(&self) -> &[u8] {
            self.0.slices().next().unwrap_or_default()
        }
    }
    if payload.slices().count() <= 1 {
        Bytes::from_owner(OnePiece(payload.clone()))
    } else {
        Bytes::from(payload.to_bytes().into_owned())
    }
}

enum AnyPublisher {
    Plain(zenoh::pubsub::Publisher<'static>),
    Kept(AdvancedPublisher<'static>),
}

/// Keeps a subscription alive.
enum Guard {
    Plain { _subscriber: zenoh::pubsub::Subscriber<()> },
    Kept { _subscriber: AdvancedSubscriber<()> },
}

/// A writer of one topic.
pub struct Publisher<M> {
    inner: AnyPublisher,
    key: String,
    sent: metrics::Counter,
    message: PhantomData<fn(M)>,
}

impl<M: Wire> Publisher<M> {
    /// Publishes. Does not wait for any reader.
    ///
    /// # Errors
    /// [`BusError::Zenoh`] if the session refuses.
    pub async fn put(&self, message: &M) -> Result<(), BusError> {
        let payload = halcyon_proto::encode(message);
        let put = match &self.inner {
            AnyPublisher::Plain(publisher) => publisher.put(payload).await,
            AnyPublisher::Kept(publisher) => publisher.put(payload).await,
        };
        self.sent.increment(1);
        put.map_err(|source| BusError::Zenoh { operation: "publish on", key: self.key.clone(), source })
    }
}

/// A reader of one topic, or of a pattern of topics.
pub struct Subscriber<M> {
    inbox: Arc<Ring<Sample>>,
    _guard: Guard,
    name: &'static str,
    refused: metrics::Counter,
    message: PhantomData<fn() -> M>,
}

impl<M: Wire> Subscriber<M> {
    /// The next valid message. Cancel-safe.
    ///
    /// # Errors
    /// [`BusError::Closed`] once the session has closed.
    pub async fn recv(&mut self) -> Result<M, BusError> {
        loop {
            let sample = self.inbox.pop().await;
            if sample.kind() != SampleKind::Put {
                continue;
            }
            match halcyon_proto::decode(shared(sample.payload())) {
                Ok(message) => return Ok(message),
                Err(error) => {
                    self.refused.increment(1);
                    warn!(topic = self.name, key = %sample.key_expr(), error = chain(&error), "message refused");
                }
            }
        }
    }
}

/// A message as it travelled.
#[derive(Debug, Clone)]
pub struct RawSample {
    /// Full key.
    pub key: String,
    /// Encoding, such as `application/protobuf;halcyon.v1.SeaState`.
    pub encoding: String,
    /// Payload.
    pub payload: Bytes,
    /// When it was taken from the inbox, fleet time.
    pub received: Stamp,
}

/// A reader of everything.
pub struct RawSubscriber {
    inbox: Arc<Ring<Sample>>,
    _guard: Guard,
    clock: Clock,
}

impl RawSubscriber {
    /// The next message. Cancel-safe.
    ///
    /// # Errors
    /// [`BusError::Closed`] once the session has closed.
    pub async fn recv(&mut self) -> Result<RawSample, BusError> {
        let sample = self.inbox.pop().await;
        Ok(RawSample {
            key: sample.key_expr().as_str().to_owned(),
            encoding: sample.encoding().to_string(),
            payload: shared(sample.payload()),
            received: self.clock.now(),
        })
    }
}

/// A server of one command.
pub struct CommandServer<C> {
    inbox: Arc<Ring<zenoh::query::Query>>,
    _queryable: zenoh::query::Queryable<()>,
    clock: Clock,
    name: &'static str,
    command: PhantomData<fn() -> C>,
}

impl<C: Wire> CommandServer<C> {
    /// The next valid command. An invalid one is refused here, by name of the field. Cancel-safe.
    ///
    /// # Errors
    /// [`BusError::Closed`] once the session has closed.
    pub async fn recv(&mut self) -> Result<Incoming<C>, BusError> {
        loop {
            let query = self.inbox.pop().await;
            let payload = query.payload().map(shared).unwrap_or_default();
            match halcyon_proto::decode(payload) {
                Ok(command) => return Ok(Incoming { command, query }),
                Err(error) => {
                    metrics::counter!("bus_messages_refused_total", "topic" => self.name).increment(1);
                    let reply = CommandReply::refused(self.clock.now(), chain(&error));
                    send_reply(&query, &reply).await;
                }
            }
        }
    }
}

/// A command that waits for its answer. Dropped unanswered, its sender is told that nobody answered.
pub struct Incoming<C> {
    /// The command.
    pub command: C,
    query: zenoh::query::Query,
}

impl<C> Incoming<C> {
    /// Answers.
    pub async fn reply(self, reply: &CommandReply) {
        send_reply(&self.query, reply).await;
    }
}

impl<C: Send + 'static> Incoming<C> {
    /// Answers with much: on a task of its own, and once more a moment later, since the bus drops what a busy link cannot take
    /// at once. Whoever asked takes the first that comes.
    pub fn reply_twice(self, reply: CommandReply) {
        tokio::spawn(async move {
            send_reply(&self.query, &reply).await;
            pause().await;
            send_reply(&self.query, &reply).await;
        });
    }
}

#[allow(clippy::disallowed_methods, reason = "a busy link is a matter of wall time")]
async fn pause() {
    tokio::time::sleep(Duration::from_millis(100)).await;
}

async fn send_reply(query: &zenoh::query::Query, reply: &CommandReply) {
    let sent = query.reply(query.key_expr().clone(), halcyon_proto::encode(reply)).encoding(encoding::<CommandReply>()).await;
    if let Err(error) = sent {
        // The sender has gone, or was cut off; it will see a timeout.
        debug!(%error, "the answer to a command could not be sent");
    }
}

/// Someone came or went.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Presence {
    /// Who.
    pub instance: InstanceId,
    /// Came or went.
    pub alive: bool,
}

/// A reader of who comes and goes.
pub struct PresenceSubscriber {
    inbox: Arc<Ring<Sample>>,
    _subscriber: zenoh::pubsub::Subscriber<()>,
}

impl PresenceSubscriber {
    /// The next change. Cancel-safe.
    ///
    /// # Errors
    /// [`BusError::Closed`] once the session has closed.
    pub async fn recv(&mut self) -> Result<Presence, BusError> {
        loop {
            let sample = self.inbox.pop().await;
            let name = sample.key_expr().as_str().rsplit('/').nth(1).unwrap_or_default();
            if let Ok(instance) = InstanceId::new(name) {
                return Ok(Presence { instance, alive: sample.kind() == SampleKind::Put });
            }
        }
    }
}
