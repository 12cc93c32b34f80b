//! What `halcyon calibrate --json` prints. An uncertain number `x` has siblings `x_low` and `x_high`: its 95 % interval.

use std::path::{Path, PathBuf};

use halcyon_model::CameraIntrinsics;
use serde::Serialize;

use crate::core::calibrate::{
    Calibration, CoverageMap, DepthUncertainty, ErrorByViews, SIGMAS_95, ViewProblem, ViewQuality, rotation_vector_rad,
};
use crate::core::camera::INTRINSICS;

/// One camera.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CameraReport {
    /// Focal length along x, pixels.
    pub fx_px: f64,
    /// 95 % interval.
    pub fx_px_low: f64,
    /// 95 % interval.
    pub fx_px_high: f64,
    /// Focal length along y, pixels.
    pub fy_px: f64,
    /// 95 % interval.
    pub fy_px_low: f64,
    /// 95 % interval.
    pub fy_px_high: f64,
    /// Principal point x, pixels.
    pub cx_px: f64,
    /// 95 % interval.
    pub cx_px_low: f64,
    /// 95 % interval.
    pub cx_px_high: f64,
    /// Principal point y, pixels.
    pub cy_px: f64,
    /// 95 % interval.
    pub cy_px_low: f64,
    /// 95 % interval.
    pub cy_px_high: f64,
    /// k1, k2, p1, p2, k3; what the model does not free is zero.
    pub distortion: [f64; 5],
    /// 95 % intervals; null where the model holds it at zero, which says nothing of how far from zero it is.
    pub distortion_low: [Option<f64>; 5],
    /// 95 % intervals.
    pub distortion_high: [Option<f64>; 5],
    /// Standard deviations of fx, fy, cx, cy (pixels), k1, k2, p1, p2, k3.
    pub sigmas: [f64; INTRINSICS],
    /// Its part of the stereo reprojection error, pixels.
    pub rms_px: f64,
    /// Share of the picture in which corners were seen, 0 to 1.
    pub coverage: f64,
    /// Where in the picture.
    pub coverage_map: CoverageReport,
}

impl CameraReport {
    fn new(camera: &CameraIntrinsics, sigmas: &[f64; INTRINSICS], rms_px: f64, map: &CoverageMap) -> Self {
        let CameraIntrinsics { fx_px, fy_px, cx_px, cy_px, distortion } = *camera;
        let off = sigmas.map(|sigma| SIGMAS_95 * sigma);
        let is_free = |k: usize| sigmas[4 + k] > 0.0;
        Self {
            fx_px,
            fx_px_low: fx_px - off[0],
            fx_px_high: fx_px + off[0],
            fy_px,
            fy_px_low: fy_px - off[1],
            fy_px_high: fy_px + off[1],
            cx_px,
            cx_px_low: cx_px - off[2],
            cx_px_high: cx_px + off[2],
            cy_px,
            cy_px_low: cy_px - off[3],
            cy_px_high: cy_px + off[3],
            distortion,
            distortion_low: std::array::from_fn(|k| is_free(k).then(|| distortion[k] - off[4 + k])),
            distortion_high: std::array::from_fn(|k| is_free(k).then(|| distortion[k] + off[4 + k])),
            sigmas: *sigmas,
            rms_px,
            coverage: map.share(),
            coverage_map: CoverageReport { cols: map.cols, rows: map.rows, counts: map.counts.clone() },
        }
    }
}

/// Corners used, counted over a grid of fields.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct CoverageReport {
    /// Fields along a row.
    pub cols: usize,
    /// Fields along a column.
    pub rows: usize,
    /// Corners in each field, row-major from the top left.
    pub counts: Vec<u32>,
}

/// One pair.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ViewReport {
    /// Left picture.
    pub left: PathBuf,
    /// Right picture.
    pub right: PathBuf,
    /// Whether it took part.
    pub used: bool,
    /// Why not.
    pub problem: Option<&'static str>,
    /// Mean reprojection error of the left picture, pixels (thesis 3-21); absent where no board was found.
    pub left_error_px: Option<f64>,
    /// The same of the right picture.
    pub right_error_px: Option<f64>,
    /// Root mean square of both.
    pub rms_px: Option<f64>,
    /// Corners left out of the left and the right picture.
    pub corners_rejected: [usize; 2],
}

