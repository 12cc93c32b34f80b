//! What waves do to a patch: to its mean level, to how it is bent, and to what a parabola leaves of them.

use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

use nalgebra::{Matrix3, Vector3};

/// Directions that a wave may come from, over a quarter of a turn: from the others it does the same to a rectangle, mirrored.
const DIRECTIONS: usize = 6;
/// Sine and cosine of each.
static QUADRANT: LazyLock<[(f64, f64); DIRECTIONS]> =
    LazyLock::new(|| std::array::from_fn(|i| (FRAC_PI_2 * (i as f64 + 0.5) / DIRECTIONS as f64).sin_cos()));

/// What waves of one wavenumber, from anywhere, do to the mean and to the bend of a rectangular patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Response {
    /// The mean level that goes with a bend of one per metre, m².
    pub level_per_bend_m2: f64,
    /// Share of the level's variance that this leaves unexplained, since directions differ: 0 for long waves.
    pub unexplained: f64,
}

impl Response {
    /// For waves of `wavenumber_radpm` over a patch of `sides_m`.
    pub(super) fn new(wavenumber_radpm: f64, sides_m: [f64; 2]) -> Self {
        let (mut levels, mut bends, mut products) = (0.0, 0.0, 0.0);
        for (sin, cos) in *QUADRANT {
            let [x, y] = [(cos, sides_m[0]), (sin, sides_m[1])]
                .map(|(share, side_m)| Axis::of(0.5 * wavenumber_radpm * share * side_m, 0.5 * side_m));
            // cos(kx x) cos(ky y): the even part of a plane wave; the odd part has no mean and no bend.
            let level = x.mean * y.mean;
            let bend = x.bend_per_m2 * y.mean + y.bend_per_m2 * x.mean;
            (levels, bends, products) = (levels + level * level, bends + bend * bend, products + level * bend);
        }
        Self { level_per_bend_m2: products / bends, unexplained: 1.0 - products * products / (levels * bends) }
    }
}

/// How much waves of `wavenumber_min_radpm` and shorter bend a patch, for what a parabola leaves of them: mean square of the bend over
/// mean square of the residual, m⁻⁴. Energy falls with the fifth power of frequency, as behind the peak of every wind sea (Phillips 1958).
pub(super) fn bend_of_residual_per_m4(wavenumber_min_radpm: f64, sides_m: [f64; 2]) -> f64 {
    const ACROSS: usize = 10;
    const HALF: usize = ACROSS / 2;
    const STEPS: i32 = 8;
    let half = sides_m.map(|side_m| 0.5 * side_m);
    // Places in the quarter of the patch where both coordinates are positive.
    let [xs, ys] = half.map(|half_m| -> [f64; HALF] { std::array::from_fn(|i| half_m * (2 * i + 1) as f64 / ACROSS as f64) });
    // cos(kx x + ky y) is cos cos − sin sin of the two axes, and its sine sin cos + cos sin. Over the mirrored quarters each of the four products is
    // orthogonal to the others: 1, x² and y² have only to do with the first, xy with the second, x and y with the last two.
    let even = |x: f64, y: f64| Vector3::new(1.0, x * x, y * y);
    let places = || xs.iter().flat_map(|x| ys.iter().map(move |y| (*x, *y)));
    let evens: Matrix3<f64> = places().map(|(x, y)| even(x, y) * even(x, y).transpose()).sum();
    let squares = |of: fn(f64, f64) -> f64| places().map(|(x, y)| of(x, y).powi(2)).sum::<f64>();
    let (crosses, norths, easts) = (squares(|x, y| x * y), squares(|_, y| y), squares(|x, _| x));
    let Some(evens) = evens.cholesky() else { return f64::INFINITY };
    let longest = wavenumber_min_radpm;
    // Down to waves that the grid of places still resolves; shorter ones bend nothing.
    let shortest = (FRAC_PI_2 * ACROSS as f64 / sides_m[0].max(sides_m[1])).max(longest);
    let (mut bends, mut residuals) = (0.0, 0.0);
    for step in 0..STEPS {
        let k_radpm = longest * (shortest / longest).powf(f64::from(step) / f64::from(STEPS));
        // f⁻⁵ df is k⁻² d ln k.
        let energy = k_radpm.powi(-2);
        for (sin, cos) in *QUADRANT {
            let (along_x, along_y) = (xs.map(|x| (k_radpm * cos * x).sin_cos()), ys.map(|y| (k_radpm * sin * y).sin_cos()));
            let (mut of_even, mut of_cross, mut of_north, mut of_east) = (Vector3::zeros(), 0.0, 0.0, 0.0);
            for (x, (sin_x, cos_x)) in xs.iter().zip(along_x) {
                for (y, (sin_y, cos_y)) in ys.iter().zip(along_y) {
                    of_even += even(*x, *y) * (cos_x * cos_y);
                    of_cross += x * y * (sin_x * sin_y);
                    of_north += y * (cos_x * sin_y);
                    of_east += x * (sin_x * cos_y);
                }
            }
            let parabola = evens.solve(&of_even);
            bends += energy * (parabola[1] + parabola[2]).powi(2);
            // The squares of cosine and sine add up to one at each place.
            let fitted = parabola.dot(&of_even)
                + of_cross * of_cross / crosses
                + of_north * of_north / norths
                + of_east * of_east / easts;
            residuals += energy * (1.0 - fitted / (HALF * HALF) as f64);
        }
    }
    bends / residuals.max(f64::MIN_POSITIVE)
}

