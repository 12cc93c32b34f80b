//! Portable float map, grey: `Pf`, width and height, a scale whose sign tells the byte order, then rows from the **bottom** up.
//! Ours are little-endian with NaN for "no match".

use halcyon_model::Image;

use super::Disparity;

/// Why bytes are not a disparity map.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PfmError {
    /// Not `Pf` with width, height and scale.
    #[error("not a one-channel PFM: {0}")]
    Header(&'static str),
    /// No sides of a picture.
    #[error("a PFM of {width_px} x {height_px} px: each side must be 1 to {} px", Image::SIDE_PX_MAX)]
    Size {
        /// Width, pixels.
        width_px: u32,
        /// Height, pixels.
        height_px: u32,
    },
    /// More data than its size has room for: the size is wrong, and rows would be torn.
    #[error("a PFM of {width_px} x {height_px} px has {excess} bytes too many")]
    Excess {
        /// Width, pixels.
        width_px: u32,
        /// Height, pixels.
        height_px: u32,
        /// How many too many.
        excess: u64,
    },
    /// Too short for its size.
    #[error("a PFM of {width_px} x {height_px} px needs {needed} bytes of data and has {bytes}")]
    Truncated {
        /// Width, pixels.
        width_px: u32,
        /// Height, pixels.
        height_px: u32,
        /// What it needs.
        needed: u64,
        /// What it has.
        bytes: usize,
    },
}

/// The map as a PFM file.
#[must_use]
pub fn encode(disparity: &Disparity) -> Vec<u8> {
    let mut bytes = format!("Pf\n{} {}\n-1.0\n", disparity.width_px, disparity.height_px).into_bytes();
    bytes.reserve(disparity.values_px.len() * 4);
    for row in (0..disparity.height_px).rev() {
        for value in disparity.row(row) {
            bytes.extend_from_slice(&value.to_le_bytes());
        }
    }
    bytes
}

