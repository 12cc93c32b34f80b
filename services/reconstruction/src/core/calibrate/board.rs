//! The checkerboard: its shape, and finding it in a picture.

use halcyon_model::Image;
use nalgebra::{Vector2, Vector3};
use opencv::core::{Mat, MatTraitConst, Point2f, Point3f, Size, TermCriteria, TermCriteria_Type, ToInputArray, Vector};
use opencv::prelude::VectorToVec;
use opencv::{calib3d, imgproc};

use super::CalibrateError;
use crate::core::cv;

/// Half a sub-pixel window is never wider: beyond that straight edges bend, with the lens.
const HALF_WINDOW_PX_MAX: i32 = 20;
/// Smaller windows than this would be all blur.
const HALF_WINDOW_PX_TO_BLUR: i32 = 4;
/// Standard deviation of the blur before the sub-pixel search, pixels.
const BLUR_PX: f64 = 1.0;

/// A checkerboard of `cols × rows` **inner** corners.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardSpec {
    cols: u32,
    rows: u32,
    square_m: f64,
}

impl BoardSpec {
    /// The fewest inner corners along a side that the detector can tell from clutter.
    const SIDE_MIN: u32 = 3;
    /// Fewer than this turn up in pictures of leaves and gravel.
    pub(super) const SIDE_CREDIBLE: u32 = 4;
    /// More than any board has.
    const SIDE_MAX: u32 = 64;

    /// Squares that a board can have, metres: from a microscope's slide to a house's wall.
    const SQUARE_M: std::ops::RangeInclusive<f64> = 1e-4..=100.0;

    /// A board of `cols × rows` inner corners whose squares are `square_m` wide.
    ///
    /// # Errors
    /// [`CalibrateError::Board`] unless both sides have 3 to 64 inner corners and the square is 0.1 mm to 100 m wide.
    pub fn new(cols: u32, rows: u32, square_m: f64) -> Result<Self, CalibrateError> {
        let sides = Self::SIDE_MIN..=Self::SIDE_MAX;
        if sides.contains(&cols) && sides.contains(&rows) && Self::SQUARE_M.contains(&square_m) {
            Ok(Self { cols, rows, square_m })
        } else {
            Err(CalibrateError::Board { cols, rows, square_m })
        }
    }

    /// Inner corners along a row.
    #[must_use]
    pub fn cols(&self) -> u32 {
        self.cols
    }

    /// Inner corners along a column.
    #[must_use]
    pub fn rows(&self) -> u32 {
        self.rows
    }

    /// Side of a square, metres.
    #[must_use]
    pub fn square_m(&self) -> f64 {
        self.square_m
    }

    /// Number of inner corners.
    #[must_use]
    pub fn corners(&self) -> usize {
        self.cols as usize * self.rows as usize
    }

    /// Corner `index` (row-major) in the board's own frame, metres: on z = 0, but for the board's warp.
    ///
    /// Printed boards bow. The two parameters are those of mrcal (`calobject_warp`): with x and y running from −1 to 1 over the
    /// corners' columns and rows, z = warp.x (1 − x²) + warp.y (1 − y²); each is how far the middle stands out.
    #[inline]
    pub(super) fn corner_m(&self, index: usize, warp_m: &Vector2<f64>) -> Vector3<f64> {
        let (row, col) = (index / self.cols as usize, index % self.cols as usize);
        Vector3::new(col as f64 * self.square_m, row as f64 * self.square_m, warp_m.dot(&self.bulge(index)))
    }

    /// How far corner `index` moves along z for each metre of the two warp parameters.
    #[inline]
    pub(super) fn bulge(&self, index: usize) -> Vector2<f64> {
        let (row, col) = (index / self.cols as usize, index % self.cols as usize);
        let along = |at: usize, count: u32| {
            let place = 2.0 * at as f64 / f64::from(count - 1) - 1.0;
            1.0 - place * place
        };
        Vector2::new(along(col, self.cols), along(row, self.rows))
    }

