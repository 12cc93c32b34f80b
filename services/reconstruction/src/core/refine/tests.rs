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

/// The limits, on a pair shifted by 20.0 to 20.9 px with noise of 2 grey levels, from starts that are locked to whole pixels.
#[test]
fn known_shifts_are_found_without_pixel_locking() {
    let left = picture((WIDTH, HEIGHT), texture);
    for step in 0..10 {
        let shift_px = 20.0 + 0.1 * f64::from(step);
        let right = picture((WIDTH, HEIGHT), |x, y| 0.9 * texture(x + shift_px, y) + 7.0);
        let mut disparity = map(|_, _| shift_px.round() as f32);
        let mut sigma_px = Vec::new();
        Refiner::new(11, 2).refine(&noisy(&left, 1), &noisy(&right, 2), &mut disparity, &mut sigma_px).unwrap();
        let (mut sum, mut squares, mut stated, mut count) = (0.0, 0.0, 0.0, 0.0);
        for y in 10..HEIGHT - 10 {
            for x in 40..WIDTH - 10 {
                let error_px = f64::from(disparity.values_px[y * WIDTH + x]) - shift_px;
                (sum, squares, count) = (sum + error_px, squares + error_px * error_px, count + 1.0);
                stated += f64::from(sigma_px[y * WIDTH + x]).powi(2);
            }
        }
        let (bias_px, rms_px) = (sum / count, f64::sqrt(squares / count));
        assert!(bias_px.abs() <= 0.02 && rms_px <= 0.1, "{shift_px}: bias {bias_px}, RMS {rms_px}");
        let stated_px = f64::sqrt(stated / count);
        assert!((0.7..1.4).contains(&(stated_px / rms_px)), "{shift_px}: states {stated_px}, is {rms_px}");
    }
}

#[test]
fn holes_stay_or_are_filled_and_flat_water_is_not_measured() {
    let left = picture((WIDTH, HEIGHT), |x, y| if x < 120.0 { texture(x, y) } else { 90.0 });
    let right = picture((WIDTH, HEIGHT), |x, y| if x + 8.3 < 120.0 { texture(x + 8.3, y) } else { 90.0 });
    // One pixel in nine is missing at the top, all of them at the bottom.
    let hole = |x: usize, y: usize| y >= 100 || (x.is_multiple_of(3) && y.is_multiple_of(3));
    let mut disparity = map(|x, y| if hole(x, y) { f32::NAN } else { 8.0 });
    let mut sigma_px = Vec::new();
    Refiner::new(11, 2).refine(&left, &right, &mut disparity, &mut sigma_px).unwrap();
    let at = |x: usize, y: usize| disparity.values_px[y * WIDTH + x];
    assert!((at(60, 60) - 8.3).abs() < 0.02 && (at(61, 61) - 8.3).abs() < 0.02);
    assert!(at(60, 130).is_nan() && at(170, 50).is_nan());
    for (value, sigma) in disparity.values_px.iter().zip(&sigma_px) {
        assert_eq!(value.is_nan(), sigma.is_nan());
    }
}

#[test]
fn threads_change_nothing() {
    let left = noisy(&picture((WIDTH, HEIGHT), texture), 3);
    let right = noisy(&picture((WIDTH, HEIGHT), |x, y| texture(x + 5.0 + 0.4 * (0.1 * x).sin(), y)), 4);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let (mut disparity, mut sigma_px) = (map(|x, y| if (x + y) % 11 == 0 { f32::NAN } else { 5.0 }), Vec::new());
        pool.install(|| Refiner::new(11, 2).refine(&left, &right, &mut disparity, &mut sigma_px)).unwrap();
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        (bits(&disparity.values_px), bits(&sigma_px))
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
                let mut disparity = Disparity { width_px: width as u32, height_px: height as u32, values_px };
                Refiner::new(11, 2).refine(left, right, &mut disparity, &mut Vec::new()).unwrap();
            }
        }
    }
    let mut disparity = map(|_, _| 1.0);
    assert!(
        Refiner::new(11, 2).refine(&picture((3, 3), |_, _| 0.0), &Mat::default(), &mut disparity, &mut Vec::new()).is_err()
    );
}
