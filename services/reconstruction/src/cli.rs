//! What `halcyon calibrate`, `features`, `match` and `self-calibrate` do, without the command line: files in, files and a report out.

mod calibrate;
mod features;
mod matching;
mod self_calibrate;

pub use calibrate::{CalibrateCliError, CalibrateReport, CameraReport, ViewReport, calibrate};
pub use features::{FeatureRow, FeaturesCliError, FeaturesOptions, FeaturesReport, PoseReport, features};
pub use matching::{MatchCliError, MatchReport, match_pair};
pub use self_calibrate::{
    AlternativeReport, AngleReport, SelfCalibrateCliError, SelfCalibrateOptions, SelfCalibrateReport, SelfViewReport,
    self_calibrate,
};
