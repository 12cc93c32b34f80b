//! What a key of the bus is, as far as recording and replay care.

/// What is published on a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Stereo pairs and previews.
    Picture,
    /// What was measured, and what vehicles and services said of themselves.
    Report,
    /// Something that makes vehicles move, if they hear it: dispatch plans, and commands.
    Order,
    /// Not in the table of topics.
    Unknown,
}

/// The part of a key below `halcyon/v1/{fleet}/`.
#[must_use]
pub fn suffix(key: &str) -> Option<&str> {
    let (_fleet, suffix) = key.strip_prefix("halcyon/v1/")?.split_once('/')?;
    Some(suffix)
}

/// What is published on the key with this suffix.
#[must_use]
pub fn kind(suffix: &str) -> Kind {
    let parts: Vec<&str> = suffix.split('/').collect();
    match parts.as_slice() {
        ["rig", _, "pair" | "preview"] => Kind::Picture,
        ["rig", _, "surface" | "sea-state"]
        | ["vehicle" | "mission", _, "state"]
        | ["service", _, "health"]
        | ["sim", _, "truth"]
        | ["event"] => Kind::Report,
        ["plan"] | [.., "command"] => Kind::Order,
        _ => Kind::Unknown,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_are_never_taken_for_reports() {
        for (key, expected) in [
            ("halcyon/v1/alpha/rig/leader-1/pair", Kind::Picture),
            ("halcyon/v1/alpha/rig/leader-1/preview", Kind::Picture),
            ("halcyon/v1/alpha/rig/leader-1/surface", Kind::Report),
            ("halcyon/v1/alpha/rig/leader-1/sea-state", Kind::Report),
            ("halcyon/v1/alpha/vehicle/follower-1/state", Kind::Report),
            ("halcyon/v1/alpha/mission/m-1/state", Kind::Report),
            ("halcyon/v1/alpha/service/capture.leader-1/health", Kind::Report),
            ("halcyon/v1/alpha/event", Kind::Report),
            ("halcyon/v1/alpha/plan", Kind::Order),
            ("halcyon/v1/alpha/mission/command", Kind::Order),
            ("halcyon/v1/alpha/vehicle/follower-1/command", Kind::Order),
            ("halcyon/v1/alpha/plan/x", Kind::Unknown),
            ("halcyon/v1/alpha/new/thing", Kind::Unknown),
        ] {
            assert_eq!(suffix(key).map(kind), Some(expected), "{key}");
        }
        assert_eq!(suffix("halcyon/v2/alpha/plan"), None);
        assert_eq!(suffix("halcyon/v1/alpha"), None);
    }
}
