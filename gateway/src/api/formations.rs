//! `/api/v1/formations`.

use std::collections::BTreeMap;

use axum::Json;
use axum::extract::State;
use axum::http::HeaderMap;
use axum::response::Response;
use halcyon_model::{CommandReply, FormationSpec, MissionAction, Task, VehicleId};

use super::dto::{CommandResult, Formation, FormationRequest};
use super::extract::{Body, Id};
use super::missions::ask_planner;
use super::problem::ApiError;
use crate::app::App;

/// Who follows whom, and where, by the newest plan.
#[utoipa::path(get, path = "/api/v1/formations", tag = "vehicles", operation_id = "list_formations",
    responses((status = 200, body = [Formation])))]
pub async fn list(State(app): State<App>) -> Json<Vec<Formation>> {
    let fleet = app.store.read();
    let mut formations: BTreeMap<String, Formation> = BTreeMap::new();
    for assignment in fleet.plan().iter().flat_map(|plan| &plan.assignments) {
        if let Task::Follow { leader, slot } = &assignment.task {
            let leader = leader.to_string();
            let formation =
                formations.entry(leader.clone()).or_insert_with(|| Formation { leader, followers: BTreeMap::new() });
            formation.followers.insert(assignment.vehicle.to_string(), (*slot).into());
        }
    }
    Json(formations.into_values().collect())
}

/// Has followers keep a shape about a leader until told otherwise. Slots are given out so that nobody's way crosses another's; the
/// same leader again changes its formation. A mission of the leader takes its follower from there.
#[utoipa::path(post, path = "/api/v1/formations", tag = "vehicles", operation_id = "order_formation",
    request_body = FormationRequest,
    responses((status = 202, body = CommandResult, headers(("Location" = String, description = "The formations")))))]
pub async fn order(
    State(app): State<App>,
    headers: HeaderMap,
    Body(request): Body<FormationRequest>,
) -> Result<Response, ApiError> {
    let vehicle = |text: String| VehicleId::new(text).map_err(|error| ApiError::Invalid(error.to_string()));
    let spec = FormationSpec {
        leader: vehicle(request.leader)?,
        shape: request.shape.into(),
        spacing_m: request.spacing_m,
        followers: request.followers.into_iter().map(vehicle).collect::<Result<_, _>>()?,
    };
    if !(spec.spacing_m > 0.0 && spec.spacing_m <= 1000.0) {
        return Err(ApiError::Invalid(format!("spacing_m must be above 0 and at most 1000 m, not {}", spec.spacing_m)));
    }
    ask_planner(&app, &headers, MissionAction::Form(spec), watch).await
}

/// Calls the followers of a leader home.
#[utoipa::path(post, path = "/api/v1/formations/{id}/disband", tag = "vehicles", operation_id = "disband_formation",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$", description = "The leader")),
    responses((status = 202, body = CommandResult, headers(("Location" = String, description = "The formations")))))]
pub async fn disband(State(app): State<App>, Id(leader): Id<VehicleId>, headers: HeaderMap) -> Result<Response, ApiError> {
    if app.store.read().vehicles.get(&leader).is_none() {
        return Err(ApiError::NotFound(format!("no vehicle {leader} was ever heard")));
    }
    ask_planner(&app, &headers, MissionAction::Disband(leader), watch).await
}

fn watch(_: &CommandReply) -> String {
    "/api/v1/formations".into()
}
