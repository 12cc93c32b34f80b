//! Identifiers. Each is a checked string, so that none can carry a `/` or a `*` into a key and be misrouted.

use std::fmt;
use std::str::FromStr;

/// Why a string is not an identifier.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{kind} identifier {text:?} must be 1 to 64 characters of a-z, A-Z, 0-9, '-', '_' or '.'")]
pub struct IdError {
    kind: &'static str,
    text: String,
}

macro_rules! id {
    ($(#[$doc:meta])* $name:ident, $kind:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub struct $name(String);

        impl $name {
            /// Checks and wraps `text`.
            ///
            /// # Errors
            /// [`IdError`] unless `text` is 1 to 64 characters of `a-z A-Z 0-9 - _ .`.
            pub fn new(text: impl Into<String>) -> Result<Self, IdError> {
                let text = text.into();
                let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
                if (1..=64).contains(&text.len()) && text.chars().all(allowed) {
                    Ok(Self(text))
                } else {
                    // Bounded: the text may be hostile and megabytes long.
                    Err(IdError { kind: $kind, text: text.chars().take(80).collect() })
                }
            }

            /// The identifier as text.
            #[must_use]
            pub fn as_str(&self) -> &str {
                &self.0
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.0)
            }
        }

        impl FromStr for $name {
            type Err = IdError;
            fn from_str(text: &str) -> Result<Self, IdError> {
                Self::new(text)
            }
        }
    };
}

id!(
    /// A fleet: the namespace of every key on the bus.
    FleetId,
    "fleet"
);
id!(
    /// One aircraft, leader or follower.
    VehicleId,
    "vehicle"
);
id!(
    /// One pair of cameras.
    RigId,
    "rig"
);
id!(
    /// One mission.
    MissionId,
    "mission"
);
id!(
    /// One running instance of a service, such as `capture.leader-1`.
    InstanceId,
    "instance"
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slash_or_a_wildcard_never_becomes_a_key() {
        for bad in ["", "a/b", "*", "**", "a b", "é", &"x".repeat(65)] {
            assert!(VehicleId::new(bad).is_err(), "{bad:?}");
        }
        assert_eq!(VehicleId::new("leader-1").map(|id| id.to_string()), Ok("leader-1".into()));
    }
}
