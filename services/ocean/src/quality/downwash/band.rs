//! The ripples' wavelengths of a grid, and their directions, by two-dimensional Fourier transforms.

use std::f64::consts::{PI, TAU};
use std::ops::RangeInclusive;
use std::sync::Arc;

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};

use super::DownwashError;

/// Elevation on a rectangle of square cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElevationGrid<'a> {
    /// Row by row, metres positive up; what is not finite is missing.
    pub elevation_m: &'a [f64],
    /// Cells in a row.
    pub columns: usize,
    /// Side of a cell, metres.
    pub cell_m: f64,
}

/// A grid's ripples.
pub(super) struct Band {
    /// Elevation of the ripples in each cell, metres, under the taper.
    pub(super) elevation_m: Vec<f64>,
    /// Riesz transform in each cell, metres, under the taper: along columns and along rows.
    pub(super) riesz_m: Vec<[f64; 2]>,
    /// Which cells had an elevation.
    pub(super) is_known: Vec<bool>,
    /// Variance about the mean plane, all wavelengths, m².
    pub(super) total_variance_m2: f64,
}

/// Plans and weights for grids of one shape.
pub(super) struct BandFilter {
    columns: usize,
    rows: usize,
    wavelength_min_m: f64,
    wavelength_max_m: f64,
    cell_m: f64,
    /// Taper of each cell: 1 inside, down to 0 over the outer eighth.
    taper: Vec<f64>,
    /// Its square: what a cell's variance weighs.
    weights: Vec<f64>,
    plans: [Arc<dyn Fft<f64>>; 4],
}

const SIDE_MIN: usize = 16;
const CELLS_MAX: usize = 1 << 20;
/// Cells of the shortest wavelength that a grid shows.
const CELLS_PER_WAVE_MIN: f64 = 2.5;

impl BandFilter {
    pub(super) fn new(grid: &ElevationGrid<'_>, wavelength_m: &RangeInclusive<f64>) -> Result<Self, DownwashError> {
        let (columns, cell_m) = (grid.columns, grid.cell_m);
        let rows = grid.elevation_m.len().checked_div(columns).unwrap_or(0);
        if rows < SIDE_MIN || columns < SIDE_MIN || rows * columns != grid.elevation_m.len() || rows * columns > CELLS_MAX {
            return Err(shape(grid, 0));
        }
        let wavelength_max_m = *wavelength_m.end();
        // NaN is in no range.
        let sensible = 1e-6..1e6;
        let wavelength_min_m = wavelength_m.start().max(CELLS_PER_WAVE_MIN * cell_m);
        if !(sensible.contains(&cell_m) && sensible.contains(&wavelength_max_m) && wavelength_min_m < 0.7 * wavelength_max_m) {
            return Err(DownwashError::Cell { cell_m, wavelength_max_m });
        }
        let (across, down) = (tukey(columns), tukey(rows));
        let taper: Vec<f64> = down.iter().flat_map(|v| across.iter().map(move |u| u * v)).collect();
        let mut planner = FftPlanner::new();
        let plans = [
            planner.plan_fft_forward(columns),
            planner.plan_fft_forward(rows),
            planner.plan_fft_inverse(columns),
            planner.plan_fft_inverse(rows),
        ];
        let weights = taper.iter().map(|t| t * t).collect();
        Ok(Self { columns, rows, wavelength_min_m, wavelength_max_m, cell_m, taper, weights, plans })
    }

    pub(super) fn wavelength_min_m(&self) -> f64 {
        self.wavelength_min_m
    }

    pub(super) fn weights(&self) -> &[f64] {
        &self.weights
    }

    pub(super) fn apply(&self, grid: &ElevationGrid<'_>, frame: usize) -> Result<Band, DownwashError> {
        if grid.columns != self.columns || grid.elevation_m.len() != self.taper.len() || grid.cell_m != self.cell_m {
            return Err(shape(grid, frame));
        }
        // Larger magnitudes are no water, and their squares would overflow.
        let is_known: Vec<bool> = grid.elevation_m.iter().map(|z| z.abs() < 1e6).collect();
        let known = is_known.iter().filter(|known| **known).count();
        let share = known as f64 / is_known.len() as f64;
        if share < 0.25 {
            return Err(DownwashError::Empty { frame, share });
        }
        let mut level_m = without_plane(grid.elevation_m, &is_known, self.columns);
        let total_variance_m2 =
            level_m.iter().zip(&is_known).filter(|(_, known)| **known).map(|(z, _)| z * z).sum::<f64>() / known as f64;
        fill(&mut level_m, &is_known, self.columns);
        let mut spectrum: Vec<Complex<f64>> = level_m.iter().zip(&self.taper).map(|(z, t)| Complex::new(z * t, 0.0)).collect();
        self.transform(&mut spectrum, [0, 1]);
        let cells = spectrum.len() as f64;
        let mut vector = vec![Complex::default(); spectrum.len()];
        for row in 0..self.rows {
            let ky = wavenumber_radpm(row, self.rows, self.cell_m);
            for column in 0..self.columns {
                let kx = wavenumber_radpm(column, self.columns, self.cell_m);
                let (place, k) = (row * self.columns + column, kx.hypot(ky));
                spectrum[place] *= self.gain(k) / cells;
                // Both components of R are real: one goes into the real part, the other into the imaginary one.
                if k > 0.0 {
                    vector[place] = spectrum[place] * Complex::new(-ky, kx) / k;
                }
            }
        }
        self.transform(&mut spectrum, [2, 3]);
        self.transform(&mut vector, [2, 3]);
        Ok(Band {
            elevation_m: spectrum.iter().map(|c| c.re).collect(),
            riesz_m: vector.iter().map(|c| [c.re, c.im]).collect(),
            is_known,
            total_variance_m2,
        })
    }

