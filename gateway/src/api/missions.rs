//! `/api/v1/missions`.

use axum::extract::State;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use halcyon_model::{CommandReply, Geodetic, LocalPoint, MissionAction, MissionCommand, MissionId, MissionSpec, VehicleId};

use super::dto::{CommandResult, CreateMission, Event, Mission, Page, PointInput};
use super::events::event_page;
use super::extract::{Asked, Body, Id};
use super::headers::OPERATOR;
use super::idempotency::RequestToken;
use super::page::{EventPageQuery, MissionCursor, MissionPageQuery, page};
use super::problem::ApiError;
use crate::app::App;

/// Survey height where none is given, metres.
const SURVEY_HEIGHT_M: f64 = 5.0;
/// Farthest that a flat local frame means anything, metres.
const LOCAL_M_MAX: f64 = 100_000.0;
/// Greatest height that any command may name, metres; vehicles have tighter limits of their own.
const HEIGHT_M_MAX: f64 = 1000.0;

/// Every mission, the newest first.
#[utoipa::path(get, path = "/api/v1/missions", tag = "missions", operation_id = "list_missions", params(MissionPageQuery),
    responses((status = 200, body = Page<Mission>)))]
pub async fn list(State(app): State<App>, Asked(query): Asked<MissionPageQuery>) -> Result<Json<Page<Mission>>, ApiError> {
    let now = app.now();
    let fleet = app.store.read();
    let edge = fleet.edge(now);
    let mut missions: Vec<_> = fleet
        .missions
        .iter()
        .map(|(id, kept)| {
            let created = kept.value.history.first().map_or(kept.value.stamp, |first| first.stamp);
            (MissionCursor { created_ns: created.as_nanos(), id: id.clone() }, kept)
        })
        .collect();
    missions.sort_by(|a, b| a.0.cmp(&b.0));
    page(missions.into_iter(), &query.into(), |kept| Mission::new(&kept.value, &edge)).map(Json)
}

/// One mission.
#[utoipa::path(get, path = "/api/v1/missions/{id}", tag = "missions", operation_id = "show_mission",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$")), responses((status = 200, body = Mission)))]
pub async fn show(State(app): State<App>, Id(id): Id<MissionId>) -> Result<Json<Mission>, ApiError> {
    let now = app.now();
    app.store.read().mission_json(&id, now).map(Json).ok_or_else(|| unknown(&id))
}

/// Creates a mission: survey a point, assess it, send one follower to land there.
#[utoipa::path(post, path = "/api/v1/missions", tag = "missions", operation_id = "create_mission", request_body = CreateMission,
    responses((status = 202, body = CommandResult, headers(("Location" = String, description = "The mission")))))]
pub async fn create(
    State(app): State<App>,
    Extension(token): Extension<RequestToken>,
    headers: HeaderMap,
    Body(request): Body<CreateMission>,
) -> Result<Response, ApiError> {
    let invalid = |error: halcyon_model::IdError| ApiError::Invalid(error.to_string());
    // From the request's token, so that a repeat of it creates nothing new even when the first answer was lost.
    let id = request.id.unwrap_or_else(|| format!("m-{}", &token.0.simple().to_string()[..10]));
    let id = MissionId::new(id).map_err(invalid)?;
    let vehicle = |text: Option<String>| text.map(VehicleId::new).transpose().map_err(invalid);
    let name = request.name.unwrap_or_else(|| id.to_string());
    if name.chars().count() > 200 {
        return Err(ApiError::Invalid("name must have at most 200 characters".into()));
    }
    let spec = MissionSpec {
        name,
        point: local_point(&app, request.point)?,
        survey_height_m: positive("survey_height_m", request.survey_height_m.unwrap_or(SURVEY_HEIGHT_M))?,
        approval: request.approval.into(),
        dispatch_on_approval: request.dispatch_on_approval,
        leader: vehicle(request.leader)?,
        follower: vehicle(request.follower)?,
    };
    ask(&app, &headers, id.clone(), MissionAction::Create(id, spec)).await
}

macro_rules! action {
    ($(#[$doc:meta])* $name:ident, $operation:literal, $path:literal, $action:ident) => {
        $(#[$doc])*
        #[utoipa::path(post, path = $path, tag = "missions", operation_id = $operation,
            params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$")),
            responses((status = 202, body = CommandResult, headers(("Location" = String, description = "The mission")))))]
        pub async fn $name(State(app): State<App>, Id(id): Id<MissionId>, headers: HeaderMap) -> Result<Response, ApiError> {
            if app.store.read().missions.get(&id).is_none() {
                return Err(unknown(&id));
            }
            ask(&app, &headers, id.clone(), MissionAction::$action(id)).await
        }
    };
}

