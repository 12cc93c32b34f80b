use opencv::core::{CV_8UC1, Mat, MatTraitManual as _, Scalar};
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::core::matcher::{Engine, SgbmMode};
use crate::core::refine::{Every, Refined, Refiner};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
const RANGE: DisparityRange = DisparityRange { min_px: 0, max_px: 95 };

/// Smooth noise, the same wherever it is asked for: a value a lattice point, three pixels apart, blended.
fn texture(x: f64, y: f64) -> f64 {
    let value = |i: i64, j: i64| {
        let mut hash = (i.wrapping_mul(0x9E37_79B9_7F4A_7C15_u64 as i64) ^ j.wrapping_mul(0x2545_F491_4F6C_DD1D)) as u64;
        hash = (hash ^ (hash >> 29)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        ((hash ^ (hash >> 32)) & 0xFFFF) as f64 / 65_535.0
    };
    let (u, v) = (x / 3.0, y / 3.0);
    let (i, j) = (u.floor(), v.floor());
    let ease = |t: f64| t * t * (3.0 - 2.0 * t);
    let (s, t) = (ease(u - i), ease(v - j));
    let row = |j: i64| value(i as i64, j) * (1.0 - s) + value(i as i64 + 1, j) * s;
    40.0 + 150.0 * (row(j as i64) * (1.0 - t) + row(j as i64 + 1) * t)
}

fn picture(level: impl Fn(usize, usize) -> f64, seed: u64) -> Mat {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut mat = Mat::new_rows_cols_with_default(HEIGHT as i32, WIDTH as i32, CV_8UC1, Scalar::default()).unwrap();
    for (i, pixel) in mat.data_typed_mut::<u8>().unwrap().iter_mut().enumerate() {
        let noise: f64 = random.sample(rand_distr::StandardNormal);
        *pixel = (level(i % WIDTH, i / WIDTH) + 1.5 * noise).round().clamp(0.0, 255.0) as u8;
    }
    mat
}

/// A pair with a disparity that is known for each pixel of the left picture: the right one is painted with the texture, the left one
/// looks up where its pixel is there.
fn pair(truth: impl Fn(f64, f64) -> f64) -> (Mat, Mat) {
    let left = picture(|x, y| texture(x as f64 - truth(x as f64, y as f64), y as f64), 1);
    (left, picture(|x, y| texture(x as f64, y as f64), 2))
}

fn matcher() -> GuidedMatcher {
    GuidedMatcher::new(9, Engine::Sgbm(SgbmMode::FivePaths).matcher(5))
}

/// Shares of the pixels that both cameras see: matched, and, of these, off by more than a pixel.
#[track_caller]
fn judge(disparity: &Disparity, truth: impl Fn(f64, f64) -> f64) -> (f64, f64) {
    let (mut seen, mut matched, mut bad) = (0.0, 0.0, 0.0);
    for (i, value) in disparity.values_px.iter().enumerate() {
        let (x, y) = ((i % WIDTH) as f64, (i / WIDTH) as f64);
        let truth_px = truth(x, y);
        if x - truth_px >= 6.0 && x < WIDTH as f64 - 6.0 {
            seen += 1.0;
            matched += f64::from(u8::from(value.is_finite()));
            bad += f64::from(u8::from((f64::from(*value) - truth_px).abs() > 1.0));
        }
    }
    (matched / seen, bad / matched)
}

#[track_caller]
fn check(truth: impl Fn(f64, f64) -> f64 + Copy, guide: Option<DisparityPlane>, is_guided: bool) {
    let (left, right) = pair(truth);
    let (mut matcher, mut disparity) = (matcher(), Disparity::default());
    matcher.guide(guide);
    matcher.compute(&left, &right, RANGE, &mut disparity).unwrap();
    let (density, bad) = judge(&disparity, truth);
    assert!(density > 0.9 && bad < 0.01, "density {density}, bad {bad}");
    assert_eq!(matcher.was_guided(), is_guided);
}

#[test]
fn a_tilted_plane_needs_no_prior() {
    check(|x, y| 40.0 + 0.06 * (x - 160.0) - 0.09 * (y - 120.0), None, true);
}

#[test]
fn waves_about_a_known_plane() {
    let waves = |x: f64, y: f64| 30.0 + 0.05 * x + 3.0 * (x / 25.0).sin() * (y / 40.0).cos();
    check(waves, DisparityPlane::through_px([(0.0, 0.0, 30.0), (100.0, 0.0, 35.0), (0.0, 100.0, 30.0)]), true);
}

/// Waves of ±10 px leave the first range and are followed; nothing is clipped.
#[test]
fn steep_waves_widen_the_range() {
    check(|x, y| 45.0 + 10.0 * (x / 60.0).sin() + 0.02 * y, Some(DisparityPlane::level(45.0)), true);
}

#[test]
fn a_wrong_prior_is_found_out() {
    for wrong_px in [0.0, 12.0, 90.0, 400.0, -50.0] {
        check(|x, _| 40.0 + 0.02 * x, Some(DisparityPlane::level(wrong_px)), true);
    }
}

/// A boat, 25 px nearer than the water, over a tenth of the picture: it may be left out or found. After refinement, and with what its own
/// fit does not trust left out as the chain does, chance makes water of so few of its pixels that no cell of a grid is filled by them.
#[test]
fn what_sticks_out_is_not_clipped() {
    let boat = |x: f64, y: f64| if (130.0..210.0).contains(&x) && (80.0..170.0).contains(&y) { 55.0 } else { 30.0 };
    let (left, right) = pair(boat);
    let (mut matcher, mut disparity) = (matcher(), Disparity::default());
    matcher.guide(Some(DisparityPlane::level(30.0)));
    matcher.compute(&left, &right, RANGE, &mut disparity).unwrap();
    let exact = |grey: &Mat| {
        let mut exact = Mat::default();
        grey.convert_to(&mut exact, opencv::core::CV_32F, 1.0, 0.0).unwrap();
        exact
    };
    let mut refined = Refined::default();
    Refiner::new(11, 2, Every::Pixel).refine(&exact(&left), &exact(&right), &disparity, &mut refined).unwrap();
    let Refined { disparity, sigma_px, .. } = refined;
    let inside = |i: usize| (145..195).contains(&(i % WIDTH)) && (95..155).contains(&(i / WIDTH));
    let on_boat = disparity.values_px.iter().zip(&sigma_px).enumerate().filter(|(i, _)| inside(*i)).map(|(_, pixel)| pixel);
    let is_water = |px: f32, sigma_px: f32| (px - 30.0).abs() < 7.0 && sigma_px <= 0.5;
    let (water, all) = on_boat.fold((0, 0), |(water, all), (px, sigma)| (water + i32::from(is_water(*px, *sigma)), all + 1));
    assert!(f64::from(water) <= 0.15 * f64::from(all), "{water} of {all}: a cell is filled from 0.3 on");
}

/// Two planes, neither of them water: everything is searched, as without a guide.
#[test]
fn what_is_no_plane_goes_to_the_general_matcher() {
    let steps = |x: f64, y: f64| 8.0 + 20.0 * ((x / 80.0).floor() + (y / 80.0).floor()) % 80.0;
    let (left, right) = pair(steps);
    let (mut matcher, mut disparity) = (matcher(), Disparity::default());
    matcher.compute(&left, &right, RANGE, &mut disparity).unwrap();
    assert!(!matcher.was_guided());
    let mut general = Disparity::default();
    Engine::Sgbm(SgbmMode::FivePaths).matcher(5).compute(&left, &right, RANGE, &mut general).unwrap();
    let bits = |disparity: &Disparity| disparity.values_px.iter().map(|px| px.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&disparity), bits(&general));
}

