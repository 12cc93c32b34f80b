//! What is kept with frames, shared between gauges or added up beforehand, against plain computations from the patches that do none of it: of patches
//! that come in order, late, with holes and gaps, of cells that change, from a rig that drifts and jumps.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use halcyon_model::{ElevationGrid, LocalPoint, Stamp, SurfacePatch, grid_error};
use halcyon_ocean::{Record, Spline};
use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use proptest::prelude::*;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::gauge::{GAUGES, Reading, SIDE};
use super::hidden::{Hidden, hidden};
use super::patch::{cell, tests::patch};
use super::records::{dense, even};
use super::sampling::degrees_of_freedom;
use super::series::{Series, Stretch, despike, runs};
use super::smooth::SMOOTHINGS;
use super::window::Window;
use crate::config::Config;

const RATE_HZ: f64 = 10.0;
const FRAMES: usize = 330;
const WINDOW_S: f64 = 25.0;
const SPOT_M: f64 = 3.0;
const GAP_S: f64 = 0.7;

/// Patches in the order in which they come, each at most `late` places after its own.
fn patches(seed: u64, late: usize, lost: f64, jumps: bool) -> Vec<SurfacePatch> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut patches = Vec::new();
    for i in 0..FRAMES {
        let (time_s, is_gap) = (i as f64 / RATE_HZ, (100..110).contains(&i) && seed.is_multiple_of(2));
        if is_gap || random.random::<f64>() < lost {
            continue;
        }
        // Another height over the water has other cells.
        let cell_m = if (i / 90).is_multiple_of(2) { 0.25 } else { 0.2 };
        let (rows, cols) = (13_u32, 15_u32);
        let north_m = 40.0 + 0.02 * time_s + if jumps && i > 60 { 4.0 } else { 0.0 };
        let wave =
            |n: f64, e: f64| 0.04 * (2.0 * n + 0.7 * e - 4.6 * time_s).sin() + 0.03 * (1.1 * e - 0.8 * n - 3.6 * time_s).sin();
        let mut elevation_m: Vec<f32> = (0..rows * cols)
            .map(|at| wave(north_m + f64::from(at / cols) * cell_m, f64::from(at % cols) * cell_m))
            .map(|z| (z + 0.004 * (random.random::<f64>() - 0.5)) as f32)
            .collect();
        elevation_m.iter_mut().filter(|_| random.random::<f64>() < 0.15).for_each(|z| *z = f32::NAN);
        if random.random::<f64>() < 0.02 {
            elevation_m.iter_mut().for_each(|z| *z *= 6.0);
        }
        let sigma_m = elevation_m.iter().map(|_| random.random_range(0.001..0.003)).collect();
        let grid =
            ElevationGrid { south_west_north_m: north_m, south_west_east_m: 0.0, cell_m, rows, cols, elevation_m, sigma_m };
        // Stamps jitter, as those of a camera do.
        let stamp = Stamp::from_nanos(1_760_000_000_000_000_000).plus_secs_f64(time_s + 0.02 * random.random::<f64>());
        patches.push(SurfacePatch {
            stamp,
            sequence: i as u64,
            level_m: (random.random::<f64>() > 0.03).then(|| 0.02 * (1.9 * time_s).sin()),
            level_sigma_m: Some(0.003),
            ..patch(&grid, 0.2 * cell_m * (1 + seed % 9) as f64, 0.002)
        });
    }
    let mut order: Vec<(usize, usize)> = (0..patches.len()).map(|i| (i + random.random_range(0..=late), i)).collect();
    order.sort_unstable();
    order.into_iter().map(|(_, i)| patches[i].clone()).collect()
}

/// The window after all of them; what it holds is looked at after each.
fn window(patches: &[SurfacePatch]) -> Window {
    let config = Config { window_s: WINDOW_S, spot_radius_m: SPOT_M, slope_baseline_m: 0.4, ..Config::default() };
    let mut window = Window::default();
    let mut kept: Vec<(Stamp, LocalPoint)> = Vec::new();
    for patch in patches {
        window.add(patch, None, &config);
        let grid = &patch.grid;
        let half_m = |cells: u32| 0.5 * (f64::from(cells - 1) * grid.cell_m);
        let centre = LocalPoint::new(grid.south_west_north_m + half_m(grid.rows), grid.south_west_east_m + half_m(grid.cols));
        kept.push((patch.stamp, centre));
        kept.sort_by_key(|(stamp, _)| *stamp);
        let (newest, about) = kept[kept.len() - 1];
        kept.retain(|(stamp, at)| newest.seconds_since(*stamp) <= WINDOW_S && at.distance_m(&about) <= SPOT_M);
        assert!(window.frames().iter().map(|frame| (frame.stamp, frame.centre)).eq(kept.iter().copied()));
    }
    window
}

