//! The water's surface on a regular grid, for the thousands of places that a picture asks for.
//!
//! A sum of C waves over R × K nodes is one matrix product: cos(a + b) = cos a cos b − sin a sin b splits each wave into a factor
//! that depends on the row only and one that depends on the column only. Between nodes elevation is interpolated from the nodes'
//! elevations and slopes, to fourth order in the cell; slopes bilinearly.

use halcyon_model::Stamp;
use nalgebra::{DMatrixView, DMatrixViewMut};

use crate::water::{Water, split};

/// Cells per shortest wave. With eight, the interpolated elevation is within 0.4 % of that wave's amplitude.
const CELLS_PER_WAVE: f64 = 8.0;
/// Most nodes along a side. A larger area gets coarser cells; by then a pixel is larger than a cell.
const SIDE_MAX: usize = 400;
/// Values at each node: elevation, slope north, slope east.
const CHANNELS: usize = 3;

/// The surface about the cameras at one instant. Keeps its buffers from frame to frame.
#[derive(Debug, Default)]
pub(super) struct SurfaceGrid {
    rows: usize,
    cols: usize,
    /// South-west corner in the local frame, metres.
    pub(super) south_west_m: [f64; 2],
    cell_m: f32,
    per_cell: f32,
    /// Node (row, col): three values at `(col × rows + row) × CHANNELS`.
    nodes: Vec<f32>,
    row_factors: Vec<f32>,
    col_factors: Vec<f32>,
}

/// The surface at one place.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sample {
    pub(super) elevation_m: f32,
    pub(super) slope_north: f32,
    pub(super) slope_east: f32,
}

impl SurfaceGrid {
    /// Computes the surface over the rectangle from `low_m` to `high_m` (north, east), metres in the local frame.
    pub(super) fn update(&mut self, water: &Water, low_m: [f64; 2], high_m: [f64; 2], stamp: Stamp) {
        let extent_m = (high_m[0] - low_m[0]).max(high_m[1] - low_m[1]);
        let finest_m = water.shortest_wavelength_m() / CELLS_PER_WAVE;
        let cell_m = finest_m.max(extent_m / (SIDE_MAX - 2) as f64).min(extent_m);
        let nodes = |axis: usize| ((high_m[axis] - low_m[axis]) / cell_m).ceil() as usize + 2;
        (self.rows, self.cols) = (nodes(0), nodes(1));
        (self.south_west_m, self.cell_m, self.per_cell) = (low_m, cell_m as f32, (1.0 / cell_m) as f32);
        self.nodes.clear();
        self.nodes.resize(CHANNELS * self.rows * self.cols, 0.0);
        if !water.components().is_empty() {
            self.fill(water, cell_m, stamp);
        }
    }

    fn fill(&mut self, water: &Water, cell_m: f64, stamp: Stamp) {
        let waves = water.components().len();
        let (whole_s, fraction_s) = split(stamp);
        let tall = CHANNELS * self.rows;
        // Column-major both: the left factor is (3 rows) × (2 waves), the right one (2 waves) × cols.
        self.row_factors.resize(tall * 2 * waves, 0.0);
        self.col_factors.resize(2 * waves * self.cols, 0.0);
        for (i, wave) in water.components().iter().enumerate() {
            let [north_m, east_m] = self.south_west_m;
            let corner_rad = wave.north_radpm * north_m + wave.east_radpm * east_m + wave.time_phase_rad(whole_s, fraction_s);
            let (amplitude_m, kn, ke) = (wave.amplitude_m, wave.north_radpm, wave.east_radpm);
            let (for_cos, for_sin) = self.row_factors[2 * i * tall..][..2 * tall].split_at_mut(tall);
            let rows = for_cos.chunks_exact_mut(CHANNELS).zip(for_sin.chunks_exact_mut(CHANNELS));
            for ((for_cos, for_sin), [cos, sin]) in rows.zip(turning(corner_rad, kn * cell_m)) {
                // a cos(p + q) = a cos p · cos q − a sin p · sin q, and its slopes −a k sin(p + q).
                let (a_cos, a_sin) = (amplitude_m * cos, amplitude_m * sin);
                for_cos[0] = a_cos as f32;
                for_sin[0] = -a_sin as f32;
                for_cos[1] = (-kn * a_sin) as f32;
                for_sin[1] = (-kn * a_cos) as f32;
                for_cos[2] = (-ke * a_sin) as f32;
                for_sin[2] = (-ke * a_cos) as f32;
            }
            let cols = self.col_factors.chunks_exact_mut(2 * waves);
            for (col, [cos, sin]) in cols.zip(turning(0.0, ke * cell_m)) {
                col[2 * i] = cos as f32;
                col[2 * i + 1] = sin as f32;
            }
        }
        let row_factors = DMatrixView::from_slice(&self.row_factors, tall, 2 * waves);
        let col_factors = DMatrixView::from_slice(&self.col_factors, 2 * waves, self.cols);
        DMatrixViewMut::from_slice(&mut self.nodes, tall, self.cols).gemm(1.0, &row_factors, &col_factors, 0.0);
    }

