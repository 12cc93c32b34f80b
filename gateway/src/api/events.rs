//! `/api/v1/events`.

use axum::Json;
use axum::extract::State;
use halcyon_model as model;
use serde::Deserialize;
use utoipa::IntoParams;

use super::dto::{Event, Page, Severity};
use super::extract::Asked;
use super::page::{EventCursor, PageQuery, page};
use super::problem::ApiError;
use crate::app::App;
use crate::core::fleet::Fleet;

/// Which events.
#[derive(Debug, Clone, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct EventQuery {
    /// At most so many items; 100 if left out.
    #[param(minimum = 1, maximum = 1000)]
    pub limit: Option<usize>,
    /// `next` of the page before.
    #[param(pattern = "^[0-9]{1,19}$")]
    pub after: Option<String>,
    /// Only this severity and above.
    #[param(inline)]
    pub severity: Option<Severity>,
    /// Only what concerns this vehicle.
    #[param(pattern = "^[A-Za-z0-9._-]{1,64}$")]
    pub vehicle: Option<String>,
}

/// What happened, the newest first.
#[utoipa::path(get, path = "/api/v1/events", tag = "fleet", operation_id = "list_events", params(EventQuery),
    responses((status = 200, body = Page<Event>)))]
pub async fn list(State(app): State<App>, Asked(query): Asked<EventQuery>) -> Result<Json<Page<Event>>, ApiError> {
    let vehicle =
        query.vehicle.map(model::VehicleId::new).transpose().map_err(|error| ApiError::BadRequest(error.to_string()))?;
    let pages = PageQuery { limit: query.limit, after: query.after };
    event_page(&app.store.read(), &pages, |event| {
        query.severity.is_none_or(|least| Severity::from(event.severity) >= least)
            && vehicle.as_ref().is_none_or(|vehicle| event.vehicle.as_ref() == Some(vehicle))
    })
    .map(Json)
}

/// A page of the events that `wanted` takes.
pub fn event_page(fleet: &Fleet, query: &PageQuery, wanted: impl Fn(&model::Event) -> bool) -> Result<Page<Event>, ApiError> {
    let events = fleet.events().filter(|event| wanted(&event.event)).map(|event| (EventCursor(event.sequence), event));
    page(events, query, |event| Event::new(event.sequence, &event.event))
}
