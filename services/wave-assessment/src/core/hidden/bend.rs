//! How a patch is bent, and what that says of waves too long for it.
//!
//! A wave longer than the footprint lifts the patch as a whole, which a patch cannot see, and bends it, which it can: the surface
//! obeys ∇²η = −k² η, whatever direction the wave comes from. k follows from the frequency by dispersion. Neither the autopilot's
//! height nor its attitude is in that. For waves not so much longer than the footprint the exact response of a least-squares
//! parabola takes the place of −k².

use halcyon_model::{LocalPoint, SurfacePatch, grid_error};
use nalgebra::{Matrix2, Matrix4, Matrix6, Vector2, Vector4, Vector6};

use crate::core::patch::cell;
use crate::core::smooth::CellErrors;

/// Fewer cells fix no parabola worth the name.
const CELLS_MIN: usize = 25;
/// Directions that a wave may come from, over half a turn.
const DIRECTIONS: u32 = 12;

/// The parabola of one patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bend {
    /// Half of ∇²η: the sum of the two pure quadratic coefficients, per metre.
    pub half_laplacian_per_m: f64,
    /// One standard deviation of it.
    pub sigma_per_m: f64,
    /// Rise over run at the middle, east and north, of the surface as the grid has it …
    pub grid_slope: [f64; 2],
    /// … and as the autopilot's attitude has it, before anything was taken out.
    pub slope: [f64; 2],
    /// The middle: the mean place of the cells seen.
    pub middle: LocalPoint,
    /// Mean square of what the parabola leaves of the elevations, m², and what the cells' own errors make of it.
    pub residual_m2: f64,
    pub own_m2: f64,
    /// Means over the cells seen, metres and m²: of the elevation, of its square, and of its product with the distance east and north of the
    /// middle …
    pub mean_m: f64,
    pub square_m2: f64,
    pub rise_m2: [f64; 2],
    /// … and of the squares of those distances, east and north, and of their product, m².
    pub moments_m2: [f64; 3],
    /// Sides of the rectangle that has the second moments of the cells seen, metres.
    pub sides_m: [f64; 2],
}

impl Bend {
    /// Mean square of all cells' elevations with the patch lifted by `level_m` and tilted by `tilt`, rise over run east and north, m².
    pub(super) fn square_with_m2(&self, level_m: f64, tilt: [f64; 2]) -> f64 {
        let ([east, north], [xx, yy, xy]) = (tilt, self.moments_m2);
        let lifted = self.square_m2 + 2.0 * level_m * self.mean_m + level_m * level_m;
        let tilted = 2.0 * (east * self.rise_m2[0] + north * self.rise_m2[1]);
        lifted + tilted + east * east * xx + north * north * yy + 2.0 * east * north * xy
    }

