//! Reading one field: present, finite, in range, of the right length, or an error that names it.

use halcyon_model::Stamp;

/// Why one field was refused. `path` is dotted, such as `grid.cell_m`.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{path} {problem}")]
pub struct FieldError {
    path: String,
    problem: String,
}

impl FieldError {
    pub(crate) fn new(path: &str, problem: impl Into<String>) -> Self {
        Self { path: path.to_owned(), problem: problem.into() }
    }

    /// The dotted path of the field.
    #[must_use]
    pub fn path(&self) -> &str {
        &self.path
    }
}

/// Why bytes were refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WireError {
    /// Not such a protobuf message at all.
    #[error("not a {message} message")]
    Decode {
        /// The expected message.
        message: &'static str,
        /// What prost says.
        #[source]
        source: prost::DecodeError,
    },
    /// A field is missing or invalid.
    #[error("{message} refused")]
    Field {
        /// The message.
        message: &'static str,
        /// Which field, and why.
        #[source]
        source: FieldError,
    },
}

/// Prefixes the path of a nested message's error.
pub(crate) trait Within<T> {
    fn within(self, parent: &str) -> Result<T, FieldError>;
}

impl<T> Within<T> for Result<T, FieldError> {
    fn within(self, parent: &str) -> Result<T, FieldError> {
        self.map_err(|error| FieldError { path: format!("{parent}.{}", error.path), problem: error.problem })
    }
}

/// A nested message that must be there, converted.
pub(crate) fn required<P, T>(
    path: &str,
    value: Option<P>,
    convert: impl FnOnce(P) -> Result<T, FieldError>,
) -> Result<T, FieldError> {
    convert(value.ok_or_else(|| FieldError::new(path, "is missing"))?).within(path)
}

/// A nested message that may be absent, converted.
pub(crate) fn optional<P, T>(
    path: &str,
    value: Option<P>,
    convert: impl FnOnce(P) -> Result<T, FieldError>,
) -> Result<Option<T>, FieldError> {
    value.map(convert).transpose().within(path)
}

pub(crate) fn finite(path: &str, value: f64) -> Result<f64, FieldError> {
    if value.is_finite() { Ok(value) } else { Err(FieldError::new(path, format!("must be finite, not {value}"))) }
}

pub(crate) fn positive(path: &str, value: f64) -> Result<f64, FieldError> {
    if value.is_finite() && value > 0.0 {
        Ok(value)
    } else {
        Err(FieldError::new(path, format!("must be above 0, not {value}")))
    }
}

/// Finite and at least 0: standard deviations, durations.
pub(crate) fn non_negative(path: &str, value: f64) -> Result<f64, FieldError> {
    if value.is_finite() && value >= 0.0 {
        Ok(value)
    } else {
        Err(FieldError::new(path, format!("must be finite and not negative, not {value}")))
    }
}

/// 0 to 1.
pub(crate) fn fraction(path: &str, value: f64) -> Result<f64, FieldError> {
    if (0.0..=1.0).contains(&value) { Ok(value) } else { Err(FieldError::new(path, format!("must be in 0 to 1, not {value}"))) }
}

pub(crate) fn optionally(
    path: &str,
    value: Option<f64>,
    check: impl FnOnce(&str, f64) -> Result<f64, FieldError>,
) -> Result<Option<f64>, FieldError> {
    value.map(|value| check(path, value)).transpose()
}

pub(crate) fn id<T: std::str::FromStr<Err = halcyon_model::IdError>>(path: &str, text: &str) -> Result<T, FieldError> {
    text.parse().map_err(|error: halcyon_model::IdError| FieldError::new(path, error.to_string()))
}

/// An identifier for which the empty string says "none".
pub(crate) fn optional_id<T: std::str::FromStr<Err = halcyon_model::IdError>>(
    path: &str,
    text: &str,
) -> Result<Option<T>, FieldError> {
    if text.is_empty() { Ok(None) } else { id(path, text).map(Some) }
}

/// Free text for people: bounded, so that nobody fills a log or a page.
pub(crate) fn text(path: &str, text: String) -> Result<String, FieldError> {
    const BYTES_MAX: usize = 4096;
    if text.len() <= BYTES_MAX { Ok(text) } else { Err(FieldError::new(path, format!("is longer than {BYTES_MAX} bytes"))) }
}

/// Exactly `N` finite numbers.
pub(crate) fn numbers<const N: usize>(path: &str, values: &[f64]) -> Result<[f64; N], FieldError> {
    let values: [f64; N] =
        values.try_into().map_err(|_| FieldError::new(path, format!("must hold {N} numbers, not {}", values.len())))?;
    values.iter().try_for_each(|&value| finite(path, value).map(drop))?;
    Ok(values)
}

/// A wire enum's number as its type.
pub(crate) fn known<E: TryFrom<i32>>(path: &str, number: i32) -> Result<E, FieldError> {
    E::try_from(number).map_err(|_| FieldError::new(path, format!("has the unknown value {number}")))
}

/// The error for a wire enum's zero.
pub(crate) fn unspecified(path: &str) -> FieldError {
    FieldError::new(path, "is not specified")
}

/// Schema version and source time, which every message of its own begins with.
pub(crate) fn header(schema_version: u32, stamp_ns: i64) -> Result<Stamp, FieldError> {
    if schema_version == crate::SCHEMA_VERSION {
        Ok(Stamp::from_nanos(stamp_ns))
    } else {
        Err(FieldError::new("schema_version", format!("is {schema_version}; this build reads {}", crate::SCHEMA_VERSION)))
    }
}
