//! The mean water plane (thesis chapter 5, 7.3): robust first, then least squares over what belongs to it.
//!
//! A plane in space is a plane in disparity: d(u, v) = (f b / D) (n · r(u, v)), affine in the pixel. The robust search runs
//! there, where noise is alike for near and far points; the final fit is in metres, on distances perpendicular to the plane.
//! Waves have no known height, so there is no inlier threshold to configure: least median of squares (Rousseeuw 1984) finds
//! the plane with the smallest typical deviation, and that deviation says what an outlier is. Half of the points may be wrong.
//! On smooth swell that plane is too clever: it hugs one flank of the waves. So it is only a start, from which plane and
//! typical deviation of *all* points are found in turn, until crests and troughs are no longer taken for outliers.

use halcyon_model::Plane;
use nalgebra::{Matrix3, Vector3};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::rectify::RectifiedRig;

/// Hypotheses that are tried. With half of the points wrong one in eight is good: that all of 96 are bad has odds of 1 in 300,000.
const HYPOTHESES: usize = 96;
/// Points that a hypothesis is judged by.
const JUDGES: usize = 512;
/// Points that say where the middle of all is; the last word is that of every point that belongs.
const SAMPLE: usize = 4096;
/// Points that one task sums up. Fixed, so that rounding does not depend on how many threads there are.
const CHUNK: usize = 8192;
/// Points further from the plane than this many robust standard deviations are outliers. A Gaussian sea has crests of four.
const OUTLIER_SIGMAS: f32 = 5.0;
/// Rounds from the robust start to the plane of all that belongs to it.
const ROUNDS: u32 = 6;
/// However smooth the water, a match is never called an outlier for less, pixels.
const OUTLIER_PX_MIN: f32 = 0.15;

/// A matched pixel of the rectified left picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Match {
    /// Pixel x.
    pub x_px: f32,
    /// Pixel y.
    pub y_px: f32,
    /// Disparity, pixels.
    pub disparity_px: f32,
    /// One standard deviation of the disparity, pixels.
    pub sigma_px: f32,
}

/// Why no plane was found.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PlaneError {
    /// Too few points.
    #[error("a plane needs at least {needed} points, there are {points}")]
    TooFewPoints {
        /// What there is.
        points: usize,
        /// What is needed.
        needed: usize,
    },
    /// The points do not lie about a plane in front of the cameras.
    #[error("the points do not lie about one plane in front of the cameras")]
    NoPlane,
}

/// Fits the mean water plane to `matches` and drops the outliers from them. The same seed and matches give the same plane.
///
/// # Errors
/// [`PlaneError`] with fewer than `points_min` points, or where they do not lie about a plane.
pub fn fit(matches: &mut Vec<Match>, rig: &RectifiedRig, points_min: usize, seed: u64) -> Result<Plane, PlaneError> {
    let needed = points_min.max(16);
    if matches.len() < needed {
        return Err(PlaneError::TooFewPoints { points: matches.len(), needed });
    }
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    // Drawn, not every so many: matches come in rows, and a regular step would see only a few columns, perhaps all crests.
    let judges: Vec<Match> = (0..JUDGES).map(|_| matches[random.random_range(0..matches.len())]).collect();
    let mut deviations = Vec::with_capacity(JUDGES);
    let (mut plane_px, mut sigma_px) =
        least_median(matches, &judges, &mut random, &mut deviations).ok_or(PlaneError::NoPlane)?;
    let mut limit_px = OUTLIER_PX_MIN;
    let sample: Vec<Match> = (0..SAMPLE.min(matches.len())).map(|_| matches[random.random_range(0..matches.len())]).collect();
    for _ in 0..ROUNDS {
        limit_px = (OUTLIER_SIGMAS * sigma_px).max(OUTLIER_PX_MIN);
        plane_px = plane_px.refit(&sample, limit_px).ok_or(PlaneError::NoPlane)?;
        let wider_px = median_deviation(&judges, &plane_px, &mut deviations) / MEDIAN_PER_SIGMA;
        if (wider_px - sigma_px).abs() <= 0.01 * sigma_px {
            break;
        }
        sigma_px = wider_px;
    }
    let before = matches.len();
    matches.retain(|point| plane_px.residual(point).abs() <= limit_px);
    if matches.len() < needed.max(before / 2) {
        return Err(PlaneError::NoPlane);
    }
    least_squares(matches, rig).ok_or(PlaneError::NoPlane)
}

