//! A client of the REST API, for the commands that talk to a running fleet.

use std::time::Duration;

use anyhow::Context as _;
use halcyon_chassis::ConfigError;
use reqwest::Method;
use serde_json::Value;

/// Where the fleet is, and how to print what it says.
#[derive(Debug, clap::Args)]
pub(super) struct Gateway {
    /// Where the gateway is
    #[arg(long, env = "HALCYON_URL", default_value = "http://127.0.0.1:8080", global = true)]
    url: String,
    /// Print JSON
    #[arg(long, global = true)]
    json: bool,
}

impl Gateway {
    /// A client, and whether to print JSON. An answer may take as long as `patience`.
    pub(super) fn open(self, patience: Duration) -> anyhow::Result<(Client, bool)> {
        reqwest::Url::parse(&self.url).map_err(|error| ConfigError::new(format!("--url {:?}: {error}", self.url)))?;
        let http = reqwest::Client::builder().timeout(patience).no_proxy().build()?;
        Ok((Client { http, url: self.url }, self.json))
    }
}

/// What most answers take at most.
pub(super) const PATIENCE: Duration = Duration::from_secs(15);

pub(super) struct Client {
    http: reqwest::Client,
    url: String,
}

impl Client {
    /// Asks `/api/v1/{path}`; what the gateway refuses is an error in its own words.
    pub(super) async fn send(&self, method: Method, path: &str, body: Option<Value>) -> anyhow::Result<Value> {
        let request = self.http.request(method, format!("{}/api/v1/{path}", self.url.trim_end_matches('/')));
        let request = if let Some(body) = body { request.json(&body) } else { request };
        let response = request.send().await.with_context(|| format!("no gateway answers at {}; is the fleet up?", self.url))?;
        let status = response.status();
        let text = response.text().await.context("the gateway's answer broke off")?;
        let value: Value = serde_json::from_str(&text).unwrap_or(Value::Null);
        if status.is_success() {
            return Ok(value);
        }
        let told = |key: &str| value.get(key).and_then(Value::as_str).filter(|text| !text.is_empty());
        anyhow::bail!("{}", told("detail").or(told("title")).unwrap_or(status.as_str()))
    }
}

/// A text of an object, or a dash.
pub(super) fn text<'a>(value: &'a Value, key: &str) -> &'a str {
    value[key].as_str().unwrap_or("-")
}
