//! Units of time and length, as columns name them.

/// What a column's name says of its unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Stated<U> {
    /// Nothing.
    Nothing,
    /// This.
    Unit(U),
    /// Something that is none of ours: in brackets, or a unit of another quantity.
    Unknown(String),
}

/// Units of other quantities, which a name may end in without brackets: whatever is measured in them is no elevation.
#[rustfmt::skip]
const OTHERS: &[&str] = &[
    "pa", "hpa", "kpa", "mbar", "bar", "dbar", "psi", "v", "mv", "volt", "volts", "ma", "count", "counts", "raw", "bits", "adc",
    "digits", "deg", "degree", "degrees", "rad", "degc", "celsius", "kelvin", "hz", "mps", "m/s", "cm/s", "m/s2", "m/s^2",
    "m/s\u{b2}", "mg", "%", "db", "fathom", "fathoms",
];
/// What a line of units has where there is no unit, and for parts of a date.
const UNITLESS: &[&str] = &["", "-", "--", "1", "yr", "mo", "dy", "mn", "utc", "yyyy", "mm/dd/yyyy"];

/// What a name has in its last brackets; and what follows its last underscore or blank.
fn parts(name: &str) -> (Option<&str>, Option<&str>) {
    let bracketed = name.rfind([']', ')']).and_then(|end| {
        let start = name.get(..end)?.rfind(['[', '('])?;
        name.get(start + 1..end).map(str::trim)
    });
    let suffix = name.trim().rsplit_once(['_', ' ']).filter(|(rest, _)| !rest.trim().is_empty()).map(|(_, suffix)| suffix);
    (bracketed, suffix)
}

fn is_among(text: &str, of: &[&str]) -> bool {
    of.iter().any(|one| text.eq_ignore_ascii_case(one))
}

/// Declares a unit: its variants, names and factors.
macro_rules! unit {
    ($(#[$doc:meta])* $name:ident { $($(#[$variant_doc:meta])* $variant:ident = $text:literal $(| $alias:literal)*, $factor:expr;)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq)]
        pub enum $name { $($(#[$variant_doc])* $variant,)* }

        impl $name {
            /// How they are written.
            pub const NAMES: &'static [&'static str] = &[$($text,)*];

            /// As it is written.
            #[must_use]
            pub fn as_str(self) -> &'static str {
                match self { $(Self::$variant => $text,)* }
            }

            /// In SI.
            #[must_use]
            pub fn factor(self) -> f64 {
                match self { $(Self::$variant => $factor,)* }
            }

            /// Of its name, in whatever case.
            #[must_use]
            pub fn named(text: &str) -> Option<Self> {
                $(if is_among(text, &[$text $(, $alias)*]) { return Some(Self::$variant); })*
                None
            }

            /// What a column's name says: `eta_mm`, `eta [mm]`, `ETA (MM)`, `eta (m) NAVD88`.
            pub(super) fn stated(name: &str) -> Stated<Self> {
                let (bracketed, suffix) = parts(name);
                if let Some(text) = bracketed.filter(|text| !is_among(text, UNITLESS)) {
                    return Self::named(text).map_or_else(|| Stated::Unknown(text.to_owned()), Stated::Unit);
                }
                match suffix {
                    Some(text) if is_among(text, OTHERS) => Stated::Unknown(text.to_owned()),
                    Some(text) => Self::named(text).map_or(Stated::Nothing, Stated::Unit),
                    None => Stated::Nothing,
                }
            }
        }
    };
}

unit! {
    /// A unit of time.
    TimeUnit {
        /// Nanoseconds.
        Nanoseconds = "ns" | "nsec" | "nanosecond" | "nanoseconds", 1e-9;
        /// Microseconds.
        Microseconds = "us" | "\u{b5}s" | "\u{3bc}s" | "usec" | "microsecond" | "microseconds", 1e-6;
        /// Milliseconds.
        Milliseconds = "ms" | "msec" | "millis" | "millisecond" | "milliseconds", 1e-3;
        /// Seconds.
        Seconds = "s" | "sec" | "secs" | "second" | "seconds", 1.0;
        /// Minutes.
        Minutes = "min" | "mins" | "minute" | "minutes", 60.0;
        /// Hours.
        Hours = "h" | "hr" | "hrs" | "hour" | "hours", 3600.0;
        /// Days, as in spreadsheets and Matlab.
        Days = "d" | "day" | "days", 86_400.0;
    }
}

unit! {
    /// A unit of elevation.
    LengthUnit {
        /// Millimetres.
        Millimetres = "mm" | "millimetre" | "millimetres" | "millimeter" | "millimeters", 1e-3;
        /// Centimetres.
        Centimetres = "cm" | "centimetre" | "centimetres" | "centimeter" | "centimeters", 1e-2;
        /// Decimetres.
        Decimetres = "dm" | "decimetre" | "decimetres" | "decimeter" | "decimeters", 0.1;
        /// Metres.
        Metres = "m" | "metre" | "metres" | "meter" | "meters", 1.0;
        /// Feet.
        Feet = "ft" | "foot" | "feet", 0.3048;
        /// Inches.
        Inches = "in" | "inch" | "inches", 0.0254;
    }
}

/// Whether a cell of a header is a unit, in brackets or not, or stands for none: with the others on its line it may be a line of units.
pub(super) fn is_unit(cell: &str) -> bool {
    let text = bare(cell);
    is_among(text, UNITLESS) || is_among(text, OTHERS) || TimeUnit::named(text).is_some() || LengthUnit::named(text).is_some()
}

/// A name with the unit that stands below it.
pub(super) fn with_unit(name: &str, cell: &str) -> String {
    let text = bare(cell);
    if is_among(text, UNITLESS) || parts(name).0.is_some() { name.to_owned() } else { format!("{name} [{text}]") }
}

fn bare(cell: &str) -> &str {
    cell.trim().trim_start_matches(['[', '(']).trim_end_matches([']', ')']).trim()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_told_from_a_name_and_what_is_no_length_is_not_taken_for_one() {
        use LengthUnit::{Centimetres, Feet, Inches, Metres, Millimetres};
        for (name, unit) in [
            ("eta_mm", Millimetres),
            ("Level [CM]", Centimetres),
            ("level (Feet)", Feet),
            ("water level (m) NAVD88", Metres),
            ("stage_in", Inches),
            ("z Meters", Metres),
        ] {
            assert_eq!(LengthUnit::stated(name), Stated::Unit(unit), "{name}");
        }
        for name in
            ["pressure (dbar)", "eta [kPa]", "level_psi", "eta (m/s)", "probe [counts]", "level (corrected)", "sensor mV"]
        {
            assert!(matches!(LengthUnit::stated(name), Stated::Unknown(_)), "{name}");
        }
        for name in ["eta", "water_level", "level 2", "mm", "_", "", "(", ")(", "a)b", "eta ()"] {
            assert_eq!(LengthUnit::stated(name), Stated::Nothing, "{name}");
        }
        assert_eq!(TimeUnit::stated("Time (Sec)"), Stated::Unit(TimeUnit::Seconds));
        assert_eq!(TimeUnit::stated("elapsed_hrs"), Stated::Unit(TimeUnit::Hours));
    }
}
