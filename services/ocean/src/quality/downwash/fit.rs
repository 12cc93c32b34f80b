//! The least-squares fit of one matrix for the sea and rings about a point.

use super::RingBin;
use super::band::{Band, ElevationGrid};

/// Rings at a dozen distances; a dozen sectors for the jackknife.
const BINS: usize = 12;
const SECTORS: usize = 12;
/// Least determinant of the normal equations over weight³: ½ where the point is seen from all sides, 0 from one.
const DETERMINANT_MIN: f64 = 0.03;
/// Cells that the taper weighs less than this are left out: what leaks from longer waves is largest at the edges.
const WEIGHT_MIN: f64 = 0.05;
/// A bin with a smaller share of all weight, in the corners, says nothing of its own.
const BIN_WEIGHT_MIN: f64 = 0.01;

/// A symmetric 2 × 2 matrix as (xx, √2 xy, yy), so that products of matrices are products of these.
type Symmetric = [f64; 3];

fn outer(v: [f64; 2]) -> Symmetric {
    [v[0] * v[0], std::f64::consts::SQRT_2 * v[0] * v[1], v[1] * v[1]]
}

fn dot(a: &Symmetric, b: &Symmetric) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Sums over the cells of one bin and sector.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    weight: f64,
    /// Σ R Rᵀ.
    riesz: Symmetric,
    /// Σ w u uᵀ.
    radial: Symmetric,
    /// Σ (u · R)².
    along: f64,
}

impl Cell {
    fn add(&mut self, other: &Self) {
        self.weight += other.weight;
        self.along += other.along;
        (0..3).for_each(|i| self.riesz[i] += other.riesz[i]);
        (0..3).for_each(|i| self.radial[i] += other.radial[i]);
    }
}

/// Where each cell lies about the point, and the sums so far.
pub(super) struct Sums {
    /// Of each cell its bin and unit vector; cells nearer than the least radius have none.
    places: Vec<Option<(usize, usize, [f64; 2])>>,
    radius_min_m: f64,
    width_m: f64,
    cells: Vec<Cell>,
}

/// Rings found.
pub(super) struct Rings {
    pub(super) ring_variance_m2: f64,
    pub(super) share: f64,
    pub(super) sigma: f64,
    pub(super) bins: Vec<RingBin>,
}

impl Sums {
    pub(super) fn new(grid: &ElevationGrid<'_>, below_m: [f64; 2], radius_min_m: f64) -> Self {
        let away = |place: usize| {
            let x_m = (place % grid.columns) as f64 * grid.cell_m - below_m[0];
            let y_m = (place / grid.columns) as f64 * grid.cell_m - below_m[1];
            [x_m, y_m]
        };
        let radii = (0..grid.elevation_m.len()).map(|place| away(place)[0].hypot(away(place)[1]));
        let (nearest_m, furthest_m) = radii.fold((f64::INFINITY, 0.0_f64), |(a, b), r| (a.min(r), b.max(r)));
        let radius_min_m = radius_min_m.max(nearest_m);
        let width_m = ((furthest_m - radius_min_m) / BINS as f64).max(grid.cell_m);
        let places = (0..grid.elevation_m.len())
            .map(|place| {
                let [x, y] = away(place);
                let radius_m = x.hypot(y);
                if !(radius_m >= radius_min_m && radius_m > 0.0) {
                    return None;
                }
                let bin = (((radius_m - radius_min_m) / width_m) as usize).min(BINS - 1);
                let turn = y.atan2(x) / std::f64::consts::TAU + 0.5;
                Some((bin, ((turn * SECTORS as f64) as usize).min(SECTORS - 1), [x / radius_m, y / radius_m]))
            })
            .collect();
        Self { places, radius_min_m, width_m, cells: vec![Cell::default(); BINS * SECTORS] }
    }

    /// The bin of each cell; those too near are the first's.
    pub(super) fn cells(&self) -> impl Iterator<Item = usize> {
        self.places.iter().map(|place| place.map_or(0, |(bin, _, _)| bin))
    }

