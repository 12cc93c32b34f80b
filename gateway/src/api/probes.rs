//! `/healthz`, `/readyz` and `/metrics`.

use axum::Json;
use axum::extract::State;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::dto::{HealthState, Readiness, ReadinessCheck};
use crate::app::App;

/// The process answers.
#[utoipa::path(get, path = "/healthz", tag = "probes", operation_id = "healthz",
    responses((status = 200, body = String, content_type = "text/plain")))]
pub async fn healthz() -> &'static str {
    "ok\n"
}

/// Whether missions can be commanded through it: it is not stopping, and a mission planner is there.
#[utoipa::path(get, path = "/readyz", tag = "probes", operation_id = "readyz",
    responses((status = 200, body = Readiness), (status = 503, description = "Not ready", body = Readiness)))]
pub async fn readyz(State(app): State<App>) -> Response {
    let stopping = app.stop.is_cancelled();
    let planner = app.store.read().services.iter().any(|(_, kept)| {
        let state = HealthState::from(kept.value.state);
        kept.value.service.replace('_', "-") == "mission-planner"
            && !(kept.stale || kept.expired)
            && matches!(state, HealthState::Ready | HealthState::Degraded)
    });
    let check = |check: &str, passed: bool, yes: &str, no: &str| ReadinessCheck {
        check: check.into(),
        passed,
        text: if passed { yes } else { no }.into(),
    };
    let checks = vec![
        check("running", !stopping, "running", "stopping"),
        check("mission_planner", planner, "a mission planner is there", "no mission planner was heard lately"),
    ];
    let ready = checks.iter().all(|check| check.passed);
    let status = if ready { StatusCode::OK } else { StatusCode::SERVICE_UNAVAILABLE };
    (status, Json(Readiness { ready, checks })).into_response()
}

/// All metrics of this process in Prometheus' text format.
#[utoipa::path(get, path = "/metrics", tag = "probes", operation_id = "metrics",
    responses((status = 200, body = String, content_type = "text/plain")))]
pub async fn metrics(State(app): State<App>) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], (app.metrics)())
}
