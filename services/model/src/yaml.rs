//! The subset of YAML that calibration programs write: top-level keys with matrices and lists of numbers.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Matrix3x4, Vector3};

use crate::rig_yaml::RigYamlError;
use crate::stereo::{CameraIntrinsics, Image};

/// How far from orthonormal a rotation may be: files with six digits pass, a transposed or scaled matrix doesn't.
const ROTATION_TOLERANCE: f64 = 1e-4;

/// What other programs call a rig's keys, ours first: OpenCV's own samples and tutorials, and what people make of them.
const NAMES: [&[&str]; 7] = [
    &["image_size", "imageSize", "ImageSize", "img_size"],
    &["M1", "cameraMatrix1", "camera_matrix_1", "camera_matrix1", "K1", "M_left"],
    &["D1", "distCoeffs1", "dist_coeffs_1", "dist_coeffs1", "distortion1", "D_left"],
    &["M2", "cameraMatrix2", "camera_matrix_2", "camera_matrix2", "K2", "M_right"],
    &["D2", "distCoeffs2", "dist_coeffs_2", "dist_coeffs2", "distortion2", "D_right"],
    &["R", "rotation", "rotation_matrix"],
    &["T", "translation", "translation_vector"],
];
/// A size may also be two keys.
const SIDES: [[&str; 2]; 2] = [["image_width", "image_height"], ["imageWidth", "imageHeight"]];

/// The names that a key goes by, in the order of preference.
fn names(key: &'static str) -> impl Iterator<Item = &'static str> {
    let own = NAMES.into_iter().find(|names| names[0] == key).unwrap_or_default();
    std::iter::once(key).chain(own.iter().copied().skip(1))
}

/// For a message about a key that is missing: what else was looked for.
pub(crate) fn also_looked_for(key: &'static str) -> String {
    let mut others: Vec<&str> = names(key).skip(1).collect();
    if key == "image_size" {
        others.push("image_width with image_height");
    }
    if others.is_empty() { String::new() } else { format!(", and so are {}", others.join(", ")) }
}

/// The top-level entries, not yet read.
pub(crate) struct Document<'a> {
    entries: BTreeMap<&'a str, Entry<'a>>,
}

/// One top-level key: the line it stands on, and the lines of its value without comments.
pub(crate) struct Entry<'a> {
    line: usize,
    lines: Vec<&'a str>,
}