fn close(found: f64, plain: f64, share: f64, what: &str) {
    assert!((found - plain).abs() <= share * plain.abs().max(1e-9), "{what}: {found}, plainly {plain}");
}

/// One disc of a reading, cell by cell and pair by pair; `None` where less smoothing is better.
fn plain_disc(patch: &SurfacePatch, reading: &Reading, share: f64, tilt_m2: impl Fn(f64, f64) -> f64) -> Option<[f64; 2]> {
    let grid = &patch.grid;
    let place = reading.place;
    let (row0, col0) =
        ((place.north_m - grid.south_west_north_m) / grid.cell_m, (place.east_m - grid.south_west_east_m) / grid.cell_m);
    let radius = (share * f64::from(grid.rows.min(grid.cols) - 1)).min(9.0);
    let mut cells = Vec::new();
    for (row, col) in (0..grid.rows as usize).flat_map(|row| (0..grid.cols as usize).map(move |col| (row, col))) {
        let (y, x) = (row as f64 - row0, col as f64 - col0);
        if let Some((z_m, sigma_m)) = cell(grid, row, col).filter(|_| x.hypot(y) <= radius) {
            let own_m = (sigma_m * sigma_m - tilt_m2(row as f64, col as f64)).max(0.0).sqrt();
            cells.push((row, col, Vector6::new(1.0, x, y, x * x, x * y, y * y), z_m, own_m));
        }
    }
    if cells.len() < 13 {
        return None;
    }
    let normal: Matrix6<f64> = cells.iter().map(|(_, _, basis, ..)| basis * basis.transpose()).sum();
    let picked = normal.cholesky()?.solve(&Vector6::x());
    let pulls = DVector::from_iterator(cells.len(), cells.iter().map(|(_, _, basis, _, own_m)| own_m * picked.dot(basis)));
    let covariance = |lag: usize| grid_error::covariance(lag as f64 * grid.cell_m, grid.cell_m, patch.error_length_m);
    let along: Vec<f64> = (0..20).map(|lag| covariance(lag) / covariance(0)).collect();
    let shared = DMatrix::from_fn(cells.len(), cells.len(), |a, b| {
        along[cells[a].0.abs_diff(cells[b].0)] * along[cells[a].1.abs_diff(cells[b].1)]
    });
    let elevation_m = cells.iter().map(|(_, _, basis, z_m, _)| z_m * picked.dot(basis)).sum();
    Some([elevation_m, pulls.dot(&(shared * &pulls))])
}

fn check_readings(window: &Window, patches: &[SurfacePatch]) {
    for frame in window.frames().iter().step_by(40) {
        let patch = patches.iter().find(|patch| patch.stamp == frame.stamp).unwrap();
        let grid = &patch.grid;
        let cols = grid.cols as usize;
        let seen: Vec<usize> = (0..grid.elevation_m.len()).filter(|i| grid.elevation_m[*i].is_finite()).collect();
        let middle = |of: &dyn Fn(usize) -> usize| seen.iter().map(|i| of(*i) as f64).sum::<f64>() / seen.len() as f64;
        let (row0, col0) = (middle(&|i| i / cols), middle(&|i| i % cols));
        let per_cell2 = (patch.slope_sigma * grid.cell_m).powi(2);
        let tilt_m2 = |row: f64, col: f64| per_cell2 * ((row - row0).powi(2) + (col - col0).powi(2));
        for reading in frame.readings.iter().flatten() {
            for (level, share) in [(1, 0.12), (2, 0.30)] {
                let (before, sample) = (reading.samples[level - 1], reading.samples[level]);
                match plain_disc(patch, reading, share, tilt_m2).filter(|[_, noise_m2]| *noise_m2 <= before.noise_m2) {
                    Some([elevation_m, noise_m2]) => {
                        close(sample.elevation_m, elevation_m, 1e-7, "elevation of a disc");
                        close(sample.noise_m2, noise_m2, 1e-7, "noise of a disc");
                    }
                    None => assert_eq!(sample, before),
                }
            }
        }
        let bend = frame.bend.unwrap();
        let basis = |i: &usize| {
            let (y, x) = (((i / cols) as f64 - row0) * grid.cell_m, ((i % cols) as f64 - col0) * grid.cell_m);
            Vector6::new(1.0, x, y, x * x, x * y, y * y)
        };
        let normal: Matrix6<f64> = seen.iter().map(|i| basis(i) * basis(i).transpose()).sum();
        let right: Vector6<f64> = seen.iter().map(|i| basis(i) * f64::from(grid.elevation_m[*i])).sum();
        let parabola = normal.cholesky().unwrap().solve(&right);
        close(bend.half_laplacian_per_m, parabola[3] + parabola[5], 1e-7, "bend");
        close(bend.grid_slope[0], parabola[1], 1e-7, "slope east");
        close(bend.grid_slope[1], parabola[2], 1e-7, "slope north");
        let left = |i: &usize| (f64::from(grid.elevation_m[*i]) - parabola.dot(&basis(i))).powi(2);
        close(bend.residual_m2, seen.iter().map(left).sum::<f64>() / seen.len() as f64, 1e-6, "residual");
    }
}

