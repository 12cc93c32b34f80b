//! The reference matcher on scenes that are known exactly: each method keeps the promise that it is made for.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

use halcyon_model::Image;
use halcyon_reconstruction::core::disparity::Disparity;
use halcyon_reconstruction::core::disparity::score::score;
use halcyon_reconstruction::core::matcher::{DisparityRange, Engine, MatchError, StudyMethod, match_images};
use halcyon_reconstruction::core::study::cost::Cost;
use halcyon_reconstruction::core::study::path::{Paths, Penalties};
use halcyon_reconstruction::core::study::window::Windows;
use halcyon_reconstruction::core::study::{Optimiser, ReferenceMatcher, Settings};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const WIDTH: usize = 200;
const HEIGHT: usize = 90;
const FAR_PX: usize = 4;
const NEAR_PX: usize = 12;
const RANGE: DisparityRange = DisparityRange { min_px: 0, max_px: 23 };
/// Where the near plane lies in the left picture.
const NEAR_X: std::ops::Range<usize> = 70..140;
const NEAR_Y: std::ops::Range<usize> = 25..65;

struct Scene {
    left: Image,
    right: Image,
    truth: Disparity,
}

fn image(pixels: Vec<u8>) -> Image {
    Image::new(WIDTH as u32, HEIGHT as u32, pixels.into()).unwrap()
}

/// A texture with detail of one and of several pixels, levels 0 to 120.
fn texture(seed: u64) -> Vec<u8> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (width, height) = (WIDTH + NEAR_PX, HEIGHT);
    let fine: Vec<f32> = (0..width * height).map(|_| random.random_range(0.0..60.0)).collect();
    let coarse: Vec<f32> = (0..width * height).map(|_| random.random_range(0.0..60.0)).collect();
    (0..width * height).map(|i| (fine[i] + coarse[i / width / 4 * width + i % width / 4]) as u8).collect()
}

/// A near rectangle before a far plane, both parallel to the cameras, and what the left camera alone sees is unknown.
fn two_planes() -> Scene {
    let (far, near) = (texture(1), texture(2));
    let at = |texture: &[u8], x: usize, y: usize| texture[y * (WIDTH + NEAR_PX) + x];
    let is_near = |x: usize, y: usize| NEAR_X.contains(&x) && NEAR_Y.contains(&y);
    let pixels = |of: &dyn Fn(usize, usize) -> u8| image((0..WIDTH * HEIGHT).map(|i| of(i % WIDTH, i / WIDTH)).collect());
    let left = pixels(&|x, y| at(if is_near(x, y) { &near } else { &far }, x, y));
    let right = pixels(&|x, y| {
        if is_near(x + NEAR_PX, y) { at(&near, x + NEAR_PX, y) } else { at(&far, x + FAR_PX, y) }
    });
    let truth = |i: usize| {
        let (x, y) = (i % WIDTH, i / WIDTH);
        match () {
            () if is_near(x, y) => NEAR_PX as f32,
            () if x < FAR_PX || is_near(x + NEAR_PX - FAR_PX, y) => f32::NAN,
            () => FAR_PX as f32,
        }
    };
    let truth =
        Disparity { width_px: WIDTH as u32, height_px: HEIGHT as u32, values_px: (0..WIDTH * HEIGHT).map(truth).collect() };
    Scene { left, right, truth }
}

fn changed(picture: &Image, change: impl Fn(u32) -> u32) -> Image {
    image(picture.pixels().iter().map(|grey| change(u32::from(*grey)) as u8).collect())
}

fn run(settings: Settings, left: &Image, right: &Image) -> Disparity {
    match_images(&mut ReferenceMatcher::new(settings), left, right, RANGE).unwrap()
}

fn settings(name: &str, window_px: u32) -> Settings {
    match name.parse().unwrap() {
        Engine::Study(method) => Settings::new(method, window_px),
        other => panic!("{other:?}"),
    }
}

/// The same, NaN included.
fn same(a: &Disparity, b: &Disparity) -> bool {
    a.values_px.iter().zip(&b.values_px).all(|(a, b)| a == b || (a.is_nan() && b.is_nan()))
}

