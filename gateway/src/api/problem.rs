//! The one API error and its one mapping to a response.

use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};

use super::dto::Problem;
use crate::port::CommandFailure;

/// Why a request failed. Becomes `application/problem+json`; the path is filled in on the way out by [`name_the_path`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ApiError {
    /// The request makes no sense: 400.
    #[error("{0}")]
    BadRequest(String),
    /// There is no such thing: 404.
    #[error("{0}")]
    NotFound(String),
    /// Not with this method: 405.
    #[error("{0}")]
    MethodNotAllowed(String),
    /// Refused, with the reason: 409.
    #[error("{0}")]
    Refused(String),
    /// The same request is still being carried out: 409.
    #[error("{0}")]
    InProgress(String),
    /// Body too large: 413.
    #[error("{0}")]
    TooLarge(String),
    /// Not JSON by its content type: 415.
    #[error("{0}")]
    MediaType(String),
    /// Asked under a name, or from a page, that is not ours: 403.
    #[error("{0}")]
    Forbidden(String),
    /// Well-formed, but means nothing here: 422.
    #[error("{0}")]
    Invalid(String),
    /// A WebSocket was expected: 426.
    #[error("{0}")]
    UpgradeRequired(String),
    /// A defect of ours; the cause goes to the log, not to the client: 500.
    #[error("the gateway failed; its log says why")]
    Internal,
    /// Cannot serve it now; try again: 503.
    #[error("{0}")]
    Unavailable(String),
    /// No answer in time: 504.
    #[error("{0}")]
    Timeout(String),
}

impl ApiError {
    /// Status, stable word and title.
    #[must_use]
    pub fn kind(&self) -> (StatusCode, &'static str, &'static str) {
        match self {
            Self::BadRequest(_) => (StatusCode::BAD_REQUEST, "bad-request", "Bad request"),
            Self::NotFound(_) => (StatusCode::NOT_FOUND, "not-found", "Not found"),
            Self::MethodNotAllowed(_) => (StatusCode::METHOD_NOT_ALLOWED, "method-not-allowed", "Method not allowed"),
            Self::Refused(_) => (StatusCode::CONFLICT, "refused", "Command refused"),
            Self::InProgress(_) => (StatusCode::CONFLICT, "in-progress", "Still in progress"),
            Self::TooLarge(_) => (StatusCode::PAYLOAD_TOO_LARGE, "too-large", "Request too large"),
            Self::MediaType(_) => (StatusCode::UNSUPPORTED_MEDIA_TYPE, "media-type", "Unsupported media type"),
            Self::Forbidden(_) => (StatusCode::FORBIDDEN, "forbidden", "Forbidden"),
            Self::Invalid(_) => (StatusCode::UNPROCESSABLE_ENTITY, "invalid", "Invalid request"),
            Self::UpgradeRequired(_) => (StatusCode::UPGRADE_REQUIRED, "upgrade-required", "WebSocket expected"),
            Self::Internal => (StatusCode::INTERNAL_SERVER_ERROR, "internal", "Internal error"),
            Self::Unavailable(_) => (StatusCode::SERVICE_UNAVAILABLE, "unavailable", "Not available now"),
            Self::Timeout(_) => (StatusCode::GATEWAY_TIMEOUT, "timeout", "No answer in time"),
        }
    }

    /// A command that got no answer from `whom`.
    #[must_use]
    pub fn no_answer(whom: &str, failure: &CommandFailure) -> Self {
        match failure {
            CommandFailure::Nobody => Self::Unavailable(format!("{whom} is not there; nothing was done")),
            CommandFailure::Timeout(_) => Self::Timeout(format!(
                "{whom}: {failure}; whether it was carried out is not known, so look before trying again"
            )),
            CommandFailure::Bus(_) => Self::Unavailable(format!("{whom} could not be asked: {failure}")),
        }
    }
}

/// Problems are RFC 9457's.
pub const PROBLEM_JSON: HeaderValue = HeaderValue::from_static("application/problem+json");

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let (status, ..) = self.kind();
        let mut response = status.into_response();
        if matches!(status, StatusCode::SERVICE_UNAVAILABLE) || matches!(self, Self::InProgress(_)) {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from_static("1"));
        }
        if matches!(self, Self::UpgradeRequired(_)) {
            response.headers_mut().insert(header::UPGRADE, HeaderValue::from_static("websocket"));
        }
        response.extensions_mut().insert(self);
        response
    }
}

/// Writes the body of a response that carries an [`ApiError`], now that the path is known. Leaves others as they are.
#[must_use]
pub fn name_the_path(mut response: Response, path: &str) -> Response {
    let Some(error) = response.extensions_mut().remove::<ApiError>() else { return response };
    let (status, word, title) = error.kind();
    let problem = Problem {
        kind: format!("urn:halcyon:problem:{word}"),
        title: title.into(),
        status: status.as_u16(),
        detail: error.to_string(),
        instance: path.into(),
    };
    // A struct of strings and a number always serialises.
    let body = serde_json::to_vec(&problem).unwrap_or_default();
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, PROBLEM_JSON);
    headers.remove(header::CONTENT_LENGTH);
    *response.body_mut() = body.into();
    response
}
