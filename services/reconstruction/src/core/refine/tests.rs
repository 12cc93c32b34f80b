use std::f64::consts::TAU;

use opencv::core::{CV_32FC1, Mat, MatTraitManual as _, Scalar};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::*;

const WIDTH: usize = 200;
const HEIGHT: usize = 150;

/// A sum of waves 4 to 30 px long, exact at any place.
fn texture(x: f64, y: f64) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let mut level = 120.0;
    for _ in 0..24 {
        let number = TAU / random.random_range(4.0..30.0);
        let turn: f64 = random.random_range(0.0..TAU);
        level += 8.0 * (number * (turn.cos() * x + turn.sin() * y) + random.random_range(0.0..TAU)).sin();
    }
    level
}

fn picture(size: (usize, usize), level: impl Fn(f64, f64) -> f64 + Sync) -> Mat {
    let mut mat = Mat::new_rows_cols_with_default(size.1 as i32, size.0 as i32, CV_32FC1, Scalar::default()).unwrap();
    let values: Vec<f32> =
        (0..size.0 * size.1).into_par_iter().map(|i| level((i % size.0) as f64, (i / size.0) as f64) as f32).collect();
    mat.data_typed_mut::<f32>().unwrap().copy_from_slice(&values);
    mat
}

fn noisy(picture: &Mat, seed: u64) -> Mat {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut noisy = picture.clone();
    for value in noisy.data_typed_mut::<f32>().unwrap() {
        let noise: f32 = random.sample(rand_distr::StandardNormal);
        *value = (*value + 2.0 * noise).round();
    }
    noisy
}

fn map(value: impl Fn(usize, usize) -> f32) -> Disparity {
    let values_px = (0..WIDTH * HEIGHT).map(|i| value(i % WIDTH, i / WIDTH)).collect();
    Disparity { width_px: WIDTH as u32, height_px: HEIGHT as u32, values_px }
}

fn refined(left: &Mat, right: &Mat, start: &Disparity, every: Every) -> Refined {
    let mut refined = Refined::default();
    Refiner::new(11, 2, every).refine(left, right, start, &mut refined).unwrap();
    refined
}

/// The limits, on a pair shifted by 20.0 to 20.9 px with noise of 2 grey levels, from starts that are locked to whole pixels.
#[test]
fn known_shifts_are_found_without_pixel_locking() {
    let left = picture((WIDTH, HEIGHT), texture);
    for step in 0..10 {
        let shift_px = 20.0 + 0.1 * f64::from(step);
        let right = picture((WIDTH, HEIGHT), |x, y| 0.9 * texture(x + shift_px, y) + 7.0);
        let (left, right) = (noisy(&left, 1), noisy(&right, 2));
        for every in [Every::Pixel, Every::SecondPixel] {
            let refined = refined(&left, &right, &map(|_, _| shift_px.round() as f32), every);
            let (width, step) = (refined.disparity.width_px as usize, every.step_px());
            let (mut sum, mut squares, mut stated, mut count) = (0.0, 0.0, 0.0, 0.0);
            for (i, (value_px, sigma_px)) in refined.disparity.values_px.iter().zip(&refined.sigma_px).enumerate() {
                let (x, y) = (i % width * step, i / width * step);
                if (40..WIDTH - 10).contains(&x) && (10..HEIGHT - 10).contains(&y) {
                    let error_px = f64::from(*value_px) - shift_px;
                    (sum, squares, count) = (sum + error_px, squares + error_px * error_px, count + 1.0);
                    stated += f64::from(*sigma_px).powi(2);
                }
            }
            let (bias_px, rms_px) = (sum / count, f64::sqrt(squares / count));
            assert!(bias_px.abs() <= 0.02 && rms_px <= 0.1, "{every:?} {shift_px}: bias {bias_px}, RMS {rms_px}");
            let stated_px = f64::sqrt(stated / count);
            assert!((0.7..1.4).contains(&(stated_px / rms_px)), "{every:?} {shift_px}: states {stated_px}, is {rms_px}");
        }
    }
}

