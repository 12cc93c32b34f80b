//! What `halcyon calibrate` and `halcyon match` do, without the command line: files in, files and a report out.

mod calibrate;
mod matching;

pub use calibrate::{
    CalibrateCliError, CalibrateReport, CalibrateRequest, CameraReport, CoverageReport, DepthReport, ErrorByViewsReport,
    ViewReport, calibrate, convert_rig,
};
pub use matching::{MatchCliError, MatchReport, match_pair};
