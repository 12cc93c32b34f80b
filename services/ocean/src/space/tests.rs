//! Tests of films and their spectra against closed forms.

use approx::assert_relative_eq;
use std::f64::consts::TAU;

use super::synthetic::{PlaneWave, elevations, film};
use super::*;
use crate::dispersion::Depth;

const SMALL: Shape = Shape { rows: 40, cols: 40, frames: 60 };

fn flat(shape: Shape) -> Vec<f32> {
    vec![0.0; shape.rows * shape.cols * shape.frames]
}

#[test]
fn what_is_no_film_is_refused() {
    let one = Shape { rows: 1, cols: 1, frames: 1 };
    assert!(matches!(Film::new(flat(one), one, 0.1, 5.0), Err(FilmError::TooSmall { .. })));
    let none = Shape { rows: 0, cols: 9, frames: 3 };
    assert!(matches!(Film::new(flat(none), none, 0.1, 5.0), Err(FilmError::TooSmall { .. })));
    let huge = Shape { rows: usize::MAX, cols: 2, frames: usize::MAX };
    assert!(matches!(Film::new(Vec::new(), huge, 0.1, 5.0), Err(FilmError::TooLarge { .. })));
    let large = Shape { rows: 1 << 14, cols: 1 << 14, frames: 1 };
    assert!(matches!(Film::new(Vec::new(), large, 0.1, 5.0), Err(FilmError::TooLarge { .. })));
    assert!(matches!(Film::new(vec![0.0; 5], SMALL, 0.1, 5.0), Err(FilmError::Shape { values: 5, .. })));
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(Film::new(flat(SMALL), SMALL, 0.1, bad), Err(FilmError::Rate { .. })));
        assert!(matches!(Film::new(flat(SMALL), SMALL, bad, 5.0), Err(FilmError::Cell { .. })));
    }
    for bad in [f32::INFINITY, -1e30] {
        let mut values = flat(SMALL);
        values[7] = bad;
        assert!(matches!(Film::new(values, SMALL, 0.1, 5.0), Err(FilmError::Elevation { index: 7, .. })));
    }
    let unseen = vec![f32::NAN; flat(SMALL).len()];
    assert!(matches!(Film::new(unseen.clone(), SMALL, 0.1, 5.0), Err(FilmError::Unseen { .. })));
    assert!(Film::with_unseen_at_most(1.0, unseen.clone(), SMALL, 0.1, 5.0).is_err());
    assert!(Film::with_unseen_at_most(f64::NAN, unseen, SMALL, 0.1, 5.0).is_err());
    // A fifth of the frames gone, which is less than a quarter of the cells, but more than is interpolated.
    let mut gone = flat(SMALL);
    gone[..12 * 1600].fill(f32::NAN);
    assert!(matches!(Film::new(gone, SMALL, 0.1, 5.0), Err(FilmError::Lost { lost: 12, .. })));
}

/// A plane is harmonic, and a plane that rises evenly is linear in time: holes in either are filled with what was there.
#[test]
fn holes_in_a_plane_are_filled_with_it() {
    let at = |i: usize| {
        let (t, row, col) = (i / 1600, i / 40 % 40, i % 40);
        (0.01 * t as f64 + 0.02 * row as f64 - 0.03 * col as f64) as f32
    };
    let all: Vec<f32> = (0..flat(SMALL).len()).map(at).collect();
    let mut holed = all.clone();
    for t in 0..SMALL.frames {
        for (row, col) in [(3, 3), (20, 20), (20, 21), (21, 20), (21, 21), (30, 7), (30, 8)] {
            holed[t * 1600 + row * 40 + col] = f32::NAN;
        }
    }
    // Two frames that are lost whole.
    holed[10 * 1600..12 * 1600].fill(f32::NAN);
    let film = Film::new(holed, SMALL, 0.1, 5.0).unwrap();
    for (found, expected) in film.elevation_m().iter().zip(&all) {
        assert!((found - expected).abs() < 1e-4, "{found} {expected}");
    }
    assert_relative_eq!(film.filled_share(), (58.0 * 7.0 + 3200.0) / 96_000.0, max_relative = 1e-12);
}

/// One wave that fits the film and the segment: a²/2, of which two thirds cubed is in its own cell, and the rest in those about it, where
/// its frequency, direction and wavenumber are.
#[test]
fn a_wave_is_where_it_should_be() {
    let shape = Shape { rows: 32, cols: 40, frames: 96 };
    let [dk_n, dk_e] = [TAU / 6.4, TAU / 8.0];
    for (north, east) in [(3.0, 4.0), (-3.0, 4.0), (3.0, -4.0), (-3.0, -4.0), (0.0, 5.0), (0.0, -5.0), (5.0, 0.0), (-5.0, 0.0)]
    {
        let wave = PlaneWave {
            amplitude_m: 0.2,
            k_north_radpm: north * dk_n,
            k_east_radpm: east * dk_e,
            omega_radps: TAU * 6.0 / 8.0,
            phase_rad: 1.0,
        };
        let spectrum = Welch3 { segment_frames: 32 }.spectrum(&film(&[wave], shape, 0.2, 4.0)).unwrap();
        assert_relative_eq!(spectrum.variance_m2(), 0.02, max_relative = 1e-5);
        let peak = spectrum.cells().max_by(|a, b| a.variance_m2.total_cmp(&b.variance_m2)).unwrap();
        assert_relative_eq!(peak.variance_m2, 0.02 * 8.0 / 27.0, max_relative = 1e-4);
        assert_relative_eq!(peak.k_north_radpm, wave.k_north_radpm, epsilon = 1e-9);
        assert_relative_eq!(peak.k_east_radpm, wave.k_east_radpm, epsilon = 1e-9);
        assert_relative_eq!(peak.f_hz, 0.75, max_relative = 1e-9);
    }
}

#[test]
fn segments_must_fit() {
    let film = film(&[PlaneWave::from(0.1, 0.5, 0.3, 0.0, Depth::DEEP)], SMALL, 0.1, 5.0);
    assert_eq!(Welch3 { segment_frames: 61 }.spectrum(&film), Err(SpaceError::TooShort { frames: 60, frames_min: 61 }));
    assert!(Welch3 { segment_frames: 0 }.spectrum(&film).is_err());
    assert_eq!(Welch3::with_segments_of_s(f64::NAN, &film).segment_frames, 8);
    assert_eq!(Welch3::with_segments_of_s(1e300, &film).segment_frames, 60);
    assert_eq!(film.elevation_m(), elevations(&[PlaneWave::from(0.1, 0.5, 0.3, 0.0, Depth::DEEP)], SMALL, 0.1, 5.0));
}
