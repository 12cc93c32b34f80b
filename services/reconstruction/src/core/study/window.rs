//! Means over windows, and the best of nine windows (Fusiello, Roberto and Trucco 1997; fig. 4-9).

/// The largest window, pixels.
pub const SIDE_PX_MAX: u32 = 51;

/// Over what costs are averaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Windows {
    /// A window centred on the pixel.
    One,
    /// Nine windows that contain the pixel at their centre, in a corner or at the middle of a side; the least of the nine mean
    /// costs counts. Beside an edge of depth one of them lies on the pixel's own side.
    Nine,
}

/// Where the centres of the nine windows lie, seen from the pixel, (x, y) in pixels (fig. 4-9).
#[must_use]
pub fn nine_centres_px(window_px: u32) -> [(i32, i32); 9] {
    let half = (window_px / 2) as i32;
    std::array::from_fn(|i| ((i as i32 % 3 - 1) * half, (i as i32 / 3 - 1) * half))
}

/// The costs of all pixels at one disparity, as far as both pictures reach; row-major.
#[derive(Debug, Clone, Default)]
pub(super) struct Plane {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) values: Vec<f32>,
}

impl Plane {
    pub(super) fn resize(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.values.resize(width * height, 0.0);
    }

    /// Sets column j of each row to `cost(left, right)`, where these are the indices of (j + d, y) and (j, y) in pictures of
    /// `picture_width`.
    pub(super) fn fill(&mut self, picture_width: usize, d: usize, cost: impl Fn(usize, usize) -> f32) {
        for (y, row) in self.values.chunks_exact_mut(self.width).enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                *value = cost(y * picture_width + j + d, y * picture_width + j);
            }
        }
    }

    fn row(&self, y: usize) -> &[f32] {
        &self.values[y * self.width..][..self.width]
    }
}

/// Box means by running sums; keeps its buffers.
#[derive(Debug, Default)]
pub(super) struct BoxMean {
    columns: Vec<f64>,
    out: Vec<f32>,
}

impl BoxMean {
    /// Replaces each value by the mean over the `window_px × window_px` values around it, as many as there are.
    pub(super) fn smooth(&mut self, plane: &mut Plane, window_px: u32) {
        let half = (window_px / 2) as usize;
        if half == 0 {
            return;
        }
        let (width, height) = (plane.width, plane.height);
        self.columns.clear();
        self.columns.resize(width, 0.0);
        self.out.resize(width * height, 0.0);
        let add = |columns: &mut [f64], row: &[f32], sign: f64| {
            for (sum, value) in columns.iter_mut().zip(row) {
                *sum += sign * f64::from(*value);
            }
        };
        for row in 0..half.min(height) {
            add(&mut self.columns, plane.row(row), 1.0);
        }
        for y in 0..height {
            if y + half < height {
                add(&mut self.columns, plane.row(y + half), 1.0);
            }
            if y > half {
                add(&mut self.columns, plane.row(y - half - 1), -1.0);
            }
            let rows = (y + half + 1).min(height) - y.saturating_sub(half);
            let mut sum: f64 = self.columns[..half.min(width)].iter().sum();
            for (x, out) in self.out[y * width..][..width].iter_mut().enumerate() {
                if x + half < width {
                    sum += self.columns[x + half];
                }
                if x > half {
                    sum -= self.columns[x - half - 1];
                }
                let columns = (x + half + 1).min(width) - x.saturating_sub(half);
                *out = (sum / (rows * columns) as f64) as f32;
            }
        }
        std::mem::swap(&mut plane.values, &mut self.out);
    }

    /// Replaces each mean by the least of the nine at [`nine_centres_px`], as many as there are.
    pub(super) fn best_of_nine(&mut self, plane: &mut Plane, window_px: u32) {
        let half = (window_px / 2) as usize;
        let (width, height) = (plane.width, plane.height);
        self.out.resize(width * height, 0.0);
        // The least of three columns, then of three rows, is the least of nine.
        for (y, out) in self.out.chunks_exact_mut(width).enumerate() {
            let row = plane.row(y);
            for (x, out) in out.iter_mut().enumerate() {
                let before = x.checked_sub(half).map_or(f32::INFINITY, |x| row[x]);
                let after = row.get(x + half).copied().unwrap_or(f32::INFINITY);
                *out = row[x].min(before).min(after);
            }
        }
        for (y, to) in plane.values.chunks_exact_mut(width).enumerate() {
            let rows = [y.checked_sub(half), Some(y), Some(y + half).filter(|y| *y < height)];
            to.fill(f32::INFINITY);
            for row in rows.into_iter().flatten() {
                for (to, from) in to.iter_mut().zip(&self.out[row * width..][..width]) {
                    *to = to.min(*from);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    fn noise(width: usize, height: usize) -> Plane {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        Plane { width, height, values: (0..width * height).map(|_| random.random_range(0.0..255.0)).collect() }
    }

    /// The mean over the window around (x, y), by its definition.
    fn mean_at(plane: &Plane, x: i32, y: i32, half: i32) -> Option<f32> {
        let inside = |x: i32, y: i32| (0..plane.width as i32).contains(&x) && (0..plane.height as i32).contains(&y);
        let (mut sum, mut count) = (0.0, 0.0);
        for (x, y) in
            (-half..=half).flat_map(|dy| (-half..=half).map(move |dx| (x + dx, y + dy))).filter(|(x, y)| inside(*x, *y))
        {
            sum += f64::from(plane.values[y as usize * plane.width + x as usize]);
            count += 1.0;
        }
        inside(x, y).then_some((sum / count) as f32)
    }

    #[test]
    fn running_sums_are_means() {
        // Wider and narrower than the window, both ways.
        for (width, height, window_px) in [(13, 9, 5), (3, 9, 7), (13, 2, 7), (1, 1, 3), (8, 8, 1)] {
            let plane = noise(width, height);
            let mut smooth = plane.clone();
            BoxMean::default().smooth(&mut smooth, window_px);
            for (i, value) in smooth.values.iter().enumerate() {
                let expected = mean_at(&plane, (i % width) as i32, (i / width) as i32, window_px as i32 / 2).unwrap();
                assert!((value - expected).abs() < 1e-3, "{width} {height} {window_px} {i}: {value} {expected}");
            }
        }
    }

    #[test]
    fn nine_windows_contain_the_pixel() {
        assert_eq!(nine_centres_px(5)[0], (-2, -2));
        assert_eq!(nine_centres_px(5)[4], (0, 0));
        assert_eq!(nine_centres_px(5)[8], (2, 2));
        let (plane, window_px) = (noise(11, 7), 5);
        let mut best = plane.clone();
        let mut boxes = BoxMean::default();
        boxes.smooth(&mut best, window_px);
        boxes.best_of_nine(&mut best, window_px);
        for (i, value) in best.values.iter().enumerate() {
            let (x, y) = ((i % 11) as i32, (i / 11) as i32);
            let means = nine_centres_px(window_px).map(|(dx, dy)| mean_at(&plane, x + dx, y + dy, 2));
            let expected = means.into_iter().flatten().fold(f32::INFINITY, f32::min);
            assert!((value - expected).abs() < 1e-3, "{x} {y}: {value} {expected}");
        }
    }
}
