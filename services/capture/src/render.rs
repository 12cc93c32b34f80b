//! Simulated water to a survey folder, with its truth beside it: `halcyon sim render`.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use halcyon_model::{Stamp, rig_yaml};
use halcyon_sim::SimConfig;
use halcyon_sim::render::{RenderError, Renderer};
use halcyon_sim::rig::RigError;
use halcyon_sim::sea::SeaError;
use halcyon_sim::texture::Texture;
use halcyon_sim::water::Water;
use nalgebra::{UnitQuaternion, Vector3};

use crate::pictures;

/// What to render.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderOptions {
    /// Frames, 1 to 100,000.
    pub frames: usize,
    /// Frames per second, 0.1 to 200.
    pub rate_hz: f64,
    /// Mid-exposure of the first frame.
    pub start: Stamp,
    /// Place of the body, metres north of the fleet's origin.
    pub north_m: f64,
    /// Place of the body, metres east of the fleet's origin.
    pub east_m: f64,
    /// Mean height of the body above the mean water, metres.
    pub height_m: f64,
    /// Heading, degrees clockwise from true north.
    pub heading_deg: f64,
    /// Amplitude of slow roll and pitch, degrees; `frames.csv` tells them exactly.
    pub sway_deg: f64,
    /// Amplitude of slow heave, metres; `frames.csv` tells it exactly.
    pub sway_m: f64,
}

impl Default for RenderOptions {
    /// One minute at 5 Hz from 5 m, hanging still.
    fn default() -> Self {
        Self {
            frames: 300,
            rate_hz: 5.0,
            start: Stamp::from_nanos(1_750_000_000_000_000_000),
            north_m: 0.0,
            east_m: 0.0,
            height_m: 5.0,
            heading_deg: 0.0,
            sway_deg: 0.0,
            sway_m: 0.0,
        }
    }
}

