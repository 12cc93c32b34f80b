//! The pictures: are they fit to be used, and where is the board in each?

use halcyon_model::Image;

use super::board::{self, BoardSpec};
use super::sighting::{Sighting, ViewProblem};
use super::{CalibrateError, ViewQuality};

/// The size that all pictures share.
pub(super) fn common_size(views: &[(Image, Image)]) -> Result<(u32, u32), CalibrateError> {
    let Some((first, _)) = views.first() else { return Err(CalibrateError::TooFewViews { views: 0, usable: 0 }) };
    let (width_px, height_px) = (first.width_px(), first.height_px());
    let differs = |image: &Image| (image.width_px(), image.height_px()) != (width_px, height_px);
    match views.iter().position(|(left, right)| differs(left) || differs(right)) {
        None => Ok((width_px, height_px)),
        Some(view) => Err(CalibrateError::MixedSizes {
            view,
            left_width_px: views[view].0.width_px(),
            left_height_px: views[view].0.height_px(),
            right_width_px: views[view].1.width_px(),
            right_height_px: views[view].1.height_px(),
            width_px,
            height_px,
        }),
    }
}

/// A picture given twice, or as left and right of one pair, is a slip that would pass for very good data.
pub(super) fn require_different(views: &[(Image, Image)]) -> Result<(), CalibrateError> {
    let sides = |(view, (left, right))| [(view, "left", left), (view, "right", right)];
    let pictures: Vec<(usize, &str, &Image)> =
        views.iter().enumerate().map(|(view, (l, r))| (view, (l, r))).flat_map(sides).collect();
    for (at, &(first, first_side, picture)) in pictures.iter().enumerate() {
        // Two pictures of nothing are alike, and harmless.
        let is_blank = picture.pixels().iter().all(|pixel| *pixel == picture.pixels()[0]);
        let again = pictures[at + 1..].iter().find(|(_, _, other)| !is_blank && other.pixels() == picture.pixels());
        if let Some(&(second, second_side, _)) = again {
            return Err(CalibrateError::SamePicture { first, first_side, second, second_side });
        }
    }
    Ok(())
}

/// Searches every picture for the board.
pub(super) fn look(
    views: &[(Image, Image)],
    board: &BoardSpec,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<(Vec<Sighting>, Vec<ViewQuality>), CalibrateError> {
    let mut sightings = Vec::new();
    let mut quality = Vec::with_capacity(views.len());
    for (view, (left, right)) in views.iter().enumerate() {
        let problem = match (board::find(left, board)?, board::find(right, board)?) {
            (Some(left), Some(right)) => {
                sightings.push(Sighting::new(view, left, right));
                None
            }
            (None, Some(_)) => Some(ViewProblem::NotFoundLeft),
            (Some(_), None) => Some(ViewProblem::NotFoundRight),
            (None, None) => Some(ViewProblem::NotFound),
        };
        quality.push(ViewQuality::without_board(problem));
        progress(view + 1, views.len());
    }
    Ok((sightings, quality))
}

/// A board can be found as a part of a larger one, each time another part: that calibrates, badly. So some of the pictures are
/// asked whether there is more of it. One of them may see another row in the clutter about the board; that most of them see
/// the same is no accident.
pub(super) fn require_whole(views: &[(Image, Image)], board: &BoardSpec, sightings: &[Sighting]) -> Result<(), CalibrateError> {
    const ASKED: usize = 5;
    let (cols, rows) = (board.cols(), board.rows());
    let asked = sightings.iter().take(ASKED);
    let mut larger: Vec<(u32, u32)> = Vec::new();
    for sighting in asked.clone() {
        let seen = board::find_larger(&views[sighting.view].0, (cols, rows))?;
        larger.extend(seen.map(|(a, b)| (a.max(b), a.min(b))).filter(|(long, short)| long * short > cols * rows));
    }
    let votes = |size: &(u32, u32)| larger.iter().filter(|other| *other == size).count();
    match larger.iter().max_by_key(|size| votes(size)) {
        Some(size) if 2 * votes(size) > asked.len() => Err(wrong_board(board, *size)),
        _ => Ok(()),
    }
}

/// Too few views have the board: because it is another one, because there is none, or just so.
pub(super) fn explain_missing(
    views: &[(Image, Image)],
    board: &BoardSpec,
    usable: usize,
) -> Result<CalibrateError, CalibrateError> {
    let (cols, rows) = (board.cols(), board.rows());
    if usable > 0 {
        return Ok(CalibrateError::TooFewViews { views: views.len(), usable });
    }
    // A few pictures tell; all of them would take long for nothing.
    for (left, _) in views.iter().take(5) {
        if let Some((seen_cols, seen_rows)) = board::find_larger(left, (BoardSpec::SIDE_CREDIBLE, BoardSpec::SIDE_CREDIBLE))?
            && (seen_cols, seen_rows) != (cols, rows)
            && (seen_rows, seen_cols) != (cols, rows)
        {
            return Ok(wrong_board(board, (seen_cols, seen_rows)));
        }
    }
    Ok(CalibrateError::NoBoard { cols, rows, pictures: 2 * views.len() })
}

/// Which side of a board is "along" depends on how it was held: the message has it as the board asked for.
fn wrong_board(board: &BoardSpec, (a, b): (u32, u32)) -> CalibrateError {
    let (cols, rows) = (board.cols(), board.rows());
    let (seen_cols, seen_rows) = if cols >= rows { (a.max(b), a.min(b)) } else { (a.min(b), a.max(b)) };
    CalibrateError::WrongBoard { cols, rows, seen_cols, seen_rows }
}
