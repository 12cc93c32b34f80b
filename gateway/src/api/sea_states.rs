//! `/api/v1/sea-states`.

use axum::Json;
use axum::extract::State;

use super::dto::{Page, SeaState};
use super::extract::Asked;
use super::page::{IdPageQuery, page};
use super::problem::ApiError;
use crate::app::App;

/// The newest sea state of each rig, by rig.
#[utoipa::path(get, path = "/api/v1/sea-states", tag = "sea", operation_id = "list_sea_states", params(IdPageQuery),
    responses((status = 200, body = Page<SeaState>)))]
pub async fn list(State(app): State<App>, Asked(query): Asked<IdPageQuery>) -> Result<Json<Page<SeaState>>, ApiError> {
    let now = app.now();
    let fleet = app.store.read();
    let edge = fleet.edge(now);
    let sea_states = fleet.sea_states.iter().map(|(rig, kept)| (rig.clone(), kept));
    page(sea_states, &query.into(), |kept| SeaState::new(&kept.value, kept.stale, &edge)).map(Json)
}
