//! Small Hermitian matrices: what likelihoods need of them.

use rustfft::num_complex::Complex64;

/// The lower triangle L of A = L Lᴴ.
pub(super) struct Cholesky {
    n: usize,
    lower: Vec<Complex64>,
}

impl Cholesky {
    /// Of the Hermitian `a`, row by row, of which the lower triangle is read; `None` unless it is positive definite.
    pub(super) fn of(a: &[Complex64], n: usize) -> Option<Self> {
        let mut lower = a.to_vec();
        for j in 0..n {
            let mut pivot = lower[j * n + j].re;
            for k in 0..j {
                pivot -= lower[j * n + k].norm_sqr();
            }
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            let root = pivot.sqrt();
            lower[j * n + j] = Complex64::new(root, 0.0);
            for i in j + 1..n {
                let mut sum = lower[i * n + j];
                for k in 0..j {
                    sum -= lower[i * n + k] * lower[j * n + k].conj();
                }
                lower[i * n + j] = sum / root;
            }
        }
        Some(Self { n, lower })
    }

    /// hᴴ A⁻¹ h, by way of `work`, which is as long as h.
    pub(super) fn inverse_form(&self, h: &[Complex64], work: &mut [Complex64]) -> f64 {
        let mut form = 0.0;
        for i in 0..self.n {
            let row = &self.lower[i * self.n..i * self.n + i];
            let sum = row.iter().zip(&*work).fold(h[i], |sum, (l, y)| sum - l * y);
            work[i] = sum / self.lower[i * self.n + i].re;
            form += work[i].norm_sqr();
        }
        form
    }
    /// A⁻¹ h in `work`, and hᴴ A⁻¹ h.
    pub(super) fn solve(&self, h: &[Complex64], work: &mut [Complex64]) -> f64 {
        let form = self.inverse_form(h, work);
        for i in (0..self.n).rev() {
            let (head, tail) = work.split_at(i + 1);
            let sum = tail.iter().zip(i + 1..self.n).fold(head[i], |sum, (y, k)| sum - self.lower[k * self.n + i].conj() * y);
            work[i] = sum / self.lower[i * self.n + i].re;
        }
        form
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A = [[2, i], [−i, 2]] has the inverse [[2, −i], [i, 2]]/3.
    #[test]
    fn the_inverse_of_two_by_two() {
        let c = Complex64::new;
        let a = [c(2.0, 0.0), c(0.0, 1.0), c(0.0, -1.0), c(2.0, 0.0)];
        let root = Cholesky::of(&a, 2).unwrap();
        let h = [c(1.0, 0.0), c(0.0, 2.0)];
        // hᴴ A⁻¹ h = (1·(2·1 + (−i)(2i)) + (−2i)(i·1 + 2·2i))/3 = (4 + 10)/3.
        assert!((root.inverse_form(&h, &mut [c(0.0, 0.0); 2]) - 14.0 / 3.0).abs() < 1e-12);
        let mut solved = [c(0.0, 0.0); 2];
        root.solve(&h, &mut solved);
        // (2·1 − i·2i, i·1 + 2·2i)/3.
        assert!((solved[0] - c(4.0 / 3.0, 0.0)).norm() < 1e-12 && (solved[1] - c(0.0, 5.0 / 3.0)).norm() < 1e-12);
        assert!(Cholesky::of(&[c(1.0, 0.0), c(2.0, 0.0), c(2.0, 0.0), c(1.0, 0.0)], 2).is_none());
        assert!(Cholesky::of(&[c(f64::NAN, 0.0)], 1).is_none());
    }
}
