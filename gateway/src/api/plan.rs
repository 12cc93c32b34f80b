//! `/api/v1/plan`.

use axum::Json;
use axum::extract::State;

use super::dto::Plan;
use super::problem::ApiError;
use crate::app::App;

/// The newest dispatch plan.
#[utoipa::path(get, path = "/api/v1/plan", tag = "fleet", operation_id = "show_plan", responses((status = 200, body = Plan)))]
pub async fn show(State(app): State<App>) -> Result<Json<Plan>, ApiError> {
    let now = app.now();
    let fleet = app.store.read();
    let plan = fleet.plan().ok_or_else(|| ApiError::NotFound("no plan was ever issued".into()))?;
    Ok(Json(Plan::new(plan, &fleet.edge(now))))
}