    pub(super) fn add(&mut self, band: &Band, weights: &[f64]) {
        for (place, cell) in self.places.iter().enumerate() {
            let Some((bin, sector, unit)) = cell.filter(|_| band.is_known[place] && weights[place] >= WEIGHT_MIN) else {
                continue;
            };
            let (weight, riesz) = (weights[place], band.riesz_m[place]);
            let (radial, along) = (outer(unit).map(|x| weight * x), unit[0] * riesz[0] + unit[1] * riesz[1]);
            self.cells[bin * SECTORS + sector].add(&Cell { weight, riesz: outer(riesz), radial, along: along * along });
        }
    }

    /// Adds up what [`outward`] needs: of (change of elevation) × R its radial part, the radial part of the sea's, and the weight.
    pub(super) fn add_flow(&self, before: &Band, now: &Band, weights: &[f64], flow: &mut [f64; 3]) {
        // The sea's own flow F is the same everywhere; Σ F · u vanishes only if the point is seen evenly, so that F is taken off.
        let (mut sums, mut units, mut weight, mut radial) = ([0.0; 2], [0.0; 2], 0.0, 0.0);
        for (place, cell) in self.places.iter().enumerate() {
            let Some((_, _, unit)) =
                cell.filter(|_| before.is_known[place] && now.is_known[place] && weights[place] >= WEIGHT_MIN)
            else {
                continue;
            };
            let change = now.elevation_m[place] - before.elevation_m[place];
            let mean = |i: usize| 0.5 * (before.riesz_m[place][i] + now.riesz_m[place][i]);
            let moved = [change * mean(0), change * mean(1)];
            for i in 0..2 {
                sums[i] += moved[i];
                units[i] += weights[place] * unit[i];
                radial += moved[i] * unit[i];
            }
            weight += weights[place];
        }
        // Least squares of moved = w (F + Q u): Σ moved = F W + Q U, Σ moved · u = F · U + Q W.
        let seen = weight * weight - units[0] * units[0] - units[1] * units[1];
        flow[0] += weight * radial - sums[0] * units[0] - sums[1] * units[1];
        flow[1] += seen;
        flow[2] += weight * weight;
    }

    pub(super) fn band_variance_m2(&self) -> f64 {
        let all = total(&self.cells, &|_| true);
        (all.riesz[0] + all.riesz[2]) / all.weight
    }

    /// Rings and their standard error; `None` where the point is seen from too few sides.
    pub(super) fn solve(&self) -> Option<Rings> {
        let (sea, variances) = rings(&self.cells, &|_| true)?;
        let all = total(&self.cells, &|_| true);
        let share = |variances: &[(f64, f64)], all: &Cell| {
            variances.iter().map(|(q, weight)| q * weight).sum::<f64>() / (all.riesz[0] + all.riesz[2])
        };
        let mut without = Vec::with_capacity(SECTORS);
        for left_out in 0..SECTORS {
            let kept = |place: usize| place % SECTORS != left_out;
            if (0..self.cells.len()).any(|place| !kept(place) && self.cells[place].weight > 0.0) {
                without.push(share(&rings(&self.cells, &kept)?.1, &total(&self.cells, &kept)));
            }
        }
        let n = without.len() as f64;
        let mean = without.iter().sum::<f64>() / n;
        let sigma = ((n - 1.0) / n * without.iter().map(|s| (s - mean).powi(2)).sum::<f64>()).sqrt();
        let sea_m2 = (sea[0] + sea[2]).max(0.0);
        let mut nearer = 0.0;
        let bins = variances.iter().enumerate().map(|(bin, (q, weight))| {
            let from_m = self.radius_min_m + bin as f64 * self.width_m;
            // Rings go on outwards: a bin that cannot tell is like the one before it.
            let ring_variance_m2: f64 = if *weight >= BIN_WEIGHT_MIN * all.weight { q.max(0.0) } else { nearer };
            nearer = ring_variance_m2;
            let all_m2 = ring_variance_m2 + sea_m2;
            let share = if all_m2 > 0.0 { ring_variance_m2 / all_m2 } else { 0.0 };
            RingBin { from_m, to_m: from_m + self.width_m, ring_variance_m2, share }
        });
        let bins = bins.collect();
        let share = share(&variances, &all);
        Some(Rings { ring_variance_m2: share * (all.riesz[0] + all.riesz[2]) / all.weight, share, sigma, bins })
    }
}