impl<'a> Document<'a> {
    pub(crate) fn read(text: &'a str) -> Result<Self, RigYamlError> {
        let mut entries: BTreeMap<&str, Entry<'_>> = BTreeMap::new();
        let mut current: Option<&str> = None;
        for (index, raw) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let line = index + 1;
            let content = without_comment(raw);
            if content.trim().is_empty() || raw.starts_with('%') || raw.starts_with("---") || raw.trim_end() == "..." {
                continue;
            }
            if content.starts_with([' ', '\t', '-']) {
                let entry = current.and_then(|key| entries.get_mut(key));
                entry
                    .ok_or(RigYamlError::Syntax { line, expected: "a key at the start of the line" })?
                    .lines
                    .push(content.trim());
                continue;
            }
            let (key, value) = content.split_once(':').ok_or(RigYamlError::Syntax { line, expected: "\"key: value\"" })?;
            let key = key.trim().trim_matches('"');
            if entries.insert(key, Entry { line, lines: vec![value.trim()] }).is_some() {
                return Err(RigYamlError::Duplicate { line, key: key.chars().take(80).collect() });
            }
            current = Some(key);
        }
        Ok(Self { entries })
    }

    pub(crate) fn optional(&self, key: &'static str) -> Result<Option<List>, RigYamlError> {
        names(key).find_map(|name| self.entries.get(name)).map(|entry| entry.list(key)).transpose()
    }

    pub(crate) fn required(&self, key: &'static str) -> Result<List, RigYamlError> {
        self.optional(key)?.ok_or(RigYamlError::Missing { key })
    }

    /// A value that is one word.
    pub(crate) fn word(&self, key: &'static str) -> Result<&'a str, RigYamlError> {
        let entry = self.entries.get(key).ok_or(RigYamlError::Missing { key })?;
        Ok(entry.lines[0].trim_matches(['"', '\'']))
    }

    /// Says what is wrong with a key's value.
    pub(crate) fn defect(&self, key: &'static str, why: &'static str) -> RigYamlError {
        self.entries.get(key).map_or(RigYamlError::Missing { key }, |entry| RigYamlError::Value { line: entry.line, key, why })
    }

    pub(crate) fn image_size(&self) -> Result<(u32, u32), RigYamlError> {
        let Some(size) = self.optional("image_size")? else { return self.sides() };
        let [width, height] = size.values[..] else { return Err(size.shape("2 numbers: width, height")) };
        let sides = side_px(width).zip(side_px(height));
        sides.ok_or_else(|| size.value("must be two whole numbers of 1 to 16384 pixels"))
    }

    /// A size as two keys.
    fn sides(&self) -> Result<(u32, u32), RigYamlError> {
        for [width, height] in SIDES {
            if let (Some(width), Some(height)) = (self.optional(width)?, self.optional(height)?) {
                let side =
                    |list: &List| list.side_px().ok_or_else(|| list.value("must be a whole number of 1 to 16384 pixels"));
                return Ok((side(&width)?, side(&height)?));
            }
        }
        Err(RigYamlError::Missing { key: "image_size" })
    }

    pub(crate) fn camera(
        &self,
        matrix_key: &'static str,
        distortion_key: &'static str,
    ) -> Result<CameraIntrinsics, RigYamlError> {
        let list = self.required(matrix_key)?;
        let m = list.matrix3()?;
        if (m.row(2) - nalgebra::RowVector3::new(0.0, 0.0, 1.0)).norm() > 0.0 || m[(0, 1)] != 0.0 || m[(1, 0)] != 0.0 {
            return Err(list.value("must be [fx 0 cx; 0 fy cy; 0 0 1]"));
        }
        if m[(0, 0)] <= 0.0 || m[(1, 1)] <= 0.0 {
            return Err(list.value("must have positive focal lengths"));
        }
        let coefficients = self.required(distortion_key)?;
        let mut distortion = [0.0; 5];
        let count = coefficients.values.len();
        if !(matches!(count, 4 | 5 | 8 | 12 | 14) && (coefficients.rows == 1 || coefficients.cols == 1)) {
            return Err(coefficients.shape("a row or a column of 4 or 5 numbers"));
        }
        if coefficients.values.iter().skip(5).any(|&value| value != 0.0) {
            return Err(coefficients.value("uses more than k1 k2 p1 p2 k3, which this does not model"));
        }
        distortion.iter_mut().zip(&coefficients.values).for_each(|(to, from)| *to = *from);
        Ok(CameraIntrinsics { fx_px: m[(0, 0)], fy_px: m[(1, 1)], cx_px: m[(0, 2)], cy_px: m[(1, 2)], distortion })
    }
}

