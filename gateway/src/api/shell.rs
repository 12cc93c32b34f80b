//! The outermost layers: time limit, problem bodies, security headers, and metrics.

use std::any::Any;
use std::time::Duration;

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use tokio::time::Instant;

use super::problem::{ApiError, name_the_path};
use super::transfers;
use crate::app::App;

/// Scripts only from here; styles may be inline, since chart libraries write them; workers may be blobs, since map libraries
/// start them so. Nobody may frame the page.
const CONTENT_SECURITY_POLICY: &str = "default-src 'self'; script-src 'self'; style-src 'self' 'unsafe-inline'; \
    img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; worker-src 'self' blob:; object-src 'none'; \
    base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

const SECURITY_HEADERS: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

fn set_if_absent(headers: &mut HeaderMap, name: HeaderName, value: &'static str) {
    headers.entry(name).or_insert(HeaderValue::from_static(value));
}

/// Bounds the time to an answer, writes problems and adds the security headers.
pub async fn layer(State(app): State<App>, request: Request, next: Next) -> Response {
    let path = request.uri().path().to_owned();
    // Transfers with an autopilot bound themselves, and are told why they took too long.
    let transfer_s = if transfers::is_one(&path) { app.config.transfer_timeout_s + 1.0 } else { 0.0 };
    let limit = Duration::from_secs_f64(app.config.request_timeout_s.max(transfer_s));
    // Wall time: it bounds what a client may hold.
    let response = match tokio::time::timeout(limit, next.run(request)).await {
        Ok(response) => response,
        Err(_) => ApiError::Timeout(format!("no answer within {} s", limit.as_secs_f64())).into_response(),
    };
    let mut response = name_the_path(response, &path);
    for (name, value) in SECURITY_HEADERS {
        set_if_absent(response.headers_mut(), name, value);
    }
    // What the dashboard caches, it says itself.
    set_if_absent(response.headers_mut(), header::CACHE_CONTROL, "no-store");
    response
}

/// Counts and times requests by route.
pub async fn observe(request: Request, next: Next) -> Response {
    let route = request.extensions().get::<MatchedPath>().map_or("other", MatchedPath::as_str).to_owned();
    let method = request.method().clone();
    let started = Instant::now();
    let response = next.run(request).await;
    let status = response.status().as_u16().to_string();
    let method = match method.as_str() {
        known @ ("GET" | "HEAD" | "POST" | "PUT" | "DELETE" | "OPTIONS") => known.to_owned(),
        // Methods are the client's to make up; labels must stay few.
        _ => "other".into(),
    };
    metrics::counter!("gateway_http_requests_total", "method" => method, "route" => route.clone(), "status" => status)
        .increment(1);
    metrics::histogram!("gateway_http_request_duration_seconds", "route" => route).record(started.elapsed().as_secs_f64());
    response
}

/// A handler panicked: log why, tell the client nothing of it.
#[allow(clippy::needless_pass_by_value, reason = "catch-panic's signature")]
pub fn panicked(cause: Box<dyn Any + Send + 'static>) -> Response {
    let cause = cause
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| cause.downcast_ref::<&str>().copied())
        .unwrap_or("unknown");
    tracing::error!(cause, "a request handler panicked");
    ApiError::Internal.into_response()
}
