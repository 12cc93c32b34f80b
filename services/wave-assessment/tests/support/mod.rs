//! Seas and patches for tests: random sums of linear waves, written without anything of the estimator.
#![allow(dead_code, unreachable_pub, clippy::unwrap_used, reason = "each test takes what it needs, and may fail")]

use halcyon_model::{ElevationGrid, Plane, RigId, Stamp, SurfacePatch};
use halcyon_ocean::{Jonswap, Spectrum};
use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::TAU;

pub const GRAVITY_MPS2: f64 = 9.80665;

/// One wave: (re + i im) exp i(kn n + ke e − ω t).
#[derive(Debug, Clone, Copy)]
pub struct Component {
    pub re_m: f64,
    pub im_m: f64,
    pub north_radpm: f64,
    pub east_radpm: f64,
    pub radps: f64,
}

impl Component {
    /// A wave of this amplitude and period in deep water that travels towards `towards_deg`.
    pub fn regular(amplitude_m: f64, period_s: f64, towards_deg: f64) -> Self {
        let radps = TAU / period_s;
        let k_radpm = radps * radps / GRAVITY_MPS2;
        let (sin, cos) = towards_deg.to_radians().sin_cos();
        Self { re_m: amplitude_m, im_m: 0.0, north_radpm: k_radpm * cos, east_radpm: k_radpm * sin, radps }
    }
}

#[derive(Debug, Clone, Default)]
pub struct Sea(pub Vec<Component>);

impl Sea {
    /// A Gaussian sea: each of many narrow bands has waves of random (complex normal) amplitude and frequency in several directions, drawn from
    /// cos-2s spreading with s = 10 about 60°. One direction a band would make a sea that looks the same wherever one stands (Jefferys 1987),
    /// so that a patch would tell no more than a point. 4 √m0 of the bands is `h_m0_m` but for the cut tails, which [`Self::h_m0_m`] counts.
    pub fn jonswap(h_m0_m: f64, t_p_s: f64, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut components = Vec::new();
        for (low_hz, width_hz, variance_m2) in bands(h_m0_m, t_p_s) {
            for _ in 0..DIRECTIONS {
                let f_hz = low_hz + width_hz * random.random::<f64>();
                let offset_rad = loop {
                    let angle_rad = TAU * (random.random::<f64>() - 0.5);
                    if random.random::<f64>() < (0.5 * angle_rad).cos().powi(20) {
                        break angle_rad;
                    }
                };
                let sigma_m = (variance_m2 / f64::from(DIRECTIONS)).sqrt();
                let mut normal = || sigma_m * random.sample::<f64, _>(rand_distr::StandardNormal);
                components.push(Component {
                    re_m: normal(),
                    im_m: normal(),
                    ..Component::regular(1.0, 1.0 / f_hz, 60.0 + offset_rad.to_degrees())
                });
            }
        }
        Self(components)
    }

    /// 4 √m0 of the bands that [`Self::jonswap`] draws from.
    pub fn h_m0_m(h_m0_m: f64, t_p_s: f64) -> f64 {
        4.0 * bands(h_m0_m, t_p_s).map(|(_, _, variance_m2)| variance_m2).sum::<f64>().sqrt()
    }

    pub fn elevation_m(&self, north_m: f64, east_m: f64, t_s: f64) -> f64 {
        self.0
            .iter()
            .map(|c| {
                let (sin, cos) = (c.north_radpm * north_m + c.east_radpm * east_m - c.radps * t_s).sin_cos();
                c.re_m * cos - c.im_m * sin
            })
            .sum()
    }
}

/// Waves in each band.
const DIRECTIONS: u32 = 20;

/// (lowest frequency, width, variance) of 100 bands from 0.55 to 2.45 peak frequencies. A sum of n waves repeats itself after n / (1.9
/// f_p) at the soonest: there must be so many that its variance is free to wander throughout an observation.
fn bands(h_m0_m: f64, t_p_s: f64) -> impl Iterator<Item = (f64, f64, f64)> {
    let spectrum = Jonswap::new(h_m0_m, t_p_s, 3.3).unwrap();
    let width_hz = 1.9 / t_p_s / 100.0;
    (0..100).map(move |i| {
        let low_hz = 0.55 / t_p_s + f64::from(i) * width_hz;
        (low_hz, width_hz, spectrum.density_m2_per_hz(low_hz + 0.5 * width_hz) * width_hz)
    })
}