/// The largest disc that takes out no more than noise explains, and what it may take out, from all readings at once.
fn plain_smoothing(window: &Window) -> (usize, f64) {
    let all: Vec<&Reading> = window.frames().iter().flat_map(|frame| frame.readings.iter().flatten()).collect();
    let count = all.len() as f64;
    let mut best = (0, 0.0);
    for level in 1..SMOOTHINGS {
        let mean = |of: &dyn Fn(&Reading) -> f64| all.iter().map(|reading| of(reading)).sum::<f64>() / count;
        let taken_m2 = mean(&|r| (r.samples[0].elevation_m - r.samples[level].elevation_m).powi(2));
        let explained_m2 = mean(&|r| r.samples[0].noise_m2 - r.samples[level].noise_m2);
        let doubt_m2 = explained_m2 * (0.1 + 2.0 * (2.0 / count).sqrt());
        if taken_m2 > explained_m2 + doubt_m2 {
            break;
        }
        best = (level, (taken_m2 - explained_m2 + doubt_m2).max(0.0));
    }
    best
}

/// Gauge by gauge, run by run: (slot, seconds, elevation, with all that may be hidden).
fn check_series(window: &Window, hidden: &Hidden, series: &Series) {
    let (level, lost_m2) = plain_smoothing(window);
    close(series.lost_m2, lost_m2, 1e-7, "lost to smoothing");
    let start = window.frames()[0].stamp;
    let (mut stretches, mut samples, mut replaced) = (Vec::new(), 0, 0);
    for slot in 0..GAUGES {
        let known = window.frames().iter().enumerate().filter(|(i, _)| !hidden.is_missing(*i));
        let readings: Vec<(u64, (usize, f64))> =
            known.filter_map(|(i, frame)| Some((frame.readings[slot]?.gauge, (i, frame.stamp.seconds_since(start))))).collect();
        // A late patch may have been read at another gauge than those about it.
        let of_gauges = readings.chunk_by(|a, b| a.0 == b.0).map(|of| of.iter().map(|(_, at)| *at).collect::<Vec<_>>());
        for run in of_gauges.collect::<Vec<_>>().iter().flat_map(|points| runs(points, GAP_S)) {
            if run[run.len() - 1].1 - run[0].1 < 10.0 || run.len() < 12 {
                continue;
            }
            let at = |i: usize| (&window.frames()[i], window.frames()[i].readings[slot].unwrap());
            let read = |i: &usize| {
                let (frame, reading) = at(*i);
                let (waves_m, all_m) = hidden.at(*i, frame, reading.place);
                (reading.samples[level].elevation_m + waves_m, reading.samples[level].elevation_m + all_m)
            };
            let (mut waves, mut upper): (Vec<f64>, Vec<f64>) = run.iter().map(|(i, _)| read(i)).unzip();
            replaced += despike(&mut waves, &mut upper);
            samples += run.len();
            for values in [&mut waves, &mut upper] {
                let mean = values.iter().sum::<f64>() / values.len() as f64;
                values.iter_mut().for_each(|x| *x -= mean);
            }
            stretches.push((slot, run.iter().map(|(_, t)| *t).collect::<Vec<_>>(), waves, upper));
        }
    }
    let all = |s: &Stretch| (s.slot, s.times_s.clone(), s.elevation_m.clone(), s.elevation_upper_m.clone());
    assert_eq!(series.stretches.iter().map(all).collect::<Vec<_>>(), stretches);
    assert_eq!((series.samples, series.replaced), (samples, replaced));
}

fn check_records(series: &Series, interval_s: f64) {
    let (dense, step_s) = (dense(series, interval_s), interval_s / 4.0);
    assert_eq!(dense.len(), series.stretches.len());
    for ((stretch, (slot, drawn)), even) in series.stretches.iter().zip(&dense).zip(even(&dense)) {
        assert_eq!(*slot, stretch.slot);
        let curve = Spline::new(stretch.times_s.clone(), stretch.elevation_m.clone()).unwrap();
        let (from_s, length_s) = (stretch.times_s[0], stretch.times_s[stretch.times_s.len() - 1] - stretch.times_s[0]);
        let plain = |step_s: f64| curve.sampled(from_s, step_s, (length_s / step_s).floor() as usize + 1);
        assert_eq!(drawn.samples_m(), plain(step_s));
        assert_eq!(even, Record::new(plain(interval_s), 1.0 / interval_s).unwrap().without_trend());
    }
}

