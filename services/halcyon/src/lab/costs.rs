//! The plain reference matcher's choices: costs (4-10 … 4-15), windows, left-right check and paths (figures 4-7 … 4-11).

use halcyon_reconstruction::core::disparity::score::Score;
use halcyon_reconstruction::core::disparity::{colour, score};
use halcyon_reconstruction::core::matcher::{StudyMethod, match_images};
use halcyon_reconstruction::core::show;
use halcyon_reconstruction::core::study::cost::Cost;
use halcyon_reconstruction::core::study::path::Paths;
use halcyon_reconstruction::core::study::window::{Windows, nine_centres_px};
use halcyon_reconstruction::core::study::{Optimiser, ReferenceMatcher, Settings, transform};

use super::context::{Lab, LabError, Object};
use super::dense::draw;
use super::exhibit::Exhibit;
use super::pictures::{halved, image, stretched};
use crate::report::{Chart, Series};

/// Window of the plain matchers, pixels.
const WINDOW_PX: u32 = 9;
const HEADER: [&str; 4] = ["", "matched", "off by more than 1 px", "mean error, px"];

/// The aloe pair as small as the reference matcher, which holds all costs at once, can take in the time.
fn small_object(lab: &Lab) -> Result<Object, LabError> {
    let half = halved(&lab.object()?)?;
    lab.choose(Ok(half), lab.object().and_then(|object| halved(&halved(&object)?)))
}

fn plain(cost: Cost) -> Settings {
    Settings::new(StudyMethod { semi_global: false, cost }, WINDOW_PX)
}

/// Matches with these settings, adds the map and its score.
fn judged(exhibit: &mut Exhibit, object: &Object, name: &str, settings: Settings) -> Result<(Score, Vec<String>), LabError> {
    let disparity = match_images(&mut ReferenceMatcher::new(settings), &object.left, &object.right, object.range)?;
    let score = score::score(&disparity, &object.truth)?;
    exhibit.png(draw(colour::encode_png(&disparity))?, name);
    exhibit.find(format!("off by more than 1 px, {name}"), "%", 100.0 * score.bad1, None);
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let row = vec![name.to_owned(), percent(score.density), percent(score.bad1), format!("{:.3}", score.mean_error_px)];
    Ok((score, row))
}

pub(super) fn costs(lab: &Lab) -> Result<Exhibit, LabError> {
    let object = small_object(lab)?;
    let mut exhibit = Exhibit::default();
    let (width, height) = (object.left.width_px(), object.left.height_px());
    let rank = transform::rank(object.left.pixels(), width as usize, 7);
    exhibit.png(
        draw(show::grey_png(&image(width, height, stretched(&rank))?))?,
        "Figure 4-7: rank transform over 7 x 7 pixels: how many neighbours are darker",
    );
    let census = transform::census(object.left.pixels(), width as usize, 3);
    let census: Vec<f32> = census.iter().map(|bits| (*bits & 0xff) as f32).collect();
    exhibit.png(
        draw(show::grey_png(&image(width, height, stretched(&census))?))?,
        "Figure 4-8: census transform over 3 x 3 pixels: which neighbours are darker, as eight bits",
    );
    exhibit
        .text("Winner takes all over a window of 9 x 9 pixels, with each way to compare pixels (figure 4-6 draws the window).");
    let mut rows = Vec::new();
    for cost in Cost::ALL {
        rows.push(judged(&mut exhibit, &object, cost.name(), plain(cost))?.1);
    }
    exhibit.table(HEADER.to_vec(), rows);
    Ok(exhibit)
}

pub(super) fn windows(lab: &Lab) -> Result<Exhibit, LabError> {
    let object = small_object(lab)?;
    let mut exhibit = Exhibit::default();
    let corners = |(x, y): (i32, i32)| {
        let half = f64::from(WINDOW_PX / 2);
        let (x, y) = (f64::from(x), f64::from(y));
        vec![(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half), (x - half, y - half)]
    };
    let mut chart = Chart::new("x, px", "y, px").equal_scales();
    for centre_px in nine_centres_px(WINDOW_PX) {
        chart = chart.with(Series::line("", corners(centre_px)));
    }
    let chart = chart.with(Series::points("the pixel", vec![(0.0, 0.0)]));
    exhibit.chart(chart.svg(), "Figure 4-9: the nine windows of a pixel")?;
    let mut rows = Vec::new();
    for (name, windows) in [("one window", Windows::One), ("nine windows", Windows::Nine)] {
        rows.push(judged(&mut exhibit, &object, name, Settings { windows, ..plain(Cost::Sad) })?.1);
    }
    exhibit.table(HEADER.to_vec(), rows);
    Ok(exhibit)
}

pub(super) fn left_right(lab: &Lab) -> Result<Exhibit, LabError> {
    let object = small_object(lab)?;
    let mut exhibit = Exhibit::default();
    exhibit.text("A match counts if the right picture's own best match leads back to within a pixel (figure 4-10).");
    let mut rows = Vec::new();
    for (name, left_right_px) in [("without the check", None), ("with the check", Some(1))] {
        let (score, row) = judged(&mut exhibit, &object, name, Settings { left_right_px, ..plain(Cost::Census) })?;
        exhibit.find(format!("matched, {name}"), "%", 100.0 * score.density, None);
        rows.push(row);
    }
    exhibit.table(HEADER.to_vec(), rows);
    Ok(exhibit)
}

pub(super) fn paths(lab: &Lab) -> Result<Exhibit, LabError> {
    let object = small_object(lab)?;
    let mut exhibit = Exhibit::default();
    let mut chart = Chart::new("x, px", "y, px").equal_scales();
    let mut rows = Vec::new();
    for (name, paths) in [("4 paths", Paths::Four), ("8 paths", Paths::Eight), ("16 paths", Paths::Sixteen)] {
        let mut settings = Settings::new(StudyMethod { semi_global: true, cost: Cost::Census }, 1);
        if let Optimiser::SemiGlobal { paths: chosen, .. } = &mut settings.optimiser {
            *chosen = paths;
        }
        rows.push(judged(&mut exhibit, &object, name, settings)?.1);
    }
    for (x, y) in Paths::Sixteen.steps() {
        let (x, y) = (f64::from(*x), f64::from(*y));
        // All as long as each other: directions, not steps.
        let length = x.hypot(y);
        chart = chart.with(Series::line("", vec![(0.0, 0.0), (x / length, y / length)]));
    }
    exhibit.chart(chart.svg(), "Figure 4-11: the directions in which paths meet in a pixel, of 16; 8 are the thesis's")?;
    exhibit.table(HEADER.to_vec(), rows);
    Ok(exhibit)
}
