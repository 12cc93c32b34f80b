//! Rectification from matches alone, without a calibration (Hartley 1999; thesis 4.5).

use nalgebra::{Matrix3, Vector2, Vector3};

use super::PointPair;

/// The epipole must stay this many picture diagonals away from the centre: nearer, rows of the rectified picture would run
/// together in a point inside it or stretch beyond use.
const EPIPOLE_DIAGONALS_MIN: f64 = 0.75;

/// Why two pictures cannot be rectified.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum HartleyError {
    /// The cameras look at each other, or along the line between them.
    #[error("an epipole lies in or near the picture: cameras that stand one behind the other cannot be rectified")]
    EpipoleInside,
    /// Nothing to align columns by.
    #[error("{0} matches are too few to rectify by: at least 8 are needed")]
    TooFew(usize),
    /// Numbers gone wrong.
    #[error("the fundamental matrix is not one")]
    Fundamental,
}

/// What turns each picture so that matches share a row: rectified pixel ~ H pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homographies {
    /// Of the left picture.
    pub left: Matrix3<f64>,
    /// Of the right picture.
    pub right: Matrix3<f64>,
}

impl Homographies {
    /// Where a match goes.
    #[must_use]
    pub fn apply(&self, pair: &PointPair) -> PointPair {
        PointPair { left: apply(&self.left, &pair.left), right: apply(&self.right, &pair.right) }
    }
}

/// A pixel moved by a homography.
fn apply(homography: &Matrix3<f64>, point: &Vector2<f64>) -> Vector2<f64> {
    let moved = homography * point.push(1.0);
    moved.xy() / moved.z
}

/// The pair of homographies that sends the epipoles to infinity along the rows, bends the right picture as little as possible
/// about its centre, and the left one so that disparities are as small as they can be. `pairs` are matches that keep to
/// `fundamental` (pixels).
///
/// # Errors
/// [`HartleyError`] with few matches, or epipoles in the pictures.
pub fn rectify_from_matches(
    fundamental: &Matrix3<f64>,
    pairs: &[PointPair],
    (width_px, height_px): (u32, u32),
) -> Result<Homographies, HartleyError> {
    if pairs.len() < 8 {
        return Err(HartleyError::TooFew(pairs.len()));
    }
    let svd = fundamental.try_svd(true, true, f64::EPSILON, 100).ok_or(HartleyError::Fundamental)?;
    let (u, v_t) = (svd.u.ok_or(HartleyError::Fundamental)?, svd.v_t.ok_or(HartleyError::Fundamental)?);
    let epipole_right: Vector3<f64> = u.column(2).into_owned();
    let epipole_left: Vector3<f64> = v_t.row(2).transpose();
    if !epipole_right.iter().chain(fundamental.iter()).all(|number| number.is_finite()) {
        return Err(HartleyError::Fundamental);
    }
    let centre = Vector2::new(f64::from(width_px) - 1.0, f64::from(height_px) - 1.0) / 2.0;
    let distance_min_px = EPIPOLE_DIAGONALS_MIN * f64::from(width_px).hypot(f64::from(height_px));
    for epipole in [epipole_left, epipole_right] {
        if (epipole.xy() - centre * epipole.z).norm() < distance_min_px * epipole.z.abs() {
            return Err(HartleyError::EpipoleInside);
        }
    }
    let right = to_infinity(&epipole_right, &centre);
    // With F = [e']× M any M, and with it H' M, sends left points to the rows of their matches: its second and third row are
    // fixed, the first, which says where along the row, is free.
    let rows = right * (-epipole_right.cross_matrix() * fundamental);
    let left = align_columns(&rows, &right, pairs, &centre).ok_or(HartleyError::Fundamental)?;
    Ok(Homographies { left, right })
}

/// Sends an epipole to infinity along x, leaving the neighbourhood of `centre` as it is but for a turn (Hartley 1999, 5).
fn to_infinity(epipole: &Vector3<f64>, centre: &Vector2<f64>) -> Matrix3<f64> {
    let to_centre = translation(-centre);
    let seen = to_centre * epipole;
    // The smaller turn of the two that put it on the x axis: the picture must not be stood on its head.
    let flip = if seen.x < 0.0 { -1.0 } else { 1.0 };
    let (sin, cos) = (flip * seen.y).atan2(flip * seen.x).sin_cos();
    let turn = Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0);
    let turned = turn * seen;
    let bend = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, -turned.z / turned.x, 0.0, 1.0);
    translation(*centre) * bend * turn * to_centre
}

fn translation(by: Vector2<f64>) -> Matrix3<f64> {
    Matrix3::new(1.0, 0.0, by.x, 0.0, 1.0, by.y, 0.0, 0.0, 1.0)
}

/// The left homography: rows two and three of `rows`, and the first row that leaves the least squared disparity.
fn align_columns(
    rows: &Matrix3<f64>,
    right: &Matrix3<f64>,
    pairs: &[PointPair],
    centre: &Vector2<f64>,
) -> Option<Matrix3<f64>> {
    // About the centre and in hundreds of pixels, so that the normal equations are well conditioned.
    let local = |point: &Vector2<f64>| ((point - centre) / 100.0).push(1.0);
    let (mut normal, mut wanted) = (Matrix3::zeros(), Vector3::zeros());
    for pair in pairs {
        let depth = rows.row(2).transpose().dot(&pair.left.push(1.0));
        let unit = local(&pair.left) / depth;
        normal += unit * unit.transpose();
        wanted += unit * apply(right, &pair.right).x;
    }
    let first = normal.cholesky()?.solve(&wanted);
    // Back from local coordinates.
    let (a, b) = (first.x / 100.0, first.y / 100.0);
    let first = Vector3::new(a, b, first.z - a * centre.x - b * centre.y);
    let mut left = *rows;
    left.set_row(0, &first.transpose());
    // A homography's sign is free; positive in the middle reads better.
    if left.row(2).transpose().dot(&centre.push(1.0)) < 0.0 {
        left = -left;
    }
    left /= left.row(2).transpose().dot(&centre.push(1.0));
    left.iter().all(|number| number.is_finite()).then_some(left)
}
