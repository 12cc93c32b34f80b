//! The dashboard, built into the program.

use axum::body::Body;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use rust_embed::{EmbeddedFile, RustEmbed};

use super::problem::ApiError;

#[derive(RustEmbed)]
#[folder = "../web/dist/"]
#[allow_missing = true]
struct Dashboard;

/// What a program built without the dashboard says.
const NOT_BUILT: &str = "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Halcyon</title>\
    <h1>Halcyon</h1><p>This program was built without its dashboard. In the source folder run <code>make web</code>, then build \
    again.</p><p>The REST API works; see <a href=\"/docs/\">its documentation</a>.</p></html>\n";

/// A file of the dashboard. A path without one, and without a file extension, is a view of the page, which knows its own paths.
///
/// # Errors
/// [`ApiError::NotFound`] for a file that is not there.
pub fn serve(path: &str, asked: &HeaderMap) -> Result<Response, ApiError> {
    let name = path.trim_start_matches('/');
    if let Some(file) = Dashboard::get(name).filter(|_| !name.is_empty()) {
        return Ok(file_response(name, file, asked));
    }
    if name.rsplit('/').next().is_some_and(|last| last.contains('.')) {
        return Err(ApiError::NotFound("there is no such file".into()));
    }
    Ok(match Dashboard::get("index.html") {
        Some(page) => file_response("index.html", page, asked),
        None => (StatusCode::OK, [(header::CONTENT_TYPE, "text/html; charset=utf-8")], NOT_BUILT).into_response(),
    })
}

fn file_response(name: &str, file: EmbeddedFile, asked: &HeaderMap) -> Response {
    let hash: String = file.metadata.sha256_hash()[..16].iter().map(|byte| format!("{byte:02x}")).collect();
    // Weak, since compression on the way changes the bytes.
    let etag = format!("W/\"{hash}\"");
    // The bundler puts a hash into the names under `assets`, so those never change.
    let cache = if name.starts_with("assets/") { "public, max-age=31536000, immutable" } else { "no-cache" };
    let unchanged = asked.get_all(header::IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok()).any(|value| {
        value.split(',').any(|tag| tag.trim() == "*" || tag.trim().trim_start_matches("W/") == etag.trim_start_matches("W/"))
    });
    let mut response =
        if unchanged { StatusCode::NOT_MODIFIED.into_response() } else { Response::new(Body::from(file.data.into_owned())) };
    let headers = response.headers_mut();
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static(cache));
    if let Ok(etag) = HeaderValue::from_str(&etag) {
        headers.insert(header::ETAG, etag);
    }
    if !unchanged && let Ok(kind) = HeaderValue::from_str(file.metadata.mimetype()) {
        headers.insert(header::CONTENT_TYPE, kind);
    }
    response
}
