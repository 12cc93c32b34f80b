//! Stereo pictures of simulated water.
//!
//! For each pixel the line of sight (undistorted once, when the renderer is made) meets the wave surface by Newton's method;
//! the colour there is light from within the water, which the floating [`Texture`] modulates and which both cameras see alike,
//! plus the sky that the sloping surface mirrors, which each camera sees differently, as on real water. Then come lens,
//! exposure and sensor: vignetting, gain, noise, 8 bits.
//!
//! **Invariant:** the pictures show nothing but the water at the stamp; a renderer has no memory that could be seen.

mod grid;
mod lens;
mod sky;

use std::sync::Arc;

use halcyon_model::{Bytes, Image, RigCalibration, Stamp};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use rand::rngs::SmallRng;
use rand::{RngCore, SeedableRng};

use crate::rig::{RigConfig, RigError};
use crate::texture::{Level, Texture};
use crate::water::Water;
use grid::SurfaceGrid;
use lens::Ray;

/// What floats drifts with the wind at this velocity (north, east), metres per second.
const DRIFT_MPS: [f64; 2] = [0.03, 0.02];
/// Lines of sight that fall by less than this show haze over the horizon instead of water.
const FALL_MIN: f32 = 0.12;
/// The grid ends this many camera heights away; farther water is drawn flat.
const RANGE_HEIGHTS: f64 = 4.0;

/// Why a picture cannot be taken.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RenderError {
    /// The camera is in the waves, or its position is no number.
    #[error("a camera {height_m:.2} m above mean water is too low: waves reach {crest_m:.2} m")]
    TooLow {
        /// Height of the lower camera, metres.
        height_m: f64,
        /// Height that the waves may reach, metres.
        crest_m: f64,
    },
    /// The attitude is not a number.
    #[error("the attitude is not finite")]
    Attitude,
}

/// Renders the pictures of one rig. Costs a few megabytes; keep it.
#[derive(Debug)]
pub struct Renderer {
    calibration: RigCalibration,
    texture: Arc<Texture>,
    left: Camera,
    right: Camera,
    noise_sigma_grey: f32,
    grey_per_radiance: f32,
    grid: SurfaceGrid,
}

#[derive(Debug)]
struct Camera {
    rays: Vec<Ray>,
    /// Centre in the left camera's axes, metres.
    centre_m: Vector3<f64>,
    /// Added to the seed, so that each sensor has its own noise.
    salt: u64,
}

impl Renderer {
    /// A renderer for `rig` over water that looks like `texture`.
    ///
    /// # Errors
    /// [`RigError`] for a configuration out of range.
    pub fn new(rig: &RigConfig, texture: Arc<Texture>) -> Result<Self, RigError> {
        rig.validate()?;
        let calibration = rig.calibration();
        let size = (rig.width_px, rig.height_px);
        let left_from_right = calibration.right_from_left.transpose();
        Ok(Self {
            left: Camera {
                rays: lens::rays(&calibration.left, size, &Matrix3::identity(), rig.vignetting),
                centre_m: Vector3::zeros(),
                salt: 0x6c65_6674,
            },
            right: Camera {
                rays: lens::rays(&calibration.right, size, &left_from_right, rig.vignetting),
                centre_m: -(left_from_right * calibration.right_from_left_m),
                salt: 0x7269_6768_7400,
            },
            noise_sigma_grey: rig.noise_sigma_grey as f32,
            grey_per_radiance: (rig.exposure_gain * rig.exposure_s) as f32,
            calibration,
            texture,
            grid: SurfaceGrid::default(),
        })
    }

    /// The exact calibration of the rig.
    #[must_use]
    pub fn calibration(&self) -> &RigCalibration {
        &self.calibration
    }

