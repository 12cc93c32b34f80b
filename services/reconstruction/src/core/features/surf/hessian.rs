//! The fast-Hessian detector (Bay et al. 2008, section 3).

use super::integral::Integral;

/// Filter sides of each octave, pixels. A filter of side L stands for Gaussian derivatives at σ = 1.2 L / 9.
const SIDES_PX: [[usize; 4]; 4] = [[9, 15, 21, 27], [15, 27, 39, 51], [27, 51, 75, 99], [51, 99, 147, 195]];
/// Balances what boxes do to the mixed derivative (Bay et al. 2008, eq. 3 and 4).
const MIXED_WEIGHT: f32 = 0.9;

/// A maximum over place and scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Blob {
    pub(super) x_px: f32,
    pub(super) y_px: f32,
    pub(super) sigma_px: f32,
    pub(super) response: f32,
    pub(super) is_dark: bool,
}

/// Responses of one filter, on a grid of every `step` pixels.
pub(super) struct Layer {
    pub(super) cols: usize,
    rows: usize,
    pub(super) responses: Vec<f32>,
    is_dark: Vec<bool>,
}

impl Layer {
    pub(super) fn new(integral: &Integral, side: usize, step: usize) -> Self {
        let (cols, rows) = (integral.width.div_ceil(step), integral.height.div_ceil(step));
        let mut layer = Self { cols, rows, responses: vec![0.0; cols * rows], is_dark: vec![false; cols * rows] };
        let (half, lobe) = (side / 2, side / 3);
        let wide = 2 * lobe - 1;
        let scale = 1.0 / (side * side) as f32;
        // Where the filter would stick out of the picture the response stays 0: nothing is found there.
        let inside = |at: usize, limit: usize| at >= half && at + half < limit;
        for row in (0..rows).filter(|row| inside(row * step, integral.height)) {
            for col in (0..cols).filter(|col| inside(col * step, integral.width)) {
                let (x, y) = (col * step, row * step);
                // Three lobes side by side, weighed 1, −2, 1: all three less three times the middle one.
                let xx = integral.sum(x - half, y - lobe + 1, side, wide)
                    - 3.0 * integral.sum(x - lobe / 2, y - lobe + 1, lobe, wide);
                let yy = integral.sum(x - lobe + 1, y - half, wide, side)
                    - 3.0 * integral.sum(x - lobe + 1, y - lobe / 2, wide, lobe);
                let xy = integral.sum(x - lobe, y - lobe, lobe, lobe) + integral.sum(x + 1, y + 1, lobe, lobe)
                    - integral.sum(x + 1, y - lobe, lobe, lobe)
                    - integral.sum(x - lobe, y + 1, lobe, lobe);
                let (xx, yy, xy) = (xx * scale, yy * scale, MIXED_WEIGHT * xy * scale);
                let at = row * cols + col;
                layer.responses[at] = xx * yy - xy * xy;
                layer.is_dark[at] = xx + yy > 0.0;
            }
        }
        layer
    }

    fn at(&self, col: usize, row: usize) -> f32 {
        self.responses[row * self.cols + col]
    }
}

/// All maxima of at least `response_min`, place and scale interpolated.
pub(super) fn find_blobs(integral: &Integral, octaves: u32, response_min: f32) -> Vec<Blob> {
    let mut blobs = Vec::new();
    for (octave, sides) in SIDES_PX.iter().take(octaves as usize).enumerate() {
        let step = 1 << octave;
        let layers = sides.map(|side| Layer::new(integral, side, step));
        for middle in 1..3 {
            let three = [&layers[middle - 1], &layers[middle], &layers[middle + 1]];
            // What is new from one filter to the next, pixels of side.
            let growth = (sides[1] - sides[0]) as f32;
            for row in 1..layers[middle].rows.saturating_sub(1) {
                for col in 1..layers[middle].cols.saturating_sub(1) {
                    let response = layers[middle].at(col, row);
                    if response < response_min || !is_maximum(&three, col, row, response) {
                        continue;
                    }
                    // A neighbour without a response, at the border, would bend the parabola.
                    let Some([dx, dy, ds]) = offset(&three, col, row) else { continue };
                    let side = sides[middle] as f32 + ds * growth;
                    blobs.push(Blob {
                        x_px: (col as f32 + dx) * step as f32,
                        y_px: (row as f32 + dy) * step as f32,
                        sigma_px: 1.2 / 9.0 * side,
                        response,
                        is_dark: layers[middle].is_dark[row * layers[middle].cols + col],
                    });
                }
            }
        }
    }
    blobs
}

/// Whether a response is above all 26 around it. Of equals the first in reading order counts, so that a plateau is found once.
fn is_maximum(layers: &[&Layer; 3], col: usize, row: usize, response: f32) -> bool {
    for (k, layer) in layers.iter().enumerate() {
        for v in row - 1..=row + 1 {
            for u in col - 1..=col + 1 {
                let other = layer.at(u, v);
                let is_before = (k, v, u) < (1, row, col);
                if (k, v, u) != (1, row, col) && (other > response || (other == response && is_before)) {
                    return false;
                }
            }
        }
    }
    true
}

/// Where the maximum lies between the samples (Brown and Lowe 2002): x, y in samples, scale in filters. `None` where it lies
/// further off than its neighbours, or the curvature is no maximum's.
fn offset(layers: &[&Layer; 3], col: usize, row: usize) -> Option<[f32; 3]> {
    let value =
        |dx: i32, dy: i32, ds: i32| layers[(1 + ds) as usize].at((col as i32 + dx) as usize, (row as i32 + dy) as usize);
    let centre = value(0, 0, 0);
    let gradient = nalgebra::Vector3::new(
        (value(1, 0, 0) - value(-1, 0, 0)) / 2.0,
        (value(0, 1, 0) - value(0, -1, 0)) / 2.0,
        (value(0, 0, 1) - value(0, 0, -1)) / 2.0,
    );
    let xx = value(1, 0, 0) + value(-1, 0, 0) - 2.0 * centre;
    let yy = value(0, 1, 0) + value(0, -1, 0) - 2.0 * centre;
    let ss = value(0, 0, 1) + value(0, 0, -1) - 2.0 * centre;
    let xy = (value(1, 1, 0) + value(-1, -1, 0) - value(1, -1, 0) - value(-1, 1, 0)) / 4.0;
    let xs = (value(1, 0, 1) + value(-1, 0, -1) - value(1, 0, -1) - value(-1, 0, 1)) / 4.0;
    let ys = (value(0, 1, 1) + value(0, -1, -1) - value(0, 1, -1) - value(0, -1, 1)) / 4.0;
    let curvature = nalgebra::Matrix3::new(xx, xy, xs, xy, yy, ys, xs, ys, ss);
    let step = (-curvature).cholesky()?.solve(&gradient);
    (step.amax() <= 1.0).then(|| [step.x, step.y, step.z])
}
