//! Flat surfaces: figures 5-8 … 5-10 and 5-18 … 5-20.

use halcyon_ocean::{Crossing, Record, crossing};
use halcyon_reconstruction::cli;
use halcyon_reconstruction::core::disparity::colour;
use halcyon_reconstruction::core::reconstruct::{Reconstructor, Settings};
use halcyon_sim::sea::SeaConfig;
use nalgebra::{UnitQuaternion, Vector3};

use super::context::{Lab, LabError};
use super::dense::draw;
use super::exhibit::Exhibit;
use crate::accuracy::{Scene, plane, still_water, thesis_rig};
use crate::report::{Chart, Series};

const MM: f64 = 1e3;
/// Pairs a second of the still-water runs.
const RATE_HZ: f64 = 3.5;

pub(super) fn baseline(lab: &Lab) -> Result<Exhibit, LabError> {
    let mut exhibit = Exhibit::default();
    exhibit.text(
        "A plane at 0.5 m, two pairs a second for 28 s. The thesis, which calibrated anew for each baseline, found that the error grows with it. \
         These cameras are simulated and known exactly, so that what is seen is the matching alone: its error falls as the baseline grows.",
    );
    let mut scene = Scene::new(&thesis_rig(0.092, 1.0), &SeaConfig::still(), 0.003, 11)?;
    let pair = scene.pair(0.0, Vector3::new(0.0, 0.0, -0.5), &UnitQuaternion::identity(), None)?;
    let mut chain = Reconstructor::new(Settings { cell_m: 0.01, ..Settings::default() });
    if let Ok(patch) = chain.reconstruct(&pair) {
        exhibit.png(draw(colour::encode_png(&chain.disparity()))?, "Figure 5-8: disparity of the plane");
        if let Ok(cloud) = cli::cloud_of(&chain, &pair, &patch) {
            let step = (cloud.points.len() / 2500).max(1);
            let points = cloud.points.iter().step_by(step).map(|point| (point.at_m.x, MM * point.at_m.z)).collect();
            let chart = Chart::new("x, m", "height above the fitted plane, mm").with(Series::points("", points));
            exhibit.chart(chart.svg(), "Figure 5-9: points of the plane from the side")?;
            exhibit.cloud("plane", &cloud);
        }
    }
    for (baseline_m, thesis_mm) in [(0.092, 8.8), (0.12, 10.8), (0.15, 25.2)] {
        let record = plane(baseline_m, lab.choose(56, 6))?;
        let ends = [record.measured.first(), record.measured.last()].map(|end| end.map_or(0.0, |end| end.0));
        let chart = Chart::new("time, s", "distance, m")
            .with(Series::points("measured", record.measured.clone()))
            .with(Series::dashed("true", ends.map(|t_s| (t_s, record.distance_m)).to_vec()));
        let name = format!("baseline {} cm", number_cm(baseline_m));
        exhibit.chart(chart.svg(), format!("Figure 5-10: mean distance of each pair, {name}"))?;
        exhibit.find(format!("RMSE, {name}"), "mm", MM * record.rmse_m, Some(thesis_mm));
    }
    Ok(exhibit)
}

fn number_cm(length_m: f64) -> f64 {
    (1e3 * length_m).round() / 10.0
}

pub(super) fn still(lab: &Lab) -> Result<Exhibit, LabError> {
    let mut exhibit = Exhibit::default();
    exhibit.text("Still water has no waves: what is measured is error. Three repetitions from each height, 200 pairs each, at 320 x 240. \
         As in the thesis: zero up-crossings of the mean level of each pair, nothing taken out. Besides, what the chain reports, which tells the noise \
         that it knows of from waves: none is left.");
    let mut by_height = Vec::new();
    for height_m in [0.80, 0.99, 1.22, 1.42] {
        let (mut sum_mm, mut told_apart_mm) = (0.0, 0.0);
        let repetitions = lab.choose(3, 1);
        for seed in 0..repetitions {
            let run = still_water(height_m, lab.choose(200, 40), 12 + seed)?;
            sum_mm += MM * run.h_mean_of_levels_m;
            told_apart_mm += MM * run.h_mean_m / repetitions as f64;
            if height_m == 0.99 && seed == 0 {
                show_record(&mut exhibit, &run.trace)?;
            }
        }
        let mean_mm = sum_mm / repetitions as f64;
        by_height.push((height_m, mean_mm));
        exhibit.find(format!("false H_m from {height_m} m"), "mm", mean_mm, (height_m == 0.99).then_some(2.3));
        exhibit.find(format!("false H_m from {height_m} m, known noise told apart"), "mm", told_apart_mm, None);
    }
    let thesis = by_height.iter().map(|(height_m, _)| (*height_m, 2.3)).collect();
    let chart = Chart::new("height above the water, m", "false H_m, mm")
        .from_zero()
        .with(Series::line("ours", by_height))
        .with(Series::dashed("thesis, at its best height of 0.99 m", thesis));
    exhibit.chart(chart.svg(), "Figure 5-20: false mean wave height against distance")?;
    Ok(exhibit)
}

fn show_record(exhibit: &mut Exhibit, trace: &[(f64, f64)]) -> Result<(), LabError> {
    let in_mm = |points: &[(f64, f64)]| points.iter().map(|(t_s, m)| (*t_s, MM * m)).collect::<Vec<_>>();
    let raw = Chart::new("time, s", "elevation, mm").with(Series::line("", in_mm(trace)));
    exhibit.chart(raw.svg(), "Figure 5-18: readings from 0.99 m")?;
    let (crests, troughs) = crests_and_troughs(trace, RATE_HZ)?;
    let found = Chart::new("time, s", "elevation, mm")
        .with(Series::line("", in_mm(trace)))
        .with(Series::points("crests", in_mm(&crests)))
        .with(Series::points("troughs", in_mm(&troughs)));
    exhibit.chart(found.svg(), "Figure 5-19: crests and troughs by zero up-crossing without a dead band, as in the thesis")?;
    Ok(())
}

/// Points in time and height.
type Points = Vec<(f64, f64)>;

/// Crest and trough of every wave between zero up-crossings, with their times, by the textbook's rule.
pub(super) fn crests_and_troughs(trace: &[(f64, f64)], rate_hz: f64) -> Result<(Points, Points), LabError> {
    let samples: Vec<f64> = trace.iter().map(|point| point.1).collect();
    let record = Record::new(samples, rate_hz)?.without_mean();
    let mean_m = trace.iter().map(|point| point.1).sum::<f64>() / trace.len().max(1) as f64;
    let start_s = trace.first().map_or(0.0, |point| point.0);
    let (mut crests, mut troughs) = (Vec::new(), Vec::new());
    for wave in crossing::waves(&record, Crossing::Up, 0.0) {
        let within = |t_s: f64| (wave.start_s..=wave.start_s + wave.period_s).contains(&(t_s - start_s));
        let inside = || trace.iter().copied().filter(|point| within(point.0));
        let nearest =
            |level_m: f64| inside().min_by(|a, b| (a.1 - mean_m - level_m).abs().total_cmp(&(b.1 - mean_m - level_m).abs()));
        crests.extend(nearest(wave.crest_m));
        troughs.extend(nearest(wave.trough_m));
    }
    Ok((crests, troughs))
}