impl ViewReport {
    fn new(left: &Path, right: &Path, quality: &ViewQuality) -> Self {
        Self {
            left: left.into(),
            right: right.into(),
            used: quality.problem.is_none(),
            problem: quality.problem.map(ViewProblem::name),
            left_error_px: known(quality.left_error_px),
            right_error_px: known(quality.right_error_px),
            rms_px: known(quality.rms_px),
            corners_rejected: quality.corners_rejected,
        }
    }
}

/// Calibrations from so many views, averaged (thesis figure 3-7).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ErrorByViewsReport {
    /// Views that each was made of.
    pub views: usize,
    /// Random choices of views that were averaged.
    pub subsets: usize,
    /// Mean reprojection error in the views used, pixels.
    pub mean_error_px: f64,
    /// The same in the views not used: the honest one. Absent where all were used.
    pub held_out_error_px: Option<f64>,
}

impl ErrorByViewsReport {
    fn new(error: &ErrorByViews) -> Self {
        let ErrorByViews { views, subsets, mean_error_px, held_out_error_px } = *error;
        Self { views, subsets, mean_error_px, held_out_error_px: known(held_out_error_px) }
    }
}

/// Standard deviation of triangulated depth that the calibration alone brings, over the left picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DepthReport {
    /// Depth that it is told for, metres.
    pub distance_m: f64,
    /// Fields along a row.
    pub cols: usize,
    /// Fields along a column.
    pub rows: usize,
    /// At the middle of each field, metres, row-major from the top left; absent where the right camera does not see the point.
    pub sigma_m: Vec<Option<f64>>,
    /// The median of these; absent where there are none.
    pub median_m: Option<f64>,
    /// The largest.
    pub max_m: Option<f64>,
}

impl DepthReport {
    fn new(map: &DepthUncertainty) -> Self {
        let (median_m, max_m) = map.median_and_max_m();
        Self {
            distance_m: map.distance_m,
            cols: map.cols,
            rows: map.rows,
            sigma_m: map.sigma_m.iter().copied().map(known).collect(),
            median_m: known(median_m),
            max_m: known(max_m),
        }
    }
}

/// The result.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CalibrateReport {
    /// Pairs given.
    pub views_total: usize,
    /// Pairs that took part.
    pub views_used: usize,
    /// Corners found, each counted once left and once right.
    pub corners_total: usize,
    /// Corners left out.
    pub corners_rejected: usize,
    /// Root mean square distance from seen to predicted corner, of the corners used, pixels (as OpenCV's `stereoCalibrate`).
    pub stereo_rms_px: f64,
    /// The same before anything was left out, with a flat board.
    pub stereo_rms_all_px: f64,
    /// Mean over the views of the mean error of both pictures, pixels (thesis 3-20).
    pub mean_error_px: f64,
    /// Distance between the cameras, metres.
    pub baseline_m: f64,
    /// 95 % interval.
    pub baseline_m_low: f64,
    /// 95 % interval.
    pub baseline_m_high: f64,
    /// Rotation vector of the right camera from the left, radians.
    pub right_from_left_rad: [f64; 3],
    /// 95 % intervals.
    pub right_from_left_rad_low: [f64; 3],
    /// 95 % intervals.
    pub right_from_left_rad_high: [f64; 3],
    /// Translation of the right camera from the left, metres.
    pub right_from_left_m: [f64; 3],
    /// 95 % intervals.
    pub right_from_left_m_low: [f64; 3],
    /// 95 % intervals.
    pub right_from_left_m_high: [f64; 3],
    /// How far the middle of the board's columns and rows stands out, away from the cameras, metres; absent for a flat board.
    pub board_warp_m: Option<[f64; 2]>,
    /// 95 % intervals.
    pub board_warp_m_low: Option<[f64; 2]>,
    /// 95 % intervals.
    pub board_warp_m_high: Option<[f64; 2]>,
    /// Root mean square vertical disparity after rectification, pixels.
    pub row_error_rms_px: f64,
    /// Largest vertical disparity after rectification, pixels.
    pub row_error_max_px: f64,
    /// Free distortion coefficients.
    pub distortion_model: &'static str,
    /// Starts of the search.
    pub starts: usize,
    /// Starts that ended at the best solution.
    pub starts_agreeing: usize,
    /// Picture width, pixels.
    pub width_px: u32,
    /// Picture height, pixels.
    pub height_px: u32,
    /// The left camera.
    pub left: CameraReport,
    /// The right camera.
    pub right: CameraReport,
    /// What the uncertainty means for depth.
    pub depth_uncertainty: DepthReport,
    /// Error against the number of views.
    pub error_by_views: Vec<ErrorByViewsReport>,
    /// Each pair.
    pub views: Vec<ViewReport>,
}

