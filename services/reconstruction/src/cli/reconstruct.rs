//! `halcyon reconstruct`: raw pairs and a rig → patches of water surface.

mod options;
mod report;
mod survey;

use std::path::Path;

use halcyon_model::{IdError, Image, PoseAtExposure, RigCalibration, RigId, Stamp, StereoPair, SurfacePatch};
pub use options::{MeshOf, ReconstructOptions, given_pose};
pub use report::{PatchReport, PlaneReport, ReconstructReport};
pub use survey::{FailedPair, SurveyFrame, SurveyReport, reconstruct_survey};

use super::speed::{Spent, spent};
use crate::core::cloud::{CloudFrame, PointCloud, point_cloud};
use crate::core::disparity::{colour, pfm};
use crate::core::matcher::UnknownEngine;
use crate::core::mesh;
use crate::core::reconstruct::{ReconstructError, Reconstructor, Settings, WorldFromRectified};
use crate::files::netcdf::{About, Series, SeriesError};
use crate::files::{FileError, RigFileError, ply, read_picture, read_rig, write_bytes};

/// Why there is no patch.
#[derive(Debug, thiserror::Error)]
pub enum ReconstructCliError {
    /// `--engine`
    #[error(transparent)]
    Engine(#[from] UnknownEngine),
    /// A number that is out of range.
    #[error("{name} must be {expected}, not {value}")]
    Value {
        /// Of what.
        name: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it is.
        value: f64,
    },
    /// A file.
    #[error(transparent)]
    File(#[from] FileError),
    /// The rig.
    #[error(transparent)]
    Rig(#[from] RigFileError),
    /// The chain.
    #[error(transparent)]
    Reconstruct(#[from] ReconstructError),
    /// The NetCDF files.
    #[error(transparent)]
    Series(#[from] SeriesError),
    /// OpenCV failed.
    #[error("OpenCV failed")]
    OpenCv(#[from] opencv::Error),
    /// The rig's name.
    #[error(transparent)]
    Name(#[from] IdError),
    /// Outputs that belong to one pair, asked of a folder of them.
    #[error("{0} shows one pair: give --left, --right and --rig instead of a folder")]
    OnePair(&'static str),
    /// Not one pair of a survey became a patch.
    #[error("none of {pairs} pairs became a patch; the first, {name}")]
    NoPatch {
        /// How many there are.
        pairs: usize,
        /// The first one.
        name: String,
        /// Why it failed.
        #[source]
        source: Box<ReconstructCliError>,
    },
}

/// Reconstructs one raw pair and writes what was asked for.
///
/// # Errors
/// [`ReconstructCliError`]: one line that says which file or number is at fault. Nothing has been written then, unless writing
/// itself failed.
pub fn reconstruct_pair(
    left: &Path,
    right: &Path,
    rig: &Path,
    pose: Option<PoseAtExposure>,
    options: &ReconstructOptions,
) -> Result<ReconstructReport, ReconstructCliError> {
    options.check_outputs()?;
    let calibration = read_rig(rig)?;
    let settings = options.settings(&calibration, 1)?;
    let pair = stereo_pair(calibration, read_picture(left)?, read_picture(right)?, pose, Stamp::default(), 0)?;
    let frame = frame_of(&pair);
    let mut series = match options.series_file() {
        Some(path) => Some(Series::beside(path, frame)?),
        None => None,
    };
    let mut chain = Chain::new(settings, options.cell_m.is_none());
    let (patch, timing) = chain.timed(&pair)?;
    options.write_pictures(&chain.reconstructor, &pair, &patch)?;
    if let Some(series) = &mut series {
        series.push(&patch)?;
        options.write_series(series, &calibration)?;
    }
    Ok(ReconstructReport::new(chain.engine, frame, &patch, &chain.reconstructor.disparity(), timing))
}

/// Gravity where the pair has a pose, otherwise the plane's own.
fn frame_of(pair: &StereoPair) -> CloudFrame {
    if pair.pose.is_some() { CloudFrame::Gravity } else { CloudFrame::Plane }
}

fn stereo_pair(
    calibration: RigCalibration,
    left: Image,
    right: Image,
    pose: Option<PoseAtExposure>,
    stamp: Stamp,
    sequence: u64,
) -> Result<StereoPair, ReconstructCliError> {
    // Files say no name.
    let rig = RigId::new("rig")?;
    Ok(StereoPair { stamp, rig, sequence, left, right, exposure_s: 0.0, calibration, pose })
}

/// The chain, which chooses its cell by the first patch where nobody did.
struct Chain {
    reconstructor: Reconstructor,
    settings: Settings,
    choose_cell: bool,
    engine: &'static str,
}

impl Chain {
    fn new(settings: Settings, choose_cell: bool) -> Self {
        let engine = settings.engine.name();
        Self { reconstructor: Reconstructor::new(settings.clone()), settings, choose_cell, engine }
    }

    /// The patch of a pair, and what it took.
    fn timed(&mut self, pair: &StereoPair) -> Result<(SurfacePatch, Spent), ReconstructError> {
        if self.choose_cell {
            self.choose_cell(pair)?;
        }
        let (patch, took) = spent(|| self.reconstructor.reconstruct(pair));
        let mut patch = patch?;
        patch.processing_s = took.wall_ms / 1e3;
        Ok((patch, took))
    }

    /// How far the water is, and so how large a cell suits, only a first reconstruction tells; its own grid may well fail.
    fn choose_cell(&mut self, pair: &StereoPair) -> Result<(), ReconstructError> {
        match self.reconstructor.reconstruct(pair) {
            Ok(_) | Err(ReconstructError::Grid(_)) => {}
            Err(error) => return Err(error),
        }
        let matches = self.reconstructor.matches();
        let sum_px: f64 = matches.iter().map(|m| f64::from(m.disparity_px)).sum();
        // Depth over focal length: f b / d / f.
        let pixel_m = pair.calibration.baseline_m() * matches.len() as f64 / sum_px;
        self.settings.cell_m = options::suitable_cell_m(pixel_m);
        self.reconstructor = Reconstructor::new(self.settings.clone());
        self.choose_cell = false;
        Ok(())
    }
}

impl ReconstructOptions {
    /// Cloud, mesh and disparity, where asked for.
    fn write_pictures(
        &self,
        reconstructor: &Reconstructor,
        pair: &StereoPair,
        patch: &SurfacePatch,
    ) -> Result<(), ReconstructCliError> {
        if let Some(path) = &self.disparity {
            let disparity = reconstructor.disparity();
            let as_pfm = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("pfm"));
            let bytes = if as_pfm { pfm::encode(&disparity) } else { colour::encode_png(&disparity)? };
            write_bytes(path, &bytes)?;
        }
        if self.cloud.is_none() && self.mesh.is_none() {
            return Ok(());
        }
        let cloud = cloud_of(reconstructor, pair, patch)?;
        if let Some(path) = &self.cloud {
            ply::write_cloud(path, &cloud)?;
        }
        if let Some(path) = &self.mesh {
            let mesh = match self.mesh_of {
                MeshOf::Cloud => mesh::of_cloud(&cloud),
                MeshOf::Grid => mesh::of_grid(&patch.grid, cloud.frame),
            };
            ply::write_mesh(path, &mesh)?;
        }
        Ok(())
    }

    fn write_series(&self, series: &mut Series, calibration: &RigCalibration) -> Result<(), SeriesError> {
        let now = jiff::Timestamp::from_second(self.now.as_nanos() / 1_000_000_000).unwrap_or_default();
        let history = format!("{} {}", now.strftime("%Y-%m-%dT%H:%M:%SZ"), self.command);
        let source = format!("Halcyon {} stereo reconstruction, engine {}", env!("CARGO_PKG_VERSION"), self.engine);
        let about = About { calibration: *calibration, source, history };
        if let Some(path) = &self.grid {
            series.write_cf(path, &about)?;
        }
        if let Some(path) = &self.wass {
            series.write_wass(path, &about)?;
        }
        Ok(())
    }
}

/// The cloud of the pair that `reconstructor` made `patch` of (figs. 4-25, 5-9, 5-16, 7-6): gravity-aligned with a pose, in the
/// plane's own frame without.
///
/// # Errors
/// OpenCV's, which only memory can cause.
pub fn cloud_of(reconstructor: &Reconstructor, pair: &StereoPair, patch: &SurfacePatch) -> opencv::Result<PointCloud> {
    let frame = frame_of(pair);
    let (Some(rig), Some(left)) = (reconstructor.rectified_rig(), reconstructor.left_grey()) else {
        return Ok(PointCloud { frame, points: Vec::new() });
    };
    let world = match &pair.pose {
        Some(pose) => WorldFromRectified::from_pose(pose, &pair.calibration, rig),
        None => WorldFromRectified::from_plane(&patch.plane),
    };
    point_cloud(reconstructor.matches(), rig, &world, frame, left)
}
