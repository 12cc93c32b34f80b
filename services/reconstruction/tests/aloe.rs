//! The aloe pair (Middlebury 2006, full size), whose disparity is known.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "tests fail by panicking and print what they measured"
)]

mod support;

use halcyon_model::Image;
use halcyon_reconstruction::core::disparity::Disparity;
use halcyon_reconstruction::core::matcher::{DisparityRange, Engine, match_images};
use halcyon_reconstruction::files::read_picture;
use support::samples;

struct Aloe {
    left: Image,
    right: Image,
    truth: Image,
}

fn aloe() -> Aloe {
    let read = |name: &str| read_picture(&samples().join(name)).unwrap();
    Aloe { left: read("aloeL.jpg"), right: read("aloeR.jpg"), truth: read("aloeGT.png") }
}

/// Middlebury scales its ground truth with the picture: 1, 1/2, 1/3 of a grey level a pixel. Which one this file has is
/// decided by the pictures themselves: the true disparity makes left and right look alike.
#[test]
fn a_grey_level_of_the_truth_is_a_pixel() {
    let aloe = aloe();
    let width = aloe.left.width_px() as usize;
    let difference = |scale: f64| {
        let (mut sum, mut count) = (0.0, 0_u32);
        for (i, truth) in aloe.truth.pixels().iter().enumerate().filter(|(_, truth)| **truth > 0) {
            let (row, x) = (i / width, i % width);
            let shift = (f64::from(*truth) * scale).round() as usize;
            if shift <= x {
                sum += (f64::from(aloe.left.pixels()[i]) - f64::from(aloe.right.pixels()[row * width + x - shift])).abs();
                count += 1;
            }
        }
        sum / f64::from(count)
    };
    let whole = difference(1.0);
    for wrong in [0.25, 1.0 / 3.0, 0.5, 0.97, 1.03] {
        assert!(whole < 0.8 * difference(wrong), "{whole} against {} at {wrong}", difference(wrong));
    }
}

/// Share of the matched pixels off by more than 2 px, and share of the pixels with a truth that were matched.
fn bad_and_density(disparity: &Disparity, truth: &Image) -> (f64, f64) {
    let (mut known, mut matched, mut bad) = (0.0, 0.0, 0.0);
    for (value, truth) in disparity.values_px.iter().zip(truth.pixels()).filter(|(_, truth)| **truth > 0) {
        known += 1.0;
        if value.is_finite() {
            matched += 1.0;
            bad += f64::from(u8::from((f64::from(*value) - f64::from(*truth)).abs() > 2.0));
        }
    }
    (bad / matched, matched / known)
}

#[track_caller]
fn check(engine: &str, bad_max: f64, density_min: f64) {
    let aloe = aloe();
    let engine: Engine = engine.parse().unwrap();
    let mut matcher = engine.matcher(engine.block_px_default());
    let disparity = match_images(matcher.as_mut(), &aloe.left, &aloe.right, DisparityRange { min_px: 0, max_px: 223 }).unwrap();
    let (bad, density) = bad_and_density(&disparity, &aloe.truth);
    println!("{}: {:.2} % off by more than 2 px, density {:.1} %", engine.name(), bad * 100.0, density * 100.0);
    assert!(bad <= bad_max && density >= density_min, "{}: bad {bad:.4}, density {density:.3}", engine.name());
}

#[test]
fn block_matching() {
    check("bm", 0.03, 0.65);
}

#[test]
fn semi_global_matching() {
    check("sgbm", 0.05, 0.8);
}

#[test]
fn semi_global_matching_along_three_paths() {
    check("sgbm-3way", 0.05, 0.8);
}
