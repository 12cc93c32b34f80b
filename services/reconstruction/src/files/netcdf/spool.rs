//! Patches that wait for the end of their series.

use std::fs::File;
use std::io::{BufWriter, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::Path;

use halcyon_model::{Plane, Stamp, SurfacePatch};

use super::{CELLS_MAX, FileError, SeriesError};
use crate::core::cloud::CloudFrame;

/// What is kept of a patch in memory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    pub(super) stamp: Stamp,
    pub(super) coverage: f64,
    pub(super) plane: Plane,
    pub(super) points: u32,
    pub(super) level_m: Option<f64>,
    pub(super) level_sigma_m: Option<f64>,
    pub(super) level_thesis_m: Option<f64>,
    pub(super) error_length_m: f64,
    pub(super) slope_removed: [f64; 2],
    pub(super) slope_sigma: f64,
    /// The patch's south-western cell on the lattice.
    first: [i64; 2],
    rows: usize,
    cols: usize,
    /// Where its cells are in the file, bytes.
    at: u64,
}

/// A rectangle of the lattice: row and column of its first cell, and how many.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Extent {
    pub(super) first: [i64; 2],
    pub(super) rows: usize,
    pub(super) cols: usize,
}

impl Extent {
    /// The smallest rectangle that holds both.
    fn union(self, other: Self) -> Self {
        let first = [self.first[0].min(other.first[0]), self.first[1].min(other.first[1])];
        let end = |axis: usize, mine: usize, its: usize| {
            (self.first[axis].saturating_add(mine as i64)).max(other.first[axis].saturating_add(its as i64))
        };
        Self {
            first,
            rows: end(0, self.rows, other.rows).saturating_sub(first[0]) as usize,
            cols: end(1, self.cols, other.cols).saturating_sub(first[1]) as usize,
        }
    }
}

/// The waiting patches.
pub(super) struct Spool {
    pub(super) entries: Vec<Entry>,
    pub(super) frame: CloudFrame,
    cells: BufWriter<File>,
    end: u64,
    shape: Option<Shape>,
    out: std::path::PathBuf,
}

/// What all patches share, and the rectangle so far.
#[derive(Debug, Clone, Copy)]
struct Shape {
    cell_m: f64,
    extent: Extent,
}

impl Spool {
    pub(super) fn beside(out: &Path, frame: CloudFrame) -> Result<Self, FileError> {
        let folder = match out.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => folder,
            _ => Path::new("."),
        };
        let cells = tempfile::tempfile_in(folder).map_err(|source| {
            // The library adds the folder's path to its text; ours names the file.
            FileError::Write { path: out.into(), source: source.kind().into() }
        })?;
        Ok(Self { entries: Vec::new(), frame, cells: BufWriter::new(cells), end: 0, shape: None, out: out.into() })
    }

    pub(super) fn push(&mut self, patch: &SurfacePatch) -> Result<(), SeriesError> {
        let grid = &patch.grid;
        let (rows, cols) = (grid.rows as usize, grid.cols as usize);
        let (cell_m, count) = (grid.cell_m, rows * cols);
        // Negated so that NaN is refused, too.
        if !(cell_m > 0.0 && count > 0 && grid.elevation_m.len() == count && grid.sigma_m.len() == count) {
            return Err(SeriesError::Mixed("has cells that are none"));
        }
        // Cell centres are half a cell beside the lattice; a cast of what is out of range saturates.
        let first = [grid.south_west_north_m, grid.south_west_east_m].map(|at_m| (at_m / cell_m - 0.5).round() as i64);
        let own = Extent { first, rows, cols };
        let shape = match self.shape {
            Some(shape) if (shape.cell_m - cell_m).abs() > 1e-9 * cell_m => return Err(SeriesError::Mixed("has another cell")),
            Some(shape) => Shape { extent: shape.extent.union(own), ..shape },
            None => Shape { cell_m, extent: own },
        };
        let (all_rows, all_cols) = (shape.extent.rows as f64, shape.extent.cols as f64);
        if all_rows * all_cols > CELLS_MAX as f64 {
            return Err(SeriesError::TooLarge { north_m: all_rows * cell_m, east_m: all_cols * cell_m, cell_m });
        }
        let entry = Entry {
            stamp: patch.stamp,
            coverage: patch.coverage,
            plane: patch.plane,
            points: patch.points,
            level_m: patch.level_m,
            level_sigma_m: patch.level_sigma_m,
            level_thesis_m: patch.level_thesis_m,
            error_length_m: patch.error_length_m,
            slope_removed: patch.slope_removed,
            slope_sigma: patch.slope_sigma,
            first,
            rows,
            cols,
            at: self.end,
        };
        for value in grid.elevation_m.iter().chain(&grid.sigma_m) {
            let written = self.cells.write_all(&value.to_le_bytes());
            written.map_err(|source| FileError::Write { path: self.out.clone(), source })?;
        }
        self.end += 8 * count as u64;
        self.shape = Some(shape);
        self.entries.push(entry);
        Ok(())
    }

    /// The common grid: side of a cell and its rectangle.
    pub(super) fn grid(&self) -> (f64, Extent) {
        let none = Extent { first: [0, 0], rows: 0, cols: 0 };
        self.shape.map_or((1.0, none), |shape| (shape.cell_m, shape.extent))
    }

    /// Centres of the common grid's rows (northwards) and columns (eastwards), metres.
    pub(super) fn axes(&self) -> (Vec<f64>, Vec<f64>) {
        let (cell_m, extent) = self.grid();
        let axis = |first: i64, count: usize| (0..count).map(|i| (first as f64 + i as f64 + 0.5) * cell_m).collect();
        (axis(extent.first[0], extent.rows), axis(extent.first[1], extent.cols))
    }

    /// Elevations and standard deviations of a patch on the common grid, NaN where it has none; in reused buffers.
    pub(super) fn read(&mut self, entry: &Entry, to: &mut Cells) -> std::io::Result<()> {
        let (_, extent) = self.grid();
        let count = entry.rows * entry.cols;
        self.cells.seek(SeekFrom::Start(entry.at))?;
        to.bytes.resize(8 * count, 0);
        self.cells.get_mut().read_exact(&mut to.bytes)?;
        let (row, col) = ((entry.first[0] - extent.first[0]) as usize, (entry.first[1] - extent.first[1]) as usize);
        let (elevations, sigmas) = to.bytes.split_at(4 * count);
        for (bytes, values) in [(elevations, &mut to.elevation_m), (sigmas, &mut to.sigma_m)] {
            values.clear();
            values.resize(extent.rows * extent.cols, f32::NAN);
            for (i, four) in bytes.chunks_exact(4).enumerate() {
                let at = (row + i / entry.cols) * extent.cols + col + i % entry.cols;
                values[at] = f32::from_le_bytes([four[0], four[1], four[2], four[3]]);
            }
        }
        Ok(())
    }
}

/// One patch on the common grid.
#[derive(Debug, Default)]
pub(super) struct Cells {
    pub(super) elevation_m: Vec<f32>,
    pub(super) sigma_m: Vec<f32>,
    bytes: Vec<u8>,
}