/// A cosine over one side of the patch: its mean, and the quadratic coefficient of its least-squares parabola.
struct Axis {
    mean: f64,
    bend_per_m2: f64,
}

impl Axis {
    /// `phase` is the wave's at the end of the side, radians; `half_m` half the side.
    fn of(phase: f64, half_m: f64) -> Self {
        // Over u in −1 … 1 the quadratic that is orthogonal to a constant is u² − 1/3, of mean square 4/45. The series takes over
        // where the closed form would subtract equals.
        let p2 = phase * phase;
        if phase.abs() < 0.1 {
            return Self { mean: 1.0 - p2 / 6.0, bend_per_m2: (-p2 / 2.0 + p2 * p2 / 28.0) / (half_m * half_m) };
        }
        let (sin, cos) = phase.sin_cos();
        let per_phase = 1.0 / phase;
        let mean = sin * per_phase;
        // Mean of u² cos(phase u) over the side.
        let second = mean + 2.0 * (cos - mean) * per_phase * per_phase;
        Self { mean, bend_per_m2: (second - mean / 3.0) * 45.0 / 4.0 / (half_m * half_m) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector6};

    #[test]
    fn long_waves_are_all_explained_and_short_ones_are_not() {
        let long = Response::new(0.1, [4.0, 3.0]);
        assert!(long.unexplained < 1e-3 && (long.level_per_bend_m2 / (-2.0 / 0.01) - 1.0).abs() < 0.02, "{long:?}");
        assert!(Response::new(2.5, [4.0, 3.0]).unexplained > 0.3);
        // The series and the closed form meet.
        let [below, above] = [0.0999, 0.1001].map(|phase| Axis::of(phase, 1.0));
        assert!((below.bend_per_m2 / above.bend_per_m2 - 1.0).abs() < 0.01 && (below.mean - above.mean).abs() < 1e-4);
    }

    /// By waves from all around over all places of the patch, and one least-squares parabola for all of them, without a thought of symmetry.
    #[test]
    fn the_residual_is_that_of_a_parabola_over_the_whole_patch() {
        for (longest_m, sides_m) in [(3.0, [4.0, 3.0]), (1.2, [4.25, 3.25]), (8.0, [2.0, 6.0]), (0.2, [3.0, 3.0])] {
            let place = |i: usize, side_m: f64| side_m * ((i as f64 + 0.5) / 10.0 - 0.5);
            let places: Vec<(f64, f64)> = (0..100).map(|i| (place(i % 10, sides_m[0]), place(i / 10, sides_m[1]))).collect();
            let basis = |(x, y): (f64, f64)| Vector6::new(1.0, x, y, x * x, x * y, y * y);
            let normal: Matrix6<f64> = places.iter().map(|at| basis(*at) * basis(*at).transpose()).sum();
            let normal = normal.cholesky().unwrap();
            let longest = std::f64::consts::TAU / longest_m;
            let shortest = (0.5 * std::f64::consts::PI * 10.0 / sides_m[0].max(sides_m[1])).max(longest);
            let (mut bends, mut residuals) = (0.0, 0.0);
            for step in 0..8 {
                let k = longest * (shortest / longest).powf(f64::from(step) / 8.0);
                for direction in 0..24 {
                    let (sin, cos) = (std::f64::consts::TAU * (f64::from(direction) + 0.5) / 24.0).sin_cos();
                    for phase in [0.0, FRAC_PI_2] {
                        let wave = |(x, y): (f64, f64)| (k * (x * cos + y * sin) + phase).cos();
                        let right: Vector6<f64> = places.iter().map(|at| basis(*at) * wave(*at)).sum();
                        let parabola = normal.solve(&right);
                        bends += (parabola[3] + parabola[5]).powi(2) / (k * k);
                        let left = places.iter().map(|at| (wave(*at) - parabola.dot(&basis(*at))).powi(2)).sum::<f64>();
                        residuals += left / 100.0 / (k * k);
                    }
                }
            }
            let found = bend_of_residual_per_m4(longest, sides_m);
            assert!((found / (bends / residuals) - 1.0).abs() < 1e-8, "{longest_m} m: {found} {}", bends / residuals);
        }
    }
}
