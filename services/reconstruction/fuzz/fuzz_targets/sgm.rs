//! Whatever sizes, strides and pixels are given to the semi-global matcher, it matches or refuses.
//! The tests of `core/sgm` run the same in small.

#![no_main]

use halcyon_reconstruction::core::sgm::{Paths, SemiGlobal, Settings, View};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: (u8, u8, u8, i16, u16, bool, &[u8])| {
    let (width, height, stride, min_px, count, eight, pixels) = input;
    let view = View { pixels, width: width.into(), height: height.into(), stride: stride.into() };
    let mut out = vec![0.0; view.width * view.height];
    let mut matcher = SemiGlobal::new(Settings::new(if eight { Paths::Eight } else { Paths::Four }));
    let _ = matcher.compute(view, view, min_px.into(), (count % 300).into(), &mut out);
});
