//! How a patch is bent, and what that says of waves too long for it.
//!
//! A wave longer than the footprint lifts the patch as a whole, which a patch cannot see, and bends it, which it can: the surface
//! obeys ∇²η = −k² η, whatever direction the wave comes from. k follows from the frequency by dispersion. Neither the autopilot's
//! height nor its attitude is in that. For waves not so much longer than the footprint the exact response of a least-squares
//! parabola takes the place of −k².

use halcyon_model::{LocalPoint, SurfacePatch, grid_error};
use nalgebra::Vector6;

use crate::core::moments::{Moments, powers};
use crate::core::patch::cell;
use crate::core::smooth::CellErrors;

/// Fewer cells fix no parabola worth the name.
const CELLS_MIN: usize = 25;
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
        let seen = || (0..rows).flat_map(|row| (0..cols).filter_map(move |col| cell(grid, row, col).map(|of| (row, col, of))));
        // Tilt bends nothing.
        let errors = CellErrors::of(patch);
        let (mut row_sum, mut col_sum, mut count, mut own_m2) = (0, 0, 0, 0.0);
        for (row, col, (_, sigma_m)) in seen() {
            (row_sum, col_sum, count) = (row_sum + row, col_sum + col, count + 1);
            own_m2 += (sigma_m * sigma_m - errors.tilt_m2(row as f64, col as f64)).max(0.0);
        }
        if count < CELLS_MIN {
            return None;
        }
        own_m2 /= count as f64;
        let (row0, col0) = (row_sum as f64 / count as f64, col_sum as f64 / count as f64);
        let (mut moments, mut right, mut squares_m2) = (Moments::default(), Vector6::<f64>::zeros(), 0.0);
        for row in 0..rows {
            let y = (row as f64 - row0) * grid.cell_m;
            // Sums over the row's cells: of the powers of x, and of the elevation times 1, x and x².
            let (mut powers_of_x, mut rises) = ([0.0; 5], [0.0; 3]);
            for (col, (elevation_m, _)) in (0..cols).filter_map(|col| cell(grid, row, col).map(|of| (col, of))) {
                let of_x = powers((col as f64 - col0) * grid.cell_m);
                powers_of_x.iter_mut().zip(of_x).for_each(|(sum, power)| *sum += power);
                rises.iter_mut().zip(of_x).for_each(|(sum, power)| *sum += power * elevation_m);
                squares_m2 += elevation_m * elevation_m;
            }
            moments.add(&powers_of_x, y);
            right += Vector6::new(rises[0], rises[1], y * rises[0], rises[2], y * rises[1], y * y * rises[0]);
        }
        let normal = moments.normal();
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

#[cfg(test)]
mod tests {
    use super::super::response::{Response, bend_of_residual_per_m4};
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
}
