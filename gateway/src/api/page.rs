//! Lists in pages.

use std::cmp::Ordering;
use std::fmt::{self, Display};
use std::str::FromStr;

use halcyon_model::MissionId;
use serde::Deserialize;
use utoipa::IntoParams;

use super::dto::Page;
use super::problem::ApiError;

/// Which page of a list, whatever its cursors look like.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PageQuery {
    /// At most so many items; 100 if left out.
    pub limit: Option<usize>,
    /// `next` of the page before.
    pub after: Option<String>,
}

macro_rules! page_query {
    ($(#[$doc:meta])* $name:ident, $pattern:literal) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Deserialize, IntoParams)]
        #[serde(deny_unknown_fields)]
        #[into_params(parameter_in = Query)]
        pub struct $name {
            /// At most so many items; 100 if left out.
            #[param(minimum = 1, maximum = 1000)]
            pub limit: Option<usize>,
            /// `next` of the page before.
            #[param(pattern = $pattern)]
            pub after: Option<String>,
        }

        impl From<$name> for PageQuery {
            fn from(query: $name) -> Self {
                Self { limit: query.limit, after: query.after }
            }
        }
    };
}

page_query!(
    /// Which page of a list by identifier.
    IdPageQuery,
    "^[A-Za-z0-9._-]{1,64}$"
);
page_query!(
    /// Which page of the missions.
    MissionPageQuery,
    "^-?[0-9]{1,18}~[A-Za-z0-9._-]{1,64}$"
);
page_query!(
    /// Which page of events.
    EventPageQuery,
    "^[0-9]{1,19}$"
);

/// Most items on a page.
const LIMIT_MAX: usize = 1000;

/// Cuts a page from `items`, which come in ascending order of their cursors. The cursor asked for need not be in the list any more.
///
/// # Errors
/// [`ApiError::BadRequest`] for a limit out of range or a cursor that is none.
pub fn page<C: Ord + Display + FromStr, T, J>(
    items: impl Iterator<Item = (C, T)>,
    query: &PageQuery,
    json: impl Fn(T) -> J,
) -> Result<Page<J>, ApiError> {
    let limit = query.limit.unwrap_or(100);
    if !(1..=LIMIT_MAX).contains(&limit) {
        return Err(ApiError::BadRequest(format!("limit must be 1 to {LIMIT_MAX}, not {limit}")));
    }
    let bad_cursor = || ApiError::BadRequest("after must be `next` of an earlier page".into());
    let after = query.after.as_deref().map(|text| text.parse::<C>().map_err(|_| bad_cursor())).transpose()?;
    let mut page = Page { items: Vec::new(), next: None };
    let mut last = None;
    for (cursor, item) in items {
        if after.as_ref().is_some_and(|after| cursor <= *after) {
            continue;
        }
        if page.items.len() == limit {
            page.next = last.map(|last: C| last.to_string());
            break;
        }
        page.items.push(json(item));
        last = Some(cursor);
    }
    Ok(page)
}

/// Cursor of a list that runs from the newest event to the oldest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EventCursor(pub u64);

impl Ord for EventCursor {
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.cmp(&self.0)
    }
}

impl PartialOrd for EventCursor {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Display for EventCursor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl FromStr for EventCursor {
    type Err = std::num::ParseIntError;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        text.parse().map(Self)
    }
}

/// Cursor of a list that runs from the newest mission to the oldest.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MissionCursor {
    /// When it was created, nanoseconds.
    pub created_ns: i64,
    /// Which.
    pub id: MissionId,
}

impl Ord for MissionCursor {
    fn cmp(&self, other: &Self) -> Ordering {
        other.created_ns.cmp(&self.created_ns).then_with(|| self.id.cmp(&other.id))
    }
}

impl PartialOrd for MissionCursor {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Display for MissionCursor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}~{}", self.created_ns, self.id)
    }
}

/// Not a mission cursor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BadCursor;

impl FromStr for MissionCursor {
    type Err = BadCursor;
    fn from_str(text: &str) -> Result<Self, BadCursor> {
        // `~` is in no identifier.
        let (created_ns, id) = text.split_once('~').ok_or(BadCursor)?;
        Ok(Self { created_ns: created_ns.parse().map_err(|_| BadCursor)?, id: id.parse().map_err(|_| BadCursor)? })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ask(limit: usize, after: Option<&str>) -> PageQuery {
        PageQuery { limit: Some(limit), after: after.map(Into::into) }
    }

    #[test]
    fn pages_join_up_without_gaps_or_repeats() {
        let events = || (1..=25_u64).rev().map(|number| (EventCursor(number), number));
        let (mut all, mut after) = (Vec::new(), None::<String>);
        loop {
            let page = page(events(), &ask(10, after.as_deref()), |number| number).unwrap();
            all.extend(page.items);
            after = page.next;
            if after.is_none() {
                break;
            }
        }
        assert_eq!(all, (1..=25).rev().collect::<Vec<_>>());
    }

    #[test]
    fn a_full_last_page_has_no_next() {
        let events = || (1..=10_u64).rev().map(|number| (EventCursor(number), number));
        assert_eq!(page(events(), &ask(10, None), |number| number).unwrap().next, None);
    }

    #[test]
    fn nonsense_is_refused() {
        let none = || std::iter::empty::<(EventCursor, u64)>();
        assert!(page(none(), &ask(0, None), |number| number).is_err());
        assert!(page(none(), &ask(1001, None), |number| number).is_err());
        assert!(page(none(), &ask(1, Some("x")), |number| number).is_err());
        assert_eq!("12~a/b".parse::<MissionCursor>(), Err(BadCursor));
        let cursor = MissionCursor { created_ns: -3, id: MissionId::new("m-1").unwrap() };
        assert_eq!(cursor.to_string().parse(), Ok(cursor));
    }
}
