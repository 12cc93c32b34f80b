//! The calibration report.

use halcyon_reconstruction::cli::{CalibrateReport, CameraReport, CoverageReport};
use halcyon_reconstruction::core::calibrate::{Calibration, SIGMAS_95, ViewQuality};

use crate::report::{Bars, Chart, ChartError, HeatMap, Page, Series};

/// Names of a camera's parameters, in the order of its sigmas.
const NAMES: [&str; 9] = ["fx, px", "fy, px", "cx, px", "cy, px", "k1", "k2", "p1", "p2", "k3"];

/// All that a calibration says about itself, to look at.
pub(super) fn page(report: &CalibrateReport, calibration: &Calibration) -> Result<String, ChartError> {
    let mut page = Page::new("Stereo calibration");
    summary(&mut page, report);
    parameters(&mut page, report);
    views(&mut page, report)?;
    by_views(&mut page, report)?;
    page.heading("Where the board was seen").paragraph(
        "Corners used in each field of the picture. Distortion is only known where corners were: empty fields are extrapolated.",
    );
    page.figure(&coverage(report, &report.left.coverage_map)?, "Left picture");
    page.figure(&coverage(report, &report.right.coverage_map)?, "Right picture");
    residuals(&mut page, calibration)?;
    depth(&mut page, report)?;
    Ok(page.html())
}

fn summary(page: &mut Page, report: &CalibrateReport) {
    let row = |name: &str, value: String| [name.to_owned(), value];
    let mut rows = vec![
        row("Pairs used", format!("{} of {}", report.views_used, report.views_total)),
        row("Corners left out", format!("{} of {}", report.corners_rejected, report.corners_total)),
        row("Stereo RMS", format!("{:.4} px", report.stereo_rms_px)),
        row("Stereo RMS of every corner, flat board", format!("{:.4} px", report.stereo_rms_all_px)),
        row("Mean reprojection error (3-20)", format!("{:.4} px", report.mean_error_px)),
        row("Row error after rectification, RMS", format!("{:.3} px", report.row_error_rms_px)),
        row("Row error after rectification, largest", format!("{:.3} px", report.row_error_max_px)),
        row("Starts that end at this solution", format!("{} of {}", report.starts_agreeing, report.starts)),
        row("Distortion", report.distortion_model.to_owned()),
        row("Picture", format!("{} x {} px", report.width_px, report.height_px)),
    ];
    rows.push(row(
        "Board warp, along rows and along columns",
        match (report.board_warp_m, report.board_warp_m_low) {
            (Some(warp), Some(low)) => {
                let [x, y] = [0, 1].map(|k| format!("{:.3} ± {:.3} mm", 1e3 * warp[k], 1e3 * (warp[k] - low[k])));
                format!("{x}, {y} (95 %)")
            }
            _ => "none: the board is flat as far as these pictures tell".to_owned(),
        },
    ));
    page.table(&["", ""], &rows);
}

fn parameters(page: &mut Page, report: &CalibrateReport) {
    page.heading("Parameters").paragraph(
        "With half of their 95 % intervals, from the covariance at the solution. They speak of noise in the corners; a wrong square size \
         scales every length, and is not in them.",
    );
    let values = |camera: &CameraReport| -> Vec<f64> {
        [camera.fx_px, camera.fy_px, camera.cx_px, camera.cy_px].into_iter().chain(camera.distortion).collect()
    };
    let cell = |value: f64, sigma: f64| if sigma == 0.0 { "fixed".to_owned() } else { measured(value, SIGMAS_95 * sigma) };
    let (left, right) = (values(&report.left), values(&report.right));
    let rows: Vec<[String; 3]> = NAMES
        .iter()
        .enumerate()
        .map(|(k, name)| [(*name).to_owned(), cell(left[k], report.left.sigmas[k]), cell(right[k], report.right.sigmas[k])])
        .collect();
    page.table(&["Camera", "left", "right"], &rows);

    let mut rows = vec![["baseline, m".to_owned(), measured(report.baseline_m, report.baseline_m_high - report.baseline_m)]];
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let (value, high) = (report.right_from_left_m[k], report.right_from_left_m_high[k]);
        rows.push([format!("translation {axis}, m"), measured(value, high - value)]);
    }
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let (value, high) = (report.right_from_left_rad[k].to_degrees(), report.right_from_left_rad_high[k].to_degrees());
        rows.push([format!("rotation {axis}, °"), measured(value, high - value)]);
    }
    page.table(&["Right camera from left", ""], &rows);
}

