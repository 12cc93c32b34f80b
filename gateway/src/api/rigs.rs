//! `/api/v1/rigs`.

use std::time::Duration;

use axum::Json;
use axum::extract::State;
use axum::http::header;
use axum::response::{IntoResponse, Response};
use halcyon_model as model;
use halcyon_model::RigId;
use serde::Deserialize;
use utoipa::IntoParams;

use super::dto::{Preview, Series, SeriesSample, Spectrum, Surface, WaveHeightSample, rfc3339};
use super::extract::{Asked, Id};
use super::problem::ApiError;
use crate::app::App;

/// How long a request waits for the first picture of a rig that nobody looked at before. They come at 2 Hz at most.
const PREVIEW_WAIT: Duration = Duration::from_secs(3);

/// The newest measured patch of water.
#[utoipa::path(get, path = "/api/v1/rigs/{id}/surface", tag = "sea", operation_id = "show_surface",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$")), responses((status = 200, body = Surface)))]
pub async fn surface(State(app): State<App>, Id(rig): Id<RigId>) -> Result<Json<Surface>, ApiError> {
    let now = app.now();
    let fleet = app.store.read();
    let kept = fleet.surfaces.get(&rig).ok_or_else(|| ApiError::NotFound(format!("rig {rig} has measured no surface")))?;
    Ok(Json(Surface::new(&kept.value, kept.stale, &fleet.edge(now))))
}

/// Where to get the newest pictures. Asking makes them flow; they stop some seconds after nobody asks any more.
#[utoipa::path(get, path = "/api/v1/rigs/{id}/preview", tag = "sea", operation_id = "show_preview",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$")), responses((status = 200, body = Preview)))]
pub async fn preview(State(app): State<App>, Id(rig): Id<RigId>) -> Result<Json<Preview>, ApiError> {
    let preview = newest_preview(&app, &rig).await?;
    let age_s = app.now().seconds_since(preview.stamp);
    Ok(Json(Preview {
        stamp: rfc3339(preview.stamp),
        age_s,
        left: format!("/api/v1/rigs/{rig}/preview/left.jpg"),
        disparity: format!("/api/v1/rigs/{rig}/preview/disparity.png"),
        rig: rig.to_string(),
    }))
}

/// The newest rectified left picture.
#[utoipa::path(get, path = "/api/v1/rigs/{id}/preview/left.jpg", tag = "sea", operation_id = "show_preview_left",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$")),
    responses((status = 200, body = [u8], content_type = "image/jpeg")))]
pub async fn preview_left(State(app): State<App>, Id(rig): Id<RigId>) -> Result<Response, ApiError> {
    let preview = newest_preview(&app, &rig).await?;
    Ok(([(header::CONTENT_TYPE, "image/jpeg")], preview.left_jpeg).into_response())
}

/// The newest disparity in colour.
#[utoipa::path(get, path = "/api/v1/rigs/{id}/preview/disparity.png", tag = "sea", operation_id = "show_preview_disparity",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$")),
    responses((status = 200, body = [u8], content_type = "image/png")))]
pub async fn preview_disparity(State(app): State<App>, Id(rig): Id<RigId>) -> Result<Response, ApiError> {
    let preview = newest_preview(&app, &rig).await?;
    Ok(([(header::CONTENT_TYPE, "image/png")], preview.disparity_png).into_response())
}

/// The newest preview; waits a little for one that is not stale, then takes what there is.
async fn newest_preview(app: &App, rig: &RigId) -> Result<model::Preview, ApiError> {
    let known = {
        let fleet = app.store.read();
        fleet.surfaces.get(rig).is_some() || fleet.previews.get(rig).is_some() || fleet.sea_states.get(rig).is_some()
    };
    if !known {
        // Otherwise anyone could make the bus look for any name.
        return Err(ApiError::NotFound(format!("no rig {rig} was ever heard")));
    }
    let mut news = app.store.preview_news();
    app.previews.want(rig);
    let fresh = async {
        loop {
            let held = app.store.read().previews.get(rig).filter(|kept| !kept.stale).map(|kept| kept.value.clone());
            if let Some(preview) = held {
                return Some(preview);
            }
            news.changed().await.ok()?;
        }
    };
    // Wall time: it bounds what a client waits.
    if let Ok(Some(preview)) = tokio::time::timeout(PREVIEW_WAIT, fresh).await {
        return Ok(preview);
    }
    let held = app.store.read().previews.get(rig).map(|kept| kept.value.clone());
    held.ok_or_else(|| ApiError::Unavailable(format!("rig {rig} has sent no picture yet")))
}

/// How much of a series.
#[derive(Debug, Clone, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
pub struct SeriesQuery {
    /// Only the last so many seconds; 120 if left out.
    #[param(exclusive_minimum = 0, maximum = 86400)]
    pub seconds: Option<f64>,
}

/// Elevation and significant height over the last minutes.
#[utoipa::path(get, path = "/api/v1/rigs/{id}/series", tag = "sea", operation_id = "show_series",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$"), SeriesQuery), responses((status = 200, body = Series)))]
pub async fn series(
    State(app): State<App>,
    Id(rig): Id<RigId>,
    Asked(query): Asked<SeriesQuery>,
) -> Result<Json<Series>, ApiError> {
    let seconds = query.seconds.unwrap_or(120.0);
    if !(seconds > 0.0 && seconds <= 86_400.0) {
        return Err(ApiError::BadRequest(format!("seconds must be above 0 and at most 86400, not {seconds}")));
    }
    let now = app.now();
    let fleet = app.store.read();
    let none = || ApiError::NotFound(format!("rig {rig} has measured no sea state"));
    let newest = fleet.sea_states.get(&rig).ok_or_else(none)?.value.stamp;
    let held = fleet.series(&rig).ok_or_else(none)?;
    let since = newest.plus_secs_f64(-seconds);
    let elevation = held
        .elevation_since(since)
        .map(|point| SeriesSample { t_s: point.stamp.seconds_since(newest), elevation_m: point.elevation_m });
    let h_s = held.h_s_since(since).map(|(stamp, h_s_m)| WaveHeightSample {
        t_s: stamp.seconds_since(newest),
        value: h_s_m.value,
        low: h_s_m.low,
        high: h_s_m.high,
    });
    Ok(Json(Series {
        rig: rig.to_string(),
        stamp: rfc3339(newest),
        age_s: now.seconds_since(newest),
        elevation: elevation.collect(),
        h_s: h_s.collect(),
    }))
}

/// The spectrum of the newest sea state, with its 95 % interval.
#[utoipa::path(get, path = "/api/v1/rigs/{id}/spectrum", tag = "sea", operation_id = "show_spectrum",
    params(("id" = String, Path, pattern = "^[A-Za-z0-9._-]{1,64}$")), responses((status = 200, body = Spectrum)))]
pub async fn spectrum(State(app): State<App>, Id(rig): Id<RigId>) -> Result<Json<Spectrum>, ApiError> {
    let now = app.now();
    let fleet = app.store.read();
    let none = || ApiError::NotFound(format!("rig {rig} has measured no spectrum"));
    let sea = fleet.sea_states.get(&rig).ok_or_else(none)?;
    Spectrum::new(&sea.value, &fleet.edge(now)).map(Json).ok_or_else(none)
}
