//! `halcyon reconstruct`: raw pairs and a rig → patches of water surface.

mod options;
mod plausible;
mod report;
mod survey;

use std::path::{Path, PathBuf};

use halcyon_model::{IdError, Image, PoseAtExposure, RigCalibration, RigId, Stamp, StereoPair, SurfacePatch};
pub use options::{MeshOf, ReconstructOptions, given_pose};
pub use plausible::ImpossibleError;
use plausible::{Doubt, Doubts, check_plane, check_pose};
pub use report::{PatchReport, PlaneReport, ReconstructReport};
pub use survey::{FailedPair, SurveyFrame, SurveyReport, SurveyStep, reconstruct_survey};

use super::speed::{Spent, spent};
use super::texture::without_texture;
use crate::core::cloud::{CloudFrame, PointCloud, point_cloud};
use crate::core::disparity::{colour, pfm};
use crate::core::grid::GridError;
use crate::core::matcher::UnknownEngine;
use crate::core::mesh;
use crate::core::reconstruct::{ReconstructError, Reconstructor, Settings, WorldFromRectified};
use crate::files::netcdf::{About, Series, SeriesError};
use crate::files::{FileError, RigFileError, has_ending, ply, read_picture, read_rig, rig_files, write_bytes};
use crate::limits::OutOfRange;

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
    Reconstruct(ReconstructError),
    /// The grid, which only its cell can mend.
    #[error(
        "the surface cannot be gridded in cells of {cell_m} m: give a larger --cell (metres), or a smaller --stride (pixels)"
    )]
    Cell {
        /// Cell side, metres.
        cell_m: f64,
        /// What is wrong with it.
        #[source]
        source: GridError,
    },
    /// The calibration of a survey.
    #[error("rig.yaml is no calibration of a rig")]
    ImpossibleRig(#[from] OutOfRange),
    /// A pose or a plane that no camera over water has.
    #[error(transparent)]
    Impossible(#[from] ImpossibleError),
    /// A blank picture.
    #[error("no texture in {}: there is nothing to match", path.display())]
    NoTexture {
        /// The picture.
        path: PathBuf,
    },
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
    let files = rig_files(rig);
    let inputs = [("--left", left), ("--right", right)].into_iter().chain(files.iter().map(|path| ("--rig", path.as_path())));
    options.check_outputs(inputs)?;
    let calibration = read_rig(rig)?;
    let settings = options.settings(&calibration, 1)?;
    let doubts = pose.as_ref().map_or(Ok(Vec::new()), |pose| check_pose(pose, &calibration))?;
    let pair = read_stereo_pair(calibration, [left, right], pose, Stamp::default(), 0)?;
    let frame = frame_of(&pair);
    let mut series = match options.series_file() {
        Some(path) => Some(Series::beside(path, frame)?),
        None => None,
    };
    let mut chain = Chain::new(settings, options.cell_m.is_none());
    let mut warnings = Vec::new();
    let (patch, timing) = match chain.timed(&pair) {
        Err(ReconstructCliError::Cell { cell_m, source }) if !options.needs_grid() => {
            let done = chain.with_coarser_cells(&pair)?;
            warnings.push(format!(
                "no grid with cells of {cell_m} m, as {source}; figures of the patch are of cells of {} m instead (--cell)",
                done.0.grid.cell_m
            ));
            done
        }
        other => other?,
    };
    let doubts = doubts.into_iter().chain(chain.check(&pair, &patch)?);
    warnings.extend(doubts.map(|doubt| doubt.to_string()));
    options.write_pictures(&chain.reconstructor, &pair, &patch)?;
    if let Some(series) = &mut series {
        series.push(&patch)?;
        options.write_series(series, &calibration)?;
    }
    Ok(ReconstructReport::new(chain.engine, frame, &patch, &chain.reconstructor.disparity(), timing, warnings))
}

/// Gravity where the pair has a pose, otherwise the plane's own.
fn frame_of(pair: &StereoPair) -> CloudFrame {
    if pair.pose.is_some() { CloudFrame::Gravity } else { CloudFrame::Plane }
}

fn read_stereo_pair(
    calibration: RigCalibration,
    paths: [&Path; 2],
    pose: Option<PoseAtExposure>,
    stamp: Stamp,
    sequence: u64,
) -> Result<StereoPair, ReconstructCliError> {
    let (left, right) = (read_picture(paths[0])?, read_picture(paths[1])?);
    // Of a picture of another size, that is what will be said.
    let fits = |image: &Image| (image.width_px(), image.height_px()) == (calibration.width_px, calibration.height_px);
    if fits(&left)
        && fits(&right)
        && let Some(path) = without_texture([(paths[0], &left), (paths[1], &right)])
    {
        return Err(ReconstructCliError::NoTexture { path: path.into() });
    }
    // Files say no name.
    let rig = RigId::new("rig")?;
    Ok(StereoPair { stamp, rig, sequence, left, right, exposure_s: 0.0, calibration, pose })
}

/// Doubled so often, a cell of ten pixels is wider than any picture.
const COARSER_MAX: u32 = 10;

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
    fn timed(&mut self, pair: &StereoPair) -> Result<(SurfacePatch, Spent), ReconstructCliError> {
        if self.choose_cell {
            self.choose_cell(pair)?;
        }
        let (patch, took) = spent(|| self.reconstructor.reconstruct(pair));
        let mut patch = patch.map_err(|error| match error {
            ReconstructError::Grid(source) => ReconstructCliError::Cell { cell_m: self.settings.cell_m, source },
            other => ReconstructCliError::Reconstruct(other),
        })?;
        patch.processing_s = took.wall_ms / 1e3;
        Ok((patch, took))
    }

    /// For what needs no grid: a cell that suits the distance, and then ever larger ones, until there is one.
    fn with_coarser_cells(&mut self, pair: &StereoPair) -> Result<(SurfacePatch, Spent), ReconstructCliError> {
        self.choose_cell(pair)?;
        let mut done = self.timed(pair);
        for _ in 0..COARSER_MAX {
            if !matches!(done, Err(ReconstructCliError::Cell { .. })) {
                break;
            }
            self.set_cell(2.0 * self.settings.cell_m);
            done = self.timed(pair);
        }
        done
    }

    fn set_cell(&mut self, cell_m: f64) {
        self.settings.cell_m = cell_m;
        self.reconstructor = Reconstructor::new(self.settings.clone());
        self.choose_cell = false;
    }

    /// Refuses a plane that is none of water; says what is unlikely about one.
    fn check(&self, pair: &StereoPair, patch: &SurfacePatch) -> Result<Vec<Doubt>, ImpossibleError> {
        let Some(rig) = self.reconstructor.rectified_rig() else { return Ok(Vec::new()) };
        check_plane(patch, pair.pose.as_ref(), &pair.calibration, rig)
    }

    /// How far the water is, and so how large a cell suits, only a first reconstruction tells; its own grid may well fail.
    fn choose_cell(&mut self, pair: &StereoPair) -> Result<(), ReconstructCliError> {
        match self.reconstructor.reconstruct(pair) {
            Ok(_) | Err(ReconstructError::Grid(_)) => {}
            Err(error) => return Err(ReconstructCliError::Reconstruct(error)),
        }
        let matches = self.reconstructor.matches();
        let sum_px: f64 = matches.iter().map(|m| f64::from(m.disparity_px)).sum();
        // Depth over focal length: f b / d / f.
        let pixel_m = pair.calibration.baseline_m() * matches.len() as f64 / sum_px;
        self.set_cell(options::suitable_cell_m(pixel_m));
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
            let as_pfm = has_ending(path, &["pfm"]);
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