/// A value with its uncertainty to two digits, and no more of it than that leaves.
fn measured(value: f64, off: f64) -> String {
    let decimals = if off > 0.0 { (1 - off.log10().floor() as i32).clamp(0, 9) as usize } else { 6 };
    format!("{value:.decimals$} ± {off:.decimals$}")
}

fn views(page: &mut Page, report: &CalibrateReport) -> Result<(), ChartError> {
    page.heading("Error of each view");
    let name = |at: usize| (at + 1).to_string();
    let bars = |side: fn(&halcyon_reconstruction::cli::ViewReport) -> Option<f64>| -> Vec<f64> {
        report.views.iter().map(|view| side(view).unwrap_or(f64::NAN)).collect()
    };
    let chart = Bars::new("mean reprojection error, px", (0..report.views.len()).map(name).collect())
        .with("left", bars(|view| view.left_error_px))
        .with("right", bars(|view| view.right_error_px));
    page.figure(&chart.svg()?, "Mean distance from seen to predicted corner in each picture (3-21)");
    let rows: Vec<[String; 6]> = report
        .views
        .iter()
        .enumerate()
        .map(|(at, view)| {
            let file = |path: &std::path::Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let error = |error: Option<f64>| error.map_or_else(|| "–".to_owned(), |error| format!("{error:.3}"));
            [
                format!("{}: {}, {}", name(at), file(&view.left), file(&view.right)),
                error(view.left_error_px),
                error(view.right_error_px),
                error(view.rms_px),
                format!("{} + {}", view.corners_rejected[0], view.corners_rejected[1]),
                view.problem.unwrap_or("used").to_owned(),
            ]
        })
        .collect();
    page.table(&["View", "left, px", "right, px", "RMS, px", "corners left out", ""], &rows);
    Ok(())
}

fn by_views(page: &mut Page, report: &CalibrateReport) -> Result<(), ChartError> {
    page.heading("Error against number of views (thesis figure 3-7)").paragraph(
        "Calibrations from random choices of the views. The error in the views used flatters: a few views can be fitted closely by a wrong \
         camera. The error in the views not used says how well the calibration holds.",
    );
    let used = report.error_by_views.iter().map(|error| (error.views as f64, error.mean_error_px)).collect();
    let unused =
        report.error_by_views.iter().map(|error| (error.views as f64, error.held_out_error_px.unwrap_or(f64::NAN))).collect();
    let chart = Chart::new("views", "mean reprojection error, px")
        .with(Series::line("views not used", unused))
        .with(Series::line("views used", used))
        .from_zero();
    page.figure(&chart.svg()?, "Mean over the choices of views");
    Ok(())
}

fn coverage(report: &CalibrateReport, map: &CoverageReport) -> Result<String, ChartError> {
    let counts = map.counts.iter().map(|count| if *count == 0 { f64::NAN } else { f64::from(*count) }).collect();
    over_picture(report, map.cols, counts, "corners")
}

fn over_picture(report: &CalibrateReport, cols: usize, values: Vec<f64>, unit: &str) -> Result<String, ChartError> {
    let (width, height) = (f64::from(report.width_px), f64::from(report.height_px));
    HeatMap::new(cols, values, (0.0, width), (height, 0.0)).labelled("x, px", "y, px", unit).svg()
}

