//! The OpenAPI 3.1 document, made from the handlers themselves.

use std::sync::OnceLock;

use axum::extract::DefaultBodyLimit;
use axum::http::header;
use axum::response::IntoResponse;
use utoipa::OpenApi as _;
use utoipa::openapi::path::{Operation, Parameter, ParameterBuilder, ParameterIn};
use utoipa::openapi::schema::{ObjectBuilder, Type};
use utoipa::openapi::{ContentBuilder, OpenApi, Ref, RefOr, Required, Response, ResponseBuilder};
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use super::dto::{Problem, StreamMessage};
use super::{events, formations, missions, plan, probes, rigs, sea_states, services, stream, transfers, vehicles};
use crate::app::App;

/// Largest body of an upload of items: 700 with all digits are 200 kB.
const ITEMS_BYTES_MAX: usize = 512 * 1024;

#[derive(utoipa::OpenApi)]
#[openapi(
    info(
        title = "Halcyon",
        description = "Measure the water, then land on it: vehicles, missions and sea states of one fleet. Degrees and metres; \
            stamps are RFC 3339 in UTC on the fleet's clock. Errors are `application/problem+json` (RFC 9457). Every POST takes an \
            `Idempotency-Key`. `/api/v1/stream` is a WebSocket that sends `StreamMessage`s as text; `/api/v1/events/stream` sends \
            the same as server-sent events.",
        license(name = "Apache-2.0", identifier = "Apache-2.0"),
    ),
    tags(
        (name = "vehicles", description = "What flies, and commands to it"),
        (name = "autopilot", description = "Parameters, missions, fences and rally points that an autopilot keeps"),
        (name = "missions", description = "Survey, assess, approve, dispatch, land"),
        (name = "sea", description = "What the rigs measure"),
        (name = "fleet", description = "Plan, services, events, live stream"),
        (name = "probes", description = "For whatever keeps this running"),
    ),
    components(schemas(Problem, StreamMessage)),
)]
struct Document;

/// What a failure of any operation looks like.
fn problem_response() -> Response {
    let content = ContentBuilder::new().schema(Some(Ref::from_schema_name("Problem"))).build();
    ResponseBuilder::new().description("A problem").content("application/problem+json", content).build()
}

/// A header that every POST takes.
fn header_parameter(name: &str, description: &str, pattern: &str) -> RefOr<Parameter> {
    let parameter = ParameterBuilder::new()
        .name(name)
        .parameter_in(ParameterIn::Header)
        .required(Required::False)
        .description(Some(description))
        .schema(Some(ObjectBuilder::new().schema_type(Type::String).pattern(Some(pattern)).build()))
        .build();
    RefOr::T(parameter)
}

fn complete(operation: &mut Operation, post: bool, changes: bool) {
    operation.responses.responses.insert("default".into(), RefOr::T(problem_response()));
    let mut headers = Vec::new();
    if post {
        headers.push(header_parameter(
            "Idempotency-Key",
            "Makes a repeat harmless: the same key with the same request gets the first answer again.",
            "^[!-~]{1,255}$",
        ));
    }
    if changes {
        let description = "Who commands this, for the record.";
        headers.push(header_parameter("Halcyon-Operator", description, "^[!-~]([ -~]{0,62}[!-~])?$"));
    }
    if !headers.is_empty() {
        operation.parameters.get_or_insert_default().extend(headers);
    }
}

/// All routes of the API with their documentation.
pub fn routes() -> OpenApiRouter<App> {
    OpenApiRouter::with_openapi(Document::openapi())
        .routes(routes!(vehicles::list))
        .routes(routes!(vehicles::show))
        .routes(routes!(vehicles::command))
        .routes(routes!(formations::list, formations::order))
        .routes(routes!(formations::disband))
        .routes(routes!(transfers::read_parameters))
        .routes(routes!(transfers::set_parameter))
        .merge(
            // Hundreds of items are more than a command has.
            OpenApiRouter::new()
                .routes(routes!(transfers::download, transfers::upload, transfers::clear))
                .layer(DefaultBodyLimit::max(ITEMS_BYTES_MAX)),
        )
        .routes(routes!(missions::list, missions::create))
        .routes(routes!(missions::show))
        .routes(routes!(missions::approve))
        .routes(routes!(missions::dispatch))
        .routes(routes!(missions::pause))
        .routes(routes!(missions::resume))
        .routes(routes!(missions::abort))
        .routes(routes!(missions::release))
        .routes(routes!(missions::skip_release))
        .routes(routes!(missions::events))
        .routes(routes!(sea_states::list))
        .routes(routes!(rigs::surface))
        .routes(routes!(rigs::preview))
        .routes(routes!(rigs::preview_left))
        .routes(routes!(rigs::preview_disparity))
        .routes(routes!(rigs::series))
        .routes(routes!(rigs::spectrum))
        .routes(routes!(plan::show))
        .routes(routes!(services::list))
        .routes(routes!(events::list))
        .routes(routes!(stream::websocket))
        .routes(routes!(stream::server_sent))
        .routes(routes!(probes::healthz))
        .routes(routes!(probes::readyz))
        .routes(routes!(probes::metrics))
}

/// The document.
#[must_use]
pub fn document() -> OpenApi {
    let mut document = routes().into_openapi();
    for path in document.paths.paths.values_mut() {
        let operations = [
            (&mut path.get, false, false),
            (&mut path.post, true, true),
            (&mut path.put, false, true),
            (&mut path.delete, false, true),
        ];
        for (operation, post, changes) in operations {
            if let Some(operation) = operation {
                complete(operation, post, changes);
            }
        }
    }
    document
}

/// The document as indented JSON, without running anything.
#[must_use]
pub fn openapi_json() -> String {
    let mut text = document().to_pretty_json().unwrap_or_default();
    text.push('\n');
    text
}

/// Serves it.
pub async fn serve() -> impl IntoResponse {
    static TEXT: OnceLock<String> = OnceLock::new();
    ([(header::CONTENT_TYPE, "application/json")], TEXT.get_or_init(openapi_json).as_str())
}