    /// Of a grid; `None` where too little of it was seen.
    pub(crate) fn of(patch: &SurfacePatch) -> Option<Self> {
        let (grid, error_length_m) = (&patch.grid, patch.error_length_m);
        let (rows, cols) = (grid.rows as usize, grid.cols as usize);
        let seen = || (0..rows * cols).filter_map(|i| cell(grid, i / cols, i % cols).map(|cell| (i, cell)));
        let count = seen().count();
        if count < CELLS_MIN {
            return None;
        }
        // Tilt bends nothing.
        let errors = CellErrors::of(patch);
        let own = |(i, (_, sigma_m)): (usize, (f64, f64))| {
            (sigma_m * sigma_m - errors.tilt_m2((i / cols) as f64, (i % cols) as f64)).max(0.0)
        };
        let own_m2 = seen().map(own).sum::<f64>() / count as f64;
        let mean = |of: &dyn Fn(usize) -> usize| seen().map(|(i, _)| of(i) as f64).sum::<f64>() / count as f64;
        let (row0, col0) = (mean(&|i| i / cols), mean(&|i| i % cols));
        let (mut normal, mut right, mut squares_m2) = (Matrix6::<f64>::zeros(), Vector6::<f64>::zeros(), 0.0);
        for (i, (elevation_m, _)) in seen() {
            let y = ((i / cols) as f64 - row0) * grid.cell_m;
            let x = ((i % cols) as f64 - col0) * grid.cell_m;
            let basis = Vector6::new(1.0, x, y, x * x, x * y, y * y);
            normal += basis * basis.transpose();
            right += basis * elevation_m;
            squares_m2 += elevation_m * elevation_m;
        }
        let factor = normal.cholesky()?;
        let picked = Vector6::new(0.0, 0.0, 0.0, 1.0, 0.0, 1.0);
        let solved = factor.solve(&picked);
        let parabola = factor.solve(&right);
        let [removed_north, removed_east] = patch.slope_removed;
        let inflation = grid_error::inflation(grid.cell_m, error_length_m);
        // Second moments about the centre: their principal ones are those of a turned rectangle, a²/12 and b²/12.
        let moments = [normal[(1, 1)], normal[(2, 2)], normal[(1, 2)]].map(|sum| sum / count as f64);
        let (middle, half) = (f64::midpoint(moments[0], moments[1]), ((moments[0] - moments[1]) / 2.0).hypot(moments[2]));
        let bend = Self {
            half_laplacian_per_m: parabola[3] + parabola[5],
            sigma_per_m: (own_m2 * inflation * solved.dot(&picked)).sqrt(),
            grid_slope: [parabola[1], parabola[2]],
            slope: [parabola[1] + removed_east, parabola[2] + removed_north],
            middle: LocalPoint::new(grid.south_west_north_m + row0 * grid.cell_m, grid.south_west_east_m + col0 * grid.cell_m),
            residual_m2: (squares_m2 - parabola.dot(&right)).max(0.0) / count as f64,
            own_m2,
            mean_m: right[0] / count as f64,
            square_m2: squares_m2 / count as f64,
            rise_m2: [right[1] / count as f64, right[2] / count as f64],
            moments_m2: moments,
            sides_m: [middle + half, middle - half].map(|moment| (12.0 * moment.max(0.0)).sqrt()),
        };
        (bend.half_laplacian_per_m.is_finite() && bend.sigma_per_m.is_finite()).then_some(bend)
    }
}

/// What waves of one wavenumber, from anywhere, do to the mean and to the bend of a rectangular patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Response {
    /// The mean level that goes with a bend of one per metre, m².
    pub level_per_bend_m2: f64,
    /// Share of the level's variance that this leaves unexplained, since directions differ: 0 for long waves.
    pub unexplained: f64,
}

impl Response {
    /// For waves of `wavenumber_radpm` over a patch of `sides_m`.
    pub(super) fn new(wavenumber_radpm: f64, sides_m: [f64; 2]) -> Self {
        let (mut levels, mut bends, mut products) = (0.0, 0.0, 0.0);
        for direction in 0..DIRECTIONS {
            let (sin, cos) = (std::f64::consts::PI * (f64::from(direction) + 0.5) / f64::from(DIRECTIONS)).sin_cos();
            let [x, y] = [(cos, sides_m[0]), (sin, sides_m[1])]
                .map(|(share, side_m)| Axis::of(0.5 * wavenumber_radpm * share * side_m, 0.5 * side_m));
            // cos(kx x) cos(ky y): the even part of a plane wave; the odd part has no mean and no bend.
            let level = x.mean * y.mean;
            let bend = x.bend_per_m2 * y.mean + y.bend_per_m2 * x.mean;
            (levels, bends, products) = (levels + level * level, bends + bend * bend, products + level * bend);
        }
        Self { level_per_bend_m2: products / bends, unexplained: 1.0 - products * products / (levels * bends) }
    }
}

