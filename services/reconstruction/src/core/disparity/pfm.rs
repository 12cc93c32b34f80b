//! Portable float map, grey: `Pf`, width and height, a scale whose sign tells the byte order, then rows from the **bottom** up.
//! Ours are little-endian with NaN for "no match".

use super::Disparity;

/// Why bytes are not a disparity map.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PfmError {
    /// Not `Pf` with width, height and scale.
    #[error("not a one-channel PFM: {0}")]
    Header(&'static str),
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

/// Reads a one-channel PFM of either byte order. Infinity, which other tools write for "no match", becomes NaN.
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
    // Exactly one white space ends the header.
    let data = bytes.get(end + 1..).unwrap_or_default();
    if (data.len() as u64) < needed {
        return Err(PfmError::Truncated { width_px, height_px, needed, bytes: data.len() });
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
    fn damage_is_named() {
        assert!(matches!(decode(b""), Err(PfmError::Header(_))));
        assert!(matches!(decode(b"PF\n1 1\n-1\n"), Err(PfmError::Header(_))));
        assert!(matches!(decode(b"Pf\n2 2\n-1.0\nabc"), Err(PfmError::Truncated { needed: 16, bytes: 3, .. })));
        assert!(matches!(decode(b"Pf\n4294967295 4294967295\n-1.0\n"), Err(PfmError::Truncated { .. })));
        assert!(matches!(decode(b"Pf\n2 2\n0\n"), Err(PfmError::Header(_))));
    }
}
