//! Filling in what a film does not show.

use super::film::{FilmError, Shape};

/// Sweeps of Gauss and Seidel over a hole: enough for holes of a few cells, and those of many start from a good guess.
const SWEEPS: usize = 24;

/// Fills all NaN of a film that has something else, too.
pub(super) fn fill(elevation_m: &mut [f32], shape: Shape) -> Result<(), FilmError> {
    let cells = shape.frame_cells();
    let mut kept = Vec::with_capacity(shape.frames);
    for (index, frame) in elevation_m.chunks_exact_mut(cells).enumerate() {
        let unseen = frame.iter().filter(|z| z.is_nan()).count();
        if 2 * unseen > cells {
            continue;
        }
        if unseen > 0 {
            fill_frame(frame, shape);
        }
        kept.push(index);
    }
    let lost = shape.frames - kept.len();
    if kept.is_empty() || 10 * lost > shape.frames {
        return Err(FilmError::Lost { lost, frames: shape.frames });
    }
    let mut next = 0;
    for index in 0..shape.frames {
        while next < kept.len() && kept[next] < index {
            next += 1;
        }
        if kept.get(next) == Some(&index) {
            continue;
        }
        // Before the first and after the last there is only one to take.
        let after = kept.get(next).or(kept.last()).copied().unwrap_or(index);
        let before = next.checked_sub(1).map_or(after, |previous| kept[previous]);
        let share = if after == before { 0.0 } else { (index as f32 - before as f32) / (after as f32 - before as f32) };
        for cell in 0..cells {
            let (a, b) = (elevation_m[before * cells + cell], elevation_m[after * cells + cell]);
            elevation_m[index * cells + cell] = a + share * (b - a);
        }
    }
    Ok(())
}

/// Fills the holes of a frame that is half seen at least: from their rims inwards by the mean of the neighbours that are known, and then
/// smooths until each filled cell is the mean of its neighbours.
fn fill_frame(frame: &mut [f32], shape: Shape) {
    let holes: Vec<usize> = (0..frame.len()).filter(|i| frame[*i].is_nan()).collect();
    let mut left = holes.clone();
    while !left.is_empty() {
        let ring: Vec<(usize, f32)> = left.iter().filter_map(|i| Some((*i, neighbours(frame, shape, *i)?))).collect();
        if ring.is_empty() {
            return;
        }
        ring.iter().for_each(|(i, z)| frame[*i] = *z);
        left.retain(|i| frame[*i].is_nan());
    }
    for _ in 0..SWEEPS {
        for i in &holes {
            if let Some(z) = neighbours(frame, shape, *i) {
                frame[*i] = z;
            }
        }
    }
}

/// Mean of the up to four neighbours that are known.
fn neighbours(frame: &[f32], shape: Shape, i: usize) -> Option<f32> {
    let (row, col) = (i / shape.cols, i % shape.cols);
    let (mut sum, mut count) = (0.0, 0.0);
    let mut take = |inside: bool, at: usize| {
        if let Some(z) = frame.get(at).filter(|z| inside && !z.is_nan()) {
            sum += z;
            count += 1.0;
        }
    };
    take(row > 0, i.wrapping_sub(shape.cols));
    take(row + 1 < shape.rows, i + shape.cols);
    take(col > 0, i.wrapping_sub(1));
    take(col + 1 < shape.cols, i + 1);
    (count > 0.0).then(|| sum / count)
}