/// A plane in space as disparities: d = a x + b y + c, pixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DisparityPlane {
    a: f32,
    b: f32,
    c: f32,
}

impl DisparityPlane {
    /// The same in every pixel.
    #[must_use]
    pub fn level(disparity_px: f32) -> Self {
        Self { a: 0.0, b: 0.0, c: disparity_px }
    }

    /// Through three pixels (x, y) with disparities; `None` where they are on a line.
    #[must_use]
    pub fn through_px(pixels: [(f32, f32, f32); 3]) -> Option<Self> {
        let [p, q, r] = pixels.map(|(x_px, y_px, disparity_px)| Match { x_px, y_px, disparity_px, sigma_px: 0.0 });
        Self::through(&p, &q, &r)
    }

    /// Of a plane of the rectified left camera: d(u, v) = (f b / D) (n · r(u, v)). `None` for a plane that is none.
    #[must_use]
    pub fn of(plane: &Plane, rig: &RectifiedRig) -> Option<Self> {
        let n = plane.normal * (rig.baseline_m / plane.distance_m);
        let c = rig.focal_px * n.z - n.x * rig.cx_px - n.y * rig.cy_px;
        let [a, b, c] = [n.x, n.y, c].map(|x| x as f32);
        (a.is_finite() && b.is_finite() && c.is_finite()).then_some(Self { a, b, c })
    }

    /// Disparity of the plane at a pixel, pixels.
    #[must_use]
    #[inline(always)]
    pub fn at(&self, x_px: f32, y_px: f32) -> f32 {
        self.a * x_px + self.b * y_px + self.c
    }

    /// The plane with the least median deviation of `judges` among planes through three `matches`, and the standard deviation that
    /// this median stands for, pixels. `None` without three matches that are on no line.
    pub(crate) fn robust(matches: &[Match], judges: &[Match], seed: u64) -> Option<(Self, f32)> {
        if matches.len() < 3 || judges.is_empty() {
            return None;
        }
        least_median(matches, judges, &mut ChaCha8Rng::seed_from_u64(seed), &mut Vec::with_capacity(judges.len()))
    }

    /// Through three matches; `None` where they are on a line.
    fn through(p: &Match, q: &Match, r: &Match) -> Option<Self> {
        let (x1, y1, d1) = (q.x_px - p.x_px, q.y_px - p.y_px, q.disparity_px - p.disparity_px);
        let (x2, y2, d2) = (r.x_px - p.x_px, r.y_px - p.y_px, r.disparity_px - p.disparity_px);
        let area = x1 * y2 - x2 * y1;
        // Pixels apart in both directions, or the slope is all noise.
        if area.abs() < 64.0 {
            return None;
        }
        let (a, b) = ((d1 * y2 - d2 * y1) / area, (x1 * d2 - x2 * d1) / area);
        Some(Self { a, b, c: p.disparity_px - a * p.x_px - b * p.y_px })
    }

