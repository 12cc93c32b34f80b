//! Who takes which slot, so that nobody's way crosses another's.
//!
//! The assignment with the least sum of squared distances has (pᵢ − pⱼ)·(sᵢ − sⱼ) ≥ 0 for every two vehicles, or swapping them
//! would be shorter. Vehicles that then go straight from their places to their slots, all departing and arriving at the same time,
//! never come nearer to each other than the smaller of their distances at the start and at the end, divided by √2 (Turpin, Michael
//! and Kumar, "CAPT: Concurrent assignment and planning of trajectories for multiple robots", 2014).

use halcyon_model::LocalPoint;
use pathfinding::kuhn_munkres::kuhn_munkres_min;
use pathfinding::matrix::Matrix;

/// The slot of each place, by index: the least sum of squared distances. With fewer slots than places some get none, those whose
/// lack makes the sum least; with more, some slots stay empty.
///
/// Distances are compared to the millimetre. Equal sums are resolved the same way each time.
#[must_use]
pub fn assign(places: &[LocalPoint], slots: &[LocalPoint]) -> Vec<Option<usize>> {
    let mut assigned = vec![None; places.len()];
    // The algorithm wants no more rows than columns.
    let turned = places.len() > slots.len();
    let (rows, columns) = if turned { (slots, places) } else { (places, slots) };
    let costs = rows.iter().map(|row| columns.iter().map(|column| cost_mm2(*row, *column)).collect::<Vec<_>>());
    let Ok(costs) = Matrix::from_rows(costs) else { return assigned };
    if costs.is_empty() {
        return assigned;
    }
    let (_, column_of_row) = kuhn_munkres_min(&costs);
    for (row, column) in column_of_row.into_iter().enumerate() {
        let (place, slot) = if turned { (column, row) } else { (row, column) };
        if let Some(assigned) = assigned.get_mut(place) {
            *assigned = Some(slot);
        }
    }
    assigned
}

/// Square of the distance, square millimetres: whole numbers compare without doubt. What is not finite counts as 0, what is
/// beyond all sense as a million kilometres, so that no sum overflows.
fn cost_mm2(a: LocalPoint, b: LocalPoint) -> i128 {
    let mm = |metres: f64| (metres * 1e3).round().clamp(-1e12, 1e12) as i128;
    let (north, east) = (mm(a.north_m) - mm(b.north_m), mm(a.east_m) - mm(b.east_m));
    north * north + east * east
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn points() -> impl Strategy<Value = Vec<(f64, f64)>> {
        prop::collection::vec((-60.0f64..60.0, -60.0f64..60.0), 0..7)
    }

    fn local(points: &[(f64, f64)]) -> Vec<LocalPoint> {
        points.iter().map(|(north, east)| LocalPoint::new(*north, *east)).collect()
    }

    /// Every choice tried.
    fn least_by_trying_m2(places: &[LocalPoint], slots: &[LocalPoint]) -> f64 {
        fn go(places: &[LocalPoint], slots: &[LocalPoint], free: &mut [bool], skips: usize) -> f64 {
            let Some((place, rest)) = places.split_first() else { return 0.0 };
            let mut least = if skips > 0 { go(rest, slots, free, skips - 1) } else { f64::INFINITY };
            for (index, slot) in slots.iter().enumerate() {
                if std::mem::take(&mut free[index]) {
                    least = least.min(place.distance_m(slot).powi(2) + go(rest, slots, free, skips));
                    free[index] = true;
                }
            }
            least
        }
        go(places, slots, &mut vec![true; slots.len()], places.len().saturating_sub(slots.len()))
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 128, ..ProptestConfig::default() })]

        #[test]
        fn everyone_has_a_slot_of_its_own_and_no_choice_is_shorter(places in points(), slots in points()) {
            let (places, slots) = (local(&places), local(&slots));
            let assigned = assign(&places, &slots);
            prop_assert_eq!(assigned.len(), places.len());
            let mut taken: Vec<usize> = assigned.iter().flatten().copied().collect();
            prop_assert_eq!(taken.len(), places.len().min(slots.len()));
            taken.sort_unstable();
            taken.dedup();
            prop_assert_eq!(taken.len(), places.len().min(slots.len()), "two in one slot");
            let pairs = places.iter().zip(&assigned);
            let sum_m2: f64 = pairs.filter_map(|(place, slot)| Some(place.distance_m(&slots[(*slot)?]).powi(2))).sum();
            // Millimetres are rounded: 2 · 170 m · 1.5 mm for each at most.
            prop_assert!(sum_m2 <= least_by_trying_m2(&places, &slots) + 0.6 * places.len() as f64);
        }

        /// Walked in small steps.
        #[test]
        fn straight_ways_of_equal_time_do_not_cross(places in points(), slots in points()) {
            let (places, slots) = (local(&places), local(&slots));
            let assigned = assign(&places, &slots);
            let ways: Vec<(LocalPoint, LocalPoint)> =
                places.iter().zip(&assigned).filter_map(|(place, slot)| Some((*place, slots[(*slot)?]))).collect();
            for (index, (from, to)) in ways.iter().enumerate() {
                for (their_from, their_to) in &ways[index + 1..] {
                    let bound_m = from.distance_m(their_from).min(to.distance_m(their_to)) / std::f64::consts::SQRT_2;
                    for step in 0..=200 {
                        let share = f64::from(step) / 200.0;
                        let at = |from: &LocalPoint, to: &LocalPoint| from.vector().lerp(&to.vector(), share);
                        let apart_m = (at(from, to) - at(their_from, their_to)).norm();
                        prop_assert!(apart_m >= bound_m - 0.01, "{apart_m} < {bound_m}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_row_that_shifts_by_one_keeps_its_order() {
        // By the sum of distances, unsquared, one vehicle could as well jump over all the others.
        let places = local(&[(0.0, 0.0), (0.0, 5.0), (0.0, 10.0)]);
        let slots = local(&[(0.0, 15.0), (0.0, 10.0), (0.0, 5.0)]);
        assert_eq!(assign(&places, &slots), [Some(2), Some(1), Some(0)]);
    }

    #[test]
    fn nobody_nowhere_and_nonsense_do_no_harm() {
        assert_eq!(assign(&[], &local(&[(1.0, 1.0)])), []);
        assert_eq!(assign(&local(&[(1.0, 1.0)]), &[]), [None]);
        let wild = local(&[(f64::NAN, 0.0), (f64::INFINITY, -f64::MAX)]);
        assert_eq!(assign(&wild, &wild).iter().flatten().count(), 2);
    }
}
