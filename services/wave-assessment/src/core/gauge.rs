//! Virtual gauges: spots of water that are read from patch after patch.

use halcyon_model::{ElevationGrid, LocalPoint, SurfacePatch};

use super::correlation::Correlation;
use super::patch::cell;
use super::smooth::{SMOOTHINGS, Smoother};

/// Gauges along each side of the layout.
pub(crate) const SIDE: usize = 3;
/// The outer ones are this share of a side from the edges: a vehicle that holds its place sways.
const MARGIN: f64 = 0.15;
/// Gauges at work at once.
pub(crate) const GAUGES: usize = SIDE * SIDE;
/// The gauge in the middle of the layout.
pub(crate) const CENTRE: usize = GAUGES / 2;
/// A gauge that could not be read this many times in a row is moved.
const MISSES_MAX: u32 = 10;

/// Elevation at a gauge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reading {
    /// Which gauge: a new number each time that a gauge is placed.
    pub gauge: u64,
    /// Where it is.
    pub place: LocalPoint,
    /// Of the cells right there, and of ever larger discs around; one that cannot be had is the same as the one before.
    pub samples: [Sample; SMOOTHINGS],
}

/// An elevation with its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    /// Above the patch's own mean level, metres.
    pub elevation_m: f64,
    /// One standard deviation, metres.
    pub sigma_m: f64,
    /// The matcher's part of its variance, m². The rest is tilt that the attitude leaves in doubt: it has been weighed against the waves'
    /// own, so that it takes from them as much as it adds.
    pub noise_m2: f64,
}

#[derive(Debug, Clone, Copy)]
struct Gauge {
    number: u64,
    place: LocalPoint,
    misses: u32,
}

/// Nine gauges in a square over the patch. Each stays over its water while the vehicle moves a little, and
/// is placed anew when it leaves the patch or sees nothing.
#[derive(Debug, Clone, Default)]
pub(crate) struct Gauges {
    placed: [Option<Gauge>; GAUGES],
    next: u64,
    /// Of the cells of the last patch.
    correlation: Option<Correlation>,
}

impl Gauges {
    /// Reads every gauge from `patch`.
    pub(crate) fn read(&mut self, patch: &SurfacePatch) -> [Option<Reading>; GAUGES] {
        let grid = &patch.grid;
        let correlation = match self.correlation.take() {
            Some(correlation) if correlation.is_of(patch) => correlation,
            _ => Correlation::new(grid.cell_m, patch.error_length_m),
        };
        let smoother = Smoother::new(patch, &correlation);
        let mut readings = [None; GAUGES];
        for (slot, reading) in readings.iter_mut().enumerate() {
            let gauge = match self.placed[slot] {
                Some(gauge) if gauge.misses <= MISSES_MAX && is_inside(grid, gauge.place) => gauge,
                _ => {
                    self.next += 1;
                    Gauge { number: self.next, place: nominal(grid, slot), misses: 0 }
                }
            };
            let seen = interpolate(grid, gauge.place);
            *reading = seen.map(|(elevation_m, sigma_m)| Reading {
                gauge: gauge.number,
                place: gauge.place,
                samples: smoother.samples(gauge.place, elevation_m, sigma_m),
            });
            let misses = if seen.is_some() { 0 } else { gauge.misses + 1 };
            self.placed[slot] = Some(Gauge { misses, ..gauge });
        }
        self.correlation = Some(correlation);
        readings
    }
}

/// Where a slot's gauge is placed: at the cell nearest to its place in the layout, or the nearest to it within an eighth that
/// has a measurement. Right on a cell, so that grids that keep to multiples of their cell need no interpolation.
fn nominal(grid: &ElevationGrid, slot: usize) -> LocalPoint {
    let fraction = |i: usize| MARGIN + (1.0 - 2.0 * MARGIN) * i as f64 / (SIDE - 1) as f64;
    let (rows, cols) = (f64::from(grid.rows - 1), f64::from(grid.cols - 1));
    let (row, col) = ((fraction(slot / SIDE) * rows).round(), (fraction(slot % SIDE) * cols).round());
    let (reach_rows, reach_cols) = ((rows / 8.0).floor() as i64, (cols / 8.0).floor() as i64);
    let (mut place, mut nearest) = ((row, col), i64::MAX);
    for i in -reach_rows..=reach_rows {
        for j in -reach_cols..=reach_cols {
            let (r, c) = (row + i as f64, col + j as f64);
            let distance = i * i + j * j;
            if distance < nearest && r >= 0.0 && c >= 0.0 && cell(grid, r as usize, c as usize).is_some() {
                (place, nearest) = ((r, c), distance);
            }
        }
    }
    LocalPoint::new(grid.south_west_north_m + place.0 * grid.cell_m, grid.south_west_east_m + place.1 * grid.cell_m)
}

