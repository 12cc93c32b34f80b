//! `/api/v1/vehicles`.

use axum::Json;
use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use halcyon_model::{FlightMode, Slot, VehicleAction, VehicleCommand, VehicleId};

use super::dto::{CommandResult, Page, PointInput, Vehicle, VehicleCommandRequest};
use super::extract::{Asked, Body, Id};
use super::missions::{local_point, operator, positive};
use super::page::{IdPageQuery, page};
use super::problem::ApiError;
use crate::app::App;

/// Every vehicle that was ever heard, by identifier.
#[utoipa::path(get, path = "/api/v1/vehicles", tag = "vehicles", operation_id = "list_vehicles", params(IdPageQuery),
    responses((status = 200, body = Page<Vehicle>)))]
pub async fn list(State(app): State<App>, Asked(query): Asked<IdPageQuery>) -> Result<Json<Page<Vehicle>>, ApiError> {
    let now = app.now();
    let fleet = app.store.read();
    let edge = fleet.edge(now);
    let vehicles = fleet.vehicles.iter().map(|(id, kept)| (id.clone(), kept));
    page(vehicles, &query.into(), |kept| Vehicle::new(&kept.value, kept.stale, &edge)).map(Json)
}

/// One vehicle.
#[utoipa::path(get, path = "/api/v1/vehicles/{id}", tag = "vehicles", operation_id = "show_vehicle",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$")), responses((status = 200, body = Vehicle)))]
pub async fn show(State(app): State<App>, Id(id): Id<VehicleId>) -> Result<Json<Vehicle>, ApiError> {
    let now = app.now();
    let fleet = app.store.read();
    let kept = fleet.vehicles.get(&id).ok_or_else(|| unknown(&id))?;
    Ok(Json(Vehicle::new(&kept.value, kept.stale, &fleet.edge(now))))
}

/// Commands a vehicle. It accepts or refuses (409); when it accepts, watch the vehicle to see it done.
#[utoipa::path(post, path = "/api/v1/vehicles/{id}/commands", tag = "vehicles", operation_id = "command_vehicle",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$")), request_body = VehicleCommandRequest,
    responses((status = 202, body = CommandResult, headers(("Location" = String, description = "The vehicle")))))]
pub async fn command(
    State(app): State<App>,
    Id(vehicle): Id<VehicleId>,
    headers: HeaderMap,
    Body(request): Body<VehicleCommandRequest>,
) -> Result<Response, ApiError> {
    if app.store.read().vehicles.get(&vehicle).is_none() {
        return Err(unknown(&vehicle));
    }
    let who = operator(&headers)?;
    let action = action(&app, request)?;
    let stamp = app.now();
    let (timeout, deadline) = app.command_limit(stamp);
    let command = VehicleCommand { stamp, deadline, who, vehicle: vehicle.clone(), action };
    let reply = app
        .commands
        .vehicle(command, timeout)
        .await
        .map_err(|failure| ApiError::no_answer(&format!("vehicle {vehicle}"), &failure))?;
    if !reply.accepted {
        return Err(ApiError::Refused(reply.reason));
    }
    let watch = format!("/api/v1/vehicles/{vehicle}");
    Ok((StatusCode::ACCEPTED, [(header::LOCATION, watch.clone())], Json(CommandResult::new(&reply, watch))).into_response())
}

pub(super) fn unknown(id: &VehicleId) -> ApiError {
    ApiError::NotFound(format!("no vehicle {id} was ever heard"))
}

/// The command in the model's words.
fn action(app: &App, request: VehicleCommandRequest) -> Result<VehicleAction, ApiError> {
    use VehicleCommandRequest as Asked;
    let go_to = |point: PointInput, height_m| {
        Ok(VehicleAction::GoTo { point: local_point(app, point)?, height_m: positive("height_m", height_m)? })
    };
    Ok(match request {
        Asked::Arm => VehicleAction::Arm,
        Asked::Disarm => VehicleAction::Disarm,
        Asked::TakeOff { height_m } => VehicleAction::TakeOff { height_m: positive("height_m", height_m)? },
        Asked::GoTo { point, height_m } => go_to(point, height_m)?,
        Asked::Follow { leader, slot } => {
            let offsets = [slot.forward_m, slot.right_m, slot.up_m];
            if offsets.iter().any(|offset| offset.abs() > 1000.0) {
                return Err(ApiError::Invalid("a slot lies within 1000 m of its leader".into()));
            }
            let leader = VehicleId::new(leader).map_err(|error| ApiError::Invalid(error.to_string()))?;
            VehicleAction::Follow { leader, slot: Slot { forward_m: slot.forward_m, right_m: slot.right_m, up_m: slot.up_m } }
        }
        Asked::Hold => VehicleAction::Hold,
        Asked::Land => VehicleAction::Land,
        Asked::Return => VehicleAction::Return,
        Asked::SetMode { mode } => {
            let known = FlightMode::from_name(&mode);
            VehicleAction::SetMode(known.ok_or_else(|| {
                ApiError::Invalid(format!("{:?} is not a flight mode", mode.chars().take(40).collect::<String>()))
            })?)
        }
        Asked::SetHeading { heading_deg } => {
            if !(-360.0..=360.0).contains(&heading_deg) {
                return Err(ApiError::Invalid(format!("heading_deg must be -360 to 360, not {heading_deg}")));
            }
            VehicleAction::SetHeading { heading_rad: heading_deg.rem_euclid(360.0).to_radians() }
        }
        Asked::Terminate => VehicleAction::Terminate,
        Asked::ReleasePayload => VehicleAction::ReleasePayload,
        Asked::SecurePayload => VehicleAction::SecurePayload,
        Asked::CancelTransfer => VehicleAction::CancelTransfer,
    })
}
