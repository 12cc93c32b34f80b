use proptest::prelude::*;

use super::*;

/// Texture that both pictures share, shifted, with noise of their own: some of it matches and some does not.
fn pair(width: usize, height: usize, stride: usize, shift: usize, levels: u8, seed: u64) -> (Vec<u8>, Vec<u8>) {
    let mut state = seed | 1;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as u8
    };
    let texture: Vec<u8> = (0..(width + shift) * height).map(|_| random() % levels.max(1)).collect();
    let mut picture = |from: usize| {
        let mut pixels = vec![0; stride * height];
        for y in 0..height {
            for x in 0..width {
                pixels[y * stride + x] = texture[y * (width + shift) + x + from].wrapping_add(random() % 2);
            }
        }
        pixels
    };
    (picture(0), picture(shift))
}

fn view(pixels: &[u8], width: usize, height: usize, stride: usize) -> View<'_> {
    View { pixels, width, height, stride }
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| if value.is_nan() { u32::MAX } else { value.to_bits() }).collect()
}

fn run(settings: Settings, left: View<'_>, right: View<'_>, min_px: i32, count: u32) -> Vec<u32> {
    let mut out = vec![7.0; left.width * left.height];
    SemiGlobal::new(settings).compute(left, right, min_px, count, &mut out).unwrap();
    bits(&out)
}

fn paths() -> impl Strategy<Value = Paths> {
    prop_oneof![Just(Paths::Four), Just(Paths::Eight)]
}

fn census() -> impl Strategy<Value = Census> {
    prop_oneof![Just(Census::Five), Just(Census::Seven), Just(Census::NineSymmetric)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Any size, stride, range, number of grey levels (one makes a picture constant): the formulas say the same, bit for bit.
    #[test]
    fn the_formulas_say_the_same(
        (width, height, spare) in (1_usize..50, 1_usize..150, 0_usize..5),
        (min_px, count) in (-20_i32..20, 1_u32..40),
        (levels, shift, seed) in (1_u8..=255, 0_usize..12, any::<u64>()),
        (paths, census, p1, p2) in (paths(), census(), 0_u8..30, 0_u8..120),
    ) {
        let stride = width + spare;
        let (left, right) = pair(width, height, stride, shift, levels, seed);
        let (left, right) = (view(&left, width, height, stride), view(&right, width, height, stride));
        let settings = Settings {
            census, p1: p1.min(p2), p2, left_right_max_px: None, speckle_area_max: 0, ..Settings::new(paths)
        };
        let mut expected = Vec::new();
        for row in (0..height).step_by(KEPT_ROWS) {
            let first = row.saturating_sub(OVERLAP_ROWS).min(height.saturating_sub(LANES));
            let rows: Vec<usize> = (first..first + LANES).collect();
            let strip = oracle::strip(left, right, &rows, min_px, count as usize, settings);
            expected.extend(strip[row - first..].iter().take(KEPT_ROWS.min(height - row)).flat_map(|row| bits(row)));
        }
        prop_assert_eq!(run(settings, left, right, min_px, count), expected);
    }

    /// Every instruction set and any number of threads give the same, bit for bit.
    #[test]
    fn threads_and_instructions_change_nothing(
        (width, height) in (1_usize..200, 1_usize..150),
        (min_px, count) in (-8_i32..8, 1_u32..300),
        (levels, shift, seed) in (1_u8..=255, 0_usize..12, any::<u64>()),
        (paths, census) in (paths(), census()),
    ) {
        let (left, right) = pair(width, height, width, shift, levels, seed);
        let (left, right) = (view(&left, width, height, width), view(&right, width, height, width));
        let settings = |simd| Settings { census, simd, ..Settings::new(paths) };
        let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let plain = pool(1).install(|| run(settings(Simd::Baseline), left, right, min_px, count));
        for simd in Simd::ALL.into_iter().filter(|simd| simd.is_available()) {
            prop_assert_eq!(&plain, &pool(2).install(|| run(settings(simd), left, right, min_px, count)), "{:?}", simd);
        }
    }

    /// A fuzzer in small: whatever is given is matched or refused, and buffers of another size are no hindrance.
    #[test]
    fn nothing_panics(
        (width, height, stride, bytes, out) in (0_usize..80, 0_usize..80, 0_usize..90, 0_usize..7000, 0_usize..7000),
        (min_px, count) in (any::<i32>(), any::<u32>()),
        fits in any::<bool>(),
    ) {
        let pixels = vec![9; if fits { stride * height } else { bytes }];
        let mut out = vec![0.0; if fits { width * height } else { out }];
        let view = view(&pixels, width, height, stride);
        let mut matcher = SemiGlobal::new(Settings::new(Paths::Four));
        let _ = matcher.compute(view, view, min_px, count, &mut out);
        let _ = matcher.compute(view, view, min_px % 100, count % 100, &mut out);
    }
}

#[test]
fn a_shift_is_found_and_the_edge_is_none() {
    let (width, height) = (160, 100);
    let (left, right) = pair(width, height, width, 9, 200, 5);
    // The right picture shows what lies 9 px further right: left (x) is right (x − 9).
    let mut out = vec![0.0; width * height];
    let mut matcher = SemiGlobal::new(Settings::new(Paths::Four));
    let (left, right) = (view(&left, width, height, width), view(&right, width, height, width));
    matcher.compute(left, right, 0, 32, &mut out).unwrap();
    assert!(out.chunks_exact(width).all(|row| row[..8].iter().all(|value| value.is_nan())), "what the right picture never saw");
    let share = |out: &[f32], columns: std::ops::Range<usize>, expected: f32| {
        let inner: Vec<f32> = out.chunks_exact(width).flat_map(|row| row[columns.clone()].to_vec()).collect();
        assert!(inner.iter().all(|value| value.is_nan() || (value - expected).abs() < 0.5));
        inner.iter().filter(|value| value.is_finite()).count() as f64 / inner.len() as f64
    };
    assert!(share(&out, 12..width, 9.0) > 0.99);
    // The other way round, disparities are negative.
    matcher.compute(right, left, -20, 32, &mut out).unwrap();
    assert!(share(&out, 0..145, -9.0) > 0.99);
}

#[test]
fn warm_buffers_do_not_grow() {
    let (left, right) = pair(300, 200, 300, 9, 200, 5);
    let (left, right) = (view(&left, 300, 200, 300), view(&right, 300, 200, 300));
    let mut out = vec![0.0; 300 * 200];
    let mut matcher = SemiGlobal::new(Settings::new(Paths::Eight));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let mut memory = || {
        pool.install(|| matcher.compute(left, right, 0, 64, &mut out)).unwrap();
        matcher.memory_bytes()
    };
    let first = memory();
    assert!(first < 2_000_000, "{first}");
    assert_eq!(first, memory());
}

#[test]
fn specks_go_and_patches_stay() {
    let nan = f32::NAN;
    #[rustfmt::skip]
    let map = [
        1.0, 1.0, 5.0, nan, 7.0,
        1.5, 1.0, nan, 9.0, 7.0,
        1.0, 2.0, 2.5, nan, 7.5,
    ];
    let mut out = map;
    Specks::default().remove(&mut out, 5, 2, 1.0);
    let mut expected = map;
    expected[2] = nan;
    expected[8] = nan;
    assert_eq!(bits(&out), bits(&expected));
}
