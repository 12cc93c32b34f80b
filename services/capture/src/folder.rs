//! A survey folder on disk: `rig.yaml`, `left/`, `right/` and `frames.csv`.

use std::path::{Path, PathBuf};

use halcyon_model::rig_yaml::{self, RigYamlError};
use halcyon_model::{Image, PoseAtExposure, RigCalibration, Stamp};
use nalgebra::Vector3;

use crate::core::frames::{self, FrameRow, FramesError};
use crate::pictures;

/// Endings that pictures may have, tried in this order.
const ENDINGS: [&str; 4] = ["png", "jpg", "jpeg", "bmp"];
/// `frames.csv` may be this long: a million rows.
const TABLE_BYTES_MAX: u64 = 1 << 27;

/// What is wrong with a survey folder.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// A file that cannot be read.
    #[error("{}: {problem}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// The calibration.
    #[error("{}", path.display())]
    Rig {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        source: RigYamlError,
    },
    /// The table of frames.
    #[error("{}", path.display())]
    Frames {
        /// Which file.
        path: PathBuf,
        /// What is wrong with it.
        source: FramesError,
    },
    /// A frame without its picture on one side.
    #[error("{}: no picture of frame {name:?} here (looked for .png, .jpg, .jpeg, .bmp)", folder.display())]
    Missing {
        /// The side's folder.
        folder: PathBuf,
        /// The frame.
        name: String,
    },
    /// A picture of another size than the rig's.
    #[error("{}: {} x {} px, but the rig takes {} x {} px", path.display(), size_px.0, size_px.1, rig_px.0, rig_px.1)]
    Size {
        /// Which file.
        path: PathBuf,
        /// Its size, pixels.
        size_px: (u32, u32),
        /// The rig's, pixels.
        rig_px: (u32, u32),
    },
}

/// A survey folder, checked when it is opened: every frame has both pictures. Pictures are read one by one.
#[derive(Debug)]
pub struct SurveyFolder {
    rig: RigCalibration,
    frames: Vec<Frame>,
}

/// One frame of it.
#[derive(Debug, Clone)]
pub struct Frame {
    /// Its row in `frames.csv`.
    pub row: FrameRow,
    left: PathBuf,
    right: PathBuf,
}

impl Frame {
    /// The left picture.
    #[must_use]
    pub fn left(&self) -> &Path {
        &self.left
    }

    /// The right picture.
    #[must_use]
    pub fn right(&self) -> &Path {
        &self.right
    }

    /// Mid-exposure.
    #[must_use]
    pub fn stamp(&self) -> Stamp {
        self.row.stamp
    }

    /// The carrier's pose, if the table has attitudes: over the local frame's origin, since a folder says nothing of where it was.
    /// The standard deviations are not in the table and so are the caller's.
    #[must_use]
    pub fn pose(&self, height_sigma_m: f64, attitude_sigma_rad: f64) -> Option<PoseAtExposure> {
        self.row.attitude.map(|attitude| PoseAtExposure {
            position_ned_m: Vector3::new(0.0, 0.0, -attitude.height_m),
            ned_from_body: attitude.ned_from_body,
            height_sigma_m,
            attitude_sigma_rad,
        })
    }
}

impl SurveyFolder {
    /// Opens a folder: reads `rig.yaml` and `frames.csv` and looks for every picture.
    ///
    /// # Errors
    /// [`FolderError`], naming the file and, where it has lines, the line.
    pub fn open(folder: &Path) -> Result<Self, FolderError> {
        Self::open_with(folder, find_picture)
    }

    /// As [`Self::open`], but a picture that is missing is found out when it is read: for those who count bad pairs and go on.
    ///
    /// # Errors
    /// [`FolderError`] for `rig.yaml` and `frames.csv`.
    pub fn open_tolerant(folder: &Path) -> Result<Self, FolderError> {
        let expected = |side: &Path, name: &str| side.join(format!("{name}.{}", ENDINGS[0]));
        Self::open_with(folder, |side, name| Ok(find_picture(side, name).unwrap_or_else(|_| expected(side, name))))
    }

    fn open_with(
        folder: &Path,
        find_picture: impl Fn(&Path, &str) -> Result<PathBuf, FolderError>,
    ) -> Result<Self, FolderError> {
        let rig_path = folder.join("rig.yaml");
        let text = read_text(&rig_path, rig_yaml::TEXT_BYTES_MAX as u64)?;
        let rig = rig_yaml::parse(&text).map_err(|source| FolderError::Rig { path: rig_path, source })?;
        let table_path = folder.join("frames.csv");
        let text = read_text(&table_path, TABLE_BYTES_MAX)?;
        let rows = frames::parse(&text).map_err(|source| FolderError::Frames { path: table_path, source })?;
        let frame = |row: FrameRow| {
            let left = find_picture(&folder.join("left"), &row.name)?;
            let right = find_picture(&folder.join("right"), &row.name)?;
            Ok(Frame { row, left, right })
        };
        Ok(Self { rig, frames: rows.into_iter().map(frame).collect::<Result<_, _>>()? })
    }

    /// The rig.
    #[must_use]
    pub fn rig(&self) -> &RigCalibration {
        &self.rig
    }

    /// All frames, oldest first; at least one.
    #[must_use]
    pub fn frames(&self) -> &[Frame] {
        &self.frames
    }

    /// Reads a frame's left and right picture as 8-bit grey.
    ///
    /// # Errors
    /// [`FolderError`] if either can't be read or has another size than the rig's.
    pub fn read(&self, frame: &Frame) -> Result<(Image, Image), FolderError> {
        let rig_px = (self.rig.width_px, self.rig.height_px);
        let read = |path: &PathBuf| {
            let image = pictures::read(path).map_err(|problem| FolderError::File { path: path.clone(), problem })?;
            let size_px = (image.width_px(), image.height_px());
            if size_px == rig_px { Ok(image) } else { Err(FolderError::Size { path: path.clone(), size_px, rig_px }) }
        };
        Ok((read(&frame.left)?, read(&frame.right)?))
    }
}

fn read_text(path: &Path, bytes_max: u64) -> Result<String, FolderError> {
    let file = |problem| FolderError::File { path: path.to_owned(), problem };
    let data = std::fs::metadata(path).map_err(|error| file(error.to_string()))?;
    // Opening a pipe that nobody writes to never ends.
    if !data.is_file() {
        return Err(file("it is a folder, a device or a pipe, not a file".into()));
    }
    let bytes = data.len();
    if bytes > bytes_max {
        return Err(file(format!("{bytes} bytes are more than the {bytes_max} that it may have")));
    }
    let bytes = std::fs::read(path).map_err(|error| file(error.to_string()))?;
    String::from_utf8(bytes).map_err(|error| {
        let line = 1 + error.as_bytes()[..error.utf8_error().valid_up_to()].iter().filter(|byte| **byte == b'\n').count();
        file(format!("line {line}: not UTF-8 text"))
    })
}

fn find_picture(folder: &Path, name: &str) -> Result<PathBuf, FolderError> {
    let given = Path::new(name).extension().and_then(|ending| ending.to_str()).map(str::to_lowercase);
    let has_ending = given.is_some_and(|ending| ENDINGS.contains(&ending.as_str()));
    let candidates = if has_ending {
        vec![folder.join(name)]
    } else {
        ENDINGS.iter().map(|ending| folder.join(format!("{name}.{ending}"))).collect()
    };
    let missing = || FolderError::Missing { folder: folder.to_owned(), name: name.to_owned() };
    candidates.into_iter().find(|path| path.is_file()).ok_or_else(missing)
}