/// A slope and a wave, from starts with holes: what is between solved pixels is where it should be.
#[test]
fn every_second_pixel_tells_of_those_between() {
    let wave = |x: f64, y: f64| 12.0 + 0.05 * x - 0.03 * y + 0.8 * (TAU * x / 70.0).sin();
    let left = picture((WIDTH, HEIGHT), texture);
    // right(x − d(x)) = left(x): the place of a right pixel, by fixed-point iteration.
    let right = picture((WIDTH, HEIGHT), |x, y| {
        let at = (0..60).fold(x, |at, _| x + wave(at, y));
        texture(at, y)
    });
    let start = map(|x, y| if (x * 7 + y * 3) % 10 == 0 { f32::NAN } else { wave(x as f64, y as f64).round() as f32 });
    for every in [Every::Pixel, Every::SecondPixel] {
        let full = refined(&left, &right, &start, every).full(WIDTH as u32, HEIGHT as u32);
        assert_eq!(full.values_px.len(), WIDTH * HEIGHT);
        for y in 10..HEIGHT - 10 {
            for x in 60..WIDTH - 10 {
                // A window's disparity is the mean over it.
                let window = (0..121).map(|i| wave((x + i % 11) as f64 - 5.0, (y + i / 11) as f64 - 5.0));
                let expected = window.sum::<f64>() / 121.0;
                let value = f64::from(full.values_px[y * WIDTH + x]);
                assert!((value - expected).abs() < 0.05, "{every:?} {x} {y}: {value} for {expected}");
            }
        }
    }
}

#[test]
fn holes_stay_or_are_filled_and_flat_water_is_not_measured() {
    let left = picture((WIDTH, HEIGHT), |x, y| if x < 120.0 { texture(x, y) } else { 90.0 });
    let right = picture((WIDTH, HEIGHT), |x, y| if x + 8.3 < 120.0 { texture(x + 8.3, y) } else { 90.0 });
    // One pixel in nine is missing at the top, all of them at the bottom.
    let hole = |x: usize, y: usize| y >= 100 || (x.is_multiple_of(3) && y.is_multiple_of(3));
    let start = map(|x, y| if hole(x, y) { f32::NAN } else { 8.0 });
    for every in [Every::Pixel, Every::SecondPixel] {
        let refined = refined(&left, &right, &start, every);
        let full = refined.full(WIDTH as u32, HEIGHT as u32);
        let at = |x: usize, y: usize| full.values_px[y * WIDTH + x];
        assert!((at(60, 60) - 8.3).abs() < 0.02 && (at(61, 61) - 8.3).abs() < 0.02);
        assert!(at(60, 130).is_nan() && at(170, 50).is_nan());
        for (value, sigma) in refined.disparity.values_px.iter().zip(&refined.sigma_px) {
            assert_eq!(value.is_nan(), sigma.is_nan());
        }
    }
}

#[test]
fn threads_change_nothing() {
    let left = noisy(&picture((WIDTH, HEIGHT), texture), 3);
    let right = noisy(&picture((WIDTH, HEIGHT), |x, y| texture(x + 5.0 + 0.4 * (0.1 * x).sin(), y)), 4);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let start = map(|x, y| if (x + y) % 11 == 0 { f32::NAN } else { 5.0 });
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        [Every::Pixel, Every::SecondPixel].map(|every| {
            let refined = pool.install(|| refined(&left, &right, &start, every));
            (bits(&refined.disparity.values_px), bits(&refined.sigma_px))
        })
    };
    assert!(with(1) == with(2) && with(1) == with(3));
}

#[test]
fn odd_sizes_and_nonsense_do_not_panic() {
    for (width, height) in [(1, 1), (2, 3), (12, 1), (1, 40), (7, 130)] {
        let flat = picture((width, height), |_, _| 3.0);
        let wild = picture((width, height), |x, _| if (x as usize).is_multiple_of(2) { f64::NAN } else { f64::INFINITY });
        for (left, right) in [(&flat, &flat), (&flat, &wild), (&wild, &wild)] {
            for value in [0.0, f32::NAN, f32::INFINITY, -1e30, 1e30] {
                let values_px = vec![value; width * height];
                let start = Disparity { width_px: width as u32, height_px: height as u32, values_px };
                for every in [Every::Pixel, Every::SecondPixel] {
                    assert_eq!(
                        refined(left, right, &start, every).full(width as u32, height as u32).values_px.len(),
                        width * height
                    );
                }
            }
        }
    }
    let (small, mut to) = (picture((3, 3), |_, _| 0.0), Refined::default());
    assert!(Refiner::new(11, 2, Every::Pixel).refine(&small, &Mat::default(), &map(|_, _| 1.0), &mut to).is_err());
}
