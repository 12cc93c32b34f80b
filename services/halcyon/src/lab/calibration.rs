//! Chapter 3: figure 3-7 and table 3-1.

use super::context::{Lab, LabError};
use super::exhibit::{Exhibit, number};
use crate::report::{Chart, Series};

/// Its lowest mean reprojection error, with forty views, pixels.
const THESIS_ERROR_PX: f64 = 0.465;

pub(super) fn run(lab: &Lab) -> Result<Exhibit, LabError> {
    let (report, calibration) = lab.calibration()?;
    let mut exhibit = Exhibit::default();
    exhibit.text(
        "The thesis took forty pictures of a board of 15 x 8 corners; here are thirteen public pairs of a board of 9 x 6. Errors of views that \
         took part fall with ever fewer views, where parameters bend to them; the error of the views that were left out tells the truth.",
    );
    let mean = |of: &dyn Fn(&halcyon_reconstruction::core::calibrate::ErrorByViews) -> f64| {
        calibration.error_by_views.iter().map(|row| (row.views as f64, of(row))).collect::<Vec<_>>()
    };
    let chart = Chart::new("number of views", "mean reprojection error, px")
        .from_zero()
        .with(Series::line("views that took part (3-20)", mean(&|row| row.mean_error_px)))
        .with(Series::line("views left out", mean(&|row| row.held_out_error_px)))
        .with(Series::dashed("thesis, 40 views", mean(&|_| THESIS_ERROR_PX)));
    exhibit.chart(chart.svg(), "Figure 3-7: mean reprojection error against number of views")?;
    exhibit.find("mean reprojection error (3-20)", "px", report.mean_error_px, Some(THESIS_ERROR_PX));
    exhibit.find("stereo RMS", "px", report.stereo_rms_px, None);
    exhibit.find("largest row error after rectification", "px", report.row_error_max_px, None);

    exhibit.text("Table 3-1: other cameras than the thesis's, so other parameters; ours with half of their 95 % intervals.");
    let cameras = [(&report.left, &calibration.rig.left), (&report.right, &calibration.rig.right)];
    let both = |name: &str, of: &dyn Fn(usize) -> (f64, f64), thesis: [f64; 2]| {
        let mut row = vec![name.to_owned()];
        for (i, thesis) in thesis.into_iter().enumerate() {
            let (value, high) = of(i);
            row.push(format!("{} ± {}", number(value), number(high - value)));
            row.push(number(thesis));
        }
        row
    };
    let mut rows = vec![
        both("horizontal focal length, px", &|i| (cameras[i].0.fx_px, cameras[i].0.fx_px_high), [509.3683; 2]),
        both("vertical focal length, px", &|i| (cameras[i].0.fy_px, cameras[i].0.fy_px_high), [509.3683; 2]),
        both("principal point u0, px", &|i| (cameras[i].0.cx_px, cameras[i].0.cx_px_high), [305.7052, 309.351]),
        both("principal point v0, px", &|i| (cameras[i].0.cy_px, cameras[i].0.cy_px_high), [242.1296, 250.989]),
    ];
    for (k, (name, thesis)) in [("k1", [-0.1075, 0.0467]), ("k2", [2.2123, -0.0674])].into_iter().enumerate() {
        rows.push(both(name, &|i| (cameras[i].0.distortion[k], cameras[i].0.distortion_high[k].unwrap_or(f64::NAN)), thesis));
    }
    exhibit.table(vec!["", "left", "thesis", "right", "thesis"], rows);
    let turn = calibration.rig.right_from_left;
    let row = |i: usize| (0..3).map(|j| format!("{:.4}", turn[(i, j)])).collect::<Vec<_>>().join("  ");
    let t_m = calibration.rig.right_from_left_m;
    exhibit.table(
        vec!["", "ours", "thesis"],
        vec![
            vec!["R, first row".into(), row(0), "0.9993  -0.0186  0.0399".into()],
            vec!["R, second row".into(), row(1), "0.0187  0.9998  0.0035".into()],
            vec!["R, third row".into(), row(2), "0.0399  -0.0042  0.9992".into()],
            vec![
                "T, cm".into(),
                format!("{:.4}  {:.4}  {:.4}", 100.0 * t_m.x, 100.0 * t_m.y, 100.0 * t_m.z),
                "-7.8968  0.1801  0.0212".into(),
            ],
        ],
    );
    // By its own table: columns of a rotation have length one.
    exhibit.text(
        "The thesis's R is no rotation: its first and last columns are not perpendicular (their product is 0.0798), one sign is missing.",
    );
    Ok(exhibit)
}

#[cfg(test)]
mod tests {
    /// What the page says about table 3-1.
    #[test]
    fn the_rotation_of_table_3_1_is_none() {
        let (first, last) = ([0.9993, 0.0187, 0.0399], [0.0399, 0.0035, 0.9992]);
        let product: f64 = first.iter().zip(&last).map(|(a, b): (&f64, &f64)| a * b).sum();
        assert!((product - 0.0798).abs() < 1e-4, "{product}");
        let mended = [0.9993, 0.0187, -0.0399];
        let product: f64 = mended.iter().zip(&last).map(|(a, b): (&f64, &f64)| a * b).sum();
        assert!(product.abs() < 1e-3, "{product}");
    }
}