action!(
    /// Says that the follower may go.
    approve, "approve_mission", "/api/v1/missions/{id}/approve", Approve
);
action!(
    /// Sends the follower now; while approval is awaited, that approves, too.
    dispatch, "dispatch_mission", "/api/v1/missions/{id}/dispatch", Dispatch
);
action!(
    /// Lets everyone hold.
    pause, "pause_mission", "/api/v1/missions/{id}/pause", Pause
);
action!(
    /// Goes on.
    resume, "resume_mission", "/api/v1/missions/{id}/resume", Resume
);
action!(
    /// Calls everyone back. Works from every phase.
    abort, "abort_mission", "/api/v1/missions/{id}/abort", Abort
);

action!(
    /// Tries once more to let the payload go, after a refusal or no answer.
    release, "release_mission_payload", "/api/v1/missions/{id}/release", Release
);
action!(
    /// Completes the mission though the payload was not let go; that stays on record.
    skip_release, "skip_mission_release", "/api/v1/missions/{id}/skip-release", SkipRelease
);

/// Events that concern a mission, the newest first.
#[utoipa::path(get, path = "/api/v1/missions/{id}/events", tag = "missions", operation_id = "list_mission_events",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$"), EventPageQuery), responses((status = 200, body = Page<Event>)))]
pub async fn events(
    State(app): State<App>,
    Id(id): Id<MissionId>,
    Asked(query): Asked<EventPageQuery>,
) -> Result<Json<Page<Event>>, ApiError> {
    let fleet = app.store.read();
    if fleet.missions.get(&id).is_none() {
        return Err(unknown(&id));
    }
    event_page(&fleet, &query.into(), |event| event.mission.as_ref() == Some(&id)).map(Json)
}

fn unknown(id: &MissionId) -> ApiError {
    ApiError::NotFound(format!("there is no mission {id}"))
}

async fn ask(app: &App, headers: &HeaderMap, id: MissionId, action: MissionAction) -> Result<Response, ApiError> {
    ask_planner(app, headers, action, |reply| format!("/api/v1/missions/{}", reply.mission.as_ref().unwrap_or(&id))).await
}

/// Asks the planner and words its answer; `watch` names what to look at then.
pub async fn ask_planner(
    app: &App,
    headers: &HeaderMap,
    action: MissionAction,
    watch: impl FnOnce(&CommandReply) -> String,
) -> Result<Response, ApiError> {
    let who = operator(headers)?;
    let stamp = app.now();
    let (timeout, deadline) = app.command_limit(stamp);
    let command = MissionCommand { stamp, deadline, who, action };
    let reply =
        app.commands.mission(command, timeout).await.map_err(|failure| ApiError::no_answer("the mission planner", &failure))?;
    if !reply.accepted {
        return Err(ApiError::Refused(reply.reason));
    }
    let watch = watch(&reply);
    Ok((StatusCode::ACCEPTED, [(header::LOCATION, watch.clone())], Json(CommandResult::new(&reply, watch))).into_response())
}

/// Who commands, for the record: the header `Halcyon-Operator`, or `rest`.
pub fn operator(headers: &HeaderMap) -> Result<String, ApiError> {
    let Some(value) = headers.get(OPERATOR) else { return Ok("rest".into()) };
    match value.to_str().map(str::trim) {
        // A tab passes for visible in HTTP.
        Ok(text) if (1..=64).contains(&text.len()) && !text.contains('\t') => Ok(text.into()),
        _ => Err(ApiError::BadRequest("Halcyon-Operator must be 1 to 64 visible ASCII characters".into())),
    }
}

/// A height above zero and below what anything flies.
pub fn positive(key: &str, height_m: f64) -> Result<f64, ApiError> {
    if height_m > 0.0 && height_m <= HEIGHT_M_MAX {
        Ok(height_m)
    } else {
        Err(ApiError::Invalid(format!("{key} must be above 0 and at most {HEIGHT_M_MAX} m, not {height_m}")))
    }
}

/// A place in the fleet's local frame.
pub fn local_point(app: &App, point: PointInput) -> Result<LocalPoint, ApiError> {
    let point = match point {
        PointInput::Local { north_m, east_m } => LocalPoint::new(north_m, east_m),
        PointInput::Global { latitude_deg, longitude_deg } => {
            let global = Geodetic::from_deg(latitude_deg, longitude_deg, app.origin.0.altitude_m);
            if !global.is_valid() {
                return Err(ApiError::Invalid(format!("{latitude_deg}, {longitude_deg} is not on the globe")));
            }
            app.origin.frame().ned_from_geodetic(global).into()
        }
    };
    if point.north_m.abs() <= LOCAL_M_MAX && point.east_m.abs() <= LOCAL_M_MAX {
        Ok(point)
    } else {
        Err(ApiError::Invalid(format!(
            "the point lies {:.0} km from the fleet's origin; at most {:.0} km make sense",
            point.vector().norm() / 1000.0,
            LOCAL_M_MAX / 1000.0
        )))
    }
}
