//! Dense matching: figures 4-4, 4-5, 4-22 … 4-25, 5-6, 5-15, 5-16.

use halcyon_model::StereoPair;
use halcyon_reconstruction::cli::{self, compare};
use halcyon_reconstruction::core::disparity::{Disparity, colour};
use halcyon_reconstruction::core::matcher::{DisparityRange, Engine, SgbmMode};
use halcyon_reconstruction::core::reconstruct::{Reconstructor, Settings};
use halcyon_reconstruction::core::show;
use halcyon_reconstruction::files;
use halcyon_sim::sea::SeaConfig;
use nalgebra::{UnitQuaternion, Vector3};

use super::context::{Lab, LabError};
use super::exhibit::{Exhibit, File};
use crate::accuracy::{Scene, thesis_rig};
use crate::report::{Bars, Chart, HeatMap, Series};

/// What is left of water's contrast where it is clear.
const CLEAR: f64 = 0.03;
/// Points of a cloud that a chart shows.
const POINTS_SHOWN: usize = 2500;

/// A failure while drawing, which only memory can cause.
pub(super) fn draw<E: std::fmt::Display>(png: Result<Vec<u8>, E>) -> Result<Vec<u8>, LabError> {
    png.map_err(|error| LabError::Draw(error.to_string()))
}

pub(super) fn rectification(lab: &Lab) -> Result<Exhibit, LabError> {
    let [left, right] = lab.board_pair()?;
    let (left, right) = files::read_pair(&left, &right)?;
    let (report, calibration) = lab.calibration()?;
    let mut exhibit = Exhibit::default();
    exhibit.png(
        draw(show::rectification_png(&left, &right, &calibration.rig))?,
        "Above: the pair as taken; each circle's point lies somewhere on the line of its colour. Below: rectified; it lies on the same row",
    );
    exhibit.find("row error after rectification, RMS", "px", report.row_error_rms_px, None);
    exhibit.find("row error after rectification, largest", "px", report.row_error_max_px, None);
    Ok(exhibit)
}

pub(super) fn object(lab: &Lab) -> Result<Exhibit, LabError> {
    // Nearly as large as the thesis's pictures.
    let object = super::pictures::halved(&lab.object()?)?;
    let mut exhibit = Exhibit::default();
    exhibit.png(draw(colour::encode_png(&object.truth))?, "Figure 4-5: the true disparity of the aloe pair; black is unknown");
    let engines = [Engine::Bm, Engine::Sgbm(SgbmMode::FivePaths), Engine::Sgbm(SgbmMode::EightPaths)];
    let matched = compare(&object.left, &object.right, object.range, &engines)?;
    let mut rows = Vec::new();
    for found in &matched {
        let score = found.score(&object.truth)?;
        let name = found.engine.name();
        exhibit.png(draw(colour::encode_png(&found.disparity))?, format!("Figure 4-23: disparity by {name}"));
        // The thesis's pictures were 640 x 480, 47 % of which its SGBM matched.
        let theirs = (found.engine == engines[1]).then_some(145_445.0);
        exhibit.find(format!("points by {name} (figure 4-24)"), "1", found.points as f64, theirs);
        let share = 100.0 * found.disparity.density();
        exhibit.find(
            format!("share of the picture by {name}"),
            "%",
            share,
            theirs.map(|points| 100.0 * points / (640.0 * 480.0)),
        );
        let percent = |share: f64| format!("{:.2} %", 100.0 * share);
        let mean = format!("{:.3}", score.mean_error_px);
        rows.push(vec![name.to_owned(), percent(score.density), percent(score.bad1), percent(score.bad2), mean]);
        exhibit.chart(cloud_chart(&found.disparity), format!("Figure 4-25: cloud by {name}, from above"))?;
    }
    exhibit.table(vec!["engine", "matched", "off by more than 1 px", "more than 2 px", "mean error, px"], rows);
    let names = matched.iter().map(|found| found.engine.name().to_owned()).collect();
    let bars = Bars::new("points", names).with("points", matched.iter().map(|found| found.points as f64).collect());
    exhibit.chart(bars.svg(), "Figure 4-24: points of dense methods; sparse ones find some hundred")?;
    Ok(exhibit)
}