    /// The surface at a place, metres north and east of the south-west corner; outside the grid the still water.
    #[inline]
    pub(super) fn sample(&self, north_m: f32, east_m: f32) -> Sample {
        let (x, y) = (north_m * self.per_cell, east_m * self.per_cell);
        // Casting saturates at 0, so a place south or west of the grid (or NaN) shows in the coordinate only.
        let (row, col) = (x as usize, y as usize);
        if !(x >= 0.0 && y >= 0.0) || row >= self.rows.saturating_sub(1) || col >= self.cols.saturating_sub(1) {
            return Sample::default();
        }
        let (u, v) = (x - row as f32, y - col as f32);
        let stride = CHANNELS * self.rows;
        let at = col * stride + CHANNELS * row;
        let (west, east) = (&self.nodes[at..at + 2 * CHANNELS], &self.nodes[at + stride..at + stride + 2 * CHANNELS]);
        // A straight line misses a curve by −½ f″ u (1 − u) h², the blend of both ends' tangents by the opposite: half of
        // each is right to fourth order.
        let bow_u = 0.5 * self.cell_m * u * (1.0 - u);
        let bow_v = 0.5 * self.cell_m * v * (1.0 - v);
        let z_west = west[0] + (west[3] - west[0]) * u + bow_u * (west[1] - west[4]);
        let z_east = east[0] + (east[3] - east[0]) * u + bow_u * (east[1] - east[4]);
        let n_west = west[1] + (west[4] - west[1]) * u;
        let n_east = east[1] + (east[4] - east[1]) * u;
        let e_west = west[2] + (west[5] - west[2]) * u;
        let e_east = east[2] + (east[5] - east[2]) * u;
        Sample {
            elevation_m: z_west + (z_east - z_west) * v + bow_v * (e_west - e_east),
            slope_north: n_west + (n_east - n_west) * v,
            slope_east: e_west + (e_east - e_west) * v,
        }
    }
}

/// cos and sin of `start_rad`, `start_rad + step_rad`, …: one complex product each, good to 10⁻¹³ over a grid's side.
fn turning(start_rad: f64, step_rad: f64) -> impl Iterator<Item = [f64; 2]> {
    let (sin_step, cos_step) = step_rad.sin_cos();
    let (sin, cos) = start_rad.sin_cos();
    std::iter::successors(Some([cos, sin]), move |&[cos, sin]| {
        Some([cos * cos_step - sin * sin_step, sin * cos_step + cos * sin_step])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sea::SeaConfig;

    /// The bound that the module states, against the direct sum, for the whole sea and for the worst single wave.
    #[test]
    fn it_is_the_direct_sum() {
        let stamp = Stamp::from_nanos(1_780_000_000_123_456_789);
        for (sea, tolerance_m) in [
            (SeaConfig::default(), 2e-5),
            // A wave at exactly eight cells: 0.4 % of its 0.1 m amplitude.
            (SeaConfig::regular(0.2, 1.3, 30.0), 4e-4),
            (SeaConfig::regular(0.2, 1.3, 0.0), 4e-4),
        ] {
            let water = Water::new(&sea, 3).unwrap();
            let mut grid = SurfaceGrid::default();
            let (low_m, high_m) = ([998.0, -503.0], [1003.0, -499.0]);
            grid.update(&water, low_m, high_m, stamp);
            let (mut worst_m, mut worst_slope) = (0.0_f64, 0.0_f64);
            for i in 0..100 {
                for j in 0..100 {
                    let (north_m, east_m) = (0.05 * f64::from(i) + 0.0123, 0.04 * f64::from(j) + 0.0077);
                    let got = grid.sample(north_m as f32, east_m as f32);
                    let truth = water.surface(low_m[0] + north_m, low_m[1] + east_m, stamp);
                    worst_m = worst_m.max((f64::from(got.elevation_m) - truth.elevation_m).abs());
                    let slope = nalgebra::Vector2::new(f64::from(got.slope_north), f64::from(got.slope_east));
                    worst_slope = worst_slope.max((slope - truth.slope).norm());
                }
            }
            println!("{:?}: {worst_m:.2e} m, slope {worst_slope:.2e}", sea.kind);
            assert!(worst_m < tolerance_m, "{worst_m}");
            assert!(worst_slope < 0.09 * 0.25, "{worst_slope}");
        }
    }

    #[test]
    fn outside_is_still_water() {
        let water = Water::new(&SeaConfig::default(), 3).unwrap();
        let mut grid = SurfaceGrid::default();
        grid.update(&water, [0.0, 0.0], [2.0, 2.0], Stamp::default());
        for (north_m, east_m) in [(-0.01, 1.0), (1.0, -5.0), (50.0, 1.0), (1.0, f32::NAN), (f32::INFINITY, 1.0)] {
            assert_eq!(grid.sample(north_m, east_m).elevation_m, 0.0, "{north_m} {east_m}");
        }
    }
}