    /// What the left and the right camera see at `stamp` from a body at `position_ned_m` (local frame, metres) turned by
    /// `ned_from_body`. `seed` is the sensors' noise: the same arguments give the same pictures.
    ///
    /// Allocates the two pictures, and what the matrix product packs its operands into.
    ///
    /// # Errors
    /// [`RenderError`] for a rig in or under the waves.
    pub fn render_pair(
        &mut self,
        water: &Water,
        ned_from_body: &UnitQuaternion<f64>,
        position_ned_m: Vector3<f64>,
        stamp: Stamp,
        seed: u64,
    ) -> Result<(Image, Image), RenderError> {
        let ned_from_camera = ned_from_body.to_rotation_matrix() * self.calibration.body_from_camera;
        if !ned_from_camera.iter().all(|value| value.is_finite()) {
            return Err(RenderError::Attitude);
        }
        let left_m = position_ned_m + ned_from_body * self.calibration.camera_in_body_m;
        let right_m = left_m + ned_from_camera * self.right.centre_m;
        // Waves of a Gaussian sea practically never rise above their significant height.
        let crest_m = water.elevation_bound_m().min(1.2 * water.true_h_s_m());
        let height_m = -left_m.z.max(right_m.z);
        if !(height_m > crest_m + 0.1 && position_ned_m.iter().all(|value| value.is_finite())) {
            return Err(RenderError::TooLow { height_m, crest_m });
        }
        let (low_m, high_m) = self.footprint([left_m, right_m], &ned_from_camera, crest_m);
        self.grid.update(water, low_m, high_m, stamp);

        let footprint_m = height_m / self.calibration.left.fx_px;
        let scene = Scene {
            grid: &self.grid,
            level: self.texture.level(footprint_m),
            stamp,
            ned_from_camera: ned_from_camera.cast::<f32>(),
            noise_sigma_grey: self.noise_sigma_grey,
            grey_per_radiance: self.grey_per_radiance,
            width_px: self.calibration.width_px,
            height_px: self.calibration.height_px,
        };
        let seed = seed ^ (stamp.as_nanos() as u64).rotate_left(17);
        Ok((scene.picture(&self.left, left_m, seed), scene.picture(&self.right, right_m, seed)))
    }

    /// The rectangle (north, east) that holds all water in view, metres.
    fn footprint(&self, centres_m: [Vector3<f64>; 2], ned_from_camera: &Matrix3<f64>, crest_m: f64) -> ([f64; 2], [f64; 2]) {
        let (width, height) = (self.calibration.width_px as usize, self.calibration.height_px as usize);
        let (mut low_m, mut high_m) = ([f64::MAX; 2], [f64::MIN; 2]);
        for (camera, centre_m) in [&self.left, &self.right].into_iter().zip(centres_m) {
            for row in [0, height / 2, height - 1] {
                for col in [0, width / 2, width - 1] {
                    let ray = ned_from_camera * Vector3::from(camera.rays[row * width + col].direction).cast::<f64>();
                    // To the troughs, where the view is widest, and a bit beyond.
                    let reach_m = (-centre_m.z + crest_m) / ray.z.max(1.0 / RANGE_HEIGHTS) * 1.02;
                    for axis in 0..2 {
                        let at_m = centre_m[axis] + ray[axis] * reach_m;
                        low_m[axis] = low_m[axis].min(at_m - 0.1);
                        high_m[axis] = high_m[axis].max(at_m + 0.1);
                    }
                }
            }
        }
        (low_m, high_m)
    }
}

/// Everything that the pictures of one instant share.
struct Scene<'a> {
    grid: &'a SurfaceGrid,
    level: &'a Level,
    stamp: Stamp,
    ned_from_camera: Matrix3<f32>,
    noise_sigma_grey: f32,
    grey_per_radiance: f32,
    width_px: u32,
    height_px: u32,
}