    /// 1 within the wavelengths, raised cosines over a fifth of an octave to either side.
    fn gain(&self, k_radpm: f64) -> f64 {
        let edge = |k_edge: f64| {
            let place = ((k_radpm / k_edge).log2() / 0.2 + 0.5).clamp(0.0, 1.0);
            0.5 - 0.5 * (PI * place).cos()
        };
        if k_radpm > 0.0 { edge(TAU / self.wavelength_max_m) * (1.0 - edge(TAU / self.wavelength_min_m)) } else { 0.0 }
    }

    /// Rows by one plan, columns by the other.
    fn transform(&self, cells: &mut [Complex<f64>], plans: [usize; 2]) {
        self.plans[plans[0]].process(cells);
        let mut turned = vec![Complex::default(); cells.len()];
        for (place, cell) in cells.iter().enumerate() {
            turned[(place % self.columns) * self.rows + place / self.columns] = *cell;
        }
        self.plans[plans[1]].process(&mut turned);
        for (place, cell) in cells.iter_mut().enumerate() {
            *cell = turned[(place % self.columns) * self.rows + place / self.columns];
        }
    }
}

fn shape(grid: &ElevationGrid<'_>, frame: usize) -> DownwashError {
    let (cells, columns) = (grid.elevation_m.len(), grid.columns);
    DownwashError::Shape { frame, cells, columns, side_min: SIDE_MIN, cells_max: CELLS_MAX }
}

fn wavenumber_radpm(index: usize, count: usize, cell_m: f64) -> f64 {
    let signed = if 2 * index > count { index as f64 - count as f64 } else { index as f64 };
    TAU * signed / (count as f64 * cell_m)
}

/// 1 but for a raised cosine over an eighth at each end.
fn tukey(count: usize) -> Vec<f64> {
    let width = count as f64 / 8.0;
    let from_end = |i: usize| (i as f64 + 0.5).min(count as f64 - 0.5 - i as f64);
    (0..count).map(|i| 0.5 - 0.5 * (PI * (from_end(i) / width).min(1.0)).cos()).collect()
}

/// Elevations less their least-squares plane; 0 where unknown.
fn without_plane(elevation_m: &[f64], is_known: &[bool], columns: usize) -> Vec<f64> {
    let at = |place: usize| [1.0, (place % columns) as f64, (place / columns) as f64];
    let (mut matrix, mut right) = ([[0.0; 3]; 3], [0.0; 3]);
    for (place, z) in elevation_m.iter().enumerate().filter(|(place, _)| is_known[*place]) {
        let base = at(place);
        for (i, a) in base.iter().enumerate() {
            right[i] += a * z;
            base.iter().enumerate().for_each(|(j, b)| matrix[i][j] += a * b);
        }
    }
    // Cells all in one line have no plane: their mean then.
    let plane = super::fit::solve(matrix, right).map_or([right[0] / matrix[0][0], 0.0, 0.0], |(plane, _)| plane);
    let level = |(place, z): (usize, &f64)| {
        let base = at(place);
        if is_known[place] { z - (0..3).map(|i| base[i] * plane[i]).sum::<f64>() } else { 0.0 }
    };
    elevation_m.iter().enumerate().map(level).collect()
}

/// Grows the known cells into the unknown, each the mean of its known neighbours, so that a hole has no edge; at most 64 cells deep.
fn fill(level_m: &mut [f64], is_known: &[bool], columns: usize) {
    const DEPTH_MAX: usize = 64;
    let rows = level_m.len() / columns;
    let mut filled = is_known.to_vec();
    let mut open: Vec<usize> = (0..filled.len()).filter(|place| !filled[*place]).collect();
    for _ in 0..DEPTH_MAX {
        let mut grown = Vec::new();
        for &place in &open {
            let (row, column) = (place / columns, place % columns);
            let sides = [
                (row > 0).then(|| place - columns),
                (row + 1 < rows).then(|| place + columns),
                (column > 0).then(|| place - 1),
                (column + 1 < columns).then(|| place + 1),
            ];
            let known: Vec<f64> = sides.into_iter().flatten().filter(|p| filled[*p]).map(|p| level_m[p]).collect();
            if !known.is_empty() {
                grown.push((place, known.iter().sum::<f64>() / known.len() as f64));
            }
        }
        if grown.is_empty() {
            return;
        }
        for (place, z) in grown {
            level_m[place] = z;
            filled[place] = true;
        }
        open.retain(|place| !filled[*place]);
    }
}
