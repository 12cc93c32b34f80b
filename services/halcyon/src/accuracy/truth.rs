//! Wave heights of a known elevation, by the definition and nothing else: the judge shares no code with the judged.

/// Heights of the waves between zero up-crossings of `elevation_m` (its mean taken out), metres.
fn heights_m(elevation_m: &[f64]) -> Vec<f64> {
    let mean = elevation_m.iter().sum::<f64>() / elevation_m.len().max(1) as f64;
    let mut heights = Vec::new();
    let mut wave: Option<(f64, f64)> = None;
    for pair in elevation_m.windows(2) {
        let (before, after) = (pair[0] - mean, pair[1] - mean);
        if before < 0.0 && after >= 0.0 {
            if let Some((low, high)) = wave {
                heights.push(high - low);
            }
            wave = Some((f64::INFINITY, f64::NEG_INFINITY));
        }
        if let Some((low, high)) = &mut wave {
            (*low, *high) = (low.min(after), high.max(after));
        }
    }
    heights
}

/// H_m and H_s of several places' elevations together: the mean of all waves, and of the highest third.
pub(super) fn h_mean_and_h_s_m(places: &[Vec<f64>]) -> (f64, f64) {
    let mut heights: Vec<f64> = places.iter().flat_map(|elevation_m| heights_m(elevation_m)).collect();
    heights.sort_by(|a, b| b.total_cmp(a));
    let mean = |heights: &[f64]| heights.iter().sum::<f64>() / heights.len() as f64;
    (mean(&heights), mean(&heights[..(heights.len().div_ceil(3)).min(heights.len())]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sine_has_waves_of_twice_its_amplitude() {
        let sine: Vec<f64> = (0..5000).map(|i| 0.3 + 0.02 * (f64::from(i) * 0.01 + 1.0).sin()).collect();
        let (h_mean_m, h_s_m) = h_mean_and_h_s_m(&[sine]);
        assert!((h_mean_m - 0.04).abs() < 1e-5 && (h_s_m - 0.04).abs() < 1e-5);
    }
}
