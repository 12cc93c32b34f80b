//! One process: configuration, session, services, signals, shutdown.

use std::future::Future;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use halcyon_model::{FleetId, FleetOrigin, InstanceId};
use tokio::task::JoinSet;
use tokio_util::sync::CancellationToken;
use tracing::{info, warn};

use crate::bus::Bus;
use crate::clock::{Clock, ClockConfig};
use crate::config::{ConfigError, FleetConfig, Section, Settings};
use crate::context::Context;
use crate::health::HealthHandle;
use crate::session::BusConfig;
use crate::telemetry::{self, LogConfig};
use crate::{supervise, topics};

/// The exit code for bad usage, bad input and bad configuration.
pub const EXIT_USAGE: u8 = 2;

/// Flags that every program shares.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Options {
    /// Configuration file; without it, halcyon.toml in the working folder if there is one
    #[arg(short, long, value_name = "FILE", env = "HALCYON_CONFIG", global = true)]
    pub config: Option<PathBuf>,
    /// Override one setting, such as --set capture.rate_hz=10
    #[arg(long = "set", value_name = "SECTION.KEY=VALUE", global = true)]
    pub overrides: Vec<String>,
}

impl Options {
    /// The settings these flags ask for.
    ///
    /// # Errors
    /// As [`Settings::load`].
    pub fn settings(&self) -> Result<Settings, ConfigError> {
        Settings::load(self.config.as_deref(), &self.overrides)
    }
}

/// A running process: one session, any number of services.
pub struct Process {
    fleet: FleetConfig,
    fleet_id: FleetId,
    bus: Bus,
    clock: Clock,
    stop: CancellationToken,
    services: JoinSet<()>,
}

impl Process {
    /// Starts logging, opens the session and serves metrics, as configured.
    ///
    /// # Errors
    /// If a shared section is invalid, or the session cannot be opened (an endpoint in use, say).
    pub async fn start(settings: &Settings) -> anyhow::Result<Self> {
        let fleet: FleetConfig = settings.section()?;
        let bus_config: BusConfig = settings.section()?;
        let log: LogConfig = settings.section()?;
        let clock = Clock::new(&settings.section::<ClockConfig>()?);
        telemetry::init(&log);
        let fleet_id = FleetId::new(&fleet.id)?;
        let opened =
            tokio::time::timeout(Duration::from_secs(15), zenoh::open(bus_config.zenoh().map_err(anyhow::Error::from_boxed)?));
        let session = match opened.await {
            Ok(session) => session.map_err(|error| anyhow::anyhow!("[bus] the session could not be opened: {error}"))?,
            Err(_) => anyhow::bail!("[bus] the session could not be opened within 15 s; connect = {:?}", bus_config.connect),
        };
        let bus = Bus::new(session, fleet_id.clone(), clock.clone());
        let stop = CancellationToken::new();
        let mut services = JoinSet::new();
        if !log.metrics_listen.is_empty() {
            let listener = tokio::net::TcpListener::bind(&log.metrics_listen)
                .await
                .map_err(|error| anyhow::anyhow!("[log] metrics_listen {}: {error}", log.metrics_listen))?;
            services.spawn(telemetry::serve(listener, stop.clone()));
        }
        Ok(Self { fleet, fleet_id, bus, clock, stop, services })
    }

    /// The bus.
    #[must_use]
    pub fn bus(&self) -> &Bus {
        &self.bus
    }

    /// The clock.
    #[must_use]
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// Cancelled when the process ends; cancel it to end the process.
    #[must_use]
    pub fn stop(&self) -> CancellationToken {
        self.stop.clone()
    }

    /// A context for `service` on `host` (such as `capture.leader-1`).
    ///
    /// # Errors
    /// If the name is no identifier, or the bus refuses.
    pub async fn context(&self, service: &str, host: &str) -> anyhow::Result<Context> {
        let origin: FleetOrigin = self.fleet.origin();
        Ok(Context {
            fleet: self.fleet_id.clone(),
            instance: InstanceId::new(format!("{}.{host}", service.replace('_', "-")))?,
            origin,
            bus: self.bus.clone(),
            clock: self.clock.clone(),
            stop: self.stop.child_token(),
            health: HealthHandle::new(),
            events: std::sync::Arc::new(self.bus.publisher(&topics::event()).await?),
        })
    }

