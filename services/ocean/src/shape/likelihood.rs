//! The most likely parameters of a density, given an estimate that scatters about it as chi-square.
//!
//! ln L = (ν/2) Σ (−ln E − Ŝ/E) over lines of ν degrees of freedom with the expectation E (Whittle 1953; that E is to be what the
//! taper makes of the density: Sykulski et al. 2019, *Biometrika* 106). Fisher's scoring: its information is (ν/2) Σ ∂ln E/∂θᵢ
//! ∂ln E/∂θⱼ.

/// An expectation with its derivatives by the parameters.
pub(super) struct Expected<const N: usize> {
    /// At each line, m²/Hz.
    pub(super) density: Vec<f64>,
    /// By each parameter.
    pub(super) by: [Vec<f64>; N],
}

/// What a search found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Found<const N: usize> {
    pub(super) theta: [f64; N],
    /// Inverse of the information per unit of ν/2: the parameters' covariance where lines are independent.
    pub(super) covariance: [[f64; N]; N],
    /// Σ (−ln E − Ŝ/E).
    pub(super) likelihood: f64,
}

/// Steps at most; a search that has not ended by then has not converged.
const STEPS_MAX: usize = 100;
/// A slope of less than this much likelihood per standard error (of ν = 2) ends it.
const SLOPE_MIN: f64 = 1e-8;

/// Climbs from `start` within `bounds` to the likeliest parameters; `None` where no direction is known or no end is found.
pub(super) fn climb<const N: usize>(
    measured: &[f64],
    start: [f64; N],
    bounds: &[(f64, f64); N],
    expected: impl Fn(&[f64; N]) -> Option<Expected<N>>,
) -> Option<Found<N>> {
    let mut theta = start;
    let mut at = expected(&theta)?;
    let mut likelihood = likelihood_of(measured, &at.density);
    let mut damping = 0.0_f64;
    for _ in 0..STEPS_MAX {
        let (slope, information) = derivatives(measured, &at);
        // What stands at its bound and would go beyond is left out.
        let free: [bool; N] = std::array::from_fn(|i| {
            let (low, high) = bounds[i];
            !(theta[i] <= low && slope[i] < 0.0 || theta[i] >= high && slope[i] > 0.0)
        });
        let step =
            solve(&damped(&information, &free, damping), &std::array::from_fn(|i| if free[i] { slope[i] } else { 0.0 }))?;
        let left = (0..N).filter(|i| free[*i]).map(|i| slope[i].powi(2) / information[i][i]).sum::<f64>().sqrt();
        if left < SLOPE_MIN {
            return Some(Found { theta, covariance: inverse(&information)?, likelihood });
        }
        let next: [f64; N] = std::array::from_fn(|i| (theta[i] + step[i]).clamp(bounds[i].0, bounds[i].1));
        let better = expected(&next).map(|next_at| (likelihood_of(measured, &next_at.density), next_at));
        match better {
            // Near the top rounding decides.
            Some((value, next_at)) if value >= likelihood - 1e-12 * likelihood.abs() => {
                let still = next == theta;
                (theta, at, likelihood) = (next, next_at, value);
                damping *= 0.1;
                if still {
                    return Some(Found { theta, covariance: inverse(&information)?, likelihood });
                }
            }
            _ => damping = (10.0 * damping).max(1e-3),
        }
        if damping > 1e12 {
            return None;
        }
    }
    None
}

/// Σ (−ln E − Ŝ/E); −∞ where something is expected to be nothing.
pub(super) fn likelihood_of(measured: &[f64], expected: &[f64]) -> f64 {
    let one = |(s, e): (&f64, &f64)| if *e > 0.0 { -e.ln() - s / e } else { f64::NEG_INFINITY };
    measured.iter().zip(expected).map(one).sum()
}

