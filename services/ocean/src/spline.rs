//! Natural cubic splines: uneven samples to even ones.

use std::sync::Arc;

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

/// Abscissae that curves go through, and what all curves through them share: several series of the same instants need it once.
#[derive(Debug, Clone, PartialEq)]
pub struct Knots {
    at: Vec<f64>,
    /// Of the eliminated tridiagonal system for the second derivatives (Thomas's algorithm), zero at both ends: what each row has of the next
    /// unknown, and of the one before; and 6 over its pivot.
    upper: Vec<f64>,
    lower: Vec<f64>,
    scale: Vec<f64>,
    /// The step after each knot but the last.
    width: Vec<f64>,
}

impl Knots {
    /// Abscissae that rise.
    ///
    /// # Errors
    /// [`SplineError`] for fewer than two, and what is not finite or not in order.
    pub fn new(at: Vec<f64>) -> Result<Self, SplineError> {
        let n = at.len();
        if n < 2 {
            return Err(SplineError::Points { knots: n, values: n });
        }
        let bad = |i: &usize| !at[*i].is_finite() || (*i > 0 && at[*i] <= at[*i - 1]);
        if let Some(index) = (0..n).find(bad) {
            return Err(SplineError::Order { index });
        }
        let [mut upper, mut lower, mut scale] = [(); 3].map(|()| vec![0.0; n]);
        let mut before = at[1] - at[0];
        for i in 1..n - 1 {
            let after = at[i + 1] - at[i];
            let pivot = 2.0 * (before + after) - before * upper[i - 1];
            (upper[i], lower[i], scale[i]) = (after / pivot, before / pivot, 6.0 / pivot);
            before = after;
        }
        let width = at.windows(2).map(|pair| pair[1] - pair[0]).collect();
        Ok(Self { at, upper, lower, scale, width })
    }

    /// The abscissae.
    #[must_use]
    pub fn at(&self) -> &[f64] {
        &self.at
    }

    /// Where to read curves through these knots: at `places`, which must not fall. Outside the knots the end segments are continued.
    #[must_use]
    pub fn places(&self, places: impl IntoIterator<Item = f64>) -> Places {
        let mut i = 0;
        // A sixth of the segment's square.
        let mut bent = self.width[0] * self.width[0] / 6.0;
        let weighed = |t: f64| {
            while i + 2 < self.at.len() && t > self.at[i + 1] {
                i += 1;
                bent = self.width[i] * self.width[i] / 6.0;
            }
            let b = (t - self.at[i]) / self.width[i];
            let a = 1.0 - b;
            Place { segment: i, values: [a, b], curvature: [(a * a * a - a) * bent, (b * b * b - b) * bent] }
        };
        Places(places.into_iter().map(weighed).collect())
    }

    /// Second derivatives at the knots of the curve through `values`, one for each.
    fn curvature(&self, values: &[f64]) -> Vec<f64> {
        let n = self.at.len();
        let mut curvature = vec![0.0; n];
        let mut slope_before = (values[1] - values[0]) / self.width[0];
        for i in 1..n - 1 {
            let slope_after = (values[i + 1] - values[i]) / self.width[i];
            curvature[i] = self.scale[i] * (slope_after - slope_before) - self.lower[i] * curvature[i - 1];
            slope_before = slope_after;
        }
        for i in (1..n - 1).rev() {
            curvature[i] -= self.upper[i] * curvature[i + 1];
        }
        curvature
    }
}

/// Places between knots, and how much each knot beside them counts.
#[derive(Debug, Clone, PartialEq)]
pub struct Places(Vec<Place>);

#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    /// The knot before.
    segment: usize,
    /// Weights of the values at this knot and the next, and of the second derivatives.
    values: [f64; 2],
    curvature: [f64; 2],
}

/// The smoothest curve through its points, with no curvature at its ends.
///
/// At five samples a wave it keeps 99 % of a sine's amplitude, where straight lines keep 87 %.
#[derive(Debug, Clone, PartialEq)]
pub struct Spline {
    knots: Arc<Knots>,
    values: Vec<f64>,
    curvature: Vec<f64>,
}

impl Spline {
    /// Through `values` at `knots`, which must rise.
    ///
    /// # Errors
    /// [`SplineError`] for fewer than two points, unequal lengths, what is not finite or not in order.
    pub fn new(knots: Vec<f64>, values: Vec<f64>) -> Result<Self, SplineError> {
        if knots.len() < 2 || values.len() != knots.len() {
            return Err(SplineError::Points { knots: knots.len(), values: values.len() });
        }
        let finite = values.iter().position(|value| !value.is_finite());
        match (Knots::new(knots), finite) {
            // The first that is bad, whatever is bad about it.
            (Err(SplineError::Order { index }), Some(value)) => Err(SplineError::Order { index: index.min(value) }),
            (Err(error), _) => Err(error),
            (Ok(knots), _) => Self::over(&Arc::new(knots), values),
        }
    }

