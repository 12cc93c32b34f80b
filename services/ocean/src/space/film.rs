//! A film of the sea: surface elevation on a square grid, frame after frame, checked once so that nothing after has to.

use super::fill;

/// Why elevations are no film.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FilmError {
    /// Rows times columns times frames is not what was given.
    #[error("{rows} x {cols} cells in {frames} frames are not {values} elevations")]
    Shape {
        /// Rows said.
        rows: usize,
        /// Columns said.
        cols: usize,
        /// Frames said.
        frames: usize,
        /// Elevations given.
        values: usize,
    },
    /// Too small to hold a wave.
    #[error("film has {rows} x {cols} cells in {frames} frames, needs at least 4 x 4 in 1")]
    TooSmall {
        /// Rows.
        rows: usize,
        /// Columns.
        cols: usize,
        /// Frames.
        frames: usize,
    },
    /// More cells than are worked on at once.
    #[error("film has {rows} x {cols} cells in {frames} frames, more than {cells_max} in all")]
    TooLarge {
        /// Rows.
        rows: usize,
        /// Columns.
        cols: usize,
        /// Frames.
        frames: usize,
        /// The most there may be.
        cells_max: usize,
    },
    /// The side of a cell is unusable.
    #[error("cells must be from 1e-4 to 1e5 m wide, not {cell_m} m")]
    Cell {
        /// As given, metres.
        cell_m: f64,
    },
    /// The frame rate is unusable.
    #[error("frame rate must be from 1e-6 to 1e6 Hz, not {rate_hz} Hz")]
    Rate {
        /// As given, hertz.
        rate_hz: f64,
    },
    /// Infinite, or too large for its square to be summed in single precision.
    #[error("elevation {index} of the film is {value_m} m, which is none")]
    Elevation {
        /// Index of the first such elevation.
        index: usize,
        /// It, metres.
        value_m: f32,
    },
    /// Too little of the sea was seen.
    #[error("{unseen} of the film's cells were not seen, at most {unseen_max} may be (shares of 1)")]
    Unseen {
        /// Share that is NaN.
        unseen: f64,
        /// Share that may be.
        unseen_max: f64,
    },
    /// Too many frames in which most was not seen.
    #[error("{lost} of {frames} frames show less than half their cells; at most one in ten may")]
    Lost {
        /// Such frames.
        lost: usize,
        /// All frames.
        frames: usize,
    },
}

/// How many cells there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shape {
    /// From south to north.
    pub rows: usize,
    /// From west to east.
    pub cols: usize,
    /// From the oldest on.
    pub frames: usize,
}

impl Shape {
    /// Cells in a frame.
    #[must_use]
    pub fn frame_cells(self) -> usize {
        self.rows * self.cols
    }
}

/// Elevation in metres, positive up, of square cells: the first row is the southernmost, the first column the westernmost, frames follow each
/// other at a constant rate. At least 4 x 4 cells, all finite: what was not seen has been filled (see [`Self::with_unseen_at_most`]).
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    elevation_m: Vec<f32>,
    shape: Shape,
    cell_m: f64,
    rate_hz: f64,
    filled: f64,
}

impl Film {
    /// The most cells in all: half a gibibyte of them, of which a spectrum takes as much again.
    pub const CELLS_MAX: usize = 1 << 27;
    /// The share of unseen cells that [`Self::new`] allows: what is filled in has less variance than what was seen.
    pub const UNSEEN_MAX: f64 = 0.25;
    /// Higher seas are refused: no sea is, and sums of the squares stay far from overflow.
    const ELEVATION_MAX_M: f32 = 1e4;

    /// Checks and wraps `elevation_m`: frame by frame, in each row by row, NaN where not seen.
    ///
    /// # Errors
    /// [`FilmError`], as [`Self::with_unseen_at_most`] with [`Self::UNSEEN_MAX`].
    pub fn new(elevation_m: Vec<f32>, shape: Shape, cell_m: f64, rate_hz: f64) -> Result<Self, FilmError> {
        Self::with_unseen_at_most(Self::UNSEEN_MAX, elevation_m, shape, cell_m, rate_hz)
    }

    /// Checks and wraps `elevation_m`, of which a share of `unseen_max` may be NaN.
    ///
    /// Holes are filled by the harmonic surface through their rims (Laplace's equation): it adds no crest and no trough. A frame of which
    /// less than half was seen is lost and is interpolated linearly, cell by cell, between the frames about it (the nearest at an end); one
    /// frame in ten may be.
    ///
    /// # Errors
    /// [`FilmError`] for fewer than 4 x 4 cells, more than [`Self::CELLS_MAX`], cells or rates that are none, infinite elevations, and too
    /// much that was not seen.
    pub fn with_unseen_at_most(
        unseen_max: f64,
        mut elevation_m: Vec<f32>,
        shape: Shape,
        cell_m: f64,
        rate_hz: f64,
    ) -> Result<Self, FilmError> {
        let Shape { rows, cols, frames } = shape;
        let cells = rows.checked_mul(cols).and_then(|n| n.checked_mul(frames));
        let too_large = FilmError::TooLarge { rows, cols, frames, cells_max: Self::CELLS_MAX };
        let cells = cells.filter(|n| *n <= Self::CELLS_MAX).ok_or(too_large)?;
        if rows < 4 || cols < 4 || frames < 1 {
            return Err(FilmError::TooSmall { rows, cols, frames });
        }
        if cells != elevation_m.len() {
            return Err(FilmError::Shape { rows, cols, frames, values: elevation_m.len() });
        }
        if !(1e-4..=1e5).contains(&cell_m) {
            return Err(FilmError::Cell { cell_m });
        }
        if !(1e-6..=1e6).contains(&rate_hz) {
            return Err(FilmError::Rate { rate_hz });
        }
        let mut unseen = 0_usize;
        for (index, &value_m) in elevation_m.iter().enumerate() {
            if value_m.is_nan() {
                unseen += 1;
            } else if value_m.abs() > Self::ELEVATION_MAX_M {
                return Err(FilmError::Elevation { index, value_m });
            }
        }
        let filled = unseen as f64 / cells as f64;
        if unseen > 0 {
            // A limit of NaN allows nothing.
            let allowed = filled <= unseen_max && unseen < cells;
            if !allowed {
                return Err(FilmError::Unseen { unseen: filled, unseen_max });
            }
            fill::fill(&mut elevation_m, shape)?;
        }
        Ok(Self { elevation_m, shape, cell_m, rate_hz, filled })
    }

    /// Elevations, metres: frame by frame, in each row by row.
    #[must_use]
    pub fn elevation_m(&self) -> &[f32] {
        &self.elevation_m
    }

    /// Elevations of frame `index`, metres, row by row; `None` past the last.
    #[must_use]
    pub fn frame_m(&self, index: usize) -> Option<&[f32]> {
        self.elevation_m.chunks_exact(self.shape.frame_cells()).nth(index)
    }

    /// How many cells there are.
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.shape
    }

    /// Side of a cell, metres.
    #[must_use]
    pub fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// Frames per second.
    #[must_use]
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Frames over the rate, seconds.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.shape.frames as f64 / self.rate_hz
    }

    /// Share of the cells that were not seen and have been filled in.
    #[must_use]
    pub fn filled_share(&self) -> f64 {
        self.filled
    }
}
