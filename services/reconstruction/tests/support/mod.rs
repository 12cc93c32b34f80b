//! What several tests need: the sample pictures.

#![allow(dead_code, reason = "each test uses its part")]

pub(crate) mod png;
pub(crate) mod scene;

use std::path::PathBuf;

use halcyon_model::Image;
use halcyon_reconstruction::files::read_picture;

/// Where `make samples` puts OpenCV's sample pictures.
pub(crate) fn samples() -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../samples");
    assert!(folder.join("left01.jpg").exists(), "{} has no sample pictures: run `make samples` first", folder.display());
    folder
}

/// The 13 checkerboard pairs (there is no number 10).
pub(crate) fn sample_pairs() -> Vec<(Image, Image)> {
    let read = |side: &str, i: u32| read_picture(&samples().join(format!("{side}{i:02}.jpg"))).unwrap();
    (1..=14).filter(|i| *i != 10).map(|i| (read("left", i), read("right", i))).collect()
}
