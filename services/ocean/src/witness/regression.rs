//! Straight lines through pairs of elevations: a = intercept + slope · b.

/// Of one series on the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regression {
    /// Ordinary least squares of a on b: as if b had no error. Noise in b lowers it by the share that it has of b's variance.
    pub slope: f64,
    /// a where b is zero, metres, of the ordinary line.
    pub intercept_m: f64,
    /// Coefficient of determination R², as the thesis has it (figure 5-29): the square of Pearson's correlation.
    pub r_squared: f64,
    /// Reduced major axis: σ_a/σ_b with the correlation's sign. Right where both have errors in the proportion of their scatter.
    pub slope_reduced: f64,
    /// Deming's: both have errors, of known proportion (the sensors' noise variances); right where those are. The reduced major
    /// axis where both noises are given as zero.
    pub slope_deming: f64,
}

impl Regression {
    /// Of pairs (a, b), metres, with the noise of each, standard deviations in metres. `None` for fewer than three pairs or where
    /// one does not vary.
    #[must_use]
    pub fn of(pairs: impl Iterator<Item = (f64, f64)> + Clone, noise_a_m: f64, noise_b_m: f64) -> Option<Self> {
        let count = pairs.clone().count();
        if count < 3 {
            return None;
        }
        let (sum_a, sum_b) = pairs.clone().fold((0.0, 0.0), |(a, b), pair| (a + pair.0, b + pair.1));
        let (mean_a_m, mean_b_m) = (sum_a / count as f64, sum_b / count as f64);
        let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
        for (a, b) in pairs.map(|(a, b)| (a - mean_a_m, b - mean_b_m)) {
            aa += a * a;
            bb += b * b;
            ab += a * b;
        }
        if !(aa > 0.0 && bb > 0.0 && aa.is_finite() && bb.is_finite()) {
            return None;
        }
        let slope = ab / bb;
        let slope_reduced = (aa / bb).sqrt().copysign(ab);
        Some(Self {
            slope,
            intercept_m: mean_a_m - slope * mean_b_m,
            r_squared: (ab * ab / (aa * bb)).min(1.0),
            slope_reduced,
            slope_deming: deming(aa, bb, ab, noise_a_m * noise_a_m, noise_b_m * noise_b_m).unwrap_or(slope_reduced),
        })
    }

    /// Pearson's correlation of the pairs.
    #[must_use]
    pub fn correlation(&self) -> f64 {
        self.r_squared.sqrt().copysign(self.slope)
    }
}

/// Deming (1943); a noiseless b makes it ordinary. `None` where the proportion of noises is undefined or nothing correlates.
fn deming(aa: f64, bb: f64, ab: f64, noise_a_m2: f64, noise_b_m2: f64) -> Option<f64> {
    if ab == 0.0 || (noise_a_m2 == 0.0 && noise_b_m2 == 0.0) {
        return None;
    }
    // Weighed by both noises, so that one of them may be zero.
    let lean = noise_b_m2 * aa - noise_a_m2 * bb;
    let root = (lean * lean + 4.0 * noise_a_m2 * noise_b_m2 * ab * ab).sqrt();
    // Of the two forms of the same root the one without cancellation.
    let slope = if lean >= 0.0 { (lean + root) / (2.0 * noise_b_m2 * ab) } else { 2.0 * noise_a_m2 * ab / (root - lean) };
    slope.is_finite().then_some(slope)
}
