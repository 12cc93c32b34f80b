//! Elevation maps over time as NetCDF-4: CF names for xarray and friends, and the layout of WASS for its tools.
//!
//! # One grid for all
//! A drone drifts, and every patch has its own rectangle. But all patches of a series have cells on one lattice (whole multiples
//! of the cell's side from the local origin), so that the same water is in the same cell: the file's grid is the smallest
//! rectangle of that lattice that holds all patches, NaN where a patch does not reach. Nothing is interpolated or cut.
//!
//! That rectangle is only known at the end. Until then the cells wait in a nameless file beside the result (it vanishes with the
//! process, however that ends), and a few numbers for each patch in memory. The result is written under a temporary name and
//! renamed when it is whole.

mod cf;
mod spool;
mod wass;

use std::path::{Path, PathBuf};

use halcyon_model::{RigCalibration, SurfacePatch};
use spool::Spool;

use super::{FileError, write_whole};
use crate::core::cloud::CloudFrame;

/// More cells than any survey's common grid needs: 400 × 400 m in cells of 20 cm.
const CELLS_MAX: i64 = 1 << 22;

/// Why there is no file.
#[derive(Debug, thiserror::Error)]
pub enum SeriesError {
    /// The operating system.
    #[error(transparent)]
    File(#[from] FileError),
    /// The NetCDF library.
    #[error("cannot write {}", path.display())]
    NetCdf {
        /// The file.
        path: PathBuf,
        /// What the library says.
        #[source]
        source: ::netcdf::Error,
    },
    /// The patches lie so far apart that one grid cannot hold them.
    #[error("the patches span {north_m:.0} x {east_m:.0} m, too much for one grid with cells of {cell_m} m")]
    TooLarge {
        /// From south to north, metres.
        north_m: f64,
        /// From west to east, metres.
        east_m: f64,
        /// Cell side, metres.
        cell_m: f64,
    },
    /// A patch that cannot share a grid with those before it.
    #[error("a patch {0}, unlike those before it")]
    Mixed(&'static str),
    /// Nothing to write.
    #[error("there is no patch to write")]
    Empty,
}

/// What a file says about its origin.
#[derive(Debug, Clone, PartialEq)]
pub struct About {
    /// The rig's calibration; the file carries all of it.
    pub calibration: RigCalibration,
    /// What made it, for the attribute `source`.
    pub source: String,
    /// One line for the attribute `history`: time (UTC) and command.
    pub history: String,
}

/// Collects patches and writes them.
pub struct Series {
    spool: Spool,
}

impl Series {
    /// An empty series of patches in this frame; their cells wait in the folder of `out` (which thereby proves writable).
    ///
    /// # Errors
    /// [`FileError::Write`], naming `out`.
    pub fn beside(out: &Path, frame: CloudFrame) -> Result<Self, FileError> {
        Ok(Self { spool: Spool::beside(out, frame)? })
    }

    /// Patches so far.
    #[must_use]
    pub fn len(&self) -> usize {
        self.spool.entries.len()
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.spool.entries.is_empty()
    }

    /// Adds a patch.
    ///
    /// # Errors
    /// [`SeriesError`] where it has another cell than those before it, lies too far from them, or the disk is full.
    pub fn push(&mut self, patch: &SurfacePatch) -> Result<(), SeriesError> {
        self.spool.push(patch)
    }

    /// Writes all patches with CF-1.8 names: `elevation(time, north, east)` above each patch's own mean level, its standard
    /// error, and for each time level, plane and coverage. `time` is unlimited, so that other tools can append. In the plane's frame
    /// the axes are `y` (to the top of the left picture) and `x` (to its right). Stamps without a date become seconds since the
    /// first; where there are none the variable `time` is left out.
    ///
    /// # Errors
    /// [`SeriesError`]; then nothing is left under `path`.
    pub fn write_cf(&mut self, path: &Path, about: &About) -> Result<(), SeriesError> {
        self.write(path, |file, spool| cf::fill(file, spool, about))
    }

    /// Writes all patches in the layout of WASS's `wassgridsurface`: `Z(count, X, Y)`, `X_grid` and `Y_grid` in millimetres,
    /// `time`, `scale` (the baseline, metres). `Z` is above the mean plane of all patches where the rig is fixed, and above each
    /// patch's own mean where it is carried: the autopilot's wander is no wave. As there, rows of `Y_grid` come first, whatever the dimensions are called. The
    /// camera's pictures, which `wassncplot` draws on, are not in it.
    ///
    /// # Errors
    /// [`SeriesError`]; then nothing is left under `path`.
    pub fn write_wass(&mut self, path: &Path, about: &About) -> Result<(), SeriesError> {
        self.write(path, |file, spool| wass::fill(file, spool, about))
    }

    fn write(
        &mut self,
        path: &Path,
        fill: impl FnOnce(&mut ::netcdf::FileMut, &mut Spool) -> Result<(), FillError>,
    ) -> Result<(), SeriesError> {
        if self.is_empty() {
            return Err(SeriesError::Empty);
        }
        let mut failed = None;
        let written = write_whole(path, |partial| {
            let filled = ::netcdf::create(partial).map_err(FillError::from).and_then(|mut file| {
                fill(&mut file, &mut self.spool)?;
                Ok(file.close()?)
            });
            match filled {
                Ok(()) => Ok(()),
                Err(FillError::Io(error)) => Err(error),
                Err(FillError::NetCdf(error)) => {
                    // The operating system's own codes are positive; the library keeps its text to itself.
                    if let ::netcdf::Error::Netcdf(code) = error
                        && code > 0
                    {
                        return Err(std::io::Error::from_raw_os_error(code));
                    }
                    failed = Some(error);
                    Err(std::io::Error::other("the NetCDF library refused"))
                }
            }
        });
        match (written, failed) {
            (_, Some(source)) => Err(SeriesError::NetCdf { path: path.into(), source }),
            (written, None) => Ok(written?),
        }
    }
}

/// While a file is filled either side may fail.
enum FillError {
    Io(std::io::Error),
    NetCdf(::netcdf::Error),
}

impl From<std::io::Error> for FillError {
    fn from(error: std::io::Error) -> Self {
        Self::Io(error)
    }
}

impl From<::netcdf::Error> for FillError {
    fn from(error: ::netcdf::Error) -> Self {
        Self::NetCdf(error)
    }
}

/// Adds a variable with its attributes, all text.
fn describe(variable: &mut ::netcdf::VariableMut<'_>, attributes: &[(&str, &str)]) -> Result<(), ::netcdf::Error> {
    for (name, value) in attributes {
        variable.put_attribute(name, *value)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests;
