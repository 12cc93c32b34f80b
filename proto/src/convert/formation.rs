use halcyon_model::{FormationSpec, Shape};

use crate::field::{FieldError, id, known, positive, unspecified};
use crate::v1;

pub(super) fn formation_to(spec: &FormationSpec) -> v1::FormationSpec {
    let shape = match spec.shape {
        Shape::Line => v1::Shape::Line,
        Shape::Vee => v1::Shape::Vee,
        Shape::Column => v1::Shape::Column,
    };
    v1::FormationSpec {
        leader_id: spec.leader.to_string(),
        shape: shape.into(),
        spacing_m: spec.spacing_m,
        follower_ids: spec.followers.iter().map(ToString::to_string).collect(),
    }
}

pub(super) fn formation_from(proto: &v1::FormationSpec) -> Result<FormationSpec, FieldError> {
    let shape = match known::<v1::Shape>("form.shape", proto.shape)? {
        v1::Shape::Unspecified => return Err(unspecified("form.shape")),
        v1::Shape::Line => Shape::Line,
        v1::Shape::Vee => Shape::Vee,
        v1::Shape::Column => Shape::Column,
    };
    Ok(FormationSpec {
        leader: id("form.leader_id", &proto.leader_id)?,
        shape,
        spacing_m: positive("form.spacing_m", proto.spacing_m)?,
        followers: proto.follower_ids.iter().map(|follower| id("form.follower_ids", follower)).collect::<Result<_, _>>()?,
    })
}
