//! Natural cubic splines: uneven samples to even ones.

/// Why no curve goes through the points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SplineError {
    /// Two are needed.
    #[error("a spline needs at least 2 points and a value for each, not {knots} and {values}")]
    Points {
        /// Abscissae given.
        knots: usize,
        /// Ordinates given.
        values: usize,
    },
    /// Not in order, not finite, or twice the same.
    #[error("point {index} of a spline is not finite or not after the one before")]
    Order {
        /// The first such point.
        index: usize,
    },
}

/// The smoothest curve through its points, with no curvature at its ends.
///
/// At five samples a wave it keeps 99 % of a sine's amplitude, where straight lines keep 87 %.
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    knots: Vec<f64>,
    values: Vec<f64>,
    curvature: Vec<f64>,
}

impl Spline {
    /// Through `values` at `knots`, which must rise.
    ///
    /// # Errors
    /// [`SplineError`] for fewer than two points, unequal lengths, what is not finite or not in order.
    pub fn new(knots: Vec<f64>, values: Vec<f64>) -> Result<Self, SplineError> {
        let n = knots.len();
        if n < 2 || values.len() != n {
            return Err(SplineError::Points { knots: n, values: values.len() });
        }
        let bad = |i: &usize| !(knots[*i].is_finite() && values[*i].is_finite()) || (*i > 0 && knots[*i] <= knots[*i - 1]);
        if let Some(index) = (0..n).find(bad) {
            return Err(SplineError::Order { index });
        }
        // The tridiagonal system for the second derivatives (Thomas's algorithm), zero at both ends.
        let mut curvature = vec![0.0; n];
        let mut upper = vec![0.0; n];
        // The step to each knot is the one from the last: worked out once.
        let step = |i: usize| {
            let width = knots[i + 1] - knots[i];
            (width, (values[i + 1] - values[i]) / width)
        };
        let (mut before, mut slope_before) = step(0);
        for i in 1..n - 1 {
            let (after, slope_after) = step(i);
            let bend = 6.0 * (slope_after - slope_before);
            let pivot = 2.0 * (before + after) - before * upper[i - 1];
            upper[i] = after / pivot;
            curvature[i] = (bend - before * curvature[i - 1]) / pivot;
            (before, slope_before) = (after, slope_after);
        }
        for i in (1..n - 1).rev() {
            curvature[i] -= upper[i] * curvature[i + 1];
        }
        Ok(Self { knots, values, curvature })
    }

    /// `count` values from `start`, `step` apart; `start` and all after must not lie before the first knot by more than they may
    /// be extrapolated: outside the knots the end segments are continued.
    #[must_use]
    pub fn sampled(&self, start: f64, step: f64, count: usize) -> Vec<f64> {
        let mut i = 0;
        (0..count)
            .map(|sample| {
                let t = start + sample as f64 * step;
                while i + 2 < self.knots.len() && t > self.knots[i + 1] {
                    i += 1;
                }
                let width = self.knots[i + 1] - self.knots[i];
                let (a, b) = ((self.knots[i + 1] - t) / width, (t - self.knots[i]) / width);
                a * self.values[i]
                    + b * self.values[i + 1]
                    + ((a * a * a - a) * self.curvature[i] + (b * b * b - b) * self.curvature[i + 1]) * width * width / 6.0
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_through_its_points_and_along_a_line() {
        let knots = vec![0.0, 0.3, 1.0, 1.7, 4.0];
        let line = Spline::new(knots.clone(), knots.iter().map(|t| 2.0 - 3.0 * t).collect()).unwrap();
        for (i, y) in line.sampled(0.0, 0.1, 41).iter().enumerate() {
            assert!((y - (2.0 - 0.3 * i as f64)).abs() < 1e-12);
        }
        let values = vec![1.0, -2.0, 5.0, 0.0, 3.0];
        let curve = Spline::new(knots.clone(), values.clone()).unwrap();
        for (t, y) in knots.iter().zip(values) {
            assert!((curve.sampled(*t, 1.0, 1)[0] - y).abs() < 1e-12);
        }
    }

    #[test]
    fn five_samples_a_wave_keep_their_amplitude() {
        let knots: Vec<f64> = (0..101).map(|i| f64::from(i) * 0.2).collect();
        let sine = |t: &f64| (std::f64::consts::TAU * t).sin();
        let curve = Spline::new(knots.clone(), knots.iter().map(sine).collect()).unwrap();
        for (i, y) in curve.sampled(2.0, 0.01, 1600).iter().enumerate() {
            assert!((y - sine(&(2.0 + 0.01 * i as f64))).abs() < 0.02, "{i} {y}");
        }
    }

    #[test]
    fn what_is_no_curve_is_refused() {
        assert!(matches!(Spline::new(vec![1.0], vec![1.0]), Err(SplineError::Points { .. })));
        assert!(matches!(Spline::new(vec![1.0, 2.0], vec![1.0]), Err(SplineError::Points { .. })));
        assert_eq!(Spline::new(vec![1.0, 1.0], vec![0.0, 0.0]), Err(SplineError::Order { index: 1 }));
        assert_eq!(Spline::new(vec![1.0, 2.0, 3.0], vec![0.0, 0.0, f64::NAN]), Err(SplineError::Order { index: 2 }));
    }
}