    /// The same corner of a flat board as OpenCV takes it.
    pub(super) fn corner_point3f(&self, index: usize) -> Point3f {
        let corner_m = self.corner_m(index, &Vector2::zeros());
        Point3f::new(corner_m.x as f32, corner_m.y as f32, 0.0)
    }

    fn size(&self) -> Size {
        Size::new(self.cols as i32, self.rows as i32)
    }

    /// The ways to renumber the corners that a picture cannot always tell apart: the board turned in its plane. A turn by
    /// 180° keeps `cols × rows`; a square board also allows 90° and 270°. Each maps "index in the turned numbering" to
    /// "index as found". (A mirrored numbering is ruled out beforehand: see [`find`].)
    pub(super) fn turns(&self) -> Vec<Vec<usize>> {
        let (cols, rows) = (self.cols as usize, self.rows as usize);
        let by = |map: &dyn Fn(usize, usize) -> usize| (0..rows * cols).map(|i| map(i / cols, i % cols)).collect::<Vec<_>>();
        let mut turns = vec![by(&|r, c| r * cols + c), by(&|r, c| (rows - 1 - r) * cols + (cols - 1 - c))];
        if rows == cols {
            turns.push(by(&|r, c| c * cols + (cols - 1 - r)));
            turns.push(by(&|r, c| (rows - 1 - c) * cols + r));
        }
        turns
    }
}

/// The inner corners of `board` in `image`, row-major, or `None` where the whole board is not seen.
///
/// Columns run to the right of rows as seen from the camera (x × y points away from it), so that a numbering is never
/// mirrored; which of the board's corners is first may still be ambiguous, see [`BoardSpec::turns`].
///
/// The sector-based detector goes first, quickly and then thoroughly (it knows blur); the classic one catches what it misses.
/// Whoever found the board, where exactly its corners are is for [`refine`].
pub(super) fn find(image: &Image, board: &BoardSpec) -> Result<Option<Vec<Point2f>>, opencv::Error> {
    let picture = cv::mat_from_image(image)?;
    let mut corners = Vector::<Point2f>::new();
    let quick = calib3d::CALIB_CB_NORMALIZE_IMAGE;
    let mut found = calib3d::find_chessboard_corners_sb(&picture, board.size(), &mut corners, quick)?;
    if !found {
        let thorough = quick | calib3d::CALIB_CB_EXHAUSTIVE | calib3d::CALIB_CB_ACCURACY;
        found = calib3d::find_chessboard_corners_sb(&picture, board.size(), &mut corners, thorough)?;
    }
    if !found {
        let flags = calib3d::CALIB_CB_ADAPTIVE_THRESH | calib3d::CALIB_CB_NORMALIZE_IMAGE;
        found = calib3d::find_chessboard_corners(&picture, board.size(), &mut corners, flags)?;
    }
    if !found || corners.len() != board.corners() {
        return Ok(None);
    }
    refine(&picture, board, &mut corners)?;
    let mut corners = corners.to_vec();
    if is_mirrored(&corners, board) {
        corners.chunks_mut(board.cols as usize).for_each(<[_]>::reverse);
    }
    Ok(Some(corners))
}

/// The board that a picture does show, of `least` inner corners a side or more: for the message when the expected one is
/// nowhere, and to notice that the expected one is but a part of it.
pub(super) fn find_larger(image: &Image, (cols, rows): (u32, u32)) -> Result<Option<(u32, u32)>, opencv::Error> {
    let picture = cv::mat_from_image(image)?;
    let (mut corners, mut meta) = (Vector::<Point2f>::new(), Mat::default());
    let flags = calib3d::CALIB_CB_NORMALIZE_IMAGE | calib3d::CALIB_CB_EXHAUSTIVE | calib3d::CALIB_CB_LARGER;
    let least = Size::new(cols as i32, rows as i32);
    let found = calib3d::find_chessboard_corners_sb_with_meta(&picture, least, &mut corners, flags, &mut meta)?;
    Ok(found.then(|| (meta.cols() as u32, meta.rows() as u32)))
}