/// A rig that looks at a sea: the order of the cells, their noise, the level's noise.
#[derive(Debug, Clone)]
pub struct Camera {
    pub rows: u32,
    pub cols: u32,
    pub cell_m: f64,
    pub rate_hz: f64,
    /// Independent in every cell, metres.
    pub sigma_m: f64,
    /// Of the level; `None` has no pose.
    pub level_sigma_m: Option<f64>,
    pub north_m: f64,
    pub east_m: f64,
    pub seed: u64,
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
            level_sigma_m: Some(0.002),
            north_m: 40.0,
            east_m: -7.0,
            seed: 1,
        }
    }
}

pub fn start() -> Stamp {
    Stamp::from_nanos(1_760_000_000_000_000_000)
}

impl Camera {
    /// The patches of `count` exposures.
    pub fn film(&self, sea: &Sea, count: usize) -> Vec<SurfacePatch> {
        let mut random = ChaCha8Rng::seed_from_u64(self.seed ^ 0xca3e_7a00);
        let (rows, cols) = (self.rows as usize, self.cols as usize);
        // Each wave as a phasor over the cells, turned a little from frame to frame: no trigonometry inside.
        let waves: Vec<(Vec<f32>, Vec<f32>, f64)> = sea
            .0
            .iter()
            .map(|c| {
                let phasors = (0..rows * cols).map(|i| {
                    let (n, e) =
                        (self.north_m + (i / cols) as f64 * self.cell_m, self.east_m + (i % cols) as f64 * self.cell_m);
                    let (sin, cos) = (c.north_radpm * n + c.east_radpm * e).sin_cos();
                    ((c.re_m * cos - c.im_m * sin) as f32, (c.re_m * sin + c.im_m * cos) as f32)
                });
                let (re, im) = phasors.unzip();
                (re, im, c.radps)
            })
            .collect();
        let mut surface_m = vec![0.0_f32; rows * cols];
        (0..count)
            .map(|frame| {
                let t_s = frame as f64 / self.rate_hz;
                surface_m.fill(0.0);
                for (re, im, radps) in &waves {
                    let (sin, cos) = (radps * t_s).sin_cos();
                    let (sin, cos) = (sin as f32, cos as f32);
                    for ((z, re), im) in surface_m.iter_mut().zip(re).zip(im) {
                        *z += re * cos + im * sin;
                    }
                }
                let mean_m = surface_m.iter().map(|z| f64::from(*z)).sum::<f64>() / surface_m.len() as f64;
                let mut noise = |sigma_m: f64| sigma_m * random.sample::<f64, _>(rand_distr::StandardNormal);
                let elevation_m = surface_m.iter().map(|z| (f64::from(*z) - mean_m + noise(self.sigma_m)) as f32).collect();
                let level_m = self.level_sigma_m.map(|sigma_m| mean_m + noise(sigma_m));
                self.patch(frame, elevation_m, level_m, 5.0 - mean_m)
            })
            .collect()
    }

    fn patch(&self, frame: usize, elevation_m: Vec<f32>, level_m: Option<f64>, distance_m: f64) -> SurfacePatch {
        SurfacePatch {
            stamp: start().plus_secs_f64(frame as f64 / self.rate_hz),
            rig: RigId::new("leader-1").unwrap(),
            sequence: frame as u64,
            grid: ElevationGrid {
                south_west_north_m: self.north_m,
                south_west_east_m: self.east_m,
                cell_m: self.cell_m,
                rows: self.rows,
                cols: self.cols,
                sigma_m: vec![self.sigma_m as f32; elevation_m.len()],
                elevation_m,
            },
            coverage: 1.0,
            plane: Plane { normal: Vector3::z(), distance_m, rms_m: 0.01 },
            points: 20_000,
            level_m,
            level_sigma_m: self.level_sigma_m,
            level_thesis_m: None,
            error_length_m: 1e-3,
            slope_removed: [0.0; 2],
            slope_sigma: 0.0,
            attitude_sigma_rad: 0.0,
            processing_s: 0.05,
        }
    }
}
