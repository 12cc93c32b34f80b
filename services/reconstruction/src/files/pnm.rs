//! PBM, PGM and PPM, text and binary (netpbm's P1 to P6).

use super::container::{Header, Trouble};

/// A decoded PNM.
#[derive(Debug, PartialEq)]
pub(super) struct Pnm {
    pub(super) width_px: u32,
    pub(super) height_px: u32,
    /// 1, or 3: red, green, blue.
    pub(super) channels: usize,
    /// The sample that stands for white.
    pub(super) white: u16,
    /// Row-major, channels together.
    pub(super) samples: Vec<u16>,
}

/// Decodes the one picture in `bytes`, which start with P1 to P6.
pub(super) fn decode(bytes: &[u8]) -> Result<Pnm, Trouble> {
    let kind = bytes.get(1).copied().unwrap_or_default();
    let mut text = Text { bytes, at: 2 };
    let (width_px, height_px) = (text.number()?, text.number()?);
    let is_bitmap = matches!(kind, b'1' | b'4');
    let white = if is_bitmap { 1 } else { text.number()? };
    let white = u16::try_from(white).ok().filter(|white| *white > 0);
    let white = white.ok_or_else(|| Trouble::Damaged("its largest sample must be 1 to 65535".into()))?;
    let channels = if matches!(kind, b'3' | b'6') { 3 } else { 1 };
    let bits = if white > 255 { 16 } else { 8 };
    Header { width_px, height_px, bits }.check(bytes.len(), if kind == b'4' { 8 } else { 1 })?;

    let (width, height) = (width_px as usize, height_px as usize);
    let count = width * height * channels;
    // One white space ends the header of binary samples.
    let data = bytes.get(text.at + 1..).unwrap_or_default();
    let (samples, rest): (Vec<u16>, &[u8]) = match kind {
        b'1' => (text.digits(count)?, &bytes[text.at..]),
        b'2' | b'3' => (text.numbers(count)?, &bytes[text.at..]),
        b'4' => {
            let stride = width.div_ceil(8);
            let (data, rest) = data.split_at_checked(stride * height).ok_or(Trouble::Truncated)?;
            let bit = |row: &[u8], x: usize| u16::from(row[x / 8] >> (7 - x % 8) & 1);
            (data.chunks_exact(stride).flat_map(|row| (0..width).map(move |x| bit(row, x))).collect(), rest)
        }
        _ if white > 255 => {
            let (data, rest) = data.split_at_checked(2 * count).ok_or(Trouble::Truncated)?;
            (data.chunks_exact(2).map(|two| u16::from_be_bytes([two[0], two[1]])).collect(), rest)
        }
        _ => {
            let (data, rest) = data.split_at_checked(count).ok_or(Trouble::Truncated)?;
            (data.iter().map(|byte| u16::from(*byte)).collect(), rest)
        }
    };
    if let Some(sample) = samples.iter().find(|sample| **sample > white) {
        return Err(Trouble::Damaged(format!("it has a sample of {sample}, above its largest, {white}")));
    }
    if let [b'P', b'1'..=b'6', ..] = rest.trim_ascii_start() {
        return Err(Trouble::Unsupported("of several pictures".into()));
    }
    // A bit that is set is black.
    let samples = if is_bitmap { samples.into_iter().map(|bit| 1 - bit).collect() } else { samples };
    Ok(Pnm { width_px, height_px, channels, white, samples })
}

/// Numbers in ASCII, white space and comments between them.
struct Text<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Text<'_> {
    fn skip_space(&mut self) {
        while let Some(byte) = self.bytes.get(self.at) {
            match byte {
                b'#' => {
                    let rest = &self.bytes[self.at..];
                    self.at += rest.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(rest.len());
                }
                _ if byte.is_ascii_whitespace() => self.at += 1,
                _ => break,
            }
        }
    }

    fn number(&mut self) -> Result<u32, Trouble> {
        self.skip_space();
        let rest = &self.bytes[self.at..];
        let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
        if digits == rest.len() {
            return Err(Trouble::Truncated);
        }
        self.at += digits;
        let text = std::str::from_utf8(&rest[..digits]).unwrap_or_default();
        text.parse().map_err(|_| Trouble::Damaged("its header is damaged".into()))
    }

    fn numbers(&mut self, count: usize) -> Result<Vec<u16>, Trouble> {
        let mut numbers = Vec::with_capacity(count);
        for _ in 0..count {
            self.skip_space();
            let rest = &self.bytes[self.at..];
            let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
            self.at += digits;
            let text = std::str::from_utf8(&rest[..digits]).unwrap_or_default();
            let problem =
                || if rest.is_empty() { Trouble::Truncated } else { Trouble::Damaged("a sample is no number".into()) };
            numbers.push(text.parse().map_err(|_| problem())?);
        }
        Ok(numbers)
    }

    /// Samples of one digit, which need nothing between them.
    fn digits(&mut self, count: usize) -> Result<Vec<u16>, Trouble> {
        let mut digits = Vec::with_capacity(count);
        for _ in 0..count {
            self.skip_space();
            match self.bytes.get(self.at) {
                Some(b'0') => digits.push(0),
                Some(b'1') => digits.push(1),
                Some(_) => return Err(Trouble::Damaged("a sample is neither 0 nor 1".into())),
                None => return Err(Trouble::Truncated),
            }
            self.at += 1;
        }
        Ok(digits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn check(bytes: &[u8], channels: usize, white: u16, expected: &[u16]) {
        let pnm = decode(bytes).unwrap();
        assert_eq!((pnm.channels, pnm.white, &pnm.samples[..]), (channels, white, expected));
        assert_eq!(pnm.width_px as usize * pnm.height_px as usize * channels, expected.len());
    }

    /// Examples in the manner of netpbm's own manual.
    #[test]
    fn all_six() {
        check(b"P1\n# bits\n3 2\n1 0 1\n010", 1, 1, &[0, 1, 0, 1, 0, 1]);
        check(b"P2 2 2 15\n0 5 10 15\n", 1, 15, &[0, 5, 10, 15]);
        check(b"P3 1 1 255 1 2 3", 3, 255, &[1, 2, 3]);
        check(b"P4 10 2\n\x80\x40\x00\x80", 1, 1, &[0, 1, 1, 1, 1, 1, 1, 1, 1, 0, 1, 1, 1, 1, 1, 1, 1, 1, 0, 1]);
        check(b"P5\n# a comment\n2 2\n255\nabcd", 1, 255, &[97, 98, 99, 100]);
        check(b"P5 2 1 4095\n\x0f\xff\x01\x00", 1, 4095, &[4095, 256]);
        check(b"P6 1 1 255\n\x01\x02\x03", 3, 255, &[1, 2, 3]);
    }

    #[test]
    fn damage_is_refused() {
        let refused: [&[u8]; 12] = [
            b"P5",
            b"P5 2 2",
            b"P5 2 2 255\nabc",
            b"P5 0 2 255\n",
            b"P5 2 2 0\nabcd",
            b"P5 2 2 65536\nabcdabcd",
            b"P5 99999999999 2 255\n",
            b"P5 60000 60000 255\nabcd",
            b"P5 2 1 100\n\x01\xff",
            b"P2 2 1 255 1 x",
            b"P1 3 1 1 0 2",
            b"P5 1 1 255\naP5 1 1 255\nb",
        ];
        for bytes in refused {
            assert!(decode(bytes).is_err(), "{}", bytes.escape_ascii());
        }
    }
}
