//! Keeps one service alive: an error or a panic restarts it with growing pauses; the rest of the process goes on.

use std::future::Future;
use std::time::{Duration, Instant};

use halcyon_model::{Health, HealthState, InstanceId};
use tracing::{info, warn};

use crate::bus::Publisher;
use crate::context::{Context, EventDraft};
use crate::topics;

/// First pause after a failure, wall time.
const BACKOFF_MIN: Duration = Duration::from_millis(200);
/// Longest pause: a service that cannot start tries again this often, for ever.
const BACKOFF_MAX: Duration = Duration::from_secs(10);
/// A run this long forgets the failures before it.
const STEADY: Duration = Duration::from_secs(30);
/// How long a service may take to stop once asked.
const GRACE: Duration = Duration::from_secs(5);

/// Runs `service` until it ends by itself or `context.stop` is cancelled, restarting it whenever it fails.
///
/// A restart calls `run` again with the same configuration: whatever the last run knew is forgotten, except what it stored.
pub(crate) async fn supervise<C, F, Fut>(context: Context, service: &'static str, config: C, run: F)
where
    C: Clone + Send + 'static,
    F: Fn(Context, C) -> Fut + Send + 'static,
    Fut: Future<Output = anyhow::Result<()>> + Send + 'static,
{
    let mut backoff = BACKOFF_MIN;
    let (restarts_sender, restarts) = tokio::sync::watch::channel((0_u32, context.clock.now()));
    let reporting = tokio::spawn(report(context.clone(), service, restarts));
    loop {
        context.health.set(HealthState::Starting, String::new());
        let started = Instant::now();
        let failure = match attempt(&context, run(context.clone(), config.clone())).await {
            Ok(()) => break,
            Err(failure) => failure,
        };
        if context.stop.is_cancelled() {
            warn!(instance = %context.instance, failure, "failed while stopping");
            break;
        }
        if started.elapsed() >= STEADY {
            backoff = BACKOFF_MIN;
        }
        metrics::counter!("service_restarts_total", "service" => service).increment(1);
        restarts_sender.send_modify(|(restarts, since)| {
            *restarts += 1;
            *since = context.clock.now();
        });
        context.health.set(HealthState::Restarting, failure.clone());
        context.event(EventDraft::warning(format!("{service} failed and will be restarted"), failure)).await;
        let stopped = tokio::time::timeout(backoff, context.stop.cancelled()).await.is_ok();
        if stopped {
            break;
        }
        backoff = (backoff * 2).min(BACKOFF_MAX);
    }
    reporting.abort();
    info!(instance = %context.instance, "stopped");
}

/// One run. A panic is an error like any other.
async fn attempt(context: &Context, run: impl Future<Output = anyhow::Result<()>> + Send + 'static) -> Result<(), String> {
    let mut task = tokio::spawn(run);
    let outcome = tokio::select! {
        outcome = &mut task => outcome,
        () = context.stop.cancelled() => match tokio::time::timeout(GRACE, &mut task).await {
            Ok(outcome) => outcome,
            Err(_) => {
                task.abort();
                return Err(format!("did not stop within {} s", GRACE.as_secs()));
            }
        },
    };
    match outcome {
        Ok(Ok(())) => Ok(()),
        Ok(Err(error)) => Err(format!("{error:#}")),
        Err(join) if join.is_panic() => {
            let panic = join.into_panic();
            let text =
                panic.downcast_ref::<&str>().map(ToString::to_string).or_else(|| panic.downcast_ref::<String>().cloned());
            Err(format!("panic: {}", text.unwrap_or_else(|| "no message".into())))
        }
        Err(_) => Err("cancelled".into()),
    }
}

/// Publishes the health on change and every second, and holds the liveliness token.
async fn report(context: Context, service: &'static str, restarts: tokio::sync::watch::Receiver<(u32, halcyon_model::Stamp)>) {
    let publisher = match announce(&context).await {
        Ok(announced) => announced,
        Err(error) => {
            warn!(instance = %context.instance, error = %error, "health cannot be published");
            return;
        }
    };
    let mut health = context.health.subscribe();
    loop {
        let current = health.borrow_and_update().clone();
        let now = context.clock.now();
        let (restarts, since) = *restarts.borrow();
        let message = Health {
            stamp: now,
            instance: context.instance.clone(),
            service: service.to_owned(),
            state: current.state,
            detail: current.detail,
            restarts,
            uptime_s: now.seconds_since(since).max(0.0),
            version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        if let Err(error) = publisher.0.put(&message).await {
            warn!(instance = %context.instance, error = %error, "health could not be sent");
        }
        // A second of wall time: people watch health, whatever the speed of the simulation.
        if let Ok(Err(_)) = tokio::time::timeout(Duration::from_secs(1), health.changed()).await {
            return;
        }
    }
}

async fn announce(context: &Context) -> Result<(Publisher<Health>, zenoh::liveliness::LivelinessToken), crate::BusError> {
    let instance: &InstanceId = &context.instance;
    Ok((context.bus.publisher(&topics::health(instance)).await?, context.bus.announce(instance).await?))
}
