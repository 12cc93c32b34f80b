//! Bytes to grey levels.

use opencv::core::{self as cvcore, CV_8U, CV_8UC3, CV_16U, CV_16UC3, Mat};
use opencv::prelude::*;
use opencv::{imgcodecs, imgproc};

use super::container::{PictureKind, Trouble, check};
use super::grey::{Grey, Samples};
use super::pnm::{self, Pnm};

/// Decodes a picture of a known kind.
pub(super) fn decode(kind: PictureKind, bytes: &[u8]) -> Result<Grey, Trouble> {
    check(kind, bytes)?;
    let grey = if kind == PictureKind::Pnm { from_pnm(pnm::decode(bytes)?) } else { from_file(bytes) };
    grey.map_err(|error| Trouble::Damaged(error.message))?
}

/// What OpenCV decodes; EXIF orientation ignored.
fn from_file(bytes: &[u8]) -> opencv::Result<Result<Grey, Trouble>> {
    let decoded = imgcodecs::imdecode(&Mat::from_slice(bytes)?, imgcodecs::IMREAD_UNCHANGED)?;
    let code = match (decoded.depth(), decoded.channels()) {
        _ if decoded.empty() => return Ok(Err(Trouble::Damaged("its pixels are damaged".into()))),
        (CV_8U | CV_16U, 1) => return to_grey(&decoded, None).map(Ok),
        (CV_8U | CV_16U, 3) => imgproc::COLOR_BGR2GRAY,
        (CV_8U | CV_16U, 4) => imgproc::COLOR_BGRA2GRAY,
        (depth, channels) => {
            return Ok(Err(Trouble::Unsupported(format!("with {channels} channels of OpenCV's type {depth}"))));
        }
    };
    if decoded.channels() == 4 && !is_opaque(&decoded)? {
        return Ok(Err(Trouble::Unsupported("with transparent pixels, whose grey nobody knows".into())));
    }
    let mut grey = Mat::default();
    imgproc::cvt_color_def(&decoded, &mut grey, code)?;
    to_grey(&grey, None).map(Ok)
}

fn from_pnm(pnm: Pnm) -> opencv::Result<Result<Grey, Trouble>> {
    let Pnm { width_px, height_px, channels, white, samples } = pnm;
    let white = Some(white);
    if channels == 1 {
        let samples = if white <= Some(255) {
            Samples::Eight(samples.into_iter().map(|sample| sample as u8).collect())
        } else {
            Samples::Sixteen(samples)
        };
        return Ok(Ok(Grey { width_px, height_px, samples, white }));
    }
    let colour = Mat::from_slice(&samples)?;
    let colour = colour.reshape(3, height_px as i32)?;
    let mut grey = Mat::default();
    if white == Some(255) {
        let mut eight = Mat::default();
        colour.convert_to(&mut eight, CV_8UC3, 1.0, 0.0)?;
        imgproc::cvt_color_def(&eight, &mut grey, imgproc::COLOR_RGB2GRAY)?;
    } else {
        debug_assert_eq!(colour.typ(), CV_16UC3);
        imgproc::cvt_color_def(&colour, &mut grey, imgproc::COLOR_RGB2GRAY)?;
    }
    to_grey(&grey, white).map(Ok)
}

fn to_grey(mat: &Mat, white: Option<u16>) -> opencv::Result<Grey> {
    let samples = if mat.depth() == CV_8U {
        Samples::Eight(mat.data_bytes()?.to_vec())
    } else {
        Samples::Sixteen(mat.data_typed::<u16>()?.to_vec())
    };
    Ok(Grey { width_px: mat.cols() as u32, height_px: mat.rows() as u32, samples, white })
}

/// Every pixel of a picture with an alpha channel is opaque.
fn is_opaque(mat: &Mat) -> opencv::Result<bool> {
    let mut alpha = Mat::default();
    cvcore::extract_channel(mat, &mut alpha, 3)?;
    Ok(if mat.depth() == CV_8U {
        alpha.data_bytes()?.iter().all(|alpha| *alpha == u8::MAX)
    } else {
        alpha.data_typed::<u16>()?.iter().all(|alpha| *alpha == u16::MAX)
    })
}