#[test]
fn constant_and_unrelated_pictures_show_no_water() {
    let grey = picture(|_, _| 90.0, 5);
    let constant = Mat::new_rows_cols_with_default(240, 320, CV_8UC1, Scalar::all(77.0)).unwrap();
    let (one, _) = pair(|_, _| 30.0);
    let other = picture(|x, y| texture(x as f64 + 5e4, y as f64 - 7e4), 3);
    for (left, right) in [(&grey, &grey), (&constant, &constant), (&one, &other), (&constant, &one)] {
        for guide in [None, Some(DisparityPlane::level(30.0)), Some(DisparityPlane::level(f32::NAN))] {
            let (mut matcher, mut disparity) = (matcher(), Disparity::default());
            matcher.guide(guide);
            matcher.compute(left, right, RANGE, &mut disparity).unwrap();
            // The same noise twice is a match at 0, which is at infinity.
            let matched = disparity.values_px.iter().filter(|px| **px > 1.0).count();
            assert!((matched as f64) < 0.2 * disparity.values_px.len() as f64, "{matched}");
        }
    }
}

#[test]
fn threads_change_nothing() {
    let (left, right) = pair(|x, y| 30.0 + 4.0 * (x / 30.0).sin() + 0.03 * y);
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut disparity = Disparity::default();
        pool.install(|| matcher().compute(&left, &right, RANGE, &mut disparity)).unwrap();
        disparity.values_px.iter().map(|px| px.to_bits()).collect::<Vec<_>>()
    };
    assert!(with(1) == with(2) && with(1) == with(3));
}

#[test]
fn any_size_is_matched_or_refused() {
    for (width, height) in [(1, 1), (10, 10), (11, 40), (43, 22), (64, 10), (65, 129)] {
        let picture = Mat::new_rows_cols_with_default(height, width, CV_8UC1, Scalar::all(9.0)).unwrap();
        for max_px in [0, 3, 40] {
            let mut disparity = Disparity::default();
            let range = DisparityRange { min_px: 0, max_px };
            let guides = [None, Some(DisparityPlane::level(1.0)), Some(DisparityPlane::level(1e30))];
            for guide in guides {
                let mut matcher = matcher();
                matcher.guide(guide);
                if matcher.compute(&picture, &picture, range, &mut disparity).is_ok() {
                    assert_eq!(disparity.values_px.len(), (width * height) as usize);
                }
            }
        }
    }
}
