//! The same matcher written from its formulas, pixel by pixel, sharing nothing with what it judges but settings: for tests.

use super::{Census, Paths, Settings, View};

/// Bits of each pixel: which neighbours are brighter, the picture's edges repeated.
fn census(view: View<'_>, rows: &[usize], kind: Census) -> Vec<Vec<u64>> {
    let at = |x: i64, row: i64| {
        // Rows run on beyond the strip: they are the picture's.
        let y = (rows[0] as i64 + row).clamp(0, view.height as i64 - 1) as usize;
        view.pixels[y * view.stride + x.clamp(0, view.width as i64 - 1) as usize]
    };
    let bits = |x: i64, row: i64| {
        let (wide, high) = match kind {
            Census::Five => (2, 2),
            Census::Seven => (3, 3),
            Census::NineSymmetric => (4, 3),
        };
        let mut bits = 0_u64;
        for dy in -high..=high {
            for dx in -wide..=wide {
                let bit = match kind {
                    Census::NineSymmetric if (dy, dx) < (0, 0) => at(x - dx, row - dy) > at(x + dx, row + dy),
                    Census::NineSymmetric => continue,
                    _ => at(x + dx, row + dy) > at(x, row),
                };
                bits = bits << 1 | u64::from(bit);
            }
        }
        bits
    };
    (0..rows.len()).map(|row| (0..view.width).map(|x| bits(x as i64, row as i64)).collect()).collect()
}

/// Matches all rows of a strip as one picture. `rows` are the picture's rows from the strip's first, one after the other.
/// Disparities and sums, NaN where there is no unique match within the right picture; no left-right check, no speck filter.
pub(super) fn strip(
    left: View<'_>,
    right: View<'_>,
    rows: &[usize],
    min_px: i32,
    count: usize,
    settings: Settings,
) -> Vec<Vec<f32>> {
    let (bits_left, bits_right) = (census(left, rows, settings.census), census(right, rows, settings.census));
    let (height, width) = (rows.len() as i64, left.width as i64);
    let cost = |x: i64, y: i64, d: usize| {
        let at = (x - i64::from(min_px) - d as i64).clamp(0, width - 1);
        (bits_left[y as usize][x as usize] ^ bits_right[y as usize][at as usize]).count_ones()
    };
    let mut sums = vec![vec![vec![0_u32; count]; width as usize]; height as usize];
    let lines: &[(i64, i64)] = match settings.paths {
        Paths::Four => &[(1, 0), (1, 1)],
        Paths::Eight => &[(1, 0), (1, 1), (1, -1), (1, 2)],
    };
    for (dx, dy) in lines.iter().flat_map(|(dx, dy)| [(*dx, *dy), (-dx, -dy)]) {
        let mut along = vec![vec![vec![0_u32; count]; width as usize]; height as usize];
        for step in 0..width {
            let x = if dx > 0 { step } else { width - 1 - step };
            for y in 0..height {
                let (px, py) = (x - dx, y - dy);
                let begun = (0..width).contains(&px) && (0..height).contains(&py);
                for d in 0..count {
                    let mut value = cost(x, y, d);
                    if begun {
                        let before = &along[py as usize][px as usize];
                        let least = *before.iter().min().unwrap();
                        let (p1, p2) = (u32::from(settings.p1), u32::from(settings.p2));
                        let mut best = before[d].min(least + p2);
                        if d > 0 {
                            best = best.min(before[d - 1] + p1);
                        }
                        if d + 1 < count {
                            best = best.min(before[d + 1] + p1);
                        }
                        value += best - least;
                    }
                    along[y as usize][x as usize][d] = value;
                    sums[y as usize][x as usize][d] += value;
                }
            }
        }
    }
    let choose = |x: usize, sums: &[u32]| {
        let sums: Vec<u32> = sums.iter().map(|sum| *sum.min(&255)).collect();
        let least = *sums.iter().min().unwrap();
        let best = sums.iter().position(|sum| *sum == least).unwrap();
        let second = sums.iter().enumerate().filter(|(d, _)| d.abs_diff(best) > 1).map(|(_, sum)| *sum).min().unwrap_or(255);
        if least == 255 || second * (100 - u32::from(settings.uniqueness_percent)) < least * 100 {
            return f32::NAN;
        }
        let mut fraction = 0.0;
        if best > 0 && best + 1 < count {
            let (below, above) = (sums[best - 1] as f32, sums[best + 1] as f32);
            let rise = below.max(above) - least as f32;
            fraction = if rise > 0.0 { 0.5 * (below - above) / rise } else { 0.0 };
        }
        let disparity_px = best as f32 + fraction + min_px as f32;
        let at_px = x as f32 - disparity_px;
        if at_px < 0.0 || at_px > (width - 1) as f32 { f32::NAN } else { disparity_px }
    };
    sums.iter().map(|row| row.iter().enumerate().map(|(x, sums)| choose(x, sums)).collect()).collect()
}
