//! Do left and right number the board's corners alike, and does each pair tell the same story about the rig?
//!
//! A board that looks the same when turned by 180° may be numbered from the other end in one of the two pictures. Each
//! numbering alone is a perfect calibration; together they put the right camera on its head. The rig is rigid, so the
//! relative pose of the two cameras must be the same in every view: the numbering with the widest agreement wins, and a pair
//! that agrees under no numbering is not a pair.

use halcyon_model::CameraIntrinsics;
use opencv::Result;

use super::board::BoardSpec;
use super::sighting::{Pose, Sighting, ViewProblem};

/// Two views of a rigid rig may differ by this much before refinement, radians: far above the error of a single board pose,
/// far below a wrong numbering (90° or 180°) or a swapped pair.
const ANGLE_MAX_RAD: f64 = 0.12;

/// Renumbers right-hand corners where that makes views agree, and marks the pairs that never do.
pub(super) fn settle(
    sightings: &mut [Sighting],
    board: &BoardSpec,
    left: &CameraIntrinsics,
    right: &CameraIntrinsics,
) -> Result<()> {
    let turns = board.turns();
    // The relative pose of the cameras for each view and each numbering of its right-hand corners.
    let mut relative: Vec<Vec<Option<Pose>>> = Vec::with_capacity(sightings.len());
    for sighting in sightings.iter() {
        let left_pose = Pose::of_board(board, &sighting.left, left)?;
        let mut row = Vec::with_capacity(turns.len());
        for turn in &turns {
            let renumbered: Vec<_> = turn.iter().map(|&i| sighting.right[i]).collect();
            let right_pose = Pose::of_board(board, &renumbered, right)?;
            row.push(left_pose.zip(right_pose).map(|(left, right)| left.to(&right)));
        }
        relative.push(row);
    }
    let distance = |row: &[Option<Pose>], rig: &Pose| {
        let angles = row.iter().enumerate().filter_map(|(turn, pose)| pose.map(|pose| (turn, pose.angle_rad(rig))));
        angles.min_by(|a, b| a.1.total_cmp(&b.1))
    };
    // Robust: a disagreeing view costs no more than the bound. Numberings as found are tried first, so they win ties.
    let cost = |rig: &Pose| {
        relative.iter().map(|row| distance(row, rig).map_or(ANGLE_MAX_RAD, |(_, angle)| angle.min(ANGLE_MAX_RAD))).sum::<f64>()
    };
    let candidates = (0..turns.len()).flat_map(|turn| relative.iter().filter_map(move |row| row[turn]));
    let mut best: Option<(f64, Pose)> = None;
    for candidate in candidates {
        let cost = cost(&candidate);
        // The margin keeps rounding from preferring a turned numbering over an equal one as found.
        if best.as_ref().is_none_or(|(least, _)| cost < least - 1e-6) {
            best = Some((cost, candidate));
        }
    }
    let Some((_, rig)) = best else { return Ok(()) };
    for (sighting, row) in sightings.iter_mut().zip(&relative) {
        match distance(row, &rig) {
            Some((turn, angle)) if angle <= ANGLE_MAX_RAD => {
                sighting.right = turns[turn].iter().map(|&i| sighting.right[i]).collect();
            }
            _ => sighting.problem = Some(ViewProblem::Inconsistent),
        }
    }
    Ok(())
}