/// How much waves of `wavenumber_min_radpm` and shorter bend a patch, for what a parabola leaves of them: mean square of the bend over
/// mean square of the residual, m⁻⁴. Energy falls with the fifth power of frequency, as behind the peak of every wind sea (Phillips 1958).
pub(super) fn bend_of_residual_per_m4(wavenumber_min_radpm: f64, sides_m: [f64; 2]) -> f64 {
    const ACROSS: i32 = 10;
    const STEPS: i32 = 8;
    let half = sides_m.map(|side_m| 0.5 * side_m);
    // One half of the places: at the others a cosine is the same and a sine the opposite, and so are the terms of a parabola.
    let places: Vec<(f64, f64)> = (0..ACROSS * ACROSS / 2)
        .map(|i| [i / ACROSS, i % ACROSS].map(|at| 2.0 * (f64::from(at) + 0.5) / f64::from(ACROSS) - 1.0))
        .map(|[y, x]| (x * half[0], y * half[1]))
        .collect();
    let even = |(x, y): (f64, f64)| Vector4::new(1.0, x * x, x * y, y * y);
    let odd = |(x, y): (f64, f64)| Vector2::new(x, y);
    let evens: Matrix4<f64> = places.iter().map(|place| even(*place) * even(*place).transpose()).sum();
    let odds: Matrix2<f64> = places.iter().map(|place| odd(*place) * odd(*place).transpose()).sum();
    let (Some(evens), Some(odds)) = (evens.cholesky(), odds.cholesky()) else { return f64::INFINITY };
    let longest = wavenumber_min_radpm;
    // Down to waves that the grid of places still resolves; shorter ones bend nothing.
    let shortest = (0.5 * std::f64::consts::PI * f64::from(ACROSS) / sides_m[0].max(sides_m[1])).max(longest);
    let (mut bends, mut residuals) = (0.0, 0.0);
    for step in 0..STEPS {
        let k_radpm = longest * (shortest / longest).powf(f64::from(step) / f64::from(STEPS));
        // f⁻⁵ df is k⁻² d ln k.
        let energy = k_radpm.powi(-2);
        for direction in 0..DIRECTIONS {
            let (sin, cos) = (std::f64::consts::PI * (f64::from(direction) + 0.5) / f64::from(DIRECTIONS)).sin_cos();
            let (mut of_cosine, mut of_sine) = (Vector4::zeros(), Vector2::zeros());
            for place in &places {
                let (sine, cosine) = (k_radpm * (place.0 * cos + place.1 * sin)).sin_cos();
                of_cosine += even(*place) * cosine;
                of_sine += odd(*place) * sine;
            }
            let (parabola, plane) = (evens.solve(&of_cosine), odds.solve(&of_sine));
            bends += energy * (parabola[1] + parabola[3]).powi(2);
            // The squares of both add up to one at each place.
            let left = places.len() as f64 - parabola.dot(&of_cosine) - plane.dot(&of_sine);
            residuals += energy * left / places.len() as f64;
        }
    }
    bends / residuals.max(f64::MIN_POSITIVE)
}

/// A cosine over one side of the patch: its mean, and the quadratic coefficient of its least-squares parabola.
struct Axis {
    mean: f64,
    bend_per_m2: f64,
}