    /// The least-squares plane of the matches within `limit_px` of this one.
    pub(crate) fn refit(&self, matches: &[Match], limit_px: f32) -> Option<Self> {
        // About a point in the middle, so that the normal equations are well conditioned.
        let origin = matches.get(matches.len() / 2)?;
        // Of x, y and 1: their products, and products with the residual.
        let (mut xx, mut xy, mut x, mut yy, mut y, mut count) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        let mut right = Vector3::<f64>::zeros();
        for point in matches {
            let residual_px = self.residual(point);
            if residual_px.abs() <= limit_px {
                let (px, py) = (f64::from(point.x_px - origin.x_px), f64::from(point.y_px - origin.y_px));
                let residual_px = f64::from(residual_px);
                (xx, xy, x) = (xx + px * px, xy + px * py, x + px);
                (yy, y, count) = (yy + py * py, y + py, count + 1.0);
                right += Vector3::new(px * residual_px, py * residual_px, residual_px);
            }
        }
        let normal = Matrix3::new(xx, xy, x, xy, yy, y, x, y, count);
        let step = normal.cholesky()?.solve(&right);
        let (a, b) = (step.x as f32, step.y as f32);
        let c = step.z as f32 - a * origin.x_px - b * origin.y_px;
        Some(Self { a: self.a + a, b: self.b + b, c: self.c + c })
    }

    pub(crate) fn residual(&self, point: &Match) -> f32 {
        point.disparity_px - self.at(point.x_px, point.y_px)
    }
}

/// The median of |x| of a normal variable is this many standard deviations.
const MEDIAN_PER_SIGMA: f32 = 0.6745;

/// The plane with the least median deviation, and the standard deviation that this median stands for.
fn least_median(
    matches: &[Match],
    judges: &[Match],
    random: &mut ChaCha8Rng,
    deviations: &mut Vec<f32>,
) -> Option<(DisparityPlane, f32)> {
    let mut best: Option<(DisparityPlane, f32)> = None;
    for _ in 0..HYPOTHESES {
        let [p, q, r] = std::array::from_fn(|_| &matches[random.random_range(0..matches.len())]);
        let Some(plane) = DisparityPlane::through(p, q, r) else { continue };
        // A median is less than the least so far if more than half of the deviations are: counting is cheaper than sorting.
        let least = best.map_or(f32::INFINITY, |(_, least)| least);
        let less: u32 = judges.iter().map(|point| u32::from(plane.residual(point).abs() < least)).sum();
        if less as usize > judges.len() / 2 {
            best = Some((plane, median_deviation(judges, &plane, deviations)));
        }
    }
    best.map(|(plane, median)| (plane, median / MEDIAN_PER_SIGMA))
}

/// Median distance of the judges from a plane, pixels.
fn median_deviation(judges: &[Match], plane: &DisparityPlane, deviations: &mut Vec<f32>) -> f32 {
    deviations.clear();
    deviations.extend(judges.iter().map(|point| plane.residual(point).abs()));
    let middle = deviations.len() / 2;
    *deviations.select_nth_unstable_by(middle, f32::total_cmp).1
}