impl CalibrateReport {
    pub(super) fn new(calibration: &Calibration, left: &[PathBuf], right: &[PathBuf]) -> Self {
        let (rig, sigmas) = (&calibration.rig, &calibration.sigmas);
        let views: Vec<ViewReport> = calibration
            .views
            .iter()
            .zip(left.iter().zip(right))
            .map(|(view, (left, right))| ViewReport::new(left, right, view))
            .collect();
        let baseline_m = rig.baseline_m();
        let turn_rad = rotation_vector_rad(&rig.right_from_left).into();
        let turn = interval(turn_rad, sigmas.rotation_rad.into());
        let shift_m = rig.right_from_left_m.into();
        let shift = interval(shift_m, sigmas.translation_m.into());
        let board_warp_m: Option<[f64; 2]> = calibration.board_warp_m.map(Into::into);
        let warp = board_warp_m.map(|warp| interval(warp, sigmas.warp_m.into()));
        Self {
            views_total: views.len(),
            views_used: views.iter().filter(|view| view.used).count(),
            corners_total: calibration.corners_total,
            corners_rejected: calibration.corners_rejected,
            stereo_rms_px: calibration.stereo_rms_px,
            stereo_rms_all_px: calibration.stereo_rms_all_px,
            mean_error_px: calibration.mean_error_px,
            baseline_m,
            baseline_m_low: baseline_m - SIGMAS_95 * sigmas.baseline_m,
            baseline_m_high: baseline_m + SIGMAS_95 * sigmas.baseline_m,
            right_from_left_rad: turn_rad,
            right_from_left_rad_low: turn.0,
            right_from_left_rad_high: turn.1,
            right_from_left_m: shift_m,
            right_from_left_m_low: shift.0,
            right_from_left_m_high: shift.1,
            board_warp_m,
            board_warp_m_low: warp.map(|(low, _)| low),
            board_warp_m_high: warp.map(|(_, high)| high),
            row_error_rms_px: calibration.row_error.rms_px,
            row_error_max_px: calibration.row_error.max_px,
            distortion_model: calibration.model.name(),
            starts: calibration.starts,
            starts_agreeing: calibration.starts_agreeing,
            width_px: rig.width_px,
            height_px: rig.height_px,
            left: CameraReport::new(&rig.left, &sigmas.left, calibration.left_rms_px, &calibration.coverage_left),
            right: CameraReport::new(&rig.right, &sigmas.right, calibration.right_rms_px, &calibration.coverage_right),
            depth_uncertainty: DepthReport::new(&calibration.depth),
            error_by_views: calibration.error_by_views.iter().map(ErrorByViewsReport::new).collect(),
            views,
        }
    }
}

/// Lower and upper end of the 95 % intervals.
fn interval<const N: usize>(values: [f64; N], sigmas: [f64; N]) -> ([f64; N], [f64; N]) {
    let at = |sign: f64| std::array::from_fn(|k| values[k] + sign * SIGMAS_95 * sigmas[k]);
    (at(-1.0), at(1.0))
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}
