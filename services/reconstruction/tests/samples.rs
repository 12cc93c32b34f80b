//! OpenCV's own sample checkerboards: real pictures, with a published result.

#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stdout, reason = "tests fail by panicking and print what they measured")]

mod support;

use halcyon_reconstruction::core::calibrate::{BoardSpec, calibrate_with};
use support::sample_pairs;

#[test]
fn the_sample_checkerboards_calibrate_to_the_good_minimum() {
    let pairs = sample_pairs();
    let t = std::time::Instant::now();
    let calibration = calibrate_with(&pairs, BoardSpec::new(9, 6, 0.025).unwrap(), &mut |d, n| { if d==n {println!("corners {:?}", t.elapsed())} }).unwrap();
    println!("{:?} {calibration:#?}", t.elapsed());
}
