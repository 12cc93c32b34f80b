//! Patches of a sea, as a rig would deliver them.
//!
//! All waves run at whole lines of one long record, each line with waves from several directions, each of a random (complex normal) amplitude: a
//! Gaussian sea that repeats itself only after the record, which is several times as long as any film. One direction a line would make a sea that
//! looks the same wherever one stands (Jefferys 1987), so that a patch would tell no more than a point. At each cell the lines add up by one
//! transform, which is far less work than wave by wave.

use std::f64::consts::{PI, TAU};

use halcyon_model::{ElevationGrid, Plane, RigId, Stamp, SurfacePatch};
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rustfft::{FftPlanner, num_complex::Complex32};

use super::GRAVITY_MPS2;
use super::sea::Sea;

/// Waves of each line and system.
const DIRECTIONS: u32 = 16;
/// The record is at least so many films long: nothing of a film is seen twice.
const RECORDS: usize = 3;

/// A rig that looks at a sea.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Cells northwards.
    pub rows: u32,
    /// Cells eastwards.
    pub cols: u32,
    /// Side of a cell, metres.
    pub cell_m: f64,
    /// Pairs a second, hertz.
    pub rate_hz: f64,
    /// Error of each cell, independent of all others, metres.
    pub sigma_m: f64,
    /// Error of the level, metres.
    pub level_sigma_m: f64,
    /// Share of frames that are lost, 0 to 1.
    pub frames_lost: f64,
    /// Share of cells that are not seen, 0 to 1.
    pub cells_lost: f64,
}

impl Default for Camera {
    /// Five metres over the water with the default rig.
    fn default() -> Self {
        Self {
            rows: 14,
            cols: 18,
            cell_m: 0.25,
            rate_hz: 5.0,
            sigma_m: 0.002,
            level_sigma_m: 0.002,
            frames_lost: 0.0,
            cells_lost: 0.0,
        }
    }
}

impl Camera {
    /// The patches of `count` exposures, less those that are lost.
    #[must_use]
    pub fn film(&self, sea: &Sea, count: usize, rig: &RigId, seed: u64) -> Vec<SurfacePatch> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let cells = self.rows as usize * self.cols as usize;
        let record = (RECORDS * count).next_power_of_two().max(2);
        let series = self.series(sea, record, &mut random);
        let mut film = Vec::with_capacity(count);
        for frame in 0..count {
            let surface = || series.chunks_exact(record).map(|cell| cell.get(frame).map_or(0.0, |z| f64::from(z.re)));
            let mean_m = surface().sum::<f64>() / cells as f64;
            let is_lost = random.random::<f64>() < self.frames_lost;
            let mut normal = |sigma_m: f64| sigma_m * random.sample::<f64, _>(rand_distr::StandardNormal);
            let level_m = mean_m + normal(self.level_sigma_m);
            let mut elevation_m: Vec<f32> = surface().map(|z| (z - mean_m + normal(self.sigma_m)) as f32).collect();
            if is_lost {
                continue;
            }
            if self.cells_lost > 0.0 {
                elevation_m.iter_mut().filter(|_| random.random::<f64>() < self.cells_lost).for_each(|z| *z = f32::NAN);
            }
            film.push(self.patch(frame, elevation_m, level_m, 5.0 - mean_m, rig));
        }
        film
    }

    /// Elevations of each cell at all instants of the record, metres, in the real parts.
    fn series(&self, sea: &Sea, record: usize, random: &mut ChaCha8Rng) -> Vec<Complex32> {
        let cells = self.rows as usize * self.cols as usize;
        let mut series = vec![Complex32::default(); cells * record];
        let mut field = vec![Complex32::default(); cells];
        let df_hz = self.rate_hz / record as f64;
        for system in &sea.0 {
            let (low_hz, high_hz) = system.band_hz();
            let lines = (low_hz / df_hz).ceil() as usize..=(high_hz / df_hz).floor() as usize;
            let whole: f64 = lines.clone().map(|line| system.shape(line as f64 * df_hz)).sum();
            for line in lines {
                let f_hz = line as f64 * df_hz;
                let variance_m2 = (0.25 * system.h_m0_m).powi(2) * system.shape(f_hz) / whole;
                let sigma_m = (variance_m2 / f64::from(DIRECTIONS)).sqrt();
                let k_radpm = (TAU * f_hz).powi(2) / GRAVITY_MPS2;
                field.fill(Complex32::default());
                for _ in 0..DIRECTIONS {
                    let angle_rad = loop {
                        let angle_rad = TAU * random.random::<f64>() - PI;
                        if random.random::<f64>() < system.spreading(angle_rad) {
                            break angle_rad;
                        }
                    };
                    let (east, north) = (system.towards_rad + angle_rad).sin_cos();
                    let mut normal = || (sigma_m * random.sample::<f64, _>(rand_distr::StandardNormal)) as f32;
                    let amplitude = Complex32::new(normal(), normal());
                    let rows = self.phasors(self.rows, k_radpm * north);
                    let columns = self.phasors(self.cols, k_radpm * east);
                    for (row, cells) in rows.iter().zip(field.chunks_exact_mut(columns.len())) {
                        let along = amplitude * row;
                        cells.iter_mut().zip(&columns).for_each(|(z, column)| *z += along * column);
                    }
                }
                // Waves too fast for the rate fold back, as they do for a camera.
                let bin = line % record;
                field.iter().zip(series.chunks_exact_mut(record)).for_each(|(z, cell)| cell[bin] += z);
            }
        }
        // Forwards, its kernel turns as exp(−iωt) does: waves travel the way they point.
        FftPlanner::<f32>::new().plan_fft_forward(record).process(&mut series);
        series
    }

    /// exp(i k x) along one side.
    fn phasors(&self, count: u32, k_radpm: f64) -> Vec<Complex32> {
        let turn = |i: u32| (k_radpm * f64::from(i) * self.cell_m).sin_cos();
        (0..count).map(turn).map(|(sin, cos)| Complex32::new(cos as f32, sin as f32)).collect()
    }

    fn patch(&self, frame: usize, elevation_m: Vec<f32>, level_m: f64, distance_m: f64, rig: &RigId) -> SurfacePatch {
        SurfacePatch {
            stamp: start().plus_secs_f64(frame as f64 / self.rate_hz),
            rig: rig.clone(),
            sequence: frame as u64,
            grid: ElevationGrid {
                south_west_north_m: 40.0,
                south_west_east_m: -7.0,
                cell_m: self.cell_m,
                rows: self.rows,
                cols: self.cols,
                sigma_m: vec![self.sigma_m as f32; elevation_m.len()],
                elevation_m,
            },
            coverage: 1.0 - self.cells_lost,
            plane: Plane { normal: Vector3::z(), distance_m, rms_m: 0.01 },
            points: 20_000,
            level_m: Some(level_m),
            level_sigma_m: Some(self.level_sigma_m),
            level_thesis_m: None,
            error_length_m: 1e-3,
            slope_removed: [0.0; 2],
            slope_sigma: 0.0,
            attitude_sigma_rad: 0.0,
            processing_s: 0.05,
        }
    }
}

/// When films begin.
#[must_use]
pub fn start() -> Stamp {
    Stamp::from_nanos(1_760_000_000_000_000_000)
}
