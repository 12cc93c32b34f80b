//! The chain: a stereo pair in, a patch of water surface out.

mod level;
mod range;
mod world;

use halcyon_model::{Plane, Preview, StereoPair, SurfacePatch};
use level::{FixedMount, level_by_thesis_m};
use nalgebra::{Vector2, Vector3};
use opencv::core::Vector;
use opencv::imgcodecs;
use opencv::prelude::VectorToVec;
use range::expected_range;
use rayon::prelude::*;
pub use world::WorldFromRectified;

use super::disparity::{Disparity, colour};
use super::grid::{GridError, Gridder, Sampling, SurfacePoint, remove_mean};
use super::matcher::{DisparityRange, Engine, MatchError, Matcher};
use super::plane::{self, DisparityPlane, Match, PlaneError};
use super::rectify::{RectifiedRig, Rectifier, RectifyError};
use super::refine::{Every, Refined, Refiner};
use super::scatter::Scatter;
use super::tilt::{TiltCorrection, TiltFilter};

/// What the chain can be told.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// The matching engine.
    pub engine: Engine,
    /// Its window, pixels, odd.
    pub block_px: u32,
    /// Search range where nothing better is known.
    pub range: DisparityRange,
    /// Water may lie this much above or below where the pose puts it, metres: waves and the autopilot's height error.
    pub height_margin_m: f64,
    /// Window of the least-squares refinement, pixels, odd; 0 leaves it out.
    pub refine_window_px: u32,
    /// Every so many pixels, in x and in y, become a point.
    pub point_stride_px: u32,
    /// Cell side of the grid, metres.
    pub cell_m: f64,
    /// Fewer points make no patch.
    pub points_min: usize,
    /// For the random choices of the robust plane fit.
    pub seed: u64,
    /// Whether the rig stands still (a tripod, a wave tank) and its pairs carry no pose. Then water is level against the mean of
    /// all planes seen, and its level is known by the distance. A carried rig whose carrier is silent is not a fixed one.
    pub fixed_rig: bool,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            engine: Engine::Guided,
            block_px: Engine::Guided.block_px_default(),
            range: DisparityRange { min_px: 0, max_px: 127 },
            height_margin_m: 0.75,
            refine_window_px: 11,
            point_stride_px: 2,
            cell_m: 0.15,
            points_min: 500,
            seed: 1,
            fixed_rig: false,
        }
    }
}

/// Disparity noise that is assumed where no refinement measures it, pixels: what semi-global matching leaves.
const SIGMA_UNREFINED_PX: f32 = 0.2;
/// Rounds of refinement: the first comes from a smoothed start within half a pixel, the second is for its curvature.
pub(crate) const REFINE_ROUNDS: u32 = 2;
/// A match that its own fit trusts less than this, pixels, is noise.
const SIGMA_MAX_PX: f32 = 0.5;
/// Points that one task works through.
const POINTS_A_CHUNK: usize = 4096;
/// Pixels that one task counts.
const PIXELS_A_CHUNK: usize = 1 << 18;
/// Rows of matches that one task collects.
const ROWS_A_BAND: usize = 32;
/// With fewer of the pixels matched than this the search range was wrong, or there was nothing to see.
const DENSITY_MIN: f64 = 0.25;

fn finite(values: &[f32]) -> usize {
    values.iter().filter(|value| value.is_finite()).count()
}

