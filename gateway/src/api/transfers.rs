//! `/api/v1/vehicles/{id}/parameters` and `/api/v1/vehicles/{id}/{mission|fence|rally}`: what the autopilot keeps.

use axum::Json;
use axum::extract::{Path, State};
use axum::http::HeaderMap;
use halcyon_model::transfer::ITEMS_MAX;
use halcyon_model::{CommandReply, Content, ItemKind, ParameterName, VehicleAction, VehicleCommand, VehicleId};
use serde::Deserialize;
use utoipa::IntoParams;

use super::dto::{CommandResult, ItemList, ItemUpload, Parameter, ParameterList, SetParameter};
use super::extract::{Asked, Body, Id};
use super::missions::operator;
use super::problem::ApiError;
use super::vehicles::unknown;
use crate::app::App;

/// Which parameters.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct ParameterQuery {
    /// This one alone.
    #[param(pattern = "^[A-Za-z0-9_]{1,16}$")]
    name: Option<String>,
}

fn parameter_name(text: String) -> Result<ParameterName, ApiError> {
    ParameterName::new(text).map_err(|error| ApiError::Invalid(error.to_string()))
}

/// Whether a path is one of these.
#[must_use]
pub fn is_one(path: &str) -> bool {
    let rest = path.strip_prefix("/api/v1/vehicles/").and_then(|rest| rest.split_once('/'));
    let what = rest.and_then(|(_, rest)| rest.split('/').next());
    what.is_some_and(|what| what == "parameters" || ItemKind::from_name(what).is_some())
}

/// Asks the vehicle, waits for the end of the transfer.
async fn ask(app: &App, headers: &HeaderMap, vehicle: VehicleId, action: VehicleAction) -> Result<CommandReply, ApiError> {
    if app.store.read().vehicles.get(&vehicle).is_none() {
        return Err(unknown(&vehicle));
    }
    let who = operator(headers)?;
    let stamp = app.now();
    let (timeout, deadline) = app.transfer_limit(stamp);
    let whom = format!("vehicle {vehicle}");
    let command = VehicleCommand { stamp, deadline, who, vehicle, action };
    let reply = app.commands.vehicle(command, timeout).await.map_err(|failure| ApiError::no_answer(&whom, &failure))?;
    if reply.accepted { Ok(reply) } else { Err(ApiError::Refused(reply.reason)) }
}

fn parameters_of(reply: CommandReply) -> Result<Vec<Parameter>, ApiError> {
    match reply.content {
        Some(Content::Parameters(parameters)) => Ok(parameters.into_iter().map(Into::into).collect()),
        _ => Err(ApiError::Internal),
    }
}

/// The autopilot's parameters, or one of them. All of them take seconds to a minute over a radio.
#[utoipa::path(get, path = "/api/v1/vehicles/{id}/parameters", tag = "autopilot", operation_id = "read_parameters",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$"), ParameterQuery), responses((status = 200, body = ParameterList)))]
pub async fn read_parameters(
    State(app): State<App>,
    Id(vehicle): Id<VehicleId>,
    Asked(query): Asked<ParameterQuery>,
    headers: HeaderMap,
) -> Result<Json<ParameterList>, ApiError> {
    let action = match query.name {
        Some(name) => VehicleAction::ReadParameter { name: parameter_name(name)? },
        None => VehicleAction::ReadParameters,
    };
    let parameters = parameters_of(ask(&app, &headers, vehicle, action).await?)?;
    Ok(Json(ParameterList { parameters }))
}

/// Sets a parameter of the autopilot; the answer is what the autopilot then says. Refused (409) while the motors turn, unless
/// `even_in_flight`; where the value stays another; and where there is no such parameter.
#[utoipa::path(put, path = "/api/v1/vehicles/{id}/parameters/{name}", tag = "autopilot", operation_id = "set_parameter",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$"), ("name" = String, Path, pattern = "^[A-Za-z0-9_]{1,16}$")),
    request_body = SetParameter, responses((status = 200, body = Parameter)))]
