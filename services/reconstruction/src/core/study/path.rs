//! Semi-global matching (Hirschmüller 2008): the energy (4-16) minimised along straight paths that end in each pixel,
//!
//! L(p, d) = C(p, d) + min(L(p−r, d), L(p−r, d±1) + P1, min_k L(p−r, k) + P2) − min_k L(p−r, k),
//!
//! and summed over the paths' directions r. The last term only keeps numbers small.

use super::MatchError;
use super::volume::CostVolume;

/// From how many directions paths come.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Paths {
    /// Along rows and columns.
    Four,
    /// And along diagonals (fig. 4-11).
    Eight,
    /// And between them, by a knight's move.
    Sixteen,
}

/// All directions, (x, y) of one step, pixels: first the 4, then the rest of the 8, then the rest of the 16.
const STEPS: [(i32, i32); 16] = [
    (1, 0),
    (-1, 0),
    (0, 1),
    (0, -1),
    (1, 1),
    (-1, 1),
    (1, -1),
    (-1, -1),
    (2, 1),
    (-2, 1),
    (2, -1),
    (-2, -1),
    (1, 2),
    (-1, 2),
    (1, -2),
    (-1, -2),
];

impl Paths {
    /// With so many directions: 4, 8 or 16.
    #[must_use]
    pub fn of(count: u32) -> Option<Self> {
        match count {
            4 => Some(Self::Four),
            8 => Some(Self::Eight),
            16 => Some(Self::Sixteen),
            _ => None,
        }
    }

    /// One step along each path towards the pixel, (x, y) in pixels.
    #[must_use]
    pub fn steps(self) -> &'static [(i32, i32)] {
        match self {
            Self::Four => &STEPS[..4],
            Self::Eight => &STEPS[..8],
            Self::Sixteen => &STEPS,
        }
    }
}

/// What a step of disparity from one pixel of a path to the next costs, in the unit of the pixel cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Penalties {
    /// For a step by one pixel: surfaces that slant or bend.
    pub p1: f32,
    /// For any larger step: edges of depth.
    pub p2: f32,
    /// Edges of depth are mostly edges of brightness: divide P2 by the step of brightness, in units of 8 grey levels (smaller
    /// steps change nothing); it stays at least P1.
    pub adaptive: bool,
}

impl Penalties {
    /// Steps of brightness below this, grey levels, may be noise.
    const NOISE_GREY: f32 = 8.0;

    /// P2 between two pixels of these grey levels.
    fn p2_between(&self, a: u8, b: u8) -> f32 {
        if self.adaptive { (self.p2 / (f32::from(a.abs_diff(b)) / Self::NOISE_GREY).max(1.0)).max(self.p1) } else { self.p2 }
    }
}

/// Sums the costs of all paths, for every pixel and disparity. `left` are the pixels of the left picture, for
/// [`Penalties::adaptive`].
///
/// # Errors
/// [`MatchError::Memory`] where the sums are too many.
pub fn sum(costs: &CostVolume, left: &[u8], paths: Paths, penalties: Penalties) -> Result<CostVolume, MatchError> {
    let mut sums = CostVolume::infinite(costs.width, costs.height, costs.min_px, costs.count)?;
    sums.values.fill(0.0);
    for step_px in paths.steps() {
        add_direction(costs, left, *step_px, penalties, &mut sums);
    }
    Ok(sums)
}

/// Adds the path costs of one direction.
fn add_direction(costs: &CostVolume, left: &[u8], (dx, dy): (i32, i32), penalties: Penalties, sums: &mut CostVolume) {
    let (width, height, count) = (costs.width, costs.height, costs.count);
    // Path costs of this row and of as many before it as a step reaches back; a margin of infinity at both ends of the
    // disparities spares their special cases.
    let reach = dy.unsigned_abs() as usize + 1;
    let mut rows = vec![f32::INFINITY; reach * width * (count + 2)];
    let mut least = vec![f32::INFINITY; reach * width];
    let mut path = vec![0.0; count];
    for line in 0..height {
        let y = if dy < 0 { height - 1 - line } else { line };
        for column in 0..width {
            let x = if dx < 0 { width - 1 - column } else { column };
            let pixel = y * width + x;
            let before = x.checked_add_signed(-dx as isize).zip(y.checked_add_signed(-dy as isize));
            let before = before.filter(|(x, y)| *x < width && *y < height);
            // Where every disparity of the pixel before looks beyond the right picture, the path begins anew.
            let from =
                before.map(|(x, y)| ((y % reach) * width + x, y * width + x)).filter(|(slot, _)| least[*slot].is_finite());
            let lowest = match from {
                Some((slot, neighbour)) => {
                    let previous = &rows[slot * (count + 2)..][..count + 2];
                    let p2 = penalties.p2_between(left[pixel], left[neighbour]);
                    step(previous, least[slot], costs.at(pixel), penalties.p1, p2, &mut path)
                }
                None => {
                    path.copy_from_slice(costs.at(pixel));
                    minimum(&path)
                }
            };
            let slot = (y % reach) * width + x;
            rows[slot * (count + 2) + 1..][..count].copy_from_slice(&path);
            least[slot] = lowest;
            for (sum, path) in sums.values[pixel * count..][..count].iter_mut().zip(&path) {
                *sum += *path;
            }
        }
    }
}