/// Why a pair became no patch.
#[derive(Debug, thiserror::Error)]
pub enum ReconstructError {
    /// The calibration or the size of the pictures.
    #[error("the pair cannot be rectified")]
    Rectify(#[from] RectifyError),
    /// The matcher.
    #[error("the pair cannot be matched")]
    Match(#[from] MatchError),
    /// So close that the two cameras share too little.
    #[error("at {height_m:.2} m the water is too close: disparities would reach {disparity_px:.0} of {width_px} px")]
    TooClose {
        /// Height of the camera above the water by the autopilot, metres.
        height_m: f64,
        /// What the disparity would be.
        disparity_px: f64,
        /// Width of the picture.
        width_px: u32,
    },
    /// No plane.
    #[error("no water surface was found")]
    Plane(#[from] PlaneError),
    /// No grid.
    #[error("the surface cannot be gridded")]
    Grid(#[from] GridError),
    /// OpenCV failed.
    #[error("OpenCV failed")]
    OpenCv(#[from] opencv::Error),
}

/// Turns the pairs of one rig into patches. Buffers, maps and what was learnt about the water's level are kept from pair to
/// pair; nothing else, so that a restart costs one full-range search and a few seconds of tilt statistics.
pub struct Reconstructor {
    settings: Settings,
    rectifier: Option<Rectifier>,
    matcher: Box<dyn Matcher>,
    refiner: Option<Refiner>,
    gridder: Gridder,
    scatter: Scatter,
    tilt: TiltFilter,
    mount: FixedMount,
    /// Level of the last patch above the datum, metres: where the autopilot's height has wandered to.
    level_m: f64,
    disparity: Disparity,
    refined: Refined,
    matches: Vec<Match>,
    /// The matches of so many rows each.
    bands: Vec<Vec<Match>>,
    points: Vec<SurfacePoint>,
    /// Mean of the points' horizontal positions: north, east, metres.
    centre: Vector2<f64>,
    /// Mean depth of the last pair's points in the rectified left camera, metres.
    mean_depth_m: f64,
    last_pair: Option<(halcyon_model::Stamp, halcyon_model::RigId)>,
    /// Of the last pair, in the rectified left camera.
    last_plane: Option<Plane>,
}

impl Reconstructor {
    /// With these settings.
    #[must_use]
    pub fn new(settings: Settings) -> Self {
        // Only points need a disparity.
        let every = if settings.point_stride_px.is_multiple_of(2) { Every::SecondPixel } else { Every::Pixel };
        let refiner = (settings.refine_window_px > 0).then(|| Refiner::new(settings.refine_window_px, REFINE_ROUNDS, every));
        Self {
            matcher: settings.engine.matcher(settings.block_px),
            refiner,
            settings,
            rectifier: None,
            gridder: Gridder::default(),
            scatter: Scatter::default(),
            tilt: TiltFilter::default(),
            mount: FixedMount::default(),
            level_m: 0.0,
            disparity: Disparity::default(),
            refined: Refined::default(),
            matches: Vec::new(),
            bands: Vec::new(),
            points: Vec::new(),
            centre: Vector2::zeros(),
            mean_depth_m: f64::NAN,
            last_pair: None,
            last_plane: None,
        }
    }

    /// The patch that a pair shows. `processing_s` is left 0: the core knows no clock.
    ///
    /// # Errors
    /// [`ReconstructError`]; the next pair may well succeed.
    pub fn reconstruct(&mut self, pair: &StereoPair) -> Result<SurfacePatch, ReconstructError> {
        self.last_pair = None;
        let rig = self.rectify(pair)?;
        let plane = self.match_surface(pair, &rig)?;
        let world = match &pair.pose {
            Some(pose) => WorldFromRectified::from_pose(pose, &pair.calibration, &rig),
            None if self.settings.fixed_rig => WorldFromRectified::from_plane(&self.mount.observe(&plane, &pair.calibration)),
            None => WorldFromRectified::from_plane(&plane),
        };
        let sampling = self.place_points(&plane, &rig, &world);
        let tilt = self.level_surface(pair, &plane, &world);
        let mut grid = self.gridder.grid(&self.points, self.settings.cell_m, sampling)?;
        self.scatter.apply(&mut grid, sampling.window_m);
        let level_m = remove_mean(&mut grid);
        let coverage = self.cover(&grid, &plane, &world, &rig);
        self.spread_tilt(&mut grid, tilt.sigma);
        let level = match &pair.pose {
            Some(pose) => {
                let centre = self.centre;
                let lever_m = (centre - Vector2::new(pose.position_ned_m.x, pose.position_ned_m.y)).norm();
                Some((level_m, pose.height_sigma_m.hypot(lever_m * pose.attitude_sigma_rad)))
            }
            None if self.settings.fixed_rig => Some((level_m, level::mean_sigma_m(&grid, sampling.window_m))),
            None => None,
        };
        // The level that a search may start from is the autopilot's wander; a fixed rig searches by its own pairs.
        self.level_m = if pair.pose.is_some() { level_m } else { 0.0 };
        self.last_pair = Some((pair.stamp, pair.rig.clone()));
        self.last_plane = Some(plane);
        Ok(SurfacePatch {
            stamp: pair.stamp,
            rig: pair.rig.clone(),
            sequence: pair.sequence,
            grid,
            coverage,
            plane,
            points: self.points.len() as u32,
            level_m: level.map(|(level_m, _)| level_m),
            level_sigma_m: level.map(|(_, sigma_m)| sigma_m),
            error_length_m: sampling.window_m,
            slope_removed: tilt.slope.into(),
            slope_sigma: tilt.sigma,
            attitude_sigma_rad: pair.pose.as_ref().map_or(0.0, |pose| pose.attitude_sigma_rad),
            level_thesis_m: pair.pose.as_ref().map(|pose| level_by_thesis_m(pose, self.mean_depth_m)),
            processing_s: 0.0,
        })
    }

    /// Pictures of the last pair that became a patch, for people; `None` before the first.
    ///
    /// # Errors
    /// OpenCV's, which only memory can cause.
    pub fn preview(&self) -> Result<Option<Preview>, ReconstructError> {
        let (Some((stamp, rig)), Some(rectifier)) = (&self.last_pair, &self.rectifier) else { return Ok(None) };
        let mut left_jpeg = Vector::<u8>::new();
        imgcodecs::imencode(
            ".jpg",
            rectifier.grey().0,
            &mut left_jpeg,
            &Vector::from_slice(&[imgcodecs::IMWRITE_JPEG_QUALITY, 80]),
        )?;
        Ok(Some(Preview {
            stamp: *stamp,
            rig: rig.clone(),
            left_jpeg: left_jpeg.to_vec().into(),
            disparity_png: colour::encode_png(&self.disparity())?.into(),
        }))
    }

    /// The disparity of the last pair, refined; pixels between those that became points are interpolated.
    #[must_use]
    pub fn disparity(&self) -> Disparity {
        self.refined.full(self.disparity.width_px, self.disparity.height_px)
    }

    /// The matches of the last pair that belong to the water, row by row; outliers are gone.
    #[must_use]
    pub fn matches(&self) -> &[Match] {
        &self.matches
    }

    /// The left picture of the last pair, rectified, 8-bit.
    #[must_use]
    pub fn left_grey(&self) -> Option<&opencv::core::Mat> {
        self.rectifier.as_ref().map(|rectifier| rectifier.grey().0)
    }

    /// The rectifier, which holds the last pair whose size fits its calibration, patch or no patch.
    #[must_use]
    pub fn rectifier(&self) -> Option<&Rectifier> {
        self.rectifier.as_ref()
    }

    /// Whether the last pair was searched about a plane only.
    #[must_use]
    pub fn was_guided(&self) -> bool {
        self.matcher.was_guided()
    }

    /// How many bytes the chain's own buffers hold.
    #[must_use]
    pub fn memory_bytes(&self) -> usize {
        let refined = self.refined.disparity.values_px.capacity() + self.refined.sigma_px.capacity();
        let floats = self.disparity.values_px.capacity() + refined;
        size_of::<f32>() * floats
            + size_of::<Match>() * (2 * self.matches.capacity())
            + size_of::<SurfacePoint>() * self.points.capacity()
            + self.rectifier.as_ref().map_or(0, Rectifier::memory_bytes)
            + self.refiner.as_ref().map_or(0, Refiner::memory_bytes)
            + self.matcher.memory_bytes()
    }

    /// The rectified cameras of the last pair.
    #[must_use]
    pub fn rectified_rig(&self) -> Option<&RectifiedRig> {
        self.rectifier.as_ref().map(Rectifier::rig)
    }

    fn rectify(&mut self, pair: &StereoPair) -> Result<RectifiedRig, RectifyError> {
        if self.rectifier.as_ref().is_none_or(|rectifier| rectifier.calibration() != &pair.calibration) {
            self.rectifier = Some(Rectifier::new(&pair.calibration)?);
        }
        // Just set; written so that no path can panic.
        let Some(rectifier) = &mut self.rectifier else { return Err(RectifyError::Invalid("size")) };
        rectifier.rectify(&pair.left, &pair.right)?;
        Ok(*rectifier.rig())
    }

    /// Matches in the range where the water should be; where that fails, in the full one.
    fn match_surface(&mut self, pair: &StereoPair, rig: &RectifiedRig) -> Result<Plane, ReconstructError> {
        let full =
            DisparityRange { max_px: self.settings.range.max_px.min(rig.width_px.saturating_sub(1)), ..self.settings.range };
        // Where less than a quarter of the picture is in common there is little to measure.
        let useful_px = rig.width_px * 3 / 4;
        let world = pair.pose.as_ref().map(|pose| WorldFromRectified::from_pose(pose, &pair.calibration, rig));
        let guide = self.guide(world.as_ref(), rig);
        let expected = world.and_then(|world| expected_range(&world, rig, self.level_m, self.settings.height_margin_m));
        let expected = expected.filter(|expected| expected.min_px < useful_px);
        let expected = expected.map(|range| DisparityRange { max_px: range.max_px.min(useful_px), ..range });
        let full = match expected {
            // A guide needs no narrow range, which would be wrong with it; but close to the water a wider one than was configured.
            Some(expected) if self.settings.engine == Engine::Guided => {
                DisparityRange { min_px: full.min_px.min(expected.min_px), max_px: full.max_px.max(expected.max_px) }
            }
            Some(expected) => {
                if let Ok(plane) = self.match_in(expected, guide, rig) {
                    return Ok(plane);
                }
                full
            }
            None => full,
        };
        self.match_in(full, guide, rig).map_err(|error| {
            let height_m = world.map_or(f64::INFINITY, |world| -world.origin_ned_m.z - self.level_m);
            let disparity_px = rig.focal_px * rig.baseline_m / height_m;
            let too_close = height_m > 0.0 && disparity_px > f64::from(useful_px);
            if too_close { ReconstructError::TooClose { height_m, disparity_px, width_px: rig.width_px } } else { error }
        })
    }

    /// Where the mean water plane should be: level water below the autopilot's pose, or else where it was.
    fn guide(&self, world: Option<&WorldFromRectified>, rig: &RectifiedRig) -> Option<DisparityPlane> {
        let plane = match world {
            Some(world) => Plane {
                normal: world.rotation.row(2).transpose(),
                distance_m: -world.origin_ned_m.z - self.level_m,
                rms_m: 0.0,
            },
            None => self.last_plane?,
        };
        if plane.distance_m > 0.0 { DisparityPlane::of(&plane, rig) } else { None }
    }

    fn match_in(
        &mut self,
        range: DisparityRange,
        guide: Option<DisparityPlane>,
        rig: &RectifiedRig,
    ) -> Result<Plane, ReconstructError> {
        let Some(rectifier) = &self.rectifier else { return Err(RectifyError::Invalid("size").into()) };
        let (left, right) = rectifier.grey();
        self.matcher.guide(guide);
        self.matcher.compute(left, right, range, &mut self.disparity)?;
        let enough = (DENSITY_MIN * self.disparity.values_px.len() as f64) as usize;
        let matched = self.disparity.values_px.par_chunks(PIXELS_A_CHUNK).map(finite).sum::<usize>();
        if matched < enough {
            return Err(PlaneError::TooFewPoints { points: matched, needed: enough }.into());
        }
        match &mut self.refiner {
            Some(refiner) => {
                let (left, right) = rectifier.exact();
                refiner.refine(left, right, &self.disparity, &mut self.refined)?;
            }
            None => {
                self.refined.every = Every::Pixel;
                self.refined.disparity.clone_from(&self.disparity);
                self.refined.sigma_px.clear();
                self.refined.sigma_px.resize(self.disparity.values_px.len(), SIGMA_UNREFINED_PX);
            }
        }
        let step = self.refined.every.step_px();
        let stride = self.settings.point_stride_px.max(1) as usize / step;
        // What a window saw beyond an edge was invented.
        let margin_px = self.window_px() / 2;
        let (disparity, sigma_px) = (&self.refined.disparity, &self.refined.sigma_px);
        let width = disparity.width_px as usize;
        let rows: Vec<u32> = (0..disparity.height_px).step_by(stride).collect();
        self.bands.resize_with(rows.len().div_ceil(ROWS_A_BAND), Vec::new);
        rows.par_chunks(ROWS_A_BAND).zip(&mut self.bands).for_each(|(rows, band)| {
            band.clear();
            for row in rows.iter().copied() {
                let Some(seen) = rectifier.seen(row * step as u32, margin_px) else { continue };
                let y_px = (row as usize * step) as f32;
                let sigmas_px = &sigma_px[row as usize * width..][..width];
                let disparities_px = disparity.row(row);
                for col in (0..width).step_by(stride) {
                    let (disparity_px, sigma_px) = (disparities_px[col], sigmas_px[col]);
                    let x = (col * step) as u32;
                    // Comparisons with NaN are false: what was not matched stays out.
                    if disparity_px > 0.0 && sigma_px <= SIGMA_MAX_PX && seen.has(x, disparity_px) {
                        band.push(Match { x_px: x as f32, y_px, disparity_px, sigma_px });
                    }
                }
            }
        });
        self.matches.clear();
        self.bands.iter().for_each(|band| self.matches.extend_from_slice(band));
        Ok(plane::fit(&mut self.matches, rig, self.settings.points_min, self.settings.seed)?)
    }

    /// Triangulates the matches into the local frame, each with its standard deviation, and says how densely they lie.
    fn place_points(&mut self, plane: &Plane, rig: &RectifiedRig, world: &WorldFromRectified) -> Sampling {
        let focal_baseline = rig.focal_px * rig.baseline_m;
        let place = |m: &Match| {
            let disparity_px = f64::from(m.disparity_px);
            let ray = rig.ray(f64::from(m.x_px), f64::from(m.y_px));
            let depth_m = focal_baseline / disparity_px;
            let ned_m = world.apply(&(ray * depth_m));
            // Depth error z²/(f b) · sigma moves the point along its ray. On the water below its new place the surface stands
            // where it stood, so the elevation error is the part of it along the plane's normal.
            let along_normal = plane.normal.dot(&ray);
            let sigma_m = f64::from(m.sigma_px) * depth_m / disparity_px * along_normal;
            SurfacePoint { north_m: ned_m.x, east_m: ned_m.y, up_m: -ned_m.z as f32, sigma_m: sigma_m as f32 }
        };
        let none = SurfacePoint { north_m: 0.0, east_m: 0.0, up_m: 0.0, sigma_m: 0.0 };
        self.points.resize(self.matches.len(), none);
        let chunks = self.matches.par_chunks(POINTS_A_CHUNK).zip(self.points.par_chunks_mut(POINTS_A_CHUNK));
        // Sums of fixed chunks: rounding does not depend on how many threads there are.
        let sums: Vec<Vector3<f64>> = chunks
            .map(|(matches, points)| {
                let mut sum = Vector3::zeros();
                for (m, point) in matches.iter().zip(points) {
                    *point = place(m);
                    sum += Vector3::new(point.north_m, point.east_m, focal_baseline / f64::from(m.disparity_px));
                }
                sum
            })
            .collect();
        let sum = sums.iter().sum::<Vector3<f64>>();
        let count = self.points.len().max(1) as f64;
        self.centre = sum.xy() / count;
        self.mean_depth_m = sum.z / count;
        let pixel_m = self.mean_depth_m / rig.focal_px;
        let window_px = self.window_px();
        Sampling {
            spacing_m: pixel_m * f64::from(self.settings.point_stride_px.max(1)),
            window_m: pixel_m * f64::from(window_px),
        }
    }

    /// Takes out the tilt that the attitude's error explains; returns what that was.
    fn level_surface(&mut self, pair: &StereoPair, plane: &Plane, world: &WorldFromRectified) -> TiltCorrection {
        let Some(pose) = &pair.pose else { return TiltCorrection { slope: Vector2::zeros(), sigma: 0.0 } };
        let normal = world.rotation * plane.normal;
        // Points on the plane have n · P = const; with up = −down its slope is n_north / n_down, n_east / n_down.
        let slope = Vector2::new(normal.x / normal.z, normal.y / normal.z);
        let forward = pose.ned_from_body * Vector3::x();
        let heading_rad = forward.y.atan2(forward.x);
        let correction = self.tilt.observe(pair.stamp, slope, heading_rad, pose.attitude_sigma_rad);
        let centre = self.centre;
        self.points.par_iter_mut().with_min_len(POINTS_A_CHUNK).for_each(|point| {
            let offset = Vector2::new(point.north_m, point.east_m) - centre;
            point.up_m -= correction.slope.dot(&offset) as f32;
        });
        correction
    }

    /// Side of the window that one disparity is made of, pixels.
    fn window_px(&self) -> u32 {
        self.refiner.as_ref().map_or(self.settings.block_px, Refiner::window_px)
    }

    /// Adds what an uncertain slope does to each cell's standard deviation.
    fn spread_tilt(&self, grid: &mut halcyon_model::ElevationGrid, slope_sigma: f64) {
        let centre = self.centre;
        let cols = grid.cols as usize;
        for (i, sigma) in grid.sigma_m.iter_mut().enumerate() {
            let north_m = grid.south_west_north_m + (i / cols) as f64 * grid.cell_m;
            let east_m = grid.south_west_east_m + (i % cols) as f64 * grid.cell_m;
            let lever_m = (Vector2::new(north_m, east_m) - centre).norm();
            *sigma = sigma.hypot((slope_sigma * lever_m) as f32);
        }
    }

    /// Share of the cells in view of both cameras that were measured. Cells of the grid's rectangle that lie outside the
    /// (possibly turned) footprint don't count against it.
    fn cover(&self, grid: &halcyon_model::ElevationGrid, plane: &Plane, world: &WorldFromRectified, rig: &RectifiedRig) -> f64 {
        let Some(rectifier) = &self.rectifier else { return 0.0 };
        let (mut in_view, mut measured) = (0_u32, 0_u32);
        let cols = grid.cols as usize;
        for (i, elevation) in grid.elevation_m.iter().enumerate() {
            let north_m = grid.south_west_north_m + (i / cols) as f64 * grid.cell_m;
            let east_m = grid.south_west_east_m + (i % cols) as f64 * grid.cell_m;
            let Some(seen) = world.on_plane(plane, north_m, east_m) else { continue };
            let (x_px, y_px) = (rig.focal_px * seen.x / seen.z + rig.cx_px, rig.focal_px * seen.y / seen.z + rig.cy_px);
            let inside =
                (0.0..f64::from(rig.width_px - 1)).contains(&x_px) && (0.0..f64::from(rig.height_px - 1)).contains(&y_px);
            let disparity_px = rig.focal_px * rig.baseline_m / seen.z;
            if seen.z > 0.0
                && inside
                && let Some(seen) = rectifier.seen(y_px.round() as u32, self.window_px() / 2)
                && seen.has(x_px.round() as u32, disparity_px as f32)
            {
                in_view += 1;
                measured += u32::from(elevation.is_finite());
            }
        }
        f64::from(measured) / f64::from(in_view.max(1))
    }
}