fn residuals(page: &mut Page, calibration: &Calibration) -> Result<(), ChartError> {
    let side = |of: fn(&ViewQuality) -> &[nalgebra::Vector2<f64>]| -> Vec<(f64, f64)> {
        let used = calibration.views.iter().filter(|view| view.problem.is_none());
        used.flat_map(|view| of(view).iter().map(|residual| (residual.x, residual.y))).collect()
    };
    page.heading("Residuals").paragraph(
        "Seen minus predicted, every corner of the views used, those left out included. A round cloud about zero is noise; \
         anything else is a model that does not fit.",
    );
    let chart = Chart::new("x, px", "y, px")
        .with(Series::points("left", side(|view| &view.left_residuals_px)))
        .with(Series::points("right", side(|view| &view.right_residuals_px)))
        .equal_scales();
    page.figure(&chart.svg()?, "Residuals of all corners");
    Ok(())
}

fn depth(page: &mut Page, report: &CalibrateReport) -> Result<(), ChartError> {
    let depth = &report.depth_uncertainty;
    page.heading("Depth uncertainty").paragraph(&format!(
        "Half of the 95 % interval of the depth of a point {} m in front of the left camera that this calibration's uncertainty alone \
         brings; matching adds its own. Grey: the right camera does not see the point.",
        depth.distance_m
    ));
    let (Some(median_m), Some(max_m)) = (depth.median_m, depth.max_m) else {
        page.paragraph("The two cameras see nothing in common at this distance.");
        return Ok(());
    };
    // Where no corner was, towards the picture's own corners, it grows tenfold: that would leave the rest one colour.
    let half_mm = |sigma_m: f64| 1e3 * SIGMAS_95 * sigma_m;
    let most_mm = half_mm(max_m).min(5.0 * half_mm(median_m));
    let values = depth.sigma_m.iter().map(|sigma| sigma.map_or(f64::NAN, |sigma_m| half_mm(sigma_m).min(most_mm))).collect();
    let caption = format!(
        "Half of the 95 % interval over the left picture: {:.2} mm in the median, {:.1} mm at most; more than {most_mm:.1} mm is \
         drawn as that",
        half_mm(median_m),
        half_mm(max_m)
    );
    page.figure(&over_picture(report, depth.cols, values, "mm")?, &caption);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use halcyon_reconstruction::cli::{CalibrateRequest, calibrate};
    use halcyon_reconstruction::core::calibrate::Options;

    #[test]
    fn numbers_have_the_digits_that_their_uncertainty_leaves() {
        assert_eq!(measured(534.001_35, 0.587), "534.00 ± 0.59");
        assert_eq!(measured(0.083_150_1, 7.35e-5), "0.083150 ± 0.000073");
        assert_eq!(measured(1234.5, 62.0), "1234 ± 62");
        assert_eq!(measured(1.0, 0.0), "1.000000 ± 0.000000");
    }

    #[test]
    fn a_page_has_all_its_figures_and_loads_nothing() {
        let glob = |side: &str| format!("{}/../../samples/{side}1?.jpg", env!("CARGO_MANIFEST_DIR"));
        let (left, right) = (glob("left"), glob("right"));
        let request = CalibrateRequest {
            left: &left,
            right: &right,
            board: "9x6",
            square_m: 0.025,
            options: Options { starts: 3, ..Options::default() },
            out: None,
            ros: None,
        };
        let (report, calibration) = calibrate(&request, &mut |_, _| {}).unwrap();
        let html = page(&report, &calibration).unwrap();
        assert_eq!(html.matches("<svg").count(), 6, "views, number of views, coverage twice, residuals, depth");
        for part in ["left11.jpg, right11.jpg", "fx, px", "figure 3-7", "Depth uncertainty"] {
            assert!(html.contains(part), "{part}");
        }
        assert!(!html.contains("<script") && !html.contains("src="));
    }
}
