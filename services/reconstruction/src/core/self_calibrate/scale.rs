//! What a known altitude says of the baseline.

use nalgebra::{Matrix3, Vector3};

use super::bundle::Bundle;
use super::median;

/// Rounds of reweighting.
const ROUNDS: u32 = 8;
/// Residuals beyond this many robust standard deviations have no say (Tukey's biweight).
const TUKEY_SIGMAS: f64 = 4.685;

/// One over the distance, in baselines, of the water along the left camera's optical axis: the middle of all pairs, and its
/// standard deviation. The inverse depth of a plane is affine over the picture, so waves and wrong matches average out.
pub(super) fn inverse_depth_on_axis(bundle: &Bundle, view_of: &[usize]) -> Option<(f64, f64)> {
    let indices: Vec<usize> = (0..bundle.used.len()).collect();
    let mut on_axis = Vec::new();
    let mut variances = Vec::new();
    for view in indices.chunk_by(|a, b| view_of[bundle.used[*a]] == view_of[bundle.used[*b]]) {
        let points: Vec<Vector3<f64>> = view.iter().map(|&i| bundle.points[i]).collect();
        if let Some((value, variance)) = plane_on_axis(&points) {
            on_axis.push(value);
            variances.push(variance);
        }
    }
    let middle = median(&mut on_axis.clone());
    let count = on_axis.len() as f64;
    // Two views on how sure that is: each fit's own, and how the pairs scatter.
    let fits = variances.iter().sum::<f64>() / (count * count);
    let scatter = if on_axis.len() > 1 {
        on_axis.iter().map(|value| (value - middle).powi(2)).sum::<f64>() / (count - 1.0) / count
    } else {
        0.0
    };
    (middle > 0.0 && middle.is_finite()).then(|| (middle, fits.max(scatter).sqrt()))
}

/// The plane ρ = a u + b v + c of points (u, v, ρ), robustly: c and its variance.
fn plane_on_axis(points: &[Vector3<f64>]) -> Option<(f64, f64)> {
    if points.len() < 6 {
        return None;
    }
    let mut plane = Vector3::new(0.0, 0.0, median(&mut points.iter().map(|point| point.z).collect::<Vec<_>>()));
    let mut variance = f64::NAN;
    for _ in 0..ROUNDS {
        let residual = |point: &Vector3<f64>| point.z - plane.dot(&point.xy().push(1.0));
        let spread = median(&mut points.iter().map(|point| residual(point).abs()).collect::<Vec<_>>()) / 0.6745;
        let limit = (TUKEY_SIGMAS * spread).max(1e-12);
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for point in points {
            let weight = (1.0 - (residual(point) / limit).powi(2)).max(0.0).powi(2);
            let row = point.xy().push(1.0);
            normal += row * row.transpose() * weight;
            right += row * (weight * point.z);
        }
        let cholesky = normal.cholesky()?;
        plane = cholesky.solve(&right);
        variance = cholesky.inverse()[(2, 2)] * spread * spread;
    }
    (plane.z.is_finite() && variance.is_finite()).then_some((plane.z, variance))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// n · X = D with X = (u, v, 1)/ρ gives ρ = (n · (u, v, 1))/D: 1/ρ on the axis is D / n_z.
    #[test]
    fn a_tilted_plane_among_lies() {
        let (normal, distance) = (Vector3::new(0.1, -0.2, 1.0).normalize(), 12.0);
        let mut points: Vec<Vector3<f64>> = (0..400)
            .map(|i| (f64::from(i % 20) * 0.04 - 0.4, f64::from(i / 20) * 0.03 - 0.3))
            .map(|(u, v)| Vector3::new(u, v, normal.dot(&Vector3::new(u, v, 1.0)) / distance))
            .collect();
        for point in points.iter_mut().step_by(4) {
            point.z *= 1.7;
        }
        let (on_axis, _) = plane_on_axis(&points).unwrap();
        assert!((on_axis * distance / normal.z - 1.0).abs() < 1e-6, "{on_axis}");
        assert_eq!(plane_on_axis(&points[..3]), None);
    }
}
