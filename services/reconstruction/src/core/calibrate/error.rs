//! What can be wrong with pictures of a board.

use super::VIEWS_MIN;

/// Why there is no calibration.
#[derive(Debug, thiserror::Error)]
pub enum CalibrateError {
    /// No such board.
    #[error("a board needs 3 to 64 inner corners a side and squares of 0.0001 to 100 m, not {cols}x{rows} of {square_m} m")]
    Board {
        /// Inner corners along a row.
        cols: u32,
        /// Inner corners along a column.
        rows: u32,
        /// Side of a square, metres.
        square_m: f64,
    },
    /// Pictures of different sizes.
    #[error(
        "pair {} has pictures of {left_width_px}x{left_height_px} and {right_width_px}x{right_height_px} px, the first left one \
         has {width_px}x{height_px}: all must be of one size",
        view + 1
    )]
    MixedSizes {
        /// The first pair that differs, from 0.
        view: usize,
        /// Its left picture's width.
        left_width_px: u32,
        /// Its left picture's height.
        left_height_px: u32,
        /// Its right picture's width.
        right_width_px: u32,
        /// Its right picture's height.
        right_height_px: u32,
        /// What the first left picture has.
        width_px: u32,
        /// What the first left picture has.
        height_px: u32,
    },
    /// No board anywhere.
    #[error("no board of {cols}x{rows} inner corners was found in any of {pictures} pictures")]
    NoBoard {
        /// Inner corners along a row, as asked.
        cols: u32,
        /// Inner corners along a column, as asked.
        rows: u32,
        /// How many were searched.
        pictures: usize,
    },
    /// A board, but another one.
    #[error("the pictures show no board of {cols}x{rows} inner corners; they seem to show one of {seen_cols}x{seen_rows}")]
    WrongBoard {
        /// Inner corners along a row, as asked.
        cols: u32,
        /// Inner corners along a column, as asked.
        rows: u32,
        /// What a picture shows.
        seen_cols: u32,
        /// What a picture shows.
        seen_rows: u32,
    },
    /// Too few views to fix the cameras.
    #[error(
        "{usable} of {views} pairs can be used (the board seen whole on both sides, and left agreeing with right); at least {VIEWS_MIN} are needed"
    )]
    TooFewViews {
        /// Pairs given.
        views: usize,
        /// Pairs that can be used.
        usable: usize,
    },
    /// Views that do not fix a camera.
    #[error("{views} views do not determine the cameras: show the board tilted in several directions, near and far")]
    Degenerate {
        /// Views that were tried.
        views: usize,
    },
    /// One picture given for two.
    #[error(
        "the {first_side} picture of pair {} and the {second_side} picture of pair {} are the very same: each must be its own",
        first + 1, second + 1
    )]
    SamePicture {
        /// A pair that has it, from 0.
        first: usize,
        /// Left or right.
        first_side: &'static str,
        /// The other; the same number where left and right of one pair are the same.
        second: usize,
        /// Left or right.
        second_side: &'static str,
    },
    /// The right camera is left of the left one.
    #[error("the right camera came out {baseline_m:.3} m to the left of the left one: the left and right pictures are swapped")]
    Swapped {
        /// How far.
        baseline_m: f64,
    },
    /// The depth that the map of uncertainty is asked for.
    #[error("depth uncertainty is told for a distance above 0 m, not {distance_m} m")]
    Distance {
        /// As asked.
        distance_m: f64,
    },
    /// Corners that were given rather than found.
    #[error("pair {} has {left} left and {right} right corners, the board has {expected}; all must be finite pixels", view + 1)]
    Corners {
        /// Which pair, from 0.
        view: usize,
        /// Left corners given.
        left: usize,
        /// Right corners given.
        right: usize,
        /// What the board has.
        expected: usize,
    },
    /// OpenCV failed in a way that none of the above explains.
    #[error("OpenCV failed during calibration")]
    OpenCv(#[from] opencv::Error),
}
