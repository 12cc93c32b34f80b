//! Sums that a least-squares parabola over cells rests on, row by row.

use nalgebra::Matrix6;

/// Sums of the products of powers of x and y over cells, each 0 to 4 and both together no more.
#[derive(Default)]
pub(super) struct Moments([[f64; 5]; 5]);

impl Moments {
    /// Adds a row of cells, all at `y`, by the sums of the powers of their x.
    pub(super) fn add(&mut self, row: &[f64; 5], y: f64) {
        for (sums, of_y) in self.0.iter_mut().zip(powers(y)) {
            sums.iter_mut().zip(row).for_each(|(sum, of_x)| *sum += of_x * of_y);
        }
    }

    /// The sum of b bᵀ with b = (1, x, y, x², x y, y²).
    pub(super) fn normal(&self) -> Matrix6<f64> {
        // Powers of x and of y in each term of b.
        const POWERS: [(usize, usize); 6] = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)];
        Matrix6::from_fn(|i, j| self.0[POWERS[i].1 + POWERS[j].1][POWERS[i].0 + POWERS[j].0])
    }
}

/// Powers of x, 0 to 4.
pub(super) fn powers(x: f64) -> [f64; 5] {
    let x2 = x * x;
    [1.0, x, x2, x2 * x, x2 * x2]
}
