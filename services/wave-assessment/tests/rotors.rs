//! Ripples of the rig's own rotors are seen, and no water is called safe by them.
#![allow(clippy::unwrap_used, reason = "a test may fail")]

mod support;

use halcyon_model::{SeaState, SurfacePatch, VerdictState};
use halcyon_wave_assessment::Config;
use halcyon_wave_assessment::core::Assessor;
use support::{Camera, Sea};

/// Three metres of water by cells of 5 cm, with rings of 20 cm length and this amplitude a metre from the middle.
fn film(amplitude_m: f64) -> Vec<SurfacePatch> {
    let camera = Camera { rows: 60, cols: 60, cell_m: 0.05, sigma_m: 0.001, ..Camera::default() };
    let mut film = camera.film(&Sea::default(), 150);
    for (number, patch) in film.iter_mut().enumerate() {
        for (i, z_m) in patch.grid.elevation_m.iter_mut().enumerate() {
            let r_m = (0.05 * ((i / 60) as f64 - 29.5)).hypot(0.05 * ((i % 60) as f64 - 29.5));
            let phase_rad = std::f64::consts::TAU * r_m / 0.2 - 2.4 * number as f64;
            *z_m += (amplitude_m * phase_rad.cos() / r_m.max(0.1).sqrt()) as f32;
        }
    }
    film
}

fn rings(state: &SeaState) -> Option<bool> {
    state.quality.iter().find(|flag| flag.test == "downwash").map(|flag| flag.failed)
}

#[test]
fn ripples_are_seen_by_a_look_around_and_not_by_a_patch() {
    for (amplitude_m, expected) in [(0.01, Some(true)), (0.0, None)] {
        let mut assessor = Assessor::new(Config { window_s_min: 10.0, ..Config::default() }).unwrap();
        let film = film(amplitude_m);
        let (before, after) = film.split_at(120);
        for patch in before {
            if let Some(state) = assessor.observe(patch, patch.stamp).unwrap() {
                assert_eq!(rings(&state), None, "nothing was looked at");
            }
        }
        assessor.look_around();
        let states: Vec<SeaState> = after.iter().filter_map(|patch| assessor.observe(patch, patch.stamp).unwrap()).collect();
        assert!(states.len() >= 5);
        for state in states {
            assert_eq!(rings(&state), expected, "{:?}", state.quality);
            assert!(expected.is_none() || state.verdict.state == VerdictState::Inconclusive);
        }
    }
}