/// Sub-pixel search (Förstner and Gülch 1987: where all gradients about the corner are at right angles to the way there).
///
/// The larger the window, the more edge it sees and the less noise is left: on OpenCV's sample boards the error of a whole
/// calibration falls from 0.27 px (the detector's own corners) over 0.23 (9 × 9 px) to 0.19. But a window must see one corner only: its own
/// corner, √2 of its half side away, reaches at most half way to the next. A slight blur takes noise off and moves no corner, whose
/// surroundings are the same turned by 180°.
fn refine(picture: &impl ToInputArray, board: &BoardSpec, corners: &mut Vector<Point2f>) -> Result<(), opencv::Error> {
    let cols = board.cols as usize;
    let points = corners.to_vec();
    let spacing_px = points
        .iter()
        .enumerate()
        .flat_map(|(i, p)| {
            let right = (i % cols + 1 < cols).then(|| points[i + 1]);
            let below = points.get(i + cols).copied();
            right.into_iter().chain(below).map(move |q| f64::from(p.x - q.x).hypot(f64::from(p.y - q.y)))
        })
        .fold(f64::INFINITY, f64::min);
    let half = ((spacing_px / (2.0 * std::f64::consts::SQRT_2)).floor() as i32).clamp(2, HALF_WINDOW_PX_MAX);
    let until = TermCriteria::new(TermCriteria_Type::COUNT as i32 + TermCriteria_Type::EPS as i32, 100, 1e-4)?;
    let (window, no_hole) = (Size::new(half, half), Size::new(-1, -1));
    if half < HALF_WINDOW_PX_TO_BLUR {
        return imgproc::corner_sub_pix(picture, corners, window, no_hole, until);
    }
    let mut smooth = Mat::default();
    imgproc::gaussian_blur_def(picture, &mut smooth, Size::new(0, 0), BLUR_PX)?;
    imgproc::corner_sub_pix(&smooth, corners, window, no_hole, until)
}

/// Whether rows and columns turn the wrong way round in the picture.
fn is_mirrored(corners: &[Point2f], board: &BoardSpec) -> bool {
    let (cols, rows) = (board.cols as usize, board.rows as usize);
    let (first, along, down) = (corners[0], corners[cols - 1], corners[(rows - 1) * cols]);
    let (a, b) = (along - first, down - first);
    a.x * b.y - a.y * b.x < 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn impossible_boards_are_refused() {
        for (cols, rows, square_m) in
            [(2, 6, 0.1), (9, 0, 0.1), (9, 65, 0.1), (9, 6, 0.0), (9, 6, -1.0), (9, 6, f64::NAN), (9, 6, 1e300)]
        {
            assert!(matches!(BoardSpec::new(cols, rows, square_m), Err(CalibrateError::Board { .. })), "{cols}x{rows}");
        }
    }

    /// Turning the picture of the numbering by its angle gives the turned numbering: checked with real rotation matrices.
    #[test]
    fn turns_are_rotations_of_the_board() {
        for (cols, rows) in [(4, 3), (3, 3)] {
            let board = BoardSpec::new(cols, rows, 1.0).unwrap();
            let flat = Vector2::zeros();
            let middle = board.corner_m(board.corners() - 1, &flat) / 2.0;
            for turn in board.turns() {
                let turned: Vec<_> = turn.iter().map(|&i| board.corner_m(i, &flat) - middle).collect();
                let (x, y) = (turned[1] - turned[0], turned[cols as usize] - turned[0]);
                assert!((x.cross(&y) - Vector3::z()).norm() < 1e-12, "a turn must not mirror");
                for (i, corner) in turned.iter().enumerate() {
                    let (row, col) = (i / cols as usize, i % cols as usize);
                    assert!((turned[0] + x * col as f64 + y * row as f64 - corner).norm() < 1e-12);
                }
            }
        }
    }
}
