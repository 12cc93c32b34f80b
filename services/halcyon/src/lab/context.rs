//! What experiments share: where pictures are, how much to run, and results that several need.

use std::cell::OnceCell;
use std::path::PathBuf;

use halcyon_model::Image;
use halcyon_ocean::record::RecordError;
use halcyon_reconstruction::cli::{CalibrateCliError, CalibrateReport, CalibrateRequest, FeaturesCliError, calibrate};
use halcyon_reconstruction::core::calibrate::{Calibration, Options};
use halcyon_reconstruction::core::disparity::Disparity;
use halcyon_reconstruction::core::disparity::score::SizeError;
use halcyon_reconstruction::core::features::FeatureError;
use halcyon_reconstruction::core::matcher::{DisparityRange, MatchError};
use halcyon_reconstruction::core::rectify::RectifyError;
use halcyon_reconstruction::files::{self, FileError};

use crate::accuracy::{Extent, SceneError};
use crate::report::ChartError;

/// Why an experiment could not be run.
#[derive(Debug, thiserror::Error)]
pub enum LabError {
    /// The public pictures are not there.
    #[error("no sample pictures in {}: `make samples` fetches them, --samples says where they are", .0.display())]
    Samples(PathBuf),
    /// A picture.
    #[error(transparent)]
    File(#[from] FileError),
    /// The calibration.
    #[error(transparent)]
    Calibrate(#[from] CalibrateCliError),
    /// Features.
    #[error(transparent)]
    Features(#[from] FeaturesCliError),
    /// Features.
    #[error(transparent)]
    Feature(#[from] FeatureError),
    /// Dense matching.
    #[error(transparent)]
    Match(#[from] MatchError),
    /// Truth of another size.
    #[error(transparent)]
    Size(#[from] SizeError),
    /// Rectification.
    #[error(transparent)]
    Rectify(#[from] RectifyError),
    /// Simulated water.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A record of the water.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A chart.
    #[error(transparent)]
    Chart(#[from] ChartError),
    /// A picture of a result.
    #[error("a picture could not be drawn: {0}")]
    Draw(String),
    /// A formation flight.
    #[error(transparent)]
    Flight(#[from] halcyon_vehicle_link::experiment::FlightError),
    /// An identifier.
    #[error(transparent)]
    Id(#[from] halcyon_model::IdError),
    /// A temporary file.
    #[error("a temporary file could not be written")]
    Temporary(#[from] std::io::Error),
}

/// Hears how much of how much of an experiment is done.
struct Progress(Box<dyn Fn(usize, usize) + Send + Sync>);

impl std::fmt::Debug for Progress {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Progress")
    }
}

/// Where experiments take place.
#[derive(Debug)]
pub struct Lab {
    samples: PathBuf,
    /// How much of each to run.
    pub extent: Extent,
    calibration: OnceCell<(CalibrateReport, Calibration)>,
    progress: Option<Progress>,
}

/// A rectified pair of a textured object, with its true disparity.
#[derive(Debug)]
pub(super) struct Object {
    pub left: Image,
    pub right: Image,
    pub truth: Disparity,
    pub range: DisparityRange,
}

impl Lab {
    /// With OpenCV's public pictures in the folder `samples`, which experiments on simulated water do without.
    #[must_use]
    pub fn new(samples: PathBuf, extent: Extent) -> Self {
        Self { samples, extent, calibration: OnceCell::new(), progress: None }
    }

    /// Lets `progress` hear, on any thread, how much of how much of a long experiment is done.
    #[must_use]
    pub fn heard_by(mut self, progress: impl Fn(usize, usize) + Send + Sync + 'static) -> Self {
        self.progress = Some(Progress(Box::new(progress)));
        self
    }

    /// To be told how much of how much is done.
    pub(super) fn progress(&self) -> &(dyn Fn(usize, usize) + Send + Sync) {
        self.progress.as_ref().map_or(&|_, _| (), |Progress(progress)| progress.as_ref())
    }

    /// `full` or, for a quick look, `quick`.
    pub(super) fn choose<T>(&self, full: T, quick: T) -> T {
        match self.extent {
            Extent::Full => full,
            Extent::Quick => quick,
        }
    }

    pub(super) fn sample(&self, name: &str) -> Result<PathBuf, LabError> {
        let path = self.samples.join(name);
        if path.is_file() { Ok(path) } else { Err(LabError::Samples(self.samples.clone())) }
    }

    /// The pair of the sample board pictures that shows most depth.
    pub(super) fn board_pair(&self) -> Result<[PathBuf; 2], LabError> {
        Ok([self.sample("left01.jpg")?, self.sample("right01.jpg")?])
    }

    /// The aloe pair; its truth is in whole pixels.
    pub(super) fn object(&self) -> Result<Object, LabError> {
        let (left, right) = files::read_pair(&self.sample("aloeL.jpg")?, &self.sample("aloeR.jpg")?)?;
        let truth = files::read_truth(&self.sample("aloeGT.png")?, 1.0)?;
        Ok(Object { left, right, truth, range: DisparityRange { min_px: 16, max_px: 223 } })
    }

    /// The rig that took the sample board pictures.
    pub(super) fn calibration(&self) -> Result<&(CalibrateReport, Calibration), LabError> {
        if let Some(done) = self.calibration.get() {
            return Ok(done);
        }
        self.board_pair()?;
        let pattern = |side: &str| self.samples.join(format!("{side}*.jpg")).to_string_lossy().into_owned();
        let request = CalibrateRequest {
            left: &pattern("left"),
            right: &pattern("right"),
            board: "9x6",
            square_m: 0.025,
            options: Options::default(),
            out: None,
            ros: None,
        };
        let done = calibrate(&request, &mut |_, _| {})?;
        Ok(self.calibration.get_or_init(|| done))
    }
}
