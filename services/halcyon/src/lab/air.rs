//! From the air: figures 7-6 … 7-8, tables 7-1 and 7-2.

use halcyon_ocean::outlier::replace_beyond;
use halcyon_reconstruction::cli;
use halcyon_reconstruction::core::mesh;
use halcyon_reconstruction::core::reconstruct::{Reconstructor, Settings};
use halcyon_reconstruction::files::ply;

use super::context::{Lab, LabError};
use super::exhibit::{Exhibit, File};
use super::flat::crests_and_troughs;
use crate::accuracy::{Flight, Flown, fly};
use crate::report::{Chart, HeatMap, Series};

const MM: f64 = 1e3;
/// Every so many readings of figure 7-7 one is made wild, as sky reflections made the thesis's.
const WILD_EVERY: usize = 29;
const WILD_M: f64 = 0.5;

pub(super) fn run(lab: &Lab) -> Result<Exhibit, LabError> {
    let mut exhibit = Exhibit::default();
    exhibit.text(
        "A hover with an ordinary autopilot: attitude good to 0.2 degrees, height to 1 cm, drifting by 5 cm; 58 s at two pairs a second, as in \
         the thesis. It compared with cameras on a tripod, we compare with the water that was simulated.",
    );
    let all = Flight::all();
    // Quick: one flight of each height.
    let flights: Vec<&Flight> =
        all.iter().enumerate().filter(|(i, _)| lab.choose(true, i % 4 == 2)).map(|(_, flight)| flight).collect();
    let (mut rows_mean, mut rows_s, mut errors) = (Vec::new(), Vec::new(), [0.0; 4]);
    let mut shown = None;
    for flight in &flights {
        let flown = fly(flight)?;
        let e = flown.errors;
        let row = |truth_m: f64, error_m: f64| {
            vec![
                flight.name.to_owned(),
                format!("{:.2}", MM * truth_m),
                format!("{:.2}", MM * (truth_m + error_m)),
                format!("{:.2}", MM * error_m.abs()),
            ]
        };
        rows_mean.push(row(e.true_h_mean_m, e.h_mean_m));
        let mut row_s = row(e.true_h_s_m, e.h_s_m);
        row_s.push(format!("{:.2}", MM * e.thesis_h_s_m.abs()));
        row_s.push(format!("{:.2}", MM * e.rotated_h_s_m.abs()));
        rows_s.push(row_s);
        for (sum, error_m) in errors.iter_mut().zip([e.h_mean_m, e.h_s_m, e.thesis_h_s_m, e.rotated_h_s_m]) {
            *sum += MM * error_m.abs() / flights.len() as f64;
        }
        shown = Some((*flight, flown));
    }
    exhibit.table(vec!["Table 7-1: H_m, mm", "true", "airborne", "|error|"], rows_mean);
    exhibit.table(
        vec!["Table 7-2: H_s, mm", "true", "airborne", "|error|", "by (7-1) alone", "by rotation of every point alone"],
        rows_s,
    );
    exhibit.find("mean |error| of H_m", "mm", errors[0], Some(7.5));
    exhibit.find("mean |error| of H_s", "mm", errors[1], Some(11.6));
    exhibit.find("mean |error| of H_s by the thesis's correction (7-1) alone", "mm", errors[2], None);
    exhibit.find("mean |error| of H_s by rotation of every point alone", "mm", errors[3], None);
    if let Some((flight, flown)) = shown {
        surface(&mut exhibit, flight, &flown)?;
        series(&mut exhibit, flight, &flown)?;
    }
    Ok(exhibit)
}

/// Figure 7-6.
fn surface(exhibit: &mut Exhibit, flight: &Flight, flown: &Flown) -> Result<(), LabError> {
    let (pair, patch) = &flown.last;
    let grid = &patch.grid;
    let side = |start_m: f64, cells: u32| (start_m, start_m + f64::from(cells) * grid.cell_m);
    let heights_mm = grid.elevation_m.iter().map(|elevation_m| MM * f64::from(*elevation_m)).collect();
    let (x, y) = (side(grid.south_west_east_m, grid.cols), side(grid.south_west_north_m, grid.rows));
    let map = HeatMap::new(grid.cols as usize, heights_mm, x, y).labelled("east, m", "north, m", "elevation, mm");
    exhibit.chart(map.svg(), format!("Figure 7-6: the surface, {}", flight.name))?;
    exhibit.find("points of a pair (figure 7-6)", "1", f64::from(patch.points), Some(21_000.0));
    let mut chain = Reconstructor::new(Settings { cell_m: flight.cell_m, ..Settings::default() });
    if let Ok(patch) = chain.reconstruct(pair)
        && let Ok(cloud) = cli::cloud_of(&chain, pair, &patch)
    {
        exhibit.cloud("water", &cloud);
        let bytes = ply::encode_mesh(&mesh::of_cloud(&cloud));
        exhibit.files.push(File { name: "water-mesh.ply".into(), bytes });
    }
    Ok(())
}

/// Figures 7-7 and 7-8.
fn series(exhibit: &mut Exhibit, flight: &Flight, flown: &Flown) -> Result<(), LabError> {
    let mut levels_m: Vec<f64> = flown.levels_thesis.iter().map(|point| point.1).collect();
    for (i, level_m) in levels_m.iter_mut().enumerate() {
        if i % WILD_EVERY == WILD_EVERY / 2 {
            *level_m += WILD_M;
        }
    }
    let at =
        |values_m: &[f64]| flown.levels_thesis.iter().zip(values_m).map(|((t_s, _), m)| (*t_s, MM * m)).collect::<Vec<_>>();
    let raw = at(&levels_m);
    let found = replace_beyond(&mut levels_m, 3.0);
    let wild = (0..levels_m.len()).filter(|i| i % WILD_EVERY == WILD_EVERY / 2).count();
    let put_in = found.iter().filter(|i| *i % WILD_EVERY == WILD_EVERY / 2).count();
    exhibit.find("wild readings found, of those put in", "%", 100.0 * put_in as f64 / wild.max(1) as f64, None);
    exhibit.find("honest readings taken for wild", "1", (found.len() - put_in) as f64, None);
    let chart = Chart::new("time, s", "elevation, mm")
        .with(Series::line("mean level of each pair by (7-1), wild readings put in", raw))
        .with(Series::points("beyond three deviations replaced by the neighbour", at(&levels_m)));
    exhibit.chart(chart.svg(), "Figure 7-7: outliers")?;
    let rate_hz = flight.rate_hz;
    let (crests, troughs) = crests_and_troughs(&flown.trace, rate_hz)?;
    let in_mm = |points: &[(f64, f64)]| points.iter().map(|(t_s, m)| (*t_s, MM * m)).collect::<Vec<_>>();
    let chart = Chart::new("time, s", "elevation, mm")
        .with(Series::line("", in_mm(&flown.trace)))
        .with(Series::points("crests", in_mm(&crests)))
        .with(Series::points("troughs", in_mm(&troughs)));
    exhibit.chart(chart.svg(), format!("Figure 7-8: water surface from the air, {}", flight.name))?;
    Ok(())
}
