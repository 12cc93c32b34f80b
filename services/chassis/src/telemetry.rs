//! Logs and metrics. Logs go to stderr, so that stdout stays for results.

use std::io::IsTerminal as _;
use std::sync::OnceLock;

use metrics_exporter_prometheus::{PrometheusBuilder, PrometheusHandle};
use serde::{Deserialize, Serialize};
use tracing_subscriber::EnvFilter;

use crate::config::Section;

/// `[log]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LogConfig {
    /// What to log, in tracing's filter syntax: `info`, or `warn,halcyon_vehicle_link=debug`.
    pub level: String,
    /// `text` for people, `json` for machines.
    pub format: LogFormat,
    /// Where this process serves `/metrics` and `/healthz`, such as `127.0.0.1:9100`; empty: nowhere. The gateway serves its own.
    pub metrics_listen: String,
}

/// The form of a log line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum LogFormat {
    /// For people.
    Text,
    /// One JSON object a line.
    Json,
}

impl Default for LogConfig {
    fn default() -> Self {
        Self { level: "info".into(), format: LogFormat::Text, metrics_listen: String::new() }
    }
}

impl Section for LogConfig {
    const NAME: &'static str = "log";

    fn validate(&self) -> Result<(), String> {
        EnvFilter::try_new(&self.level).map_err(|error| format!("level {:?}: {error}", self.level))?;
        if !self.metrics_listen.is_empty() {
            self.metrics_listen.parse::<std::net::SocketAddr>().map_err(|_| {
                format!("metrics_listen must be an address such as 127.0.0.1:9100, not {:?}", self.metrics_listen)
            })?;
        }
        Ok(())
    }
}

/// Starts logging and metrics. The first call of a process counts; later ones change nothing.
pub fn init(config: &LogConfig) {
    static DONE: OnceLock<()> = OnceLock::new();
    DONE.get_or_init(|| {
        // Zenoh's own info lines are about its links, for its developers.
        let filter = EnvFilter::try_new(format!("zenoh=warn,{}", config.level)).unwrap_or_else(|_| EnvFilter::new("info"));
        let builder = tracing_subscriber::fmt()
            .with_env_filter(filter)
            .with_writer(std::io::stderr)
            .with_ansi(std::io::stderr().is_terminal());
        let started = match config.format {
            LogFormat::Text => builder.with_target(false).try_init(),
            LogFormat::Json => builder.json().try_init(),
        };
        // A test harness may have its own subscriber; that is fine.
        drop(started);
        prometheus();
    });
}

fn prometheus() -> &'static PrometheusHandle {
    static HANDLE: OnceLock<PrometheusHandle> = OnceLock::new();
    HANDLE.get_or_init(|| {
        let recorder = PrometheusBuilder::new().build_recorder();
        let handle = recorder.handle();
        drop(metrics::set_global_recorder(recorder));
        handle
    })
}

/// All metrics of this process in Prometheus's text form.
#[must_use]
pub fn prometheus_text() -> String {
    let handle = prometheus();
    handle.run_upkeep();
    handle.render()
}

/// Serves `/metrics` and `/healthz` on `address` until `stop`.
pub(crate) async fn serve(listener: tokio::net::TcpListener, stop: tokio_util::sync::CancellationToken) {
    let router = axum::Router::new()
        .route("/metrics", axum::routing::get(|| async { prometheus_text() }))
        .route("/healthz", axum::routing::get(|| async { "ok\n" }));
    if let Err(error) = axum::serve(listener, router).with_graceful_shutdown(async move { stop.cancelled().await }).await {
        tracing::warn!(%error, "the metrics server ended");
    }
}
