//! Headers of our own.

use axum::http::HeaderName;

/// Names a request across its repeats (draft-ietf-httpapi-idempotency-key-header).
pub const IDEMPOTENCY_KEY: HeaderName = HeaderName::from_static("idempotency-key");

/// Who commands, for the record.
pub const OPERATOR: HeaderName = HeaderName::from_static("halcyon-operator");