impl Scene<'_> {
    fn picture(&self, camera: &Camera, centre_m: Vector3<f64>, seed: u64) -> Image {
        // Everything below is relative to the grid's corner, so that single precision is a few micrometres anywhere on Earth.
        let north_m = (centre_m.x - self.grid.south_west_m[0]) as f32;
        let east_m = (centre_m.y - self.grid.south_west_m[1]) as f32;
        let height_m = -centre_m.z as f32;
        let per_m = self.level.per_m as f32;
        let [north_offset, east_offset] = self.texture_offset();
        let r = &self.ned_from_camera;
        let [r00, r01, r02] = [r[(0, 0)], r[(0, 1)], r[(0, 2)]];
        let [r10, r11, r12] = [r[(1, 0)], r[(1, 1)], r[(1, 2)]];
        let [r20, r21, r22] = [r[(2, 0)], r[(2, 1)], r[(2, 2)]];
        let mut rng = SmallRng::seed_from_u64(seed.wrapping_add(camera.salt));
        let mut pixels = Vec::with_capacity(camera.rays.len());
        let mut elevation_m = 0.0_f32;
        for &Ray { direction: [x, y, z], gain } in &camera.rays {
            let north = r00 * x + r01 * y + r02 * z;
            let east = r10 * x + r11 * y + r12 * z;
            let fall = r20 * x + r21 * y + r22 * z;
            let radiance = if fall < FALL_MIN {
                sky::radiance([north, east, -fall])
            } else {
                // The last pixel's elevation is a good start: one or two steps reach a tenth of a millimetre.
                let mut range_m = (height_m - elevation_m) / fall;
                let mut at = grid::Sample::default();
                for _ in 0..6 {
                    at = self.grid.sample(north_m + north * range_m, east_m + east * range_m);
                    let above_m = height_m - fall * range_m - at.elevation_m;
                    // A slope that nearly meets the line of sight would send Newton's step astray.
                    let closing = (fall + at.slope_north * north + at.slope_east * east).max(0.5 * fall);
                    let step_m = above_m / closing;
                    range_m += step_m;
                    // Its square is what remains after the step.
                    if step_m.abs() < 3e-3 {
                        break;
                    }
                }
                elevation_m = at.elevation_m;
                let albedo = self.level.sample(
                    ((north_m + north * range_m) * per_m + north_offset).max(0.0),
                    ((east_m + east * range_m) * per_m + east_offset).max(0.0),
                );
                // The surface's normal is (−slope, 1) / length in north, east, up.
                let per_length = 1.0 / (1.0 + at.slope_north * at.slope_north + at.slope_east * at.slope_east).sqrt();
                let cos = (at.slope_north * north + at.slope_east * east + fall) * per_length;
                let twice = 2.0 * cos * per_length;
                let mirrored = [north - twice * at.slope_north, east - twice * at.slope_east, twice - fall];
                let reflectance = sky::reflectance(cos.clamp(0.0, 1.0));
                (1.0 - reflectance) * albedo + reflectance * sky::radiance(mirrored)
            };
            let grey = self.grey_per_radiance * gain * radiance + self.noise_sigma_grey * unit_noise(&mut rng);
            // Casting saturates: black stays 0, overexposed stays 255.
            pixels.push((grey + 0.5) as u8);
        }
        match Image::new(self.width_px, self.height_px, Bytes::from(pixels)) {
            Ok(image) => image,
            // One byte was pushed for each of width × height rays, and the sides were validated.
            Err(_) => unreachable!("a picture has as many pixels as rays"),
        }
    }

    /// Where the grid's corner is in the drifting texture, texels, at least one period from zero so that places a little outside
    /// the grid stay positive.
    fn texture_offset(&self) -> [f32; 2] {
        // Repeats with the coarsest of periods: that of the whole texture, the same for every level.
        let period = 16.0 * self.level.period();
        [0, 1].map(|axis| {
            let at_m = self.grid.south_west_m[axis] - DRIFT_MPS[axis] * self.stamp.as_secs_f64();
            ((at_m * self.level.per_m).rem_euclid(self.level.period()) + period) as f32
        })
    }
}

/// Near-normal noise of unit variance: the sum of four uniform numbers, cut from one random word.
#[inline]
fn unit_noise(rng: &mut SmallRng) -> f32 {
    let word = rng.next_u64();
    let sum = (word & 0xffff) + ((word >> 16) & 0xffff) + ((word >> 32) & 0xffff) + (word >> 48);
    // Four uniform numbers on 0…65535: mean 131070, standard deviation 65536 / √3.
    (sum as f32 - 131_070.0) * (1.0 / 37_837.227)
}