    /// Runs a service under supervision, as the instance `SERVICE.host`.
    ///
    /// # Errors
    /// As [`Self::context`].
    pub async fn spawn<C, F, Fut>(&mut self, host: &str, config: C, run: F) -> anyhow::Result<()>
    where
        C: Section + Sync,
        F: Fn(Context, C) -> Fut + Send + 'static,
        Fut: Future<Output = anyhow::Result<()>> + Send + 'static,
    {
        let context = self.context(C::NAME, host).await?;
        info!(instance = %context.instance, "starting");
        self.services.spawn(supervise::supervise(context, C::NAME, config, run));
        Ok(())
    }

    /// Waits for SIGINT, SIGTERM or [`Self::stop`], or until every service has ended by itself; then stops all, within a few
    /// seconds, and closes the session. A process without services is a router for others, and waits for the signal.
    pub async fn wait(mut self) {
        let stop = self.stop.clone();
        tokio::select! {
            () = stop.cancelled() => {}
            () = signalled() => info!("stopping"),
            () = ended(&mut self.services) => {}
        }
        self.stop.cancel();
        let drained =
            tokio::time::timeout(Duration::from_secs(8), async { while self.services.join_next().await.is_some() {} });
        tokio::select! {
            drained = drained => if drained.is_err() {
                warn!("some services did not stop in time");
            },
            // A second Ctrl-C means now.
            () = signalled() => warn!("stopping at once"),
        }
        // Zenoh's close can hang for seconds under packet loss; what mattered has been flushed by now.
        if tokio::time::timeout(Duration::from_secs(2), self.bus.session().close()).await.is_err() {
            warn!("the bus session did not close in time");
        }
    }
}

/// Until the last of some services has ended by itself; never where there is none.
async fn ended(services: &mut JoinSet<()>) {
    if services.is_empty() {
        std::future::pending::<()>().await;
    }
    while services.join_next().await.is_some() {}
}

/// SIGINT or SIGTERM.
async fn signalled() {
    use tokio::signal::unix::{SignalKind, signal};
    match (signal(SignalKind::interrupt()), signal(SignalKind::terminate())) {
        (Ok(mut interrupt), Ok(mut terminate)) => {
            tokio::select! { _ = interrupt.recv() => {}, _ = terminate.recv() => {} }
        }
        // Without handlers the default action of the signals applies: the process just ends.
        _ => std::future::pending().await,
    }
}

/// The whole `main` of a service's own binary: flags, configuration, run until a signal.
pub fn main<C, F, Fut>(run: F) -> ExitCode
where
    C: Section + Sync,
    F: Fn(Context, C) -> Fut + Send + 'static,
    Fut: Future<Output = anyhow::Result<()>> + Send + 'static,
{
    let name = C::NAME.replace('_', "-");
    let about = format!("The {name} service of a Halcyon fleet. Example: halcyon-{name} --config fleet.toml");
    let command = clap::Command::new(format!("halcyon-{name}")).version(env!("CARGO_PKG_VERSION")).about(about);
    let matches = <Options as clap::Args>::augment_args(command).get_matches();
    let outcome =
        <Options as clap::FromArgMatches>::from_arg_matches(&matches).map_err(anyhow::Error::from).and_then(|options| {
            let settings = options.settings()?;
            let config = C::resolve(&settings)?;
            runtime()?.block_on(async {
                let fleet: FleetConfig = settings.section()?;
                let mut process = Process::start(&settings).await?;
                process.spawn(&fleet.host, config, run).await?;
                process.wait().await;
                Ok(())
            })
        });
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => fail(&error),
    }
}

/// The async runtime that every program uses.
///
/// # Errors
/// If the system gives no threads.
pub fn runtime() -> std::io::Result<tokio::runtime::Runtime> {
    tokio::runtime::Builder::new_multi_thread().enable_all().build()
}

/// One line on stderr, and the exit code: 2 for configuration, 1 for the rest.
#[allow(clippy::print_stderr, reason = "the one place where a program says why it ends")]
pub fn fail(error: &anyhow::Error) -> ExitCode {
    eprintln!("error: {error:#}");
    let usage = error.chain().any(<dyn std::error::Error>::is::<ConfigError>);
    if usage { ExitCode::from(EXIT_USAGE) } else { ExitCode::FAILURE }
}
