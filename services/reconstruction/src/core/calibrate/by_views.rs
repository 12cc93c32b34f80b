//! Error against the number of views (thesis figure 3-7), and against views that took no part, which is the honest figure.

use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

use super::VIEWS_MIN;
use super::bundle::{Free, Guess, Scene, View, minimise};
use super::fit::RigFit;

/// Subsets for each number of views: enough to see a trend through luck.
const SUBSETS_MAX: usize = 8;

/// Reprojection error of calibrations from `views` views.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorByViews {
    /// Views that a calibration was made of.
    pub views: usize,
    /// Random choices of views that were averaged.
    pub subsets: usize,
    /// Mean distance from seen to predicted corner in the views that were used (3-20), pixels. It **rises** with more views where
    /// the model is not perfect: few views can be fitted closely by a wrong camera.
    pub mean_error_px: f64,
    /// The same in the views that were not used (only the board's pose is fitted there), pixels: how well the calibration holds
    /// for pictures it has not seen. NaN where there are none.
    pub held_out_error_px: f64,
}

/// Calibrations from 3 views to all of them, each number averaged over seeded random subsets. Model as in `fit`.
pub(super) fn error_by_views(scene: &Scene, fit: &RigFit, size: (u32, u32), seed: u64) -> Vec<ErrorByViews> {
    let all = scene.views.len();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut order: Vec<usize> = (0..all).collect();
    let mut errors = Vec::new();
    for count in VIEWS_MIN..=all {
        let (mut inside, mut outside) = (Mean::default(), Mean::default());
        let mut subsets = 0;
        // One shuffled order, entered at evenly spaced places and followed in a ring: every view is in, and out, about equally often.
        order.shuffle(&mut random);
        let choices = if count == all { 1 } else { SUBSETS_MAX.min(all) };
        for choice in 0..choices {
            let mut ring = order.clone();
            ring.rotate_left(choice * all / choices);
            let (used, unused) = ring.split_at(count);
            let (used, unused) = (part(scene, &fit.solved.guess, used), part(scene, &fit.solved.guess, unused));
            // A subset that does not determine the cameras says nothing.
            let Some(found) = RigFit::new(&used.0, &used.1, fit.model, fit.warp, size) else { continue };
            subsets += 1;
            inside.add(&used.0, &found.solved.guess);
            if !unused.0.views.is_empty()
                && let Some(placed) = minimise(&unused.0, &Guess { poses: unused.1.poses, ..found.solved.guess }, &Free::POSES)
            {
                outside.add(&unused.0, &placed.guess);
            }
        }
        if subsets > 0 {
            let (mean_error_px, held_out_error_px) = (inside.value(), outside.value());
            errors.push(ErrorByViews { views: count, subsets, mean_error_px, held_out_error_px });
        }
    }
    errors
}

/// Some of the views, with their poses.
fn part(scene: &Scene, guess: &Guess, views: &[usize]) -> (Scene, Guess) {
    let pick: Vec<View> = views.iter().map(|&view| scene.views[view].clone()).collect();
    let poses = views.iter().map(|&view| guess.poses[view]).collect();
    (Scene { board: scene.board, views: pick }, Guess { poses, ..guess.clone() })
}

/// Mean distance from seen to predicted corner.
#[derive(Default)]
struct Mean {
    sum_px: f64,
    count: usize,
}

impl Mean {
    fn add(&mut self, scene: &Scene, guess: &Guess) {
        for (view, pose) in scene.views.iter().zip(&guess.poses) {
            let left = view.left.iter().map(|seen| (seen.pixel - guess.predict(&scene.board, pose, seen.corner).0).norm());
            let right = view.right.iter().map(|seen| (seen.pixel - guess.predict(&scene.board, pose, seen.corner).1).norm());
            self.sum_px += left.chain(right).sum::<f64>();
            self.count += view.left.len() + view.right.len();
        }
    }

    fn value(&self) -> f64 {
        self.sum_px / self.count as f64
    }
}
