//! Pictures from and to files, by OpenCV.

use std::path::Path;

use halcyon_model::{Bytes, Image};
use opencv::core::{Mat, Vector};
use opencv::imgcodecs;
use opencv::prelude::*;

/// Files larger than this are no pictures of a survey.
const FILE_BYTES_MAX: u64 = 1 << 29;

/// Reads a PNG, JPEG or whatever else OpenCV reads, as 8-bit grey; what is wrong comes back as text.
pub(crate) fn read(path: &Path) -> Result<Image, String> {
    let bytes = std::fs::metadata(path).map_err(|error| error.to_string())?.len();
    if bytes > FILE_BYTES_MAX {
        return Err(format!("{bytes} bytes are too many for a picture"));
    }
    // Read here and decoded there: OpenCV says nothing about why a file can't be read.
    let file = Vector::<u8>::from_slice(&std::fs::read(path).map_err(|error| error.to_string())?);
    if file.is_empty() {
        return Err("the file is empty".into());
    }
    let mat = imgcodecs::imdecode(&file, imgcodecs::IMREAD_GRAYSCALE).map_err(|error| error.message)?;
    if mat.empty() {
        return Err("not a picture that OpenCV can read".into());
    }
    let pixels = mat.data_bytes().map_err(|error| error.message)?;
    let sides = (u32::try_from(mat.cols()), u32::try_from(mat.rows()));
    let (Ok(width_px), Ok(height_px)) = sides else { return Err("the picture has no size".into()) };
    Image::new(width_px, height_px, Bytes::copy_from_slice(pixels)).map_err(|error| error.to_string())
}

/// Writes a grey PNG.
pub(crate) fn write_png(path: &Path, image: &Image) -> Result<(), String> {
    let rows = i32::try_from(image.height_px()).map_err(|error| error.to_string())?;
    let mat = Mat::from_slice(image.pixels()).map_err(|error| error.message)?;
    let mat = mat.reshape(1, rows).map_err(|error| error.message)?;
    let mut file = Vector::<u8>::new();
    imgcodecs::imencode(".png", &mat, &mut file, &Vector::new()).map_err(|error| error.message)?;
    std::fs::write(path, file.as_slice()).map_err(|error| error.to_string())
}