#[test]
fn every_method_finds_two_planes() {
    let Scene { left, right, truth } = two_planes();
    for method in StudyMethod::ALL {
        let engine = Engine::Study(method);
        let disparity = run(Settings::new(method, engine.block_px_default()), &left, &right);
        let score = score(&disparity, &truth).unwrap();
        println!("{:11} density {:.3} bad1 {:.4}", engine.name(), score.density, score.bad1);
        assert!(score.density > 0.9 && score.bad1 < 0.05, "{} {score:?}", engine.name());
    }
}

/// Fusiello, Roberto and Trucco (1997): a window across an edge of depth sees two surfaces; one of nine sees one.
#[test]
fn nine_windows_keep_an_edge_sharper_than_one() {
    let Scene { left, right, truth } = two_planes();
    for name in ["wta-sad", "wta-ssd", "wta-census"] {
        let bad = |windows: Windows| {
            let settings = Settings { windows, left_right_px: None, ..settings(name, 11) };
            let disparity = run(settings, &left, &right);
            let near_edge = |i: usize| {
                let (x, y) = (i % WIDTH, i / WIDTH);
                let close = |a: usize, b: usize| a.abs_diff(b) <= 6;
                (close(x, NEAR_X.start) || close(x, NEAR_X.end)) && NEAR_Y.contains(&y)
                    || (close(y, NEAR_Y.start) || close(y, NEAR_Y.end)) && NEAR_X.contains(&x)
            };
            let pairs = disparity.values_px.iter().zip(&truth.values_px).enumerate();
            let pairs = pairs.filter(|(i, (_, truth))| near_edge(*i) && truth.is_finite());
            pairs.filter(|(_, (value, truth))| value.is_nan() || (*value - *truth).abs() > 1.0).count()
        };
        let (one, nine) = (bad(Windows::One), bad(Windows::Nine));
        println!("{name}: {one} bad pixels at the edges with one window, {nine} with nine");
        assert!(nine * 2 < one, "{name}: {nine} with nine, {one} with one");
    }
}

/// v + v²/120 grows strictly over 0 to 120: order is kept, and so are rank and census, bit by bit.
#[test]
fn rank_and_census_see_only_order() {
    let Scene { left, right, truth } = two_planes();
    let bent = changed(&right, |v| v + v * v / 120);
    assert!((0..120_u32).all(|v| v + v * v / 120 < v + 1 + (v + 1) * (v + 1) / 120));
    for name in ["wta-rank", "wta-census", "sgm-rank", "sgm-census"] {
        let settings = settings(name, 7);
        assert!(same(&run(settings, &left, &right), &run(settings, &left, &bent)), "{name}");
    }
    for name in ["wta-sad", "wta-ssd"] {
        let score = score(&run(Settings { left_right_px: None, ..settings(name, 7) }, &left, &bent), &truth).unwrap();
        assert!(score.bad1 > 0.3, "{name} should fail: {score:?}");
    }
    for name in ["wta-mi", "sgm-mi"] {
        let score = score(&run(settings(name, 7), &left, &bent), &truth).unwrap();
        assert!(score.density > 0.9 && score.bad1 < 0.05, "{name} {score:?}");
    }
}

#[test]
fn correlation_sees_neither_gain_nor_offset() {
    let Scene { left, right, truth } = two_planes();
    let brighter = changed(&right, |v| 2 * v + 10);
    for name in ["wta-ncc", "sgm-ncc"] {
        let (plain, gained) = (run(settings(name, 7), &left, &right), run(settings(name, 7), &left, &brighter));
        let pairs = plain.values_px.iter().zip(&gained.values_px);
        let differing = pairs.filter(|(a, b)| a.is_nan() != b.is_nan() || (*a - *b).abs() > 0.01).count();
        assert!(differing <= 20, "{name}: {differing} differ");
        assert!(score(&gained, &truth).unwrap().bad1 < 0.05);
    }
    let sad = score(&run(Settings { left_right_px: None, ..settings("wta-sad", 7) }, &left, &brighter), &truth).unwrap();
    assert!(sad.bad1 > 0.5, "SAD should fail: {sad:?}");
}

