//! The rig: every distortion model, flat or warped board, the best kept; from many starts, so that a bad minimum shows.

use halcyon_model::CameraIntrinsics;
use opencv::Result;

use super::board::BoardSpec;
use super::bundle::{Free, Guess, Scene, Solved, minimise};
use super::model::{DistortionModel, is_plausible};
use super::sighting::Sighting;
use super::start::{self, Cameras};

/// Ends of two searches are one where their errors differ by less than this share.
pub(super) const SAME_END: f64 = 1e-4;

/// One solution of the whole rig.
#[derive(Debug, Clone)]
pub(super) struct RigFit {
    pub(super) model: DistortionModel,
    /// Whether the board's warp is free.
    pub(super) warp: bool,
    pub(super) solved: Solved,
    pub(super) rms_px: f64,
}

impl RigFit {
    /// From `from`, with this model; `None` where that leads nowhere, or to what no lens could be.
    pub(super) fn new(scene: &Scene, from: &Guess, model: DistortionModel, warp: bool, size: (u32, u32)) -> Option<Self> {
        let solved = minimise(scene, from, &Free::rig(model, warp))?;
        let rms_px = solved.rms_px(scene);
        let sound = rms_px.is_finite() && is_plausible(&solved.guess.left, size) && is_plausible(&solved.guess.right, size);
        sound.then_some(Self { model, warp, solved, rms_px })
    }

    /// The same model again after a few points have gone.
    pub(super) fn again(&self, scene: &Scene, from: &Guess, size: (u32, u32)) -> Option<Self> {
        Self::new(scene, from, self.model, self.warp, size)
    }

    pub(super) fn free(&self) -> Free {
        Free::rig(self.model, self.warp)
    }

    /// The same error, and by the same cameras: to a hundredth of a pixel and a ten-thousandth of the baseline.
    fn agrees_with(&self, other: &Self) -> bool {
        let (a, b) = (&self.solved.guess, &other.solved.guess);
        let pixels = |a: &CameraIntrinsics, b: &CameraIntrinsics| {
            (a.matrix() - b.matrix()).abs().max() < 0.01
                && a.distortion.iter().zip(&b.distortion).all(|(a, b)| (a - b).abs() < 1e-3)
        };
        self.rms_px <= other.rms_px * (1.0 + SAME_END)
            && pixels(&a.left, &b.left)
            && pixels(&a.right, &b.right)
            && (a.right_from_left_m - b.right_from_left_m).norm() < 1e-4 * b.right_from_left_m.norm()
    }

    /// Bayesian information criterion, up to what all models share: n ln(mean square) + parameters · ln n.
    fn information(&self, scene: &Scene) -> f64 {
        let numbers = 2.0 * scene.corners() as f64;
        // Not below what a corner detector can ever reach: with exact corners there is nothing left to explain.
        numbers * (self.rms_px * self.rms_px).max(1e-12).ln() + self.free().count() as f64 * numbers.ln()
    }
}

/// The simplest model that the data do not refuse: the richer one only where it earns its coefficients (Bayesian information
/// criterion), and so the board's warp, where `may_warp`.
pub(super) fn choose(scene: &Scene, from: &Guess, may_warp: bool, size: (u32, u32)) -> Option<RigFit> {
    let mut best: Option<(f64, RigFit)> = None;
    for warp in [false, true] {
        if warp && !may_warp {
            break;
        }
        for model in DistortionModel::ALL {
            let from = best.as_ref().map_or(from, |(_, best)| &best.solved.guess);
            // What the best so far had and this model holds fixed starts, and stays, at zero.
            let Some(fit) = RigFit::new(scene, &from.without(&Free::rig(model, warp)), model, warp, size) else { continue };
            let score = fit.information(scene);
            if best.as_ref().is_none_or(|(least, _)| score < *least) {
                best = Some((score, fit));
            }
        }
    }
    best.map(|(_, fit)| fit)
}

/// What many starts came to.
#[derive(Debug, Clone)]
pub(super) struct Search {
    pub(super) best: RigFit,
    /// How many starts there were.
    pub(super) starts: usize,
    /// Of those, how many ended at the best.
    pub(super) agreeing: usize,
}

/// One model from many starts; `None` where none leads anywhere.
pub(super) fn search(
    sightings: &[Sighting],
    board: &BoardSpec,
    size: (u32, u32),
    starts: &[Cameras],
    (model, warp): (DistortionModel, bool),
) -> Result<Option<Search>> {
    let scene = Scene::new(sightings, board);
    let mut ends = Vec::with_capacity(starts.len());
    for cameras in starts {
        let from = start::guess(sightings, board, cameras)?;
        ends.extend(from.and_then(|from| RigFit::new(&scene, &from.without(&Free::rig(model, warp)), model, warp, size)));
    }
    let Some(best) = ends.iter().min_by(|a, b| a.rms_px.total_cmp(&b.rms_px)) else { return Ok(None) };
    let agreeing = ends.iter().filter(|end| end.agrees_with(best)).count();
    Ok(Some(Search { best: best.clone(), starts: starts.len(), agreeing }))
}
