#![allow(clippy::unwrap_used, reason = "a test may fail")]

use super::*;
use halcyon_model::RigId;

fn rig() -> RigId {
    RigId::new("leader-1").unwrap()
}

/// The film's variance, mean period and slope, averaged over seas, are the truth's.
#[test]
fn films_show_the_sea_that_is_meant() {
    let sea = Sea(vec![System::wind_sea(0.1, 1.3), System { spread: 40.0, towards_rad: 2.0, ..System::wind_sea(0.06, 2.5) }]);
    // Cells as far apart as the slope's baseline, and no noise.
    let camera = Camera { rows: 9, cols: 9, cell_m: 0.4, sigma_m: 0.0, level_sigma_m: 0.0, rate_hz: 10.0, ..Camera::default() };
    let truth = Truth::of(&sea, camera.cell_m);
    let (mut m0, mut m2, mut slope, mut seen) = (0.0, 0.0, 0.0, 0.0);
    for seed in 0..80 {
        let film = camera.film(&sea, 1000, &rig(), seed);
        let at = |frame: usize, cell: usize| f64::from(film[frame].grid.elevation_m[cell]) + film[frame].level_m.unwrap();
        for frame in 1..film.len() - 1 {
            for cell in [0, 5, 30, 42] {
                let z = at(frame, cell);
                m0 += z * z;
                // Second differences: −ω² z, less the sine's share of a step.
                m2 += -z * (at(frame - 1, cell) - 2.0 * z + at(frame + 1, cell)) * camera.rate_hz.powi(2);
                slope += ((at(frame, cell + 1) - z).powi(2) + (at(frame, cell + 9) - z).powi(2)) / camera.cell_m.powi(2);
                seen += 1.0;
            }
        }
    }
    let omega2 = m2 / m0;
    // Waves of 3 s⁻¹ and more are seen 4 % slow at 10 Hz.
    let t_z_s = std::f64::consts::TAU / omega2.sqrt();
    assert!(((m0 / seen).sqrt() / truth.sigma_m - 1.0).abs() < 0.02, "{} for {}", (m0 / seen).sqrt(), truth.sigma_m);
    assert!((t_z_s / truth.t_z_s - 1.0).abs() < 0.05, "{t_z_s} for {}", truth.t_z_s);
    assert!(((slope / seen).sqrt() / truth.slope_rms - 1.0).abs() < 0.02, "{} for {}", (slope / seen).sqrt(), truth.slope_rms);
}

/// A crest moves the way it should: from one cell to the next in the time that a wave of its period takes.
#[test]
fn waves_travel_the_way_they_point() {
    let north = System { peakedness: 50.0, spread: 2000.0, towards_rad: 0.0, ..System::wind_sea(0.1, 1.6) };
    let camera = Camera { rows: 2, cols: 2, cell_m: 1.0, sigma_m: 0.0, level_sigma_m: 0.0, rate_hz: 10.0, ..Camera::default() };
    let film = camera.film(&Sea(vec![north]), 400, &rig(), 3);
    let at = |frame: usize, cell: usize| f64::from(film[frame].grid.elevation_m[cell]) + film[frame].level_m.unwrap();
    // A wave of 1.6 s is 4 m long and runs a metre in 0.4 s, four frames.
    let agreement = |lag: i64| -> f64 { (10..390).map(|i| at(i, 0) * at((i as i64 + lag) as usize, 2)).sum() };
    // And the other way it is half a period off.
    assert!(agreement(4) > 0.0 && agreement(-4) < -0.5 * agreement(4), "{} {}", agreement(4), agreement(-4));
    let across: f64 = (10..390).map(|i| (at(i, 0) - at(i, 1)).powi(2)).sum();
    assert!(across < 0.02 * agreement(4), "crests lie across");
}

/// What goes missing does.
#[test]
fn frames_and_cells_are_lost() {
    let camera = Camera { frames_lost: 0.3, cells_lost: 0.2, ..Camera::default() };
    let film = camera.film(&Sea(vec![System::wind_sea(0.05, 1.3)]), 600, &rig(), 1);
    assert!((370..470).contains(&film.len()), "{}", film.len());
    let cells: usize = film.iter().map(|patch| patch.grid.elevation_m.len()).sum();
    let unseen: usize = film.iter().map(|patch| patch.grid.elevation_m.iter().filter(|z| z.is_nan()).count()).sum();
    assert!((unseen as f64 / cells as f64 - 0.2).abs() < 0.01);
}

#[test]
fn severity_is_the_share_of_the_limit() {
    let config = crate::Config::default();
    let unit = Truth::of(&Sea(vec![System::wind_sea(1.0, 2.0)]), config.slope_baseline_m);
    assert!((4.0 * unit.sigma_m - 1.0).abs() < 1e-9);
    let truth = unit.scaled(unit.scale_of_severity(0.8, &config));
    assert!((truth.severity(&config) - 0.8).abs() < 1e-6);
    // Waves of 2 s reach the limit of H_s first.
    assert!((4.0 * truth.sigma_m / config.h_s_m_max - 0.8).abs() < 1e-6);
    // The largest of one Rayleigh amplitude is its mean, √(π/2).
    assert!((sea::rayleigh_largest(1.0) - (0.5 * std::f64::consts::PI).sqrt()).abs() < 1e-4);
}

#[test]
fn a_tally_counts_and_scores() {
    let one = |severity: f64, probability: f64, state| Drawn {
        severity,
        state,
        safe_s: (state == halcyon_model::VerdictState::Safe).then_some(30.0),
        probability,
        measured: [[1.0; 3]; 3],
        failed: vec!["slope".into()],
    };
    let mut tally = Tally::default();
    tally.add(&one(0.9, 0.8, halcyon_model::VerdictState::Safe));
    tally.add(&one(1.1, 0.4, halcyon_model::VerdictState::Safe));
    tally.add(&one(0.7, 1.0, halcyon_model::VerdictState::Unsafe));
    assert_eq!((tally.seas, tally.wrong, tally.wrong_ever, tally.unfounded, tally.safe), (3, 1, 1, 1, 2));
    // (0.2² + 0.4² + 0²)/3.
    assert!((tally.brier() - 0.2 / 3.0).abs() < 1e-12);
    assert_eq!(tally.reliability(), [[1.0, 0.4, 0.0], [1.0, 0.8, 1.0], [1.0, 1.0, 1.0]]);
    assert_eq!(tally.failed["slope"], 3);
}
