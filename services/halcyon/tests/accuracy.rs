//! The measurement chain at the figures that it promises, with margins: small pictures and few pairs, so that it ends in a minute.
//! `halcyon bench --accuracy` runs all of it.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests fail by panicking and print what they measured")]

use halcyon::accuracy::{Flight, TankErrors, TankRun, fly, honesty, plane, still_water, tank};

/// Thesis: 8.8, 10.8 and 25.2 mm; wanted: 1 mm, and no worse with a longer baseline.
#[test]
fn a_plane_at_half_a_metre() {
    let [first_m, second_m, third_m] = [0.092, 0.12, 0.15].map(|baseline_m| plane(baseline_m, 3).unwrap().rmse_m);
    println!("{first_m} {second_m} {third_m}");
    assert!(first_m < 0.7e-3 && second_m < 1.05 * first_m && third_m < 1.05 * first_m);
}

/// Thesis: 2.3 mm; wanted: 0.3 mm.
#[test]
fn still_water_has_no_waves() {
    let still = still_water(0.99, 40, 12).unwrap();
    println!("{} {}", still.h_mean_of_levels_m, still.h_mean_m);
    // Raw, and so above nothing; and what the chain makes of it.
    assert!(still.h_mean_of_levels_m > 0.0 && still.h_mean_of_levels_m < 0.25e-3, "{}", still.h_mean_of_levels_m);
    assert!(still.h_mean_m < 0.25e-3, "{}", still.h_mean_m);
}

/// Thesis: 4.0 mm, 7.8 mm, R² 0.93; wanted: 0.5 mm, 1.0 mm, 0.01 Hz, 0.995.
#[test]
fn the_wave_tank() {
    let errors = TankErrors::of(&tank(&TankRun::quick()).unwrap());
    println!("{errors:?}");
    assert!(errors.h_mean_m < 0.4e-3 && errors.h_s_m < 0.9e-3, "{errors:?}");
    assert!(errors.peak_hz < 0.008 && errors.amplitude_m < 0.2e-3, "{errors:?}");
}

/// Thesis: 7.5 mm and 11.6 mm, means over its repetitions; wanted: 2 mm and 3 mm. And whatever the error, the interval says so.
#[test]
fn from_the_air() {
    let errors: Vec<_> = Flight::all().iter().map(|flight| (flight.name, fly(flight).unwrap().errors)).collect();
    let mean_m = |of: &dyn Fn(usize) -> f64| (0..errors.len()).map(of).sum::<f64>() / errors.len() as f64;
    let h_mean_m = mean_m(&|i| errors[i].1.h_mean_m.abs());
    let h_s_m = mean_m(&|i| errors[i].1.h_s_m.abs());
    println!("{h_mean_m} {h_s_m} {errors:?}");
    assert!(h_mean_m < 1.9e-3 && h_s_m < 2.8e-3, "{h_mean_m} {h_s_m}");
    // Each holds with 95 %, eight in a row with 66 %: one miss is no lie.
    let missed: Vec<_> = errors.iter().filter(|(_, errors)| !errors.h_s_held).map(|(name, _)| name).collect();
    assert!(missed.len() <= 1, "{missed:?}");
}

/// 68 % within one stated deviation, 95 % within two: wanted within 3 and 2 % of the whole, over every kind of picture.
#[test]
fn cells_are_as_uncertain_as_they_say() {
    let honest = honesty(36).unwrap();
    println!("{honest:?}");
    assert!((0.65..0.71).contains(&honest.within_one) && (0.93..0.97).contains(&honest.within_two), "{honest:?}");
}