impl Axis {
    /// `phase` is the wave's at the end of the side, radians; `half_m` half the side.
    fn of(phase: f64, half_m: f64) -> Self {
        // Over u in −1 … 1 the quadratic that is orthogonal to a constant is u² − 1/3, of mean square 4/45. The series takes over
        // where the closed form would subtract equals.
        let p2 = phase * phase;
        if phase.abs() < 0.1 {
            return Self { mean: 1.0 - p2 / 6.0, bend_per_m2: (-p2 / 2.0 + p2 * p2 / 28.0) / (half_m * half_m) };
        }
        let (sin, cos) = phase.sin_cos();
        let mean = sin / phase;
        // Mean of u² cos(phase u) over the side.
        let second = sin / phase + 2.0 * cos / p2 - 2.0 * sin / (p2 * phase);
        Self { mean, bend_per_m2: (second - mean / 3.0) * 45.0 / 4.0 / (half_m * half_m) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::patch::tests::patch;
    use halcyon_model::ElevationGrid;

    fn bend_of(grid: &ElevationGrid) -> Option<Bend> {
        Bend::of(&SurfacePatch { slope_removed: [0.01, 0.02], ..patch(grid, 0.01, 0.0) })
    }

    fn grid(turn: f64, f: impl Fn(f64, f64) -> f64) -> ElevationGrid {
        // A rectangle of 4 × 3 m, turned, on a square of cells.
        let (side, cell_m) = (61_u32, 0.1);
        let elevation_m: Vec<f32> = (0..side * side)
            .map(|i| {
                let (y, x) = (f64::from(i / side) * cell_m - 3.0, f64::from(i % side) * cell_m - 3.0);
                let (sin, cos) = turn.sin_cos();
                let (u, v) = (x * cos + y * sin, y * cos - x * sin);
                if u.abs() <= 2.0 && v.abs() <= 1.5 { f(x, y) as f32 } else { f32::NAN }
            })
            .collect();
        let sigma_m = elevation_m.iter().map(|z| if z.is_nan() { f32::NAN } else { 0.002 }).collect();
        ElevationGrid {
            south_west_north_m: -3.0,
            south_west_east_m: -3.0,
            cell_m,
            rows: side,
            cols: side,
            elevation_m,
            sigma_m,
        }
    }

    #[test]
    fn a_parabola_is_bent_by_its_coefficients_whatever_its_tilt() {
        for turn in [0.0, 0.4, 1.2] {
            let bend =
                bend_of(&grid(turn, |x, y| 0.02 * x * x - 0.005 * y * y + 0.03 * x * y + 0.1 * x - 0.2 * y + 1.0)).unwrap();
            assert!((bend.half_laplacian_per_m - 0.015).abs() < 1e-5, "{bend:?}");
            assert!((bend.slope[0] - 0.12).abs() < 1e-4 && (bend.slope[1] + 0.19).abs() < 1e-4, "{bend:?}");
            assert!((bend.sides_m[0] - 4.0).abs() < 0.15 && (bend.sides_m[1] - 3.0).abs() < 0.15, "{bend:?}");
        }
        assert_eq!(bend_of(&grid(0.0, |_, _| f64::NAN)), None);
    }

    /// Against grids of real plane waves from all around: the level that was taken out is found again from the bend, but for the share
    /// that is said to be unexplained (directions differ) and half a per cent of it that the cells' steps make.
    #[test]
    fn the_level_of_a_wave_follows_from_its_bend() {
        for length_m in [20.0, 10.0, 6.0, 4.5] {
            let k = std::f64::consts::TAU / length_m;
            let (mut off, mut all, mut unexplained) = (0.0, 0.0, 0.0);
            for step in 0..12 {
                let direction = std::f64::consts::PI * (f64::from(step) + 0.3) / 12.0;
                let wave = |x: f64, y: f64| (k * (x * direction.cos() + y * direction.sin()) + 0.3).cos();
                let grid = grid(0.3, wave);
                let seen: Vec<f32> = grid.elevation_m.iter().copied().filter(|z| z.is_finite()).collect();
                let level = seen.iter().map(|z| f64::from(*z)).sum::<f64>() / seen.len() as f64;
                let bend = bend_of(&grid).unwrap();
                let response = Response::new(k, bend.sides_m);
                off += (response.level_per_bend_m2 * bend.half_laplacian_per_m - level).powi(2);
                all += level * level;
                unexplained = response.unexplained;
            }
            assert!(off / all < 1.3 * unexplained + 5e-3, "{length_m} m: {} of {unexplained}", off / all);
        }
    }

    /// Real short waves on a real grid, weighed as in a wind sea.
    #[test]
    fn short_waves_leave_a_residual() {
        let (sides_m, longest_m) = ([4.0, 3.0], 3.0);
        let expected = bend_of_residual_per_m4(std::f64::consts::TAU / longest_m, sides_m);
        let (mut bends, mut residuals) = (0.0, 0.0);
        // Eight steps of an equal ratio down to 0.8 m, as long as ten places across resolve.
        for step in 0..8 {
            let length_m = longest_m * (0.8_f64 / longest_m).powf(f64::from(step) / 8.0);
            let k = std::f64::consts::TAU / length_m;
            for direction in [0.1_f64, 0.6, 1.1, 1.6, 2.1, 2.6] {
                for phase in [0.0, 1.5] {
                    let wave = |x: f64, y: f64| (k * (x * direction.cos() + y * direction.sin()) + phase).cos();
                    let bend = bend_of(&grid(0.3, wave)).unwrap();
                    bends += bend.half_laplacian_per_m.powi(2) / (k * k);
                    residuals += bend.residual_m2 / (k * k);
                }
            }
        }
        assert!((bends / residuals / expected - 1.0).abs() < 0.3, "{} for {expected}", bends / residuals);
        assert!(bend_of_residual_per_m4(6.0, sides_m) < 0.1 * expected, "ripples hardly bend anything");
    }

    #[test]
    fn long_waves_are_all_explained_and_short_ones_are_not() {
        let long = Response::new(0.1, [4.0, 3.0]);
        assert!(long.unexplained < 1e-3 && (long.level_per_bend_m2 / (-2.0 / 0.01) - 1.0).abs() < 0.02, "{long:?}");
        assert!(Response::new(2.5, [4.0, 3.0]).unexplained > 0.3);
        // The series and the closed form meet.
        let [below, above] = [0.0999, 0.1001].map(|phase| Axis::of(phase, 1.0));
        assert!((below.bend_per_m2 / above.bend_per_m2 - 1.0).abs() < 0.01 && (below.mean - above.mean).abs() < 1e-4);
    }
}