impl Entry<'_> {
    /// Reads `!!opencv-matrix`, ROS's matrices, `[ a, b ]` and `- a` forms alike; a bare number is a list of one.
    fn list(&self, key: &'static str) -> Result<List, RigYamlError> {
        let line = self.line;
        // OpenCV says so; in ROS's files rows and cols just follow.
        let is_matrix = self.lines[0].starts_with("!!opencv-matrix")
            || (self.lines[0].is_empty() && self.lines.iter().any(|line| line.starts_with("rows:")));
        let (mut rows, mut cols, mut data) = (None, None, String::new());
        // A block sequence has one "- value" a line: commas are made of the dashes, and brackets go round it.
        let (mut is_block, mut is_first) = (false, true);
        for text in &self.lines[usize::from(is_matrix)..] {
            let mut text = *text;
            if is_matrix {
                if let Some(count) = text.strip_prefix("rows:") {
                    rows = count.trim().parse::<usize>().ok();
                    continue;
                } else if let Some(count) = text.strip_prefix("cols:") {
                    cols = count.trim().parse::<usize>().ok();
                    continue;
                } else if text.starts_with("dt:") {
                    continue;
                }
                text = text.strip_prefix("data:").unwrap_or(text).trim();
            }
            if let Some(item) = text.strip_prefix("- ") {
                is_block = true;
                data.push_str(if is_first { "[" } else { "," });
                is_first = false;
                text = item;
            }
            data.push_str(text);
            data.push(' ');
        }
        if is_block {
            data.push(']');
        }
        let data = data.trim();
        let bare = (!is_matrix && self.lines.len() == 1 && !data.is_empty() && !data.contains(['[', ']', ','])).then_some(data);
        let inner = data.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')).or(bare);
        let inner = inner.ok_or(RigYamlError::Syntax { line, expected: "a list of numbers in [ ]" })?;
        let values = inner
            .split(',')
            .map(str::trim)
            .filter(|text| !text.is_empty())
            .map(|text| {
                let value = text.parse::<f64>().ok().filter(|value| value.is_finite());
                value.ok_or_else(|| RigYamlError::Number { line, key, text: text.chars().take(40).collect() })
            })
            .collect::<Result<Vec<_>, _>>()?;
        let (rows, cols) = if is_matrix {
            let expected = "rows and cols that fit the data of a matrix";
            let (rows, cols) = rows.zip(cols).ok_or(RigYamlError::Syntax { line, expected })?;
            if rows.checked_mul(cols) != Some(values.len()) {
                return Err(RigYamlError::Syntax { line, expected });
            }
            (rows, cols)
        } else {
            (1, values.len())
        };
        Ok(List { key, line, rows, cols, values })
    }
}

/// Numbers with their shape, row-major.
pub(crate) struct List {
    key: &'static str,
    line: usize,
    pub(crate) rows: usize,
    pub(crate) cols: usize,
    pub(crate) values: Vec<f64>,
}

impl List {
    pub(crate) fn shape(&self, expected: &'static str) -> RigYamlError {
        RigYamlError::Shape { line: self.line, key: self.key, rows: self.rows, cols: self.cols, expected }
    }

    pub(crate) fn value(&self, why: &'static str) -> RigYamlError {
        RigYamlError::Value { line: self.line, key: self.key, why }
    }

    /// One number that is a picture's width or height.
    pub(crate) fn side_px(&self) -> Option<u32> {
        if let [value] = self.values[..] { side_px(value) } else { None }
    }

    pub(crate) fn matrix3x4(&self) -> Result<Matrix3x4<f64>, RigYamlError> {
        if (self.rows, self.cols) == (3, 4) { Ok(Matrix3x4::from_row_slice(&self.values)) } else { Err(self.shape("3 x 4")) }
    }

    pub(crate) fn matrix3(&self) -> Result<Matrix3<f64>, RigYamlError> {
        if (self.rows, self.cols) == (3, 3) { Ok(Matrix3::from_row_slice(&self.values)) } else { Err(self.shape("3 x 3")) }
    }

    pub(crate) fn vector3(&self) -> Result<Vector3<f64>, RigYamlError> {
        if self.values.len() == 3 { Ok(Vector3::from_column_slice(&self.values)) } else { Err(self.shape("3 x 1")) }
    }

    pub(crate) fn rotation(&self) -> Result<Matrix3<f64>, RigYamlError> {
        let m = self.matrix3()?;
        let off = (m * m.transpose() - Matrix3::identity()).abs().max();
        if off > ROTATION_TOLERANCE || m.determinant() <= 0.0 {
            return Err(self.value("must be a rotation: orthonormal, determinant 1"));
        }
        Ok(m)
    }
}

/// A picture's width or height, where a number can be one.
fn side_px(value: f64) -> Option<u32> {
    let fits = value.fract() == 0.0 && (1.0..=f64::from(Image::SIDE_PX_MAX)).contains(&value);
    fits.then_some(value as u32)
}

/// Cuts a `#` comment off, quotes respected.
fn without_comment(line: &str) -> &str {
    let mut quoted = false;
    for (at, c) in line.char_indices() {
        match c {
            '"' => quoted = !quoted,
            '#' if !quoted => return line[..at].trim_end(),
            _ => {}
        }
    }
    line.trim_end()
}