pub async fn set_parameter(
    State(app): State<App>,
    Path((vehicle, name)): Path<(String, String)>,
    headers: HeaderMap,
    Body(request): Body<SetParameter>,
) -> Result<Json<Parameter>, ApiError> {
    let vehicle = VehicleId::new(vehicle).map_err(|error| ApiError::BadRequest(error.to_string()))?;
    let SetParameter { value, even_in_flight } = request;
    let action = VehicleAction::SetParameter { name: parameter_name(name)?, value, even_in_flight };
    let mut parameters = parameters_of(ask(&app, &headers, vehicle, action).await?)?;
    parameters.pop().map(Json).ok_or(ApiError::Internal)
}

fn target((vehicle, list): (String, String)) -> Result<(VehicleId, ItemKind), ApiError> {
    let vehicle = VehicleId::new(vehicle).map_err(|error| ApiError::BadRequest(error.to_string()))?;
    let kind = ItemKind::from_name(&list).ok_or_else(|| ApiError::NotFound("there is no such resource".into()))?;
    Ok((vehicle, kind))
}

/// The mission, fence or rally points that the autopilot keeps.
#[utoipa::path(get, path = "/api/v1/vehicles/{id}/{list}", tag = "autopilot", operation_id = "download_items",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$"), ("list" = String, Path, pattern = "^(mission|fence|rally)$")),
    responses((status = 200, body = ItemList)))]
pub async fn download(
    State(app): State<App>,
    Path(path): Path<(String, String)>,
    headers: HeaderMap,
) -> Result<Json<ItemList>, ApiError> {
    let (vehicle, kind) = target(path)?;
    let reply = ask(&app, &headers, vehicle, VehicleAction::DownloadItems { kind }).await?;
    let Some(Content::Items(items)) = reply.content else { return Err(ApiError::Internal) };
    Ok(Json(ItemList { kind: kind.into(), items: items.into_iter().map(Into::into).collect() }))
}

/// Replaces the mission, fence or rally points that the autopilot keeps. A fence changes with the motors off only.
#[utoipa::path(put, path = "/api/v1/vehicles/{id}/{list}", tag = "autopilot", operation_id = "upload_items",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$"), ("list" = String, Path, pattern = "^(mission|fence|rally)$")),
    request_body = ItemUpload, responses((status = 200, body = CommandResult)))]
pub async fn upload(
    State(app): State<App>,
    Path(path): Path<(String, String)>,
    headers: HeaderMap,
    Body(request): Body<ItemUpload>,
) -> Result<Json<CommandResult>, ApiError> {
    let (vehicle, kind) = target(path)?;
    if request.items.len() > ITEMS_MAX {
        return Err(ApiError::Invalid(format!("{} items; at most {ITEMS_MAX}", request.items.len())));
    }
    let read = request
        .items
        .into_iter()
        .enumerate()
        .map(|(at, item)| item.read(kind).map_err(|error| ApiError::Invalid(format!("item {}: {error}", at + 1))));
    let items = read.collect::<Result<_, _>>()?;
    let watch = format!("/api/v1/vehicles/{vehicle}/{}", kind.name());
    let reply = ask(&app, &headers, vehicle, VehicleAction::UploadItems { kind, items }).await?;
    Ok(Json(CommandResult::new(&reply, watch)))
}

/// Empties the mission, fence or rally points that the autopilot keeps.
#[utoipa::path(delete, path = "/api/v1/vehicles/{id}/{list}", tag = "autopilot", operation_id = "clear_items",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$"), ("list" = String, Path, pattern = "^(mission|fence|rally)$")),
    responses((status = 200, body = CommandResult)))]
pub async fn clear(
    State(app): State<App>,
    Path(path): Path<(String, String)>,
    headers: HeaderMap,
) -> Result<Json<CommandResult>, ApiError> {
    let (vehicle, kind) = target(path)?;
    let watch = format!("/api/v1/vehicles/{vehicle}/{}", kind.name());
    let reply = ask(&app, &headers, vehicle, VehicleAction::ClearItems { kind }).await?;
    Ok(Json(CommandResult::new(&reply, watch)))
}