/// Row and column of a place, in cells.
fn row_col(grid: &ElevationGrid, place: LocalPoint) -> (f64, f64) {
    ((place.north_m - grid.south_west_north_m) / grid.cell_m, (place.east_m - grid.south_west_east_m) / grid.cell_m)
}

fn is_inside(grid: &ElevationGrid, place: LocalPoint) -> bool {
    let (row, col) = row_col(grid, place);
    (0.0..=f64::from(grid.rows - 1)).contains(&row) && (0.0..=f64::from(grid.cols - 1)).contains(&col)
}

/// Elevation at a place and its standard deviation: Catmull-Rom's cubic over the 4 × 4 cells around it (straight lines would flatten
/// waves of ten cells by 5 %), or the nearest cell where one of them was not seen; `None` where that was not either.
///
/// Neighbouring cells share pixels, so their errors are taken as common: averaging them gains nothing.
fn interpolate(grid: &ElevationGrid, place: LocalPoint) -> Option<(f64, f64)> {
    if !is_inside(grid, place) {
        return None;
    }
    let (row, col) = row_col(grid, place);
    let nearest = cell(grid, row.round() as usize, col.round() as usize)
        .or_else(|| bridged(grid, row.round() as usize, col.round() as usize));
    let (row0, col0) = (row.floor(), col.floor());
    if (row - row.round()).abs() < 1e-3 && (col - col.round()).abs() < 1e-3 {
        return nearest;
    }
    let (row_weights, col_weights) = (catmull_rom(row - row0), catmull_rom(col - col0));
    let (mut elevation_m, mut variance_m2, mut weight) = (0.0, 0.0, 0.0);
    for (i, row_weight) in row_weights.iter().enumerate() {
        for (j, col_weight) in col_weights.iter().enumerate() {
            let w = row_weight * col_weight;
            if w == 0.0 {
                continue;
            }
            let (Some(r), Some(c)) = ((row0 as usize + i).checked_sub(1), (col0 as usize + j).checked_sub(1)) else {
                return nearest;
            };
            if r >= grid.rows as usize || c >= grid.cols as usize {
                return nearest;
            }
            let Some((cell_m, sigma_m)) = cell(grid, r, c) else { return nearest };
            elevation_m += w * cell_m;
            variance_m2 += w.abs() * sigma_m * sigma_m;
            weight += w.abs();
        }
    }
    Some((elevation_m, (variance_m2 / weight).sqrt()))
}

/// A cell that was not seen, from those two to either side along each axis that has all four: the cubic through them, which keeps 97 % of a wave of ten
/// cells. A series with holes loses its crests, and stretches between them.
fn bridged(grid: &ElevationGrid, row: usize, col: usize) -> Option<(f64, f64)> {
    let (mut elevation_m, mut variance_m2, mut axes) = (0.0, 0.0, 0.0);
    for (step_row, step_col) in [(1, 0), (0, 1)] {
        let beside = |steps: isize| {
            let (r, c) = (row.checked_add_signed(steps * step_row)?, col.checked_add_signed(steps * step_col)?);
            if r < grid.rows as usize && c < grid.cols as usize { cell(grid, r, c) } else { None }
        };
        if let (Some(a), Some(b), Some(c), Some(d)) = (beside(-2), beside(-1), beside(1), beside(2)) {
            elevation_m += (4.0 * (b.0 + c.0) - (a.0 + d.0)) / 6.0;
            variance_m2 += (16.0 * (b.1 * b.1 + c.1 * c.1) + a.1 * a.1 + d.1 * d.1) / 36.0;
            axes += 1.0;
        }
    }
    // Of one axis as of two: neighbours share pixels, and what is averaged may share its error.
    (axes > 0.0).then(|| (elevation_m / axes, (variance_m2 / axes).sqrt()))
}

