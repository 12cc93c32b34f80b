//! What `halcyon calibrate` and `halcyon match` do, without the command line: files in, files and a report out.

mod calibrate;
mod compare;
mod matching;
mod options;

pub use calibrate::{
    CalibrateCliError, CalibrateReport, CalibrateRequest, CameraReport, CoverageReport, DepthReport, ErrorByViewsReport,
    ViewReport, calibrate, convert_rig,
};
pub use compare::{Matched, THESIS_SIZES_PX, TimeAtSize, compare, times_by_size};
pub use matching::{MatchCliError, MatchReport, TruthReport, match_pair};
pub use options::{MatchOptions, OptionError};
