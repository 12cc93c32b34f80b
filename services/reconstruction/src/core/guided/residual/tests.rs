use super::*;

/// The search, written as its definition: one pixel, one residual, one window at a time.
fn plain(
    left: &[u8],
    right: &[u8],
    (width, height): (usize, usize),
    plane: &DisparityPlane,
    reach: i32,
    window: usize,
) -> Vec<f32> {
    let slope = |picture: &[u8], x: usize, y: usize| -> i32 {
        if x == 0 || x + 1 == width {
            return 0;
        }
        let at = |x: usize, y: isize| i32::from(picture[mirrored(y, height) * width + x]);
        let y = y as isize;
        let column = |x: usize| at(x, y - 1) + 2 * at(x, y) + at(x, y + 1);
        (column(x + 1) - column(x - 1)).clamp(-31, 31)
    };
    let whole = |x: usize, y: usize| plane.at(x as f32, y as f32).round() as i32;
    let cost = |x: isize, y: isize, residual: i32| -> i32 {
        let (x, y) = (mirrored(x, width), mirrored(y, height));
        let partner = x as i32 - whole(x, y) - residual;
        if partner < 0 || partner >= width as i32 {
            return 63;
        }
        (slope(left, x, y) - slope(right, partner as usize, y)).abs()
    };
    let half = window as isize / 2;
    let summed = |x: usize, y: usize, residual: i32| -> i32 {
        let window = (-half..=half).flat_map(|dy| (-half..=half).map(move |dx| (dx, dy)));
        window.map(|(dx, dy)| cost(x as isize + dx, y as isize + dy, residual)).sum()
    };
    // The disparity that a pixel of the right picture chooses: the first of the least.
    let chosen_by_right = |right: usize, y: usize| -> Option<i32> {
        let mut best: Option<(i32, i32)> = None;
        for residual in -reach..=reach {
            for x in 0..width {
                let shift = whole(x, y) + residual;
                if x as i32 - shift == right as i32 {
                    let sum = summed(x, y, residual);
                    best = if best.is_none_or(|(least, _)| sum < least) { Some((sum, shift)) } else { best };
                }
            }
        }
        best.map(|(_, shift)| shift)
    };
    let mut values = Vec::new();
    for y in 0..height as isize {
        for x in 0..width as isize {
            let sums: Vec<i32> = (-reach..=reach).map(|residual| summed(x as usize, y as usize, residual)).collect();
            let winner = (0..sums.len()).min_by_key(|i| sums[*i]).unwrap();
            let rivals = (0..sums.len()).filter(|i| i.abs_diff(winner) > 1).map(|i| sums[i]);
            let is_clear = rivals.min().is_none_or(|second| 90 * second > 100 * sums[winner]);
            let mut value = f32::NAN;
            if is_clear && winner > 0 && winner + 1 < sums.len() {
                let [below, best, above] = [sums[winner - 1], sums[winner], sums[winner + 1]].map(|sum| sum as f32);
                let fraction = (below - above) / (2.0 * (below.max(above) - best)).max(1.0);
                let d = (whole(x as usize, y as usize) + winner as i32 - reach) as f32 + fraction;
                let is_seen = (0..width as i32).contains(&(x as i32 - whole(x as usize, y as usize)));
                let shift = whole(x as usize, y as usize) + winner as i32 - reach;
                let partner = usize::try_from(x as i32 - shift).ok().filter(|partner| *partner < width);
                let chosen = partner.and_then(|partner| chosen_by_right(partner, y as usize));
                let is_mutual = chosen.is_some_and(|chosen| (chosen - shift).abs() <= 1);
                value = if is_seen && is_mutual && d <= x as f32 && d >= 0.0 { d } else { f32::NAN };
            }
            values.push(value);
        }
    }
    values
}

proptest::proptest! {
    #![proptest_config(proptest::prelude::ProptestConfig { cases: 24, failure_persistence: None, ..Default::default() })]

    /// Whatever instructions the processor has: the same to the last bit as the definition.
    #[test]
    fn the_search_is_its_definition(
        width in 1_usize..50,
        height in 1_usize..70,
        reach in 1_u32..7,
        half in 0_u32..5,
        (a, b, c) in (-0.3_f32..0.3, -0.3_f32..0.3, -5.0_f32..20.0),
        contrast in 0_u32..=255,
        seed in proptest::num::u64::ANY,
    ) {
        use rand::{Rng as _, SeedableRng as _};
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let mut noise = || (0..width * height).map(|_| (random.random_range(0..=contrast)) as u8).collect::<Vec<u8>>();
        let (left, mut right) = (noise(), noise());
        if seed.is_multiple_of(2) {
            right.clone_from(&left);
        }
        let plane = DisparityPlane::through_px([(0.0, 0.0, c), (100.0, 0.0, c + 100.0 * a), (0.0, 100.0, c + 100.0 * b)]).unwrap();
        let pair = Pair { left: &left, right: &right, width, height };
        let mut residual = Residual::new(2 * half + 1);
        let mut disparity = Disparity::default();
        let range = DisparityRange { min_px: 0, max_px: 10_000 };
        residual.prepare(&pair);
        residual.search(&pair, &plane, reach, range, &mut disparity);
        let expected = plain(&left, &right, (width, height), &plane, reach as i32, 2 * half as usize + 1);
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        proptest::prop_assert_eq!(bits(&disparity.values_px), bits(&expected));
    }
}
