//! Pictures of known water, and the chain that measures them.

use std::sync::Arc;

use halcyon_model::{PoseAtExposure, RigId, Stamp, StereoPair, SurfacePatch};
use halcyon_reconstruction::core::reconstruct::{ReconstructError, Reconstructor, Settings};
use halcyon_sim::render::{RenderError, Renderer};
use halcyon_sim::rig::{RigConfig, RigError};
use halcyon_sim::sea::{SeaConfig, SeaError};
use halcyon_sim::texture::Texture;
use halcyon_sim::water::Water;
use nalgebra::{UnitQuaternion, Vector3};

/// Why an experiment could not be run.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The rig.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The water.
    #[error(transparent)]
    Sea(#[from] SeaError),
    /// A picture.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A pair that became no patch.
    #[error("pair {sequence} became no patch")]
    Reconstruct {
        /// Which, from 0.
        sequence: u64,
        /// Why.
        source: ReconstructError,
    },
    /// No statistics came out.
    #[error("{0}")]
    NoResult(&'static str),
}

/// The thesis's pair of webcams (table 3-1: 509 px at 640 × 480), `baseline_m` apart, without the flaws of its lenses; `scale` 1
/// is 640 × 480, 0.5 is 320 × 240.
#[must_use]
pub fn thesis_rig(baseline_m: f64, scale: f64) -> RigConfig {
    const FOCAL_PX: f64 = 509.368;
    RigConfig {
        width_px: (640.0 * scale).round() as u32,
        height_px: (480.0 * scale).round() as u32,
        horizontal_fov_deg: 2.0 * (320.0 / FOCAL_PX).atan().to_degrees(),
        baseline_m,
        mount_m: [0.0; 3],
        ..RigConfig::default()
    }
}

/// The time of the first pair: any will do.
pub(super) fn start() -> Stamp {
    Stamp::from_nanos(1_780_000_000_000_000_000)
}

/// A rig over water.
#[derive(Debug)]
pub struct Scene {
    renderer: Renderer,
    /// The water.
    pub water: Water,
    seed: u64,
    sequence: u64,
}

impl Scene {
    /// `rig` over `sea`, whose surface shows grains of `grain_m`; `seed` is the water's, the texture's and the sensors'.
    ///
    /// # Errors
    /// [`SceneError`] for a rig or a sea that cannot be.
    pub fn new(rig: &RigConfig, sea: &SeaConfig, grain_m: f64, seed: u64) -> Result<Self, SceneError> {
        Self::with_texture(rig, sea, Texture::grained(seed, grain_m), seed)
    }

    /// The same with a surface of your own.
    ///
    /// # Errors
    /// As [`Scene::new`].
    pub fn with_texture(rig: &RigConfig, sea: &SeaConfig, texture: Texture, seed: u64) -> Result<Self, SceneError> {
        let renderer = Renderer::new(rig, Arc::new(texture))?;
        Ok(Self { renderer, water: Water::new(sea, seed)?, seed, sequence: 0 })
    }

    /// The pair that the rig takes `t_s` after the start from where the body truly is; `pose` is what is believed of that.
    ///
    /// # Errors
    /// [`SceneError::Render`] for a rig in the waves.
    pub fn pair(
        &mut self,
        t_s: f64,
        position_ned_m: Vector3<f64>,
        ned_from_body: &UnitQuaternion<f64>,
        pose: Option<PoseAtExposure>,
    ) -> Result<StereoPair, SceneError> {
        let stamp = start().plus_secs_f64(t_s);
        let (left, right) = self.renderer.render_pair(&self.water, ned_from_body, position_ned_m, stamp, self.seed)?;
        let sequence = self.sequence;
        self.sequence += 1;
        Ok(StereoPair {
            stamp,
            rig: rig_id(),
            sequence,
            left,
            right,
            exposure_s: 0.001,
            calibration: *self.renderer.calibration(),
            pose,
        })
    }
}

/// The name that every experiment's rig has.
pub(super) fn rig_id() -> RigId {
    RigId::new("leader-1").unwrap_or_else(|_| unreachable!("a constant name is valid"))
}

/// The chain with `cell_m` cells, for a rig that stands still or is carried.
pub(super) fn chain(cell_m: f64, fixed_rig: bool) -> Reconstructor {
    Reconstructor::new(Settings { cell_m, fixed_rig, ..Settings::default() })
}

/// One patch.
pub(super) fn measure(chain: &mut Reconstructor, pair: &StereoPair) -> Result<SurfacePatch, SceneError> {
    chain.reconstruct(pair).map_err(|source| SceneError::Reconstruct { sequence: pair.sequence, source })
}
