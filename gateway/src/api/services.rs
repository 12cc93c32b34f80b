//! `/api/v1/services`.

use axum::Json;
use axum::extract::State;

use super::dto::{Page, Service};
use super::extract::Asked;
use super::page::{IdPageQuery, page};
use super::problem::ApiError;
use crate::app::App;

/// The health of every service that was ever heard, by instance.
#[utoipa::path(get, path = "/api/v1/services", tag = "fleet", operation_id = "list_services", params(IdPageQuery),
    responses((status = 200, body = Page<Service>)))]
pub async fn list(State(app): State<App>, Asked(query): Asked<IdPageQuery>) -> Result<Json<Page<Service>>, ApiError> {
    let now = app.now();
    let fleet = app.store.read();
    let edge = fleet.edge(now);
    let services = fleet.services.iter().map(|(instance, kept)| (instance.clone(), kept));
    page(services, &query.into(), |kept| Service::new(&kept.value, kept.stale || kept.expired, &edge)).map(Json)
}
