//! Virtual gauges of a film: single cells, or weighted sums of all of them; and what each makes of a plane wave.

use rustfft::num_complex::Complex64;

use super::film::{Film, Shape};
use super::welch3::SpaceError;

/// What an array is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Gauges {
    /// Squares of cells, evenly spaced from edge to edge: each gauge is the mean of its cells.
    Points {
        /// Gauges along each side of the film.
        side: usize,
        /// Cells along each side of a gauge: 1 is a point, more have less noise.
        cells: usize,
    },
    /// Products of Gram's polynomials (orthogonal on the cells) up to this order in all: mean, two tilts, three curvatures, and so on. Each
    /// is a sum over all cells, which averages their noise. For films up to about a wavelength.
    Modes {
        /// The highest order, at most [`Gauges::ORDER_MAX`].
        order: usize,
    },
}

impl Gauges {
    /// Fewest gauges that tell a direction.
    pub const COUNT_MIN: usize = 3;
    /// Most gauges: the cross spectra of more want longer films than there are.
    pub const COUNT_MAX: usize = 64;
    /// The highest order of modes.
    pub const ORDER_MAX: usize = 6;
}

/// What has been taken off each frame before (or is not to be trusted): an array that is told so looks only at what is left, and knows what
/// was left of each wave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Removed {
    /// Nothing: elevations are above one and the same level.
    #[default]
    Nothing,
    /// Each frame's mean.
    Mean,
    /// Each frame's least-squares plane: mean and tilt.
    Plane,
}

impl Removed {
    fn orders(self) -> usize {
        match self {
            Self::Nothing => 0,
            Self::Mean => 1,
            Self::Plane => 2,
        }
    }
}

/// Gauges as sums over rows and columns.
pub(super) struct Sensors {
    /// Weights of the cells of a side, for the north and for the east: what gauges are products of.
    north: Vec<Vec<f64>>,
    east: Vec<Vec<f64>>,
    /// Each gauge's two weights.
    gauges: Vec<(usize, usize)>,
    /// The modes that have been removed, as weights, and how much of each is in a gauge: 0 for modes, which are orthogonal to them.
    removed: Vec<(usize, usize)>,
    parts: Vec<f64>,
    cell_m: f64,
}

impl Sensors {
    pub(super) fn new(gauges: Gauges, removed: Removed, shape: Shape, cell_m: f64) -> Result<Self, SpaceError> {
        let sides = [shape.rows, shape.cols];
        let pairs = |orders: usize| -> Vec<(usize, usize)> {
            (0..orders).flat_map(|total| (0..=total).map(move |i| (total - i, i))).collect()
        };
        let off = pairs(removed.orders());
        let refuse =
            |count: usize| SpaceError::Gauges { gauges: count, gauges_min: Gauges::COUNT_MIN, gauges_max: Gauges::COUNT_MAX };
        let (weights, gauges) = match gauges {
            Gauges::Modes { order } => {
                let all = pairs(order.min(Gauges::ORDER_MAX) + 1);
                if order > Gauges::ORDER_MAX || sides.iter().any(|n| *n <= order) {
                    return Err(refuse(all.len()));
                }
                (sides.map(|n| gram(n, order + 1)), all[off.len().min(all.len())..].to_vec())
            }
            Gauges::Points { side, cells } => {
                if !(2..=Gauges::COUNT_MAX).contains(&side) || cells < 1 || sides.iter().any(|n| *n < side || *n < cells) {
                    return Err(refuse(side.saturating_mul(side)));
                }
                let base = removed.orders();
                let weights = sides.map(|n| {
                    let points = (0..side).map(|i| {
                        let mut weights = vec![0.0; n];
                        let first = (i * (n - cells) + (side - 1) / 2) / (side - 1);
                        weights[first..first + cells].fill(1.0 / cells as f64);
                        weights
                    });
                    gram(n, base).into_iter().chain(points).collect::<Vec<_>>()
                });
                (weights, (0..side * side).map(|i| (base + i / side, base + i % side)).collect())
            }
        };
        if !(Gauges::COUNT_MIN..=Gauges::COUNT_MAX).contains(&gauges.len()) {
            return Err(refuse(gauges.len()));
        }
        let [north, east] = weights;
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let parts = gauges.iter().flat_map(|(a, b)| {
            off.iter().map(|(i, j)| dot(&north[*a], &north[*i]) * dot(&east[*b], &east[*j])).collect::<Vec<_>>()
        });
        let parts = parts.collect();
        Ok(Self { north, east, gauges, removed: off, parts, cell_m })
    }

    pub(super) fn len(&self) -> usize {
        self.gauges.len()
    }

    /// Each gauge from the sums for each pair of weights.
    fn gather<T: Copy + std::ops::Sub<Output = T> + std::ops::Mul<f64, Output = T>>(
        &self,
        pair: impl Fn((usize, usize)) -> T,
        mut out: impl FnMut(usize, T),
    ) {
        let removed: Vec<T> = self.removed.iter().map(|p| pair(*p)).collect();
        for (i, gauge) in self.gauges.iter().enumerate() {
            let parts = &self.parts[i * removed.len()..(i + 1) * removed.len()];
            out(i, parts.iter().zip(&removed).fold(pair(*gauge), |sum, (part, mode)| sum - *mode * *part));
        }
    }

