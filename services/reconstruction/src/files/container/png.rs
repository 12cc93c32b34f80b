//! PNG (ISO/IEC 15948): chunks with lengths and check sums, up to IEND.

use super::{Header, SIGNATURE_PNG, Trouble, u32_at};

/// The header of a whole PNG.
pub(super) fn check(bytes: &[u8]) -> Result<Header, Trouble> {
    let damaged = |why: &str| Err(Trouble::Damaged(why.to_owned()));
    let mut header = None;
    let mut has_pixels = false;
    let mut at = SIGNATURE_PNG.len();
    loop {
        let length = u32_at(bytes, at).ok_or(Trouble::Truncated)? as usize;
        let body = bytes.get(at + 4..).and_then(|rest| rest.get(..length.checked_add(4)?)).ok_or(Trouble::Truncated)?;
        let sum = u32_at(bytes, at + 8 + length).ok_or(Trouble::Truncated)?;
        let (name, data) = body.split_at(4);
        if crc32(body) != sum {
            return Err(Trouble::Damaged(format!("the check sum of its {} chunk is wrong", name.escape_ascii())));
        }
        match name {
            b"IHDR" if header.is_none() && data.len() == 13 => {
                let (width_px, height_px) = (u32_at(data, 0).unwrap_or(0), u32_at(data, 4).unwrap_or(0));
                let read = Header { width_px, height_px, bits: u32::from(data[8]) };
                // Deflate makes at most 1032 bytes of one, and a byte holds at most 8 pixels.
                read.check(bytes.len(), 1032 * if data[8] < 8 { 8 / u64::from(data[8].max(1)) } else { 1 })?;
                header = Some(read);
            }
            b"IHDR" => return damaged("its header is damaged"),
            _ if header.is_none() => return damaged("it has no header"),
            b"acTL" => {
                let frames = u32_at(data, 0).unwrap_or(0);
                if frames > 1 {
                    return Err(Trouble::Unsupported(format!("of {frames} frames")));
                }
            }
            b"IDAT" => has_pixels = true,
            b"IEND" if has_pixels => return header.ok_or(Trouble::Truncated),
            b"IEND" => return damaged("it has no pixels"),
            _ => {}
        }
        at += 12 + length;
    }
}

/// The check sum of PNG and zlib, eight bits at a time by table.
fn crc32(bytes: &[u8]) -> u32 {
    const TABLE: [u32; 256] = {
        let mut table = [0; 256];
        let mut byte = 0;
        while byte < 256 {
            let mut sum = byte as u32;
            let mut bit = 0;
            while bit < 8 {
                sum = if sum & 1 == 1 { 0xedb8_8320 ^ (sum >> 1) } else { sum >> 1 };
                bit += 1;
            }
            table[byte] = sum;
            byte += 1;
        }
        table
    };
    !bytes.iter().fold(!0_u32, |sum, byte| TABLE[usize::from(sum as u8 ^ byte)] ^ (sum >> 8))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The check value of every CRC catalogue.
    #[test]
    fn crc32_of_the_digits() {
        assert_eq!(crc32(b"123456789"), 0xcbf4_3926);
    }
}