/// A quarter of a pixel: the right picture is sampled between the pixels of a smooth texture.
#[test]
fn a_parabola_finds_fractions_of_a_pixel() {
    let wave = |x: f64, y: f64| 128.0 + 60.0 * (0.45 * x + 0.2 * y).sin() + 50.0 * (0.3 * x - 0.37 * y + 1.0).sin();
    let sampled = |shift: f64| {
        image((0..WIDTH * HEIGHT).map(|i| wave((i % WIDTH) as f64 + shift, (i / WIDTH) as f64).round() as u8).collect())
    };
    let (left, right) = (sampled(0.0), sampled(7.25));
    let range = DisparityRange { min_px: 3, max_px: 12 };
    for name in ["wta-ssd", "wta-ncc", "sgm-ssd"] {
        for (sub_pixel, error_px) in [(true, 0.05), (false, 0.25)] {
            let settings = Settings { sub_pixel, ..settings(name, 9) };
            let disparity = match_images(&mut ReferenceMatcher::new(settings), &left, &right, range).unwrap();
            let mut values: Vec<f32> = disparity.values_px.iter().copied().filter(|value| value.is_finite()).collect();
            values.sort_by(f32::total_cmp);
            let median = values[values.len() / 2];
            assert!(values.len() > WIDTH * HEIGHT / 2 && (median - 7.25).abs() <= error_px, "{name} {median}");
        }
    }
}

#[test]
fn more_paths_and_adaptive_penalties_work() {
    let Scene { left, right, truth } = two_planes();
    let bad = |paths, adaptive| {
        let penalties = Penalties { adaptive, ..Cost::Census.penalties_default() };
        let settings = Settings { optimiser: Optimiser::SemiGlobal { paths, penalties }, ..settings("sgm-census", 1) };
        let score = score(&run(settings, &left, &right), &truth).unwrap();
        assert!(score.density > 0.9 && score.bad1 < 0.03, "{paths:?} {adaptive} {score:?}");
        score.bad1
    };
    for paths in [Paths::Four, Paths::Eight, Paths::Sixteen] {
        println!("{paths:?}: {:.4} {:.4}", bad(paths, false), bad(paths, true));
    }
}

#[test]
fn nothing_to_see_is_no_match() {
    let blank = image(vec![90; WIDTH * HEIGHT]);
    // Semi-global sums prefer the least disparity where nothing is to be seen: that is what fills holes.
    for method in StudyMethod::ALL.into_iter().filter(|method| !method.semi_global) {
        let disparity = run(Settings::new(method, 7), &blank, &blank);
        assert!(disparity.density() < 0.02, "{} {}", method.name(), disparity.density());
    }
}

#[test]
fn what_cannot_be_matched_is_refused() {
    let Scene { left, right, .. } = two_planes();
    let refused =
        |settings: Settings, range| match_images(&mut ReferenceMatcher::new(settings), &left, &right, range).unwrap_err();
    let good = settings("sgm-sad", 5);
    let none = DisparityRange { min_px: 9, max_px: 8 };
    assert!(matches!(refused(good, none), MatchError::Range { .. }));
    assert!(matches!(refused(good, DisparityRange { min_px: 0, max_px: 200 }), MatchError::Range { .. }));
    assert!(matches!(refused(Settings { window_px: 6, ..good }, RANGE), MatchError::Settings(_)));
    let small = Image::new(4, 4, vec![0; 16].into()).unwrap();
    let other = match_images(&mut ReferenceMatcher::new(good), &left, &small, RANGE);
    assert!(matches!(other, Err(MatchError::Sizes { .. })));
    let huge = Image::new(8000, 800, vec![0; 6_400_000].into()).unwrap();
    let range = DisparityRange { min_px: 0, max_px: 999 };
    let too_much = match_images(&mut ReferenceMatcher::new(good), &huge, &huge, range);
    assert!(matches!(too_much, Err(MatchError::Memory { .. })), "{too_much:?}");
}