/// Where points lie from side to side and in depth, in units of the focal length and of the (unknown) baseline.
fn cloud_chart(disparity: &Disparity) -> Result<String, crate::report::ChartError> {
    let width = disparity.width_px as usize;
    let step = (disparity.matched() / POINTS_SHOWN).max(1);
    let found = disparity.values_px.iter().enumerate().filter(|(_, value)| **value > 0.0).step_by(step);
    let points = found.map(|(i, value)| ((i % width) as f64 - width as f64 / 2.0, 1e3 / f64::from(*value))).collect();
    Chart::new("x, px from the middle", "depth, thousandths of f b").with(Series::points("", points)).svg()
}

/// One pair of the thesis's rig over its tank, 0.99 m above water of that contrast.
pub(super) fn tank_pair(lab: &Lab, contrast: f64) -> Result<StereoPair, LabError> {
    let scale = lab.choose(1.0, 0.5);
    let sea = SeaConfig { depth_m: 0.6, ..SeaConfig::regular(0.04, 0.8, 270.0) };
    let texture = halcyon_sim::texture::Texture::grained(7, 0.0035 / scale).faded(contrast);
    let mut scene = Scene::with_texture(&thesis_rig(0.092, scale), &sea, texture, 7)?;
    Ok(scene.pair(3.0, Vector3::new(0.0, 0.0, -0.99), &UnitQuaternion::identity(), None)?)
}

/// A pair of clear water.
pub(super) fn clear_water(lab: &Lab) -> Result<StereoPair, LabError> {
    tank_pair(lab, CLEAR)
}

pub(super) fn film(lab: &Lab) -> Result<Exhibit, LabError> {
    let mut exhibit = Exhibit::default();
    exhibit.text("The same waves (4 cm, 0.8 s), seen as clear water and with a patterned film afloat on them.");
    let engine = [Engine::Sgbm(SgbmMode::FivePaths)];
    let pairs = [("clear water (figure 5-6)", clear_water(lab)?), ("film (figure 5-15)", tank_pair(lab, 1.0)?)];
    for (name, pair) in &pairs {
        let range = DisparityRange { min_px: 0, max_px: pair.left.width_px() / 8 - 1 };
        for found in compare(&pair.left, &pair.right, range, &engine)? {
            exhibit.png(draw(colour::encode_png(&found.disparity))?, format!("Disparity of {name}"));
            exhibit.find(format!("matched pixels, {name}"), "%", 100.0 * found.disparity.density(), None);
        }
    }
    let mut chain = Reconstructor::new(Settings { cell_m: 0.02, ..Settings::default() });
    let mut on = |pair: &StereoPair| chain.reconstruct(pair).ok();
    let clear = on(&pairs[0].1).map_or(0.0, |patch| 100.0 * patch.coverage);
    exhibit.find("surface covered by the default chain, clear water", "%", clear, None);
    let Some(patch) = on(&pairs[1].1) else { return Ok(exhibit) };
    exhibit.find("surface covered by the default chain, film", "%", 100.0 * patch.coverage, None);
    let grid = &patch.grid;
    let side = |start_m: f64, cells: u32| (start_m, start_m + f64::from(cells) * grid.cell_m);
    let heights_mm = grid.elevation_m.iter().map(|elevation_m| 1e3 * f64::from(*elevation_m)).collect();
    let (x, y) = (side(grid.south_west_east_m, grid.cols), side(grid.south_west_north_m, grid.rows));
    let map = HeatMap::new(grid.cols as usize, heights_mm, x, y).labelled("x, m", "y, m", "elevation, mm");
    exhibit.chart(map.svg(), "Figure 5-16, top view: elevation of the film")?;
    if let Ok(cloud) = cli::cloud_of(&chain, &pairs[1].1, &patch) {
        let step = (cloud.points.len() / POINTS_SHOWN).max(1);
        let points = cloud.points.iter().step_by(step).map(|point| (point.at_m.x, 1e3 * point.at_m.z)).collect();
        let chart = Chart::new("x, m", "elevation, mm").with(Series::points("", points));
        exhibit.chart(chart.svg(), "Figure 5-16, side view: points of the film")?;
        exhibit.cloud("film", &cloud);
        let mesh = halcyon_reconstruction::core::mesh::of_cloud(&cloud);
        exhibit.files.push(File { name: "film-mesh.ply".into(), bytes: files::ply::encode_mesh(&mesh) });
    }
    Ok(exhibit)
}