/// Slope and information per unit of ν/2.
fn derivatives<const N: usize>(measured: &[f64], at: &Expected<N>) -> ([f64; N], [[f64; N]; N]) {
    let (mut slope, mut information) = ([0.0; N], [[0.0; N]; N]);
    for (line, (s, e)) in measured.iter().zip(&at.density).enumerate() {
        let by: [f64; N] = std::array::from_fn(|i| at.by[i][line] / e);
        for i in 0..N {
            slope[i] += (s / e - 1.0) * by[i];
            for j in 0..N {
                information[i][j] += by[i] * by[j];
            }
        }
    }
    (slope, information)
}

/// Levenberg's and Marquardt's damping; rows of what is not free are those of the unit matrix.
fn damped<const N: usize>(information: &[[f64; N]; N], free: &[bool; N], damping: f64) -> [[f64; N]; N] {
    std::array::from_fn(|i| {
        std::array::from_fn(|j| match (i == j, free[i] && free[j]) {
            (true, true) => information[i][i] * (1.0 + damping),
            (true, false) => 1.0,
            (false, true) => information[i][j],
            (false, false) => 0.0,
        })
    })
}

/// x of `matrix` x = `right`, symmetric and positive, by Cholesky's factors; `None` where it is singular.
fn solve<const N: usize>(matrix: &[[f64; N]; N], right: &[f64; N]) -> Option<[f64; N]> {
    let mut lower = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            let rest = matrix[i][j] - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
            if i == j {
                // What is left of a column that others explain is rounding.
                let known = rest > 1e-13 * matrix[i][i] && rest.is_finite();
                lower[i][i] = known.then(|| rest.sqrt())?;
            } else {
                lower[i][j] = rest / lower[j][j];
            }
        }
    }
    let mut x = *right;
    for i in 0..N {
        x[i] = (x[i] - (0..i).map(|k| lower[i][k] * x[k]).sum::<f64>()) / lower[i][i];
    }
    for i in (0..N).rev() {
        x[i] = (x[i] - (i + 1..N).map(|k| lower[k][i] * x[k]).sum::<f64>()) / lower[i][i];
    }
    Some(x)
}

/// Inverse of a symmetric positive matrix.
fn inverse<const N: usize>(matrix: &[[f64; N]; N]) -> Option<[[f64; N]; N]> {
    let mut columns = [[0.0; N]; N];
    for (j, column) in columns.iter_mut().enumerate() {
        *column = solve(matrix, &std::array::from_fn(|i| if i == j { 1.0 } else { 0.0 }))?;
    }
    Some(columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// By hand: det is 3.
    #[test]
    fn small_systems_are_solved() {
        let x = solve(&[[2.0, 1.0], [1.0, 2.0]], &[4.0, 5.0]).unwrap();
        assert_relative_eq!(x[0], 1.0, max_relative = 1e-12);
        assert_relative_eq!(x[1], 2.0, max_relative = 1e-12);
        let found = inverse(&[[2.0, 1.0], [1.0, 2.0]]).unwrap();
        assert_relative_eq!(found[0][0], 2.0 / 3.0, max_relative = 1e-12);
        assert_relative_eq!(found[1][0], -1.0 / 3.0, max_relative = 1e-12);
        assert_eq!(solve(&[[1.0, 1.0], [1.0, 1.0]], &[1.0, 1.0]), None);
        assert_eq!(solve(&[[f64::NAN, 1.0], [1.0, 1.0]], &[1.0, 1.0]), None);
    }

    /// E = exp(θ) at every line: the likeliest is the mean, whose logarithm has the variance 2/(ν n).
    #[test]
    fn a_level_is_the_mean_and_known_as_one() {
        let measured = [1.0, 4.0, 2.0, 9.0];
        let level = |theta: &[f64; 1]| Some(Expected { density: vec![theta[0].exp(); 4], by: [vec![theta[0].exp(); 4]] });
        let found = climb(&measured, [-3.0], &[(-50.0, 50.0)], level).unwrap();
        assert_relative_eq!(found.theta[0], 4.0_f64.ln(), max_relative = 1e-8);
        assert_relative_eq!(found.covariance[0][0], 0.25, max_relative = 1e-9);
        let bound = climb(&measured, [0.0], &[(-50.0, 1.0)], level).unwrap();
        assert_eq!(bound.theta, [1.0]);
    }
}