/// Weights of the points at −1, 0, 1 and 2 for a value at `t` in 0 … 1; they add up to one.
fn catmull_rom(t: f64) -> [f64; 4] {
    [
        0.5 * t * (t * (2.0 - t) - 1.0),
        0.5 * (t * t * (3.0 * t - 5.0) + 2.0),
        0.5 * t * (t * (4.0 - 3.0 * t) + 1.0),
        0.5 * t * t * (t - 1.0),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::patch::tests::patch;

    fn grid(north_m: f64, f: impl Fn(f64, f64) -> f32) -> ElevationGrid {
        let (rows, cols, cell_m) = (21_u32, 31_u32, 0.1);
        let elevation_m = (0..rows * cols)
            .map(|i| f(north_m + f64::from(i / cols) * cell_m, f64::from(i % cols) * cell_m))
            .collect::<Vec<_>>();
        let sigma_m = vec![0.002; elevation_m.len()];
        ElevationGrid { south_west_north_m: north_m, south_west_east_m: 0.0, cell_m, rows, cols, elevation_m, sigma_m }
    }

    #[test]
    fn a_gauge_stays_over_its_water_and_ends_with_the_patch() {
        let plane = |n: f64, e: f64| (0.3 * n - 0.2 * e) as f32;
        // Between cells as well as on them: Catmull-Rom's cubic is exact for a plane.
        let mut gauges = Gauges::default();
        let first = gauges.read(&patch(&grid(0.0, plane), 0.1, 0.0));
        let moved = gauges.read(&patch(&grid(0.13, plane), 0.1, 0.0));
        for (a, b) in first.iter().zip(&moved) {
            let (a, b) = (a.unwrap(), b.unwrap());
            assert_eq!(a.gauge, b.gauge);
            assert!((a.samples[0].elevation_m - b.samples[0].elevation_m).abs() < 1e-6);
        }
        // One metre north: the southern three (at 0.3 m) are left behind, the others stay.
        let further = gauges.read(&patch(&grid(1.0, plane), 0.1, 0.0));
        let kept = first.iter().zip(&further).filter(|(a, b)| a.unwrap().gauge == b.unwrap().gauge).count();
        assert_eq!(kept, 6);
    }

    #[test]
    fn between_cells_a_wave_keeps_its_height() {
        // Twelve cells long, read half-way between cells along it.
        let wave = |n: f64, _: f64| (std::f64::consts::TAU * n / 1.2).sin() as f32;
        for i in 0..100 {
            let place = LocalPoint::new(0.55 + 0.01 * f64::from(i), 1.0);
            let (elevation_m, _) = interpolate(&grid(0.0, wave), place).unwrap();
            assert!((elevation_m - f64::from(wave(place.north_m, 0.0))).abs() < 0.01);
        }
    }

    #[test]
    fn holes_are_no_readings() {
        let mut gauges = Gauges::default();
        assert!(gauges.read(&patch(&grid(0.0, |_, _| f32::NAN), 0.1, 0.0)).iter().all(Option::is_none));
        // Nothing in the northern half: the three gauges there see nothing, and none is made up.
        let half = gauges.read(&patch(&grid(0.0, |n, _| if n > 1.25 { f32::NAN } else { 0.01 }), 0.1, 0.0));
        assert_eq!(half.iter().filter(|r| r.is_some()).count(), 6);
        // A hole just at the centre: after a while its gauge moves to the nearest water in sight.
        let hole = |n: f64, e: f64| if (n - 1.0).abs() < 0.15 && (e - 1.5).abs() < 0.15 { f32::NAN } else { 0.01 };
        for _ in 0..=MISSES_MAX + 1 {
            gauges.read(&patch(&grid(0.0, hole), 0.1, 0.0));
        }
        assert!(gauges.read(&patch(&grid(0.0, hole), 0.1, 0.0))[CENTRE].is_some());
    }
}
