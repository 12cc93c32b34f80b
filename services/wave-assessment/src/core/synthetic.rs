//! Seas of which all is known, for tests: sums of linear waves, written without anything of the estimator, and what a rig over them sees.

use std::f64::consts::{PI, TAU};

use halcyon_model::{ElevationGrid, Plane, RigId, Stamp, SurfacePatch};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const GRAVITY_MPS2: f64 = 9.80665;
/// Bands of a system, and waves in each.
const BANDS: u32 = 80;
const EACH: u32 = 10;

/// Waves of JONSWAP's shape (γ 3.3, from 0.55 to 2.45 of the peak's frequency), spread as cos-2s at all frequencies, in deep water.
#[derive(Debug, Clone, Copy)]
pub(crate) struct System {
    pub h_m0_m: f64,
    pub t_p_s: f64,
    pub s: f64,
    pub towards_deg: f64,
}

impl System {
    pub(crate) fn new(h_m0_m: f64, t_p_s: f64, s: f64, towards_deg: f64) -> Self {
        Self { h_m0_m, t_p_s, s, towards_deg }
    }

    pub(crate) fn variance_m2(&self) -> f64 {
        (0.25 * self.h_m0_m).powi(2)
    }

    /// Up to a factor.
    fn shape(&self, f_hz: f64) -> f64 {
        let ratio = f_hz * self.t_p_s;
        if !(0.55..=2.45).contains(&ratio) {
            return 0.0;
        }
        let width = if ratio <= 1.0 { 0.07 } else { 0.09 };
        ratio.powi(-5) * (-1.25 * ratio.powi(-4)).exp() * 3.3_f64.powf((-((ratio - 1.0) / width).powi(2) / 2.0).exp())
    }

    /// The frequency spectrum's share in 1/Hz: its integral is 1.
    fn share_per_hz(&self) -> impl Fn(f64) -> f64 {
        let df_hz = 1.9 / self.t_p_s / 2000.0;
        let whole: f64 = (0..2000).map(|i| self.shape(0.55 / self.t_p_s + (f64::from(i) + 0.5) * df_hz) * df_hz).sum();
        let system = *self;
        move |f_hz| system.shape(f_hz) / whole
    }

    /// cos-2s at so many radians off the mean direction; over the circle its integral is 1.
    fn spreading(&self) -> impl Fn(f64) -> f64 {
        let s = self.s;
        let shape = move |off_rad: f64| (0.5 * off_rad).cos().powi(2).powf(s);
        let whole: f64 = (0..2000).map(|i| shape(TAU * f64::from(i) / 2000.0) * TAU / 2000.0).sum();
        move |off_rad| shape(off_rad) / whole
    }

    /// m²/Hz/rad at a frequency, hertz, and where waves go to, radians.
    pub(crate) fn density(&self) -> impl Fn(f64, f64) -> f64 {
        let (share, spreading, system) = (self.share_per_hz(), self.spreading(), *self);
        move |f_hz, rad| system.variance_m2() * share(f_hz) * spreading(rad - system.towards_deg.to_radians())
    }

    /// Mean square of the slope between points `run_m` apart, northwards and eastwards together.
    pub(crate) fn slope_square(&self, run_m: f64) -> f64 {
        let density = self.density();
        let (df_hz, step_rad) = (1.9 / self.t_p_s / 200.0, TAU / 180.0);
        let mut sum = 0.0;
        for i in 0..200 {
            let f_hz = 0.55 / self.t_p_s + (f64::from(i) + 0.5) * df_hz;
            let k_radpm = (TAU * f_hz).powi(2) / GRAVITY_MPS2;
            for j in 0..180 {
                let rad = f64::from(j) * step_rad;
                // A sine's rise over its run.
                let along = |share: f64| (2.0 * (0.5 * k_radpm * run_m * share).sin() / run_m).powi(2);
                sum += density(f_hz, rad) * (along(rad.cos()) + along(rad.sin())) * df_hz * step_rad;
            }
        }
        sum
    }
}

/// (re + i im) exp i(kn n + ke e − ω t).
struct Wave {
    re_m: f64,
    im_m: f64,
    north_radpm: f64,
    east_radpm: f64,
    radps: f64,
}

/// A Gaussian sea: each of many narrow bands has waves of random frequency, direction and complex normal amplitude. With one direction a band it
/// would look the same wherever one stands (Jefferys 1987).
pub(crate) struct Water(Vec<Wave>);

impl Water {
    pub(crate) fn new(systems: &[System], seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut all = Vec::new();
        for system in systems {
            let width_hz = 1.9 / system.t_p_s / f64::from(BANDS);
            let share = system.share_per_hz();
            for band in 0..BANDS {
                let low_hz = 0.55 / system.t_p_s + f64::from(band) * width_hz;
                let variance_m2 = system.variance_m2() * share(low_hz + 0.5 * width_hz) * width_hz / f64::from(EACH);
                for _ in 0..EACH {
                    let radps = TAU * (low_hz + width_hz * random.random::<f64>());
                    let off_rad = loop {
                        let angle_rad = TAU * random.random::<f64>() - PI;
                        if random.random::<f64>() < (0.5 * angle_rad).cos().powi(2).powf(system.s) {
                            break angle_rad;
                        }
                    };
                    let (sin, cos) = (system.towards_deg.to_radians() + off_rad).sin_cos();
                    let k_radpm = radps * radps / GRAVITY_MPS2;
                    let mut normal = || variance_m2.sqrt() * random.sample::<f64, _>(rand_distr::StandardNormal);
                    let (re_m, im_m) = (normal(), normal());
                    all.push(Wave { re_m, im_m, north_radpm: k_radpm * cos, east_radpm: k_radpm * sin, radps });
                }
            }
        }
        Self(all)
    }

