//! From costs to disparities: the winner takes all, if it is alone and if left and right agree.

use super::Settings;
use super::volume::CostVolume;
use crate::core::disparity::Disparity;

/// Chooses the disparity of every left pixel; NaN where there is none, where it is not unique, or where the right picture
/// disagrees.
pub fn fill(costs: &CostVolume, settings: &Settings, disparity: &mut Disparity) {
    let winners = left_winners(costs, settings.uniqueness_percent);
    let right = settings.left_right_px.map(|tolerance_px| (tolerance_px, right_winners(costs)));
    disparity.reset(costs.width as u32, costs.height as u32);
    for (pixel, (value, winner)) in disparity.values_px.iter_mut().zip(&winners).enumerate() {
        let Some(k) = *winner else { continue };
        if let Some((tolerance_px, right)) = &right
            && right[pixel - costs.min_px - k].is_none_or(|other| other.abs_diff(k) > *tolerance_px as usize)
        {
            continue;
        }
        let fraction_px = if settings.sub_pixel { parabola(costs.at(pixel), k) } else { 0.0 };
        *value = (costs.min_px + k) as f32 + fraction_px;
    }
}

/// For each left pixel the index of its least cost; `None` where another that is no neighbour comes within
/// `uniqueness_percent`, a tie included.
#[must_use]
pub fn left_winners(costs: &CostVolume, uniqueness_percent: f32) -> Vec<Option<usize>> {
    let factor = 1.0 + uniqueness_percent / 100.0;
    let winner = |costs: &[f32]| {
        let mut best = (0, f32::INFINITY);
        for (k, cost) in costs.iter().enumerate() {
            if *cost < best.1 {
                best = (k, *cost);
            }
        }
        let (best, least) = best;
        let rival = |(k, cost): (usize, &f32)| k.abs_diff(best) > 1 && *cost <= least * factor;
        (least.is_finite() && !costs.iter().enumerate().any(rival)).then_some(best)
    };
    costs.values.chunks_exact(costs.count).map(winner).collect()
}

/// For each right pixel the index of its least cost: left (x + d, y) against right (x, y) is the same comparison seen from the
/// other side (fig. 4-10).
#[must_use]
pub fn right_winners(costs: &CostVolume) -> Vec<Option<usize>> {
    let mut winners = vec![None; costs.width * costs.height];
    let mut least = vec![f32::INFINITY; costs.width];
    for (y, winners) in winners.chunks_exact_mut(costs.width).enumerate() {
        least.fill(f32::INFINITY);
        for x in 0..costs.width {
            for (k, cost) in costs.at(y * costs.width + x).iter().enumerate() {
                // A finite cost has its right pixel inside the picture.
                if cost.is_finite() && *cost < least[x - costs.min_px - k] {
                    (least[x - costs.min_px - k], winners[x - costs.min_px - k]) = (*cost, Some(k));
                }
            }
        }
    }
    winners
}

/// How far from `k` the vertex of the parabola through the three costs around it lies, −½ to ½ px; 0 at the end of the range.
fn parabola(costs: &[f32], k: usize) -> f32 {
    let before = k.checked_sub(1).map_or(f32::INFINITY, |k| costs[k]);
    let after = costs.get(k + 1).copied().unwrap_or(f32::INFINITY);
    let curvature = before - 2.0 * costs[k] + after;
    if curvature.is_finite() && curvature > 0.0 { (before - after) / (2.0 * curvature) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parabola_is_met_at_its_vertex() {
        let costs: Vec<f32> = (0..6).map(|k| (k as f32 - 2.3).powi(2) + 5.0).collect();
        assert!((parabola(&costs, 2) - 0.3).abs() < 1e-5);
        assert_eq!(parabola(&costs, 0), 0.0);
        assert_eq!(parabola(&[1.0, 1.0, 1.0], 1), 0.0);
    }

    fn row(count: usize, costs: &[&[f32]]) -> CostVolume {
        CostVolume { width: costs.len(), height: 1, min_px: 0, count, values: costs.concat() }
    }

    #[test]
    fn a_tie_is_no_match_and_neither_is_a_close_rival() {
        let none = f32::INFINITY;
        let costs = row(3, &[&[5.0, none, none], &[5.0, 1.0, none], &[4.0, 9.0, 4.0], &[4.0, 9.0, 4.3], &[4.0, 4.1, 9.0]]);
        assert_eq!(left_winners(&costs, 0.0), [Some(0), Some(1), None, Some(0), Some(0)]);
        assert_eq!(left_winners(&costs, 10.0), [Some(0), Some(1), None, None, Some(0)]);
    }

    /// Figure 4-10: two left pixels claim one right pixel; the right one decides.
    #[test]
    fn left_and_right_must_agree() {
        let none = f32::INFINITY;
        // Right pixel 0 is claimed by left 0 (cost 2), left 1 (d = 1, cost 3) and left 2 (d = 2, cost 1): it belongs to left 2.
        let costs = row(3, &[&[2.0, none, none], &[8.0, 3.0, none], &[9.0, 9.0, 1.0]]);
        assert_eq!(right_winners(&costs), [Some(2), Some(0), Some(0)]);
        let settings = Settings {
            left_right_px: Some(0),
            sub_pixel: false,
            ..Settings::new(crate::core::matcher::StudyMethod::ALL[0], 3)
        };
        let mut disparity = Disparity::default();
        fill(&costs, &settings, &mut disparity);
        assert!(disparity.values_px[0].is_nan() && disparity.values_px[1].is_nan());
        assert_eq!(disparity.values_px[2], 2.0);
    }
}
