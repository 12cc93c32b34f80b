//! How long the spectrum of a large film takes: `cargo test --release -p halcyon-ocean --test film_speed -- --ignored --nocapture`.

use std::time::Instant;

use halcyon_ocean::Depth;
use halcyon_ocean::space::{Array, Film, Removed, Shape, Shell, Water, Welch3};

#[test]
#[ignore = "a measurement, for release builds"]
fn a_large_film_takes_two_seconds() {
    let shape = Shape { rows: 200, cols: 200, frames: 600 };
    // One wave: what is in a film changes nothing of what its transforms take.
    let at = |i: usize| {
        let (t, row, col) = (i / 40_000, i / 200 % 200, i % 200);
        (0.05 * (0.14 * row as f64 + 0.1 * col as f64 - 0.4 * t as f64).sin()) as f32
    };
    let elevation_m: Vec<f32> = (0..200 * 200 * 600).map(at).collect();
    let start = Instant::now();
    let film = Film::new(elevation_m, shape, 0.1, 10.0).unwrap();
    println!("checked {:?}", start.elapsed());
    for segment_frames in [128, 300, 600] {
        let start = Instant::now();
        let spectrum = Welch3 { segment_frames }.spectrum(&film).unwrap();
        let transformed = start.elapsed();
        let water = Water::still(Depth::DEEP);
        let (spectrum, share) = spectrum.on_shell(&Shell::new(water));
        let found = spectrum.statistics(&water).unwrap();
        let all = start.elapsed();
        println!("segments of {segment_frames}: spectrum {transformed:?}, with filter and statistics {all:?}");
        println!("  {found:.3?} {share:.3?}");
    }
    let start = Instant::now();
    let array = Array::new(Removed::Plane, 240, (0.3, 1.5));
    assert!(array.spectrum(&film, &Water::DEEP).is_ok());
    println!("array of 16 gauges {:?}", start.elapsed());
}
