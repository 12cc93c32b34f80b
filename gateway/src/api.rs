//! The HTTP interface: routes, the layers around them, and the OpenAPI document.

pub mod dashboard;
pub mod dto;
pub mod events;
pub mod extract;
pub mod formations;
pub mod guard;
pub mod headers;
pub mod idempotency;
pub mod missions;
pub mod openapi;
pub mod page;
pub mod plan;
pub mod probes;
pub mod problem;
pub mod rigs;
pub mod sea_states;
pub mod services;
pub mod shell;
pub mod stream;
pub mod transfers;
pub mod vehicles;

use axum::Router;
use axum::extract::{DefaultBodyLimit, OriginalUri, Request};
use axum::http::Method;
use axum::middleware::{from_fn, from_fn_with_state};
use axum::response::Response;
use axum::routing::get;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use utoipa_swagger_ui::SwaggerUi;

use crate::app::App;
use problem::ApiError;

/// Everything under one router.
pub fn router(app: App) -> Router {
    let (api, _) = openapi::routes().split_for_parts();
    Router::new()
        .merge(api)
        .route("/openapi.json", get(openapi::serve))
        .merge(SwaggerUi::new("/docs").config(utoipa_swagger_ui::Config::from("/openapi.json")))
        .fallback(fallback)
        .method_not_allowed_fallback(method_not_allowed)
        .layer(CatchPanicLayer::custom(shell::panicked))
        .layer(from_fn_with_state(app.clone(), idempotency::layer))
        .layer(DefaultBodyLimit::max(app.config.body_bytes_max))
        .layer(from_fn_with_state(app.clone(), guard::layer))
        .layer(from_fn_with_state(app.clone(), shell::layer))
        .layer(CompressionLayer::new().gzip(true))
        .layer(from_fn(shell::observe))
        .with_state(app)
}

/// The dashboard for whoever gets a page; a problem for everything else.
async fn fallback(OriginalUri(uri): OriginalUri, request: Request) -> Result<Response, ApiError> {
    let path = uri.path();
    let page = matches!(*request.method(), Method::GET | Method::HEAD);
    if !page || path == "/api" || path.starts_with("/api/") {
        return Err(ApiError::NotFound("there is no such resource".into()));
    }
    dashboard::serve(path, request.headers())
}

async fn method_not_allowed(request: Request) -> ApiError {
    ApiError::MethodNotAllowed(format!("{} is not offered here", request.method()))
}
