//! What `halcyon calibrate`, `halcyon match`, `halcyon reconstruct` and `halcyon rig` do, without the command line: files in,
//! files and a report out.

mod calibrate;
mod compare;
mod matching;
mod options;
mod reconstruct;
mod rig;

pub use calibrate::{
    CalibrateCliError, CalibrateReport, CalibrateRequest, CameraReport, CoverageReport, DepthReport, ErrorByViewsReport,
    ViewReport, calibrate, convert_rig,
};
pub use compare::{Matched, THESIS_SIZES_PX, TimeAtSize, compare, times_by_size};
pub use matching::{MatchCliError, MatchReport, TruthReport, match_pair};
pub use options::{MatchOptions, OptionError};
pub use reconstruct::{
    FailedPair, MeshOf, PatchReport, PlaneReport, ReconstructCliError, ReconstructOptions, ReconstructReport, SurveyFrame,
    SurveyReport, cloud_of, given_pose, reconstruct_pair, reconstruct_survey,
};
pub use rig::{BestRow, BudgetRow, RigCliError, RigNumbers, RigOptions, RigReport, RigSource, rig};

pub use crate::core::rig_budget::DISPARITY_SIGMA_PX;