/// The plane with the least sum of squared perpendicular distances.
fn least_squares(matches: &[Match], rig: &RectifiedRig) -> Option<Plane> {
    let point = |m: &Match| rig.triangulate(f64::from(m.x_px), f64::from(m.y_px), f64::from(m.disparity_px));
    let count = matches.len() as f64;
    // Sums about a nearby point: squares of depths would eat the digits that waves need.
    let origin = point(matches.first()?);
    // x, y, z; then xx, xy, xz, yy, yz, zz.
    let sums: Vec<[f64; 9]> = matches
        .par_chunks(CHUNK)
        .map(|matches| {
            let mut sums = [0.0; 9];
            for m in matches {
                let offset = point(m) - origin;
                let (x, y, z) = (offset.x, offset.y, offset.z);
                let products = [x, y, z, x * x, x * y, x * z, y * y, y * z, z * z];
                sums.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
            }
            sums
        })
        .collect();
    let mut all = [0.0; 9];
    sums.iter().for_each(|one| all.iter_mut().zip(one).for_each(|(sum, one)| *sum += one));
    let [x, y, z, xx, xy, xz, yy, yz, zz] = all;
    let (sum, squares) = (Vector3::new(x, y, z), Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz));
    let mean = sum / count;
    let eigen = (squares / count - mean * mean.transpose()).symmetric_eigen();
    let smallest = eigen.eigenvalues.imin();
    let mut normal: Vector3<f64> = eigen.eigenvectors.column(smallest).into_owned();
    let mut distance_m = normal.dot(&(origin + mean));
    if distance_m < 0.0 {
        (normal, distance_m) = (-normal, -distance_m);
    }
    let sound = normal.iter().all(|n| n.is_finite()) && distance_m > 0.0 && normal.z > 0.0;
    sound.then(|| Plane { normal, distance_m, rms_m: eigen.eigenvalues[smallest].max(0.0).sqrt() })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RIG: RectifiedRig = RectifiedRig {
        width_px: 320,
        height_px: 240,
        focal_px: 343.0,
        cx_px: 159.5,
        cy_px: 119.5,
        baseline_m: 0.4,
        camera_from_rectified: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
    };

    /// Exact matches of a tilted plane, a share of them replaced by a second, wrong plane and by chaos.
    fn matches(normal: Vector3<f64>, distance_m: f64, wrong: f64) -> Vec<Match> {
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut matches = Vec::new();
        for y in (0..240).step_by(4) {
            for x in (0..320).step_by(4) {
                let depth_m = distance_m / normal.dot(&RIG.ray(f64::from(x), f64::from(y)));
                let mut disparity_px = RIG.focal_px * RIG.baseline_m / depth_m;
                if random.random_bool(wrong) {
                    disparity_px = if random.random_bool(0.5) { 24.0 } else { random.random_range(1.0..60.0) };
                }
                matches.push(Match { x_px: x as f32, y_px: y as f32, disparity_px: disparity_px as f32, sigma_px: 0.05 });
            }
        }
        matches
    }

    #[test]
    fn the_plane_is_found_among_forty_per_cent_of_lies() {
        let normal = Vector3::new(0.08, -0.05, 1.0).normalize();
        for wrong in [0.0, 0.2, 0.4] {
            let plane = fit(&mut matches(normal, 5.0, wrong), &RIG, 100, 1).unwrap();
            assert!((plane.distance_m - 5.0).abs() < 2e-3, "{wrong} {plane:?}");
            assert!(plane.normal.angle(&normal) < 1e-3, "{wrong} {plane:?}");
        }
    }

    /// Swell without noise: no crest and no trough may be taken for an outlier.
    #[test]
    fn smooth_swell_loses_no_point() {
        for wavelength_px in [40.0, 90.0, 150.0, 240.0] {
            let mut swell = matches(Vector3::z(), 5.0, 0.0);
            for m in &mut swell {
                m.disparity_px += 0.5 * (std::f32::consts::TAU * m.x_px / wavelength_px).sin();
            }
            let before = swell.len();
            fit(&mut swell, &RIG, 100, 1).unwrap();
            assert_eq!(swell.len(), before, "{wavelength_px}");
        }
    }

    #[test]
    fn the_same_seed_gives_the_same_plane() {
        let once = || fit(&mut matches(Vector3::z(), 5.0, 0.3), &RIG, 100, 7).unwrap();
        assert_eq!(once(), once());
    }

    #[test]
    fn chaos_is_no_plane() {
        let mut chaos = matches(Vector3::z(), 5.0, 0.0);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for m in &mut chaos {
            m.disparity_px =
                if random.random_bool(0.5) { random.random_range(0.1..8.0) } else { random.random_range(90.0..250.0) };
        }
        let plane = fit(&mut chaos, &RIG, 100, 1);
        assert!(
            plane.is_err() || plane.is_ok_and(|plane| plane.rms_m > 0.2),
            "a plane through chaos must at least say how bad it is"
        );
        assert!(matches!(fit(&mut Vec::new(), &RIG, 100, 1), Err(PlaneError::TooFewPoints { points: 0, needed: 100 })));
    }
}
