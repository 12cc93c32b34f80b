//! Numbers out of range, refused with the option or the quantity and the unit.

/// A number that cannot be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{name} must be {low} to {high}{unit}, not {}{hint}", shown(*value, unit))]
pub struct OutOfRange {
    /// The option, or what the number is.
    pub name: &'static str,
    /// What was given.
    pub value: f64,
    /// At least.
    pub low: f64,
    /// At most.
    pub high: f64,
    /// The unit with a space before it; empty for a plain number.
    pub unit: &'static str,
    /// What was probably meant; may be empty.
    pub hint: String,
}

/// A number with its unit; what is no number has none.
fn shown(value: f64, unit: &str) -> String {
    match value.abs() {
        size if !size.is_finite() => value.to_string(),
        // Nobody counts three hundred digits.
        size if size >= 1e9 => format!("{value:e}{unit}"),
        _ => format!("{value}{unit}"),
    }
}

impl OutOfRange {
    /// The same, with what was probably meant.
    #[must_use]
    pub fn with_hint(self, hint: String) -> Self {
        Self { hint, ..self }
    }
}

/// Refuses what lies outside; NaN lies outside of everything.
///
/// # Errors
/// [`OutOfRange`]
pub(crate) fn within(name: &'static str, value: f64, low: f64, high: f64, unit: &'static str) -> Result<(), OutOfRange> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(OutOfRange { name, value, low, high, unit, hint: String::new() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_are_within_and_nan_is_not() {
        assert!(within("--cell", 1.0, 1.0, 2.0, " m").is_ok() && within("--cell", 2.0, 1.0, 2.0, " m").is_ok());
        let refused = |value| within("--cell", value, 1.0, 2.0, " m").unwrap_err().to_string();
        for (value, text) in
            [(f64::NAN, "NaN"), (f64::INFINITY, "inf"), (f64::NEG_INFINITY, "-inf"), (0.999, "0.999 m"), (-1e308, "-1e308 m")]
        {
            assert_eq!(refused(value), format!("--cell must be 1 to 2 m, not {text}"));
        }
    }
}