/// One step along a path: `previous` are the path costs of the pixel before with one infinite value at each end, `least` their
/// minimum. Returns the minimum of `path`.
fn step(previous: &[f32], least: f32, costs: &[f32], p1: f32, p2: f32, path: &mut [f32]) -> f32 {
    let count = costs.len();
    let (below, same, above) = (&previous[..count], &previous[1..=count], &previous[2..count + 2]);
    for (((path, cost), same), (below, above)) in path.iter_mut().zip(costs).zip(same).zip(below.iter().zip(above)) {
        *path = cost + (lesser(lesser(*same, lesser(*below, *above) + p1), least + p2) - least);
    }
    minimum(path)
}

/// The lesser of two that are no NaN: one instruction, which `f32::min` is not.
fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// In eight lanes, so that it becomes vector code.
fn minimum(values: &[f32]) -> f32 {
    let mut lanes = [f32::INFINITY; 8];
    let (eights, rest) = values.as_chunks::<8>();
    for eight in eights {
        for (lane, value) in lanes.iter_mut().zip(eight) {
            *lane = lesser(*lane, *value);
        }
    }
    lanes.iter().chain(rest).fold(f32::INFINITY, |least, value| lesser(least, *value))
}

/// The energy (4-16) of the disparities `labels` (indices into each pixel's costs) along one row of pixels.
#[must_use]
pub fn energy(costs: &CostVolume, labels: &[usize], penalties: Penalties) -> f64 {
    let data: f64 = labels.iter().enumerate().map(|(pixel, k)| f64::from(costs.at(pixel)[*k])).sum();
    let smoothness = |pair: &[usize]| match pair[0].abs_diff(pair[1]) {
        0 => 0.0,
        1 => f64::from(penalties.p1),
        _ => f64::from(penalties.p2),
    };
    data + labels.windows(2).map(smoothness).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    const PENALTIES: Penalties = Penalties { p1: 2.0, p2: 7.0, adaptive: false };

    fn random_row(width: usize, count: usize, seed: u64) -> CostVolume {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let values = (0..width * count).map(|_| random.random_range(0.0..10.0)).collect();
        CostVolume { width, height: 1, min_px: 0, count, values }
    }

    /// The least energy of a row by trying every labelling.
    fn least_by_trying(costs: &CostVolume) -> f64 {
        let labellings = costs.count.pow(costs.width as u32);
        let labels = |mut i: usize| -> Vec<usize> {
            std::iter::repeat_with(|| {
                let k = i % costs.count;
                i /= costs.count;
                k
            })
            .take(costs.width)
            .collect()
        };
        (0..labellings).map(|i| energy(costs, &labels(i), PENALTIES)).fold(f64::INFINITY, f64::min)
    }

    /// The least energy of a row and its labels by Viterbi's algorithm: every transition looked at.
    fn viterbi(costs: &CostVolume) -> (f64, Vec<usize>) {
        let count = costs.count;
        let transition = |a: usize, b: usize| match a.abs_diff(b) {
            0 => 0.0,
            1 => f64::from(PENALTIES.p1),
            _ => f64::from(PENALTIES.p2),
        };
        let mut best: Vec<f64> = costs.at(0).iter().map(|cost| f64::from(*cost)).collect();
        let mut back = Vec::new();
        for pixel in 1..costs.width {
            let from: Vec<usize> = (0..count)
                .map(|k| {
                    (0..count).min_by(|a, b| (best[*a] + transition(*a, k)).total_cmp(&(best[*b] + transition(*b, k)))).unwrap()
                })
                .collect();
            best = (0..count).map(|k| best[from[k]] + transition(from[k], k) + f64::from(costs.at(pixel)[k])).collect();
            back.push(from);
        }
        let mut k = (0..count).min_by(|a, b| best[*a].total_cmp(&best[*b])).unwrap();
        let least = best[k];
        let mut labels = vec![k];
        for from in back.iter().rev() {
            k = from[k];
            labels.push(k);
        }
        labels.reverse();
        (least, labels)
    }

    /// The least energy along a path is the least path cost at its end, plus what was subtracted on the way.
    fn least_by_path(costs: &CostVolume) -> f64 {
        let mut previous = vec![f32::INFINITY; costs.count + 2];
        previous[1..=costs.count].copy_from_slice(costs.at(0));
        let mut least = minimum(costs.at(0));
        let mut subtracted = 0.0;
        let mut path = vec![0.0; costs.count];
        for pixel in 1..costs.width {
            subtracted += f64::from(least);
            least = step(&previous, least, costs.at(pixel), PENALTIES.p1, PENALTIES.p2, &mut path);
            previous[1..=costs.count].copy_from_slice(&path);
        }
        subtracted + f64::from(least)
    }

    #[test]
    fn a_path_finds_the_least_energy() {
        for seed in 0..20 {
            let costs = random_row(6, 5, seed);
            let tried = least_by_trying(&costs);
            assert!((viterbi(&costs).0 - tried).abs() < 1e-6, "the test's own dynamic programming");
            assert!((least_by_path(&costs) - tried).abs() < 1e-4);
        }
        for seed in 0..20 {
            let costs = random_row(200, 19, seed);
            assert!((least_by_path(&costs) - viterbi(&costs).0).abs() < 1e-2);
        }
    }

    /// On a single row the two horizontal paths together hold every pixel's min-marginals, so the winners are Viterbi's labels.
    /// The two vertical paths start in each pixel and add its own cost, as does counting it twice in the horizontal ones.
    #[test]
    fn two_opposite_paths_give_the_best_labels() {
        for seed in 0..20 {
            let costs = random_row(120, 17, seed);
            let mut sums = sum(&costs, &[0; 120], Paths::Four, PENALTIES).unwrap();
            for (sum, cost) in sums.values.iter_mut().zip(&costs.values) {
                *sum -= 3.0 * cost;
            }
            let winners: Vec<usize> = (0..120)
                .map(|pixel| (0..17).min_by(|a, b| sums.at(pixel)[*a].total_cmp(&sums.at(pixel)[*b])).unwrap())
                .collect();
            let (least, labels) = viterbi(&costs);
            assert!((energy(&costs, &winners, PENALTIES) - least).abs() < 1e-3);
            assert_eq!(winners, labels);
        }
    }

    /// Each direction by its definition, from every pixel back to the edge.
    #[test]
    fn every_direction_follows_its_path() {
        let (width, height, count) = (9, 7, 4);
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let values = (0..width * height * count).map(|_| random.random_range(0.0..10.0)).collect();
        let costs = CostVolume { width, height, min_px: 0, count, values };
        let left: Vec<u8> = (0..width * height).map(|_| random.random()).collect();
        let penalties = Penalties { adaptive: true, ..PENALTIES };
        for (dx, dy) in STEPS {
            let mut sums = CostVolume::infinite(width, height, 0, count).unwrap();
            sums.values.fill(0.0);
            add_direction(&costs, &left, (dx, dy), penalties, &mut sums);
            for pixel in 0..width * height {
                let (mut x, mut y) = ((pixel % width) as i32, (pixel / width) as i32);
                let mut pixels = Vec::new();
                while (0..width as i32).contains(&x) && (0..height as i32).contains(&y) {
                    pixels.push(y as usize * width + x as usize);
                    (x, y) = (x - dx, y - dy);
                }
                pixels.reverse();
                let mut path: Vec<f64> = costs.at(pixels[0]).iter().map(|cost| f64::from(*cost)).collect();
                for pair in pixels.windows(2) {
                    let least = path.iter().copied().fold(f64::INFINITY, f64::min);
                    let contrast = f64::from(left[pair[0]].abs_diff(left[pair[1]]));
                    let p2 = (7.0 / (contrast / 8.0).max(1.0)).max(2.0);
                    path = (0..count)
                        .map(|k| {
                            let reach = |from: usize| path[from] + [0.0, 2.0, p2][from.abs_diff(k).min(2)];
                            f64::from(costs.at(pair[1])[k]) + (0..count).map(reach).fold(f64::INFINITY, f64::min) - least
                        })
                        .collect();
                }
                for (sum, expected) in sums.at(pixel).iter().zip(&path) {
                    assert!((f64::from(*sum) - expected).abs() < 1e-4, "{dx} {dy} at {pixel}: {sum} {expected}");
                }
            }
        }
    }

    #[test]
    fn paths_come_from_all_sides() {
        for (paths, count) in [(Paths::Four, 4), (Paths::Eight, 8), (Paths::Sixteen, 16)] {
            assert_eq!((paths.steps().len(), Paths::of(count)), (count as usize, Some(paths)));
            let centre = paths.steps().iter().fold((0, 0), |sum, step| (sum.0 + step.0, sum.1 + step.1));
            assert_eq!(centre, (0, 0));
            let distinct: std::collections::HashSet<_> = paths.steps().iter().collect();
            assert_eq!(distinct.len(), count as usize);
        }
        assert_eq!(Paths::of(5), None);
    }

    /// Disparities that look beyond the right picture are infinite and stay so; none becomes NaN.
    #[test]
    fn what_lies_outside_stays_outside() {
        let (width, height, count) = (6, 5, 3);
        let mut costs = CostVolume::infinite(width, height, 2, count).unwrap();
        for pixel in 0..width * height {
            for k in 0..count {
                if 2 + k <= pixel % width {
                    costs.values[pixel * count + k] = 1.0;
                }
            }
        }
        let sums = sum(&costs, &[0; 30], Paths::Sixteen, PENALTIES).unwrap();
        for (sum, cost) in sums.values.iter().zip(&costs.values) {
            assert!(!sum.is_nan() && sum.is_finite() == cost.is_finite(), "{sum} {cost}");
        }
    }
}