/// Why nothing, or not everything, was rendered.
#[derive(Debug, thiserror::Error)]
pub enum RenderFolderError {
    /// An option out of range.
    #[error("{option} must be {expected}, not {value}")]
    Option {
        /// Which.
        option: &'static str,
        /// Its range.
        expected: &'static str,
        /// What it is.
        value: f64,
    },
    /// The folder holds something already.
    #[error("{} is not empty; give a folder that is, or that does not exist", .0.display())]
    NotEmpty(PathBuf),
    /// A file or folder that cannot be written.
    #[error("{}: {problem}", path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// The sea.
    #[error(transparent)]
    Sea(#[from] SeaError),
    /// The rig.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A picture.
    #[error(transparent)]
    Render(#[from] RenderError),
}

impl RenderOptions {
    fn validate(&self) -> Result<(), RenderFolderError> {
        for (option, value, low, high, expected) in [
            ("frames", self.frames as f64, 1.0, 1e5, "from 1 to 100000"),
            ("rate_hz", self.rate_hz, 0.1, 200.0, "from 0.1 to 200"),
            ("start", self.start.as_secs_f64(), 0.0, 9e9, "from 1970 to 2255"),
            ("north_m", self.north_m, -1e5, 1e5, "from -100000 to 100000"),
            ("east_m", self.east_m, -1e5, 1e5, "from -100000 to 100000"),
            ("height_m", self.height_m, 0.5, 200.0, "from 0.5 to 200"),
            ("heading_deg", self.heading_deg, -360.0, 360.0, "from -360 to 360"),
            ("sway_deg", self.sway_deg, 0.0, 30.0, "from 0 to 30"),
            ("sway_m", self.sway_m, 0.0, 5.0, "from 0 to 5"),
        ] {
            if !(low..=high).contains(&value) {
                return Err(RenderFolderError::Option { option, expected, value });
            }
        }
        Ok(())
    }

    /// Roll and pitch, degrees, and height, metres, at `t_s`: three slow sines of unrelated periods.
    fn sway(&self, t_s: f64) -> (f64, f64, f64) {
        let sine = |period_s: f64, turns: f64| (std::f64::consts::TAU * (t_s / period_s + turns)).sin();
        (self.sway_deg * sine(3.1, 0.0), self.sway_deg * sine(4.3, 0.2), self.height_m + self.sway_m * sine(5.9, 0.6))
    }
}

/// Renders simulated water to a survey folder: `rig.yaml`, `left/`, `right/`, `frames.csv` with the exact attitude, and the truth:
/// `truth.csv` (elevation of the water where the left camera's optical axis meets the mean level, metres) and `truth.json`
/// (`h_s_m`, the true significant height, and the seed). `progress(done, total)` is called after each frame.
///
/// # Errors
/// [`RenderFolderError`]; the folder must be empty or not exist yet. What was written before an error stays.
pub fn write_survey_folder(
    folder: &Path,
    sim: &SimConfig,
    options: &RenderOptions,
    mut progress: impl FnMut(usize, usize),
) -> Result<(), RenderFolderError> {
    options.validate()?;
    let water = Water::new(&sim.sea, sim.seed)?;
    let mut renderer = Renderer::new(&sim.rig, Arc::new(Texture::water(sim.seed)))?;
    let rig = *renderer.calibration();
    let (left, right) = (folder.join("left"), folder.join("right"));
    create(folder)?;
    if std::fs::read_dir(folder).is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(RenderFolderError::NotEmpty(folder.to_owned()));
    }
    create(&left)?;
    create(&right)?;
    save(&folder.join("rig.yaml"), &rig_yaml::write(&rig))?;

    let mut frames = String::from("name,stamp_s,roll_deg,pitch_deg,heading_deg,height_m\n");
    let mut truth = String::from("name,stamp_s,north_m,east_m,elevation_m\n");
    for index in 0..options.frames {
        let t_s = index as f64 / options.rate_hz;
        let stamp = options.start.plus_secs_f64(t_s);
        let (roll_deg, pitch_deg, height_m) = options.sway(t_s);
        let [roll, pitch, heading] = [roll_deg, pitch_deg, options.heading_deg].map(f64::to_radians);
        let ned_from_body = UnitQuaternion::from_euler_angles(roll, pitch, heading);
        let position_ned_m = Vector3::new(options.north_m, options.east_m, -height_m);
        let pair = renderer.render_pair(&water, &ned_from_body, position_ned_m, stamp, sim.seed)?;
        let name = format!("{index:06}");
        for (side, image) in [(&left, &pair.0), (&right, &pair.1)] {
            let path = side.join(format!("{name}.png"));
            pictures::write_png(&path, image).map_err(|problem| RenderFolderError::File { path, problem })?;
        }
        let camera_m = position_ned_m + ned_from_body * rig.camera_in_body_m;
        let axis = ned_from_body * (rig.body_from_camera * Vector3::z());
        let centre_m = camera_m - axis * (camera_m.z / axis.z);
        let elevation_m = water.elevation_m(centre_m.x, centre_m.y, stamp);
        // Nanoseconds as they are: seconds in a double would lose some.
        let (whole_s, nanos) = (stamp.as_nanos() / 1_000_000_000, stamp.as_nanos() % 1_000_000_000);
        let stamp_s = format!("{whole_s}.{nanos:09}");
        // Writing to a String cannot fail.
        let _ = writeln!(frames, "{name},{stamp_s},{roll_deg:.6},{pitch_deg:.6},{:.6},{height_m:.6}", options.heading_deg);
        let _ = writeln!(truth, "{name},{stamp_s},{:.6},{:.6},{elevation_m:.6}", centre_m.x, centre_m.y);
        progress(index + 1, options.frames);
    }
    save(&folder.join("frames.csv"), &frames)?;
    save(&folder.join("truth.csv"), &truth)?;
    save(&folder.join("truth.json"), &format!("{{\"h_s_m\": {:?}, \"seed\": {}}}\n", water.true_h_s_m(), sim.seed))
}

fn create(folder: &Path) -> Result<(), RenderFolderError> {
    let failed = |error: std::io::Error| RenderFolderError::File { path: folder.to_owned(), problem: error.to_string() };
    std::fs::create_dir_all(folder).map_err(failed)
}

fn save(path: &Path, text: &str) -> Result<(), RenderFolderError> {
    let failed = |error: std::io::Error| RenderFolderError::File { path: path.to_owned(), problem: error.to_string() };
    std::fs::write(path, text).map_err(failed)
}
