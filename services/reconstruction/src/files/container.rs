//! Is this file a whole picture? Walks the container without decoding it.

/// Formats that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureKind {
    /// JFIF or EXIF.
    Jpeg,
    /// Portable network graphics.
    Png,
    /// Binary PGM or PPM.
    Pnm,
}

/// What the header says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) width_px: u32,
    pub(super) height_px: u32,
    pub(super) bits: u32,
}

const PNG_SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";

impl PictureKind {
    /// By the first bytes: names lie.
    pub(super) fn of(bytes: &[u8]) -> Option<Self> {
        if bytes.starts_with(&[0xff, 0xd8, 0xff]) {
            Some(Self::Jpeg)
        } else if bytes.starts_with(PNG_SIGNATURE) {
            Some(Self::Png)
        } else if bytes.starts_with(b"P5") || bytes.starts_with(b"P6") {
            Some(Self::Pnm)
        } else {
            None
        }
    }

    /// For messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Jpeg => "JPEG",
            Self::Png => "PNG",
            Self::Pnm => "PGM or PPM",
        }
    }
}

/// The header of a whole file; otherwise what is wrong with it.
pub(super) fn check(kind: PictureKind, bytes: &[u8]) -> Result<Header, String> {
    match kind {
        PictureKind::Jpeg => check_jpeg(bytes),
        PictureKind::Png => check_png(bytes),
        PictureKind::Pnm => check_pnm(bytes),
    }
}

fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    bytes.get(at..at + 2).map(|two| u16::from_be_bytes([two[0], two[1]]))
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4).map(|four| u32::from_be_bytes([four[0], four[1], four[2], four[3]]))
}

/// JPEG (ITU-T T.81, annex B): segments with lengths up to the first scan, then entropy-coded data in which 0xff is always
/// followed by 0x00 or a restart marker, up to the end-of-image marker.
fn check_jpeg(bytes: &[u8]) -> Result<Header, String> {
    let truncated = || "it is truncated".to_owned();
    let mut header = None;
    let mut at = 2;
    loop {
        if *bytes.get(at).ok_or_else(truncated)? != 0xff {
            return Err(format!("byte {at} should start a segment"));
        }
        let marker = *bytes.get(at + 1).ok_or_else(truncated)?;
        match marker {
            0xff => at += 1,
            0x01 | 0xd0..=0xd7 => at += 2,
            0xd9 => return header.ok_or_else(|| "it has no frame".to_owned()),
            _ => {
                let length = usize::from(u16_at(bytes, at + 2).ok_or_else(truncated)?);
                let is_frame = matches!(marker, 0xc0..=0xcf) && !matches!(marker, 0xc4 | 0xc8 | 0xcc);
                if is_frame {
                    let bits = u32::from(*bytes.get(at + 4).ok_or_else(truncated)?);
                    let height_px = u32::from(u16_at(bytes, at + 5).ok_or_else(truncated)?);
                    let width_px = u32::from(u16_at(bytes, at + 7).ok_or_else(truncated)?);
                    header = Some(Header { width_px, height_px, bits });
                }
                at += 2 + length.max(2);
                if marker == 0xda {
                    at = end_of_scan(bytes, at).ok_or_else(truncated)?;
                }
            }
        }
    }
}

/// Where the entropy-coded data that start at `at` end: the next marker that is no stuffing and no restart.
fn end_of_scan(bytes: &[u8], mut at: usize) -> Option<usize> {
    loop {
        let next = bytes.get(at..)?.iter().position(|byte| *byte == 0xff)? + at;
        match *bytes.get(next + 1)? {
            0x00 | 0xd0..=0xd7 => at = next + 2,
            0xff => at = next + 1,
            _ => return Some(next),
        }
    }
}

/// PNG (ISO/IEC 15948): chunks with lengths and check sums, up to IEND.
fn check_png(bytes: &[u8]) -> Result<Header, String> {
    let truncated = || "it is truncated".to_owned();
    let mut header = None;
    let mut at = PNG_SIGNATURE.len();
    loop {
        let length = u32_at(bytes, at).ok_or_else(truncated)? as usize;
        let body = bytes.get(at + 4..).and_then(|rest| rest.get(..length.checked_add(4)?)).ok_or_else(truncated)?;
        let sum = u32_at(bytes, at + 8 + length).ok_or_else(truncated)?;
        let (name, data) = body.split_at(4);
        if crc32(body) != sum {
            return Err(format!("the check sum of its {} chunk is wrong", String::from_utf8_lossy(name)));
        }
        match name {
            b"IHDR" if data.len() == 13 => {
                let (width_px, height_px) = (u32_at(data, 0).unwrap_or(0), u32_at(data, 4).unwrap_or(0));
                header = Some(Header { width_px, height_px, bits: u32::from(data[8]) });
            }
            b"IEND" => return header.ok_or_else(|| "it has no header".to_owned()),
            _ => {}
        }
        at += 12 + length;
    }
}

/// The check sum of PNG and zlib, bit by bit: files are few.
fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| if sum & 1 == 1 { 0xedb8_8320 ^ (sum >> 1) } else { sum >> 1 })
    })
}

/// Binary PNM: width, height and largest value in ASCII, one white space, then all samples.
fn check_pnm(bytes: &[u8]) -> Result<Header, String> {
    let channels = if bytes.starts_with(b"P6") { 3 } else { 1 };
    let mut at = 2;
    let mut numbers = [0_u32; 3];
    for number in &mut numbers {
        loop {
            match bytes.get(at) {
                Some(b'#') => at += bytes[at..].iter().position(|byte| *byte == b'\n').unwrap_or(bytes.len() - at),
                Some(byte) if byte.is_ascii_whitespace() => at += 1,
                _ => break,
            }
        }
        let digits = bytes[at..].iter().take_while(|byte| byte.is_ascii_digit()).count();
        let text = std::str::from_utf8(&bytes[at..at + digits]).unwrap_or_default();
        *number = text.parse().map_err(|_| "its header is incomplete".to_owned())?;
        at += digits;
    }
    let [width_px, height_px, largest] = numbers;
    let bits = if largest > 255 { 16 } else { 8 };
    let samples = u64::from(width_px) * u64::from(height_px) * channels * u64::from(bits / 8);
    if ((bytes.len() - at).saturating_sub(1) as u64) < samples {
        return Err("it is truncated".into());
    }
    Ok(Header { width_px, height_px, bits })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of every CRC catalogue.
    #[test]
    fn crc32_of_the_digits() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn pnm_headers() {
        let whole = check_pnm(b"P5\n# a comment\n2 2\n255\nabcd");
        assert_eq!(whole, Ok(Header { width_px: 2, height_px: 2, bits: 8 }));
        assert!(check_pnm(b"P5 2 2 255\nabc").is_err());
        assert!(check_pnm(b"P5 2").is_err());
        assert!(check_pnm(b"P5 99999999999 2 255\n").is_err());
    }
}
