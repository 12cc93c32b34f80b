//! Shapes of a formation: slots about a leader, in its heading frame.

use std::f64::consts::FRAC_1_SQRT_2;

use halcyon_model::{Shape, Slot};

/// The first `count` slots of a shape, at the leader's height. Neighbours are `spacing_m` apart; nobody is nearer than that to
/// anybody, the leader included.
#[must_use]
pub fn shape(shape: Shape, count: usize, spacing_m: f64) -> Vec<Slot> {
    (0..count)
        .map(|index| {
            // The pair's number from the leader outwards, and the side: right first.
            let out_m = spacing_m * (index / 2 + 1) as f64;
            let side = if index % 2 == 0 { 1.0 } else { -1.0 };
            let (forward_m, right_m) = match shape {
                Shape::Line => (0.0, side * out_m),
                Shape::Vee => (-out_m * FRAC_1_SQRT_2, side * out_m * FRAC_1_SQRT_2),
                Shape::Column => (-spacing_m * (index + 1) as f64, 0.0),
            };
            Slot { forward_m, right_m, up_m: 0.0 }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_is_nearer_than_the_spacing_and_everybody_has_a_neighbour_just_there() {
        let (spacing_m, count) = (7.0, 9);
        for kind in Shape::ALL {
            let mut places = vec![(0.0, 0.0)];
            places.extend(shape(kind, count, spacing_m).iter().map(|slot| (slot.forward_m, slot.right_m)));
            assert_eq!(places.len(), count + 1);
            for (index, a) in places.iter().enumerate() {
                let others = places.iter().enumerate().filter(|(other, _)| *other != index);
                let nearest_m = others.map(|(_, b)| f64::hypot(a.0 - b.0, a.1 - b.1)).fold(f64::INFINITY, f64::min);
                assert!((nearest_m - spacing_m).abs() < 1e-9, "{kind:?} {index}: {nearest_m}");
            }
            assert_eq!(Shape::from_name(kind.as_str()), Some(kind));
        }
        assert_eq!(Shape::from_name("circle"), None);
        assert!(shape(Shape::Vee, 0, 7.0).is_empty());
    }

    #[test]
    fn the_thesiss_slot_comes_first() {
        assert_eq!(shape(Shape::Line, 2, 5.0)[0], Slot { forward_m: 0.0, right_m: 5.0, up_m: 0.0 });
        assert_eq!(shape(Shape::Line, 2, 5.0)[1], Slot { forward_m: 0.0, right_m: -5.0, up_m: 0.0 });
        let vee = shape(Shape::Vee, 2, 5.0);
        assert!(vee.iter().all(|slot| slot.forward_m < 0.0 && slot.right_m.abs() + slot.forward_m < 1e-12));
    }
}
