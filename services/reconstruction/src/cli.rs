//! What `halcyon calibrate`, `features`, `match`, `reconstruct`, `rig` and `self-calibrate` do, without the command line: files in,
//! files and a report out.

mod calibrate;
mod compare;
mod features;
mod matching;
mod options;
mod reconstruct;
mod rig;
mod self_calibrate;
mod speed;
mod texture;

pub use calibrate::{
    CalibrateCliError, CalibrateReport, CalibrateRequest, CameraReport, CoverageReport, DepthReport, ErrorByViewsReport,
    ViewReport, calibrate, convert_rig,
};
pub use compare::{Matched, THESIS_SIZES_PX, TimeAtSize, compare, refined, times_by_size};
pub use features::{FeatureRow, FeaturesCliError, FeaturesOptions, FeaturesReport, MissingCloud, PoseReport, features};
pub use matching::{MatchCliError, MatchReport, TruthReport, match_pair};
pub use options::{MatchOptions, OptionError};
pub use reconstruct::{
    FailedPair, ImpossibleError, MeshOf, PatchReport, PlaneReport, ReconstructCliError, ReconstructOptions, ReconstructReport,
    SurveyFrame, SurveyReport, SurveyStep, cloud_of, given_pose, reconstruct_pair, reconstruct_survey,
};
pub use rig::{BestRow, BudgetRow, RigCliError, RigNumbers, RigOptions, RigReport, RigSource, rig};
pub use self_calibrate::{
    AlternativeReport, AngleReport, SelfCalibrateCliError, SelfCalibrateOptions, SelfCalibrateReport, SelfViewReport,
    self_calibrate,
};
pub use speed::{Spent, Threads, median, median_spent, spent};

pub use crate::core::rig_budget::DISPARITY_SIGMA_PX;
pub use crate::limits::OutOfRange;
