//! Formations as JSON.

use std::collections::BTreeMap;

use halcyon_model as model;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::SlotOffset;

/// The shape of a formation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum FormationShape {
    /// Abreast of the leader, by turns to its right and its left.
    Line,
    /// Behind the leader on both sides.
    Vee,
    /// One behind the other.
    Column,
}

impl From<FormationShape> for model::Shape {
    fn from(shape: FormationShape) -> Self {
        match shape {
            FormationShape::Line => Self::Line,
            FormationShape::Vee => Self::Vee,
            FormationShape::Column => Self::Column,
        }
    }
}

/// A formation to keep.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FormationRequest {
    /// About whom.
    #[schema(pattern = "^[A-Za-z0-9._-]{1,64}$")]
    pub leader: String,
    /// In which shape.
    pub shape: FormationShape,
    /// Between neighbours, metres.
    #[schema(exclusive_minimum = 0, maximum = 1000)]
    pub spacing_m: f64,
    /// Who; none named takes every follower that can be sent.
    #[serde(default)]
    #[schema(max_items = 16)]
    pub followers: Vec<String>,
}

/// A formation that is kept.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Formation {
    /// About whom.
    pub leader: String,
    /// Who keeps which slot.
    pub followers: BTreeMap<String, SlotOffset>,
}
