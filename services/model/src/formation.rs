//! Several followers in a shape about one leader.

use crate::id::VehicleId;

/// The shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Shape {
    /// Abreast of the leader, by turns to its right and its left: the thesis's (6-1 … 6-8) for any number.
    Line,
    /// Behind the leader on both sides, like geese.
    Vee,
    /// One behind the other.
    Column,
}

impl Shape {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Line, Self::Vee, Self::Column];

    /// In a word.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Line => "line",
            Self::Vee => "vee",
            Self::Column => "column",
        }
    }

    /// From the word.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|shape| shape.as_str() == name)
    }
}

/// A formation that is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct FormationSpec {
    /// About whom.
    pub leader: VehicleId,
    /// In which shape.
    pub shape: Shape,
    /// Between neighbours, metres.
    pub spacing_m: f64,
    /// Who; empty takes every follower that can be sent.
    pub followers: Vec<VehicleId>,
}