/// Reads a one-channel PFM of either byte order. Infinity, which other tools write for "no match", becomes NaN. Of the scale only
/// the sign counts: Middlebury's files put a display factor there and mean pixels none the less.
///
/// # Errors
/// [`PfmError`] where the header or the length is wrong.
pub fn decode(bytes: &[u8]) -> Result<Disparity, PfmError> {
    let mut at = 0;
    let mut word = || {
        let start = at + bytes[at..].iter().take_while(|byte| byte.is_ascii_whitespace()).count();
        let length = bytes[start..].iter().take_while(|byte| !byte.is_ascii_whitespace()).count().min(32);
        at = start + length;
        (std::str::from_utf8(&bytes[start..at]).unwrap_or_default(), at)
    };
    if word().0 != "Pf" {
        return Err(PfmError::Header("it does not start with Pf"));
    }
    let width_px: u32 = word().0.parse().map_err(|_| PfmError::Header("the width is no number"))?;
    let height_px: u32 = word().0.parse().map_err(|_| PfmError::Header("the height is no number"))?;
    let (scale, end) = word();
    let scale: f32 = scale.parse().map_err(|_| PfmError::Header("the scale is no number"))?;
    if scale == 0.0 || !scale.is_finite() {
        return Err(PfmError::Header("the scale is 0 or not finite"));
    }
    let needed = (u64::from(width_px) * u64::from(height_px)).saturating_mul(4);
    let sides = 1..=Image::SIDE_PX_MAX;
    if !sides.contains(&width_px) || !sides.contains(&height_px) {
        return Err(PfmError::Size { width_px, height_px });
    }
    // Exactly one white space ends the header; two where a tool ended the line with \r\n.
    let mut data = bytes.get(end + 1..).unwrap_or_default();
    if bytes[end..].starts_with(b"\r\n") && data.len() as u64 > needed {
        data = &data[1..];
    }
    if (data.len() as u64) < needed {
        return Err(PfmError::Truncated { width_px, height_px, needed, bytes: data.len() });
    }
    if data.len() as u64 > needed {
        return Err(PfmError::Excess { width_px, height_px, excess: data.len() as u64 - needed });
    }
    let mut disparity = Disparity::default();
    disparity.reset(width_px, height_px);
    let width = width_px as usize;
    for row in 0..height_px as usize {
        let from = &data[(height_px as usize - 1 - row) * width * 4..][..width * 4];
        for (value, four) in disparity.values_px[row * width..][..width].iter_mut().zip(from.chunks_exact(4)) {
            let four = [four[0], four[1], four[2], four[3]];
            let read = if scale < 0.0 { f32::from_le_bytes(four) } else { f32::from_be_bytes(four) };
            *value = if read.is_finite() { read } else { f32::NAN };
        }
    }
    Ok(disparity)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> Disparity {
        Disparity { width_px: 2, height_px: 2, values_px: vec![1.0, 2.0, f32::NAN, 4.5] }
    }

    /// Byte for byte as the format's description has it: the bottom row first, little-endian after a negative scale.
    #[test]
    fn rows_go_from_the_bottom_up() {
        let bytes = encode(&map());
        let data = bytes.strip_prefix(b"Pf\n2 2\n-1.0\n").unwrap();
        assert!(f32::from_le_bytes(data[0..4].try_into().unwrap()).is_nan());
        assert_eq!(data[4..8], [0, 0, 0x90, 0x40]);
        assert_eq!(data[8..12], [0, 0, 0x80, 0x3f]);
        assert_eq!(data.len(), 16);
    }

    #[test]
    fn both_byte_orders_are_read() {
        let read = decode(&encode(&map())).unwrap();
        assert_eq!(read.values_px[..2], [1.0, 2.0]);
        assert!(read.values_px[2].is_nan());
        let big = [b"Pf\n1 1\n1.0\n".as_slice(), &7.25_f32.to_be_bytes()].concat();
        assert_eq!(decode(&big).unwrap().values_px, [7.25]);
    }

    #[test]
    fn other_tools_are_read() {
        // Middlebury: a display factor for a scale, infinity for "unknown"; Windows: \r\n.
        let infinite = [b"Pf\n1 1\n-0.003922\n".as_slice(), &f32::INFINITY.to_le_bytes()].concat();
        assert!(decode(&infinite).unwrap().values_px[0].is_nan());
        let windows = [b"Pf\r\n1 1\r\n-1\r\n".as_slice(), &3.5_f32.to_le_bytes()].concat();
        assert_eq!(decode(&windows).unwrap().values_px, [3.5]);
        // A value whose first byte looks like a line feed is not mistaken for one.
        let feed = f32::from_le_bytes([b'\n', 0, 0, 0x40]);
        let value = [b"Pf\n1 1\n-1\r".as_slice(), &feed.to_le_bytes()].concat();
        assert_eq!(decode(&value).unwrap().values_px, [feed]);
    }

    #[test]
    fn damage_is_named() {
        assert!(matches!(decode(b""), Err(PfmError::Header(_))));
        assert!(matches!(decode(b"PF\n1 1\n-1\n"), Err(PfmError::Header(_))));
        assert!(matches!(decode(b"Pf\n2 2\n-1.0\nabc"), Err(PfmError::Truncated { needed: 16, bytes: 3, .. })));
        assert!(matches!(decode(b"Pf\n4294967295 4294967295\n-1.0\n"), Err(PfmError::Size { .. })));
        assert!(matches!(decode(b"Pf\n16384 16384\n-1.0\n"), Err(PfmError::Truncated { .. })));
        assert!(matches!(decode(b"Pf\n0 2\n-1.0\n"), Err(PfmError::Size { .. })));
        assert!(matches!(decode(b"Pf\n1 1\n-1.0\nabcde"), Err(PfmError::Excess { excess: 1, .. })));
        for header in ["-2 2\n-1", "2 2\n0", "2 2\nnan", "2 2\ninf", "2 2\n", "2", "1e9 1\n-1", "99999999999 1\n-1"] {
            assert!(matches!(decode(format!("Pf\n{header}\n").as_bytes()), Err(PfmError::Header(_))), "{header}");
        }
        // Cut anywhere, a file is refused.
        let whole = encode(&map());
        for cut in 0..whole.len() {
            assert!(decode(&whole[..cut]).is_err(), "{cut}");
        }
    }
}