/// Signs sample by sample, pair by pair.
fn plain_freedom(series: &Series, interval_s: f64, period_s: f64) -> f64 {
    let number = |time_s: f64| (time_s / interval_s).round() as usize;
    let length = 1 + series.stretches.iter().map(|s| number(s.times_s[s.times_s.len() - 1])).max().unwrap();
    let mut rows: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for stretch in &series.stretches {
        let row = rows.entry(stretch.slot).or_insert_with(|| vec![f64::NAN; length]);
        stretch.times_s.iter().zip(&stretch.elevation_m).for_each(|(time_s, z)| row[number(*time_s)] = *z);
    }
    let duration_s = length as f64 * interval_s;
    let lag_max = ((3.0 * period_s).max(2.0).min(duration_s / 3.0) / interval_s).round() as usize;
    let way = |a: &usize, b: &usize| ((b / SIDE) as i64 - (a / SIDE) as i64, (b % SIDE) as i64 - (a % SIDE) as i64);
    let pairs: Vec<(&usize, &usize)> = rows.keys().flat_map(|a| rows.keys().map(move |b| (a, b))).collect();
    let squares = |apart: (i64, i64)| {
        let (mut waves, mut signs) = (0.0, 0.0);
        for lag in 0..=lag_max {
            let (mut known, mut unlike) = (0.0, 0.0);
            for (a, b) in pairs.iter().filter(|(a, b)| way(a, b) == apart) {
                for (x, y) in rows[*a].iter().zip(&rows[*b][lag..]).filter(|(x, y)| !x.is_nan() && !y.is_nan()) {
                    (known, unlike) = (known + 1.0, unlike + if (*x > 0.0) == (*y > 0.0) { 0.0 } else { 1.0 });
                }
            }
            let angle = FRAC_PI_2 * if known > 0.0 { 1.0 - 2.0 * unlike / known } else { 0.0 };
            let weight = (1.0 - lag as f64 / length as f64).powi(2) * if lag == 0 { 1.0 } else { 2.0 };
            (waves, signs) = (waves + weight * angle.sin().powi(2), signs + weight * angle * angle);
        }
        (waves, signs)
    };
    let mut ways: BTreeMap<(i64, i64), f64> = BTreeMap::new();
    pairs.iter().for_each(|(a, b)| *ways.entry(way(a, b)).or_default() += 1.0);
    let all: BTreeMap<(i64, i64), (f64, f64)> = ways.keys().map(|apart| (*apart, squares(*apart))).collect();
    let lags = 2.0 * lag_max as f64 * interval_s / duration_s;
    let mut sum = 0.0;
    for (apart, count) in &ways {
        // Pairs of pairs: the squared correlation of the first gauges of each two pairs that lie alike.
        let first: Vec<&usize> = pairs.iter().filter(|(a, b)| way(a, b) == *apart).map(|(a, _)| *a).collect();
        let noise = first.iter().flat_map(|a| first.iter().map(|b| all[&way(a, b)].1)).sum::<f64>() / (count * count);
        sum += count * (all[apart].0 - lags / (1.0 + lags) * noise);
    }
    let (gauges, scale) = (rows.len() as f64, 2.0 * interval_s / duration_s);
    let own = all[&(0, 0)].0 / (1.0 + lags) * scale;
    let wider = (1.9 * period_s / duration_s / own).max(1.0);
    let freedom = 2.0 / (wider * (sum * scale / (gauges * gauges)).clamp(own / gauges, own));
    freedom * freedom / (freedom + 10.0)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn what_is_kept_and_shared_is_what_comes_of_the_patches(
        seed in 0_u64..1000, late in 0_usize..12, lost in 0.0..0.2, jumps in any::<bool>(),
    ) {
        let patches = patches(seed, late, lost, jumps);
        let window = window(&patches);
        check_readings(&window, &patches);
        let config = Config::default();
        let interval_s = window.interval_s().unwrap();
        for hidden in [Hidden::Unknown, hidden(&window, &config, interval_s)] {
            let series = Series::new(&window, &hidden, GAP_S);
            check_series(&window, &hidden, &series);
            prop_assert!(series.samples > 200, "{} samples: nothing was looked at", series.samples);
            check_records(&series, interval_s);
            for period_s in [0.3, 1.4] {
                let found = degrees_of_freedom(&series, interval_s, Some(period_s)).unwrap();
                close(found, plain_freedom(&series, interval_s, period_s), 1e-9, "degrees of freedom");
            }
        }
    }
}