    /// Through `values`, one at each of `knots`.
    ///
    /// # Errors
    /// [`SplineError`] for another number of values, and what is not finite.
    pub fn over(knots: &Arc<Knots>, values: Vec<f64>) -> Result<Self, SplineError> {
        if values.len() != knots.at.len() {
            return Err(SplineError::Points { knots: knots.at.len(), values: values.len() });
        }
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            return Err(SplineError::Order { index });
        }
        let curvature = knots.curvature(&values);
        Ok(Self { knots: Arc::clone(knots), values, curvature })
    }

    /// `count` values from `start`, `step` apart; `start` and all after must not lie before the first knot by more than they may
    /// be extrapolated: outside the knots the end segments are continued.
    #[must_use]
    pub fn sampled(&self, start: f64, step: f64, count: usize) -> Vec<f64> {
        let knots = &self.knots.at;
        // The last segment goes on for ever.
        let end = |i: usize| if i + 2 < knots.len() { knots[i + 1] } else { f64::INFINITY };
        let (mut i, mut cubic) = (0, self.cubic(0));
        let sample = |sample: usize| {
            let t = start + sample as f64 * step;
            while t > end(i) {
                i += 1;
                cubic = self.cubic(i);
            }
            let [c0, c1, c2, c3] = cubic;
            let u = t - knots[i];
            c0 + u * (c1 + u * (c2 + u * c3))
        };
        (0..count).map(sample).collect()
    }

    /// Coefficients of the powers of the distance from knot `i`, on the segment after it.
    fn cubic(&self, i: usize) -> [f64; 4] {
        let width = self.knots.width[i];
        let ([y0, y1], [c0, c1]) = ([self.values[i], self.values[i + 1]], [self.curvature[i], self.curvature[i + 1]]);
        [y0, (y1 - y0) / width - width * (2.0 * c0 + c1) / 6.0, 0.5 * c0, (c1 - c0) / (6.0 * width)]
    }

    /// The values at `places`, which must be those of its own knots; NaN at one that is not.
    #[must_use]
    pub fn read(&self, places: &Places) -> Vec<f64> {
        places.0.iter().map(|place| self.at(place)).collect()
    }

    fn at(&self, place: &Place) -> f64 {
        let segment = place.segment..place.segment + 2;
        match (self.values.get(segment.clone()), self.curvature.get(segment)) {
            (Some([y0, y1]), Some([c0, c1])) => {
                let ([a, b], [p, q]) = (place.values, place.curvature);
                a * y0 + b * y1 + (p * c0 + q * c1)
            }
            _ => f64::NAN,
        }
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

    /// Curves that share their knots are those that do not, wherever they are read.
    #[test]
    fn knots_can_be_shared() {
        let at: Vec<f64> = (0..40).map(|i| f64::from(i) * 0.1 + 0.03 * f64::from(i * 7 % 5)).collect();
        let knots = Arc::new(Knots::new(at.clone()).unwrap());
        let places: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.0211).collect();
        let shared = knots.places(places.iter().copied());
        for seed in 0..5 {
            let values: Vec<f64> = (0..40).map(|i| (f64::from(i * i + seed) * 0.7).sin()).collect();
            let read = Spline::over(&knots, values.clone()).unwrap().read(&shared);
            let own = Spline::new(at.clone(), values).unwrap();
            assert_eq!(read.len(), places.len());
            for (place, y) in places.iter().zip(read) {
                assert!((own.sampled(*place, 1.0, 1)[0] - y).abs() < 1e-12, "at {place}");
            }
        }
        let few = Spline::new(vec![0.0, 1.0], vec![0.0, 1.0]).unwrap();
        assert!(few.read(&shared).iter().any(|y| y.is_nan()), "places of other knots");
        assert!(matches!(Spline::over(&knots, vec![0.0; 39]), Err(SplineError::Points { knots: 40, values: 39 })));
        assert!(Knots::new(vec![0.0, f64::INFINITY]).is_err() && Knots::new(vec![0.0]).is_err());
    }

    /// The conditions that make a natural spline one, looked at from outside: it is a cubic on each segment, its first two derivatives have no steps at
    /// the knots, and the second is nothing at the ends.
    #[test]
    fn it_is_smooth_at_its_knots() {
        let at = vec![0.0, 0.4, 0.7, 1.5, 2.0, 2.9];
        let curve = Spline::new(at.clone(), vec![0.3, -1.0, 0.4, 2.0, -0.5, 0.1]).unwrap();
        let step = 1e-3;
        let y = |t: f64| curve.sampled(t, 1.0, 1)[0];
        // Third differences of a cubic are exact, whichever side of the knot it is continued from.
        let second = |t: f64, side: f64| (y(t + 2.0 * side * step) - 2.0 * y(t + side * step) + y(t)) / (step * step);
        let first = |t: f64, side: f64| side * (y(t + side * step) - y(t)) / step;
        for t in &at[1..5] {
            assert!((first(*t, 1.0) - first(*t, -1.0)).abs() < 0.1, "slope at {t}");
            assert!((second(*t, 1.0) - second(*t, -1.0)).abs() < 0.5, "curvature at {t}");
        }
        assert!(second(0.0, 1.0).abs() < 0.2 && second(2.9, -1.0).abs() < 0.2);
    }
}