fn total(cells: &[Cell], kept: &dyn Fn(usize) -> bool) -> Cell {
    let mut sum = Cell::default();
    cells.iter().enumerate().filter(|(place, _)| kept(*place)).for_each(|(_, cell)| sum.add(cell));
    sum
}

/// The sea's matrix, and of each bin the ring variance and weight, from the sectors kept.
///
/// Normal equations: Σ R Rᵀ = W T + Σ q_b S_b and Σ_b (u·R)² = ⟨T, S_b⟩ + q_b W_b, with S = Σ w u uᵀ; the second gives q_b, put into the first.
fn rings(cells: &[Cell], kept: &dyn Fn(usize) -> bool) -> Option<(Symmetric, Vec<(f64, f64)>)> {
    let bins: Vec<Cell> = (0..BINS).map(|bin| total(cells, &|place| place / SECTORS == bin && kept(place))).collect();
    let all = total(cells, kept);
    if all.weight.is_nan() || all.weight <= 0.0 || dot(&all.riesz, &[1.0, 0.0, 1.0]) <= 0.0 {
        return None;
    }
    let (mut matrix, mut right) = ([[0.0; 3]; 3], all.riesz.map(|x| x / all.weight));
    (0..3).for_each(|i| matrix[i][i] = 1.0);
    for bin in bins.iter().filter(|bin| bin.weight > 0.0) {
        for i in 0..3 {
            right[i] -= bin.along * bin.radial[i] / (bin.weight * all.weight);
            (0..3).for_each(|j| matrix[i][j] -= bin.radial[i] * bin.radial[j] / (bin.weight * all.weight));
        }
    }
    let (sea, determinant) = solve(matrix, right)?;
    if determinant < DETERMINANT_MIN {
        return None;
    }
    let ring = |bin: &Cell| if bin.weight > 0.0 { (bin.along - dot(&sea, &bin.radial)) / bin.weight } else { 0.0 };
    Some((sea, bins.iter().map(|bin| (ring(bin), bin.weight)).collect()))
}

/// Solves a 3 × 3 system by Cramer's rule, with its determinant; `None` where that is not a positive number.
pub(super) fn solve(matrix: [[f64; 3]; 3], right: [f64; 3]) -> Option<([f64; 3], f64)> {
    let determinant = |m: &[[f64; 3]; 3]| {
        m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0])
            + m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0])
    };
    let whole = determinant(&matrix);
    if whole.is_nan() || whole <= 0.0 {
        return None;
    }
    let with = |column: usize| {
        let mut replaced = matrix;
        (0..3).for_each(|row| replaced[row][column] = right[row]);
        determinant(&replaced) / whole
    };
    let answer = [with(0), with(1), with(2)];
    answer.iter().all(|x| x.is_finite()).then_some((answer, whole))
}

/// How much of the rings runs outwards: a ring cos(kr − ωt) has a radial flow of −q sin ωΔt from frame to frame, one that runs inwards the opposite.
/// `None` where the point is seen from one side or there are no rings.
pub(super) fn outward(flow: &[f64; 3], ring_variance_m2: f64) -> Option<f64> {
    let seen = flow[1] / flow[2];
    let radial_m2 = -flow[0] / flow[1];
    (seen > 0.05 && ring_variance_m2 > 0.0).then(|| radial_m2 / ring_variance_m2)
}
