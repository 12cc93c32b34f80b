//! `Idempotency-Key` on every POST: the same key with the same request gets the first answer again, so that a client may repeat
//! a command whose answer was lost (draft-ietf-httpapi-idempotency-key-header).

use std::collections::{HashMap, VecDeque};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::PoisonError;

use axum::body::{Body, Bytes, to_bytes};
use axum::extract::{Request, State};
use axum::http::{HeaderMap, HeaderValue, Method, StatusCode};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use super::headers::{IDEMPOTENCY_KEY, OPERATOR};
use super::problem::ApiError;
use crate::app::App;

/// Keys remembered; the oldest is forgotten first.
const KEYS_MAX: usize = 1024;
/// Longest answer remembered, bytes. Ours are far shorter.
const ANSWER_BYTES_MAX: usize = 256 * 1024;

/// Names the request across its repeats: what is made up for it, such as a mission's identifier, derives from this.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RequestToken(pub Uuid);

#[derive(Debug, Clone)]
enum Answer {
    /// A problem; its body is written further out.
    Problem(ApiError),
    /// Anything else.
    Plain { status: StatusCode, headers: HeaderMap, body: Bytes },
}

impl Answer {
    fn status(&self) -> StatusCode {
        match self {
            Self::Problem(error) => error.kind().0,
            Self::Plain { status, .. } => *status,
        }
    }
}

impl IntoResponse for Answer {
    fn into_response(self) -> Response {
        match self {
            Self::Problem(error) => error.into_response(),
            Self::Plain { status, headers, body } => (status, headers, body).into_response(),
        }
    }
}

#[derive(Debug)]
enum Progress {
    /// Being carried out.
    Running,
    /// The last try failed on our side, so it may be tried again.
    Open,
    /// Answered.
    Done(Answer),
}

#[derive(Debug)]
struct Entry {
    fingerprint: u64,
    token: RequestToken,
    progress: Progress,
}

/// Answers by key, bounded.
#[derive(Debug, Default)]
pub struct Cache {
    entries: HashMap<String, Entry>,
    order: VecDeque<String>,
}

enum Begin {
    Run(RequestToken),
    Replay(Answer),
}

impl Cache {
    fn begin(&mut self, key: &str, fingerprint: u64) -> Result<Begin, ApiError> {
        if let Some(entry) = self.entries.get_mut(key) {
            if entry.fingerprint != fingerprint {
                return Err(ApiError::Invalid("this Idempotency-Key was used for a different request".into()));
            }
            return match &entry.progress {
                Progress::Running => {
                    Err(ApiError::InProgress("the request with this Idempotency-Key is still being carried out".into()))
                }
                Progress::Done(answer) => Ok(Begin::Replay(answer.clone())),
                Progress::Open => {
                    entry.progress = Progress::Running;
                    Ok(Begin::Run(entry.token))
                }
            };
        }
        while self.order.len() >= KEYS_MAX {
            self.order.pop_front().and_then(|oldest| self.entries.remove(&oldest));
        }
        let token = RequestToken(Uuid::new_v4());
        self.order.push_back(key.into());
        self.entries.insert(key.into(), Entry { fingerprint, token, progress: Progress::Running });
        Ok(Begin::Run(token))
    }

    fn end(&mut self, key: &str, answer: Option<Answer>) {
        // What is settled stays settled.
        if let Some(entry) = self.entries.get_mut(key)
            && matches!(entry.progress, Progress::Running)
        {
            entry.progress = answer.map_or(Progress::Open, Progress::Done);
        }
    }
}

/// The key: 1 to 255 visible ASCII characters.
fn key(headers: &HeaderMap) -> Result<Option<String>, ApiError> {
    let Some(value) = headers.get(IDEMPOTENCY_KEY) else { return Ok(None) };
    match value.to_str() {
        Ok(text) if (1..=255).contains(&text.len()) && text.chars().all(|c| c.is_ascii_graphic()) => Ok(Some(text.into())),
        _ => Err(ApiError::BadRequest("Idempotency-Key must be 1 to 255 visible ASCII characters".into())),
    }
}

/// Middleware; see the module. Leaves everything but POST alone.
pub async fn layer(State(app): State<App>, mut request: Request, next: Next) -> Result<Response, ApiError> {
    if request.method() != Method::POST {
        return Ok(next.run(request).await);
    }
    let Some(key) = key(request.headers())? else {
        request.extensions_mut().insert(RequestToken(Uuid::new_v4()));
        return Ok(next.run(request).await);
    };

    let (mut parts, body) = request.into_parts();
    let limit = app.config.body_bytes_max;
    let body = to_bytes(body, limit)
        .await
        .map_err(|_| ApiError::TooLarge(format!("the body could not be read, or has more than {limit} bytes")))?;
    let mut hasher = DefaultHasher::new();
    // Who commands belongs to the request.
    let operator = parts.headers.get(OPERATOR).map(HeaderValue::as_bytes);
    (parts.uri.path(), parts.uri.query(), operator, &body[..]).hash(&mut hasher);
    let begun = app.idempotency.lock().unwrap_or_else(PoisonError::into_inner).begin(&key, hasher.finish())?;
    let token = match begun {
        Begin::Replay(answer) => {
            let mut response = answer.into_response();
            response.headers_mut().insert("idempotent-replayed", HeaderValue::from_static("true"));
            return Ok(response);
        }
        Begin::Run(token) => token,
    };
    parts.extensions.insert(token);

    // On a task of its own: a client that hangs up must not leave the command half-asked and its key locked.
    let task = tokio::spawn(async move {
        let open_again = OpenAgain { app: &app, key: &key };
        let answer = read(next.run(Request::from_parts(parts, Body::from(body))).await).await;
        if !answer.status().is_server_error() {
            end(&app, &key, Some(answer.clone()));
        }
        drop(open_again);
        answer
    });
    match task.await {
        Ok(answer) => Ok(answer.into_response()),
        Err(_) => Err(ApiError::Internal),
    }
}

/// Lets the request be tried again unless it was settled, whether the handler failed or panicked.
struct OpenAgain<'a> {
    app: &'a App,
    key: &'a str,
}

impl Drop for OpenAgain<'_> {
    fn drop(&mut self) {
        end(self.app, self.key, None);
    }
}

fn end(app: &App, key: &str, answer: Option<Answer>) {
    app.idempotency.lock().unwrap_or_else(PoisonError::into_inner).end(key, answer);
}

/// Reads a response whole, so that it can be both sent and remembered.
async fn read(mut response: Response) -> Answer {
    if let Some(error) = response.extensions_mut().remove::<ApiError>() {
        return Answer::Problem(error);
    }
    let (parts, body) = response.into_parts();
    match to_bytes(body, ANSWER_BYTES_MAX).await {
        Ok(body) => Answer::Plain { status: parts.status, headers: parts.headers, body },
        Err(_) => Answer::Problem(ApiError::Internal),
    }
}