    /// Elevation, metres, and the slopes northwards and eastwards.
    pub(crate) fn at(&self, north_m: f64, east_m: f64, t_s: f64) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for w in &self.0 {
            let (sin, cos) = (w.north_radpm * north_m + w.east_radpm * east_m - w.radps * t_s).sin_cos();
            let (value, turned) = (w.re_m * cos - w.im_m * sin, -w.re_m * sin - w.im_m * cos);
            sum = [sum[0] + value, sum[1] + turned * w.north_radpm, sum[2] + turned * w.east_radpm];
        }
        sum
    }
}

/// A rig that holds its place over the water, the first cell's middle at the origin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rig {
    pub rows: u32,
    pub cols: u32,
    pub cell_m: f64,
    pub rate_hz: f64,
    pub frames: u32,
    /// Of each cell, independent of all others, metres; and of the level.
    pub sigma_m: f64,
}

impl Rig {
    /// North and east of the middle, metres.
    pub(crate) fn middle_m(&self) -> (f64, f64) {
        (0.5 * f64::from(self.rows - 1) * self.cell_m, 0.5 * f64::from(self.cols - 1) * self.cell_m)
    }

    /// Seconds of a frame: the last is at 0.
    pub(crate) fn time_s(&self, frame: u32) -> f64 {
        (f64::from(frame) - f64::from(self.frames - 1)) / self.rate_hz
    }

    /// The patches of `water`.
    pub(crate) fn film(&self, water: &Water, seed: u64) -> Vec<SurfacePatch> {
        let mut random = ChaCha8Rng::seed_from_u64(seed ^ 0x5eed);
        let cells = (self.rows * self.cols) as usize;
        let place = |i: usize| (f64::from(i as u32 / self.cols) * self.cell_m, f64::from(i as u32 % self.cols) * self.cell_m);
        // Each wave as a phasor over the cells, turned from frame to frame.
        let phasors = water.0.iter().map(|w| {
            let at = |(north_m, east_m): (f64, f64)| {
                let (sin, cos) = (w.north_radpm * north_m + w.east_radpm * east_m).sin_cos();
                ((w.re_m * cos - w.im_m * sin) as f32, (w.re_m * sin + w.im_m * cos) as f32)
            };
            (0..cells).map(place).map(at).unzip()
        });
        let phasors: Vec<(Vec<f32>, Vec<f32>)> = phasors.collect();
        let frame = |frame: u32| {
            let t_s = self.time_s(frame);
            let mut surface_m = vec![0.0_f32; cells];
            for (w, (re, im)) in water.0.iter().zip(&phasors) {
                let (sin, cos) = (w.radps * t_s).sin_cos();
                let (sin, cos) = (sin as f32, cos as f32);
                surface_m.iter_mut().zip(re).zip(im).for_each(|((z, re), im)| *z += re * cos + im * sin);
            }
            let mean_m = surface_m.iter().map(|z| f64::from(*z)).sum::<f64>() / cells as f64;
            let mut noise = || self.sigma_m * random.sample::<f64, _>(rand_distr::StandardNormal);
            let level_m = mean_m + noise();
            let elevation_m = surface_m.iter().map(|z| (f64::from(*z) - mean_m + noise()) as f32).collect();
            self.patch(frame, elevation_m, level_m)
        };
        (0..self.frames).map(frame).collect()
    }

    /// The same patches with `more` on the water: metres at places north and east and a time. What it lifts all cells by goes to the level.
    pub(crate) fn with(&self, film: &[SurfacePatch], more: impl Fn(f64, f64, f64) -> f64) -> Vec<SurfacePatch> {
        let mut film = film.to_vec();
        for (frame, patch) in film.iter_mut().enumerate() {
            let t_s = self.time_s(frame as u32);
            let place = |i: u32| (f64::from(i / self.cols) * self.cell_m, f64::from(i % self.cols) * self.cell_m);
            let added: Vec<f64> = (0..self.rows * self.cols).map(place).map(|(n, e)| more(n, e, t_s)).collect();
            let mean_m = added.iter().sum::<f64>() / added.len() as f64;
            patch.grid.elevation_m.iter_mut().zip(&added).for_each(|(z, more_m)| *z += (more_m - mean_m) as f32);
            patch.level_m = patch.level_m.map(|level_m| level_m + mean_m);
        }
        film
    }

    fn patch(&self, frame: u32, elevation_m: Vec<f32>, level_m: f64) -> SurfacePatch {
        SurfacePatch {
            stamp: Stamp::from_nanos(1_760_000_000_000_000_000).plus_secs_f64(self.time_s(frame)),
            rig: RigId::new("leader-1").unwrap(),
            sequence: u64::from(frame),
            grid: ElevationGrid {
                south_west_north_m: 0.0,
                south_west_east_m: 0.0,
                cell_m: self.cell_m,
                rows: self.rows,
                cols: self.cols,
                sigma_m: vec![self.sigma_m as f32; elevation_m.len()],
                elevation_m,
            },
            coverage: 1.0,
            plane: Plane { normal: nalgebra::Vector3::z(), distance_m: 5.0 - level_m, rms_m: 0.01 },
            points: 20_000,
            level_m: Some(level_m),
            level_sigma_m: Some(self.sigma_m),
            level_thesis_m: None,
            error_length_m: 1e-3,
            slope_removed: [0.0; 2],
            slope_sigma: 0.0,
            attitude_sigma_rad: 0.0,
            processing_s: 0.05,
        }
    }
}