    /// What each gauge reads, gauge by gauge, in each frame by frame.
    pub(super) fn read(&self, film: &Film) -> Vec<f64> {
        let (shape, count) = (film.shape(), self.east.len());
        let mut series = vec![0.0; self.len() * shape.frames];
        let mut sums = vec![0.0; self.north.len() * count];
        let east: Vec<Vec<f32>> = self.east.iter().map(|w| w.iter().map(|x| *x as f32).collect()).collect();
        for (t, frame) in film.elevation_m().chunks_exact(shape.frame_cells()).enumerate() {
            sums.fill(0.0);
            for (r, row) in frame.chunks_exact(shape.cols).enumerate() {
                for (b, east) in east.iter().enumerate() {
                    let sum = f64::from(row.iter().zip(east).map(|(z, w)| z * w).sum::<f32>());
                    self.north.iter().enumerate().for_each(|(a, north)| sums[a * count + b] += north[r] * sum);
                }
            }
            self.gather(|(a, b)| sums[a * count + b], |i, value| series[i * shape.frames + t] = value);
        }
        series
    }

    /// What each makes of waves of unit amplitude that come from along `k` (to the north and to the east, radians per metre).
    pub(super) fn transfer(&self, [north, east]: [f64; 2]) -> Vec<Complex64> {
        let sums = |weights: &[Vec<f64>], k: f64| -> Vec<Complex64> {
            let n = weights.first().map_or(0, Vec::len);
            let middle = 0.5 * (n as f64 - 1.0);
            let turns: Vec<_> = (0..n).map(|i| Complex64::from_polar(1.0, k * self.cell_m * (i as f64 - middle))).collect();
            weights.iter().map(|w| w.iter().zip(&turns).map(|(w, turn)| turn * w).sum()).collect()
        };
        let (along, across) = (sums(&self.north, north), sums(&self.east, east));
        let mut all = vec![Complex64::default(); self.len()];
        self.gather(|(a, b)| along[a] * across[b], |i, value| all[i] = value);
        all
    }
}

/// The first `count` of Gram's polynomials on `n` evenly spaced points, each of unit square.
fn gram(n: usize, count: usize) -> Vec<Vec<f64>> {
    let x = |i: usize| (2.0 * i as f64 - (n as f64 - 1.0)) / n as f64;
    let mut all: Vec<Vec<f64>> = Vec::with_capacity(count);
    for order in 0..count {
        // x times the last one is of the next order; what it has of the others is taken off, twice against rounding.
        let mut next: Vec<f64> = match all.last() {
            Some(last) if order > 0 => last.iter().enumerate().map(|(i, p)| x(i) * p).collect(),
            _ => vec![1.0; n],
        };
        for _ in 0..2 {
            for other in &all {
                let part: f64 = next.iter().zip(other).map(|(a, b)| a * b).sum();
                next.iter_mut().zip(other).for_each(|(a, b)| *a -= part * b);
            }
        }
        let norm = next.iter().map(|a| a * a).sum::<f64>().sqrt();
        next.iter_mut().for_each(|a| *a /= norm);
        all.push(next);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::super::synthetic::{PlaneWave, film};
    use super::*;
    use crate::dispersion::{Depth, wavenumber_radpm};

    const SHAPE: Shape = Shape { rows: 20, cols: 24, frames: 2 };

    /// A gauge reads the real part of what it makes of a wave, whether planes are taken off the film beforehand or not.
    #[test]
    fn gauges_read_what_they_make_of_waves() {
        let wave = PlaneWave::from(0.2, 0.5, 0.7, 0.0, Depth::DEEP);
        let k = wavenumber_radpm(std::f64::consts::TAU * 0.5, Depth::DEEP);
        let film = film(&[wave], SHAPE, 0.2, 4.0);
        // The phase where the array has its middle.
        let middle = 0.2 * (9.5 * wave.k_north_radpm + 11.5 * wave.k_east_radpm);
        for gauges in [Gauges::Modes { order: 3 }, Gauges::Points { side: 4, cells: 3 }] {
            for removed in [Removed::Nothing, Removed::Mean, Removed::Plane] {
                let sensors = Sensors::new(gauges, removed, SHAPE, 0.2).unwrap();
                let transfer = sensors.transfer([k * 0.7_f64.cos(), k * 0.7_f64.sin()]);
                for (i, (series, h)) in sensors.read(&film).chunks_exact(2).zip(transfer).enumerate() {
                    let expected = 0.2 * (h * Complex64::from_polar(1.0, -middle)).re;
                    assert!((series[0] - expected).abs() < 1e-5, "{gauges:?} {removed:?} {i}: {} {expected}", series[0]);
                }
            }
        }
    }

    #[test]
    fn of_a_plane_nothing_is_left_without_planes() {
        let plane = (0..960).map(|i| 0.3 + 0.02 * (i / 24 % 20) as f32 - 0.01 * (i % 24) as f32).collect();
        let film = Film::new(plane, SHAPE, 0.2, 4.0).unwrap();
        for gauges in [Gauges::Modes { order: 3 }, Gauges::Points { side: 4, cells: 3 }] {
            let sensors = Sensors::new(gauges, Removed::Plane, SHAPE, 0.2).unwrap();
            assert!(sensors.read(&film).iter().all(|z| z.abs() < 1e-5));
        }
    }

    #[test]
    fn arrays_have_their_limits() {
        let new = |gauges| Sensors::new(gauges, Removed::Plane, SHAPE, 0.2).map(|s| s.len());
        assert_eq!(new(Gauges::Modes { order: 2 }), Ok(3));
        for bad in [0, 1, 7, usize::MAX] {
            assert!(new(Gauges::Modes { order: bad }).is_err(), "{bad}");
        }
        for bad in [0, 1, 9, usize::MAX] {
            assert!(new(Gauges::Points { side: bad, cells: 1 }).is_err(), "{bad}");
        }
        for bad in [0, 21, usize::MAX] {
            assert!(new(Gauges::Points { side: 4, cells: bad }).is_err(), "{bad}");
        }
    }
}
